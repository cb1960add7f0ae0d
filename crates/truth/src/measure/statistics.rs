//! Order statistics of repeated measurements. Medians and percentiles, because the tail of a frame time is one-sided:
//! a mean would follow every hiccup of the machine.

use serde::Serialize;

/// The distribution of repeated measurements of one quantity, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distribution {
    /// Samples that went in.
    pub count: usize,
    /// The least value.
    pub min: f64,
    /// 5th percentile.
    pub p5: f64,
    /// The middle value.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
    /// The greatest value.
    pub max: f64,
}

impl Distribution {
    /// The distribution of the finite ones among `samples`; `None` when there is none.
    pub fn of(samples: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = samples.into_iter().filter(|sample| sample.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            count: sorted.len(),
            min: *sorted.first()?,
            p5: percentile(&sorted, 5.0)?,
            median: percentile(&sorted, 50.0)?,
            p95: percentile(&sorted, 95.0)?,
            max: *sorted.last()?,
        })
    }
}

/// The `percent`-th percentile (0 to 100, clamped) of samples in ascending order, interpolated linearly between the two
/// nearest ranks (Hyndman and Fan 1996, definition 7, as in spreadsheets and NumPy). `None` without samples.
pub fn percentile(sorted: &[f64], percent: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let rank = (percent / 100.0).clamp(0.0, 1.0) * last as f64;
    // The rank is at most `last`, so both neighbours exist; a NaN percentage becomes rank 0.
    let below = rank.floor() as usize;
    let above = (below + 1).min(last);
    let share = rank.fract();
    Some(if share > 0.0 { sorted[below] * (1.0 - share) + sorted[above] * share } else { sorted[below] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_interpolate_between_ranks() {
        let sorted = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(percentile(&sorted, 0.0), Some(1.0));
        assert_eq!(percentile(&sorted, 50.0), Some(2.5));
        assert_eq!(percentile(&sorted, 100.0), Some(4.0));
        assert_eq!(percentile(&sorted, 25.0), Some(1.75));
    }

    #[test]
    fn percentiles_outside_the_range_and_of_nothing_are_tame() {
        assert_eq!(percentile(&[1.0, 2.0], -5.0), Some(1.0));
        assert_eq!(percentile(&[1.0, 2.0], 500.0), Some(2.0));
        assert_eq!(percentile(&[1.0, 2.0], f64::NAN), Some(1.0));
        assert_eq!(percentile(&[], 50.0), None);
    }

    #[test]
    fn distribution_sorts_and_ignores_what_is_not_finite() {
        let distribution = Distribution::of([3.0, f64::NAN, 1.0, 2.0, f64::INFINITY]).expect("three finite samples");
        assert_eq!((distribution.count, distribution.min, distribution.median, distribution.max), (3, 1.0, 2.0, 3.0));
        assert_eq!(Distribution::of([]), None);
        assert_eq!(Distribution::of([f64::NAN]), None);
    }
}
