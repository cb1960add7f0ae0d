//! The rows of particles: SIMULATE, SORT and PARTICLES share their states and keys, which all frames in flight have in common.

use super::{Carrier, Edge, Place, RowName, row};
use crate::gpu::sync::Use;
use crate::passes::{particles, simulate, sort, transparent};
use crate::plan::FramePlan;

impl RowName {
    /// Lets the last frame's PARTICLES fetch before SIMULATE writes anew.
    pub const PARTICLES_REUSE: Self = Self("particles-reuse");
    pub(crate) const SIMULATE_TO_SORT: Self = Self("simulate-to-sort");
    pub(crate) const SORT_TO_SORT: Self = Self("sort-to-sort");
    pub(crate) const PARTICLES_TO_DRAW: Self = Self("particles-to-draw");
}

/// The use by which TRANSPARENT's subpass reads depth besides its test, where particles are in it.
pub(super) fn depth(plan: &FramePlan) -> Option<Use> {
    plan.particles.as_ref().map(|_| particles::DEPTH_READ)
}

pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    let (sorted, keys) = (plan.sorts_particles(), [sort::KEY_READ, sort::KEY_WRITE]);
    let mut rows = vec![
        row(RowName::PARTICLES_REUSE, Carrier::BufferBarrier)
            // PARTICLES already waits for the earlier writes, so waiting for its fragments, which come after its vertices, covers it.
            .from(Place::OUTSIDE, &[particles::LAST_READ])
            .to(simulate::PASS.place, &[simulate::STATE_WRITE])
            .because("frames share the particles: PARTICLES of the last one may still fetch what SIMULATE overwrites"),
    ];
    if sorted {
        rows.extend([
            row(RowName::SIMULATE_TO_SORT, Carrier::BufferBarrier)
                .from(simulate::PASS.place, &[simulate::STATE_WRITE])
                .to(sort::PASS.place, &keys)
                .because("SORT puts the keys that SIMULATE wrote into their order"),
            row(RowName::SORT_TO_SORT, Carrier::BufferBarrier)
                .from(sort::PASS.place, &[sort::KEY_WRITE])
                .to(sort::PASS.place, &keys)
                .because("each step of the network compares keys that the step before it wrote"),
        ]);
    }
    let (from, wrote) = match sorted {
        true => (sort::PASS.place, sort::KEY_WRITE),
        false => (simulate::PASS.place, simulate::STATE_WRITE),
    };
    rows.push(
        row(RowName::PARTICLES_TO_DRAW, Carrier::BufferBarrier)
            .from(from, &[wrote])
            .to(transparent::PASS.place, &[particles::STATE_READ])
            .because("PARTICLES, in the subpass of TRANSPARENT, fetches what SIMULATE wrote, in the order in which SORT left it"),
    );
    rows
}
