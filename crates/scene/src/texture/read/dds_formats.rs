//! Pixel formats of DDS files, by their codes, masks and numbers.

/// The layout of a surface's texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TexelLayout {
    Blocks(BlockCompression),
    /// Words of red, green, blue and alpha as whole numbers. A mask of 0 is a channel that the file lacks.
    Bits {
        bytes: usize,
        masks: [u64; 4],
    },
    Floats {
        channels: usize,
        is_half: bool,
    },
}

/// The compression of 4x4 texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum BlockCompression {
    Bc1,
    Bc2,
    Bc3,
    /// BC3 of a normal map whose red is in alpha.
    Bc3Red,
    Bc4 {
        is_signed: bool,
    },
    Bc5 {
        is_signed: bool,
    },
    Bc6 {
        is_signed: bool,
    },
    Bc7,
}

impl TexelLayout {
    /// Bytes of a texel or of a block.
    pub fn bytes(self) -> usize {
        match self {
            Self::Blocks(BlockCompression::Bc1 | BlockCompression::Bc4 { .. }) => 8,
            Self::Blocks(_) => 16,
            Self::Bits { bytes, .. } => bytes,
            Self::Floats { channels, is_half } => channels * if is_half { 2 } else { 4 },
        }
    }
}

impl BlockCompression {
    /// Returns true if its values are proportional to light.
    pub fn is_light(self) -> bool {
        matches!(self, Self::Bc6 { .. })
    }

    /// The texels, rows from the top. One channel is grey; of two, which are X and Y of a normal, blue is Z.
    pub fn decode(self, block: &[u8]) -> [[u8; 4]; 16] {
        let mut texels = [0xff00_0000_u32; 16];
        match self {
            Self::Bc1 => texture2ddecoder::decode_bc1a_block(block, &mut texels),
            Self::Bc2 => texture2ddecoder::decode_bc2_block(block, &mut texels),
            Self::Bc3 | Self::Bc3Red => texture2ddecoder::decode_bc3_block(block, &mut texels),
            Self::Bc6 { is_signed: false } => texture2ddecoder::decode_bc6_block_unsigned(block, &mut texels),
            Self::Bc6 { is_signed: true } => texture2ddecoder::decode_bc6_block_signed(block, &mut texels),
            Self::Bc7 => texture2ddecoder::decode_bc7_block(block, &mut texels),
            Self::Bc4 { is_signed } => return ramp(block, is_signed).map(code).map(|grey| [grey, grey, grey, 255]),
            Self::Bc5 { is_signed } => {
                let (x, y) = block.split_at(8);
                let (x, y) = (ramp(x, is_signed), ramp(y, is_signed));
                return std::array::from_fn(|at| {
                    let [x, y] = [x[at], y[at]];
                    let [along, up] = [x, y].map(|value| value * 2.0 - 1.0);
                    let z = (1.0 - along * along - up * up).max(0.0).sqrt();
                    [code(x), code(y), code(z * 0.5 + 0.5), 255]
                });
            }
        }
        texels.map(|texel| {
            let [blue, green, red, alpha] = texel.to_le_bytes();
            if self == Self::Bc3Red { [alpha, green, blue, 255] } else { [red, green, blue, alpha] }
        })
    }
}

/// The nearest of 8 bits.
fn code(value: f32) -> u8 {
    (value * 255.0).round() as u8
}

/// The 16 values of a block of one channel, from 0 to 1 (Khronos Data Format Specification 1.3, "RGTC Compressed Texture Image Formats").
fn ramp(block: &[u8], is_signed: bool) -> [f32; 16] {
    let bytes = block.first_chunk::<8>().copied().unwrap_or_default();
    let end = |byte: u8| match is_signed {
        true => f32::from((byte as i8).max(-127)) / 254.0 + 0.5,
        false => f32::from(byte) / 255.0,
    };
    let [a, b] = [end(bytes[0]), end(bytes[1])];
    let is_longer = if is_signed { bytes[0] as i8 > bytes[1] as i8 } else { bytes[0] > bytes[1] };
    let steps = if is_longer { 7.0 } else { 5.0 };
    let bits = u64::from_le_bytes(bytes) >> 16;
    std::array::from_fn(|at| match bits >> (3 * at) & 7 {
        0 => a,
        1 => b,
        6 if !is_longer => 0.0,
        7 if !is_longer => 1.0,
        index => {
            let share = (index - 1) as f32 / steps;
            a + (b - a) * share
        }
    })
}

/// The layout that a file's headers name: by its code, if it has one, else by masks. `number` reads a header.
///
/// # Errors
/// The name of a format that is not read.
pub(super) fn form_of(
    bytes: &[u8],
    number: fn(&[u8], usize) -> u32,
    code: Option<[u8; 4]>,
) -> Result<TexelLayout, String> {
    const READ: &str = "BC1 to BC7, and texels of bits, half floats and floats are";
    match code {
        Some(code) if code == *b"DX10" => {
            let format = number(bytes, 128);
            newer(format).ok_or_else(|| format!("its DXGI format {format} is not read ({READ})"))
        }
        Some(code) => older(code).ok_or_else(|| match code.iter().all(u8::is_ascii_graphic) {
            true => format!("its format `{}` is not read ({READ})", code.escape_ascii()),
            false => format!("its Direct3D format {} is not read ({READ})", u32::from_le_bytes(code)),
        }),
        None => {
            let (flags, bits) = (number(bytes, 80), number(bytes, 88));
            let masks = [92, 96, 100, 104].map(|at| u64::from(number(bytes, at)));
            let [red, green, blue, alpha] = masks;
            // Colour, luminance or alpha alone. Writers leave masks behind that their flags do not name.
            let masks = [red, green, blue, if flags & 0x3 == 0 { 0 } else { alpha }];
            let fault = match (flags, bits) {
                _ if flags & 0x20 != 0 => Some("texels that number a palette".into()),
                _ if flags & 0x8_0000 != 0 => Some("texels of signed numbers".into()),
                (_, 8 | 16 | 24 | 32) if flags & 0x2_0042 != 0 => None,
                _ => Some(format!("texels of {bits} bits with flags {flags:#x}")),
            };
            match fault {
                Some(what) => Err(format!("it has {what}, which are not read ({READ})")),
                None => Ok(TexelLayout::Bits { bytes: bits as usize / 8, masks: within(masks, bits, flags) }),
            }
        }
    }
}

/// Returns the masks, or the usual ones of this many bits if they reach beyond a word, as some writers have them.
fn within(masks: [u64; 4], bits: u32, flags: u32) -> [u64; 4] {
    let word = u64::MAX >> (64 - bits);
    if masks != [0; 4] && masks.iter().all(|mask| mask & !word == 0) {
        return masks;
    }
    let (has_alpha, is_grey, has_color) = (flags & 0x1 != 0, flags & 0x2_0000 != 0, flags & 0x40 != 0);
    match bits {
        8 if !is_grey && !has_color => [0, 0, 0, 0xff],
        16 if is_grey && has_alpha => [0xff, 0, 0, 0xff00],
        8 | 16 if is_grey || bits == 8 => [word, 0, 0, 0],
        16 if has_alpha => [0x7c00, 0x3e0, 0x1f, 0x8000],
        16 => [0xf800, 0x7e0, 0x1f, 0],
        _ => [0xff_0000, 0xff00, 0xff, if has_alpha { 0xff00_0000 & word } else { 0 }],
    }
}

/// Formats of Direct3D 9.
fn older(code: [u8; 4]) -> Option<TexelLayout> {
    Some(match &code {
        b"DXT1" => TexelLayout::Blocks(BlockCompression::Bc1),
        b"DXT2" | b"DXT3" => TexelLayout::Blocks(BlockCompression::Bc2),
        b"DXT4" | b"DXT5" => TexelLayout::Blocks(BlockCompression::Bc3),
        b"RXGB" => TexelLayout::Blocks(BlockCompression::Bc3Red),
        b"ATI1" | b"BC4U" => TexelLayout::Blocks(BlockCompression::Bc4 { is_signed: false }),
        b"BC4S" => TexelLayout::Blocks(BlockCompression::Bc4 { is_signed: true }),
        b"ATI2" | b"BC5U" => TexelLayout::Blocks(BlockCompression::Bc5 { is_signed: false }),
        b"BC5S" => TexelLayout::Blocks(BlockCompression::Bc5 { is_signed: true }),
        _ => match u32::from_le_bytes(code) {
            36 => wide(8, 4),
            111 => TexelLayout::Floats { channels: 1, is_half: true },
            112 => TexelLayout::Floats { channels: 2, is_half: true },
            113 => TexelLayout::Floats { channels: 4, is_half: true },
            114 => TexelLayout::Floats { channels: 1, is_half: false },
            115 => TexelLayout::Floats { channels: 2, is_half: false },
            116 => TexelLayout::Floats { channels: 4, is_half: false },
            _ => return None,
        },
    })
}

/// Formats of Direct3D 10 and later (DXGI_FORMAT).
fn newer(format: u32) -> Option<TexelLayout> {
    let bits = |bytes, masks| TexelLayout::Bits { bytes, masks };
    Some(match format {
        1 | 2 => TexelLayout::Floats { channels: 4, is_half: false },
        5 | 6 => TexelLayout::Floats { channels: 3, is_half: false },
        9 | 10 => TexelLayout::Floats { channels: 4, is_half: true },
        11 => wide(8, 4),
        15 | 16 => TexelLayout::Floats { channels: 2, is_half: false },
        23 | 24 => bits(4, [0x3ff, 0x3ff << 10, 0x3ff << 20, 3 << 30]),
        27..=29 => bits(4, [0xff, 0xff00, 0xff_0000, 0xff00_0000]),
        33 | 34 => TexelLayout::Floats { channels: 2, is_half: true },
        35 => wide(4, 2),
        39 | 41 => TexelLayout::Floats { channels: 1, is_half: false },
        48 | 49 => bits(2, [0xff, 0xff00, 0, 0]),
        53 | 54 => TexelLayout::Floats { channels: 1, is_half: true },
        56 => wide(2, 1),
        60 | 61 => bits(1, [0xff, 0, 0, 0]),
        65 => bits(1, [0, 0, 0, 0xff]),
        70..=72 => TexelLayout::Blocks(BlockCompression::Bc1),
        73..=75 => TexelLayout::Blocks(BlockCompression::Bc2),
        76..=78 => TexelLayout::Blocks(BlockCompression::Bc3),
        79 | 80 => TexelLayout::Blocks(BlockCompression::Bc4 { is_signed: false }),
        81 => TexelLayout::Blocks(BlockCompression::Bc4 { is_signed: true }),
        82 | 83 => TexelLayout::Blocks(BlockCompression::Bc5 { is_signed: false }),
        84 => TexelLayout::Blocks(BlockCompression::Bc5 { is_signed: true }),
        85 => bits(2, [0xf800, 0x7e0, 0x1f, 0]),
        86 => bits(2, [0x7c00, 0x3e0, 0x1f, 0x8000]),
        87 | 90 | 91 => bits(4, [0xff_0000, 0xff00, 0xff, 0xff00_0000]),
        88 | 92 | 93 => bits(4, [0xff_0000, 0xff00, 0xff, 0]),
        94 | 95 => TexelLayout::Blocks(BlockCompression::Bc6 { is_signed: false }),
        96 => TexelLayout::Blocks(BlockCompression::Bc6 { is_signed: true }),
        97..=99 => TexelLayout::Blocks(BlockCompression::Bc7),
        115 => bits(2, [0xf00, 0xf0, 0xf, 0xf000]),
        _ => return None,
    })
}

/// Channels of 16 bits.
fn wide(bytes: usize, channels: usize) -> TexelLayout {
    TexelLayout::Bits { bytes, masks: std::array::from_fn(|at| if at < channels { 0xffff << (16 * at) } else { 0 }) }
}
