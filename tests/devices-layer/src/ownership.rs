//! Ownership of resources by the played queue families. The device below uses one family, so it has no ownership transfers: concurrent sharing becomes
//! exclusive, and each half of a transfer becomes a barrier without families. The acquiring half alone changes an image's layout.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk;
use ash::vk::Handle;

use super::DEVICES;
use super::device::{DeviceBelow, next};
use super::loader::Dispatched;
use super::queues::is_played;
use super::shared::below;

/// The played families of command pools, by device and pool, and of their command buffers.
#[derive(Default)]
struct Recorders {
    pools: HashMap<(vk::Device, u64), u32>,
    /// With the pool and its device: a pool takes its command buffers with it.
    commands: HashMap<vk::CommandBuffer, (vk::Device, u64, u32)>,
}

static RECORDERS: LazyLock<Mutex<Recorders>> = LazyLock::new(Mutex::default);

fn recorders() -> MutexGuard<'static, Recorders> {
    // A thread that panicked with the lock has made its change wholly or not at all.
    RECORDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Dispatched for vk::CommandBuffer {}

/// Forgets the pools of a device that is destroyed.
pub fn forget(device: vk::Device) {
    let mut all = recorders();
    all.pools.retain(|(own, _), _| *own != device);
    all.commands.retain(|_, (own, ..)| *own != device);
}

/// As [`next`], or returns this from the function.
macro_rules! next {
    ($device:ident, $type:ty, $name:literal $(, $or:expr)?) => {{
        // SAFETY: the device is the caller's own, and the name has this type.
        match unsafe { next::<$type>($device, $name) } {
            Some(next) => next,
            None => return $($or)?,
        }
    }};
}

pub unsafe extern "system" fn create_command_pool(
    device: vk::Device,
    info: *const vk::CommandPoolCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pool: *mut vk::CommandPool,
) -> vk::Result {
    let (create, below) = next!(device, vk::PFN_vkCreateCommandPool, c"vkCreateCommandPool", vk::Result::ERROR_UNKNOWN);
    // SAFETY: the structure is the caller's.
    let mut info = unsafe { *info };
    let family = info.queue_family_index;
    info.queue_family_index = below.real_family.filter(|_| is_played(family)).unwrap_or(family);
    // SAFETY: as this function was called, with a family of the device below.
    let result = unsafe { create(device, &raw const info, allocator, pool) };
    if result == vk::Result::SUCCESS {
        // SAFETY: it was written there.
        recorders().pools.insert((device, unsafe { pool.read() }.as_raw()), family);
    }
    result
}

pub unsafe extern "system" fn destroy_command_pool(
    device: vk::Device,
    pool: vk::CommandPool,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let (destroy, _) = next!(device, vk::PFN_vkDestroyCommandPool, c"vkDestroyCommandPool");
    // Forgotten first: after the call another thread may get the same handles.
    let mut all = recorders();
    all.pools.remove(&(device, pool.as_raw()));
    all.commands.retain(|_, (own, of, _)| (*own, *of) != (device, pool.as_raw()));
    drop(all);
    // SAFETY: as this function was called.
    unsafe { destroy(device, pool, allocator) };
}

pub unsafe extern "system" fn allocate_command_buffers(
    device: vk::Device,
    info: *const vk::CommandBufferAllocateInfo<'_>,
    place: *mut vk::CommandBuffer,
) -> vk::Result {
    let (allocate, _) =
        next!(device, vk::PFN_vkAllocateCommandBuffers, c"vkAllocateCommandBuffers", vk::Result::ERROR_UNKNOWN);
    // SAFETY: as this function was called.
    let result = unsafe { allocate(device, info, place) };
    // SAFETY: the structure is the caller's.
    let (pool, count) = unsafe { ((*info).command_pool.as_raw(), (*info).command_buffer_count as usize) };
    let mut all = recorders();
    if let Some(family) = all.pools.get(&(device, pool)).copied().filter(|_| result == vk::Result::SUCCESS) {
        // SAFETY: the list was just written there.
        let new = unsafe { std::slice::from_raw_parts(place, count) };
        all.commands.extend(new.iter().map(|own| (*own, (device, pool, family))));
    }
    result
}

pub unsafe extern "system" fn free_command_buffers(
    device: vk::Device,
    pool: vk::CommandPool,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    let (free, _) = next!(device, vk::PFN_vkFreeCommandBuffers, c"vkFreeCommandBuffers");
    // SAFETY: the list is the caller's.
    let own = unsafe { list(buffers, count) };
    // Forgotten first: after the call another thread may get the same handles.
    let mut all = recorders();
    all.commands.retain(|commands, _| !own.contains(commands));
    drop(all);
    // SAFETY: as this function was called.
    unsafe { free(device, pool, count, buffers) };
}

/// A list of Vulkan's. An empty one may be null.
///
/// # Safety
/// So many elements lie there for as long as the list is used.
pub unsafe fn list<'a, T>(first: *const T, count: u32) -> &'a [T] {
    match count {
        0 => &[],
        // SAFETY: the caller's promise.
        _ => unsafe { std::slice::from_raw_parts(first, count as usize) },
    }
}

/// A barrier of a buffer or of an image.
trait Barrier: Copy {
    fn families(&mut self) -> (&mut u32, &mut u32);

    /// Leaves the layout of an image as it is.
    fn keep_layout(&mut self) {}
}

macro_rules! are_barriers {
    ($($type:ident $(: $keep:ident)?,)*) => {
        $(impl Barrier for vk::$type<'_> {
            fn families(&mut self) -> (&mut u32, &mut u32) {
                (&mut self.src_queue_family_index, &mut self.dst_queue_family_index)
            }

            $(fn keep_layout(&mut self) {
                // No barrier may lead to these two layouts. The transfer discards the contents, so both halves can change the layout.
                if ![vk::ImageLayout::UNDEFINED, vk::ImageLayout::PREINITIALIZED].contains(&self.old_layout) {
                    self.$keep = self.old_layout;
                }
            })?
        })*
    };
}

are_barriers! {
    BufferMemoryBarrier,
    BufferMemoryBarrier2,
    ImageMemoryBarrier: new_layout,
    ImageMemoryBarrier2: new_layout,
}

/// Barriers for the device below, which are recorded into a command buffer of this played family. `real` is its family for all played ones.
///
/// A transfer between two played families is recorded twice: by the releasing and by the acquiring family. Vulkan changes the layout once, between the
/// two; here the acquiring half does.
fn lowered<B: Barrier>(barriers: &[B], recorded_in: Option<u32>, real: u32) -> Vec<B> {
    let lower = |barrier: &B| {
        let mut own = *barrier;
        let (from, to) = own.families();
        let (source, target) = (*from, *to);
        if is_played(source) && is_played(target) {
            (*from, *to) = (vk::QUEUE_FAMILY_IGNORED, vk::QUEUE_FAMILY_IGNORED);
            if source != target && recorded_in != Some(target) {
                own.keep_layout();
            }
        } else {
            // One side is another device, instance or API, if it is any.
            for family in [from, to] {
                *family = if is_played(*family) { real } else { *family };
            }
        }
        own
    };
    barriers.iter().map(lower).collect()
}

/// Returns the device below of a command buffer, with its real family and the played family of the command buffer. The families are `None` if none
/// are played.
fn recorder(commands: vk::CommandBuffer) -> Option<(DeviceBelow, Option<u32>, Option<u32>)> {
    // SAFETY: the command buffer is the caller's own, with the key of its device.
    let device = unsafe { below(&DEVICES, commands) }?;
    let family = recorders().commands.get(&commands).map(|&(.., family)| family);
    Some((device, device.real_family, family))
}

pub unsafe extern "system" fn pipeline_barrier(
    commands: vk::CommandBuffer,
    from: vk::PipelineStageFlags,
    to: vk::PipelineStageFlags,
    flags: vk::DependencyFlags,
    memory_count: u32,
    memory: *const vk::MemoryBarrier<'_>,
    buffer_count: u32,
    buffers: *const vk::BufferMemoryBarrier<'_>,
    image_count: u32,
    images: *const vk::ImageMemoryBarrier<'_>,
) {
    let Some((device, real, family)) = recorder(commands) else { return };
    // SAFETY: the name has this type.
    let below = unsafe { device.function::<vk::PFN_vkCmdPipelineBarrier>(c"vkCmdPipelineBarrier") };
    let Some(record) = below else { return };
    // SAFETY: the lists are the caller's.
    let (own_buffers, own_images) = unsafe { (list(buffers, buffer_count), list(images, image_count)) };
    let lowered = real.map(|real| (lowered(own_buffers, family, real), lowered(own_images, family, real)));
    let (buffers, images) = lowered.as_ref().map_or((buffers, images), |(a, b)| (a.as_ptr(), b.as_ptr()));
    // SAFETY: as this function was called, with families of the device below; the lists are as long as they were.
    unsafe {
        record(commands, from, to, flags, memory_count, memory, buffer_count, buffers, image_count, images);
    }
}

pub unsafe extern "system" fn pipeline_barrier2(commands: vk::CommandBuffer, info: *const vk::DependencyInfo<'_>) {
    let Some((device, real, family)) = recorder(commands) else { return };
    let named = [c"vkCmdPipelineBarrier2KHR", c"vkCmdPipelineBarrier2"];
    // SAFETY: both names have this type.
    let found = named.into_iter().find_map(|name| unsafe { device.function::<vk::PFN_vkCmdPipelineBarrier2>(name) });
    let Some(record) = found else { return };
    // SAFETY: the structure is the caller's, with its lists.
    let (mut own, buffers, images) = unsafe {
        let own = *info;
        let buffers = list(own.p_buffer_memory_barriers, own.buffer_memory_barrier_count);
        (own, buffers, list(own.p_image_memory_barriers, own.image_memory_barrier_count))
    };
    let lowered = real.map(|real| (lowered(buffers, family, real), lowered(images, family, real)));
    if let Some((buffers, images)) = &lowered {
        own.p_buffer_memory_barriers = buffers.as_ptr();
        own.p_image_memory_barriers = images.as_ptr();
    }
    // SAFETY: as this function was called, with families of the device below.
    unsafe { record(commands, &raw const own) };
}

/// A structure that says which families share a resource.
pub trait Shared: Copy {
    fn sharing(&mut self) -> (&mut vk::SharingMode, &mut u32, &mut *const u32);

    /// Returns the structure for the device below, where one family stands for all families that share the resource.
    fn owned(mut self, below: &DeviceBelow) -> Self {
        let (mode, count, families) = self.sharing();
        if below.real_family.is_some() && *mode == vk::SharingMode::CONCURRENT {
            (*mode, *count, *families) = (vk::SharingMode::EXCLUSIVE, 0, std::ptr::null());
        }
        self
    }
}

macro_rules! are_shared {
    ($($type:ident: $mode:ident,)*) => {
        $(impl Shared for vk::$type<'_> {
            fn sharing(&mut self) -> (&mut vk::SharingMode, &mut u32, &mut *const u32) {
                (&mut self.$mode, &mut self.queue_family_index_count, &mut self.p_queue_family_indices)
            }
        })*
    };
}

are_shared! {
    BufferCreateInfo: sharing_mode,
    ImageCreateInfo: sharing_mode,
    SwapchainCreateInfoKHR: image_sharing_mode,
}

/// Declares functions that create a resource which families may share.
macro_rules! create_shared {
    ($($own:ident: $type:ty, $name:literal, $info:ty, $made:ty;)*) => {
        $(pub unsafe extern "system" fn $own(
            device: vk::Device,
            info: *const $info,
            allocator: *const vk::AllocationCallbacks<'_>,
            made: *mut $made,
        ) -> vk::Result {
            let (create, below) = next!(device, $type, $name, vk::Result::ERROR_UNKNOWN);
            // SAFETY: the structure is the caller's.
            let info = unsafe { *info }.owned(&below);
            // SAFETY: as this function was called, with families of the device below.
            unsafe { create(device, &raw const info, allocator, made) }
        })*
    };
}

create_shared! {
    create_buffer: vk::PFN_vkCreateBuffer, c"vkCreateBuffer", vk::BufferCreateInfo<'_>, vk::Buffer;
    create_swapchain: vk::PFN_vkCreateSwapchainKHR, c"vkCreateSwapchainKHR", vk::SwapchainCreateInfoKHR<'_>, vk::SwapchainKHR;
}

#[cfg(test)]
mod tests {
    use super::*;

    const IGNORED: u32 = vk::QUEUE_FAMILY_IGNORED;
    const REAL: u32 = 5;

    fn image(families: (u32, u32), layouts: (vk::ImageLayout, vk::ImageLayout)) -> vk::ImageMemoryBarrier2<'static> {
        vk::ImageMemoryBarrier2::default()
            .src_queue_family_index(families.0)
            .dst_queue_family_index(families.1)
            .old_layout(layouts.0)
            .new_layout(layouts.1)
    }

    /// The families and the layouts of a barrier for the device below.
    fn below_of(
        families: (u32, u32),
        layouts: (vk::ImageLayout, vk::ImageLayout),
        recorded_in: u32,
    ) -> ((u32, u32), (vk::ImageLayout, vk::ImageLayout)) {
        let own = lowered(&[image(families, layouts)], Some(recorded_in), REAL)[0];
        ((own.src_queue_family_index, own.dst_queue_family_index), (own.old_layout, own.new_layout))
    }

    #[test]
    fn the_family_that_acquires_changes_the_layout() {
        let (written, read) = (vk::ImageLayout::TRANSFER_DST_OPTIMAL, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        assert!(below_of((2, 1), (written, read), 2) == ((IGNORED, IGNORED), (written, written)));
        assert!(below_of((2, 1), (written, read), 1) == ((IGNORED, IGNORED), (written, read)));
        // No transfer: whoever records it changes the layout.
        for families in [(1, 1), (IGNORED, IGNORED)] {
            assert!(below_of(families, (written, read), 1) == ((IGNORED, IGNORED), (written, read)));
        }
    }

    #[test]
    fn contents_that_are_discarded_are_so_by_both_sides() {
        let layouts = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
        for family in [0, 1] {
            assert!(below_of((0, 1), layouts, family) == ((IGNORED, IGNORED), layouts));
        }
    }

    #[test]
    fn families_of_others_stay_and_the_played_side_is_the_real_family() {
        let (external, foreign) = (vk::QUEUE_FAMILY_EXTERNAL, vk::QUEUE_FAMILY_FOREIGN_EXT);
        let layouts = (vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        assert!(below_of((external, 2), layouts, 2) == ((external, REAL), layouts));
        assert!(below_of((0, foreign), layouts, 0) == ((REAL, foreign), layouts));
    }

    #[test]
    fn the_older_barriers_are_lowered_as_the_newer_ones() {
        let (old, new) = (vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        let own = vk::ImageMemoryBarrier::default().src_queue_family_index(0).dst_queue_family_index(2);
        let own = lowered(&[own.old_layout(old).new_layout(new)], Some(0), REAL)[0];
        assert!(own.new_layout == old && own.src_queue_family_index == IGNORED);
        let buffer = vk::BufferMemoryBarrier::default().src_queue_family_index(0).dst_queue_family_index(2).size(64);
        let buffer = lowered(&[buffer], Some(2), REAL)[0];
        assert!(buffer.dst_queue_family_index == IGNORED && buffer.size == 64);
        let buffer = vk::BufferMemoryBarrier2::default().src_queue_family_index(2).dst_queue_family_index(2);
        assert_eq!(lowered(&[buffer], Some(2), REAL)[0].src_queue_family_index, IGNORED);
    }
}
