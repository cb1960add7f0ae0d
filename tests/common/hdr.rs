//! Values that HDR displays take, computed in 64 bits from the standards.

use glam::{DMat3, DVec3};

/// SMPTE ST 2084, equation 5.2, with the fractions that define its constants: 0 to 1 of a brightness in nits.
pub fn perceptual_quantizer(nits: f64) -> f64 {
    let (m1, m2) = (2610.0 / 16384.0, 2523.0 / 4096.0 * 128.0);
    let [c1, c2, c3] = [3424.0 / 4096.0, 2413.0 / 4096.0 * 32.0, 2392.0 / 4096.0 * 32.0];
    let y = (nits / 10_000.0).clamp(0.0, 1.0).powf(m1);
    ((c1 + c2 * y) / (1.0 + c3 * y)).powf(m2)
}

/// Returns the matrix from linear ITU-R BT.709 to linear BT.2020.
pub fn to_rec2020() -> DMat3 {
    let rec709 = to_xyz([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]]);
    let rec2020 = to_xyz([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]]);
    rec2020.inverse() * rec709
}

/// Returns the matrix from linear light of these primaries, with D65 as white, to CIE XYZ in which white has luminance 1.
fn to_xyz(primaries: [[f64; 2]; 3]) -> DMat3 {
    let xyz = |[x, y]: [f64; 2]| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let [red, green, blue] = primaries.map(xyz);
    let all = DMat3::from_cols(red, green, blue);
    all * DMat3::from_diagonal(all.inverse() * xyz([0.3127, 0.3290]))
}

#[test]
fn the_formulas_here_have_the_values_of_their_standards() {
    // SMPTE ST 2084: 10000 nits are all of the range; ITU-R BT.2408, table 1: 58 % at 203 nits, 75 % at 1000.
    for (nits, expected, digits) in
        [(10_000.0, 1.0, 1e-12), (203.0, 0.58, 5e-3), (1000.0, 0.75, 5e-3), (0.0, 0.0, 1e-6)]
    {
        let value = perceptual_quantizer(nits);
        assert!((value - expected).abs() < digits, "{nits} nits: {value}");
    }
    // ITU-R BT.2087, as it is rounded there.
    let expected = [[0.6274, 0.0691, 0.0164], [0.3293, 0.9195, 0.0880], [0.0433, 0.0114, 0.8956]];
    assert!(to_rec2020().abs_diff_eq(DMat3::from_cols_array_2d(&expected), 0.6e-4), "{}", to_rec2020());
}
