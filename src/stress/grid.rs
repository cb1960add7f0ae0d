//! What may differ because devices place vertices on a grid.
//!
//! A rasterizer snaps vertices to steps of 1 / 2^`subPixelPrecisionBits` of a pixel (Vulkan, "Limits"), at least 1/16 and mostly 1/256, and what it
//! interpolates moves along, by half a step in each direction at most. How much light changes over so small a part of a pixel is no
//! error of how it is computed. CPU devices have no part in it: lavapipe interpolates from where vertices are.

use glam::DVec2;

use crate::gpu::{Device, vk};
use crate::reference::{Options, Reference, View};

/// Half a step of the device's grid, in pixels.
pub fn half_step(device: &Device) -> f64 {
    if device.physical.kind == vk::PhysicalDeviceType::CPU {
        return 0.0;
    }
    0.5 * (-f64::from(device.physical.limits.sub_pixel_precision_bits)).exp2()
}

/// How much the light of each pixel may differ, in nits: from a truth of three times as many pixels in each direction, of which every third lies in the
/// middle of one.
pub fn allowance(half_step: f64, reference: &Reference, view: &View, options: &Options) -> Vec<f64> {
    let [width, height] = view.size.map(|edge| edge as usize);
    if half_step == 0.0 {
        return vec![0.0; width * height];
    }
    let fine = View { size: view.size.map(|edge| 3 * edge), ..*view };
    let light = reference.render(&fine, options, &|_, _| {}).radiance;
    let at = |x: usize, y: usize| light[y * 3 * width + x];
    let apart = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
    let of_pixel = |x: usize, y: usize| {
        let (x, y) = (3 * x + 1, 3 * y + 1);
        let middle = at(x, y);
        let across = apart(at(x - 1, y), middle).max(apart(at(x + 1, y), middle));
        let along = apart(at(x, y - 1), middle).max(apart(at(x, y + 1), middle));
        3.0 * half_step * (across + along)
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| of_pixel(x, y)).collect()
}

/// How far the place that a pixel shows may be off, in metres.
pub fn place_allowance(half_step: f64, reference: &Reference, view: &View, pixel: DVec2) -> f64 {
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
    use crate::reference::{Mode, Smith};
    use crate::scene::builtin;

    #[test]
    fn light_may_differ_by_its_slope_over_half_a_step() {
        let scene = builtin::open("builtin:overlap").expect("built in");
        let reference = Reference::new(&scene);
        let view = View { camera: scene.camera, size: [64, 36] };
        let options = Options { mode: Mode::Point, smith: Smith::default() };
        assert!(allowance(0.0, &reference, &view, &options).iter().all(|&allowed| allowed == 0.0));
        let (small, large) = (1.0 / 512.0, 1.0 / 256.0);
        let [of_small, of_large] = [small, large].map(|step| allowance(step, &reference, &view, &options));
        let (brightest, sum) = of_small.iter().fold((0.0f64, 0.0), |(most, sum), &one| (most.max(one), sum + one));
        // A spot's edge is narrower than a pixel: all of its light, over the third of a pixel that was looked at.
        assert!(brightest > 0.0 && brightest < 0.1 && sum > 0.0, "{brightest} {sum}");
        assert!(of_small.iter().zip(&of_large).all(|(small, large)| (2.0 * small - large).abs() < 1e-12));
        let middle = DVec2::new(32.0, 18.0);
        let place = place_allowance(small, &reference, &view, middle);
        // Two metres high, 36 pixels: half a step of each, to the side and up.
        assert!((place / (2.0 / 36.0 * small * 2.0) - 1.0).abs() < 0.01, "{place}");
        assert_eq!(place_allowance(0.0, &reference, &view, middle), 0.0);
    }
}
