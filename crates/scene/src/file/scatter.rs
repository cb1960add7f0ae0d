//! `[[scattered_lights]]`: many point lights from a few numbers.

use glam::{DVec3, Vec3};

use super::lights::reach;
use super::node::{KeyedValue, SHARE, STRENGTH};
use super::schema;
use crate::builtin::stage::{Random, hue};
use crate::{Error, Light, LightKind, luminance};

/// The most lights of one table.
const MAX_COUNT: u32 = 1_000_000;

/// Adds the lights of one table.
pub(super) fn lights(node: &KeyedValue, lights: &mut Vec<Light>) -> Result<(), Error> {
    let table = node.table(schema::SCATTER)?;
    let needs = |key: &str| table.get(key).ok_or_else(|| table.wrong(&format!("needs {key}")));
    let count = needs("count")?.integer(1..=MAX_COUNT)?;
    let (low, high) = (needs("min")?.point()?, needs("max")?);
    let size = high.point()? - low;
    if size.min_element() < 0.0 {
        return Err(high.wrong("must not be below min in any coordinate"));
    }
    let intensity = needs("intensity")?.number_f32(STRENGTH)?;
    let saturation = table.read("saturation", |node| node.number_f32(SHARE))?.unwrap_or(0.45);
    let seed = table.read("seed", |node| node.integer(0..=u32::MAX))?.unwrap_or(0);
    let name = table.read("name", KeyedValue::string)?.unwrap_or("scattered");
    for (index, place) in places(seed).take(count as usize).enumerate() {
        let color = Vec3::ONE.lerp(hue(place[3]), saturation);
        let (range, falloff) = reach(&table, f64::from(luminance(color)) * f64::from(intensity))?;
        let position = low + size * DVec3::new(place[0], place[1], place[2]);
        lights.push(Light {
            name: format!("{name} {index}"),
            color,
            intensity,
            ..Light::of(LightKind::Point { position, range, falloff })
        });
    }
    Ok(())
}

/// Places in the unit cube, and a fourth share for the hue: the additive recurrence by the powers of the generalized golden ratio (M. Roberts,
/// "The Unreasonable Effectiveness of Quasirandom Sequences", 2018), which fills the cube evenly however many are taken, and hues by the
/// golden ratio itself. Seed 0 starts in the cube's middle.
fn places(seed: u32) -> impl Iterator<Item = [f64; 4]> {
    /// The roots of x^4 = x + 1 and x^2 = x + 1.
    const RATIO: f64 = 1.220_744_084_605_759_5;
    const GOLDEN: f64 = 1.618_033_988_749_895;
    let mut random = Random(u64::from(seed));
    let start: [f64; 4] = std::array::from_fn(|_| if seed == 0 { 0.5 } else { random.unit() });
    let step = [1.0 / RATIO, RATIO.powi(-2), RATIO.powi(-3), 1.0 / GOLDEN];
    (0..).map(move |index| std::array::from_fn(|axis| (start[axis] + f64::from(index) * step[axis]).fract()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_fill_the_cube_evenly() {
        for seed in [0, 1, u32::MAX] {
            // Of 8 x 8 x 8 cells each gets about its share, 8 of 4096; by chance some would get one or none, and others 18.
            let mut cells = vec![0; 512];
            for place in places(seed).take(4096) {
                assert!(place.iter().all(|share| (0.0..1.0).contains(share)), "{place:?}");
                let cell = |axis: usize| (place[axis] * 8.0) as usize;
                cells[(cell(0) * 8 + cell(1)) * 8 + cell(2)] += 1;
            }
            let (fewest, most) = (cells.iter().min(), cells.iter().max());
            assert!(fewest >= Some(&4) && most <= Some(&14), "seed {seed}: {fewest:?} to {most:?}");
        }
        assert_eq!(places(0).next(), Some([0.5; 4]));
        assert_ne!(places(1).next(), places(2).next());
    }

    #[test]
    fn no_two_hang_in_one_place() {
        // A tenth of the mean spacing is no great demand, but chance alone does not meet it.
        let all: Vec<DVec3> = places(0).take(1000).map(|[x, y, z, _]| DVec3::new(x, y, z)).collect();
        let pairs = all.iter().enumerate().flat_map(|(index, a)| all[..index].iter().map(move |b| a.distance(*b)));
        let nearest = pairs.fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.02, "{nearest}");
    }
}
