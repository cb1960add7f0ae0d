//! A swapchain: the images that a window shows, one after the other.
//!
//! The order of the waits stands in the caller's table of dependencies. This module has the semaphores of each wait: the caller's for an image that
//! is acquired, and one for each image that is presented. The latter cannot be one a frame: presentation waits for it at a time that no fence of Vulkan's core tells,
//! and it is only known to be over when the same image is acquired again (VUID-vkQueueSubmit-pSignalSemaphores-00067).

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::image_formats::{ImageFormats, ImageWish, image_formats};
use super::memory::leak;
use super::owned::Owned;
use super::surface::Surface;

/// Synchronization of presented images with the display's refresh: which images wait for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Vsync {
    /// Each image waits, and none is torn.
    #[default]
    On,
    /// No image waits: the lowest latency; images may be torn.
    Off,
    /// Each image waits but one that is late.
    Adaptive,
}

/// The description of a swapchain.
#[derive(Clone, Copy, Debug)]
pub struct SwapchainDesc {
    /// The images to ask for.
    pub images: ImageWish,
    /// The usage of the images, unless a shader encodes their content: then that shader draws into them, and they have no other use.
    pub usage: vk::ImageUsageFlags,
    /// Further usage, where the surface allows it.
    pub wishes: vk::ImageUsageFlags,
    /// The time at which images are shown.
    pub vsync: Vsync,
    /// Width and height where the surface leaves them to its swapchain, in pixels.
    pub size: [u32; 2],
}

/// The fit between a swapchain and its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// As it was made for it.
    Exact,
    /// It is still shown, but another one would suit better.
    Suboptimal,
    /// It is not shown any more: another one is needed.
    OutOfDate,
    /// The surface is gone: a new surface is needed, and a new swapchain for it.
    SurfaceLost,
}

/// The result of acquiring an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acquired {
    /// The image of this index, once the semaphore is signalled.
    Image(usize, Fit),
    /// No image; the semaphore is unchanged.
    Nothing(Fit),
}

/// An image of a swapchain.
pub struct PresentableImage {
    /// The handle, which belongs to the swapchain.
    pub raw: vk::Image,
    /// A view of it, if it is drawn into as an attachment.
    pub view: Option<Owned<vk::ImageView>>,
    /// Presentation waits for it.
    pub drawn: Owned<vk::Semaphore>,
}

/// A swapchain with its images. It keeps its surface alive.
pub struct Swapchain {
    raw: vk::SwapchainKHR,
    functions: ash::khr::swapchain::Device,
    /// The images, by index.
    pub images: Vec<PresentableImage>,
    /// The images' formats.
    pub formats: ImageFormats,
    /// The images' size in pixels.
    pub extent: vk::Extent2D,
    /// The present mode.
    pub present_mode: vk::PresentModeKHR,
    /// The usage of the images: the usage asked for, and the wishes that the surface allows.
    pub usage: vk::ImageUsageFlags,
    _surface: Arc<Surface>,
    device: Arc<Device>,
}

/// The longest wait for an image, in nanoseconds, before the window looks after its events again: a window that nobody sees may get none.
const PATIENCE_NS: u64 = 100_000_000;

impl Swapchain {
    /// A swapchain that takes the place of `old` one, or `None` while the window has no pixels. An old one is given up in any case: its images
    /// are waited for and destroyed.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a surface without a format or usage that is needed; the driver's errors.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        desc: &SwapchainDesc,
        old: Option<Swapchain>,
    ) -> Result<Option<Swapchain>> {
        let capabilities = surface.capabilities(device)?;
        let extent = extent_of(&capabilities, desc.size);
        if extent.width == 0 || extent.height == 0 {
            return Ok(None);
        }
        let formats = image_formats(device, surface, desc.images)?;
        let usage = usage_of(device, desc, &formats, capabilities.supported_usage_flags)?;
        let present_mode = choose_mode(&surface.present_modes(device)?, desc.vsync);
        let views = [formats.own, formats.drawn];
        let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&views);
        let mut info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count(image_count(&capabilities))
            .image_format(formats.own)
            .image_color_space(formats.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(choose_alpha(capabilities.supported_composite_alpha))
            .present_mode(present_mode)
            // Parts of the window that others cover need not be drawn.
            .clipped(true)
            .old_swapchain(old.as_ref().map_or(vk::SwapchainKHR::null(), |old| old.raw));
        if formats.own != formats.drawn {
            info = info.flags(vk::SwapchainCreateFlagsKHR::MUTABLE_FORMAT).push_next(&mut list);
        }
        let functions = ash::khr::swapchain::Device::new(device.instance.raw(), &device.raw);
        // SAFETY: surface and device are alive and of one instance; the old swapchain is of this surface and not retired yet.
        let raw = unsafe { functions.create_swapchain(&info, None) }
            .doing("vkCreateSwapchainKHR", || "creating the swapchain")?;
        drop(old);
        device.name_object(raw, "swapchain");
        let (surface, device) = (Arc::clone(surface), Arc::clone(device));
        let mut swapchain = Swapchain {
            raw,
            functions,
            images: Vec::new(),
            formats,
            extent,
            present_mode,
            usage,
            _surface: surface,
            device,
        };
        swapchain.images = swapchain.list_images()?;
        Ok(Some(swapchain))
    }

    /// Views of its images, by index; none where they are no attachments.
    pub fn views(&self) -> Vec<vk::ImageView> {
        self.images.iter().filter_map(|image| Some(image.view.as_ref()?.raw)).collect()
    }

    fn list_images(&self) -> Result<Vec<PresentableImage>> {
        // SAFETY: the swapchain is alive.
        let images = unsafe { self.functions.get_swapchain_images(self.raw) }
            .doing("vkGetSwapchainImagesKHR", || "listing the swapchain's images")?;
        (0..).zip(images).map(|(index, raw)| self.presentable(index, raw)).collect()
    }

    fn presentable(&self, index: usize, raw: vk::Image) -> Result<PresentableImage> {
        let name = format!("swapchain image {index}");
        self.device.name_object(raw, &name);
        let attached = self.usage.contains(vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let view = attached.then(|| self.view_of(&name, raw)).transpose()?;
        let drawn = semaphore(&self.device, &format!("{name} drawn"))?;
        Ok(PresentableImage { raw, view, drawn })
    }

    fn view_of(&self, name: &str, image: vk::Image) -> Result<Owned<vk::ImageView>> {
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(self.formats.drawn)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                base_mip_level: 0,
                level_count: 1,
                base_array_layer: 0,
                layer_count: 1,
            });
        // SAFETY: the image is alive, and its usage allows a view.
        let view = unsafe { self.device.raw.create_image_view(&info, None) }
            .doing("vkCreateImageView", || format!("creating the image view '{name}'"))?;
        Ok(Owned::new_from(&self.device, name, view))
    }

    /// Asks for the next image, and waits a moment for it. `acquired` is signalled when presentation has let go of the image; nothing may
    /// wait for it or signal it now.
    ///
    /// # Errors
    /// A lost device; running out of memory.
    pub fn acquire(&self, acquired: &Owned<vk::Semaphore>) -> Result<Acquired> {
        // SAFETY: the swapchain is alive and used by one thread; the semaphore is the caller's promise.
        let result =
            unsafe { self.functions.acquire_next_image(self.raw, PATIENCE_NS, acquired.raw, vk::Fence::null()) };
        // ANCHOR: acquire
        match result {
            Ok((index, suboptimal)) => Ok(Acquired::Image(index as usize, fit_of(suboptimal))),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::Nothing(Fit::Exact)),
            Err(result) => misfit(result)
                .map(Acquired::Nothing)
                .ok_or_else(|| Error::vulkan("vkAcquireNextImageKHR", "acquiring an image of the window", result)),
        }
        // ANCHOR_END: acquire
    }

    /// Shows an image that was acquired, when its semaphore `drawn` is signalled, as a submission before this does.
    ///
    /// # Errors
    /// A lost device; running out of memory.
    pub fn present(&self, index: usize) -> Result<Fit> {
        let (waits, swapchains, indices) = ([self.images[index].drawn.raw], [self.raw], [index as u32]);
        let info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&swapchains).image_indices(&indices);
        // SAFETY: the image is acquired and was submitted; the queue is used by one thread at a time.
        let result = self.device.with_queue(|queue| unsafe { self.functions.queue_present(queue, &info) });
        match result {
            Ok(suboptimal) => Ok(fit_of(suboptimal)),
            Err(result) => {
                misfit(result).ok_or_else(|| Error::vulkan("vkQueuePresentKHR", "presenting a frame", result))
            }
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // A fence says when a submission is done, but without VK_EXT_swapchain_maintenance1 nothing says when presentation has waited for its
        // semaphore. That wait is a queue operation, though, and waiting for the queue waits for all its outstanding operations (specification,
        // "Queue Operation").
        if !self.device.settle() {
            // The images stay as well, with the device that they hold, and so does the surface.
            let log = self.device.instance.message_log();
            log.push(leak("the swapchain stays: there was no memory to wait for presentation's end".into()));
            std::mem::take(&mut self.images).into_iter().for_each(std::mem::forget);
            std::mem::forget(Arc::clone(&self._surface));
            return;
        }
        // Views go before their images: with the queue idle, they are destroyed as they are dropped.
        self.images.clear();
        // SAFETY: nothing uses the swapchain or its images.
        unsafe { self.functions.destroy_swapchain(self.raw, None) };
    }
}

/// A semaphore that is not signalled.
///
/// # Errors
/// Running out of memory.
pub fn semaphore(device: &Arc<Device>, name: &str) -> Result<Owned<vk::Semaphore>> {
    // SAFETY: the device is alive.
    let raw = unsafe { device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
        .doing("vkCreateSemaphore", || format!("creating the semaphore '{name}'"))?;
    Ok(Owned::new_from(device, name, raw))
}

fn fit_of(suboptimal: bool) -> Fit {
    if suboptimal { Fit::Suboptimal } else { Fit::Exact }
}

/// The surface's state that a failure tells, if it is about the surface.
fn misfit(result: vk::Result) -> Option<Fit> {
    match result {
        vk::Result::ERROR_OUT_OF_DATE_KHR => Some(Fit::OutOfDate),
        vk::Result::ERROR_SURFACE_LOST_KHR => Some(Fit::SurfaceLost),
        _ => None,
    }
}

/// Returns the usage of the images: the required one, and the wishes that the surface supports.
fn usage_of(
    device: &Device,
    desc: &SwapchainDesc,
    formats: &ImageFormats,
    supported: vk::ImageUsageFlags,
) -> Result<vk::ImageUsageFlags> {
    let (needed, wishes) = match formats.by_shader {
        true => (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::ImageUsageFlags::empty()),
        false => (desc.usage, desc.wishes),
    };
    if supported.contains(needed) {
        return Ok(needed | (supported & wishes));
    }
    let name = &device.physical.name;
    Err(Error::Unsupported(format!("the window's images on '{name}' cannot be used for {needed:?}")))
}

/// The surface's own size, or as the window says where that is left to the swapchain (as on Wayland).
fn extent_of(capabilities: &vk::SurfaceCapabilitiesKHR, [width, height]: [u32; 2]) -> vk::Extent2D {
    const LEFT_TO_THE_SWAPCHAIN: u32 = u32::MAX;
    if capabilities.current_extent.width != LEFT_TO_THE_SWAPCHAIN {
        return capabilities.current_extent;
    }
    let (least, most) = (capabilities.min_image_extent, capabilities.max_image_extent);
    // Not `clamp`, which panics where a driver has them the wrong way round.
    let within = |size: u32, least: u32, most: u32| if size == 0 { 0 } else { size.max(least).min(most) };
    vk::Extent2D { width: within(width, least.width, most.width), height: within(height, least.height, most.height) }
}

/// One more than the least, so that an image can be had while presentation holds all that it needs.
fn image_count(capabilities: &vk::SurfaceCapabilitiesKHR) -> u32 {
    let most = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
    capabilities.min_image_count.saturating_add(1).min(most)
}

/// The mode that was asked for, else the nearest; FIFO is there on every surface.
fn choose_mode(offered: &[vk::PresentModeKHR], vsync: Vsync) -> vk::PresentModeKHR {
    use vk::PresentModeKHR as Mode;
    // ANCHOR: present-mode
    let wanted: &[Mode] = match vsync {
        Vsync::On => &[],
        // MAILBOX does not hold frames up either, and tears none.
        Vsync::Off => &[Mode::IMMEDIATE, Mode::MAILBOX],
        Vsync::Adaptive => &[Mode::FIFO_RELAXED],
    };
    wanted.iter().copied().find(|mode| offered.contains(mode)).unwrap_or(Mode::FIFO)
    // ANCHOR_END: present-mode
}

/// Opaque, where the surface leaves the choice: frames have no holes.
fn choose_alpha(offered: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    use vk::CompositeAlphaFlagsKHR as Alpha;
    let all = [Alpha::OPAQUE, Alpha::INHERIT, Alpha::PRE_MULTIPLIED, Alpha::POST_MULTIPLIED];
    all.into_iter().find(|&one| offered.contains(one)).unwrap_or(Alpha::OPAQUE)
}

impl Vsync {
    /// Returns true if a swapchain's mode is the one asked for, and not only the nearest that exists.
    pub fn is(self, mode: vk::PresentModeKHR) -> bool {
        match self {
            Vsync::On => mode == vk::PresentModeKHR::FIFO,
            Vsync::Off => mode != vk::PresentModeKHR::FIFO,
            Vsync::Adaptive => mode == vk::PresentModeKHR::FIFO_RELAXED,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_has_its_own_size_or_the_windows_within_limits() {
        let extent = |width, height| vk::Extent2D { width, height };
        let mut capabilities = vk::SurfaceCapabilitiesKHR {
            current_extent: extent(640, 480),
            min_image_extent: extent(16, 16),
            max_image_extent: extent(4096, 4096),
            ..Default::default()
        };
        assert_eq!(extent_of(&capabilities, [800, 600]), extent(640, 480));
        capabilities.current_extent = extent(u32::MAX, u32::MAX);
        assert_eq!(extent_of(&capabilities, [800, 600]), extent(800, 600));
        assert_eq!(extent_of(&capabilities, [8, 60_000]), extent(16, 4096));
        assert_eq!(extent_of(&capabilities, [0, 0]), extent(0, 0), "a minimized window stays without pixels");
    }

    #[test]
    fn a_mode_that_is_not_offered_falls_back_to_the_nearest() {
        use vk::PresentModeKHR as Mode;
        let all = [Mode::FIFO, Mode::MAILBOX, Mode::IMMEDIATE, Mode::FIFO_RELAXED];
        for (vsync, mode) in [(Vsync::On, all[0]), (Vsync::Off, all[2]), (Vsync::Adaptive, all[3])] {
            assert_eq!(choose_mode(&all, vsync), mode);
            assert!(vsync.is(mode));
            assert_eq!(choose_mode(&all[..1], vsync), Mode::FIFO);
        }
        assert_eq!(choose_mode(&all[..2], Vsync::Off), Mode::MAILBOX);
        assert!(!Vsync::Off.is(Mode::FIFO) && !Vsync::Adaptive.is(Mode::FIFO));
    }

    #[test]
    fn one_image_more_than_the_least_unless_that_is_too_many() {
        let count = |min_image_count, max_image_count| {
            image_count(&vk::SurfaceCapabilitiesKHR { min_image_count, max_image_count, ..Default::default() })
        };
        assert_eq!([count(2, 0), count(3, 8), count(3, 3)], [3, 4, 3]);
    }
}
