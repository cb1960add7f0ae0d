//! AO: ambient occlusion on the screen. The share of light from everywhere that surfaces nearby leave to each pixel, or to one of four, from the
//! stored depth and normals.

use ash::vk;

use super::per_pixel::PerPixelPass;
use super::{Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, ResourceUse, frame_data, needed};
use crate::gpu::{self, sync::Use};
use crate::plan::{FramePlan, Target, VISIBILITY};
use crate::scene::AmbientOcclusion;
use crate::shaders::ao::{self as shader, Flags, constants};

/// Reads depth and normals of the pixel and of its neighbours.
pub const GBUFFER_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes every texel.
pub const VISIBILITY_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

const READS: &str = "reads depth and normals of its pixel and of others";

pub const PASS: Pass = Pass {
    name: Endpoint::pass("AO"),
    time: "ao",
    what: "what surfaces nearby leave of the light from everywhere, found in the depth buffer",
    presence: |plan| match &plan.effects.ao {
        Some(ao) => Presence::In(ao.to_string()),
        None => Presence::Out(plan.reasons.lack_of("ambient occlusion").into()),
    },
    touches: |_| {
        vec![
            ResourceUse::sampled(0, Target::Depth, GBUFFER_READ).because(READS),
            ResourceUse::sampled(1, Target::Normal, GBUFFER_READ).because(READS),
            ResourceUse::storage(2, VISIBILITY, VISIBILITY_WRITE).because("writes every texel"),
            frame_data(),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(AoPass::new(own)?))),
};

pub struct AoPass {
    pass: PerPixelPass,
    size: [u32; 2],
}

impl AoPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let shader = needed("ao", shader::variant, flags(own.plan))?;
        let pass = PerPixelPass::new(own, ("ao", shader), &constants_of(own.plan))?;
        Ok(Self { pass, size: own.plan.extent_of(VISIBILITY) })
    }
}

impl PassRecorder for AoPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        self.pass.dispatch(context, self.size);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.size = own.plan.extent_of(VISIBILITY);
        self.pass.rebind(own)
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    let uint = plan.gbuffer.as_ref().is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT);
    Flags::NORMAL_UINT.when(uint)
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let Some(ao) = &plan.effects.ao else { return Vec::new() };
    let [slices, steps] = ao.slices();
    vec![
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::NORMAL_ENCODING, plan.gbuffer.as_ref().map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::RADIUS, ao.radius.to_bits()),
        (constants::SCALE, ao.scale),
        (constants::SLICED, u32::from(ao.method == AmbientOcclusion::Bitmask)),
        (constants::SLICES, slices),
        (constants::STEPS, steps),
        (constants::SAMPLES, ao.samples),
    ]
}
