//! LIGHTING, light by light: after LIGHTING's own triangle (ambient and directional light) each light is a draw, added by blending: cut
//! to a rectangle of pixels (`per-light`), or as a sphere or cone in space (`volumes`).

use ash::vk;

use super::screen::{InputSet, add, stages};
use super::{Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, needed};
use crate::gpu::{self, DepthState, GraphicsPipeline, GraphicsPipelineDesc, Owned, pipeline_layout};
use crate::gpu_scene::{POSITION, VERTEX_READ, vertex_input};
use crate::plan::{Extras, FramePlan, Shading};
use crate::scene::LightPath;
use crate::shaders::per_light::{self as shader, Flags, constants};
use crate::visible::{LightRect, LightWork};

/// Bytes of the push constant: the light's index.
const PUSH_BYTES: u32 = 4;
const _: () = assert!(shader::push::SIZE == PUSH_BYTES as usize);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("PER_LIGHT"),
    time: "lighting",
    what: "adds lights one by one, in LIGHTING's subpass",
    presence: |plan| {
        let why = match plan.light_path {
            LightPath::Volumes => "each light of limited reach is a draw, added by blending",
            _ => "each point light, spot and beam is a draw, added by blending",
        };
        Presence::when(plan.adds_lights(), why, "no light is drawn by itself")
    },
    // LIGHTING, whose subpass it draws in, declares the attachments.
    touches: |plan| {
        plan.uploads.volumes.then_some(ResourceUse::resource(Resource::Vertices, VERTEX_READ)).into_iter().collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(PerLightPass::new(own)?))),
};

/// The pass. It draws inside LIGHTING's subpass.
pub struct PerLightPass {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    pub inputs: InputSet,
}

impl PerLightPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, .. } = own;
        let inputs = InputSet::new(device, "G-buffer inputs light by light", &own.inputs())?;
        let flags = flags(plan);
        let volume = plan.light_path == LightPath::Volumes;
        let shader = needed("per_light", shader::variant, flags)?;
        let mut sets = vec![layouts.frame, inputs.set_layout.raw];
        sets.extend(layouts.shadows);
        let range = vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::FRAGMENT, offset: 0, size: PUSH_BYTES };
        let layout =
            pipeline_layout(device, "per light", &sets, if volume { &[] } else { std::slice::from_ref(&range) })?;
        let (vertex_bindings, vertex_attributes) =
            vertex_input(if volume { &[POSITION] } else { &[] }, Extras::default());
        let pipeline = GraphicsPipeline::new(
            device,
            &GraphicsPipelineDesc {
                name: "per light",
                stages: &stages(shader, &constants_of(plan)),
                vertex_bindings: &vertex_bindings,
                vertex_attributes: &vertex_attributes,
                // ANCHOR: volume-depth
                // The back of a volume is there also when the camera stands inside.
                cull_mode: if volume { vk::CullModeFlags::FRONT } else { vk::CullModeFlags::NONE },
                front_face: vk::FrontFace::COUNTER_CLOCKWISE,
                // Reversed Z: surfaces before the back of the volume, or before infinity.
                depth: Some(DepthState { test: vk::CompareOp::LESS, write: false }),
                // ANCHOR_END: volume-depth
                depth_bias: false,
                depth_clamp: false,
                blend: &[add()],
                samples: vk::SampleCountFlags::TYPE_1,
                layout: layout.raw,
                place: own.slot()?,
            },
        )?;
        Ok(Self { layout, pipeline, inputs })
    }

    fn draw_rect(&self, context: &FrameContext, rect: &LightRect) {
        let [x, y] = rect.offset.map(|edge| edge as i32);
        let [width, height] = rect.extent;
        let rectangle = vk::Rect2D { offset: vk::Offset2D { x, y }, extent: vk::Extent2D { width, height } };
        let scissor = context.drawn_part(rectangle);
        context.push(self.layout.raw, vk::ShaderStageFlags::FRAGMENT, &rect.light);
        // SAFETY: the pipeline is bound and its scissor dynamic; the vertex stage makes its three vertices from their index.
        unsafe {
            context.device.raw.cmd_set_scissor(context.cmd, 0, &[scissor]);
            context.device.raw.cmd_draw(context.cmd, 3, 1, 0, 0);
        }
    }
}

impl PassRecorder for PerLightPass {
    /// Adds the lights. Runs inside LIGHTING's subpass, after its triangle.
    fn record(&self, context: &FrameContext) {
        // Without opaque surfaces in view, every depth is the sky's, and no light passes the depth test.
        if context.visible.draws.is_empty() && context.culling.is_none() {
            return;
        }
        context.bind_pipeline(self.pipeline.raw);
        context.bind_set(self.layout.raw, 0, context.frame_set);
        context.bind_set(self.layout.raw, 1, self.inputs.set);
        if let Some(shadow_set) = context.shadow_set {
            context.bind_set(self.layout.raw, 2, shadow_set);
        }
        match (&context.visible.lights, &context.scene.volumes) {
            (LightWork::Draws(rects), _) => rects.iter().for_each(|rect| self.draw_rect(context, rect)),
            (LightWork::Volumes(volumes), Some(meshes)) => {
                let spheres = volumes.spheres as u32;
                let cones = volumes.records.len() as u32 - spheres;
                // SAFETY: pipeline and sets are bound; the buffer was made for vertices and holds both meshes, one after the other; the
                // instances lie inside the list that this frame's set names.
                unsafe {
                    let raw = &context.device.raw;
                    raw.cmd_bind_vertex_buffers(context.cmd, POSITION, &[meshes.corners.raw], &[0]);
                    if spheres > 0 {
                        raw.cmd_draw(context.cmd, meshes.sphere, spheres, 0, 0);
                    }
                    if cones > 0 {
                        raw.cmd_draw(context.cmd, meshes.cone, cones, meshes.sphere, spheres);
                    }
                }
            }
            // No light reaches anything that is seen.
            _ => {}
        }
        context.set_area();
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::VOLUME.when(plan.light_path == LightPath::Volumes)
        | Flags::UNIFORM_BUFFER.when(plan.lights.uniform)
        | Flags::SHADOW.when(plan.has_light_maps())
        | gbuffer_flags!(plan)
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    light_constants!(plan).to_vec()
}
