//! From displayed colours back to light: each curve's inverse in closed form, but for a polynomial's root.
//!
//! Curves that grow flat show all bright light alike. Beyond the brightness at which shown grey rises by less than 1/32 of its light, all light
//! counts as being just as bright; a channel that a curve clamps is lost in the same way. Where a clamped channel has changed the others, as in
//! saturated colours of AgX and ACES, the inverse is a colour that is shown the same, not the original one.

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

use super::{
    ACES_CURVE, ACES_INPUT, ACES_OUTPUT, AGX_CONTRAST, AGX_INSET, AGX_OUTSET, AGX_STOPS, NEUTRAL_DESATURATION,
    NEUTRAL_OFFSET, NEUTRAL_START, matrix, tone_map,
};
use crate::reference::light::{vector, widened};
use afterlight_scene::Tonemap;

/// Grey light from which on a curve rises by less than 1/32.
const NEUTRAL_BRIGHTEST: f64 = 1.9176;
const AGX_BRIGHTEST: f64 = 4.2404;
const ACES_BRIGHTEST: f64 = 3.7106;

/// Returns the light to add to `exposed` so that its tone-mapped value becomes the `shown` one: an error of the display side, in linear
/// exposed light. `shown` is linear, 0 to 1. NaN where light is not finite.
///
/// Light that is too bright for the curve to tell counts as the brightest that it tells, before and after.
pub fn input_referred(exposed: DVec3, shown: DVec3, curve: Tonemap) -> DVec3 {
    if !exposed.is_finite() {
        return DVec3::NAN;
    }
    light(shown, curve) - light(tone_map::<f64>(exposed, curve), curve)
}

/// Light that is shown so.
fn light(shown: DVec3, curve: Tonemap) -> DVec3 {
    let shown: Vector3<f64> = vector(shown.clamp(DVec3::ZERO, DVec3::ONE));
    widened(match curve {
        Tonemap::Neutral => neutral(shown),
        Tonemap::Agx => agx(shown),
        Tonemap::Aces => aces(shown),
        Tonemap::None => shown,
    })
}

/// The inverse that the Khronos Group publishes beside its curve.
fn neutral(color: Vector3<f64>) -> Vector3<f64> {
    let above = 1.0 - NEUTRAL_START;
    let peak = color.max();
    let color = if peak < NEUTRAL_START {
        color
    } else {
        let brightest = NEUTRAL_BRIGHTEST - NEUTRAL_OFFSET;
        let was = (above * above / (1.0 - peak) - above + NEUTRAL_START).min(brightest);
        let desaturated = NEUTRAL_DESATURATION * (was - peak) + 1.0;
        // 8 bits round to colours more vivid than any light is shown.
        color.map(|channel| ((channel - peak) * desaturated + peak).max(0.0) * (was / peak))
    };
    let least = color.min();
    let offset = if least < NEUTRAL_OFFSET { (least / 6.25).sqrt() - least } else { NEUTRAL_OFFSET };
    color.map(|channel| channel + offset)
}

fn agx(color: Vector3<f64>) -> Vector3<f64> {
    let [least, most] = AGX_STOPS;
    let curved = inverse(AGX_OUTSET) * color.map(|channel| channel.powf(2.2f64.recip()));
    let light = curved.map(|channel| (least + contrast_root(channel) * (most - least)).exp2().min(AGX_BRIGHTEST));
    inverse(AGX_INSET) * light
}

/// Returns the place at which AgX's contrast curve, which rises all the way from 0 to 1, has a value: Newton's steps, halving where they lead astray.
fn contrast_root(value: f64) -> f64 {
    let [mut low, mut high] = [0.0, 1.0];
    let curve = |x: f64| {
        let step = |(sum, slope): (f64, f64), coefficient: f64| (sum * x + coefficient, slope * x + sum);
        AGX_CONTRAST.into_iter().fold((0.0, 0.0), step)
    };
    if value <= curve(low).0 || value >= curve(high).0 {
        return if value <= curve(low).0 { low } else { high };
    }
    let mut x = 0.5;
    // Halving alone would be done by then.
    for _ in 0..64 {
        let (found, slope) = curve(x);
        if found < value {
            low = x
        } else {
            high = x
        }
        let newton = x - (found - value) / slope;
        let next = if (low..=high).contains(&newton) { newton } else { 0.5 * (low + high) };
        if (next - x).abs() < 1e-15 {
            return next;
        }
        x = next;
    }
    x
}

fn aces(color: Vector3<f64>) -> Vector3<f64> {
    let [[above2, above1, above0], [below2, below1, below0]] = ACES_CURVE;
    let light = (inverse(ACES_OUTPUT) * color).map(|shown| {
        // above(v) = shown below(v): a square of v, whose value at 0 is negative and at the brightest light is not.
        let [square, linear, constant] = [above2 - shown * below2, above1 - shown * below1, above0 - shown * below0];
        if constant >= 0.0 {
            return 0.0;
        }
        if ACES_BRIGHTEST * (square * ACES_BRIGHTEST + linear) + constant <= 0.0 {
            return ACES_BRIGHTEST;
        }
        (-linear + (linear * linear - 4.0 * square * constant).sqrt()) / (2.0 * square)
    });
    inverse(ACES_INPUT) * light
}

/// Returns the inverse of a matrix of this module, all of which have one.
fn inverse(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    matrix(rows).try_inverse().unwrap_or_else(Matrix3::identity)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CURVES: [Tonemap; 4] = [Tonemap::Neutral, Tonemap::Agx, Tonemap::Aces, Tonemap::None];

    /// The brightest grey that a curve tells from brighter ones.
    fn brightest(curve: Tonemap) -> f64 {
        match curve {
            Tonemap::Neutral => NEUTRAL_BRIGHTEST,
            Tonemap::Agx => AGX_BRIGHTEST,
            Tonemap::Aces => ACES_BRIGHTEST,
            Tonemap::None => 1.0,
        }
    }

    /// Maps `exposed + more` to a display and back.
    fn found(exposed: DVec3, more: DVec3, curve: Tonemap) -> DVec3 {
        input_referred(exposed, tone_map::<f64>(exposed + more, curve), curve)
    }

    #[test]
    fn greys_and_nearly_greys_come_back_exactly_up_to_where_the_curve_is_flat() {
        let greys =
            [0.005, 0.01, 0.03, 0.0799, 0.08, 0.0801, 0.2, 0.5, 0.79, 0.8, 0.8001, 1.0, 1.2, 1.5, 1.8, 2.5, 3.0];
        let tints =
            [DVec3::ZERO, DVec3::new(1e-3, 0.0, 0.0), DVec3::new(0.0, -1e-3, 2e-3), DVec3::new(-1e-9, 1e-9, 0.0)];
        let errors = [
            DVec3::splat(1e-4),
            DVec3::splat(-1e-4),
            DVec3::splat(0.015),
            DVec3::new(1e-4, -2e-4, 3e-4),
            DVec3::Y * 2e-3,
        ];
        let mut told = [0; CURVES.len()];
        for (told, curve) in told.iter_mut().zip(CURVES) {
            for case in 0..greys.len() * tints.len() * errors.len() {
                let (grey, rest) = (greys[case % greys.len()], case / greys.len());
                let (tint, more) = (tints[rest % tints.len()], errors[rest / tints.len()]);
                let exposed = DVec3::splat(grey) + tint;
                let found = found(exposed, more, curve);
                let what = format!("{curve:?} of {exposed} and {more}: {found}");
                if grey + 0.03 < brightest(curve) {
                    assert!((found - more).abs().max_element() < 1e-10, "{what}");
                    *told += 1;
                } else if grey - 0.03 > brightest(curve) && more.x == more.y && tint == DVec3::ZERO {
                    assert!(found.abs().max_element() < 1e-12, "{what}");
                }
            }
        }
        assert!(told.iter().all(|&told| told >= 180), "{told:?}");
    }

    #[test]
    fn the_brightest_light_is_where_a_curve_rises_by_a_32nd() {
        for curve in [Tonemap::Neutral, Tonemap::Agx, Tonemap::Aces] {
            let shown = |light: f64| tone_map::<f64>(DVec3::splat(light), curve).x;
            let (light, step) = (brightest(curve), 1e-5);
            let slope = (shown(light + step) - shown(light - step)) / (2.0 * step);
            assert!((slope * 32.0 - 1.0).abs() < 1e-3, "{curve:?}: {slope}");
        }
    }

    #[test]
    fn what_is_shown_alike_is_no_error() {
        for exposed in [DVec3::ZERO, DVec3::new(0.3, 0.2, 0.5), DVec3::new(0.0, 0.0, 7.0), DVec3::splat(1e30)] {
            for curve in CURVES {
                assert_eq!(found(exposed, DVec3::ZERO, curve), DVec3::ZERO, "{curve:?} {exposed}");
            }
        }
    }

    #[test]
    fn light_that_a_curve_does_not_tell_counts_as_the_brightest_that_it_does() {
        // Clamped, and just not.
        let found = input_referred(DVec3::new(2.0, 0.9, 0.0), DVec3::new(0.9, 0.8, 0.1), Tonemap::None);
        assert!((found - DVec3::new(-0.1, -0.1, 0.1)).abs().max_element() < 1e-9, "{found}");
        for curve in CURVES {
            // Greys that are far too bright all look alike, and yet one that is not is told from them.
            let found = input_referred(DVec3::splat(1e3), DVec3::splat(0.999), curve);
            assert!(found.abs().max_element() < 2e-3, "{curve:?}: {found}");
            let shown = tone_map::<f64>(DVec3::splat(0.5), curve);
            let found = input_referred(DVec3::splat(1e3), shown, curve);
            assert!((found - (0.5 - brightest(curve))).abs().max_element() < 1e-3, "{curve:?}: {found}");
        }
        assert!(input_referred(DVec3::new(f64::INFINITY, 0.0, 0.0), DVec3::ONE, Tonemap::Aces).is_nan());
    }

    proptest! {
        #[test]
        fn any_light_that_no_curve_clamps_comes_back(light in prop::array::uniform3(1e-3..1.8f64)) {
            let light = DVec3::from(light);
            for curve in CURVES {
                let shown = tone_map::<f64>(light, curve);
                if shown.min_element() > 0.0 && shown.max_element() < 1.0 {
                    let found = super::light(shown, curve);
                    prop_assert!((found - light).abs().max_element() < 1e-9, "{:?} of {}: {}", curve, light, found);
                }
            }
        }

        #[test]
        fn whatever_is_shown_comes_from_finite_light(codes in prop::array::uniform3(0..=255u8)) {
            let shown = DVec3::from(codes.map(|code| f64::from(code) / 255.0));
            for curve in CURVES {
                let found = super::light(shown, curve);
                prop_assert!(found.is_finite() && found.abs().max_element() < 12.0, "{:?} of {}: {}", curve, shown, found);
            }
        }
    }
}
