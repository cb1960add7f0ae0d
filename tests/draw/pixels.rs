//! Pixels whose values are known without a renderer: formulas in f64, and codes worked out by hand.

use std::f64::consts::PI;

use crate::common::gpu::{code, nits, on_gpu, places};
use crate::common::stage::{
    EDGE, EYE, add, beam, directional, display, exact, gbuffer, lambert, open, plane, point, rectangle, seen, spot,
    srgb_code, stage, white_radiance,
};
use crate::common::truth::radiance;
use afterlight::frame::Picture;
use afterlight::scene::{
    Brdf, Camera, ColorSpace, Environment, Falloff, Light, LightPath, Material, Projection, Scene, Settings, Texture,
    View,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// Single precision through a handful of operations, each good to 1.2e-7 and up to 3 units in the last place in a shader.
const SINGLE: f64 = 1e-5;

/// Single precision through a specular lobe: an error of 1e-6 in a direction becomes 2e-6 / alpha in GGX (alpha >= 0.09 here), and a shader's exp2,
/// log2 and pow may err by 3 + 2 |x| units each, which a power of 60 multiplies by 60.
const SINGLE_LOBE: f64 = 1e-4;

/// Holds every pixel of a picture of the plane z = 0 against the light model in f64. `bound` is relative to the pixel and, where light
/// fades to nothing, to a thousandth of the brightest pixel.
fn assert_is_the_formula(picture: &Picture, scene: &Scene, bound: f64) {
    let truth = |x, y| radiance(&scene.materials[0], &scene.lights, seen(picture.size, x, y), DVec3::Z, EYE);
    let brightest = places(picture).map(|(x, y)| truth(x, y).max_element()).fold(0.0, f64::max);
    assert!(brightest > 0.0, "nothing is lit");
    for (x, y) in places(picture) {
        let (found, expected) = (nits(picture, x, y), truth(x, y));
        let allowed = bound * expected.max(DVec3::splat(1e-3 * brightest));
        let wrong = (found - expected).abs().cmpgt(allowed).any() || !found.is_finite();
        assert!(!wrong, "({x}, {y}): {found} instead of {expected}, of at most {brightest}");
    }
}

fn assert_plane_is_the_formula(material: Material, lights: Vec<Light>, bound: f64) {
    on_gpu(|gpu| {
        let scene = plane(material, lights);
        assert_is_the_formula(&gpu.draw(&scene, &exact(EDGE, EDGE)), &scene, bound);
    });
}

#[test]
fn a_lambert_plane_reflects_illuminance_times_cosine_times_albedo_over_pi() {
    on_gpu(|gpu| {
        for (lux, degrees, albedo) in
            [(PI, 0.0f64, 1.0f32), (1000.0, 60.0, 0.5), (120_000.0, 85.0, 0.18), (0.01, 30.0, 0.9)]
        {
            let towards = DVec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos());
            let picture = gpu.draw(&plane(lambert(albedo), vec![directional(towards, lux as f32)]), &exact(9, 5));
            let expected = white_radiance(f64::from(lux as f32), degrees) * f64::from(albedo);
            for (x, y) in places(&picture) {
                let found = nits(&picture, x, y);
                let error = (found / expected - 1.0).abs().max_element();
                assert!(error < SINGLE, "{lux} lux at {degrees} degrees: {found} instead of {expected}");
            }
        }
    });
}

#[test]
fn a_lambert_plane_has_the_srgb_code_of_its_radiance() {
    on_gpu(|gpu| {
        // No expected value lies within a tenth of a code of the limit between two codes, since drivers may round by tables.
        for (degrees, albedo) in [(0.0, 1.0f32), (0.0, 0.48), (60.0, 0.5), (75.0, 0.25), (0.0, 0.0), (45.0, 0.025)] {
            let spec = format!("builtin:quad?albedo={albedo}&angle={degrees}");
            let scene = open(&spec);
            // Albedo is not rounded to 8 bits twice.
            let settings = afterlight::scene::Settings { gbuffer: gbuffer("float32"), ..display(5, 3) };
            let expected = srgb_code(white_radiance(PI, degrees) * f64::from(albedo));
            let picture = gpu.draw(&scene, &settings);
            for (x, y) in places(&picture) {
                assert_eq!(code(&picture, x, y), [expected; 3], "{spec} at ({x}, {y})");
            }
        }
    });
}

#[test]
fn light_from_behind_adds_nothing() {
    on_gpu(|gpu| {
        let lights = vec![
            directional(DVec3::new(0.2, 0.0, -1.0), 1e4),
            point(DVec3::new(0.0, 0.0, -1.0), 1e4, None, Falloff::InverseSquare),
        ];
        for brdf in [Brdf::Lambert, Brdf::CookTorrance, Brdf::Phong, Brdf::BlinnPhong] {
            let material = Material { brdf, specular: Vec3::ONE, shininess: 3.0, ..lambert(1.0) };
            let picture = gpu.draw(&plane(material, lights.clone()), &exact(7, 7));
            assert!(places(&picture).all(|(x, y)| nits(&picture, x, y) == DVec3::ZERO), "{brdf}");
        }
    });
}

#[test]
fn ambient_light_is_reflected_by_albedo_and_occlusion_alone() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(0.5), Vec::new());
        scene.environment = Environment { ambient: Vec3::new(3.0, 2.0, 1.0), background: Vec3::ZERO, ground: None };
        let found = nits(&gpu.draw(&scene, &exact(3, 3)), 1, 1);
        assert!((found / DVec3::new(1.5, 1.0, 0.5) - 1.0).abs().max_element() < SINGLE, "{found}");
    });
}

/// The plane and the camera before it, turned about +X: by -90 degrees to a floor, by 90 to a ceiling. And the plane's normal.
fn turned(material: Material, degrees: f64) -> (Scene, DQuat) {
    let rotation = DQuat::from_rotation_x(degrees.to_radians());
    let mut scene = plane(material, Vec::new());
    scene.objects[0].transform = glam::DAffine3::from_quat(rotation);
    scene.camera.position = rotation * EYE;
    scene.camera.rotation = rotation;
    (scene, rotation)
}

#[test]
fn sky_lights_the_floor_ground_the_ceiling_and_both_the_wall() {
    let (sky, ground) = (DVec3::new(3.0, 2.0, 1.0), DVec3::new(0.25, 0.5, 0.125));
    on_gpu(|gpu| {
        let draw = |degrees: f64, environment: Environment| {
            let (mut scene, rotation) = turned(lambert(0.5), degrees);
            scene.environment = environment;
            (nits(&gpu.draw(&scene, &exact(3, 3)), 1, 1), rotation * DVec3::Z)
        };
        let halves = |sky: DVec3, ground: Option<DVec3>| Environment {
            ambient: sky.as_vec3(),
            ground: ground.map(|ground| ground.as_vec3()),
            background: Vec3::ZERO,
        };
        for (degrees, expected) in [(-90.0, sky * 0.5), (0.0, (sky + ground) * 0.25), (90.0, ground * 0.5)] {
            let (found, _) = draw(degrees, halves(sky, Some(ground)));
            assert!((found / expected - 1.0).abs().max_element() < SINGLE, "{degrees}: {found} instead of {expected}");
        }
        for degrees in [-72.0, -31.0, 14.0, 55.0] {
            let (found, normal) = draw(degrees, halves(sky, Some(ground)));
            let expected = 0.5 * ground.lerp(sky, 0.5 + 0.5 * normal.y);
            assert!((found / expected - 1.0).abs().max_element() < SINGLE, "{degrees}: {found} instead of {expected}");
        }
        // Even light is even light, however it is said; and nothing comes from a black ground.
        assert_eq!(draw(33.0, halves(sky, Some(sky))).0, draw(33.0, halves(sky, None)).0);
        assert_eq!(draw(33.0, halves(sky, None)).0, draw(-33.0, halves(sky, None)).0);
        let below = draw(90.0, halves(sky, Some(DVec3::ZERO))).0;
        assert!(below.min_element() >= 0.0 && below.max_element() < SINGLE, "{below}");
        let from_below = draw(90.0, halves(DVec3::ZERO, Some(ground))).0;
        assert!((from_below / (ground * 0.5) - 1.0).abs().max_element() < SINGLE, "{from_below}");
    });
}

#[test]
fn a_metal_shows_what_its_mirrored_ray_goes_to() {
    on_gpu(|gpu| {
        let metal =
            Material { metallic: 1.0, roughness: 0.3, base_color: Vec3::new(0.9, 0.5, 0.1), ..Default::default() };
        for degrees in [-90.0, -40.0, 0.0, 65.0] {
            let (mut scene, rotation) = turned(metal.clone(), degrees);
            scene.environment.ambient = Vec3::ONE;
            let even = gpu.draw(&scene, &exact(EDGE, EDGE));
            scene.environment.ground = Some(Vec3::ZERO);
            let sky = gpu.draw(&scene, &exact(EDGE, EDGE));
            for (x, y) in places(&even) {
                let view = (EYE - seen(even.size, x, y)).normalize();
                let mirrored = rotation * DVec3::new(-view.x, -view.y, view.z);
                let share = nits(&sky, x, y) / nits(&even, x, y);
                let expected = 0.5 + 0.5 * mirrored.y;
                assert!(
                    (share - expected).abs().max_element() < SINGLE,
                    "{degrees}, ({x}, {y}): {share} for {expected}"
                );
            }
        }
    });
}

#[test]
fn a_point_light_falls_off_with_the_square_of_the_distance() {
    let at = DVec3::new(0.25, 0.5, 0.75);
    assert_plane_is_the_formula(lambert(0.8), vec![point(at, 50.0, None, Falloff::InverseSquare)], SINGLE);
    // The light on the axis, by hand: 8 cd two metres away are 2 lux.
    on_gpu(|gpu| {
        let above = point(DVec3::new(0.0, 0.0, 2.0), 8.0, None, Falloff::InverseSquare);
        let found = nits(&gpu.draw(&plane(lambert(1.0), vec![above]), &exact(EDGE, EDGE)), EDGE / 2, EDGE / 2);
        assert!((found.x / (2.0 / PI) - 1.0).abs() < SINGLE, "{found}");
    });
}

#[test]
fn a_range_windows_the_light_and_ends_it() {
    let at = DVec3::new(0.0, 0.0, 0.5);
    assert_plane_is_the_formula(lambert(0.8), vec![point(at, 50.0, Some(0.9), Falloff::InverseSquare)], SINGLE_LOBE);
    on_gpu(|gpu| {
        let light = point(at, 50.0, Some(0.9), Falloff::InverseSquare);
        let picture = gpu.draw(&plane(lambert(0.8), vec![light]), &exact(EDGE, EDGE));
        let beyond = |&(x, y): &(u32, u32)| seen(picture.size, x, y).distance(at) > 0.9;
        assert!(places(&picture).filter(beyond).count() > 100);
        assert!(places(&picture).filter(beyond).all(|(x, y)| nits(&picture, x, y) == DVec3::ZERO));
    });
}

#[test]
fn nearer_than_a_centimetre_a_point_light_grows_no_brighter() {
    let at = DVec3::new(0.0, 0.0, 0.0025);
    assert_plane_is_the_formula(lambert(1.0), vec![point(at, 1.0, None, Falloff::InverseSquare)], 1e-3);
}

#[test]
fn the_other_fall_offs_follow_their_formulas() {
    let at = DVec3::new(-0.3, 0.1, 0.5);
    let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.7, quadratic: 1.8 };
    // 1 - (d/r)^2 cancels near the range: an error of 1e-6 in d is 2e-6 of the brightest.
    assert_plane_is_the_formula(lambert(0.8), vec![point(at, 50.0, Some(1.0), Falloff::Quadratic)], SINGLE_LOBE * 20.0);
    assert_plane_is_the_formula(lambert(0.8), vec![point(at, 50.0, None, polynomial)], SINGLE);
    // All three at once: the shader then reads each light's own.
    let mixed = vec![
        point(at, 50.0, Some(4.0), Falloff::Quadratic),
        point(-at + DVec3::Z, 9.0, None, polynomial),
        point(EYE, 20.0, None, Falloff::InverseSquare),
    ];
    assert_plane_is_the_formula(lambert(0.8), mixed, SINGLE);
}

#[test]
fn a_polynomial_light_ends_where_it_has_fallen_to_its_cutoff() {
    let falloff = Falloff::Polynomial { constant: 1.0, linear: 0.7, quadratic: 1.8 };
    let (at, candela, lux) = (DVec3::new(0.0, 0.0, 0.5), 50.0f32, 18.0);
    let range = falloff.polynomial_radius(f64::from(candela), lux);
    on_gpu(|gpu| {
        let scene = plane(lambert(1.0), vec![point(at, candela, range, falloff)]);
        let picture = gpu.draw(&scene, &exact(EDGE, EDGE));
        // The plane reflects the cosine over pi of the brightness that arrives.
        let arrived = |x, y| {
            let offset = at - seen(picture.size, x, y);
            (nits(&picture, x, y).x * PI * offset.length() / offset.z, offset.length())
        };
        let lit: Vec<f64> = places(&picture).map(|(x, y)| arrived(x, y).0).filter(|lux| *lux > 0.0).collect();
        let dimmest = lit.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(dimmest >= lux * (1.0 - SINGLE) && dimmest < lux * 1.05, "{dimmest}");
        let range = range.expect("a polynomial has a radius");
        for (x, y) in places(&picture) {
            let (found, distance) = arrived(x, y);
            assert_eq!(found > 0.0, distance < range, "({x}, {y}): {found} lux at {distance} of {range} m");
        }
        assert!(lit.len() > 100 && lit.len() < (EDGE * EDGE) as usize - 100, "{}", lit.len());
    });
}

#[test]
fn a_spot_is_full_inside_its_inner_cone_and_dark_outside_the_outer() {
    let light = spot(DVec3::new(0.0, 0.0, 1.0), 30.0, 15.0, 35.0);
    // cos of the angle, good to 1e-7, over the 0.15 between the cones; squared near 0 it counts against the brightest pixel.
    assert_plane_is_the_formula(lambert(1.0), vec![light.clone()], SINGLE_LOBE * 10.0);
    on_gpu(|gpu| {
        let picture = gpu.draw(&plane(lambert(1.0), vec![light]), &exact(EDGE, EDGE));
        for (x, y) in places(&picture) {
            let radius = seen(picture.size, x, y).length();
            let (found, inside) = (nits(&picture, x, y).x, 30.0 / PI * (1.0 + radius * radius).powi(-2));
            if radius < 14.9f64.to_radians().tan() {
                // cos / (1 + r^2) for the angle and the distance.
                let expected = inside * (1.0 + radius * radius).sqrt();
                assert!((found / expected - 1.0).abs() < SINGLE, "({x}, {y}): {found} for {expected}");
            } else if radius > 35.1f64.to_radians().tan() {
                assert_eq!(found, 0.0, "({x}, {y})");
            }
        }
    });
}

#[test]
fn a_spot_without_a_soft_edge_is_full_or_dark() {
    on_gpu(|gpu| {
        let angle = 24.0;
        let picture = gpu
            .draw(&plane(lambert(1.0), vec![spot(DVec3::new(0.0, 0.0, 1.0), 30.0, angle, angle)]), &exact(EDGE, EDGE));
        // The guard of KHR_lights_punctual leaves an edge of 0.001 in the cosine: 0.14 degrees here.
        let limit = |degrees: f64| (angle + degrees).to_radians().tan();
        let mut counts = [0; 2];
        for (x, y) in places(&picture) {
            let radius = seen(picture.size, x, y).length();
            let found = nits(&picture, x, y).x;
            if radius < limit(-0.15) {
                let expected = 30.0 / PI * (1.0 + radius * radius).powf(-1.5);
                assert!((found / expected - 1.0).abs() < SINGLE, "({x}, {y}): {found} for {expected}");
                counts[0] += 1;
            } else if radius > limit(0.01) {
                assert_eq!(found, 0.0, "({x}, {y})");
                counts[1] += 1;
            }
        }
        assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
    });
}

#[test]
fn a_beam_is_as_bright_from_near_and_far_and_ends_at_its_edge_its_disc_and_its_range() {
    let (at, to) = (DVec3::new(0.9, 0.2, 1.2), DVec3::new(-0.6, 0.0, -0.8));
    for range in [None, Some(1.6)] {
        let slanting = beam(at, to, 40.0, [0.5, 0.5], range);
        assert_plane_is_the_formula(lambert(0.8), vec![slanting.clone()], SINGLE_LOBE * 10.0);
        // Beside a lamp: the shader then looks at each light's own.
        let lamp = point(at, 2.0, Some(3.0), Falloff::Quadratic);
        assert_plane_is_the_formula(lambert(0.8), vec![lamp, slanting], SINGLE_LOBE * 10.0);
    }
    on_gpu(|gpu| {
        let drawn = |height: f64, to: DVec3, range| {
            let light = beam(DVec3::Z * height, to, 8.0, [0.5, 0.5], range);
            gpu.draw(&plane(lambert(1.0), vec![light]), &exact(EDGE, EDGE))
        };
        // By hand: 8 lux in the middle, whatever the distance; of the outer 0.25 m the square of the share that is left; nothing at 0.5 m.
        for height in [0.01, 1.0, 30.0] {
            let picture = drawn(height, DVec3::NEG_Z, None);
            for (x, y) in places(&picture) {
                let (found, radius) = (nits(&picture, x, y).x, seen(picture.size, x, y).length());
                let expected = 8.0 / PI * ((0.5 - radius) / 0.25).clamp(0.0, 1.0).powi(2);
                assert!(
                    (found - expected).abs() <= 1e-5 * 8.0 / PI,
                    "({x}, {y}) from {height}: {found} for {expected}"
                );
                assert!(radius < 0.5 || found == 0.0, "({x}, {y}) from {height}: {found}");
            }
        }
        // Half of the range away: (1 - 1/16)^2 of it.
        let found = nits(&drawn(1.0, DVec3::NEG_Z, Some(2.0)), EDGE / 2, EDGE / 2).x;
        assert!((found / (8.0 / PI * (15.0 / 16.0f64).powi(2)) - 1.0).abs() < SINGLE, "{found}");
        // Beyond it, and behind the disc, nothing.
        for dark in [drawn(2.5, DVec3::NEG_Z, Some(2.0)), drawn(-0.5, DVec3::NEG_Z, None)] {
            assert!(places(&dark).all(|(x, y)| nits(&dark, x, y) == DVec3::ZERO));
        }
    });
}

/// Lights around the mirror direction of the middle of the picture, and one from the side.
fn lobes() -> Vec<Light> {
    vec![
        directional(DVec3::new(0.1, 0.2, 1.0), 1000.0),
        point(DVec3::new(-0.5, 0.5, 1.5), 700.0, None, Falloff::InverseSquare),
        spot(DVec3::new(1.0, 0.0, 1.0), 300.0, 10.0, 60.0),
        directional(DVec3::new(-1.0, 0.0, 0.1), 500.0),
    ]
}

#[test]
fn cook_torrance_follows_its_formula() {
    for (metallic, roughness) in [(0.0, 1.0), (0.0, 0.5), (1.0, 0.3), (0.4, 0.6), (1.0, 1.0)] {
        let base_color = Vec3::new(0.9, 0.5, 0.1);
        let material = Material { metallic, roughness, base_color, ..Material::default() };
        assert_plane_is_the_formula(material, lobes(), SINGLE_LOBE);
    }
}

#[test]
fn phong_and_blinn_phong_follow_their_formulas() {
    for brdf in [Brdf::Phong, Brdf::BlinnPhong] {
        for shininess in [1.0, 8.0, 60.0] {
            let (base_color, specular) = (Vec3::new(0.1, 0.5, 0.3), Vec3::new(0.7, 0.2, 0.4));
            let material = Material { brdf, base_color, specular, shininess, ..Material::default() };
            assert_plane_is_the_formula(material, lobes(), SINGLE_LOBE);
        }
    }
}

#[test]
fn a_shininess_texture_scales_the_power_of_the_phong_models_and_of_no_other() {
    // Right and left of the seam 51 and 204 of 255 in green; the other channels do not count.
    let texels = (0..64u8).flat_map(|x| [x, if x < 32 { 204 } else { 51 }, 255 - x, x]).collect();
    let texture = Texture {
        name: "halves".into(),
        size: [64, 1],
        color_space: ColorSpace::Linear,
        sampler: Default::default(),
        texels,
    };
    for brdf in [Brdf::Phong, Brdf::BlinnPhong, Brdf::CookTorrance] {
        let shiny = Material { brdf, specular: Vec3::splat(0.5), shininess: 100.0, ..lambert(0.3) };
        let mut scene = plane(Material { shininess_texture: Some(0), ..shiny.clone() }, lobes());
        scene.textures = vec![texture.clone()];
        on_gpu(|gpu| {
            for light_path in [LightPath::Loop, LightPath::Forward] {
                let picture = gpu.draw(&scene, &Settings { light_path, ..exact(EDGE, EDGE) });
                let mut differing = 0;
                for (x, y) in places(&picture) {
                    let place = seen(picture.size, x, y);
                    // A texel is 0.125 m wide.
                    if place.x.abs() < 0.07 {
                        continue;
                    }
                    // By hand: 0.8 and 0.2 of 100.
                    let shininess = if place.x < 0.0 { 80.0 } else { 20.0 };
                    let truth = |shininess| {
                        radiance(&Material { shininess, ..shiny.clone() }, &scene.lights, place, DVec3::Z, EYE)
                    };
                    let (found, expected) = (nits(&picture, x, y), truth(shininess));
                    let off = (found - expected).abs().max_element() / expected.max_element();
                    assert!(off < SINGLE_LOBE, "{brdf} {light_path} ({x}, {y}): {found} for {expected}");
                    differing +=
                        usize::from((truth(100.0) - expected).abs().max_element() > 0.01 * expected.max_element());
                }
                assert_eq!(differing > 100, brdf != Brdf::CookTorrance, "{brdf} {light_path}: {differing}");
            }
        });
    }
}

#[test]
fn materials_keep_their_own_model_where_a_scene_mixes_them() {
    on_gpu(|gpu| {
        let material = |brdf| Material {
            brdf,
            base_color: Vec3::new(0.3, 0.6, 0.2),
            specular: Vec3::splat(0.4),
            shininess: 12.0,
            roughness: 0.4,
            ..Material::default()
        };
        let models = [Brdf::CookTorrance, Brdf::Phong, Brdf::BlinnPhong, Brdf::Lambert];
        let mut scene = crate::common::stage::stage();
        for (strip, brdf) in models.into_iter().enumerate() {
            let left = strip as f64 * 0.5 - 1.0;
            let mesh = crate::common::stage::rectangle([left, -1.0], [left + 0.5, 1.0], 0.0);
            crate::common::stage::add(&mut scene, mesh, material(brdf), glam::DAffine3::IDENTITY);
        }
        scene.lights = lobes();
        let picture = gpu.draw(&scene, &exact(32, 32));
        for (x, y) in places(&picture) {
            let brdf = models[x as usize / 8];
            let expected = radiance(&material(brdf), &scene.lights, seen(picture.size, x, y), DVec3::Z, EYE);
            let found = nits(&picture, x, y);
            assert!((found / expected - 1.0).abs().max_element() < SINGLE_LOBE, "{brdf}: {found} for {expected}");
        }
    });
}

#[test]
fn red_and_green_light_add_to_yellow() {
    on_gpu(|gpu| {
        let scene = open("builtin:overlap");
        let picture = gpu.draw(&scene, &display(64, 32));
        // Columns are 1/16 m. The spots stand at x = -0.3 and 0.3, two metres away, and light discs of 0.56 m.
        let [left, before, middle, right, outside] = [24, 31, 32, 40, 2].map(|x| code(&picture, x, 16));
        assert_eq!((left[1], left[2], right[0], right[2]), (0, 0, 0, 0), "{left:?} {right:?}");
        assert!(left[0] > 100 && right[1] > 100 && left[0].abs_diff(right[1]) <= 1, "{left:?} {right:?}");
        // The middle lies between two columns: a pixel is 1/32 m nearer to one of the lights, which is 1.8% of its light.
        assert!(middle[0] > 100 && middle[0].abs_diff(middle[1]) <= 3 && middle[2] == 0, "{middle:?}");
        assert!(middle[0].abs_diff(before[1]) <= 1 && middle[1].abs_diff(before[0]) <= 1, "{before:?} {middle:?}");
        assert_eq!(outside, [0, 0, 0]);
    });
}

#[test]
fn the_test_card_is_the_right_way_up_the_right_way_round_and_of_the_right_colours() {
    on_gpu(|gpu| {
        // Two metres are 180 pixels: 1.8 m of card are 162, texels and pixels do not beat within the areas looked at.
        let picture = gpu.draw(&open("builtin:orientation"), &display(320, 180));
        let at = |x: f64, y: f64| code(&picture, (160.0 + x * 90.0) as u32, (90.0 - y * 90.0) as u32);
        let (red, green, blue, white) = (at(-0.7, 0.7), at(0.7, 0.7), at(-0.7, -0.7), at(0.7, -0.7));
        assert_eq!([red, green, blue, white], [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3]], "texture origin");
        // An F, not its mirror image: ink at the left of the middle, paper at the right.
        assert_eq!([at(-0.17, 0.0), at(0.2, 0.0)], [[0; 3], [188; 3]], "the letter, and sRGB 188 through linear light");
        // Half of full light is code 187.52, which a driver may round either way.
        assert!(
            [[187; 3], [188; 3]].contains(&at(-1.3, 0.0)),
            "a clockwise square is culled: what lies behind it shows"
        );
        assert_eq!([at(1.25, 0.35), at(1.25, -0.35)], [[0, 255, 255]; 2], "the nearer square wins in either order");
        assert_eq!([at(1.55, 0.35), at(1.55, -0.35)], [[255, 255, 0]; 2], "the farther square beside it");
        for texels in ["bc7", "etc2-rgb8", "etc2-rgb8a1", "etc2-rgba8"] {
            let blocks = gpu.draw(&open(&format!("builtin:orientation?texels={texels}")), &display(320, 180));
            for (x, y) in [(-0.7, 0.7), (0.7, 0.7), (-0.7, -0.7), (0.7, -0.7), (-0.17, 0.0), (0.2, 0.0)] {
                let [own, other] = [&picture, &blocks]
                    .map(|picture| code(picture, (160.0 + x * 90.0) as u32, (90.0 - y * 90.0) as u32));
                let differ = own.iter().zip(other).map(|(own, other)| own.abs_diff(other)).max();
                assert!(differ <= Some(12), "{texels}: {other:?} and not {own:?} at {x}, {y}");
            }
        }
    });
}

#[test]
fn stripes_that_are_seen_along_stay_apart_as_far_as_anisotropy_goes() {
    on_gpu(|gpu| {
        // A floor of stripes half a metre wide, that run away from the eye.
        let mut scene = stage();
        add(&mut scene, rectangle([-10.0, -10.0], [10.0, 10.0], 0.0), lambert(1.0), DAffine3::IDENTITY);
        scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv *= 20.0);
        let texels = (0..64 * 64u32).flat_map(|i| if i % 64 < 32 { [255; 4] } else { [0, 0, 0, 255] });
        let (name, size) = ("stripes".into(), [64, 64]);
        scene.textures.push(Texture {
            name,
            size,
            color_space: ColorSpace::Linear,
            sampler: Default::default(),
            texels: texels.collect(),
        });
        scene.materials[0].base_color_texture = Some(0);
        let eye = DVec3::new(0.0, -9.0, 0.6);
        scene.camera =
            Camera { projection: Projection::perspective(60.0), ..Camera::looking_at(eye, eye + DVec3::Y, DVec3::Z) };
        let contrast = |anisotropy| {
            let picture = gpu.draw(&scene, &Settings { view: View::Albedo, anisotropy, ..exact(96, 64) });
            // 6 m away a pixel is 7 texels wide and 69 long.
            let row = (0..96).map(|x| nits(&picture, x, 37).y);
            let (low, high) = row.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
            high - low
        };
        let (isotropic, anisotropic) = (contrast(1), contrast(8));
        assert!(isotropic < 0.2 && anisotropic > 0.6, "{isotropic} and {anisotropic}");
    });
}
