//! Chromatic aberration: the picture whose colours a lens has drawn apart.

use crate::plan::effect::{Effect, Variation};
use crate::plan::parts::{bytes_of_target, part};
use crate::plan::{OwnTarget, PartGroup, Target, TargetName, format_bytes};

/// The picture with red and blue apart.
pub const APART: Target = Target::Redrawn(TargetName(1, "Apart"));

/// The name of its line in `inspect`.
const LINE: &str = "picture with its colours apart";

/// Red and blue of the finished picture lie apart, the more so the farther from its middle.
pub(crate) const EFFECT: Effect = Effect {
    name: "chromatic aberration",
    is_asked_for: |_, settings| settings.aberration > 0.0,
    off: Some(("--aberration 0", |settings| settings.aberration = 0.0)),
    is_in: |plans| plans.aberration.is_some(),
    targets: &[OwnTarget {
        target: APART,
        noun: "the picture",
        line: Some(LINE),
        format: |plan| plan.effects.aberration.map(|_| plan.output),
        extent: |plan| plan.size,
        bytes_per_pixel: |plan| format_bytes(plan.output),
    }],
    parts: |_, _, plan| {
        let reason = match plan.effects.aberration {
            Some(share) => format!(
                "ABERRATION draws it: red lies {share} of the distance from the middle farther out, blue as much farther in"
            ),
            None => "no chromatic aberration is asked for".into(),
        };
        let bytes = bytes_of_target(plan, APART);
        vec![part(LINE, plan.effects.aberration.is_some(), reason, bytes).of(PartGroup::Targets)]
    },
    variations: &[Variation::of("colours apart", |settings| settings.aberration = 0.02)],
    ..Effect::PLAIN
};
