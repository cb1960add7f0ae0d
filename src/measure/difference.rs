//! How far two pictures of the same size are apart. Alpha is left out: the renderer's pictures are opaque.

/// The difference of two pictures over all their colour channels, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Largest absolute difference.
    pub max: f64,
    /// 99.9th percentile of the absolute difference.
    pub p99_9: f64,
    /// Mean over the channels of (a - b)^2 / (b^2 + 0.01), with `b` the expected picture: what is commonly called relMSE
    /// (Rousselle et al. 2011). 0.01 keeps black from counting without limit.
    pub rel_mse: f64,
    /// Pixels of which any channel differs at all.
    pub differing_pixels: usize,
    /// Channels that are NaN or infinite in one picture and not the same in the other; they are in no other figure.
    pub not_finite: usize,
}

impl Difference {
    /// Peak signal-to-noise ratio in decibels for a largest possible sample `peak` (255 for 8-bit codes); infinite for
    /// equal pictures.
    pub fn psnr_db(&self, peak: f64) -> f64 {
        20.0 * (peak / self.rmse).log10()
    }
}

/// Two pictures cannot be compared: their numbers of samples differ, or are no multiple of four.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cannot compare a picture of {actual} samples with one of {expected}")]
pub struct Mismatch {
    pub actual: usize,
    pub expected: usize,
}

/// Compares 8-bit RGBA pictures, in codes of 0 to 255.
///
/// # Errors
/// When the sizes differ.
pub fn difference_srgb8(actual: &[u8], expected: &[u8]) -> Result<Difference, Mismatch> {
    difference(actual, expected)
}

/// Compares linear RGBA pictures, in nits.
///
/// # Errors
/// When the sizes differ.
pub fn difference_linear(actual: &[f32], expected: &[f32]) -> Result<Difference, Mismatch> {
    difference(actual, expected)
}

fn difference<T: Copy + Into<f64>>(actual: &[T], expected: &[T]) -> Result<Difference, Mismatch> {
    if actual.len() != expected.len() || !actual.len().is_multiple_of(4) {
        return Err(Mismatch { actual: actual.len(), expected: expected.len() });
    }
    let mut absolute = Vec::with_capacity(actual.len() / 4 * 3);
    let (mut squares, mut relative, mut differing_pixels, mut not_finite) = (0.0, 0.0, 0, 0);
    for (a, b) in actual.chunks_exact(4).zip(expected.chunks_exact(4)) {
        let mut differs = false;
        for (a, b) in a[..3].iter().zip(&b[..3]) {
            let (a, b): (f64, f64) = ((*a).into(), (*b).into());
            if !a.is_finite() || !b.is_finite() {
                let same = a == b || (a.is_nan() && b.is_nan());
                not_finite += usize::from(!same);
                differs |= !same;
                continue;
            }
            let square = (a - b) * (a - b);
            squares += square;
            relative += square / (b * b + 0.01);
            differs |= a != b;
            absolute.push((a - b).abs());
        }
        differing_pixels += usize::from(differs);
    }
    let count = absolute.len().max(1) as f64;
    absolute.sort_by(f64::total_cmp);
    Ok(Difference {
        rmse: (squares / count).sqrt(),
        max: absolute.last().copied().unwrap_or(0.0),
        p99_9: super::percentile(&absolute, 99.9).unwrap_or(0.0),
        rel_mse: relative / count,
        differing_pixels,
        not_finite,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture = [1u8, 2, 3, 255, 4, 5, 6, 255];
        let difference = difference_srgb8(&picture, &picture).expect("sizes agree");
        assert_eq!((difference.rmse, difference.max, difference.differing_pixels), (0.0, 0.0, 0));
        assert_eq!(difference.psnr_db(255.0), f64::INFINITY);
    }

    #[test]
    fn a_known_difference_has_the_known_figures() {
        // One of six channels is off by 6: RMSE = sqrt(36 / 6), PSNR = 20 log10(255 / sqrt(6)). Alpha does not count.
        let difference =
            difference_srgb8(&[6, 0, 0, 255, 0, 0, 0, 9], &[0, 0, 0, 255, 0, 0, 0, 255]).expect("sizes agree");
        assert!((difference.rmse - 6f64.sqrt()).abs() < 1e-12);
        assert!((difference.psnr_db(255.0) - 40.349_1).abs() < 1e-3, "{}", difference.psnr_db(255.0));
        assert_eq!((difference.max, difference.differing_pixels), (6.0, 1));
        assert!((difference.rel_mse - 600.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_finite_is_counted_apart() {
        let difference = difference_linear(
            &[f32::NAN, f32::INFINITY, 1.0, 1.0, f32::NAN, 0.0, 0.0, 1.0],
            &[0.0, f32::INFINITY, 1.0, 1.0, f32::NAN, 0.0, 0.0, 1.0],
        )
        .expect("sizes agree");
        assert_eq!((difference.not_finite, difference.differing_pixels, difference.rmse), (1, 1, 0.0));
    }

    #[test]
    fn pictures_of_different_sizes_are_refused() {
        assert_eq!(difference_srgb8(&[0; 4], &[0; 8]), Err(Mismatch { actual: 4, expected: 8 }));
        assert!(difference_srgb8(&[0; 3], &[0; 3]).is_err());
        assert_eq!(difference_srgb8(&[], &[]).map(|difference| difference.max), Ok(0.0));
    }
}
