//! What a surface is said to offer, and how a list of it is told.

use ash::vk;

/// What displays show unless they are told otherwise.
const SRGB: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;
/// SMPTE ST 2084 of nits with the primaries of ITU-R BT.2020.
const HDR10: vk::ColorSpaceKHR = vk::ColorSpaceKHR::HDR10_ST2084_EXT;

const OF_10_BITS: [vk::Format; 2] = [vk::Format::A2R10G10B10_UNORM_PACK32, vk::Format::A2B10G10R10_UNORM_PACK32];

/// What is offered, and then each format of 10 bits in the colour space of HDR10 as well.
pub fn with_hdr10(mut offered: Vec<vk::SurfaceFormatKHR>) -> Vec<vk::SurfaceFormatKHR> {
    let deep = |one: &&vk::SurfaceFormatKHR| OF_10_BITS.contains(&one.format) && one.color_space == SRGB;
    let bright = |one: &vk::SurfaceFormatKHR| vk::SurfaceFormatKHR { color_space: HDR10, ..*one };
    let added: Vec<_> = offered.iter().filter(deep).map(bright).filter(|one| !offered.contains(one)).collect();
    offered.extend(added);
    offered
}

/// What a driver is to take images for that a program has asked for: of HDR10, which only the layer offers, for those of the same bits.
pub fn for_driver(color_space: vk::ColorSpaceKHR) -> vk::ColorSpaceKHR {
    if color_space == HDR10 { SRGB } else { color_space }
}

/// Tells a list as Vulkan's functions do: without a place for it how long it is, else as much of it as there is place for.
///
/// # Safety
/// `count` points to a number, and `place` is null or points to so many elements; nobody else uses them meanwhile.
pub unsafe fn tell<T: Copy>(list: &[T], count: *mut u32, place: *mut T) -> vk::Result {
    let length = u32::try_from(list.len()).unwrap_or(u32::MAX);
    if place.is_null() {
        // SAFETY: the caller's promise.
        unsafe { count.write(length) };
        return vk::Result::SUCCESS;
    }
    // SAFETY: the caller's promise.
    let told = length.min(unsafe { count.read() });
    // SAFETY: the list has so many, and so has the place; one is this layer's own, the other is not.
    unsafe { place.copy_from_nonoverlapping(list.as_ptr(), told as usize) };
    // SAFETY: as above.
    unsafe { count.write(told) };
    if told < length { vk::Result::INCOMPLETE } else { vk::Result::SUCCESS }
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

    #[test]
    fn a_list_is_counted_then_told_and_cut_where_the_place_ends() {
        let list = [7, 8, 9];
        let told = |mut count: u32, place: Option<&mut [i32; 4]>| {
            let place = place.map_or(std::ptr::null_mut(), |place| place.as_mut_ptr());
            // SAFETY: no test gives a count beyond the four places.
            let result = unsafe { tell(&list, &raw mut count, place) };
            (result, count)
        };
        assert_eq!(told(99, None), (vk::Result::SUCCESS, 3));
        for (count, result, expected) in [
            (0, vk::Result::INCOMPLETE, [0; 4]),
            (2, vk::Result::INCOMPLETE, [7, 8, 0, 0]),
            (3, vk::Result::SUCCESS, [7, 8, 9, 0]),
            (4, vk::Result::SUCCESS, [7, 8, 9, 0]),
        ] {
            let mut place = [0; 4];
            assert_eq!(told(count, Some(&mut place)), (result, count.min(3)));
            assert_eq!(place, expected);
        }
    }
}
