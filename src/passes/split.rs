//! SPLIT: a part of another picture over the window's, right of a divider. It exists only while the window is split.

use ash::vk;

use super::{Endpoint, NO_WINDOW, Pass, Presence, ResourceUse, UseKind, shown};
use crate::gpu::{
    Device, Image,
    sync::{Layouts, Use},
};

/// Writes a part of the window's picture, and keeps the rest.
pub const WRITE: Use = Use::new(vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SPLIT"),
    time: "split",
    what: "copies a part of another picture over this one",
    presence: |plan| Presence::when(plan.presented.is_some(), "only while the window is split", NO_WINDOW),
    touches: |plan| vec![ResourceUse::new(shown(plan), UseKind::CopiedTo, WRITE)],
    leave_out: None,
    make: None,
};

/// Copies the columns of `picture` from `first` on, which is in TRANSFER_SRC_OPTIMAL, into an image of its size that is in
/// TRANSFER_DST_OPTIMAL. Bytes as they are: the two have texels of the same size with the same order of channels.
pub fn record(
    device: &Device,
    cmd: vk::CommandBuffer,
    (picture, first): (&Image, u32),
    (shown, layouts): (vk::Image, Layouts),
) {
    let Some(width) = picture.extent.width.checked_sub(first).filter(|&width| width > 0) else { return };
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    };
    let corner = vk::Offset3D { x: first as i32, y: 0, z: 0 };
    let region = vk::ImageCopy {
        src_subresource: layers,
        src_offset: corner,
        dst_subresource: layers,
        dst_offset: corner,
        extent: vk::Extent3D { width, height: picture.extent.height, depth: 1 },
    };
    let [from, to] =
        [vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL].map(|own| layouts.of(own));
    // SAFETY: `cmd` is being recorded outside a render pass; both images have the size of the plan and lie in these layouts.
    unsafe { device.raw.cmd_copy_image(cmd, picture.raw, from, shown, to, &[region]) };
}
