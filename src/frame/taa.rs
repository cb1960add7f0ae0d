//! VELOCITY, TAA and SHARPEN: between the main pass, which stores light and depth, and the passes that finish the picture.

use ash::vk;

use super::FrameParts;
use super::edges::{Edge, RowName};
use super::list::{self, Occasion, SHARPEN_PASS, Step, VELOCITY_PASS};
use super::render_passes::{RenderPassIndex, RenderPasses};
use crate::gpu::{self, Timestamps, barrier};
use crate::passes::sharpen::{self, Sharpen};
use crate::passes::taa::{self, Taa};
use crate::passes::velocity::{self, Velocity};
use crate::passes::{Recording, Resource};
use crate::plan::FramePlan;

const INLINE: vk::SubpassContents = vk::SubpassContents::INLINE;

/// The passes with the row of the barrier between frames, and the render pass that goes on after TAA.
pub struct TaaStage {
    velocity: Option<(RenderPassIndex, Velocity)>,
    taa: Taa,
    sharpen: Sharpen,
    reuse: Option<Edge>,
    next: RenderPassIndex,
}

/// VELOCITY and TAA in a frame's list.
pub(super) fn steps(plan: &FramePlan) -> [Option<Step>; 2] {
    let velocity = list::subpass(plan, velocity::PASS.place, &[&velocity::PASS]);
    let reuse = [Resource::LastHistory, Resource::History].map(|history| (RowName::HISTORY_REUSE, history));
    [list::render_pass(VELOCITY_PASS, [velocity]), list::commands(plan, Occasion::Always, &taa::PASS, &reuse, &[])]
}

impl TaaStage {
    /// Returns none if the plan has no TAA.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, frame_layout, .. } = parts;
        let (Some(planned), Some(next)) = (&plan.taa, passes.find(SHARPEN_PASS)) else { return Ok(None) };
        let velocity = match (passes.find(VELOCITY_PASS), passes.slot(&velocity::PASS)) {
            (Some(pass), Some(slot)) => Some((pass, Velocity::new(device, plan, slot, frame_layout)?)),
            _ => None,
        };
        let taa = Taa::new(device, plan, planned, &passes.inputs(&taa::PASS, plan))?;
        let sharpen = Sharpen::new(device, plan, planned, passes.needed_slot(&sharpen::PASS)?, &taa.histories)?;
        Ok(Some(Self { velocity, taa, sharpen, reuse: edges.find(RowName::HISTORY_REUSE).cloned(), next }))
    }

    /// Makes the objects of the picture's size anew.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<()> {
        let &FrameParts { device, plan, .. } = parts;
        self.taa.resize(device, plan, &passes.inputs(&taa::PASS, plan))?;
        self.sharpen.read_from(device, &self.taa.histories)
    }

    /// Runs outside of a render pass, and begins the one that goes on with SHARPEN.
    pub fn record(&self, frame: &Recording, passes: &RenderPasses, times: &mut Option<Timestamps>) {
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);
        if let Some((pass, velocity)) = &self.velocity {
            // Rows `depth-to-velocity` and `velocity-reuse`: it tests against the depth that the main pass stored.
            frame.begin(&velocity::PASS);
            // SAFETY: outside a render pass; VELOCITY is its only subpass.
            unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, *pass), INLINE) };
            velocity.record(frame);
            // SAFETY: begun above, and its one subpass is recorded.
            unsafe { gpu.cmd_end_render_pass(cmd) };
            frame.end(times, &velocity::PASS);
        }
        frame.begin(&taa::PASS);
        // Rows `light-to-taa` and `velocity-to-taa` say when it may look at this frame. The last one left its history, and SHARPEN may still read that.
        if let Some(row) = &self.reuse {
            for history in &self.taa.histories {
                barrier::buffer_barrier(frame.device, cmd, history, row.order());
            }
        }
        self.taa.record(frame);
        frame.end(times, &taa::PASS);
        frame.begin(&sharpen::PASS);
        // Row `taa-to-sharpen`.
        // SAFETY: outside a render pass again; SHARPEN is the first subpass of the next.
        unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, self.next), INLINE) };
        self.sharpen.record(frame);
        frame.end(times, &sharpen::PASS);
    }
}
