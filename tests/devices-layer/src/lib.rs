//! A Vulkan layer for tests: it plays a device that has less than the device below it, or one extension or some queues more. `AFTERLIGHT_PLAYS` names
//! the device. docs/DEVICES.md describes how to load the layer, and lists the results of the program on each device.
//!
//! It belongs below the validation layer, nearer to the driver: validation then holds the program against the played limits, features and formats. The
//! layer itself refuses to open a device with a feature or an extension that the played one lacks.
//!
//! Draws reach the device below unchanged. The layer changes a device's description of itself; it does not make the device slower or less precise.

#[path = "../../hdr-layer/src/loader.rs"]
mod loader;
#[macro_use]
#[path = "../../hdr-layer/src/shared.rs"]
mod shared;

mod chain;
mod device;
mod formats;
mod limits;
mod merging;
mod ownership;
mod profile;
mod queries;
mod queues;

use std::ffi::CStr;
use std::sync::{LazyLock, Mutex};

use ash::vk;
use device::DeviceBelow;
use loader::{Dispatched, typed};
use profile::Profile;
use shared::{Table, create_instance_below, locked};

const NAME: &CStr = c"VK_LAYER_AFTERLIGHT_devices";

/// An instance's functions below this layer, and the profile of the device that the layer plays.
#[derive(Clone, Copy)]
struct InstanceBelow {
    instance: vk::Instance,
    get_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    destroy: Option<vk::PFN_vkDestroyInstance>,
    functions: queries::Functions,
    profile: Profile,
}

static INSTANCES: Table<InstanceBelow> = LazyLock::new(Mutex::default);
static DEVICES: Table<DeviceBelow> = LazyLock::new(Mutex::default);

entry_points!();

/// Returns this layer's function of a device by its name, if there is one.
fn own_of_device(name: &CStr) -> vk::PFN_vkVoidFunction {
    use device as own;
    match name.to_bytes() {
        b"vkGetDeviceProcAddr" => untyped!(get_device_proc_addr, vk::PFN_vkGetDeviceProcAddr),
        b"vkDestroyDevice" => untyped!(own::destroy, vk::PFN_vkDestroyDevice),
        b"vkAllocateMemory" => untyped!(own::allocate_memory, vk::PFN_vkAllocateMemory),
        b"vkCreateImage" => untyped!(own::create_image, vk::PFN_vkCreateImage),
        b"vkDestroyImage" => untyped!(own::destroy_image, vk::PFN_vkDestroyImage),
        b"vkGetImageMemoryRequirements" => {
            untyped!(own::image_requirements, vk::PFN_vkGetImageMemoryRequirements)
        }
        b"vkGetImageMemoryRequirements2" | b"vkGetImageMemoryRequirements2KHR" => {
            untyped!(own::image_requirements2, vk::PFN_vkGetImageMemoryRequirements2)
        }
        b"vkCreateRenderPass2" | b"vkCreateRenderPass2KHR" => {
            untyped!(merging::create_render_pass2, vk::PFN_vkCreateRenderPass2)
        }
        // Other devices have the real queues, and nothing is between them and the program.
        _ if Profile::chosen().is_ok_and(Profile::has_queues) => own_of_queues(name),
        _ => None,
    }
}

/// Returns this layer's function of this name for played queues and for the objects that they own, if it has one.
fn own_of_queues(name: &CStr) -> vk::PFN_vkVoidFunction {
    use {ownership as own, queues};
    match name.to_bytes() {
        b"vkGetDeviceQueue" => untyped!(queues::get, vk::PFN_vkGetDeviceQueue),
        b"vkGetDeviceQueue2" => untyped!(queues::get2, vk::PFN_vkGetDeviceQueue2),
        b"vkQueueSubmit" => untyped!(queues::submit, vk::PFN_vkQueueSubmit),
        b"vkQueueSubmit2" | b"vkQueueSubmit2KHR" => untyped!(queues::submit2, vk::PFN_vkQueueSubmit2),
        b"vkQueueBindSparse" => untyped!(queues::bind_sparse, vk::PFN_vkQueueBindSparse),
        b"vkQueueWaitIdle" => untyped!(queues::wait_idle, vk::PFN_vkQueueWaitIdle),
        b"vkQueuePresentKHR" => untyped!(queues::present, vk::PFN_vkQueuePresentKHR),
        b"vkQueueBeginDebugUtilsLabelEXT" => {
            untyped!(queues::begin_label, vk::PFN_vkQueueBeginDebugUtilsLabelEXT)
        }
        b"vkQueueEndDebugUtilsLabelEXT" => untyped!(queues::end_label, vk::PFN_vkQueueEndDebugUtilsLabelEXT),
        b"vkQueueInsertDebugUtilsLabelEXT" => {
            untyped!(queues::insert_label, vk::PFN_vkQueueInsertDebugUtilsLabelEXT)
        }
        b"vkDeviceWaitIdle" => untyped!(queues::device_wait_idle, vk::PFN_vkDeviceWaitIdle),
        b"vkSetDebugUtilsObjectNameEXT" => untyped!(queues::set_name, vk::PFN_vkSetDebugUtilsObjectNameEXT),
        b"vkSetDebugUtilsObjectTagEXT" => untyped!(queues::set_tag, vk::PFN_vkSetDebugUtilsObjectTagEXT),
        b"vkCreateCommandPool" => untyped!(own::create_command_pool, vk::PFN_vkCreateCommandPool),
        b"vkDestroyCommandPool" => untyped!(own::destroy_command_pool, vk::PFN_vkDestroyCommandPool),
        b"vkAllocateCommandBuffers" => untyped!(own::allocate_command_buffers, vk::PFN_vkAllocateCommandBuffers),
        b"vkFreeCommandBuffers" => untyped!(own::free_command_buffers, vk::PFN_vkFreeCommandBuffers),
        b"vkCmdPipelineBarrier" => untyped!(own::pipeline_barrier, vk::PFN_vkCmdPipelineBarrier),
        b"vkCmdPipelineBarrier2" | b"vkCmdPipelineBarrier2KHR" => {
            untyped!(own::pipeline_barrier2, vk::PFN_vkCmdPipelineBarrier2)
        }
        b"vkCreateBuffer" => untyped!(own::create_buffer, vk::PFN_vkCreateBuffer),
        b"vkCreateSwapchainKHR" => untyped!(own::create_swapchain, vk::PFN_vkCreateSwapchainKHR),
        _ => None,
    }
}

/// Returns this layer's function of an instance by its name, if there is one.
fn own_of_instance(name: &CStr) -> vk::PFN_vkVoidFunction {
    use queries as own;
    match name.to_bytes() {
        b"vkGetInstanceProcAddr" => untyped!(get_instance_proc_addr, vk::PFN_vkGetInstanceProcAddr),
        b"vkCreateInstance" => untyped!(create_instance, vk::PFN_vkCreateInstance),
        b"vkDestroyInstance" => untyped!(destroy_instance, vk::PFN_vkDestroyInstance),
        b"vkCreateDevice" => untyped!(device::create, vk::PFN_vkCreateDevice),
        b"vkEnumerateDeviceExtensionProperties" => {
            untyped!(own::extensions, vk::PFN_vkEnumerateDeviceExtensionProperties)
        }
        b"vkGetPhysicalDeviceProperties" => untyped!(own::properties, vk::PFN_vkGetPhysicalDeviceProperties),
        b"vkGetPhysicalDeviceProperties2" | b"vkGetPhysicalDeviceProperties2KHR" => {
            untyped!(own::properties2, vk::PFN_vkGetPhysicalDeviceProperties2)
        }
        b"vkGetPhysicalDeviceFeatures" => untyped!(own::features, vk::PFN_vkGetPhysicalDeviceFeatures),
        b"vkGetPhysicalDeviceFeatures2" | b"vkGetPhysicalDeviceFeatures2KHR" => {
            untyped!(own::features2, vk::PFN_vkGetPhysicalDeviceFeatures2)
        }
        b"vkGetPhysicalDeviceMemoryProperties" => untyped!(own::memory, vk::PFN_vkGetPhysicalDeviceMemoryProperties),
        b"vkGetPhysicalDeviceMemoryProperties2" | b"vkGetPhysicalDeviceMemoryProperties2KHR" => {
            untyped!(own::memory2, vk::PFN_vkGetPhysicalDeviceMemoryProperties2)
        }
        b"vkGetPhysicalDeviceQueueFamilyProperties" => {
            untyped!(own::families, vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties)
        }
        b"vkGetPhysicalDeviceQueueFamilyProperties2" | b"vkGetPhysicalDeviceQueueFamilyProperties2KHR" => {
            untyped!(own::families2, vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties2)
        }
        b"vkGetPhysicalDeviceSurfaceSupportKHR" => {
            untyped!(own::surface_support, vk::PFN_vkGetPhysicalDeviceSurfaceSupportKHR)
        }
        b"vkGetPhysicalDeviceXcbPresentationSupportKHR" => {
            untyped!(own::xcb_support, vk::PFN_vkGetPhysicalDeviceXcbPresentationSupportKHR)
        }
        b"vkGetPhysicalDeviceXlibPresentationSupportKHR" => {
            untyped!(own::xlib_support, vk::PFN_vkGetPhysicalDeviceXlibPresentationSupportKHR)
        }
        b"vkGetPhysicalDeviceWaylandPresentationSupportKHR" => {
            untyped!(own::wayland_support, vk::PFN_vkGetPhysicalDeviceWaylandPresentationSupportKHR)
        }
        b"vkGetPhysicalDeviceWin32PresentationSupportKHR" => {
            untyped!(own::win32_support, vk::PFN_vkGetPhysicalDeviceWin32PresentationSupportKHR)
        }
        b"vkGetPhysicalDeviceFormatProperties" => untyped!(own::format, vk::PFN_vkGetPhysicalDeviceFormatProperties),
        b"vkGetPhysicalDeviceFormatProperties2" | b"vkGetPhysicalDeviceFormatProperties2KHR" => {
            untyped!(own::format2, vk::PFN_vkGetPhysicalDeviceFormatProperties2)
        }
        b"vkGetPhysicalDeviceImageFormatProperties" => {
            untyped!(own::image_format, vk::PFN_vkGetPhysicalDeviceImageFormatProperties)
        }
        b"vkGetPhysicalDeviceImageFormatProperties2" | b"vkGetPhysicalDeviceImageFormatProperties2KHR" => {
            untyped!(own::image_format2, vk::PFN_vkGetPhysicalDeviceImageFormatProperties2)
        }
        _ => own_of_device(name),
    }
}

unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    let profile = match Profile::chosen() {
        Ok(profile) => profile,
        Err(why) => {
            eprintln!("{}: {why}", NAME.to_string_lossy());
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        }
    };
    // SAFETY: as this function was called.
    let (created, get_proc_addr) = match unsafe { create_instance_below(info, allocator, instance) } {
        Ok(created) => created,
        Err(failed) => return failed,
    };
    // SAFETY: the instance was just created.
    let named = |name: &CStr| unsafe { get_proc_addr(created, name.as_ptr()) };
    let functions = queries::functions(named);
    // SAFETY: the type is that of the name.
    let destroy = unsafe { typed(named(c"vkDestroyInstance")) };
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        locked(&INSTANCES).insert(key, InstanceBelow { instance: created, get_proc_addr, destroy, functions, profile });
    }
    vk::Result::SUCCESS
}

unsafe extern "system" fn destroy_instance(instance: vk::Instance, allocator: *const vk::AllocationCallbacks<'_>) {
    // SAFETY: the instance is null or the caller's own.
    let Some(key) = (unsafe { instance.key() }) else { return };
    let below = locked(&INSTANCES).remove(&key);
    if let Some(destroy) = below.and_then(|below| below.destroy) {
        // SAFETY: as this function was called.
        unsafe { destroy(instance, allocator) };
    }
}
