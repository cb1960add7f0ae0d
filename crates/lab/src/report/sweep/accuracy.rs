//! The difference of a point's pictures from the truth.
//!
//! Light is compared before it is tone-mapped: exposed, and read as 32-bit floats. The shown picture is compared in codes of 8 bits, against the
//! truth as tone-mapped by the reference's own curves. The light of a picture of several samples is their mean, and its shown picture follows
//! `resolve`. FXAA smooths only the shown picture: the light is the light before FXAA.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::error::SweepError;
use super::model::{ErrorMetrics, ErrorsByTruth, TruthInfo};
use afterlight::frame::{self, Pixels, Renderer};
use afterlight::gpu::Device;
use afterlight::scene::{Camera, Output, Scene, Settings, ev100_of, exposure_scale};
use afterlight_truth::measure::{LinearImage, RELATIVE_EPSILON, Srgb8Image, errors, flip, shown_errors};
use afterlight_truth::reference::{Cache, Cached, CameraView, Mode, Reference, Truth, TruthOptions};

/// The truths that a point's pictures are compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct TruthPictures {
    /// Exposed.
    pub light: LinearImage,
    pub shown: Srgb8Image,
}

/// Both truths of a view.
#[derive(Debug, Clone, PartialEq)]
pub struct Truths {
    pub point: TruthPictures,
    pub converged: TruthPictures,
    pub info: TruthInfo,
    /// A hash of all that the truths depend on.
    pub hash: String,
    /// The pictures as they were rendered, in nits, without bloom.
    pub raw: Raw,
    /// Faults of the cache, a line each. The truths are right all the same.
    pub warnings: Vec<String>,
}

/// Both truths in nits.
#[derive(Debug, Clone, PartialEq)]
pub struct Raw {
    pub point: Truth,
    pub converged: Truth,
}

/// The light and the picture that a point draws.
#[derive(Debug, Clone, PartialEq)]
pub struct PointPictures {
    pub light: LinearImage,
    pub shown: Shown,
}

/// The picture, with the memory of its frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    pub picture: Srgb8Image,
    /// Bytes on the device.
    pub memory: u64,
    pub gbuffer_bytes_per_pixel: u32,
}

impl TruthPictures {
    fn of(truth: &Truth, exposure: f64, settings: &Settings) -> Self {
        let light = LinearImage { size: truth.size, pixels: truth.radiance.clone() }.scaled(exposure);
        Self { shown: Srgb8Image { size: truth.size, pixels: truth.shown(exposure, settings) }, light }
    }
}

impl Raw {
    /// Renders both truths by a reference without fog and reflections.
    pub(super) fn plain(reference: &Reference, view: &CameraView, samples: u32) -> Self {
        let render = |mode| reference.render(view, &TruthOptions::of(mode), &|_, _| {});
        Self { point: render(Mode::Point), converged: render(Mode::Converged { samples }) }
    }
}

impl Truths {
    /// The name by which `progress` knows the truth of several samples.
    pub const CONVERGED: &'static str = "converged";

    /// Renders both, or reads them from the cache. The scene's lights cast shadows as the settings as given have it.
    ///
    /// # Errors
    /// When [`Scene::check`] finds a fault.
    pub fn of(
        scene: &Scene,
        view: &CameraView,
        settings: &Settings,
        samples: u32,
        progress: &(dyn Fn(&str, u64, u64) + Sync),
    ) -> Result<Self, SweepError> {
        let reference = Reference::new(scene).map_err(frame::Error::from)?;
        let reference = reference.with_settings(settings, &view.camera);
        let cache = Cache::of_user();
        let mut warnings = Vec::new();
        let mut render = |mode, what: &str| {
            let tell = |done, total| progress(what, done, total);
            let cached = Cached::render(cache.as_ref(), &reference, view, &TruthOptions::of(mode), &tell);
            warnings.extend(cached.warnings);
            cached.truth
        };
        let point = render(Mode::Point, "point");
        let converged = render(Mode::Converged { samples }, Self::CONVERGED);
        let exposure = f64::from(exposure_scale(ev100_of(scene, settings)));
        Ok(Self {
            point: TruthPictures::of(&point.clone().with_spread_light(settings), exposure, settings),
            converged: TruthPictures::of(&converged.clone().with_spread_light(settings), exposure, settings),
            info: info(&point, &converged, exposure, samples),
            hash: reference.fingerprint(view, &TruthOptions::of(Mode::Converged { samples })),
            raw: Raw { point, converged },
            warnings,
        })
    }

    /// Puts pictures of a device in a truth's place: an error against them lacks the part that both pictures share. A metric's own picture is enough.
    pub(in crate::report) fn of_pictures(light: Option<LinearImage>, shown: Option<Srgb8Image>) -> Self {
        let size = [0; 2];
        let light = light.unwrap_or(LinearImage { size, pixels: Vec::new() });
        let shown = shown.unwrap_or(Srgb8Image { size, pixels: Vec::new() });
        let expected = TruthPictures { light, shown };
        let truth = Truth { size, radiance: Vec::new(), standard_error: None, triangles: None };
        Self {
            point: expected.clone(),
            converged: expected,
            info: TruthInfo::unknown(1, None),
            hash: String::new(),
            raw: Raw { point: truth.clone(), converged: truth },
            warnings: Vec::new(),
        }
    }

    /// The error of the shown picture alone against the converged truth: FLIP and PSNR. Other figures are NaN, and pixels that are not finite are
    /// seen in light only.
    ///
    /// # Errors
    /// When the picture is of another size.
    pub fn error_shown(&self, picture: &Srgb8Image) -> Result<ErrorsByTruth, SweepError> {
        let psnr_db = shown_errors(picture, &self.converged.shown)?.psnr_db(1.0);
        let flip = flip(picture, &self.converged.shown)?.mean();
        let converged =
            ErrorMetrics { flip, psnr_db: Some(psnr_db).filter(|psnr| psnr.is_finite()), ..ErrorMetrics::UNKNOWN };
        Ok(ErrorsByTruth { point: ErrorMetrics::UNKNOWN, converged })
    }

    /// The error against the converged truth of light alone.
    ///
    /// # Errors
    /// When the picture is of another size.
    pub fn error_of_light(&self, light: &LinearImage) -> Result<ErrorsByTruth, SweepError> {
        let light = errors(light, &self.converged.light)?;
        let (rel_mse, rmse, max, p99_9, not_finite) =
            (light.rel_mse, light.rmse, light.max, light.p99_9, light.not_finite);
        let converged = ErrorMetrics { rel_mse, rmse, max, p99_9, not_finite, ..ErrorMetrics::UNKNOWN };
        Ok(ErrorsByTruth { point: ErrorMetrics::UNKNOWN, converged })
    }

    pub fn errors(&self, drawing: &PointPictures) -> Result<ErrorsByTruth, SweepError> {
        let against = |truth| move || errors_against(drawing, truth);
        let (point, converged) = rayon::join(against(&self.point), against(&self.converged));
        Ok(ErrorsByTruth { point: point?, converged: converged? })
    }
}

/// Returns the uncertainty of the truth, exposed.
fn info(point: &Truth, converged: &Truth, exposure: f64, samples: u32) -> TruthInfo {
    let (mut squares, mut relative) = (0.0, 0.0);
    let noise = converged.standard_error.as_deref().unwrap_or_default();
    for (error, mean) in noise.iter().zip(&converged.radiance) {
        for (error, mean) in error.iter().zip(mean) {
            let square = (error * exposure).powi(2);
            squares += square;
            relative += square / ((mean * exposure).powi(2) + RELATIVE_EPSILON);
        }
    }
    let count = (3 * noise.len()).max(1) as f64;
    let seen = point.triangles.as_deref().unwrap_or_default();
    let sky = seen.iter().filter(|triangle| triangle.is_none()).count() as f64 / seen.len().max(1) as f64;
    TruthInfo {
        samples,
        noise_rmse: (squares / count).sqrt(),
        noise_rel_mse: relative / count,
        sky,
        other_triangle: None,
        size: None,
    }
}

/// The size of a picture that tells how long a truth takes, and the samples of the first try.
const PILOT: ([u32; 2], u32) = ([96, 54], 2);
/// Pictures that take less time tell nothing: threads begin, and memory is read for the first time.
const LEAST_PILOT: Duration = Duration::from_millis(200);
/// The shortest edge at which errors are measured.
const LEAST_EDGE: u32 = 64;

/// The sizes at which errors may be measured: the size of the pictures, and that halved again and again.
pub fn sizes(of_pictures: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let is_large = |size: &[u32; 2]| size.iter().all(|&edge| edge >= 2 * LEAST_EDGE);
    let half = move |size: &[u32; 2]| is_large(size).then(|| size.map(|edge| edge.div_ceil(2)));
    std::iter::successors(Some(of_pictures), half)
}

/// Chooses the size at which errors are measured: the first of [`sizes`] at which a truth of `samples` samples takes at most `most`, as estimated from a
/// small picture.
pub fn affordable_size(reference: &Reference, view: &CameraView, samples: u32, most: Duration) -> [u32; 2] {
    let rays = |size: [u32; 2], samples: u32| f64::from(size[0]) * f64::from(size[1]) * f64::from(samples + 1);
    if rays(view.size, samples) <= rays(PILOT.0, 4 * PILOT.1) {
        return view.size;
    }
    let mut tried = PILOT.1;
    let seconds_a_ray = loop {
        let options = TruthOptions::of(Mode::Converged { samples: tried });
        let begun = Instant::now();
        reference.render(&CameraView { size: PILOT.0, ..*view }, &options, &|_, _| {});
        if begun.elapsed() >= LEAST_PILOT || tried >= samples {
            break begun.elapsed().as_secs_f64() / rays(PILOT.0, tried - 1);
        }
        tried *= 4;
    };
    let is_affordable = |size: &[u32; 2]| rays(*size, samples) * seconds_a_ray <= most.as_secs_f64();
    sizes(view.size).find(is_affordable).or_else(|| sizes(view.size).last()).unwrap_or(view.size)
}

fn errors_against(drawing: &PointPictures, expected: &TruthPictures) -> Result<ErrorMetrics, SweepError> {
    let picture = &drawing.shown.picture;
    let (light, (psnr_db, flip)) = rayon::join(
        || errors(&drawing.light, &expected.light),
        || rayon::join(|| shown_errors(picture, &expected.shown), || flip(picture, &expected.shown)),
    );
    let (light, psnr_db, flip) = (light?, psnr_db?.psnr_db(1.0), flip?.mean());
    Ok(ErrorMetrics {
        rel_mse: light.rel_mse,
        rmse: light.rmse,
        max: light.max,
        p99_9: light.p99_9,
        flip,
        psnr_db: Some(psnr_db).filter(|psnr| psnr.is_finite()),
        not_finite: light.not_finite,
    })
}

impl PointPictures {
    /// Draws the shown picture, and its light.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn of(device: &Arc<Device>, scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Self, SweepError> {
        let shown = Shown::of(device, scene, camera, settings)?;
        Ok(Self { light: light_of(device, scene, camera, settings)?, shown })
    }
}

impl Shown {
    /// Draws the shown picture.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn of(device: &Arc<Device>, scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Self, SweepError> {
        let before = bytes_on(device);
        let mut renderer = Renderer::new(device, scene, settings)?;
        let picture = shown_by(&mut renderer, camera, settings.size)?;
        let memory = bytes_on(device).saturating_sub(before);
        let gbuffer_bytes_per_pixel = renderer.plan().gbuffer_bytes_per_pixel();
        Ok(Self { picture, memory, gbuffer_bytes_per_pixel })
    }
}

/// Returns the picture that a renderer shows.
pub(in crate::report) fn shown_by(
    renderer: &mut Renderer,
    camera: &Camera,
    size: [u32; 2],
) -> Result<Srgb8Image, SweepError> {
    match renderer.picture(camera, || {})?.pixels {
        Pixels::Srgb8(rgba) => Ok(Srgb8Image::from_rgba(size, &rgba)),
        _ => Err(SweepError::Refused("a picture that is shown is linear".into())),
    }
}

/// Settings of exposed light, before FXAA.
pub(in crate::report) fn of_light(settings: &Settings) -> Settings {
    Settings { output: Output::Exposed, ..settings.without_effects() }
}

/// The light of a renderer of [`of_light`].
pub(in crate::report) fn light_by(
    renderer: &mut Renderer,
    camera: &Camera,
    size: [u32; 2],
) -> Result<LinearImage, SweepError> {
    match renderer.picture(camera, || {})?.pixels {
        Pixels::LinearF32(rgba) => Ok(LinearImage::from_rgba(size, &rgba)),
        _ => Err(SweepError::Refused("a linear picture is not linear".into())),
    }
}

fn light_of(
    device: &Arc<Device>,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
) -> Result<LinearImage, SweepError> {
    light_by(&mut Renderer::new(device, scene, &of_light(settings))?, camera, settings.size)
}

/// The share of pixels on which the raster and the truth see different triangles; `None` where the device does not number them.
///
/// # Errors
/// When the device is lost, or lacks the memory.
pub fn other_triangle(
    device: &Arc<Device>,
    scene: &Scene,
    camera: &Camera,
    settings: &Settings,
    point: &Truth,
) -> Result<Option<f64>, SweepError> {
    let Some(raster) = frame::triangles(device, (scene, None), camera, settings)? else { return Ok(None) };
    let seen = point.triangles.as_deref().unwrap_or_default();
    let other = raster.iter().zip(seen).filter(|(raster, truth)| raster != truth).count();
    Ok((!seen.is_empty()).then(|| other as f64 / seen.len() as f64))
}

fn bytes_on(device: &Device) -> u64 {
    // Retired objects that are not yet destroyed would count for the next renderer.
    device.collect();
    device.memory_report().bytes
}
