//! Devices: the features and extensions that they are opened with, and memory that only the played one has.

use std::collections::HashSet;
use std::ffi::{CStr, c_char};
use std::sync::{LazyLock, Mutex, PoisonError};

use ash::vk;
use ash::vk::Handle;

use super::loader::{Dispatched, typed};
use super::ownership::{self, Shared};
use super::profile::Profile;
use super::queries::{LazyType, lazy_type, played_extensions, real_family, real_features, real_memory};
use super::queues::{self, Opened};
use super::shared::{below, device_below, locked, names_extension};
use super::{DEVICES, INSTANCES, InstanceBelow, chain};

/// A device's functions below this layer, and the memory that is played on it.
#[derive(Clone, Copy)]
pub struct DeviceBelow {
    pub get_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    destroy: Option<vk::PFN_vkDestroyDevice>,
    device: vk::Device,
    lazy: Option<LazyType>,
    pub tells_merging: bool,
    /// The family below whose one queue stands for the queues of all played families. `None` if no queues are played.
    pub real_family: Option<u32>,
}

impl DeviceBelow {
    /// Returns the function of this name of the device below, if it has one.
    ///
    /// # Safety
    /// The device is alive, and `F` is the type of the function's pointer.
    pub unsafe fn function<F: Copy>(&self, name: &CStr) -> Option<F> {
        // SAFETY: the layer below gives functions by their names, and the type is the caller's promise.
        unsafe { typed((self.get_proc_addr)(self.device, name.as_ptr())) }
    }
}

/// Images that live in lazily allocated memory, if their owner wants it: by their device and their handle.
static TRANSIENT: LazyLock<Mutex<HashSet<(vk::Device, u64)>>> = LazyLock::new(Mutex::default);

fn transient() -> std::sync::MutexGuard<'static, HashSet<(vk::Device, u64)>> {
    // A thread that panicked with the lock has changed the set wholly or not at all.
    TRANSIENT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the fault in how a device of the played kind is opened, if there is one.
///
/// # Safety
/// The physical device is alive, and the structures are as the specification has them.
unsafe fn refused(
    parent: &InstanceBelow,
    physical: vk::PhysicalDevice,
    info: &vk::DeviceCreateInfo<'_>,
) -> Option<vk::Result> {
    // SAFETY: the caller's promise.
    let (real, extensions) = unsafe { (real_features(physical), played_extensions(physical)) };
    let features = parent.profile.features(&real);
    // SAFETY: the caller's promise.
    let plain = unsafe { info.p_enabled_features.as_ref() };
    // SAFETY: the caller's promise; nothing is written.
    let chained =
        unsafe { chain::structures(info.p_next).any(|own| chain::asks_for_lacking(parent.profile, &features, own)) };
    if chained || plain.is_some_and(|asked| chain::exceeds(asked, &features)) {
        return Some(vk::Result::ERROR_FEATURE_NOT_PRESENT);
    }
    let Ok(extensions) = extensions else { return Some(vk::Result::ERROR_UNKNOWN) };
    let (count, names) = (info.enabled_extension_count, info.pp_enabled_extension_names);
    let lacking = (0..count as usize).any(|index| {
        // SAFETY: there are so many names, each of them a string that ends in NUL.
        let name = unsafe { CStr::from_ptr(names.add(index).read()) };
        parent.profile.breaks(name) || !extensions.iter().any(|own| own.extension_name_as_c_str() == Ok(name))
    });
    // SAFETY: as above.
    let admits = unsafe { names_extension((count, names), ash::khr::portability_subset::NAME) };
    // A program that opens a device of Vulkan in part must name VK_KHR_portability_subset.
    let unaware = parent.profile.has_portability_subset() && !admits;
    (lacking || unaware).then_some(vk::Result::ERROR_EXTENSION_NOT_PRESENT)
}

pub unsafe extern "system" fn create(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;
    // SAFETY: the loader passes on the program's structure, with structures of its own in the chain.
    let Some(described) = (unsafe { info.as_ref() }) else { return FAILED };
    // SAFETY: the physical device is the caller's own; it has the key of its instance.
    let Some(parent) = (unsafe { below(&INSTANCES, physical) }) else { return FAILED };
    // SAFETY: as this function was called.
    let Some((create, get_proc_addr)) = (unsafe { device_below(parent.instance, described) }) else { return FAILED };
    // SAFETY: as this function was called.
    if let Some(refused) = unsafe { refused(&parent, physical, described) } {
        return refused;
    }
    // SAFETY: the physical device is the caller's own.
    let real_family = unsafe { real_family(physical, parent.profile) };
    // SAFETY: as this function was called.
    let Ok(opened) = (unsafe { opened(described, real_family) }) else { return FAILED };
    let queues = opened.as_ref().map(|(own, first, real)| own.below(first, *real));
    let mut described = *described;
    if let Some(queues) = &queues {
        (described.queue_create_info_count, described.p_queue_create_infos) = (1, std::ptr::from_ref(queues));
    }
    // SAFETY: as this function was called, with the link of the layer below in the chain, and without the extension and the queues that the device
    // below does not know.
    let result = unsafe { create_real(create, (physical, &described), (allocator, device), parent.profile) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: it was written there.
    let created = unsafe { device.read() };
    // SAFETY: the physical device is the caller's own; the type is that of the name.
    let (real, destroy) =
        unsafe { (real_memory(physical), typed(get_proc_addr(created, c"vkDestroyDevice".as_ptr()))) };
    let lazy = lazy_type(parent.profile, &real);
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        let tells_merging = parent.profile.tells_merging();
        let own = DeviceBelow { get_proc_addr, destroy, device: created, lazy, tells_merging, real_family };
        locked(&DEVICES).insert(key, own);
    }
    if let Some((opened, _, real)) = &opened {
        // SAFETY: it was just created, with one queue of that family.
        unsafe { queues::remember(created, get_proc_addr, opened, *real) };
    }
    result
}

/// Returns the queues that a device with played families is opened with, the first of their structures, and the real family. Returns `None` if no
/// families are played or the device is opened without queues.
///
/// # Errors
/// Fails if the played device lacks one of the queues. A line on the error output names that queue.
///
/// # Safety
/// The structures are as the specification has them.
unsafe fn opened<'a>(
    described: &vk::DeviceCreateInfo<'a>,
    real_family: Option<u32>,
) -> Result<Option<(Opened, vk::DeviceQueueCreateInfo<'a>, u32)>, ()> {
    // SAFETY: the caller's promise.
    let infos = unsafe { ownership::list(described.p_queue_create_infos, described.queue_create_info_count) };
    let (Some(real), Some(first)) = (real_family, infos.first()) else { return Ok(None) };
    // SAFETY: the caller's promise.
    let own = unsafe { Opened::read(infos) }.map_err(|why| queues::say(&why))?;
    Ok(Some((own, *first, real)))
}

/// Creates the device below without the extension and the feature that only the played one has.
///
/// # Safety
/// As `vkCreateDevice`.
unsafe fn create_real(
    create: vk::PFN_vkCreateDevice,
    (physical, described): (vk::PhysicalDevice, &vk::DeviceCreateInfo<'_>),
    (allocator, device): (*const vk::AllocationCallbacks<'_>, *mut vk::Device),
    profile: Profile,
) -> vk::Result {
    let (count, names) = (described.enabled_extension_count as usize, described.pp_enabled_extension_names);
    // SAFETY: there are so many names, each of them a string that ends in NUL.
    let own = (0..count).map(|index| unsafe { names.add(index).read() });
    let names: Vec<*const c_char> = own
        // SAFETY: as above.
        .filter(|&name| Some(unsafe { CStr::from_ptr(name) }) != profile.own_extension())
        .collect();
    let mut info = *described;
    info.enabled_extension_count = names.len() as u32;
    info.pp_enabled_extension_names = names.as_ptr();
    let features = match profile.tells_merging() {
        true => vk::StructureType::PHYSICAL_DEVICE_SUBPASS_MERGE_FEEDBACK_FEATURES_EXT,
        false => vk::StructureType::PHYSICAL_DEVICE_PORTABILITY_SUBSET_FEATURES_KHR,
    };
    // SAFETY: the chain is the caller's, alive, and used by no other thread meanwhile; it is put together again below.
    let removed = unsafe {
        let first = std::ptr::from_mut(&mut info).cast::<vk::BaseOutStructure<'static>>();
        let before = chain::structures(first.cast())
            .find(|own| own.as_ref().p_next.as_ref().is_some_and(|next| next.s_type == features));
        before.map(|mut before| {
            let removed = before.as_ref().p_next;
            before.as_mut().p_next = (*removed).p_next;
            (before, removed)
        })
    };
    // SAFETY: the caller's promise.
    let result = unsafe { create(physical, &raw const info, allocator, device) };
    if let Some((mut before, removed)) = removed {
        // SAFETY: as above.
        unsafe { before.as_mut().p_next = removed };
    }
    result
}

pub unsafe extern "system" fn destroy(device: vk::Device, allocator: *const vk::AllocationCallbacks<'_>) {
    // SAFETY: the device is null or the caller's own.
    let Some(key) = (unsafe { device.key() }) else { return };
    // Remove the entries before another device can get the same key.
    let (below, queues) = (locked(&DEVICES).remove(&key), queues::forget(key));
    transient().retain(|(own, _)| *own != device);
    ownership::forget(device);
    if let Some(destroy) = below.and_then(|below| below.destroy) {
        // SAFETY: as this function was called.
        unsafe { destroy(device, allocator) };
    }
    drop(queues);
}

/// A function of the device below.
///
/// # Safety
/// The device is alive, and `F` is the type of the function's pointer.
pub unsafe fn next<F: Copy>(device: vk::Device, name: &CStr) -> Option<(F, DeviceBelow)> {
    // SAFETY: the caller's promise.
    let below = unsafe { below(&DEVICES, device) }?;
    // SAFETY: the caller's promise.
    Some((unsafe { below.function(name) }?, below))
}

/// As [`next`], or returns this from the function.
macro_rules! next {
    ($device:ident, $type:ty, $name:literal $(, $or:expr)?) => {{
        // SAFETY: the device is the caller's own, and the type is that of the name.
        match unsafe { next::<$type>($device, $name) } {
            Some(next) => next,
            None => return $($or)?,
        }
    }};
}

pub unsafe extern "system" fn allocate_memory(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    let (allocate, below) =
        next!(device, vk::PFN_vkAllocateMemory, c"vkAllocateMemory", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
    // SAFETY: the structure is the caller's.
    let mut info = unsafe { *info };
    if let Some(lazy) = below.lazy.filter(|lazy| lazy.played == info.memory_type_index) {
        info.memory_type_index = lazy.real;
    }
    // SAFETY: as this function was called, with a memory type of the device below.
    unsafe { allocate(device, &raw const info, allocator, memory) }
}

pub unsafe extern "system" fn create_image(
    device: vk::Device,
    info: *const vk::ImageCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    image: *mut vk::Image,
) -> vk::Result {
    let (create, below) = next!(device, vk::PFN_vkCreateImage, c"vkCreateImage", vk::Result::ERROR_UNKNOWN);
    // SAFETY: the structure is the caller's.
    let info = unsafe { *info }.owned(&below);
    // SAFETY: as this function was called, with families of the device below.
    let result = unsafe { create(device, &raw const info, allocator, image) };
    if result == vk::Result::SUCCESS
        && below.lazy.is_some()
        && info.usage.contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT)
    {
        // SAFETY: it was written there.
        transient().insert((device, unsafe { image.read() }.as_raw()));
    }
    result
}

pub unsafe extern "system" fn destroy_image(
    device: vk::Device,
    image: vk::Image,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let (destroy, _) = next!(device, vk::PFN_vkDestroyImage, c"vkDestroyImage");
    // Remove the entry before another thread can get the same handle.
    transient().remove(&(device, image.as_raw()));
    // SAFETY: as this function was called.
    unsafe { destroy(device, image, allocator) };
}

/// Adds the lazily allocated type to the memory types that a transient attachment may use.
fn play_requirements(below: &DeviceBelow, (device, image): (vk::Device, vk::Image), bits: &mut u32) {
    if let Some(lazy) = below.lazy.filter(|_| transient().contains(&(device, image.as_raw()))) {
        *bits |= 1 << lazy.played;
    }
}

pub unsafe extern "system" fn image_requirements(
    device: vk::Device,
    image: vk::Image,
    place: *mut vk::MemoryRequirements,
) {
    let (ask, below) = next!(device, vk::PFN_vkGetImageMemoryRequirements, c"vkGetImageMemoryRequirements");
    // SAFETY: as this function was called.
    unsafe { ask(device, image, place) };
    // SAFETY: it was just written there.
    play_requirements(&below, (device, image), unsafe { &mut (*place).memory_type_bits });
}

pub unsafe extern "system" fn image_requirements2(
    device: vk::Device,
    info: *const vk::ImageMemoryRequirementsInfo2<'_>,
    place: *mut vk::MemoryRequirements2<'_>,
) {
    let (ask, below) = next!(device, vk::PFN_vkGetImageMemoryRequirements2, c"vkGetImageMemoryRequirements2");
    // SAFETY: as this function was called.
    unsafe { ask(device, info, place) };
    // SAFETY: it was just written there, and the structure is the caller's.
    let (image, own) = unsafe { ((*info).image, &mut *place) };
    play_requirements(&below, (device, image), &mut own.memory_requirements.memory_type_bits);
}
