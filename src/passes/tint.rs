//! TINT: the second map beside each shadow map, of what transparent surfaces let through. A subpass of the same render pass: SHADOW's depth, which it tests against, stays in
//! the tile.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::casters::{self, PUSH_STAGES, streams};
use super::spirv::with_cells;
use super::surface::textured_stages;
use super::{
    COLOR_BLEND, COLOR_WRITE, ContentsIfFirst, DEPTH_COMPARE, Endpoint, FrameContext, Making, MapRecording, MeshDraws,
    Pass, PassRecorder, Presence, Resource, ResourceUse, Slot, UseKind, frame_data, meshes, needed, screen,
};
use crate::gpu::{self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, pipeline_layout, sync::Use};
use crate::gpu_scene::{GpuScene, HOLES};
use crate::plan::{Extras, ShadowPlan};
use crate::scene::{Brdf, CastsShadow, Material, Refraction, TextureSlot};
use crate::shaders::tint::{self as shader, Flags, constants};
use crate::visible::{ShadowView, WorldObject};

pub const PASS: Pass = Pass {
    name: Endpoint::pass("TINT"),
    time: "shadow",
    what: "what transparent surfaces let through of the lights of these maps",
    presence: |plan| {
        Presence::when(plan.effects.tints, "transparent surfaces cast a shadow", plan.reasons.lack_of("tinted shadows"))
    },
    touches: |plan| {
        let drawn = UseKind::Color { location: 0, first: ContentsIfFirst::Clear };
        let tested = UseKind::Depth { first: ContentsIfFirst::Undefined };
        let own = [
            ResourceUse::new(Resource::SHADOW_TINTS, drawn, COLOR_WRITE.or(COLOR_BLEND))
                .because("clears the maps that have changed, and multiplies into them"),
            ResourceUse::new(Resource::SHADOW_MAPS, tested, DEPTH_COMPARE)
                .because("leaves out what lies behind opaque surfaces"),
            frame_data(),
        ];
        own.into_iter().chain(meshes(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(TintPass::new(own)?))),
};

/// The first use of a map's square.
pub const TINT_CLEAR: Use = COLOR_WRITE;

/// As SHADOW's: the drawn square is cleared, the rest of the layer stays.
pub fn attachment() -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(ShadowPlan::TINT)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TintPush {
    uv_rows: [Vec4; 2],
    color: Vec3,
    alpha: f32,
    absorption: Vec3,
    facing: f32,
    across: f32,
    along: f32,
    round: f32,
    slope_bias: f32,
}

const _: () = {
    use crate::shaders::tint::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<TintPush>() == wgsl::SIZE);
    assert!(offset_of!(TintPush, uv_rows) == wgsl::UV_X);
    assert!(offset_of!(TintPush, color) == wgsl::COLOR);
    assert!(offset_of!(TintPush, alpha) == wgsl::ALPHA);
    assert!(offset_of!(TintPush, absorption) == wgsl::ABSORPTION);
    assert!(offset_of!(TintPush, facing) == wgsl::FACING);
    assert!(offset_of!(TintPush, across) == wgsl::ACROSS);
    assert!(offset_of!(TintPush, along) == wgsl::ALONG);
    assert!(offset_of!(TintPush, round) == wgsl::ROUND);
    assert!(offset_of!(TintPush, slope_bias) == wgsl::SLOPE_BIAS);
};

/// The way in which light passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Through {
    /// As far as alpha lets it.
    Veil,
    /// Tinted once at each surface, which mirrors a part.
    Wall,
    /// Tinted as it enters, and absorbed on its way.
    Body,
}

/// All that sets one pipeline of the pass apart from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct TintKey {
    textured: bool,
    extras: Extras,
    through: Through,
    /// Both sides of the surface are met.
    two_sided: bool,
    mirrored: bool,
    clamps: bool,
}

struct TintPass {
    plain_layout: Owned<vk::PipelineLayout>,
    /// Layout for surfaces with a texture; none if no surface has one.
    textured_layout: Option<Owned<vk::PipelineLayout>>,
    pipelines: BTreeMap<TintKey, Owned<vk::Pipeline>>,
    brdf_override: Option<Brdf>,
    bias_scale: f32,
    clamp: bool,
}

impl TintPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let (device, world, scene) = (own.device, own.world, own.scene);
        let planned: &ShadowPlan = own.needed(own.plan.shadow.as_ref())?;
        let range = vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: size_of::<TintPush>() as u32 };
        let tinting = || world.objects.iter().filter(|object| object.transparent && object.casts != CastsShadow::No);
        let textures = textures(scene).filter(|_| tinting().any(|object| object.cuts.texture.is_some()));
        let layout = |set| pipeline_layout(device, "textured tint layout", &[set], &[range]);
        let mut made = Self {
            plain_layout: pipeline_layout(device, "tint layout", &[], &[range])?,
            textured_layout: textures.map(layout).transpose()?,
            pipelines: BTreeMap::new(),
            brdf_override: own.plan.brdf_override,
            bias_scale: planned.bias_scale(),
            clamp: planned.clamp,
        };
        for object in tinting() {
            let key = made.key(object, &world.materials[object.material], false);
            let mirrors = if object.may_mirror { &[false, true][..] } else { &[key.mirrored] };
            let clamps = if planned.clamp { &[false, true][..] } else { &[false] };
            for (&mirrored, &clamps) in mirrors.iter().flat_map(|own| clamps.iter().map(move |other| (own, other))) {
                let key = TintKey { mirrored, clamps, ..key };
                if !made.pipelines.contains_key(&key) {
                    let pipeline = pipeline(device, own.slot()?, key, made.layout(key))?;
                    made.pipelines.insert(key, pipeline);
                }
            }
        }
        Ok(made)
    }

    fn key(&self, object: &WorldObject, material: &Material, clamps: bool) -> TintKey {
        let through = match self.glass(material) {
            None => Through::Veil,
            Some(glass) if glass.thickness > 0.0 => Through::Body,
            Some(_) => Through::Wall,
        };
        TintKey {
            textured: object.cuts.texture.is_some(),
            extras: object.cuts.extras,
            through,
            two_sided: object.casts != CastsShadow::Front && (material.two_sided || through == Through::Body),
            mirrored: object.key.mirrored,
            clamps,
        }
    }

    fn glass(&self, material: &Material) -> Option<Refraction> {
        material.refracts(material.model(self.brdf_override))
    }

    fn layout(&self, key: TintKey) -> vk::PipelineLayout {
        match &self.textured_layout {
            Some(layout) if key.textured => layout.raw,
            _ => self.plain_layout.raw,
        }
    }

    fn push(&self, context: &FrameContext, view: &ShadowView, object: &WorldObject) -> TintPush {
        let material = &context.world.materials[object.material];
        let glass = self.glass(material);
        let [across, along] = view.metres();
        // Metres per unit of the mesh.
        let scale = object.transform.matrix3.determinant().abs().cbrt() as f32;
        let body = glass.filter(|own| own.thickness > 0.0);
        // As in `shaders/shared/refraction.wgsl`.
        let ball = |own: Refraction| object.round * (4.0 * own.thickness * object.slender - 1.0).clamp(0.0, 1.0);
        // With a texture of metalness the factor says nothing, and the texture is not looked at.
        let is_textured = material.texture(TextureSlot::MetallicRoughness).is_some();
        let kept = if is_textured { 1.0 } else { 1.0 - material.metallic };
        TintPush {
            uv_rows: context.textures.uv_rows(
                object.material,
                TextureSlot::BaseColor,
                &material.uv_maps[TextureSlot::BaseColor as usize],
            ),
            color: material.base_color * kept,
            alpha: material.alpha,
            absorption: body.map_or(Vec3::ZERO, |own| own.absorption() * (own.thickness * scale)),
            facing: material.reflectance.max_element().clamp(0.0, 1.0),
            across: across as f32,
            along: along as f32,
            round: body.map_or(0.0, ball),
            slope_bias: context.world.shadows.slope_bias * self.bias_scale,
        }
    }
}

impl PassRecorder for TintPass {
    /// Draws the transparent surfaces of one map, in its render pass. Push constants differ from object to object, so that each has a command.
    fn record(&self, context: &FrameContext) {
        let Some(map) = context.map.as_ref().filter(|map| !map.tinting.is_empty()) else { return };
        let &MapRecording { view, casters, tinting, first } = map;
        context.set_area();
        let objects = || tinting.iter().map(|own| (&context.world.objects[own.object], own.level));
        let key_of = |object: &WorldObject| {
            self.key(object, &context.world.materials[object.material], self.clamp && view.clamps)
        };
        let mut all: Vec<u32> = objects()
            .map(|(object, _)| key_of(object))
            .flat_map(|key| streams(key.textured, key.extras))
            .copied()
            .collect();
        all.sort_unstable();
        all.dedup();
        let mut meshes = MeshDraws::of_casters(context, &all);
        let mut bound: (Option<TintKey>, Option<(usize, u32)>) = (None, None);
        for ((object, level), place) in objects().zip(first + casters.len() as u32..) {
            let key = key_of(object);
            let Some(pipeline) = self.pipelines.get(&key) else { continue };
            let layout = self.layout(key);
            if bound.0 != Some(key) {
                context.bind_pipeline(pipeline.raw);
                bound = (Some(key), None);
            }
            let material = object.material_set();
            if key.textured && bound.1 != Some(material) {
                let set = context.scene.materials.as_ref().and_then(|materials| materials.holes(material));
                set.into_iter().for_each(|set| context.bind_set(layout, 0, set));
                bound.1 = Some(material);
            }
            context.push(layout, PUSH_STAGES, &self.push(context, view, object));
            meshes.draw(object, level, None, place..place + 1);
        }
    }
}

/// The layout of the set that has a surface's texture.
fn textures(scene: &GpuScene) -> Option<vk::DescriptorSetLayout> {
    scene.materials.as_ref().and_then(|materials| materials.layout(HOLES))
}

/// Colours are multiplied, and of nearness the largest stays.
fn multiply() -> vk::PipelineColorBlendAttachmentState {
    screen::add()
        .src_color_blend_factor(vk::BlendFactor::ZERO)
        .dst_color_blend_factor(vk::BlendFactor::SRC_COLOR)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
        .alpha_blend_op(vk::BlendOp::MAX)
}

fn pipeline(
    device: &Arc<Device>,
    slot: &Slot,
    key: TintKey,
    layout: vk::PipelineLayout,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let flags = Flags::TEXTURED.when(key.textured) | Flags::EXTRAS.when(key.extras.any());
    let variant = needed("tint", shader::variant, flags)?;
    let (vertex_bindings, vertex_attributes) = casters::inputs(key.textured, key.extras);
    let fragment = variant
        .fragment()
        .map_or(Vec::new(), |own| with_cells(own.spirv.words(), (key.extras.any(), key.extras.cells)));
    let constants = [
        (constants::GLASS, u32::from(key.through != Through::Veil)),
        (constants::THIN, u32::from(key.through == Through::Wall)),
        (constants::COLORED, u32::from(key.extras.colors)),
    ];
    // The last is one of meshes with extras.
    let constants = if key.extras.any() { &constants[..] } else { &constants[..2] };
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: &format!("tint {key:?}"),
            stages: &textured_stages(variant, &fragment, constants),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            cull_mode: if key.two_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK },
            front_face: if key.mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE },
            depth: Some(DepthState { test: vk::CompareOp::GREATER_OR_EQUAL, write: false }),
            depth_bias: false,
            depth_clamp: key.clamps,
            blend: &[multiply()],
            samples: vk::SampleCountFlags::TYPE_1,
            layout,
            place: slot,
        },
    )
}
