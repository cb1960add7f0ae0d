//! Pipeline barriers without the boilerplate. Stages, accesses and layouts are the caller's.

use ash::vk;

use super::buffer::Buffer;
use super::device::Device;
use super::image::Image;
use super::journal::Barriers;
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
    order: Dependency,
    [old, new]: [vk::ImageLayout; 2],
) {
    let target = target.into();
    let barrier = vk::ImageMemoryBarrier::default()
        .src_access_mask(order.before.access)
        .dst_access_mask(order.after.access)
        .old_layout(old)
        .new_layout(new)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(target.image)
        .subresource_range(target.range);
    record(device, cmd, order, &Barriers { memory: &[], buffers: &[], images: &[barrier] });
}

/// Orders two uses of all memory.
pub fn memory_barrier(device: &Device, cmd: vk::CommandBuffer, order: Dependency) {
    let barrier = vk::MemoryBarrier::default().src_access_mask(order.before.access).dst_access_mask(order.after.access);
    record(device, cmd, order, &Barriers { memory: &[barrier], buffers: &[], images: &[] });
}

/// Orders two uses of a buffer.
pub fn buffer_barrier(device: &Device, cmd: vk::CommandBuffer, buffer: &Buffer, order: Dependency) {
    buffer_barriers(device, cmd, &[buffer], order);
}

/// Records one barrier on several buffers, and nothing if there are none.
pub fn buffer_barriers(device: &Device, cmd: vk::CommandBuffer, buffers: &[&Buffer], order: Dependency) {
    let barrier = |buffer: &&Buffer| {
        vk::BufferMemoryBarrier::default()
            .src_access_mask(order.before.access)
            .dst_access_mask(order.after.access)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .buffer(buffer.raw)
            .size(vk::WHOLE_SIZE)
    };
    let barriers: Vec<_> = buffers.iter().map(barrier).collect();
    if !barriers.is_empty() {
        record(device, cmd, order, &Barriers { memory: &[], buffers: &barriers, images: &[] });
    }
}

/// The one place where barriers are recorded.
fn record(device: &Device, cmd: vk::CommandBuffer, order: Dependency, barriers: &Barriers<'_>) {
    device.raw.journal.note(cmd, "vkCmdPipelineBarrier", |names| barriers.arguments(order, names));
    let (from, to, none) = (order.before.stage, order.after.stage, vk::DependencyFlags::empty());
    let &Barriers { memory, buffers, images } = barriers;
    // SAFETY: the command buffer is recording, and the buffers and images are alive (the module's contract).
    unsafe { device.raw.cmd_pipeline_barrier(cmd, from, to, none, memory, buffers, images) };
}
