//! Blocks of one colour.

use super::BlockFormat;

/// Modifiers of ETC2's colours, by the block's table and a texel's code (Khronos Data Format Specification 1.3, table "ETC1 intensity modifier sets").
const ETC2_MODIFIERS: [[i32; 4]; 8] = [
    [2, 8, -2, -8],
    [5, 17, -5, -17],
    [9, 29, -9, -29],
    [13, 42, -13, -42],
    [18, 60, -18, -60],
    [24, 80, -24, -80],
    [33, 106, -33, -106],
    [47, 183, -47, -183],
];

impl BlockFormat {
    /// Returns a block of one colour, RGBA, or of a colour near it. Channels of BC7 have 7 bits; channels of ETC2 have 5 bits and a shared modifier;
    /// alpha has 8. A colour of [`BlockFormat::Etc2Rgb8A1`] is opaque.
    pub(crate) fn solid(self, color: [u8; 4]) -> Vec<u8> {
        match self {
            Self::Bc7 => solid_bc7(color).to_vec(),
            Self::Etc2Rgb8 | Self::Etc2Rgb8A1 => solid_etc2(color).to_vec(),
            Self::Etc2Rgba8 => [solid_eac(color[3]), solid_etc2(color)].concat(),
        }
    }
}

/// Mode 5, with both endpoints the same.
pub(super) fn solid_bc7([red, green, blue, alpha]: [u8; 4]) -> [u8; 16] {
    let pair = |code: u8, bits: u32| u128::from(code) | u128::from(code) << bits;
    let colors = pair(red >> 1, 7) | pair(green >> 1, 7) << 14 | pair(blue >> 1, 7) << 28;
    (1 << 5 | colors << 8 | pair(alpha, 8) << 50).to_le_bytes()
}

/// Differential mode without a difference: of all modifiers the one with which the nearest base has the smallest error.
fn solid_etc2([red, green, blue, _]: [u8; 4]) -> [u8; 8] {
    let shown = |base: i32, modifier: i32| ((base << 3 | base >> 2) + modifier).clamp(0, 255);
    let nearest = |channel: u8, modifier: i32| {
        let error = |base: &i32| shown(*base, modifier).abs_diff(i32::from(channel));
        (0..32).min_by_key(error).map_or((0, 0), |base| (base, error(&base)))
    };
    let tables = ETC2_MODIFIERS.iter().enumerate();
    let ways =
        tables.flat_map(|(table, own)| own.iter().enumerate().map(move |(code, modifier)| (table, code, *modifier)));
    let errors = ways.map(|(table, code, modifier)| {
        let channels = [red, green, blue].map(|channel| nearest(channel, modifier));
        (channels.iter().map(|(_, error)| error).sum::<u32>(), table, code, channels.map(|(base, _)| base as u8))
    });
    let (_, table, code, [red, green, blue]) = errors.min().unwrap_or_default();
    let bits = |is_set: bool| if is_set { 0xff } else { 0 };
    // The high bits of all texels' codes come before their low bits.
    let (high, low) = (bits(code & 2 != 0), bits(code & 1 != 0));
    let [table, differential] = [(table << 5 | table << 2) as u8, 2];
    [red << 3, green << 3, blue << 3, table | differential, high, high, low, low]
}

/// All texels have the base: code 4 of table 13 adds nothing to it.
fn solid_eac(alpha: u8) -> [u8; 8] {
    let codes = (0..16).fold(0, |codes: u64, _| codes << 3 | 4);
    let [_, _, codes @ ..] = codes.to_be_bytes();
    let mut block = [alpha, 1 << 4 | 13, 0, 0, 0, 0, 0, 0];
    block[2..].copy_from_slice(&codes);
    block
}
