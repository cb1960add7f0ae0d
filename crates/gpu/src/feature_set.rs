//! Vulkan's structures of device features, as far as this crate queries or enables them. One set holds the features that a device has, another the features
//! that the program opens it with.

use std::collections::BTreeSet;
use std::ffi::CStr;

use ash::{ext, khr, vk};

use super::instance::InstanceHandles;
use super::newer::{self, API_VERSION_1_4};

/// The versions and extensions with which a structure came. A driver must not be asked for a structure that it does not know.
enum Since {
    Version(u32),
    Extension(&'static CStr),
    Either(u32, &'static CStr),
}

/// The version and the extensions of a device that is asked.
#[derive(Clone, Copy)]
pub(super) struct Knowledge<'a> {
    /// The lower of the device's version and the instance's: a structure is allowed only if both know it.
    pub(super) version: u32,
    pub(super) extensions: &'a BTreeSet<String>,
}

impl Knowledge<'_> {
    fn has(self, since: &Since) -> bool {
        let lists = |name: &CStr| self.extensions.contains(&*name.to_string_lossy());
        match *since {
            Since::Version(version) => self.version >= version,
            Since::Extension(name) => lists(name),
            Since::Either(version, name) => self.version >= version || lists(name),
        }
    }
}

macro_rules! feature_set {
    ($($name:ident: $type:ty, $since:expr;)*) => {
        /// Structures of features, each by a short name; `core` has the features of Vulkan 1.0.
        #[derive(Default)]
        pub(super) struct FeatureSet {
            pub(super) core: vk::PhysicalDeviceFeatures,
            $(pub(super) $name: $type,)*
        }

        impl FeatureSet {
            /// Queries the features of a device of Vulkan 1.1 or newer. A structure that the device does not know stays empty.
            pub(super) fn of(instance: &InstanceHandles, raw: vk::PhysicalDevice, known: Knowledge<'_>) -> Self {
                let mut own = Self::default();
                let mut query = vk::PhysicalDeviceFeatures2::default();
                $(if known.has(&$since) {
                    query = query.push_next(&mut own.$name);
                })*
                // SAFETY: the device was listed by this instance, and the structures live until the call returns.
                unsafe { instance.raw.get_physical_device_features2(raw, &mut query) };
                own.core = query.features;
                own
            }

            /// All features.
            #[cfg(test)]
            pub(super) fn all() -> Self {
                let mut own = Self::default();
                tests::fill(&mut own.core, 0);
                $(tests::fill(&mut own.$name, size_of::<vk::BaseOutStructure<'_>>());)*
                own
            }
        }
    };
}

feature_set! {
    multiview: vk::PhysicalDeviceMultiviewFeatures<'static>, Since::Version(vk::API_VERSION_1_1);
    storage16: vk::PhysicalDevice16BitStorageFeatures<'static>, Since::Version(vk::API_VERSION_1_1);
    ycbcr: vk::PhysicalDeviceSamplerYcbcrConversionFeatures<'static>, Since::Version(vk::API_VERSION_1_1);
    draw_parameters: vk::PhysicalDeviceShaderDrawParametersFeatures<'static>, Since::Version(vk::API_VERSION_1_1);
    vulkan12: vk::PhysicalDeviceVulkan12Features<'static>, Since::Version(vk::API_VERSION_1_2);
    vulkan13: vk::PhysicalDeviceVulkan13Features<'static>, Since::Version(vk::API_VERSION_1_3);

    // The extensions that the program enables by their own names, so that Vulkan 1.1 is enough for it.
    indexing: vk::PhysicalDeviceDescriptorIndexingFeatures<'static>,
        Since::Either(vk::API_VERSION_1_2, ext::descriptor_indexing::NAME);
    maintenance4: vk::PhysicalDeviceMaintenance4Features<'static>,
        Since::Either(vk::API_VERSION_1_3, khr::maintenance4::NAME);
    synchronization2: vk::PhysicalDeviceSynchronization2Features<'static>,
        Since::Either(vk::API_VERSION_1_3, khr::synchronization2::NAME);
    rendering: vk::PhysicalDeviceDynamicRenderingFeatures<'static>,
        Since::Either(vk::API_VERSION_1_3, khr::dynamic_rendering::NAME);
    local_read: vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR<'static>,
        Since::Extension(khr::dynamic_rendering_local_read::NAME);

    // Extensions that Roadmap milestones require.
    global_priority: vk::PhysicalDeviceGlobalPriorityQueryFeaturesKHR<'static>,
        Since::Extension(khr::global_priority::NAME);
    quad_control: vk::PhysicalDeviceShaderQuadControlFeaturesKHR<'static>,
        Since::Extension(khr::shader_quad_control::NAME);
    reconvergence: vk::PhysicalDeviceShaderMaximalReconvergenceFeaturesKHR<'static>,
        Since::Extension(khr::shader_maximal_reconvergence::NAME);
    uniform_control_flow: vk::PhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR<'static>,
        Since::Extension(khr::shader_subgroup_uniform_control_flow::NAME);
    subgroup_rotate: vk::PhysicalDeviceShaderSubgroupRotateFeaturesKHR<'static>,
        Since::Extension(khr::shader_subgroup_rotate::NAME);
    float_controls2: vk::PhysicalDeviceShaderFloatControls2FeaturesKHR<'static>,
        Since::Extension(khr::shader_float_controls2::NAME);
    expect_assume: vk::PhysicalDeviceShaderExpectAssumeFeaturesKHR<'static>,
        Since::Extension(khr::shader_expect_assume::NAME);
    lines: vk::PhysicalDeviceLineRasterizationFeaturesKHR<'static>, Since::Extension(khr::line_rasterization::NAME);
    divisor: vk::PhysicalDeviceVertexAttributeDivisorFeaturesKHR<'static>,
        Since::Extension(khr::vertex_attribute_divisor::NAME);
    index_uint8: vk::PhysicalDeviceIndexTypeUint8FeaturesKHR<'static>, Since::Extension(khr::index_type_uint8::NAME);
    maintenance5: vk::PhysicalDeviceMaintenance5FeaturesKHR<'static>, Since::Extension(khr::maintenance5::NAME);
    host_image_copy: vk::PhysicalDeviceHostImageCopyFeaturesEXT<'static>,
        Since::Either(API_VERSION_1_4, ext::host_image_copy::NAME);
    // KHR extensions that took the structure of an EXT or NV extension over, with its number.
    robustness2: vk::PhysicalDeviceRobustness2FeaturesEXT<'static>, Since::Extension(newer::ROBUSTNESS2);
    derivatives: vk::PhysicalDeviceComputeShaderDerivativesFeaturesNV<'static>,
        Since::Extension(newer::COMPUTE_SHADER_DERIVATIVES);
    depth_clamp_zero_one: vk::PhysicalDeviceDepthClampZeroOneFeaturesEXT<'static>,
        Since::Extension(newer::DEPTH_CLAMP_ZERO_ONE);
    swapchain_maintenance1: vk::PhysicalDeviceSwapchainMaintenance1FeaturesEXT<'static>,
        Since::Extension(newer::SWAPCHAIN_MAINTENANCE1);
    shading_rate: vk::PhysicalDeviceFragmentShadingRateFeaturesKHR<'static>,
        Since::Extension(khr::fragment_shading_rate::NAME);
    shader_clock: vk::PhysicalDeviceShaderClockFeaturesKHR<'static>, Since::Extension(khr::shader_clock::NAME);
    workgroup_layout: vk::PhysicalDeviceWorkgroupMemoryExplicitLayoutFeaturesKHR<'static>,
        Since::Extension(khr::workgroup_memory_explicit_layout::NAME);
    cooperative_matrix: vk::PhysicalDeviceCooperativeMatrixFeaturesKHR<'static>,
        Since::Extension(khr::cooperative_matrix::NAME);
    pipeline_binary: newer::PipelineBinaryFeatures, Since::Extension(newer::PIPELINE_BINARY);
    maintenance7: newer::Maintenance7Features, Since::Extension(newer::MAINTENANCE7);
    maintenance8: newer::Maintenance8Features, Since::Extension(newer::MAINTENANCE8);
    maintenance9: newer::Maintenance9Features, Since::Extension(newer::MAINTENANCE9);
    copy_memory_indirect: newer::CopyMemoryIndirectFeatures, Since::Extension(newer::COPY_MEMORY_INDIRECT);
    untyped_pointers: newer::ShaderUntypedPointersFeatures, Since::Extension(newer::SHADER_UNTYPED_POINTERS);
    fifo_latest_ready: newer::PresentModeFifoLatestReadyFeatures,
        Since::Extension(newer::PRESENT_MODE_FIFO_LATEST_READY);
    present_id2: newer::PresentId2Features, Since::Extension(newer::PRESENT_ID2);
    present_wait2: newer::PresentWait2Features, Since::Extension(newer::PRESENT_WAIT2);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets all switches of a structure. Behind its head, which is `head` bytes long, it has nothing else.
    pub(super) fn fill<T>(own: &mut T, head: usize) {
        let count = (size_of::<T>() - head) / size_of::<vk::Bool32>();
        let first = std::ptr::from_mut(own).cast::<u8>();
        // SAFETY: `count` switches, or padding of their size, follow each other behind the head.
        unsafe { std::slice::from_raw_parts_mut(first.add(head).cast::<vk::Bool32>(), count) }.fill(vk::TRUE);
    }

    #[test]
    fn a_driver_is_asked_only_for_structures_that_it_knows() {
        let extensions = BTreeSet::from(["VK_KHR_maintenance4".to_owned()]);
        let knows = |version, since: &Since| Knowledge { version, extensions: &extensions }.has(since);
        let (v1_1, v1_3) = (vk::API_VERSION_1_1, vk::API_VERSION_1_3);
        assert!(!knows(v1_1, &Since::Version(v1_3)) && knows(v1_3, &Since::Version(v1_3)));
        assert!(knows(v1_1, &Since::Either(v1_3, khr::maintenance4::NAME)));
        assert!(!knows(v1_1, &Since::Either(v1_3, khr::synchronization2::NAME)));
        assert!(knows(v1_3, &Since::Either(v1_3, khr::synchronization2::NAME)));
        assert!(!knows(v1_3, &Since::Extension(khr::synchronization2::NAME)));
    }
}
