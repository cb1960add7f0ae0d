//! The steps between a window's picture and the swapchain's image: panels, a copy of it, and ENCODE.

use std::sync::Arc;

use ash::vk;

use crate::frame::read_back::host_barrier;
use crate::frame::render_passes::image_barrier;
use crate::frame::rows::{RowName, Rows};
use crate::frame::{IN_FLIGHT, Renderer};
use crate::gpu::barrier::ImageRange;
use crate::gpu::{self, Device, Image, ImageDesc, ImageWish, Swapchain, UploadOrder};
use crate::passes::copy::Copy;
use crate::passes::encode::Encode;
use crate::passes::overlay::{OverlayPass, Panels};
use crate::plan::{FramePlan, PresentTarget};

/// The image that panels are drawn into and that ENCODE reads; `None` if panels are drawn into the swapchain's image. If the picture is kept, this is
/// `kept`, into which PRESENT copies it.
pub(super) fn encoded_image<'a>(renderer: &'a Renderer, kept: Option<&'a Image>) -> Option<&'a Image> {
    match renderer.plan.presented? {
        PresentTarget::Encode(_) => renderer.frame.output(&renderer.plan),
        PresentTarget::EncodeKept(_) => kept,
        PresentTarget::Straight(_) | PresentTarget::Enlarge(_) => None,
    }
}

/// The image that ENCODE reads in the place of a picture that is kept, where the plan has it. `before` is the last one.
pub(super) fn image_beside(
    device: &Arc<Device>,
    plan: &FramePlan,
    before: Option<Image>,
) -> gpu::Result<Option<Image>> {
    let Some(PresentTarget::EncodeKept(_)) = plan.presented else { return Ok(None) };
    let [width, height] = plan.size;
    let extent = vk::Extent2D { width, height };
    let fits = |own: &Image| (own.format, own.extent.width, own.extent.height) == (plan.output, width, height);
    if let Some(own) = before.filter(fits) {
        return Ok(Some(own));
    }
    // PRESENT and SPLIT copy into it, COPY out of it, OVERLAY draws over it, and ENCODE samples it.
    let usage = vk::ImageUsageFlags::TRANSFER_DST
        | vk::ImageUsageFlags::TRANSFER_SRC
        | vk::ImageUsageFlags::COLOR_ATTACHMENT
        | vk::ImageUsageFlags::SAMPLED;
    let desc = ImageDesc { name: "picture under panels", format: plan.output, extent, usage, ..ImageDesc::default() };
    Image::new(device, &desc).map(Some)
}

/// The images that panels are drawn over.
pub(super) struct Over {
    pub(super) format: vk::Format,
    /// It takes them linear.
    pub(super) encodes: bool,
    /// One, or one for each image of the swapchain.
    pub(super) views: Vec<vk::ImageView>,
    pub(super) extent: vk::Extent2D,
    /// The rows before and after uploads of its textures.
    pub(super) uploads: UploadOrder,
}

impl Over {
    pub(super) fn of(renderer: &Renderer, encoded: Option<&Image>, swapchain: &Swapchain, images: ImageWish) -> Self {
        let (extent, uploads) = (swapchain.extent, renderer.rows.panel_order());
        match encoded {
            Some(own) => Self { format: own.format, encodes: true, views: vec![own.view], extent, uploads },
            None => {
                let (format, encodes) = (swapchain.formats.drawn, images.encodes);
                Self { format, encodes, views: swapchain.views(), extent, uploads }
            }
        }
    }
}

/// Creates the overlay if there are panels, drops it otherwise, and writes this frame's panels into it.
pub(super) fn overlay(
    device: &Arc<Device>,
    overlay: &mut Option<OverlayPass>,
    over: impl FnOnce() -> Over,
    panels: Option<&Panels>,
    frame: usize,
) -> gpu::Result<()> {
    let Some(panels) = panels else {
        *overlay = None;
        return Ok(());
    };
    let own = match overlay {
        Some(own) => own,
        None => {
            let Over { format, encodes, views, extent, uploads } = over();
            // One place more is for pictures that are shown again.
            let mut new = OverlayPass::new(device, format, encodes, uploads, IN_FLIGHT + 1)?;
            new.resize(&views, extent)?;
            overlay.insert(new)
        }
    };
    own.write(frame, panels)
}

/// Copies the picture of the frame that is being recorded, before it is presented. The copy is made from the image that ENCODE reads, if there is one. It is
/// made from the frame's own image if the picture is drawn there, or if the swapchain's images cannot be copied from.
pub(super) fn record_copy(
    renderer: &Renderer,
    cmd: vk::CommandBuffer,
    copy: &Copy,
    (swapchain_image, encoded): (Option<vk::Image>, Option<&Image>),
) {
    let (device, rows) = (&renderer.device, &renderer.rows);
    match (swapchain_image, encoded.or_else(|| renderer.frame.output(&renderer.plan))) {
        (Some(image), _) => copy_presented(device, rows, (cmd, image), copy),
        (None, Some(own)) => copy.record(device, cmd, (own.raw, rows.layouts)),
        (None, None) => return,
    }
    host_barrier(device, cmd, copy, rows);
}

/// Brings the picture into an image of the swapchain, which is ready to be presented then.
pub(super) fn record_encode(
    (device, rows): (&Device, &Rows),
    cmd: vk::CommandBuffer,
    (encode, picture): (&Encode, &Image),
    (index, image): (usize, vk::Image),
) {
    let shown = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
    device.begin_label(cmd, "ENCODE");
    image_barrier(device, cmd, picture, rows.find(RowName::PICTURE_TO_ENCODE));
    image_barrier(device, cmd, shown, rows.find(RowName::SWAPCHAIN_TO_ENCODE));
    encode.record(cmd, index);
    image_barrier(device, cmd, picture, rows.find(RowName::ENCODE_TO_PICTURE));
    image_barrier(device, cmd, shown, rows.find(RowName::ENCODE_TO_SWAPCHAIN));
    device.end_label(cmd);
}

/// Copies an image that is ready to be presented, as it is again after that.
fn copy_presented(device: &Device, rows: &Rows, (cmd, image): (vk::CommandBuffer, vk::Image), copy: &Copy) {
    let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
    image_barrier(device, cmd, whole, rows.find(RowName::PICTURE_TO_COPY));
    copy.record(device, cmd, (image, rows.layouts));
    image_barrier(device, cmd, whole, rows.find(RowName::COPY_TO_PICTURE));
}
