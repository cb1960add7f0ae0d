//! FXAA: the picture that it draws.

use crate::plan::effect::Effect;
use crate::plan::parts::{of_target, part};
use crate::plan::{PartGroup, Target};

/// Edges of the finished picture are smoothed.
pub(crate) const EFFECT: Effect = Effect {
    name: "FXAA",
    is_asked_for: |_, settings| settings.fxaa,
    off: Some(("--fxaa off", |settings| settings.fxaa = false)),
    is_in: |plan| plan.effects.fxaa,
    parts: |_, _, plan| {
        let reason = if plan.effects.fxaa { "FXAA draws it" } else { "FXAA is off" };
        vec![
            part("smoothed picture", plan.effects.fxaa, reason, of_target(plan, Target::Smoothed))
                .of(PartGroup::Targets),
        ]
    },
    ..Effect::PLAIN
};
