//! Devices whose memory is not coherent: with `incoherent` the layer hides `HOST_COHERENT`, so that a program has to flush and to invalidate memory. The
//! memory below stays what it is, where neither is wrong. Vulkan promises each device a coherent type, so this device is poorer than a real one can be.

use std::ffi::CStr;

use ash::vk;

use crate::chain::next;
use crate::steering::incoherent;

/// The functions that tell what memory there is, as C has their names; false, as none is of a device.
pub const NAMES: &[(&CStr, bool)] = &[(PLAIN, false), (CHAINED, false), (OF_THE_EXTENSION, false)];

const PLAIN: &CStr = c"vkGetPhysicalDeviceMemoryProperties";
const CHAINED: &CStr = c"vkGetPhysicalDeviceMemoryProperties2";
const OF_THE_EXTENSION: &CStr = c"vkGetPhysicalDeviceMemoryProperties2KHR";

/// This module's function of that name, if it has one.
pub fn own(name: &CStr) -> vk::PFN_vkVoidFunction {
    match name {
        name if name == PLAIN => untyped!(plain, vk::PFN_vkGetPhysicalDeviceMemoryProperties),
        name if name == CHAINED => untyped!(chained, vk::PFN_vkGetPhysicalDeviceMemoryProperties2),
        name if name == OF_THE_EXTENSION => untyped!(of_the_extension, vk::PFN_vkGetPhysicalDeviceMemoryProperties2),
        _ => None,
    }
}

fn hide_coherence(properties: &mut vk::PhysicalDeviceMemoryProperties) {
    if incoherent() {
        properties
            .memory_types
            .iter_mut()
            .for_each(|own| own.property_flags &= !vk::MemoryPropertyFlags::HOST_COHERENT);
    }
}

unsafe extern "system" fn plain(device: vk::PhysicalDevice, properties: *mut vk::PhysicalDeviceMemoryProperties) {
    // SAFETY: the handle is the caller's own, and the type is that of the name; as this function was called.
    unsafe {
        if let Some(function) = next::<vk::PFN_vkGetPhysicalDeviceMemoryProperties>(device, PLAIN) {
            function(device, properties);
            hide_coherence(&mut *properties);
        }
    }
}

unsafe extern "system" fn chained(
    device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceMemoryProperties2<'_>,
) {
    // SAFETY: as this function was called.
    unsafe { by_name(CHAINED, device, properties) }
}

unsafe extern "system" fn of_the_extension(
    device: vk::PhysicalDevice,
    properties: *mut vk::PhysicalDeviceMemoryProperties2<'_>,
) {
    // SAFETY: as this function was called.
    unsafe { by_name(OF_THE_EXTENSION, device, properties) }
}

/// Asks the function of one of the two names, which a device may have one of.
///
/// # Safety
/// As the function's own.
unsafe fn by_name(name: &CStr, device: vk::PhysicalDevice, properties: *mut vk::PhysicalDeviceMemoryProperties2<'_>) {
    // SAFETY: the handle is the caller's own, and the type is that of the name; as this function was called.
    unsafe {
        if let Some(function) = next::<vk::PFN_vkGetPhysicalDeviceMemoryProperties2>(device, name) {
            function(device, properties);
            hide_coherence(&mut (*properties).memory_properties);
        }
    }
}
