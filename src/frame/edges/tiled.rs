//! The rows of a frame that a compute pass lights.

use ash::vk;

use super::{Carrier, Edge, Place, RowName};
use crate::passes::{copy, geometry, tiled};

/// The main pass ends with GEOMETRY; a compute pass reads what it stored and writes the output.
pub(super) fn rows() -> [Edge; 4] {
    // None is by region: a work group reads pixels that other fragments wrote.
    let row = |name, carrier, places, before, after, why| Edge::new(name, carrier, places, (before, after), why);
    [
        row(
            RowName::GbufferReuse,
            Carrier::MainPass,
            (Place::Outside, Place::Geometry),
            tiled::GBUFFER_READ,
            geometry::DEPTH_CLEAR.or(geometry::COLOR_WRITE),
            "frames in flight share the targets: TILED of the last frame must have read what this one overwrites",
        ),
        row(
            RowName::GbufferToTiled,
            Carrier::MainPass,
            (Place::Geometry, Place::Tiled),
            geometry::DEPTH_STORE.or(geometry::COLOR_WRITE),
            tiled::GBUFFER_READ,
            "TILED reads what GEOMETRY stored, in the layout that the pass leaves it in",
        ),
        row(
            RowName::OutputReuse,
            Carrier::ImageBarrier(vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL),
            (Place::Outside, Place::Tiled),
            copy::READ,
            tiled::OUTPUT_WRITE,
            "the last picture may still be copied when this one is written",
        ),
        row(
            RowName::ReadBack,
            Carrier::ImageBarrier(vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
            (Place::Tiled, Place::Outside),
            tiled::OUTPUT_WRITE,
            copy::READ,
            "COPY reads the picture that TILED wrote",
        ),
    ]
}
