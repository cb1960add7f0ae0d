//! The host memory of drivers and layers below: counts its allocations, and refuses one on request.
//!
//! A program's own callbacks stay in use.

use std::alloc::{Layout, alloc, dealloc};
use std::ffi::{CStr, c_char, c_void};
use std::ptr;
use std::sync::atomic::{AtomicI64, AtomicPtr, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use ash::vk;

use crate::steering;

static ASKED_FOR: AtomicU64 = AtomicU64::new(0);
static FAILED: AtomicU64 = AtomicU64::new(0);
static REFUSED_IN: AtomicPtr<c_char> = AtomicPtr::new(ptr::null_mut());
static LIVE: AtomicI64 = AtomicI64::new(0);
static TO_FAIL: Mutex<Vec<u64>> = Mutex::new(Vec::new());

/// Before each allocation: its size and its alignment, of a `usize` each.
const HEADER: usize = 2 * size_of::<usize>();

struct Shared(vk::AllocationCallbacks<'static>);

// SAFETY: it points to functions only.
unsafe impl Sync for Shared {}

static CALLBACKS: Shared = Shared(vk::AllocationCallbacks {
    p_user_data: ptr::null_mut(),
    pfn_allocation: Some(allocate),
    pfn_reallocation: Some(reallocate),
    pfn_free: Some(free),
    pfn_internal_allocation: None,
    pfn_internal_free: None,
    _marker: std::marker::PhantomData,
});

/// Commands that get no callbacks from the layer. Messengers belong to the loader, and Debian 13's loader (1.4.309) frees memory through these
/// callbacks that it did not allocate through them.
const WITHOUT: [&CStr; 2] = [c"vkCreateDebugUtilsMessengerEXT", c"vkDestroyDebugUtilsMessengerEXT"];

/// Returns the callbacks for a command: the caller's, or the layer's if the caller has none and the command is not in [`WITHOUT`].
pub fn of_command<'a>(name: &CStr, own: *const vk::AllocationCallbacks<'a>) -> *const vk::AllocationCallbacks<'a> {
    if WITHOUT.contains(&name) { own } else { in_place_of(own) }
}

/// Returns the caller's callbacks, or the layer's if the caller has none.
pub fn in_place_of(own: *const vk::AllocationCallbacks<'_>) -> *const vk::AllocationCallbacks<'_> {
    if own.is_null() { (&raw const CALLBACKS.0).cast() } else { own }
}

/// The command in which an allocation was refused last. Null for one that cannot fail.
pub fn refused_in() -> *const c_char {
    REFUSED_IN.load(Ordering::SeqCst)
}

/// Refuses the allocation of this number.
pub fn fail_at(nth: u64) {
    TO_FAIL.lock().unwrap_or_else(PoisonError::into_inner).push(nth);
}

pub fn reset() {
    TO_FAIL.lock().unwrap_or_else(PoisonError::into_inner).clear();
    ASKED_FOR.store(0, Ordering::SeqCst);
    FAILED.store(0, Ordering::SeqCst);
}

pub fn asked_for() -> u64 {
    ASKED_FOR.load(Ordering::SeqCst)
}

pub fn failed() -> u64 {
    FAILED.load(Ordering::SeqCst)
}

pub fn live() -> i64 {
    LIVE.load(Ordering::SeqCst)
}

/// Counts an allocation, and says whether it may be made.
fn may_be_made() -> bool {
    let number = ASKED_FOR.fetch_add(1, Ordering::SeqCst) + 1;
    if !TO_FAIL.lock().unwrap_or_else(PoisonError::into_inner).contains(&number) {
        return true;
    }
    FAILED.fetch_add(1, Ordering::SeqCst);
    let command = steering::command();
    REFUSED_IN.store(command.map_or(ptr::null_mut(), |name| name.as_ptr().cast_mut()), Ordering::SeqCst);
    let command = command.map_or("a command that cannot fail".into(), |name| name.to_string_lossy());
    steering::say(&format!("allocation {number} of host memory is refused in {command}"));
    false
}

fn layout_of(size: usize, alignment: usize) -> Option<(Layout, usize)> {
    let offset = alignment.max(HEADER);
    Some((Layout::from_size_align(size.checked_add(offset)?, offset).ok()?, offset))
}

unsafe extern "system" fn allocate(
    _: *mut c_void,
    size: usize,
    alignment: usize,
    _: vk::SystemAllocationScope,
) -> *mut c_void {
    // One of no bytes is made as well, as by `malloc`: drivers take null for a lack of memory.
    if !may_be_made() {
        return ptr::null_mut();
    }
    let Some((layout, offset)) = layout_of(size, alignment) else { return ptr::null_mut() };
    // SAFETY: its size is not 0, as it has a header.
    let start = unsafe { alloc(layout) };
    if start.is_null() {
        return ptr::null_mut();
    }
    LIVE.fetch_add(1, Ordering::SeqCst);
    // SAFETY: the allocation is as large as the offset and the size together, and the header lies before the offset, aligned as it is.
    unsafe {
        let own = start.add(offset);
        own.sub(HEADER).cast::<[usize; 2]>().write([size, alignment]);
        own.cast()
    }
}

unsafe extern "system" fn reallocate(
    user: *mut c_void,
    original: *mut c_void,
    size: usize,
    alignment: usize,
    scope: vk::SystemAllocationScope,
) -> *mut c_void {
    // SAFETY: as this function was called.
    let new = if size == 0 { ptr::null_mut() } else { unsafe { allocate(user, size, alignment, scope) } };
    if original.is_null() || size != 0 && new.is_null() {
        // Without memory for the new size the original stays (specification, PFN_vkReallocationFunction).
        return new;
    }
    // SAFETY: the original came from `allocate`, so that its header lies before it; both are at least as large as the copy.
    unsafe {
        let [old, _] = original.cast::<u8>().sub(HEADER).cast::<[usize; 2]>().read();
        if !new.is_null() {
            ptr::copy_nonoverlapping(original.cast::<u8>(), new.cast(), old.min(size));
        }
        free(user, original);
    }
    new
}

unsafe extern "system" fn free(_: *mut c_void, memory: *mut c_void) {
    if memory.is_null() {
        return;
    }
    // SAFETY: it came from `allocate`, so that its header lies before it and says how it was made.
    unsafe {
        let [size, alignment] = memory.cast::<u8>().sub(HEADER).cast::<[usize; 2]>().read();
        if let Some((layout, offset)) = layout_of(size, alignment) {
            dealloc(memory.cast::<u8>().sub(offset), layout);
            LIVE.fetch_sub(1, Ordering::SeqCst);
        }
    }
}
