//! Pictures of the truth: a ray through each pixel, or many.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::geometry::{Geometry, Hit};
use super::intersect::Ray;
use super::light::{self, Illumination};
use super::shadow::Receiver;
use super::surface::Surface;
use super::{Mode, Options, Smith, Truth, View, material, sampling};
use crate::scene::{AlphaMode, Brdf, Error, Light, Scene, TriangleId};

/// Samples that are added to every pixel before the next pass begins. What a pass adds depends on the samples' numbers alone.
pub const PASS: u32 = 4;

/// Told how many samples of how many are done.
pub type Progress<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// A scene that is ready to be looked at.
#[derive(Debug)]
pub struct Reference<'a> {
    pub(super) scene: &'a Scene,
    pub(super) brdf: Option<Brdf>,
    pub(super) shadows: bool,
    /// With directions of length 1.
    lights: Vec<Light>,
    geometry: Geometry<'a>,
}

/// Mean and spread of the samples of each pixel so far (Welford 1962).
#[derive(Debug, Clone, PartialEq)]
pub struct Accumulation {
    /// Samples of each pixel so far.
    pub samples: u32,
    /// Their mean, rows from the top.
    pub mean: Vec<[f64; 3]>,
    /// Sum of the squared distances from the mean.
    pub squares: Vec<[f64; 3]>,
}

/// A view that is decided: rays through a picture.
#[derive(Debug, Clone, Copy)]
struct Lens {
    size: DVec2,
    near: f64,
    eye: DVec3,
    forward: DVec3,
    /// From the middle of the picture to its right and lower edges: at a distance of 1, or anywhere where rays are parallel.
    right: DVec3,
    down: DVec3,
    parallel: bool,
}

/// Which points of a light a sample asks.
#[derive(Debug, Clone, Copy)]
enum Points {
    All,
    One { sample: u32, pixel: u64 },
}

/// What is beneath a sample.
struct Seen {
    radiance: DVec3,
    triangle: Option<TriangleId>,
}

impl Lens {
    fn of(view: &View) -> Self {
        let camera = &view.camera;
        let size = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1]));
        let half = camera.half_height();
        Self {
            size,
            near: camera.near,
            eye: camera.position,
            forward: camera.forward(),
            right: camera.right() * (half * size.x / size.y),
            down: -camera.up() * half,
            parallel: camera.is_orthographic(),
        }
    }

    /// Through a place of the picture, in pixels from its upper left corner. Distances along it are distances along the view. Where rays are
    /// parallel, what looks along one looks from where it begins.
    fn ray(&self, place: DVec2) -> Ray {
        let at = place * 2.0 / self.size - 1.0;
        let aside = self.right * at.x + self.down * at.y;
        match self.parallel {
            true => Ray::new(self.eye + aside, self.forward),
            false => Ray::new(self.eye, self.forward + aside),
        }
    }
}

impl<'a> Reference<'a> {
    /// Builds what rays need. Materials keep their own reflection models, and lights their shadows.
    ///
    /// # Errors
    /// When [`Scene::check`] finds a fault.
    pub fn new(scene: &'a Scene) -> Result<Self, Error> {
        scene.check()?;
        let lights = scene.lights.iter().map(Light::aimed).collect();
        Ok(Self { scene, brdf: None, shadows: true, lights, geometry: Geometry::of(scene) })
    }

    /// With one reflection model for all materials, as `Settings::brdf` has it.
    pub fn with_brdf(self, brdf: Option<Brdf>) -> Self {
        Self { brdf, ..self }
    }

    /// With shadows or without any, as `ShadowSettings::enabled` has it.
    pub fn with_shadows(self, shadows: bool) -> Self {
        Self { shadows, ..self }
    }

    /// The nearest opaque surface at a place of the picture, in pixels from its upper left corner (the middle of the first one is at
    /// 0.5, 0.5), its triangle, and its distance along the view axis in metres. The surface's place is relative to the camera's.
    pub fn surface(&self, view: &View, pixel: DVec2) -> Option<(Surface, TriangleId, f64)> {
        let lens = Lens::of(view);
        let ray = lens.ray(pixel);
        let hit = self.geometry.seen(&ray, lens.near, &mut Vec::new())?;
        let (surface, _) = self.surface_of(&hit, &ray);
        let surface = match lens.parallel {
            true => {
                Surface { position: surface.position + (ray.origin - lens.eye), ray: Some(ray.direction), ..surface }
            }
            false => surface,
        };
        Some((surface, self.geometry.triangles[hit.triangle].id, hit.crossing.distance))
    }

    /// Share of a light that the nearest opaque surface there sees, 0 to 1, by [`sampling::DISC_POINTS`] points of a light that has a
    /// size; 1 where nothing is seen, and without shadows. Whether the light casts any, or the surface receives some, is not asked.
    pub fn visibility(&self, view: &View, pixel: DVec2, light: usize) -> f64 {
        if !self.shadows {
            return 1.0;
        }
        let lens = Lens::of(view);
        let ray = lens.ray(pixel);
        let hit = self.geometry.seen(&ray, lens.near, &mut Vec::new());
        hit.map_or(1.0, |hit| self.share(&Receiver::of(&self.geometry, &hit, &ray), light, Points::All))
    }

    /// The light, in nits, that what is seen at a place of the picture sends along the ray through another, as [`Mode::Point`] has it where both
    /// are the middle of a pixel.
    pub fn light(&self, view: &View, smith: Smith, place: DVec2, along: DVec2) -> [f64; 3] {
        let lens = Lens::of(view);
        let along = Some(lens.ray(along).direction);
        self.look(&lens, place, smith, Points::All, along, &mut Vec::new()).radiance.to_array()
    }

    /// Renders a picture. The same on any number of threads, to the last bit.
    pub fn render(&self, view: &View, options: &Options, progress: Progress) -> Truth {
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

    fn render_points(&self, view: &View, smith: Smith, progress: Progress) -> Truth {
        let lens = Lens::of(view);
        let (width, height) = (view.size[0] as usize, view.size[1] as usize);
        let mut radiance = vec![[0.0; 3]; width * height];
        let mut triangles = vec![None; width * height];
        let done = std::sync::atomic::AtomicU64::new(0);
        let rows = radiance.par_chunks_mut(width).zip(triangles.par_chunks_mut(width)).enumerate();
        rows.for_each_init(Vec::new, |transparent, (y, (radiance, triangles))| {
            for x in 0..width {
                let place = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let seen = self.look(&lens, place, smith, Points::All, None, transparent);
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
        view: &View,
        smith: Smith,
        count: u32,
        accumulation: &mut Accumulation,
        progress: &(dyn Fn(u64) + Sync),
    ) {
        let lens = Lens::of(view);
        let width = view.size[0] as usize;
        let first = accumulation.samples;
        let before = u64::from(first) * accumulation.mean.len() as u64;
        let done = std::sync::atomic::AtomicU64::new(before);
        let rows = accumulation.mean.par_chunks_mut(width).zip(accumulation.squares.par_chunks_mut(width)).enumerate();
        rows.for_each_init(Vec::new, |transparent, (y, (means, squares))| {
            for x in 0..width {
                let corner = DVec2::new(x as f64, y as f64);
                let pixel = (y * width + x) as u64;
                for sample in first..first + count {
                    let place = corner + sampling::in_pixel(sample, pixel);
                    let points = Points::One { sample, pixel };
                    let radiance = self.look(&lens, place, smith, points, None, transparent).radiance;
                    add(radiance, sample + 1, &mut means[x], &mut squares[x]);
                }
            }
            let added = u64::from(count) * width as u64;
            progress(done.fetch_add(added, std::sync::atomic::Ordering::Relaxed) + added);
        });
        accumulation.samples += count;
    }

    /// What comes to the eye at a place of the picture: the nearest opaque surface or the background, and over it what is transparent.
    /// [`Surface::ray`] is `along`.
    fn look(
        &self,
        lens: &Lens,
        place: DVec2,
        smith: Smith,
        points: Points,
        along: Option<DVec3>,
        transparent: &mut Vec<Hit>,
    ) -> Seen {
        let ray = lens.ray(place);
        let nearest = self.geometry.seen(&ray, lens.near, transparent);
        let background = self.scene.environment.background.as_dvec3();
        let behind = nearest.map_or(background, |hit| self.shown(&hit, (&ray, along), smith, points, DVec3::ZERO));
        let over = |behind, hit: &Hit| self.shown(hit, (&ray, along), smith, points, behind);
        let radiance = transparent.iter().fold(behind, over);
        Seen { radiance, triangle: nearest.map(|hit| self.geometry.triangles[hit.triangle].id) }
    }

    fn surface_of(&self, hit: &Hit, ray: &Ray) -> (Surface, AlphaMode) {
        let position = ray.direction * hit.crossing.distance;
        material::surface(self.scene, &self.geometry, hit, position, self.brdf)
    }

    /// What a surface shows towards the eye, over what lies behind it.
    fn shown(
        &self,
        hit: &Hit,
        (ray, along): (&Ray, Option<DVec3>),
        smith: Smith,
        points: Points,
        behind: DVec3,
    ) -> DVec3 {
        let (surface, mode) = self.surface_of(hit, ray);
        let surface = Surface { ray: along, ..surface };
        let (lights, environment) = (&self.lights, &self.scene.environment);
        let illumination = Illumination { lights, environment, eye: ray.origin, smith };
        let mut receiver = None;
        let mut visibility = |light: usize| {
            if !self.shadows {
                return 1.0;
            }
            let receiver = receiver.get_or_insert_with(|| Receiver::of(&self.geometry, hit, ray));
            self.share(receiver, light, points)
        };
        let light = light::split_radiance::<f64>(&surface, &illumination, &mut visibility);
        match mode {
            AlphaMode::Opaque | AlphaMode::Mask { .. } => light.body + light.shine,
            AlphaMode::Blend => (light.body + light.shine) * surface.alpha + behind * (1.0 - surface.alpha),
            AlphaMode::Glass => light.body * surface.alpha + light.shine + behind * (1.0 - surface.alpha),
            AlphaMode::Coat => {
                let share = surface.alpha * light::coat_share(&surface);
                light.shine * share + behind * (1.0 - share)
            }
        }
    }

    /// Share of a light that arrives.
    fn share(&self, receiver: &Receiver, index: usize, points: Points) -> f64 {
        let light = &self.lights[index];
        let sees = |point| f64::from(u8::from(receiver.sees(&self.geometry, light, point)));
        match points {
            _ if light.size == 0.0 => sees(DVec2::ZERO),
            Points::One { sample, pixel } => sees(sampling::on_disc(sample, pixel, index)),
            Points::All => {
                let count = sampling::DISC_POINTS;
                (0..count).map(|point| sees(sampling::stratum(point, index))).sum::<f64>() / f64::from(count)
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

    /// The picture so far. The standard error is that of independent samples; these are spread more evenly, so that it bounds theirs
    /// from above, and not tightly. A single sample has none.
    pub fn truth(self, size: [u32; 2]) -> Truth {
        let count = f64::from(self.samples);
        let error = |squares: &[f64; 3]| squares.map(|sum| (sum.max(0.0) / (count * (count - 1.0))).sqrt());
        let standard_error = (self.samples > 1).then(|| self.squares.iter().map(error).collect());
        Truth { size, radiance: self.mean, standard_error, triangles: None }
    }
}
