//! Medians and their uncertainty, by bootstrap (Efron 1979): the samples themselves stand for the distribution that they were drawn from.
//!
//! The interval is the plain percentile interval, and equal samples always give the same one. With fewer than six samples no interval covers 95%, not
//! even the one from the least to the largest ([`LEAST_FOR_95`]); with one sample it has no width.

use serde::{Deserialize, Serialize};

use super::percentile;

/// The number of times that samples are drawn anew: the ends of a 95% interval are then the 50th draw from below and from above.
const RESAMPLES: usize = 2000;
/// The least number of samples whose interval can cover the median with 95%: five samples all lie on one side of it with a probability of 1/16.
pub const LEAST_FOR_95: usize = 6;

/// A median with its 95% interval, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MedianInterval {
    /// The median of the samples.
    pub median: f64,
    /// The interval's lower end.
    pub low: f64,
    /// The interval's upper end.
    pub high: f64,
    /// Samples that went in.
    pub count: usize,
}

impl MedianInterval {
    /// Half of its width over the median.
    pub fn relative_half_width(&self) -> f64 {
        (self.high - self.low) / (2.0 * self.median)
    }

    /// Returns true if the interval is wide enough to warn about. An interval of fewer than [`LEAST_FOR_95`] samples always is.
    pub fn is_wide(&self) -> bool {
        self.relative_half_width() > 0.05 || self.count < LEAST_FOR_95
    }
}

/// The median of the finite ones among `samples`; `None` when there is none.
pub fn median_interval(samples: &[f64]) -> Option<MedianInterval> {
    let mut resampler = Resampler::of(samples)?;
    let mut random = fastrand::Rng::with_seed(SEED);
    let mut medians: Vec<f64> = (0..RESAMPLES).map(|_| resampler.median(&mut random)).collect();
    medians.sort_unstable_by(f64::total_cmp);
    Some(MedianInterval {
        median: percentile(&resampler.sorted, 50.0)?,
        low: percentile(&medians, 2.5)?,
        high: percentile(&medians, 97.5)?,
        count: resampler.sorted.len(),
    })
}

/// The median of samples that were taken in groups, and as many draws of it: influences on a whole group, such as a busy machine, count as
/// uncertainty, too.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupedMedian {
    median: f64,
    count: usize,
    draws: Vec<f64>,
}

impl GroupedMedian {
    /// The median of all finite samples together. Groups are drawn anew, and samples within them (Davison and Hinkley 1997, section 3.8). `None`
    /// without a finite sample.
    pub fn of(groups: &[Vec<f64>]) -> Option<Self> {
        let finite = |group: &Vec<f64>| group.iter().copied().filter(|sample| sample.is_finite()).collect::<Vec<_>>();
        let groups: Vec<Vec<f64>> = groups.iter().map(finite).filter(|group| !group.is_empty()).collect();
        let mut all = groups.concat();
        all.sort_unstable_by(f64::total_cmp);
        let median = percentile(&all, 50.0)?;
        // The seed differs from the seed of the draws with which these are multiplied.
        let mut random = fastrand::Rng::with_seed(!SEED);
        let mut drawn = Vec::with_capacity(all.len());
        let draws = (0..RESAMPLES).map(|_| {
            drawn.clear();
            for _ in 0..groups.len() {
                let group = &groups[random.usize(..groups.len())];
                drawn.extend(group.iter().map(|_| group[random.usize(..group.len())]));
            }
            middle(&mut drawn)
        });
        Some(Self { median, count: all.len(), draws: draws.collect() })
    }

    /// The median with its interval, if there are samples enough.
    pub fn interval(&self) -> Option<MedianInterval> {
        interval(self.median, self.draws.clone(), self.count)
    }

    /// The product with the median of `factors`, which are independent of these samples: as uncertain as both. `None` without a finite factor.
    pub fn times(&self, factors: &[f64]) -> Option<MedianInterval> {
        let mut resampler = Resampler::of(factors)?;
        let mut random = fastrand::Rng::with_seed(SEED);
        let products = self.draws.iter().map(|draw| draw * resampler.median(&mut random)).collect();
        interval(self.median * percentile(&resampler.sorted, 50.0)?, products, resampler.sorted.len())
    }
}

fn interval(median: f64, mut draws: Vec<f64>, count: usize) -> Option<MedianInterval> {
    draws.sort_unstable_by(f64::total_cmp);
    Some(MedianInterval { median, low: percentile(&draws, 2.5)?, high: percentile(&draws, 97.5)?, count })
}

/// The median of samples, of which there is at least one.
fn middle(samples: &mut [f64]) -> f64 {
    let count = samples.len();
    let (below, &mut upper, _) = samples.select_nth_unstable_by(count / 2, f64::total_cmp);
    match below.iter().copied().max_by(f64::total_cmp) {
        Some(lower) if count.is_multiple_of(2) => 0.5 * (lower + upper),
        _ => upper,
    }
}

/// The seed is arbitrary. It is fixed so that the same measurements always give the same report.
pub(super) const SEED: u64 = 0x5EED;

/// A normal deviate (Box and Muller 1958).
pub(super) fn normal(random: &mut fastrand::Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.f64()).cos()
}

/// Draws samples with replacement, as many as there are.
pub(super) struct Resampler {
    /// The finite samples in ascending order.
    pub sorted: Vec<f64>,
    drawn: Vec<usize>,
}

impl Resampler {
    /// `None` without a finite sample.
    pub fn of(samples: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = samples.iter().copied().filter(|sample| sample.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let drawn = vec![0; sorted.len()];
        (!sorted.is_empty()).then_some(Self { sorted, drawn })
    }

    /// The median of a new draw.
    pub fn median(&mut self, random: &mut fastrand::Rng) -> f64 {
        let count = self.sorted.len();
        self.drawn.fill_with(|| random.usize(..count));
        let middle = count / 2;
        // Ranks of sorted samples order as the samples do.
        let (below, &mut above, _) = self.drawn.select_nth_unstable(middle);
        let upper = self.sorted[above];
        match below.iter().max() {
            Some(&lower) if count.is_multiple_of(2) => 0.5 * (self.sorted[lower] + upper),
            _ => upper,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_covers_the_true_median_nineteen_times_of_twenty() {
        let mut random = fastrand::Rng::with_seed(1);
        let trials = 500;
        for count in [15, 30] {
            let covered = (0..trials).filter(|_| {
                // As frame times: log-normal about 3 ms.
                let samples: Vec<f64> = (0..count).map(|_| 3.0 * (0.4 * normal(&mut random)).exp()).collect();
                let interval = median_interval(&samples).expect("finite samples");
                (interval.low..=interval.high).contains(&3.0)
            });
            let share = covered.count() as f64 / f64::from(trials);
            // Four standard errors of 500 trials are 0.039.
            assert!((0.91..=0.985).contains(&share), "{count} samples: {share}");
        }
    }

    #[test]
    fn more_samples_make_a_narrower_interval() {
        let mut random = fastrand::Rng::with_seed(2);
        let samples: Vec<f64> = (0..1600).map(|_| normal(&mut random)).collect();
        let width = |count: usize| {
            let interval = median_interval(&samples[..count]).expect("finite samples");
            assert!(interval.low <= interval.median && interval.median <= interval.high);
            interval.high - interval.low
        };
        // A sixteenth of the variance is a quarter of the width, give or take.
        assert!((2.0..8.0).contains(&(width(100) / width(1600))), "{} {}", width(100), width(1600));
    }

    #[test]
    fn the_same_samples_have_the_same_interval_in_any_order() {
        let interval = median_interval(&[3.0, 1.0, f64::NAN, 2.0, 9.0]).expect("finite samples");
        assert_eq!(Some(interval), median_interval(&[1.0, 2.0, 3.0, 9.0, f64::INFINITY]));
        assert_eq!((interval.median, interval.count), (2.5, 4));
        assert_eq!((interval.low, interval.high), (1.0, 9.0));
        let one = MedianInterval { median: 7.0, low: 7.0, high: 7.0, count: 1 };
        assert_eq!(median_interval(&[7.0]), Some(one));
        assert_eq!(median_interval(&[f64::NAN]), None);
    }

    #[test]
    fn a_product_is_as_uncertain_as_both_and_groups_more_than_their_samples() {
        let mut random = fastrand::Rng::with_seed(4);
        let mut scattered = |mean: f64, spread: f64, count: usize| -> Vec<f64> {
            (0..count).map(|_| mean * (1.0 + spread * normal(&mut random))).collect()
        };
        let relative = |interval: &MedianInterval| (interval.high - interval.low) / interval.median;
        let wide = GroupedMedian::of(&[scattered(10.0, 0.1, 40)]).expect("finite");
        let own = wide.interval().expect("an interval");
        let product = wide.times(&scattered(2.0, 0.001, 20)).expect("finite");
        assert!((product.median / 2.0 - own.median).abs() < 0.01 * own.median, "{product:?} {own:?}");
        let ratio = relative(&product) / relative(&own);
        assert!((0.9..1.2).contains(&ratio) && product.count == 20, "{ratio}");
        let exact = GroupedMedian::of(&[vec![10.0; 8]]).expect("finite");
        let narrow = scattered(2.0, 0.05, 20);
        let (alone, scaled) = (median_interval(&narrow).expect("finite"), exact.times(&narrow).expect("finite"));
        assert_eq!((alone.low * 10.0, alone.high * 10.0), (scaled.low, scaled.high));
        // Each group is sure of itself, and they do not agree.
        let apart =
            GroupedMedian::of(&[scattered(9.0, 0.001, 20), scattered(10.0, 0.001, 20), scattered(11.0, 0.001, 20)]);
        let apart = apart.and_then(|apart| apart.interval()).expect("finite");
        assert!(apart.low < 9.6 && apart.high > 10.4, "{apart:?}");
        assert_eq!(GroupedMedian::of(&[vec![], vec![f64::NAN]]), None);
    }
}
