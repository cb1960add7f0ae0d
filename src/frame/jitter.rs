//! The samples of a picture's frames: one sequence of places in the pixel, points on the lens and moments of the shutter, for all code that makes one
//! picture of many frames.

use std::f64::consts::TAU;

/// Parts of a square or of a circle by which the points of a sequence follow each other: irrational numbers of which no whole multiples add up to a
/// whole number, so that places in the pixel, points on the lens and moments fill the space of all of them evenly, and none follows another (Kronecker
/// sequences; Niederreiter, "Random Number Generation and Quasi-Monte Carlo Methods", 1992, chapter 3).
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// The fractional parts of the square roots of 3, 2 and 17: of 900 choices among roots of small numbers, e and pi, they distribute the points over
/// the disc best and pair them best with the other sequences, for 8 to 4096 frames.
const RING: f64 = 0.732_050_807_568_877_3;
const ANGLE: f64 = 0.414_213_562_373_095_05;
const TIME: f64 = 0.123_105_625_617_660_5;

/// The place in each pixel that frame `index` of `count` looks through, in pixels to the right and down from its centre, each within half a pixel.
///
/// A Hammersley set with the golden ratio's additive recurrence in place of the radical inverse (Niederreiter, "Random Number
/// Generation and Quasi-Monte Carlo Methods", 1992, chapter 3): as even as `count` points can be over the square, and each column of
/// width 1 / `count` has one. Centred, so that one frame looks through the middle, and that no picture is shifted.
pub fn sample_offset(index: u32, count: u32) -> [f64; 2] {
    let from_middle = f64::from(index) - (f64::from(count) - 1.0) / 2.0;
    let around = from_middle * GOLDEN;
    [from_middle / f64::from(count), around - around.round()]
}

/// The places of `count` frames, ordered so that every run of consecutive frames fills the pixel evenly; [`sample_offset`]'s own order goes from left
/// to right. The order has the same places as the whole set, so the mean over all of them equals the mean of as many samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JitterSequence {
    count: u32,
    /// Increment from one place to the next, coprime with the count.
    step: u32,
}

impl JitterSequence {
    /// Places that follow each other soon lie far apart: of all steps, this one has the least sum, over pairs, of one divided by the frames between them and
    /// the square of their distance, in a pixel that repeats itself.
    pub fn of(count: u32) -> Self {
        let count = count.max(1);
        let steps = (1..count.max(2)).filter(|&step| divisor(step, count) == 1).map(|step| Self { count, step });
        steps.min_by(|a, b| a.crowding().total_cmp(&b.crowding())).unwrap_or(Self { count, step: 1 })
    }

    /// The number of places.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The place that a frame looks through; after the last place the first one follows again.
    pub fn offset(&self, index: u32) -> [f64; 2] {
        let place = u64::from(index % self.count) * u64::from(self.step) % u64::from(self.count);
        sample_offset(place as u32, self.count)
    }

    fn crowding(&self) -> f64 {
        let places: Vec<_> = (0..self.count.min(LOOKED_AT)).map(|index| self.offset(index)).collect();
        let apart = |a: f64, b: f64| ((a - b) - (a - b).round()).powi(2);
        let mut sum = 0.0;
        for (index, a) in places.iter().enumerate() {
            // Longer gaps only repeat pairs, as the sequence is cyclic.
            for (between, b) in (1..=(self.count / 2).max(1)).zip(&places[index + 1..]) {
                sum += (f64::from(between) * (apart(a[0], b[0]) + apart(a[1], b[1]) + 1e-4)).recip();
            }
        }
        sum
    }
}

/// Places that are held against each other.
const LOOKED_AT: u32 = 48;

/// The greatest common one.
fn divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// Through which point of the lens frame `index` of `count` looks: right and up from its middle, in radii.
///
/// Each ring of a share of 1 / `count` of the disc has one point. Rings and angles follow other numbers than places in the pixel do.
pub fn lens_point(index: u32, count: u32) -> [f64; 2] {
    let radius = ((f64::from(rank(index, count, RING)) + 0.5) / f64::from(count)).sqrt();
    let (sine, cosine) = ((f64::from(index) + 0.5) * ANGLE * TAU).sin_cos();
    [cosine * radius, sine * radius]
}

/// The moment of frame `index` of `count`, as a share of the shutter's open time: the middle of the frame's own interval.
pub fn moment(index: u32, count: u32) -> f64 {
    (f64::from(rank(index, count, TIME)) + 0.5) / f64::from(count)
}

/// The place of an element among `count` of a Kronecker sequence in the order of their values: a permutation.
fn rank(index: u32, count: u32, step: f64) -> u32 {
    let value = |index: u32| (f64::from(index) + 0.5) * step % 1.0;
    let own = value(index);
    (0..count).filter(|&other| value(other) < own).count() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_frame_looks_through_the_middle_of_each_pixel() {
        assert_eq!(sample_offset(0, 1), [0.0, 0.0]);
    }

    #[test]
    fn offsets_lie_within_a_pixel_and_their_mean_in_its_middle() {
        for count in 1..300 {
            let offsets: Vec<_> = (0..count).map(|index| sample_offset(index, count)).collect();
            for axis in 0..2 {
                assert!(offsets.iter().all(|offset| offset[axis].abs() <= 0.5), "{count}");
                let mean = offsets.iter().map(|offset| offset[axis]).sum::<f64>() / f64::from(count);
                assert!(mean.abs() < 1e-12, "{count}: {mean}");
            }
        }
    }

    /// The part of a centred unit square where x cos + y sin < d.
    fn covered(cos: f64, sin: f64, d: f64) -> f64 {
        let (small, large) = (cos.abs().min(sin.abs()), cos.abs().max(sin.abs()));
        let (all, straight) = ((large + small) / 2.0, (large - small) / 2.0);
        let beyond = match d.abs() {
            d if d >= all => 0.5,
            d if d <= straight => d / large,
            d => 0.5 - (all - d).powi(2) / (2.0 * large * small),
        };
        0.5 + beyond.copysign(d)
    }

    /// The share of samples on one side of a straight edge, against the truth. For the mean over all edges no point set beats N^-3/4 (Beck 1987); the
    /// worst edges run along the points' own rows.
    #[test]
    fn the_error_of_an_edge_falls_as_it_can_at_best() {
        for count in [1u32, 2, 4, 8, 16, 32, 64, 256, 1024] {
            let (mut worst, mut squares, mut edges): (f64, f64, f64) = (0.0, 0.0, 0.0);
            for (angle, place) in (0..90).flat_map(|a| (0..71).map(move |b| (a, b))) {
                let (sin, cos) = (f64::from(angle) * 2.0).to_radians().sin_cos();
                let d = f64::from(place) * 0.02 - 0.7;
                let inside = (0..count).filter(|&index| {
                    let [x, y] = sample_offset(index, count);
                    x * cos + y * sin < d
                });
                let error = inside.count() as f64 / f64::from(count) - covered(cos, sin, d);
                (worst, squares, edges) = (worst.max(error.abs()), squares + error * error, edges + 1.0);
            }
            let (mean, count) = ((squares / edges).sqrt(), f64::from(count));
            assert!(worst <= 0.75 / count.sqrt(), "{count}: {worst}");
            assert!(mean <= 0.35 * count.powf(-0.75), "{count}: {mean}");
        }
    }

    /// The mean error over edges, for `count` consecutive places from `first` on.
    fn edge_error(order: &JitterSequence, first: u32, count: u32) -> f64 {
        let (mut squares, mut edges) = (0.0, 0.0);
        for (angle, place) in (0..45).flat_map(|a| (0..35).map(move |b| (a, b))) {
            let (sin, cos) = (f64::from(angle) * 4.0).to_radians().sin_cos();
            let d = f64::from(place) * 0.04 - 0.7;
            let inside = (first..first + count).filter(|&index| {
                let [x, y] = order.offset(index);
                x * cos + y * sin < d
            });
            squares += (inside.count() as f64 / f64::from(count) - covered(cos, sin, d)).powi(2);
            edges += 1.0;
        }
        f64::sqrt(squares / edges)
    }

    /// The places in their order have each place once, and any part of a row has at most twice the error of as many places as they are at best.
    #[test]
    fn parts_of_a_row_fill_the_pixel_too() {
        for count in [1u32, 2, 3, 4, 7, 8, 16, 24, 32, 64, 128, 1024] {
            let order = JitterSequence::of(count);
            let mut places: Vec<_> = (0..count).map(|index| order.offset(index)).collect();
            places.sort_by(|a, b| a[0].total_cmp(&b[0]));
            assert_eq!(places, (0..count).map(|index| sample_offset(index, count)).collect::<Vec<_>>(), "{count}");
            for part in [4, 8, 16, 32].into_iter().filter(|&part| part < count) {
                for first in [0, 5, count - 2] {
                    let error = edge_error(&order, first, part);
                    assert!(error <= 0.65 * f64::from(part).powf(-0.75), "{part} of {count} from {first}: {error}");
                }
            }
        }
    }

    /// Each of `count` frames: place in the pixel from 0 to 1, point on the lens, moment.
    fn frames(count: u32) -> Vec<([f64; 2], [f64; 2], f64)> {
        let frame = |index| {
            let place = sample_offset(index, count).map(|offset| offset + 0.5);
            (place, lens_point(index, count), moment(index, count))
        };
        (0..count).map(frame).collect()
    }

    #[test]
    fn every_part_of_the_time_and_every_ring_of_the_lens_has_one_frame() {
        for count in (1..70).chain([256, 1000, 4096]) {
            let part = |share: f64| (share * f64::from(count)) as usize;
            let (mut parts, mut rings) = (vec![0; count as usize], vec![0; count as usize]);
            for (_, [x, y], moment) in frames(count) {
                assert!(x.hypot(y) < 1.0 && (0.0..1.0).contains(&moment));
                parts[part(moment)] += 1;
                rings[part(x * x + y * y)] += 1;
            }
            assert!(parts.iter().chain(&rings).all(|&own| own == 1), "{count}: {parts:?} {rings:?}");
        }
    }

    #[test]
    fn the_disc_is_covered_evenly_from_every_side() {
        for count in [4u32, 8, 16, 64, 256, 1024] {
            let frames = frames(count);
            for angle in (0..360).step_by(7) {
                let (sin, cos) = f64::from(angle).to_radians().sin_cos();
                for cut in [-0.5f64, 0.0, 0.3, 0.7] {
                    let inside = frames.iter().filter(|(_, [x, y], _)| x * cos + y * sin < cut).count() as f64;
                    // The part of the unit disc left of a line.
                    let covered = 0.5 + (cut.asin() + cut * (1.0 - cut * cut).sqrt()) / std::f64::consts::PI;
                    let error = (inside / f64::from(count) - covered).abs();
                    // A row of points along the line, as for edges of pixels above.
                    assert!(error <= 0.75 / f64::from(count).sqrt(), "{count}, {angle} degrees, {cut}: {error}");
                }
            }
        }
    }

    /// Were the place in the pixel, the point on the lens and the moment not paired well, a blurred edge would have steps: halves of one would have more
    /// than their share of the others. Random frames have a standard deviation of sqrt(count) / 4 in each of these quarters.
    #[test]
    fn places_points_and_moments_do_not_follow_each_other() {
        for count in [16u32, 64, 256, 1024, 4096] {
            let coordinates: Vec<[f64; 5]> = frames(count)
                .into_iter()
                .map(|([x, y], [u, v], t)| [x, y, u * u + v * v, v.atan2(u) / TAU + 0.5, t])
                .collect();
            for (a, b) in (0..5).flat_map(|a| (a + 1..5).map(move |b| (a, b))) {
                let both = coordinates.iter().filter(|own| own[a] < 0.5 && own[b] < 0.5).count() as f64;
                let error = (both - f64::from(count) / 4.0).abs();
                assert!(error <= 1.0 + 0.75 * f64::from(count).sqrt() / 4.0, "{count}, {a} and {b}: {both}");
            }
        }
    }
}
