//! Pareto fronts: the points that no other beats in both time and error.

use super::bootstrap::{Resampler, SEED};

/// Draws of new times; a probability is then good to 0.016.
const RESAMPLES: usize = 1000;

/// Indices of the (time, error) points on the front, the fastest first, both being better when smaller.
///
/// A point is off the front when another is no worse in either and better in one, or is equal and comes first; so that no two on it are
/// equal. A point with a NaN or an infinity is never on it.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let is_finite = |&index: &usize| points[index].0.is_finite() && points[index].1.is_finite();
    let mut order: Vec<usize> = (0..points.len()).filter(is_finite).collect();
    // Stable: of equal points the first stays first. Adding zero makes 0 of -0, which is equal to it.
    let key = |index: usize| (points[index].0 + 0.0, points[index].1 + 0.0);
    order.sort_by(|&a, &b| {
        let ((time_a, error_a), (time_b, error_b)) = (key(a), key(b));
        time_a.total_cmp(&time_b).then(error_a.total_cmp(&error_b))
    });
    let mut least_error = f64::INFINITY;
    order.retain(|&index| {
        let better = points[index].1 < least_error;
        least_error = least_error.min(points[index].1);
        better
    });
    order
}

/// Returns the probability, 0 to 1, that each point is on the front, given the scatter of its times: the share of bootstrap resamples that have it on
/// their front, where a point's time is the median of its resampled times. A point without a finite time or error has 0.
///
/// `times` has the measurements of each point, in any unit, and `errors` its error. If one list is shorter, its last entries count as missing.
pub fn front_probability<T: AsRef<[f64]>>(times: &[T], errors: &[f64]) -> Vec<f64> {
    let mut resamplers: Vec<Option<Resampler>> = times.iter().map(|times| Resampler::of(times.as_ref())).collect();
    let mut random = fastrand::Rng::with_seed(SEED);
    let mut counts = vec![0usize; times.len()];
    let mut points = vec![(f64::NAN, f64::NAN); times.len()];
    for _ in 0..RESAMPLES {
        for (index, resampler) in resamplers.iter_mut().enumerate() {
            let time = resampler.as_mut().map_or(f64::NAN, |resampler| resampler.median(&mut random));
            points[index] = (time, errors.get(index).copied().unwrap_or(f64::NAN));
        }
        for index in front(&points) {
            counts[index] += 1;
        }
    }
    counts.into_iter().map(|count| count as f64 / RESAMPLES as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn dominates(a: (f64, f64), b: (f64, f64)) -> bool {
        a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1)
    }

    /// Few different values, so that ties are common, and now and then a NaN or an infinity.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![
            8 => (0..6i32).prop_map(f64::from),
            4 => -10.0..10.0f64,
            1 => Just(-0.0),
            1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)],
        ]
    }

    proptest! {
        #[test]
        fn the_front_is_a_front(points in prop::collection::vec((coordinate(), coordinate()), 0..40)) {
            let found = front(&points);
            let finite = |index: &usize| points[*index].0.is_finite() && points[*index].1.is_finite();
            prop_assert!(found.iter().all(finite));
            for pair in found.windows(2) {
                let (faster, slower) = (points[pair[0]], points[pair[1]]);
                prop_assert!(faster.0 < slower.0 && faster.1 > slower.1);
            }
            for index in (0..points.len()).filter(finite) {
                let beaten = found.iter().any(|&on| dominates(points[on], points[index]));
                let equal = found.iter().any(|&on| points[on] == points[index]);
                // No point on the front is dominated; one off the front is dominated by a point on it, or equal to one.
                if found.contains(&index) { prop_assert!(!beaten) } else { prop_assert!(beaten || equal) }
            }
        }
    }

    #[test]
    fn ties_leave_one_and_what_is_not_finite_is_off() {
        assert_eq!(front(&[(1.0, 1.0), (1.0, 1.0), (1.0, 2.0), (2.0, 1.0)]), [0]);
        assert_eq!(front(&[(2.0, 0.0), (1.0, f64::NAN), (f64::NEG_INFINITY, 0.0), (1.0, 3.0)]), [3, 0]);
        assert_eq!(front(&[]), [0usize; 0]);
    }

    #[test]
    fn points_that_are_told_apart_are_certain_and_equal_ones_share() {
        let times: Vec<Vec<f64>> = [1.0, 2.0, 2.0, 3.0]
            .iter()
            .enumerate()
            .map(|(point, time)| (0..20).map(|run| time + 0.01 * ((run * 7 + point * 3) % 20) as f64).collect())
            .collect();
        // The second and the third have the same error and the same times in another order; the last is beaten by all.
        let probability = front_probability(&times, &[0.3, 0.1, 0.1, 0.4]);
        assert_eq!((probability[0], probability[3]), (1.0, 0.0));
        assert!((probability[1] + probability[2] - 1.0).abs() < 1e-9, "{probability:?}");
        assert!((0.35..0.65).contains(&probability[1]), "{probability:?}");
        assert_eq!(probability, front_probability(&times, &[0.3, 0.1, 0.1, 0.4]));
    }

    #[test]
    fn points_without_times_or_errors_are_never_on_the_front() {
        let times = [vec![1.0], vec![], vec![f64::NAN], vec![0.5]];
        assert_eq!(front_probability(&times, &[1.0, 0.0, 0.0]), [1.0, 0.0, 0.0, 0.0]);
    }
}
