//! VELOCITY: screen-space motion vectors, since the previous frame, of opaque surfaces that move by themselves. TAA computes the motion of all other
//! surfaces from depth and the two cameras. Objects that have not moved are not drawn.
//!
//! It draws with an EQUAL test against the finished picture's depth, so it needs no alpha mask. Other objects with vectors are drawn in the same
//! subpass or a later one.

use std::collections::BTreeMap;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::screen::{replace, stages};
use super::{
    COLOR_WRITE, ContentsIfFirst, DEPTH_COMPARE, EARLY_DEPTH_READ, Endpoint, FrameContext, Making, MeshDraws, Pass,
    PassRecorder, Presence, Resource, ResourceUse, frame_data, meshes, needed,
};
use crate::gpu::{self, DepthState, GraphicsPipeline, GraphicsPipelineDesc, Owned, pipeline_layout, sync::Use};
use crate::gpu_scene::{OTHER_END, POSITION, POSITION_BEFORE, ROWS, vertex_input};
use crate::plan::{Extras, VECTORS};
use crate::shaders::velocity::{self as shader, Flags};
use crate::visible::WorldObject;

/// Clears the vectors and writes them.
pub const VECTOR_WRITE: Use = COLOR_WRITE;
/// Loads depth, and tests against it.
pub const DEPTH_READ: Use = EARLY_DEPTH_READ.or(DEPTH_COMPARE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("VELOCITY"),
    time: "velocity",
    what: "how far what moves by itself has come since the frame before",
    presence: |plan| match plan.effects.taa {
        None => Presence::Out("frames are not averaged over time".into()),
        Some(taa) => Presence::when(
            taa.moves,
            "opaque surfaces can move by themselves",
            "no opaque surface moves by itself: depth and the camera give its motion",
        ),
    },
    touches: |plan| {
        let own = [
            ResourceUse::depth(ContentsIfFirst::Undefined, DEPTH_READ)
                .because("draws where depth is that of the picture"),
            ResourceUse::color(0, VECTORS, ContentsIfFirst::Clear, VECTOR_WRITE)
                .because("clears the vectors and writes them"),
            frame_data(),
        ];
        let textured = |touch: &ResourceUse| touch.resource == Resource::Textures;
        own.into_iter().chain(meshes(plan).filter(|touch| !textured(touch))).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(VelocityPass::new(own)?))),
};

const STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::VERTEX;

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct VelocityPush {
    before: [Vec4; 3],
    distance: Vec4,
    distance_before: Vec4,
}

const _: () = {
    use std::mem::offset_of;
    assert!(size_of::<VelocityPush>() == shader::push::SIZE && size_of::<VelocityPush>() <= 128);
    assert!(offset_of!(VelocityPush, before) == shader::push::BEFORE_X);
    assert!(offset_of!(VelocityPush, distance) == shader::push::DISTANCE);
    assert!(offset_of!(VelocityPush, distance_before) == shader::push::DISTANCE_BEFORE);
};

/// The pass, with a pipeline for each kind of mesh that the plan has.
pub struct VelocityPass {
    layout: Owned<vk::PipelineLayout>,
    /// By whether SKIN deforms the mesh, and whether it is points and lines.
    pipelines: BTreeMap<(bool, bool), Owned<vk::Pipeline>>,
}

impl VelocityPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let range = vk::PushConstantRange { stage_flags: STAGES, offset: 0, size: size_of::<VelocityPush>() as u32 };
        let layout = pipeline_layout(device, "velocity layout", &[own.layouts.frame], &[range])?;
        let pipeline = |(deformed, strokes): (bool, bool)| {
            let flags = Flags::DEFORMED.when(deformed) | Flags::STROKES.when(strokes);
            let mut locations = vec![POSITION, ROWS, ROWS + 1, ROWS + 2];
            locations.extend(deformed.then_some(POSITION_BEFORE));
            locations.extend(strokes.then_some(OTHER_END));
            let (vertex_bindings, vertex_attributes) =
                vertex_input(&locations, Extras { strokes, ..Extras::default() });
            GraphicsPipeline::new(
                device,
                &GraphicsPipelineDesc {
                    name: "velocity",
                    stages: &stages(needed("velocity", shader::variant, flags)?, &[]),
                    vertex_bindings: &vertex_bindings,
                    vertex_attributes: &vertex_attributes,
                    // The depth test passes only surfaces that the picture shows, front or back face.
                    cull_mode: vk::CullModeFlags::NONE,
                    front_face: vk::FrontFace::COUNTER_CLOCKWISE,
                    depth: Some(DepthState { test: vk::CompareOp::EQUAL, write: false }),
                    depth_bias: false,
                    depth_clamp: false,
                    blend: &[replace()],
                    samples: vk::SampleCountFlags::TYPE_1,
                    layout: layout.raw,
                    place: own.slot()?,
                },
            )
        };
        let strokes = plan.keys().any(|key| key.extras.strokes);
        let kinds = [false, true].into_iter().filter(|&deformed| !deformed || plan.meshes.deforms.keeps_positions);
        let kinds = kinds.flat_map(|deformed| [(deformed, false), (deformed, true)]).filter(|kind| strokes || !kind.1);
        let pipelines = kinds.map(|kind| Ok((kind, pipeline(kind)?))).collect::<gpu::Result<_>>()?;
        Ok(Self { pipelines, layout })
    }
}

impl PassRecorder for VelocityPass {
    /// Draws the objects that have moved since the frame before. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        let Some(frame) = context.reprojection else { return };
        let Some(before) = &frame.previous else { return };
        context.set_area();
        context.bind_set(self.layout.raw, 0, context.frame_set);
        for (&kind, pipeline) in &self.pipelines {
            let object = |index: usize| &context.world.objects[index];
            let is_own = |own: &WorldObject| (own.deform.is_some(), own.key.extras.strokes) == kind;
            let mut own = frame.moved.iter().filter(|moved| is_own(object(moved.draw.object))).peekable();
            if own.peek().is_none() {
                continue;
            }
            context.bind_pipeline(pipeline.raw);
            let (deformed, _) = kind;
            let streams: &[u32] = if deformed { &[POSITION, POSITION_BEFORE] } else { &[POSITION] };
            let mut meshes = MeshDraws::new(context, streams);
            for moved in own {
                let object = object(moved.draw.object);
                let (was, is) = (before.rows(&moved.before), frame.current.rows(&object.transform));
                let push = VelocityPush { before: was.place, distance: is.distance, distance_before: was.distance };
                context.push(self.layout.raw, STAGES, &push);
                meshes.draw(object, moved.draw.level, None, moved.draw.instances());
            }
        }
    }
}
