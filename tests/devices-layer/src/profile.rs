//! The devices that the layer plays.

use std::ffi::CStr;

use ash::vk;

use super::{formats, limits};

/// A kind of device that the layer plays on the one below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Vulkan in part only, as MoltenVK has it: VK_KHR_portability_subset without any of its features.
    Portability,
    /// Vulkan 1.1 with the limits and formats that it requires, and no optional feature.
    Least,
    /// A phone's tiler: one memory for CPU and GPU, attachments that live in tiles, few targets.
    Phone,
    /// 4 kB of shared memory in compute shaders.
    SmallSharedMemory,
    /// The device below, which does not open with an extension that it lists: VK_KHR_synchronization2.
    BrokenPromise,
    /// The device below without a queue for graphics.
    NoGraphics,
    /// The device below as a tiler's driver that tells which subpasses it merges: VK_EXT_subpass_merge_feedback.
    MergeFeedback,
    /// The device below with three queue families: for graphics, for compute and for transfers.
    Queues,
    /// The device below, which reads attachments locally but for depth (`dynamicRenderingLocalReadDepthStencilAttachments`).
    NoLocalDepth,
}

/// The profiles by their words in `AFTERLIGHT_PLAYS`.
pub const PROFILES: [(&str, Profile); 9] = [
    ("portability", Profile::Portability),
    ("least", Profile::Least),
    ("phone", Profile::Phone),
    ("small-shared-memory", Profile::SmallSharedMemory),
    ("broken-promise", Profile::BrokenPromise),
    ("no-graphics", Profile::NoGraphics),
    ("merge-feedback", Profile::MergeFeedback),
    ("queues", Profile::Queues),
    ("no-local-depth", Profile::NoLocalDepth),
];

/// A multiple of which the strides of vertex bindings are where the portability subset is.
pub const STRIDE_ALIGNMENT: u32 = 4;

impl Profile {
    /// The one that the environment names.
    ///
    /// # Errors
    /// The error names the words that the layer plays.
    pub fn chosen() -> Result<Self, String> {
        let word = std::env::var("AFTERLIGHT_PLAYS").unwrap_or_default();
        let names = || PROFILES.map(|(name, _)| name).join(", ");
        let own = PROFILES.into_iter().find(|(name, _)| *name == word).map(|(_, own)| own);
        own.ok_or_else(|| format!("AFTERLIGHT_PLAYS is '{word}', and the layer plays {}", names()))
    }

    pub fn limits(self, real: &vk::PhysicalDeviceLimits) -> vk::PhysicalDeviceLimits {
        let played = match self {
            Self::Portability => limits::metal(*real),
            Self::Least => limits::least(),
            Self::Phone => limits::phone(),
            Self::SmallSharedMemory => limits::small_shared_memory(*real),
            Self::BrokenPromise | Self::NoGraphics | Self::MergeFeedback | Self::Queues | Self::NoLocalDepth => *real,
        };
        limits::within(played, real)
    }

    pub fn properties(self, own: &mut vk::PhysicalDeviceProperties) {
        own.limits = self.limits(&own.limits);
        if self.is_of_vulkan_1_1() {
            own.api_version = own.api_version.min(vk::make_api_version(0, 1, 1, 0xfff));
        }
        if self == Self::Phone {
            own.device_type = vk::PhysicalDeviceType::INTEGRATED_GPU;
        }
    }

    /// Returns the played device's features, as far as the device below has them.
    pub fn features(self, real: &vk::PhysicalDeviceFeatures) -> vk::PhysicalDeviceFeatures {
        let none = vk::PhysicalDeviceFeatures::default();
        match self {
            Self::SmallSharedMemory
            | Self::BrokenPromise
            | Self::NoGraphics
            | Self::MergeFeedback
            | Self::Queues
            | Self::NoLocalDepth => *real,
            // Metal has no geometry shaders, wide lines, logic operations or bounds of depth.
            Self::Portability => vk::PhysicalDeviceFeatures {
                geometry_shader: vk::FALSE,
                wide_lines: vk::FALSE,
                logic_op: vk::FALSE,
                depth_bounds: vk::FALSE,
                shader_cull_distance: vk::FALSE,
                shader_float64: vk::FALSE,
                pipeline_statistics_query: vk::FALSE,
                sparse_binding: vk::FALSE,
                ..*real
            },
            // The one feature that every device has.
            Self::Least => vk::PhysicalDeviceFeatures { robust_buffer_access: real.robust_buffer_access, ..none },
            Self::Phone => vk::PhysicalDeviceFeatures {
                robust_buffer_access: real.robust_buffer_access,
                full_draw_index_uint32: real.full_draw_index_uint32,
                image_cube_array: real.image_cube_array,
                independent_blend: real.independent_blend,
                sample_rate_shading: real.sample_rate_shading,
                sampler_anisotropy: real.sampler_anisotropy,
                texture_compression_etc2: real.texture_compression_etc2,
                fragment_stores_and_atomics: real.fragment_stores_and_atomics,
                draw_indirect_first_instance: real.draw_indirect_first_instance,
                shader_sampled_image_array_dynamic_indexing: real.shader_sampled_image_array_dynamic_indexing,
                ..none
            },
        }
    }

    /// Returns true if it has this extension, which the device below has.
    pub fn keeps(self, extension: &CStr) -> bool {
        match self {
            Self::Portability
            | Self::SmallSharedMemory
            | Self::BrokenPromise
            | Self::NoGraphics
            | Self::MergeFeedback
            | Self::Queues
            | Self::NoLocalDepth => true,
            Self::Least => extension == ash::khr::swapchain::NAME,
            Self::Phone => [ash::khr::swapchain::NAME, ash::khr::driver_properties::NAME].contains(&extension),
        }
    }

    /// Returns true if it does not open with this extension, which it lists.
    pub fn breaks(self, extension: &CStr) -> bool {
        self == Self::BrokenPromise && extension == ash::khr::synchronization2::NAME
    }

    /// Returns true if it has no more of Vulkan than 1.1.
    pub fn is_of_vulkan_1_1(self) -> bool {
        matches!(self, Self::Least | Self::Phone)
    }

    pub fn has_portability_subset(self) -> bool {
        self == Self::Portability
    }

    /// Returns true if its driver tells which subpasses it merges.
    pub fn tells_merging(self) -> bool {
        self == Self::MergeFeedback
    }

    /// Returns true if it has queue families that the device below has not.
    pub fn has_queues(self) -> bool {
        self == Self::Queues
    }

    /// Returns true if depth is no attachment that its draws read locally.
    pub fn reads_no_local_depth(self) -> bool {
        self == Self::NoLocalDepth
    }

    /// The extension that the played device has whatever the one below has. The device below is opened without it.
    pub fn own_extension(self) -> Option<&'static CStr> {
        match self {
            Self::Portability => Some(ash::khr::portability_subset::NAME),
            Self::MergeFeedback => Some(ash::ext::subpass_merge_feedback::NAME),
            _ => None,
        }
    }

    /// The features of optimally tiled images of this format, as far as the device below has them.
    pub fn format(self, format: vk::Format, real: vk::FormatFeatureFlags) -> vk::FormatFeatureFlags {
        match self {
            Self::Least | Self::Phone => real & formats::required(format),
            Self::Portability
            | Self::SmallSharedMemory
            | Self::BrokenPromise
            | Self::NoGraphics
            | Self::MergeFeedback
            | Self::Queues
            | Self::NoLocalDepth => real,
        }
    }

    pub fn queue_family(self, own: &mut vk::QueueFamilyProperties) {
        if self == Self::Least {
            (own.queue_count, own.timestamp_valid_bits) = (own.queue_count.min(1), 0);
        }
        if self == Self::NoGraphics {
            own.queue_flags &= !vk::QueueFlags::GRAPHICS;
        }
    }

    /// Returns true if memory is lazily allocated for attachments that a tile holds.
    pub fn has_lazy_memory(self) -> bool {
        self == Self::Phone
    }
}
