//! GEOMETRY: surfaces into the G-buffer, emissive light into the light target.

use std::sync::Arc;

use ash::vk;

use super::screen::{add, replace};
use super::surface::{Surfaces, bound_fragment, faces, textured_stages};
use super::{First, Pass, Place, Presence, Recording, SetLayouts, Slot, Touch, frame_data, meshes};
use crate::gpu::{self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, sync::Use};
use crate::gpu_scene::{GpuScene, vertex_input};
use crate::plan::{FramePlan, GeometryKey, Shading, Target};
use crate::scene::TextureSlot;
use crate::shaders::geometry::{self as shader, Flags, constants};

/// Writes its colour targets; their clears and the undefined loads are writes too.
pub const COLOR_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);
/// Adds to the fragment count.
pub const COUNT_BLEND: Use =
    COLOR_WRITE.or(Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_READ));
/// Clears depth, before it is used.
pub const DEPTH_CLEAR: Use =
    Use::new(vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Stores depth for a later pass, when it was used.
pub const DEPTH_STORE: Use =
    Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Clears, tests and writes depth: early, and late where a mask may discard.
pub const DEPTH_TEST: Use =
    Use::new(vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ)
        .or(Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE));

pub const PASS: Pass = Pass {
    place: Place::pass("GEOMETRY"),
    time: "geometry",
    what: "surfaces into the G-buffer, near ones first",
    presence: |plan| match (plan.has_geometry(), plan.is_forward()) {
        (true, false) => Presence::In("surfaces are drawn before they are lit or shown".into()),
        (true, true) => Presence::Out("surfaces are lit as they are drawn".into()),
        (false, _) => Presence::Out("this view shows no surface".into()),
    },
    touches,
    leave_out: None,
};

fn touches(plan: &FramePlan) -> Vec<Touch> {
    // A location whose target the plan lacks stays empty. LIGHTING leaves out every pixel that is not written here, so nothing but what
    // adds up is cleared.
    let locations = [
        (0, Target::Albedo, First::Undefined, COLOR_WRITE),
        (1, Target::Normal, First::Undefined, COLOR_WRITE),
        (2, Target::Material, First::Undefined, COLOR_WRITE),
        (4, Target::Specular, First::Undefined, COLOR_WRITE),
        (5, Target::Position, First::Undefined, COLOR_WRITE),
        (0, Target::Count, First::Clear, COUNT_BLEND),
        (0, Target::Triangle, First::Undefined, COLOR_WRITE),
    ];
    let drawn = locations.into_iter().filter(|&(_, target, ..)| plan.format_of(target).is_some());
    let mut touches = vec![Touch::depth(First::Clear, DEPTH_TEST), frame_data()];
    touches.extend(drawn.map(|(location, target, first, uses)| Touch::color(location, target, first, uses)));
    if plan.emissive {
        touches.push(Touch::color(3, plan.light_target(), First::Clear, COLOR_WRITE));
    }
    touches.extend(meshes(plan));
    touches
}

/// The pass: a pipeline for each [`GeometryKey`] of the plan.
pub struct Geometry {
    surfaces: Surfaces,
    after_prepass: bool,
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
        let mut surfaces = Surfaces::new(
            device,
            plan,
            ("geometry", &plan.geometry),
            SetLayouts { frame: frame_layout, shadows: None },
            scene,
        )?;
        for &key in &plan.geometry {
            let pipeline = pipeline(device, plan, slot, key, surfaces.layout(key))?;
            surfaces.insert(key, pipeline);
        }
        Ok(Self { surfaces, after_prepass: plan.depth_prepass })
    }

    /// Draws what is visible. Runs inside its subpass.
    pub fn record(&self, recording: &Recording) {
        let draws = recording.visible.draws.iter().map(|draw| (draw.object, None));
        // Of surfaces that lie in each other the first drawn is seen. After a pre-pass all of them are equal, so that it is the last:
        // then the order is turned around.
        match self.after_prepass {
            true => self.surfaces.record(recording, draws.rev()),
            false => self.surfaces.record(recording, draws),
        }
    }
}

fn pipeline(
    device: &Arc<Device>,
    plan: &FramePlan,
    slot: Slot,
    key: GeometryKey,
    layout: vk::PipelineLayout,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let flags = flags(plan, key);
    let Some(variant) = shader::variant(flags) else {
        return Err(gpu::Error::Unsupported(format!("geometry.wgsl has no variant {flags:?}")));
    };
    let inputs = variant.vertex().map_or(&[][..], |entry| entry.vertex_inputs);
    let streams: Vec<u32> = inputs.iter().map(|input| input.location).collect();
    let (vertex_bindings, vertex_attributes) = vertex_input(&streams);
    let (cull_mode, front_face) = faces(key);
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: &format!("geometry {key:?}"),
            stages: &textured_stages(variant, &bound_fragment(variant, key.textures), &constants_of(plan, key)),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            cull_mode,
            front_face,
            depth: Some(depth_state(plan, key)),
            depth_bias: false,
            depth_clamp: false,
            blend: &blend(plan),
            samples: plan.sample_count(),
            layout,
            render_pass: slot.render_pass,
            subpass: slot.subpass,
        },
    )
}

/// Which variant of the shader a pipeline of the plan takes.
pub(crate) fn flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    let when = |condition: bool, flag: Flags| if condition { flag } else { Flags::NONE };
    when(!key.textures.is_empty(), Flags::TEXTURED)
        | when(key.textures.contains(TextureSlot::Normal), Flags::NORMAL_MAP)
        | gbuffer_flags!(plan)
        | when(plan.emissive, Flags::EMISSIVE)
        | when(plan.shading.only_covers(), Flags::OVERDRAW)
        | when(plan.shading == Shading::ShowTriangle, Flags::TRIANGLE)
}

fn constants_of(plan: &FramePlan, key: GeometryKey) -> Vec<(u32, u32)> {
    let gbuffer = plan.gbuffer.as_ref();
    let half_position = gbuffer.is_some_and(|gbuffer| gbuffer.position == Some(vk::Format::R16G16B16A16_SFLOAT));
    let farthest: f32 = if half_position { 65000.0 } else { f32::MAX };
    vec![
        (constants::TEXTURES, key.textures.bits()),
        (constants::MASKED, u32::from(key.discards)),
        (constants::TWO_SIDED, u32::from(key.two_sided)),
        (constants::RECEIVES, u32::from(key.receives)),
        (constants::PHONG, u32::from(key.phong)),
        (constants::LARGEST, plan.largest_light().to_bits()),
        (constants::FARTHEST, farthest.to_bits()),
        (constants::NORMAL_ENCODING, gbuffer.map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::GEOMETRIC_STEPS, gbuffer.map_or(0.0, |gbuffer| gbuffer.geometric_steps()).to_bits()),
    ]
}

/// Reversed Z. After a depth pre-pass only what it left visible is equal to its depth; masked surfaces were not in it.
fn depth_state(plan: &FramePlan, key: GeometryKey) -> DepthState {
    match plan.depth_prepass && !key.masked {
        true => DepthState { test: vk::CompareOp::EQUAL, write: false },
        false => DepthState { test: vk::CompareOp::GREATER, write: true },
    }
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
    use crate::gpu_scene::{NORMAL, POSITION, TANGENT, UV};
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
}
