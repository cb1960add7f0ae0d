//! Normal maps: telling them from height maps, making them of these, and finding out which way their green points.

use glam::Vec3;
use image::{Rgba, RgbaImage};

/// The depth, in texels, of a height map of `-bm 1` from black to white.
const HEIGHT_IN_TEXELS: f32 = 8.0;

/// Mean [`downwardness`] of a model's maps above which their green is taken to point down.
pub(super) const CLEARLY_DOWN: f32 = 0.2;

fn decode(texel: &Rgba<u8>) -> Vec3 {
    let [x, y, z, _] = texel.0;
    let axis = |code: u8| (f32::from(code) - 128.0) / 127.0;
    Vec3::new(axis(x), axis(y), axis(z))
}

fn is_unit(normal: Vec3) -> bool {
    normal.z > 0.0 && (normal.length() - 1.0).abs() < 0.25
}

/// Returns true if an image holds tangent-space normals: bluish all over, and its texels decode to unit vectors. Black ones do not
/// count: baking leaves them where no surface is.
pub(super) fn looks_like_normals(image: &RgbaImage) -> bool {
    let stride = (image.pixels().len() / 65_536).max(1);
    let (mut sum, mut unit, mut count) = (Vec3::ZERO, 0_u32, 0_u32);
    let painted = image.pixels().step_by(stride).filter(|texel| texel.0[..3].iter().any(|&value| value > 16));
    for texel in painted {
        let normal = decode(texel);
        unit += u32::from(is_unit(normal));
        sum += normal;
        count += 1;
    }
    let mean = sum / count.max(1) as f32;
    mean.z - mean.x.max(mean.y) > 0.2 && unit as f32 > 0.6 * count as f32
}

/// Heights from 0 to 1, rows from the top.
pub(super) struct Heights {
    pub size: (u32, u32),
    pub values: Vec<f32>,
}

/// Tangent-space normals, +Y up, of a repeating height field (Sobel's gradient).
pub(super) fn normals_of_heights(heights: &Heights, bump_scale: f32) -> RgbaImage {
    let (width, height) = heights.size;
    let at = |x: u32, y: u32| heights.values[(y % height) as usize * width as usize + (x % width) as usize];
    let strength = HEIGHT_IN_TEXELS * bump_scale / 8.0;
    RgbaImage::from_fn(width, height, |x, y| {
        let (left, right, above, below) = (x + width - 1, x + 1, y + height - 1, y + 1);
        let column = |x: u32| at(x, above) + 2.0 * at(x, y) + at(x, below);
        let row = |y: u32| at(left, y) + 2.0 * at(x, y) + at(right, y);
        let normal = Vec3::new(column(left) - column(right), row(below) - row(above), 0.0) * strength;
        let [x, y, z] = (normal + Vec3::Z).normalize().to_array().map(|n| (n * 127.0).round() as i32 + 128);
        Rgba([x as u8, y as u8, z as u8, 255])
    })
}

/// Evidence that a map's +Y points to the image's bottom, as DirectX has it: above zero if so, below if it points to the top.
///
/// A surface's slopes are the gradient of its heights, and a gradient has no curl. So the curl that the slopes have if green
/// is taken to point up is compared with the curl that they have if it points down: the logarithm of the ratio of their squares' sums.
pub(super) fn downwardness(image: &RgbaImage) -> f32 {
    let (width, height) = image.dimensions();
    let slope = |texel: &Rgba<u8>| {
        let normal = decode(texel);
        // Steeper than 80 degrees, 8 bits say nothing any more.
        (is_unit(normal) && normal.z > 0.17).then(|| (normal.x / normal.z, normal.y / normal.z))
    };
    let row =
        |y: u32| -> Vec<Option<(f32, f32)>> { (0..width).map(|x| slope(image.get_pixel(x, y % height))).collect() };
    let (mut up, mut down) = (0.0_f64, 0.0_f64);
    // Each row is read once, and stays while its neighbours are looked at.
    let mut rows = [row(0), row(1), row(2)];
    for y in 0..height {
        if y > 0 {
            rows.rotate_left(1);
            rows[2] = row(y + 2);
        }
        let [row_above, between, row_below] = &rows;
        for x in 0..width as usize {
            let (before, after) =
                (between[x.checked_sub(1).unwrap_or(between.len() - 1)], between[(x + 1) % between.len()]);
            let (Some(above), Some(below), Some(left), Some(right)) = (row_above[x], row_below[x], before, after)
            else {
                continue;
            };
            let (across, along) = (f64::from(below.0 - above.0), f64::from(right.1 - left.1));
            up += (across + along).powi(2);
            down += (across - along).powi(2);
        }
    }
    // A flat map says nothing; the constant keeps it at zero.
    ((up + 1.0) / (down + 1.0)).ln() as f32
}

/// Turns +Y over; (128, 128, 255) stays the same.
pub(super) fn turn_green_over(texels: &mut [u8]) {
    for texel in texels.as_chunks_mut::<4>().0 {
        texel[1] = (256 - u16::from(texel[1])).min(255) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights in codes of 8 bits.
    fn field(size: u32, code: impl Fn(u32, u32) -> u8) -> Heights {
        let values = (0..size * size).map(|at| f32::from(code(at % size, at / size)) / 255.0).collect();
        Heights { size: (size, size), values }
    }

    /// Rolling hills, whose slopes along X change along Y.
    fn heights() -> Heights {
        let wave =
            |x: u32, y: u32| (x as f32 * 0.4).sin() * (y as f32 * 0.3).cos() + (x as f32 * 0.1 + y as f32 * 0.2).sin();
        field(64, |x, y| (128.0 + 50.0 * wave(x, y)) as u8)
    }

    #[test]
    fn heights_become_normals_that_lean_downhill() {
        let ramp = field(8, |x, y| (x * 10 + y * 5) as u8);
        let normals = normals_of_heights(&ramp, 1.0);
        let normal = decode(normals.get_pixel(3, 3));
        // Uphill is right and down, so the normal leans left and up.
        assert!(normal.x < -0.1 && normal.y > 0.1 && normal.z > 0.9, "{normal}");
        let flat = normals_of_heights(&field(4, |_, _| 0), 1.0);
        assert!(flat.pixels().all(|texel| texel.0 == [128, 128, 255, 255]));
        let inverted = decode(normals_of_heights(&ramp, -1.0).get_pixel(3, 3));
        assert!((inverted.x + normal.x).abs() < 0.01 && (inverted.y + normal.y).abs() < 0.01);
    }

    #[test]
    fn normal_maps_are_told_from_other_pictures() {
        let heights = heights();
        let mut normals = normals_of_heights(&heights, 1.0);
        assert!(looks_like_normals(&normals));
        (0..64 * 48).for_each(|i| normals.put_pixel(i % 64, i / 64, Rgba([0, 0, 0, 255])));
        assert!(looks_like_normals(&normals), "mostly unused");
        for color in [[255, 255, 255, 255], [200, 200, 200, 255], [60, 90, 160, 255], [0, 0, 0, 255]] {
            assert!(!looks_like_normals(&RgbaImage::from_pixel(4, 4, Rgba(color))), "{color:?}");
        }
    }

    #[test]
    fn the_direction_of_green_is_found_and_turned() {
        let mut normals = normals_of_heights(&heights(), 2.0);
        let up = downwardness(&normals);
        turn_green_over(&mut normals);
        let down = downwardness(&normals);
        assert!(up < -1.0 && down > 1.0, "{up} {down}");
        assert_eq!(downwardness(&RgbaImage::from_pixel(8, 8, Rgba([128, 128, 255, 255]))), 0.0);
        let mut neutral = [128, 128, 255, 255, 0, 0, 0, 7];
        turn_green_over(&mut neutral);
        assert_eq!(neutral, [128, 128, 255, 255, 0, 255, 0, 7]);
    }
}
