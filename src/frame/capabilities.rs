//! The capabilities of a device that plans depend on.

use ash::vk;

#[cfg(feature = "caches")]
use super::calibration::Calibration;
use crate::gpu::{Lack, PhysicalDevice, Queue};
use crate::plan::{Capabilities, CostModel, texture_format};
use crate::scene::{BlockFormat, ColorSpace};

/// Returns the capabilities of a device that plans depend on.
pub fn capabilities(device: &PhysicalDevice) -> Capabilities {
    let limits = &device.limits;
    let read = vk::ImageUsageFlags::INPUT_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
    let sampled_msaa = msaa(device, read)
        & limits.sampled_image_color_sample_counts.as_raw()
        & limits.sampled_image_depth_sample_counts.as_raw();
    let numbers = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
    let numbered_msaa = sampled_msaa
        & limits.sampled_image_integer_sample_counts.as_raw()
        & sample_counts(device, vk::Format::R32_UINT, numbers);
    Capabilities {
        max_extent: limits
            .max_image_dimension2_d
            .min(limits.max_framebuffer_width)
            .min(limits.max_framebuffer_height)
            .min(limits.max_viewport_dimensions[0])
            .min(limits.max_viewport_dimensions[1]),
        max_layers: limits.max_image_array_layers,
        depth_clamp: device.features.depth_clamp == vk::TRUE,
        max_color_attachments: limits.max_color_attachments.min(limits.max_fragment_output_attachments),
        max_input_attachments: limits
            .max_per_stage_descriptor_input_attachments
            .min(limits.max_descriptor_set_input_attachments),
        unorm_2x16_attachment: device.supports_color_attachment(vk::Format::R16G16_UNORM, false),
        packed_float_blends: device.supports_color_attachment(vk::Format::B10G11R11_UFLOAT_PACK32, true),
        float32_blends: [vk::Format::R32G32B32A32_SFLOAT, vk::Format::R32_SFLOAT]
            .into_iter()
            .all(|format| device.supports_color_attachment(format, true)),
        msaa: msaa(device, vk::ImageUsageFlags::INPUT_ATTACHMENT),
        sampled_msaa,
        numbered_msaa,
        anisotropy: anisotropy(device),
        slow_anisotropy: has_slow_anisotropy(&device.driver_name, &device.driver_info),
        reads_pushed_places_once: reads_pushed_places_once(&device.driver_name, &device.driver_info),
        primitive_index: device.features.geometry_shader == vk::TRUE,
        non_uniform_textures: match device.non_uniform_textures {
            // SwiftShader says that it can, then warns of the capability as unsupported, and samples other textures.
            true if device.driver_name.contains("SwiftShader") => 0,
            true => limits
                .max_per_stage_descriptor_sampled_images
                .min(limits.max_descriptor_set_sampled_images)
                // This limit counts resources of all kinds, of which fewer than 48 are no textures.
                .min(limits.max_per_stage_resources.saturating_sub(48)),
            false => 0,
        },
        sampled_images: limits.max_per_stage_descriptor_sampled_images.min(limits.max_descriptor_set_sampled_images),
        storage_buffers: limits.max_per_stage_descriptor_storage_buffers.min(limits.max_descriptor_set_storage_buffers),
        fragment_resources: limits.max_fragment_combined_output_resources,
        storage_range: limits.max_storage_buffer_range,
        lazily_allocated: device.has_lazily_allocated_memory(),
        compute_invocations: limits.max_compute_work_group_invocations.min(limits.max_compute_work_group_size[0]),
        shared_memory: limits.max_compute_shared_memory_size,
        indirect_draws: device.features.multi_draw_indirect == vk::TRUE
            && device.features.draw_indirect_first_instance == vk::TRUE
            && limits.max_draw_indirect_count >= 65536
            && limits.max_compute_work_group_invocations >= 128,
        software: device.kind == vk::PhysicalDeviceType::CPU,
        costs: costs(device),
        synchronization2: device.newer.synchronization2,
        // Draws of one rendering have all of its colour attachments, and each blends as its own pass has it.
        local_read: device.newer.local_read.and(match device.features.independent_blend {
            vk::TRUE => Ok(()),
            _ => Err(Lack::Feature("independentBlend")),
        }),
        local_read_depth: device.newer.local_read_depth,
        local_read_samples: device.newer.local_read_samples,
        unified_layouts: device.newer.unified_layouts,
        compute_queue: device.queue_support(Queue::Compute),
        transfer_queue: device.queue_support(Queue::Transfer),
        bc7: device.features.texture_compression_bc == vk::TRUE && samples(device, BlockFormat::Bc7),
        etc2: device.features.texture_compression_etc2 == vk::TRUE
            && [BlockFormat::Etc2Rgb8, BlockFormat::Etc2Rgb8A1, BlockFormat::Etc2Rgba8]
                .into_iter()
                .all(|format| samples(device, format)),
    }
}

/// Returns the device's own figures if an earlier run kept some, or else the figures of its kind.
fn costs(device: &PhysicalDevice) -> CostModel {
    let software = device.kind == vk::PhysicalDeviceType::CPU;
    #[cfg(feature = "caches")]
    if let Some(kept) = Calibration::of(device) {
        return kept.costs(software);
    }
    CostModel::of_kind(software)
}

/// Returns true if textures in these blocks can be uploaded and filtered.
fn samples(device: &PhysicalDevice, format: BlockFormat) -> bool {
    let needed = vk::FormatFeatureFlags::SAMPLED_IMAGE
        | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR
        | vk::FormatFeatureFlags::TRANSFER_DST;
    [ColorSpace::Srgb, ColorSpace::Linear]
        .into_iter()
        .all(|space| device.format_features(texture_format(Some(format), space)).contains(needed))
}

/// Maximum anisotropy of the device's samplers.
fn anisotropy(device: &PhysicalDevice) -> u32 {
    match device.features.sampler_anisotropy {
        vk::TRUE => device.limits.max_sampler_anisotropy as u32,
        _ => 1,
    }
}

/// Tells a driver whose anisotropic samplers go through every texel that a pixel covers. Lavapipe's do before Mesa 25; since then they filter from places along
/// the pixel's long side.
fn has_slow_anisotropy(driver_name: &str, driver_info: &str) -> bool {
    lavapipe_of_mesa(driver_name, driver_info).is_some_and(|major| major < 25)
}

/// Returns true for a driver whose compiler knows that push constants are uniform: it reads a buffer element that a push constant selects once for a
/// vector of eight pixels. Lavapipe's compiler before Mesa 25 reads push constants like any buffer, and gathers in both cases.
fn reads_pushed_places_once(driver_name: &str, driver_info: &str) -> bool {
    lavapipe_of_mesa(driver_name, driver_info).is_some_and(|major| major >= 25)
}

/// Mesa's major version, if the driver is lavapipe.
fn lavapipe_of_mesa(driver_name: &str, driver_info: &str) -> Option<u32> {
    let version = driver_info.strip_prefix("Mesa ").filter(|_| driver_name == "llvmpipe")?;
    version.split('.').next()?.parse().ok()
}

/// The sample counts that the device supports for every attachment format, with attachments read as `read` says. More than one sample requires sample
/// shading, and the standard sample locations of `shaders/shared/multisampling.wgsl`.
fn msaa(device: &PhysicalDevice, read: vk::ImageUsageFlags) -> u32 {
    let features = device.features.sample_rate_shading == vk::TRUE;
    if !features || device.limits.standard_sample_locations == vk::FALSE {
        return 1;
    }
    let color = vk::ImageUsageFlags::COLOR_ATTACHMENT | read;
    let depth = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | read;
    let mut counts = device.attachment_samples();
    for (format, usage) in [
        (vk::Format::D32_SFLOAT, depth),
        (vk::Format::R8G8B8A8_SRGB, color),
        (vk::Format::R8G8B8A8_UNORM, color),
        (vk::Format::R8G8_UNORM, color),
        (vk::Format::R8_UNORM, color),
        (vk::Format::R16G16_UNORM, color),
        (vk::Format::A2B10G10R10_UNORM_PACK32, color),
        (vk::Format::R16G16B16A16_SFLOAT, color),
        (vk::Format::B10G11R11_UFLOAT_PACK32, color),
        (vk::Format::R32G32B32A32_SFLOAT, color),
        (vk::Format::R16_SFLOAT, color),
        (vk::Format::R16G16_SFLOAT, color),
        (vk::Format::R32G32_SFLOAT, color),
        (vk::Format::R32_SFLOAT, color),
    ] {
        counts &= vk::SampleCountFlags::from_raw(sample_counts(device, format, usage));
    }
    counts.as_raw()
}

/// The sample counts of a format that is used so. They are all counts where the device does not have the format: then nobody chooses it.
fn sample_counts(device: &PhysicalDevice, format: vk::Format, usage: vk::ImageUsageFlags) -> u32 {
    let limits = device.image_limits(format, usage, vk::ImageCreateFlags::empty());
    limits.ok().flatten().map_or(u32::MAX, |limits| limits.sample_counts.as_raw())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lavapipe_filters_slowly_before_mesa_25() {
        let slow = |info: &str| has_slow_anisotropy("llvmpipe", info);
        assert!(slow("Mesa 22.3.6 (LLVM 15.0.6)") && slow("Mesa 24.2.8-1ubuntu1 (LLVM 17.0.6)"));
        assert!(!slow("Mesa 25.0.7-2+deb13u1 (LLVM 19.1.7)") && !slow("Mesa 26.1.0-devel (git-0123)"));
        assert!(!slow("") && !slow("LLVM 10") && !has_slow_anisotropy("radv", "Mesa 22.3.6"));
    }

    #[test]
    fn lavapipe_reads_pushed_places_once_since_mesa_25() {
        let once = |info: &str| reads_pushed_places_once("llvmpipe", info);
        assert!(once("Mesa 25.0.7-2+deb13u1 (LLVM 19.1.7)") && once("Mesa 26.1.0-devel (git-0123)"));
        assert!(!once("Mesa 22.3.6 (LLVM 15.0.6)") && !once("") && !reads_pushed_places_once("radv", "Mesa 25.0.7"));
    }
}
