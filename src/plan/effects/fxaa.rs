//! FXAA: the picture that it draws.

use crate::plan::effect::{Effect, Variation};
use crate::plan::parts::{bytes_of_target, part};
use crate::plan::{OwnTarget, PartGroup, Target, TargetName, format_bytes};

/// The picture with its edges smoothed.
pub const SMOOTHED: Target = Target::Redrawn(TargetName(0, "Smoothed"));

/// The name of its line in `inspect`.
const LINE: &str = "smoothed picture";

/// Edges of the finished picture are smoothed.
pub(crate) const EFFECT: Effect = Effect {
    name: "FXAA",
    is_asked_for: |_, settings| settings.fxaa,
    off: Some(("--fxaa off", |settings| settings.fxaa = false)),
    is_in: |plans| plans.fxaa,
    targets: &[OwnTarget {
        target: SMOOTHED,
        noun: "the picture",
        line: Some(LINE),
        format: |plan| plan.effects.fxaa.then_some(plan.output),
        extent: |plan| plan.size,
        bytes_per_pixel: |plan| format_bytes(plan.output),
    }],
    parts: |_, _, plan| {
        let reason = if plan.effects.fxaa { "FXAA draws it" } else { "FXAA is off" };
        vec![part(LINE, plan.effects.fxaa, reason, bytes_of_target(plan, SMOOTHED)).of(PartGroup::Targets)]
    },
    variations: &[Variation::of("fxaa", |settings| settings.fxaa = true)],
    draws: &["fxaa"],
    former_rows: &[("output-to-fxaa", &["*-to-fxaa"]), ("picture-reuse", &["fxaa-reuse"])],
    ..Effect::PLAIN
};
