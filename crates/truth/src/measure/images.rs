//! Pictures as they are compared, without alpha: the renderer's are opaque.

/// Two pictures of different sizes cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "cannot compare a picture of {}x{} pixels with one of {}x{}",
    actual[0], actual[1], expected[0], expected[1]
)]
/// Two images of different sizes, in pixels.
pub struct Mismatch {
    /// Size of the image that is compared.
    pub actual: [u32; 2],
    /// Size of the image that it is compared with.
    pub expected: [u32; 2],
}

/// Linear RGB, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearImage {
    /// Width and height in pixels; their product is the number of `pixels`.
    pub size: [u32; 2],
    /// RGB, rows from the top.
    pub pixels: Vec<[f64; 3]>,
}

/// RGB as it is shown, in sRGB codes; rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Srgb8Image {
    /// Width and height in pixels; their product is the number of `pixels`.
    pub size: [u32; 2],
    /// RGB, rows from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl LinearImage {
    /// Converts RGBA samples; alpha is dropped.
    pub fn from_rgba(size: [u32; 2], rgba: &[f32]) -> Self {
        let pixels = rgba.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect();
        Self { size, pixels }
    }

    /// The picture with all samples multiplied, as by `afterlight_scene::exposure_scale`.
    pub fn scaled(&self, scale: f64) -> Self {
        Self { size: self.size, pixels: self.pixels.iter().map(|pixel| pixel.map(|sample| sample * scale)).collect() }
    }

    /// The mean of the photometric luminance of all pixels that are finite, in the picture's unit; 0 without any.
    pub fn mean_luminance(&self) -> f64 {
        let finite = self.pixels.iter().filter(|pixel| pixel.iter().all(|sample| sample.is_finite()));
        let (sum, count) =
            finite.fold((0.0, 0u64), |(sum, count), [r, g, b]| (sum + 0.2126 * r + 0.7152 * g + 0.0722 * b, count + 1));
        sum / count.max(1) as f64
    }
}

impl Srgb8Image {
    /// Converts RGBA samples; alpha is dropped.
    pub fn from_rgba(size: [u32; 2], rgba: &[u8]) -> Self {
        Self { size, pixels: rgba.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect() }
    }
}

/// Refuses pictures of different sizes, and pictures whose number of pixels does not match their size.
pub(super) fn same_size<A, B>(
    (actual, actual_pixels): ([u32; 2], &[A]),
    (expected, expected_pixels): ([u32; 2], &[B]),
) -> Result<(), Mismatch> {
    let whole = |[width, height]: [u32; 2], count: usize| u64::from(width) * u64::from(height) == count as u64;
    let same = actual == expected && whole(actual, actual_pixels.len()) && whole(expected, expected_pixels.len());
    if same { Ok(()) } else { Err(Mismatch { actual, expected }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_drop_alpha_and_scale() {
        let image = LinearImage::from_rgba([2, 1], &[1.0, 2.0, 3.0, 0.5, 4.0, 5.0, 6.0, 0.5]);
        assert_eq!(image.pixels, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(image.scaled(2.0).pixels[1], [8.0, 10.0, 12.0]);
        assert_eq!(Srgb8Image::from_rgba([1, 1], &[1, 2, 3, 4]).pixels, [[1, 2, 3]]);
    }

    #[test]
    fn the_mean_luminance_is_photometric_and_of_what_is_finite() {
        let image = LinearImage { size: [3, 1], pixels: vec![[1.0; 3], [0.0, 5.0, 0.0], [f64::NAN, 0.0, 0.0]] };
        assert!((image.mean_luminance() - (1.0 + 5.0 * 0.7152) / 2.0).abs() < 1e-12);
        assert_eq!(LinearImage { size: [0, 0], pixels: Vec::new() }.mean_luminance(), 0.0);
    }
}
