//! Every light path draws the same picture.

use crate::common::gpu::{Gpu, bytes, floats, on_gpu};
use crate::common::stage::{add, beam, exact, gbuffer, lambert, open, own, plane, point, rectangle, spot, sun};
use crate::common::{one_of, some_in_turn, some_of, tries_all};
use afterlight::frame::Picture;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    Brdf, Camera, Falloff, HdrFormat, Light, LightKind, LightPath, Material, Projection, Resolve, Scene, Settings,
    ShadowFilter, ShadowSettings, Tonemap,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// Odd, so that no tile divides it.
const SIZE: (u32, u32) = (139, 77);

/// Paths that sum in the same order as `loop`, with a light out of reach adding exactly zero.
const SAME_ORDER: [LightPath; 2] = [LightPath::Clustered, LightPath::Compute];
/// Paths that add by blending into 32-bit floats.
const BLENDED: [LightPath; 2] = [LightPath::PerLight, LightPath::Volumes];

/// Draws by each path that adds lights in the loop's order.
fn assert_same_bits(gpu: &Gpu, (scene, settings): (&Scene, &Settings), expected: &Picture, what: &str) {
    for path in SAME_ORDER {
        let found = draw(gpu, scene, settings, path);
        let different = floats(expected).iter().zip(floats(&found)).filter(|(a, b)| a != b).count();
        let off = largest_difference(expected, &found);
        assert_eq!(different, 0, "{} {what} {path}: values that differ, by {off:.2e} at most", scene.name);
    }
}

/// Returns the place of a light of a crowd: a low-discrepancy sequence over a box (Roberts 2018, R3).
fn scattered(index: u32) -> DVec3 {
    let share = |step: f64| (0.5 + f64::from(index) * step).fract() * 2.0 - 1.0;
    DVec3::new(share(0.819_172_513), share(0.671_043_607), share(0.549_700_478))
}

/// Lights of every kind and fall-off, with and without a range, some behind the camera and some around it, before surfaces of
/// several models at several distances. The sun casts a shadow.
fn crowd(count: u32) -> Scene {
    let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.2, quadratic: 3.0 };
    let mut lights = vec![sun(DVec3::new(0.4, 0.6, 1.0), 0.4)];
    for index in 0..count {
        let place = scattered(index) * DVec3::new(1.6, 1.0, 1.5) + DVec3::Z;
        let range = 0.3 + 0.2 * f64::from(index % 5);
        let mut light = match index % 5 {
            0 => point(place, 0.2, Some(range), Falloff::InverseSquare),
            1 => point(place, 0.5, Some(range), Falloff::Quadratic),
            2 => point(place, 0.2, Some(range), polynomial),
            3 => ranged(spot(place, 0.6, 15.0, 20.0 + f64::from(index % 7) * 20.0), range * 2.0),
            _ => point(place, 0.02, None, Falloff::InverseSquare),
        };
        light.color = Vec3::new(0.4 + 0.1 * (index % 7) as f32, 0.7, 1.0 - 0.1 * (index % 9) as f32);
        lights.push(light);
    }
    let mut scene = plane(lambert(0.7), lights);
    scene.name = format!("crowd of {count}");
    let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    let shiny = |brdf| Material { brdf, specular: Vec3::splat(0.3), shininess: 20.0, ..Material::default() };
    add(&mut scene, shapes::cuboid([0.4; 3]), shiny(Brdf::Phong), at(-0.6, -0.5, 0.3));
    add(&mut scene, shapes::sphere(0.25, 16), shiny(Brdf::CookTorrance), at(0.0, -0.5, 0.5));
    add(&mut scene, shapes::sphere(0.3, 16), shiny(Brdf::BlinnPhong), at(0.7, 0.4, 0.6));
    // Far behind an edge, so that a tile holds near and far; and the sky beyond.
    scene.objects[0].transform = at(0.0, 0.0, -0.5);
    add(&mut scene, rectangle([-0.1, -9.0], [0.1, 9.0], -7.0), lambert(0.9), DAffine3::IDENTITY);
    scene.camera =
        Camera { projection: Projection::perspective(75.0), rotation: DQuat::from_rotation_y(0.2), ..scene.camera };
    scene.environment.ambient = Vec3::splat(0.02);
    scene.environment.background = Vec3::new(0.05, 0.1, 0.3);
    scene
}

fn ranged(light: Light, range: f64) -> Light {
    let LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, falloff, .. } = light.kind
    else {
        return light;
    };
    let range = Some(range);
    Light {
        kind: LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff },
        ..light
    }
}

/// Beams with and without a range among other lights, or with nothing but a sun; some cast shadows.
fn beams(others: u32) -> Scene {
    let mut scene = crowd(others);
    scene.name = format!("beams among {others}");
    for index in 0..10 {
        let place = scattered(500 + index) * DVec3::new(1.4, 0.9, 0.8) + DVec3::Z * 1.2;
        let to = scattered(700 + index) * DVec3::new(0.8, 0.8, 0.3) - place;
        let range = (index % 3 > 0).then_some(0.8 + 0.3 * f64::from(index));
        let own = beam(place, to, 0.5, [0.08 + 0.04 * f64::from(index % 4), 0.25 * f64::from(index % 5)], range);
        let color = Vec3::new(0.3 + 0.1 * (index % 6) as f32, 0.6, 1.0 - 0.1 * (index % 8) as f32);
        scene.lights.push(Light { color, casts_shadow: index % 4 == 1, ..own });
    }
    scene
}

fn draw(gpu: &Gpu, scene: &Scene, settings: &Settings, light_path: LightPath) -> Picture {
    gpu.draw(scene, &Settings { light_path, ..settings.clone() })
}

/// The largest difference of two linear pictures, over the brightest value of either at that pixel.
fn largest_difference(a: &Picture, b: &Picture) -> f64 {
    let relative = |(a, b): (&[f32], &[f32])| {
        let most = a.iter().chain(b).take(3).fold(0f32, |most, v| most.max(*v));
        let off = a.iter().zip(b).take(3).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        f64::from(off / most.max(1e-6))
    };
    floats(a).chunks_exact(4).zip(floats(b).chunks_exact(4)).map(relative).fold(0.0, f64::max)
}

fn scenes() -> Vec<Scene> {
    let mut glowing = crowd(12);
    glowing.name = "glowing crowd".into();
    glowing.materials[1].emissive = Vec3::new(0.3, 0.1, 0.0);
    let mut parallel = crowd(40);
    parallel.name = "crowd in parallel rays".into();
    parallel.camera.projection = Projection::orthographic(1.8);
    vec![
        crowd(0),
        crowd(40),
        parallel,
        crowd(150),
        beams(0),
        beams(12),
        glowing,
        open("builtin:field?objects=60&lights=24&range=12"),
        open("builtin:hall"),
    ]
}

#[test]
fn paths_that_sum_in_the_same_order_give_the_same_bits() {
    on_gpu(|gpu| {
        for (turn, scene) in some_of(scenes(), 3).enumerate() {
            let layouts: &[&str] = if scene.lights.len() > 100 { &["lean"] } else { &["float32", "lean"] };
            for layout in one_of(layouts, turn) {
                let settings = Settings { gbuffer: gbuffer(layout), ..exact(SIZE.0, SIZE.1) };
                let expected = draw(gpu, &scene, &settings, LightPath::Loop);
                assert_same_bits(gpu, (&scene, &settings), &expected, layout);
            }
        }
    });
}

/// Pixels whose samples agree are shaded once, and the samples of others one by one, in the same places.
#[test]
fn several_samples_a_pixel_give_the_same_bits() {
    on_gpu(|gpu| {
        for (turn, scene) in some_of(scenes(), 3).enumerate() {
            for &(layout, resolve) in one_of(&[("float32", Resolve::ToneMapped), ("lean", Resolve::Linear)], turn) {
                let settings = Settings { msaa: 4, resolve, gbuffer: gbuffer(layout), ..exact(SIZE.0, SIZE.1) };
                let expected = draw(gpu, &scene, &settings, LightPath::Loop);
                let single = draw(gpu, &scene, &Settings { msaa: 1, ..settings.clone() }, LightPath::Loop);
                assert!(expected != single, "{}: no samples differ", scene.name);
                assert_same_bits(gpu, (&scene, &settings), &expected, layout);
            }
        }
    });
}

#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn paths_that_blend_differ_by_rounding() {
    on_gpu(|gpu| {
        for (turn, scene) in scenes().into_iter().enumerate() {
            let settings = exact(SIZE.0, SIZE.1);
            let expected = draw(gpu, &scene, &settings, LightPath::Loop);
            for &path in one_of(&BLENDED, turn) {
                let off = largest_difference(&expected, &draw(gpu, &scene, &settings, path));
                // Sums of n positive terms in two orders: each rounds n times by half a unit of 2^-23, and each term is cut off once.
                let bound = 2.0 * (scene.lights.len() + 2) as f64 * 2f64.powi(-24);
                eprintln!("{} {path}: {off:.2e} at most, bound {bound:.2e}", scene.name);
                assert!(off <= bound, "{} {path}: {off} exceeds {bound}", scene.name);
            }
        }
    });
}

/// Lamps of a crowd cast shadows as well, and the filter turns its disc from pixel to pixel: alike on every path.
#[test]
fn shadows_of_every_kind_of_light_give_the_same_bits() {
    on_gpu(|gpu| {
        let mut scene = crowd(10);
        scene.lights.iter_mut().for_each(|light| light.casts_shadow = true);
        for filter in [ShadowFilter::Box3, ShadowFilter::Poisson] {
            let shadows = ShadowSettings { filter, size: 256, ..ShadowSettings::default() };
            let settings = Settings { shadows, ..exact(SIZE.0, SIZE.1) };
            let expected = draw(gpu, &scene, &settings, LightPath::Loop);
            assert_same_bits(gpu, (&scene, &settings), &expected, &filter.to_string());
            for path in BLENDED {
                let off = largest_difference(&expected, &draw(gpu, &scene, &settings, path));
                assert!(off <= 2.0 * 13.0 * 2f64.powi(-24), "{filter} {path}: {off}");
            }
        }
    });
}

/// A narrow field of view: a tile's planes lie close together.
#[test]
fn a_telescope_sees_what_the_loop_sees() {
    on_gpu(|gpu| {
        let scene = crowd(40);
        for (fov_y_degrees, turn) in [(1.0, 0.1), (0.05, -0.15)] {
            let rotation = DQuat::from_rotation_y(turn) * DQuat::from_rotation_x(-0.12) * DQuat::from_rotation_z(0.7);
            let narrow = Scene {
                camera: Camera { projection: Projection::perspective(fov_y_degrees), rotation, ..scene.camera },
                ..scene.clone()
            };
            let settings = exact(SIZE.0, SIZE.1);
            let expected = draw(gpu, &narrow, &settings, LightPath::Loop);
            assert_same_bits(gpu, (&narrow, &settings), &expected, &format!("{fov_y_degrees} degrees"));
        }
    });
}

/// More lights than TILED bins in one batch (16,384), each of a small reach.
#[test]
fn twenty_thousand_lights_work() {
    on_gpu(|gpu| {
        let lamp = |index: u32| {
            let place = scattered(index) * DVec3::new(1.2, 1.0, 0.2) + DVec3::Z * 0.1;
            point(place, 0.001, Some(0.08), Falloff::InverseSquare)
        };
        let scene = plane(lambert(0.8), (0..20_000).map(lamp).collect());
        let settings = exact(27, 19);
        let expected = draw(gpu, &scene, &settings, LightPath::Loop);
        let lit = floats(&expected).chunks_exact(4).filter(|pixel| pixel[0] > 0.0).count();
        assert!(lit > 27 * 19 * 3 / 4, "{lit} pixels are lit");
        assert_same_bits(gpu, (&scene, &settings), &expected, "20,000 lights");
        if tries_all() {
            // The batches are listed anew for each round of samples.
            let settings = Settings { msaa: 4, ..settings.clone() };
            let expected = draw(gpu, &scene, &settings, LightPath::Loop);
            assert_same_bits(gpu, (&scene, &settings), &expected, "20,000 lights, 4 samples a pixel");
        }
        for path in BLENDED {
            let off = largest_difference(&expected, &draw(gpu, &scene, &settings, path));
            // No pixel has more than a few hundred of them in reach.
            assert!(off <= 2.0 * 500.0 * 2f64.powi(-24), "{path}: {off}");
        }
    });
}

/// The certified cut-off drops light, and nobody sees it.
#[test]
fn what_the_cut_off_drops_is_less_than_half_a_step() {
    on_gpu(|gpu| {
        // Lamps along a road that leads away: at EV 0 the bound reaches some tens of metres.
        let lamp = |index: u32| {
            let place = DVec3::new(f64::from(index % 2) * 4.0 - 2.0, 0.5, 1.0 - 20.0 * f64::from(index));
            point(place, 0.3, None, Falloff::InverseSquare)
        };
        let mut scene = plane(lambert(0.9), (0..24).map(lamp).collect());
        let road = rectangle([-6.0, -0.5], [6.0, 600.0], 0.0);
        add(&mut scene, road, Material { roughness: 0.7, ..Material::default() }, DAffine3::from_rotation_x(-1.571));
        scene.objects.remove(0);
        scene.camera = Camera { position: DVec3::new(0.0, 1.5, 3.0), near: 0.1, ..scene.camera };
        for (_, tonemap) in Tonemap::NAMES {
            let base = Settings { exposure: Some(0.0), tonemap: *tonemap, ..own(&scene, SIZE.0, SIZE.1) };
            let whole = draw(gpu, &scene, &base, LightPath::Loop);
            assert!(bytes(&whole).iter().any(|&code| code > 40), "{tonemap}: black");
            let cut = Settings { light_cutoff: true, ..base.clone() };
            let mut renderer = gpu.renderer(&scene, &Settings { light_path: LightPath::Clustered, ..cut });
            let drawn = renderer.render(&scene.camera).and_then(|()| renderer.read_back());
            let cut = drawn.unwrap_or_else(|error| panic!("{error}"));
            let off = bytes(&whole).iter().zip(bytes(&cut)).map(|(a, b)| a.abs_diff(*b)).max();
            let differ = bytes(&whole).iter().zip(bytes(&cut)).filter(|(a, b)| a != b).count();
            eprintln!("{tonemap}: {differ} values differ, by {off:?} at most");
            // Half a step moves a value by one code where it was near the edge between two.
            assert!(off <= Some(1), "{tonemap}: {off:?}");
        }
        // Something was dropped: with linear light the difference shows.
        let linear = Settings { samples: 2, exposure: Some(0.0), ..own(&scene, SIZE.0, SIZE.1) };
        let pictures = [false, true]
            .map(|light_cutoff| draw(gpu, &scene, &Settings { light_cutoff, ..linear.clone() }, LightPath::Clustered));
        assert!(pictures[0] != pictures[1], "nothing was dropped");
    });
}

#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn a_depth_pre_pass_changes_nothing_but_ties_within_a_mesh() {
    on_gpu(|gpu| {
        let scenes =
            [crowd(5), open("builtin:hall"), open("builtin:field?objects=60&lights=4"), open("builtin:spheres")];
        for (turn, scene) in scenes.into_iter().enumerate() {
            for &light_path in one_of(&[LightPath::Loop, LightPath::Compute], turn) {
                let pictures = [Some(false), Some(true)].map(|depth_prepass| {
                    let settings = exact(SIZE.0, SIZE.1);
                    draw(gpu, &scene, &Settings { depth_prepass, ..settings }, light_path)
                });
                let different = floats(&pictures[0]).iter().zip(floats(&pictures[1])).filter(|(a, b)| a != b).count();
                eprintln!("{} {light_path}: {different} values differ", scene.name);
                // With a pre-pass, the last of coplanar triangles of one mesh wins instead of the first.
                assert!(different <= 9, "{} {light_path}: {different} values differ", scene.name);
            }
        }
    });
}

/// The hardware averages samples of 8 bits, and TILED before it has rounded any.
#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn tone_mapped_samples_agree_to_a_code() {
    on_gpu(|gpu| {
        for (turn, scene) in some_of(scenes(), 4).enumerate() {
            for &resolve in one_of(&[Resolve::ToneMapped, Resolve::Linear], turn) {
                let hdr_format = HdrFormat::Rgba32f;
                let settings = Settings { msaa: 4, resolve, hdr_format, ..own(&scene, SIZE.0, SIZE.1) };
                let expected = draw(gpu, &scene, &settings, LightPath::Loop);
                let found = draw(gpu, &scene, &settings, LightPath::Compute);
                let off = bytes(&expected).iter().zip(bytes(&found)).map(|(a, b)| a.abs_diff(*b));
                let (most, differ) = (off.clone().max(), off.clone().filter(|&off| off > 0).count());
                eprintln!("{} {resolve}: {differ} of {} values differ, by {most:?} at most", scene.name, off.len());
                assert!(most <= Some(1) && differ <= off.len() / 8, "{} {resolve}: {differ} by {most:?}", scene.name);
            }
        }
    });
}

#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn tone_mapped_pictures_agree_to_a_code() {
    on_gpu(|gpu| {
        let paths: Vec<LightPath> = SAME_ORDER.into_iter().chain(BLENDED).collect();
        for (turn, scene) in scenes().into_iter().enumerate() {
            // Paths that blend have an HDR target of 32-bit floats in any case.
            let settings = Settings { hdr_format: HdrFormat::Rgba32f, ..own(&scene, SIZE.0, SIZE.1) };
            let expected = draw(gpu, &scene, &settings, LightPath::Loop);
            for path in some_in_turn(&paths, turn, 5) {
                let found = draw(gpu, &scene, &settings, path);
                let off: Vec<u8> = bytes(&expected).iter().zip(bytes(&found)).map(|(a, b)| a.abs_diff(*b)).collect();
                let (most, differ) =
                    (off.iter().max().copied().unwrap_or(0), off.iter().filter(|&&off| off > 0).count());
                eprintln!("{} {path}: {differ} of {} values differ, by {most} at most", scene.name, off.len());
                // Compute encodes sRGB by itself; the hardware's encoding of attachments may be as much as a code off (lavapipe's is, in 6% of all
                // values). Blended sums on the edge between two codes may round either way.
                let most_differ = match path {
                    LightPath::Clustered => 0,
                    LightPath::Compute => off.len() / 8,
                    _ => off.len() / 200,
                };
                assert!(most <= 1 && differ <= most_differ, "{} {path}: {differ} differ by up to {most}", scene.name);
            }
        }
    });
}
