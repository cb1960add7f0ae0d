//! The contents of a report: the value that `report.json` is, and that pages, tables and plots are made from.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize};

use afterlight_truth::measure::still_moving;
pub use afterlight_truth::measure::{MedianInterval as Interval, Shard};

/// The version of the JSON's layout: a merge refuses parts with another layout.
pub const LAYOUT: u32 = 4;

/// One or several scenes on one device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub layout: u32,
    /// The program's version.
    pub version: String,
    pub machine: Machine,
    /// The shard that this is, and of how many; `None` for all of it.
    pub shard: Option<Shard>,
    pub scenes: Vec<SceneReport>,
}

/// The machine on which the times were taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    pub device: String,
    pub driver: String,
    /// A CPU draws: times are wall clock, and CPU seconds are told.
    pub software: bool,
    pub os: String,
    pub cpu: String,
    /// Threads that this process may use.
    pub threads: usize,
    /// Threads that a software driver draws with.
    pub driver_threads: Option<usize>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneReport {
    pub name: String,
    pub size: [u32; 2],
    /// With `true` every timed frame draws all shadow maps; with `false` frames keep them.
    pub moving: bool,
    /// Batches of frames that began before the device's clocks had settled, and all batches.
    #[serde(default)]
    pub clocks_moving: [usize; 2],
    pub triangles: usize,
    pub lights: usize,
    pub truth: TruthInfo,
    /// The points that are measured, each once, in the order of the sweep; families name them by their index.
    pub points: Vec<Point>,
    pub families: Vec<Family>,
    /// Index of the default settings' point.
    pub default: usize,
    /// The points on the front, by error metric and truth.
    pub fronts: Vec<Front>,
    pub attributions: Vec<Attribution>,
    /// Settings that this device or scene cannot have, and why.
    pub left_out: Vec<LeftOut>,
}

impl SceneReport {
    /// Returns a sentence about clocks that had not settled before frames were timed; `None` where they had.
    pub fn clocks(&self) -> Option<String> {
        let [moving, batches] = self.clocks_moving;
        still_moving(moving, batches)
    }
}

/// The accuracy of the truth itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TruthInfo {
    pub samples: u32,
    /// Root mean square of the standard error of `converged`, exposed: errors near it are not told apart from noise.
    #[serde(deserialize_with = "real")]
    pub noise_rmse: f64,
    /// The noise as `noise_rmse`, for relMSE.
    #[serde(deserialize_with = "real")]
    pub noise_rel_mse: f64,
    /// Shares of the pixels, 0 to 1.
    pub sky: f64,
    /// The share of pixels on which the raster with the default settings and the truth see different triangles; `None` where the device cannot tell.
    pub other_triangle: Option<f64>,
    /// The size at which errors are measured, where it differs from the scene's size.
    #[serde(default)]
    pub size: Option<[u32; 2]>,
}

impl TruthInfo {
    /// What is known of a truth that is still being rendered.
    pub fn unknown(samples: u32, size: Option<[u32; 2]>) -> Self {
        Self { samples, noise_rmse: 0.0, noise_rel_mse: 0.0, sky: 0.0, other_triangle: None, size }
    }

    /// The noise of `converged` in the measure of this metric; `None` if it is not known.
    pub fn noise(&self, metric: Metric) -> Option<f64> {
        match metric {
            Metric::RelMse => Some(self.noise_rel_mse),
            Metric::Rmse => Some(self.noise_rmse),
            Metric::Flip => None,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The settings that differ from the scene's own, as `--vary` takes them, as `gbuffer=fat shadow-size=1024`; "default" for none.
    pub name: String,
    pub errors: ErrorsByTruth,
    pub time: Timing,
    /// Memory on the device, in bytes.
    pub memory: u64,
    pub gbuffer_bytes_per_pixel: u32,
    /// PNG files beside the report, by their contents: "picture", "difference".
    pub pictures: BTreeMap<String, String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorsByTruth {
    /// Without the error of one sample a pixel: numeric error, and the filtering of textures.
    pub point: ErrorMetrics,
    /// All of it.
    pub converged: ErrorMetrics,
}

/// A figure that is not finite is null in JSON, and NaN when it is read again.
fn real<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Linear figures are of exposed light: 1 is where the sensor saturates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorMetrics {
    #[serde(deserialize_with = "real")]
    pub rel_mse: f64,
    #[serde(deserialize_with = "real")]
    pub rmse: f64,
    #[serde(deserialize_with = "real")]
    pub max: f64,
    #[serde(deserialize_with = "real")]
    pub p99_9: f64,
    /// Mean FLIP of the tone-mapped pictures, 0 to 1.
    #[serde(deserialize_with = "real")]
    pub flip: f64,
    /// Of the tone-mapped pictures, in decibels; `None` where they are equal.
    pub psnr_db: Option<f64>,
    /// Pixels with a value that is NaN or infinite.
    pub not_finite: usize,
}

/// Milliseconds a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// The time from the start of recording until the device is done.
    pub wall: Interval,
    /// The time by the device's own clock; `None` on CPU devices.
    pub gpu: Option<Interval>,
    /// CPU time of the process; on CPU devices only.
    pub cpu: Option<Interval>,
    /// The time that counts over the time of the settings as given, in the same rounds; 1 for the settings as given. It is surer than milliseconds,
    /// which also carry the uncertainty of the settings as given.
    pub ratio: Interval,
    /// True if the point was measured again since it was found to be on a front; the figures are then from the second time. The settings as given are
    /// in every batch, and their figures are from all batches: some of these measured a front again.
    pub confirmed: bool,
}

impl Timing {
    /// The time that counts: the device's own where that means something, else the wall clock's.
    pub fn decisive(&self) -> &Interval {
        self.gpu.as_ref().unwrap_or(&self.wall)
    }
}

/// A curve of error against time: one setting changes, or all together ("joint").
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Family {
    /// As `shadow-size`.
    pub key: String,
    pub title: String,
    pub members: Vec<Member>,
    /// `None` if theory has no order of convergence.
    pub convergence: Option<Convergence>,
    /// The reason why the curve falls no further, in a sentence.
    pub floor: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// Index in [`SceneReport::points`].
    pub point: usize,
    /// Short, as "1024" or "fat".
    pub label: String,
    /// `None` if the members are not numbers.
    pub value: Option<f64>,
}

/// error = a value^-order + floor, fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Convergence {
    pub metric: Metric,
    pub truth: Against,
    pub order: f64,
    /// 95% interval of the order.
    pub low: f64,
    pub high: f64,
    pub floor: f64,
    /// The order that theory expects, and the source.
    pub expected: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    RelMse,
    Rmse,
    Flip,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Against {
    Point,
    Converged,
}

impl ErrorMetrics {
    /// The errors of pictures that nobody has compared.
    pub const UNKNOWN: Self = Self {
        rel_mse: f64::NAN,
        rmse: f64::NAN,
        max: f64::NAN,
        p99_9: f64::NAN,
        flip: f64::NAN,
        psnr_db: None,
        not_finite: 0,
    };

    /// Returns true if light and shown picture have both been compared.
    pub fn is_whole(&self) -> bool {
        self.not_finite > 0 || !(self.rmse.is_nan() || self.flip.is_nan())
    }

    /// Returns the error that fronts and bounds compare: infinite where a pixel is not finite, since metrics leave such pixels out.
    pub fn comparable(&self, metric: Metric) -> f64 {
        if self.not_finite > 0 { f64::INFINITY } else { self.by(metric) }
    }

    /// The error over the pixels that are finite.
    pub fn by(&self, metric: Metric) -> f64 {
        match metric {
            Metric::RelMse => self.rel_mse,
            Metric::Rmse => self.rmse,
            Metric::Flip => self.flip,
        }
    }
}

impl ErrorsByTruth {
    pub fn against(&self, truth: Against) -> &ErrorMetrics {
        match truth {
            Against::Point => &self.point,
            Against::Converged => &self.converged,
        }
    }
}

/// The points that no other beats in both error and time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Front {
    pub metric: Metric,
    pub truth: Against,
    /// Indices of points, the fastest first.
    pub points: Vec<usize>,
    /// For each point of the scene: how probable it is that it is on the front, by bootstrap over its times.
    pub probability: Vec<f64>,
}

/// A point's place, on the front or off it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// The point is on the front, more probably than not.
    On,
    /// The point is on the front by the figures at hand, but more probably not.
    Perhaps,
    Off,
}

impl Front {
    pub fn standing(&self, point: usize) -> Standing {
        match self.probability.get(point) {
            _ if !self.points.contains(&point) => Standing::Off,
            Some(probability) if *probability < 0.5 => Standing::Perhaps,
            _ => Standing::On,
        }
    }
}

/// The parts of the error by their causes, in exposed linear light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attribution {
    /// Index of the point whose frame was taken apart.
    pub point: usize,
    pub parts: Vec<AttributedPart>,
    /// Root mean square error of the light, before a picture is made of it: the point's RMSE against the converged truth, where all pixels
    /// are taken apart and the point draws one sample a pixel.
    pub light_rms: f64,
    /// Pixels that were taken apart, of how many.
    pub pixels: usize,
    pub of_pixels: usize,
}

/// A row. The parts' means add up to the mean of the whole, which is the part named "whole".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AttributedPart {
    /// As "shadows".
    pub name: String,
    /// Mean signed error over pixels and channels.
    #[serde(deserialize_with = "real")]
    pub mean: f64,
    /// Root mean square of the part over pixels and channels.
    #[serde(deserialize_with = "real")]
    pub rms: f64,
    /// The part's share of the whole's mean square: the mean of part times whole over the mean of the whole squared. Shares add up to 1; a share
    /// below 0 works against the others.
    #[serde(deserialize_with = "real")]
    pub share: f64,
    /// The part's meaning, in a sentence.
    pub note: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    pub name: String,
    pub reason: String,
}
