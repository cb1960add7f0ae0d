//! Pictures of the truth: a ray through each pixel, or many.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::geometry::{Geometry, Hit};
use super::intersect::Ray;
use super::light::{self, Collector, Collects, Illumination, Reflector};
use super::occlusion;
use super::rays::CameraRays;
use super::shadow::Receiver;
use super::sky::SkySampler;
use super::strokes::{Overlay, Strokes};
use super::surface::ShadingPoint;
use super::{CameraView, Effects, Lit, Mode, Smith, Truth, TruthOptions, material, sampling};
use afterlight_scene::{AlphaMode, Brdf, Camera, Error, Light, Scene, Settings, ThinLens, TriangleId};

/// Samples that are added to every pixel before the next pass begins. A pass depends on the samples' numbers alone.
pub const PASS: u32 = 4;

/// Called with the number of finished samples and the number of all samples.
pub type ProgressCallback<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// A scene that is ready to be looked at.
#[derive(Debug)]
pub struct Reference<'a> {
    pub(super) scene: &'a Scene,
    pub(super) brdf: Option<Brdf>,
    pub(super) shadows: bool,
    /// The sky, if it lights the scene.
    pub(super) sky: Option<SkySampler>,
    pub(super) sky_light: bool,
    pub(super) occludes_sky: bool,
    pub(super) effects: Effects,
    /// Probes of the air along a ray, of where lights are.
    pub(super) air_steps: u32,
    /// The lit particles, computed when first needed.
    pub(super) lit: OnceLock<Vec<Lit>>,
    /// The scene's lights, with directions of length 1.
    pub(super) lights: Vec<Light>,
    pub(super) geometry: Geometry<'a>,
    pub(super) lens: Option<ThinLens>,
}

/// Mean and spread of the samples of each pixel so far (Welford 1962).
#[derive(Debug, Clone, PartialEq)]
pub struct Accumulation {
    /// Samples of each pixel so far.
    pub samples: u32,
    /// Mean of the samples, rows from the top.
    pub mean: Vec<[f64; 3]>,
    /// Sum of the squared distances from the mean.
    pub squares: Vec<[f64; 3]>,
}

/// The points of a light that a sample asks.
#[derive(Debug, Clone, Copy)]
pub(super) enum Points {
    All,
    One { sample: u32, pixel: u64 },
}

/// The light of a sample, and the triangle seen there, if any.
struct TracedSample {
    radiance: DVec3,
    triangle: Option<TriangleId>,
}

impl<'a> Reference<'a> {
    /// Builds the trees and tables that rays need. Materials keep their own reflection models, and lights their shadows.
    ///
    /// # Errors
    /// When [`Scene::check`] finds a fault.
    pub fn new(scene: &'a Scene) -> Result<Self, Error> {
        scene.check()?;
        let lights = scene.lights.iter().map(Light::aimed).collect();
        let sky = scene.sky.as_ref().filter(|sky| sky.lights && sky.nits > 0.0).map(SkySampler::of);
        let geometry = Geometry::of(scene);
        Ok(Self {
            scene,
            brdf: None,
            shadows: true,
            sky,
            sky_light: true,
            occludes_sky: true,
            effects: Effects::default(),
            air_steps: super::air::STEPS,
            lit: OnceLock::new(),
            lights,
            geometry,
            lens: None,
        })
    }

    /// Takes over all settings that the truth has, and the lens of a camera.
    pub fn with_settings(self, settings: &Settings, camera: &Camera) -> Self {
        self.with_pinhole_settings(settings).with_lens(ThinLens::of(settings, camera))
    }

    /// Takes over all settings that the truth has but the lens: reflection model, shadows, light of the sky and effects.
    pub fn with_pinhole_settings(self, settings: &Settings) -> Self {
        self.with_brdf(settings.brdf)
            .with_shadows(settings.shadows.enabled)
            .with_sky_light(settings.sky_light)
            .with_effects(Effects::of(settings))
    }

    /// With one reflection model for all materials, as `Settings::brdf` has it.
    pub fn with_brdf(self, brdf: Option<Brdf>) -> Self {
        Self { brdf, ..self }
    }

    /// With light of the scene's sky or without, as `Settings::sky_light` has it.
    pub fn with_sky_light(self, sky_light: bool) -> Self {
        Self { sky_light, ..self }
    }

    /// Sets whether objects that cast shadows hide the sky. Otherwise all of it arrives everywhere, and its integrals are exact.
    pub fn with_occluded_sky(self, occludes_sky: bool) -> Self {
        Self { occludes_sky, ..self }
    }

    /// Sets the lens. Each sample of [`Mode::Converged`] has its own point of the lens; [`Mode::Point`] looks through the middle.
    pub fn with_lens(self, lens: Option<ThinLens>) -> Self {
        Self { lens, ..self }
    }

    /// Turns shadows on or off, as `ShadowSettings::enabled` does.
    pub fn with_shadows(self, shadows: bool) -> Self {
        Self { shadows, ..self }
    }

    /// Replaces all effects.
    pub fn with_effects(self, effects: Effects) -> Self {
        Self { effects, lit: OnceLock::new(), ..self }
    }

    pub(super) fn geometry(&self) -> &Geometry<'a> {
        &self.geometry
    }

    /// The nearest opaque surface at a place of the picture, in pixels from its upper left corner (the middle of the first one is at
    /// 0.5, 0.5), its triangle, and its distance along the view axis in metres. The surface's place is relative to the camera's.
    pub fn surface(&self, view: &CameraView, pixel: DVec2) -> Option<(ShadingPoint, TriangleId, f64)> {
        let rays = CameraRays::of(view);
        let ray = rays.ray(pixel);
        let hit = self.seen_on(&ray, &rays)?;
        let (surface, _) = self.surface_of(&hit, &ray);
        let surface = match rays.parallel {
            true => ShadingPoint {
                position: surface.position + (ray.origin - rays.eye),
                ray: Some(ray.direction),
                ..surface
            },
            false => surface,
        };
        Some((surface, self.geometry.triangles[hit.triangle].id, hit.crossing.distance))
    }

    /// Returns the share of a light that the nearest opaque surface there sees, 0 to 1; 1 where nothing is seen, and without shadows. A light with a
    /// size has [`sampling::DISC_POINTS`] points. For a light behind a surface that lets light through, the rays start at its back. Lights that cast
    /// no shadow and surfaces that receive none count as if they did. A tinted shadow counts with the colour that has the largest share.
    pub fn visibility(&self, view: &CameraView, pixel: DVec2, light: usize) -> f64 {
        if !self.shadows {
            return 1.0;
        }
        let rays = CameraRays::of(view);
        let ray = rays.ray(pixel);
        let hit = self.seen_on(&ray, &rays);
        hit.map_or(1.0, |hit| {
            let (surface, _) = self.surface_of(&hit, &ray);
            let receiver = Receiver::of(&self.geometry, &hit, &ray);
            self.share(&receiver.towards(&self.lights[light], &surface), light, Points::All).max_element()
        })
    }

    /// Share of the light from everywhere that the nearest opaque surface there sees, 0 to 1, by [`occlusion::RAYS`] rays of `radius` metres; 1 where
    /// nothing is seen. The surface's own [`ShadingPoint::occlusion`] does not count.
    pub fn ambient_visibility(&self, view: &CameraView, pixel: DVec2, radius: f64) -> f64 {
        let lens = CameraRays::of(view);
        let ray = lens.ray(pixel);
        let hit = self.seen_on(&ray, &lens);
        hit.map_or(1.0, |hit| {
            let (surface, _) = self.surface_of(&hit, &ray);
            let start = Receiver::of(&self.geometry, &hit, &ray).start;
            occlusion::visibility(&self.geometry, (start, surface.normal), radius, occlusion::RaySubset::All)
        })
    }

    /// Returns the light, in nits, of the surface at a place of the picture, sent along the ray through another place: as [`Mode::Point`] has it
    /// where both are the middle of a pixel.
    pub fn light(&self, view: &CameraView, smith: Smith, place: DVec2, along: DVec2) -> [f64; 3] {
        let rays = CameraRays::of(view);
        let along = Some(rays.ray(along).direction);
        let ray = rays.ray(place);
        let strokes = Strokes::unsorted(&self.geometry, &rays);
        let overlay = Overlay { billboards: self.billboards_on(&ray, &rays), strokes };
        self.look((&overlay, 0), (&ray, along), smith, Points::All, &mut Vec::new()).radiance.to_array()
    }

    /// Renders a picture. The result is the same to the last bit on any number of threads.
    pub fn render(&self, view: &CameraView, options: &TruthOptions, progress: ProgressCallback) -> Truth {
        match options.mode {
            Mode::Point => self.render_points(view, options.smith, progress),
            Mode::Converged { samples } => {
                let mut accumulation = Accumulation::new(view.size);
                let total = u64::from(samples) * accumulation.mean.len() as u64;
                while accumulation.samples < samples {
                    let count = PASS.min(samples - accumulation.samples);
                    self.accumulate(view, options.smith, count, &mut accumulation, &|done| progress(done, total));
                }
                accumulation.truth(view.size)
            }
        }
    }

    fn render_points(&self, view: &CameraView, smith: Smith, progress: ProgressCallback) -> Truth {
        let rays = CameraRays::of(view);
        let (width, height) = (view.size[0] as usize, view.size[1] as usize);
        let mut radiance = vec![[0.0; 3]; width * height];
        let mut triangles = vec![None; width * height];
        let done = std::sync::atomic::AtomicU64::new(0);
        let overlay = self.overlay(&rays);
        let rows = radiance.par_chunks_mut(width).zip(triangles.par_chunks_mut(width)).enumerate();
        rows.for_each_init(Vec::new, |transparent, (y, (radiance, triangles))| {
            for x in 0..width {
                let place = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let seen = self.look((&overlay, y), (&rays.ray(place), None), smith, Points::All, transparent);
                (radiance[x], triangles[x]) = (seen.radiance.to_array(), seen.triangle);
            }
            let before = done.fetch_add(width as u64, std::sync::atomic::Ordering::Relaxed);
            progress(before + width as u64, (width * height) as u64);
        });
        Truth { size: view.size, radiance, standard_error: None, triangles: Some(triangles) }
    }

    /// Adds the next `count` samples to every pixel. `progress` is told how many samples there are then, of all pixels together.
    pub fn accumulate(
        &self,
        view: &CameraView,
        smith: Smith,
        count: u32,
        accumulation: &mut Accumulation,
        progress: &(dyn Fn(u64) + Sync),
    ) {
        self.accumulate_some(view, (smith, count), &|_| true, accumulation, progress);
        accumulation.samples += count;
    }

    /// Adds samples to the pixels whose index `is_wanted` accepts, and leaves `accumulation.samples` to the caller.
    pub(super) fn accumulate_some(
        &self,
        view: &CameraView,
        (smith, count): (Smith, u32),
        is_wanted: &(dyn Fn(u64) -> bool + Sync),
        accumulation: &mut Accumulation,
        progress: &(dyn Fn(u64) + Sync),
    ) {
        let rays = CameraRays::of(view).with_lens(self.lens);
        let width = view.size[0] as usize;
        let first = accumulation.samples;
        let before = u64::from(first) * accumulation.mean.len() as u64;
        let done = std::sync::atomic::AtomicU64::new(before);
        let overlay = self.overlay(&rays);
        let rows = accumulation.mean.par_chunks_mut(width).zip(accumulation.squares.par_chunks_mut(width)).enumerate();
        rows.for_each_init(Vec::new, |transparent, (y, (means, squares))| {
            for x in 0..width {
                let corner = DVec2::new(x as f64, y as f64);
                let pixel = (y * width + x) as u64;
                if !is_wanted(pixel) {
                    continue;
                }
                for sample in first..first + count {
                    let place = corner + sampling::in_pixel(sample, pixel);
                    let points = Points::One { sample, pixel };
                    let ray = rays.through(place, || sampling::on_lens(sample, pixel));
                    let radiance = self.look((&overlay, y), (&ray, None), smith, points, transparent).radiance;
                    add(radiance, sample + 1, &mut means[x], &mut squares[x]);
                }
            }
            let added = u64::from(count) * width as u64;
            progress(done.fetch_add(added, std::sync::atomic::Ordering::Relaxed) + added);
        });
    }

    /// Returns the light at a place of the picture, in this row of it: the nearest opaque surface or the background, and over it transparent
    /// surfaces and particles, each in its place. [`ShadingPoint::ray`] is `along`.
    fn look(
        &self,
        (Overlay { billboards, strokes }, row): (&Overlay, usize),
        (ray, along): (&Ray, Option<DVec3>),
        smith: Smith,
        points: Points,
        transparent: &mut Vec<Hit>,
    ) -> TracedSample {
        let met = |visit: &mut dyn FnMut(Hit)| strokes.met(ray, row, visit);
        let nearest = self.geometry.seen_with(ray, billboards.near(), met, transparent);
        // Light from behind glass follows refracted rays.
        let glass = transparent.iter().enumerate().rev().find_map(|(at, hit)| Some((at, self.body_of(hit)?)));
        let behind = match (&glass, nearest) {
            (Some((at, body)), _) => self.passed(&transparent[*at], body, ray, (smith, points), 0),
            (None, None) => self.background(ray.direction),
            (None, Some(hit)) => {
                self.shown(&hit, (ray, along), smith, points, DVec3::ZERO)
                    + self.mirrored(&hit, (ray, along), smith, points)
            }
        };
        let first = glass.map_or(0, |(at, _)| at);
        let surface = match glass {
            Some((at, _)) => transparent[at].crossing.distance,
            None => nearest.map_or(f64::INFINITY, |hit| hit.crossing.distance),
        };
        // From the farthest on: each transparent layer is blended over the light that has come through the air before it.
        let (mut radiance, mut from) = (behind, surface);
        let mut through = |radiance: DVec3, near: f64| {
            self.passage(ray, [near, std::mem::replace(&mut from, near)], points).of(radiance)
        };
        let mut panes = transparent[first..].iter().peekable();
        let over = |behind, hit: &Hit| self.shown(hit, (ray, along), smith, points, behind);
        for layer in billboards.met(ray, row) {
            while let Some(hit) = panes.next_if(|hit| hit.crossing.distance >= layer.distance) {
                radiance = over(through(radiance, hit.crossing.distance), hit);
            }
            radiance = billboards.over(&layer, surface, through(radiance, layer.distance));
        }
        for hit in panes {
            radiance = over(through(radiance, hit.crossing.distance), hit);
        }
        let radiance = through(radiance, 0.0);
        TracedSample { radiance, triangle: nearest.map(|hit| self.geometry.triangles[hit.triangle].id) }
    }

    /// Returns the background along a direction of any length.
    pub(super) fn background(&self, direction: DVec3) -> DVec3 {
        match &self.scene.sky {
            Some(sky) if sky.shown => sky.seen(direction.normalize()),
            _ => self.scene.environment.background.as_dvec3(),
        }
    }

    pub(super) fn surface_of(&self, hit: &Hit, ray: &Ray) -> (ShadingPoint, AlphaMode) {
        let position = ray.direction * hit.crossing.distance;
        material::surface(self.scene, &self.geometry, hit, position, self.brdf)
    }

    /// Returns a surface's light towards the eye, blended over the light behind it.
    pub(super) fn shown(
        &self,
        hit: &Hit,
        (ray, along): (&Ray, Option<DVec3>),
        smith: Smith,
        points: Points,
        behind: DVec3,
    ) -> DVec3 {
        let (surface, mode) = self.surface_of(hit, ray);
        let open = self.open(hit, ray, (surface.normal, false), points);
        let transmits = surface.lobes.transmits();
        let open_behind = if transmits { self.open(hit, ray, (-surface.normal, true), points) } else { 1.0 };
        let surface = ShadingPoint { ray: along, ..surface };
        let (lights, environment) = (&self.lights, &self.scene.environment);
        let around = self.visible_sky(hit, ray, &surface, points);
        let sky = around.as_ref().map(|own| own as &dyn Collects);
        let illumination = Illumination { lights, environment, open, open_behind, eye: ray.origin, sky, smith };
        let mut receiver = None;
        let mut visibility = |light: usize| {
            if !self.shadows {
                return DVec3::ONE;
            }
            let receiver = receiver.get_or_insert_with(|| Receiver::of(&self.geometry, hit, ray));
            self.share(&receiver.towards(&self.lights[light], &surface), light, points)
        };
        let light = light::split_radiance::<f64>(&surface, &illumination, &mut visibility);
        match mode {
            AlphaMode::Opaque | AlphaMode::Mask { .. } => light.body + light.shine,
            AlphaMode::Blend => (light.body + light.shine) * surface.alpha + behind * (1.0 - surface.alpha),
            // Light that glass bends has its tint and its losses.
            AlphaMode::Glass if self.body_of(hit).is_some() => light.body * surface.alpha + light.shine + behind,
            AlphaMode::Glass => light.body * surface.alpha + light.shine + behind * (1.0 - surface.alpha),
            AlphaMode::Coat => {
                let share = surface.alpha * light::coat_share(&surface);
                light.shine * share + behind * (1.0 - share)
            }
        }
    }

    /// Light of the sky that is collected at a hit, where a sky lights the scene.
    pub(super) fn visible_sky(
        &self,
        hit: &Hit,
        ray: &Ray,
        surface: &ShadingPoint,
        points: Points,
    ) -> Option<VisibleSky<'_>> {
        let sky = self.sky.as_ref().filter(|_| self.sky_light)?;
        if !self.occludes_sky {
            return Some(VisibleSky { sky, rays: None });
        }
        let receiver = (self.shadows && surface.receives_shadow).then(|| Receiver::of(&self.geometry, hit, ray));
        Some(VisibleSky { sky, rays: Some((self, receiver, points)) })
    }

    /// Returns the sky's part of the light at the middle of a pixel, as [`Mode::Point`] has it, in nits: of the nearest opaque surface; zero without
    /// one.
    pub fn light_of_sky(&self, view: &CameraView, pixel: DVec2) -> [f64; 3] {
        let lens = CameraRays::of(view);
        let ray = lens.ray(pixel);
        let collected = || {
            let hit = self.seen_on(&ray, &lens)?;
            let (surface, _) = self.surface_of(&hit, &ray);
            let around = self.visible_sky(&hit, &ray, &surface, Points::All)?;
            let [base, lobe] = around.collected(&Reflector::<f64>::new(&surface, Smith::default()).collector());
            Some(((base + lobe) * surface.occlusion).to_array())
        };
        collected().unwrap_or_default()
    }

    /// Share of the light from everywhere that other surfaces leave, on the side of a normal.
    fn open(&self, hit: &Hit, ray: &Ray, (normal, is_behind): (DVec3, bool), points: Points) -> f64 {
        let Some(radius) = self.effects.occlusion.filter(|_| self.scene.environment.is_lit()) else { return 1.0 };
        let rays = match points {
            Points::All => occlusion::RaySubset::All,
            Points::One { sample, pixel } => occlusion::RaySubset::Of { sample, pixel },
        };
        let receiver = Receiver::of(&self.geometry, hit, ray);
        let start = if is_behind { receiver.behind().start } else { receiver.start };
        occlusion::visibility(&self.geometry, (start, normal), radius, rays)
    }

    /// Share of a light that arrives.
    pub(super) fn share(&self, receiver: &Receiver, index: usize, points: Points) -> DVec3 {
        let light = &self.lights[index];
        let sees = |point| receiver.way_to(light, point).map_or(DVec3::ONE, |(ray, limit)| self.left_by(&ray, limit));
        match points {
            _ if light.size == 0.0 => sees(DVec2::ZERO),
            Points::One { sample, pixel } => sees(sampling::on_disc(sample, pixel, index)),
            Points::All => {
                let count = sampling::DISC_POINTS;
                (0..count).map(|point| sees(sampling::stratum(point, index))).sum::<DVec3>() / f64::from(count)
            }
        }
    }
}

/// Light of the sky: all of it, or as far as objects leave it, by rays.
pub(super) struct VisibleSky<'a> {
    sky: &'a SkySampler,
    /// The receiver is none where nothing casts a shadow on the surface.
    rays: Option<(&'a Reference<'a>, Option<Receiver>, Points)>,
}

impl VisibleSky<'_> {
    /// Returns true if all of it arrives.
    pub(super) fn is_open(&self) -> bool {
        self.rays.as_ref().is_none_or(|(_, receiver, _)| receiver.is_none())
    }

    /// Returns the sky's light that a surface's lobe mirrors.
    pub(super) fn lobe(&self, surface: &Collector) -> DVec3 {
        let [_, lobe] = self.collected(surface);
        lobe
    }
}

impl Collects for VisibleSky<'_> {
    fn collected(&self, surface: &Collector) -> [DVec3; 2] {
        let Some((reference, receiver, points)) = &self.rays else { return self.sky.collected(surface) };
        let mut arrives = |direction| {
            let Some(own) = receiver else { return DVec3::ONE };
            let side = if surface.normal.dot(direction) < 0.0 { own.behind() } else { *own };
            reference.left_by(&Ray::new(side.start, direction), f64::INFINITY)
        };
        let mut estimate = |sample: u32, pixel: u64| {
            let points = [0, 1, 2].map(|strategy| sampling::on_sky(sample, pixel, strategy));
            self.sky.estimate(surface, points, &mut arrives)
        };
        match *points {
            Points::One { sample, pixel } => estimate(sample, pixel),
            Points::All => {
                let all = (0..sampling::SKY_POINTS).map(|sample| estimate(sample, 0));
                let sum = all.fold([DVec3::ZERO; 2], |sum, [base, lobe]| [sum[0] + base, sum[1] + lobe]);
                sum.map(|sum| sum / f64::from(sampling::SKY_POINTS))
            }
        }
    }
}

/// Adds the `count`th sample to a pixel's mean and spread.
fn add(radiance: DVec3, count: u32, mean: &mut [f64; 3], squares: &mut [f64; 3]) {
    for ((value, mean), squares) in radiance.to_array().into_iter().zip(mean).zip(squares) {
        let off = value - *mean;
        *mean += off / f64::from(count);
        *squares += off * (value - *mean);
    }
}

impl Accumulation {
    /// No samples yet, for a picture of this size.
    pub fn new(size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        Self { samples: 0, mean: vec![[0.0; 3]; pixels], squares: vec![[0.0; 3]; pixels] }
    }

    /// The picture so far. The standard error assumes independent samples; these are spread more evenly, so it is an upper bound, and not a tight
    /// one. A single sample has none.
    pub fn truth(self, size: [u32; 2]) -> Truth {
        let count = f64::from(self.samples);
        let error = |squares: &[f64; 3]| squares.map(|sum| (sum.max(0.0) / (count * (count - 1.0))).sqrt());
        let standard_error = (self.samples > 1).then(|| self.squares.iter().map(error).collect());
        Truth { size, radiance: self.mean, standard_error, triangles: None }
    }
}
