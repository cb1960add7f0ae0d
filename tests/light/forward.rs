//! Lighting surfaces while they are rasterized gives the picture that lighting a G-buffer of 32-bit floats does.

use crate::common::compare::{assert_identical, largest_code_difference, largest_relative_difference};
use crate::common::gpu::{Gpu, nits, on_gpu, on_gpu_in_both_modes, places};
use crate::common::stage::{gbuffer, open, own};
use crate::common::{one_of, some_of};
use afterlight::frame::Renderer;
use afterlight::plan::FramePlan;
use afterlight::scene::builtin::CATALOGUE;
use afterlight::scene::{LightPath, Output, Scene, Settings, ShadowSettings, Tonemap, View};

const SIZE: [u32; 2] = [96, 54];

/// Normals are normalized once more when they come from a target, and a shininess is encoded and decoded; each is good to some steps
/// of single precision, 6e-8, and a lobe of roughness 0.1 has a slope of 2 / alpha = 200 (`tests/draw/gbuffer.rs`).
const SINGLE: f64 = 1e-4;

fn scenes() -> impl Iterator<Item = Scene> {
    let built_in = CATALOGUE.iter().map(|builtin| {
        // Fewer objects than by default: more of them are drawn the same way.
        let query = if builtin.name == "field" { "?objects=60&lights=30" } else { "" };
        open(&format!("builtin:{}{query}", builtin.name))
    });
    built_in.chain([open("assets/gallery/beam.toml")])
}

fn linear(scene: &Scene) -> Settings {
    Settings { output: Output::Nits, gbuffer: gbuffer("float32"), ..own(scene, SIZE[0], SIZE[1]) }
}

fn on(light_path: LightPath, depth_prepass: Option<bool>, settings: &Settings) -> Settings {
    Settings { light_path, depth_prepass, ..*settings }
}

fn plan(gpu: &Gpu, scene: &Scene, settings: &Settings) -> FramePlan {
    gpu.renderer(scene, settings).plan().clone()
}

const WAYS: [(LightPath, Option<bool>); 3] =
    [(LightPath::Forward, None), (LightPath::Forward, Some(false)), (LightPath::ForwardNaive, None)];

#[test]
fn every_built_in_scene_is_the_same_without_a_gbuffer() {
    on_gpu(|gpu| {
        for (turn, scene) in scenes().enumerate() {
            let off = ShadowSettings { enabled: false, ..linear(&scene).shadows };
            let settings = Settings { shadows: off, ..linear(&scene) };
            let expected = gpu.draw(&scene, &on(LightPath::Loop, None, &settings));
            for &(path, prepass) in one_of(&WAYS, turn) {
                let picture = gpu.draw(&scene, &on(path, prepass, &settings));
                let (most, at) = largest_relative_difference(&picture, &expected, 1e-3);
                eprintln!("{} {path} {prepass:?}: {most:.2e}", scene.name);
                assert!(most < SINGLE, "{} {path} {prepass:?}: {most} at {at:?}", scene.name);
            }
        }
    });
}

/// The geometric normal that a lookup moves along is stored in steps of 1/32767: the lookup moves by less than a thousandth of a texel, and
/// crosses a texel's border, or a surface's depth, in as few pixels.
#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn shadows_are_the_same_but_for_pixels_on_a_texels_border() {
    on_gpu(|gpu| {
        for scene in scenes() {
            let settings = linear(&scene);
            let expected = gpu.draw(&scene, &on(LightPath::Loop, None, &settings));
            let picture = gpu.draw(&scene, &on(LightPath::Forward, None, &settings));
            let differs = |&(x, y): &(u32, u32)| {
                let (a, b) = (nits(&picture, x, y), nits(&expected, x, y));
                (a - b).abs().max_element() > SINGLE * a.max(b).max_element().max(1e-3)
            };
            let differing = places(&picture).filter(differs).count();
            eprintln!("{}: {differing} of {} pixels", scene.name, SIZE[0] * SIZE[1]);
            assert!(differing < (SIZE[0] * SIZE[1]) as usize / 200, "{}: {differing} pixels", scene.name);
        }
    });
}

/// Coplanar surfaces of one mesh would differ, but none here lies under a pixel's centre: the first drawn wins without a pre-pass, the last with one.
#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn a_depth_prepass_changes_no_bit() {
    on_gpu(|gpu| {
        for (turn, scene) in some_of(scenes(), 3).enumerate() {
            for settings in one_of(&[linear(&scene), own(&scene, SIZE[0], SIZE[1])], turn) {
                let drawn = |path, prepass| gpu.draw(&scene, &on(path, prepass, settings));
                let (with, without) = (drawn(LightPath::Forward, Some(true)), drawn(LightPath::Forward, Some(false)));
                assert_identical(&with, &without, &scene.name);
                // Lists of lights keep their order, so the sums equal the loop's.
                assert_identical(&drawn(LightPath::ForwardNaive, None), &with, &scene.name);
            }
        }
    });
}

#[test]
#[ignore = "test-all: every built-in scene without a G-buffer stays, and the paths that give the same bits"]
fn forward_tone_maps_in_place() {
    on_gpu(|gpu| {
        let scene = open("builtin:hall");
        for (_, tonemap) in Tonemap::NAMES {
            let off = ShadowSettings { enabled: false, ..ShadowSettings::default() };
            let settings = Settings {
                tonemap: *tonemap,
                shadows: off,
                gbuffer: gbuffer("float32"),
                ..own(&scene, SIZE[0], SIZE[1])
            };
            let forward = on(LightPath::Forward, None, &settings);
            // Emission of the hall's lamps is added before tone mapping, without a separate target, unlike in the deferred frame.
            assert_eq!(plan(gpu, &scene, &forward).hdr, None);
            let expected = gpu.draw(&scene, &on(LightPath::Loop, None, &settings));
            let (most, at) = largest_code_difference(&gpu.draw(&scene, &forward), &expected);
            assert!(most <= 1, "{tonemap}: {most} codes at {at:?}");
        }
    });
}

#[test]
fn the_view_of_the_light_alone_is_the_same() {
    on_gpu(|gpu| {
        let scene = open("builtin:hall");
        let off = ShadowSettings { enabled: false, ..ShadowSettings::default() };
        let settings = Settings { view: View::Lighting, shadows: off, ..linear(&scene) };
        let expected = gpu.draw(&scene, &on(LightPath::Loop, None, &settings));
        let picture = gpu.draw(&scene, &on(LightPath::Forward, None, &settings));
        let (most, at) = largest_relative_difference(&picture, &expected, 1e-3);
        assert!(most < SINGLE, "{most} at {at:?}");
    });
}

#[test]
fn what_does_not_go_together_is_refused() {
    on_gpu(|gpu| {
        let scene = open("builtin:cornell");
        let settings = own(&scene, SIZE[0], SIZE[1]);
        let refusal = |settings: Settings| match Renderer::new(&gpu.device, &scene, &settings) {
            Ok(_) => panic!("{settings:?} is drawn"),
            Err(error) => error.to_string(),
        };
        let error = refusal(on(LightPath::ForwardNaive, Some(true), &settings));
        assert!(
            error.contains("forward-naive has no depth pre-pass") && error.contains("--light-path forward"),
            "{error}"
        );
        // By default only forward has a depth pre-pass.
        let has = |path| plan(gpu, &scene, &on(path, None, &settings)).depth_prepass;
        assert_eq!([LightPath::Forward, LightPath::ForwardNaive, LightPath::Loop].map(has), [true, false, false]);
        for path in [LightPath::Forward, LightPath::ForwardNaive] {
            let error = refusal(Settings { view: View::Normal, ..on(path, None, &settings) });
            assert!(error.contains("G-buffer") && error.contains(path.name()), "{error}");
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn forward_frames_are_silent() {
    on_gpu_in_both_modes(|gpu| {
        let outputs = [(Output::Srgb8, false), (Output::Nits, false), (Output::Exposed, false), (Output::Srgb8, true)];
        let (hall, cornell) = (open("builtin:hall"), open("builtin:cornell"));
        for (scene, outputs) in [(hall, &outputs[..1]), (cornell, &outputs)] {
            for (path, prepass) in WAYS {
                for &(output, fxaa) in outputs {
                    if !gpu.takes_turn() {
                        continue;
                    }
                    let settings = Settings { output, fxaa, ..own(&scene, 32, 18) };
                    let mut renderer = gpu.renderer(&scene, &on(path, prepass, &settings));
                    for _ in 0..4 {
                        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
                    }
                    renderer.read_back().unwrap_or_else(|error| panic!("{error}"));
                }
            }
        }
    });
}
