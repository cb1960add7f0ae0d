//! Froxels: lamps, suns and their shadows in fog, as rays have them; and a camera that moves does not make them flicker.

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::stage::{add, directional, exact, lambert, plane, point, rectangle, spot, sun};
use crate::common::tries_all;
use afterlight::frame::Renderer;
use afterlight::scene::{
    AlphaMode, Camera, Falloff, Fog, LightPath, Material, Projection, Scene, Settings, Transparency,
};
use afterlight_truth::reference::{CameraView as Eye, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

fn light(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<DVec3> {
    linear(floats(&gpu.draw(scene, settings)))
}

fn linear(rgba: &[f32]) -> Vec<DVec3> {
    rgba.chunks_exact(4).map(|rgba| DVec3::new(rgba[0].into(), rgba[1].into(), rgba[2].into())).collect()
}

fn truth(scene: &Scene, settings: &Settings) -> Vec<DVec3> {
    let reference = Reference::new(scene).expect("a scene").with_settings(settings, &scene.camera);
    let options = TruthOptions { mode: Mode::Point, smith: Smith::default() };
    let truth = reference.render(&Eye { camera: scene.camera, size: settings.size }, &options, &|_, _| {});
    truth.radiance.into_iter().map(DVec3::from).collect()
}

/// The mean error, as a share of the mean light.
fn error(found: &[DVec3], wanted: &[DVec3]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let sum = |own: DVec3| own.x + own.y + own.z;
    let off: f64 = found.iter().zip(wanted).map(|(found, wanted)| sum((*found - *wanted).abs())).sum();
    off / wanted.iter().map(|own| sum(*own)).sum::<f64>()
}

fn worst(found: &[DVec3], wanted: &[DVec3]) -> f64 {
    let pairs = found.iter().zip(wanted);
    pairs.map(|(found, wanted)| (*found - *wanted).abs().max_element() / wanted.max_element()).fold(0.0, f64::max)
}

/// Black boards in the light of a sun, of a spot light and of a lamp between them, so that all that is seen is the air.
fn boards() -> Scene {
    let mut cone = spot(DVec3::new(-0.6, 0.4, 1.2), 2.0, 10.0, 25.0);
    cone.casts_shadow = true;
    let mut lamp = point(DVec3::new(0.45, -0.3, 0.6), 0.5, None, Falloff::InverseSquare);
    lamp.casts_shadow = true;
    let mut scene = plane(lambert(0.0), vec![sun(DVec3::new(1.0, 0.4, 0.3), 3.0), cone, lamp]);
    for (low, high, z) in
        [([-0.8, 0.2], [-0.5, 0.5], 0.5), ([0.2, -0.2], [0.6, 0.3], 0.3), ([0.9, -0.6], [1.0, 0.9], 0.9)]
    {
        add(&mut scene, rectangle(low, high, z), lambert(0.0), DAffine3::IDENTITY);
    }
    scene
}

fn foggy(width: u32, height: u32) -> Settings {
    Settings {
        fog: Fog::Froxels,
        fog_density: 0.3,
        fog_height: 5.0,
        light_path: LightPath::Loop,
        ..exact(width, height)
    }
}

/// Without lamps and shadows the froxels' sum is the closed form, but for the rounding of half floats.
#[test]
fn fog_without_lamps_and_shadows_is_the_closed_form() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(0.5), vec![directional(DVec3::new(0.3, 1.0, 0.4), 4.0)]);
        scene.environment.ambient = Vec3::new(0.3, 0.4, 0.5);
        let mut parallel = scene.clone();
        parallel.camera.projection = Projection::Orthographic { height: 2.0 };
        for scene in [scene, parallel] {
            for (fog_density, fog_height) in [(1e-3, 20.0), (0.3, 0.5), (100.0, 1e6)] {
                let froxels = Settings { fog_density, fog_height, fog_froxels: [24, 14, 6], ..foggy(24, 14) };
                let height = Settings { fog: Fog::Height, ..froxels.clone() };
                let error = worst(&light(gpu, &scene, &froxels), &light(gpu, &scene, &height));
                println!("{fog_density}: {error:e}");
                // A column for each pixel: nothing but two roundings to 2^-11, or cuts, is in between.
                assert!(error < 1.1 / 1024.0, "{fog_density}: {error}");
            }
        }
    });
}

#[test]
fn lamps_and_shadows_in_fog_are_as_rays_have_them_and_more_froxels_come_nearer() {
    on_gpu(|gpu| {
        let scene = boards();
        let wanted = truth(&scene, &foggy(48, 28));
        let errors = [[12, 7, 8], [24, 14, 16], [48, 28, 32]].map(|fog_froxels| {
            let settings = Settings { fog_froxels, ..foggy(48, 28) };
            error(&light(gpu, &scene, &settings), &wanted)
        });
        let height = error(&light(gpu, &scene, &Settings { fog: Fog::Height, ..foggy(48, 28) }), &wanted);
        println!("{errors:?}, and by height alone {height}");
        assert!(errors[1] < errors[0] && errors[2] < 0.5 * errors[0], "{errors:?}");
        assert!(errors[2] < 0.05 && height > 10.0 * errors[2], "{errors:?}, {height}");
    });
}

/// The table of docs/FOG.md.
#[test]
fn errors_fall_with_the_number_of_froxels() {
    if !tries_all() {
        return;
    }
    on_gpu(|gpu| {
        let scene = boards();
        let wanted = truth(&scene, &foggy(96, 54));
        let grids = [[40, 23, 16], [80, 45, 32], [160, 90, 64], [320, 180, 128]];
        for fog_samples in [1, 4, 16] {
            let errors = grids.map(|fog_froxels| {
                let settings = Settings { fog_froxels, fog_samples, ..foggy(96, 54) };
                error(&light(gpu, &scene, &settings), &wanted)
            });
            println!("{fog_samples} places: {errors:.4?}");
            assert!(errors.is_sorted_by(|coarse, fine| coarse > fine), "{errors:?}");
        }
    });
}

#[test]
fn panes_in_lit_fog_are_as_rays_have_them() {
    on_gpu(|gpu| {
        let mut scene = boards();
        let pane = |mode| Material { alpha: 0.4, alpha_mode: mode, base_color: Vec3::ZERO, ..Material::default() };
        for (mode, z) in [(AlphaMode::Blend, 0.4), (AlphaMode::Blend, 1.0)] {
            add(&mut scene, rectangle([-1.0, -0.4], [0.8, 0.7], z), pane(mode), DAffine3::IDENTITY);
        }
        for (transparency, light_path) in
            [(Transparency::Sorted, LightPath::Loop), (Transparency::Sorted, LightPath::Forward)]
        {
            let settings = Settings { transparency, light_path, fog_froxels: [48, 28, 32], ..foggy(48, 28) };
            let error = error(&light(gpu, &scene, &settings), &truth(&scene, &settings));
            println!("{transparency} {light_path}: {error}");
            assert!(error < 0.06, "{transparency} {light_path}: {error}");
        }
    });
}

/// At 64 places of a camera: how far a pixel's light from the air strays from that at the places before and after, and how much the light of the
/// whole picture changes, as shares of their means.
fn flicker(gpu: &Gpu, scene: &Scene, settings: &Settings, step: DVec3) -> [f64; 2] {
    let mut renderer = Renderer::new(&gpu.device, scene, settings).unwrap_or_else(|error| panic!("{error}"));
    let mut shown = |place: u32| {
        let (across, down) = (f64::from(place % 8), f64::from(place / 8));
        let aside = scene.camera.right() * (across * step.x) + scene.camera.up() * (down * step.y);
        let position = scene.camera.position + aside + scene.camera.forward() * (f64::from(place) * step.z);
        renderer.render(&Camera { position, ..scene.camera }).unwrap_or_else(|error| panic!("{error}"));
        linear(floats(&renderer.read_back().unwrap_or_else(|error| panic!("{error}"))))
    };
    let frames: Vec<Vec<DVec3>> = (0..64).map(&mut shown).collect();
    let pixel = |index: usize| {
        let values: Vec<f64> = frames.iter().map(|frame| frame[index].x).collect();
        // Noise of variance 1 gives these the variance 6.
        let bends = values.chunks(8).flat_map(|row| row.windows(3)).map(|own| own[0] - 2.0 * own[1] + own[2]);
        let variance = bends.map(|bend| bend * bend).sum::<f64>() / 48.0 / 6.0;
        variance.sqrt() / (values.iter().sum::<f64>() / 64.0)
    };
    let count = frames[0].len();
    let light = frames.iter().map(|frame| frame.iter().map(|own| own.x).sum::<f64>());
    let light: Vec<f64> = light.collect();
    let mean = light.iter().sum::<f64>() / 64.0;
    let bends = light.chunks(8).flat_map(|row| row.windows(3)).map(|own| own[0] - 2.0 * own[1] + own[2]);
    let variance = bends.map(|bend| bend * bend).sum::<f64>() / 48.0 / 6.0;
    [(0..count).map(pixel).sum::<f64>() / count as f64, variance.sqrt() / mean]
}

#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn a_camera_that_moves_does_not_make_lit_fog_flicker() {
    on_gpu(|gpu| {
        let scene = boards();
        // An eighth of a pixel at a distance of two metres, and a centimetre of a walk.
        let eighth = 2.0 / 28.0 / 8.0;
        for (name, step) in [("aside", DVec3::new(eighth, eighth, 0.0)), ("a walk", DVec3::new(0.0, 0.0, -0.01))] {
            let settings = Settings { fog_froxels: [24, 14, 16], ..foggy(48, 28) };
            let [pixel, picture] = flicker(gpu, &scene, &settings, step);
            println!("{name}: a pixel by {pixel:.5}, the picture by {picture:.5}");
            assert!(pixel < 0.02 && picture < 0.012, "{name}: {pixel} {picture}");
        }
    });
}
