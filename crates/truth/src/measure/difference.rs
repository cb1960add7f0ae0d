//! Differences of two pictures of the same size. Alpha is left out: the renderer's pictures are opaque.

use super::images::{LinearImage, Mismatch, Srgb8Image, same_size};

/// A constant that keeps black from counting without limit in relMSE. It is meant for exposed light, where 1 is where the sensor saturates: 0.01 is
/// then the square of a tenth of that.
pub const RELATIVE_EPSILON: f64 = 0.01;

/// The difference of two pictures over all their colour channels, in the unit of the samples.
///
/// A pixel with a sample that is NaN or infinite in either picture is counted in `not_finite`, and is in no other figure but
/// `differing_pixels`: look at `not_finite` before judging by the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Largest absolute difference.
    pub max: f64,
    /// 99.9th percentile of the absolute difference.
    pub p99_9: f64,
    /// Mean over the channels of (a - b)^2 / (b^2 + [`RELATIVE_EPSILON`]), with `b` the expected picture: commonly called relMSE
    /// (Rousselle et al. 2011). It depends on the unit, so both pictures must be exposed.
    pub rel_mse: f64,
    /// Pixels of which any channel differs at all.
    pub differing_pixels: usize,
    /// Pixels of the actual picture with a channel that is NaN or infinite.
    pub not_finite: usize,
    /// Pixels of the expected picture with a channel that is NaN or infinite.
    pub expected_not_finite: usize,
}

impl Difference {
    /// Peak signal-to-noise ratio in decibels for a largest possible sample `peak`; infinite for equal pictures.
    pub fn psnr_db(&self, peak: f64) -> f64 {
        20.0 * (peak / self.rmse).log10()
    }
}

/// Compares a picture with the truth. Both are scene-linear and exposed: 1 is where the sensor saturates.
///
/// # Errors
/// When the sizes differ, or a picture does not have as many pixels as it says.
pub fn errors(actual: &LinearImage, truth: &LinearImage) -> Result<Difference, Mismatch> {
    same_size((actual.size, &actual.pixels), (truth.size, &truth.pixels))?;
    Ok(difference(actual.pixels.iter().copied().zip(truth.pixels.iter().copied())))
}

/// Compares pictures as they are shown, in sRGB codes as 0 to 1: the peak of [`Difference::psnr_db`] is then 1.
///
/// # Errors
/// As [`errors`].
pub fn shown_errors(actual: &Srgb8Image, expected: &Srgb8Image) -> Result<Difference, Mismatch> {
    same_size((actual.size, &actual.pixels), (expected.size, &expected.pixels))?;
    let unit = |pixel: &[u8; 3]| pixel.map(|code| f64::from(code) / 255.0);
    Ok(difference(actual.pixels.iter().map(unit).zip(expected.pixels.iter().map(unit))))
}

fn difference(pairs: impl ExactSizeIterator<Item = ([f64; 3], [f64; 3])>) -> Difference {
    let mut absolute = Vec::with_capacity(pairs.len() * 3);
    let (mut squares, mut relative, mut differing_pixels) = (0.0, 0.0, 0);
    let (mut not_finite, mut expected_not_finite) = (0, 0);
    let is_finite = |pixel: &[f64; 3]| pixel.iter().all(|sample| sample.is_finite());
    for (actual, expected) in pairs {
        let same = actual.iter().zip(&expected).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
        differing_pixels += usize::from(!same);
        let finite = [is_finite(&actual), is_finite(&expected)];
        not_finite += usize::from(!finite[0]);
        expected_not_finite += usize::from(!finite[1]);
        if finite != [true; 2] {
            continue;
        }
        for (a, b) in actual.iter().zip(&expected) {
            let square = (a - b) * (a - b);
            squares += square;
            relative += square / (b * b + RELATIVE_EPSILON);
            absolute.push((a - b).abs());
        }
    }
    let count = absolute.len().max(1) as f64;
    // Only the samples from the percentile's rank on are sorted: for millions of samples that takes a tenth of a full sort.
    let from = (absolute.len() * 999 / 1000).saturating_sub(1);
    if !absolute.is_empty() {
        absolute.select_nth_unstable_by(from, f64::total_cmp);
        absolute[from..].sort_unstable_by(f64::total_cmp);
    }
    Difference {
        rmse: (squares / count).sqrt(),
        max: absolute.last().copied().unwrap_or(0.0),
        p99_9: super::percentile(&absolute, 99.9).unwrap_or(0.0),
        rel_mse: relative / count,
        differing_pixels,
        not_finite,
        expected_not_finite,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(pixels: &[[f64; 3]]) -> LinearImage {
        LinearImage { size: [pixels.len() as u32, 1], pixels: pixels.to_vec() }
    }

    fn shown(pixels: &[[u8; 3]]) -> Srgb8Image {
        Srgb8Image { size: [pixels.len() as u32, 1], pixels: pixels.to_vec() }
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture = shown(&[[1, 2, 3], [4, 5, 6]]);
        let difference = shown_errors(&picture, &picture).expect("sizes agree");
        assert_eq!((difference.rmse, difference.max, difference.differing_pixels), (0.0, 0.0, 0));
        assert_eq!(difference.psnr_db(1.0), f64::INFINITY);
    }

    #[test]
    fn a_known_difference_of_codes_has_the_known_figures() {
        // One of six channels is off by 6 codes: RMSE = sqrt(36 / 6) codes, PSNR = 20 log10(255 / sqrt(6)).
        let difference = shown_errors(&shown(&[[6, 0, 0], [0; 3]]), &shown(&[[0; 3]; 2])).expect("sizes agree");
        assert!((difference.rmse * 255.0 - 6f64.sqrt()).abs() < 1e-12);
        assert!((difference.psnr_db(1.0) - 40.349_1).abs() < 1e-3, "{}", difference.psnr_db(1.0));
        assert!((difference.max - 6.0 / 255.0).abs() < 1e-15);
        assert_eq!(difference.differing_pixels, 1);
    }

    #[test]
    fn a_known_difference_of_light_has_the_known_figures() {
        // Differences 0.1 of 0.3, 0.2 of 0 and -0.2 of 1, and three channels that agree.
        let actual = linear(&[[0.4, 0.2, 0.8], [0.5; 3]]);
        let difference = errors(&actual, &linear(&[[0.3, 0.0, 1.0], [0.5; 3]])).expect("sizes agree");
        assert!((difference.rmse - (0.09f64 / 6.0).sqrt()).abs() < 1e-12, "{difference:?}");
        let relative = (0.01 / 0.1 + 0.04 / 0.01 + 0.04 / 1.01) / 6.0;
        assert!((difference.rel_mse - relative).abs() < 1e-12, "{difference:?}");
        assert!((difference.max - 0.2).abs() < 1e-12);
    }

    #[test]
    fn the_percentile_leaves_out_one_channel_in_a_thousand() {
        let expected = linear(&vec![[0.0; 3]; 1000]);
        let with = |count: usize| {
            let mut actual = expected.clone();
            actual.pixels.iter_mut().take(count).for_each(|pixel| pixel[1] = 1.0);
            errors(&actual, &expected).expect("sizes agree")
        };
        assert_eq!((with(2).p99_9, with(2).max), (0.0, 1.0));
        assert_eq!(with(4).p99_9, 1.0);
        // The percentile equals the percentile of all samples, sorted, for any number of them.
        let mut random = fastrand::Rng::with_seed(3);
        for count in (1..40).chain([999, 1000, 1001, 3333]) {
            let actual = LinearImage {
                size: [count, 1],
                pixels: (0..count).map(|_| [0; 3].map(|_: u8| random.f64())).collect(),
            };
            let black = LinearImage { size: actual.size, pixels: vec![[0.0; 3]; count as usize] };
            let mut all = actual.pixels.as_flattened().to_vec();
            all.sort_unstable_by(f64::total_cmp);
            let found = errors(&actual, &black).expect("sizes agree");
            assert_eq!((Some(found.p99_9), Some(&found.max)), (crate::measure::percentile(&all, 99.9), all.last()));
        }
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_apart() {
        let actual = linear(&[[f64::NAN, f64::INFINITY, 1.0], [f64::NAN, 0.0, 0.0], [0.5; 3], [0.0; 3]]);
        let expected = linear(&[[0.0; 3], [f64::NAN, 0.0, 0.0], [0.5; 3], [f64::INFINITY, 0.0, 0.0]]);
        let difference = errors(&actual, &expected).expect("sizes agree");
        assert_eq!((difference.not_finite, difference.expected_not_finite), (2, 2));
        assert_eq!((difference.differing_pixels, difference.rmse, difference.max), (2, 0.0, 0.0));
    }

    #[test]
    fn pictures_of_different_sizes_are_refused() {
        let flat = linear(&[[0.0; 3]; 4]);
        let square = LinearImage { size: [2, 2], ..flat.clone() };
        assert_eq!(errors(&flat, &square), Err(Mismatch { actual: [4, 1], expected: [2, 2] }));
        let short = LinearImage { size: [4, 1], pixels: vec![[0.0; 3]; 3] };
        assert!(errors(&short, &short).is_err());
        assert_eq!(errors(&linear(&[]), &linear(&[])).map(|difference| difference.max), Ok(0.0));
        let said = errors(&flat, &square).expect_err("they differ").to_string();
        assert_eq!(said, "cannot compare a picture of 4x1 pixels with one of 2x2");
    }
}
