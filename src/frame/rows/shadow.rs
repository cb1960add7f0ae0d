//! The rows of the clears that the images of shadow maps and of their tints begin with.

use ash::vk;

use super::{Endpoint, Row, RowName, Rows, barrier, waits};
use crate::frame::list::{Step, StepList, Subpass};
use crate::gpu::sync::Use;
use crate::gpu_scene::{ATLAS_LAYOUT, ClearOrder, ClearOrders, TINT_LAYOUT, shadow_clear};
use crate::passes::{Resource, ResourceUse, shadow, tint};
use crate::plan::FramePlan;

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    pub const SHADOW_ATLAS_TO_CLEAR: Self = Self::Own("shadow-atlas-to-clear");
    pub const CLEAR_TO_SHADOW_MAPS: Self = Self::Own("clear-to-shadow-maps");
    pub const SHADOW_TINTS_TO_CLEAR: Self = Self::Own("shadow-tints-to-clear");
    pub const CLEAR_TO_SHADOW_TINTS: Self = Self::Own("clear-to-shadow-tints");
}

const CLEARED: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

/// The names of the rows before and after the clear of an image.
type ClearRows = [RowName; 2];
const OF_MAPS: ClearRows = [RowName::SHADOW_ATLAS_TO_CLEAR, RowName::CLEAR_TO_SHADOW_MAPS];
const OF_TINTS: ClearRows = [RowName::SHADOW_TINTS_TO_CLEAR, RowName::CLEAR_TO_SHADOW_TINTS];

/// The images of a plan's maps, each with the rows of its clear.
pub fn images(plan: &FramePlan) -> impl Iterator<Item = (Resource, ClearRows)> {
    let planned = plan.shadow.as_ref();
    let tints = planned.filter(|own| own.tinted).map(|_| (Resource::SHADOW_TINTS, OF_TINTS));
    planned.map(|_| (Resource::SHADOW_MAPS, OF_MAPS)).into_iter().chain(tints)
}

/// The attachments of a render pass of maps with these subpasses: the images that they use. A map is a part of a layer that has others: it is readable
/// before the first of its render passes and after the last.
pub fn attachments(
    plan: &FramePlan,
    list: &StepList,
    listed: &[Subpass],
) -> Vec<(Resource, vk::AttachmentDescription)> {
    let used = |subpass: &Subpass, image| {
        subpass.touches.iter().find(|own| own.resource == image && own.is_attachment()).map(ResourceUse::layout)
    };
    let of = |(image, _)| {
        let all = || list.render_passes().flat_map(|(_, subpasses)| subpasses).filter(|own| used(own, image).is_some());
        let (first, last) = (all().next()?, all().last()?);
        let is_here = |subpass: &Subpass| listed.iter().any(|own| own.place == subpass.place);
        let layout = listed.iter().find_map(|own| used(own, image))?;
        let (own, readable) = match image {
            Resource::SHADOW_TINTS => (tint::attachment(), TINT_LAYOUT),
            _ => (shadow::attachment(), ATLAS_LAYOUT),
        };
        let readable = plan.layouts.of(readable);
        let (load, before) = match is_here(first) {
            true => (own.load_op, readable),
            false => (vk::AttachmentLoadOp::LOAD, layout),
        };
        let after = if is_here(last) { readable } else { layout };
        Some((image, own.load_op(load).initial_layout(before).final_layout(after)))
    };
    images(plan).filter_map(of).collect()
}

/// Returns no rows if the plan has no maps.
pub(super) fn rows(plan: &FramePlan, steps: &[Step]) -> Vec<Row> {
    let clear = |(image, [before, after]): (Resource, ClearRows)| {
        let (layout, drawn, why) = match image {
            Resource::SHADOW_TINTS => (
                TINT_LAYOUT,
                (tint::PASS.name, tint::TINT_CLEAR),
                "tints that no frame has drawn yet are sampled, or drawn by TINT, which waits for samplers",
            ),
            _ => (
                ATLAS_LAYOUT,
                (shadow::PASS.name, shadow::MAP_CLEAR),
                "a map that no frame has drawn yet is sampled, or drawn by SHADOW, which waits for samplers",
            ),
        };
        // Who draws waits for readers, and so for the clear as well.
        let (reader, read) = waits::readers(plan, steps, image).unwrap_or(drawn);
        [
            barrier(before, vk::ImageLayout::UNDEFINED, CLEARED)
                .from(Endpoint::OUTSIDE, &[Use::START])
                .to(Endpoint::CLEAR, &[shadow_clear::WRITE])
                .because("the image is new: there is nothing to wait for, but its layout changes before the write"),
            barrier(after, CLEARED, layout)
                .from(Endpoint::CLEAR, &[shadow_clear::WRITE])
                .to(reader, &[read])
                .because(why),
        ]
    };
    images(plan).flat_map(clear).collect()
}

impl Rows {
    /// The rows that the images are made with; `None` without shadow maps.
    pub(in crate::frame) fn clear_orders(&self) -> Option<ClearOrders> {
        let order = |[before, after]: ClearRows| {
            let (clear, look_up) = (self.find(before)?.order(), self.find(after)?.order());
            Some(ClearOrder { clear, look_up, sync: self.sync })
        };
        Some(ClearOrders { maps: order(OF_MAPS)?, tints: order(OF_TINTS), layouts: self.layouts })
    }
}
