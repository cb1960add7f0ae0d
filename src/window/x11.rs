//! What Xlib asks of every program that would end in its own words.

use std::ffi::c_int;
use std::sync::OnceLock;

use x11_dl::xlib::{Display, Xlib};

/// Kept for good: the library calls back whenever the connection breaks.
static LIBRARY: OnceLock<Option<Xlib>> = OnceLock::new();
static GONE: OnceLock<fn() -> !> = OnceLock::new();

/// Has `gone` called when the connection to the X server breaks. Xlib's own handler would print a line and end the program with exit code 1.
/// Where the library is absent, the window system is another one.
pub fn on_broken_connection(gone: fn() -> !) {
    GONE.get_or_init(|| gone);
    if let Some(library) = LIBRARY.get_or_init(|| Xlib::open().ok()) {
        // SAFETY: the handler does not return, as Xlib asks for, and is there for good.
        unsafe { (library.XSetIOErrorHandler)(Some(broken)) };
    }
}

extern "C" fn broken(_: *mut Display) -> c_int {
    match GONE.get() {
        Some(gone) => gone(),
        // Set before the handler is.
        None => std::process::abort(),
    }
}
