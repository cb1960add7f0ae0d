//! The mean of many frames as one picture. [`super::jitter`] chooses the place in the pixel, on the lens and in time that each of them looks through.

use glam::Vec3;
use rayon::prelude::*;

use super::{Picture, Pixels};
use crate::passes::curves::{encode_srgb, tone_map};
use crate::plan::{FramePlan, ToneMapping};
use crate::scene::{Resolve, Tonemap};

/// Pixels that one thread looks at in turn. Neighbours often show the same, so that one's result serves the next.
const RUN: usize = 4096;

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
    /// Accumulates frames of a plan whose output is linear.
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
        let seen = |light: [f32; 3]| {
            let light = Vec3::from_array(light);
            curve.map_or(light, |curve| tone_map(light, curve)).as_dvec3().to_array()
        };
        // Fresh memory is written and not read first: Linux would map a page of zeros, and then stop all threads to put another in its place.
        let is_first = self.frames == 0;
        self.sums.par_chunks_mut(RUN).zip(rgba.par_chunks(4 * RUN)).for_each(|(sums, texels)| {
            let mut last = ([0.0; 3], seen([0.0; 3]));
            for (sum, &[r, g, b, _]) in sums.iter_mut().zip(texels.as_chunks().0) {
                if !same_bits(last.0, [r, g, b]) {
                    last = ([r, g, b], seen([r, g, b]));
                }
                let ([r, g, b], before) = (last.1, if is_first { [0.0; 3] } else { *sum });
                *sum = [before[0] + r, before[1] + g, before[2] + b];
            }
        });
        self.frames += 1;
    }

    /// The mean of all frames: as light for linear pictures, else as sRGB codes.
    pub fn picture(&self) -> Picture {
        let frames = f64::from(self.frames.max(1));
        let mean = |[r, g, b]: [f64; 3]| [r / frames, g / frames, b / frames];
        let pixels = match self.curve {
            None => Pixels::LinearF32(self.texels(|sum| {
                let [r, g, b] = mean(sum);
                [r as f32, g as f32, b as f32, 1.0]
            })),
            Some(curve) => Pixels::Srgb8(self.texels(|sum| {
                let mean = mean(sum);
                let [r, g, b] = match self.resolve {
                    Resolve::ToneMapped => mean,
                    Resolve::Linear => {
                        let light = Vec3::new(mean[0] as f32, mean[1] as f32, mean[2] as f32);
                        tone_map(light, curve).as_dvec3().to_array()
                    }
                };
                [srgb_code(r), srgb_code(g), srgb_code(b), 255]
            })),
        };
        Picture { size: self.size, pixels }
    }

    /// A texel of each pixel's sum.
    fn texels<T: Copy + Default + Send + Sync + bytemuck::Pod>(
        &self,
        texel: impl Fn([f64; 3]) -> [T; 4] + Sync,
    ) -> Vec<T> {
        let mut texels = vec![T::default(); 4 * self.sums.len()];
        self.sums.par_chunks(RUN).zip(texels.par_chunks_mut(4 * RUN)).for_each(|(sums, texels)| {
            let mut last = ([0.0; 3], texel([0.0; 3]));
            for (&sum, own) in sums.iter().zip(texels.as_chunks_mut().0) {
                if sum != last.0 {
                    last = (sum, texel(sum));
                }
                *own = last.1;
            }
        });
        texels
    }
}

/// Zeros of either sign are not the same, and a NaN is the same as itself.
fn same_bits(a: [f32; 3], b: [f32; 3]) -> bool {
    bytemuck::bytes_of(&a) == bytemuck::bytes_of(&b)
}

/// IEC 61966-2-1: the 8-bit code of a linear value, as an sRGB attachment stores it.
fn srgb_code(linear: f64) -> u8 {
    (encode_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise, and runs of one colour that begin and end anywhere, zeros of both signs among them.
    fn frame(seed: u32, pixels: usize) -> Vec<f32> {
        let texel = |pixel: usize| {
            let group = if pixel % 1000 < 300 { pixel } else { pixel / 777 };
            let hash = (group as u32 ^ seed).wrapping_mul(2_654_435_761);
            let value = |shift: u32| ((hash >> shift) & 0xff) as f32 / 100.0;
            if hash.is_multiple_of(7) { [0.0, -0.0, value(3), 1.0] } else { [value(0), value(8), value(16), 1.0] }
        };
        (0..pixels).flat_map(texel).collect()
    }

    #[test]
    fn a_pixel_is_the_mean_of_its_own_values_whatever_is_beside_it() {
        let pixels = 3 * RUN + 123;
        let frames = [1, 2, 3].map(|seed| frame(seed, pixels));
        for (curve, resolve) in [
            (None, Resolve::Linear),
            (Some(Tonemap::Agx), Resolve::ToneMapped),
            (Some(Tonemap::Neutral), Resolve::Linear),
        ] {
            let mut sum =
                Accumulator { size: [1, pixels as u32], sums: vec![[0.0; 3]; pixels], frames: 0, curve, resolve };
            frames.iter().for_each(|frame| sum.add(frame));
            // Each pixel accumulated alone must give the same picture.
            let alone = (0..pixels).map(|pixel| {
                let mut one = Accumulator { size: [1, 1], sums: vec![[0.0; 3]], frames: 0, curve, resolve };
                frames.iter().for_each(|frame| one.add(&frame[4 * pixel..][..4]));
                one.picture().pixels
            });
            match sum.picture().pixels {
                Pixels::LinearF32(all) => {
                    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                    for (own, alone) in all.chunks(4).zip(alone) {
                        assert!(matches!(alone, Pixels::LinearF32(alone) if bits(&alone) == bits(own)));
                    }
                    let sum: f64 = frames.iter().map(|frame| f64::from(frame[4 * 4097])).sum();
                    assert_eq!(all[4 * 4097], (sum / 3.0) as f32);
                }
                Pixels::Srgb8(all) => {
                    for (own, alone) in all.chunks(4).zip(alone) {
                        assert!(matches!(alone, Pixels::Srgb8(alone) if alone == own));
                    }
                }
            }
        }
    }

    #[test]
    fn codes_are_those_of_the_standard() {
        assert_eq!([0.0, 0.18, 0.5, 1.0, 7.0].map(srgb_code), [0, 118, 188, 255, 255]);
    }
}
