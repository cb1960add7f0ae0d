//! One picture from many frames: what their mean is. [`super::jitter`] has where each of them looks.

use glam::Vec3;
use rayon::prelude::*;

use super::{Picture, Pixels};
use crate::passes::tonemap::{encode_srgb, tone_map};
use crate::plan::{FramePlan, ToneMapping};
use crate::scene::{Resolve, Tonemap};

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
    fn codes_are_those_of_the_standard() {
        assert_eq!([0.0, 0.18, 0.5, 1.0, 7.0].map(srgb_code), [0, 118, 188, 255, 255]);
    }
}
