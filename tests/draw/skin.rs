//! Deformed meshes: what SKIN writes on the device against the f64 mesh of the same moment, drawn as a plain one.

use afterlight::frame::Picture;
use afterlight::scene::{Playing, Scene, Settings};
use glam::DVec3;

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::moving::{SECONDS, moving};
use crate::common::stage::exact;

fn at(gpu: &Gpu, scene: &Scene, settings: &Settings, time: f64) -> Picture {
    let mut renderer = gpu.renderer(scene, settings);
    let pose = scene.motion.pose(&Playing { time, looped: false, ..Playing::default() });
    renderer.pose(scene, &pose).unwrap_or_else(|error| panic!("{error}"));
    renderer.picture(&scene.camera, || {}).unwrap_or_else(|error| panic!("{error}"))
}

/// Of all channels, how many pixels differ by more than `bound`, and the largest value.
fn differing(a: &Picture, b: &Picture, bound: f32) -> (usize, f32) {
    let pairs = floats(a).chunks(4).zip(floats(b).chunks(4));
    let far =
        |(a, b): &(&[f32], &[f32])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > bound || a.is_nan() || b.is_nan());
    (pairs.filter(far).count(), floats(a).iter().fold(0.0, |most: f32, value| most.max(value.abs())))
}

#[test]
fn a_deformed_mesh_is_the_f64_mesh_of_its_moment() {
    on_gpu(|gpu| {
        for place in [DVec3::ZERO, DVec3::new(3e6, 20.0, -1e6)] {
            let mut scene = moving(place);
            // Maps are fitted to boxes, and those of deformed meshes are wider than their vertices need.
            scene.lights.iter_mut().for_each(|light| light.casts_shadow = false);
            scene.check().unwrap_or_else(|error| panic!("{error}"));
            for step in 0..=8 {
                let time = SECONDS * f64::from(step) / 8.0;
                let still = scene.at(&Playing { time, looped: false, ..Playing::default() });
                let settings = exact(160, 120);
                let (found, expected) = (at(gpu, &scene, &settings, time), gpu.draw(&still, &settings));
                let (differing, brightest) = differing(&found, &expected, 1e-3);
                assert!(brightest > 0.1, "{place} {time}: nothing is lit");
                // Edges of triangles may fall on the other side of a pixel's centre.
                assert!(differing <= 8, "{place} {time}: {differing} pixels differ");
            }
        }
    });
}
