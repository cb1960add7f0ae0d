//! FORWARD: opaque surfaces, lit while they are rasterized, in GEOMETRY's and LIGHTING's place.

use std::sync::Arc;

use ash::vk;

use super::screen::replace;
use super::surface::{Limits, LitDesc, Surfaces, lit_pipeline};
use super::{First, Pass, Place, Presence, Recording, SetLayouts, Slot, Touch, frame_data, maps, meshes};
use crate::gpu::{self, DepthState, Device, sync::Use};
use crate::gpu_scene::GpuScene;
use crate::plan::{FramePlan, GeometryKey};
use crate::shaders::forward::Flags;

/// Clears, tests and writes depth, DEPTH before it in the same subpass too: early, and late where a mask may discard. Its store is a late
/// write.
pub const DEPTH_TEST: Use =
    Use::new(vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ)
        .or(Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE));
/// Clears depth, before it is used.
pub const DEPTH_CLEAR: Use =
    Use::new(vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Drops depth as its last user; DONT_CARE counts as a write.
pub const DEPTH_DROP: Use =
    Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Writes the light target; its clear is a write too.
pub const LIGHT_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);

/// Looks shadow maps up.
pub const MAP_READ: Use = Use::new(vk::PipelineStageFlags::FRAGMENT_SHADER, vk::AccessFlags::SHADER_READ);

pub const PASS: Pass = Pass {
    place: Place::pass("FORWARD"),
    time: "forward",
    what: "surfaces, lit while they are rasterized",
    presence: |plan| {
        Presence::when(plan.is_forward(), "surfaces are lit as they are drawn", "the light path has a G-buffer")
    },
    touches: |plan| {
        let drawn = [
            Touch::depth(First::Clear, DEPTH_TEST),
            Touch::color(0, plan.light_target(), First::Clear, LIGHT_WRITE),
            frame_data(),
        ];
        drawn.into_iter().chain(meshes(plan)).chain(maps(plan, MAP_READ)).collect()
    },
    leave_out: None,
};

/// The pass: a pipeline for each [`GeometryKey`] of the plan.
pub struct Forward {
    surfaces: Surfaces,
    after_prepass: bool,
}

impl Forward {
    /// `layouts` are those of set 0 and, where the plan has shadow maps, of set 2.
    ///
    /// # Errors
    /// When a pipeline cannot be made.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: Slot,
        layouts: SetLayouts,
        scene: &GpuScene,
    ) -> gpu::Result<Self> {
        let mut surfaces = Surfaces::new(device, plan, ("forward", &plan.geometry), layouts, scene)?;
        for &key in &plan.geometry {
            let desc = LitDesc {
                name: "forward",
                weighted: Flags::NONE,
                limits: Limits::unweighted(plan.largest_light(), 0.0),
                masked: key.discards,
                depth: depth_state(plan, key),
                blend: &[replace()],
            };
            let pipeline = lit_pipeline(device, plan, slot, key, surfaces.layout(key), &desc)?;
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

/// Reversed Z. After a depth pre-pass only what it left visible is equal to its depth; masked surfaces were not in it.
fn depth_state(plan: &FramePlan, key: GeometryKey) -> DepthState {
    match plan.depth_prepass && !key.masked {
        true => DepthState { test: vk::CompareOp::EQUAL, write: false },
        false => DepthState { test: vk::CompareOp::GREATER, write: true },
    }
}

/// Which variant of the shader a pipeline of the plan takes.
#[cfg(test)]
pub(crate) fn flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    super::surface::lit_flags(plan, key)
}
