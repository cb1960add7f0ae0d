//! PRESENT: copies a picture that a compute pass wrote, or one that is to be enlarged or kept, into an image of the swapchain, or into the one that
//! ENCODE reads. A picture that a render pass draws otherwise is drawn there directly.

use ash::vk;

use super::{Endpoint, NO_WINDOW, Pass, Presence, Resource, ResourceUse, UseKind, shown};
use crate::gpu::{
    Device, Image,
    sync::{Layouts, Use},
};
use crate::plan::PresentTarget;

/// The first stage of a render pass that touches the swapchain's image, as an attachment. Presentation read the image before, and its semaphore has
/// made that available.
pub const ATTACH: Use = Use::new(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags2::empty());
/// The first stage of PRESENT, if PRESENT is the first to touch the swapchain's image.
pub const BEGIN: Use = Use::new(vk::PipelineStageFlags2::TRANSFER, vk::AccessFlags2::empty());
/// Writes every pixel of the image that the window shows.
pub const WRITE: Use = Use::new(vk::PipelineStageFlags2::TRANSFER, vk::AccessFlags2::TRANSFER_WRITE);

/// Reads the picture.
pub const READ: Use = Use::new(vk::PipelineStageFlags2::TRANSFER, vk::AccessFlags2::TRANSFER_READ);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("PRESENT"),
    time: "present",
    what: "copies the picture into the image that the window shows, enlarged where that is larger",
    presence: |plan| {
        let why = match plan.presented {
            Some(PresentTarget::Enlarge(_) | PresentTarget::EncodeKept(_)) => {
                "the picture is kept: panels change over a copy of it"
            }
            _ => "compute cannot store to an image that the hardware encodes",
        };
        let why_not = match plan.presented {
            None => NO_WINDOW,
            Some(PresentTarget::Encode(_)) => "ENCODE draws into the swapchain's image",
            Some(_) => "the last pass draws straight into the swapchain's image",
        };
        Presence::when(plan.is_copied_to_be_shown(), why, why_not)
    },
    touches: |plan| {
        vec![
            ResourceUse::new(Resource::Target(plan.picture()), UseKind::CopiedFrom, READ),
            ResourceUse::new(shown(plan), UseKind::CopiedTo, WRITE),
        ]
    },
    leave_out: None,
    make: None,
};

/// Copies the picture, which is in TRANSFER_SRC_OPTIMAL, into an image of this extent that is in TRANSFER_DST_OPTIMAL. Where the two have the same
/// texels (`is_alike`) and the same size, their bytes are copied: an image that is viewed as sRGB through another format would have a blit decode
/// them. Otherwise it is a blit, because the image may be larger, or have its channels in another order. A blit interpolates between texels, linearly
/// in light if the hardware encodes both images.
pub fn record(
    device: &Device,
    cmd: vk::CommandBuffer,
    (picture, is_alike): (&Image, bool),
    (shown, extent): (vk::Image, vk::Extent2D),
    layouts: Layouts,
) {
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    };
    let [from, to] =
        [vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL].map(|own| layouts.of(own));
    let is_whole = (picture.extent.width, picture.extent.height) == (extent.width, extent.height);
    if is_whole && is_alike {
        let region = vk::ImageCopy {
            src_subresource: layers,
            dst_subresource: layers,
            extent: vk::Extent3D { width: extent.width, height: extent.height, depth: 1 },
            ..vk::ImageCopy::default()
        };
        // SAFETY: `cmd` is being recorded outside a render pass; both images have this size and texels of one size, and lie in these layouts.
        unsafe { device.raw.cmd_copy_image(cmd, picture.raw, from, shown, to, &[region]) };
        return;
    }
    let corners =
        |width: u32, height: u32| [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }];
    let region = vk::ImageBlit {
        src_subresource: layers,
        src_offsets: corners(picture.extent.width, picture.extent.height),
        dst_subresource: layers,
        dst_offsets: corners(extent.width, extent.height),
    };
    let filter = if is_whole { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
    // SAFETY: `cmd` is being recorded outside a render pass; both images have these sizes and lie in these layouts. The 8-bit formats of swapchains
    // can be sampled with a linear filter everywhere (Vulkan 1.1, 45.3 "Required Format Support").
    unsafe { device.raw.cmd_blit_image(cmd, picture.raw, from, shown, to, &[region], filter) };
}
