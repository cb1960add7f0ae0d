//! SHADOW: depth maps of lights. Each map to be drawn has a separate render pass.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::casters::{self, PUSH_STAGES, streams};
use super::spirv::with_cells;
use super::surface::textured_stages;
use super::{
    ContentsIfFirst, EARLY_DEPTH_WRITE, Endpoint, FrameContext, LATE_DEPTH_WRITE, Making, MapRecording, MeshDraws,
    Pass, PassRecorder, Presence, Resource, ResourceUse, Slot, UseKind, frame_data, meshes, needed,
};
use crate::gpu::{self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, pipeline_layout, sync::Use};
use crate::gpu_scene::HOLES;
use crate::plan::{DEPTH, Extras};
use crate::scene::{AlphaMode, CastsShadow, TextureSlot};
use crate::shaders::shadow::{self as shader, Flags, constants};
use crate::visible::{Caster, WorldObject};

/// Clears a map's square, before it is tested and drawn into.
pub const MAP_CLEAR: Use = EARLY_DEPTH_WRITE;
/// Stores it, when it is drawn.
pub const MAP_STORE: Use = LATE_DEPTH_WRITE;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SHADOW"),
    time: "shadow",
    what: "depth maps of lights, a render pass each, those in which something has moved",
    presence: |plan| match &plan.shadow {
        Some(own) if own.lights.is_empty() => Presence::In("kept on request: no light has a map".into()),
        Some(_) => Presence::In("a light casts shadows".into()),
        None => Presence::Out(plan.reasons.shadow.clone()),
    },
    touches: |plan| {
        let how = UseKind::Depth { first: ContentsIfFirst::Clear };
        let map = ResourceUse::new(Resource::SHADOW_MAPS, how, MAP_CLEAR.or(MAP_STORE))
            .because("clears and draws the maps that have changed");
        [map, frame_data()].into_iter().chain(meshes(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(ShadowPass::new(own)?))),
};

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ShadowPush {
    alpha: f32,
    alpha_cutoff: f32,
    _padding: [f32; 2],
    uv_rows: [Vec4; 2],
}

const _: () = {
    use crate::shaders::shadow::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<ShadowPush>() == wgsl::SIZE);
    assert!(offset_of!(ShadowPush, alpha) == wgsl::ALPHA);
    assert!(offset_of!(ShadowPush, alpha_cutoff) == wgsl::ALPHA_CUTOFF);
    assert!(offset_of!(ShadowPush, uv_rows) == wgsl::UV_X);
};

/// Key of the pass's pipelines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct CasterKey {
    /// The material's texture cuts holes.
    masked: bool,
    /// Vertex alpha cuts holes too, or the texture is not mapped by the first set of coordinates as it is.
    extras: Extras,
    /// Only faces that are turned to the light cast.
    front: bool,
    /// The transform swaps front and back.
    mirrored: bool,
    /// True if casters before the near plane still cast: depth is clamped.
    clamps: bool,
}

impl CasterKey {
    fn of(object: &WorldObject, clamps: bool) -> Self {
        let front = object.casts == CastsShadow::Front;
        Self {
            masked: object.cuts.texture.is_some(),
            extras: object.cuts.extras,
            front,
            // Where both sides cast, the winding of the front does not matter.
            mirrored: front && object.key.mirrored,
            clamps,
        }
    }

    /// Returns true if the pipeline needs a fragment stage.
    fn has_holes(self) -> bool {
        self.masked || self.extras.any()
    }
}

/// The pass: a pipeline for each kind of caster.
pub struct ShadowPass {
    plain_layout: Owned<vk::PipelineLayout>,
    /// Layout for casters with holes in their texture, if the scene has any.
    masked_layout: Option<Owned<vk::PipelineLayout>>,
    pipelines: BTreeMap<CasterKey, Owned<vk::Pipeline>>,
    /// Scales the slope bias, which each frame's settings give.
    bias_scale: f32,
    clamp: bool,
}

/// A layer of the maps: the drawn square is cleared, the rest of the layer stays. The map is readable between passes.
pub fn attachment() -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(DEPTH)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
}

impl ShadowPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, scene, world, .. } = own;
        let (plan, slot) = (own.needed(own.plan.shadow.as_ref())?, own.slot()?);
        let range = vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: size_of::<ShadowPush>() as u32 };
        let plain_layout = pipeline_layout(device, "shadow layout", &[], &[range])?;
        let holes = scene.materials.as_ref().and_then(|materials| materials.layout(HOLES));
        // Without holes there is no set to bind, though a material that samples its base colour has one of the same layout.
        let stops = || world.objects.iter().filter(|object| object.casts != CastsShadow::No && !object.transparent);
        let holes = holes.filter(|_| stops().any(|object| CasterKey::of(object, plan.clamp).masked));
        let layout = |holes| pipeline_layout(device, "masked shadow layout", &[holes], &[range]);
        let mut shadow = Self {
            plain_layout,
            masked_layout: holes.map(layout).transpose()?,
            pipelines: BTreeMap::new(),
            bias_scale: plan.bias_scale(),
            clamp: plan.clamp,
        };
        let forms = plan.lights.iter().map(|own| world.lights[own.light].kind.form());
        let mut clamps: BTreeSet<bool> = forms.map(|form| plan.clamp && !form.starts_at_plane()).collect();
        if clamps.is_empty() {
            clamps.insert(plan.clamp);
        }
        for object in stops() {
            for &clamps in &clamps {
                let key = CasterKey::of(object, clamps);
                let other = CasterKey { mirrored: key.front && !key.mirrored, ..key };
                for key in [Some(key), object.may_mirror.then_some(other)].into_iter().flatten() {
                    if !shadow.pipelines.contains_key(&key) {
                        let pipeline = pipeline(device, slot, key, shadow.layout(key))?;
                        shadow.pipelines.insert(key, pipeline);
                    }
                }
            }
        }
        Ok(shadow)
    }

    fn layout(&self, key: CasterKey) -> vk::PipelineLayout {
        match &self.masked_layout {
            Some(layout) if key.masked => layout.raw,
            _ => self.plain_layout.raw,
        }
    }

    fn draw(&self, context: &FrameContext, map: &MapRecording) {
        let &MapRecording { view, casters, mut first, .. } = map;
        // The streams that some caster needs are bound at once: a draw without holes fetches positions alone.
        let keys = casters.iter().map(|own| CasterKey::of(&context.world.objects[own.object], false));
        let streams: BTreeSet<u32> = keys.flat_map(|key| streams(key.masked, key.extras)).copied().collect();
        let streams: Vec<u32> = streams.into_iter().collect();
        let mut meshes = MeshDraws::of_casters(context, &streams);
        let mut bound: (Option<CasterKey>, Option<(usize, u32)>) = (None, None);
        let object_of = |caster: &Caster| &context.world.objects[caster.object];
        let one_draw = |a: &Caster, b: &Caster| {
            a.level == b.level && ShadowBatch::of(object_of(a)) == ShadowBatch::of(object_of(b))
        };
        for casters in casters.chunk_by(one_draw) {
            let (object, count) = (object_of(&casters[0]), casters.len() as u32);
            let key = CasterKey::of(object, self.clamp && view.clamps);
            let layout = self.layout(key);
            if bound.0 != Some(key) {
                // There is one for each object that casts.
                context.bind_pipeline(self.pipelines[&key].raw);
                bound = (Some(key), None);
            }
            let material = object.material_set();
            if key.masked && bound.1 != Some(material) {
                let set = context.scene.materials.as_ref().and_then(|materials| materials.holes(material));
                if let Some(set) = set {
                    context.bind_set(layout, 0, set);
                }
                bound.1 = Some(material);
            }
            if key.has_holes() {
                context.push(layout, PUSH_STAGES, &push(context, object));
            }
            meshes.draw(object, casters[0].level, None, first..first + count);
            first += count;
        }
    }
}

impl PassRecorder for ShadowPass {
    /// Draws one map, in its render pass.
    fn record(&self, context: &FrameContext) {
        let Some(map) = &context.map else { return };
        context.set_area();
        // ANCHOR: slope-bias
        // Reversed depth: farther from the light is less.
        let slope_bias = -context.world.shadows.slope_bias * self.bias_scale;
        // SAFETY: depth bias is dynamic in every pipeline of the pass.
        unsafe { context.device.raw.cmd_set_depth_bias(context.cmd, 0.0, 0.0, slope_bias) };
        // ANCHOR_END: slope-bias
        self.draw(context, map);
    }
}

/// The state shared by casters that one command draws.
#[derive(PartialEq)]
struct ShadowBatch {
    key: CasterKey,
    mesh: usize,
    deform: Option<usize>,
    /// The material and the sheet of its cell, where it cuts holes.
    material: Option<(usize, u32)>,
}

impl ShadowBatch {
    fn of(object: &WorldObject) -> Self {
        let key = CasterKey::of(object, false);
        let material = key.has_holes().then_some(object.material_set());
        Self { key, mesh: object.mesh, deform: object.deform, material }
    }
}

/// Returns the push constants by which a caster's material cuts holes.
fn push(context: &FrameContext, object: &WorldObject) -> ShadowPush {
    let material = &context.world.materials[object.material];
    ShadowPush {
        alpha: material.alpha,
        alpha_cutoff: match material.alpha_mode {
            AlphaMode::Mask { cutoff } => cutoff,
            AlphaMode::Opaque | AlphaMode::Blend | AlphaMode::Glass | AlphaMode::Coat => 0.0,
        },
        _padding: [0.0; 2],
        uv_rows: context.textures.uv_rows(
            object.material,
            TextureSlot::BaseColor,
            &material.uv_maps[TextureSlot::BaseColor as usize],
        ),
    }
}

fn pipeline(
    device: &Arc<Device>,
    slot: &Slot,
    key: CasterKey,
    layout: vk::PipelineLayout,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let flags = Flags::MASKED.when(key.masked) | Flags::EXTRAS.when(key.extras.any());
    let variant = needed("shadow", shader::variant, flags)?;
    let (vertex_bindings, vertex_attributes) = casters::inputs(key.masked, key.extras);
    let fragment = variant
        .fragment()
        .map_or(Vec::new(), |own| with_cells(own.spirv.words(), (key.extras.any(), key.extras.cells)));
    let constants = [(constants::COLORED, u32::from(key.extras.colors))];
    let constants = if key.extras.any() { &constants[..] } else { &[] };
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: &format!("shadow {key:?}"),
            stages: &textured_stages(variant, &fragment, constants),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            // Both sides cast, unless the object says otherwise: a surface seen from behind still stands in the light.
            cull_mode: if key.front { vk::CullModeFlags::BACK } else { vk::CullModeFlags::NONE },
            front_face: if key.mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE },
            depth: Some(DepthState { test: vk::CompareOp::GREATER_OR_EQUAL, write: true }),
            depth_bias: true,
            depth_clamp: key.clamps,
            blend: &[],
            samples: vk::SampleCountFlags::TYPE_1,
            layout,
            place: slot,
        },
    )
}
