//! Shared by the passes that draw surfaces: their push constants, pipeline layouts, and the loop over the objects.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::air::air_constants;
use super::screen::stages;
use super::spirv::bound_fragment;
use super::{FrameContext, MeshDraws, SetLayouts, Slot, needed};
use crate::gpu::{
    self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, SetLayout, ShaderStage, pipeline_layout,
};
use crate::gpu_scene::{
    COLOR, CullingBuffers, GpuScene, NORMAL, POSITION, SECOND_UV, SetForm, TANGENT, UV, vertex_input,
};
use crate::plan::{FramePlan, GeometryKey, LobeMask, LobesPlan, Opacity, Shading, ToneMapping};
use crate::scene::{AlphaMode, Brdf, Material, TextureSlot};
use crate::shaders::Variant;
use crate::shaders::forward::{self as shader, Flags, constants};
use crate::visible::{Draw, STEPS, WorldObject};

pub const PUSH_STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

/// The push constants, which change from draw to draw: 72 of the 128 bytes that every device has.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct SurfacePush {
    base_color: Vec3,
    alpha: f32,
    emissive: Vec3,
    alpha_cutoff: f32,
    specular: Vec3,
    brdf: f32,
    metallic: f32,
    roughness: f32,
    ambient: f32,
    normal_scale: f32,
    first_uv_map: u32,
    lobes: u32,
    round: f32,
    slender: f32,
}

const _: () = {
    use crate::shaders::geometry::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<SurfacePush>() <= 128);
    assert!(size_of::<SurfacePush>() == wgsl::SIZE);
    assert!(size_of::<SurfacePush>() == crate::shaders::forward::push::SIZE);
    assert!(offset_of!(SurfacePush, base_color) == wgsl::BASE_COLOR);
    assert!(offset_of!(SurfacePush, alpha) == wgsl::ALPHA);
    assert!(offset_of!(SurfacePush, emissive) == wgsl::EMISSIVE);
    assert!(offset_of!(SurfacePush, alpha_cutoff) == wgsl::ALPHA_CUTOFF);
    assert!(offset_of!(SurfacePush, specular) == wgsl::SPECULAR);
    assert!(offset_of!(SurfacePush, brdf) == wgsl::BRDF);
    assert!(offset_of!(SurfacePush, metallic) == wgsl::METALLIC);
    assert!(offset_of!(SurfacePush, roughness) == wgsl::ROUGHNESS);
    assert!(offset_of!(SurfacePush, ambient) == wgsl::AMBIENT);
    assert!(offset_of!(SurfacePush, normal_scale) == wgsl::NORMAL_SCALE);
    assert!(offset_of!(SurfacePush, first_uv_map) == wgsl::FIRST_UV_MAP);
    assert!(offset_of!(SurfacePush, lobes) == wgsl::LOBES && offset_of!(SurfacePush, round) == wgsl::ROUND);
    assert!(offset_of!(SurfacePush, slender) == wgsl::SLENDER);
};

/// The pipeline and the material that are bound.
#[derive(Default)]
struct BoundState {
    key: Option<GeometryKey>,
    material: Option<(usize, u32)>,
}

/// A pipeline for each [`GeometryKey`] of a pass.
pub struct SurfacePipelines {
    /// Pipeline layouts, by the textures that a pipeline samples.
    layouts: BTreeMap<SetForm, Owned<vk::PipelineLayout>>,
    pipelines: BTreeMap<GeometryKey, Owned<vk::Pipeline>>,
    /// True if surfaces are lit with shadows as they are drawn.
    shadows: bool,
    _empty: Option<SetLayout>,
    streams: Vec<u32>,
    brdf_override: Option<Brdf>,
    stores_reflectance: bool,
    largest_light: f32,
    after_prepass: bool,
    /// Rows of materials with lobes.
    lobes: Option<LobesPlan>,
    /// Only surfaces that are lit once more are drawn, by the keys of that.
    relights: bool,
}

impl SurfacePipelines {
    /// Makes the pipeline layouts that the pass `name` needs for `keys`, without pipelines yet. `layouts` has set 0 and, for passes that also light
    /// surfaces, set 2.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        (name, keys): (&str, &BTreeSet<GeometryKey>),
        layouts: SetLayouts,
        scene: &GpuScene,
    ) -> gpu::Result<Self> {
        let range =
            vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: size_of::<SurfacePush>() as u32 };
        let forms: BTreeSet<SetForm> = keys.iter().map(|&key| SetForm::of(key)).collect();
        // Shadow maps are in set 2: where nothing is in set 1, its place in the layout is empty.
        let skips = layouts.shadows.is_some() && forms.iter().any(|form| form.textures.is_empty());
        let empty = skips.then(|| SetLayout::new(device, "no textures", &[])).transpose()?;
        let layout = |form: SetForm| {
            let (name, textures) = match form.textures.is_empty() {
                true => (format!("{name} layout"), empty.as_ref().map(|empty| empty.raw)),
                // There is one for the material of each key.
                false => {
                    let sets = scene.materials.as_ref().and_then(|materials| materials.layout(form));
                    (format!("{name} layout, {}", form.textures), sets)
                }
            };
            let sets = [Some(layouts.frame), textures, layouts.shadows];
            let sets: Vec<_> = sets.into_iter().flatten().collect();
            Ok((form, pipeline_layout(device, &name, &sets, &[range])?))
        };
        Ok(Self {
            layouts: forms.into_iter().map(layout).collect::<gpu::Result<_>>()?,
            pipelines: BTreeMap::new(),
            shadows: layouts.shadows.is_some(),
            _empty: empty,
            streams: [
                (POSITION, true),
                (NORMAL, plan.streams.normals),
                (UV, plan.streams.uvs),
                (TANGENT, plan.streams.tangents),
                (COLOR, plan.streams.colors),
                (SECOND_UV, plan.streams.second_uvs),
            ]
            .into_iter()
            .filter_map(|(stream, present)| present.then_some(stream))
            .collect(),
            brdf_override: plan.brdf_override,
            stores_reflectance: plan.reflectance,
            largest_light: plan.largest_light(),
            after_prepass: plan.depth_prepass,
            lobes: plan.effects.lobes.clone(),
            relights: false,
        })
    }

    /// Variant for the surfaces that are lit once more.
    pub fn relighting(self) -> Self {
        Self { relights: true, ..self }
    }

    /// The key of the pipeline that draws an object; `None` if the object is not drawn.
    fn key_of(&self, object: &WorldObject) -> Option<GeometryKey> {
        if self.relights { object.key.relit(object.relit) } else { Some(object.key) }
    }

    /// The layout that the pipeline of a key has.
    pub fn layout(&self, key: GeometryKey) -> vk::PipelineLayout {
        self.layouts[&SetForm::of(key)].raw
    }

    pub fn insert(&mut self, key: GeometryKey, pipeline: Owned<vk::Pipeline>) {
        self.pipelines.insert(key, pipeline);
    }

    /// Draws instances in this order. Runs inside the subpass of the pipelines. A draw takes the mesh's indices from the scene's buffer, or the same
    /// number from the frame's sorted ones if it has a first index there.
    pub fn record<'a>(&self, context: &FrameContext, draws: impl Iterator<Item = (&'a Draw, Option<u32>)>) {
        context.set_area();
        let mut meshes = MeshDraws::new(context, &self.streams);
        let mut bound = BoundState::default();
        for (draw, first_index) in draws {
            let object = &context.world.objects[draw.object];
            let Some(key) = self.key_of(object) else { continue };
            self.bind(context, (object, key), &mut bound);
            meshes.draw(object, draw.level, first_index, draw.instances());
        }
    }

    /// Draws the objects that the device found visible, near ones first.
    fn record_culled(&self, context: &FrameContext, culling: &CullingBuffers) {
        context.set_area();
        let mut meshes = MeshDraws::new(context, &self.streams);
        let mut bound = BoundState::default();
        for step in 0..STEPS {
            for state in &culling.states {
                let object = &context.world.objects[state.object];
                let Some(key) = self.key_of(object) else { continue };
                self.bind(context, (object, key), &mut bound);
                meshes.draw_culled(culling, step, state);
            }
        }
    }

    /// Binds the pipeline and the material of an object, where others are bound, and pushes its values.
    fn bind(&self, context: &FrameContext, (object, key): (&WorldObject, GeometryKey), bound: &mut BoundState) {
        // The plan has a key for each object of the scene (plan.rs), and the pass a pipeline for each key.
        let pipeline = &self.pipelines[&key];
        let layout = self.layout(key);
        if bound.key != Some(key) {
            context.bind_pipeline(pipeline.raw);
            // The layouts differ in set 1 only, but that disturbs the sets after it, and a change of push constant ranges
            // may disturb set 0.
            context.bind_set(layout, 0, context.frame_set);
            if let Some(set) = context.shadow_set.filter(|_| self.shadows) {
                context.bind_set(layout, 2, set);
            }
            *bound = BoundState { key: Some(key), material: None };
        }
        let material = object.material_set();
        // How round a body of glass is differs from object to object.
        if bound.material != Some(material) || key.lobes.contains(LobeMask::GLASS) {
            let set = context.scene.materials.as_ref().and_then(|materials| materials.set(material));
            if let Some(set) = set.filter(|_| !key.textures.is_empty()) {
                context.bind_set(layout, 1, set);
            }
            bound.material = Some(material);
            context.push(layout, PUSH_STAGES, &self.push(context, object));
        }
    }

    /// Draws the opaque surfaces that are visible.
    pub fn record_opaque(&self, context: &FrameContext) {
        if let Some(culling) = context.culling {
            return self.record_culled(context, culling);
        }
        let visible = context.visible;
        let draws = if self.after_prepass { &visible.shaded } else { &visible.draws };
        self.record(context, draws.iter().map(|draw| (draw, None)));
    }

    fn push(&self, context: &FrameContext, object: &WorldObject) -> SurfacePush {
        let material = &context.world.materials[object.material];
        SurfacePush {
            base_color: material.base_color,
            alpha: material.alpha,
            // Cut off here as well: infinity times a black texel would be no number.
            emissive: (material.emissive * context.world.exposure).min(Vec3::splat(self.largest_light)),
            alpha_cutoff: match material.alpha_mode {
                AlphaMode::Mask { cutoff } => cutoff,
                AlphaMode::Opaque | AlphaMode::Blend | AlphaMode::Glass | AlphaMode::Coat => 0.0,
            },
            specular: if object.key.reflectance { material.reflectance } else { material.specular },
            brdf: self.brdf_code(material, object),
            metallic: material.metallic,
            roughness: if object.key.phong { material.shininess } else { material.roughness },
            ambient: material.ambient,
            normal_scale: material.normal_scale,
            first_uv_map: context.textures.first_uv_map(object.material).unwrap_or(0),
            lobes: self.lobes.as_ref().and_then(|lobes| lobes.row(object.material)).unwrap_or(0),
            round: object.round,
            slender: object.slender,
        }
    }
}

impl SurfacePipelines {
    /// The value for the specular target's alpha.
    fn brdf_code(&self, material: &Material, object: &WorldObject) -> f32 {
        let index = material.model(self.brdf_override) as u32 as f32;
        match object.key.forward {
            _ if object.key.reflectance => material.grazing,
            None if self.stores_reflectance => (index + 6.0) / 9.0,
            _ => index / 3.0,
        }
    }
}

/// The stages of a variant of a shader that samples a material's textures, as [`stages`] makes them: `fragment` is [`bound_fragment`]'s.
pub fn textured_stages<'a>(
    variant: &'a Variant,
    fragment: &'a [u32],
    constants: &'a [(u32, u32)],
) -> Vec<ShaderStage<'a>> {
    let mut stages = stages(variant, constants);
    let fragments = stages.iter_mut().filter(|stage| stage.stage == vk::ShaderStageFlags::FRAGMENT);
    fragments.for_each(|stage| stage.spirv = fragment);
    stages
}

/// The faces that the pipelines of a key cull, and the winding of the front.
pub fn faces(key: GeometryKey) -> (vk::CullModeFlags, vk::FrontFace) {
    (
        if key.two_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK },
        if key.mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE },
    )
}

/// Reversed Z. After a depth pre-pass only surfaces that it left visible are equal to its depth; masked ones and strokes were not in it.
pub fn opaque_depth(plan: &FramePlan, key: GeometryKey) -> DepthState {
    match plan.depth_prepass && key.is_in_prepass() {
        true => DepthState { test: vk::CompareOp::EQUAL, write: false },
        false => DepthState { test: vk::CompareOp::GREATER, write: true },
    }
}

/// The differences between FORWARD and TRANSPARENT, which share `shaders/forward.wgsl`.
pub struct LitDesc<'a> {
    pub name: &'a str,
    /// [`Flags::WEIGHTED`] or nothing.
    pub weighted: Flags,
    pub limits: Limits,
    pub masked: bool,
    pub depth: DepthState,
    pub blend: &'a [vk::PipelineColorBlendAttachmentState],
}

/// The shader's constants of these names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    pub largest: f32,
    pub highlight: f32,
    pub weight: f32,
    pub least: f32,
    pub peak: f32,
}

impl Limits {
    /// Limits for surfaces that are not blended by weight.
    pub fn unweighted(largest: f32, highlight: f32) -> Self {
        Self { largest, highlight, weight: 1.0, least: 1.0, peak: 1.0 }
    }
}

/// A pipeline that lights the surfaces that it draws.
pub fn lit_pipeline(
    device: &Arc<Device>,
    plan: &FramePlan,
    slot: &Slot,
    key: GeometryKey,
    layout: vk::PipelineLayout,
    desc: &LitDesc,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let flags = lit_flags(plan, key) | desc.weighted;
    let variant = needed("forward", shader::variant, flags)?;
    let constants = lit_constants(plan, key, desc);
    let surface = SurfaceDesc { name: desc.name, variant, constants: &constants, depth: desc.depth, blend: desc.blend };
    surface_pipeline(device, plan, slot, (key, layout), &surface)
}

/// The differences between passes that draw the surfaces of a key.
pub struct SurfaceDesc<'a> {
    pub name: &'a str,
    pub variant: &'a Variant,
    pub constants: &'a [(u32, u32)],
    pub depth: DepthState,
    pub blend: &'a [vk::PipelineColorBlendAttachmentState],
}

/// A pipeline for the surfaces of a key, which reads the vertex streams of its shader.
pub fn surface_pipeline(
    device: &Arc<Device>,
    plan: &FramePlan,
    slot: &Slot,
    (key, layout): (GeometryKey, vk::PipelineLayout),
    desc: &SurfaceDesc,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let inputs = desc.variant.vertex().map_or(&[][..], |entry| entry.vertex_inputs);
    let streams: Vec<u32> = inputs.iter().map(|input| input.location).collect();
    let (vertex_bindings, vertex_attributes) = vertex_input(&streams, key.extras);
    let (cull_mode, front_face) = faces(key);
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: &format!("{} {key:?}", desc.name),
            stages: &textured_stages(desc.variant, &bound_fragment(desc.variant, key), desc.constants),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            cull_mode,
            front_face,
            depth: Some(desc.depth),
            depth_bias: false,
            depth_clamp: false,
            blend: desc.blend,
            samples: plan.sample_count(),
            layout,
            place: slot,
        },
    )
}

/// Returns the variant of `shaders/forward.wgsl` for one of the plan's pipelines, but for the outputs.
pub(crate) fn lit_flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    Flags::TEXTURED.when(!key.textures.is_empty())
        | Flags::NORMAL_MAP.when(key.textures.contains(TextureSlot::Normal))
        | Flags::EXTRAS.when(key.has_extras())
        | Flags::LIGHTS.when(plan.lights.any())
        | Flags::SKY_LIGHT.when(plan.is_lit_by_sky())
        | Flags::LOBES.when(!key.lobes.is_empty())
        | Flags::UNIFORM_BUFFER.when(plan.lights.any() && plan.lights.uniform)
        | Flags::CLUSTERED.when(plan.has_clusters())
        | Flags::SHADOW.when(plan.shadow.is_some())
}

fn lit_constants(plan: &FramePlan, key: GeometryKey, desc: &LitDesc) -> Vec<(u32, u32)> {
    let forward = key.forward;
    let limits = desc.limits;
    let opacity = forward.map_or(Opacity::Hides, |forward| forward.opacity);
    // Transparent surfaces bring a subpass for it.
    let (tone_map, curve) = match plan.tone_mapping {
        ToneMapping::InLighting(curve) if opacity == Opacity::Hides => (1, curve as u32),
        _ => (0, 0),
    };
    [
        (constants::TEXTURES, key.textures.bits()),
        (constants::FOOTPRINT, plan.footprint.to_bits()),
        (constants::PLACES, plan.places_of_shaders()),
        (constants::COLORED, u32::from(key.extras.colors)),
        (constants::COLORED_LIGHT, u32::from(key.extras.colored_light)),
        (constants::LOOKS, u32::from(key.extras.looks)),
        (constants::STROKES, u32::from(key.extras.strokes)),
        (constants::MASKED, u32::from(desc.masked)),
        (constants::TWO_SIDED, u32::from(key.two_sided)),
        (constants::RECEIVES, u32::from(key.receives)),
        (constants::BRDF, forward.map_or(0, |forward| forward.brdf as u32)),
        (constants::PHONG, u32::from(key.phong)),
        (constants::REFLECTANCE, u32::from(key.reflectance)),
        (constants::DIFFUSE_TRANSMISSION, u32::from(key.lobes.contains(LobeMask::DIFFUSE_TRANSMISSION))),
        (constants::GROOVES, u32::from(key.lobes.contains(LobeMask::GROOVES))),
        (constants::FILM, u32::from(key.lobes.contains(LobeMask::FILM))),
        (constants::SHEEN, u32::from(key.lobes.contains(LobeMask::SHEEN))),
        (constants::REFRACTS, u32::from(key.lobes.contains(LobeMask::GLASS))),
        (constants::SEES_SKY, u32::from(plan.effects.sky.as_ref().is_some_and(|sky| sky.shown))),
        (constants::TEXTBOOK, u32::from(plan.textbook)),
        (constants::METAL, u32::from(plan.metal)),
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::EMISSIVE, u32::from(forward.is_some_and(|forward| forward.emissive))),
        (constants::AMBIENT, u32::from(plan.lights.ambient)),
        (constants::DIRECTIONAL, u32::from(plan.lights.directional)),
        (constants::ONE_DIRECTIONAL, u32::from(plan.lights.one_directional)),
        (constants::PUNCTUAL, u32::from(plan.lights.punctual)),
        (constants::FALLOFF, plan.lights.falloff),
        (constants::TRAITS, plan.lights.traits),
        (constants::SHADOW_FILTER, plan.shadow.as_ref().map_or(0, |shadow| shadow.filter_code())),
        (constants::DIRECTIONAL_SHADOWS, u32::from(plan.has_directional_shadows())),
        (constants::PUNCTUAL_SHADOWS, u32::from(plan.has_punctual_shadows())),
        (constants::LIGHT_ONLY, u32::from(plan.shading == Shading::Light { light_only: true })),
        (constants::TONE_MAP, tone_map),
        (constants::OPERATOR, curve),
        (constants::HEADROOM, plan.headroom().to_bits()),
        (constants::MULTISAMPLED, u32::from(plan.msaa > 1)),
        (constants::LARGEST, limits.largest.to_bits()),
        (constants::OPACITY, opacity as u32),
        (constants::HIGHLIGHT, limits.highlight.to_bits()),
        (constants::WEIGHT, limits.weight.to_bits()),
        (constants::LEAST, limits.least.to_bits()),
        (constants::PEAK, limits.peak.to_bits()),
    ]
    .into_iter()
    // FOG draws the air in front of opaque surfaces.
    .chain(air_constants!(plan, opacity != Opacity::Hides))
    .chain(sky_constants!(plan))
    .collect()
}
