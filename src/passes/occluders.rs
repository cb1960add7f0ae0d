//! OCCLUDERS: depth of the largest objects in view, from which PYRAMID and CULL find the objects behind them. Later passes draw these objects again
//! with all others. The CPU chooses them by the size of their boxes in the picture, so that the choice does not depend on earlier frames.

use super::depth_only::DepthOnly;
use super::{
    ContentsIfFirst, EARLY_DEPTH_READ, Endpoint, FrameContext, LATE_DEPTH_WRITE, Pass, PassRecorder, ResourceUse,
    culling, frame_data, meshes,
};
use crate::gpu::sync::Use;
use crate::plan::Target;

/// Clears, tests and writes depth.
const DEPTH_TEST: Use = EARLY_DEPTH_READ.or(LATE_DEPTH_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("OCCLUDERS"),
    time: "occluders",
    what: "depth of the largest objects, which may hide others",
    presence: culling::hiding,
    touches: |plan| {
        let depth = ResourceUse::depth_of(Target::Occluders, ContentsIfFirst::Clear, DEPTH_TEST)
            .because("clears the depth of large objects and draws it");
        [depth, frame_data()].into_iter().chain(meshes(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(OccludersPass(DepthOnly::new(own, "occluders", 0)?)))),
};

/// The pass, which has a separate render pass.
pub struct OccludersPass(DepthOnly);

impl PassRecorder for OccludersPass {
    /// Draws them. Runs inside its render pass.
    fn record(&self, context: &FrameContext) {
        self.0.record(context, &context.visible.occluders);
    }
}
