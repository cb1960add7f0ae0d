//! INTEGRATE: the light that the fog before each froxel scatters to the eye, by compute, column by column.

use ash::vk;

use super::{
    Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, ResourceUse, air, compute_stage, frame_data,
};
use crate::gpu::{self, Owned, compute_pipeline, pipeline_layout, sync::Use};
use crate::shaders::group_edge;
use crate::shaders::integrate::{self as shader, Flags, constants};

/// Reads the light of each froxel.
pub const LIGHT_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes the light scattered before each froxel.
pub const SUM_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("INTEGRATE"),
    time: "integrate",
    what: "what the fog before each froxel scatters to the eye",
    presence: |plan| Presence::of(plan.froxels(), plan.lack_of_froxels()),
    touches: |_| {
        vec![
            frame_data(),
            ResourceUse::resource(air::LIGHT, LIGHT_READ.or(SUM_WRITE))
                .because("adds up the light of froxels, and writes its sums beside it"),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(IntegratePass::new(own)?))),
};

/// Edge of a work group in columns.
const GROUP: u32 = group_edge(shader::WORKGROUP_SIZE);

pub struct IntegratePass {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    groups: [u32; 2],
}

impl IntegratePass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let layout = pipeline_layout(device, "integrate", &[own.layouts.frame], &[])?;
        let [columns, rows, _] = own.needed(plan.froxels())?.grid;
        let own = [(constants::ORTHOGRAPHIC, u32::from(plan.orthographic))];
        let constants: Vec<_> = own.into_iter().chain(air::froxel_grid!(plan)).collect();
        let stage = compute_stage("integrate", shader::variant, Flags::NONE, &constants)?;
        let pipeline = compute_pipeline(device, "integrate", &stage, layout.raw)?;
        Ok(Self { layout, pipeline, groups: [columns, rows].map(|edge| edge.div_ceil(GROUP)) })
    }
}

impl PassRecorder for IntegratePass {
    /// Runs outside any render pass, after SCATTER.
    fn record(&self, context: &FrameContext) {
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: `cmd` is being recorded outside a render pass; the set is of the layout, and the pass outlives the submission. The shader looks at
        // no froxel beyond the plan's grid and the slice after it.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[context.frame_set], &[]);
            raw.cmd_dispatch(cmd, self.groups[0], self.groups[1], 1);
        }
    }
}
