//! SCATTER and INTEGRATE, after the shadow maps and before the passes that draw.

use super::FrameParts;
use super::edges::{Edge, RowName};
use super::list::{self, Occasion, Step};
use crate::gpu::{self, Buffer, Timestamps, barrier};
use crate::gpu_scene::froxel_buffer;
use crate::passes::integrate::{self, Integrate};
use crate::passes::scatter::{self, Scatter};
use crate::passes::{Recording, Resource};
use crate::plan::FramePlan;

/// Both passes with their buffer, and the rows of the barriers around them.
pub struct FroxelStage {
    /// Set 0 names it.
    pub froxels: Buffer,
    scatter: Scatter,
    integrate: Integrate,
    reuse: Option<Edge>,
    to_integrate: Option<Edge>,
    to_fog: Option<Edge>,
}

/// The steps before those that draw.
pub(super) fn steps(plan: &FramePlan) -> [Option<Step>; 2] {
    let step = |pass, row, after: &[(RowName, Resource)]| {
        list::commands(plan, Occasion::Always, pass, &[(row, Resource::Froxels)], after)
    };
    [
        step(&scatter::PASS, RowName::FROXELS_REUSE, &[]),
        step(&integrate::PASS, RowName::SCATTER_TO_INTEGRATE, &[(RowName::FROXELS_TO_FOG, Resource::Froxels)]),
    ]
}

impl FroxelStage {
    /// Returns none if the plan has no froxels.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts) -> gpu::Result<Option<Self>> {
        let (&FrameParts { device, plan, edges, frame_layout, .. }, layouts) = (parts, parts.layouts());
        let (Some(planned), Some(froxels)) = (plan.froxels(), froxel_buffer(device, plan)?) else { return Ok(None) };
        let row = |name| edges.find(name).cloned();
        Ok(Some(Self {
            froxels,
            scatter: Scatter::new(device, (plan, planned), layouts)?,
            integrate: Integrate::new(device, (plan, planned), frame_layout)?,
            reuse: row(RowName::FROXELS_REUSE),
            to_integrate: row(RowName::SCATTER_TO_INTEGRATE),
            to_fog: row(RowName::FROXELS_TO_FOG),
        }))
    }

    /// Records both, outside a render pass.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let barrier = |row: &Option<Edge>| {
            if let Some(row) = row {
                barrier::buffer_barrier(frame.device, frame.cmd, &self.froxels, row.order());
            }
        };
        frame.begin(&scatter::PASS);
        // The last frame may still look up the overwritten values.
        barrier(&self.reuse);
        self.scatter.record(frame);
        frame.end(times, &scatter::PASS);
        frame.begin(&integrate::PASS);
        // It adds up what SCATTER wrote.
        barrier(&self.to_integrate);
        self.integrate.record(frame);
        // FOG, TRANSPARENT and PARTICLES look both up.
        barrier(&self.to_fog);
        frame.end(times, &integrate::PASS);
    }
}
