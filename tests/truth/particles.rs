//! Particles against their truth: the same closed form in 64 bits, rays for shadows, and layers in exact order.

use afterlight::scene::{
    AlphaMode, ColorSpace, Emitter, HdrFormat, LightPath, Material, Playing, Sampler, Scene, Settings, Texture,
    Transparency, Wrap,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::stage::{add, camera, exact, lambert, open, plane, point, rectangle, sun};

/// Errors as shares of the brightest channel of the truth: the root mean square and the worst.
struct Errors {
    rms: f64,
    worst: f64,
}

/// A scene in which nothing moves, drawn and held against the truth.
fn errors(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Errors {
    let settings = Settings { hdr_format: HdrFormat::Rgba32f, ..settings.clone() };
    let drawn = floats(&gpu.draw(scene, &settings)).to_vec();
    let reference = Reference::new(scene).expect("a scene").with_settings(&settings, &scene.camera);
    let view = CameraView { camera: scene.camera, size: settings.size };
    let options = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };
    let truth = reference.render(&view, &options, &|_, _| ()).radiance;
    let peak = truth.iter().flatten().fold(0.0f64, |most, &channel| most.max(channel));
    assert!(peak > 0.0 && drawn.iter().all(|value| value.is_finite()));
    let pairs = drawn
        .chunks_exact(4)
        .zip(&truth)
        .flat_map(|(drawn, truth)| (0..3).map(move |c| f64::from(drawn[c]) - truth[c]));
    let differences: Vec<f64> = pairs.map(|own| (own / peak).abs()).collect();
    let squares: f64 = differences.iter().map(|own| own * own).sum();
    Errors { rms: (squares / differences.len() as f64).sqrt(), worst: differences.iter().copied().fold(0.0, f64::max) }
}

/// A wall with a lamp and a sun that a screen keeps from a half, and smoke before it.
fn smoke() -> Scene {
    let mut scene = plane(
        lambert(0.6),
        vec![point(DVec3::new(0.6, 0.5, 0.8), 3.0, None, Default::default()), sun(DVec3::new(0.2, 0.4, 1.0), 2.0)],
    );
    scene.environment.ambient = Vec3::splat(0.1);
    add(&mut scene, rectangle([-0.9, -0.2], [-0.3, 0.8], 0.6), lambert(0.3), DAffine3::IDENTITY);
    scene.emitters = vec![
        Emitter {
            position: DVec3::new(0.0, -0.5, 0.3),
            extent: DVec3::new(0.5, 0.1, 0.2),
            rate: 80.0,
            life: 2.0,
            velocity: DVec3::new(0.1, 0.5, 0.0),
            spread: DVec3::splat(0.2),
            gravity: DVec3::new(0.0, 0.1, 0.0),
            drag: 0.3,
            size: vec![0.2, 0.5],
            color: vec![[0.9, 0.8, 0.7, 0.1], [0.6, 0.7, 0.9, 0.7], [0.5, 0.5, 0.5, 0.0]],
            softness: 0.2,
            seed: 1,
            ..Emitter::default()
        },
        Emitter {
            position: DVec3::new(-0.2, -0.3, 0.4),
            rate: 40.0,
            life: 1.0,
            spread: DVec3::splat(0.6),
            size: vec![0.08],
            emission: vec![Vec3::new(3.0, 1.0, 0.2), Vec3::ZERO],
            color: vec![[1.0, 1.0, 1.0, 0.9]],
            lit: false,
            softness: 0.02,
            seed: 2,
            ..Emitter::default()
        },
    ];
    scene.into_still(&Playing::at(12.3))
}

#[test]
fn sorted_particles_are_the_truth_but_for_single_floats_and_weights_err() {
    on_gpu(|gpu| {
        let scene = smoke();
        // Shadows of lamps with maps of many texels: only the closed form, the order and the light are left.
        let mut settings = exact(72, 48);
        settings.shadows.size = 2048;
        let of =
            |transparency, light_path| errors(gpu, &scene, &Settings { transparency, light_path, ..settings.clone() });
        let sorted = of(Transparency::Sorted, LightPath::Loop);
        println!("sorted: RMS {:.5}, worst {:.5}", sorted.rms, sorted.worst);
        assert!(sorted.rms < 4e-3 && sorted.worst < 0.12, "{} {}", sorted.rms, sorted.worst);
        let forward = of(Transparency::Sorted, LightPath::Forward);
        assert!((forward.rms - sorted.rms).abs() < 1e-4, "{} {}", forward.rms, sorted.rms);
        let weighted = of(Transparency::Oit, LightPath::Loop);
        println!("weighted: RMS {:.5}, worst {:.5}", weighted.rms, weighted.worst);
        assert!(weighted.rms > 2.0 * sorted.rms && weighted.rms < 0.1, "{}", weighted.rms);
        // Surfaces alone err as much, by edges of shadows: particles add nothing to that. The comparison notices such of another seed.
        let off = Settings { particles: false, ..settings.clone() };
        let without = errors(gpu, &Scene { emitters: Vec::new(), ..scene.clone() }, &off);
        assert!(without.rms < 6e-3 && sorted.rms < without.rms, "{}", without.rms);
        let mut other = scene.clone();
        other.emitters[0].seed = 99;
        let drawn = floats(&gpu.draw(&scene, &settings)).to_vec();
        let reseeded = floats(&gpu.draw(&other, &settings)).to_vec();
        let apart = drawn.iter().zip(&reseeded).filter(|(a, b)| (*a - *b).abs() > 0.02).count();
        assert!(apart > drawn.len() / 50, "{apart}");
    });
}

/// Cells of a texture, turned, before a lens with parallel rays, too.
#[test]
fn cells_of_textures_lie_where_the_truth_has_them() {
    on_gpu(|gpu| {
        // Four cells of different colours, each with a mark in one of its corners, and wide enough that no level is ever between two.
        let texel = |index: u32| {
            let (x, y) = (index % 64, index / 64);
            let mark = x % 32 < 12 && y % 32 < 12;
            let color = [[255, 40, 40], [40, 255, 40], [40, 40, 255], [255, 255, 40]][(y / 32 * 2 + x / 32) as usize];
            let [r, g, b] = if mark { [255; 3] } else { color };
            [r, g, b, 230]
        };
        let texels: Vec<u8> = (0..64 * 64).flat_map(texel).collect();
        let sampler = Sampler { wrap: [Wrap::Clamp; 2], ..Sampler::DEFAULT };
        let texture = Texture {
            name: "cells".into(),
            size: [64, 64],
            color_space: ColorSpace::Srgb,
            sampler,
            texels: texels.into(),
        };
        let mut scene = plane(lambert(0.5), vec![sun(DVec3::new(0.0, 0.0, 1.0), 3.0)]);
        scene.textures.push(texture);
        let usual = Emitter {
            texture: Some(0),
            frames: [2, 2],
            rate: 4.0,
            life: 1.0,
            velocity: DVec3::ZERO,
            ..Emitter::default()
        };
        scene.emitters = vec![
            Emitter {
                position: DVec3::new(-0.5, 0.0, 0.3),
                size: vec![0.9],
                turn_degrees: 180.0,
                extent: DVec3::splat(0.2),
                ..usual.clone()
            },
            Emitter {
                position: DVec3::new(0.7, 0.1, 0.5),
                size: vec![0.6],
                picks_frame: true,
                spin_degrees: 200.0,
                ..usual.clone()
            },
            // A disc among them.
            Emitter { position: DVec3::new(0.2, -0.4, 0.6), size: vec![0.5], texture: None, frames: [1, 1], ..usual },
        ];
        let scene = scene.into_still(&Playing::at(3.1));
        let own = errors(gpu, &scene, &Settings { light_path: LightPath::Loop, ..exact(96, 64) });
        println!("cells: RMS {:.5}, worst {:.5}", own.rms, own.worst);
        // Edges of squares and marks, a pixel wide, are where a rounding shows.
        assert!(own.rms < 0.03, "{} {}", own.rms, own.worst);
        let mut parallel = scene.clone();
        parallel.camera.projection = afterlight::scene::Projection::orthographic(2.0);
        for is_empty in [false, true] {
            // Particles before all surfaces, and without any.
            if is_empty {
                parallel.objects.clear();
            }
            let own = errors(gpu, &parallel, &Settings { light_path: LightPath::Loop, ..exact(96, 64) });
            assert!(own.rms < 0.03, "{} {}", own.rms, own.worst);
        }
    });
}

/// The failure that docs/PARTICLES.md shows: a pane before smoke is drawn behind it.
#[test]
fn what_lies_behind_a_pane_is_drawn_over_it() {
    on_gpu(|gpu| {
        let mut scene = smoke();
        let pane = Material {
            alpha: 0.8,
            alpha_mode: AlphaMode::Blend,
            base_color: Vec3::new(0.1, 0.3, 0.1),
            ..Material::default()
        };
        add(&mut scene, rectangle([-0.6, -0.7], [0.6, 0.7], 1.0), pane, DAffine3::IDENTITY);
        let settings = Settings { light_path: LightPath::Loop, ..exact(48, 32) };
        let before = errors(gpu, &scene, &settings);
        println!("behind a pane: RMS {:.4}", before.rms);
        assert!(before.rms > 0.01, "{}", before.rms);
        // Behind the smoke it is right.
        let last = scene.objects.len() - 1;
        scene.objects[last].transform = DAffine3::from_translation(DVec3::new(0.0, 0.0, -0.9));
        let behind = errors(gpu, &scene, &settings);
        assert!(behind.rms < 4e-3, "{}", behind.rms);
    });
}

/// The rows of docs/PARTICLES.md: `cargo test --test truth particles::prints -- --ignored --nocapture`.
#[test]
#[ignore = "prints figures of the documents"]
fn prints_the_errors_of_the_gallerys_scene() {
    on_gpu(|gpu| {
        let scene = open("assets/gallery/particles.toml").into_still(&Playing::at(20.0));
        for light_path in [LightPath::Loop, LightPath::Forward] {
            for transparency in [Transparency::Sorted, Transparency::Oit] {
                let own = errors(gpu, &scene, &Settings { light_path, transparency, ..exact(640, 400) });
                println!("{light_path} {transparency}: RMS {:.5}, worst {:.4} of the brightest", own.rms, own.worst);
            }
        }
        assert_eq!(camera().near, 0.125);
    });
}
