//! Filtered texels of level 0, magnified and wrapped as their sampler says. sRGB is decoded before it is filtered, as samplers do.
//!
//! Each cell of an atlas is sampled, and wraps, as an image by itself.
//!
//! There are no levels: [`super::Mode::Converged`] converges to the mean of level 0 over a pixel by looking at more places.

use std::sync::OnceLock;

use glam::{DVec2, DVec4};

use afterlight_scene::{ColorSpace, Filter, Texture, Wrap};

/// The linear values of the 256 codes (IEC 61966-2-1).
fn srgb() -> &'static [f64; 256] {
    static TABLE: OnceLock<[f64; 256]> = OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|code| {
            let encoded = code as f64 / 255.0;
            if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
        })
    })
}

/// The part of a texture that is sampled.
#[derive(Debug, Clone, Copy)]
pub struct TextureRegion {
    /// Upper left corner, in texels.
    first: [usize; 2],
    /// Width and height in texels.
    size: [u32; 2],
}

impl TextureRegion {
    /// Returns a cell of an atlas of `rows` and `columns`. The only cell of a 1 x 1 atlas is the whole texture.
    pub fn cell(texture: &Texture, [rows, columns]: [u32; 2], cell: u32) -> Self {
        let size = [texture.size[0] / columns, texture.size[1] / rows];
        let first = [(cell % columns) as usize * size[0] as usize, (cell / columns) as usize * size[1] as usize];
        Self { first, size }
    }
}

fn texel(texture: &Texture, x: usize, y: usize) -> DVec4 {
    let linear = |code: u8| f64::from(code) / 255.0;
    let [r, g, b, a] = texture.texel(x, y);
    match texture.color_space {
        ColorSpace::Linear => DVec4::new(linear(r), linear(g), linear(b), linear(a)),
        ColorSpace::Srgb => {
            let table = srgb();
            DVec4::new(table[r as usize], table[g as usize], table[b as usize], linear(a))
        }
    }
}

/// The two texels around a coordinate and the second one's share: none, where the nearest is all there is. A coordinate that is no number is 0.
fn between(coordinate: f64, edge: u32, wrap: Wrap, filter: Filter) -> (usize, usize, f64) {
    let edge = f64::from(edge);
    let within = match wrap {
        Wrap::Repeat => coordinate.rem_euclid(1.0),
        Wrap::Mirror => coordinate.rem_euclid(2.0),
        Wrap::Clamp => coordinate.clamp(-1.0, 2.0),
    };
    let place = within * edge - if filter == Filter::Linear { 0.5 } else { 0.0 };
    let place = if place.is_finite() { place } else { -0.5 };
    let first = place.floor();
    let wrapped = |texel: f64| match wrap {
        Wrap::Repeat => texel.rem_euclid(edge),
        // Counts up to the last texel, repeats it, and counts back.
        Wrap::Mirror => {
            let texel = texel.rem_euclid(2.0 * edge);
            texel.min(2.0 * edge - 1.0 - texel)
        }
        Wrap::Clamp => texel.clamp(0.0, edge - 1.0),
    } as usize;
    let share = if filter == Filter::Linear { place - first } else { 0.0 };
    (wrapped(first), wrapped(first + 1.0), share)
}

/// Linear RGBA at a place of a window; (0, 0) is the upper left corner of its first texel.
pub fn sample(texture: &Texture, TextureRegion { first, size }: TextureRegion, uv: DVec2) -> DVec4 {
    let [wrap_u, wrap_v] = texture.sampler.wrap;
    let filter = texture.sampler.magnify;
    let (x0, x1, fx) = between(uv.x, size[0], wrap_u, filter);
    let (y0, y1, fy) = between(uv.y, size[1], wrap_v, filter);
    let own = |x, y| texel(texture, first[0] + x, first[1] + y);
    let row = |y| own(x0, y).lerp(own(x1, y), fx);
    row(y0).lerp(row(y1), fy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(color_space: ColorSpace) -> Texture {
        let texels = vec![0, 0, 0, 0, 255, 128, 64, 255, 10, 20, 30, 40, 50, 60, 70, 80];
        Texture { name: "two".into(), size: [2, 2], color_space, sampler: Default::default(), texels: texels.into() }
    }

    fn sample(texture: &Texture, uv: DVec2) -> DVec4 {
        super::sample(texture, TextureRegion::cell(texture, [1, 1], 0), uv)
    }

    #[test]
    fn a_cell_is_sampled_as_an_image_of_its_own() {
        let texels: Vec<u8> = (0..6 * 4 * 4).map(|value: u32| (value * 37 % 251) as u8).collect();
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let sampler = afterlight_scene::Sampler { wrap: [wrap; 2], ..Default::default() };
            let color_space = ColorSpace::Linear;
            let atlas =
                Texture { name: "atlas".into(), size: [6, 4], color_space, sampler, texels: texels.clone().into() };
            for cell in 0..6 {
                // Two rows of three cells of 2x2 texels.
                let (column, row) = (cell as usize % 3, cell as usize / 3);
                let rows = (0..2).flat_map(|y| texels[((row * 2 + y) * 6 + column * 2) * 4..][..8].to_vec());
                let alone = Texture { size: [2, 2], texels: rows.collect(), ..atlas.clone() };
                for uv in [[0.0, 0.0], [0.3, 0.9], [-0.2, 1.7], [0.99, -3.01]].map(DVec2::from) {
                    let found = super::sample(&atlas, TextureRegion::cell(&atlas, [2, 3], cell), uv);
                    assert_eq!(found, sample(&alone, uv), "{wrap:?}: cell {cell} at {uv}");
                }
            }
        }
    }

    #[test]
    fn the_middle_of_a_texel_is_the_texel_and_the_edge_is_the_mean() {
        let texture = two(ColorSpace::Linear);
        assert_eq!(sample(&texture, DVec2::new(0.75, 0.25)), DVec4::new(255.0, 128.0, 64.0, 255.0) / 255.0);
        let mean = sample(&texture, DVec2::new(0.5, 0.25));
        assert!((mean - DVec4::new(127.5, 64.0, 32.0, 127.5) / 255.0).length() < 1e-15);
        // Beyond the last texel comes the first one again.
        for uv in [DVec2::new(0.0, 0.25), DVec2::new(1.0, -0.75), DVec2::new(-3.0, 7.25)] {
            assert!((sample(&texture, uv) - mean).length() < 1e-14, "{uv}");
        }
    }

    #[test]
    fn srgb_is_decoded_before_it_is_filtered_and_alpha_is_not_decoded() {
        let mean = sample(&two(ColorSpace::Srgb), DVec2::new(0.5, 0.25));
        assert!((mean.x - 0.5).abs() < 1e-15 && (mean.w - 0.5).abs() < 1e-15, "{mean}");
        assert!((mean.y - 0.5 * 0.215_860_5).abs() < 1e-7, "{mean}");
    }

    #[test]
    fn any_coordinate_has_a_texel() {
        for bad in [f64::NAN, f64::INFINITY, 1e300, -1e300, 5e-324, -5e-324] {
            let found = sample(&two(ColorSpace::Srgb), DVec2::new(bad, bad));
            assert!(found.is_finite(), "{bad}: {found}");
        }
    }
}
