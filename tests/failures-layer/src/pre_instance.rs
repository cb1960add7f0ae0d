//! Commands that are called before there is an instance: loaders ask implicit layers for them, by `pre_instance_functions` of a manifest
//! (`vulkan/implicit_layer.d`). For each call a loader opens the library anew and closes it after; that it stays in the process, with its counts, is the
//! work of `build.rs`.

use std::ffi::{c_char, c_void};

use ash::vk;

use crate::steering::{CallFate, decide, read_environment};

/// `VkChainHeader` of vk_layer.h.
#[repr(C)]
struct ChainHeader {
    kind: i32,
    version: u32,
    size: u32,
}

/// `VkEnumerateInstanceVersionChain` and its like: the next layer's function, or the loader's own, and its first argument.
#[repr(C)]
pub struct Chain<F> {
    header: ChainHeader,
    next: F,
    link: *const c_void,
}

type Version = unsafe extern "system" fn(*const c_void, *mut u32) -> vk::Result;
type Layers = unsafe extern "system" fn(*const c_void, *mut u32, *mut vk::LayerProperties) -> vk::Result;
type Extensions =
    unsafe extern "system" fn(*const c_void, *const c_char, *mut u32, *mut vk::ExtensionProperties) -> vk::Result;

/// Makes a call, or lets it fail. `shorten` takes an element's room from the caller's list, if it has one.
fn answer(
    command: &'static str,
    has_list: bool,
    shorten: impl FnOnce(),
    call: impl FnOnce() -> vk::Result,
) -> vk::Result {
    // Words that mean nothing are told of when an instance is created: these functions have no result for them.
    let _ = read_environment();
    match decide(command, None, has_list) {
        CallFate::Instead(result) => result,
        CallFate::Shortened => {
            shorten();
            call()
        }
        CallFate::Pass | CallFate::After(_) | CallFate::Lost { .. } => call(),
    }
}

/// `vkEnumerateInstanceVersion`.
///
/// # Safety
/// As a loader calls it.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn afterlight_failures_enumerate_instance_version(
    chain: *const Chain<Version>,
    version: *mut u32,
) -> vk::Result {
    // SAFETY: the loader's own chain, with a function of this type, and the program's arguments; here and below.
    let call = || unsafe { ((*chain).next)((*chain).link, version) };
    answer("vkEnumerateInstanceVersion", false, || {}, call)
}

/// `vkEnumerateInstanceLayerProperties`.
///
/// # Safety
/// As a loader calls it.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn afterlight_failures_enumerate_instance_layer_properties(
    chain: *const Chain<Layers>,
    count: *mut u32,
    layers: *mut vk::LayerProperties,
) -> vk::Result {
    // SAFETY: as above.
    let call = || unsafe { ((*chain).next)((*chain).link, count, layers) };
    // SAFETY: there is a list, and the number is the caller's own.
    let shorten = || unsafe { count.write(count.read() - 1) };
    answer("vkEnumerateInstanceLayerProperties", has_list!(count layers), shorten, call)
}

/// `vkEnumerateInstanceExtensionProperties`.
///
/// # Safety
/// As a loader calls it.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn afterlight_failures_enumerate_instance_extension_properties(
    chain: *const Chain<Extensions>,
    layer: *const c_char,
    count: *mut u32,
    extensions: *mut vk::ExtensionProperties,
) -> vk::Result {
    // SAFETY: as above.
    let call = || unsafe { ((*chain).next)((*chain).link, layer, count, extensions) };
    // SAFETY: there is a list, and the number is the caller's own.
    let shorten = || unsafe { count.write(count.read() - 1) };
    answer("vkEnumerateInstanceExtensionProperties", has_list!(count extensions), shorten, call)
}
