//! The formats of a window's images, chosen from the formats that a surface offers.

use ash::vk;

use super::device::Device;
use super::error::{Error, Result};
use super::surface::Surface;

/// The images that are wanted of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageWish {
    /// True if the passes draw linear values and the hardware encodes them; else the values are encoded already.
    pub encodes: bool,
    /// Brightness beyond white, where the surface has it: HDR.
    pub hdr: bool,
    /// A shader encodes the values, even where the hardware could.
    pub by_shader: bool,
}

/// The formats of a swapchain's images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageFormats {
    /// The format for presentation.
    pub own: vk::Format,
    /// The format for the passes that draw: the same bytes.
    pub drawn: vk::Format,
    /// The meaning of their values for presentation.
    pub color_space: vk::ColorSpaceKHR,
    /// True if a shader must encode the values. Else the images take them as wished for.
    pub by_shader: bool,
}

/// The colour space of displays, unless they are told otherwise.
const SRGB: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;

/// 8 bits a channel, the second of each pair encoded by the hardware.
const OF_8_BITS: [[vk::Format; 2]; 3] = [
    [vk::Format::B8G8R8A8_UNORM, vk::Format::B8G8R8A8_SRGB],
    [vk::Format::R8G8B8A8_UNORM, vk::Format::R8G8B8A8_SRGB],
    [vk::Format::A8B8G8R8_UNORM_PACK32, vk::Format::A8B8G8R8_SRGB_PACK32],
];

/// No hardware encodes these.
const OF_MORE_BITS: [vk::Format; 4] = [
    vk::Format::A2B10G10R10_UNORM_PACK32,
    vk::Format::A2R10G10B10_UNORM_PACK32,
    vk::Format::R16G16B16A16_UNORM,
    vk::Format::R16G16B16A16_SFLOAT,
];

/// Brightness beyond white. The first two tell it in nits on every display. In the third 1 is 80 nits; on Apple's systems it would be the
/// display's own white, which nothing tells, and so it is not taken there.
const OF_HDR: [(vk::Format, vk::ColorSpaceKHR); 3] = [
    (vk::Format::A2B10G10R10_UNORM_PACK32, vk::ColorSpaceKHR::HDR10_ST2084_EXT),
    (vk::Format::A2R10G10B10_UNORM_PACK32, vk::ColorSpaceKHR::HDR10_ST2084_EXT),
    (vk::Format::R16G16B16A16_SFLOAT, vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT),
];

/// The formats that a swapchain of this surface would have.
///
/// # Errors
/// [`Error::Unsupported`] if the surface offers no usable format; the driver's errors.
pub fn image_formats(device: &Device, surface: &Surface, wish: ImageWish) -> Result<ImageFormats> {
    let offered = surface.formats(device)?;
    choose_formats(&offered, wish, device.features.mutable_swapchains)
        .ok_or_else(|| Error::Unsupported(no_format(&device.physical.name, &offered)))
}

/// The first of these that the surface offers: HDR, where that is wished for; images that take values as drawn; plain ones for values that are to be
/// encoded, drawn through views that encode (`mutable` images); and images for a shader to encode.
fn choose_formats(offered: &[vk::SurfaceFormatKHR], wish: ImageWish, mutable: bool) -> Option<ImageFormats> {
    let is_offered = |format, color_space| offered.contains(&vk::SurfaceFormatKHR { format, color_space });
    let one = |own, color_space, by_shader| ImageFormats { own, drawn: own, color_space, by_shader };
    let tells_nits = |space| space == vk::ColorSpaceKHR::HDR10_ST2084_EXT || !cfg!(target_vendor = "apple");
    let bright = OF_HDR.into_iter().find(|&(format, space)| wish.hdr && tells_nits(space) && is_offered(format, space));
    if let Some((format, space)) = bright {
        return Some(one(format, space, true));
    }
    if !wish.by_shader {
        let same = OF_8_BITS.map(|pair| pair[usize::from(wish.encodes)]).into_iter().find(|&one| is_offered(one, SRGB));
        if let Some(format) = same {
            return Some(one(format, SRGB, false));
        }
        let through = OF_8_BITS.into_iter().find(|&[plain, _]| wish.encodes && mutable && is_offered(plain, SRGB));
        if let Some([own, drawn]) = through {
            return Some(ImageFormats { own, drawn, color_space: SRGB, by_shader: false });
        }
    }
    let plain = OF_MORE_BITS.into_iter().chain(OF_8_BITS.map(|[plain, _]| plain));
    plain.into_iter().find(|&format| is_offered(format, SRGB)).map(|format| one(format, SRGB, true))
}

fn no_format(device: &str, offered: &[vk::SurfaceFormatKHR]) -> String {
    let offered: Vec<String> = offered.iter().map(|own| format!("{:?} ({:?})", own.format, own.color_space)).collect();
    let offered = if offered.is_empty() { "none at all".to_owned() } else { format!("only {}", offered.join(", ")) };
    format!("'{device}' offers no images for this window that its pictures fit into, {offered}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENCODED: ImageWish = ImageWish { encodes: true, hdr: false, by_shader: false };
    const PLAIN: ImageWish = ImageWish { encodes: false, ..ENCODED };

    fn offer(format: vk::Format, color_space: vk::ColorSpaceKHR) -> vk::SurfaceFormatKHR {
        vk::SurfaceFormatKHR { format, color_space }
    }

    fn same(own: vk::SurfaceFormatKHR, by_shader: bool) -> Option<ImageFormats> {
        Some(ImageFormats { own: own.format, drawn: own.format, color_space: own.color_space, by_shader })
    }

    #[test]
    fn hardware_encodes_where_it_can_in_the_colour_space_of_displays() {
        let plain = offer(vk::Format::B8G8R8A8_UNORM, SRGB);
        let encoding = offer(vk::Format::R8G8B8A8_SRGB, SRGB);
        let other = offer(vk::Format::B8G8R8A8_SRGB, vk::ColorSpaceKHR::DISPLAY_P3_NONLINEAR_EXT);
        let deep = offer(vk::Format::A2B10G10R10_UNORM_PACK32, SRGB);
        let offered = [other, plain, encoding, deep];
        for mutable in [false, true] {
            assert_eq!(choose_formats(&offered, ENCODED, mutable), same(encoding, false));
            assert_eq!(choose_formats(&offered, PLAIN, mutable), same(plain, false));
            assert_eq!(choose_formats(&offered[..1], ENCODED, mutable), None);
        }
        let through =
            ImageFormats { own: plain.format, drawn: vk::Format::B8G8R8A8_SRGB, color_space: SRGB, by_shader: false };
        assert_eq!(choose_formats(&offered[..2], ENCODED, true), Some(through));
    }

    #[test]
    fn a_shader_encodes_for_images_that_no_hardware_encodes() {
        let plain = offer(vk::Format::B8G8R8A8_UNORM, SRGB);
        let [deep, deeper] =
            [vk::Format::A2R10G10B10_UNORM_PACK32, vk::Format::R16G16B16A16_UNORM].map(|format| offer(format, SRGB));
        assert_eq!(choose_formats(&[plain], ENCODED, false), same(plain, true), "images of one format only");
        for wish in [ENCODED, PLAIN] {
            assert_eq!(choose_formats(&[deeper, deep], wish, true), same(deep, true));
            let by_shader = ImageWish { by_shader: true, ..wish };
            assert_eq!(choose_formats(&[plain], by_shader, true), same(plain, true), "whatever the hardware can");
        }
    }

    #[test]
    fn brightness_beyond_white_is_taken_where_it_is_wished_for_and_nits_before_what_is_relative() {
        let plain = offer(vk::Format::B8G8R8A8_SRGB, SRGB);
        let linear = offer(vk::Format::R16G16B16A16_SFLOAT, vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT);
        let pq = offer(vk::Format::A2R10G10B10_UNORM_PACK32, vk::ColorSpaceKHR::HDR10_ST2084_EXT);
        // 10 bits are no brightness.
        let deep = offer(vk::Format::A2R10G10B10_UNORM_PACK32, SRGB);
        let offered = [plain, deep, linear, pq];
        let bright = ImageWish { hdr: true, ..ENCODED };
        for (count, expected) in [(2, same(plain, false)), (3, same(linear, true)), (4, same(pq, true))] {
            assert_eq!(choose_formats(&offered[..count], bright, true), expected);
            assert_eq!(choose_formats(&offered[..count], ENCODED, true), same(plain, false));
        }
    }
}
