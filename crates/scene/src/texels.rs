//! The contents of a texture: texels, or the blocks of 4x4 texels that its file compresses them to, with the levels of the file.

#[cfg(feature = "readers")]
mod decode;
#[cfg(feature = "readers")]
mod solid;

use std::borrow::Cow;
use std::fmt;

use rayon::prelude::*;

use super::Texture;

/// The compression of blocks of 4x4 texels (Khronos Data Format Specification 1.3, "BPTC Compressed Texture Image Formats" and "ETC2
/// Compressed Texture Image Formats"). Both are exact: every decoder finds the same texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BlockFormat {
    /// RGBA in 16 bytes.
    Bc7,
    /// Opaque, in 8 bytes.
    Etc2Rgb8,
    /// Each texel opaque or nothing, in 8 bytes.
    Etc2Rgb8A1,
    /// RGBA in 16 bytes.
    Etc2Rgba8,
}

impl BlockFormat {
    /// Every format.
    pub const ALL: [Self; 4] = [Self::Bc7, Self::Etc2Rgb8, Self::Etc2Rgb8A1, Self::Etc2Rgba8];

    /// Bytes of a block.
    pub const fn block_bytes(self) -> usize {
        match self {
            Self::Bc7 | Self::Etc2Rgba8 => 16,
            Self::Etc2Rgb8 | Self::Etc2Rgb8A1 => 8,
        }
    }

    /// Bytes of a level of this many texels, blocks at its edges included.
    pub fn level_bytes(self, [width, height]: [u32; 2]) -> u64 {
        u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) * self.block_bytes() as u64
    }
}

impl fmt::Display for BlockFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bc7 => "BC7",
            Self::Etc2Rgb8 => "ETC2 RGB8",
            Self::Etc2Rgb8A1 => "ETC2 RGB8A1",
            Self::Etc2Rgba8 => "ETC2 RGBA8",
        })
    }
}

#[cfg(not(feature = "readers"))]
impl BlockFormat {
    /// Stands in for the decoder, with zeros: [`Texture::is_readable`] is then false.
    fn decode(self, _block: &[u8]) -> [[u8; 4]; 16] {
        [[0; 4]; 16]
    }
}

/// The content of a texture, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Texels {
    /// 4 bytes a texel. The smaller levels are made on the device.
    Rgba8(Vec<u8>),
    /// As in [`Texels::Rgba8`], 4 bytes a texel, with levels, the largest first; at least one.
    Rgba8Levels(Vec<Vec<u8>>),
    /// Blocks of 4x4 texels, row by row. Without the feature `readers` they are drawn only by devices that sample them as they are.
    Blocks {
        /// The compression of the blocks.
        format: BlockFormat,
        /// The levels of the file, the largest first; at least one.
        levels: Vec<Vec<u8>>,
    },
}

impl From<Vec<u8>> for Texels {
    /// RGBA.
    fn from(texels: Vec<u8>) -> Self {
        Self::Rgba8(texels)
    }
}

impl FromIterator<u8> for Texels {
    /// RGBA.
    fn from_iter<T: IntoIterator<Item = u8>>(bytes: T) -> Self {
        Self::Rgba8(bytes.into_iter().collect())
    }
}

/// Width and height of a level, given the texture's.
pub fn level_size(size: [u32; 2], level: u32) -> [u32; 2] {
    size.map(|edge| edge.checked_shr(level).unwrap_or(0).max(1))
}

/// The number of levels of a texture of this size, down to one texel.
pub fn most_levels(size: [u32; 2]) -> u32 {
    1 + size[0].max(size[1]).max(1).ilog2()
}

impl Texture {
    /// Returns true if texels can be read. Blocks must be decoded, which needs the feature `readers`: without it they are read as 0.
    pub fn is_readable(&self) -> bool {
        cfg!(feature = "readers") || !matches!(self.texels, Texels::Blocks { .. })
    }

    /// The texels of a level that the texture has, 8-bit RGBA. Blocks are decoded each time; without the feature `readers` they are read as 0
    /// ([`Texture::is_readable`]).
    pub fn rgba8(&self, level: usize) -> Cow<'_, [u8]> {
        match &self.texels {
            Texels::Rgba8(texels) => texels.as_slice().into(),
            Texels::Rgba8Levels(levels) => levels[level].as_slice().into(),
            Texels::Blocks { format, levels } => {
                decode_level(*format, level_size(self.size, level as u32), &levels[level]).into()
            }
        }
    }

    /// The texels of level 0, to be changed: blocks become texels, as [`Texture::rgba8`] reads them, and the other levels are gone.
    pub fn rgba8_mut(&mut self) -> &mut Vec<u8> {
        let level_0 = match &mut self.texels {
            Texels::Rgba8(texels) => std::mem::take(texels),
            Texels::Rgba8Levels(levels) => levels.swap_remove(0),
            Texels::Blocks { .. } => self.rgba8(0).into_owned(),
        };
        self.texels = Texels::Rgba8(level_0);
        match &mut self.texels {
            Texels::Rgba8(texels) => texels,
            _ => unreachable!("they have just become texels"),
        }
    }

    /// Returns the number of levels that the texture itself has.
    pub fn own_levels(&self) -> u32 {
        match &self.texels {
            Texels::Rgba8(_) => 1,
            Texels::Rgba8Levels(levels) | Texels::Blocks { levels, .. } => levels.len() as u32,
        }
    }

    /// 8-bit RGBA of level 0, or the blocks that it is in.
    fn level_0(&self) -> Result<&[[u8; 4]], (BlockFormat, &[u8])> {
        match &self.texels {
            Texels::Rgba8(texels) => Ok(texels.as_chunks().0),
            Texels::Rgba8Levels(levels) => Ok(levels[0].as_chunks().0),
            Texels::Blocks { format, levels } => Err((*format, &levels[0])),
        }
    }

    /// A texel of level 0 of a texture that [`super::Scene::check`] finds no fault with.
    pub fn texel(&self, x: usize, y: usize) -> [u8; 4] {
        let width = self.size[0] as usize;
        match self.level_0() {
            Ok(texels) => texels[y * width + x],
            Err((format, level)) => {
                let bytes = format.block_bytes();
                let block = (y / 4 * width.div_ceil(4) + x / 4) * bytes;
                format.decode(&level[block..block + bytes])[y % 4 * 4 + x % 4]
            }
        }
    }

    /// Returns true if any texel of level 0 satisfies the predicate. Texels are visited in any order until one does.
    pub fn any_texel(&self, mut is: impl FnMut([u8; 4]) -> bool) -> bool {
        match self.level_0() {
            Ok(texels) => texels.iter().any(|&texel| is(texel)),
            Err((format, level)) => {
                let mut blocks = blocks(format, self.size, level);
                blocks.any(|(block, [x, y])| inside(self.size, [x, y]).any(|(own, _)| is(block[own])))
            }
        }
    }
}

/// The blocks of a level, each with the place of its upper left texel.
fn blocks(format: BlockFormat, size: [u32; 2], level: &[u8]) -> impl Iterator<Item = ([[u8; 4]; 16], [usize; 2])> {
    let across = size[0].div_ceil(4) as usize;
    let place = move |block: usize| [block % across * 4, block / across * 4];
    let blocks = level.chunks_exact(format.block_bytes()).enumerate();
    blocks.map(move |(index, block)| (format.decode(block), place(index)))
}

/// The texels that a block covers in the image, given the block's upper left texel: each one's index in the block and in the image.
fn inside(size: [u32; 2], [left, top]: [usize; 2]) -> impl Iterator<Item = (usize, usize)> {
    let [width, height] = size.map(|edge| edge as usize);
    let rows = top..height.min(top + 4);
    rows.flat_map(move |y| (left..width.min(left + 4)).map(move |x| ((y - top) * 4 + x - left, y * width + x)))
}

fn decode_level(format: BlockFormat, size: [u32; 2], level: &[u8]) -> Vec<u8> {
    let width = size[0] as usize;
    let mut texels = vec![[0; 4]; width * size[1] as usize];
    let row_of_blocks = width.div_ceil(4) * format.block_bytes();
    let rows = texels.par_chunks_mut(4 * width).zip(level.par_chunks(row_of_blocks));
    rows.for_each(|(texels, row)| {
        let size = [size[0], (texels.len() / width) as u32];
        for (block, corner) in blocks(format, size, row) {
            inside(size, corner).for_each(|(own, place)| texels[place] = block[own]);
        }
    });
    texels.into_flattened()
}

#[cfg(test)]
mod tests {
    use super::solid::solid_bc7;
    use super::*;
    use crate::ColorSpace;

    fn texture(size: [u32; 2], texels: Texels) -> Texture {
        Texture { name: "blocks".into(), size, color_space: ColorSpace::Linear, sampler: Default::default(), texels }
    }

    #[test]
    fn blocks_at_the_edge_give_the_texels_that_lie_in_the_image() {
        // 5x2 texels are two blocks, of the second one only its left column.
        let colors = [[255, 0, 0, 200], [0, 255, 0, 100]];
        let level = colors.map(solid_bc7).concat();
        let own = texture([5, 2], Texels::Blocks { format: BlockFormat::Bc7, levels: vec![level] });
        let row = [colors[0], colors[0], colors[0], colors[0], colors[1]];
        assert_eq!(*own.rgba8(0), [row, row].concat().concat());
        for (x, color) in row.into_iter().enumerate() {
            assert_eq!([own.texel(x, 0), own.texel(x, 1)], [color; 2]);
        }
        let mut count = 0;
        assert!(!own.any_texel(|texel| {
            count += 1;
            texel[0] == texel[1]
        }));
        assert_eq!(count, 10);
        assert!(own.any_texel(|texel| texel[3] == 100));
        assert_eq!((BlockFormat::Bc7.level_bytes([5, 2]), BlockFormat::Etc2Rgb8.level_bytes([1, 9])), (32, 24));
    }

    #[test]
    fn levels_are_decoded_each_in_its_size_and_texels_can_be_changed() {
        let levels = [[10, 20, 30, 40], [50, 60, 70, 80]].map(|color| solid_bc7(color).to_vec()).to_vec();
        let mut own = texture([3, 2], Texels::Blocks { format: BlockFormat::Bc7, levels });
        assert_eq!((*own.rgba8(1)).len(), 4);
        assert_eq!(*own.rgba8(1), [50, 60, 70, 80]);
        own.rgba8_mut()[0] = 7;
        assert_eq!((own.texel(0, 0), own.texel(2, 1)), ([7, 20, 30, 40], [10, 20, 30, 40]));
        assert!(matches!(own.texels, Texels::Rgba8(_)));
    }

    #[test]
    fn a_block_of_one_colour_is_of_a_colour_near_it() {
        for format in BlockFormat::ALL {
            let (nearest, alphas) = match format {
                BlockFormat::Bc7 => (1, [0, 77, 255]),
                BlockFormat::Etc2Rgba8 => (12, [0, 77, 255]),
                _ => (12, [255; 3]),
            };
            for color in [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255; 3], [188; 3], [0; 3], [51; 3], [9, 99, 199]] {
                for alpha in alphas {
                    let [red, green, blue] = color;
                    let texels = format.decode(&format.solid([red, green, blue, alpha]));
                    assert_eq!(texels, [texels[0]; 16], "{format}: {color:?}");
                    let error = color.iter().zip(&texels[0]).map(|(own, texel)| own.abs_diff(*texel)).max();
                    assert!(error <= Some(nearest), "{format}: {color:?} is {:?}", texels[0]);
                    assert_eq!(texels[0][3], alpha, "{format}: {color:?}");
                }
            }
        }
    }

    #[test]
    fn what_a_mask_of_one_bit_leaves_out_is_black() {
        // Differential, not opaque, code 0: of the four values of a texel's bits the third is nothing.
        let block = [0xf8, 0xf8, 0xf8, 0x00, 0xff, 0xff, 0x00, 0x00];
        assert_eq!(BlockFormat::Etc2Rgb8A1.decode(&block), [[0; 4]; 16]);
        let opaque = BlockFormat::Etc2Rgb8A1.decode(&[0xf8, 0xf8, 0xf8, 0x02, 0, 0, 0, 0]);
        assert!(opaque.iter().all(|texel| texel[3] == 255 && texel[0] > 200), "{opaque:?}");
    }
}
