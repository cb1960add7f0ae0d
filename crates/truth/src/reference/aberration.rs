//! Chromatic aberration: the place of the picture where a simple lens shows each colour of a pixel.

use glam::{DVec2, DVec3, UVec2};

/// The colour that is seen at a place, in pixels from the top left of a picture of this size: red comes from farther in, as its picture is larger by this share, and
/// blue from farther out. `picture` has the light of each place.
pub fn seen(picture: impl Fn(DVec2) -> DVec3, place: DVec2, size: [u32; 2], share: f64) -> DVec3 {
    if share == 0.0 {
        return picture(place);
    }
    let middle = UVec2::from(size).as_dvec2() / 2.0;
    let scaled = |scale: f64| picture(middle + (place - middle) * scale);
    DVec3::new(scaled(1.0 - share).x, picture(place).y, scaled(1.0 + share).z)
}

/// A picture of linear light with its colours apart. Between the middles of pixels it is linear, and beyond its border lies the border.
pub fn apart(pixels: &[DVec3], size: [u32; 2], share: f64) -> Vec<DVec3> {
    if share == 0.0 {
        return pixels.to_vec();
    }
    let last = UVec2::from(size).as_dvec2() - 1.0;
    let pixel = |place: DVec2| {
        let place = place.clamp(DVec2::ZERO, last).as_uvec2();
        pixels[(place.y * size[0] + place.x) as usize]
    };
    let between = |place: DVec2| {
        let low = (place - 0.5).floor();
        let part = place - 0.5 - low;
        let row = |y: f64| pixel(DVec2::new(low.x, y)).lerp(pixel(DVec2::new(low.x + 1.0, y)), part.x);
        row(low.y).lerp(row(low.y + 1.0), part.y)
    };
    let middles = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| UVec2::new(x, y).as_dvec2() + 0.5));
    middles.map(|place| seen(between, place, size, share)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_white_line_has_red_on_its_far_side_and_blue_on_its_near_one() {
        let size = [101, 1];
        let line: Vec<DVec3> = (0..101).map(|x| if x == 90 { DVec3::ONE } else { DVec3::ZERO }).collect();
        let apart = apart(&line, size, 0.05);
        let brightest = |channel: usize| (0..101).max_by(|a, b| apart[*a][channel].total_cmp(&apart[*b][channel]));
        // Forty pixels from the middle: two farther out, and two farther in.
        assert_eq!([0, 1, 2].map(brightest), [Some(92), Some(90), Some(88)]);
    }
}
