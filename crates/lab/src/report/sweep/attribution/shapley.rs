//! Shares of several parts in their common effect.
//!
//! Parts are put right one after another, and the share of each is the change of the value in its turn. The change depends on the order, so it is
//! averaged over all orders (Shapley, "A Value for n-Person Games", 1953). Interactions of parts are shared evenly, and the shares add up to the
//! whole.

use glam::DVec3;

/// Returns the share of each of `PARTS` parts. `values` has one value for each set of parts that are at work: bit i of its index is set if part i is.
///
/// # Panics
/// When there are not 2^`PARTS` values.
pub fn shapley<const PARTS: usize>(values: &[DVec3]) -> [DVec3; PARTS] {
    assert_eq!(values.len(), 1 << PARTS, "a value for each set of parts");
    std::array::from_fn(|part| {
        let without = (0..values.len()).filter(|set| set >> part & 1 == 0);
        without
            .map(|set| (values[set | 1 << part] - values[set]) * share_of_orders(PARTS, set.count_ones() as usize))
            .sum()
    })
}

/// The share of all orders in which a given part comes after exactly a given set of `before` others: before! (parts - 1 - before)! / parts!.
fn share_of_orders(parts: usize, before: usize) -> f64 {
    // 1 / parts for the place, divided by the number of sets of that size.
    let sets = (0..before).fold(1.0, |sets, chosen| sets * (parts - 1 - chosen) as f64 / (chosen + 1) as f64);
    1.0 / (parts as f64 * sets)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn game<const PARTS: usize>(value: impl Fn([bool; PARTS]) -> f64) -> [f64; PARTS] {
        let values: Vec<DVec3> = (0..1usize << PARTS)
            .map(|set| DVec3::new(value(std::array::from_fn(|part| set >> part & 1 == 1)), 0.0, 1.0))
            .collect();
        let shares = shapley::<PARTS>(&values);
        assert!(shares.iter().all(|share| share.y == 0.0 && share.z == 0.0));
        shares.map(|share| share.x)
    }

    fn close<const PARTS: usize>(found: [f64; PARTS], expected: [f64; PARTS]) {
        let off = found.into_iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{found:?}, not {expected:?}");
    }

    #[test]
    fn where_parts_only_add_up_each_gets_its_own() {
        let own = [3.0, -1.0, 0.5, 0.0];
        close(
            game(|on: [bool; 4]| 7.0 + on.iter().zip(own).map(|(&on, own)| if on { own } else { 0.0 }).sum::<f64>()),
            own,
        );
    }

    #[test]
    fn parts_that_do_the_same_get_the_same_and_one_that_does_nothing_gets_nothing() {
        // Any two of the first three are enough; the last is idle.
        let two = |on: [bool; 4]| f64::from(u8::from(on[..3].iter().filter(|on| **on).count() >= 2));
        close(game(two), [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0]);
    }

    #[test]
    fn what_two_parts_do_to_one_another_is_shared_evenly() {
        close(
            game(|[a, b]: [bool; 2]| {
                if a && b {
                    5.0
                } else if a {
                    1.0
                } else {
                    0.0
                }
            }),
            [3.0, 2.0],
        );
        // One that works against the other: both together do nothing, and neither seems to when it is looked at last.
        close(game(|[a, b]: [bool; 2]| f64::from(u8::from(a)) - f64::from(u8::from(b))), [1.0, -1.0]);
    }

    /// The mean of the steps over all orders of three parts, taken one by one.
    fn by_orders(values: &[f64; 8]) -> [f64; 3] {
        let mut shares = [0.0; 3];
        for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut set = 0;
            for part in order {
                shares[part] += (values[set | 1 << part] - values[set]) / 6.0;
                set |= 1 << part;
            }
        }
        shares
    }

    proptest! {
        #[test]
        fn shares_are_the_mean_over_all_orders(values in prop::array::uniform8(-10.0..10.0f64)) {
            let found = shapley::<3>(&values.map(DVec3::splat));
            for (found, expected) in found.into_iter().zip(by_orders(&values)) {
                prop_assert!((found - DVec3::splat(expected)).abs().max_element() < 1e-12);
            }
        }

        #[test]
        fn shares_add_up_to_the_whole(values in prop::collection::vec(-10.0..10.0f64, 32)) {
            let values: Vec<DVec3> = values.into_iter().map(DVec3::splat).collect();
            let sum: DVec3 = shapley::<5>(&values).into_iter().sum();
            prop_assert!((sum - (values[31] - values[0])).abs().max_element() < 1e-12);
        }
    }
}
