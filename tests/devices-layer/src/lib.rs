//! A Vulkan layer for tests: it plays devices that have less than the one below, `AFTERLIGHT_PLAYS` says which. docs/DEVICES.md says how it is loaded, and
//! what the program draws on each.
//!
//! It belongs below the validation layer, nearer to the driver: validation then holds the program against the played limits, features and formats. The
//! layer itself refuses to open a device with a feature or an extension that the played one lacks.
//!
//! Drawing goes to the device below as it is. The layer changes what a device says of itself, and does not make it slower or less precise.

#[path = "../../hdr-layer/src/loader.rs"]
mod loader;
#[macro_use]
#[path = "../../hdr-layer/src/shared.rs"]
mod shared;

mod chain;
mod device;
mod formats;
mod limits;
mod profile;
mod queries;

use std::ffi::{CStr, c_char};
use std::sync::{LazyLock, Mutex};

use ash::vk;
use device::DeviceBelow;
use loader::{Dispatched, InstanceLink, Interface, take_link, typed};
use profile::Profile;
use shared::{Table, below, locked};

const NAME: &CStr = c"VK_LAYER_AFTERLIGHT_devices";

/// What an instance has below this layer, and what is played on its devices.
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

/// The layer's entry: the loader asks which version of their interface both know, and for the functions by which it asks for all others.
///
/// # Safety
/// `interface` is null or the loader's own.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(interface: *mut Interface) -> vk::Result {
    // SAFETY: the caller's promise.
    let Some(interface) = (unsafe { interface.as_mut() }) else { return vk::Result::ERROR_INITIALIZATION_FAILED };
    if interface.structure != loader::INTERFACE || interface.version < loader::VERSION {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    }
    interface.version = loader::VERSION;
    interface.get_instance_proc_addr = Some(get_instance_proc_addr);
    interface.get_device_proc_addr = Some(get_device_proc_addr);
    interface.get_physical_device_proc_addr = None;
    vk::Result::SUCCESS
}

/// What this layer has of a device's functions.
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
        _ => None,
    }
}

/// What this layer has of an instance's functions.
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

/// The layer's own function where there is one and below it as well: where not, an extension is not enabled.
unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    if name.is_null() {
        return None;
    }
    // SAFETY: names are strings that end in NUL (specification, vkGetInstanceProcAddr).
    let own = own_of_instance(unsafe { CStr::from_ptr(name) });
    // SAFETY: the instance is null or the caller's own.
    let Some(below) = (unsafe { below(&INSTANCES, instance) }) else {
        // Before there is an instance, and while one is being created.
        return own;
    };
    // SAFETY: as this function was called.
    let other = unsafe { (below.get_proc_addr)(instance, name) };
    other.and(own.or(other))
}

/// The same of a device.
unsafe extern "system" fn get_device_proc_addr(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: the device is null or the caller's own.
    let below = unsafe { below(&DEVICES, device) }?;
    if name.is_null() {
        return None;
    }
    // SAFETY: names are strings that end in NUL (specification, vkGetDeviceProcAddr).
    let own = own_of_device(unsafe { CStr::from_ptr(name) });
    // SAFETY: as this function was called.
    let other = unsafe { (below.get_proc_addr)(device, name) };
    other.and(own.or(other))
}

unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;
    let profile = match Profile::chosen() {
        Ok(profile) => profile,
        Err(why) => {
            eprintln!("{}: {why}", NAME.to_string_lossy());
            return FAILED;
        }
    };
    // SAFETY: the loader passes on what a program has given it, with structures of its own in the chain.
    let Some(described) = (unsafe { info.as_ref() }) else { return FAILED };
    // SAFETY: as above; one thread creates this instance.
    let Some(link) = (unsafe { take_link::<InstanceLink>(described.p_next) }) else { return FAILED };
    let get_proc_addr = link.get_instance_proc_addr;
    // SAFETY: the layer below gives functions by their names.
    let create = unsafe { typed(get_proc_addr(vk::Instance::null(), c"vkCreateInstance".as_ptr())) };
    let create: vk::PFN_vkCreateInstance = match create {
        Some(create) => create,
        None => return FAILED,
    };
    // SAFETY: as this function was called, with the link of the layer below in the chain.
    let result = unsafe { create(info, allocator, instance) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: it was written there.
    let created = unsafe { instance.read() };
    // SAFETY: the instance was just created.
    let named = |name: &CStr| unsafe { get_proc_addr(created, name.as_ptr()) };
    let functions = queries::functions(named);
    // SAFETY: the type is that of the name.
    let destroy = unsafe { typed(named(c"vkDestroyInstance")) };
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        locked(&INSTANCES).insert(key, InstanceBelow { instance: created, get_proc_addr, destroy, functions, profile });
    }
    result
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
