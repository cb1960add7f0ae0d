//! Pipeline barriers without the boilerplate. Stages, accesses and layouts are the caller's.

use ash::vk;

use super::buffer::Buffer;
use super::device::Device;
use super::image::Image;
use super::sync::Dependency;

/// A part of an image.
#[derive(Clone, Copy, Debug)]
pub struct ImageRange {
    /// The image.
    pub image: vk::Image,
    /// Its aspects, mip levels and layers.
    pub range: vk::ImageSubresourceRange,
}

impl ImageRange {
    /// All levels and layers of an image that this module does not own, such as a swapchain's.
    pub fn whole(image: vk::Image, aspect_mask: vk::ImageAspectFlags) -> ImageRange {
        let range = vk::ImageSubresourceRange {
            aspect_mask,
            base_mip_level: 0,
            level_count: vk::REMAINING_MIP_LEVELS,
            base_array_layer: 0,
            layer_count: vk::REMAINING_ARRAY_LAYERS,
        };
        ImageRange { image, range }
    }

    /// The same, but only `count` mip levels from `first`.
    pub fn levels(mut self, first: u32, count: u32) -> ImageRange {
        self.range.base_mip_level = first;
        self.range.level_count = count;
        self
    }
}

impl From<&Image> for ImageRange {
    /// All levels and layers, and every aspect that the format has.
    fn from(image: &Image) -> ImageRange {
        ImageRange::whole(image.raw, image.all_aspects())
    }
}

/// Orders two uses of an image and changes its layout from the first to the second one. `&Image` means all of it.
pub fn image_barrier(
    device: &Device,
    cmd: vk::CommandBuffer,
    target: impl Into<ImageRange>,
    Dependency { before, after }: Dependency,
    [old, new]: [vk::ImageLayout; 2],
) {
    let target = target.into();
    let barrier = vk::ImageMemoryBarrier::default()
        .src_access_mask(before.access)
        .dst_access_mask(after.access)
        .old_layout(old)
        .new_layout(new)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(target.image)
        .subresource_range(target.range);
    let none = vk::DependencyFlags::empty();
    // SAFETY: the command buffer is recording and the image alive (the module's contract).
    unsafe { device.raw.cmd_pipeline_barrier(cmd, before.stage, after.stage, none, &[], &[], &[barrier]) };
}

/// Orders two uses of all memory.
pub fn memory_barrier(device: &Device, cmd: vk::CommandBuffer, Dependency { before, after }: Dependency) {
    let barrier = vk::MemoryBarrier::default().src_access_mask(before.access).dst_access_mask(after.access);
    let none = vk::DependencyFlags::empty();
    // SAFETY: the command buffer is recording (the module's contract).
    unsafe { device.raw.cmd_pipeline_barrier(cmd, before.stage, after.stage, none, &[barrier], &[], &[]) };
}

/// Orders two uses of a buffer.
pub fn buffer_barrier(device: &Device, cmd: vk::CommandBuffer, buffer: &Buffer, order: Dependency) {
    buffer_barriers(device, cmd, &[buffer], order);
}

/// The same of several buffers, at once; of none, nothing.
pub fn buffer_barriers(
    device: &Device,
    cmd: vk::CommandBuffer,
    buffers: &[&Buffer],
    Dependency { before, after }: Dependency,
) {
    let barrier = |buffer: &&Buffer| {
        vk::BufferMemoryBarrier::default()
            .src_access_mask(before.access)
            .dst_access_mask(after.access)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .buffer(buffer.raw)
            .size(vk::WHOLE_SIZE)
    };
    let barriers: Vec<_> = buffers.iter().map(barrier).collect();
    if barriers.is_empty() {
        return;
    }
    let none = vk::DependencyFlags::empty();
    // SAFETY: the command buffer is recording (the module's contract), and the buffers are alive.
    unsafe { device.raw.cmd_pipeline_barrier(cmd, before.stage, after.stage, none, &[], &barriers, &[]) };
}
