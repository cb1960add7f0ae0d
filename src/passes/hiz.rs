//! HIZ: the nearest and the farthest depth of squares of the picture, in five sizes of squares, so that a ray takes long steps where nothing is.

use ash::vk;

use super::per_pixel::PerPixelPass;
use super::{Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, ResourceUse, needed};
use crate::gpu::{self, sync::Use};
use crate::plan::{HIZ, Hiz, Target};
use crate::shaders::group_edge;
use crate::shaders::hiz::{self as shader, Flags};

/// Reads the depth of each pixel.
pub const GBUFFER_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes every square.
pub const HIZ_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("HIZ"),
    time: "depth pyramid",
    what: "the nearest and the farthest depth of squares of the picture",
    presence: |plan| {
        Presence::when(plan.reflects(), "rays take long steps where nothing is", plan.reasons.lack_of("reflections"))
    },
    touches: |_| {
        vec![
            ResourceUse::sampled(0, Target::Depth, GBUFFER_READ).because("reads the depth of each pixel"),
            ResourceUse::storage(1, HIZ, HIZ_WRITE).because("writes the depths of squares"),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(HizPass::new(own)?))),
};

pub struct HizPass {
    pass: PerPixelPass,
    tiles: [u32; 2],
}

impl HizPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let shader = needed("hiz", shader::variant, Flags::NONE)?;
        Ok(Self { pass: PerPixelPass::new(own, ("hiz", shader), &[])?, tiles: Hiz::of(own.plan.size).tiles })
    }
}

impl PassRecorder for HizPass {
    /// Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        // A work group for each tile.
        self.pass.dispatch(context, self.tiles.map(|count| count * group_edge(shader::WORKGROUP_SIZE)));
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.tiles = Hiz::of(own.plan.size).tiles;
        self.pass.rebind(own)
    }
}
