//! TILED: every light on every pixel by compute, tile by tile, from a stored G-buffer into the output, or from the numbers of the triangles that pixels show.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::background::{background, exposed_background};
use super::curves::encode_srgb;
use super::spirv::with_lengths;
use super::{
    Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, SetLayouts, frame_data,
    gbuffer_inputs, light_maps,
};
use crate::gpu::{
    self, DescriptorPool, Device, Owned, SetLayout, SetWriter, ShaderStage, binding, compute_pipeline, pipeline_layout,
    sync::Use,
};
use crate::gpu_scene::VisibilityLookup;
use crate::plan::{FramePlan, HDR, OUTPUT_PLAIN, Shading, Target, ToneMapping};
use crate::scene::TextureSlot;
use crate::shaders::tiled::{self as shader, Flags, constants};
use crate::shaders::{group_edge, shared};
use crate::visible::World;

/// Reads the stored G-buffer.
pub const GBUFFER_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes every pixel of the output.
pub const OUTPUT_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);
/// Looks up vertices, indices and textures of a pixel's surface, if there is no G-buffer.
pub use crate::gpu_scene::LOOK_UP;
/// Loads from the shadow map.
pub const MAP_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);

/// Bindings of emissive light and of the output, after the G-buffer's bindings (`shaders/tiled.wgsl`).
pub const EMISSIVE: u32 = 6;
const OUTPUT: u32 = 7;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("TILED"),
    time: "lighting",
    what: "every light on every pixel, tile by tile, in a compute shader",
    presence: |plan| {
        let why = match plan.triangles {
            Some(_) => "a compute pass looks up what each pixel shows, and lights it",
            None => "a compute pass lights the stored G-buffer",
        };
        Presence::when(plan.is_tiled(), why, "the light path has no compute pass")
    },
    touches: |plan| {
        let stored = stored_inputs(plan).into_iter().map(|(binding, target)| {
            ResourceUse::sampled(binding, target, GBUFFER_READ).because("reads what GEOMETRY stored of its tile")
        });
        let others = [
            ResourceUse::storage(OUTPUT, Target::Output, OUTPUT_WRITE).because("writes every pixel of the picture"),
            frame_data(),
        ];
        stored.chain(others).chain(light_maps(plan, MAP_READ)).chain(looked_up(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| {
        let (stored, output) = (own.inputs(), own.targets.image(Target::Output).view);
        let background = Background::of(own.plan, own.world);
        Ok(Box::new(TiledPass::new(own.device, own.plan, own.layouts, own.seen, (&stored, output), background)?))
    }),
};

/// The meshes and textures of visible surfaces, if there is no G-buffer.
fn looked_up(plan: &FramePlan) -> impl Iterator<Item = ResourceUse> {
    let (is_any, uploads) = (plan.triangles.is_some(), plan.uploads);
    [
        (uploads.vertices, ResourceUse::resource(Resource::Vertices, LOOK_UP)),
        (uploads.vertices, ResourceUse::resource(Resource::Indices, LOOK_UP)),
        (uploads.textures, ResourceUse::resource(Resource::Textures, LOOK_UP)),
    ]
    .into_iter()
    .filter_map(move |(is_in, touch)| (is_any && is_in).then_some(touch))
}

/// Returns the targets that it reads, by binding of `shaders/shared/gbuffer.wgsl`: as LIGHTING does, depth in any case, and emitted light; or depth
/// and the triangles alone.
pub fn stored_inputs(plan: &FramePlan) -> Vec<(u32, Target)> {
    if plan.triangles.is_some() {
        return vec![(0, Target::Depth), (1, Target::Triangle)];
    }
    let others = gbuffer_inputs(plan).into_iter().filter(|&(_, target)| target != Target::Depth);
    let emitted = plan.emissive.then_some((EMISSIVE, Target::Hdr));
    [(0, Target::Depth)].into_iter().chain(others).chain(emitted).collect()
}

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;

/// Edge of a tile in pixels.
const TILE: u32 = shared::tile::TILE;
const _: () = assert!(TILE == group_edge(shader::WORKGROUP_SIZE));

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TiledPush {
    background: Vec3,
    padding: u32,
    sample_background: Vec3,
}

const _: () = {
    assert!(std::mem::offset_of!(TiledPush, background) == shader::push::BACKGROUND);
    assert!(std::mem::offset_of!(TiledPush, sample_background) == shader::push::SAMPLE_BACKGROUND);
    assert!(size_of::<TiledPush>() <= shader::push::SIZE);
};

/// The light where nothing is seen.
#[derive(Debug, Clone, Copy)]
pub struct Background {
    /// The light of a pixel, as the output has it.
    pub of_pixel: Vec3,
    /// The light of one of several samples, as they are averaged.
    pub of_sample: Vec3,
}

impl Background {
    /// As a shader writes it: an attachment's clear value would be encoded by the hardware.
    fn of(plan: &FramePlan, world: &World) -> Self {
        let light = background(plan, world, Target::Output);
        let encoded = plan.output == OUTPUT_PLAIN;
        Self {
            of_pixel: if encoded { light.map(|v| encode_srgb(f64::from(v)) as f32) } else { light },
            of_sample: if plan.averages_light() { exposed_background(plan, world) } else { light },
        }
    }
}

pub struct TiledPass {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    set_layout: SetLayout,
    /// In the place of the shadow maps' set, where only the one after it exists.
    _empty: Option<SetLayout>,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
    background: Background,
}

/// A stored target as a descriptor: its binding, view and layout.
pub type StoredTarget = (u32, vk::ImageView, vk::ImageLayout);

impl TiledPass {
    /// `stored` are the views of the G-buffer, and `output` is the picture's view.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        layouts: SetLayouts,
        seen: Option<&VisibilityLookup>,
        (stored, output): (&[StoredTarget], vk::ImageView),
        background: Background,
    ) -> gpu::Result<Self> {
        let mut bindings: Vec<_> =
            stored.iter().map(|&(index, ..)| binding(index, vk::DescriptorType::SAMPLED_IMAGE, COMPUTE)).collect();
        bindings.push(binding(OUTPUT, vk::DescriptorType::STORAGE_IMAGE, COMPUTE));
        let set_layout = SetLayout::new(device, "tiled inputs", &bindings)?;
        let (pool, set) = bound(device, &set_layout, stored, output)?;

        let flags = flags(plan);
        let entry = shader::variant(flags).and_then(|variant| variant.compute());
        let Some(entry) = entry else {
            return Err(gpu::Error::Unsupported(format!("tiled.wgsl has no variant {flags:?}")));
        };
        let empty = match (layouts.shadows, seen) {
            (None, Some(_)) => Some(SetLayout::new(device, "no shadow maps", &[])?),
            _ => None,
        };
        let mut sets = vec![layouts.frame, set_layout.raw];
        sets.extend(layouts.shadows.or(empty.as_ref().map(|empty| empty.raw)));
        sets.extend(seen.map(|seen| seen.set_layout.raw));
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: shader::push::SIZE as u32 };
        let layout = pipeline_layout(device, "tiled", &sets, &[range])?;
        let constants = constants_of(plan);
        let sized = seen.filter(|seen| seen.textures > 0);
        let sized = sized.map(|seen| with_lengths(entry.spirv.words(), [seen.textures, seen.samplers]));
        let spirv = sized.as_deref().unwrap_or(entry.spirv.words());
        let stage = ShaderStage { spirv, entry: entry.name, stage: COMPUTE, constants: &constants };
        let pipeline = compute_pipeline(device, "tiled", &stage, layout.raw)?;
        Ok(Self { layout, pipeline, set_layout, _empty: empty, pool, set, background })
    }
}

impl PassRecorder for TiledPass {
    /// Lights the picture. Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let (raw, cmd) = (&context.device.raw, context.cmd);
        let point = vk::PipelineBindPoint::COMPUTE;
        let mut sets = vec![context.frame_set, self.set];
        sets.extend(context.shadow_set);
        let mut push = [0u8; shader::push::SIZE];
        let Background { of_pixel, of_sample } = self.background;
        let background = TiledPush { background: of_pixel, padding: 0, sample_background: of_sample };
        push[..size_of::<TiledPush>()].copy_from_slice(bytemuck::bytes_of(&background));
        let groups = context.size.map(|edge| edge.div_ceil(TILE));
        // SAFETY: `cmd` is being recorded outside a render pass; sets and push constants are those of the layout, and the pass owns
        // all of them and outlives the submission.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &sets, &[]);
            if let Some(seen) = context.seen_set {
                raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, SEEN_SET, &[seen], &[]);
            }
            raw.cmd_push_constants(cmd, self.layout.raw, COMPUTE, 0, &push);
            raw.cmd_dispatch(cmd, groups[0], groups[1], 1);
        }
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        let output = own.targets.image(Target::Output).view;
        (self.pool, self.set) = bound(own.device, &self.set_layout, &own.inputs(), output)?;
        Ok(())
    }

    fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.background = Background::of(plan, world);
    }
}

/// The set of `shaders/shared/seen.wgsl`.
const SEEN_SET: u32 = 3;

/// The set with all that is read and written.
fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    stored: &[StoredTarget],
    output: vk::ImageView,
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let kinds = [(vk::DescriptorType::SAMPLED_IMAGE, stored.len() as u32), (vk::DescriptorType::STORAGE_IMAGE, 1)];
    let pool = DescriptorPool::new(device, "tiled inputs", 1, &kinds)?;
    let set = pool.allocate("tiled inputs", layout.raw)?;
    let writer = stored
        .iter()
        .fold(SetWriter::new(), |writer, &(index, view, layout)| writer.sampled_image(index, view, layout));
    writer.storage_image(OUTPUT, output, vk::ImageLayout::GENERAL).update(device, set);
    Ok((pool, set))
}

/// Returns the shader variant of a plan.
pub fn flags(plan: &FramePlan) -> Flags {
    Flags::UNIFORM_BUFFER.when(plan.lights.uniform)
        | Flags::SHADOW.when(plan.has_light_maps())
        | gbuffer_flags!(plan)
        | Flags::EMISSIVE.when(plan.emissive)
        | Flags::MSAA.when(plan.msaa > 1)
        | Flags::VISIBILITY.when(plan.triangles.is_some())
        | Flags::TEXTURED.when(plan.triangles.is_some() && plan.keys().any(|key| !key.textures.is_empty()))
        | Flags::LINEAR_OUTPUT.when(plan.output == vk::Format::R32G32B32A32_SFLOAT)
        | Flags::HALF_OUTPUT.when(plan.output == HDR)
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let (tone_map, curve) = match plan.tone_mapping {
        ToneMapping::InLighting(curve) => (1, curve as u32),
        _ => (0, 0),
    };
    let own = [
        (constants::AMBIENT, u32::from(plan.lights.ambient)),
        (constants::DIRECTIONAL, u32::from(plan.lights.directional)),
        (constants::UNBOUNDED, u32::from(plan.lights.unbounded)),
        (constants::BOUNDED, u32::from(plan.lights.bounded)),
        (constants::DIRECTIONAL_SHADOWS, u32::from(plan.has_directional_shadows())),
        (constants::TONE_MAP, tone_map),
        (constants::OPERATOR, curve),
        (constants::HEADROOM, plan.headroom().to_bits()),
        (constants::SWAPPED, u32::from(plan.swaps_red_and_blue)),
        (constants::SAMPLES, plan.msaa),
        (constants::LINEAR, u32::from(plan.averages_light())),
    ];
    let seen = [
        (constants::TRIANGLE_BITS, plan.triangles.map_or(0, |code| code.bits)),
        (constants::EXTRAS, u32::from(plan.keys().any(|key| key.extras.any()))),
        (constants::NORMAL_MAPS, u32::from(plan.keys().any(|key| key.textures.contains(TextureSlot::Normal)))),
        (constants::FOOTPRINT, plan.footprint.to_bits()),
        (constants::PLACES, plan.places_of_shaders()),
    ];
    let seen = if plan.triangles.is_some() { &seen[..] } else { &[] };
    [&light_constants!(plan)[..], &own, seen].concat()
}
