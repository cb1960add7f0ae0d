//! The rows of a frame that a compute pass lights.

use ash::vk;

use super::{Carrier, Edge, Place, RowName, barrier, row};
use crate::frame::list::MAIN_PASS;
use crate::passes::{copy, geometry, tiled};
use crate::plan::FramePlan;

impl RowName {
    pub(crate) const GBUFFER_TO_TILED: Self = Self("gbuffer-to-tiled");
}

/// The main pass ends with GEOMETRY; a compute pass reads what it stored and writes the output.
pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    // None is by region: a work group reads pixels that other fragments wrote.
    let mut rows = vec![
        row(RowName::GBUFFER_REUSE, Carrier::Subpass(MAIN_PASS))
            .from(Place::OUTSIDE, &[tiled::GBUFFER_READ])
            .to(geometry::PASS.place, &[geometry::DEPTH_CLEAR.or(geometry::COLOR_WRITE)])
            .because(
                "frames in flight share the targets: TILED of the last frame must have read what this one overwrites",
            ),
        row(RowName::GBUFFER_TO_TILED, Carrier::Subpass(MAIN_PASS))
            .from(geometry::PASS.place, &[geometry::DEPTH_STORE.or(geometry::COLOR_WRITE)])
            .to(tiled::PASS.place, &[tiled::GBUFFER_READ])
            .because("TILED reads what GEOMETRY stored, in the layout that the pass leaves it in"),
        barrier(RowName::OUTPUT_REUSE, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL)
            .from(Place::OUTSIDE, &[copy::READ])
            .to(tiled::PASS.place, &[tiled::OUTPUT_WRITE])
            .because("the last picture may still be copied when this one is written"),
        barrier(RowName::READ_BACK, vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
            .from(tiled::PASS.place, &[tiled::OUTPUT_WRITE])
            .to(Place::OUTSIDE, &[copy::READ])
            .because("COPY reads the picture that TILED wrote"),
    ];
    if plan.has_ao() {
        // The rows before AO make the same writes visible to TILED.
        rows.retain(|row| row.name != RowName::GBUFFER_TO_TILED);
    }
    rows
}
