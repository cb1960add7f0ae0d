//! The rows of what the device finds to be seen.

use super::{Carrier, Edge, Place, RowName, row};
use crate::passes::{CULLED_READ, arrange, cull, fill};

impl RowName {
    /// Lets the last frame's draws read commands and rows before CULL, ARRANGE and FILL write them anew.
    pub const CULLED_REUSE: Self = Self("culled-reuse");
    pub(crate) const CULL_TO_ARRANGE: Self = Self("cull-to-arrange");
    pub(crate) const ARRANGE_TO_FILL: Self = Self("arrange-to-fill");
    pub(crate) const FILL_TO_DRAWS: Self = Self("fill-to-draws");
}

pub(super) fn rows() -> [Edge; 4] {
    [
        row(RowName::CULLED_REUSE, Carrier::BufferBarrier)
            // Readers already wait for what FILL wrote before, so waiting for the readers covers it.
            .from(Place::OUTSIDE, &[CULLED_READ])
            .to(cull::PASS.place, &[cull::MARK_WRITE])
            .because("frames share the culled instances: draws of the last one may still read what is overwritten"),
        row(RowName::CULL_TO_ARRANGE, Carrier::BufferBarrier)
            .from(cull::PASS.place, &[cull::MARK_WRITE])
            .to(arrange::PASS.place, &[arrange::COUNT])
            .because("ARRANGE adds up and replaces the numbers that CULL counted"),
        row(RowName::ARRANGE_TO_FILL, Carrier::BufferBarrier)
            .from(arrange::PASS.place, &[arrange::COUNT])
            .to(fill::PASS.place, &[fill::COUNT_READ, fill::DRAW_WRITE])
            .because("FILL puts rows where ARRANGE says, and CULL before it"),
        row(RowName::FILL_TO_DRAWS, Carrier::BufferBarrier)
            .from(fill::PASS.place, &[fill::DRAW_WRITE])
            .to(Place::DRAWS, &[CULLED_READ])
            .because("draws read their commands and the rows of their instances"),
    ]
}
