//! Parts of the layers of these tests: their entry, tables of instances and devices below, functions by name, lists that are told in parts.

use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::loader::{DeviceLink, Dispatched, InstanceLink, take_link, typed};

/// A function's pointer without its type, as functions are asked for by name.
macro_rules! untyped {
    ($function:expr, $type:ty) => {{
        let function: $type = $function;
        // SAFETY: both are pointers to functions; the caller gives it the type that goes with its name.
        Some(unsafe { std::mem::transmute::<$type, unsafe extern "system" fn()>(function) })
    }};
}

/// The layer's entry, and the functions by which the loader then asks for all others. The layer that uses this macro has `own_of_instance` and
/// `own_of_device`, which return a function by its name, and the tables `INSTANCES` and `DEVICES`.
macro_rules! entry_points {
    () => {
        /// The layer's entry: the loader asks for the version of the interface that both know, and for the functions by which it asks for all others.
        ///
        /// # Safety
        /// `interface` is null or the loader's own.
        #[unsafe(no_mangle)]
        pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
            interface: *mut $crate::loader::Interface,
        ) -> vk::Result {
            // SAFETY: the caller's promise.
            let Some(interface) = (unsafe { interface.as_mut() }) else {
                return vk::Result::ERROR_INITIALIZATION_FAILED;
            };
            if interface.structure != $crate::loader::INTERFACE || interface.version < $crate::loader::VERSION {
                return vk::Result::ERROR_INITIALIZATION_FAILED;
            }
            interface.version = $crate::loader::VERSION;
            interface.get_instance_proc_addr = Some(get_instance_proc_addr);
            interface.get_device_proc_addr = Some(get_device_proc_addr);
            interface.get_physical_device_proc_addr = None;
            vk::Result::SUCCESS
        }

        /// Returns the layer's own function, else the function below. Returns `None` for a function that is missing below, since its extension is not
        /// enabled.
        unsafe extern "system" fn get_instance_proc_addr(
            instance: vk::Instance,
            name: *const std::ffi::c_char,
        ) -> vk::PFN_vkVoidFunction {
            if name.is_null() {
                return None;
            }
            // SAFETY: names are strings that end in NUL (specification, vkGetInstanceProcAddr).
            let own = own_of_instance(unsafe { std::ffi::CStr::from_ptr(name) });
            // SAFETY: the instance is null or the caller's own.
            let Some(below) = (unsafe { $crate::shared::below(&INSTANCES, instance) }) else {
                // No instance exists yet, or it is being created.
                return own;
            };
            // SAFETY: as this function was called.
            let other = unsafe { (below.get_proc_addr)(instance, name) };
            other.and(own.or(other))
        }

        /// Returns a device's function by the rules of `get_instance_proc_addr`.
        unsafe extern "system" fn get_device_proc_addr(
            device: vk::Device,
            name: *const std::ffi::c_char,
        ) -> vk::PFN_vkVoidFunction {
            // SAFETY: the device is null or the caller's own.
            let below = unsafe { $crate::shared::below(&DEVICES, device) }?;
            if name.is_null() {
                return None;
            }
            // SAFETY: names are strings that end in NUL (specification, vkGetDeviceProcAddr).
            let own = own_of_device(unsafe { std::ffi::CStr::from_ptr(name) });
            // SAFETY: as this function was called.
            let other = unsafe { (below.get_proc_addr)(device, name) };
            other.and(own.or(other))
        }
    };
}

/// Entries by their [`Dispatched::key`].
pub type Table<T> = LazyLock<Mutex<HashMap<usize, T>>>;

pub fn locked<T>(table: &Table<T>) -> MutexGuard<'_, HashMap<usize, T>> {
    // A thread that panicked with the lock has changed the table wholly or not at all.
    table.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the entry of a handle, copied, so that nothing is locked while a function of it is called.
///
/// # Safety
/// As [`Dispatched::key`].
pub unsafe fn below<T: Copy>(table: &Table<T>, handle: impl Dispatched) -> Option<T> {
    // SAFETY: the caller's promise.
    let key = unsafe { handle.key() }?;
    locked(table).get(&key).copied()
}

/// Creates the instance below, and returns it with the function that gives its functions by their names.
///
/// # Safety
/// As `vkCreateInstance`, as the loader calls it of a layer.
pub unsafe fn create_instance_below(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> Result<(vk::Instance, vk::PFN_vkGetInstanceProcAddr), vk::Result> {
    const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;
    // SAFETY: the loader passes on the program's structure, with structures of its own in the chain.
    let described = unsafe { info.as_ref() }.ok_or(FAILED)?;
    // SAFETY: as above; one thread creates this instance.
    let link = unsafe { take_link::<InstanceLink>(described.p_next) }.ok_or(FAILED)?;
    let get_proc_addr = link.get_instance_proc_addr;
    // SAFETY: the layer below gives functions by their names.
    let create = unsafe { typed(get_proc_addr(vk::Instance::null(), c"vkCreateInstance".as_ptr())) };
    let create: vk::PFN_vkCreateInstance = create.ok_or(FAILED)?;
    // SAFETY: the caller's promise, with the link of the layer below in the chain.
    match unsafe { create(info, allocator, instance) } {
        // SAFETY: it was written there.
        vk::Result::SUCCESS => Ok((unsafe { instance.read() }, get_proc_addr)),
        failed => Err(failed),
    }
}

/// Returns the functions of the layer below that create a device, and that give its functions by their names.
///
/// # Safety
/// `described` is a device's creation, as the loader calls it of a layer, on a physical device of `instance`.
pub unsafe fn device_below(
    instance: vk::Instance,
    described: &vk::DeviceCreateInfo<'_>,
) -> Option<(vk::PFN_vkCreateDevice, vk::PFN_vkGetDeviceProcAddr)> {
    // SAFETY: the caller's promise; one thread creates this device.
    let link = unsafe { take_link::<DeviceLink>(described.p_next) }?;
    // SAFETY: the layer below gives functions by their names.
    let create = unsafe { typed((link.get_instance_proc_addr)(instance, c"vkCreateDevice".as_ptr())) }?;
    Some((create, link.get_device_proc_addr))
}

/// Returns true if an extension is among the enabled ones of an instance or a device, given as their number and their names.
///
/// # Safety
/// The number counts the names, and each of them is a string that ends in NUL.
pub unsafe fn names_extension((count, names): (u32, *const *const c_char), extension: &CStr) -> bool {
    (0..count as usize).any(|index| {
        // SAFETY: the caller's promise.
        unsafe { CStr::from_ptr(names.add(index).read()) == extension }
    })
}

/// Returns the whole of a list that Vulkan reports in parts.
pub fn all<T: Clone + Default>(ask: impl Fn(*mut u32, *mut T) -> vk::Result) -> Result<Vec<T>, vk::Result> {
    loop {
        let mut count = 0;
        let counted = ask(&raw mut count, std::ptr::null_mut());
        if counted != vk::Result::SUCCESS {
            return Err(counted);
        }
        let mut list = vec![T::default(); count as usize];
        match ask(&raw mut count, list.as_mut_ptr()) {
            vk::Result::SUCCESS => {
                list.truncate(count as usize);
                return Ok(list);
            }
            // There are more than when they were counted.
            vk::Result::INCOMPLETE => {}
            failed => return Err(failed),
        }
    }
}

/// Reports a list as Vulkan's functions do: only its length if `place` is null, else as many elements as fit there.
///
/// # Safety
/// `count` points to a number, and `place` is null or points to that many elements; nobody else uses them meanwhile.
pub unsafe fn tell<T: Copy>(list: &[T], count: *mut u32, place: *mut T) -> vk::Result {
    let length = u32::try_from(list.len()).unwrap_or(u32::MAX);
    if place.is_null() {
        // SAFETY: the caller's promise.
        unsafe { count.write(length) };
        return vk::Result::SUCCESS;
    }
    // SAFETY: the caller's promise.
    let told = length.min(unsafe { count.read() });
    // SAFETY: the list has so many, and so has the place; one is this layer's own, the other is not.
    unsafe { place.copy_from_nonoverlapping(list.as_ptr(), told as usize) };
    // SAFETY: as above.
    unsafe { count.write(told) };
    if told < length { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_counted_then_told_and_cut_where_the_place_ends() {
        let list = [7, 8, 9];
        let told = |mut count: u32, place: Option<&mut [i32; 4]>| {
            let place = place.map_or(std::ptr::null_mut(), |place| place.as_mut_ptr());
            // SAFETY: no test gives a count beyond the four places.
            let result = unsafe { tell(&list, &raw mut count, place) };
            (result, count)
        };
        assert_eq!(told(99, None), (vk::Result::SUCCESS, 3));
        for (count, result, expected) in [
            (0, vk::Result::INCOMPLETE, [0; 4]),
            (2, vk::Result::INCOMPLETE, [7, 8, 0, 0]),
            (3, vk::Result::SUCCESS, [7, 8, 9, 0]),
            (4, vk::Result::SUCCESS, [7, 8, 9, 0]),
        ] {
            let mut place = [0; 4];
            assert_eq!(told(count, Some(&mut place)), (result, count.min(3)));
            assert_eq!(place, expected);
        }
    }
}
