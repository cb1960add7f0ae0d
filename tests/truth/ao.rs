//! The three errors of ambient occlusion: of a pass against the f64 march of the same depths, of a pass against the scene's rays, and of the march
//! against the rays, which is the price of seeing no more than a screen does.

use afterlight::scene::{AmbientOcclusion, AoResolution, Output, Scene, Settings, View};
use afterlight_truth::reference::depth_march::{DepthBuffer, March};
use afterlight_truth::reference::{self, Reference};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::stage::{open, own};

/// Pixels of a view with their truths.
struct AoTruths {
    pixels: Vec<usize>,
    rays: Vec<f64>,
    march: Vec<f64>,
}

/// Errors of a pass, as root mean squares.
struct Errors {
    own: f64,
    rays: f64,
}

fn shown(gpu: &Gpu, scene: &Scene, settings: &Settings, view: View) -> Vec<[f64; 3]> {
    let picture = gpu.draw(scene, &Settings { view, output: Output::Nits, ..settings.clone() });
    floats(&picture).chunks_exact(4).map(|texel| [0, 1, 2].map(|channel| f64::from(texel[channel]))).collect()
}

fn root_mean_square(differences: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = differences.fold((0.0, 0), |(sum, count), own| (sum + own * own, count + 1));
    (sum / f64::from(count)).sqrt()
}

impl AoTruths {
    /// Takes a grid of the pixels with a surface: as many as a picture of 80 x 45 has.
    fn of(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Self {
        let [width, height] = settings.size;
        let (view, radius) =
            (reference::CameraView { camera: scene.camera, size: settings.size }, f64::from(settings.ao_radius));
        let normals = shown(gpu, scene, settings, View::Normal);
        let depths = shown(gpu, scene, settings, View::Depth);
        let distances: Vec<f64> = depths.iter().map(|at| if at[0] > 0.0 { at[0] } else { f64::INFINITY }).collect();
        // Odd, so that all of the 16 patterns of a tile are among them.
        let step = ((width / 80) | 1) as usize;
        let at = |index: usize| [index as u32 % width, index as u32 / width];
        let is_asked = |index: &usize| at(*index).iter().all(|edge| *edge as usize % step == step / 2);
        let pixels: Vec<usize> =
            (0..(width * height) as usize).filter(|index| is_asked(index) && distances[*index].is_finite()).collect();
        let (buffer, reference) =
            (DepthBuffer { view, distances: &distances }, Reference::new(scene).expect("a scene"));
        let middle = |index: usize| DVec2::from(at(index).map(f64::from)) + 0.5;
        let rays = pixels.par_iter().map(|&index| reference.ambient_visibility(&view, middle(index), radius)).collect();
        let march = pixels.par_iter().map(|&index| {
            let normal = DVec3::from_array(normals[index]).normalize();
            buffer.visibility(at(index), normal, &March::fine(radius))
        });
        let march = march.collect();
        Self { pixels, rays, march }
    }

    fn errors(&self, gpu: &Gpu, scene: &Scene, settings: &Settings) -> Errors {
        let found = shown(gpu, scene, settings, View::Ao);
        let against = |truth: &[f64]| {
            root_mean_square(self.pixels.iter().zip(truth).map(|(index, truth)| found[*index][0] - truth))
        };
        Errors { own: against(&self.march), rays: against(&self.rays) }
    }

    /// Returns the error of the march itself.
    fn price(&self) -> f64 {
        root_mean_square(self.march.iter().zip(&self.rays).map(|(march, rays)| march - rays))
    }
}

/// A row of docs/AO.md for each method.
fn table(gpu: &Gpu, spec: &str, [width, height]: [u32; 2], radius: f32) -> Vec<(String, Errors)> {
    let scene = open(spec);
    let base = Settings { ao: AmbientOcclusion::Bitmask, ao_radius: radius, samples: 1, ..own(&scene, width, height) };
    let truths = AoTruths::of(gpu, &scene, &base);
    let mean = truths.rays.iter().sum::<f64>() / truths.rays.len() as f64;
    let none = root_mean_square(truths.rays.iter().map(|rays| 1.0 - rays));
    println!(
        "{spec} {width}x{height}, {radius} m: {} places see {mean:.3}; without any {none:.4}",
        truths.pixels.len()
    );
    println!("  the march is off by {:.4}", truths.price());
    let ways = [
        (AmbientOcclusion::Ssao, 16, AoResolution::Full),
        (AmbientOcclusion::Ssao, 64, AoResolution::Full),
        (AmbientOcclusion::Bitmask, 8, AoResolution::Full),
        (AmbientOcclusion::Bitmask, 16, AoResolution::Full),
        (AmbientOcclusion::Bitmask, 32, AoResolution::Full),
        (AmbientOcclusion::Bitmask, 64, AoResolution::Full),
        (AmbientOcclusion::Bitmask, 16, AoResolution::Half),
    ];
    let row = |(ao, ao_samples, ao_resolution): (AmbientOcclusion, u32, AoResolution)| {
        let settings = Settings { ao, ao_samples, ao_resolution, ..base.clone() };
        let errors = truths.errors(gpu, &scene, &settings);
        let name = format!("{ao} {ao_samples} {ao_resolution}");
        println!("  {name}: own {:.4}, against rays {:.4}", errors.own, errors.rays);
        (name, errors)
    };
    ways.into_iter().map(row).collect()
}

#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn slices_are_nearer_to_rays_than_samples_of_the_hemisphere() {
    on_gpu(|gpu| {
        for (spec, radius) in [("builtin:hall", 0.5), ("builtin:spheres", 0.5), ("builtin:cornell", 0.5)] {
            let rows = table(gpu, spec, [320, 180], radius);
            let of = |name: &str| &rows.iter().find(|(own, _)| own == name).expect("a row").1;
            let (ssao, bitmask) = (of("ssao 16 full"), of("bitmask 16 full"));
            assert!(bitmask.own < 0.8 * ssao.own, "{spec}: {} {}", bitmask.own, ssao.own);
            assert!(bitmask.rays < 0.9 * ssao.rays, "{spec}: {} {}", bitmask.rays, ssao.rays);
            assert!(of("bitmask 64 full").own < bitmask.own && bitmask.own < of("bitmask 8 full").own, "{spec}");
        }
    });
}

/// `cargo test --test truth ao::prints -- --ignored --nocapture` prints the figures of docs/AO.md.
#[test]
#[ignore = "prints a table for people"]
fn prints_the_errors_of_larger_pictures() {
    on_gpu(|gpu| {
        for (spec, radius) in
            [("builtin:hall", 0.25), ("builtin:hall", 0.5), ("builtin:hall", 1.0), ("builtin:spheres", 0.5)]
        {
            table(gpu, spec, [1280, 720], radius);
        }
    });
}
