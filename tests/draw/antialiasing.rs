//! Antialiasing: jittered frames, multisampling and FXAA, against coverage that is computed in f64.

use crate::common::compare::assert_identical;
use crate::common::gpu::{bytes, code, floats, nits, on_gpu, on_gpu_in_both_modes, places};
use crate::common::stage::{
    EDGE, EYE, add, directional, display, exact, gbuffer, lambert, open, own, plane, point, rectangle, srgb_code, stage,
};
use crate::common::truth::radiance;
use crate::common::{one_of, some_in_turn, some_of};
use afterlight::frame::{Complexity, Picture, sample_offset};
use afterlight::scene::{
    AlphaMode, ColorSpace, Falloff, LightPath, Material, Output, Resolve, Scene, Settings, Texture, Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

/// Radiance of the half-plane in nits; that of the background is `DARK`.
pub(crate) const BRIGHT: f64 = 0.75;
pub(crate) const DARK: f64 = 0.125;

/// A rectangle of `BRIGHT` in the plane z = 0, turned by an angle, of which the camera sees one edge that runs through the middle of
/// the picture.
pub(crate) fn edge(degrees: f64) -> Scene {
    let mut scene = stage();
    scene.environment.background = Vec3::splat(DARK as f32);
    let transform = DAffine3::from_rotation_z(degrees.to_radians());
    add(&mut scene, rectangle([0.0, -8.0], [16.0, 8.0], 0.0), lambert(0.5), transform);
    scene.lights = vec![directional(DVec3::Z, (BRIGHT / 0.5 * std::f64::consts::PI) as f32)];
    scene
}

/// Returns the share of the pixel at a place that the half-plane covers, 0 to 1: the pixel's square cut by the edge (Sutherland and Hodgman 1974),
/// then the shoelace formula.
fn coverage(degrees: f64, x: u32, y: u32) -> f64 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let middle = f64::from(EDGE) / 2.0;
    // Pixels from the middle of the picture, Y up; the plane fills the picture's height.
    let (left, top) = (f64::from(x) - middle, middle - f64::from(y));
    let corners = [[left, top], [left, top - 1.0], [left + 1.0, top - 1.0], [left + 1.0, top]];
    let inside = |[x, y]: [f64; 2]| x * cos + y * sin;
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for (index, &from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % 4];
        let (a, b) = (inside(from), inside(to));
        if a >= 0.0 {
            kept.push(from);
        }
        if (a >= 0.0) != (b >= 0.0) {
            let t = a / (a - b);
            kept.push([from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t]);
        }
    }
    let pairs = (0..kept.len()).map(|index| (kept[index], kept[(index + 1) % kept.len()]));
    pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs() / 2.0
}

fn draw_samples(gpu: &crate::common::gpu::Gpu, scene: &Scene, settings: &Settings) -> Picture {
    let mut frames = 0;
    let picture = gpu.renderer(scene, settings).picture(&scene.camera, || frames += 1);
    assert_eq!(frames, settings.samples);
    picture.unwrap_or_else(|error| panic!("{}: {error}", scene.name))
}

#[test]
fn one_sample_is_the_picture_of_one_frame() {
    on_gpu(|gpu| {
        for spec in ["builtin:spheres?rows=2&columns=2", "builtin:cornell"] {
            let scene = open(spec);
            let settings = own(&scene, 48, 32);
            assert_eq!(draw_samples(gpu, &scene, &settings), gpu.draw(&scene, &settings), "{spec}");
        }
    });
}

#[test]
fn samples_converge_to_the_covered_part_of_each_pixel() {
    on_gpu(|gpu| {
        for degrees in [0.0, 11.0, 30.0, 45.0, 77.0] {
            let scene = edge(degrees);
            for samples in [1u32, 4, 16, 64, 256] {
                let settings = Settings { samples, ..exact(EDGE, EDGE) };
                let picture = draw_samples(gpu, &scene, &settings);
                let error = |(x, y)| {
                    let expected = DARK + (BRIGHT - DARK) * coverage(degrees, x, y);
                    ((nits(&picture, x, y).y - expected) / (BRIGHT - DARK)).abs()
                };
                let worst = places(&picture).map(error).fold(0.0, f64::max);
                // The offsets keep this bound for any edge (src/frame/accumulate.rs holds them to it); and vertices have 8 bits below the pixel.
                let bound = 0.75 / f64::from(samples).sqrt() + 1.0 / 256.0;
                assert!(worst <= bound, "{degrees} degrees, {samples} samples: off by {worst}, more than {bound}");
                // One sample alone is all or nothing, so that the bound is not met by a picture that is smooth anyway.
                assert!(samples > 1 || worst > 0.4, "{degrees} degrees: {worst}");
            }
        }
    });
}

#[test]
fn each_frame_sees_what_lies_at_its_offset() {
    on_gpu(|gpu| {
        let scene = edge(30.0);
        let settings = exact(EDGE, EDGE);
        let mut renderer = gpu.renderer(&scene, &settings);
        let (sin, cos) = 30f64.to_radians().sin_cos();
        for index in 0..8 {
            let [right, down] = sample_offset(index, 8);
            renderer.render_jittered(&scene.camera, [right, down]).expect("a frame");
            let picture = renderer.read_back().expect("a picture");
            for (x, y) in places(&picture) {
                let middle = f64::from(EDGE) / 2.0;
                let inside = (f64::from(x) + 0.5 + right - middle) * cos - (f64::from(y) + 0.5 + down - middle) * sin;
                // The hardware has 8 bits below the pixel.
                if inside.abs() > 1.0 / 128.0 {
                    let expected = if inside > 0.0 { BRIGHT } else { DARK };
                    assert!((nits(&picture, x, y).y - expected).abs() < 1e-4, "frame {index}, ({x}, {y})");
                }
            }
        }
    });
}

/// Pixels of a wave on the plane, and texels of a pixel: levels of the texture are those of a power of two.
const WAVE: f64 = 4.0;
const TEXELS: f64 = 8.0;

/// The plane with a texture that waves from left to right: mean 128 / 255, amplitude 100 / 255 in the largest level.
fn waves() -> Scene {
    let mut scene = plane(lambert(1.0), vec![directional(DVec3::Z, std::f32::consts::PI)]);
    const EDGE: u32 = 1024;
    let code = |column: u32| {
        let phase = (f64::from(column) + 0.5) / (WAVE * TEXELS) * std::f64::consts::TAU;
        (128.0 + 100.0 * phase.cos()).round() as u8
    };
    let texels: Vec<u8> =
        (0..EDGE * EDGE).flat_map(|index| [[code(index % EDGE); 3].as_slice(), &[255]].concat()).collect();
    scene.textures.push(Texture {
        name: "waves".into(),
        size: [EDGE; 2],
        color_space: ColorSpace::Linear,
        sampler: Default::default(),
        texels: texels.into(),
    });
    scene.materials[0].base_color_texture = Some(0);
    scene
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) }
}

/// Returns the share of a wave that is left in a level, whose texels are means over squares and are interpolated linearly.
fn left_in_level(level: f64) -> f64 {
    let step = level.exp2() / (WAVE * TEXELS);
    (if level > 0.0 { sinc(step) } else { 1.0 }) * sinc(step).powi(2)
}

#[test]
fn a_texture_is_blurred_by_the_pixel_once_however_many_samples_it_has() {
    on_gpu(|gpu| {
        let scene = waves();
        const SIZE: u32 = 32;
        for (samples, anisotropy) in [(4u32, 1u32), (4, 8), (16, 1), (16, 4), (64, 1), (64, 8)] {
            let settings = Settings { samples, anisotropy, ..exact(SIZE, SIZE) };
            let picture = draw_samples(gpu, &scene, &settings);
            let wave = |(x, y)| {
                let phase = (f64::from(x) + 0.5 - f64::from(SIZE) / 2.0) / WAVE * std::f64::consts::TAU;
                nits(&picture, x, y).y * phase.cos() * 2.0 / f64::from(SIZE * SIZE)
            };
            let found = places(&picture).map(wave).sum::<f64>() * 255.0 / 100.0;
            // The mean over the frames' columns, which are as far apart as they can be; then the two levels that the sampler mixes.
            let (count, f) = (f64::from(samples), std::f64::consts::PI / WAVE);
            let averaged = f.sin() / (count * (f / count).sin());
            let places = f64::from(anisotropy.min(samples));
            let level = (TEXELS / (count * places).sqrt()).log2().max(0.0);
            let (larger, share) = (left_in_level(level.floor()), level.fract());
            let expected = averaged * (larger + (left_in_level(level.floor() + 1.0) - larger) * share);
            // Codes of 8 bits are half a hundredth of the wave; texels that are interpolated add their harmonics, of which the nearest two of 8
            // texels a wave have 1 / 49 and 1 / 81 of it before the mean over the pixel.
            assert!(
                (found - expected).abs() < 0.015,
                "{samples} samples, {anisotropy} places: {found}, not {expected}"
            );
            // Nothing but the pixel is left where there are many.
            assert!(samples < 64 || (found - sinc(1.0 / WAVE)).abs() < 0.02, "{samples}, {anisotropy}: {found}");
        }
    });
}

#[test]
fn light_is_averaged_before_or_after_the_tone_mapper_as_the_setting_says() {
    on_gpu(|gpu| {
        // Four times white on black, with the clamp as the tone mapper.
        let mut scene = edge(0.0);
        scene.environment.background = Vec3::ZERO;
        scene.lights[0].intensity *= (4.0 / BRIGHT) as f32;
        for (resolve, expected) in [(Resolve::Linear, 2.0), (Resolve::ToneMapped, 0.5)] {
            let settings = Settings { samples: 8, resolve, ..display(EDGE, EDGE) };
            let picture = draw_samples(gpu, &scene, &settings);
            let middle = EDGE / 2;
            // The edge halves the column in the middle; 8 columns of offsets lie on either side of it.
            assert_eq!(code(&picture, middle, middle), [srgb_code(expected); 3], "{resolve}");
            assert_eq!(code(&picture, middle - 1, middle), [0; 3], "{resolve}");
            assert_eq!(code(&picture, middle + 1, middle), [255; 3], "{resolve}");
        }
    });
}

#[test]
fn the_same_samples_give_the_same_bytes() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres?rows=2&columns=2");
        for resolve in [Resolve::Linear, Resolve::ToneMapped] {
            let settings = Settings { samples: 5, resolve, ..own(&scene, 48, 32) };
            let first = draw_samples(gpu, &scene, &settings);
            assert_eq!(first, draw_samples(gpu, &scene, &settings));
            assert!(bytes(&first).chunks_exact(4).all(|texel| texel[3] == 255));
        }
    });
}

#[test]
fn flat_areas_look_the_same_with_many_samples_as_with_one() {
    on_gpu(|gpu| {
        let scene = edge(30.0);
        for tonemap in afterlight::scene::Tonemap::NAMES.iter().map(|(_, tonemap)| *tonemap) {
            let settings = Settings { tonemap, ..display(EDGE, EDGE) };
            let (one, many) = (gpu.draw(&scene, &settings), Settings { samples: 4, ..settings });
            let many = draw_samples(gpu, &scene, &many);
            for (x, y) in places(&one).filter(|&(x, y)| [0.0, 1.0].contains(&coverage(30.0, x, y))) {
                for (a, b) in code(&one, x, y).into_iter().zip(code(&many, x, y)) {
                    // Both round, and the curves are evaluated by two processors.
                    assert!(a.abs_diff(b) <= 1, "{tonemap} at ({x}, {y}): {a} and {b}");
                }
            }
        }
    });
}

#[test]
fn fxaa_smooths_the_stairs_of_an_edge_and_leaves_flat_areas_as_they_are() {
    on_gpu(|gpu| {
        for degrees in [8.0, 15.0, 24.0, 72.0, 82.0] {
            let scene = edge(degrees);
            let settings = display(EDGE, EDGE);
            let plain = gpu.draw(&scene, &settings);
            let smooth = gpu.draw(&scene, &Settings { fxaa: true, ..settings });
            // Brightness as the eye sees it, about.
            let error = |picture: &Picture, x, y| {
                let truth = DARK + (BRIGHT - DARK) * coverage(degrees, x, y);
                (f64::from(code(picture, x, y)[1]) - f64::from(srgb_code(truth))).abs()
            };
            let (mut before, mut after) = (0.0, 0.0);
            // The picture's border has no neighbours to look at.
            let inner = 2..EDGE - 2;
            for (x, y) in places(&plain) {
                let beside_an_edge = (-1i64..=1).any(|right| {
                    (-1i64..=1).any(|down| {
                        let (x, y) = (i64::from(x) + right, i64::from(y) + down);
                        let inside = (0..i64::from(EDGE)).contains(&x) && (0..i64::from(EDGE)).contains(&y);
                        inside && !coverage_is_whole(degrees, x as u32, y as u32)
                    })
                });
                if !beside_an_edge {
                    assert_eq!(code(&plain, x, y), code(&smooth, x, y), "{degrees} degrees, ({x}, {y})");
                } else if inner.contains(&x) && inner.contains(&y) {
                    before += error(&plain, x, y);
                    after += error(&smooth, x, y);
                }
            }
            assert!(after < 0.6 * before, "{degrees} degrees: the error falls from {before} to {after} only");
        }
    });
}

fn coverage_is_whole(degrees: f64, x: u32, y: u32) -> bool {
    let covered = coverage(degrees, x, y);
    covered == 0.0 || (covered - 1.0).abs() < 1e-12
}

#[test]
fn fxaa_of_a_picture_without_edges_is_that_picture() {
    on_gpu(|gpu| {
        let mut scene = stage();
        for value in [0.0, 0.002, 0.1, 0.5, 1.0] {
            scene.environment.background = Vec3::new(value, value * 0.5, 1.0 - value);
            let settings = display(17, 9);
            let plain = gpu.draw(&scene, &settings);
            assert_eq!(plain, gpu.draw(&scene, &Settings { fxaa: true, ..settings }), "{value}");
        }
    });
}

#[test]
fn the_layers_have_nothing_to_say_about_any_of_it() {
    on_gpu_in_both_modes(|gpu| {
        // Without emissive surfaces, and with them.
        let scenes = ["builtin:spheres?rows=2&columns=2", "builtin:cornell"].map(open);
        let glass = scenes.clone().map(|mut scene| {
            (scene.materials[0].alpha, scene.materials[0].alpha_mode) = (0.5, AlphaMode::Blend);
            scene.name += " of glass";
            scene
        });
        for scene in some_of(scenes.into_iter().chain(glass), 4) {
            let spec = scene.name.clone();
            let base = own(&scene, 24, 16);
            let forward = Settings { msaa: 4, light_path: LightPath::Forward, ..base.clone() };
            // Nothing can come after it.
            let is_transparent = scene.materials.iter().any(Material::is_transparent);
            let tiled = if is_transparent { LightPath::Loop } else { LightPath::Compute };
            let is_looked_up = !is_transparent && gpu.takes(LightPath::Visibility, &scene);
            let looked_up = if is_looked_up { LightPath::Visibility } else { tiled };
            for settings in [
                Settings { samples: 3, ..base.clone() },
                Settings { samples: 3, output: Output::Nits, ..base.clone() },
                Settings { samples: 3, resolve: Resolve::Linear, ..base.clone() },
                Settings { fxaa: true, ..base.clone() },
                Settings { msaa: 4, ..base.clone() },
                Settings { msaa: 4, fxaa: true, ..base.clone() },
                Settings { msaa: 4, resolve: Resolve::Linear, ..base.clone() },
                Settings { msaa: 4, output: Output::Nits, ..base.clone() },
                Settings { msaa: 4, gbuffer: gbuffer("float32"), ..base.clone() },
                Settings { msaa: 4, view: View::Complexity, ..base.clone() },
                Settings { msaa: 4, light_path: LightPath::Clustered, ..base.clone() },
                Settings { msaa: 4, light_path: tiled, ..base.clone() },
                Settings { msaa: 4, light_path: tiled, resolve: Resolve::Linear, ..base.clone() },
                Settings { msaa: 4, light_path: tiled, output: Output::Nits, ..base.clone() },
                Settings { msaa: 4, light_path: looked_up, ..base.clone() },
                Settings { msaa: 4, light_path: looked_up, resolve: Resolve::Linear, ..base.clone() },
                Settings { msaa: 4, depth_prepass: Some(true), ..base.clone() },
                forward.clone(),
                Settings { output: Output::Nits, ..forward.clone() },
                Settings { resolve: Resolve::Linear, ..forward.clone() },
                Settings { fxaa: true, depth_prepass: Some(false), ..forward.clone() },
                Settings { light_path: LightPath::ForwardNaive, ..forward.clone() },
                Settings { msaa: 4, transparency: Transparency::Oit, ..base.clone() },
                Settings { msaa: 4, transparency: Transparency::Oit, output: Output::Nits, ..base.clone() },
                Settings { transparency: Transparency::Oit, output: Output::Nits, ..forward.clone() },
            ] {
                if !gpu.takes_turn() {
                    continue;
                }
                let mut renderer = gpu.renderer(&scene, &settings);
                let first = renderer.picture(&scene.camera, || ()).expect("a picture");
                // Frames in flight, then another picture.
                for _ in 0..3 {
                    renderer.render(&scene.camera).expect("a frame");
                }
                let again = renderer.picture(&scene.camera, || ()).expect("a picture");
                assert_eq!(first, again, "{spec}");
                if settings.output.is_linear() {
                    assert!(floats(&first).iter().any(|value| *value > 0.0));
                } else {
                    assert!(bytes(&first).iter().any(|code| *code > 0 && *code < 255));
                }
            }
        }
    });
}

/// Samples of a pixel with 4, from its centre, to the right and down: "Standard sample locations" of the Vulkan specification.
const FOUR: [[f64; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]];

/// Returns how many of a pixel's samples the half-plane covers; none where a sample lies too near the edge to say.
fn covered_samples(degrees: f64, x: u32, y: u32) -> Option<usize> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let middle = f64::from(EDGE) / 2.0;
    let inside = FOUR
        .map(|[right, down]| (f64::from(x) + 0.5 + right - middle) * cos + (middle - f64::from(y) - 0.5 - down) * sin);
    // Vertices have 8 bits below the pixel.
    inside.iter().all(|d| d.abs() > 1.0 / 128.0).then(|| inside.iter().filter(|d| **d > 0.0).count())
}

/// The same half-plane as a pane that lets half of the light from behind it through.
fn pane_edge(degrees: f64) -> Scene {
    let mut scene = edge(degrees);
    let pane = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..scene.materials[0].clone() };
    scene.materials[0] = pane;
    // A surface behind the pane, in place of a clear colour: depth of all samples is tested.
    let behind = (DARK / (BRIGHT / 0.5)) as f32;
    add(&mut scene, rectangle([-8.0, -8.0], [8.0, 8.0], -1.0), lambert(behind), DAffine3::IDENTITY);
    scene.environment.background = Vec3::ZERO;
    scene
}

/// Every way to light the multisampled surfaces of a scene.
fn multisampled(scene: &Scene, base: &Settings) -> Vec<(String, Settings)> {
    let ways = [
        (LightPath::Loop, None),
        (LightPath::Clustered, None),
        (LightPath::Forward, Some(true)),
        (LightPath::Forward, Some(false)),
        (LightPath::ForwardNaive, None),
        (LightPath::Compute, None),
        (LightPath::Visibility, None),
    ];
    let is_transparent = scene.materials.iter().any(Material::is_transparent);
    let by_compute = |path| matches!(path, LightPath::Compute | LightPath::Visibility);
    let ways = ways.into_iter().filter(|&(light_path, _)| !is_transparent || !by_compute(light_path));
    let mut all = Vec::new();
    for (light_path, depth_prepass) in ways {
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            let settings = Settings { msaa: 4, light_path, depth_prepass, transparency, ..base.clone() };
            all.push((format!("{light_path}, pre-pass {depth_prepass:?}, {transparency}"), settings));
        }
    }
    all
}

#[test]
fn multisampled_edges_have_as_much_of_each_side_as_samples_lie_there() {
    on_gpu(|gpu| {
        for degrees in [5.0, 17.0, 45.5, 78.0] {
            for (scene, full) in [(edge(degrees), BRIGHT), (pane_edge(degrees), (BRIGHT + DARK) / 2.0)] {
                for (way, settings) in multisampled(&scene, &exact(EDGE, EDGE)) {
                    let what = format!("{degrees} degrees, {way}");
                    let linear = gpu.draw(&scene, &settings);
                    let mut levels = [0; 5];
                    for (x, y) in places(&linear) {
                        let Some(covered) = covered_samples(degrees, x, y) else { continue };
                        levels[covered] += 1;
                        let shown = nits(&linear, x, y).y;
                        let error = (shown - (DARK + (full - DARK) * covered as f64 / 4.0)).abs();
                        assert!(error < 1e-5, "{what}, ({x}, {y}): {covered} of 4 covered, off by {error}");
                        // Four samples, no two in a row or column, miss the covered area by at most a quarter of the pixel.
                        let missed = (shown - DARK) / (full - DARK) - coverage(degrees, x, y);
                        assert!(missed.abs() < 0.25, "{what}, ({x}, {y}): coverage off by {missed}");
                    }
                    assert!(levels.iter().all(|count| *count > 0), "{what}: {levels:?}");
                }
            }
        }
    });
}

#[test]
fn an_edge_that_is_lit_as_it_is_drawn_is_lit_where_the_surface_is() {
    on_gpu(|gpu| {
        let degrees = 17.0;
        let mut scene = edge(degrees);
        let (sin, cos) = degrees.to_radians().sin_cos();
        // So near that its light changes much within a pixel, away from the edge.
        let lamp = DVec3::new(0.08 * cos, 0.08 * sin, 0.04);
        scene.lights = vec![point(lamp, 0.01, None, Falloff::InverseSquare)];
        let ways = multisampled(&scene, &exact(EDGE, EDGE));
        for (way, settings) in ways.into_iter().filter(|(way, _)| way.contains("forward")) {
            let picture = gpu.draw(&scene, &settings);
            let mut cut = 0;
            for (x, y) in places(&picture) {
                let Some(covered @ 1..4) = covered_samples(degrees, x, y) else { continue };
                cut += 1;
                // The one place is the driver's choice, but on the part that is covered.
                let (mut least, mut most) = (f64::INFINITY, 0f64);
                for (right, down) in (0..=16).flat_map(|right| (0..=16).map(move |down| (right, down))) {
                    let place = in_plane(f64::from(x) + f64::from(right) / 16.0, f64::from(y) + f64::from(down) / 16.0);
                    // Vertices have 8 bits below the pixel.
                    if place.x * cos + place.y * sin > -1.0 / 128.0 * 2.0 / f64::from(EDGE) {
                        let light = radiance(&scene.materials[0], &scene.lights, place, DVec3::Z, EYE).y;
                        (least, most) = (least.min(light), most.max(light));
                    }
                }
                let share = covered as f64 / 4.0;
                let lit = (nits(&picture, x, y).y - DARK * (1.0 - share)) / share;
                let (low, high) = (least * 0.995, most * 1.005);
                assert!((low..=high).contains(&lit), "{way} ({x}, {y}): {lit} is not in {low} to {high}");
            }
            assert!(cut > 20, "{cut}");
        }
    });
}

#[test]
fn lists_of_lights_change_no_sample() {
    on_gpu(|gpu| {
        // A floor that ends 6.9 m away, within a pixel whose centre lies 8.25 m away on its plane: behind the froxel, from 5.7 m to 8 m,
        // that has the light.
        let mut floor = stage();
        let flat = DAffine3::from_rotation_x(-90f64.to_radians());
        add(&mut floor, rectangle([-8.0, -1.5], [8.0, 4.9], -0.5), lambert(0.5), flat);
        floor.lights = vec![point(DVec3::new(0.0, -0.3, -4.6), 1.0, Some(0.8), Falloff::InverseSquare)];
        let scenes = [floor, open("builtin:field?objects=60&lights=30"), open("builtin:hall")];
        for (turn, scene) in scenes.into_iter().enumerate() {
            let spec = &scene.name;
            for base in one_of(&[exact(EDGE, EDGE), display(EDGE, EDGE)], turn).iter().cloned() {
                let settings = Settings { msaa: 4, exposure: own(&scene, 1, 1).exposure, ..base };
                let draw = |light_path, depth_prepass| {
                    gpu.draw(&scene, &Settings { light_path, depth_prepass, ..settings.clone() })
                };
                let naive = draw(LightPath::ForwardNaive, None);
                assert_identical(&draw(LightPath::Forward, Some(false)), &naive, spec);
            }
        }
    });
}

/// Returns the point of the plane z = 0 at a place of the picture, in pixels from its upper left corner.
fn in_plane(right: f64, down: f64) -> DVec3 {
    let middle = f64::from(EDGE) / 2.0;
    DVec3::new(right - middle, middle - down, 0.0) / middle
}

#[test]
fn each_sample_of_an_edge_is_lit_at_its_own_place() {
    on_gpu(|gpu| {
        let degrees = 17.0;
        let mut scene = edge(degrees);
        // So near that its light changes much within a pixel.
        scene.lights = vec![point(DVec3::new(0.02, 0.03, 0.04), 0.01, None, Falloff::InverseSquare)];
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Rebuilt from depth: a position target has one place for all samples that a triangle covers, and not where they are. The albedo
        // of `lean` has 8 bits.
        let layouts = [("lean", 0.01), ("lean,albedo=rgba32f,normal=rgba32f", 0.001)];
        let paths = [LightPath::Loop, LightPath::Compute, LightPath::Visibility];
        for ((layout, bound), light_path) in layouts.into_iter().flat_map(|own| paths.map(|path| (own, path))) {
            let settings = Settings { msaa: 4, light_path, gbuffer: gbuffer(layout), ..exact(EDGE, EDGE) };
            let picture = gpu.draw(&scene, &settings);
            for (x, y) in places(&picture) {
                let Some(covered) = covered_samples(degrees, x, y) else { continue };
                let lit = |[right, down]: [f64; 2]| {
                    let place = in_plane(f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down);
                    radiance(&scene.materials[0], &scene.lights, place, DVec3::Z, EYE).y
                };
                let inside = |[right, down]: [f64; 2]| {
                    let place = in_plane(f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down);
                    place.x * cos + place.y * sin > 0.0
                };
                let expected = match covered {
                    // Samples that agree are lit as one, in the pixel's middle.
                    4 => lit([0.0, 0.0]),
                    _ => FOUR.into_iter().map(|at| if inside(at) { lit(at) } else { DARK }).sum::<f64>() / 4.0,
                };
                let error = (nits(&picture, x, y).y - expected).abs() / expected;
                assert!(error < bound, "{light_path} {layout} ({x}, {y}), {covered} covered: off by {error}");
            }
        }
    });
}

#[test]
fn samples_are_resolved_as_light_or_as_shown() {
    on_gpu(|gpu| {
        let degrees = 17.0;
        let mut scene = edge(degrees);
        // Four times white on a quarter of white, with the clamp as the tone mapper; glowing or lit.
        scene.environment.background = Vec3::splat(0.25);
        let lit = scene.clone();
        scene.lights.clear();
        scene.materials[0].emissive = Vec3::splat(4.0);
        let glowing = scene;
        let mut lit = lit;
        lit.lights[0].intensity *= (4.0 / BRIGHT) as f32;
        // Over a quarter of white, as bright as that.
        let mut pane = lit.clone();
        pane.materials[0] = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..lambert(0.5) };
        pane.lights[0].intensity *= (4.0 - 0.5 * 0.25) / (0.5 * 4.0);
        let pictures = [(&lit, "lit"), (&glowing, "glowing"), (&pane, "a pane")];
        for ((scene, name), resolve) in pictures
            .into_iter()
            .flat_map(|scene| [Resolve::Linear, Resolve::ToneMapped].map(|resolve| (scene, resolve)))
        {
            for (way, settings) in multisampled(scene, &Settings { resolve, ..display(EDGE, EDGE) }) {
                let picture = gpu.draw(scene, &settings);
                for (x, y) in places(&picture) {
                    let Some(covered) = covered_samples(degrees, x, y) else { continue };
                    let share = covered as f64 / 4.0;
                    let expected = match resolve {
                        Resolve::Linear => 0.25 + (4.0 - 0.25) * share,
                        Resolve::ToneMapped => 0.25 + (1.0 - 0.25) * share,
                    };
                    let (code, expected) = (code(&picture, x, y)[1], srgb_code(expected));
                    // A resolve of 8 bits may round once more.
                    assert!(code.abs_diff(expected) <= 1, "{name} {way} {resolve} ({x}, {y}): {code}, not {expected}");
                }
            }
        }
    });
}

#[test]
fn what_lies_inside_a_surface_is_the_same_with_one_sample_as_with_four() {
    on_gpu(|gpu| {
        let plain = edge(30.0);
        let inside_plain = |x, y| coverage_is_whole(30.0, x, y);
        // A square whose colours change from pixel to pixel, as interpolation at a wrong place would show.
        let mut noisy = stage();
        add(&mut noisy, rectangle([-0.75, -0.75], [0.75, 0.75], 0.0), lambert(1.0), DAffine3::IDENTITY);
        noisy.lights = vec![directional(DVec3::Z, 3.0)];
        let texels = (0..64 * 64u32).flat_map(|i| [i * 37 % 251, i * 91 % 241, i * 13 % 239, 255].map(|v| v as u8));
        let (name, size) = ("noise".into(), [64, 64]);
        noisy.textures.push(Texture {
            name,
            size,
            color_space: ColorSpace::Srgb,
            sampler: Default::default(),
            texels: texels.collect(),
        });
        noisy.materials[0].base_color_texture = Some(0);
        // Away from its border, and from where its two triangles meet.
        let inside_noisy = |x: u32, y: u32| {
            let (x, y) = (x.abs_diff(EDGE / 2), y.abs_diff(EDGE / 2));
            x.max(y) < 11 && x.abs_diff(y) > 2
        };
        let glassy = |scene: &Scene| {
            let mut scene = scene.clone();
            (scene.materials[0].alpha, scene.materials[0].alpha_mode) = (0.5, AlphaMode::Blend);
            scene
        };
        for (turn, scene) in [&plain, &noisy, &glassy(&plain), &glassy(&noisy)].into_iter().enumerate() {
            let inside = |x, y| if scene.textures.is_empty() { inside_plain(x, y) } else { inside_noisy(x, y) };
            // An anisotropic filter makes more of how places are rounded.
            for base in [exact(EDGE, EDGE), display(EDGE, EDGE)].map(|base| Settings { anisotropy: 1, ..base }) {
                let ways = multisampled(scene, &base);
                for (way, settings) in some_in_turn(&ways.iter().collect::<Vec<_>>(), turn, 2) {
                    let one = gpu.draw(scene, &Settings { msaa: 1, ..settings.clone() });
                    let four = gpu.draw(scene, settings);
                    // Bit for bit, but for one difference: lavapipe rounds values otherwise where it interpolates to a centroid than where to a
                    // centre, which moves where a texture is sampled, and a layer's weight.
                    let weighted = scene.materials[0].alpha < 1.0 && settings.transparency == Transparency::Oit;
                    let rounded = weighted || !scene.textures.is_empty();
                    for (x, y) in places(&one).filter(|&(x, y)| inside(x, y)) {
                        let what = format!("{way}, linear {} ({x}, {y})", base.output.is_linear());
                        if base.output.is_linear() {
                            let (one, four) = (nits(&one, x, y), nits(&four, x, y));
                            let bound = if rounded { one.max_element() / f64::from(1 << 18) } else { 0.0 };
                            assert!((one - four).abs().max_element() <= bound, "{what}: {one} and {four}");
                        } else {
                            let (one, four) = (code(&one, x, y), code(&four, x, y));
                            let most = one.into_iter().zip(four).map(|(one, four)| one.abs_diff(four)).max();
                            assert!(most <= Some(u8::from(weighted)), "{what}: {one:?} and {four:?}");
                        }
                    }
                }
            }
            for layout in ["lean", "fat", "float32"] {
                // With a G-buffer in either case: so plain a surface is else lit as it is drawn, where it has one sample.
                let light_path = LightPath::Loop;
                let settings = Settings { gbuffer: gbuffer(layout), light_path, anisotropy: 1, ..display(EDGE, EDGE) };
                let one = gpu.draw(scene, &settings);
                let four = gpu.draw(scene, &Settings { msaa: 4, ..settings });
                for (x, y) in places(&one).filter(|&(x, y)| inside(x, y)) {
                    assert_eq!(code(&one, x, y), code(&four, x, y), "{layout} ({x}, {y})");
                }
            }
        }
    });
}

#[test]
fn the_view_of_complexity_marks_the_pixels_whose_samples_differ() {
    on_gpu(|gpu| {
        for degrees in [5.0, 45.5, 78.0] {
            for layout in ["lean", "fat", "float32"] {
                let scene = edge(degrees);
                let gbuffer = gbuffer(layout);
                let settings = Settings { msaa: 4, gbuffer, view: View::Complexity, ..display(EDGE, EDGE) };
                let picture = gpu.draw(&scene, &settings);
                let mut counted = Complexity { covered: 0, complex: 0 };
                for (x, y) in places(&picture) {
                    let shown = code(&picture, x, y);
                    let (complex, covered) = (shown[0] > 127, shown[2] > 0);
                    counted.covered += usize::from(covered);
                    counted.complex += usize::from(complex);
                    if let Some(samples) = covered_samples(degrees, x, y) {
                        let expected = (!matches!(samples, 0 | 4), samples > 0);
                        assert_eq!((complex, covered), expected, "{layout}, {degrees} degrees, ({x}, {y})");
                    }
                }
                assert_eq!(Complexity::of(&picture), counted);
                assert!(counted.share() > 0.02 && counted.share() < 0.2, "{}", counted.share());
            }
        }
    });
}

#[test]
fn a_depth_pre_pass_meets_the_same_samples() {
    on_gpu(|gpu| {
        // Without textures: the driver chooses where in a partly covered pixel a texture is sampled, and may go by the samples that pass the depth
        // test.
        for spec in ["builtin:spheres?rows=2&columns=2", "builtin:cornell"] {
            let scene = open(spec);
            let settings = Settings { msaa: 4, light_path: LightPath::Loop, ..own(&scene, 64, 48) };
            let without = gpu.draw(&scene, &Settings { depth_prepass: Some(false), ..settings.clone() });
            assert_eq!(without, gpu.draw(&scene, &Settings { depth_prepass: Some(true), ..settings }), "{spec}");
        }
    });
}
