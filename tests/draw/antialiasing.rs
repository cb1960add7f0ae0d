//! Antialiasing: jittered frames and FXAA, against coverage that is computed in f64.

use crate::common::gpu::{bytes, code, floats, nits, on_gpu, on_gpu_in_both_modes, places};
use crate::common::some_of;
use crate::common::stage::{
    EDGE, add, directional, display, exact, gbuffer, lambert, open, own, plane, rectangle, srgb_code, stage,
};
use afterlight::frame::{Picture, sample_offset};
use afterlight::scene::{
    AlphaMode, ColorSpace, LightPath, Material, Output, Resolve, Scene, Settings, Texture, Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

/// Radiance of the half-plane in nits; the background's radiance is `DARK`.
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
pub(crate) fn coverage(degrees: f64, x: u32, y: u32) -> f64 {
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

/// Pixels of a wave on the plane, and texels of a pixel. `TEXELS` is a power of two, as the texture's levels are.
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
            // Only the blur of the pixel itself is left if the samples are many.
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

pub(crate) fn coverage_is_whole(degrees: f64, x: u32, y: u32) -> bool {
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
        // Scenes without emissive surfaces, and with them.
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
