//! Shared by CULL, ARRANGE and FILL, and by the passes before them that find occluded objects.

use ash::vk;

use super::{FrameContext, Making, Presence};
use crate::gpu::{self, Owned, ShaderStage, compute_pipeline, pipeline_layout};
use crate::gpu_scene::CullingBuffers;
use crate::plan::FramePlan;

/// Tells if the device culls, and why.
pub fn presence(plan: &FramePlan) -> Presence {
    Presence::when(plan.culls_on_device, &plan.reasons.culling, &plan.reasons.culling)
}

/// Tells if it culls occluded objects, too, and why.
pub fn hiding(plan: &FramePlan) -> Presence {
    Presence::when(plan.hides_on_device, &plan.reasons.hiding, &plan.reasons.hiding)
}

/// A compute pipeline that takes nothing but the set of [`CullingBuffers`].
pub struct CullingPipeline {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
}

impl CullingPipeline {
    pub fn new(own: &Making, name: &str, stage: &ShaderStage) -> gpu::Result<Self> {
        let layout = pipeline_layout(own.device, name, &[own.needed(own.culling)?.set_layout.raw], &[])?;
        let pipeline = compute_pipeline(own.device, name, stage, layout.raw)?;
        Ok(Self { layout, pipeline })
    }

    /// So many work groups across and down.
    pub fn dispatch(&self, context: &FrameContext, culling: &CullingBuffers, [across, down]: [u32; 2]) {
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let set = culling.set(context.in_flight);
        // SAFETY: `cmd` is being recorded outside a render pass; the set is of the layout. The buffers in it live until the frame is done, and no
        // work group looks beyond their content.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[set], &[]);
            raw.cmd_dispatch(cmd, across, down, 1);
        }
    }
}
