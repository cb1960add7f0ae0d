//! Formats that a surface offers through this layer.

use ash::vk;

/// The colour space that displays show unless they are told otherwise.
const SRGB: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;
/// SMPTE ST 2084 of nits with the primaries of ITU-R BT.2020.
const HDR10: vk::ColorSpaceKHR = vk::ColorSpaceKHR::HDR10_ST2084_EXT;

const OF_10_BITS: [vk::Format; 2] = [vk::Format::A2R10G10B10_UNORM_PACK32, vk::Format::A2B10G10R10_UNORM_PACK32];

/// Returns the offered formats, and then each of 10 bits in the colour space of HDR10 as well.
pub fn with_hdr10(mut offered: Vec<vk::SurfaceFormatKHR>) -> Vec<vk::SurfaceFormatKHR> {
    let deep = |one: &&vk::SurfaceFormatKHR| OF_10_BITS.contains(&one.format) && one.color_space == SRGB;
    let bright = |one: &vk::SurfaceFormatKHR| vk::SurfaceFormatKHR { color_space: HDR10, ..*one };
    let added: Vec<_> = offered.iter().filter(deep).map(bright).filter(|one| !offered.contains(one)).collect();
    offered.extend(added);
    offered
}

/// Returns the colour space that the driver gets for images: sRGB for HDR10, which only the layer offers and which has the same bits.
pub fn for_driver(color_space: vk::ColorSpaceKHR) -> vk::ColorSpaceKHR {
    if color_space == HDR10 { SRGB } else { color_space }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offer(format: vk::Format, color_space: vk::ColorSpaceKHR) -> vk::SurfaceFormatKHR {
        vk::SurfaceFormatKHR { format, color_space }
    }

    #[test]
    fn each_format_of_10_bits_is_offered_as_hdr10_once() {
        let [red_first, blue_first] = OF_10_BITS.map(|format| offer(format, SRGB));
        let bytes = offer(vk::Format::B8G8R8A8_SRGB, SRGB);
        let wide = offer(blue_first.format, vk::ColorSpaceKHR::DISPLAY_P3_NONLINEAR_EXT);
        // The types of Vulkan print nothing of themselves here.
        assert!(with_hdr10(vec![bytes, wide]) == [bytes, wide]);
        let [red_bright, blue_bright] = OF_10_BITS.map(|format| offer(format, HDR10));
        let all = with_hdr10(vec![blue_first, bytes, red_first]);
        assert!(all == [blue_first, bytes, red_first, blue_bright, red_bright]);
        assert!(with_hdr10(all.clone()) == all);
    }

    #[test]
    fn drivers_are_told_of_no_colour_space_that_they_do_not_offer() {
        let linear = vk::ColorSpaceKHR::BT709_LINEAR_EXT;
        assert!([HDR10, SRGB, linear].map(for_driver) == [SRGB, SRGB, linear]);
    }
}
