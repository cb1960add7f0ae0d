//! Differences that are allowed because devices place vertices on a grid.
//!
//! A rasterizer snaps vertices to steps of 1 / 2^`subPixelPrecisionBits` of a pixel (Vulkan, "Limits"), at least 1/16 and mostly 1/256, and
//! interpolated values move along: a pixel shows a place up to half a step beside its middle, to either side and up or down. The change of light over
//! so small a part of a pixel is no error of the light's computation. The direction to the eye is the pixel's own and stays. CPU devices do not snap:
//! lavapipe interpolates from the vertices' own places.

use glam::DVec2;
use rayon::prelude::*;

use afterlight::gpu::{Device, vk};
use afterlight_truth::reference::{CameraView, Reference, Smith};

/// Half a step of the device's grid, in pixels.
pub fn half_step(device: &Device) -> f64 {
    if device.physical.kind == vk::PhysicalDeviceType::CPU {
        return 0.0;
    }
    0.5 * (-f64::from(device.physical.limits.sub_pixel_precision_bits)).exp2()
}

/// The light that a pixel may show, in each channel: the least and the most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelRange {
    pub least: [f64; 3],
    pub most: [f64; 3],
}

/// Places that are looked at across the grid's step, and where light changes between them.
const COARSE: i32 = 1;
const FINE: i32 = 4;
/// Share of its light by which it changes enough to be looked at more closely.
const CHANGES: f64 = 1e-2;

impl ChannelRange {
    pub fn of(light: [f64; 3]) -> Self {
        Self { least: light, most: light }
    }

    fn with(self, light: [f64; 3]) -> Self {
        let each = |of: fn(f64, f64) -> f64, a: [f64; 3]| [0, 1, 2].map(|channel| of(a[channel], light[channel]));
        Self { least: each(f64::min, self.least), most: each(f64::max, self.most) }
    }

    /// Maps both bounds by `change`, which grows with its argument.
    pub fn map(self, change: impl Fn(f64) -> f64) -> Self {
        Self { least: self.least.map(&change), most: self.most.map(&change) }
    }

    /// Returns the distance by which a light lies outside, in the channel that does most.
    pub fn distance(&self, light: [f64; 3]) -> f64 {
        (0..3).fold(0.0, |most: f64, channel| {
            most.max(self.least[channel] - light[channel]).max(light[channel] - self.most[channel])
        })
    }
}

/// The light of each pixel, in nits, from anywhere up to half a step of the grid beside its middle, whose light is `middles`.
pub fn spans(
    half_step: f64,
    reference: &Reference,
    view: &CameraView,
    smith: Smith,
    middles: &[[f64; 3]],
) -> Vec<ChannelRange> {
    if half_step == 0.0 {
        return middles.iter().copied().map(ChannelRange::of).collect();
    }
    let width = view.size[0] as usize;
    let span = |(index, &middle): (usize, &[f64; 3])| {
        let place = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        let among = |count: i32| {
            let offsets = (-count..=count).flat_map(|y| (-count..=count).map(move |x| (x, y)));
            let places =
                offsets.map(|(x, y)| place + DVec2::new(f64::from(x), f64::from(y)) * (half_step / f64::from(count)));
            places.fold(ChannelRange::of(middle), |span, aside| span.with(reference.light(view, smith, aside, place)))
        };
        let coarse = among(COARSE);
        let changes =
            (0..3).any(|channel| coarse.most[channel] - coarse.least[channel] > CHANGES * coarse.most[channel]);
        if changes { among(FINE) } else { coarse }
    };
    middles.par_iter().enumerate().map(span).collect()
}

/// Returns the allowed distance of the place that a pixel shows from the true one, in metres.
pub fn place_allowance(half_step: f64, reference: &Reference, view: &CameraView, pixel: DVec2) -> f64 {
    let place = |offset: DVec2| reference.surface(view, pixel + offset).map(|(surface, ..)| surface.position);
    let Some(middle) = place(DVec2::ZERO).filter(|_| half_step > 0.0) else { return 0.0 };
    let moved = |axis: DVec2| {
        let ends = [-half_step, half_step].map(|step| place(step * axis).map_or(0.0, |place| place.distance(middle)));
        ends[0].max(ends[1])
    };
    moved(DVec2::X) + moved(DVec2::Y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight::scene::builtin;
    use afterlight_truth::reference::{Mode, TruthOptions};

    #[test]
    fn light_may_be_that_of_any_place_within_half_a_step() {
        let scene = builtin::open("builtin:overlap").expect("built in");
        let reference = Reference::new(&scene).expect("a scene");
        let view = CameraView { camera: scene.camera, size: [64, 36] };
        let smith = Smith::default();
        let middles = reference.render(&view, &TruthOptions { mode: Mode::Point, smith }, &|_, _| {}).radiance;
        let exact = spans(0.0, &reference, &view, smith, &middles);
        assert!(exact.iter().zip(&middles).all(|(span, middle)| *span == ChannelRange::of(*middle)));
        let [small, large] = [1.0 / 512.0, 0.25].map(|step| spans(step, &reference, &view, smith, &middles));
        assert!(small.iter().zip(&middles).all(|(span, middle)| span.distance(*middle) == 0.0));
        let sum = |spans: &[ChannelRange]| {
            spans.iter().map(|span| span.distance([0.0; 3]).abs() + span.most[0] - span.least[0]).sum::<f64>()
        };
        assert!(sum(&exact) < sum(&small) && sum(&small) < sum(&large), "{} {}", sum(&small), sum(&large));
        // Half a pixel aside is beyond a quarter, and where light has a slope it shows.
        let place = DVec2::new(32.9, 18.5);
        let aside = reference.light(&view, smith, place, place);
        let seen = |spans: &[ChannelRange]| spans[18 * 64 + 32].distance(aside);
        assert!(seen(&small) > 0.0 && seen(&large) < seen(&small), "{} {}", seen(&small), seen(&large));
    }

    #[test]
    fn what_lies_outside_of_a_span_is_as_far_from_it_as_its_worst_channel() {
        let span = ChannelRange { least: [1.0, 2.0, 3.0], most: [2.0, 2.0, 5.0] };
        assert_eq!(span.distance([1.5, 2.0, 3.0]), 0.0);
        assert_eq!(span.distance([0.5, 2.25, 4.0]), 0.5);
        assert_eq!(span.map(|light| 2.0 * light).distance([2.0, 4.0, 11.0]), 1.0);
    }

    #[test]
    fn a_place_may_be_off_by_its_slope_over_half_a_step() {
        let scene = builtin::open("builtin:overlap").expect("built in");
        let reference = Reference::new(&scene).expect("a scene");
        let view = CameraView { camera: scene.camera, size: [64, 36] };
        let (small, middle) = (1.0 / 512.0, DVec2::new(32.0, 18.0));
        let place = place_allowance(small, &reference, &view, middle);
        // Two metres high, 36 pixels: half a step of each, to the side and up.
        assert!((place / (2.0 / 36.0 * small * 2.0) - 1.0).abs() < 0.01, "{place}");
        assert_eq!(place_allowance(0.0, &reference, &view, middle), 0.0);
    }
}
