//! Images as KTX 2.0 files: blocks of BC7 and ETC2 as they are, plain or packed by Zstandard; Basis Universal (KHR_texture_basisu).

use super::basis;
use super::textures::SourceImage;
use crate::texture::MAX_TEXTURE_EDGE;
use crate::{BlockFormat, Texels, level_size, most_levels};

const IDENTIFIER: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Returns true if bytes begin with the identifier of a KTX 2.0 file.
pub(super) fn is_ktx(bytes: &[u8]) -> bool {
    bytes.starts_with(IDENTIFIER)
}

/// Reads an image with all its levels.
pub(super) fn read(bytes: &[u8]) -> Result<SourceImage, String> {
    let header = KtxHeader::of(bytes)?;
    let texels = match header.format {
        0 => basis::decode(bytes, &header)?,
        format => blocks(bytes, &header, block_format(format)?)?,
    };
    Ok(SourceImage::new(header.size, texels))
}

/// A level's place in the file, and its length when it is unpacked.
pub(super) struct KtxLevel {
    offset: u64,
    length: u64,
    pub unpacked: u64,
}

/// The beginning of a file (KTX 2.0, "File Structure").
pub(super) struct KtxHeader {
    /// The file's `vkFormat`; 0 for Basis Universal.
    format: u32,
    pub size: [u32; 2],
    /// The supercompression scheme of levels.
    packing: u32,
    /// The levels, the largest first.
    pub levels: Vec<KtxLevel>,
}

impl KtxHeader {
    /// Reads the header of a file with one flat image. Checks that all its byte ranges lie in the file.
    pub fn of(bytes: &[u8]) -> Result<Self, String> {
        let word = |at: usize| {
            let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
            word.map(u32::from_le_bytes).ok_or_else(|| "is cut short in its header".to_owned())
        };
        let long = |at: usize| Ok::<_, String>(u64::from(word(at)?) | u64::from(word(at + 4)?) << 32);
        let size = [word(20)?, word(24)?];
        let [width, height] = size;
        if !size.iter().all(|edge| (1..=MAX_TEXTURE_EDGE).contains(edge)) {
            return Err(format!("is {width}x{height} texels, but each edge must have 1 to {MAX_TEXTURE_EDGE}"));
        }
        let (depth, layers, faces) = (word(28)?, word(32)?, word(36)?);
        if depth > 1 || layers > 1 || faces != 1 {
            return Err("is not one flat image".into());
        }
        // A count of 0 asks the reader to generate levels from the one that is stored.
        let (count, most) = (word(40)?.max(1), most_levels(size));
        if count > most {
            return Err(format!("says that it has {count} levels, but {width}x{height} texels have {most} at most"));
        }
        let level = |index: usize| {
            let at = 80 + 24 * index;
            Ok::<_, String>(KtxLevel { offset: long(at)?, length: long(at + 8)?, unpacked: long(at + 16)? })
        };
        let levels = (0..count as usize).map(level).collect::<Result<Vec<_>, _>>()?;
        // With other alignments the Basis Universal transcoder reads past the end.
        let (keys, length_of_keys) = (word(56)?, word(60)?);
        if keys % 4 != 0 || length_of_keys % 4 != 0 {
            return Err(format!("has {length_of_keys} bytes of keys at {keys}, but both must be multiples of 4"));
        }
        // The ranges of the format description, the key/value data and the supercompression data are checked as well: the Basis Universal transcoder
        // adds their offsets and lengths without a check.
        let described = [48, 56].map(|at| Ok::<_, String>((u64::from(word(at)?), u64::from(word(at + 4)?))));
        let described = described.into_iter().chain([Ok((long(64)?, long(72)?))]).collect::<Result<Vec<_>, _>>()?;
        let ranges = described.into_iter().chain(levels.iter().map(|level| (level.offset, level.length)));
        let length = bytes.len() as u64;
        let is_outside = |&(offset, bytes): &(u64, u64)| offset.checked_add(bytes).is_none_or(|end| end > length);
        match { ranges }.find(is_outside) {
            Some((offset, bytes)) => Err(format!("names {bytes} bytes at {offset}, but has {length}")),
            None => Ok(Self { format: word(12)?, size, packing: word(44)?, levels }),
        }
    }
}

fn block_format(format: u32) -> Result<BlockFormat, String> {
    match format {
        145 | 146 => Ok(BlockFormat::Bc7),
        147 | 148 => Ok(BlockFormat::Etc2Rgb8),
        149 | 150 => Ok(BlockFormat::Etc2Rgb8A1),
        151 | 152 => Ok(BlockFormat::Etc2Rgba8),
        other => Err(format!(
            "has vkFormat {other}, but only Basis Universal (0), BC7 (145 and 146) and ETC2 (147 to 152) can be read"
        )),
    }
}

fn blocks(bytes: &[u8], header: &KtxHeader, format: BlockFormat) -> Result<Texels, String> {
    let read = |(index, level): (u32, &KtxLevel)| {
        let [width, height] = level_size(header.size, index);
        let expected = format.level_bytes([width, height]);
        let wrong = |found: u64| {
            format!("level {index} has {found} bytes, but {width}x{height} texels in {format} are {expected}")
        };
        if level.unpacked != expected {
            return Err(wrong(level.unpacked));
        }
        let stored = &bytes[level.offset as usize..(level.offset + level.length) as usize];
        let unpacked = match header.packing {
            0 => stored.to_vec(),
            2 => zstd::bulk::decompress(stored, expected as usize)
                .map_err(|error| format!("level {index} cannot be unpacked by Zstandard: {error}"))?,
            other => {
                return Err(format!("has supercompression {other}, but only none (0) and Zstandard (2) can be read"));
            }
        };
        if unpacked.len() as u64 == expected { Ok(unpacked) } else { Err(wrong(unpacked.len() as u64)) }
    };
    let levels = (0..).zip(&header.levels).map(read).collect::<Result<_, _>>()?;
    Ok(Texels::Blocks { format, levels })
}
