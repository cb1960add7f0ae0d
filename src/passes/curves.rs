//! TONEMAP's curves on the CPU: for the background's clear colour, and for pictures that the CPU tone-maps.

use glam::{Mat3, Vec3};

use crate::scene::Tonemap;

/// The curves of `shaders/shared/tonemap.wgsl`, where they are named and cited: scene-linear to display-linear, 0 to 1.
pub fn tone_map(color: Vec3, curve: Tonemap) -> Vec3 {
    tone_map_up_to(1.0, color, curve)
}

/// Variant of `tone_map` for a display that shows more than white: 0 to `headroom`, in units of white.
pub fn tone_map_up_to(headroom: f32, color: Vec3, curve: Tonemap) -> Vec3 {
    let shown = |color: Vec3| color.clamp(Vec3::ZERO, Vec3::splat(headroom));
    match curve {
        Tonemap::Neutral => shown(neutral(color, headroom)),
        Tonemap::Agx => stretch(agx(color), headroom),
        Tonemap::Aces => stretch(aces(color), headroom),
        Tonemap::None => shown(color),
    }
}

fn stretch(color: Vec3, headroom: f32) -> Vec3 {
    let mapped = color.clamp(Vec3::ZERO, Vec3::ONE);
    let brightest = mapped.max_element();
    if headroom <= 1.0 || brightest <= 0.5 {
        return mapped;
    }
    mapped * (1.0 + (headroom - 1.0) * (2.0 * brightest - 1.0).powi(4) / brightest)
}

/// IEC 61966-2-1, for values that no attachment encodes: 0 to 1, linear to encoded.
pub fn encode_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn neutral(color: Vec3, headroom: f32) -> Vec3 {
    let start = 0.76 + 0.8 * (headroom - 1.0);
    let least = color.min_element();
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color - offset;
    let peak = color.max_element();
    if peak < start {
        return color;
    }
    let d = headroom - start;
    let new_peak = headroom - d * d / (peak + d - start);
    let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), g)
}

fn agx(color: Vec3) -> Vec3 {
    let inset = Mat3::from_cols_array(&[
        0.842_479_05,
        0.042_328_242,
        0.042_375_654,
        0.078_433_6,
        0.878_468_63,
        0.078_433_6,
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    let outset = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_853,
        -0.052_971_635,
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45,
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    let (least, most) = (-12.473_93, 4.026_069);
    let encode = |v: f32| (v.max(1e-10).log2().clamp(least, most) - least) / (most - least);
    let contrast = |x: f32| {
        let x2 = x * x;
        let x4 = x2 * x2;
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232
    };
    let log = inset * color;
    let curved = Vec3::from_array(log.to_array().map(|v| contrast(encode(v))));
    Vec3::from_array((outset * curved).to_array().map(|v| v.max(0.0).powf(2.2)))
}

fn aces(color: Vec3) -> Vec3 {
    let input =
        Mat3::from_cols_array(&[0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777]);
    let output =
        Mat3::from_cols_array(&[1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602]);
    // The squares of large single floats overflow, and infinity over infinity is black.
    let v = input * color.min(Vec3::splat(65000.0));
    let a = v * (v + 0.024_578_6) - 0.000_090_537;
    let b = v * (0.983_729 * v + 0.432_951) + 0.238_081;
    output * (a / b)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::steepest;

    const CURVES: [Tonemap; 4] = [Tonemap::Neutral, Tonemap::Agx, Tonemap::Aces, Tonemap::None];

    fn close(color: Vec3, curve: Tonemap, expected: [f32; 3], tolerance: f32) {
        let mapped = tone_map(color, curve);
        let error = (mapped - Vec3::from(expected)).abs().max_element();
        assert!(error <= tolerance, "{curve:?} of {color} is {mapped}, not {expected:?}");
    }

    #[test]
    fn neutral_subtracts_the_fresnel_offset_and_compresses_from_0_76_on() {
        // 0.04 less from 0.08 on; below, 6.25 of the square is left.
        close(Vec3::splat(0.5), Tonemap::Neutral, [0.46; 3], 1e-6);
        close(Vec3::splat(0.08), Tonemap::Neutral, [0.04; 3], 1e-6);
        close(Vec3::splat(0.04), Tonemap::Neutral, [0.01; 3], 1e-6);
        // 1 - 0.24^2 / (0.96 + 0.24 - 0.76)
        close(Vec3::ONE, Tonemap::Neutral, [1.0 - 0.0576 / 0.44; 3], 1e-6);
        // Red of 1: peak 1 - 0.24^2 / 0.48 = 0.88, desaturated by 1 - 1 / (0.15 * 0.12 + 1).
        let white = 1.0 - 1.0 / 1.018;
        close(Vec3::X, Tonemap::Neutral, [0.88, 0.88 * white, 0.88 * white], 1e-6);
        close(Vec3::new(0.6, 0.2, 0.0), Tonemap::Neutral, [0.6, 0.2, 0.0], 1e-6);
    }

    #[test]
    fn beyond_white_every_curve_rises_to_the_brightest_and_leaves_what_is_dark() {
        for headroom in [1.0, 1.5, 1000.0 / 203.0, 10_000.0 / 203.0] {
            for curve in CURVES {
                let of = |light: f32| tone_map_up_to(headroom, Vec3::splat(light), curve).max_element();
                let lights = (-80..=100).map(|step| 2f32.powf(step as f32 / 6.0));
                let values: Vec<f32> = lights.map(of).collect();
                let rises = values.windows(2).all(|pair| pair[0] <= pair[1] * (1.0 + 1e-6));
                assert!(rises, "{curve:?} up to {headroom} falls: {values:?}");
                let brightest = of(60_000.0);
                assert!((brightest / headroom - 1.0).abs() < 0.03, "{curve:?}: {brightest} of {headroom}");
                // Up to half of white, greys are the same on any display.
                for light in [0.001, 0.05, 0.18, 0.36, 0.5] {
                    let white = tone_map(Vec3::splat(light), curve).max_element();
                    assert_eq!(of(light), white, "{curve:?} up to {headroom}: a grey of {light}");
                }
            }
        }
    }

    #[test]
    fn aces_of_a_grey_is_the_rational_function_of_hills_fit() {
        // Rows of both matrices add up to 1, so that grey stays grey.
        close(Vec3::ONE, Tonemap::Aces, [1.024_488 / 1.654_761; 3], 2e-5);
        let v = 0.18;
        let expected = (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
        close(Vec3::splat(v), Tonemap::Aces, [expected; 3], 2e-5);
    }

    #[test]
    fn agx_has_the_values_of_its_formula_in_double_precision() {
        close(Vec3::splat(0.18), Tonemap::Agx, [0.214_467, 0.214_533, 0.214_537], 2e-5);
        close(Vec3::ONE, Tonemap::Agx, [0.589_977, 0.590_207, 0.590_221], 2e-5);
        close(Vec3::X, Tonemap::Agx, [0.719_417, 0.039_488, 0.039_550], 2e-5);
        // Beyond 2^4.026 of middle grey's scale all is white.
        close(Vec3::splat(1e6), Tonemap::Agx, [0.996_502, 0.996_978, 0.997_007], 2e-5);
    }

    #[test]
    fn none_clamps() {
        close(Vec3::new(-1.0, 0.5, 2.0), Tonemap::None, [0.0, 0.5, 1.0], 0.0);
    }

    #[test]
    fn black_stays_black() {
        for curve in CURVES {
            close(Vec3::ZERO, curve, [0.0; 3], 1e-6);
        }
    }

    #[test]
    fn greys_come_out_grey_and_never_darker_than_a_darker_one() {
        for curve in CURVES {
            let mut before = Vec3::ZERO;
            for step in 0..=2000 {
                let grey = 10f32.powf(-4.0 + 42.0 * step as f32 / 2000.0);
                let mapped = tone_map(Vec3::splat(grey), curve);
                assert!((mapped - before).min_element() > -2e-6, "{curve:?}: {grey} gives {mapped} after {before}");
                assert!(mapped.max_element() - mapped.min_element() < 1e-3, "{curve:?}: {grey} gives {mapped}");
                before = mapped;
            }
            assert!(before.min_element() > 0.98, "{curve:?} {before}");
        }
    }

    proptest! {
        /// The certified cut-off of lights rests on this bound: dropped light changes the encoded output by at most `steepest(curve)` times itself.
        #[test]
        fn no_curve_is_steeper_than_the_plan_takes_it_to_be(
            exponents in [-6.0..1.5f32, -6.0..1.5, -6.0..1.5], black in 0..8u8, share in [0.0..=1.0f32, 0.0..=1.0, 0.0..=1.0],
            dropped in -4.5..-2.5f32,
        ) {
            let mut color = Vec3::from(exponents.map(|exponent| 10f32.powf(exponent)));
            (0..3).filter(|bit| black >> bit & 1 == 1).for_each(|channel| color[channel] = 0.0);
            let dropped = 10f32.powf(dropped);
            for curve in CURVES {
                let (with, without) = (tone_map(color + Vec3::from(share) * dropped, curve), tone_map(color, curve));
                for channel in 0..3 {
                    let moved = (encode_srgb(with[channel].into()) - encode_srgb(without[channel].into())).abs();
                    // The curves round in f32.
                    let bound = f64::from(dropped) * steepest(curve) + 3e-5;
                    prop_assert!(moved <= bound, "{curve}: {color} {dropped} {moved} {}", moved / f64::from(dropped));
                }
            }
        }

        #[test]
        fn every_finite_light_is_shown_between_0_and_1(exponents in [-40.0..38.5f32, -40.0..38.5, -40.0..38.5], zero in 0..8u8) {
            let mut color = Vec3::from(exponents.map(|exponent| 10f32.powf(exponent).min(f32::MAX)));
            (0..3).filter(|bit| zero >> bit & 1 == 1).for_each(|channel| color[channel] = 0.0);
            for curve in CURVES {
                let mapped = tone_map(color, curve);
                // False for NaN.
                prop_assert!(mapped.min_element() >= 0.0 && mapped.max_element() <= 1.0, "{curve:?} {color} {mapped}");
                prop_assert!(!mapped.is_nan(), "{curve:?} {color} {mapped}");
            }
        }
    }
}
