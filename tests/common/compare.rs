//! Differences between two pictures.

use afterlight::frame::Picture;

use super::gpu::{bytes, floats, nits, places};

/// Returns the largest difference between two tone-mapped pictures, in codes, and its pixel.
pub fn largest_code_difference(a: &Picture, b: &Picture) -> (u8, (u32, u32)) {
    assert_eq!(a.size, b.size);
    let differences = bytes(a).iter().zip(bytes(b)).map(|(a, b)| a.abs_diff(*b)).enumerate();
    let (at, most) = differences.max_by_key(|&(_, difference)| difference).unwrap_or((0, 0));
    let pixel = at as u32 / 4;
    (most, (pixel % a.size[0], pixel / a.size[0]))
}

/// Asserts that two pictures are the same to the last bit.
pub fn assert_identical(a: &Picture, b: &Picture, what: &str) {
    assert_eq!(a.size, b.size, "{what}");
    if a == b {
        return;
    }
    let differing = match (&a.pixels, &b.pixels) {
        (afterlight::frame::Pixels::Srgb8(a), afterlight::frame::Pixels::Srgb8(b)) => {
            a.iter().zip(b).position(|(a, b)| a != b)
        }
        _ => floats(a).iter().zip(floats(b)).position(|(a, b)| a.to_bits() != b.to_bits()),
    };
    // Equal bits and unequal floats: NaN.
    let pixel = differing.unwrap_or_else(|| panic!("{what}: a picture holds NaN")) as u32 / 4;
    panic!("{what}: the pictures differ at ({}, {})", pixel % a.size[0], pixel / a.size[0]);
}

/// The largest difference of two linear pictures, relative to the brighter of the two values but to no less than `floor`.
pub fn largest_relative_difference(a: &Picture, b: &Picture, floor: f64) -> (f64, (u32, u32)) {
    assert_eq!(a.size, b.size);
    let mut most = (0.0, (0, 0));
    for (x, y) in places(a) {
        let (a, b) = (nits(a, x, y), nits(b, x, y));
        assert!(a.is_finite() && b.is_finite(), "({x}, {y}): {a} and {b}");
        let difference = ((a - b).abs() / a.max(b).max(glam::DVec3::splat(floor))).max_element();
        if difference > most.0 {
            most = (difference, (x, y));
        }
    }
    most
}
