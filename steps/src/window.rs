//! A window of X11, for step 10: opened, resized, and made a surface of.

use ash::{khr, vk};
use x11_dl::xlib::{self, Xlib};

use crate::{Gpu, Result};

/// A window with its surface. Swapchains of the surface must be gone when it is dropped.
pub struct Window {
    pub surface: vk::SurfaceKHR,
    surfaces: khr::surface::Instance,
    xlib: Xlib,
    display: *mut xlib::Display,
    window: xlib::Window,
}

impl Window {
    /// Opens a window, to which the device's queue can present.
    pub fn open(gpu: &Gpu, size: vk::Extent2D) -> Result<Self> {
        let xlib = Xlib::open()?;
        // SAFETY: the display is not null where it is used; display and window outlive the surface.
        unsafe {
            let display = (xlib.XOpenDisplay)(std::ptr::null());
            if display.is_null() {
                return Err("there is no X server: DISPLAY names none that answers".into());
            }
            let root = (xlib.XDefaultRootWindow)(display);
            let window = (xlib.XCreateSimpleWindow)(display, root, 0, 0, size.width, size.height, 0, 0, 0);
            (xlib.XMapWindow)(display, window);
            let info = vk::XlibSurfaceCreateInfoKHR::default().dpy(display.cast()).window(window);
            let surface =
                khr::xlib_surface::Instance::new(&gpu.entry, &gpu.instance).create_xlib_surface(&info, None)?;
            let surfaces = khr::surface::Instance::new(&gpu.entry, &gpu.instance);
            // The surface has no name: Mesa 22.3 crashes when one is set.
            let opened = Self { surface, surfaces, xlib, display, window };
            match opened.surfaces.get_physical_device_surface_support(gpu.physical, gpu.family, surface)? {
                true => Ok(opened),
                false => Err("the queue cannot present to this window".into()),
            }
        }
    }

    /// Gives the window another size.
    pub fn resize(&self, size: vk::Extent2D) {
        // SAFETY: the window is open.
        unsafe {
            (self.xlib.XResizeWindow)(self.display, self.window, size.width, size.height);
            (self.xlib.XSync)(self.display, 0);
        }
    }

    /// The properties of the surface, its size among them, and its formats.
    pub fn ask(&self, gpu: &Gpu) -> Result<(vk::SurfaceCapabilitiesKHR, Vec<vk::SurfaceFormatKHR>)> {
        // SAFETY: the surface is alive.
        unsafe {
            let able = self.surfaces.get_physical_device_surface_capabilities(gpu.physical, self.surface)?;
            Ok((able, self.surfaces.get_physical_device_surface_formats(gpu.physical, self.surface)?))
        }
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        // SAFETY: nothing is presented any longer, and the surface goes before the window.
        unsafe {
            self.surfaces.destroy_surface(self.surface, None);
            (self.xlib.XCloseDisplay)(self.display);
        }
    }
}
