//! KHR_texture_basisu: KTX 2.0 files of ETC1S or UASTC blocks, transcoded to texels.

use std::panic::{AssertUnwindSafe, catch_unwind};

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use image::RgbaImage;

use crate::scene::texture::MAX_TEXTURE_EDGE;

const IDENTIFIER: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Whether bytes begin as a KTX 2.0 file does.
pub(super) fn is_ktx(bytes: &[u8]) -> bool {
    bytes.starts_with(IDENTIFIER)
}

/// The largest level.
pub(super) fn decode(bytes: &[u8]) -> Result<RgbaImage, String> {
    // The transcoder checks its input; it is young, and a slip of it must not take the program along.
    let image = catch_unwind(AssertUnwindSafe(|| transcode(bytes)));
    image.unwrap_or_else(|_| Err("cannot be transcoded: the transcoder failed".into()))
}

/// The same by the transcoder's own checks and those here.
pub(super) fn transcode(bytes: &[u8]) -> Result<RgbaImage, String> {
    let [width, height] = size(bytes)?;
    let failed = |error| format!("cannot be transcoded: {error:?}");
    let transcoder = Transcoder::new(bytes).map_err(failed)?;
    let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(failed)?;
    let found = texels.len();
    RgbaImage::from_raw(width, height, texels)
        .ok_or_else(|| format!("cannot be transcoded: {width}x{height} texels became {found} bytes"))
}

/// Width and height, if the file is one image of them (KTX 2.0, "File Structure").
fn size(bytes: &[u8]) -> Result<[u32; 2], String> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|word| word.try_into().ok());
        word.map(u32::from_le_bytes).ok_or_else(|| "is cut short in its header".to_owned())
    };
    let (width, height) = (word(20)?, word(24)?);
    if ![width, height].iter().all(|edge| (1..=MAX_TEXTURE_EDGE).contains(edge)) {
        return Err(format!("is {width}x{height} texels, but each edge must have 1 to {MAX_TEXTURE_EDGE}"));
    }
    let (depth, layers, faces) = (word(28)?, word(32)?, word(36)?);
    if depth > 1 || layers > 1 || faces != 1 {
        return Err("is not one flat image".into());
    }
    // The transcoder takes the first level's unpacked length for granted: at most 16 bytes for each block of 4x4 texels.
    let unpacked = u64::from(word(96)?) | u64::from(word(100)?) << 32;
    let most = 16 * u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4));
    if unpacked > most {
        return Err(format!("says that its {width}x{height} texels are {unpacked} bytes, but they are {most} at most"));
    }
    check_ranges(bytes.len() as u64, word)?;
    Ok([width, height])
}

/// Holds every range that the header and the level index name against the file's length: the transcoder adds them up without a look (KTX 2.0,
/// "Index" and "Level Index").
fn check_ranges(length: u64, word: impl Fn(usize) -> Result<u32, String>) -> Result<(), String> {
    let long = |at: usize| Ok::<_, String>(u64::from(word(at)?) | u64::from(word(at + 4)?) << 32);
    let mut ranges = Vec::new();
    for at in [48, 56] {
        ranges.push((u64::from(word(at)?), u64::from(word(at + 4)?)));
    }
    ranges.push((long(64)?, long(72)?));
    let levels = word(40)?.max(1);
    if levels > 32 {
        return Err(format!("says that it has {levels} levels"));
    }
    for level in 0..levels as usize {
        ranges.push((long(80 + 24 * level)?, long(88 + 24 * level)?));
    }
    match ranges.iter().find(|&&(offset, bytes)| offset.checked_add(bytes).is_none_or(|end| end > length)) {
        Some((offset, bytes)) => Err(format!("names {bytes} bytes at {offset}, but has {length}")),
        None => Ok(()),
    }
}
