//! Places of samples: over a pixel's square, over the discs of lights and of the lens, and in the time for which a shutter is open.
//!
//! Converged pictures take the first two dimensions of Sobol's sequence with hashed Owen scrambling, their order shuffled anew for the
//! pixel's square, for the lens and for each light (Burley, "Practical Hash-Based Owen Scrambling", JCGT 2020). So each is evenly covered by any number of
//! samples, none depends on another, more samples go on from fewer, and each sample alone is uniform, so that means are without bias.

use std::f64::consts::TAU;

use glam::DVec2;

/// Points of a light's disc that [`super::Mode::Point`] asks.
pub const DISC_POINTS: u32 = 64;
/// Samples of the sky that it asks: by each strategy.
pub const SKY_POINTS: u32 = 256;

/// A hash of 64 bits (splitmix64's finalizer; Steele, Lea and Flood 2014).
pub fn hash(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A permutation of which bit n depends only on the bits up to n (Laine and Karras 2011, constants by Burley).
fn permuted(value: u32, seed: u32) -> u32 {
    let mut x = value.wrapping_add(seed);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6u32] {
        x ^= x.wrapping_mul(factor);
    }
    x
}

/// Halves, quarters and so on of the range change places (Owen 1995).
fn scrambled(value: u32, seed: u32) -> u32 {
    permuted(value.reverse_bits(), seed).reverse_bits()
}

/// The second dimension of Sobol's sequence in 32 bits; the first is the index with its bits reversed.
fn sobol(index: u32) -> u32 {
    let mut direction = 1u32 << 31;
    (0..32).fold(0, |sum, bit| {
        let own = if index >> bit & 1 == 1 { direction } else { 0 };
        direction ^= direction >> 1;
        sum ^ own
    })
}

/// Element `index` of a sequence over the unit square that the seed chooses.
fn element(index: u32, seed: u64) -> DVec2 {
    let part = |number: u64| hash(seed ^ hash(number)) as u32;
    let (order, across, down) = (part(0), part(1), part(2));
    let index = scrambled(index, order);
    let share = |bits: u32| (f64::from(bits) + 0.5) / 4_294_967_296.0;
    DVec2::new(share(scrambled(index.reverse_bits(), across)), share(scrambled(sobol(index), down)))
}

/// Returns the place of sample `index` in a pixel's square, 0 to 1 from the upper left corner.
pub fn in_pixel(index: u32, pixel: u64) -> DVec2 {
    element(index, hash(pixel))
}

/// Returns the place on the unit disc at which sample `index` of a pixel meets a light.
pub fn on_disc(index: u32, pixel: u64, light: usize) -> DVec2 {
    disc(element(index, hash(hash(pixel) ^ (light as u64 + 1))))
}

/// Returns the place in the unit square by which sample `index` of a pixel chooses a direction of the sky, for each of several strategies.
pub fn on_sky(index: u32, pixel: u64, strategy: u64) -> DVec2 {
    // Lights are numbered from 1.
    element(index, hash(hash(pixel) ^ (u64::MAX - 1).wrapping_sub(strategy)))
}

/// Returns the place on the unit disc above which ray `index` of a pixel meets the hemisphere.
pub fn on_hemisphere(index: u32, pixel: u64) -> DVec2 {
    disc(element(index, hash(hash(pixel) ^ u64::MAX)))
}

/// Returns the place in the unit square by which direction `index` of a pixel's lobe is chosen.
pub fn on_lobe(index: u32, pixel: u64) -> DVec2 {
    element(index, hash(hash(pixel) ^ LOBE))
}

/// Returns the place on the unit disc at which sample `index` of a pixel goes through the lens.
pub fn on_lens(index: u32, pixel: u64) -> DVec2 {
    disc(element(index, hash(hash(pixel) ^ LENS)))
}

/// Returns the index of the part of the time, of `count` equal ones, in which sample `index` of a pixel lies.
pub fn part_of_time(index: u32, pixel: u64, count: u32) -> u32 {
    (hash(hash(pixel ^ SHUTTER) ^ u64::from(index)) % u64::from(count)) as u32
}

/// Numbers that no light has.
const LENS: u64 = u64::MAX - 100;
const SHUTTER: u64 = u64::MAX - 101;
const LOBE: u64 = u64::MAX - 102;

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
    fn every_cell_of_a_pixel_has_its_share_of_samples() {
        for pixel in 0..20 {
            // A net: each of 64 cells, whatever their shape, has exactly its share of 1024 samples.
            let (mut cells, mut strips) = ([0; 64], [0; 64]);
            for index in 0..1024 {
                let place = in_pixel(index, pixel);
                assert!((0.0..1.0).contains(&place.x) && (0.0..1.0).contains(&place.y));
                cells[(place.y * 8.0) as usize * 8 + (place.x * 8.0) as usize] += 1;
                strips[(place.y * 32.0) as usize * 2 + (place.x * 2.0) as usize] += 1;
            }
            assert!(cells.iter().chain(&strips).all(|&count| count == 16), "{cells:?} {strips:?}");
        }
    }
}
