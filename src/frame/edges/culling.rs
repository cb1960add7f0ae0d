//! The rows of culling on the device.

use super::{Carrier, Edge, Place, RowName, row};
use crate::frame::list::OCCLUDER_PASS;
use crate::passes::{CULLED_READ, arrange, copy, cull, fill, occluders, pyramid};

impl RowName {
    /// Lets the last frame's draws read commands and rows before CULL, ARRANGE and FILL write them anew.
    pub const CULLED_REUSE: Self = Self("culled-reuse");
    pub(crate) const CULL_TO_ARRANGE: Self = Self("cull-to-arrange");
    pub(crate) const ARRANGE_TO_FILL: Self = Self("arrange-to-fill");
    pub(crate) const FOUND_TO_HOST: Self = Self("found-to-host");
    pub(crate) const FILL_TO_DRAWS: Self = Self("fill-to-draws");
    pub(crate) const OCCLUDERS_REUSE: Self = Self("occluders-reuse");
    pub(crate) const OCCLUDERS_TO_PYRAMID: Self = Self("occluders-to-pyramid");
    pub(crate) const PYRAMID_REUSE: Self = Self("pyramid-reuse");
    pub(crate) const PYRAMID_TO_CULL: Self = Self("pyramid-to-cull");
}

pub(super) fn rows() -> [Edge; 5] {
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
        row(RowName::FOUND_TO_HOST, Carrier::BufferBarrier)
            .from(arrange::PASS.place, &[arrange::FOUND_WRITE])
            .to(Place::HOST, &[copy::HOST_READ])
            .because("a fence alone does not make the counts visible to the CPU"),
        row(RowName::FILL_TO_DRAWS, Carrier::BufferBarrier)
            .from(fill::PASS.place, &[fill::DRAW_WRITE])
            .to(Place::DRAWS, &[CULLED_READ])
            .because("draws read their commands and the rows of their instances"),
    ]
}

/// The rows of occlusion culling on the device.
pub(super) fn hiding_rows() -> [Edge; 4] {
    // None is by region: a work group reads pixels that other fragments wrote.
    [
        row(RowName::OCCLUDERS_REUSE, Carrier::Subpass(OCCLUDER_PASS))
            .from(Place::OUTSIDE, &[pyramid::DEPTH_READ])
            .to(occluders::PASS.place, &[occluders::DEPTH_CLEAR])
            .because("frames in flight share the target: PYRAMID of the last one must have read what this one clears"),
        row(RowName::OCCLUDERS_TO_PYRAMID, Carrier::Subpass(OCCLUDER_PASS))
            .from(occluders::PASS.place, &[occluders::DEPTH_STORE])
            .to(pyramid::PASS.place, &[pyramid::DEPTH_READ])
            .because("PYRAMID reads the depth that OCCLUDERS stored, in the layout that the pass leaves it in"),
        row(RowName::PYRAMID_REUSE, Carrier::BufferBarrier)
            // CULL already waits for what PYRAMID wrote before, so waiting for it covers that.
            .from(Place::OUTSIDE, &[cull::PYRAMID_READ])
            .to(pyramid::PASS.place, &[pyramid::PYRAMID_WRITE])
            .because("frames share the pyramid: CULL of the last one may still read what is overwritten"),
        row(RowName::PYRAMID_TO_CULL, Carrier::BufferBarrier)
            .from(pyramid::PASS.place, &[pyramid::PYRAMID_WRITE])
            .to(cull::PASS.place, &[cull::PYRAMID_READ])
            .because("CULL tests boxes against the least depths that PYRAMID found"),
    ]
}
