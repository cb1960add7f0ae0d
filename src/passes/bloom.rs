//! BLOOM and SPREAD: light that spreads around its source, by ever coarser levels. BLOOM takes the picture's light to half its size. SPREAD goes on
//! to the widest level, and back up again, where each level takes its share of the wider ones' light. TONEMAP takes the picture's share of the first
//! level.
//!
//! The levels are in single floats. Half floats would be enough for the eye, but a driver may truncate when it packs them, and a loss of 2^-11 at
//! each step down and up exceeds the allowed change of energy. Single bright pixels are not weighted down as in Karis's average: that would lose
//! energy, and here a bright pixel spreads like any other.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::{
    Endpoint, FrameContext, InputDescriptor, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, compute_stage,
};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Location, MemoryKind, Owned, SetLayout, SetWriter, binding, compute_pipeline,
    pipeline_layout, sync::Use,
};
use crate::plan::{BLOOM_LEVELS, BloomLevel, BloomPlan as Planned, FramePlan, Target};
use crate::shaders::bloom::{self as shader, Flags, constants};
use crate::shaders::group_edge;

/// Reads the light of the picture.
pub const HDR_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads a level that an earlier step wrote.
pub const LEVEL_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes a level.
pub const LEVEL_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("BLOOM"),
    time: "bloom",
    what: "the picture's light at half its size",
    presence,
    touches: |_| {
        let levels =
            ResourceUse::resource(Resource::Buffers(BLOOM_LEVELS), LEVEL_WRITE).because("writes the first level");
        vec![
            ResourceUse::sampled(PICTURE, Target::Hdr, HDR_READ)
                .because("loads the light of a pixel and its neighbours"),
            levels,
        ]
    },
    leave_out: None,
    make: Some(|own| {
        let planned = own.needed(own.plan.effects.bloom)?;
        let levels = buffer(own.device, own.plan, &planned)?;
        let steps = Steps::new(own, (planned, &[BloomStage::First]), (&levels, &own.inputs()))?;
        Ok(Box::new(BloomPass { levels, steps }))
    }),
};

/// The other steps.
pub const SPREAD: Pass = Pass {
    name: Endpoint::pass("SPREAD"),
    time: "spread",
    what: "spreads light, down to wider levels and up again",
    presence,
    touches: |_| {
        vec![
            ResourceUse::resource(Resource::Buffers(BLOOM_LEVELS), LEVEL_READ.or(LEVEL_WRITE))
                .because("reads the level that the step before wrote, and writes another"),
        ]
    },
    leave_out: Some(|settings| settings.bloom = 0.0),
    make: Some(|own| {
        let (planned, levels) = (own.needed(own.plan.effects.bloom)?, own.buffer(Resource::Buffers(BLOOM_LEVELS))?);
        Ok(Box::new(SpreadPass(Steps::new(own, (planned, &[BloomStage::Down, BloomStage::Up]), (levels, &[]))?)))
    }),
};

fn presence(plan: &FramePlan) -> Presence {
    Presence::when(plan.effects.bloom.is_some(), "asked for", plan.reasons.lack_of("bloom"))
}

const LEVELS: u32 = 0;
const PICTURE: u32 = 1;
const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;
/// Edge of a work group in texels.
const GROUP: u32 = group_edge(shader::WORKGROUP_SIZE);

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct BloomPush {
    picture: [u32; 2],
    level: u32,
    finer_at: u32,
    wider_at: u32,
    share: f32,
}

const _: () = {
    use std::mem::offset_of;
    assert!(size_of::<BloomPush>() == shader::push::SIZE);
    assert!(
        offset_of!(BloomPush, picture) == shader::push::PICTURE && offset_of!(BloomPush, level) == shader::push::LEVEL
    );
    assert!(
        offset_of!(BloomPush, finer_at) == shader::push::FINER_AT
            && offset_of!(BloomPush, wider_at) == shader::push::WIDER_AT
    );
    assert!(offset_of!(BloomPush, share) == shader::push::SHARE);
};

/// BLOOM's step, and the levels that it writes.
struct BloomPass {
    levels: Buffer,
    steps: Steps,
}

/// The steps of SPREAD.
struct SpreadPass(Steps);

/// Dispatches over levels, with the buffer and the picture that they read.
struct Steps {
    planned: Planned,
    all: Vec<BloomDispatch>,
    layout: Owned<vk::PipelineLayout>,
    /// A pipeline for each kind of step.
    pipelines: Vec<(BloomStage, Owned<vk::Pipeline>)>,
    set_layout: SetLayout,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
}

/// A dispatch: its kind, its push constants, and the texels that it writes across and down.
type BloomDispatch = (BloomStage, BloomPush, [u32; 2]);

/// The kind of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BloomStage {
    First,
    Down,
    Up,
}

impl PassRecorder for BloomPass {
    fn record(&self, context: &FrameContext) {
        self.steps.record(context);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.levels = buffer(own.device, own.plan, &self.steps.planned)?;
        self.steps.rebind(own, &self.levels, &own.inputs())
    }

    fn buffers(&self) -> Vec<(Resource, &Buffer)> {
        vec![(Resource::Buffers(BLOOM_LEVELS), &self.levels)]
    }
}

impl PassRecorder for SpreadPass {
    fn record(&self, context: &FrameContext) {
        self.0.record(context);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.0.rebind(own, own.buffer(Resource::Buffers(BLOOM_LEVELS))?, &[])
    }
}

impl Steps {
    /// Makes the steps of these kinds. `inputs` is the picture's light for steps that read it.
    fn new(
        own: &Making,
        (planned, kinds): (Planned, &[BloomStage]),
        (levels, inputs): (&Buffer, &[InputDescriptor]),
    ) -> gpu::Result<Self> {
        let (device, plan) = (own.device, own.plan);
        let picture = inputs.iter().map(|input| binding(input.0, vk::DescriptorType::SAMPLED_IMAGE, COMPUTE));
        let bindings: Vec<_> =
            [binding(LEVELS, vk::DescriptorType::STORAGE_BUFFER, COMPUTE)].into_iter().chain(picture).collect();
        let set_layout = SetLayout::new(device, "bloom", &bindings)?;
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: shader::push::SIZE as u32 };
        let layout = pipeline_layout(device, "bloom", &[set_layout.raw], &[range])?;
        let constants = [(constants::TAPS, planned.taps), (constants::LARGEST, plan.largest_shown().to_bits())];
        let pipeline = |&kind: &BloomStage| {
            let stage = compute_stage("bloom", shader::variant, flags(plan, kind), &constants)?;
            Ok((kind, compute_pipeline(device, "bloom", &stage, layout.raw)?))
        };
        let pipelines = kinds.iter().map(pipeline).collect::<gpu::Result<Vec<_>>>()?;
        let (pool, set) = bound(device, &set_layout, levels, inputs)?;
        let mut all = steps(plan.size, &planned);
        all.retain(|(kind, ..)| kinds.contains(kind));
        Ok(Self { planned, all, layout, pipelines, set_layout, pool, set })
    }

    fn rebind(&mut self, own: &Making, levels: &Buffer, inputs: &[InputDescriptor]) -> gpu::Result<()> {
        (self.pool, self.set) = bound(own.device, &self.set_layout, levels, inputs)?;
        self.all = steps(own.plan.size, &self.planned);
        let Self { all, pipelines, .. } = self;
        all.retain(|(kind, ..)| pipelines.iter().any(|(own, _)| own == kind));
        Ok(())
    }

    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: `cmd` is being recorded outside a render pass; the set is of the layout.
        unsafe { raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[self.set], &[]) };
        for (index, (kind, push, extent)) in self.all.iter().enumerate() {
            let Some((_, pipeline)) = self.pipelines.iter().find(|(own, _)| own == kind) else { continue };
            if index > 0 {
                // A step reads the level that the step before it wrote.
                (context.between)();
            }
            // SAFETY: as above, with the set bound; the push constants are those of the layout. The pass owns all of it and outlives the submission,
            // and the buffer has room for all levels.
            unsafe {
                raw.cmd_bind_pipeline(cmd, point, pipeline.raw);
                raw.cmd_push_constants(cmd, self.layout.raw, COMPUTE, 0, bytemuck::bytes_of(push));
                raw.cmd_dispatch(cmd, extent[0].div_ceil(GROUP), extent[1].div_ceil(GROUP), 1);
            }
        }
    }
}

/// Down to each level, and up again to each but the widest; each with the texels that it writes.
fn steps(size: [u32; 2], planned: &Planned) -> Vec<BloomDispatch> {
    let (levels, shares) = (planned.levels(size), planned.shares(size));
    let push = |level: usize, share: f32| {
        // The picture is in no buffer.
        let at = |index: Option<usize>| index.and_then(|index| levels.get(index)).map_or(0, |own: &BloomLevel| own.at);
        BloomPush {
            picture: size,
            level: level as u32,
            finer_at: at(level.checked_sub(1)),
            wider_at: at(Some(level)),
            share,
        }
    };
    let first = (BloomStage::First, push(0, planned.strength * shares[0]), levels[0].extent);
    let down = (1..levels.len()).map(|level| (BloomStage::Down, push(level, 0.0), levels[level].extent));
    let up =
        (1..levels.len()).rev().map(|level| (BloomStage::Up, push(level, shares[level]), levels[level - 1].extent));
    [first].into_iter().chain(down).chain(up).collect()
}

fn buffer(device: &Arc<Device>, plan: &FramePlan, planned: &Planned) -> gpu::Result<Buffer> {
    let (size, usage) = (planned.bytes(plan.size), vk::BufferUsageFlags::STORAGE_BUFFER);
    Buffer::new(device, "levels of bloom", size, usage, Location::Device, MemoryKind::Attachment)
}

/// The set of the inputs and the output.
fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    levels: &Buffer,
    inputs: &[InputDescriptor],
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let kinds = [(vk::DescriptorType::STORAGE_BUFFER, 1), (vk::DescriptorType::SAMPLED_IMAGE, 1)];
    let pool = DescriptorPool::new(device, "bloom", 1, &kinds)?;
    let set = pool.allocate("bloom", layout.raw)?;
    let writer = SetWriter::new().storage_buffer(LEVELS, levels, levels.size);
    let all = inputs.iter().fold(writer, |writer, &(index, view, layout)| writer.sampled_image(index, view, layout));
    all.update(device, set);
    Ok((pool, set))
}

/// Returns the shader variant of a step.
fn flags(plan: &FramePlan, kind: BloomStage) -> Flags {
    match kind {
        BloomStage::First => Flags::FIRST | Flags::MSAA.when(plan.msaa > 1),
        BloomStage::Down => Flags::NONE,
        BloomStage::Up => Flags::UP,
    }
}
