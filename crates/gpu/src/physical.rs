//! The devices of a system: their properties and features, and the choice among them.

#[cfg(feature = "caches")]
mod calibration;

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::ffi::CStr;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use ash::vk;

use super::device::{LOCAL_READ, SYNCHRONIZATION2};
use super::error::{Doing, Error, Result};
use super::instance::{InstanceHandles, fixed_text};
use super::lack::{Lack, Support};
use super::newer::{API_VERSION_1_4, UNIFIED_LAYOUTS, UnifiedLayoutsFeatures, Vulkan14Properties};
use super::queues::QueueFamilies;

/// A device as its driver describes it. Keeps its instance alive.
#[derive(Clone)]
pub struct PhysicalDevice {
    /// The handle.
    pub raw: vk::PhysicalDevice,
    /// The device's name, as `llvmpipe (LLVM 15.0.6, 256 bits)`.
    pub name: String,
    /// Discrete, integrated, virtual, or a CPU.
    pub kind: vk::PhysicalDeviceType,
    /// The driver's name, as `llvmpipe`; its number if it tells none.
    pub driver_name: String,
    /// The driver's description of its version, as `Mesa 22.3.6 (LLVM 15.0.6)`; may be empty.
    pub driver_info: String,
    /// The driver's version, packed as the vendor packs it.
    pub driver_version: u32,
    /// The highest Vulkan version of the device, packed as Vulkan packs it.
    pub api_version: u32,
    /// The vendor's PCI id, or a Khronos vendor id.
    pub vendor_id: u32,
    /// The vendor's id of the device.
    pub device_id: u32,
    /// The UUID of pipeline caches that the device accepts.
    pub pipeline_cache_uuid: [u8; vk::UUID_SIZE],
    /// The device's limits.
    pub limits: vk::PhysicalDeviceLimits,
    /// The features of Vulkan 1.0 that the device has; which of them are enabled, [`super::EnabledFeatures`] says.
    pub features: vk::PhysicalDeviceFeatures,
    /// Shaders look textures of an array up by numbers that differ from invocation to invocation (`VK_EXT_descriptor_indexing`).
    pub non_uniform_textures: bool,
    /// The features of newer APIs that the device has.
    pub newer: NewerFeatures,
    /// Memory types and heaps.
    pub memory: vk::PhysicalDeviceMemoryProperties,
    /// The device extensions that can be enabled, without the ones in `broken`.
    pub extensions: BTreeSet<String>,
    /// Extensions that the device lists and that it does not open with. Empty before it was opened.
    pub broken: Vec<&'static CStr>,
    /// The first queue family that does graphics and compute, if there is one.
    pub queue_family: Option<u32>,
    /// The number of valid bits in that family's timestamps; 0: it writes none.
    pub timestamp_valid_bits: u32,
    /// The families of other queues.
    pub families: QueueFamilies,
    /// The figures that an earlier run measured of the device and its driver, as [`PhysicalDevice::keep_calibration`] took them; only with
    /// [`super::InstanceOptions::calibrated`], and with the feature `caches`.
    #[cfg(feature = "caches")]
    pub calibration: Option<Vec<u8>>,
    pub(super) instance: Arc<InstanceHandles>,
}

impl PhysicalDevice {
    pub(super) fn query(instance: &Arc<InstanceHandles>, raw: vk::PhysicalDevice) -> Result<PhysicalDevice> {
        // SAFETY: the device was listed by this instance, which is alive; here and in the calls below.
        let properties = unsafe { instance.raw.get_physical_device_properties(raw) };
        // SAFETY: as above.
        let (features, memory, families) = unsafe {
            (
                instance.raw.get_physical_device_features(raw),
                instance.raw.get_physical_device_memory_properties(raw),
                instance.raw.get_physical_device_queue_family_properties(raw),
            )
        };
        let name = fixed_text(&properties.device_name);
        // SAFETY: as above.
        let extensions = unsafe { instance.raw.enumerate_device_extension_properties(raw) }
            .doing("vkEnumerateDeviceExtensionProperties", || format!("listing the extensions of '{name}'"))?
            .iter()
            .map(|extension| fixed_text(&extension.extension_name))
            .collect::<BTreeSet<String>>();
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let family = families.iter().position(|family| family.queue_flags.contains(wanted) && family.queue_count > 0);
        let non_uniform_textures = indexes_textures(instance, raw, (properties.api_version, &features), &extensions);
        let (driver_name, driver_info) = driver_of(instance, raw, &properties, &extensions);
        Ok(PhysicalDevice {
            raw,
            name,
            kind: properties.device_type,
            driver_name,
            driver_info,
            driver_version: properties.driver_version,
            api_version: properties.api_version,
            vendor_id: properties.vendor_id,
            device_id: properties.device_id,
            pipeline_cache_uuid: properties.pipeline_cache_uuid,
            limits: properties.limits,
            features,
            non_uniform_textures,
            newer: NewerFeatures::query(instance, raw, properties.api_version, &extensions),
            memory,
            extensions,
            broken: Vec::new(),
            queue_family: family.and_then(|index| u32::try_from(index).ok()),
            timestamp_valid_bits: family.map_or(0, |index| families[index].timestamp_valid_bits),
            families: QueueFamilies::of(&families),
            #[cfg(feature = "caches")]
            calibration: None,
            instance: Arc::clone(instance),
        })
    }

    /// Returns the features of this format for optimally tiled images.
    pub fn format_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        // SAFETY: the instance is alive, as `self` holds it.
        unsafe { self.instance.raw.get_physical_device_format_properties(self.raw, format) }.optimal_tiling_features
    }

    /// Returns true if images of this format can be colour attachments, also of a subpass that blends if `blended`.
    pub fn supports_color_attachment(&self, format: vk::Format, blended: bool) -> bool {
        let needed = if blended {
            vk::FormatFeatureFlags::COLOR_ATTACHMENT | vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND
        } else {
            vk::FormatFeatureFlags::COLOR_ATTACHMENT
        };
        self.format_features(format).contains(needed)
    }

    /// The limits of images of this format and usage (2D, optimal tiling), or `None` if there can be none.
    ///
    /// # Errors
    /// Running out of memory.
    pub fn image_limits(
        &self,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        flags: vk::ImageCreateFlags,
    ) -> Result<Option<vk::ImageFormatProperties>> {
        let (kind, tiling) = (vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL);
        // SAFETY: the instance is alive, as `self` holds it.
        let limits = unsafe {
            self.instance.raw.get_physical_device_image_format_properties(self.raw, format, kind, tiling, usage, flags)
        };
        match limits {
            Ok(limits) => Ok(Some(limits)),
            Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED) => Ok(None),
            Err(result) => Err(Error::vulkan(
                "vkGetPhysicalDeviceImageFormatProperties",
                format!("asking for the limits of {format:?} images"),
                result,
            )),
        }
    }

    /// The sample counts that colour and depth attachments share.
    pub fn attachment_samples(&self) -> vk::SampleCountFlags {
        self.limits.framebuffer_color_sample_counts & self.limits.framebuffer_depth_sample_counts
    }

    /// Returns true if there is memory that transient attachments take only when a tile does not hold them.
    pub fn has_lazily_allocated_memory(&self) -> bool {
        let types = self.memory.memory_types_as_slice().iter();
        types.into_iter().any(|kind| kind.property_flags.contains(vk::MemoryPropertyFlags::LAZILY_ALLOCATED))
    }

    /// The device as one that does not list this extension: it does not open with it.
    pub(super) fn without(mut self, name: &'static CStr) -> PhysicalDevice {
        self.extensions.remove(&*name.to_string_lossy());
        self.newer = self.newer.without(name);
        self.non_uniform_textures &= name != ash::ext::descriptor_indexing::NAME;
        self.broken.push(name);
        self
    }

    /// The extensions that the device does not open with, in a sentence; `None` where it keeps its promises.
    pub fn fault(&self) -> Option<String> {
        let names: Vec<_> = self.broken.iter().map(|name| name.to_string_lossy()).collect();
        let (names, one) = (names.join(", "), if names.len() == 1 { "it" } else { "all of them" });
        let name = &self.name;
        (!self.broken.is_empty()).then(|| {
            format!("'{name}' lists {names} and does not open with {one}, a fault of its driver or of a layer: it is used without")
        })
    }

    /// Why this program cannot use the device, if it cannot.
    pub fn unusable(&self) -> Option<String> {
        if self.api_version < vk::API_VERSION_1_1 {
            Some(format!("'{}' has Vulkan {}; 1.1 is needed", self.name, version_text(self.api_version)))
        } else if self.queue_family.is_none() {
            Some(format!("'{}' has no queue for graphics and compute", self.name))
        } else {
            None
        }
    }
}

impl fmt::Debug for PhysicalDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:?}, Vulkan {})", self.name, self.kind, version_text(self.api_version))
    }
}

/// A Vulkan version in its usual form, as `1.3.230`.
pub(super) fn version_text(version: u32) -> String {
    format!("{}.{}.{}", vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version))
}

/// The driver's name and its own words for its version.
fn driver_of(
    instance: &InstanceHandles,
    raw: vk::PhysicalDevice,
    properties: &vk::PhysicalDeviceProperties,
    extensions: &BTreeSet<String>,
) -> (String, String) {
    let extension = ash::khr::driver_properties::NAME.to_string_lossy();
    let known = properties.api_version >= vk::API_VERSION_1_2 || extensions.contains(&*extension);
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    // The call itself is of Vulkan 1.1; a device of 1.0 is only listed.
    if known && properties.api_version >= vk::API_VERSION_1_1 {
        let mut query = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the device was listed by this instance, and the structures live until the call returns.
        unsafe { instance.raw.get_physical_device_properties2(raw, &mut query) };
    }
    let name = fixed_text(&driver.driver_name);
    let name = if name.is_empty() { format!("driver {:#x}", properties.driver_version) } else { name };
    (name, fixed_text(&driver.driver_info))
}

fn indexes_textures(
    instance: &InstanceHandles,
    raw: vk::PhysicalDevice,
    (api_version, features): (u32, &vk::PhysicalDeviceFeatures),
    extensions: &BTreeSet<String>,
) -> bool {
    // The call itself is of Vulkan 1.1.
    if api_version < vk::API_VERSION_1_1
        || !extensions.contains(&*ash::ext::descriptor_indexing::NAME.to_string_lossy())
    {
        return false;
    }
    let mut indexing = vk::PhysicalDeviceDescriptorIndexingFeatures::default();
    let mut query = vk::PhysicalDeviceFeatures2::default().push_next(&mut indexing);
    // SAFETY: the device was listed by this instance, and the structures live until the call returns.
    unsafe { instance.raw.get_physical_device_features2(raw, &mut query) };
    // SPIR-V declares both.
    features.shader_sampled_image_array_dynamic_indexing == vk::TRUE
        && indexing.shader_sampled_image_array_non_uniform_indexing == vk::TRUE
}

/// The features of Vulkan 1.3 and 1.4 that frames may use, as extensions.
///
/// The device must list the extensions by name, even if its Vulkan version has them in core: functions are loaded by the extensions' names, and `ash` does not know
/// the core names of Vulkan 1.4. Drivers still list promoted extensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NewerFeatures {
    /// VK_KHR_synchronization2, and VK_KHR_create_renderpass2 for its masks in render passes.
    pub synchronization2: Support,
    /// VK_KHR_dynamic_rendering_local_read, with all that it needs.
    pub local_read: Support,
    /// Depth can be read so (`dynamicRenderingLocalReadDepthStencilAttachments`).
    pub local_read_depth: bool,
    /// And attachments of several samples (`dynamicRenderingLocalReadMultisampledAttachments`).
    pub local_read_samples: bool,
    /// VK_KHR_unified_image_layouts.
    pub unified_layouts: Support,
    /// VK_EXT_subpass_merge_feedback.
    pub merge_feedback: bool,
    /// VK_KHR_timeline_semaphore.
    pub timeline_semaphore: Support,
}

impl NewerFeatures {
    fn query(
        instance: &InstanceHandles,
        raw: vk::PhysicalDevice,
        api_version: u32,
        extensions: &BTreeSet<String>,
    ) -> NewerFeatures {
        // The calls themselves are of Vulkan 1.1.
        if api_version < vk::API_VERSION_1_1 {
            return NewerFeatures::none();
        }
        let has = |name: &CStr| extensions.contains(&*name.to_string_lossy());
        let mut synchronization2 = vk::PhysicalDeviceSynchronization2Features::default();
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
        let mut local_read = vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR::default();
        let mut unified = UnifiedLayoutsFeatures::new(false);
        let mut merging = vk::PhysicalDeviceSubpassMergeFeedbackFeaturesEXT::default();
        let mut timeline = vk::PhysicalDeviceTimelineSemaphoreFeatures::default();
        let lists_local_read = LOCAL_READ.into_iter().all(has);
        let mut query = vk::PhysicalDeviceFeatures2::default();
        // A structure of an extension that is not listed must not be asked for.
        if has(ash::khr::synchronization2::NAME) {
            query = query.push_next(&mut synchronization2);
        }
        if lists_local_read {
            query = query.push_next(&mut rendering).push_next(&mut local_read);
        }
        if has(UNIFIED_LAYOUTS) {
            query = query.push_next(&mut unified);
        }
        if has(ash::ext::subpass_merge_feedback::NAME) {
            query = query.push_next(&mut merging);
        }
        if has(ash::khr::timeline_semaphore::NAME) {
            query = query.push_next(&mut timeline);
        }
        // SAFETY: the device was listed by this instance, and the structures live until the call returns.
        unsafe { instance.raw.get_physical_device_features2(raw, &mut query) };
        // "If the VK_KHR_dynamic_rendering_local_read extension is not supported, Vulkan 1.4 implementations must support local read only for storage
        // resources and single sampled color attachments." (Specification, "Core Revisions".) Lavapipe has the extension, yet says by these
        // properties that it cannot do the rest. The properties are believed where they exist.
        let mut read = Vulkan14Properties::default();
        let unasked = can_unasked(api_version).into();
        (read.local_read_depth, read.local_read_samples) = (unasked, unasked);
        if lists_local_read && api_version.min(instance.api_version) >= API_VERSION_1_4 {
            let mut query = vk::PhysicalDeviceProperties2::default().push_next(&mut read);
            // SAFETY: as above.
            unsafe { instance.raw.get_physical_device_properties2(raw, &mut query) };
        }
        let is_on = |feature: vk::Bool32| feature == vk::TRUE;
        let listed = |names: &[&'static CStr]| match names.iter().find(|name| !has(name)) {
            Some(&name) => Err(Lack::Extension(name)),
            None => Ok(()),
        };
        let on = |feature, name| if is_on(feature) { Ok(()) } else { Err(Lack::Feature(name)) };
        let local_read = listed(&LOCAL_READ)
            .and_then(|()| on(local_read.dynamic_rendering_local_read, "dynamicRenderingLocalRead"))
            .and_then(|()| on(rendering.dynamic_rendering, "dynamicRendering"));
        NewerFeatures {
            synchronization2: listed(&SYNCHRONIZATION2)
                .and_then(|()| on(synchronization2.synchronization2, "synchronization2")),
            local_read,
            local_read_depth: local_read.is_ok() && is_on(read.local_read_depth),
            local_read_samples: local_read.is_ok() && is_on(read.local_read_samples),
            unified_layouts: listed(&[UNIFIED_LAYOUTS])
                .and_then(|()| on(unified.unified_image_layouts, "unifiedImageLayouts")),
            merge_feedback: is_on(merging.subpass_merge_feedback) && has(ash::khr::create_renderpass2::NAME),
            timeline_semaphore: listed(&[ash::khr::timeline_semaphore::NAME])
                .and_then(|()| on(timeline.timeline_semaphore, "timelineSemaphore")),
        }
    }

    /// Features of a device without extensions.
    fn none() -> Self {
        Self {
            synchronization2: Err(Lack::Extension(SYNCHRONIZATION2[0])),
            local_read: Err(Lack::Extension(LOCAL_READ[0])),
            local_read_depth: false,
            local_read_samples: false,
            unified_layouts: Err(Lack::Extension(UNIFIED_LAYOUTS)),
            merge_feedback: false,
            timeline_semaphore: Err(Lack::Extension(ash::khr::timeline_semaphore::NAME)),
        }
    }

    /// The features of a device that does not open with this extension.
    fn without(mut self, name: &'static CStr) -> Self {
        let broken = Err(Lack::Broken(name));
        if SYNCHRONIZATION2.contains(&name) {
            self.synchronization2 = self.synchronization2.and(broken);
        }
        if LOCAL_READ.contains(&name) {
            self.local_read = self.local_read.and(broken);
            (self.local_read_depth, self.local_read_samples) = (false, false);
        }
        if name == UNIFIED_LAYOUTS {
            self.unified_layouts = self.unified_layouts.and(broken);
        }
        if name == ash::khr::timeline_semaphore::NAME {
            self.timeline_semaphore = self.timeline_semaphore.and(broken);
        }
        let of_merging = [ash::ext::subpass_merge_feedback::NAME, ash::khr::create_renderpass2::NAME];
        self.merge_feedback &= !of_merging.contains(&name);
        self
    }
}

/// Whether a device with VK_KHR_dynamic_rendering_local_read reads depth and several samples so where nobody can ask. The extension alone promises both. A device of
/// Vulkan 1.4 may say that it cannot, but only to an instance of Vulkan 1.4: without its answer it counts as one that cannot.
fn can_unasked(api_version: u32) -> bool {
    api_version < API_VERSION_1_4
}

/// The choice of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A real GPU before a virtual one, and that before a CPU.
    #[default]
    Auto,
    /// The device of this number in the loader's order, from 0.
    Index(usize),
    /// A device whose name has this in it, in upper or lower case; of several, the one that `Auto` would take.
    Name(String),
}

impl FromStr for DeviceChoice {
    type Err = Infallible;

    /// A number, `auto`, or a part of a name.
    fn from_str(text: &str) -> Result<DeviceChoice, Infallible> {
        let text = text.trim();
        Ok(match text.parse() {
            Ok(index) => DeviceChoice::Index(index),
            Err(_) if text.is_empty() || text.eq_ignore_ascii_case("auto") => DeviceChoice::Auto,
            Err(_) => DeviceChoice::Name(text.to_owned()),
        })
    }
}

impl fmt::Display for DeviceChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DeviceChoice::Auto => f.write_str("auto"),
            DeviceChoice::Index(index) => write!(f, "{index}"),
            DeviceChoice::Name(name) => f.write_str(name),
        }
    }
}

/// The index of the device that `choice` means.
///
/// # Errors
/// [`Error::NoSuchDevice`] with the names of the devices that exist; [`Error::Unsupported`] if the device cannot be used.
pub fn choose(devices: &[PhysicalDevice], choice: &DeviceChoice) -> Result<usize> {
    let described: Vec<DeviceCandidate<'_>> = devices
        .iter()
        .map(|device| DeviceCandidate { name: &device.name, kind: device.kind, unusable: device.unusable() })
        .collect();
    choose_among(&described, choice)
}

/// The properties of a device on which the choice depends.
struct DeviceCandidate<'a> {
    name: &'a str,
    kind: vk::PhysicalDeviceType,
    unusable: Option<String>,
}

fn choose_among(devices: &[DeviceCandidate<'_>], choice: &DeviceChoice) -> Result<usize> {
    let matches = |index: usize, device: &DeviceCandidate<'_>| match choice {
        DeviceChoice::Auto => true,
        DeviceChoice::Index(wanted) => index == *wanted,
        DeviceChoice::Name(part) => device.name.to_lowercase().contains(&part.to_lowercase()),
    };
    let matching = devices.iter().enumerate().filter(|&(index, device)| matches(index, device));
    // Among equals `min_by_key` returns the first, so the loader's order (and whatever configures it) has the last word.
    let best = matching.min_by_key(|(_, device)| (device.unusable.is_some(), rank(device.kind)));
    match best {
        Some((index, DeviceCandidate { unusable: None, .. })) => Ok(index),
        Some((_, DeviceCandidate { unusable: Some(reason), .. })) => Err(Error::Unsupported(reason.clone())),
        None => Err(Error::NoSuchDevice {
            wanted: choice.to_string(),
            available: devices.iter().map(|device| device.name.to_owned()).collect(),
        }),
    }
}

fn rank(kind: vk::PhysicalDeviceType) -> u32 {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 4,
        _ => 3,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidates() -> [DeviceCandidate<'static>; 4] {
        let of = |name, kind| DeviceCandidate { name, kind, unusable: None };
        [
            of("llvmpipe (LLVM 15)", vk::PhysicalDeviceType::CPU),
            of("Radeon 780M", vk::PhysicalDeviceType::INTEGRATED_GPU),
            of("GeForce A", vk::PhysicalDeviceType::DISCRETE_GPU),
            of("GeForce B", vk::PhysicalDeviceType::DISCRETE_GPU),
        ]
    }

    fn chosen(text: &str) -> Result<usize> {
        let Ok(choice) = text.parse::<DeviceChoice>();
        choose_among(&candidates(), &choice)
    }

    #[test]
    fn local_read_of_depth_is_believed_unasked_before_vulkan_1_4_alone() {
        assert!(can_unasked(vk::API_VERSION_1_1) && can_unasked(vk::make_api_version(0, 1, 3, 309)));
        assert!(!can_unasked(API_VERSION_1_4) && !can_unasked(vk::make_api_version(0, 1, 4, 309)));
    }

    #[test]
    fn a_device_that_does_not_open_with_an_extension_lacks_what_needs_it_and_says_so() {
        let all = NewerFeatures {
            synchronization2: Ok(()),
            local_read: Ok(()),
            local_read_depth: true,
            local_read_samples: true,
            unified_layouts: Ok(()),
            merge_feedback: true,
            timeline_semaphore: Ok(()),
        };
        let (sync, pass2) = (ash::khr::synchronization2::NAME, ash::khr::create_renderpass2::NAME);
        assert_eq!(all.without(sync), NewerFeatures { synchronization2: Err(Lack::Broken(sync)), ..all });
        let without = all.without(pass2);
        let broken = Err(Lack::Broken(pass2));
        let (depth, samples) = (without.local_read_depth, without.local_read_samples);
        assert_eq!((without.synchronization2, without.local_read, depth, samples), (broken, broken, false, false));
        assert!(!without.merge_feedback && without.unified_layouts.is_ok());
        assert!(Lack::Broken(sync).to_string().contains("lists VK_KHR_synchronization2 and does not open with it"));
        // It never had them.
        assert_eq!(NewerFeatures::none().without(pass2), NewerFeatures::none());
    }

    #[test]
    fn a_real_gpu_comes_before_a_cpu_and_the_first_before_its_equal() {
        assert_eq!(chosen("auto").ok(), Some(2));
        assert_eq!(choose_among(&candidates()[..1], &DeviceChoice::Auto).ok(), Some(0));
    }

    #[test]
    fn a_device_is_chosen_by_number_or_part_of_its_name() {
        assert_eq!(chosen("1").ok(), Some(1));
        assert_eq!(chosen("LLVMPIPE").ok(), Some(0));
        assert_eq!(chosen("force b").ok(), Some(3));
    }

    #[test]
    fn an_unknown_device_lists_those_that_exist() {
        for wanted in ["4", "voodoo"] {
            let text = chosen(wanted).map_or_else(|error| error.to_string(), |index| index.to_string());
            assert!(text.contains(wanted) && text.contains("1: Radeon 780M"), "{text}");
        }
    }

    #[test]
    fn a_device_that_cannot_be_used_is_passed_over_unless_asked_for() {
        let mut devices = candidates();
        devices[2].unusable = Some("'GeForce A' has Vulkan 1.0; 1.1 is needed".to_owned());
        assert_eq!(choose_among(&devices, &DeviceChoice::Auto).ok(), Some(3));
        assert!(matches!(choose_among(&devices, &DeviceChoice::Index(2)), Err(Error::Unsupported(_))));
    }
}
