//! Textures out of formulas: a function of (u, v) gives colour, height, roughness and metalness; a texture repeats seamlessly if its
//! function does.

use rayon::prelude::*;

use crate::{ColorSpace, Texture};

/// A painted surface at one point.
#[derive(Clone, Copy)]
pub(super) struct Texel {
    /// sRGB-encoded, 0 to 1: painted as seen.
    pub color: [f32; 3],
    pub alpha: f32,
    /// Height in widths of the image.
    pub height: f32,
    pub roughness: f32,
    pub metallic: f32,
}

impl Texel {
    pub fn new(color: [f32; 3], height: f32, roughness: f32) -> Self {
        Self { color, alpha: 1.0, height, roughness, metallic: 0.0 }
    }
}

/// The three images of a painted surface.
pub(super) struct Painted {
    pub color: Texture,
    pub normal: Texture,
    pub surface: Texture,
}

/// Paints a square image of `edge` texels, with its smaller levels; (0, 0) is its upper left corner.
pub(super) fn paint(name: &str, edge: usize, at: impl Fn(f32, f32) -> Texel + Sync) -> Painted {
    let sample = |index: usize| {
        let place = |i: usize| (i as f32 + 0.5) / edge as f32;
        at(place(index % edge), place(index / edge))
    };
    let texels: Vec<Texel> = (0..edge * edge).into_par_iter().map(sample).collect();
    let color = texels.iter().flat_map(|t| [t.color[0], t.color[1], t.color[2], t.alpha].map(unorm)).collect();
    let surface = texels.iter().flat_map(|t| [255, unorm(t.roughness), unorm(t.metallic), 255]).collect();
    let height = |x: usize, y: usize| texels[(y % edge) * edge + x % edge].height * edge as f32;
    let normal = (0..edge * edge).flat_map(|index| {
        let (x, y) = (index % edge + edge, index / edge + edge);
        // Central differences; V runs down while the normal's Y points to the image's top.
        let slope_x = (height(x + 1, y) - height(x - 1, y)) * 0.5;
        let slope_y = (height(x, y + 1) - height(x, y - 1)) * 0.5;
        let length = (slope_x * slope_x + slope_y * slope_y + 1.0).sqrt();
        // 128 is zero exactly: see TextureSlot::Normal.
        let encode = |n: f32| (128.0 + 127.0 * n / length).round() as u8;
        [encode(-slope_x), encode(slope_y), encode(1.0), 255]
    });
    let texture = |suffix: &str, color_space, texels| {
        let (name, size, sampler) = (format!("{name} {suffix}"), [edge as u32; 2], Default::default());
        let mut texture = Texture { name, size, color_space, sampler, texels };
        // As loaders do. Blits round differently from driver to driver, and a mirror shows normals that are a code off.
        texture.make_levels();
        texture
    };
    Painted {
        color: texture("colour", ColorSpace::Srgb, color),
        normal: texture("normal", ColorSpace::Linear, normal.collect()),
        surface: texture("surface", ColorSpace::Linear, surface),
    }
}

fn unorm(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}

pub(super) fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

pub(super) fn scaled(color: [f32; 3], factor: f32) -> [f32; 3] {
    color.map(|channel| channel * factor)
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A number from 0 to 1 for a cell of a lattice (a finalizer in the manner of SplitMix64).
pub(super) fn hash(x: i32, y: i32, seed: u32) -> f32 {
    let mut h = (x as u32 as u64) | ((y as u32 as u64) << 32);
    h = (h ^ (u64::from(seed) << 17)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    h = (h ^ (h >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((h >> 40) as f32) / (1u64 << 24) as f32
}

/// Value noise from 0 to 1 on a lattice of `period` cells over the unit square, repeating with it.
pub(super) fn noise(u: f32, v: f32, period: i32, seed: u32) -> f32 {
    let (x, y) = (u * period as f32, v * period as f32);
    let (cell_x, cell_y) = (x.floor(), y.floor());
    let (tx, ty) = (smoothstep(0.0, 1.0, x - cell_x), smoothstep(0.0, 1.0, y - cell_y));
    let (left, top) = ((cell_x as i32).rem_euclid(period), (cell_y as i32).rem_euclid(period));
    let next = |cell: i32| if cell + 1 == period { 0 } else { cell + 1 };
    let row = |y: i32| {
        let (from, to) = (hash(left, y, seed), hash(next(left), y, seed));
        from + (to - from) * tx
    };
    let (low, high) = (row(top), row(next(top)));
    low + (high - low) * ty
}

/// Octaves of [`noise`], each twice as fine and half as strong; 0 to 1.
pub(super) fn fractal(u: f32, v: f32, period: i32, octaves: u32, seed: u32) -> f32 {
    let octave = |i: u32| noise(u, v, period << i, seed + i) / (2 << i) as f32;
    (0..octaves).map(octave).sum::<f32>() / (1.0 - 0.5f32.powi(octaves as i32))
}

/// Distance from the edges of the cell of a brick bond, in cells' heights; and which cell it is.
pub(super) fn bricks(u: f32, v: f32, columns: i32, rows: i32) -> (f32, i32, i32) {
    let row = (v * rows as f32).floor();
    let shift = if (row as i32).rem_euclid(2) == 1 { 0.5 } else { 0.0 };
    let x = u * columns as f32 + shift;
    let column = x.floor();
    let aspect = rows as f32 / columns as f32;
    let (in_x, in_y) = (x - column, v * rows as f32 - row);
    let edge = (in_x.min(1.0 - in_x) * aspect).min(in_y.min(1.0 - in_y));
    (edge, (column as i32).rem_euclid(columns), (row as i32).rem_euclid(rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_and_stays_in_range() {
        for i in 0..100 {
            let (u, v) = (i as f32 * 0.037, i as f32 * 0.013);
            let n = fractal(u, v, 4, 5, 7);
            assert!((0.0..=1.0).contains(&n));
            assert!((n - fractal(u + 1.0, v - 1.0, 4, 5, 7)).abs() < 1e-3);
        }
    }

    #[test]
    fn painted_textures_have_their_levels_so_that_no_driver_rounds_them() {
        let painted = paint("sides", 8, |u, _| Texel::new([if u < 0.5 { 0.0 } else { 1.0 }; 3], 0.0, u));
        for texture in [&painted.color, &painted.normal, &painted.surface] {
            assert_eq!(texture.own_levels(), 4, "{}", texture.name);
        }
        // Half of black and white light, and half of all roughness.
        assert_eq!(painted.color.rgba8(3)[..3], [188; 3]);
        assert!((127..=128).contains(&painted.surface.rgba8(3)[1]), "{:?}", painted.surface.rgba8(3));
    }

    #[test]
    fn a_flat_surface_has_the_neutral_normal_and_a_slope_leans_away() {
        let flat = paint("flat", 4, |_, _| Texel::new([0.5; 3], 0.1, 0.5));
        assert!((0..3).all(|level| flat.normal.rgba8(level).chunks(4).all(|texel| texel == [128, 128, 255, 255])));
        // Higher to the right and to the bottom: the normal leans left and up.
        let slope = paint("slope", 8, |u, v| Texel::new([0.5; 3], u + v, 0.5));
        let middle = &slope.normal.rgba8(0)[(3 * 8 + 3) * 4..][..3];
        assert!(middle[0] < 128 && middle[1] > 128, "{middle:?}");
    }
}
