//! FXAA: the picture that it draws.

use super::effect::{Effect, Variation};
use super::parts::{of_target, part};
use super::{PartGroup, Target};

/// Edges of the finished picture are smoothed.
pub(crate) const EFFECT: Effect = Effect {
    name: "FXAA",
    is_asked_for: |_, settings| settings.fxaa,
    off: Some(("--fxaa off", |settings| settings.fxaa = false)),
    is_in: |plan| plan.fxaa,
    parts: |_, _, plan| {
        let reason = if plan.fxaa { "FXAA draws it" } else { "FXAA is off" };
        vec![part("smoothed picture", plan.fxaa, reason, of_target(plan, Target::Smoothed)).of(PartGroup::Targets)]
    },
    variations: &[Variation::of("fxaa", |settings| settings.fxaa = true)],
    ..Effect::PLAIN
};
