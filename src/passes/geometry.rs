//! GEOMETRY: surfaces into the G-buffer, emissive light into the light target.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::screen::{add, replace, stages};
use super::{Recording, Slot, camera_relative};
use crate::gpu::{self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, pipeline_layout, sync::Use};
use crate::gpu_scene::{GpuScene, NORMAL, POSITION, TANGENT, UV, vertex_input};
use crate::plan::{FramePlan, GeometryKey, Shading, WorldObject};
use crate::scene::{AlphaMode, Brdf, Material, TextureSlot};
use crate::shaders::geometry::{self as shader, Flags, constants};

/// Writes its colour targets; their clears and the undefined loads are writes too.
pub const COLOR_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
/// Adds to the fragment count.
pub const COUNT_BLEND: Use =
    COLOR_WRITE.or(Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_READ));
/// Clears, tests and writes depth: early, and late where a mask may discard.
pub const DEPTH_TEST: Use =
    Use::new(vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ)
        .or(Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE));

const PUSH_STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

/// What changes from draw to draw: 112 of the 128 bytes that every device has.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    rows: [Vec4; 3],
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
}

const _: () = {
    use crate::shaders::geometry::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<Push>() == wgsl::SIZE);
    assert!(offset_of!(Push, rows) == wgsl::ROW_X);
    assert!(offset_of!(Push, base_color) == wgsl::BASE_COLOR);
    assert!(offset_of!(Push, alpha) == wgsl::ALPHA);
    assert!(offset_of!(Push, emissive) == wgsl::EMISSIVE);
    assert!(offset_of!(Push, alpha_cutoff) == wgsl::ALPHA_CUTOFF);
    assert!(offset_of!(Push, specular) == wgsl::SPECULAR);
    assert!(offset_of!(Push, brdf) == wgsl::BRDF);
    assert!(offset_of!(Push, metallic) == wgsl::METALLIC);
    assert!(offset_of!(Push, roughness) == wgsl::ROUGHNESS);
    assert!(offset_of!(Push, ambient) == wgsl::AMBIENT);
    assert!(offset_of!(Push, normal_scale) == wgsl::NORMAL_SCALE);
};

/// The pass: a pipeline for each [`GeometryKey`] of the plan.
pub struct Geometry {
    plain_layout: Owned<vk::PipelineLayout>,
    textured_layout: Option<Owned<vk::PipelineLayout>>,
    pipelines: BTreeMap<GeometryKey, Owned<vk::Pipeline>>,
    streams: Vec<u32>,
    area: [u32; 2],
    brdf_override: Option<Brdf>,
    largest_light: f32,
}

impl Geometry {
    /// # Errors
    /// When a pipeline cannot be made.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: Slot,
        frame_layout: vk::DescriptorSetLayout,
        scene: &GpuScene,
    ) -> gpu::Result<Self> {
        let range = vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: size_of::<Push>() as u32 };
        let plain_layout = pipeline_layout(device, "geometry layout", &[frame_layout], &[range])?;
        let textured_layout = match &scene.materials {
            Some(materials) => {
                let sets = [frame_layout, materials.set_layout.raw];
                Some(pipeline_layout(device, "textured geometry layout", &sets, &[range])?)
            }
            None => None,
        };
        let mut geometry = Self {
            plain_layout,
            textured_layout,
            pipelines: BTreeMap::new(),
            streams: [
                (POSITION, true),
                (NORMAL, plan.streams.normals),
                (UV, plan.streams.uvs),
                (TANGENT, plan.streams.tangents),
            ]
            .into_iter()
            .filter_map(|(stream, present)| present.then_some(stream))
            .collect(),
            area: plan.size,
            brdf_override: plan.brdf_override,
            largest_light: plan.largest_light(),
        };
        for &key in &plan.geometry {
            let pipeline = geometry.pipeline(device, plan, slot, key)?;
            geometry.pipelines.insert(key, pipeline);
        }
        Ok(geometry)
    }

    fn layout(&self, key: GeometryKey) -> vk::PipelineLayout {
        match &self.textured_layout {
            Some(layout) if !key.textures.is_empty() => layout.raw,
            _ => self.plain_layout.raw,
        }
    }

    fn pipeline(
        &self,
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: Slot,
        key: GeometryKey,
    ) -> gpu::Result<Owned<vk::Pipeline>> {
        let flags = flags(plan, key);
        let Some(variant) = shader::variant(flags) else {
            return Err(gpu::Error::Unsupported(format!("geometry.wgsl has no variant {flags:?}")));
        };
        let inputs = variant.vertex().map_or(&[][..], |entry| entry.vertex_inputs);
        let streams: Vec<u32> = inputs.iter().map(|input| input.location).collect();
        let (vertex_bindings, vertex_attributes) = vertex_input(&streams);
        GraphicsPipeline::new(
            device,
            &GraphicsPipelineDesc {
                name: &format!("geometry {key:?}"),
                stages: &stages(variant, &constants_of(plan, key)),
                vertex_bindings: &vertex_bindings,
                vertex_attributes: &vertex_attributes,
                cull_mode: if key.two_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK },
                front_face: if key.mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE },
                // Reversed Z.
                depth: Some(DepthState { test: vk::CompareOp::GREATER, write: true }),
                depth_bias: false,
                depth_clamp: false,
                blend: &blend(plan),
                samples: vk::SampleCountFlags::TYPE_1,
                layout: self.layout(key),
                render_pass: slot.render_pass,
                subpass: slot.subpass,
            },
        )
    }

    /// Draws what is visible. Runs inside its subpass.
    pub fn record(&self, recording: &Recording) {
        recording.set_area(self.area[0], self.area[1]);
        recording.scene.bind(recording.device, recording.cmd, &self.streams);
        recording.bind_set(self.plain_layout.raw, 0, recording.frame_set);
        let mut bound: (Option<GeometryKey>, Option<usize>) = (None, None);
        for draw in &recording.visible.draws {
            let object = &recording.world.objects[draw.object];
            // The plan has a key for each object of the scene (plan.rs), and the pass a pipeline for each key.
            let pipeline = &self.pipelines[&object.key];
            let layout = self.layout(object.key);
            if bound.0 != Some(object.key) {
                recording.bind_pipeline(pipeline.raw);
                // The two layouts differ in set 1 only, but a change of push constant ranges or sets may disturb set 0.
                recording.bind_set(layout, 0, recording.frame_set);
                bound = (Some(object.key), None);
            }
            if bound.1 != Some(object.material) {
                let set = recording.scene.materials.as_ref().and_then(|materials| materials.sets[object.material]);
                if let Some(set) = set.filter(|_| !object.key.textures.is_empty()) {
                    recording.bind_set(layout, 1, set);
                }
                bound.1 = Some(object.material);
            }
            recording.push(layout, PUSH_STAGES, &self.push(recording, object));
            recording.draw_mesh(object.mesh);
        }
    }

    fn push(&self, recording: &Recording, object: &WorldObject) -> Push {
        let material: &Material = &recording.world.materials[object.material];
        let brdf = self.brdf_override.unwrap_or(material.brdf);
        Push {
            rows: camera_relative(&object.transform, recording.camera.position),
            base_color: material.base_color,
            alpha: material.alpha,
            // Cut off here as well: infinity times a black texel would be no number.
            emissive: (material.emissive * recording.world.exposure).min(Vec3::splat(self.largest_light)),
            alpha_cutoff: match material.alpha_mode {
                AlphaMode::Mask { cutoff } => cutoff,
                AlphaMode::Opaque => 0.0,
            },
            specular: material.specular,
            brdf: brdf as u32 as f32 / 3.0,
            metallic: material.metallic,
            roughness: if object.key.phong { material.shininess } else { material.roughness },
            ambient: if object.key.phong { material.ambient } else { 1.0 },
            normal_scale: material.normal_scale,
        }
    }
}

/// Which variant of the shader a pipeline of the plan takes.
pub(crate) fn flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    let gbuffer = plan.gbuffer.as_ref();
    let when = |condition: bool, flag: Flags| if condition { flag } else { Flags::NONE };
    when(!key.textures.is_empty(), Flags::TEXTURED)
        | when(key.textures.contains(TextureSlot::Normal), Flags::NORMAL_MAP)
        | when(gbuffer.is_some_and(|gbuffer| gbuffer.material.is_some()), Flags::MATERIAL)
        | when(gbuffer.is_some_and(|gbuffer| gbuffer.specular.is_some()), Flags::SPECULAR)
        | when(gbuffer.is_some_and(|gbuffer| gbuffer.position.is_some()), Flags::POSITION)
        | when(gbuffer.is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT), Flags::NORMAL_UINT)
        | when(plan.emissive, Flags::EMISSIVE)
        | when(plan.shading == Shading::ShowOverdraw, Flags::OVERDRAW)
}

fn constants_of(plan: &FramePlan, key: GeometryKey) -> Vec<(u32, u32)> {
    let has = |slot| u32::from(key.textures.contains(slot));
    let gbuffer = plan.gbuffer.as_ref();
    let half_position = gbuffer.is_some_and(|gbuffer| gbuffer.position == Some(vk::Format::R16G16B16A16_SFLOAT));
    let farthest: f32 = if half_position { 65000.0 } else { f32::MAX };
    vec![
        (constants::BASE_COLOR_TEXTURE, has(TextureSlot::BaseColor)),
        (constants::METALLIC_ROUGHNESS_TEXTURE, has(TextureSlot::MetallicRoughness)),
        (constants::OCCLUSION_TEXTURE, has(TextureSlot::Occlusion)),
        (constants::EMISSIVE_TEXTURE, has(TextureSlot::Emissive)),
        (constants::SPECULAR_TEXTURE, has(TextureSlot::Specular)),
        (constants::MASKED, u32::from(key.masked)),
        (constants::TWO_SIDED, u32::from(key.two_sided)),
        (constants::RECEIVES, u32::from(key.receives)),
        (constants::PHONG, u32::from(key.phong)),
        (constants::LARGEST, plan.largest_light().to_bits()),
        (constants::FARTHEST, farthest.to_bits()),
        (constants::NORMAL_ENCODING, gbuffer.map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::GEOMETRIC_STEPS, gbuffer.map_or(255.0, |gbuffer| gbuffer.geometric_steps()).to_bits()),
    ]
}

/// One state for each colour location of the subpass.
fn blend(plan: &FramePlan) -> Vec<vk::PipelineColorBlendAttachmentState> {
    match plan.shading {
        Shading::ShowOverdraw => vec![add()],
        _ => vec![replace(); plan.geometry_locations() as usize],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::samples;

    #[test]
    fn there_is_one_blend_state_for_each_colour_location() {
        for (name, plan) in samples::plans().iter().filter(|(_, plan)| plan.has_geometry()) {
            assert_eq!(blend(plan).len(), plan.geometry_locations() as usize, "{name}");
            assert!(!blend(plan).is_empty(), "{name}");
        }
    }

    #[test]
    fn every_pipeline_has_a_shader_that_reads_only_streams_of_the_plan() {
        for (name, plan) in samples::plans() {
            let streams = plan.streams;
            for &key in &plan.geometry {
                let flags = flags(&plan, key);
                let variant = shader::variant(flags).unwrap_or_else(|| panic!("{name}: no variant {flags:?}"));
                for input in variant.vertex().expect("a vertex stage").vertex_inputs {
                    let present = match input.location {
                        POSITION => true,
                        NORMAL => streams.normals,
                        UV => streams.uvs,
                        TANGENT => streams.tangents,
                        other => panic!("{name}: no stream for location {other}"),
                    };
                    assert!(present, "{name} {key:?}: {} is not in {streams:?}", input.name);
                }
            }
        }
    }

    #[test]
    fn push_constants_fit_into_what_every_device_has() {
        assert!(size_of::<Push>() <= 128);
    }
}
