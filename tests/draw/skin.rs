//! Deformed meshes: SKIN's result on the device against the f64 mesh of the same moment, drawn as a plain mesh.

use afterlight::frame::Picture;
use afterlight::scene::{
    Channel, ChannelTarget, ClipChoice, Interpolation, LightValue, Local, MaterialValue, Playing, Scene, Settings,
};
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

/// Returns the number of pixels of which any channel differs by more than `bound`, and the largest value of all channels of `a`.
fn differing(a: &Picture, b: &Picture, bound: f32) -> (usize, f32) {
    let pairs = floats(a).chunks(4).zip(floats(b).chunks(4));
    let far =
        |(a, b): &(&[f32], &[f32])| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > bound || a.is_nan() || b.is_nan());
    (pairs.filter(far).count(), floats(a).iter().fold(0.0, |most: f32, value| most.max(value.abs())))
}

/// Gives every vertex the same colour, which a shape takes beyond the range of colours.
fn paint(scene: &mut Scene) {
    let ball = scene.meshes.iter_mut().find(|mesh| mesh.morphs.len() == 2).expect("the ball");
    let count = ball.positions.len();
    ball.colors = vec![[0.9, 0.5, 0.2, 1.0]; count];
    ball.morphs[0].colors = vec![[0.6, -0.2, -0.7, 0.0]; count];
}

#[test]
fn a_deformed_mesh_is_the_f64_mesh_of_its_moment() {
    on_gpu(|gpu| {
        let far = DVec3::new(3e6, 20.0, -1e6);
        for (place, mirror) in [(DVec3::ZERO, 1.0), (far, 1.0), (DVec3::ZERO, -1.0)] {
            let mut scene = moving(place);
            paint(&mut scene);
            if let Local::Parts(own) = &mut scene.motion.nodes[0].local {
                own.scale.x = mirror;
            }
            // Shadow maps are fitted to bounding boxes, and a deformed mesh has a wider box than its vertices need.
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

/// Materials and lights that a clip changes are drawn as in the still scene of the moment, and as the scene has them when no clip plays.
#[test]
fn materials_and_lights_change_with_their_clips_and_go_back() {
    on_gpu(|gpu| {
        let mut scene = moving(DVec3::ZERO);
        scene.lights.iter_mut().for_each(|light| light.casts_shadow = false);
        scene.materials[0].unlit = true;
        let channel = |target, values: &[f64]| Channel {
            target,
            times: vec![0.0, SECONDS],
            values: values.into(),
            interpolation: Interpolation::Linear,
        };
        scene.motion.clips[0].channels.extend([
            channel(ChannelTarget::Material(0, MaterialValue::BaseColor), &[0.1, 0.5, 0.2, 1.0, 0.9, 0.1, 0.4, 1.0]),
            channel(ChannelTarget::Material(3, MaterialValue::Emissive), &[0.0, 0.0, 0.0, 2.0, 1.0, 0.0]),
            channel(ChannelTarget::Light(0, LightValue::Intensity), &[3.0, 0.0]),
        ]);
        let settings = exact(80, 60);
        let mut renderer = gpu.renderer(&scene, &settings);
        let mut drawn = |playing: &Playing| {
            renderer.pose(&scene, &scene.motion.pose(playing)).unwrap_or_else(|error| panic!("{error}"));
            renderer.picture(&scene.camera, || {}).unwrap_or_else(|error| panic!("{error}"))
        };
        let playing = |time, clips| Playing { time, clips, looped: false };
        let (begin, end) = (playing(0.0, ClipChoice::All), playing(SECONDS, ClipChoice::All));
        for moment in [begin, end, playing(0.0, ClipChoice::None)] {
            let found = drawn(&moment);
            let (differing, brightest) = differing(&found, &gpu.draw(&scene.at(&moment), &settings), 1e-3);
            assert!(differing <= 8 && brightest > 0.1, "{moment:?}: {differing} pixels differ, at most {brightest}");
        }
    });
}
