//! A Vulkan layer for tests: any command that can fail fails on request. docs/FAILURES.md describes how to load the layer and how to request
//! failures.
//!
//! It belongs above the validation layer, nearer to the program: a call that fails here has not happened below, and validation sees only calls that
//! really happened. Results that a command gives after it has done its work, such as `VK_SUBOPTIMAL_KHR`, come after that work. A lost device is idle
//! before the loss is reported, and stays lost.

#[path = "../../hdr-layer/src/loader.rs"]
mod loader;

#[macro_use]
mod wrappers;

mod callbacks;
mod chain;
mod commands;
mod driver_cache;
mod incoherent;
mod pre_instance;
mod steering;
pub mod table;

use std::ffi::{CStr, c_char};

use ash::vk;
use steering::Asked;

/// Results that a command can return, except SUCCESS.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    pub name: &'static str,
    pub errors: &'static [(&'static str, vk::Result)],
    /// Successes that are not `VK_SUCCESS`.
    pub successes: &'static [(&'static str, vk::Result)],
}

impl Command {
    /// All that it can answer but success.
    pub fn results(&self) -> impl Iterator<Item = (&'static str, vk::Result)> {
        self.errors.iter().chain(self.successes).copied()
    }
}

/// Returns all commands of the table that can fail, including the loader's own.
pub fn commands() -> impl Iterator<Item = &'static Command> {
    table::FALLIBLE.iter().chain(table::BY_HAND).filter(|command| !command.errors.is_empty())
}

/// A command that loaders answer without asking any layer.
pub const OF_THE_LOADER: &str = "vkEnumerateDeviceLayerProperties";

/// Commands without an instance, for which loaders ask implicit layers alone.
pub const PRE_INSTANCE: [&str; 3] =
    ["vkEnumerateInstanceVersion", "vkEnumerateInstanceLayerProperties", "vkEnumerateInstanceExtensionProperties"];

/// Forgets which calls were to fail, and counts from 0 again.
#[unsafe(no_mangle)]
pub extern "C" fn afterlight_failures_reset() {
    steering::reset();
    callbacks::reset();
}

/// Tells which calls fail, in words of `AFTERLIGHT_FAILURES`. Returns false for other words.
///
/// # Safety
/// The text ends in NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn afterlight_failures_tell(text: *const c_char) -> bool {
    // SAFETY: the caller's promise.
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
    Asked::of(&text).map(steering::add).is_ok()
}

/// Returns the number of calls and allocations that have failed on request.
#[unsafe(no_mangle)]
pub extern "C" fn afterlight_failures_fired() -> u64 {
    steering::fired() + callbacks::failed()
}

/// Returns how often a command was called, 0 for one that is not in the table.
///
/// # Safety
/// The text ends in NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn afterlight_failures_calls(command: *const c_char) -> u64 {
    // SAFETY: the caller's promise.
    steering::calls(&unsafe { CStr::from_ptr(command) }.to_string_lossy())
}

/// Returns the number of allocations of host memory that drivers and layers have asked for.
#[unsafe(no_mangle)]
pub extern "C" fn afterlight_failures_allocations() -> u64 {
    callbacks::asked_for()
}

/// Returns the command in which an allocation was refused last, or null if that command cannot fail, such as a recording command.
#[unsafe(no_mangle)]
pub extern "C" fn afterlight_failures_refused_in() -> *const c_char {
    callbacks::refused_in()
}

/// Returns the number of allocations that have not been given back.
#[unsafe(no_mangle)]
pub extern "C" fn afterlight_failures_live_allocations() -> i64 {
    callbacks::live()
}
