//! Devices whose memory is not coherent: with `incoherent` the layer hides `HOST_COHERENT`, so that a program has to flush and to invalidate memory,
//! in the largest atoms that Vulkan allows. The memory below stays coherent, where flushing and invalidating do no harm. Vulkan promises each device
//! a coherent type, so this device is poorer than a real one can be.

use std::ffi::CStr;

use ash::vk;

use crate::chain::next;
use crate::steering::incoherent;

/// The most that `nonCoherentAtomSize` can be (specification, Required Limits).
const ATOM: vk::DeviceSize = 256;

fn change_memory(memory: &mut vk::PhysicalDeviceMemoryProperties) {
    memory.memory_types.iter_mut().for_each(|own| own.property_flags &= !vk::MemoryPropertyFlags::HOST_COHERENT);
}

fn change_device(device: &mut vk::PhysicalDeviceProperties) {
    device.limits.non_coherent_atom_size = ATOM;
}

/// Defines functions that query a structure from a device and then change it.
macro_rules! changed {
    ($($name:ident: $pfn:ident($type:ty), $change:expr;)*) => {
        /// The functions' C names, each with false since none is a device-level function.
        pub const NAMES: &[(&CStr, bool)] = &[$((c_name!($name), false)),*];

        #[allow(non_snake_case)]
        mod functions {
            use super::*;

            $(pub unsafe extern "system" fn $name(device: vk::PhysicalDevice, asked: *mut $type) {
                let change: fn(&mut $type) = $change;
                // SAFETY: the handle is the caller's own, and the type is that of the name; as this function was called.
                unsafe {
                    let Some(function) = next::<vk::$pfn>(device, c_name!($name)) else { return };
                    function(device, asked);
                    if incoherent() {
                        change(&mut *asked);
                    }
                }
            })*
        }

        /// This module's function of that name, if it has one.
        pub fn own(name: &CStr) -> vk::PFN_vkVoidFunction {
            match name.to_bytes() {
                $(own if own == stringify!($name).as_bytes() => untyped!(functions::$name, vk::$pfn),)*
                _ => None,
            }
        }
    };
}

changed! {
    vkGetPhysicalDeviceMemoryProperties: PFN_vkGetPhysicalDeviceMemoryProperties(vk::PhysicalDeviceMemoryProperties),
        change_memory;
    vkGetPhysicalDeviceMemoryProperties2: PFN_vkGetPhysicalDeviceMemoryProperties2(vk::PhysicalDeviceMemoryProperties2<'_>),
        |own| change_memory(&mut own.memory_properties);
    vkGetPhysicalDeviceMemoryProperties2KHR: PFN_vkGetPhysicalDeviceMemoryProperties2(vk::PhysicalDeviceMemoryProperties2<'_>),
        |own| change_memory(&mut own.memory_properties);
    vkGetPhysicalDeviceProperties: PFN_vkGetPhysicalDeviceProperties(vk::PhysicalDeviceProperties), change_device;
    vkGetPhysicalDeviceProperties2: PFN_vkGetPhysicalDeviceProperties2(vk::PhysicalDeviceProperties2<'_>),
        |own| change_device(&mut own.properties);
    vkGetPhysicalDeviceProperties2KHR: PFN_vkGetPhysicalDeviceProperties2(vk::PhysicalDeviceProperties2<'_>),
        |own| change_device(&mut own.properties);
}
