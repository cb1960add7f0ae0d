//! The parts that each frame leaves out because of where its camera is.

use super::{Part, part};
use crate::plan::{FramePlan, Shading};
use crate::scene::{OptionalPart, Scene};

pub(super) fn parts(scene: &Scene, plan: &FramePlan) -> Vec<Part> {
    let kept = |part| plan.keep.has(part);
    let why = |part, leaves_out: &str, keeps: &str| if kept(part) { keeps.to_owned() } else { leaves_out.to_owned() };
    let (offscreen, casters) = (OptionalPart::OffscreenObjects, OptionalPart::IdleCasters);
    let reason = why(offscreen, "culled by their boxes", "kept on request: all objects are drawn");
    let hidden = plan.finds_hidden(scene);
    let casters_reason = match &plan.shadow {
        None => "there are no shadow maps".into(),
        Some(_) if plan.shading == Shading::ShowShadowMap => "the view shows all that the lights see".into(),
        Some(_) if !plan.software => {
            "a GPU draws casters faster than the CPU finds those without a visible shadow".into()
        }
        Some(_) => why(
            casters,
            "casters are skipped where nothing visible lies behind them, unless their map is cached",
            "kept on request: all casters of a map are drawn",
        ),
    };
    let draws_casters =
        plan.shadow.is_some() && (!plan.may_leave_out(casters) || plan.shading == Shading::ShowShadowMap);
    vec![
        part("objects out of view", kept(offscreen), reason, 0).is(offscreen),
        part("objects behind others", hidden.is_err(), hidden.unwrap_or_else(|why| why), 0)
            .is(OptionalPart::OccludedObjects),
        part("casters without a visible shadow", draws_casters, casters_reason, 0).is(casters),
    ]
}
