//! The parts of newer Vulkan that `ash` does not know yet: VK_KHR_unified_image_layouts, the properties of Vulkan 1.4, and extensions of Roadmap 2026.

use std::ffi::{CStr, c_void};
use std::marker::PhantomData;

use ash::vk;

/// Vulkan 1.4, without its patches.
pub const API_VERSION_1_4: u32 = vk::make_api_version(0, 1, 4, 0);

/// The name of the extension of unified layouts.
pub const UNIFIED_LAYOUTS: &CStr = c"VK_KHR_unified_image_layouts";

/// `VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_UNIFIED_IMAGE_LAYOUTS_FEATURES_KHR`.
const UNIFIED_LAYOUTS_FEATURES: i32 = 1_000_527_000;

/// `VkPhysicalDeviceUnifiedImageLayoutsFeaturesKHR`.
#[repr(C)]
pub struct UnifiedLayoutsFeatures<'a> {
    s_type: vk::StructureType,
    p_next: *mut c_void,
    /// Images may stay in GENERAL without a loss.
    pub unified_image_layouts: vk::Bool32,
    /// Images of video codecs may do so as well.
    unified_image_layouts_video: vk::Bool32,
    marker: PhantomData<&'a ()>,
}

impl UnifiedLayoutsFeatures<'_> {
    /// The structure, asking for the feature of images or for nothing.
    pub fn new(unified_image_layouts: bool) -> Self {
        Self {
            s_type: vk::StructureType::from_raw(UNIFIED_LAYOUTS_FEATURES),
            p_next: std::ptr::null_mut(),
            unified_image_layouts: unified_image_layouts.into(),
            unified_image_layouts_video: vk::FALSE,
            marker: PhantomData,
        }
    }
}

// SAFETY: the specification lets the structure extend both, and it begins as all of Vulkan's do.
unsafe impl vk::ExtendsPhysicalDeviceFeatures2 for UnifiedLayoutsFeatures<'_> {}
// SAFETY: as above.
unsafe impl vk::ExtendsDeviceCreateInfo for UnifiedLayoutsFeatures<'_> {}

/// `VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_4_PROPERTIES`.
const VULKAN_1_4_PROPERTIES: i32 = 56;

/// `VkPhysicalDeviceVulkan14Properties`, of which two fields count here.
#[repr(C)]
pub struct Vulkan14Properties<'a> {
    s_type: vk::StructureType,
    p_next: *mut c_void,
    before: [u32; 4],
    /// Depth can be read by local read.
    pub local_read_depth: vk::Bool32,
    /// Attachments of several samples can.
    pub local_read_samples: vk::Bool32,
    between: [u32; 13],
    copy_src_layout_count: u32,
    copy_src_layouts: *mut vk::ImageLayout,
    copy_dst_layout_count: u32,
    copy_dst_layouts: *mut vk::ImageLayout,
    optimal_tiling_layout_uuid: [u8; vk::UUID_SIZE],
    identical_memory_type_requirements: vk::Bool32,
    marker: PhantomData<&'a ()>,
}

impl Default for Vulkan14Properties<'_> {
    fn default() -> Self {
        Self {
            s_type: vk::StructureType::from_raw(VULKAN_1_4_PROPERTIES),
            p_next: std::ptr::null_mut(),
            before: [0; 4],
            local_read_depth: vk::FALSE,
            local_read_samples: vk::FALSE,
            between: [0; 13],
            copy_src_layout_count: 0,
            // No room: drivers return the number of layouts alone.
            copy_src_layouts: std::ptr::null_mut(),
            copy_dst_layout_count: 0,
            copy_dst_layouts: std::ptr::null_mut(),
            optimal_tiling_layout_uuid: [0; vk::UUID_SIZE],
            identical_memory_type_requirements: vk::FALSE,
            marker: PhantomData,
        }
    }
}

// SAFETY: the specification lets the structure extend these properties, and it begins as all of Vulkan's do.
unsafe impl vk::ExtendsPhysicalDeviceProperties2 for Vulkan14Properties<'_> {}

/// Names of extensions that `ash` does not have.
macro_rules! names {
    ($($name:ident = $text:literal;)*) => {
        $(
            #[doc = concat!("The name of the extension, ", stringify!($text), ".")]
            pub const $name: &CStr = $text;
        )*
    };
}

names! {
    ROBUSTNESS2 = c"VK_KHR_robustness2";
    COMPUTE_SHADER_DERIVATIVES = c"VK_KHR_compute_shader_derivatives";
    DEPTH_CLAMP_ZERO_ONE = c"VK_KHR_depth_clamp_zero_one";
    SWAPCHAIN_MAINTENANCE1 = c"VK_KHR_swapchain_maintenance1";
    SURFACE_MAINTENANCE1 = c"VK_KHR_surface_maintenance1";
    PIPELINE_BINARY = c"VK_KHR_pipeline_binary";
    MAINTENANCE7 = c"VK_KHR_maintenance7";
    MAINTENANCE8 = c"VK_KHR_maintenance8";
    MAINTENANCE9 = c"VK_KHR_maintenance9";
    COPY_MEMORY_INDIRECT = c"VK_KHR_copy_memory_indirect";
    SHADER_UNTYPED_POINTERS = c"VK_KHR_shader_untyped_pointers";
    PRESENT_MODE_FIFO_LATEST_READY = c"VK_KHR_present_mode_fifo_latest_ready";
    PRESENT_ID2 = c"VK_KHR_present_id2";
    PRESENT_WAIT2 = c"VK_KHR_present_wait2";
}

/// Structures of features by the numbers of their types in the registry (vk.xml), with their fields in order.
macro_rules! feature_structures {
    ($($name:ident = $s_type:literal { $($field:ident),* })*) => {
        $(
            #[doc = concat!("`VkPhysicalDevice", stringify!($name), "KHR`.")]
            #[repr(C)]
            pub struct $name {
                s_type: vk::StructureType,
                p_next: *mut c_void,
                $(pub $field: vk::Bool32,)*
            }

            impl Default for $name {
                fn default() -> Self {
                    Self {
                        s_type: vk::StructureType::from_raw($s_type),
                        p_next: std::ptr::null_mut(),
                        $($field: vk::FALSE,)*
                    }
                }
            }

            // SAFETY: the specification lets the structure extend these features, and it begins as all of Vulkan's do.
            unsafe impl vk::ExtendsPhysicalDeviceFeatures2 for $name {}
        )*
    };
}

feature_structures! {
    PipelineBinaryFeatures = 1_000_483_000 { pipeline_binaries }
    Maintenance7Features = 1_000_562_000 { maintenance7 }
    Maintenance8Features = 1_000_574_000 { maintenance8 }
    Maintenance9Features = 1_000_584_000 { maintenance9 }
    CopyMemoryIndirectFeatures = 1_000_549_000 { indirect_memory_copy, indirect_memory_to_image_copy }
    ShaderUntypedPointersFeatures = 1_000_387_000 { shader_untyped_pointers }
    PresentModeFifoLatestReadyFeatures = 1_000_361_000 { present_mode_fifo_latest_ready }
    PresentId2Features = 1_000_479_002 { present_id2 }
    PresentWait2Features = 1_000_480_001 { present_wait2 }
}
