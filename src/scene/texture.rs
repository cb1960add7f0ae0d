//! Decoded images.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::math::Vec2;
use exr::meta::attribute::ChannelList;
use exr::meta::{BlockDescription, MetaData};
use image::{DynamicImage, ImageError, ImageFormat, ImageReader, Limits, RgbaImage};

use super::{Error, Texels};
use crate::regular_file::read_regular;

/// Longest edge of a texture, in texels: the limit of desktop devices.
pub const MAX_TEXTURE_EDGE: u32 = 16384;

/// The most that decoding one image may allocate: the largest texture of 8-bit RGBA.
const MAX_DECODED_BYTES: u64 = 4 * (MAX_TEXTURE_EDGE as u64) * (MAX_TEXTURE_EDGE as u64);

/// The meaning of the values of texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// RGB is sRGB-encoded, alpha linear.
    Srgb,
    /// The values are proportional to what they stand for.
    Linear,
}

/// The texture's continuation outside 0..1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored, and again.
    Mirror,
    /// The texels of the edge.
    Clamp,
}

/// The filter over the texels, or the levels, around a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Filter {
    /// The value of the nearest one.
    Nearest,
    /// Their mean by distance.
    #[default]
    Linear,
}

/// The sampling of a texture: how it goes on beyond its edges, and its filters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sampler {
    /// Along U and V.
    pub wrap: [Wrap; 2],
    /// The filter for texels larger than a pixel.
    pub magnify: Filter,
    /// The filter for texels smaller than a pixel.
    pub minify: Filter,
    /// The filter between levels; `None` samples the largest level only.
    pub levels: Option<Filter>,
}

impl Sampler {
    /// Returns true if texels and levels blend into each other everywhere. A texel that is meant to have an edge would be softened by filtering from several places.
    pub fn softens(&self) -> bool {
        [Some(self.magnify), Some(self.minify), self.levels] == [Some(Filter::Linear); 3]
    }

    /// Repeated, linear between texels and levels.
    pub const DEFAULT: Self =
        Self { wrap: [Wrap::Repeat; 2], magnify: Filter::Linear, minify: Filter::Linear, levels: Some(Filter::Linear) };
}

impl Default for Sampler {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// An image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texture {
    /// For messages and reports.
    pub name: String,
    /// Width and height in texels, both at least 1.
    pub size: [u32; 2],
    /// The encoding of RGB.
    pub color_space: ColorSpace,
    /// Its sampler.
    pub sampler: Sampler,
    /// Its contents.
    pub texels: Texels,
}

impl Texture {
    pub(crate) fn from_image(name: impl Into<String>, image: RgbaImage, color_space: ColorSpace) -> Self {
        let size = [image.width(), image.height()];
        Self { name: name.into(), size, color_space, sampler: Sampler::DEFAULT, texels: image.into_raw().into() }
    }
}

/// Reads an image file: PNG, JPEG, TGA, BMP or OpenEXR, told apart by content rather than by name.
///
/// # Errors
/// `Error::Read` when the file cannot be read; `Error::Content` when it is no such image, when its header claims an edge above
/// [`MAX_TEXTURE_EDGE`] (which is refused before anything is allocated), or when a texel is infinite or no number.
pub(crate) fn read_image(path: &Path, color_space: ColorSpace) -> Result<RgbaImage, Error> {
    let bytes = read_regular(path, MAX_DECODED_BYTES);
    let bytes = bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?;
    decode_image(&bytes, path, color_space)
}

/// Decodes an image. Decoders panic at some damaged files (zune-jpeg 0.5.15 where a component is shorter than its rows): that is an error here.
///
/// # Errors
/// As [`ImageReader::decode`].
pub fn decode(bytes: &[u8], format: ImageFormat, limits: Limits) -> Result<DynamicImage, ImageError> {
    let failed = |why: String| Err(ImageError::IoError(std::io::Error::other(why)));
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        if let Some(claim) = (format == ImageFormat::OpenExr).then(|| too_much_claimed(bytes)).flatten() {
            return failed(claim);
        }
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(limits);
        reader.decode()
    }));
    decoded.unwrap_or_else(|_| failed("it makes its decoder fail".into()))
}

/// Says which data window or tile of an OpenEXR file is too large for the file. The decoder (exr 1.74.2) allocates them before it misses the texels, and
/// checks the display window alone against its limits.
fn too_much_claimed(bytes: &[u8]) -> Option<String> {
    // Lossy compression in blocks of 256 rows packs a picture of one colour the most, by some 50,000.
    const MOST_PACKED: usize = 1 << 17;
    let most = bytes.len().saturating_mul(MOST_PACKED);
    let claim = |what: &str, size: Vec2<usize>, channels: &ChannelList| {
        let needed = size.0.saturating_mul(size.1).saturating_mul(channels.bytes_per_pixel);
        let told =
            || format!("a {what} of {}x{} texels has {needed} bytes, and the file {}", size.0, size.1, bytes.len());
        (needed > most).then(told)
    };
    let headers = MetaData::read_from_buffered(bytes, false).ok()?.headers;
    headers.iter().find_map(|header| {
        let tile = match header.blocks {
            BlockDescription::Tiles(tiles) => tiles.tile_size,
            BlockDescription::ScanLines => Vec2(0, 0),
        };
        let window = claim("data window", header.layer_size, &header.channels);
        window.or_else(|| claim("tile", tile, &header.channels))
    })
}

/// Decodes a texture; `path` names it in errors and, for TGA, which has no mark of its own, says the format.
pub(crate) fn decode_image(bytes: &[u8], path: &Path, color_space: ColorSpace) -> Result<RgbaImage, Error> {
    let wrong = |what: String| Error::Content { path: path.to_owned(), line: None, what };
    let tga = || ImageFormat::from_path(path).ok().filter(|&format| format == ImageFormat::Tga);
    let Some(format) = image::guess_format(bytes).ok().or_else(tga) else {
        return Err(wrong("is not an image (PNG, JPEG, TGA, BMP and OpenEXR can be read)".into()));
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_EDGE);
    limits.max_image_height = Some(MAX_TEXTURE_EDGE);
    limits.max_alloc = Some(MAX_DECODED_BYTES);
    let image = decode(bytes, format, limits).map_err(|error| match error {
        ImageError::Limits(_) => wrong(format!("is larger than {MAX_TEXTURE_EDGE}x{MAX_TEXTURE_EDGE} texels")),
        error => wrong(format!("cannot be decoded: {}", error.to_string().replace('\n', " "))),
    })?;
    if image.width() == 0 || image.height() == 0 {
        return Err(wrong("has no texels".into()));
    }
    if let Some([x, y]) = not_finite(&image) {
        return Err(wrong(format!("texel ({x}, {y}), counted from the upper left corner, is not a finite number")));
    }
    Ok(to_rgba8(image, color_space))
}

/// The first texel of an image of floats with a channel that is infinite or no number.
fn not_finite(image: &DynamicImage) -> Option<[usize; 2]> {
    let (channels, values) = match image {
        DynamicImage::ImageRgb32F(image) => (3, image.as_raw()),
        DynamicImage::ImageRgba32F(image) => (4, image.as_raw()),
        _ => return None,
    };
    let texel = values.iter().position(|value| !value.is_finite())? / channels;
    let width = image.width() as usize;
    Some([texel % width, texel / width])
}

fn to_rgba8(image: DynamicImage, color_space: ColorSpace) -> RgbaImage {
    let is_float = matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    if !is_float || color_space == ColorSpace::Linear {
        return image.into_rgba8();
    }
    // Float images are linear; storing them as sRGB means encoding them.
    let mut image = image.into_rgba32f();
    for pixel in image.pixels_mut() {
        pixel.0[..3].iter_mut().for_each(|channel| *channel = srgb_encode(*channel));
    }
    DynamicImage::ImageRgba32F(image).into_rgba8()
}

/// IEC 61966-2-1, for 0 to 1; clamps.
pub(super) fn srgb_encode(linear: f32) -> f32 {
    let linear = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(bytes: &[u8], name: &str) -> String {
        decode_image(bytes, Path::new(name), ColorSpace::Srgb).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_image_is_named() {
        assert!(error_of(b"hello", "a/wall.png").starts_with("a/wall.png: is not an image"));
        assert!(error_of(b"", "wall.jpg").contains("is not an image"));
        assert!(error_of(b"\x89PNG\r\n\x1a\ncut", "wall.png").contains("cannot be decoded"));
        assert!(matches!(read_image(Path::new("/no/such.png"), ColorSpace::Srgb), Err(Error::Read { .. })));
    }

    #[test]
    fn a_file_that_makes_its_decoder_panic_is_refused() {
        // Found by fuzzing.
        let jpeg = include_bytes!("../../fuzz/corpus/image/short-component.jpg");
        assert!(error_of(jpeg, "wall.jpg").contains("cannot be decoded: it makes its decoder fail"));
    }

    #[test]
    fn a_tile_that_its_file_cannot_fill_is_refused() {
        // Found by fuzzing: exr takes 1.7 GB before it refuses the file.
        let exr = include_bytes!("../../fuzz/corpus/sky_exr/wide-window.exr");
        let error = error_of(exr, "sky.exr");
        assert!(error.contains("a tile of") && error.ends_with("and the file 916"), "{error}");
    }

    #[test]
    fn a_header_that_claims_too_much_is_refused() {
        let mut png = Vec::new();
        RgbaImage::new(1, 1).write_to(&mut Cursor::new(&mut png), ImageFormat::Png).unwrap();
        // Width and height of IHDR, and its checksum.
        let mut header =
            [b"IHDR".as_slice(), &100_000_u32.to_be_bytes(), &100_000_u32.to_be_bytes(), &png[24..29]].concat();
        header.extend(crc32(&header).to_be_bytes());
        png.splice(12..33, header);
        assert!(error_of(&png, "huge.png").contains("larger than 16384x16384"), "{}", error_of(&png, "huge.png"));
    }

    fn crc32(bytes: &[u8]) -> u32 {
        let step = |crc: u32, byte: &u8| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
        };
        !bytes.iter().fold(!0, step)
    }

    #[test]
    fn a_float_image_with_a_texel_that_is_no_number_is_refused_by_its_place() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for channel in 0..4 {
                let mut image = image::Rgba32FImage::from_pixel(3, 2, image::Rgba([0.5; 4]));
                image.get_pixel_mut(1, 1).0[channel] = bad;
                let mut exr = Vec::new();
                image.write_to(&mut Cursor::new(&mut exr), ImageFormat::OpenExr).unwrap();
                let error = error_of(&exr, "sky.exr");
                assert!(error.starts_with("sky.exr: texel (1, 1), counted") && error.contains("finite"), "{error}");
            }
        }
        let mut exr = Vec::new();
        let image = image::Rgb32FImage::from_pixel(3, 2, image::Rgb([0.5, 1e30, -1.0]));
        image.write_to(&mut Cursor::new(&mut exr), ImageFormat::OpenExr).unwrap();
        assert!(decode_image(&exr, Path::new("sky.exr"), ColorSpace::Linear).is_ok());
    }

    #[test]
    fn float_images_are_encoded_for_srgb() {
        let image = image::Rgba32FImage::from_pixel(1, 1, image::Rgba([0.2159, 2.0, -1.0, 0.5]));
        let encoded = to_rgba8(DynamicImage::ImageRgba32F(image), ColorSpace::Srgb);
        assert_eq!(encoded.get_pixel(0, 0).0, [128, 255, 0, 128]);
    }
}
