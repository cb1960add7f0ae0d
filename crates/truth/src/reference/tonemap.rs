//! Tone mapping from exposed linear light to a display's light, both linear Rec. 709; the display's encoding; and the inverses of both.

mod inverse;

pub use inverse::input_referred;

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

use super::light::{Real, vector, widened};
use afterlight_scene::Tonemap;

/// Returns the display's value, 0 to 1 and linear, for any finite light that is not negative.
pub fn tone_map<R: Real>(exposed: DVec3, curve: Tonemap) -> DVec3 {
    let exposed: Vector3<R> = vector(exposed);
    let mapped = match curve {
        Tonemap::Neutral => neutral(exposed),
        Tonemap::Agx => agx(exposed),
        Tonemap::Aces => aces(exposed),
        Tonemap::None => exposed,
    };
    widened(mapped.map(|channel| channel.max(R::zero()).min(R::one())))
}

/// IEC 61966-2-1: from linear, 0 to 1, to encoded.
pub fn encode_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(2.4f64.recip()) - 0.055 }
}

/// Inverse of [`encode_srgb`].
pub fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The Fresnel reflection added to a base colour.
const NEUTRAL_OFFSET: f64 = 0.04;
/// The brightness at which compression begins.
const NEUTRAL_START: f64 = 0.8 - NEUTRAL_OFFSET;
const NEUTRAL_DESATURATION: f64 = 0.15;

/// Khronos PBR Neutral Tone Mapper (Khronos Group 2024): takes off the light that Fresnel reflection adds to a base colour, leaves
/// colours as they are below 0.76, and compresses and desaturates brighter ones.
fn neutral<R: Real>(color: Vector3<R>) -> Vector3<R> {
    let number = R::of;
    let (start, desaturation) = (number(NEUTRAL_START), number(NEUTRAL_DESATURATION));
    let least = color.x.min(color.y).min(color.z);
    let offset = if least < number(0.08) { least - number(6.25) * least * least } else { number(NEUTRAL_OFFSET) };
    let color = color.map(|channel| channel - offset);
    let peak = color.x.max(color.y).max(color.z);
    if peak < start {
        return color;
    }
    let above = R::one() - start;
    let compressed = R::one() - above * above / (peak + above - start);
    let grey = R::one() - R::one() / (desaturation * (peak - compressed) + R::one());
    color.map(|channel| channel * (compressed / peak) * (R::one() - grey) + compressed * grey)
}

const AGX_INSET: [[f64; 3]; 3] = [
    [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
    [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
    [0.0423756549057051, 0.0784336, 0.879142973793104],
];
const AGX_OUTSET: [[f64; 3]; 3] = [
    [1.19687900512017, -0.0980208811401368, -0.0990297440797205],
    [-0.0528968517574562, 1.15190312990417, -0.0989611768448433],
    [-0.0529716355144438, -0.0980434501171241, 1.15107367264116],
];
/// Stops around middle grey that AgX's curve spans.
const AGX_STOPS: [f64; 2] = [-12.47393, 4.026069];
/// Coefficients from the sixth power down.
const AGX_CONTRAST: [f64; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];

/// AgX (Troy Sobotka 2022) with Benjamin Wrensch's polynomial for its contrast curve ("Minimal AgX Implementation", 2023).
fn agx<R: Real>(color: Vector3<R>) -> Vector3<R> {
    let (least, most) = (R::of(AGX_STOPS[0]), R::of(AGX_STOPS[1]));
    let curved = (matrix(AGX_INSET) * color).map(|channel| {
        let stops = channel.max(R::of(1e-10)).log2().max(least).min(most);
        let x = (stops - least) / (most - least);
        AGX_CONTRAST.into_iter().fold(R::zero(), |sum, coefficient| sum * x + R::of(coefficient))
    });
    (matrix(AGX_OUTSET) * curved).map(|channel| channel.max(R::zero()).powf(R::of(2.2)))
}

const ACES_INPUT: [[f64; 3]; 3] =
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
const ACES_OUTPUT: [[f64; 3]; 3] =
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
/// Above and below the fraction: the factors of the square, of the value, and of 1.
const ACES_CURVE: [[f64; 3]; 2] = [[1.0, 0.0245786, -0.000090537], [0.983729, 0.432951, 0.238081]];

/// The ACES reference and output transforms, as fitted by Stephen Hill (2017).
fn aces<R: Real>(color: Vector3<R>) -> Vector3<R> {
    // White long before, and a limit of the model: squares of more than that are not held by single precision.
    let limited = color.map(|channel| channel.min(R::of(65000.0)));
    let curved = (matrix(ACES_INPUT) * limited).map(|v| {
        let [above, below] =
            ACES_CURVE.map(|[square, linear, constant]| v * (R::of(square) * v + R::of(linear)) + R::of(constant));
        above / below
    });
    matrix(ACES_OUTPUT) * curved
}

fn matrix<R: Real>(rows: [[f64; 3]; 3]) -> Matrix3<R> {
    Matrix3::from_fn(|row, column| R::of(rows[row][column]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CURVES: [Tonemap; 4] = [Tonemap::Neutral, Tonemap::Agx, Tonemap::Aces, Tonemap::None];

    fn close(color: DVec3, curve: Tonemap, expected: DVec3, tolerance: f64) {
        let mapped = tone_map::<f64>(color, curve);
        assert!((mapped - expected).abs().max_element() <= tolerance, "{curve:?} of {color}: {mapped}, not {expected}");
    }

    #[test]
    fn neutral_takes_off_the_fresnel_offset_and_compresses_above_0_76() {
        let grey = |light: f64, shown: f64| close(DVec3::splat(light), Tonemap::Neutral, DVec3::splat(shown), 1e-15);
        grey(0.3, 0.26);
        // 6.25 x^2 below 0.08.
        grey(0.02, 0.0025);
        // 4 - 0.04 = 3.96; 1 - 0.24^2 / (3.96 + 0.24 - 0.76).
        grey(4.0, 1.0 - 0.0576 / 3.44);
        // Green alone: no offset; 1 - 0.24^2 / (2 - 0.52), and the others by the share of grey.
        let peak = 1.0 - 0.0576 / 1.48;
        let share = 1.0 - 1.0 / (0.15 * (2.0 - peak) + 1.0);
        close(DVec3::Y * 2.0, Tonemap::Neutral, DVec3::new(peak * share, peak, peak * share), 1e-15);
    }

    #[test]
    fn agx_is_black_at_its_foot_its_polynomial_between_and_white_at_its_shoulder() {
        close(DVec3::splat(1e-5), Tonemap::Agx, DVec3::ZERO, 0.0);
        // Half of the stops: the polynomial at 1/2 is 0.291 492 5. The matrices' rows add up to 1 within 2e-4.
        let middle = ((-12.47393f64 + 4.026069) / 2.0).exp2();
        close(DVec3::splat(middle), Tonemap::Agx, DVec3::splat(0.291_492_5f64.powf(2.2)), 1e-4);
        // The coefficients add up to 0.998 58.
        close(DVec3::splat(1e4), Tonemap::Agx, DVec3::splat(0.998_58f64.powf(2.2)), 5e-4);
    }

    #[test]
    fn aces_of_grey_is_its_rational_function_and_nothing_overflows() {
        let v = 0.5;
        let expected = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
        // Rows add up to 1 within 1e-5.
        close(DVec3::splat(v), Tonemap::Aces, DVec3::splat(expected), 2e-5);
        // 1 / 0.983729 in each channel: more than white.
        close(DVec3::splat(1e30), Tonemap::Aces, DVec3::ONE, 0.0);
        close(DVec3::ZERO, Tonemap::Aces, DVec3::ZERO, 0.0);
    }

    /// The figures of book/src/light.md.
    #[test]
    fn neutral_stays_below_white_agx_ends_at_0_997_and_aces_is_white_from_25_7_on() {
        let grey = |light: f64, curve| tone_map::<f64>(DVec3::splat(light), curve).min_element();
        for light in [0.08, 0.3, 0.79] {
            assert!((light - grey(light, Tonemap::Neutral) - 0.04).abs() < 1e-15, "{light}");
        }
        for light in [0.8, 1.0, 26.0, 1e4, 1e9] {
            let expected = 1.0 - 0.0576 / (light - 0.56);
            assert!((grey(light, Tonemap::Neutral) - expected).abs() < 1e-12 && expected < 1.0, "{light}");
        }
        let most =
            (-200..=400).map(|tenth| grey(10f64.powf(f64::from(tenth) / 10.0), Tonemap::Agx)).fold(0.0, f64::max);
        assert!((most - 0.997).abs() < 5e-4, "{most}");
        assert!(grey(25.6, Tonemap::Aces) < 1.0 && grey(25.7, Tonemap::Aces) == 1.0);
    }

    #[test]
    fn none_clamps() {
        close(DVec3::new(0.2, 1.0, 7.0), Tonemap::None, DVec3::new(0.2, 1.0, 1.0), 0.0);
    }

    #[test]
    fn the_srgb_curve_has_its_known_values_and_comes_back() {
        // Half of the light is code 187.5 of 255; middle grey 0.18 is 117.6.
        assert!((encode_srgb(0.5) * 255.0 - 187.516).abs() < 1e-3, "{}", encode_srgb(0.5) * 255.0);
        assert!((encode_srgb(0.18) * 255.0 - 117.65).abs() < 1e-2, "{}", encode_srgb(0.18) * 255.0);
        assert!(encode_srgb(0.0) == 0.0 && (encode_srgb(0.001) - 0.01292).abs() < 1e-15);
        for step in 0..=1000 {
            let linear = f64::from(step) / 1000.0;
            assert!((decode_srgb(encode_srgb(linear)) - linear).abs() < 1e-7, "{linear}");
        }
    }

    proptest! {
        #[test]
        fn every_finite_light_is_shown_between_0_and_1(exponents in [-40.0..38.0f64, -40.0..38.0, -40.0..38.0], zero in 0..8u8) {
            let mut color = DVec3::from(exponents.map(|exponent| 10f64.powf(exponent)));
            (0..3).filter(|bit| zero >> bit & 1 == 1).for_each(|channel| color[channel] = 0.0);
            for curve in CURVES {
                for mapped in [tone_map::<f64>(color, curve), tone_map::<f32>(color, curve)] {
                    prop_assert!(mapped.is_finite(), "{curve:?} {color} {mapped}");
                    prop_assert!(mapped.min_element() >= 0.0 && mapped.max_element() <= 1.0, "{curve:?} {color} {mapped}");
                }
            }
        }

        #[test]
        fn single_precision_is_within_2e_5_of_double(exponents in [-5.0..3.0f64, -5.0..3.0, -5.0..3.0]) {
            let color = DVec3::from(exponents.map(|exponent| 10f64.powf(exponent)));
            for curve in CURVES {
                let (single, double) = (tone_map::<f32>(color, curve), tone_map::<f64>(color, curve));
                prop_assert!((single - double).abs().max_element() < 2e-5, "{curve:?} {color} {single} {double}");
            }
        }
    }
}
