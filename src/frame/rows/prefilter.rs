//! The rows of PREFILTER, which computes once the light that surfaces collect of the sky.

use ash::vk;

use super::{Endpoint, Row, RowName, Rows, barrier, waits};
use crate::frame::list::Step;
use crate::gpu::sync::Use;
use crate::passes::Resource;
use crate::passes::prefilter::{self, PrefilterOrder};
use crate::plan::FramePlan;

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    pub const SKY_LIGHT_TO_PREFILTER: Self = Self::Own("sky-light-to-prefilter");
    pub const PREFILTER_TO_LIGHTING: Self = Self::Own("prefilter-to-lighting");
}

/// Returns no rows if no pass reads the light.
pub(super) fn rows(plan: &FramePlan, steps: &[Step]) -> Vec<Row> {
    let Some((reader, read)) = waits::readers(plan, steps, Resource::SkyLight) else { return Vec::new() };
    let (written, readable) = (vk::ImageLayout::GENERAL, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    vec![
        barrier(RowName::SKY_LIGHT_TO_PREFILTER, vk::ImageLayout::UNDEFINED, written)
            .from(Endpoint::OUTSIDE, &[Use::START])
            .to(Endpoint::PREFILTER, &[prefilter::LIGHT_WRITE])
            .because("the image is new: there is nothing to wait for, but its layout changes before the write"),
        barrier(RowName::PREFILTER_TO_LIGHTING, written, readable)
            .from(Endpoint::PREFILTER, &[prefilter::LIGHT_WRITE])
            .to(reader, &[read])
            .because("surfaces sample what PREFILTER wrote, in every frame after it; its layout changes in between"),
    ]
}

impl Rows {
    /// The rows that PREFILTER is submitted with; `None` where no sky lights the scene.
    pub(in crate::frame) fn prefilter_order(&self) -> Option<PrefilterOrder> {
        let begin = self.find(RowName::SKY_LIGHT_TO_PREFILTER)?.order();
        let readable = self.find(RowName::PREFILTER_TO_LIGHTING)?.order();
        Some(PrefilterOrder { begin, readable, layouts: self.layouts, sync: self.sync })
    }
}
