//! Pipeline barriers without the boilerplate. Stages, accesses and layouts are the caller's.

use ash::vk;

use super::buffer::Buffer;
use super::device::Device;
use super::image::Image;
use super::journal::Barriers;
use super::queues::Queue;
use super::sync::{Dependency, SyncVersion, Use};

/// A part of an image.
#[derive(Clone, Copy, Debug)]
pub struct ImageRange {
    /// The image.
    pub image: vk::Image,
    /// The aspects, mip levels and layers.
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

    /// Narrows the range to `count` mip levels from `first`.
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
    layouts: [vk::ImageLayout; 2],
) {
    image_barriers(device, cmd, &[(target.into(), layouts)], order);
}

/// Orders two uses of several images, each of which changes its layout. Records nothing if there are none.
pub fn image_barriers(
    device: &Device,
    cmd: vk::CommandBuffer,
    images: &[(ImageRange, [vk::ImageLayout; 2])],
    order: Dependency,
) {
    let barrier = |&(target, [old, new]): &(ImageRange, [vk::ImageLayout; 2])| {
        vk::ImageMemoryBarrier2::default()
            .old_layout(old)
            .new_layout(new)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(target.image)
            .subresource_range(target.range)
    };
    let images: Vec<_> = images.iter().map(barrier).collect();
    if !images.is_empty() {
        record(device, cmd, order, Barriers { images, ..Barriers::default() });
    }
}

/// Orders two uses of all memory.
pub fn memory_barrier(device: &Device, cmd: vk::CommandBuffer, order: Dependency) {
    record(device, cmd, order, Barriers { memory: vec![vk::MemoryBarrier2::default()], ..Barriers::default() });
}

/// Orders two uses of all attachments of the pixels that draws before and after it share: between subpasses that are no subpasses to Vulkan, inside of
/// `vkCmdBeginRendering`.
pub fn local_barrier(device: &Device, cmd: vk::CommandBuffer, order: Dependency) {
    let memory = vec![vk::MemoryBarrier2::default()];
    record(device, cmd, order, Barriers { memory, flags: vk::DependencyFlags::BY_REGION, ..Barriers::default() });
}

/// Orders two uses of a buffer.
pub fn buffer_barrier(device: &Device, cmd: vk::CommandBuffer, buffer: &Buffer, order: Dependency) {
    buffer_barriers(device, cmd, &[buffer], order);
}

/// Records one barrier on several buffers, and nothing if there are none.
pub fn buffer_barriers(device: &Device, cmd: vk::CommandBuffer, buffers: &[&Buffer], order: Dependency) {
    let barrier = |buffer: &&Buffer| {
        vk::BufferMemoryBarrier2::default()
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .buffer(buffer.raw)
            .size(vk::WHOLE_SIZE)
    };
    let buffers: Vec<_> = buffers.iter().map(barrier).collect();
    if !buffers.is_empty() {
        record(device, cmd, order, Barriers { buffers, ..Barriers::default() });
    }
}

/// A half of an ownership transfer, each in its own queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Half {
    /// Recorded on the queue that wrote the contents. It makes their writes available.
    Release,
    /// On the queue that uses them next, after a semaphore that was signalled after the release.
    Acquire,
}

impl Half {
    /// The scopes of this half's barrier.
    pub const fn scopes(self, order: Dependency) -> Dependency {
        let Dependency { row, before, after } = order;
        match self {
            Self::Release => Dependency { row, before, after: Use::END },
            Self::Acquire => Dependency { row, before: Use::new(after.stage, vk::AccessFlags2::empty()), after },
        }
    }
}

/// Images with the layout that they keep, and buffers.
pub type Contents<'a> = (&'a [(ImageRange, vk::ImageLayout)], &'a [vk::Buffer]);

/// Records a half of a transfer of contents from one queue's family to another's. `order` has the source scope of the release and the destination scope of the
/// acquire. The source stages of the acquire are its destination stages, which must also wait for the semaphore. Records nothing if there are no contents.
pub fn hand_over(
    device: &Device,
    cmd: vk::CommandBuffer,
    half: Half,
    queues: [Queue; 2],
    (images, buffers): Contents<'_>,
    order: Dependency,
) {
    let order = half.scopes(order);
    // A device without one of the queues has no command buffer of it.
    let [from, to] = queues.map(|own| device.physical.family_of(own).unwrap_or(vk::QUEUE_FAMILY_IGNORED));
    let image = |&(target, layout): &(ImageRange, vk::ImageLayout)| {
        vk::ImageMemoryBarrier2::default()
            .old_layout(layout)
            .new_layout(layout)
            .src_queue_family_index(from)
            .dst_queue_family_index(to)
            .image(target.image)
            .subresource_range(target.range)
    };
    let buffer = |&own: &vk::Buffer| {
        vk::BufferMemoryBarrier2::default()
            .src_queue_family_index(from)
            .dst_queue_family_index(to)
            .buffer(own)
            .size(vk::WHOLE_SIZE)
    };
    let (images, buffers): (Vec<_>, Vec<_>) =
        (images.iter().map(image).collect(), buffers.iter().map(buffer).collect());
    if !images.is_empty() || !buffers.is_empty() {
        record(device, cmd, order, Barriers { images, buffers, handed: Some((half, queues)), ..Barriers::default() });
    }
}

/// The one place where barriers are recorded, by the API of the command buffer's recording. All of them have the masks of `order`.
fn record(device: &Device, cmd: vk::CommandBuffer, order: Dependency, mut barriers: Barriers<'_>) {
    let Use { stage: from, access: available } = order.before;
    let Use { stage: to, access: visible } = order.after;
    let is_by_2 = device.sync_of(cmd) == SyncVersion::Two;
    let name = if is_by_2 { "vkCmdPipelineBarrier2" } else { "vkCmdPipelineBarrier" };
    device.raw.journal.note(cmd, name, |names| barriers.arguments(order, names));
    if is_by_2 {
        for own in &mut barriers.memory {
            (own.src_stage_mask, own.src_access_mask, own.dst_stage_mask, own.dst_access_mask) =
                (from, available, to, visible);
        }
        for own in &mut barriers.buffers {
            (own.src_stage_mask, own.src_access_mask, own.dst_stage_mask, own.dst_access_mask) =
                (from, available, to, visible);
        }
        for own in &mut barriers.images {
            (own.src_stage_mask, own.src_access_mask, own.dst_stage_mask, own.dst_access_mask) =
                (from, available, to, visible);
        }
        let info = vk::DependencyInfo::default()
            .dependency_flags(barriers.flags)
            .memory_barriers(&barriers.memory)
            .buffer_memory_barriers(&barriers.buffers)
            .image_memory_barriers(&barriers.images);
        // SAFETY: the command buffer is recording, and the buffers and images are alive (the module's contract).
        unsafe { device.raw.pipeline_barrier2(cmd, &info) };
        return;
    }
    let ((from, available), (to, visible)) = (order.before.masks(), order.after.masks());
    let memory: Vec<_> = barriers
        .memory
        .iter()
        .map(|_| vk::MemoryBarrier::default().src_access_mask(available).dst_access_mask(visible))
        .collect();
    let buffer = |own: &vk::BufferMemoryBarrier2| {
        vk::BufferMemoryBarrier::default()
            .src_access_mask(available)
            .dst_access_mask(visible)
            .src_queue_family_index(own.src_queue_family_index)
            .dst_queue_family_index(own.dst_queue_family_index)
            .buffer(own.buffer)
            .offset(own.offset)
            .size(own.size)
    };
    let image = |own: &vk::ImageMemoryBarrier2| {
        vk::ImageMemoryBarrier::default()
            .src_access_mask(available)
            .dst_access_mask(visible)
            .old_layout(own.old_layout)
            .new_layout(own.new_layout)
            .src_queue_family_index(own.src_queue_family_index)
            .dst_queue_family_index(own.dst_queue_family_index)
            .image(own.image)
            .subresource_range(own.subresource_range)
    };
    let buffers: Vec<_> = barriers.buffers.iter().map(buffer).collect();
    let images: Vec<_> = barriers.images.iter().map(image).collect();
    // SAFETY: as above.
    unsafe { device.raw.cmd_pipeline_barrier(cmd, from, to, barriers.flags, &memory, &buffers, &images) };
}
