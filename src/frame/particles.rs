//! SIMULATE and SORT, before the passes that draw, and PARTICLES among those.

use super::edges::{Edge, RowName};
use super::list::{self, Occasion, Step};
use super::render_passes::RenderPasses;
use super::{FrameParts, IN_FLIGHT};
use crate::gpu::{self, Buffer, Timestamps, barrier};
use crate::gpu_scene::ParticleBuffers;
use crate::passes::particles::{self, ParticlePass};
use crate::passes::simulate::{self, Simulate};
use crate::passes::sort::{self, Sort};
use crate::passes::{Recording, Resource};
use crate::plan::FramePlan;
use crate::visible::Particles;

/// The three passes with the rows of the barriers around them.
pub struct ParticleStage {
    simulate: Simulate,
    sort: Option<Sort>,
    draw: ParticlePass,
    reuse: Option<Edge>,
    to_sort: Option<Edge>,
    step: Option<Edge>,
    to_draw: Option<Edge>,
}

/// The steps before those that draw. A step of SORT after another: all but the first wait alike.
pub(super) fn steps(plan: &FramePlan) -> [Option<Step>; 3] {
    let particles = Resource::Particles;
    let drawn = [(RowName::PARTICLES_TO_DRAW, particles)];
    let after: &[_] = if plan.sorts_particles() { &[] } else { &drawn };
    let step = |pass, row, after| list::commands(plan, Occasion::Always, pass, &[(row, particles)], after);
    [
        step(&simulate::PASS, RowName::PARTICLES_REUSE, after),
        step(&sort::PASS, RowName::SIMULATE_TO_SORT, &[]),
        step(&sort::PASS, RowName::SORT_TO_SORT, &drawn),
    ]
}

impl ParticleStage {
    /// Returns none if the plan has no particles.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Self>> {
        let (&FrameParts { device, plan, edges, frame_layout, scene, .. }, layouts) = (parts, parts.layouts());
        let Some(planned) = &plan.particles else { return Ok(None) };
        let simulate = Simulate::new(device, (plan, planned), layouts, IN_FLIGHT)?;
        let slot = passes.needed_slot(&particles::PASS)?;
        let buffers = (&simulate.buffers, scene.particles.as_ref());
        let inputs = passes.inputs(&particles::PASS, plan);
        let row = |name| edges.find(name).cloned();
        Ok(Some(Self {
            sort: simulate.buffers.keys.as_ref().map(|keys| Sort::new(device, keys)).transpose()?,
            draw: ParticlePass::new(device, (plan, planned), (slot, frame_layout), buffers, &inputs)?,
            reuse: row(RowName::PARTICLES_REUSE),
            to_sort: row(RowName::SIMULATE_TO_SORT),
            step: row(RowName::SORT_TO_SORT),
            to_draw: row(RowName::PARTICLES_TO_DRAW),
            simulate,
        }))
    }

    /// Makes the descriptor set anew that names images of the picture's size.
    ///
    /// # Errors
    /// When there is no memory for a set.
    pub fn rebind(&mut self, parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<()> {
        self.draw.inputs.read_from(parts.device, &passes.inputs(&particles::PASS, parts.plan))
    }

    /// Writes the emitters of a frame in flight. The frame that used them before must be done.
    ///
    /// # Errors
    /// When mapped memory cannot be flushed.
    pub fn write(&self, place: usize, particles: &Particles) -> gpu::Result<()> {
        self.simulate.write(place, particles)
    }

    /// Records SIMULATE and SORT, outside a render pass.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let ParticleBuffers { states, keys } = &self.simulate.buffers;
        let count = frame.visible.particles.count;
        let barrier = |row: &Option<Edge>, buffer: Option<&Buffer>| {
            if let (Some(row), Some(buffer)) = (row, buffer.filter(|_| count > 0)) {
                barrier::buffer_barrier(frame.device, frame.cmd, buffer, row.order());
            }
        };
        let places = if keys.is_some() { sort::places(count) } else { 0 };
        frame.begin(&simulate::PASS);
        // PARTICLES of the last frame may still fetch the overwritten values.
        barrier(&self.reuse, Some(states));
        barrier(&self.reuse, keys.as_ref());
        if count > 0 {
            self.simulate.record(frame, places);
        }
        frame.end(times, &simulate::PASS);
        if let Some(sort) = &self.sort {
            frame.begin(&sort::PASS);
            // It orders the keys that SIMULATE wrote.
            barrier(&self.to_sort, keys.as_ref());
            if count > 0 {
                // Each step reads what the one before it wrote.
                sort.record(frame, places, || barrier(&self.step, keys.as_ref()));
            }
            frame.end(times, &sort::PASS);
        }
        // PARTICLES fetches them in their order.
        barrier(&self.to_draw, Some(states));
        barrier(&self.to_draw, keys.as_ref());
    }

    /// Records PARTICLES, inside its subpass.
    pub fn draw(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        frame.begin(&particles::PASS);
        self.draw.record(frame);
        frame.end(times, &particles::PASS);
    }
}
