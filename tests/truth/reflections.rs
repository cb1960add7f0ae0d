//! The three errors of reflections: of frames against the f64 march of the same depths and the same lit picture, of frames against the scene's rays,
//! and of the march against the rays, which is the price of seeing no more than a screen does. Also the shares of rays that meet the surface that
//! they should.

use afterlight::scene::{Brdf, Output, Reflections, Scene, Settings, View};
use afterlight_truth::reference::depth_march::DepthBuffer;
use afterlight_truth::reference::light::Reflector;
use afterlight_truth::reference::reflections::{all_points, ambient_lobe, mirrored, smooth_enough};
use afterlight_truth::reference::screen_march::ScreenMarch;
use afterlight_truth::reference::{self, Reference, ShadingPoint, Smith};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::stage::{open, own};

fn shown(gpu: &Gpu, scene: &Scene, settings: &Settings, view: View) -> Vec<DVec3> {
    let picture = gpu.draw(scene, &Settings { view, output: Output::Nits, ..settings.clone() });
    floats(&picture)
        .chunks_exact(4)
        .map(|texel| DVec3::new(texel[0].into(), texel[1].into(), texel[2].into()))
        .collect()
}

/// Numbers of rays that pixels sent, by where they end.
#[derive(Debug, Default, Clone, Copy)]
struct Counts {
    /// Met within the tolerance of where the scene's ray does.
    right: u64,
    /// Met something else, or something where the scene's ray meets nothing.
    wrong: u64,
    /// Met nothing where the scene's ray does.
    missed: u64,
    /// Met nothing, as the scene's ray.
    open: u64,
}

impl Counts {
    fn add(self, other: Self) -> Self {
        let Self { right, wrong, missed, open } = other;
        Self {
            right: self.right + right,
            wrong: self.wrong + wrong,
            missed: self.missed + missed,
            open: self.open + open,
        }
    }

    fn shares(&self) -> [f64; 4] {
        let all = (self.right + self.wrong + self.missed + self.open).max(1);
        [self.right, self.wrong, self.missed, self.open].map(|own| own as f64 / all as f64)
    }
}

/// Light above this many means of a picture is white.
const WHITE: f64 = 4.0;

/// Pixels of a view with their truths: the light, in nits, that each gains, or loses, by mirroring others.
struct ReflectionTruths {
    pixels: Vec<usize>,
    /// The pixels' light without reflections.
    plain: Vec<DVec3>,
    rays: Vec<DVec3>,
    march: Vec<DVec3>,
    /// The mean light of the pixels, as rays have it, without the brightest fiftieth.
    mean: f64,
    counts: Counts,
}

/// Rows from the top.
fn at(index: usize, width: u32) -> [u32; 2] {
    [index as u32 % width, index as u32 / width]
}

fn middle(pixel: [u32; 2]) -> DVec2 {
    DVec2::from(pixel.map(f64::from)) + 0.5
}

fn grey(light: DVec3) -> f64 {
    light.element_sum() / 3.0
}

/// A tolerance of two pixels where the ray ends, and a hundredth of its length.
fn is_right(truth: DVec3, found: DVec3, from: DVec3, pixel_width: f64) -> bool {
    (truth - found).length() <= 2.0 * pixel_width * truth.length() + 0.01 * (truth - from).length()
}

impl ReflectionTruths {
    /// Takes a grid of the pixels that mirror something: about as many as a picture of `across` pixels has.
    fn of(gpu: &Gpu, scene: &Scene, settings: &Settings, across: u32) -> Self {
        let [width, height] = settings.size;
        let view = reference::CameraView { camera: scene.camera, size: settings.size };
        let roughest = settings.mirrored_roughness().expect("reflections");
        let off = Settings { reflections: Reflections::Off, ..settings.clone() };
        let normals = shown(gpu, scene, settings, View::Normal);
        let normals: Vec<DVec3> = normals.iter().map(|own| own.normalize_or_zero()).collect();
        let depths = shown(gpu, scene, settings, View::Depth);
        let distances: Vec<f64> = depths.iter().map(|at| if at.x > 0.0 { at.x } else { f64::INFINITY }).collect();
        let light = shown(gpu, scene, &off, View::Final);
        let plain = Reference::new(scene).expect("a scene").with_settings(&off, &scene.camera);
        let bounced = Reference::new(scene).expect("a scene").with_settings(settings, &scene.camera);
        let step = ((width / across) | 1) as usize;
        let is_asked = |index: usize| at(index, width).iter().all(|edge| *edge as usize % step == step / 2);
        let smooth = |index: &usize| {
            let (surface, _, distance) = plain.surface(&view, middle(at(*index, width)))?;
            let amount = smooth_enough(surface.roughness, roughest);
            // Pixels where frame and rays see different surfaces cannot be compared.
            let same = (distances[*index] / distance - 1.0).abs() < 1e-3;
            (surface.brdf == Brdf::CookTorrance && amount > 0.0 && same).then_some((*index, surface, amount))
        };
        let all: Vec<usize> = (0..(width * height) as usize).filter(|&index| is_asked(index)).collect();
        let chosen: Vec<(usize, ShadingPoint, f64)> = all.par_iter().filter_map(smooth).collect();
        let march = ScreenMarch {
            depth: DepthBuffer { view, distances: &distances },
            normals: &normals,
            light: &light,
            thickness: f64::from(settings.reflection_thickness),
        };
        let points = all_points();
        let rays: Vec<(DVec3, DVec3)> = chosen
            .par_iter()
            .map(|&(index, ..)| {
                let place = middle(at(index, width));
                let [with, without] =
                    [&bounced, &plain].map(|own| DVec3::from(own.light(&view, Smith::default(), place, place)));
                (with - without, without)
            })
            .collect();
        let marched = chosen
            .par_iter()
            .map(|(index, surface, amount)| {
                let lobe = Reflector::<f64>::new(surface, Smith::default()).collector();
                let (light, share) = march.mirrored(at(*index, width), &lobe, &points);
                (light - ambient_lobe(scene, surface) * share) * *amount
            })
            .collect();
        let pixel_width = 2.0 * scene.camera.half_height() / f64::from(height);
        let count = |(index, surface, _): &(usize, ShadingPoint, f64)| {
            let pixel = at(*index, width);
            let lobe = Reflector::<f64>::new(surface, Smith::default()).collector();
            let mut counts = Counts::default();
            for own in points.iter().take(16).filter_map(|&point| mirrored(&lobe, point)) {
                let truth = plain.met(&view, middle(pixel), own.direction);
                let found = march.met(pixel, lobe.normal, own.direction).and_then(|pixel| march.place_of(pixel));
                match (truth, found) {
                    (Some(truth), Some(found)) if is_right(truth, found, surface.position, pixel_width) => {
                        counts.right += 1
                    }
                    (_, Some(_)) => counts.wrong += 1,
                    (Some(_), None) => counts.missed += 1,
                    (None, None) => counts.open += 1,
                }
            }
            counts
        };
        let counts = chosen.par_iter().map(count).reduce(Counts::default, Counts::add);
        // Highlights would be most of a plain mean.
        let mut greys: Vec<f64> = rays.iter().map(|(delta, plain)| grey(*delta + *plain)).collect();
        greys.sort_by(f64::total_cmp);
        let inner = &greys[..greys.len() - greys.len() / 50];
        let mean = inner.iter().sum::<f64>() / inner.len() as f64;
        let pixels = chosen.iter().map(|(index, ..)| *index).collect();
        let (rays, plain) = rays.into_iter().unzip();
        Self { pixels, plain, rays, march: marched, mean, counts }
    }

    /// The root of the mean square between pictures with these differences, in means of the light. Light above white counts as white: mirrored
    /// highlights outshine all else by thousands.
    fn distance(&self, one: &[DVec3], other: &[DVec3]) -> f64 {
        let white = WHITE * self.mean;
        let square = |(index, plain): (usize, &DVec3)| {
            let [one, other] = [one[index], other[index]].map(|own| (*plain + own).min(DVec3::splat(white)));
            (one - other).length_squared() / 3.0
        };
        let sum: f64 = self.plain.iter().enumerate().map(square).sum();
        (sum / self.plain.len() as f64).sqrt() / self.mean
    }

    /// Returns the errors of frames: against the march, and against rays.
    fn errors(&self, gpu: &Gpu, scene: &Scene, settings: &Settings) -> [f64; 2] {
        let off = Settings { reflections: Reflections::Off, ..settings.clone() };
        let [with, without] = [settings, &off].map(|own| shown(gpu, scene, own, View::Final));
        let found: Vec<DVec3> = self.pixels.iter().map(|&index| with[index] - without[index]).collect();
        [self.distance(&found, &self.march), self.distance(&found, &self.rays)]
    }

    fn price(&self) -> f64 {
        self.distance(&self.march, &self.rays)
    }

    /// Returns the error of a picture without reflections.
    fn without(&self) -> f64 {
        let none = vec![DVec3::ZERO; self.rays.len()];
        self.distance(&none, &self.rays)
    }
}

/// A scene with nothing that only some truths have: its camera as it is, and no sky.
fn reflecting(spec: &str, [width, height]: [u32; 2]) -> (Scene, Settings) {
    let scene = open(spec);
    let settings = Settings {
        reflections: Reflections::Screen,
        samples: 1,
        exposure: Some(0.0),
        // All of Sponza's are rough.
        reflection_roughness: if spec.ends_with("sponza.obj") { 1.0 } else { 0.6 },
        brdf: Some(Brdf::CookTorrance),
        ..own(&scene, width, height)
    };
    (scene, settings)
}

fn table(gpu: &Gpu, spec: &str, size: [u32; 2], steps: &[u32]) -> (ReflectionTruths, Vec<[f64; 2]>) {
    let (scene, settings) = reflecting(spec, size);
    let truths = ReflectionTruths::of(gpu, &scene, &settings, 160);
    let [right, wrong, missed, open] = truths.counts.shares().map(|share| 100.0 * share);
    println!(
        "{spec} {}x{}: {} pixels mirror; without {:.4}, the march {:.4}",
        size[0],
        size[1],
        truths.pixels.len(),
        truths.without(),
        truths.price()
    );
    println!("  rays: right {right:.1}%, wrong {wrong:.1}%, missed {missed:.1}%, nothing to meet {open:.1}%");
    let rows = steps.iter().map(|&reflection_steps| {
        let errors = truths.errors(gpu, &scene, &Settings { reflection_steps, ..settings.clone() });
        println!("  {reflection_steps} steps: own {:.4}, against rays {:.4}", errors[0], errors[1]);
        errors
    });
    let rows = rows.collect();
    (truths, rows)
}

const SHOWN: &str = concat!(env!("AFTERLIGHT_ROOT"), "/assets/gallery/reflections.toml");

#[test]
fn frames_mirror_what_the_march_of_the_same_picture_does_and_are_nearer_to_rays_than_without() {
    on_gpu(|gpu| {
        let (truths, rows) = table(gpu, SHOWN, [160, 90], &[8, 64]);
        let [few, many] = [rows[0], rows[1]];
        assert!(many[0] < 0.5 * truths.without() && many[1] < 0.8 * truths.without(), "{rows:?} {}", truths.without());
        assert!(many[0] < few[0], "{rows:?}");
        let [right, wrong, ..] = truths.counts.shares();
        assert!(right > 0.3 && wrong < 0.1, "{:?}", truths.counts);
    });
}

/// `cargo test --test truth reflections::prints -- --ignored --nocapture` prints the figures of docs/REFLECTIONS.md.
#[test]
#[ignore = "prints a table for people"]
fn prints_the_errors_and_the_shares_of_rays() {
    on_gpu(|gpu| {
        let sponza = std::env::var("AFTERLIGHT_SCENES").map(|folder| format!("{folder}/crytek_sponza/sponza.obj"));
        let specs = [SHOWN, "builtin:hall", "builtin:spheres"].map(str::to_owned);
        for spec in specs.into_iter().chain(sponza.ok()) {
            table(gpu, &spec, [640, 360], &[16, 32, 64, 128, 256]);
        }
    });
}
