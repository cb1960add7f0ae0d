//! SIMULATE: computes the position, look and light of each particle in this frame.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::{
    Endpoint, FrameContext, Pass, PassRecorder, Presence, Resource, ResourceUse, SetLayouts, compute_stage, frame_data,
    light_maps,
};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Location, MemoryKind, Owned, SetLayout, SetWriter, binding, compute_pipeline,
    pipeline_layout, sync::Use,
};
use crate::plan::{FramePlan, PARTICLES, ParticlePlan, sort_places};
use crate::shaders::simulate::{self as shader, Flags, constants};
use crate::visible::{EmitterRecord, Visible};

/// Writes what each particle looks like, and its key where they are sorted.
pub const STATE_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);
/// Looks shadow maps up.
pub const MAP_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SIMULATE"),
    time: "simulate",
    what: "particles of the moment, lit",
    presence: |plan| Presence::of(plan.effects.particles.as_ref(), "no particles are drawn"),
    touches: |plan| {
        let states = ResourceUse::resource(Resource::Buffers(PARTICLES), STATE_WRITE).because("writes states and keys");
        [frame_data(), states].into_iter().chain(light_maps(plan, MAP_READ)).collect()
    },
    leave_out: None,
    make: Some(|own| {
        let planned = own.needed(own.plan.effects.particles.as_ref())?;
        Ok(Box::new(SimulatePass::new(own.device, (own.plan, planned), own.layouts, own.in_flight)?))
    }),
};

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;
/// Particles of a work group.
const GROUP: u32 = shader::WORKGROUP_SIZE[0];

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SimulatePush {
    count: u32,
    places: u32,
    emitters: u32,
}

const _: () = {
    use shader::structs::emitter as wgsl;
    use std::mem::offset_of;
    assert!(
        size_of::<SimulatePush>() == shader::push::SIZE && offset_of!(SimulatePush, emitters) == shader::push::EMITTERS
    );
    assert!(
        offset_of!(SimulatePush, count) == shader::push::COUNT
            && offset_of!(SimulatePush, places) == shader::push::PLACES
    );
    assert!(size_of::<EmitterRecord>() == wgsl::SIZE);
    assert!(offset_of!(EmitterRecord, life) == wgsl::LIFE && offset_of!(EmitterRecord, drag) == wgsl::DRAG);
    assert!(offset_of!(EmitterRecord, velocity) == wgsl::VELOCITY && offset_of!(EmitterRecord, step) == wgsl::STEP);
    assert!(offset_of!(EmitterRecord, spread) == wgsl::SPREAD && offset_of!(EmitterRecord, age) == wgsl::AGE);
    assert!(offset_of!(EmitterRecord, extent) == wgsl::EXTENT && offset_of!(EmitterRecord, lit) == wgsl::LIT);
    assert!(offset_of!(EmitterRecord, gravity) == wgsl::GRAVITY && offset_of!(EmitterRecord, sizes) == wgsl::SIZES);
    assert!(offset_of!(EmitterRecord, softness) == wgsl::SOFTNESS && offset_of!(EmitterRecord, keys) == wgsl::KEYS);
    assert!(offset_of!(EmitterRecord, ambient) == wgsl::AMBIENT && offset_of!(EmitterRecord, place) == wgsl::PLACE);
    assert!(offset_of!(EmitterRecord, colors) == wgsl::COLORS && offset_of!(EmitterRecord, turns) == wgsl::TURNS);
    assert!(offset_of!(EmitterRecord, emissions) == wgsl::EMISSIONS);
};

/// Output of the pass, shared by all frames in flight.
struct ParticleBuffers {
    states: Buffer,
    /// The keys, if particles are sorted.
    keys: Option<Buffer>,
}

impl ParticleBuffers {
    fn new(device: &Arc<Device>, plan: &FramePlan, planned: &ParticlePlan) -> gpu::Result<Self> {
        let buffer = |name: &str, size: u64| {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(device, name, size, usage, Location::Device, MemoryKind::Geometry)
        };
        let bytes = crate::shaders::particles::structs::particle::SIZE as u64;
        Ok(Self {
            states: buffer("particles", bytes * u64::from(planned.capacity))?,
            keys: match plan.sorts_particles() {
                true => Some(buffer("order of particles", 8 * u64::from(planned.places()))?),
                false => None,
            },
        })
    }
}

/// The pass, with the emitters of each frame in flight.
pub struct SimulatePass {
    buffers: ParticleBuffers,
    emitters: Vec<Buffer>,
    sets: Vec<vk::DescriptorSet>,
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    _set_layout: SetLayout,
    _pool: DescriptorPool,
}

impl SimulatePass {
    pub fn new(
        device: &Arc<Device>,
        (plan, planned): (&FramePlan, &ParticlePlan),
        layouts: SetLayouts,
        in_flight: usize,
    ) -> gpu::Result<Self> {
        let buffers = ParticleBuffers::new(device, plan, planned)?;
        let count = if buffers.keys.is_some() { 3 } else { 2 };
        let storage = |index| binding(index, vk::DescriptorType::STORAGE_BUFFER, COMPUTE);
        let set_layout = SetLayout::new(device, "simulate", &(0..count).map(storage).collect::<Vec<_>>())?;
        let frames = in_flight as u32;
        let pool =
            DescriptorPool::new(device, "simulate", frames, &[(vk::DescriptorType::STORAGE_BUFFER, count * frames)])?;
        let emitters = (0..in_flight).map(|index| {
            let (name, bytes) = (format!("emitters of frame {index}"), size_of::<EmitterRecord>() as u64);
            let (size, usage) = (bytes * u64::from(planned.emitters), vk::BufferUsageFlags::STORAGE_BUFFER);
            Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Uniform)
        });
        let emitters = emitters.collect::<gpu::Result<Vec<_>>>()?;
        let set = |(index, emitters): (usize, &Buffer)| {
            let set = pool.allocate(&format!("simulate of frame {index}"), set_layout.raw)?;
            let all = [Some(emitters), Some(&buffers.states), buffers.keys.as_ref()];
            let writer = (0..)
                .zip(all.into_iter().flatten())
                .fold(SetWriter::new(), |writer, (index, buffer)| writer.storage_buffer(index, buffer, buffer.size));
            writer.update(device, set);
            Ok(set)
        };
        let sets = emitters.iter().enumerate().map(set).collect::<gpu::Result<_>>()?;
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: shader::push::SIZE as u32 };
        let all: Vec<_> = [layouts.frame, set_layout.raw].into_iter().chain(layouts.shadows).collect();
        let layout = pipeline_layout(device, "simulate", &all, &[range])?;
        let constants = [
            (constants::FALLOFF, plan.lights.falloff),
            (constants::TRAITS, plan.lights.traits),
            (constants::SHADOW_FILTER, plan.shadow.as_ref().map_or(0, |shadow| shadow.filter_code())),
            (constants::DIRECTIONAL_SHADOWS, u32::from(plan.has_directional_shadows())),
            (constants::PUNCTUAL_SHADOWS, u32::from(plan.has_punctual_shadows())),
            (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
            (constants::LARGEST, plan.largest_light().to_bits()),
            (constants::COUNTS, u32::from(planned.counts)),
        ];
        let stage = compute_stage("simulate", shader::variant, flags(plan), &constants)?;
        let pipeline = compute_pipeline(device, "simulate", &stage, layout.raw)?;
        Ok(Self { buffers, emitters, sets, layout, pipeline, _set_layout: set_layout, _pool: pool })
    }
}

impl PassRecorder for SimulatePass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let count = context.visible.emitters.count;
        if count == 0 {
            return;
        }
        let places = if self.buffers.keys.is_some() { sort_places(count) } else { 0 };
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let particles = &context.visible.emitters;
        let push = SimulatePush { count: particles.count, places, emitters: particles.records.len() as u32 };
        let sets: Vec<_> =
            [context.frame_set, self.sets[context.in_flight]].into_iter().chain(context.shadow_set).collect();
        let groups = particles.count.max(places).div_ceil(GROUP);
        // SAFETY: `cmd` is being recorded outside a render pass; sets and push constants are those of the layout. The pass owns the buffers and
        // outlives the submission; they have room for all particles and keys of the plan.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &sets, &[]);
            raw.cmd_push_constants(cmd, self.layout.raw, COMPUTE, 0, bytemuck::bytes_of(&push));
            raw.cmd_dispatch(cmd, groups, 1, 1);
        }
    }

    /// Writes the emitters of a frame in flight. The frame that used the buffer before must be done.
    fn write(&self, place: usize, visible: &Visible) -> gpu::Result<()> {
        let particles = &visible.emitters;
        if particles.records.is_empty() { Ok(()) } else { self.emitters[place].write(0, &particles.records) }
    }

    fn buffers(&self) -> Vec<(Resource, &Buffer)> {
        let all = [Some(&self.buffers.states), self.buffers.keys.as_ref()];
        all.into_iter().flatten().map(|buffer| (Resource::Buffers(PARTICLES), buffer)).collect()
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::LIGHTS.when(plan.lights.any())
        | Flags::SHADOW.when(plan.has_light_maps())
        | Flags::SORTED.when(plan.sorts_particles())
}
