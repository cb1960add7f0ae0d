//! PYRAMID: the least depth of each square of the picture, in four sizes of squares: an object that lies behind it all over a square cannot be seen
//! there.

use std::sync::Arc;

use ash::vk;

use super::{
    Endpoint, FrameContext, InputDescriptor, Making, Pass, PassRecorder, Resource, ResourceUse, compute_stage, culling,
};
use crate::gpu::{
    self, DescriptorPool, Device, Owned, SetLayout, SetWriter, binding, compute_pipeline, pipeline_layout, sync::Use,
};
use crate::gpu_scene::CullingBuffers;
use crate::plan::Target;
use crate::shaders::pyramid::{self as shader, Flags};

/// Reads the depth of the largest objects.
pub const DEPTH_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes every square.
pub const PYRAMID_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("PYRAMID"),
    time: "pyramid",
    what: "the least depth of each square of the picture",
    presence: culling::hiding,
    touches: |_| {
        vec![
            ResourceUse::sampled(0, Target::Occluders, DEPTH_READ).because("reads the depth of all pixels of a square"),
            ResourceUse::resource(Resource::DepthPyramid, PYRAMID_WRITE)
                .because("writes the least depth of each square"),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(PyramidPass::new(own)?))),
};

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;
const KINDS: [vk::DescriptorType; 2] = [vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::STORAGE_BUFFER];

pub struct PyramidPass {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    set_layout: SetLayout,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
}

impl PyramidPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let bindings = [0, 1].map(|index| binding(index, KINDS[index as usize], COMPUTE));
        let set_layout = SetLayout::new(device, "pyramid", &bindings)?;
        let layout = pipeline_layout(device, "pyramid", &[set_layout.raw], &[])?;
        let stage = compute_stage("pyramid", shader::variant, Flags::SAMPLES.when(plan.msaa > 1), &[])?;
        let pipeline = compute_pipeline(device, "pyramid", &stage, layout.raw)?;
        let (pool, set) = bound(device, &set_layout, own.needed(own.culling)?, &own.inputs())?;
        Ok(Self { layout, pipeline, set_layout, pool, set })
    }
}

impl PassRecorder for PyramidPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let Some(culling) = context.culling else { return };
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let [across, down] = culling.tiles();
        // SAFETY: `cmd` is being recorded outside a render pass; the set is of the layout. The pyramid has room for so many tiles.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[self.set], &[]);
            raw.cmd_dispatch(cmd, across, down, 1);
        }
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        (self.pool, self.set) = bound(own.device, &self.set_layout, own.needed(own.culling)?, &own.inputs())?;
        Ok(())
    }
}

/// The set of the inputs and the output.
fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    culling: &CullingBuffers,
    inputs: &[InputDescriptor],
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let pool = DescriptorPool::new(device, "pyramid", 1, &KINDS.map(|kind| (kind, 1)))?;
    let set = pool.allocate("pyramid", layout.raw)?;
    let mut writer = SetWriter::new();
    for &(binding, view, layout) in inputs {
        writer = writer.sampled_image(binding, view, layout);
    }
    if let Some(pyramid) = &culling.pyramid {
        writer = writer.storage_buffer(1, pyramid, pyramid.size);
    }
    writer.update(device, set);
    Ok((pool, set))
}
