//! PRESENT: a picture that a compute pass wrote, into an image of the swapchain. What a render pass draws, it draws there by itself.

use ash::vk;

use super::{How, Pass, Place, Presence, Resource, Touch};
use crate::gpu::{Device, Image, sync::Use};
use crate::plan::{Canvas, Target};

/// The first stage of a render pass that touches the swapchain's image, as an attachment. What came before it there was read by presentation,
/// whose semaphore has made that available.
pub const ATTACH: Use = Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::empty());
/// The same where PRESENT is the first.
pub const BEGIN: Use = Use::new(vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::empty());
/// Writes every pixel of the swapchain's image.
pub const WRITE: Use = Use::new(vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE);

/// Reads the picture.
const READ: Use = Use::new(vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_READ);

pub const PASS: Pass = Pass {
    place: Place::pass("PRESENT"),
    time: "present",
    what: "copies the picture into an image of the swapchain",
    presence: |plan| {
        let is_in = plan.is_tiled() && matches!(plan.presented, Some(Canvas::Straight(_)));
        Presence::when(
            is_in,
            "compute cannot store to an image that the hardware encodes",
            "no window, or it is drawn into directly",
        )
    },
    touches: |_| {
        vec![
            Touch { resource: Resource::Target(Target::Output), how: How::CopiedFrom, uses: READ },
            Touch { resource: Resource::SwapchainImage, how: How::CopiedTo, uses: WRITE },
        ]
    },
    leave_out: None,
};

/// Copies the picture, which is in TRANSFER_SRC_OPTIMAL, into an image of its size that is in TRANSFER_DST_OPTIMAL. A blit, because the two may
/// have their channels in different orders.
pub fn record(device: &Device, cmd: vk::CommandBuffer, picture: &Image, swapchain_image: vk::Image) {
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    };
    let end = vk::Offset3D { x: picture.extent.width as i32, y: picture.extent.height as i32, z: 1 };
    let corners = [vk::Offset3D::default(), end];
    let region =
        vk::ImageBlit { src_subresource: layers, src_offsets: corners, dst_subresource: layers, dst_offsets: corners };
    let (from, to) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
    // SAFETY: `cmd` is being recorded outside a render pass; both images have the size of the plan and lie in these layouts.
    unsafe { device.raw.cmd_blit_image(cmd, picture.raw, from, swapchain_image, to, &[region], vk::Filter::NEAREST) };
}
