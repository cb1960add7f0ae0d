//! The picture of each step.

use afterlight_scene::builtin;
use glam::DVec3;
use image::RgbaImage;

use crate::program::whole;
use crate::truth::{codes, positions, radiance};

/// The largest difference of a channel for each pixel, in codes, rows from the top.
fn differences(picture: &RgbaImage, expected: &[[u8; 3]]) -> Vec<u8> {
    assert_eq!(picture.pixels().len(), expected.len());
    let largest = |pixel: &image::Rgba<u8>, expected: &[u8; 3]| {
        (0..3).map(|channel| pixel[channel].abs_diff(expected[channel])).max().unwrap_or(0)
    };
    picture.pixels().zip(expected).map(|(pixel, expected)| largest(pixel, expected)).collect()
}

#[test]
fn step_00_fills_the_picture_with_one_colour() {
    let picture = whole("step-00-clear").picture;
    let expected = codes(glam::dvec3(0.05, 0.2, 0.5));
    assert_eq!(picture.dimensions(), (320, 180));
    assert!(picture.pixels().all(|pixel| pixel.0[..3] == expected && pixel[3] == 255), "expected {expected:?}");
}

#[test]
fn step_01_is_the_built_in_triangle_to_a_code() {
    let picture = whole("step-01-triangle").picture;
    let scene = builtin::open("triangle").expect("a built-in scene");
    let expected: Vec<_> = radiance(&scene, [320, 180]).into_iter().map(codes).collect();
    let most = differences(&picture, &expected).into_iter().max();
    assert!(most <= Some(1), "{most:?}");
}

/// Rasterization rounds corners to 1/256 pixel, which at the far end of the floor, where a pixel is a third of a metre long, is a millimetre.
/// Measured: at most 0.26 mm, and no pixel on an edge that falls to the other side.
#[test]
fn step_02_writes_positions_as_rays_find_them() {
    let path = whole("step-02-mesh").path.with_extension("f32");
    let bytes = std::fs::read(path).expect("positions");
    let floats: Vec<_> = bytes.as_chunks().0.iter().map(|bytes| f32::from_ne_bytes(*bytes)).collect();
    let (mut largest, mut elsewhere) = (0.0f64, 0);
    for (drawn, expected) in std::iter::zip(floats.as_chunks::<4>().0, positions([320, 180])) {
        let [x, y, z, seen] = drawn.map(f64::from);
        match expected {
            Some(place) if seen == 1.0 && place.distance(DVec3::new(x, y, z)) < 0.01 => {
                largest = largest.max(place.distance(DVec3::new(x, y, z)));
            }
            None if seen == 0.0 => {}
            _ => elsewhere += 1,
        }
    }
    println!("measured: {largest} m, {elsewhere} pixels elsewhere");
    assert!(largest < 4e-4 && elsewhere <= 3, "{largest} m, {elsewhere} pixels elsewhere");
}
