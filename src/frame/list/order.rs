//! Lines of the frame's order (`src/frame/deferred.rs`), and the steps that a plan makes of them.

use super::{Condition, Planned, commands, subpass};
use crate::passes::Pass;
use crate::plan::FramePlan;

/// A line of the frame's order.
pub(in crate::frame) enum OrderEntry {
    /// Passes that draw in one subpass, named by the first argument.
    Draw(&'static Pass, &'static [&'static Pass]),
    /// Passes that draw into images of another size: a separate render pass with a subpass for each pass.
    DrawApart(&'static [&'static Pass]),
    /// A pass outside of render passes.
    Run(&'static Pass),
    /// `Run` on the compute queue, if the plan has one.
    RunBeside(&'static Pass),
    /// A pass outside of render passes, left out of frames in which deformed objects have the pose that they had in the frame before.
    RunPosed(&'static Pass),
    /// Ends a render pass if the plan asks for it.
    SplitIf(fn(&FramePlan) -> bool),
    /// Lines that stand here in some plans, and elsewhere in the others.
    LinesIf(fn(&FramePlan) -> bool, &'static [OrderEntry]),
}

impl OrderEntry {
    pub(super) fn passes(&self) -> Vec<&'static Pass> {
        match *self {
            Self::Draw(_, passes) => passes.to_vec(),
            Self::DrawApart(passes) => passes.to_vec(),
            Self::Run(pass) | Self::RunBeside(pass) | Self::RunPosed(pass) => vec![pass],
            Self::SplitIf(_) => Vec::new(),
            Self::LinesIf(_, lines) => lines.iter().flat_map(Self::passes).collect(),
        }
    }

    pub(super) fn planned(&self, plan: &FramePlan) -> Vec<Planned> {
        let run = |when, pass| commands(plan, when, pass, &[], &[]);
        let one = match *self {
            Self::Draw(place, passes) => subpass(plan, place.name, passes).map(Planned::Drawn),
            Self::DrawApart(passes) => {
                let drawn: Vec<_> = passes.iter().filter_map(|&pass| subpass(plan, pass.name, &[pass])).collect();
                (!drawn.is_empty()).then_some(Planned::DrawnApart(drawn))
            }
            Self::Run(pass) => run(Condition::Always, pass).map(Planned::Recorded),
            Self::RunBeside(pass) => run(Condition::Always, pass).map(|step| Planned::Recorded(step.beside(plan))),
            Self::RunPosed(pass) => run(Condition::Posed, pass).map(Planned::Recorded),
            Self::SplitIf(parts) => parts(plan).then_some(Planned::Split),
            Self::LinesIf(stands, lines) if stands(plan) => {
                return lines.iter().flat_map(|line| line.planned(plan)).collect();
            }
            Self::LinesIf(..) => None,
        };
        one.into_iter().collect()
    }
}
