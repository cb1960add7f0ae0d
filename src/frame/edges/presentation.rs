//! The rows of frames that a window shows, besides those of other frames: two semaphores, and what is a copy on the way.
//!
//! Within a frame the swapchain's image is as any output: its row from OUTSIDE waits, instead of for COPY, for the stage at which the semaphore
//! of the acquired image lets the frame go on ([`ATTACH`], [`BEGIN`]). The image's layout changes before the first write and after that stage,
//! and so after presentation has read the image: the two make a chain.

use ash::vk;

use super::main_pass::first_of_picture;
use super::{Carrier, Edge, Place};
use crate::gpu::sync::{DEVICE_ACCESS, Use};
use crate::passes::{copy, overlay};
use crate::passes::present::{ATTACH, BEGIN, WRITE};
use crate::plan::FramePlan;

const READ_BY_PRESENTATION: vk::ImageLayout = vk::ImageLayout::PRESENT_SRC_KHR;
const COPIED: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
const WRITTEN: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
const DRAWN_OVER: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;

/// None where nothing is presented.
pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    if plan.presented.is_none() {
        return Vec::new();
    }
    let row = |name, (old, new), places, uses, why| Edge::new(name, Carrier::ImageBarrier(old, new), places, uses, why);
    let (first, first_use) = match plan.is_tiled() {
        true => (Place::Present, BEGIN),
        false => (first_of_picture(plan), ATTACH),
    };
    let mut rows = vec![Edge::new(
        "acquire",
        Carrier::Semaphore,
        (Place::Presentation, first),
        (Use::START, first_use),
        "presentation may still read the image when the frame is recorded; the frame goes on until it needs the image",
    )];
    rows.extend(match plan.is_tiled() {
        true => [
            row(
                "swapchain-to-present",
                (vk::ImageLayout::UNDEFINED, WRITTEN),
                (Place::Outside, Place::Present),
                (BEGIN, WRITE),
                "the image's layout changes when it is acquired, before PRESENT writes all of it",
            ),
            row(
                "present-to-swapchain",
                (WRITTEN, READ_BY_PRESENTATION),
                (Place::Present, Place::Presentation),
                (WRITE, copy::READ),
                "presentation reads the image in its own layout, and sees it by the semaphore; OVERLAY before it waits for TRANSFER",
            ),
        ],
        false => [
            row(
                "swapchain-to-copy",
                (READ_BY_PRESENTATION, COPIED),
                (Place::Outside, Place::Copy),
                (copy::READ, copy::READ),
                "only for a screenshot: the layout changes when the pass has left the image, which read-back orders before TRANSFER",
            ),
            row(
                "copy-to-swapchain",
                (COPIED, READ_BY_PRESENTATION),
                (Place::Copy, Place::Presentation),
                (copy::READ, copy::READ),
                "only for a screenshot: the layout changes back when the image is copied, before OVERLAY, which waits for TRANSFER",
            ),
        ],
    });
    rows.push(row(
        "picture-to-overlay",
        (READ_BY_PRESENTATION, DRAWN_OVER),
        (Place::Outside, Place::Overlay),
        (copy::READ, overlay::BLEND),
        "only while panels are shown: the picture is whole, for a copy or not, when OVERLAY blends over it",
    ));
    rows.push(row(
        "overlay-to-swapchain",
        (DRAWN_OVER, READ_BY_PRESENTATION),
        (Place::Overlay, Place::Presentation),
        (overlay::BLEND.writes(), Use::END),
        "only while panels are shown: the layout changes back when OVERLAY has drawn",
    ));
    rows.push(Edge::new(
        "present",
        Carrier::Semaphore,
        (Place::Device, Place::Presentation),
        (DEVICE_ACCESS, Use::END),
        "presentation reads the image when the frame is done; a semaphore makes all that was written available, and presentation sees it by itself",
    ));
    rows
}
