//! ARRANGE: turns the numbers of instances that CULL has counted into places, a work group for each step of depth.

use ash::vk;

use super::culling::CullingPipeline;
use super::{Endpoint, FrameContext, Pass, PassRecorder, Resource, ResourceUse, compute_stage, culling};
use crate::gpu::sync::Use;
use crate::shaders::arrange::{self as shader, Flags};
use crate::visible::STEPS;

/// Reads and writes numbers of instances.
pub const COUNT: Use = Use::new(
    vk::PipelineStageFlags2::COMPUTE_SHADER,
    vk::AccessFlags2::from_raw(vk::AccessFlags2::SHADER_READ.as_raw() | vk::AccessFlags2::SHADER_WRITE.as_raw()),
);

/// Writes the counts that the CPU will read.
pub const FOUND_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("ARRANGE"),
    time: "arrange",
    what: "how many instances come before those of each group",
    presence: culling::presence,
    touches: |_| {
        vec![
            ResourceUse::resource(Resource::CulledInstances, COUNT)
                .because("adds up the numbers that CULL counted, and replaces them"),
            ResourceUse::resource(Resource::FoundCounts, FOUND_WRITE).because("writes the numbers that the CPU reads"),
        ]
    },
    leave_out: None,
    make: Some(|own| {
        let stage = compute_stage("arrange", shader::variant, Flags::NONE, &[])?;
        Ok(Box::new(ArrangePass(CullingPipeline::new(own, "arrange", &stage)?)))
    }),
};

pub struct ArrangePass(CullingPipeline);

impl PassRecorder for ArrangePass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let Some(culling) = context.culling else { return };
        self.0.dispatch(context, culling, [STEPS as u32, 1]);
    }
}
