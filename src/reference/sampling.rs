//! Where samples lie: over a pixel's square and over the discs of lights.
//!
//! Converged pictures take the additive recurrence of the generalized golden ratio in four dimensions (Roberts, "The Unreasonable Effectiveness
//! of Quasirandom Sequences", 2018), shifted for each pixel and each light by a hash (Cranley and Patterson 1976): any number of samples is
//! evenly spread, more samples go on from fewer, and each sample alone is uniform, so that means are without bias.

use std::f64::consts::TAU;

use glam::DVec2;

/// Points of a light's disc that [`super::Mode::Point`] asks.
pub const DISC_POINTS: u32 = 64;

/// The root of x^5 = x + 1, to the powers -1 to -4.
const STEPS: [f64; 4] = [0.856_674_883_854_502_9, 0.733_891_856_627_126, 0.628_706_721_037_808_6, 0.538_597_257_223_61];

/// A place in the unit square from a number of 64 bits.
fn square(hash: u64) -> DVec2 {
    let part = |bits: u64| (bits & 0xffff_ffff) as f64 / 4_294_967_296.0;
    DVec2::new(part(hash), part(hash >> 32))
}

/// A hash of 64 bits (splitmix64's finalizer; Steele, Lea and Flood 2014).
pub fn hash(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn element(index: u32, steps: [f64; 2], shift: DVec2) -> DVec2 {
    (DVec2::from_array(steps) * f64::from(index) + shift).fract()
}

/// Where sample `index` of a pixel lies in its square, 0 to 1 from the upper left corner.
pub fn in_pixel(index: u32, pixel: u64) -> DVec2 {
    element(index, [STEPS[0], STEPS[1]], square(hash(pixel)))
}

/// Where on the unit disc sample `index` of a pixel meets a light.
pub fn on_disc(index: u32, pixel: u64, light: usize) -> DVec2 {
    let shift = square(hash(hash(pixel) ^ (light as u64 + 1)));
    let place = element(index, [STEPS[2], STEPS[3]], shift);
    disc(place)
}

/// Point `index` of [`DISC_POINTS`] that cover the unit disc evenly: a sunflower's seeds, turned by the light's number so that edges
/// along the same line are not cut alike.
pub fn stratum(index: u32, light: usize) -> DVec2 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let radius = ((f64::from(index) + 0.5) / f64::from(DISC_POINTS)).sqrt();
    let (sine, cosine) = ((f64::from(index) + light as f64) * GOLDEN * TAU).sin_cos();
    DVec2::new(cosine, sine) * radius
}

/// The unit square onto the unit disc, areas kept in proportion, squares around the middle to circles (Shirley and Chiu 1997).
fn disc(place: DVec2) -> DVec2 {
    let p = place * 2.0 - 1.0;
    if p == DVec2::ZERO {
        return DVec2::ZERO;
    }
    let eighth = TAU / 8.0;
    let (radius, angle) =
        if p.x.abs() > p.y.abs() { (p.x, eighth * (p.y / p.x)) } else { (p.y, 2.0 * eighth - eighth * (p.x / p.y)) };
    DVec2::from_angle(angle) * radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_are_powers_of_the_root() {
        let root: f64 = 1.0 / STEPS[0];
        assert!((root.powi(5) - root - 1.0).abs() < 1e-12, "{root}");
        for (power, step) in STEPS.into_iter().enumerate() {
            assert!((step - root.powi(-(power as i32 + 1))).abs() < 1e-12, "{power}");
        }
    }

    /// The share of points in a half-plane and their mean square radius.
    fn spread(points: impl Iterator<Item = DVec2>) -> (f64, f64, f64) {
        let points: Vec<DVec2> = points.collect();
        let count = points.len() as f64;
        assert!(points.iter().all(|point| point.length() <= 1.0));
        let half = points.iter().filter(|point| point.x + 0.5 * point.y > 0.0).count() as f64 / count;
        let radius = points.iter().map(|point| point.length_squared()).sum::<f64>() / count;
        (half, radius, points.iter().map(|point| point.x).sum::<f64>() / count)
    }

    #[test]
    fn discs_are_covered_evenly() {
        let (half, radius, mean) = spread((0..DISC_POINTS).map(|index| stratum(index, 3)));
        assert!(
            (half - 0.5).abs() < 0.035 && (radius - 0.5).abs() < 1e-12 && mean.abs() < 0.02,
            "{half} {radius} {mean}"
        );
        let (half, radius, mean) = spread((0..4096).map(|index| on_disc(index, 77, 0)));
        assert!((half - 0.5).abs() < 0.004 && (radius - 0.5).abs() < 0.004 && mean.abs() < 0.004, "{half} {radius}");
    }

    #[test]
    fn every_pixel_is_covered_evenly_whatever_its_shift() {
        for pixel in 0..20 {
            // Each of 64 cells of the square has about its share of 1024 samples.
            let mut cells = [0; 64];
            for index in 0..1024 {
                let place = in_pixel(index, pixel);
                assert!((0.0..1.0).contains(&place.x) && (0.0..1.0).contains(&place.y));
                cells[(place.y * 8.0) as usize * 8 + (place.x * 8.0) as usize] += 1;
            }
            assert!(cells.iter().all(|count| (10..=22).contains(count)), "{cells:?}");
        }
    }
}
