//! Particles in frames: the same for a moment whatever came before, counted, and gone without a trace.

use afterlight::scene::{Emitter, LightPath, Output, Playing, Scene, Settings, Transparency, View};
use glam::DVec3;

use crate::common::gpu::{Gpu, bytes, floats, on_gpu};
use crate::common::stage::{display, exact, lambert, plane, sun};

fn smoke() -> Scene {
    let mut scene = plane(lambert(0.5), vec![sun(DVec3::new(0.3, 0.5, 1.0), 2.0)]);
    scene.emitters = vec![Emitter {
        position: DVec3::new(0.0, -0.4, 0.4),
        extent: DVec3::new(0.4, 0.1, 0.2),
        // So many that SORT takes several steps.
        rate: 3000.0,
        spread: DVec3::splat(0.3),
        size: vec![0.05, 0.1],
        color: vec![[0.9, 0.6, 0.3, 0.5], [0.3, 0.6, 0.9, 0.0]],
        ..Emitter::default()
    }];
    scene
}

fn at(gpu: &Gpu, scene: &Scene, settings: &Settings, times: &[f64]) -> Vec<u8> {
    let mut renderer = gpu.renderer(scene, settings);
    for &time in times {
        renderer.pose(scene, &scene.motion.pose(&Playing::at(time))).unwrap_or_else(|error| panic!("{error}"));
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
    }
    bytes(&renderer.read_back().unwrap_or_else(|error| panic!("{error}"))).to_vec()
}

#[test]
fn a_moment_looks_the_same_whatever_frames_came_before() {
    on_gpu(|gpu| {
        let scene = smoke();
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            let settings = Settings { transparency, ..display(48, 32) };
            let alone = at(gpu, &scene, &settings, &[1e5]);
            assert!(alone == at(gpu, &scene, &settings, &[0.0, 3.0, 1e5 - 0.01, 1e5]), "{transparency}");
            assert!(alone != at(gpu, &scene, &settings, &[1e5 + 0.1]), "{transparency}");
            // And so does a scene that stands still at it.
            let still = scene.clone().into_still(&Playing::at(1e5));
            assert!(alone == bytes(&gpu.draw(&still, &settings)), "{transparency}");
        }
    });
}

#[test]
fn without_particles_nothing_is_left_of_them() {
    on_gpu(|gpu| {
        let (scene, bare) = (smoke(), Scene { emitters: Vec::new(), ..smoke() });
        let settings = Settings { light_path: LightPath::Loop, ..display(48, 32) };
        let off = Settings { particles: false, ..settings.clone() };
        let own = bytes(&gpu.draw(&bare, &settings)).to_vec();
        assert!(own == bytes(&gpu.draw(&scene, &off)));
        assert!(own != bytes(&gpu.draw(&scene, &settings)));
        let plans =
            [(&bare, &settings), (&scene, &off)].map(|(scene, settings)| gpu.renderer(scene, settings).plan().clone());
        assert!(plans[0].has_structure_of(&plans[1]) && plans[0].effects.particles.is_none() && plans[0].hdr.is_none());
        // Before the first is born there is none either, but an HDR target, which rounds.
        let mut late = smoke();
        late.emitters[0].start = Some(10.0);
        let late = gpu.draw(&late.into_still(&Playing::at(5.0)), &settings);
        let apart = own.iter().zip(bytes(&late)).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(apart.is_some_and(|most| most <= 1), "{apart:?}");
    });
}

/// Squares that do not move, in the middle of the picture: the view shows their number there.
#[test]
fn the_view_counts_layers() {
    on_gpu(|gpu| {
        let mut scene = smoke();
        let still =
            Emitter { extent: DVec3::ZERO, velocity: DVec3::ZERO, spread: DVec3::ZERO, ..scene.emitters[0].clone() };
        scene.emitters = vec![Emitter { rate: 6.5, size: vec![0.5], color: vec![[1.0; 4]], ..still.clone() }];
        // Behind the plane none is seen.
        let hidden = Emitter { position: DVec3::new(0.0, -0.4, -0.5), rate: 50.0, ..still };
        scene.emitters.push(hidden);
        let count = scene.emitters[0].alive(10.0).count;
        let scene = scene.into_still(&Playing::at(10.0));
        for light_path in [LightPath::Loop, LightPath::Forward] {
            let settings = Settings { view: View::Particles, output: Output::Nits, light_path, ..exact(33, 33) };
            let counted = floats(&gpu.draw(&scene, &settings)).to_vec();
            let most = counted.chunks_exact(4).map(|texel| texel[0]).fold(0.0f32, f32::max);
            assert_eq!(most, count as f32, "{light_path}");
            assert_eq!(counted[..3], [0.0; 3], "nothing else is seen");
        }
    });
}
