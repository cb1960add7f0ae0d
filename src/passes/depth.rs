//! DEPTH, the pre-pass: opaque surfaces into the depth target alone, before the same subpass shades them where depths are equal. Masked
//! ones are left out.

use super::depth_only::DepthOnly;
use super::{Endpoint, FrameContext, Pass, PassRecorder, Presence, frame_data, meshes};

pub const PASS: Pass = Pass {
    name: Endpoint::pass("DEPTH"),
    time: "depth",
    what: "depth of opaque surfaces alone, before the same subpass shades them",
    presence: |plan| {
        let why_not = if plan.shading.reads_gbuffer() { "not asked for" } else { "this view shades nothing" };
        Presence::when(plan.depth_prepass, "depth is drawn first, so that each pixel is shaded once", why_not)
    },
    // The pass whose subpass it draws in declares the attachments.
    touches: |plan| [frame_data()].into_iter().chain(meshes(plan)).collect(),
    leave_out: None,
    make: Some(|own| {
        // FORWARD writes light alone.
        let locations = if own.plan.is_forward() { 1 } else { own.plan.geometry_locations() };
        Ok(Box::new(DepthPass(DepthOnly::new(own, "depth", locations)?)))
    }),
};

/// The pass. It draws inside the subpass that shades afterwards.
pub struct DepthPass(DepthOnly);

impl PassRecorder for DepthPass {
    /// Draws visible opaque objects. Runs inside the subpass, before the draws that shade.
    fn record(&self, context: &FrameContext) {
        self.0.record(context, &context.visible.draws);
    }
}
