//! OCCLUDERS: depth of the largest objects in view, from which PYRAMID and CULL find out what they hide. They are drawn again among the
//! others; the CPU chooses them by the size of their boxes in the picture, so that nothing depends on what was drawn before.

use std::sync::Arc;

use ash::vk;

use super::depth_only::DepthOnly;
use super::{
    ContentsIfFirst, EARLY_DEPTH_READ, FrameContext, LATE_DEPTH_WRITE, Pass, PassName, PassRecorder, ResourceUse, Slot,
    culling, frame_data, meshes,
};
use crate::gpu::{self, Device, sync::Use};
use crate::plan::{FramePlan, Target};

/// Clears, tests and writes depth.
const DEPTH_TEST: Use = EARLY_DEPTH_READ.or(LATE_DEPTH_WRITE);

pub const PASS: Pass = Pass {
    place: PassName::pass("OCCLUDERS"),
    time: "occluders",
    what: "depth of the largest objects, which may hide others",
    presence: culling::hiding,
    touches: |plan| {
        let depth = ResourceUse::depth_of(Target::Occluders, ContentsIfFirst::Clear, DEPTH_TEST)
            .because("clears the depth of large objects and draws it");
        [depth, frame_data()].into_iter().chain(meshes(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(OccludersPass::new(own.device, own.plan, own.slot()?, own.layouts.frame)?))),
};

/// The pass, in a render pass of its own.
pub struct OccludersPass(DepthOnly);

impl OccludersPass {
    /// # Errors
    /// When the device cannot compile a pipeline.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: &Slot,
        frame_layout: vk::DescriptorSetLayout,
    ) -> gpu::Result<Self> {
        Ok(Self(DepthOnly::new(device, plan, ("occluders", slot), frame_layout, 0)?))
    }
}

impl PassRecorder for OccludersPass {
    /// Draws them. Runs inside its render pass.
    fn record(&self, recording: &FrameContext) {
        self.0.record(recording, &recording.visible.occluders);
    }
}
