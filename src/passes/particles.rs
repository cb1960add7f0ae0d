//! PARTICLES: discs or squares that face the view, over the lit picture and its transparent surfaces, in TRANSPARENT's subpass after that.

use std::sync::Arc;

use ash::vk;

use super::blending::{blend, limits, targets};
use super::screen::{InputDescriptor, InputSet, stages};
use super::{
    Endpoint, FrameContext, INPUT_READ, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, Slot, air,
    frame_data, needed,
};
use crate::gpu::{
    self, Buffer, DepthState, DescriptorPool, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, SetLayout,
    SetWriter, binding, pipeline_layout, sync::Use,
};
use crate::gpu_scene::{Sheets, TEXTURE_READ};
use crate::plan::{FramePlan, PARTICLES, ParticlePlan, Target, ToneMapping};
use crate::scene::emitter::MOST_TEXTURES;
use crate::shaders::particles::{self as shader, Flags, constants};

/// Reads what SIMULATE and SORT wrote: vertices where it lies, and fragments how it looks.
pub const STATE_READ: Use =
    Use::new(vk::PipelineStageFlags2::VERTEX_SHADER, vk::AccessFlags2::SHADER_READ).or(LAST_READ);
/// Reads it last.
pub const LAST_READ: Use = Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads the pixel's depth, to fade particles out close to the surface.
pub const DEPTH_READ: Use = INPUT_READ;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("PARTICLES"),
    time: "particles",
    what: "particles, over what is behind them",
    presence: |plan| Presence::of(plan.effects.particles.as_ref(), "no particles are drawn"),
    touches: |plan| {
        let mut touches = targets(plan);
        touches.push(ResourceUse::input(0, Target::Depth, DEPTH_READ).because("reads depth, to fade near surfaces"));
        touches.extend([
            frame_data(),
            ResourceUse::resource(Resource::Buffers(PARTICLES), STATE_READ)
                .because("fetches particles in the order in which SORT left them"),
        ]);
        touches.extend(air::touch(plan));
        if plan.effects.particles.as_ref().is_some_and(|own| !own.textures.is_empty()) {
            touches.push(ResourceUse::resource(Resource::Textures, TEXTURE_READ));
        }
        touches
    },
    leave_out: Some(|settings| settings.particles = false),
    make: Some(|own| {
        let planned = own.needed(own.plan.effects.particles.as_ref())?;
        let (buffers, textures) = (own.buffers(Resource::Buffers(PARTICLES)), own.scene.sheets.as_ref());
        let place = (own.slot()?, own.layouts.frame);
        Ok(Box::new(ParticlePass::new(own.device, (own.plan, planned), place, (buffers, textures), &own.inputs())?))
    }),
};

pub struct ParticlePass {
    pub inputs: InputSet,
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    set: vk::DescriptorSet,
    counts: bool,
    /// Vertices of each.
    corners: u32,
    _set_layout: SetLayout,
    _pool: DescriptorPool,
}

impl ParticlePass {
    /// `inputs` are depth alone.
    fn new<'a>(
        device: &Arc<Device>,
        (plan, planned): (&FramePlan, &ParticlePlan),
        (slot, frame_layout): (&Slot, vk::DescriptorSetLayout),
        (buffers, textures): (impl Iterator<Item = &'a Buffer>, Option<&Sheets>),
        inputs: &[InputDescriptor],
    ) -> gpu::Result<Self> {
        let inputs = InputSet::new(device, "depth behind particles", inputs)?;
        let (set_layout, pool, set) =
            described(device, buffers, textures, plan.layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL))?;
        let layout = pipeline_layout(device, "particles", &[frame_layout, inputs.set_layout.raw, set_layout.raw], &[])?;
        let variant = needed("particles", shader::variant, flags(plan))?;
        let own = limits(plan);
        let constants = [
            (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
            (constants::COUNTS, u32::from(planned.counts)),
            (constants::LAYER, layer(plan).to_bits()),
            (constants::WEIGHT, own.weight.to_bits()),
            (constants::LEAST, own.least.to_bits()),
            (constants::PEAK, own.peak.to_bits()),
            (constants::LARGEST, plan.largest_light().to_bits()),
        ];
        let constants: Vec<_> = constants.into_iter().chain(air::air_constants!(plan, true)).collect();
        let pipeline = GraphicsPipeline::new(
            device,
            &GraphicsPipelineDesc {
                name: "particles",
                stages: &stages(variant, &constants),
                vertex_bindings: &[],
                vertex_attributes: &[],
                cull_mode: vk::CullModeFlags::NONE,
                front_face: vk::FrontFace::COUNTER_CLOCKWISE,
                // Reversed Z. A particle at the far end of an orthographic range passes where nothing is drawn.
                depth: Some(DepthState { test: vk::CompareOp::GREATER_OR_EQUAL, write: false }),
                depth_bias: false,
                depth_clamp: false,
                // Where layers are counted, alpha is 1 where the picture is covered, and 0 where a layer is added.
                blend: &blend(plan),
                samples: plan.sample_count(),
                layout: layout.raw,
                place: slot,
            },
        )?;
        // As in the shader: two triangles of a square, or one around a disc.
        let corners = if textures.is_some() { 6 } else { 3 };
        let counts = planned.counts;
        Ok(Self { inputs, layout, pipeline, set, counts, corners, _set_layout: set_layout, _pool: pool })
    }
}

impl PassRecorder for ParticlePass {
    /// Draws the living particles. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        let count = context.visible.emitters.count + u32::from(self.counts);
        if count == 0 {
            return;
        }
        context.set_area();
        context.bind_pipeline(self.pipeline.raw);
        for (index, set) in [context.frame_set, self.inputs.set, self.set].into_iter().enumerate() {
            context.bind_set(self.layout.raw, index as u32, set);
        }
        // SAFETY: pipeline and sets are bound; the vertex stage makes the corners of each particle from their index, and SIMULATE has written so many.
        unsafe { context.device.raw.cmd_draw(context.cmd, self.corners * count, 1, 0, 0) };
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())
    }
}

/// Binding of the particles; their order has the next binding.
const STATES: u32 = 0;

/// The value that each layer adds when layers are counted: 1 in a linear picture, otherwise 1/64 of white.
fn layer(plan: &FramePlan) -> f32 {
    match plan.tone_mapping {
        ToneMapping::AfterFrames(_) | ToneMapping::Absent => 1.0,
        _ => 1.0 / 64.0,
    }
}

/// The set with particles, their order and their textures.
fn described<'a>(
    device: &Arc<Device>,
    buffers: impl Iterator<Item = &'a Buffer>,
    textures: Option<&Sheets>,
    readable: vk::ImageLayout,
) -> gpu::Result<(SetLayout, DescriptorPool, vk::DescriptorSet)> {
    const IMAGE: vk::DescriptorType = vk::DescriptorType::SAMPLED_IMAGE;
    const STORAGE: vk::DescriptorType = vk::DescriptorType::STORAGE_BUFFER;
    let (vertex, fragment) = (vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT);
    // The particles, and their keys where they are sorted.
    let storage: Vec<_> = (STATES..).zip(buffers).collect();
    let images: Vec<_> = (2..).zip(textures.into_iter().flat_map(views)).collect();
    let sampler = 2 + images.len() as u32;
    let bindings: Vec<_> = storage
        .iter()
        .map(|&(index, _)| binding(index, STORAGE, if index == STATES { vertex | fragment } else { vertex }))
        .chain(images.iter().map(|&(index, _)| binding(index, IMAGE, fragment)))
        .chain(textures.map(|_| binding(sampler, vk::DescriptorType::SAMPLER, fragment)))
        .collect();
    let layout = SetLayout::new(device, "particles", &bindings)?;
    let mut kinds = vec![(STORAGE, storage.len() as u32)];
    if textures.is_some() {
        kinds.extend([(IMAGE, images.len() as u32), (vk::DescriptorType::SAMPLER, 1)]);
    }
    let pool = DescriptorPool::new(device, "particles", 1, &kinds)?;
    let set = pool.allocate("particles", layout.raw)?;
    let mut writer = SetWriter::new();
    for (index, buffer) in storage {
        writer = writer.storage_buffer(index, buffer, buffer.size);
    }
    for (index, view) in images {
        writer = writer.sampled_image(index, view, readable);
    }
    if let Some(textures) = textures {
        writer = writer.sampler(sampler, textures.sampler.raw);
    }
    writer.update(device, set);
    Ok((layout, pool, set))
}

/// A texture for each binding of the shader; missing ones repeat the last.
fn views(textures: &Sheets) -> Vec<vk::ImageView> {
    let own: Vec<_> = textures.views().collect();
    own.iter().chain(std::iter::repeat_with(|| &own[own.len() - 1])).take(MOST_TEXTURES).copied().collect()
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    let textured = plan.effects.particles.as_ref().is_some_and(|own| !own.textures.is_empty());
    Flags::TEXTURED.when(textured)
        | Flags::WEIGHTED.when(plan.sums.is_some())
        | Flags::SORTED.when(plan.sorts_particles())
        | Flags::LIGHTS.when(air::is_lit(plan))
}
