//! Shared by the passes that draw depth alone. Masked surfaces are left out: their texture cuts the holes, and the pass that shades samples it
//! anyway. So are points and lines, which hide next to nothing.

use std::collections::BTreeMap;

use ash::vk;

use super::screen::stages;
use super::{FrameContext, Making, MeshDraws, needed};
use crate::gpu::{self, DepthState, GraphicsPipeline, GraphicsPipelineDesc, Owned, pipeline_layout};
use crate::gpu_scene::{POSITION, ROWS, vertex_input};
use crate::plan::{Extras, GeometryKey};
use crate::shaders::depth::{self as shader, Flags};
use crate::visible::Draw;

/// The drawn faces, which are all that sets pipelines apart.
type CullModeKey = (bool, bool);

fn cull_key(key: &GeometryKey) -> CullModeKey {
    // Two-sided pipelines cull nothing, so the winding does not matter.
    (key.two_sided, key.mirrored && !key.two_sided)
}

/// A pipeline for the faces of each opaque [`GeometryKey`] of a plan.
pub struct DepthOnly {
    layout: Owned<vk::PipelineLayout>,
    pipelines: BTreeMap<CullModeKey, Owned<vk::Pipeline>>,
}

impl DepthOnly {
    /// `colors`: the colour locations of the subpass, none of which is written.
    pub fn new(own: &Making, name: &str, colors: u32) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let layout = pipeline_layout(device, &format!("{name} layout"), &[own.layouts.frame], &[])?;
        let variant = needed("depth", shader::variant, Flags::NONE)?;
        let (vertex_bindings, vertex_attributes) =
            vertex_input(&[POSITION, ROWS, ROWS + 1, ROWS + 2], Extras::default());
        let blend = vec![vk::PipelineColorBlendAttachmentState::default(); colors as usize];
        let mut pipelines = BTreeMap::new();
        for key in plan.geometry.iter().filter(|key| key.is_in_prepass()) {
            let (two_sided, mirrored) = cull_key(key);
            if pipelines.contains_key(&(two_sided, mirrored)) {
                continue;
            }
            let pipeline = GraphicsPipeline::new(
                device,
                &GraphicsPipelineDesc {
                    name: &format!("{name}, two-sided {two_sided}, mirrored {mirrored}"),
                    stages: &stages(variant, &[]),
                    vertex_bindings: &vertex_bindings,
                    vertex_attributes: &vertex_attributes,
                    cull_mode: if two_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK },
                    front_face: if mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE },
                    // Reversed Z.
                    depth: Some(DepthState { test: vk::CompareOp::GREATER, write: true }),
                    depth_bias: false,
                    depth_clamp: false,
                    blend: &blend,
                    samples: plan.sample_count(),
                    layout: layout.raw,
                    place: own.slot()?,
                },
            )?;
            pipelines.insert((two_sided, mirrored), pipeline);
        }
        Ok(Self { layout, pipelines })
    }

    /// Draws the opaque objects of some instances. Runs inside the subpass of the pipelines.
    pub fn record(&self, context: &FrameContext, draws: &[Draw]) {
        context.set_area();
        let mut meshes = MeshDraws::new(context, &[POSITION]);
        context.bind_set(self.layout.raw, 0, context.frame_set);
        let mut bound = None;
        for draw in draws {
            let object = &context.world.objects[draw.object];
            // There is one for each opaque key of the plan.
            let Some(pipeline) = self.pipelines.get(&cull_key(&object.key)).filter(|_| object.key.is_in_prepass())
            else {
                continue;
            };
            if bound != Some(pipeline.raw) {
                context.bind_pipeline(pipeline.raw);
                bound = Some(pipeline.raw);
            }
            meshes.draw(object, draw.level, None, draw.instances());
        }
    }
}
