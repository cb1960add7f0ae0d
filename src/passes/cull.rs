//! CULL: which opaque instances are in view, in which step of depth each of them is, and how many come before it in its group. It is the first of
//! three culling passes on the device: ARRANGE and FILL put the visible instances into the order in which the CPU would draw them.

use ash::vk;

use super::culling::CullingPipeline;
use super::{Endpoint, FrameContext, Pass, PassRecorder, Resource, ResourceUse, compute_stage, culling};
use crate::gpu::sync::Use;
use crate::shaders::cull::{self as shader, Flags};

/// Reads the CPU's data.
pub const LIST_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Looks into the pyramid of depths.
pub const PYRAMID_READ: Use = LIST_READ;
/// Writes the visibility marks and counts.
pub const MARK_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("CULL"),
    time: "cull",
    what: "which instances are in view, and in which step of depth",
    presence: culling::presence,
    touches: |plan| {
        let pyramid = plan.hides_on_device.then(|| {
            ResourceUse::resource(Resource::DepthPyramid, PYRAMID_READ).because("tests boxes against the least depths")
        });
        let lists = [
            ResourceUse::resource(Resource::FrameData, LIST_READ),
            ResourceUse::resource(Resource::CulledInstances, MARK_WRITE).because("marks and counts what it finds"),
        ];
        lists.into_iter().chain(pyramid).collect()
    },
    leave_out: None,
    make: Some(|own| {
        let culling = own.needed(own.culling)?;
        let flags = Flags::HIDES.when(culling.hides()) | Flags::LEVELS.when(culling.has_levels());
        let stage = compute_stage("cull", shader::variant, flags, &[])?;
        Ok(Box::new(CullPass(CullingPipeline::new(own, "cull", &stage)?)))
    }),
};

pub struct CullPass(CullingPipeline);

impl PassRecorder for CullPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let Some(culling) = context.culling else { return };
        self.0.dispatch(context, culling, culling.groups());
    }
}
