//! FLIP, the error that a viewer sees who flips between two pictures (Andersson et al. 2020), by NVIDIA's own code.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageFloat, FlipImageRgb8, magma_lut};
use rayon::prelude::*;

use super::images::{Mismatch, Srgb8Image, same_size};

/// The distance of the eye, as pixels in a degree of its view. 67 is a 0.7 m wide screen of 3840 pixels seen from 0.7 m, the authors' own
/// choice.
pub const PIXELS_PER_DEGREE: f32 = DEFAULT_PIXELS_PER_DEGREE;

/// The greatest distance in rows (and columns) that a pixel's error can come from: the larger of the two filters' radii. For the contrast sensitivity
/// the radius is three standard deviations of its widest Gaussian, ceil(3 sqrt(0.04 / (2 pi^2)) 67) = 10; for edges and points it is ceil(3 x 0.041 x
/// 67) = 9.
const REACH: usize = 10;
/// The fewest rows of a band: a band also filters [`REACH`] more rows on either side.
const LEAST_ROWS: usize = 4 * REACH;

/// The error at each pixel, 0 (none) to 1, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipMap {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// One error a pixel, 0 to 1, rows from the top.
    pub errors: Vec<f32>,
}

impl FlipMap {
    /// The mean over all pixels: the picture's FLIP error. 0 for a picture without pixels.
    pub fn mean(&self) -> f64 {
        self.errors.iter().map(|&error| f64::from(error)).sum::<f64>() / self.errors.len().max(1) as f64
    }

    /// The map as a picture, from black (no error) over purple and orange to pale yellow (1): matplotlib's "magma".
    pub fn heat(&self) -> Srgb8Image {
        if self.errors.is_empty() {
            return Srgb8Image { size: self.size, pixels: Vec::new() };
        }
        let [width, height] = self.size;
        let heat = FlipImageFloat::with_data(width, height, &self.errors).apply_color_lut(&magma_lut()).to_vec();
        Srgb8Image { size: self.size, pixels: heat.as_chunks::<3>().0.to_vec() }
    }
}

/// Computes LDR-FLIP of two pictures at [`PIXELS_PER_DEGREE`]. Each of rayon's threads takes a band of rows. The errors equal a computation on the
/// whole picture to the bit.
///
/// # Errors
/// When the sizes differ, or a picture does not have as many pixels as it says.
pub fn flip(actual: &Srgb8Image, expected: &Srgb8Image) -> Result<FlipMap, Mismatch> {
    same_size((actual.size, &actual.pixels), (expected.size, &expected.pixels))?;
    let size = actual.size;
    if actual.pixels.is_empty() {
        return Ok(FlipMap { size, errors: Vec::new() });
    }
    let [width, height] = size.map(|side| side as usize);
    let rows = height.div_ceil(rayon::current_num_threads()).max(LEAST_ROWS);
    let mut errors = vec![0.0; width * height];
    errors.par_chunks_mut(rows * width).enumerate().for_each(|(band, own)| {
        let first = band * rows;
        let above = first.min(REACH);
        let end = (first + own.len() / width + REACH).min(height);
        let [actual, expected] = [actual, expected].map(|image| {
            let pixels = &image.pixels[(first - above) * width..end * width];
            FlipImageRgb8::with_data(size[0], (end - first + above) as u32, pixels.as_flattened())
        });
        let with_reach = nv_flip::flip(expected, actual, PIXELS_PER_DEGREE).to_vec();
        own.copy_from_slice(&with_reach[above * width..][..own.len()]);
    });
    Ok(FlipMap { size, errors })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(color: [u8; 3]) -> Srgb8Image {
        Srgb8Image { size: [32, 24], pixels: vec![color; 32 * 24] }
    }

    #[test]
    fn equal_pictures_have_none_and_black_against_white_has_all() {
        let gray = filled([120; 3]);
        let none = flip(&gray, &gray).expect("sizes agree");
        assert_eq!((none.mean(), none.errors.len()), (0.0, 32 * 24));
        let all = flip(&filled([0; 3]), &filled([255; 3])).expect("sizes agree").mean();
        // 0.972 of the perceptual range: black and white are not the pair that is farthest apart, green and blue are.
        assert!((0.95..=1.0).contains(&all), "{all}");
    }

    #[test]
    fn the_error_grows_with_the_difference_and_lies_where_it_is() {
        let expected = filled([120; 3]);
        let mut spot = expected.clone();
        spot.pixels[12 * 32 + 4] = [255, 0, 0];
        let map = flip(&spot, &expected).expect("sizes agree");
        let most = map.errors.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map(|(at, _)| at);
        assert_eq!(most, Some(12 * 32 + 4));
        assert_eq!(map.errors[31], 0.0, "far away nothing is seen");
        let mean = |code| flip(&filled([code; 3]), &expected).expect("sizes agree").mean();
        assert!(0.0 < mean(122) && mean(122) < mean(140) && mean(140) < mean(200));
    }

    #[test]
    fn bands_are_the_whole_to_the_bit() {
        let size @ [width, height] = [48, 3 * LEAST_ROWS as u32 + 7];
        let mut random = fastrand::Rng::with_seed(7);
        let mut noise =
            || Srgb8Image { size, pixels: (0..width * height).map(|_| [0; 3].map(|_: u8| random.u8(..))).collect() };
        let (actual, expected) = (noise(), noise());
        let whole = {
            let [actual, expected] =
                [&actual, &expected].map(|image| FlipImageRgb8::with_data(width, height, image.pixels.as_flattened()));
            nv_flip::flip(expected, actual, PIXELS_PER_DEGREE).to_vec()
        };
        for threads in [1, 2, 4, 64] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let map = pool.install(|| flip(&actual, &expected)).expect("sizes agree");
            assert_eq!(map.errors, whole, "{threads} threads");
        }
    }

    #[test]
    fn heat_goes_from_black_to_pale() {
        let map = FlipMap { size: [2, 1], errors: vec![0.0, 1.0] };
        let [none, all] = map.heat().pixels[..] else { panic!("two pixels") };
        assert!(none.iter().all(|&code| code < 10), "{none:?}");
        assert!(all[0] > 240 && all[1] > 240 && all[2] > 150, "{all:?}");
    }

    #[test]
    fn sizes_must_agree_and_nothing_is_tame() {
        let flat = Srgb8Image { size: [768, 1], ..filled([0; 3]) };
        assert!(flip(&flat, &filled([0; 3])).is_err());
        let nothing = Srgb8Image { size: [0, 5], pixels: Vec::new() };
        let map = flip(&nothing, &nothing).expect("sizes agree");
        assert_eq!((map.mean(), map.heat().pixels.len()), (0.0, 0));
        let one = Srgb8Image { size: [1, 1], pixels: vec![[9; 3]] };
        assert_eq!(flip(&one, &one).expect("sizes agree").mean(), 0.0);
    }
}
