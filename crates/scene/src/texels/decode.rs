//! Decodes blocks.

use super::BlockFormat;

impl BlockFormat {
    /// The texels of a block, rows from the top.
    pub(super) fn decode(self, block: &[u8]) -> [[u8; 4]; 16] {
        let mut texels = [0; 16];
        match self {
            Self::Bc7 => texture2ddecoder::decode_bc7_block(block, &mut texels),
            Self::Etc2Rgb8 => texture2ddecoder::decode_etc2_rgb_block(block, &mut texels),
            Self::Etc2Rgb8A1 => texture2ddecoder::decode_etc2_rgba1_block(block, &mut texels),
            Self::Etc2Rgba8 => texture2ddecoder::decode_etc2_rgba8_block(block, &mut texels),
        }
        texels.map(|texel| match texel.to_le_bytes() {
            // By the specification black as well, which filtering brings to light; the decoder keeps its colour.
            [.., 0] if self == Self::Etc2Rgb8A1 => [0; 4],
            [blue, green, red, alpha] => [red, green, blue, alpha],
        })
    }
}
