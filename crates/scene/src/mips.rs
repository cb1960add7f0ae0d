//! The smaller levels of textures that loaders decode or built-in scenes paint. Each texel is the mean, in linear light, of the texels that it covers one
//! level above. Textures without levels get theirs on the device, by blits, which some drivers round up: before Mesa 26, lavapipe's fifth level of a
//! linear texture is 2.6 codes too bright, which turns normals; the one made here is off by less than a tenth on average.

use std::sync::LazyLock;

use super::texels::{level_size, most_levels};
use super::texture::srgb_encode;
use super::{ColorSpace, Texels, Texture};

impl Texture {
    /// Adds the smaller levels, down to one texel, to 8-bit RGBA without levels, if the sampler uses them.
    pub(crate) fn make_levels(&mut self) {
        let Texels::Rgba8(texels) = &mut self.texels else { return };
        let count = most_levels(self.size);
        if self.sampler.levels.is_none() || count == 1 {
            return;
        }
        let mut levels = vec![std::mem::take(texels)];
        for level in 1..count {
            let above = levels[level as usize - 1].as_chunks().0;
            levels.push(halved(above, level_size(self.size, level - 1), self.color_space).into_flattened());
        }
        self.texels = Texels::Rgba8Levels(levels);
    }
}

/// The texels of the level above that each texel covers, along one axis: `count` texels from twice its own index on, each weighted by its share.
struct Cover {
    count: usize,
    shares: Vec<[f32; 3]>,
}

impl Cover {
    fn of(edge: u32) -> Self {
        let half = edge / 2;
        match (edge, edge % 2) {
            (1, _) => Self { count: 1, shares: vec![[1.0, 0.0, 0.0]] },
            (_, 0) => Self { count: 2, shares: vec![[0.5, 0.5, 0.0]; half as usize] },
            // A texel is 2 + 1 / half wide and covers parts of its first and its last one.
            _ => {
                let share = |parts: u32| parts as f32 / edge as f32;
                let shares = |index: u32| [share(half - index), share(half), share(index + 1)];
                Self { count: 3, shares: (0..half).map(shares).collect() }
            }
        }
    }
}

/// The level below one of this size.
fn halved(above: &[[u8; 4]], size: [u32; 2], color_space: ColorSpace) -> Vec<[u8; 4]> {
    let is_even = size[0].is_multiple_of(2) && size[1].is_multiple_of(2);
    match color_space {
        _ if !is_even => covered(above, size, color_space),
        ColorSpace::Linear => halved_evenly(above, size, |a, b, c, d| {
            let channel = |index: usize| mean([a[index], b[index], c[index], d[index]]);
            [channel(0), channel(1), channel(2), channel(3)]
        }),
        ColorSpace::Srgb => {
            let (decode, encode) = (&*SRGB, ENCODED.as_slice());
            let light = |code: u8| decode[usize::from(code)];
            halved_evenly(above, size, |a, b, c, d| {
                let channel = |index: usize| {
                    let sum = light(a[index]) + light(b[index]) + light(c[index]) + light(d[index]);
                    encode[(sum * (0.25 * STEPS) + 0.5) as i32 as usize]
                };
                [channel(0), channel(1), channel(2), mean([a[3], b[3], c[3], d[3]])]
            })
        }
    }
}

/// The level below one of even size, where each texel covers exactly four. It rounds as [`covered`] does, to the bit, because a quarter of a float is
/// exact.
fn halved_evenly(
    above: &[[u8; 4]],
    size: [u32; 2],
    mean: impl Fn(&[u8; 4], &[u8; 4], &[u8; 4], &[u8; 4]) -> [u8; 4],
) -> Vec<[u8; 4]> {
    let width = size[0] as usize;
    let mut below = Vec::with_capacity(above.len() / 4);
    for rows in above.chunks_exact(2 * width) {
        let (upper, lower) = rows.split_at(width);
        let squares = upper.as_chunks().0.iter().zip(lower.as_chunks().0);
        below.extend(squares.map(|([a, b], [c, d])| mean(a, b, c, d)));
    }
    below
}

/// The mean of four codes, rounded as [`rounded`] does.
fn mean([a, b, c, d]: [u8; 4]) -> u8 {
    let sum = u16::from(a) + u16::from(b) + u16::from(c) + u16::from(d);
    // A remainder of one half rounds to the even code.
    ((sum + 1 + (sum >> 2 & 1)) >> 2) as u8
}

/// The level below one of any size.
fn covered(above: &[[u8; 4]], size: [u32; 2], color_space: ColorSpace) -> Vec<[u8; 4]> {
    let width = size[0] as usize;
    let [columns, rows] = size.map(Cover::of);
    let is_srgb = color_space == ColorSpace::Srgb;
    let decode = if is_srgb { &*SRGB } else { &*CODES };
    let encode = |value: f32| match is_srgb {
        true => ENCODED[(value * STEPS + 0.5) as usize],
        false => rounded(value),
    };
    let mut texels = Vec::with_capacity(columns.shares.len() * rows.shares.len());
    for (y, down) in rows.shares.iter().enumerate() {
        for (x, across) in columns.shares.iter().enumerate() {
            let mut sum = [0.0; 4];
            for (row, down) in down.iter().enumerate().take(rows.count) {
                let first = (2 * y + row) * width + 2 * x;
                for ([red, green, blue, alpha], across) in above[first..first + columns.count].iter().zip(across) {
                    let share = down * across;
                    for (sum, code) in sum.iter_mut().zip([red, green, blue]) {
                        *sum += share * decode[usize::from(*code)];
                    }
                    sum[3] += share * f32::from(*alpha);
                }
            }
            texels.push([encode(sum[0]), encode(sum[1]), encode(sum[2]), rounded(sum[3])]);
        }
    }
    texels
}

/// The nearest code to a value from 0 to 255; ties go to the even code. A quarter of the means of four codes are ties: if they all rounded up, each
/// level would be an eighth of a code brighter than the one above it.
fn rounded(value: f32) -> u8 {
    /// From this value on floats are whole numbers, so their last bits are the number's.
    const WHOLE: f32 = (1 << (f32::MANTISSA_DIGITS - 1)) as f32;
    (value + WHOLE).to_bits() as u8
}

/// The values of linear codes: themselves.
static CODES: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| code as f32));

/// The linear values of sRGB codes (IEC 61966-2-1).
static SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let encoded = code as f32 / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
});

/// Steps of values from 0 to 1 before they are encoded: each is a twentieth of the darkest code.
const STEPS: f32 = 65535.0;

/// The sRGB codes of linear values.
static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let code = |step: u32| (255.0 * srgb_encode(step as f32 / STEPS) + 0.5) as u8;
    (0..=STEPS as u32 + 1).map(code).collect()
});

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sampler;

    fn made(size: [u32; 2], color_space: ColorSpace, texel: impl Fn(u32) -> [u8; 4]) -> Vec<Vec<u8>> {
        let texels = (0..size[0] * size[1]).flat_map(texel).collect();
        let mut texture = Texture { name: "it".into(), size, color_space, sampler: Sampler::DEFAULT, texels };
        texture.make_levels();
        match texture.texels {
            Texels::Rgba8Levels(levels) => levels,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_level_is_the_mean_of_the_one_above_in_linear_light_with_linear_alpha() {
        let checks =
            |index: u32| if (index + index / 4).is_multiple_of(2) { [255, 255, 255, 200] } else { [0, 0, 0, 100] };
        for (color_space, grey) in [(ColorSpace::Srgb, 188), (ColorSpace::Linear, 128)] {
            let levels = made([4, 4], color_space, checks);
            assert_eq!(levels.iter().map(Vec::len).collect::<Vec<_>>(), [64, 16, 4]);
            assert!(levels[1..].iter().all(|level| level.chunks(4).all(|texel| texel == [grey, grey, grey, 150])));
        }
    }

    #[test]
    fn every_texel_counts_as_much_whatever_the_size() {
        for size in [[7, 1], [1, 5], [5, 3], [6, 7], [3, 8]] {
            let sums = |level: &[u8], size: [u32; 2]| {
                level.iter().map(|&code| f64::from(code)).sum::<f64>() / f64::from(4 * size[0] * size[1])
            };
            let levels = made(size, ColorSpace::Linear, |index| [(index * 91 % 256) as u8; 4]);
            for (level, texels) in (0..).zip(&levels) {
                let own = level_size(size, level);
                assert_eq!(texels.len() as u32, 4 * own[0] * own[1], "{size:?}");
                // But for the rounding of each level.
                let off = sums(texels, own) - sums(&levels[0], size);
                assert!(off.abs() <= 0.5 * f64::from(level), "{size:?} level {level}: {off}");
            }
        }
    }

    #[test]
    fn rounding_makes_no_level_brighter_or_darker() {
        let noise = |index: u32| [(index.wrapping_mul(2_027_808_452) >> 24) as u8; 4];
        let levels = made([256, 256], ColorSpace::Linear, noise);
        let mean = |level: &[u8]| level.iter().map(|&code| f64::from(code)).sum::<f64>() / level.len() as f64;
        for (number, level) in levels.iter().enumerate().take(6) {
            let off = mean(level) - mean(&levels[0]);
            assert!(off.abs() < 0.05, "level {number}: {off}");
        }
    }

    #[test]
    fn even_sizes_have_the_texels_that_any_size_has() {
        let noise: Vec<u8> =
            (0..4 * 512 * 512_u32).map(|index| (index.wrapping_mul(2_654_435_761) >> 23) as u8).collect();
        // All sums of four codes, also sums whose mean lies between two codes.
        let sums: Vec<u8> =
            (0..4 * 4 * 256_u32).flat_map(|index| [(index / 16) as u8, (index % 16 * 17) as u8]).collect();
        for (texels, size) in [(noise.as_slice(), [512, 512]), (&sums, [2, 1024]), (&sums, [1024, 2])] {
            for color_space in [ColorSpace::Srgb, ColorSpace::Linear] {
                let above = texels.as_chunks().0;
                assert!(
                    halved(above, size, color_space) == covered(above, size, color_space),
                    "{size:?} {color_space:?}"
                );
            }
        }
    }

    #[test]
    fn a_texture_of_one_colour_keeps_it() {
        for code in 0..=255 {
            for color_space in [ColorSpace::Srgb, ColorSpace::Linear] {
                let levels = made([5, 4], color_space, |_| [code; 4]);
                assert!(levels.iter().flatten().all(|&found| found == code), "{code} {color_space:?}");
            }
        }
    }

    #[test]
    fn what_looks_at_one_level_has_one() {
        let mut texture = Texture {
            name: "it".into(),
            size: [2, 2],
            color_space: ColorSpace::Linear,
            sampler: Sampler { levels: None, ..Sampler::DEFAULT },
            texels: vec![7; 16].into(),
        };
        texture.make_levels();
        assert_eq!(texture.texels, vec![7; 16].into());
    }
}
