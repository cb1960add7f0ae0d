//! A Vulkan layer for tests of HDR without an HDR display. Surfaces with 10-bit formats also offer them with `HDR10_ST2084_EXT`, and the driver makes
//! such swapchains as if their values were sRGB. A program that reads a window back finds the codes that an HDR display would get.
//!
//! It adds no extension: as with a driver, surfaces have other colour spaces only where the instance has `VK_EXT_swapchain_colorspace`, which the
//! driver must know. It belongs below the validation layer, which then knows the offered formats. `vkGetPhysicalDeviceSurfaceFormats2KHR` has the
//! driver's own answer.

mod formats;
mod loader;
#[macro_use]
mod shared;

use std::ffi::CStr;
use std::sync::{LazyLock, Mutex};

use ash::vk;
use loader::{Dispatched, typed};
use shared::{Table, all, below, create_instance_below, device_below, locked, names_extension, tell};

/// An instance's functions below this layer.
#[derive(Clone, Copy)]
struct InstanceBelow {
    instance: vk::Instance,
    get_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    destroy: Option<vk::PFN_vkDestroyInstance>,
    /// The function below, absent if the instance has no surfaces.
    formats: Option<vk::PFN_vkGetPhysicalDeviceSurfaceFormatsKHR>,
    /// True if surfaces may have other colour spaces than sRGB's.
    has_color_spaces: bool,
}

/// A device's functions below this layer.
#[derive(Clone, Copy)]
struct DeviceBelow {
    get_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    destroy: Option<vk::PFN_vkDestroyDevice>,
    /// The function below, absent if the device has no swapchains.
    create_swapchain: Option<vk::PFN_vkCreateSwapchainKHR>,
}

static INSTANCES: Table<InstanceBelow> = LazyLock::new(Mutex::default);
static DEVICES: Table<DeviceBelow> = LazyLock::new(Mutex::default);

entry_points!();

/// Returns this layer's function of a device by its name, if there is one.
fn own_of_device(name: &CStr) -> vk::PFN_vkVoidFunction {
    match name.to_bytes() {
        b"vkGetDeviceProcAddr" => untyped!(get_device_proc_addr, vk::PFN_vkGetDeviceProcAddr),
        b"vkDestroyDevice" => untyped!(destroy_device, vk::PFN_vkDestroyDevice),
        b"vkCreateSwapchainKHR" => untyped!(create_swapchain, vk::PFN_vkCreateSwapchainKHR),
        _ => None,
    }
}

/// Returns this layer's function of an instance by its name, if there is one.
fn own_of_instance(name: &CStr) -> vk::PFN_vkVoidFunction {
    match name.to_bytes() {
        b"vkGetInstanceProcAddr" => untyped!(get_instance_proc_addr, vk::PFN_vkGetInstanceProcAddr),
        b"vkCreateInstance" => untyped!(create_instance, vk::PFN_vkCreateInstance),
        b"vkDestroyInstance" => untyped!(destroy_instance, vk::PFN_vkDestroyInstance),
        b"vkCreateDevice" => untyped!(create_device, vk::PFN_vkCreateDevice),
        b"vkGetPhysicalDeviceSurfaceFormatsKHR" => {
            untyped!(surface_formats, vk::PFN_vkGetPhysicalDeviceSurfaceFormatsKHR)
        }
        _ => own_of_device(name),
    }
}

unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo,
    allocator: *const vk::AllocationCallbacks,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: as this function was called.
    let (created, get_proc_addr) = match unsafe { create_instance_below(info, allocator, instance) } {
        Ok(created) => created,
        Err(failed) => return failed,
    };
    // SAFETY: the types are those of the names, and the structure is the caller's.
    let below = unsafe {
        let named = |name: &CStr| get_proc_addr(created, name.as_ptr());
        InstanceBelow {
            instance: created,
            get_proc_addr,
            destroy: typed(named(c"vkDestroyInstance")),
            formats: typed(named(c"vkGetPhysicalDeviceSurfaceFormatsKHR")),
            has_color_spaces: names_extension(
                ((*info).enabled_extension_count, (*info).pp_enabled_extension_names),
                ash::ext::swapchain_colorspace::NAME,
            ),
        }
    };
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        locked(&INSTANCES).insert(key, below);
    }
    vk::Result::SUCCESS
}

unsafe extern "system" fn destroy_instance(instance: vk::Instance, allocator: *const vk::AllocationCallbacks) {
    // SAFETY: the instance is null or the caller's own.
    let Some(key) = (unsafe { instance.key() }) else { return };
    let below = locked(&INSTANCES).remove(&key);
    if let Some(destroy) = below.and_then(|below| below.destroy) {
        // SAFETY: as this function was called.
        unsafe { destroy(instance, allocator) };
    }
}

unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo,
    allocator: *const vk::AllocationCallbacks,
    device: *mut vk::Device,
) -> vk::Result {
    const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;
    // SAFETY: the loader passes on the program's structure, with structures of its own in the chain.
    let Some(described) = (unsafe { info.as_ref() }) else { return FAILED };
    // SAFETY: the physical device is the caller's own; it has the key of its instance.
    let Some(parent) = (unsafe { below(&INSTANCES, physical) }) else { return FAILED };
    // SAFETY: as this function was called.
    let Some((create, get_proc_addr)) = (unsafe { device_below(parent.instance, described) }) else { return FAILED };
    // SAFETY: as this function was called, with the link of the layer below in the chain.
    let result = unsafe { create(physical, info, allocator, device) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: it was written there.
    let created = unsafe { device.read() };
    // SAFETY: the types are those of the names.
    let below = unsafe {
        let named = |name: &CStr| get_proc_addr(created, name.as_ptr());
        DeviceBelow {
            get_proc_addr,
            destroy: typed(named(c"vkDestroyDevice")),
            create_swapchain: typed(named(c"vkCreateSwapchainKHR")),
        }
    };
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        locked(&DEVICES).insert(key, below);
    }
    result
}

unsafe extern "system" fn destroy_device(device: vk::Device, allocator: *const vk::AllocationCallbacks) {
    // SAFETY: the device is null or the caller's own.
    let Some(key) = (unsafe { device.key() }) else { return };
    let below = locked(&DEVICES).remove(&key);
    if let Some(destroy) = below.and_then(|below| below.destroy) {
        // SAFETY: as this function was called.
        unsafe { destroy(device, allocator) };
    }
}

unsafe extern "system" fn surface_formats(
    physical: vk::PhysicalDevice,
    surface: vk::SurfaceKHR,
    count: *mut u32,
    place: *mut vk::SurfaceFormatKHR,
) -> vk::Result {
    // SAFETY: the physical device is the caller's own; it has the key of its instance.
    let Some(below) = (unsafe { below(&INSTANCES, physical) }) else { return vk::Result::ERROR_UNKNOWN };
    let Some(formats) = below.formats else { return vk::Result::ERROR_UNKNOWN };
    if !below.has_color_spaces {
        // SAFETY: as this function was called.
        return unsafe { formats(physical, surface, count, place) };
    }
    // SAFETY: as this function was called, but for the list, which is this layer's own.
    let offered = all(|count, place| unsafe { formats(physical, surface, count, place) });
    match offered {
        // SAFETY: as this function was called.
        Ok(offered) => unsafe { tell(&formats::with_hdr10(offered), count, place) },
        Err(result) => result,
    }
}

unsafe extern "system" fn create_swapchain(
    device: vk::Device,
    info: *const vk::SwapchainCreateInfoKHR,
    allocator: *const vk::AllocationCallbacks,
    swapchain: *mut vk::SwapchainKHR,
) -> vk::Result {
    // SAFETY: the device is the caller's own.
    let create = unsafe { below(&DEVICES, device) }.and_then(|below| below.create_swapchain);
    // SAFETY: the structure is as the specification has it.
    let (Some(create), Some(info)) = (create, unsafe { info.as_ref() }) else { return vk::Result::ERROR_UNKNOWN };
    let info = vk::SwapchainCreateInfoKHR { image_color_space: formats::for_driver(info.image_color_space), ..*info };
    // SAFETY: as this function was called; the copy's pointers are the caller's.
    unsafe { create(device, &raw const info, allocator, swapchain) }
}
