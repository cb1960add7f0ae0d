//! The rows of a frame that a compute pass lights.

use ash::vk;

use super::{Carrier, Edge, Place, RowName};
use crate::frame::list::MAIN_PASS;
use crate::passes::{copy, geometry, tiled};

impl RowName {
    pub(crate) const GBUFFER_TO_TILED: Self = Self("gbuffer-to-tiled");
}

/// The main pass ends with GEOMETRY; a compute pass reads what it stored and writes the output.
pub(super) fn rows() -> [Edge; 4] {
    // None is by region: a work group reads pixels that other fragments wrote.
    let row = |name, carrier, places, before, after, why| Edge::new(name, carrier, places, (before, after), why);
    [
        row(
            RowName::GBUFFER_REUSE,
            Carrier::Subpass(MAIN_PASS),
            (Place::OUTSIDE, geometry::PASS.place),
            tiled::GBUFFER_READ,
            geometry::DEPTH_CLEAR.or(geometry::COLOR_WRITE),
            "frames in flight share the targets: TILED of the last frame must have read what this one overwrites",
        ),
        row(
            RowName::GBUFFER_TO_TILED,
            Carrier::Subpass(MAIN_PASS),
            (geometry::PASS.place, tiled::PASS.place),
            geometry::DEPTH_STORE.or(geometry::COLOR_WRITE),
            tiled::GBUFFER_READ,
            "TILED reads what GEOMETRY stored, in the layout that the pass leaves it in",
        ),
        row(
            RowName::OUTPUT_REUSE,
            Carrier::ImageBarrier(vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL),
            (Place::OUTSIDE, tiled::PASS.place),
            copy::READ,
            tiled::OUTPUT_WRITE,
            "the last picture may still be copied when this one is written",
        ),
        row(
            RowName::READ_BACK,
            Carrier::ImageBarrier(vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
            (tiled::PASS.place, Place::OUTSIDE),
            tiled::OUTPUT_WRITE,
            copy::READ,
            "COPY reads the picture that TILED wrote",
        ),
    ]
}
