//! A driver that keeps data in its pipeline cache, and does not survive damage there. Software drivers keep nothing: with `cache:N` the layer adds N
//! bytes, at most 64 MiB, to the driver's data, takes them off when they are given back, and aborts the process if they are not the same.

use std::ffi::{CStr, c_void};
use std::slice;
use std::sync::atomic::{AtomicUsize, Ordering};

use ash::vk;

use crate::loader::typed;
use crate::steering::say;
use crate::table;

/// The most bytes added: sizes are summed in functions that the loader calls, where an overflow would abort.
const MOST: usize = 64 << 20;

static ADDED: AtomicUsize = AtomicUsize::new(0);

/// Makes caches `bytes` larger from now on, at most by [`MOST`].
pub fn add(bytes: usize) {
    ADDED.store(bytes.min(MOST), Ordering::SeqCst);
}

/// The bytes that are added.
fn data(length: usize) -> impl ExactSizeIterator<Item = u8> {
    (0..length).map(|index| (index % 251) as u8)
}

/// This module's function of that name, if it has one and is asked for.
pub fn own(name: &CStr) -> vk::PFN_vkVoidFunction {
    match name.to_bytes() {
        _ if ADDED.load(Ordering::SeqCst) == 0 => None,
        b"vkCreatePipelineCache" => untyped!(create, vk::PFN_vkCreatePipelineCache),
        b"vkGetPipelineCacheData" => untyped!(get_data, vk::PFN_vkGetPipelineCacheData),
        _ => None,
    }
}

unsafe extern "system" fn create(
    device: vk::Device,
    info: *const vk::PipelineCacheCreateInfo<'_>,
    callbacks: *const vk::AllocationCallbacks<'_>,
    cache: *mut vk::PipelineCache,
) -> vk::Result {
    // SAFETY: the type is that of the name.
    let create = unsafe { typed::<vk::PFN_vkCreatePipelineCache>(table::fallible(c"vkCreatePipelineCache")) };
    // SAFETY: the structure is as the specification has it.
    let (Some(create), Some(info)) = (create, unsafe { info.as_ref() }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    let mut info = *info;
    if info.initial_data_size > 0 {
        // SAFETY: as the specification has it, there are so many bytes.
        let given = unsafe { slice::from_raw_parts(info.p_initial_data.cast::<u8>(), info.initial_data_size) };
        let added = ADDED.load(Ordering::SeqCst);
        let of_driver = given.len().saturating_sub(added);
        if !given[of_driver..].iter().copied().eq(data(added)) {
            eprintln!("VK_LAYER_AFTERLIGHT_failures: a pipeline cache of {} bytes is damaged", given.len());
            std::process::abort();
        }
        say(&format!("a pipeline cache of {} bytes is whole", given.len()));
        info.initial_data_size = of_driver;
    }
    // SAFETY: as this function was called, with a part of the data.
    unsafe { create(device, &raw const info, callbacks, cache) }
}

unsafe extern "system" fn get_data(
    device: vk::Device,
    cache: vk::PipelineCache,
    size: *mut usize,
    place: *mut c_void,
) -> vk::Result {
    // SAFETY: the type is that of the name.
    let get = unsafe { typed::<vk::PFN_vkGetPipelineCacheData>(table::fallible(c"vkGetPipelineCacheData")) };
    let (Some(get), false) = (get, size.is_null()) else { return vk::Result::ERROR_INITIALIZATION_FAILED };
    let added = ADDED.load(Ordering::SeqCst);
    // SAFETY: as this function was called. The driver's part comes first, in as much room as it asks for: lavapipe 22.3 does not say how much of more room
    // it has used. A caller with too little room gets nothing, and learns that this is not all.
    unsafe {
        let room = size.read();
        let result = get(device, cache, size, std::ptr::null_mut());
        let of_driver = size.read();
        if result != vk::Result::SUCCESS || place.is_null() {
            size.write(of_driver + added);
            return result;
        }
        if room < of_driver + added {
            size.write(0);
            return vk::Result::INCOMPLETE;
        }
        let result = get(device, cache, size, place);
        if result == vk::Result::SUCCESS {
            let place = place.cast::<u8>().add(of_driver);
            data(added).enumerate().for_each(|(index, byte)| place.add(index).write(byte));
            size.write(of_driver + added);
        }
        result
    }
}
