//! Queries of a physical device, and the answers of the played one.

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

use super::loader::typed;
use super::profile::Profile;
use super::shared::{all, below, tell};
use super::{INSTANCES, NAME, chain, formats, queues};

/// Functions of the layer below by which physical devices are queried. The loader gives these while an instance is created; later it gives the
/// uppermost layer's.
const ASKED_BY: [&CStr; 18] = [
    c"vkEnumerateDeviceExtensionProperties",
    c"vkGetPhysicalDeviceProperties",
    c"vkGetPhysicalDeviceProperties2",
    c"vkGetPhysicalDeviceFeatures",
    c"vkGetPhysicalDeviceFeatures2",
    c"vkGetPhysicalDeviceMemoryProperties",
    c"vkGetPhysicalDeviceMemoryProperties2",
    c"vkGetPhysicalDeviceQueueFamilyProperties",
    c"vkGetPhysicalDeviceQueueFamilyProperties2",
    c"vkGetPhysicalDeviceFormatProperties",
    c"vkGetPhysicalDeviceFormatProperties2",
    c"vkGetPhysicalDeviceImageFormatProperties",
    c"vkGetPhysicalDeviceImageFormatProperties2",
    c"vkGetPhysicalDeviceSurfaceSupportKHR",
    c"vkGetPhysicalDeviceXcbPresentationSupportKHR",
    c"vkGetPhysicalDeviceXlibPresentationSupportKHR",
    c"vkGetPhysicalDeviceWaylandPresentationSupportKHR",
    c"vkGetPhysicalDeviceWin32PresentationSupportKHR",
];

/// The functions below, in the order of their names here.
pub type Functions = [vk::PFN_vkVoidFunction; ASKED_BY.len()];

/// All of them, as `named` finds them.
pub fn functions(named: impl Fn(&CStr) -> vk::PFN_vkVoidFunction) -> Functions {
    ASKED_BY.map(named)
}

/// A function of the instance below, and the profile that is played on it.
///
/// # Safety
/// The physical device is alive, and `F` is the type of the function's pointer.
unsafe fn next<F: Copy>(physical: vk::PhysicalDevice, name: &CStr) -> Option<(F, Profile)> {
    // SAFETY: the caller's promise; it has the key of its instance.
    let below = unsafe { below(&INSTANCES, physical) }?;
    let function = below.functions[ASKED_BY.iter().position(|own| *own == name)?];
    // SAFETY: the caller's promise.
    Some((unsafe { typed(function) }?, below.profile))
}

/// As [`next`], or returns this from the function.
macro_rules! next {
    ($physical:ident, $type:ty, $name:literal $(, $or:expr)?) => {{
        // SAFETY: the physical device is the caller's own, and the type is that of the name.
        match unsafe { next::<$type>($physical, $name) } {
            Some(next) => next,
            None => return $($or)?,
        }
    }};
}

/// Features of the device below.
///
/// # Safety
/// The physical device is alive.
pub unsafe fn real_features(physical: vk::PhysicalDevice) -> vk::PhysicalDeviceFeatures {
    let mut real = vk::PhysicalDeviceFeatures::default();
    let (ask, _) = next!(physical, vk::PFN_vkGetPhysicalDeviceFeatures, c"vkGetPhysicalDeviceFeatures", real);
    // SAFETY: the caller's promise; the place is this function's own.
    unsafe { ask(physical, &raw mut real) };
    real
}

/// Memory of the device below.
///
/// # Safety
/// The physical device is alive.
pub unsafe fn real_memory(physical: vk::PhysicalDevice) -> vk::PhysicalDeviceMemoryProperties {
    let mut real = vk::PhysicalDeviceMemoryProperties::default();
    let (ask, _) =
        next!(physical, vk::PFN_vkGetPhysicalDeviceMemoryProperties, c"vkGetPhysicalDeviceMemoryProperties", real);
    // SAFETY: the caller's promise; the place is this function's own.
    unsafe { ask(physical, &raw mut real) };
    real
}

/// The names of the extensions of the played device.
///
/// # Safety
/// The physical device is alive.
pub unsafe fn played_extensions(physical: vk::PhysicalDevice) -> Result<Vec<vk::ExtensionProperties>, vk::Result> {
    let (ask, profile) = next!(
        physical,
        vk::PFN_vkEnumerateDeviceExtensionProperties,
        c"vkEnumerateDeviceExtensionProperties",
        Err(vk::Result::ERROR_UNKNOWN)
    );
    // SAFETY: the caller's promise; the list is this function's own.
    let mut played = all(|count, place| unsafe { ask(physical, std::ptr::null(), count, place) })?;
    played.retain(|own| own.extension_name_as_c_str().is_ok_and(|name| profile.keeps(name)));
    if let Some(name) = profile.own_extension() {
        played.retain(|own| own.extension_name_as_c_str() != Ok(name));
        let mut own = vk::ExtensionProperties { spec_version: 1, ..Default::default() };
        for (to, from) in own.extension_name.iter_mut().zip(name.to_bytes()) {
            *to = from.cast_signed() as c_char;
        }
        played.push(own);
    }
    Ok(played)
}

pub unsafe extern "system" fn extensions(
    physical: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    place: *mut vk::ExtensionProperties,
) -> vk::Result {
    if layer.is_null() {
        // SAFETY: the physical device is the caller's own.
        return match unsafe { played_extensions(physical) } {
            // SAFETY: as this function was called.
            Ok(played) => unsafe { tell(&played, count, place) },
            Err(result) => result,
        };
    }
    // SAFETY: names are strings that end in NUL.
    if unsafe { CStr::from_ptr(layer) } == NAME {
        // SAFETY: as this function was called.
        return unsafe { tell::<vk::ExtensionProperties>(&[], count, place) };
    }
    let (ask, _) = next!(
        physical,
        vk::PFN_vkEnumerateDeviceExtensionProperties,
        c"vkEnumerateDeviceExtensionProperties",
        vk::Result::ERROR_UNKNOWN
    );
    // SAFETY: as this function was called.
    unsafe { ask(physical, layer, count, place) }
}

pub unsafe extern "system" fn properties(physical: vk::PhysicalDevice, place: *mut vk::PhysicalDeviceProperties) {
    let (ask, profile) = next!(physical, vk::PFN_vkGetPhysicalDeviceProperties, c"vkGetPhysicalDeviceProperties");
    // SAFETY: as this function was called.
    unsafe { ask(physical, place) };
    // SAFETY: it was just written there.
    profile.properties(unsafe { &mut *place });
}

pub unsafe extern "system" fn properties2(physical: vk::PhysicalDevice, place: *mut vk::PhysicalDeviceProperties2<'_>) {
    let (ask, profile) = next!(physical, vk::PFN_vkGetPhysicalDeviceProperties2, c"vkGetPhysicalDeviceProperties2");
    // SAFETY: as this function was called.
    unsafe { ask(physical, place) };
    // SAFETY: it was just written there.
    let own = unsafe { &mut *place };
    profile.properties(&mut own.properties);
    // SAFETY: the chain is the caller's, and the caller waits for its answer.
    unsafe { chain::structures(own.p_next).for_each(|structure| chain::play_properties(profile, structure)) };
}

pub unsafe extern "system" fn features(physical: vk::PhysicalDevice, place: *mut vk::PhysicalDeviceFeatures) {
    let (ask, profile) = next!(physical, vk::PFN_vkGetPhysicalDeviceFeatures, c"vkGetPhysicalDeviceFeatures");
    // SAFETY: as this function was called.
    unsafe { ask(physical, place) };
    // SAFETY: it was just written there.
    let own = unsafe { &mut *place };
    *own = profile.features(own);
}

pub unsafe extern "system" fn features2(physical: vk::PhysicalDevice, place: *mut vk::PhysicalDeviceFeatures2<'_>) {
    let (ask, profile) = next!(physical, vk::PFN_vkGetPhysicalDeviceFeatures2, c"vkGetPhysicalDeviceFeatures2");
    // SAFETY: as this function was called.
    unsafe { ask(physical, place) };
    // SAFETY: it was just written there.
    let own = unsafe { &mut *place };
    own.features = profile.features(&own.features);
    // SAFETY: the chain is the caller's, and the caller waits for its answer.
    unsafe { chain::structures(own.p_next).for_each(|structure| chain::play_features(profile, structure)) };
}

pub unsafe extern "system" fn memory(physical: vk::PhysicalDevice, place: *mut vk::PhysicalDeviceMemoryProperties) {
    let (ask, profile) =
        next!(physical, vk::PFN_vkGetPhysicalDeviceMemoryProperties, c"vkGetPhysicalDeviceMemoryProperties");
    // SAFETY: as this function was called.
    unsafe { ask(physical, place) };
    // SAFETY: it was just written there.
    play_memory(profile, unsafe { &mut *place });
}

pub unsafe extern "system" fn memory2(
    physical: vk::PhysicalDevice,
    place: *mut vk::PhysicalDeviceMemoryProperties2<'_>,
) {
    let (ask, profile) =
        next!(physical, vk::PFN_vkGetPhysicalDeviceMemoryProperties2, c"vkGetPhysicalDeviceMemoryProperties2");
    // SAFETY: as this function was called.
    unsafe { ask(physical, place) };
    // SAFETY: it was just written there.
    play_memory(profile, &mut unsafe { &mut *place }.memory_properties);
}

/// Adds the lazily allocated type, of the heap of the first type that is near the device.
fn play_memory(profile: Profile, own: &mut vk::PhysicalDeviceMemoryProperties) {
    let Some(lazy) = lazy_type(profile, own) else { return };
    own.memory_types[lazy.played as usize] = vk::MemoryType {
        property_flags: vk::MemoryPropertyFlags::DEVICE_LOCAL | vk::MemoryPropertyFlags::LAZILY_ALLOCATED,
        heap_index: own.memory_types[lazy.real as usize].heap_index,
    };
    own.memory_type_count = lazy.played + 1;
}

/// The number of a memory type that only the played device has, and of the one below that stands for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LazyType {
    pub played: u32,
    pub real: u32,
}

/// Returns the lazily allocated memory type. Returns `None` if the played device has no lazily allocated type, or the device below has no slot left
/// for it.
pub fn lazy_type(profile: Profile, real: &vk::PhysicalDeviceMemoryProperties) -> Option<LazyType> {
    let own = real.memory_types_as_slice();
    let near = own.iter().position(|own| own.property_flags.contains(vk::MemoryPropertyFlags::DEVICE_LOCAL))?;
    let has_place = profile.has_lazy_memory() && own.len() < vk::MAX_MEMORY_TYPES;
    has_place.then_some(LazyType { played: own.len() as u32, real: near as u32 })
}

/// Queue families of the device below.
///
/// # Safety
/// The physical device is alive.
unsafe fn real_families(physical: vk::PhysicalDevice) -> Vec<vk::QueueFamilyProperties> {
    let (ask, _) = next!(
        physical,
        vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties,
        c"vkGetPhysicalDeviceQueueFamilyProperties",
        Vec::new()
    );
    let told = |count, place| {
        // SAFETY: the caller's promise; the list is `all`'s own.
        unsafe { ask(physical, count, place) };
        vk::Result::SUCCESS
    };
    all(told).unwrap_or_default()
}

/// Returns the family below whose queue stands for all played families: the first with graphics. Returns `None` if no families are played.
///
/// # Safety
/// The physical device is alive.
pub unsafe fn real_family(physical: vk::PhysicalDevice, profile: Profile) -> Option<u32> {
    // SAFETY: the caller's promise.
    let real = profile.has_queues().then(|| unsafe { real_families(physical) })?;
    Some(real.iter().position(|own| own.queue_flags.contains(vk::QueueFlags::GRAPHICS))? as u32)
}

pub unsafe extern "system" fn families(
    physical: vk::PhysicalDevice,
    count: *mut u32,
    place: *mut vk::QueueFamilyProperties,
) {
    let (ask, profile) =
        next!(physical, vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties, c"vkGetPhysicalDeviceQueueFamilyProperties");
    // SAFETY: the physical device is the caller's own.
    if let Some(real) = unsafe { real_family(physical, profile) } {
        // SAFETY: as above, and as this function was called. A list that is cut short is no fault here.
        let _ = unsafe { tell(&queues::played_families(&real_families(physical)[real as usize]), count, place) };
        return;
    }
    // SAFETY: as this function was called.
    unsafe { ask(physical, count, place) };
    if !place.is_null() {
        // SAFETY: so many were just written there.
        unsafe { std::slice::from_raw_parts_mut(place, count.read() as usize) }
            .iter_mut()
            .for_each(|own| profile.queue_family(own));
    }
}

pub unsafe extern "system" fn families2(
    physical: vk::PhysicalDevice,
    count: *mut u32,
    place: *mut vk::QueueFamilyProperties2<'_>,
) {
    let (ask, profile) = next!(
        physical,
        vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties2,
        c"vkGetPhysicalDeviceQueueFamilyProperties2"
    );
    // SAFETY: the physical device is the caller's own.
    if let Some(real) = unsafe { real_family(physical, profile) } {
        // SAFETY: as above, and as this function was called.
        unsafe { tell_families2((ask, physical), real as usize, count, place) };
        return;
    }
    // SAFETY: as this function was called.
    unsafe { ask(physical, count, place) };
    if !place.is_null() {
        // SAFETY: so many were just written there.
        unsafe { std::slice::from_raw_parts_mut(place, count.read() as usize) }
            .iter_mut()
            .for_each(|own| profile.queue_family(&mut own.queue_family_properties));
    }
}

/// Reports the played families. Structures that are chained to a played family are filled in for the real family.
///
/// # Safety
/// The conditions of the function `ask` hold, and `real` is the index of a family of the physical device below.
unsafe fn tell_families2(
    (ask, physical): (vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties2, vk::PhysicalDevice),
    real: usize,
    count: *mut u32,
    place: *mut vk::QueueFamilyProperties2<'_>,
) {
    // SAFETY: the caller's promise.
    let families = unsafe { real_families(physical) };
    let played = queues::played_families(&families[real]);
    if place.is_null() {
        // SAFETY: the caller's promise.
        unsafe { count.write(queues::FAMILIES) };
        return;
    }
    // SAFETY: the caller's promise: so many places are there.
    let places = unsafe { std::slice::from_raw_parts_mut(place, count.read().min(queues::FAMILIES) as usize) };
    for (own, family) in places.iter_mut().zip(played) {
        let mut list = vec![vk::QueueFamilyProperties2::default(); families.len()];
        list[real].p_next = own.p_next.cast::<c_void>();
        let mut length = list.len() as u32;
        // SAFETY: the list is this function's own, and the chain is the caller's, who waits for its answer.
        unsafe { ask(physical, &raw mut length, list.as_mut_ptr()) };
        own.queue_family_properties = family;
    }
    // SAFETY: the caller's promise.
    unsafe { count.write(places.len() as u32) };
}

/// Returns the family below that is asked in place of this one whether it presents. Returns `None` if the played device's answer is no.
///
/// # Safety
/// The physical device is alive.
unsafe fn asked_to_present(physical: vk::PhysicalDevice, profile: Profile, family: u32) -> Option<u32> {
    // SAFETY: the caller's promise.
    match unsafe { real_family(physical, profile) } {
        // Only the first of the played families presents.
        Some(real) => (family == 0).then_some(real),
        None => Some(family),
    }
}

pub unsafe extern "system" fn surface_support(
    physical: vk::PhysicalDevice,
    family: u32,
    surface: vk::SurfaceKHR,
    place: *mut vk::Bool32,
) -> vk::Result {
    let (ask, profile) = next!(
        physical,
        vk::PFN_vkGetPhysicalDeviceSurfaceSupportKHR,
        c"vkGetPhysicalDeviceSurfaceSupportKHR",
        vk::Result::ERROR_UNKNOWN
    );
    // SAFETY: the physical device is the caller's own.
    let Some(family) = (unsafe { asked_to_present(physical, profile, family) }) else {
        // SAFETY: as this function was called.
        unsafe { place.write(vk::FALSE) };
        return vk::Result::SUCCESS;
    };
    // SAFETY: as this function was called, with a family of the device below.
    unsafe { ask(physical, family, surface, place) }
}

/// Declares functions by which a window system's programs ask whether a family presents there.
macro_rules! presentation_support {
    ($($own:ident: $type:ty, $name:literal, ($($argument:ident: $of:ty),*);)*) => {
        $(pub unsafe extern "system" fn $own(physical: vk::PhysicalDevice, family: u32 $(, $argument: $of)*) -> vk::Bool32 {
            let (ask, profile) = next!(physical, $type, $name, vk::FALSE);
            // SAFETY: the physical device is the caller's own.
            match unsafe { asked_to_present(physical, profile, family) } {
                // SAFETY: as this function was called, with a family of the device below.
                Some(family) => unsafe { ask(physical, family $(, $argument)*) },
                None => vk::FALSE,
            }
        })*
    };
}

presentation_support! {
    xcb_support: vk::PFN_vkGetPhysicalDeviceXcbPresentationSupportKHR, c"vkGetPhysicalDeviceXcbPresentationSupportKHR",
        (connection: *mut vk::xcb_connection_t, visual: vk::xcb_visualid_t);
    xlib_support: vk::PFN_vkGetPhysicalDeviceXlibPresentationSupportKHR, c"vkGetPhysicalDeviceXlibPresentationSupportKHR",
        (display: *mut vk::Display, visual: vk::VisualID);
    wayland_support: vk::PFN_vkGetPhysicalDeviceWaylandPresentationSupportKHR, c"vkGetPhysicalDeviceWaylandPresentationSupportKHR",
        (display: *mut vk::wl_display);
    win32_support: vk::PFN_vkGetPhysicalDeviceWin32PresentationSupportKHR, c"vkGetPhysicalDeviceWin32PresentationSupportKHR", ();
}

pub unsafe extern "system" fn format(
    physical: vk::PhysicalDevice,
    format: vk::Format,
    place: *mut vk::FormatProperties,
) {
    let (ask, profile) =
        next!(physical, vk::PFN_vkGetPhysicalDeviceFormatProperties, c"vkGetPhysicalDeviceFormatProperties");
    // SAFETY: as this function was called.
    unsafe { ask(physical, format, place) };
    // SAFETY: it was just written there.
    let own = unsafe { &mut *place };
    own.optimal_tiling_features = profile.format(format, own.optimal_tiling_features);
}

pub unsafe extern "system" fn format2(
    physical: vk::PhysicalDevice,
    format: vk::Format,
    place: *mut vk::FormatProperties2<'_>,
) {
    let (ask, profile) =
        next!(physical, vk::PFN_vkGetPhysicalDeviceFormatProperties2, c"vkGetPhysicalDeviceFormatProperties2");
    // SAFETY: as this function was called.
    unsafe { ask(physical, format, place) };
    // SAFETY: it was just written there.
    let own = &mut unsafe { &mut *place }.format_properties;
    own.optimal_tiling_features = profile.format(format, own.optimal_tiling_features);
}

/// An image that is asked about.
#[derive(Clone, Copy)]
struct Wanted {
    format: vk::Format,
    tiling: vk::ImageTiling,
    usage: vk::ImageUsageFlags,
    flags: vk::ImageCreateFlags,
}

pub unsafe extern "system" fn image_format(
    physical: vk::PhysicalDevice,
    format: vk::Format,
    kind: vk::ImageType,
    tiling: vk::ImageTiling,
    usage: vk::ImageUsageFlags,
    flags: vk::ImageCreateFlags,
    place: *mut vk::ImageFormatProperties,
) -> vk::Result {
    let (ask, profile) = next!(
        physical,
        vk::PFN_vkGetPhysicalDeviceImageFormatProperties,
        c"vkGetPhysicalDeviceImageFormatProperties",
        vk::Result::ERROR_UNKNOWN
    );
    // SAFETY: as this function was called.
    let result = unsafe { ask(physical, format, kind, tiling, usage, flags, place) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: it was just written there, and the physical device is the caller's own.
    unsafe { play_image(physical, profile, Wanted { format, tiling, usage, flags }, &mut *place) }
}

pub unsafe extern "system" fn image_format2(
    physical: vk::PhysicalDevice,
    info: *const vk::PhysicalDeviceImageFormatInfo2<'_>,
    place: *mut vk::ImageFormatProperties2<'_>,
) -> vk::Result {
    let (ask, profile) = next!(
        physical,
        vk::PFN_vkGetPhysicalDeviceImageFormatProperties2,
        c"vkGetPhysicalDeviceImageFormatProperties2",
        vk::Result::ERROR_UNKNOWN
    );
    // SAFETY: as this function was called.
    let result = unsafe { ask(physical, info, place) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: the structure is the caller's.
    let own = unsafe { &*info };
    let wanted = Wanted { format: own.format, tiling: own.tiling, usage: own.usage, flags: own.flags };
    // SAFETY: it was just written there, and the physical device is the caller's own.
    unsafe { play_image(physical, profile, wanted, &mut (*place).image_format_properties) }
}

/// Lowers the limits of images of the wanted kind to the played device's limits.
///
/// # Safety
/// The physical device is alive.
unsafe fn play_image(
    physical: vk::PhysicalDevice,
    profile: Profile,
    wanted: Wanted,
    own: &mut vk::ImageFormatProperties,
) -> vk::Result {
    let mut device = vk::PhysicalDeviceProperties::default();
    let mut able = vk::FormatProperties::default();
    // SAFETY: the caller's promise; the places are this function's own.
    unsafe {
        properties(physical, &raw mut device);
        format(physical, wanted.format, &raw mut able);
    }
    let is_extended = wanted.flags.contains(vk::ImageCreateFlags::EXTENDED_USAGE);
    let is_optimal = wanted.tiling == vk::ImageTiling::OPTIMAL;
    if is_optimal && !is_extended && !able.optimal_tiling_features.contains(formats::needed(wanted.usage)) {
        *own = vk::ImageFormatProperties::default();
        return vk::Result::ERROR_FORMAT_NOT_SUPPORTED;
    }
    let limits = &device.limits;
    let most = match wanted.flags.contains(vk::ImageCreateFlags::CUBE_COMPATIBLE) {
        true => limits.max_image_dimension_cube,
        false => limits.max_image_dimension2_d,
    };
    own.max_extent.width = own.max_extent.width.min(most);
    own.max_extent.height = own.max_extent.height.min(most);
    own.max_array_layers = own.max_array_layers.min(limits.max_image_array_layers);
    own.max_mip_levels = own.max_mip_levels.min(most.ilog2() + 1);
    if profile.is_of_vulkan_1_1() {
        own.sample_counts &= formats::sample_counts(limits, wanted.format, wanted.usage);
    }
    vk::Result::SUCCESS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phone_has_one_type_more_of_the_same_heap() {
        let mut real = vk::PhysicalDeviceMemoryProperties { memory_type_count: 2, ..Default::default() };
        real.memory_types[0] = vk::MemoryType { property_flags: vk::MemoryPropertyFlags::HOST_VISIBLE, heap_index: 0 };
        real.memory_types[1] = vk::MemoryType { property_flags: vk::MemoryPropertyFlags::DEVICE_LOCAL, heap_index: 1 };
        let mut played = real;
        play_memory(Profile::Phone, &mut played);
        assert_eq!(lazy_type(Profile::Phone, &real), Some(LazyType { played: 2, real: 1 }));
        assert!(played.memory_types_as_slice().len() == 3 && played.memory_types[2].heap_index == 1);
        play_memory(Profile::Least, &mut real);
        assert_eq!(real.memory_type_count, 2);
    }
}
