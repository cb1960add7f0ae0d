//! The interface between the loader and its layers: vk_layer.h of the Vulkan headers, version 2 of the interface, as far as a layer needs it.

use std::ffi::c_void;
use std::ptr::NonNull;

use ash::vk;

/// The version of the interface from which on the loader asks for [`Interface`].
pub const VERSION: u32 = 2;

/// `LAYER_NEGOTIATE_INTERFACE_STRUCT` of `VkNegotiateLayerStructType`.
pub const INTERFACE: i32 = 1;

/// `VkNegotiateLayerInterface`: the layer's answer to the loader.
#[repr(C)]
pub struct Interface {
    pub structure: i32,
    pub next: *mut c_void,
    pub version: u32,
    pub get_instance_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
    pub get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    /// `PFN_GetPhysicalDeviceProcAddr`: `None` for a layer that adds no functions.
    pub get_physical_device_proc_addr: vk::PFN_vkVoidFunction,
}

/// `VK_LAYER_LINK_INFO` of `VkLayerFunction`.
const LINK: i32 = 0;

/// `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`, up to the member of their unions that says who comes next.
#[repr(C)]
struct CreateInfo<L> {
    structure: vk::StructureType,
    next: *const c_void,
    function: i32,
    link: *mut L,
}

/// `VkLayerInstanceLink`.
#[repr(C)]
pub struct InstanceLink {
    next: *mut InstanceLink,
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    get_physical_device_proc_addr: vk::PFN_vkVoidFunction,
}

/// `VkLayerDeviceLink`.
#[repr(C)]
pub struct DeviceLink {
    next: *mut DeviceLink,
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    pub get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
}

/// A link that the loader puts into the chain of an instance's or a device's creation, for each layer in turn.
pub trait Link: Sized {
    /// The type of the structure that holds the link.
    const STRUCTURE: vk::StructureType;

    /// The link of the layer below.
    fn below(&self) -> *mut Self;
}

impl Link for InstanceLink {
    const STRUCTURE: vk::StructureType = vk::StructureType::LOADER_INSTANCE_CREATE_INFO;

    fn below(&self) -> *mut Self {
        self.next
    }
}

impl Link for DeviceLink {
    const STRUCTURE: vk::StructureType = vk::StructureType::LOADER_DEVICE_CREATE_INFO;

    fn below(&self) -> *mut Self {
        self.next
    }
}

/// Takes this layer's link out of the chain, so that the layer below finds its own there. Returns `None` if the chain is not the loader's.
///
/// # Safety
/// `chain` is null, or points to structures of Vulkan that are chained by their second member, are alive, and are read by nobody else meanwhile.
pub unsafe fn take_link<'a, L: Link>(mut chain: *const c_void) -> Option<&'a L> {
    while let Some(structure) = NonNull::new(chain.cast_mut().cast::<vk::BaseInStructure>()) {
        // SAFETY: the caller's promise: each begins as a `VkBaseInStructure` does.
        let base = unsafe { structure.read() };
        if base.s_type == L::STRUCTURE {
            // SAFETY: that type is the loader's own, and has a function in this place.
            let info = unsafe { structure.cast::<CreateInfo<L>>().as_mut() };
            if info.function == LINK {
                // SAFETY: with this function the union holds a link, or null at the end.
                let link = unsafe { info.link.as_ref() }?;
                info.link = link.below();
                return Some(link);
            }
        }
        chain = base.p_next.cast();
    }
    None
}

/// Returns a function with the type that goes with its name, or `None` without a function.
///
/// # Safety
/// `F` is the type of the function's pointer.
pub unsafe fn typed<F: Copy>(function: vk::PFN_vkVoidFunction) -> Option<F> {
    const { assert!(size_of::<F>() == size_of::<unsafe extern "system" fn()>()) };
    // SAFETY: pointers to functions have one size, and the type is the caller's promise.
    function.map(|function| unsafe { std::mem::transmute_copy(&function) })
}

/// A handle that functions are dispatched by: `VkInstance`, `VkPhysicalDevice`, `VkDevice`.
pub trait Dispatched: vk::Handle + Copy {
    /// Returns the word that all handles of one instance, or of one device, point to: the address of the loader's table. Returns `None` for a null
    /// handle.
    ///
    /// # Safety
    /// The handle is null or alive, and came from the loader or from a layer below.
    unsafe fn key(self) -> Option<usize> {
        let pointer = NonNull::new(self.as_raw() as *mut usize)?;
        // SAFETY: the caller's promise; the interface between loader and drivers puts that word first.
        Some(unsafe { pointer.read() })
    }
}

impl Dispatched for vk::Instance {}
impl Dispatched for vk::PhysicalDevice {}
impl Dispatched for vk::Device {}
