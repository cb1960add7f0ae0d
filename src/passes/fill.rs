//! FILL: writes the rows of the instances that are seen, in the order in which they are drawn, and the commands that draw them.

use ash::vk;

use super::culling::CullingPipeline;
use super::{Endpoint, FrameContext, Pass, PassRecorder, Resource, ResourceUse, compute_stage, culling};
use crate::gpu::sync::Use;
use crate::shaders::fill::{self as shader, Flags};

/// Reads the CPU's data.
pub const LIST_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads what CULL and ARRANGE found.
pub const COUNT_READ: Use = LIST_READ;
/// Writes rows and commands.
pub const DRAW_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("FILL"),
    time: "fill",
    what: "rows of the instances that are seen, and the commands that draw them",
    presence: culling::presence,
    touches: |_| {
        vec![
            ResourceUse::resource(Resource::FrameData, LIST_READ),
            ResourceUse::resource(Resource::CulledInstances, COUNT_READ.or(DRAW_WRITE))
                .because("puts rows where ARRANGE says, and writes the commands"),
        ]
    },
    leave_out: None,
    make: Some(|own| {
        let culling = own.needed(own.culling)?;
        let stage = compute_stage("fill", shader::variant, Flags::LOOKS.when(culling.has_looks()), &[])?;
        Ok(Box::new(FillPass(CullingPipeline::new(own, "fill", &stage)?)))
    }),
};

pub struct FillPass(CullingPipeline);

impl PassRecorder for FillPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let Some(culling) = context.culling else { return };
        self.0.dispatch(context, culling, culling.groups());
    }
}
