//! DirectDraw surfaces (DDS): blocks of BC1 to BC7, and texels of bits, half floats and floats, with headers of Direct3D 9 and 10. The largest level is
//! read, of the first face, slice or element.

use std::ops::Range;

use half::f16;
use image::{DynamicImage, ImageBuffer, Rgba};

use super::dds_formats::{TexelLayout, form_of};

/// Bytes of the first header with its mark, and of the one that may follow.
const HEADERS: [usize; 2] = [128, 20];

/// A surface, before its texels are decoded.
pub(super) struct DdsSurface<'a> {
    pub size: [u32; 2],
    form: TexelLayout,
    texels: &'a [u8],
    /// True if colours have been multiplied by alpha.
    is_premultiplied: bool,
    /// A warning about contents that are left out or reduced, as a predicate of the file.
    pub more: Option<&'static str>,
}

/// A header's number at a byte.
fn number(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

impl<'a> DdsSurface<'a> {
    /// Reads the headers (Microsoft, "DDS_HEADER" and "DDS_HEADER_DXT10").
    ///
    /// # Errors
    /// A format that is not read, by its name.
    pub fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let size = [number(bytes, 16), number(bytes, 12)];
        let code = bytes.get(84..88).and_then(|code| code.first_chunk::<4>()).copied().unwrap_or_default();
        let has_code = number(bytes, 80) & 0x4 != 0;
        let is_newer = has_code && code == *b"DX10";
        let form = form_of(bytes, number, has_code.then_some(code))?;
        let start = HEADERS[0] + if is_newer { HEADERS[1] } else { 0 };
        let texels = bytes.get(start..).ok_or("it ends within its header")?;
        let (caps, dimension, flags, elements) = match is_newer {
            true => (number(bytes, 112), number(bytes, 132), number(bytes, 136), number(bytes, 140)),
            false => (number(bytes, 112), 3, 0, 1),
        };
        let more = match () {
            () if caps & 0x200 != 0 || flags & 0x4 != 0 => Some("is a cube map, of which the first face is drawn"),
            () if caps & 0x20_0000 != 0 || dimension == 4 => Some("is a volume, of which the first slice is drawn"),
            () if elements > 1 => Some("is an array of textures, of which the first is drawn"),
            () if matches!(&form, TexelLayout::Blocks(block) if block.is_light()) => {
                Some("is of BC6H, whose light is read up to 1 and in 8 bits")
            }
            () => None,
        };
        let is_premultiplied =
            matches!(&code, b"DXT2" | b"DXT4") && has_code || is_newer && number(bytes, 144) & 7 == 2;
        Ok(Self { size, form, texels, is_premultiplied, more })
    }

    /// The bytes of the decoded texels, and of intermediate results.
    pub fn decoded_bytes(&self) -> u64 {
        let per_texel = match &self.form {
            TexelLayout::Blocks(block) if block.is_light() => 4 + 16,
            TexelLayout::Blocks(_) => 4,
            TexelLayout::Bits { .. } => 8,
            TexelLayout::Floats { .. } => 16,
        };
        let [width, height] = self.size.map(u64::from);
        width.saturating_mul(height).saturating_mul(per_texel)
    }

    /// Decodes the texels. The bytes are counted before any is allocated for.
    ///
    /// # Errors
    /// Fewer bytes than the size needs.
    pub fn decode(&self) -> Result<DynamicImage, String> {
        let decoded = self.stored()?;
        Ok(if self.is_premultiplied { divided_by_alpha(decoded) } else { decoded })
    }

    /// The texels as they are stored.
    fn stored(&self) -> Result<DynamicImage, String> {
        let [width, height] = self.size.map(|edge| edge as usize);
        let per = self.form.bytes();
        let units = match self.form {
            TexelLayout::Blocks(_) => width.div_ceil(4).saturating_mul(height.div_ceil(4)),
            _ => width.saturating_mul(height),
        };
        let needed = units.saturating_mul(per);
        let Some(data) = self.texels.get(..needed) else {
            return Err(format!("its {width}x{height} texels need {needed} bytes, and it has {}", self.texels.len()));
        };
        let unread = "its size is wrong";
        let [columns, rows] = self.size;
        Ok(match self.form {
            TexelLayout::Blocks(block) => {
                let mut texels = vec![[0; 4]; width * height];
                for (at, bytes) in data.chunks_exact(per).enumerate() {
                    let [left, top] = [at % width.div_ceil(4), at / width.div_ceil(4)].map(|edge| edge * 4);
                    let own = block.decode(bytes);
                    let inside = |from: usize, end: usize| -> Range<usize> { 0..(end - from).min(4) };
                    for y in inside(top, height) {
                        for x in inside(left, width) {
                            texels[(top + y) * width + left + x] = own[y * 4 + x];
                        }
                    }
                }
                if block.is_light() {
                    let light = texels.iter().flatten().map(|&value| f32::from(value) / 255.0).collect();
                    return ImageBuffer::from_raw(columns, rows, light)
                        .map(DynamicImage::ImageRgba32F)
                        .ok_or_else(|| unread.into());
                }
                self.eight_bits(texels).ok_or(unread)?
            }
            TexelLayout::Bits { masks, .. } => {
                let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word: u64, &byte| word << 8 | u64::from(byte));
                let most = masks.iter().map(|mask| mask.count_ones()).max().unwrap_or(0);
                let value = |word: u64, mask: u64, whole: u64| match mask {
                    0 => whole,
                    _ => {
                        let most = mask >> mask.trailing_zeros();
                        (((word & mask) >> mask.trailing_zeros()) * whole + most / 2) / most
                    }
                };
                let [_, has_green, has_blue, _] = masks.map(|mask| mask != 0);
                let texel = |bytes: &[u8], whole: u64| {
                    let word = word(bytes);
                    let [red, green, blue, alpha] = masks.map(|mask| value(word, mask, whole));
                    match (has_green, has_blue) {
                        (false, false) => [red, red, red, alpha],
                        (_, false) => [red, green, 0, alpha],
                        _ => [red, green, blue, alpha],
                    }
                };
                if most <= 8 {
                    let texels = data.chunks_exact(per).map(|bytes| texel(bytes, 255).map(|value| value as u8));
                    self.eight_bits(texels.collect()).ok_or(unread)?
                } else {
                    let texels = data.chunks_exact(per).flat_map(|bytes| texel(bytes, 65535));
                    let texels = texels.map(|value| value as u16).collect();
                    ImageBuffer::from_raw(columns, rows, texels).map(DynamicImage::ImageRgba16).ok_or(unread)?
                }
            }
            TexelLayout::Floats { channels, is_half } => {
                let texel = |bytes: &[u8]| {
                    let value = |at: usize| match is_half {
                        true => bytes
                            .get(at * 2..)
                            .and_then(|rest| rest.first_chunk())
                            .map(|own| f16::from_le_bytes(*own).to_f32()),
                        false => {
                            bytes.get(at * 4..).and_then(|rest| rest.first_chunk()).map(|own| f32::from_le_bytes(*own))
                        }
                    };
                    let value = |at: usize| value(at).unwrap_or(if at == 3 { 1.0 } else { 0.0 });
                    match channels {
                        1 => [value(0), value(0), value(0), 1.0],
                        _ => [0, 1, 2, 3].map(value),
                    }
                };
                let texels: Vec<f32> = data.chunks_exact(per).flat_map(texel).collect();
                ImageBuffer::from_raw(columns, rows, texels).map(DynamicImage::ImageRgba32F).ok_or(unread)?
            }
        })
    }

    fn eight_bits(&self, texels: Vec<[u8; 4]>) -> Option<DynamicImage> {
        let [width, height] = self.size;
        let image: ImageBuffer<Rgba<u8>, Vec<u8>> = ImageBuffer::from_raw(width, height, texels.into_flattened())?;
        Some(DynamicImage::ImageRgba8(image))
    }
}

/// Divides colours by their alpha, where that is not 0.
fn divided_by_alpha(mut image: DynamicImage) -> DynamicImage {
    match &mut image {
        DynamicImage::ImageRgba8(texels) => {
            for Rgba([red, green, blue, alpha]) in texels.pixels_mut().filter(|texel| texel.0[3] > 0) {
                let alpha = u16::from(*alpha);
                for own in [red, green, blue] {
                    *own = ((u16::from(*own) * 255 + alpha / 2) / alpha).min(255) as u8;
                }
            }
        }
        DynamicImage::ImageRgba16(texels) => {
            for Rgba([red, green, blue, alpha]) in texels.pixels_mut().filter(|texel| texel.0[3] > 0) {
                let alpha = u32::from(*alpha);
                for own in [red, green, blue] {
                    *own = ((u32::from(*own) * 65535 + alpha / 2) / alpha).min(65535) as u16;
                }
            }
        }
        DynamicImage::ImageRgba32F(texels) => {
            for Rgba([red, green, blue, alpha]) in texels.pixels_mut().filter(|texel| texel.0[3] > 0.0) {
                for own in [red, green, blue] {
                    *own /= *alpha;
                }
            }
        }
        _ => {}
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of this size and pixel format: flags, code, bits and masks; or one of Direct3D 10.
    fn file(size: [u32; 2], format: (u32, [u8; 4], u32, [u32; 4]), newer: Option<u32>, texels: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0; HEADERS[0]];
        bytes[..4].copy_from_slice(b"DDS ");
        let (flags, code, bits, masks) = format;
        let code = if newer.is_some() { *b"DX10" } else { code };
        let numbers = [(4, 124), (8, 0x1007), (12, size[1]), (16, size[0]), (76, 32), (80, flags)];
        let masks = (0..4).map(|at| (92 + 4 * at, masks[at]));
        for (at, value) in numbers.into_iter().chain([(84, u32::from_le_bytes(code)), (88, bits)]).chain(masks) {
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        if let Some(newer) = newer {
            bytes.extend([newer, 3, 0, 1, 0].into_iter().flat_map(u32::to_le_bytes));
        }
        bytes.extend(texels);
        bytes
    }

    fn texel(bytes: &[u8]) -> [u8; 4] {
        let image = DdsSurface::open(bytes).expect("open").decode().expect("decoded");
        image.to_rgba8().get_pixel(0, 0).0
    }

    #[test]
    fn plain_texels_of_every_order_are_read() {
        let rgb = |bits, masks: [u32; 4]| (0x40 | u32::from(masks[3] != 0), [0; 4], bits, masks);
        let old = |format, texels: &[u8]| texel(&file([1, 1], format, None, texels));
        let bgr = [0x00ff_0000, 0xff00, 0xff, 0];
        assert_eq!(old(rgb(24, bgr), &[1, 2, 3]), [3, 2, 1, 255]);
        assert_eq!(old(rgb(24, [0xff, 0xff00, 0x00ff_0000, 0]), &[1, 2, 3]), [1, 2, 3, 255]);
        // Without alpha the fourth byte is nothing, also where its mask has been left behind.
        assert_eq!(old((0x40, [0; 4], 32, [0x00ff_0000, 0xff00, 0xff, 0xff00_0000]), &[1, 2, 3, 0]), [3, 2, 1, 255]);
        assert_eq!(old(rgb(32, bgr), &[1, 2, 3, 0]), [3, 2, 1, 255]);
        assert_eq!(old(rgb(32, [0x00ff_0000, 0xff00, 0xff, 0xff00_0000]), &[1, 2, 3, 4]), [3, 2, 1, 4]);
        assert_eq!(old(rgb(16, [0xf800, 0x7e0, 0x1f, 0]), &[0x1f, 0x80]), [132, 0, 255, 255]);
        assert_eq!(old(rgb(16, [0x7c00, 0x3e0, 0x1f, 0x8000]), &[0x00, 0x7c]), [255, 0, 0, 0]);
        assert_eq!(old((0x20000, [0; 4], 8, [0xff, 0, 0, 0]), &[9]), [9, 9, 9, 255]);
        assert_eq!(old((0x20001, [0; 4], 16, [0xff, 0, 0, 0xff00]), &[9, 8]), [9, 9, 9, 8]);
        // Masks beyond the word, as Pillow writes them.
        assert_eq!(old((0x20000, [0; 4], 8, [0xff00_0000, 0xff00_0000, 0xff00_0000, 0]), &[9]), [9, 9, 9, 255]);
        assert_eq!(old((0x20001, [0; 4], 16, [0xff, 0xff, 0xff, 0xff00_0000]), &[9, 8]), [9, 9, 9, 8]);
        assert_eq!(old((0x40, [0; 4], 24, [0; 4]), &[1, 2, 3]), [3, 2, 1, 255]);
        assert_eq!(old((0x2, [0; 4], 8, [0, 0, 0, 0xff]), &[7]), [255, 255, 255, 7]);
        let new = |format, texels: &[u8]| texel(&file([1, 1], (0x4, [0; 4], 0, [0; 4]), Some(format), texels));
        assert_eq!(new(28, &[1, 2, 3, 4]), [1, 2, 3, 4]);
        assert_eq!(new(91, &[1, 2, 3, 4]), [3, 2, 1, 4]);
        assert_eq!(new(88, &[1, 2, 3, 4]), [3, 2, 1, 255]);
        assert_eq!(new(61, &[5]), [5, 5, 5, 255]);
        assert_eq!(new(49, &[5, 6]), [5, 6, 0, 255]);
        assert_eq!(new(24, &(0x3ff_u32 | 1 << 30).to_le_bytes()), [255, 0, 0, 85]);
        assert_eq!(new(11, &[0xff, 0xff, 0x80, 0x80, 0, 0, 0xff, 0xff]), [255, 128, 0, 255]);
        assert_eq!(new(10, &[0x00, 0x3c, 0x00, 0x38, 0, 0, 0x00, 0x3c]), [255, 128, 0, 255]);
        assert_eq!(new(41, &0.5_f32.to_le_bytes()), [128, 128, 128, 255]);
    }

    #[test]
    fn blocks_of_every_kind_are_read() {
        let new = |format, block: &[u8]| texel(&file([4, 4], (0x4, [0; 4], 0, [0; 4]), Some(format), block));
        let old = |code: &[u8; 4], block: &[u8]| texel(&file([4, 4], (0x4, *code, 0, [0; 4]), None, block));
        let red = [0x00, 0xf8, 0x00, 0x00, 0, 0, 0, 0];
        for code in [71, 72] {
            assert_eq!(new(code, &red), [255, 0, 0, 255]);
        }
        // The first colour is the smaller number, so that the fourth one is nothing.
        assert_eq!(old(b"DXT1", &[0x00, 0x00, 0x00, 0xf8, 0xff, 0xff, 0xff, 0xff]), [0; 4]);
        let flat = |value: u8| [value, value, 0, 0, 0, 0, 0, 0];
        assert_eq!(old(b"DXT3", &[[0x88; 8], red].concat()), [255, 0, 0, 0x88]);
        assert_eq!(old(b"DXT5", &[flat(7), red].concat()), [255, 0, 0, 7]);
        // Half of red, multiplied by an alpha of a half.
        let half = [0x00, 0x80, 0x00, 0x00, 0, 0, 0, 0];
        assert_eq!(old(b"DXT4", &[flat(132), half].concat()), [255, 0, 0, 132]);
        assert_eq!(old(b"RXGB", &[flat(7), red].concat()), [7, 0, 0, 255]);
        for code in [b"ATI1", b"BC4U"] {
            assert_eq!(old(code, &flat(100)), [100, 100, 100, 255]);
        }
        assert_eq!(new(81, &flat(127)), [255, 255, 255, 255]);
        assert_eq!(new(81, &flat(0x81)), [0, 0, 0, 255]);
        // Code 2 between the end values 255 and 0 is 6/7 of 255.
        assert_eq!(new(80, &[255, 0, 2, 0, 0, 0, 0, 0])[0], 219);
        // Blue is Z, computed from the normal's X and Y: it is 0 for 0.6 and 0.8, and 1 straight up.
        for (x, y, z) in [(204, 128, 229), (128, 128, 255), (204, 230, 128)] {
            let [red, green, blue, alpha] = old(b"ATI2", &[flat(x), flat(y)].concat());
            assert!([red, green, alpha] == [x, y, 255] && blue.abs_diff(z) <= 6, "{x} {y}: {blue}");
        }
        // Mode 5 of BC7 with both ends (254, 0, 254) and alpha 255: bit 5, ends of 7 bits, alpha of 8.
        let ends = 127_u128 | 127 << 7 | 127 << 28 | 127 << 35 | 255 << 42 | 255 << 50;
        assert_eq!(new(98, &(1_u128 << 5 | ends << 8).to_le_bytes()), [255, 0, 255, 255]);
        // Mode 11 of BC6H, with ends of 10 bits: 0x180 becomes the half float 0x2e8f.
        let ends = 0x180_u128 | 0x180 << 30;
        let light =
            DdsSurface::open(&file([4, 4], (0x4, [0; 4], 0, [0; 4]), Some(95), &(3_u128 | ends << 5).to_le_bytes()))
                .and_then(|own| own.decode())
                .expect("decoded");
        assert!(matches!(light, DynamicImage::ImageRgba32F(_)));
        let [red, green, ..] = light.to_rgba32f().get_pixel(3, 3).0;
        assert!((red - 0.1025).abs() < 0.005 && green == 0.0, "{red} {green}");
    }

    #[test]
    fn edges_that_are_no_multiple_of_four_are_cut() {
        let bytes =
            file([5, 3], (0x4, *b"DXT1", 0, [0; 4]), None, &[0x00, 0xf8, 0, 0, 0, 0, 0, 0, 0x1f, 0, 0, 0, 0, 0, 0, 0]);
        let image = DdsSurface::open(&bytes).and_then(|own| own.decode()).expect("decoded").to_rgba8();
        assert_eq!((image.dimensions(), image.get_pixel(3, 2).0), ((5, 3), [255, 0, 0, 255]));
        assert_eq!(image.get_pixel(4, 2).0, [0, 0, 255, 255]);
    }

    #[test]
    fn other_formats_and_short_files_are_named() {
        let error = |bytes: &[u8]| match DdsSurface::open(bytes) {
            Ok(surface) => surface.decode().expect_err("refused"),
            Err(why) => why,
        };
        let plain = (0x4, *b"YUY2", 0, [0; 4]);
        assert!(error(&file([1, 1], plain, None, &[0; 4])).contains("`YUY2`"));
        assert!(error(&file([1, 1], plain, Some(130), &[0; 4])).contains("DXGI format 130"));
        assert!(error(&file([1, 1], (0x20, [0; 4], 8, [0; 4]), None, &[0; 4])).contains("a palette"));
        assert!(error(&file([1, 1], (0x40, [0; 4], 40, [0; 4]), None, &[0; 4])).contains("40 bits"));
        assert!(error(&file([8, 8], (0x4, *b"DXT1", 0, [0; 4]), None, &[0; 8])).contains("8x8 texels need 32 bytes"));
        assert!(error(&file([u32::MAX; 2], (0x4, *b"DXT1", 0, [0; 4]), None, &[0; 8])).contains("need"));
        assert!(error(b"DDS ").contains("bits"));
        let mut cube = file([1, 1], (0x40, [0; 4], 8, [0xff, 0, 0, 0]), None, &[0; 6]);
        cube[113] = 0x02;
        assert!(DdsSurface::open(&cube).expect("open").more.is_some_and(|what| what.contains("cube map")));
    }
}
