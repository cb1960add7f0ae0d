//! Bloom: the share of light that is spread, the distance, and the number of levels.

use crate::plan::effect::{Effect, EffectView, Hdr, NOT_ASKED_FOR, Shows, Variation};
use crate::plan::parts::part;
use crate::plan::{BufferName, PartGroup, Shading};
use crate::scene::{Output, Resolve, Settings, View};

/// The light that BLOOM spreads, level by level.
pub const BLOOM_LEVELS: BufferName = BufferName("levels of bloom");

/// Light is spread before it is shown.
pub(crate) const EFFECT: Effect = Effect {
    name: "bloom",
    is_asked_for: |_, settings| settings.bloom > 0.0,
    off: Some(("--bloom 0", |settings| settings.bloom = 0.0)),
    view: Some(EffectView {
        view: View::Bloom,
        shows: Shows::Light,
        is_alone: false,
        // The lit picture, all of whose light is spread.
        plan: |settings| (settings.view, settings.bloom) = (View::Final, 1.0),
    }),
    changes_light: true,
    is_set_aside: true,
    unswept: |key, _, plan| (key == "bloom-taps" && plan.effects.bloom.is_none()).then_some("no bloom is asked for"),
    spreads: true,
    shines_beyond: true,
    is_in: |plans| plans.bloom.is_some(),
    hdr: Some(Hdr::Reads("light is spread before it is tone-mapped")),
    absence: |own| if own.asked.bloom > 0.0 { "this view shows no bloom" } else { NOT_ASKED_FOR },
    parts: |_, _, plan| {
        let levels = match &plan.effects.bloom {
            Some(own) => {
                let levels = own.levels(plan.size).len();
                let reason =
                    format!("{levels} levels, each half as large as the one before it, four single floats a texel");
                part("levels of bloom", true, reason, own.bytes(plan.size))
            }
            None => part("levels of bloom", false, plan.reasons.lack_of(EFFECT.name), 0),
        };
        vec![levels.of(PartGroup::Targets)]
    },
    not_by_compute: Some("they leave no light for bloom to spread"),
    check: |request| {
        let settings = request.settings;
        if settings.bloom <= 0.0 {
            return Ok(());
        }
        EFFECT.check_path(request.path)?;
        let averages_shown = settings.resolve == Resolve::ToneMapped && settings.output == Output::Srgb8;
        if settings.msaa > 1 && settings.view != View::Complexity && averages_shown {
            return EFFECT.refuse(
                "it spreads light, and samples that are averaged as shown are light no more: ask for --resolve linear",
            );
        }
        Ok(())
    },
    variations: &[
        Variation::of("bloom", |settings| settings.bloom = 0.1).carried_with(&[&["over time"]]),
        Variation::view("view of bloom", |_| {}, |settings| settings.view = View::Bloom),
    ],
    former_rows: &[("hdr-to-bloom", &["*-to-bloom"]), ("spread-to-tonemap", &["spread-to-readers"])],
    ..Effect::PLAIN
};

/// The parameters of BLOOM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BloomPlan {
    /// The share of all light that is spread.
    pub strength: f32,
    /// The root mean square distance of the spread light, as a share of the picture's height.
    pub radius: f32,
    /// Taps of the downsampling filter along an axis: 2, 4 or 6.
    pub taps: u32,
}

/// A level, coarser than the picture by a power of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BloomLevel {
    /// Width and height in texels.
    pub extent: [u32; 2],
    /// The index of its first texel in the buffer of all levels.
    pub at: u32,
}

/// The fewest levels, so that small pictures have the same steps. Levels that are too wide weigh nothing.
const LEAST_LEVELS: u32 = 3;
/// The most levels: at the last one a texel covers the largest picture that a device can draw.
const MOST_LEVELS: u32 = 15;

impl BloomPlan {
    /// Views of values have no light to spread. Values out of the settings' ranges, which only a library's caller can pass, are clamped; NaN spreads
    /// nothing, or as little as possible.
    pub(super) fn of(settings: &Settings, shading: Shading) -> Option<Self> {
        let strength = settings.bloom.min(1.0);
        let radius = settings.bloom_radius.clamp(0.001, 1.0);
        let taps = settings.bloom_taps.clamp(2, 6) / 2 * 2;
        let own = Self { strength, radius: if radius.is_nan() { 0.001 } else { radius }, taps };
        (settings.bloom > 0.0 && shading.is_lit()).then_some(own)
    }

    /// The mean square distance of the light of a level, in pixels. A downsampling filter of 2, 4 or 6 taps has a variance of 1/4, 3/4 or 5/4 squared
    /// texels along an axis, and the upsampling filter, of 4, 4 or 6 taps, follows the same rule. The area of a texel grows by four with each level.
    fn spread(&self, level: u32) -> f64 {
        let of_taps = |taps: u32| f64::from(taps - 1) / 4.0;
        2.0 * (of_taps(self.taps) + of_taps(self.taps.max(4))) * (4f64.powi(level as i32) - 1.0) / 3.0
    }

    /// The weights of the picture itself and of each level. Each level weighs twice as much as the previous one, and the last as much as the radius
    /// needs, so that weights change smoothly with the size of the picture.
    pub fn weights(&self, [width, height]: [u32; 2]) -> Vec<f64> {
        let square = (f64::from(self.radius) * f64::from(height)).powi(2);
        let most = width.max(height).next_power_of_two().ilog2().clamp(LEAST_LEVELS, MOST_LEVELS);
        let (mut weights, mut sum, mut spread) = (vec![1.0], 1.0, 0.0);
        for level in 1..=most {
            let (weight, own) = (2f64.powi(level as i32), self.spread(level));
            // (spread + x own) / (sum + x) is the square of the radius.
            let needed = (square * sum - spread) / (own - square).max(f64::MIN_POSITIVE);
            weights.push(needed.clamp(0.0, weight));
            (sum, spread) = (sum + weight, spread + weight * own);
            if needed <= weight {
                break;
            }
        }
        weights.resize(weights.len().max(LEAST_LEVELS as usize + 1), 0.0);
        let sum: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / sum).collect()
    }

    /// The share of the light of the picture, and of each level but the last, that comes from wider ones.
    pub fn shares(&self, size: [u32; 2]) -> Vec<f32> {
        let weights = self.weights(size);
        let wider = |level: usize| weights[level + 1..].iter().sum::<f64>();
        (0..weights.len() - 1)
            .map(|level| {
                let all = weights[level] + wider(level);
                if all > 0.0 { (wider(level) / all) as f32 } else { 0.0 }
            })
            .collect()
    }

    /// The levels from the first on.
    pub fn levels(&self, size: [u32; 2]) -> Vec<BloomLevel> {
        let mut at = 0;
        (1..self.weights(size).len() as u32)
            .map(|level| {
                let extent = size.map(|edge| edge.div_ceil(1 << level));
                let own = BloomLevel { extent, at };
                at += extent[0] * extent[1];
                own
            })
            .collect()
    }

    /// Of the buffer of all levels: four single floats a texel, and as much before the first.
    pub fn bytes(&self, size: [u32; 2]) -> u64 {
        let texels: u64 = self.levels(size).iter().map(|own| u64::from(own.extent[0]) * u64::from(own.extent[1])).sum();
        16 * (1 + texels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [[u32; 2]; 6] = [[1, 1], [7, 5], [33, 1], [320, 180], [1280, 720], [16384, 16384]];

    fn all() -> impl Iterator<Item = BloomPlan> {
        let radii = [0.001, 0.01, 0.05, 0.2, 1.0];
        radii.into_iter().flat_map(|radius| [2, 4, 6].map(|taps| BloomPlan { strength: 0.5, radius, taps }))
    }

    #[test]
    fn the_radius_is_that_of_the_spread_light_at_any_size_that_has_room_for_it() {
        for bloom in all() {
            for size in SIZES {
                let weights = bloom.weights(size);
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12 && weights.iter().all(|own| *own >= 0.0));
                let spread = |(level, weight): (usize, &f64)| weight * bloom.spread(level as u32);
                let found = weights.iter().enumerate().map(spread).sum::<f64>().sqrt() / f64::from(size[1]);
                // Where the widest level is the whole picture, light has nowhere else to go.
                let has_room = 4.0 * f64::from(bloom.radius) * f64::from(size[1]) < f64::from(size[0].max(size[1]));
                let error = (found / f64::from(bloom.radius) - 1.0).abs();
                assert!(!has_room || error < 1e-9, "{bloom:?} {size:?}: {found}");
            }
        }
    }

    #[test]
    fn a_caller_may_ask_for_any_numbers() {
        let of = |bloom, bloom_radius, bloom_taps| {
            let settings = Settings { bloom, bloom_radius, bloom_taps, ..Settings::default() };
            BloomPlan::of(&settings, Shading::Light { light_only: false })
        };
        for strength in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(of(strength, 0.05, 6), None);
        }
        for (asked, radius) in [(0.0, 0.001), (1e6, 1.0), (f32::INFINITY, 1.0), (-1.0, 0.001), (f32::NAN, 0.001)] {
            for (taps, own) in [(0, 2), (3, 2), (5, 4), (u32::MAX, 6)] {
                let planned = of(f32::INFINITY, asked, taps).expect("bloom");
                assert_eq!(planned, BloomPlan { strength: 1.0, radius, taps: own }, "{asked} {taps}");
                assert!(SIZES.iter().all(|&size| planned.weights(size).iter().all(|weight| weight.is_finite())));
            }
        }
    }

    #[test]
    fn weights_change_smoothly_with_the_size() {
        let bloom = BloomPlan { strength: 0.5, radius: 0.05, taps: 6 };
        for height in 100..3000 {
            let [before, after] = [height, height + 1].map(|height| bloom.weights([2 * height, height]));
            let at = |weights: &[f64], level: usize| weights.get(level).copied().unwrap_or(0.0);
            for level in 0..16 {
                let moved = (at(&before, level) - at(&after, level)).abs();
                assert!(moved < 4.0 / f64::from(height), "{height}: {before:?} {after:?}");
            }
        }
    }

    #[test]
    fn what_frames_do_does_not_depend_on_the_size_and_levels_follow_each_other() {
        for bloom in all() {
            for size in SIZES {
                let levels = bloom.levels(size);
                assert!(levels.len() >= 3 && bloom.shares(size).len() == levels.len(), "{bloom:?} {size:?}");
                let mut end = 0;
                for level in &levels {
                    assert_eq!(level.at, end);
                    end += level.extent[0] * level.extent[1];
                }
                assert_eq!(bloom.bytes(size), 16 * (1 + u64::from(end)));
                assert!(bloom.shares(size).iter().all(|share| (0.0..=1.0).contains(share)), "{bloom:?} {size:?}");
            }
        }
    }
}
