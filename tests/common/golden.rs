//! Golden images: pictures as they looked when somebody last looked at them.

use std::path::{Path, PathBuf};

use image::RgbImage;

use super::gpu::{bytes, is_swiftshader};
use afterlight::frame::Picture;
use afterlight::gpu::PhysicalDevice;
use afterlight_truth::measure::{Srgb8Image, flip};

/// A pixel whose channels all differ by no more codes than this counts as the same.
///
/// One driver draws different pictures on different processors: lavapipe divides by the processor's reciprocal estimate, whose
/// last bits are the vendor's own, so that texture coordinates come out a little aside and a fifth of all textured pixels differ by a
/// code or two. FLIP adds that up over the picture to as much as a mistake has, although nobody can see it. A mistake that
/// moves every pixel by so little would go unnoticed here: pictures that can be worked out are compared code by code in `pixels.rs`.
pub const SAME_WITHIN: u8 = 2;

/// The largest mean FLIP error that passes, of the pixels that are not the same.
///
/// The errors that are left are single pixels along edges, where each driver rasterizes and filters as it may.
pub const LARGEST_MEAN: f64 = 0.004;

/// The mean FLIP error of each image on SwiftShader, against lavapipe's golden image. SwiftShader rasterizes with 4 bits of a pixel where lavapipe
/// has 8, so that many more edges fall on the other side of a pixel's centre; a picture as a whole is the same.
const ON_SWIFTSHADER: &str = include_str!("../golden/swiftshader.txt");

/// The largest mean FLIP error of an image that passes on a driver.
pub fn bound(name: &str, device: &PhysicalDevice) -> f64 {
    if !is_swiftshader(device) {
        return LARGEST_MEAN;
    }
    let listed = ON_SWIFTSHADER.lines().find_map(|line| line.split_once(' ').filter(|(of, _)| *of == name));
    let measured = listed.and_then(|(_, mean)| mean.trim().parse::<f64>().ok());
    // A tenth more is left to other versions and processors.
    measured.map_or(LARGEST_MEAN, |mean| (mean * 1.1).max(LARGEST_MEAN))
}

fn folder(name: &str) -> PathBuf {
    PathBuf::from(env!("AFTERLIGHT_ROOT")).join(name)
}

fn rgb(picture: &Picture) -> RgbImage {
    let rgb = bytes(picture).chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    RgbImage::from_raw(picture.size[0], picture.size[1], rgb).unwrap_or_else(|| panic!("a picture of the wrong length"))
}

fn save(path: &Path, image: &RgbImage) {
    let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    made.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    image.save(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

/// The mean FLIP error of two pictures of one size, where they differ by more than [`SAME_WITHIN`], and its map.
pub fn flip_error(expected: &RgbImage, actual: &RgbImage) -> (f64, RgbImage) {
    let (width, height) = expected.dimensions();
    let pixels = |image: &RgbImage| image.pixels().map(|pixel| pixel.0).collect();
    let expected = Srgb8Image { size: [width, height], pixels: pixels(expected) };
    let mut actual = Srgb8Image { size: actual.dimensions().into(), pixels: pixels(actual) };
    for (actual, expected) in actual.pixels.iter_mut().zip(&expected.pixels) {
        if actual.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= SAME_WITHIN) {
            *actual = *expected;
        }
    }
    let map = flip(&actual, &expected).unwrap_or_else(|error| panic!("{error}"));
    let heat = map.heat().pixels.as_flattened().to_vec();
    let image = RgbImage::from_raw(width, height, heat);
    (map.mean(), image.unwrap_or_else(|| panic!("a FLIP map of the wrong length")))
}

/// Compares a picture with `tests/golden/NAME.png`. If they differ by more than is allowed, AFTERLIGHT_BLESS=1 rewrites that file; smaller
/// differences, such as another run's rounding, leave it as it is. The error describes the difference; expected, actual and difference are then in
/// `target/test-output/NAME`.
pub fn check(name: &str, picture: &Picture, device: &PhysicalDevice) -> Result<(), String> {
    let actual = rgb(picture);
    let golden = folder("tests/golden").join(format!("{name}.png"));
    let blessed = || {
        let wanted = std::env::var("AFTERLIGHT_BLESS").is_ok_and(|value| value == "1");
        assert!(!wanted || !is_swiftshader(device), "golden images are lavapipe's");
        if wanted {
            save(&golden, &actual);
        }
        wanted
    };
    let output = folder("target/test-output").join(name);
    let expected = match image::open(&golden) {
        Ok(image) => image.into_rgb8(),
        Err(_) if blessed() => return Ok(()),
        Err(error) => {
            save(&output.join("actual.png"), &actual);
            return Err(format!("{}: {error}; AFTERLIGHT_BLESS=1 makes it from this picture", golden.display()));
        }
    };
    if expected.dimensions() != actual.dimensions() {
        if blessed() {
            return Ok(());
        }
        save(&output.join("actual.png"), &actual);
        return Err(format!("{name}: {:?} instead of {:?}", actual.dimensions(), expected.dimensions()));
    }
    let (mean, difference) = flip_error(&expected, &actual);
    let largest = bound(name, device);
    eprintln!("{name}: mean FLIP {mean:.5}, of {largest:.5}");
    if mean <= largest || blessed() {
        return Ok(());
    }
    save(&output.join("expected.png"), &expected);
    save(&output.join("actual.png"), &actual);
    save(&output.join("difference.png"), &difference);
    Err(format!("{name}: mean FLIP {mean:.4} exceeds {largest}; see {}", output.display()))
}
