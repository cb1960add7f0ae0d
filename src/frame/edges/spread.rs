//! The rows of BLOOM and SPREAD, and of the render pass that goes on after them.

use ash::vk;

use super::main_pass::output_reader;
use super::taa::of_sharpen_pass;
use super::{Carrier, Edge, Place, RowName, barrier, row, subpass};
use crate::frame::list::TONEMAP_PASS;
use crate::gpu::sync::Use;
use crate::passes::{bloom, tonemap};
use crate::plan::FramePlan;

impl RowName {
    pub(crate) const HDR_TO_BLOOM: Self = Self("hdr-to-bloom");
    /// Lets the last frame's TONEMAP read the levels before BLOOM writes them anew.
    pub const BLOOM_REUSE: Self = Self("bloom-reuse");
    pub(crate) const BLOOM_TO_SPREAD: Self = Self("bloom-to-spread");
    pub(crate) const SPREAD_TO_SPREAD: Self = Self("spread-to-spread");
    pub(crate) const SPREAD_TO_TONEMAP: Self = Self("spread-to-tonemap");
}

/// `light` is how the last subpass writes the light.
pub(super) fn bloom_rows(plan: &FramePlan, (last_light, light): (Place, Use)) -> [Edge; 5] {
    let (spread, levels) = (bloom::SPREAD.place, [bloom::LEVEL_READ, bloom::LEVEL_WRITE]);
    [
        // Not by region: a work group reads pixels that other fragments wrote.
        match plan.blooms_reflected() {
            true => barrier(RowName::HDR_TO_BLOOM, vk::ImageLayout::GENERAL, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
                .from(last_light, &[light])
                .to(bloom::PASS.place, &[bloom::HDR_READ])
                .because("BLOOM loads the light of a pixel and its neighbours, to which REFLECT_RESOLVE has added"),
            false => of_sharpen_pass(
                plan,
                subpass(RowName::HDR_TO_BLOOM)
                    .from(last_light, &[light])
                    .to(bloom::PASS.place, &[bloom::HDR_READ])
                    .because("BLOOM loads the light of a pixel and its neighbours, in the layout that the main pass leaves it in"),
            ),
        },
        row(RowName::BLOOM_REUSE, Carrier::BufferBarrier)
            // TONEMAP already waits for what SPREAD wrote before, so waiting for TONEMAP covers it.
            .from(Place::OUTSIDE, &[tonemap::LEVEL_READ])
            .to(bloom::PASS.place, &[bloom::LEVEL_WRITE])
            .because("frames share the levels: TONEMAP of the last one may still read what is overwritten"),
        row(RowName::BLOOM_TO_SPREAD, Carrier::BufferBarrier)
            .from(bloom::PASS.place, &[bloom::LEVEL_WRITE])
            .to(spread, &levels)
            .because("SPREAD reads the first level, and changes it on its way back"),
        row(RowName::SPREAD_TO_SPREAD, Carrier::BufferBarrier)
            .from(spread, &[bloom::LEVEL_WRITE])
            .to(spread, &levels)
            .because("each step reads the level that the one before it wrote, and on the way back changes another"),
        row(RowName::SPREAD_TO_TONEMAP, Carrier::Subpass(TONEMAP_PASS))
            .from(spread, &[bloom::LEVEL_WRITE, bloom::HDR_READ, output_reader(plan)])
            .to(
                tonemap::PASS.place,
                &[
                    tonemap::LEVEL_READ,
                    tonemap::HDR_LOAD,
                    tonemap::HDR_READ,
                    tonemap::HDR_DROP,
                    tonemap::OUTPUT_WRITE,
                ],
            )
            .because(
                "TONEMAP reads the first level, loads the light that BLOOM has read and as the last user drops it, and the \
                 last picture may still be read when this one is drawn",
            ),
    ]
}
