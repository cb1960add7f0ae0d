//! Formats of played devices, and the features that each has.

use ash::vk;
use vk::FormatFeatureFlags as F;

/// Every colour format can be copied from and to (Vulkan 1.1).
const COPIED: F = F::from_raw(F::TRANSFER_SRC.as_raw() | F::TRANSFER_DST.as_raw());
const FETCHED: F = F::from_raw(F::SAMPLED_IMAGE.as_raw() | F::BLIT_SRC.as_raw() | COPIED.as_raw());
const FILTERED: F = F::from_raw(FETCHED.as_raw() | F::SAMPLED_IMAGE_FILTER_LINEAR.as_raw());
const DRAWN: F = F::from_raw(F::COLOR_ATTACHMENT.as_raw() | F::BLIT_DST.as_raw());
const BLENDED: F = F::from_raw(DRAWN.as_raw() | F::COLOR_ATTACHMENT_BLEND.as_raw());
const DEPTH: F = F::from_raw(FETCHED.as_raw() | F::DEPTH_STENCIL_ATTACHMENT.as_raw());

/// Returns the features that Vulkan 1.1 requires of optimally tiled images of a format (specification, "Required Format Support"), none for formats
/// that it does not require. Of D32_SFLOAT and X8_D24_UNORM_PACK32 the specification requires one: it is D32_SFLOAT here.
pub fn required(format: vk::Format) -> F {
    use vk::Format as N;
    match format {
        N::R8G8B8A8_UNORM | N::R16G16B16A16_SFLOAT => FILTERED | BLENDED | F::STORAGE_IMAGE,
        N::R5G6B5_UNORM_PACK16
        | N::A1R5G5B5_UNORM_PACK16
        | N::R8_UNORM
        | N::R8G8_UNORM
        | N::R8G8B8A8_SRGB
        | N::B8G8R8A8_UNORM
        | N::B8G8R8A8_SRGB
        | N::A8B8G8R8_UNORM_PACK32
        | N::A8B8G8R8_SRGB_PACK32
        | N::A2B10G10R10_UNORM_PACK32
        | N::R16_SFLOAT
        | N::R16G16_SFLOAT => FILTERED | BLENDED,
        N::R8G8B8A8_SNORM => FILTERED | F::STORAGE_IMAGE,
        N::R8_SNORM
        | N::R8G8_SNORM
        | N::A8B8G8R8_SNORM_PACK32
        | N::B4G4R4A4_UNORM_PACK16
        | N::B10G11R11_UFLOAT_PACK32
        | N::E5B9G9R9_UFLOAT_PACK32 => FILTERED,
        N::R8_UINT
        | N::R8_SINT
        | N::R8G8_UINT
        | N::R8G8_SINT
        | N::A8B8G8R8_UINT_PACK32
        | N::A8B8G8R8_SINT_PACK32
        | N::A2B10G10R10_UINT_PACK32
        | N::R16_UINT
        | N::R16_SINT
        | N::R16G16_UINT
        | N::R16G16_SINT => FETCHED | DRAWN,
        N::R32_UINT | N::R32_SINT => FETCHED | DRAWN | F::STORAGE_IMAGE | F::STORAGE_IMAGE_ATOMIC,
        N::R8G8B8A8_UINT
        | N::R8G8B8A8_SINT
        | N::R16G16B16A16_UINT
        | N::R16G16B16A16_SINT
        | N::R32_SFLOAT
        | N::R32G32_UINT
        | N::R32G32_SINT
        | N::R32G32_SFLOAT
        | N::R32G32B32A32_UINT
        | N::R32G32B32A32_SINT
        | N::R32G32B32A32_SFLOAT => FETCHED | DRAWN | F::STORAGE_IMAGE,
        N::D16_UNORM | N::D32_SFLOAT | N::D24_UNORM_S8_UINT | N::D32_SFLOAT_S8_UINT => DEPTH,
        _ => F::empty(),
    }
}

/// Returns the features that images of this usage need of their format.
pub fn needed(usage: vk::ImageUsageFlags) -> F {
    [
        (vk::ImageUsageFlags::SAMPLED, F::SAMPLED_IMAGE),
        (vk::ImageUsageFlags::STORAGE, F::STORAGE_IMAGE),
        (vk::ImageUsageFlags::COLOR_ATTACHMENT, F::COLOR_ATTACHMENT),
        (vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, F::DEPTH_STENCIL_ATTACHMENT),
    ]
    .into_iter()
    .filter(|(used, _)| usage.contains(*used))
    .fold(F::empty(), |all, (_, one)| all | one)
}

/// Sample counts that images of this format and usage have by the limits of a device.
pub fn sample_counts(
    limits: &vk::PhysicalDeviceLimits,
    format: vk::Format,
    usage: vk::ImageUsageFlags,
) -> vk::SampleCountFlags {
    use vk::ImageUsageFlags as U;
    let is_depth = required(format).contains(F::DEPTH_STENCIL_ATTACHMENT);
    let [drawn, sampled] = match is_depth {
        true => [limits.framebuffer_depth_sample_counts, limits.sampled_image_depth_sample_counts],
        false => [limits.framebuffer_color_sample_counts, limits.sampled_image_color_sample_counts],
    };
    let mut counts = vk::SampleCountFlags::from_raw(0x7f);
    if usage.intersects(U::COLOR_ATTACHMENT | U::DEPTH_STENCIL_ATTACHMENT | U::INPUT_ATTACHMENT) {
        counts &= drawn;
    }
    if usage.contains(U::SAMPLED) {
        counts &= sampled;
    }
    if usage.contains(U::STORAGE) {
        counts &= limits.storage_image_sample_counts;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_device_needs_to_blend_floats_of_32_bits_or_to_draw_to_16_bits_of_unorm() {
        assert!(!required(vk::Format::R32G32B32A32_SFLOAT).contains(F::COLOR_ATTACHMENT_BLEND));
        assert!(required(vk::Format::R32G32B32A32_SFLOAT).contains(F::COLOR_ATTACHMENT));
        assert!(required(vk::Format::R16G16B16A16_SFLOAT).contains(F::COLOR_ATTACHMENT_BLEND));
        assert!(required(vk::Format::R16G16_UNORM).is_empty());
        assert!(!required(vk::Format::B10G11R11_UFLOAT_PACK32).contains(F::COLOR_ATTACHMENT));
    }
}
