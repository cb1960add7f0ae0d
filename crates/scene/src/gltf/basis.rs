//! Basis Universal: ETC1S or UASTC blocks of KTX 2.0 files, transcoded to BC7, as a scene is loaded without a device: desktop devices sample
//! BC7, for others it is decoded.

use std::panic::{AssertUnwindSafe, catch_unwind};

use basisu::{DecodeFlags, TargetFormat, Transcoder};

use super::ktx::KtxHeader;
use crate::{BlockFormat, Texels, level_size};

/// All levels of a file with this header.
pub(super) fn decode(bytes: &[u8], header: &KtxHeader) -> Result<Texels, String> {
    // The transcoder checks its input; it is young, and a slip of it must not take the program along.
    let texels = catch_unwind(AssertUnwindSafe(|| transcode(bytes, header)));
    texels.unwrap_or_else(|_| Err("cannot be transcoded: the transcoder failed".into()))
}

/// As [`decode`], by the transcoder's own checks and the checks here, without a guard against panics.
pub(super) fn transcode(bytes: &[u8], header: &KtxHeader) -> Result<Texels, String> {
    let format = BlockFormat::Bc7;
    let failed = |error| format!("cannot be transcoded: {error:?}");
    let size = |level: u32| level_size(header.size, level);
    for (index, level) in (0..).zip(&header.levels) {
        // The transcoder takes a level's unpacked length for granted: at most 16 bytes for each block of 4x4 texels.
        let ([width, height], unpacked, most) = (size(index), level.unpacked, format.level_bytes(size(index)));
        if unpacked > most {
            return Err(format!(
                "says that its {width}x{height} texels are {unpacked} bytes, but they are {most} at most"
            ));
        }
    }
    let transcoder = Transcoder::new(bytes).map_err(failed)?;
    let level = |index: u32| {
        let blocks = transcoder.transcode(index, TargetFormat::Bc7Rgba, DecodeFlags::NONE).map_err(failed)?;
        let ([width, height], found, expected) = (size(index), blocks.len(), format.level_bytes(size(index)));
        match found as u64 == expected {
            true => Ok(blocks),
            false => Err(format!("cannot be transcoded: {width}x{height} texels became {found} bytes, not {expected}")),
        }
    };
    let levels = (0..header.levels.len() as u32).map(level).collect::<Result<_, _>>()?;
    Ok(Texels::Blocks { format, levels })
}
