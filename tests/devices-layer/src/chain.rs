//! Chains of structures (`pNext`) that hold features and properties of a device beyond Vulkan 1.0.

use std::ffi::c_void;
use std::ptr::NonNull;

use ash::vk;

use super::profile::{Profile, STRIDE_ALIGNMENT};

/// All structures of a chain in turn.
///
/// # Safety
/// `chain` is null or points to structures of Vulkan that are chained by their second member and live as long as the iterator.
pub unsafe fn structures(chain: *const c_void) -> impl Iterator<Item = NonNull<vk::BaseOutStructure<'static>>> {
    let first = NonNull::new(chain.cast_mut().cast::<vk::BaseOutStructure<'static>>());
    // SAFETY: the caller's promise: each begins as a `VkBaseOutStructure` does.
    std::iter::successors(first, |own| NonNull::new(unsafe { own.as_ref() }.p_next))
}

/// Runs `$do` on the structure if it has one of these types.
macro_rules! for_each_of {
    ($structure:expr, [$($type:ty),*], $do:ident) => {
        // SAFETY: the caller has it from a chain, where each has the type that it tells.
        match unsafe { $structure.as_ref() }.s_type {
            $(<$type as vk::TaggedStructure>::STRUCTURE_TYPE => {
                // SAFETY: as above; nobody else uses it meanwhile.
                let own = unsafe { $structure.cast::<$type>().as_mut() };
                $do!(own);
            })*
            _ => {}
        }
    };
}

/// Runs `$do` on the structure if it holds features that Vulkan 1.1 leaves to devices, or features of later versions.
macro_rules! for_each_optional {
    ($structure:expr, $do:ident) => {
        for_each_of!(
            $structure,
            [
                vk::PhysicalDevice16BitStorageFeatures<'static>,
                vk::PhysicalDeviceVariablePointersFeatures<'static>,
                vk::PhysicalDeviceProtectedMemoryFeatures<'static>,
                vk::PhysicalDeviceSamplerYcbcrConversionFeatures<'static>,
                vk::PhysicalDeviceShaderDrawParametersFeatures<'static>,
                vk::PhysicalDeviceDescriptorIndexingFeatures<'static>,
                vk::PhysicalDeviceVulkan11Features<'static>,
                vk::PhysicalDeviceVulkan12Features<'static>,
                vk::PhysicalDeviceVulkan13Features<'static>
            ],
            $do
        )
    };
}

/// A structure whose only members behind the header are `COUNT` switches, perhaps followed by padding.
trait Switches: vk::TaggedStructure {
    const COUNT: usize;

    fn switches(&mut self) -> &mut [vk::Bool32]
    where
        Self: Sized,
    {
        const HEAD: usize = size_of::<vk::BaseOutStructure<'static>>();
        const { assert!(size_of::<Self>() - HEAD - Self::COUNT * size_of::<vk::Bool32>() < align_of::<Self>()) };
        let first = std::ptr::from_mut(self).cast::<u8>();
        // SAFETY: `COUNT` switches follow the header, which has the same length in all structures.
        unsafe { std::slice::from_raw_parts_mut(first.add(HEAD).cast::<vk::Bool32>(), Self::COUNT) }
    }
}

macro_rules! have_switches {
    ($($name:ident: $count:literal,)*) => {
        $(impl Switches for vk::$name<'_> {
            const COUNT: usize = $count;
        })*
    };
}

have_switches! {
    PhysicalDevicePortabilitySubsetFeaturesKHR: 15,
    PhysicalDeviceSubpassMergeFeedbackFeaturesEXT: 1,
    PhysicalDevice16BitStorageFeatures: 4,
    PhysicalDeviceVariablePointersFeatures: 2,
    PhysicalDeviceProtectedMemoryFeatures: 1,
    PhysicalDeviceSamplerYcbcrConversionFeatures: 1,
    PhysicalDeviceShaderDrawParametersFeatures: 1,
    PhysicalDeviceDescriptorIndexingFeatures: 20,
    PhysicalDeviceVulkan11Features: 12,
    PhysicalDeviceVulkan12Features: 47,
    PhysicalDeviceVulkan13Features: 15,
}

/// Takes the features away that the played device lacks, of a structure that a device below has filled in, and adds its own.
///
/// # Safety
/// The structure is from a chain, and nobody else uses it meanwhile.
pub unsafe fn play_features(profile: Profile, structure: NonNull<vk::BaseOutStructure<'static>>) {
    macro_rules! clear {
        ($own:ident) => {
            $own.switches().fill(vk::FALSE)
        };
    }
    if profile.has_portability_subset() {
        for_each_of!(structure, [vk::PhysicalDevicePortabilitySubsetFeaturesKHR<'static>], clear);
    }
    macro_rules! set {
        ($own:ident) => {
            $own.switches().fill(vk::TRUE)
        };
    }
    if profile.tells_merging() {
        for_each_of!(structure, [vk::PhysicalDeviceSubpassMergeFeedbackFeaturesEXT<'static>], set);
    }
    if profile.is_of_vulkan_1_1() {
        for_each_optional!(structure, clear);
        // Views of several at once are no option in Vulkan 1.1.
        macro_rules! keep_multiview {
            ($own:ident) => {{
                $own.multiview_geometry_shader = vk::FALSE;
                $own.multiview_tessellation_shader = vk::FALSE;
            }};
        }
        for_each_of!(structure, [vk::PhysicalDeviceMultiviewFeatures<'static>], keep_multiview);
    }
}

/// `VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_4_PROPERTIES`, which `ash` does not know.
const VULKAN_1_4_PROPERTIES: i32 = 56;

/// The begin of `VkPhysicalDeviceVulkan14Properties`.
#[repr(C)]
struct Vulkan14Properties {
    head: vk::BaseOutStructure<'static>,
    before: [u32; 4],
    local_read_depth: vk::Bool32,
    local_read_samples: vk::Bool32,
}

/// Lowers limits of structures that a device below has filled in.
///
/// # Safety
/// As [`play_features`].
pub unsafe fn play_properties(profile: Profile, structure: NonNull<vk::BaseOutStructure<'static>>) {
    macro_rules! align {
        ($own:ident) => {
            $own.min_vertex_input_binding_stride_alignment = STRIDE_ALIGNMENT
        };
    }
    macro_rules! lower {
        ($own:ident) => {{
            $own.max_per_set_descriptors = $own.max_per_set_descriptors.min(1024);
            $own.max_memory_allocation_size = $own.max_memory_allocation_size.min(1 << 30);
        }};
    }
    if profile.has_portability_subset() {
        for_each_of!(structure, [vk::PhysicalDevicePortabilitySubsetPropertiesKHR<'static>], align);
    }
    if profile.is_of_vulkan_1_1() {
        for_each_of!(structure, [vk::PhysicalDeviceMaintenance3Properties<'static>], lower);
    }
    // SAFETY: as of `for_each_of`.
    if profile.reads_no_local_depth() && unsafe { structure.as_ref() }.s_type.as_raw() == VULKAN_1_4_PROPERTIES {
        // SAFETY: as of `for_each_of`; the structure begins so.
        let own = unsafe { structure.cast::<Vulkan14Properties>().as_mut() };
        (own.local_read_depth, own.local_read_samples) = (vk::FALSE, vk::TRUE);
    }
}

/// Returns true if a structure of a device's creation asks for a feature that the played device lacks.
///
/// # Safety
/// As [`play_features`].
pub unsafe fn asks_for_lacking(
    profile: Profile,
    features: &vk::PhysicalDeviceFeatures,
    structure: NonNull<vk::BaseOutStructure<'static>>,
) -> bool {
    let mut lacking = false;
    macro_rules! look {
        ($own:ident) => {
            lacking |= $own.switches().contains(&vk::TRUE)
        };
    }
    macro_rules! compare {
        ($own:ident) => {
            lacking |= exceeds(&$own.features, features)
        };
    }
    for_each_of!(structure, [vk::PhysicalDeviceFeatures2<'static>], compare);
    if profile.has_portability_subset() {
        for_each_of!(structure, [vk::PhysicalDevicePortabilitySubsetFeaturesKHR<'static>], look);
    }
    if profile.is_of_vulkan_1_1() {
        for_each_optional!(structure, look);
    }
    lacking
}

/// Returns true if `asked` has a feature that `played` has not.
pub fn exceeds(asked: &vk::PhysicalDeviceFeatures, played: &vk::PhysicalDeviceFeatures) -> bool {
    const COUNT: usize = size_of::<vk::PhysicalDeviceFeatures>() / size_of::<vk::Bool32>();
    // SAFETY: the structure is so many switches and nothing else, in the layout of C.
    let switches =
        |own: &vk::PhysicalDeviceFeatures| unsafe { std::mem::transmute_copy::<_, [vk::Bool32; COUNT]>(own) };
    switches(asked).into_iter().zip(switches(played)).any(|(asked, played)| asked == vk::TRUE && played == vk::FALSE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feature_beyond_those_of_the_played_device_is_found() {
        let none = vk::PhysicalDeviceFeatures::default();
        let last = vk::PhysicalDeviceFeatures { inherited_queries: vk::TRUE, ..none };
        assert!(exceeds(&last, &none) && !exceeds(&none, &last) && !exceeds(&last, &last));
    }

    #[test]
    fn depth_alone_is_taken_from_the_properties_of_local_read() {
        let head = vk::BaseOutStructure {
            s_type: vk::StructureType::from_raw(VULKAN_1_4_PROPERTIES),
            p_next: std::ptr::null_mut(),
            _marker: std::marker::PhantomData,
        };
        let mut own =
            Vulkan14Properties { head, before: [7; 4], local_read_depth: vk::TRUE, local_read_samples: vk::FALSE };
        let structure = NonNull::from(&mut own).cast::<vk::BaseOutStructure<'static>>();
        // SAFETY: the structure is this test's own.
        unsafe { play_properties(Profile::NoLocalDepth, structure) };
        assert_eq!((own.before, own.local_read_depth, own.local_read_samples), ([7; 4], vk::FALSE, vk::TRUE));
    }

    #[test]
    fn a_subset_has_none_of_its_features() {
        let mut own = vk::PhysicalDevicePortabilitySubsetFeaturesKHR::default()
            .constant_alpha_color_blend_factors(true)
            .vertex_attribute_access_beyond_stride(true);
        let none = vk::PhysicalDeviceFeatures::default();
        let structure = NonNull::from(&mut own).cast::<vk::BaseOutStructure<'static>>();
        // SAFETY: the structure is this test's own.
        unsafe {
            assert!(asks_for_lacking(Profile::Portability, &none, structure));
            play_features(Profile::Portability, structure);
            assert!(!asks_for_lacking(Profile::Portability, &none, structure));
        }
        assert!(own.constant_alpha_color_blend_factors == 0 && own.vertex_attribute_access_beyond_stride == 0);
    }
}
