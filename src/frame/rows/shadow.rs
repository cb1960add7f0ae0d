//! The rows of the clear that the shadow maps' image begins with.

use ash::vk;

use super::{PassName, Row, RowName, Rows, barrier, waits};
use crate::frame::list::Step;
use crate::gpu::sync::Use;
use crate::gpu_scene::{ATLAS_LAYOUT, ClearOrder, shadow_clear};
use crate::passes::{Resource, shadow};
use crate::plan::FramePlan;

impl RowName {
    pub(crate) const SHADOW_ATLAS_TO_CLEAR: Self = Self::Own("shadow-atlas-to-clear");
    pub(crate) const CLEAR_TO_SHADOW_MAPS: Self = Self::Own("clear-to-shadow-maps");
}

const CLEARED: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

/// None where the plan has no maps.
pub(super) fn rows(plan: &FramePlan, steps: &[Step]) -> Vec<Row> {
    if plan.shadow.is_none() {
        return Vec::new();
    }
    // SHADOW waits for readers, and so for the clear as well.
    let readers = waits::readers(plan, steps, Resource::ShadowMaps);
    let (reader, map_read) = readers.unwrap_or((shadow::PASS.place, shadow::MAP_CLEAR));
    vec![
        barrier(RowName::SHADOW_ATLAS_TO_CLEAR, vk::ImageLayout::UNDEFINED, CLEARED)
            .from(PassName::OUTSIDE, &[Use::START])
            .to(PassName::CLEAR, &[shadow_clear::WRITE])
            .because("the image is new: there is nothing to wait for, but its layout changes before the write"),
        barrier(RowName::CLEAR_TO_SHADOW_MAPS, CLEARED, ATLAS_LAYOUT)
            .from(PassName::CLEAR, &[shadow_clear::WRITE])
            .to(reader, &[map_read])
            .because("a map that no frame has drawn yet is sampled, or drawn by SHADOW, which waits for samplers"),
    ]
}

impl Rows {
    /// The rows that the atlas is made with; `None` without shadow maps.
    pub(in crate::frame) fn clear_order(&self) -> Option<ClearOrder> {
        let clear = self.find(RowName::SHADOW_ATLAS_TO_CLEAR)?.order();
        Some(ClearOrder { clear, look_up: self.find(RowName::CLEAR_TO_SHADOW_MAPS)?.order() })
    }
}
