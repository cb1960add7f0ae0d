//! The colour of a black body: Planck's law seen by the standard observer, as linear Rec. 709 RGB.

use std::ops::RangeInclusive;

use glam::{DMat3, DVec3, Vec3};

/// The temperatures of light in kelvin that have a colour here: red-hot iron to the bluest stars.
pub const KELVIN: RangeInclusive<f64> = 1000.0..=40_000.0;

/// Second radiation constant h c / k in metre kelvin (CODATA 2018; exact, as its factors are by definition).
const SECOND_RADIATION: f64 = 1.438_776_877e-2;

/// The colour of a black body of `kelvin`, in linear Rec. 709 and of luminance 1, so that a light's intensity keeps its photometric
/// meaning. A temperature out of [`KELVIN`] counts as the nearer end.
///
/// Colours redder than about 1,900 K lie outside Rec. 709: their blue would be negative and is 0.
pub fn black_body_color(kelvin: f64) -> Vec3 {
    let rgb = rec709(black_body_xyz(kelvin.clamp(*KELVIN.start(), *KELVIN.end()))).max(DVec3::ZERO);
    // `exposure::luminance` in f64.
    (rgb / rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))).as_vec3()
}

/// Tristimulus values of Planck's law, up to a factor: the sum over the observer's table, by CIE 15:2004, section 7.1. The chromaticity agrees with a
/// sum in steps of 1 nm to within 5e-6.
fn black_body_xyz(kelvin: f64) -> DVec3 {
    (0..X_BAR.len()).fold(DVec3::ZERO, |sum, index| {
        let metres = (FIRST_NM + STEP_NM * index as f64) * 1e-9;
        // Powers of the wavelength in micrometres do not overflow; the scale cancels.
        let radiance = (metres * 1e6).powi(-5) / (SECOND_RADIATION / (metres * kelvin)).exp_m1();
        sum + DVec3::new(X_BAR[index], Y_BAR[index], Z_BAR[index]) * radiance
    })
}

/// Converts CIE 1931 XYZ to the primaries and the white (D65) of ITU-R BT.709, by the inverse of the matrix of IEC 61966-2-1.
fn rec709(xyz: DVec3) -> DVec3 {
    let rows = DMat3::from_cols(
        DVec3::new(3.240_454_2, -1.537_138_5, -0.498_531_4),
        DVec3::new(-0.969_266_0, 1.876_010_8, 0.041_556_0),
        DVec3::new(0.055_643_4, -0.204_025_9, 1.057_225_2),
    );
    rows.transpose() * xyz
}

// The CIE 1931 standard colorimetric observer, 2 degrees (CIE 15:2004, table 4; CIE 018:2019 beyond 780 nm), from 360 to 830 nm. A fit by
// Gaussians (Wyman, Sloan and Shirley 2013) is shorter, but at 1,000 K it is 0.01 off in x and y; Kim et al.'s spline of the locus
// (2002) starts at 1,667 K.
const FIRST_NM: f64 = 360.0;
const STEP_NM: f64 = 5.0;
const X_BAR: [f64; 95] = [
    0.00013, 0.000232, 0.000415, 0.000742, 0.001368, 0.002236, 0.004243, 0.00765, 0.01431, 0.02319, 0.04351, 0.07763,
    0.13438, 0.21477, 0.2839, 0.3285, 0.34828, 0.34806, 0.3362, 0.3187, 0.2908, 0.2511, 0.19536, 0.1421, 0.09564,
    0.05795, 0.03201, 0.0147, 0.0049, 0.0024, 0.0093, 0.0291, 0.06327, 0.1096, 0.1655, 0.22575, 0.2904, 0.3597,
    0.43345, 0.51205, 0.5945, 0.6784, 0.7621, 0.8425, 0.9163, 0.9786, 1.0263, 1.0567, 1.0622, 1.0456, 1.0026, 0.9384,
    0.85445, 0.7514, 0.6424, 0.5419, 0.4479, 0.3608, 0.2835, 0.2187, 0.1649, 0.1212, 0.0874, 0.0636, 0.04677, 0.0329,
    0.0227, 0.01584, 0.011359, 0.008111, 0.00579, 0.004109, 0.002899, 0.002049, 0.00144, 0.001, 0.00069, 0.000476,
    0.000332, 0.000235, 0.000166, 0.000117, 0.000083, 0.000059, 0.000042, 0.000029, 0.000021, 0.000015, 0.00001,
    0.000007, 0.000005, 0.000004, 0.000003, 0.000002, 0.000001,
];
const Y_BAR: [f64; 95] = [
    0.000004, 0.000007, 0.000012, 0.000022, 0.000039, 0.000064, 0.00012, 0.000217, 0.000396, 0.00064, 0.00121, 0.00218,
    0.004, 0.0073, 0.0116, 0.01684, 0.023, 0.0298, 0.038, 0.048, 0.06, 0.0739, 0.09098, 0.1126, 0.13902, 0.1693,
    0.20802, 0.2586, 0.323, 0.4073, 0.503, 0.6082, 0.71, 0.7932, 0.862, 0.91485, 0.954, 0.9803, 0.99495, 1.0, 0.995,
    0.9786, 0.952, 0.9154, 0.87, 0.8163, 0.757, 0.6949, 0.631, 0.5668, 0.503, 0.4412, 0.381, 0.321, 0.265, 0.217,
    0.175, 0.1382, 0.107, 0.0816, 0.061, 0.04458, 0.032, 0.0232, 0.017, 0.01192, 0.00821, 0.005723, 0.004102, 0.002929,
    0.002091, 0.001484, 0.001047, 0.00074, 0.00052, 0.000361, 0.000249, 0.000172, 0.00012, 0.000085, 0.00006, 0.000042,
    0.00003, 0.000021, 0.000015, 0.000011, 0.000007, 0.000005, 0.000004, 0.000003, 0.000002, 0.000001, 0.000001,
    0.000001, 0.0,
];
const Z_BAR: [f64; 95] = [
    0.000606, 0.001086, 0.001946, 0.003486, 0.00645, 0.01055, 0.02005, 0.03621, 0.06785, 0.1102, 0.2074, 0.3713,
    0.6456, 1.03905, 1.3856, 1.62296, 1.74706, 1.7826, 1.77211, 1.7441, 1.6692, 1.5281, 1.28764, 1.0419, 0.81295,
    0.6162, 0.46518, 0.3533, 0.272, 0.2123, 0.1582, 0.1117, 0.07825, 0.05725, 0.04216, 0.02984, 0.0203, 0.0134,
    0.00875, 0.00575, 0.0039, 0.00275, 0.0021, 0.0018, 0.00165, 0.0014, 0.0011, 0.001, 0.0008, 0.0006, 0.00034,
    0.00024, 0.00019, 0.0001, 0.00005, 0.00003, 0.00002, 0.00001, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    0.0, 0.0, 0.0, 0.0,
];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::luminance;

    fn chromaticity(xyz: DVec3) -> [f64; 2] {
        [xyz.x, xyz.y].map(|value| value / (xyz.x + xyz.y + xyz.z))
    }

    #[test]
    fn the_chromaticities_are_the_published_ones() {
        // CIE standard illuminant A is 2856 K; the others from the same integral in steps of 1 nm. Five digits.
        for (kelvin, x, y) in [
            (1000.0, 0.65275, 0.34446),
            (2000.0, 0.52668, 0.41330),
            (2855.5, 0.44758, 0.40745),
            (4000.0, 0.38044, 0.37675),
            (5000.0, 0.34510, 0.35161),
            (6500.0, 0.31353, 0.32363),
            (10_000.0, 0.28063, 0.28829),
            (40_000.0, 0.24720, 0.24472),
        ] {
            let found = chromaticity(black_body_xyz(kelvin));
            assert!((found[0] - x).abs() < 2e-5 && (found[1] - y).abs() < 2e-5, "{kelvin} K: {found:?}");
        }
    }

    #[test]
    fn at_6504_kelvin_it_is_nearly_white() {
        // D65's correlated colour temperature: daylight lies beside the black body's locus, 0.0032 away in CIE 1960 u, v.
        let uv = |[x, y]: [f64; 2]| DVec3::new(4.0 * x, 6.0 * y, 0.0) / (-2.0 * x + 12.0 * y + 3.0);
        let apart = uv(chromaticity(black_body_xyz(6504.0))) - uv([0.312_71, 0.329_02]);
        assert!((apart.length() - 0.0032).abs() < 1e-4, "{apart}");
        assert!((black_body_color(6504.0) - Vec3::ONE).abs().max_element() < 0.05);
    }

    #[test]
    fn rec709_white_is_d65_and_its_luminance_is_y() {
        let d65 = DVec3::new(0.950_47, 1.0, 1.088_83);
        assert!((rec709(d65) - 1.0).abs().max_element() < 1e-4, "{}", rec709(d65));
    }

    proptest! {
        #[test]
        fn every_temperature_has_a_colour_of_luminance_one(kelvin in KELVIN) {
            let color = black_body_color(kelvin);
            prop_assert!(color.is_finite() && color.min_element() >= 0.0, "{color}");
            prop_assert!((luminance(color) - 1.0).abs() < 1e-6, "{color}");
        }

        #[test]
        fn hotter_is_bluer(kelvin in 1000.0..39_000.0f64, more in 1.001..1.5f64) {
            let (cooler, hotter) = (black_body_color(kelvin), black_body_color(kelvin * more));
            prop_assert!(hotter.x < cooler.x || kelvin * more > 40_000.0, "{cooler} {hotter}");
            prop_assert!(hotter.z > cooler.z || hotter.z == 0.0 || kelvin * more > 40_000.0, "{cooler} {hotter}");
        }

        #[test]
        fn out_of_range_is_the_nearer_end(kelvin in 40_000.0..1e9f64) {
            prop_assert_eq!(black_body_color(kelvin), black_body_color(40_000.0));
            prop_assert_eq!(black_body_color(1e6 / kelvin), black_body_color(1000.0));
        }
    }
}
