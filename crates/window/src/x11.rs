//! X11: a handler for a broken connection, where Xlib's own would end the program, and a separate connection for the driver.

use std::env;
use std::ffi::c_int;
use std::ptr::NonNull;
use std::sync::{Arc, OnceLock};

use raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle, WindowHandle, XlibDisplayHandle,
};
use winit::window::Window;
use x11_dl::xlib::{Display, Xlib};

use super::Error;

/// Kept for good: the library calls back whenever the connection breaks.
static LIBRARY: OnceLock<Option<Xlib>> = OnceLock::new();
static GONE: OnceLock<fn() -> !> = OnceLock::new();

fn library() -> Option<&'static Xlib> {
    LIBRARY.get_or_init(|| Xlib::open().ok()).as_ref()
}

/// Has `gone` called when a connection to the X server breaks. Xlib's own handler would print a line and end the program with exit code 1. If the
/// library is missing, the window system is another one.
pub fn on_broken_connection(gone: fn() -> !) {
    GONE.get_or_init(|| gone);
    if let Some(library) = library() {
        // SAFETY: the handler does not return, as Xlib asks for, and is there for good.
        unsafe { (library.XSetIOErrorHandler)(Some(broken)) };
    }
}

/// Refuses a scale factor of the environment that winit panics at. It reads the variable for each monitor of an X server, and not on Wayland.
pub fn check_scale_factor() -> Result<(), Error> {
    let is_set = |name| env::var(name).is_ok_and(|value| !value.is_empty());
    let factor = env::var("WINIT_X11_SCALE_FACTOR").unwrap_or_default();
    let is_wayland = is_set("WAYLAND_DISPLAY") || is_set("WAYLAND_SOCKET");
    if is_wayland || is_scale_factor(&factor) { Ok(()) } else { Err(Error::ScaleFactor(factor)) }
}

/// Returns true if winit takes this text; an empty one counts as none.
fn is_scale_factor(text: &str) -> bool {
    let is_factor = |factor: f64| factor.is_sign_positive() && factor.is_normal();
    text.is_empty() || text.eq_ignore_ascii_case("randr") || text.parse().is_ok_and(is_factor)
}

extern "C" fn broken(_: *mut Display) -> c_int {
    match GONE.get() {
        Some(gone) => gone(),
        // Set before the handler is.
        None => std::process::abort(),
    }
}

/// A window as a driver knows it: where the window system is X11, by the driver's own connection to the X server.
///
/// A driver reads from its connection in separate threads (Mesa's "WSI swapchain event"). It keeps events of others for the next reader, but does not
/// wake a loop that waits for the connection to have something to read: a key, or the wish to close the window, would wait there until something else
/// happens.
pub struct DrawnWindow {
    // Closed before the window goes, as a driver may still have asked something of it.
    connection: Option<Connection>,
    window: Arc<Window>,
}

impl DrawnWindow {
    /// # Errors
    /// [`Error::System`] when the X server takes no other connection.
    pub fn new(window: Arc<Window>) -> Result<Self, Error> {
        let connection = match window.display_handle().map(|handle| handle.as_raw()) {
            Ok(RawDisplayHandle::Xlib(XlibDisplayHandle { display: Some(display), screen, .. })) => {
                Some(Connection::beside(display.cast(), screen)?)
            }
            _ => None,
        };
        Ok(Self { connection, window })
    }
}

impl HasDisplayHandle for DrawnWindow {
    fn display_handle(&self) -> Result<DisplayHandle<'_>, HandleError> {
        let Some(Connection { display, screen, .. }) = &self.connection else { return self.window.display_handle() };
        let raw = RawDisplayHandle::Xlib(XlibDisplayHandle::new(Some(display.cast()), *screen));
        // SAFETY: the connection is open as long as `self` is borrowed.
        Ok(unsafe { DisplayHandle::borrow_raw(raw) })
    }
}

impl HasWindowHandle for DrawnWindow {
    fn window_handle(&self) -> Result<WindowHandle<'_>, HandleError> {
        self.window.window_handle()
    }
}

/// A connection to an X server, open until it is dropped.
struct Connection {
    library: &'static Xlib,
    display: NonNull<Display>,
    screen: c_int,
}

// SAFETY: winit has told Xlib, before it connected, that there are threads (XInitThreads): each call locks its connection.
unsafe impl Send for Connection {}
// SAFETY: as above.
unsafe impl Sync for Connection {}

impl Connection {
    /// Another one to the server of `display`, which is open.
    fn beside(display: NonNull<Display>, screen: c_int) -> Result<Self, Error> {
        let broke = || Error::System("the X server takes no other connection".into());
        let library = library().ok_or_else(broke)?;
        // SAFETY: the display is open, and its name is its own.
        let opened = unsafe { (library.XOpenDisplay)((library.XDisplayString)(display.as_ptr())) };
        NonNull::new(opened).map(|display| Self { library, display, screen }).ok_or_else(broke)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // SAFETY: it is open, and nobody else has it: the surface that had it is destroyed before.
        unsafe { (self.library.XCloseDisplay)(self.display.as_ptr()) };
    }
}
