//! What the layers of these tests share: tables of what is below, functions by name, lists that are told in parts.

use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::loader::Dispatched;

/// A function's pointer without its type, as functions are asked for by name.
macro_rules! untyped {
    ($function:expr, $type:ty) => {{
        let function: $type = $function;
        // SAFETY: both are pointers to functions; whoever calls it gives it the type that goes with its name.
        Some(unsafe { std::mem::transmute::<$type, unsafe extern "system" fn()>(function) })
    }};
}

/// By [`Dispatched::key`].
pub type Table<T> = LazyLock<Mutex<HashMap<usize, T>>>;

pub fn locked<T>(table: &Table<T>) -> MutexGuard<'_, HashMap<usize, T>> {
    // Whoever held it has changed it wholly or not at all.
    table.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is below a handle: copied, so that nothing is locked while it is called.
///
/// # Safety
/// As [`Dispatched::key`].
pub unsafe fn below<T: Copy>(table: &Table<T>, handle: impl Dispatched) -> Option<T> {
    // SAFETY: the caller's promise.
    let key = unsafe { handle.key() }?;
    locked(table).get(&key).copied()
}

/// Returns true if an extension is among those that an instance or a device is created with: their number, and their names.
///
/// # Safety
/// There are so many names, each of them a string that ends in NUL.
pub unsafe fn names_extension((count, names): (u32, *const *const c_char), extension: &CStr) -> bool {
    (0..count as usize).any(|index| {
        // SAFETY: the caller's promise.
        unsafe { CStr::from_ptr(names.add(index).read()) == extension }
    })
}

/// The whole of a list that is told in parts.
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

/// Tells a list as Vulkan's functions do: without a place for it how long it is, else as much of it as there is place for.
///
/// # Safety
/// `count` points to a number, and `place` is null or points to so many elements; nobody else uses them meanwhile.
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
