//! The steps between a window's picture and the swapchain's image: panels, a copy of it, and ENCODE.

use std::sync::Arc;

use ash::vk;

use crate::frame::edges::{Edges, RowName};
use crate::frame::read_back::host_barrier;
use crate::frame::render_passes::image_barrier;
use crate::frame::{IN_FLIGHT, Renderer};
use crate::gpu::barrier::ImageRange;
use crate::gpu::{self, Device, Image, ImageWish, Swapchain, Timestamps, UploadOrder};
use crate::passes::copy::Copy;
use crate::passes::encode::Encode;
use crate::passes::overlay::{Overlay, Panels};

/// The picture, where it is not an image of the swapchain and nothing is copied into one.
pub(super) fn own_canvas(renderer: &Renderer) -> Option<&Image> {
    renderer.plan.encoding.and_then(|_| renderer.frame.output(&renderer.plan))
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
    pub(super) fn of(renderer: &Renderer, swapchain: &Swapchain, images: ImageWish) -> Self {
        let (extent, uploads) = (swapchain.extent, renderer.edges.panel_order());
        match own_canvas(renderer) {
            Some(own) => Self { format: own.format, encodes: true, views: vec![own.view], extent, uploads },
            None => {
                let (format, encodes) = (swapchain.formats.drawn, images.encodes);
                Self { format, encodes, views: swapchain.views(), extent, uploads }
            }
        }
    }
}

/// Sees to it that there is an overlay where there are panels, and nowhere else, and that it has what this frame in flight shows.
pub(super) fn overlay(
    device: &Arc<Device>,
    overlay: &mut Option<Overlay>,
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
            let mut new = Overlay::new(device, format, encodes, uploads, IN_FLIGHT + 1)?;
            new.resize(&views, extent)?;
            overlay.insert(new)
        }
    };
    own.write(frame, panels)
}

/// Copies the picture of the frame that is being recorded, before it is presented: out of the frame's own image where it is not the swapchain's,
/// or where that cannot be copied from.
pub(super) fn record_copy(
    renderer: &Renderer,
    cmd: vk::CommandBuffer,
    copy: &Copy,
    swapchain_image: Option<vk::Image>,
) {
    let (device, edges) = (&renderer.device, &renderer.edges);
    match (swapchain_image, renderer.frame.output(&renderer.plan)) {
        (Some(image), _) => copy_presented(device, edges, (cmd, image), copy),
        (None, Some(own)) => copy.record(device, cmd, own.raw),
        (None, None) => return,
    }
    host_barrier(device, cmd, copy, edges);
}

/// Brings the picture of the frame that is being recorded into an image of the swapchain, which is ready to be presented then.
pub(super) fn record_encode(
    renderer: &mut Renderer,
    encode: &Encode,
    (index, image): (usize, vk::Image),
    is_covered: bool,
) {
    let in_flight = &mut renderer.frames[renderer.next];
    let cmd = in_flight.cmd.raw;
    if is_covered {
        // The overlay's time is not ENCODE's.
        Timestamps::stamp(&mut in_flight.times, cmd, "over the picture");
    }
    let Some(picture) = own_canvas(renderer) else { return };
    let (device, edges) = (&renderer.device, &renderer.edges);
    let shown = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
    device.begin_label(cmd, "ENCODE");
    image_barrier(device, cmd, picture, edges.find(RowName::PICTURE_TO_ENCODE));
    image_barrier(device, cmd, shown, edges.find(RowName::SWAPCHAIN_TO_ENCODE));
    encode.record(cmd, index);
    image_barrier(device, cmd, picture, edges.find(RowName::ENCODE_TO_PICTURE));
    image_barrier(device, cmd, shown, edges.find(RowName::ENCODE_TO_SWAPCHAIN));
    device.end_label(cmd);
    Timestamps::stamp(&mut renderer.frames[renderer.next].times, cmd, "encode");
}

/// Copies an image that is ready to be presented, as it is again after that.
fn copy_presented(device: &Device, edges: &Edges, (cmd, image): (vk::CommandBuffer, vk::Image), copy: &Copy) {
    let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
    image_barrier(device, cmd, whole, edges.find(RowName::PICTURE_TO_COPY));
    copy.record(device, cmd, image);
    image_barrier(device, cmd, whole, edges.find(RowName::COPY_TO_PICTURE));
}
