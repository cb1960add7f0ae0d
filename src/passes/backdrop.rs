//! BACKDROP: the picture as glass shows it, before anything transparent is blended over it: light and depth of each pixel, and the mean light of ever larger squares, which
//! rough glass blurs it by.

use std::sync::Arc;

use ash::vk;

use super::{
    Endpoint, FrameContext, InputDescriptor, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, SAMPLED,
    compute_stage,
};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Location, MemoryKind, Owned, SetLayout, SetWriter, binding, compute_pipeline,
    pipeline_layout, sync::Use,
};
use crate::plan::{BACKDROP, FramePlan, Target};
use crate::shaders::backdrop::{self as shader, Flags, constants};

/// Reads the light and the depth of each pixel.
pub const PICTURE_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes all levels.
pub const LEVELS_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);
/// The levels, where set 0 names them.
pub const LEVELS: Resource = Resource::Buffers(BACKDROP);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("BACKDROP"),
    time: "backdrop",
    what: "the picture behind glass, and the means of its squares",
    presence: |plan| {
        Presence::when(
            plan.effects.refraction.is_some(),
            "glass bends and blurs what is behind it",
            plan.reasons.lack_of("refraction"),
        )
    },
    touches: |plan| {
        vec![
            ResourceUse::sampled(PICTURE, plan.light_target(), PICTURE_READ).because("reads the light of each pixel"),
            ResourceUse::sampled(DEPTH, Target::Depth, PICTURE_READ).because("reads the depth of each pixel"),
            ResourceUse::resource(LEVELS, LEVELS_WRITE).because("writes the picture behind glass"),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(BackdropPass::new(own)?))),
};

/// Looks at the picture behind glass, as every pass does whose shader names it.
pub(super) fn touch(plan: &FramePlan) -> Option<ResourceUse> {
    plan.effects.refraction.map(|_| ResourceUse::resource(LEVELS, SAMPLED).because("looks up the picture behind glass"))
}

const TEXELS: u32 = 0;
const PICTURE: u32 = 1;
const DEPTH: u32 = 2;
const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;
/// Edge of the part of the picture that a work group reads, in pixels.
const TILE: u32 = 32;

struct BackdropPass {
    levels: Buffer,
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    set_layout: SetLayout,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
}

impl BackdropPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let (device, inputs) = (own.device, own.inputs());
        let images = inputs.iter().map(|input| binding(input.0, vk::DescriptorType::SAMPLED_IMAGE, COMPUTE));
        let bindings: Vec<_> =
            [binding(TEXELS, vk::DescriptorType::STORAGE_BUFFER, COMPUTE)].into_iter().chain(images).collect();
        let set_layout = SetLayout::new(device, "backdrop", &bindings)?;
        let layout = pipeline_layout(device, "backdrop", &[set_layout.raw], &[])?;
        let constants = [(constants::LARGEST, own.plan.largest_shown().to_bits())];
        let stage = compute_stage("backdrop", shader::variant, flags(own.plan), &constants)?;
        let pipeline = compute_pipeline(device, "backdrop", &stage, layout.raw)?;
        let levels = buffer(own)?;
        let (pool, set) = bound(device, &set_layout, &levels, &inputs)?;
        Ok(Self { levels, layout, pipeline, set_layout, pool, set })
    }
}

impl PassRecorder for BackdropPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let [across, down] = context.size.map(|edge| edge.div_ceil(TILE));
        // SAFETY: `cmd` is being recorded outside a render pass; the set is that of the layout, and the pass owns all of it and outlives the submission. The shader
        // looks at no texel outside its images, and the buffer has room for all levels.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[self.set], &[]);
            raw.cmd_dispatch(cmd, across, down, 1);
        }
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.levels = buffer(own)?;
        (self.pool, self.set) = bound(own.device, &self.set_layout, &self.levels, &own.inputs())?;
        Ok(())
    }

    fn buffers(&self) -> Vec<(Resource, &Buffer)> {
        vec![(LEVELS, &self.levels)]
    }
}

fn buffer(own: &Making) -> gpu::Result<Buffer> {
    let size = own.needed(own.plan.effects.refraction)?.bytes(own.plan.size);
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    Buffer::new(own.device, "backdrop", size, usage, Location::Device, MemoryKind::Attachment)
}

/// The set of the inputs and the output.
fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    levels: &Buffer,
    inputs: &[InputDescriptor],
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let kinds = [(vk::DescriptorType::STORAGE_BUFFER, 1), (vk::DescriptorType::SAMPLED_IMAGE, 2)];
    let pool = DescriptorPool::new(device, "backdrop", 1, &kinds)?;
    let set = pool.allocate("backdrop", layout.raw)?;
    let writer = SetWriter::new().storage_buffer(TEXELS, levels, levels.size);
    let all = inputs.iter().fold(writer, |writer, &(index, view, layout)| writer.sampled_image(index, view, layout));
    all.update(device, set);
    Ok((pool, set))
}

/// Returns the shader variant of a plan.
fn flags(plan: &FramePlan) -> Flags {
    Flags::MSAA.when(plan.msaa > 1)
}
