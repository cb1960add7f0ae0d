//! PREFILTER: the light that surfaces collect of the sky, once when it is uploaded and not in frames: the reflections in lobes by their roughness,
//! the diffuse light of lambert surfaces, and the table of the split sum.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::{Endpoint, compute_stage};
use crate::gpu::sync::{Dependency, Layouts, SyncVersion, Use};
use crate::gpu::{
    self, CommandBuffer, DescriptorPool, Device, Image, Owned, SetLayout, SetWriter, barrier, binding,
    compute_pipeline, pipeline_layout,
};
use crate::gpu_scene::{BASE_EDGE, LOBE_EDGE, LOBE_LEVELS, SkyMaps, TABLE_EDGE};
use crate::plan::SkyPlan;
use crate::shaders::group_edge;
use crate::shaders::prefilter::{self as shader, Flags};

impl Endpoint {
    /// Computes the sky's diffuse and specular light when the sky is uploaded.
    pub const PREFILTER: Self = Self::beside("PREFILTER");
}

/// Samples the sky.
pub const SKY_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_SAMPLED_READ);
/// Writes the light that is collected of it.
pub const LIGHT_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_STORAGE_WRITE);

/// The edge of the level that BASE reads: its texels are 2.8 degrees wide.
const SOURCE_EDGE: u32 = 32;
/// Directions of the table's sums, and invocations of a work group along an edge.
const TABLE_SAMPLES: u32 = 1024;
const GROUP: u32 = group_edge(shader::WORKGROUP_SIZE);

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;

/// The rows that order it.
#[derive(Debug, Clone, Copy)]
pub struct PrefilterOrder {
    pub begin: Dependency,
    pub readable: Dependency,
    /// The layouts of the images.
    pub layouts: Layouts,
    /// The API by which it is recorded.
    pub sync: SyncVersion,
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct PrefilterPush {
    edge: u32,
    roughness: f32,
    samples: u32,
    source_edge: f32,
    level: u32,
}

const _: () = {
    use crate::shaders::prefilter::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<PrefilterPush>() == wgsl::SIZE);
    assert!(offset_of!(PrefilterPush, edge) == wgsl::EDGE);
    assert!(offset_of!(PrefilterPush, roughness) == wgsl::ROUGHNESS);
    assert!(offset_of!(PrefilterPush, samples) == wgsl::SAMPLES);
    assert!(offset_of!(PrefilterPush, source_edge) == wgsl::SOURCE_EDGE);
    assert!(offset_of!(PrefilterPush, level) == wgsl::LEVEL);
};

/// One of its three programs.
struct PrefilterProgram {
    set_layout: SetLayout,
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
}

/// A dispatch over the layers of an image, from the sky as a program sees it.
struct PrefilterDispatch<'a> {
    program: &'a PrefilterProgram,
    source: Option<vk::ImageView>,
    output: vk::ImageView,
    layers: u32,
    push: PrefilterPush,
}

/// Fills the maps of the sky's light, in a separate submission; does not wait for it.
///
/// # Errors
/// When there is no memory for it, or the device is lost.
pub fn submit(device: &Arc<Device>, sky: &SkyMaps, plan: &SkyPlan, order: PrefilterOrder) -> gpu::Result<()> {
    let Some(light) = &sky.light else { return Ok(()) };
    let [lobe, base, table] = [Flags::LOBE, Flags::BASE, Flags::NONE].map(|flags| PrefilterProgram::new(device, flags));
    let (lobe, base, table) = (lobe?, base?, table?);
    let levels = levels(&light.lobe)?;
    let source_edge = plan.edge.min(SOURCE_EDGE);
    let mut works = Vec::new();
    for (view, level) in levels.iter().zip(0..) {
        let roughness = level as f32 / (LOBE_LEVELS - 1) as f32;
        let push = PrefilterPush {
            edge: LOBE_EDGE >> level,
            roughness,
            samples: plan.samples,
            source_edge: plan.edge as f32,
            level: 0,
        };
        works.push(PrefilterDispatch {
            program: &lobe,
            source: Some(sky.cube_view.raw),
            output: view.raw,
            layers: 6,
            push,
        });
    }
    let push = PrefilterPush {
        edge: BASE_EDGE,
        roughness: 0.0,
        samples: 0,
        source_edge: source_edge as f32,
        level: (plan.edge / source_edge).ilog2(),
    };
    works.push(PrefilterDispatch {
        program: &base,
        source: Some(sky.cube.view),
        output: light.base.view,
        layers: 6,
        push,
    });
    let array = light.table.array_view()?;
    let push = PrefilterPush { edge: TABLE_EDGE, roughness: 0.0, samples: TABLE_SAMPLES, source_edge: 0.0, level: 0 };
    works.push(PrefilterDispatch { program: &table, source: None, output: array.raw, layers: 1, push });

    let kinds = [vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::SAMPLER, vk::DescriptorType::STORAGE_IMAGE];
    let count = works.len() as u32;
    let pool = DescriptorPool::new(device, "prefilter", count, &kinds.map(|kind| (kind, count)))?;
    let mut cmd = CommandBuffer::new(device, "prefilter sky")?;
    cmd.begin_by(order.sync)?;
    device.begin_label(cmd.raw, "PREFILTER");
    let general = vk::ImageLayout::GENERAL;
    let readable = order.layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    let images = [&light.lobe, &light.base, &light.table];
    for image in images {
        // It is new: its layout changes before the write.
        barrier::image_barrier(device, cmd.raw, image, order.begin, [vk::ImageLayout::UNDEFINED, general]);
    }
    for work in &works {
        work.record(device, (&pool, readable), sky, cmd.raw)?;
    }
    for image in images {
        // Surfaces sample the results.
        barrier::image_barrier(device, cmd.raw, image, order.readable, [general, readable]);
    }
    device.end_label(cmd.raw);
    cmd.end()?;
    device.submit(&cmd)?;
    Ok(())
}

/// A view of each level of the mirrored sky, to store to.
fn levels(lobe: &Image) -> gpu::Result<Vec<Owned<vk::ImageView>>> {
    let level = |base_mip_level| {
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level,
            level_count: 1,
            base_array_layer: 0,
            layer_count: lobe.layers,
        };
        lobe.view_of(&format!("{} level {base_mip_level}", lobe.name), vk::ImageViewType::TYPE_2D_ARRAY, range)
    };
    (0..lobe.mip_levels).map(level).collect()
}

impl PrefilterProgram {
    fn new(device: &Arc<Device>, flags: Flags) -> gpu::Result<Self> {
        let mut bindings = vec![binding(2, vk::DescriptorType::STORAGE_IMAGE, COMPUTE)];
        if flags != Flags::NONE {
            bindings.push(binding(0, vk::DescriptorType::SAMPLED_IMAGE, COMPUTE));
        }
        if flags == Flags::LOBE {
            bindings.push(binding(1, vk::DescriptorType::SAMPLER, COMPUTE));
        }
        let name = format!("prefilter {flags:?}");
        let set_layout = SetLayout::new(device, &name, &bindings)?;
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: size_of::<PrefilterPush>() as u32 };
        let layout = pipeline_layout(device, &name, &[set_layout.raw], &[range])?;
        let stage = compute_stage("prefilter", shader::variant, flags, &[])?;
        let pipeline = compute_pipeline(device, &name, &stage, layout.raw)?;
        Ok(Self { set_layout, layout, pipeline })
    }
}

impl PrefilterDispatch<'_> {
    fn record(
        &self,
        device: &Arc<Device>,
        (pool, readable): (&DescriptorPool, vk::ImageLayout),
        sky: &SkyMaps,
        cmd: vk::CommandBuffer,
    ) -> gpu::Result<()> {
        let set = pool.allocate("prefilter", self.program.set_layout.raw)?;
        let mut writer = SetWriter::new().storage_image(2, self.output, vk::ImageLayout::GENERAL);
        if let Some(source) = self.source {
            writer = writer.sampled_image(0, source, readable);
            if source == sky.cube_view.raw {
                writer = writer.sampler(1, sky.sampler.raw);
            }
        }
        writer.update(device, set);
        let (raw, point) = (&device.raw, vk::PipelineBindPoint::COMPUTE);
        let groups = self.push.edge.div_ceil(GROUP);
        // SAFETY: `cmd` is being recorded outside a render pass; set and push constants are those of the layout. Objects that are dropped before the
        // submission is done are kept by the retire queue until then.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.program.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.program.layout.raw, 0, &[set], &[]);
            raw.cmd_push_constants(cmd, self.program.layout.raw, COMPUTE, 0, bytemuck::bytes_of(&self.push));
            raw.cmd_dispatch(cmd, groups, groups, self.layers);
        }
        Ok(())
    }
}
