//! One picture from many frames: where in each pixel a frame looks, and what their mean is.

use glam::Vec3;
use rayon::prelude::*;

use super::{Picture, Pixels};
use crate::passes::tonemap::{encode_srgb, tone_map};
use crate::plan::{FramePlan, ToneMapping};
use crate::scene::{Resolve, Tonemap};

/// Where frame `index` of `count` looks in each pixel: pixels to the right and down from its centre, each within half a pixel.
///
/// A Hammersley set with the golden ratio's additive recurrence in place of the radical inverse (Niederreiter, "Random Number
/// Generation and Quasi-Monte Carlo Methods", 1992, chapter 3): as even as `count` points can be over the square, and each column of
/// width 1 / `count` has one. Centred, so that one frame looks through the middle, and that no picture is shifted.
pub fn sample_offset(index: u32, count: u32) -> [f64; 2] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let from_middle = f64::from(index) - (f64::from(count) - 1.0) / 2.0;
    let around = from_middle * GOLDEN;
    [from_middle / f64::from(count), around - around.round()]
}

/// The sum of frames so far.
pub struct Accumulator {
    size: [u32; 2],
    /// RGB in f64, so that thousands of frames add up without loss.
    sums: Vec<[f64; 3]>,
    frames: u32,
    curve: Option<Tonemap>,
    resolve: Resolve,
}

impl Accumulator {
    /// For frames of a plan, whose output is linear.
    pub fn new(plan: &FramePlan) -> Self {
        let curve = match plan.tone_mapping {
            ToneMapping::AfterFrames(curve) => Some(curve),
            _ => None,
        };
        let pixels = plan.size[0] as usize * plan.size[1] as usize;
        Self { size: plan.size, sums: vec![[0.0; 3]; pixels], frames: 0, curve, resolve: plan.resolve }
    }

    /// Adds a frame: RGBA, of which A is left out.
    pub fn add(&mut self, rgba: &[f32]) {
        let curve = self.curve.filter(|_| self.resolve == Resolve::ToneMapped);
        self.sums.par_iter_mut().zip(rgba.par_chunks_exact(4)).with_min_len(1024).for_each(|(sum, texel)| {
            let light = Vec3::new(texel[0], texel[1], texel[2]);
            let seen = curve.map_or(light, |curve| tone_map(light, curve));
            for (channel, value) in sum.iter_mut().zip(seen.to_array()) {
                *channel += f64::from(value);
            }
        });
        self.frames += 1;
    }

    /// The mean of all frames: as light for linear pictures, else as sRGB codes.
    pub fn picture(&self) -> Picture {
        let frames = f64::from(self.frames.max(1));
        let mean = |sum: &[f64; 3]| sum.map(|channel| channel / frames);
        let pixels = match self.curve {
            None => Pixels::LinearF32(
                self.sums.par_iter().map(mean).flat_map_iter(|[r, g, b]| [r as f32, g as f32, b as f32, 1.0]).collect(),
            ),
            Some(curve) => {
                let shown = |mean: [f64; 3]| match self.resolve {
                    Resolve::ToneMapped => mean,
                    Resolve::Linear => {
                        tone_map(Vec3::from_array(mean.map(|channel| channel as f32)), curve).to_array().map(f64::from)
                    }
                };
                let codes = |sum| {
                    let [r, g, b] = shown(mean(sum)).map(srgb_code);
                    [r, g, b, 255]
                };
                Pixels::Srgb8(self.sums.par_iter().flat_map_iter(codes).collect())
            }
        };
        Picture { size: self.size, pixels }
    }
}

/// IEC 61966-2-1: the 8-bit code of a linear value, as an sRGB attachment stores it.
fn srgb_code(linear: f64) -> u8 {
    (encode_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_frame_looks_through_the_middle_of_each_pixel() {
        assert_eq!(sample_offset(0, 1), [0.0, 0.0]);
    }

    #[test]
    fn offsets_lie_within_a_pixel_and_their_mean_in_its_middle() {
        for count in 1..300 {
            let offsets: Vec<_> = (0..count).map(|index| sample_offset(index, count)).collect();
            for axis in 0..2 {
                assert!(offsets.iter().all(|offset| offset[axis].abs() <= 0.5), "{count}");
                let mean = offsets.iter().map(|offset| offset[axis]).sum::<f64>() / f64::from(count);
                assert!(mean.abs() < 1e-12, "{count}: {mean}");
            }
        }
    }

    /// The part of a centred unit square where x cos + y sin < d.
    fn covered(cos: f64, sin: f64, d: f64) -> f64 {
        let (small, large) = (cos.abs().min(sin.abs()), cos.abs().max(sin.abs()));
        let (all, straight) = ((large + small) / 2.0, (large - small) / 2.0);
        let beyond = match d.abs() {
            d if d >= all => 0.5,
            d if d <= straight => d / large,
            d => 0.5 - (all - d).powi(2) / (2.0 * large * small),
        };
        0.5 + beyond.copysign(d)
    }

    /// The share of samples on one side of a straight edge, against the truth. For the mean over all edges no set of points does better
    /// than N^-3/4 (Beck 1987); the worst edges are those along the points' own rows.
    #[test]
    fn the_error_of_an_edge_falls_as_it_can_at_best() {
        for count in [1u32, 2, 4, 8, 16, 32, 64, 256, 1024] {
            let (mut worst, mut squares, mut edges): (f64, f64, f64) = (0.0, 0.0, 0.0);
            for (angle, place) in (0..90).flat_map(|a| (0..71).map(move |b| (a, b))) {
                let (sin, cos) = (f64::from(angle) * 2.0).to_radians().sin_cos();
                let d = f64::from(place) * 0.02 - 0.7;
                let inside = (0..count).filter(|&index| {
                    let [x, y] = sample_offset(index, count);
                    x * cos + y * sin < d
                });
                let error = inside.count() as f64 / f64::from(count) - covered(cos, sin, d);
                (worst, squares, edges) = (worst.max(error.abs()), squares + error * error, edges + 1.0);
            }
            let (mean, count) = ((squares / edges).sqrt(), f64::from(count));
            assert!(worst <= 0.75 / count.sqrt(), "{count}: {worst}");
            assert!(mean <= 0.35 * count.powf(-0.75), "{count}: {mean}");
        }
    }

    #[test]
    fn codes_are_those_of_the_standard() {
        assert_eq!([0.0, 0.18, 0.5, 1.0, 7.0].map(srgb_code), [0, 118, 188, 255, 255]);
    }
}
