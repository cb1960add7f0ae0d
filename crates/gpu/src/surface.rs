//! A window's surface: Vulkan's side of a window.

use std::any::Any;
use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle};

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::instance::Instance;

/// A surface, which keeps its instance and its window alive.
pub struct Surface {
    /// The handle. It is valid as long as this owner.
    pub raw: vk::SurfaceKHR,
    functions: ash::khr::surface::Instance,
    _instance: Arc<Instance>,
    // Destroyed after the surface, as Vulkan asks for.
    _window: Option<Arc<dyn Any + Send + Sync>>,
}

/// The command by which `ash_window` creates a window's surface.
fn surface_command(display: RawDisplayHandle) -> &'static str {
    match display {
        RawDisplayHandle::Xcb(_) => "vkCreateXcbSurfaceKHR",
        RawDisplayHandle::Xlib(_) => "vkCreateXlibSurfaceKHR",
        RawDisplayHandle::Wayland(_) => "vkCreateWaylandSurfaceKHR",
        RawDisplayHandle::Windows(_) => "vkCreateWin32SurfaceKHR",
        RawDisplayHandle::Android(_) => "vkCreateAndroidSurfaceKHR",
        RawDisplayHandle::AppKit(_) | RawDisplayHandle::UiKit(_) => "vkCreateMetalSurfaceEXT",
        _ => "a window system's command",
    }
}

/// The instance extensions that [`Surface::headless`] needs.
pub const HEADLESS: [&CStr; 2] = [ash::khr::surface::NAME, ash::ext::headless_surface::NAME];

/// The instance extensions that surfaces on a display need, of which the window system says which it is.
///
/// # Errors
/// [`Error::Unsupported`] for a window system that Vulkan has no surfaces for.
pub fn surface_extensions(display: &impl HasDisplayHandle) -> Result<Vec<&'static CStr>> {
    let display = display.display_handle().map_err(|error| no_handle("display", &error))?;
    let names = ash_window::enumerate_required_extensions(display.as_raw())
        .map_err(|_| Error::Unsupported("Vulkan has no surfaces for this window system".to_owned()))?;
    // SAFETY: they are constants with a NUL at their end.
    Ok(names.iter().map(|&name| unsafe { CStr::from_ptr(name) }).collect())
}

fn no_handle(of: &str, error: &raw_window_handle::HandleError) -> Error {
    Error::Unsupported(format!("the {of} cannot be drawn to: {error}"))
}

impl Surface {
    /// The surface of a window, for an instance with [`surface_extensions`].
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a window that has no handle now; the driver's errors.
    pub fn new<W>(device: &Device, window: Arc<W>) -> Result<Arc<Surface>>
    where
        W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static,
    {
        let instance = &device.instance;
        let display = window.display_handle().map_err(|error| no_handle("display", &error))?.as_raw();
        let handle = window.window_handle().map_err(|error| no_handle("window", &error))?.as_raw();
        // SAFETY: both handles are the window's own, which lives as long as the surface.
        let raw = unsafe { ash_window::create_surface(instance.entry(), instance.raw(), display, handle, None) }
            .doing(surface_command(display), || "creating the window's surface")?;
        // The one object without a name: it is the loader's, and Mesa 22.3 crashes when it is given a name for it.
        Ok(Arc::new(Surface::of(instance, raw, Some(window))))
    }

    /// A surface that no display shows, for an instance with the extensions [`HEADLESS`]: code that presents frames runs as it does in a window.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if the instance does not have the extensions; the driver's errors.
    pub fn headless(device: &Device) -> Result<Arc<Surface>> {
        let instance = &device.instance;
        if !HEADLESS.iter().all(|name| instance.has_extension(name)) {
            return Err(Error::Unsupported("the instance has no surfaces without a display".into()));
        }
        let functions = ash::ext::headless_surface::Instance::new(instance.entry(), instance.raw());
        let info = vk::HeadlessSurfaceCreateInfoEXT::default();
        // SAFETY: the instance has the extension, and lives as long as the surface.
        let raw = unsafe { functions.create_headless_surface(&info, None) }
            .doing("vkCreateHeadlessSurfaceEXT", || "creating a surface without a display")?;
        Ok(Arc::new(Surface::of(instance, raw, None)))
    }

    fn of(instance: &Arc<Instance>, raw: vk::SurfaceKHR, window: Option<Arc<dyn Any + Send + Sync>>) -> Surface {
        let functions = ash::khr::surface::Instance::new(instance.entry(), instance.raw());
        Surface { raw, functions, _instance: Arc::clone(instance), _window: window }
    }

    /// Returns true if the device's queue can show images here.
    ///
    /// # Errors
    /// Running out of memory, or a surface that is lost.
    pub fn is_served_by(&self, device: &Device) -> Result<bool> {
        // SAFETY: surface and device are alive and of one instance; here and in the calls below.
        unsafe {
            self.functions.get_physical_device_surface_support(device.physical.raw, device.queue_family, self.raw)
        }
        .doing("vkGetPhysicalDeviceSurfaceSupportKHR", || {
            format!("asking whether '{}' can show images in this window", device.physical.name)
        })
    }

    /// The sizes and usages that its swapchains can have now.
    pub(super) fn capabilities(&self, device: &Device) -> Result<vk::SurfaceCapabilitiesKHR> {
        // SAFETY: as above.
        unsafe { self.functions.get_physical_device_surface_capabilities(device.physical.raw, self.raw) }
            .doing("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", || "asking how large the window is")
    }

    /// The formats that its images can have.
    pub(super) fn formats(&self, device: &Device) -> Result<Vec<vk::SurfaceFormatKHR>> {
        // SAFETY: as above.
        unsafe { self.functions.get_physical_device_surface_formats(device.physical.raw, self.raw) }
            .doing("vkGetPhysicalDeviceSurfaceFormatsKHR", || "asking for the window's formats")
    }

    /// The ways in which images can follow each other on it.
    pub(super) fn present_modes(&self, device: &Device) -> Result<Vec<vk::PresentModeKHR>> {
        // SAFETY: as above.
        unsafe { self.functions.get_physical_device_surface_present_modes(device.physical.raw, self.raw) }
            .doing("vkGetPhysicalDeviceSurfacePresentModesKHR", || "asking for the window's present modes")
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: swapchains hold their surface, so that none is left.
        unsafe { self.functions.destroy_surface(self.raw, None) };
    }
}
