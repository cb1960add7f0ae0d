//! SCATTER: the light in each of the fog's froxels, by compute: of lamps and the sun with their shadow maps, and ambient light.

use ash::vk;

use super::{
    Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, air, compute_stage,
    frame_data, light_maps,
};
use crate::gpu::{self, Buffer, Location, MemoryKind, Owned, SetLayout, compute_pipeline, pipeline_layout, sync::Use};
use crate::plan::{FramePlan, FroxelPlan};
use crate::scene::{Fog, ShadowFilter};
use crate::shaders::group_edge;
use crate::shaders::scatter::{self as shader, Flags, constants};

/// Writes the light of each froxel.
pub const LIGHT_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);
/// Looks shadow maps up.
pub const MAP_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SCATTER"),
    time: "scatter",
    what: "the light that each froxel of fog scatters",
    presence: |plan| Presence::of(plan.froxels(), plan.lack_of_froxels()),
    touches: |plan| {
        let light = ResourceUse::resource(air::LIGHT, LIGHT_WRITE).because("writes the light of each froxel");
        [frame_data(), light].into_iter().chain(light_maps(plan, MAP_READ)).collect()
    },
    leave_out: Some(|settings| settings.fog = Fog::Height),
    make: Some(|own| Ok(Box::new(ScatterPass::new(own)?))),
};

/// Edge of a work group in froxels.
const GROUP: u32 = group_edge(shader::WORKGROUP_SIZE);

pub struct ScatterPass {
    /// Set 0 names it.
    froxels: Buffer,
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    groups: [u32; 3],
    _empty: SetLayout,
}

impl ScatterPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, layouts, .. } = own;
        let planned = own.needed(plan.froxels())?;
        // Shadow maps are in set 2, and nothing is in set 1.
        let empty = SetLayout::new(device, "scatter, nothing", &[])?;
        let sets: Vec<_> = [layouts.frame, empty.raw].into_iter().chain(layouts.shadows).collect();
        let layout = pipeline_layout(device, "scatter", &sets, &[])?;
        let constants = constants_of(plan, planned);
        let stage = compute_stage("scatter", shader::variant, flags(plan), &constants)?;
        let pipeline = compute_pipeline(device, "scatter", &stage, layout.raw)?;
        let (bytes, usage) = (planned.bytes(), vk::BufferUsageFlags::STORAGE_BUFFER);
        let froxels = Buffer::new(device, "froxels of fog", bytes, usage, Location::Device, MemoryKind::Attachment)?;
        Ok(Self { froxels, layout, pipeline, groups: planned.grid.map(|edge| edge.div_ceil(GROUP)), _empty: empty })
    }
}

impl PassRecorder for ScatterPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        let [across, down, deep] = self.groups;
        // SAFETY: `cmd` is being recorded outside a render pass; the sets are those of the layout, and the pass outlives the submission. The shader
        // writes no froxel beyond the plan's grid, for which the buffer has room.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[context.frame_set], &[]);
            if let Some(shadows) = context.shadow_set {
                raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 2, &[shadows], &[]);
            }
            raw.cmd_dispatch(cmd, across, down, deep);
        }
    }

    fn buffers(&self) -> Vec<(Resource, &Buffer)> {
        vec![(air::LIGHT, &self.froxels)]
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::SHADOW.when(plan.has_light_maps())
}

fn constants_of(plan: &FramePlan, planned: &FroxelPlan) -> Vec<(u32, u32)> {
    // Wider filters turn from pixel to pixel, of which froxels know nothing.
    let filter = match plan.shadow.as_ref().map(|shadow| shadow.filter) {
        None | Some(ShadowFilter::None) => ShadowFilter::None,
        Some(_) => ShadowFilter::Box2,
    };
    let own = [
        (constants::SAMPLES, planned.samples),
        (constants::FALLOFF, plan.lights.falloff),
        (constants::TRAITS, plan.lights.traits),
        (constants::SHADOW_FILTER, filter as u32),
        (constants::DIRECTIONAL_SHADOWS, u32::from(plan.has_directional_shadows())),
        (constants::PUNCTUAL_SHADOWS, u32::from(plan.has_punctual_shadows())),
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::LARGEST, plan.largest_light().to_bits()),
    ];
    own.into_iter().chain(air::froxel_grid!(plan)).collect()
}
