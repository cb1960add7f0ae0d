//! Shared by compute passes over the pixels of a target: a pipeline whose set 1 has the images that it reads and stores to.

use std::sync::Arc;

use ash::vk;

use super::{FrameContext, Making, PassRecorder, ResourceUse, gbuffer_inputs};
use crate::gpu::sync::Use;
use crate::gpu::{
    self, DescriptorPool, Device, Owned, SetLayout, SetWriter, ShaderStage, binding, compute_pipeline, pipeline_layout,
};
use crate::plan::{FramePlan, Target};
use crate::shaders::Variant;

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;

/// An image of set 1: its binding, view and layout, and how it is used.
pub type ImageBinding = (u32, vk::ImageView, vk::ImageLayout, vk::DescriptorType);

/// The targets of the G-buffer as a pass samples them that finds places by depth in every layout (`STORED` in `shaders/shared/gbuffer.wgsl`).
pub(super) fn sampled_gbuffer(plan: &FramePlan, read: Use) -> Vec<ResourceUse> {
    let others = gbuffer_inputs(plan).into_iter().filter(|(_, own)| ![Target::Depth, Target::Position].contains(own));
    let all = [(0, Target::Depth)].into_iter().chain(others);
    all.map(|(binding, target)| ResourceUse::sampled(binding, target, read).because("reads the G-buffer of a pixel"))
        .collect()
}

/// A compute pipeline with its images.
pub struct PerPixelPass {
    name: String,
    /// Invocations of a work group across and down.
    group: [u32; 2],
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    set_layout: SetLayout,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
}

impl PerPixelPass {
    /// Makes the pipeline, and a set with a descriptor for each image that the pass touches.
    pub fn new(own: &Making, (name, shader): (&str, &Variant), constants: &[(u32, u32)]) -> gpu::Result<Self> {
        let (device, images) = (own.device, own.images());
        let Some(entry) = shader.compute() else {
            return Err(gpu::Error::Unsupported(format!("{name}.wgsl has no compute entry")));
        };
        let bindings: Vec<_> = images.iter().map(|image| binding(image.0, image.3, COMPUTE)).collect();
        let set_layout = SetLayout::new(device, name, &bindings)?;
        let layout = pipeline_layout(device, name, &[own.layouts.frame, set_layout.raw], &[])?;
        let stage = ShaderStage { spirv: entry.spirv.words(), entry: entry.name, stage: COMPUTE, constants };
        let pipeline = compute_pipeline(device, name, &stage, layout.raw)?;
        let (pool, set) = bound(device, name, &set_layout, &images)?;
        let [across, down, _] = entry.workgroup_size;
        Ok(Self { name: name.to_owned(), group: [across, down], layout, pipeline, set_layout, pool, set })
    }

    /// Dispatches an invocation for each of `size` texels. Runs outside any render pass.
    pub fn dispatch(&self, context: &FrameContext, size: [u32; 2]) {
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let [across, down] = std::array::from_fn(|axis| size[axis].div_ceil(self.group[axis]));
        // SAFETY: `cmd` is being recorded outside a render pass; the sets match the layout, and the pass owns its own and outlives the submission.
        // The shader looks at no texel outside its images.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[context.frame_set, self.set], &[]);
            raw.cmd_dispatch(cmd, across, down, 1);
        }
    }
}

impl PassRecorder for PerPixelPass {
    /// Dispatches an invocation for every pixel.
    fn record(&self, context: &FrameContext) {
        self.dispatch(context, context.size);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        (self.pool, self.set) = bound(own.device, &self.name, &self.set_layout, &own.images())?;
        Ok(())
    }
}

/// The set with all that is read and written.
fn bound(
    device: &Arc<Device>,
    name: &str,
    layout: &SetLayout,
    images: &[ImageBinding],
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let kinds: Vec<_> = images.iter().map(|image| (image.3, 1)).collect();
    let pool = DescriptorPool::new(device, name, 1, &kinds)?;
    let set = pool.allocate(name, layout.raw)?;
    let mut writer = SetWriter::new();
    for &(binding, view, layout, kind) in images {
        writer = match kind {
            vk::DescriptorType::STORAGE_IMAGE => writer.storage_image(binding, view, layout),
            _ => writer.sampled_image(binding, view, layout),
        };
    }
    writer.update(device, set);
    Ok((pool, set))
}
