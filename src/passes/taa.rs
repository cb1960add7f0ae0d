//! TAA: the mean of a frame and of the frames before it, over the same surfaces. Each frame leaves a history for the next one.
//!
//! Where nothing changes it is the mean, as of `samples`. Else the history is looked up at the surface's place in the frame before, is held against
//! the values around the pixel (variance clipping), and counts for nothing where something nearer hid the surface.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Mat4;

use super::{
    Endpoint, FrameContext, InputDescriptor, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, compute_stage,
};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Location, MemoryKind, Owned, SetLayout, SetWriter, binding, compute_pipeline,
    pipeline_layout, sync::Use,
};
use crate::plan::{FramePlan, TAA_MEAN, Target, VECTORS, Vectors};
use crate::shaders::group_edge;
use crate::shaders::taa::host::{FOLLOWS, LOOKS_ELSEWHERE, STILL};
use crate::shaders::taa::{self as shader, Flags, constants};
use crate::visible::Reprojection;

/// Reads light, depth and vectors, of a pixel and its neighbours.
pub const FRAME_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads the history that the frame before left.
pub const HISTORY_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes the history for the next frame.
pub const HISTORY_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

const LOOKS: &str = "looks at a pixel and its neighbours";

pub const PASS: Pass = Pass {
    name: Endpoint::pass("TAA"),
    time: "taa",
    what: "averages with what frames before saw of the same surfaces",
    presence: |plan| Presence::when(plan.averages_over_time(), "asked for", plan.reasons.lack_of("TAA")),
    touches: |plan| {
        let mut touches = vec![
            ResourceUse::sampled(LIGHT, Target::Hdr, FRAME_READ).because(LOOKS),
            ResourceUse::sampled(DEPTH, Target::Depth, FRAME_READ).because(LOOKS),
            ResourceUse::resource(Resource::KeptBefore(TAA_MEAN), HISTORY_READ)
                .because("reads the mean that the last frame wrote"),
            ResourceUse::resource(Resource::Kept(TAA_MEAN), HISTORY_WRITE)
                .because("overwrites the mean that the last frame read"),
        ];
        touches.extend(plan.has_velocity().then(|| ResourceUse::sampled(VELOCITY, VECTORS, FRAME_READ).because(LOOKS)));
        touches
    },
    leave_out: Some(|settings| settings.taa = false),
    make: Some(|own| Ok(Box::new(TaaPass::new(own)?))),
};

const BEFORE: u32 = 0;
const AFTER: u32 = 1;
const LIGHT: u32 = 2;
const DEPTH: u32 = 3;
const VELOCITY: u32 = 4;
const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;
/// Edge of a work group in pixels.
const GROUP: u32 = group_edge(shader::WORKGROUP_SIZE);

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TaaPush {
    moved: Mat4,
    jitter: [f32; 2],
    depths: [f32; 2],
    depths_before: [f32; 2],
    flags: u32,
    exposed: f32,
}

const _: () = {
    use std::mem::offset_of;
    assert!(size_of::<TaaPush>() == shader::push::SIZE && size_of::<TaaPush>() <= 128);
    assert!(offset_of!(TaaPush, moved) == shader::push::MOVED && offset_of!(TaaPush, jitter) == shader::push::JITTER);
    assert!(offset_of!(TaaPush, depths) == shader::push::DEPTHS);
    assert!(offset_of!(TaaPush, depths_before) == shader::push::DEPTHS_BEFORE);
    assert!(offset_of!(TaaPush, flags) == shader::push::FLAGS && offset_of!(TaaPush, exposed) == shader::push::EXPOSED);
};

/// The pass, and the histories of two frames: each frame reads the other's history.
pub struct TaaPass {
    /// Histories of the frames in flight, by frame index.
    pub histories: [Buffer; 2],
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    set_layout: SetLayout,
    pool: DescriptorPool,
    sets: [vk::DescriptorSet; 2],
}

impl TaaPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let (&Making { device, plan, .. }, inputs) = (own, own.inputs());
        let planned = own.needed(plan.effects.taa.as_ref())?;
        let storage = [BEFORE, AFTER].map(|index| binding(index, vk::DescriptorType::STORAGE_BUFFER, COMPUTE));
        let images = inputs.iter().map(|input| binding(input.0, vk::DescriptorType::SAMPLED_IMAGE, COMPUTE));
        let bindings: Vec<_> = storage.into_iter().chain(images).collect();
        let set_layout = SetLayout::new(device, "taa", &bindings)?;
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: size_of::<TaaPush>() as u32 };
        let layout = pipeline_layout(device, "taa", &[set_layout.raw], &[range])?;
        let shown = match planned.shown {
            None => 0,
            Some(Vectors::Values) => 1,
            Some(Vectors::Colors) => 2,
        };
        let constants = [
            (constants::MOST_FRAMES, planned.history),
            (constants::SHOWN, shown),
            (constants::AS_SHOWN, u32::from(planned.as_shown)),
            (constants::LARGEST, plan.largest_shown().to_bits()),
            (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        ];
        let stage = compute_stage("taa", shader::variant, flags(plan), &constants)?;
        let pipeline = compute_pipeline(device, "taa", &stage, layout.raw)?;
        let histories = histories(device, plan)?;
        let (pool, sets) = bound(device, &set_layout, &histories, &inputs)?;
        Ok(Self { histories, layout, pipeline, set_layout, pool, sets })
    }
}

impl PassRecorder for TaaPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let Some(frame) = context.reprojection else { return };
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let [across, down] = context.size.map(|edge| edge.div_ceil(GROUP));
        // SAFETY: `cmd` is being recorded outside a render pass; the set and the push constants are those of the layout. The pass owns all of it and outlives
        // the submission, and the shader looks at no pixel outside the picture.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[self.sets[context.in_flight]], &[]);
            raw.cmd_push_constants(cmd, self.layout.raw, COMPUTE, 0, bytemuck::bytes_of(&push(frame)));
            raw.cmd_dispatch(cmd, across, down, 1);
        }
    }

    /// A picture of another size has no history yet.
    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.histories = histories(own.device, own.plan)?;
        (self.pool, self.sets) = bound(own.device, &self.set_layout, &self.histories, &own.inputs())?;
        Ok(())
    }

    fn buffers(&self) -> Vec<(Resource, &Buffer)> {
        let [first, second] = &self.histories;
        vec![(Resource::Kept(TAA_MEAN), first), (Resource::KeptBefore(TAA_MEAN), second)]
    }
}

fn push(frame: &Reprojection) -> TaaPush {
    let before = frame.previous.as_ref().unwrap_or(&frame.current);
    let flag = |bit, is_set| if is_set { bit } else { 0 };
    TaaPush {
        moved: before.moved_from(&frame.current),
        jitter: frame.jitter.map(|offset| offset as f32),
        depths: frame.current.depths(),
        depths_before: before.depths(),
        flags: flag(FOLLOWS, frame.previous.is_some())
            | flag(STILL, frame.still)
            | flag(LOOKS_ELSEWHERE, *before != frame.current),
        exposed: frame.exposed,
    }
}

/// A header of four words, and as many for each pixel.
fn histories(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<[Buffer; 2]> {
    let bytes = 16 + plan.history_bytes() / 2;
    let limit = u64::from(device.physical.limits.max_storage_buffer_range);
    if bytes > limit {
        return Err(gpu::Error::TooLarge { what: "the history of a frame".into(), asked: bytes, limit });
    }
    let one = |index: u32| {
        let (name, usage) = (format!("history {index}"), vk::BufferUsageFlags::STORAGE_BUFFER);
        Buffer::new(device, &name, bytes, usage, Location::Device, MemoryKind::Attachment)
    };
    Ok([one(0)?, one(1)?])
}

/// The sets of both frames.
fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    histories: &[Buffer; 2],
    inputs: &[InputDescriptor],
) -> gpu::Result<(DescriptorPool, [vk::DescriptorSet; 2])> {
    let images = 2 * inputs.len() as u32;
    let kinds = [(vk::DescriptorType::STORAGE_BUFFER, 4), (vk::DescriptorType::SAMPLED_IMAGE, images)];
    let pool = DescriptorPool::new(device, "taa", 2, &kinds)?;
    let set = |place: usize| {
        let set = pool.allocate(&format!("taa of frame {place}"), layout.raw)?;
        let [before, after] = [&histories[1 - place], &histories[place]];
        let writer =
            SetWriter::new().storage_buffer(BEFORE, before, before.size).storage_buffer(AFTER, after, after.size);
        let all =
            inputs.iter().fold(writer, |writer, &(index, view, layout)| writer.sampled_image(index, view, layout));
        all.update(device, set);
        Ok(set)
    };
    let sets = [set(0)?, set(1)?];
    Ok((pool, sets))
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::VELOCITY.when(plan.has_velocity())
}
