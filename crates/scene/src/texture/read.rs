//! Reads image files.

mod dds;
mod dds_formats;
mod exr_file;
mod exr_rates;
mod radiance;

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::math::Vec2;
use exr::meta::attribute::ChannelList;
use exr::meta::{BlockDescription, MetaData};
use image::{DynamicImage, ImageError, ImageFormat, ImageReader, Limits, Rgba32FImage, RgbaImage};

use self::dds::DdsSurface;
use super::{ColorSpace, MAX_TEXTURE_EDGE, Sampler, Texture, srgb_encode};
use crate::Error;
use afterlight_files::regular_file::read_regular;

/// The most that decoding one image may allocate: the largest texture of 8-bit RGBA.
const MAX_DECODED_BYTES: u64 = 4 * (MAX_TEXTURE_EDGE as u64) * (MAX_TEXTURE_EDGE as u64);

impl Texture {
    /// A texture of a picture's own size with one level and the default sampler. Needs the feature `readers`.
    pub(crate) fn from_image(name: impl Into<String>, image: RgbaImage, color_space: ColorSpace) -> Self {
        let size = [image.width(), image.height()];
        Self { name: name.into(), size, color_space, sampler: Sampler::DEFAULT, texels: image.into_raw().into() }
    }
}

/// The formats that are read, for messages.
const READS: &str = "PNG, JPEG, TGA, BMP, GIF, TIFF, DDS, WebP, PNM, QOI, Radiance HDR and OpenEXR can be read";

/// A decoded image file.
pub struct DecodedImage {
    image: DynamicImage,
    /// The number of its values that had to be mended.
    pub warning: Option<String>,
}

impl DecodedImage {
    /// The texels, rounded to 8 bits.
    pub fn rgba8(&self, color_space: ColorSpace) -> RgbaImage {
        to_rgba8(&self.image, color_space)
    }

    /// The texels from 0 to 1 if the file has more than 8 bits a channel.
    pub fn beyond_8_bits(&self) -> Option<Rgba32FImage> {
        use DynamicImage::{ImageLuma8, ImageLumaA8, ImageRgb8, ImageRgba8};
        match self.image {
            ImageLuma8(_) | ImageLumaA8(_) | ImageRgb8(_) | ImageRgba8(_) => None,
            _ => Some(self.image.to_rgba32f()),
        }
    }
}

/// Reads an image file, whose format is told by its content rather than by its name.
///
/// # Errors
/// `Error::Read` when the file cannot be read; `Error::Content` when it is no image that can be decoded, or when its header claims an edge above
/// [`MAX_TEXTURE_EDGE`], which is refused before anything is allocated.
pub fn read_image(path: &Path) -> Result<DecodedImage, Error> {
    let bytes = read_regular(path, MAX_DECODED_BYTES);
    let bytes = bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?;
    decode_image(&bytes, path)
}

/// Decodes an image. Decoders panic at some damaged files (zune-jpeg 0.5.15 where a component is shorter than its rows): that is an error here.
///
/// # Errors
/// As [`ImageReader::decode`].
pub fn decode(bytes: &[u8], format: ImageFormat, limits: Limits) -> Result<DynamicImage, ImageError> {
    if matches!(format, ImageFormat::OpenExr | ImageFormat::Hdr) {
        let most = limits.max_alloc.unwrap_or(u64::MAX);
        let edge = limits.max_image_width.into_iter().chain(limits.max_image_height).min().unwrap_or(u32::MAX);
        let fault = |[width, height]: [u32; 2]| {
            let bytes = u64::from(width).saturating_mul(u64::from(height)).saturating_mul(16);
            (width.max(height) > edge || bytes > most).then(|| format!("it is {width}x{height}, which is too large"))
        };
        let decoded = decode_light(bytes, format, most, &fault);
        return decoded.map_err(|why| ImageError::IoError(std::io::Error::other(why)));
    }
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        let other = |why: String| ImageError::IoError(std::io::Error::other(why));
        if format == ImageFormat::Dds {
            let surface = DdsSurface::open(bytes).map_err(other)?;
            limits.check_dimensions(surface.size[0], surface.size[1])?;
            limits.clone().reserve(surface.decoded_bytes())?;
            return surface.decode().map_err(other);
        }
        let read = |bytes: &[u8]| {
            let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
            reader.limits(limits.clone());
            reader.decode()
        };
        match read(bytes) {
            // All texels may be there, and the end alone be missing.
            Err(error) if format == ImageFormat::Png => read(&[bytes, END_OF_PNG].concat()).map_err(|_| error),
            read => read,
        }
    }));
    decoded.unwrap_or_else(|_| Err(ImageError::IoError(std::io::Error::other(FAILS))))
}

/// The last chunk of a PNG (PNG, third edition, section 11.2.5).
const END_OF_PNG: &[u8] = b"\0\0\0\0IEND\xae\x42\x60\x82";

/// The error of a file whose decoder panics.
const FAILS: &str = "it makes its decoder fail";

/// Decodes OpenEXR or Radiance HDR to linear Rec. 709. `fault` checks the size before the picture is allocated; the
/// decoder may allocate `most_bytes`.
///
/// # Errors
/// The fault of its size, or why it cannot be decoded.
pub(crate) fn decode_light(
    bytes: &[u8],
    format: ImageFormat,
    most_bytes: u64,
    fault: &dyn Fn([u32; 2]) -> Option<String>,
) -> Result<DynamicImage, String> {
    let mut limits = Limits::default();
    limits.max_alloc = Some(most_bytes);
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        if format == ImageFormat::Hdr {
            return radiance::read_radiance(bytes, fault, limits).map(DynamicImage::ImageRgb32F);
        }
        if let Some(claim) = too_much_claimed(bytes) {
            return Err(claim);
        }
        exr_file::read_exr(bytes, fault).map(DynamicImage::ImageRgba32F)
    }));
    decoded.unwrap_or_else(|_| Err(FAILS.into()))
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
    let headers = MetaData::read_from_buffered(&*exr_rates::whole(bytes).0, false).ok()?.headers;
    headers.iter().find_map(|header| {
        let tile = match header.blocks {
            BlockDescription::Tiles(tiles) => tiles.tile_size,
            BlockDescription::ScanLines => Vec2(0, 0),
        };
        let window = claim("data window", header.layer_size, &header.channels);
        window.or_else(|| claim("tile", tile, &header.channels))
    })
}

/// The format of an image by its content; TGA, which has no mark at its start, is asked for last.
pub(crate) fn format_of(bytes: &[u8], path: &Path) -> Option<ImageFormat> {
    if bytes.starts_with(b"#?") {
        return Some(ImageFormat::Hdr);
    }
    let is_tga = || {
        let is_named = ImageFormat::from_path(path).is_ok_and(|format| format == ImageFormat::Tga);
        is_named || bytes.ends_with(b"TRUEVISION-XFILE.\0") || has_tga_header(bytes)
    };
    image::guess_format(bytes).ok().or_else(|| is_tga().then_some(ImageFormat::Tga))
}

/// Returns true if the first 18 bytes are a valid TGA header.
fn has_tga_header(bytes: &[u8]) -> bool {
    let Some(&[_, has_map, kind, _, _, _, _, map_bits, _, _, _, _, w, w_high, h, h_high, bits, _]) =
        bytes.first_chunk()
    else {
        return false;
    };
    let has_size = (w | w_high) != 0 && (h | h_high) != 0;
    let is_kind = match kind {
        1 | 9 => has_map == 1 && bits == 8 && matches!(map_bits, 15 | 16 | 24 | 32),
        2 | 10 => has_map == 0 && matches!(bits, 15 | 16 | 24 | 32),
        3 | 11 => has_map == 0 && matches!(bits, 8 | 16),
        _ => false,
    };
    has_size && is_kind
}

/// Decodes a texture; `path` names it in errors. Values that are infinite or no number are mended, with a warning.
pub fn decode_image(bytes: &[u8], path: &Path) -> Result<DecodedImage, Error> {
    let wrong = |what: String| Error::Content { path: path.to_owned(), line: None, what };
    let Some(format) = format_of(bytes, path) else {
        return Err(wrong(format!("is not an image ({READS})")));
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_EDGE);
    limits.max_image_height = Some(MAX_TEXTURE_EDGE);
    limits.max_alloc = Some(MAX_DECODED_BYTES);
    let mut image = decode(bytes, format, limits).map_err(|error| match error {
        ImageError::Limits(_) => wrong(format!("is larger than {MAX_TEXTURE_EDGE}x{MAX_TEXTURE_EDGE} texels")),
        error => wrong(format!("cannot be decoded: {}", error.to_string().replace('\n', " "))),
    })?;
    if image.width() == 0 || image.height() == 0 {
        return Err(wrong("has no texels".into()));
    }
    let mended = mend(&mut image);
    let mended = (mended > 0).then(|| format!("{mended} values are infinite or no number: they are taken for 1 or 0"));
    let more = (format == ImageFormat::Dds).then(|| DdsSurface::open(bytes).ok()?.more).flatten().map(str::to_owned);
    let told: Vec<String> = more.into_iter().chain(mended).collect();
    let warning = (!told.is_empty()).then(|| format!("{}: {}", path.display(), told.join("; ")));
    Ok(DecodedImage { image, warning })
}

/// Replaces infinities of a float image by 1 or 0 and NaN by 0. Returns the number of replaced values.
fn mend(image: &mut DynamicImage) -> usize {
    let values: &mut [f32] = match image {
        DynamicImage::ImageRgb32F(image) => image,
        DynamicImage::ImageRgba32F(image) => image,
        _ => return 0,
    };
    let mut count = 0;
    for value in values.iter_mut().filter(|value| !value.is_finite()) {
        *value = if *value == f32::INFINITY { 1.0 } else { 0.0 };
        count += 1;
    }
    count
}

fn to_rgba8(image: &DynamicImage, color_space: ColorSpace) -> RgbaImage {
    let is_float = matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    if !is_float || color_space == ColorSpace::Linear {
        return image.to_rgba8();
    }
    // Float images are linear; storing them as sRGB means encoding them.
    let mut image = image.to_rgba32f();
    for pixel in image.pixels_mut() {
        pixel.0[..3].iter_mut().for_each(|channel| *channel = srgb_encode(*channel));
    }
    DynamicImage::ImageRgba32F(image).into_rgba8()
}

/// IEC 61966-2-1, for 0 to 1.
pub(crate) fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(bytes: &[u8], name: &str) -> String {
        decode_image(bytes, Path::new(name)).err().expect("refused").to_string()
    }

    #[test]
    fn what_is_no_image_is_named() {
        assert!(error_of(b"hello", "a/wall.png").starts_with("a/wall.png: is not an image"));
        assert!(error_of(b"", "wall.jpg").contains("is not an image"));
        assert!(error_of(b"\x89PNG\r\n\x1a\ncut", "wall.png").contains("cannot be decoded"));
        assert!(matches!(read_image(Path::new("/no/such.png")), Err(Error::Read { .. })));
    }

    #[test]
    fn a_file_that_makes_its_decoder_panic_is_refused() {
        // Found by fuzzing.
        let jpeg = include_bytes!("../../../../fuzz/corpus/image/short-component.jpg");
        assert!(error_of(jpeg, "wall.jpg").contains("cannot be decoded: it makes its decoder fail"));
    }

    #[test]
    fn a_tile_that_its_file_cannot_fill_is_refused() {
        // Found by fuzzing: exr takes 1.7 GB before it refuses the file.
        let exr = include_bytes!("../../../../fuzz/corpus/sky_exr/wide-window.exr");
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
    fn values_of_a_float_image_that_are_no_number_are_mended_and_told() {
        let image = image::Rgba32FImage::from_fn(3, 1, |x, _| {
            image::Rgba(
                [[f32::NAN, 0.5, f32::INFINITY, 1.0], [0.5, 1e30, -1.0, 1.0], [f32::NEG_INFINITY, 0.0, 0.0, 1.0]]
                    [x as usize],
            )
        });
        let mut exr = Vec::new();
        image.write_to(&mut Cursor::new(&mut exr), ImageFormat::OpenExr).unwrap();
        let picture = decode_image(&exr, Path::new("wall.exr")).expect("an image");
        let warning = picture.warning.as_deref().expect("a warning");
        assert!(warning.starts_with("wall.exr: 3 values are infinite or no number"), "{warning}");
        let texels = picture.rgba8(ColorSpace::Linear);
        assert_eq!(texels.as_raw()[..], [0, 128, 255, 255, 128, 255, 0, 255, 0, 0, 0, 255]);
    }

    #[test]
    fn images_are_known_by_their_content_and_not_by_their_names() {
        let image = DynamicImage::ImageRgb8(image::RgbImage::from_fn(4, 2, |x, y| {
            image::Rgb([200, x as u8 * 50, y as u8 * 90])
        }));
        for format in [
            ImageFormat::Png,
            ImageFormat::Jpeg,
            ImageFormat::Tga,
            ImageFormat::Bmp,
            ImageFormat::Gif,
            ImageFormat::Tiff,
            ImageFormat::WebP,
            ImageFormat::Pnm,
            ImageFormat::Qoi,
        ] {
            let mut bytes = Vec::new();
            image.write_to(&mut Cursor::new(&mut bytes), format).expect("written");
            for name in ["wall.png", "wall.jpg", "wall.tga", "wall"] {
                assert_eq!(format_of(&bytes, Path::new(name)), Some(format), "{name}");
                let texels = decode_image(&bytes, Path::new(name)).expect("decoded").rgba8(ColorSpace::Srgb);
                assert_eq!((texels.dimensions(), texels.get_pixel(0, 0).0[3]), ((4, 2), 255), "{format:?}");
                let error = texels.get_pixel(3, 1).0.iter().zip([200u8, 150, 90]).map(|(a, b)| a.abs_diff(b)).max();
                let most = if format == ImageFormat::Jpeg { 60 } else { 0 };
                assert!(error <= Some(most), "{format:?}: {:?}", texels.get_pixel(3, 1));
            }
        }
    }

    #[test]
    fn a_dds_is_read_and_unknown_formats_are_refused_in_words() {
        let mut bytes = vec![0; 136];
        bytes[..8].copy_from_slice(b"DDS \x7c\0\0\0");
        // Flags, height, width; the pixel format's size, flag of a code, and code.
        for (at, value) in [(8, 0x1007_u32), (12, 4), (16, 4), (76, 32), (80, 4), (108, 0x1000)] {
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        }
        bytes[84..88].copy_from_slice(b"DXT1");
        // Two reds, of which all texels take the first.
        bytes[128..132].copy_from_slice(&[0x00, 0xf8, 0x00, 0xf8]);
        let texels = decode_image(&bytes, Path::new("wall.png")).expect("decoded").rgba8(ColorSpace::Srgb);
        assert_eq!((texels.dimensions(), texels.get_pixel(3, 3).0), ((4, 4), [255, 0, 0, 255]));
        bytes[84..88].copy_from_slice(b"UYVY");
        let error = error_of(&bytes, "wall.dds");
        assert!(error.contains("wall.dds: cannot be decoded: its format `UYVY` is not read"), "{error}");
        bytes[84..88].copy_from_slice(b"DXT1");
        bytes[113] = 0x02;
        let cube = decode_image(&bytes, Path::new("wall.dds")).expect("decoded");
        assert_eq!(cube.warning.as_deref(), Some("wall.dds: is a cube map, of which the first face is drawn"));
        bytes[17] = 0xff;
        assert!(error_of(&bytes, "wall.dds").contains("larger than 16384x16384"));
    }

    #[test]
    fn images_of_more_than_8_bits_keep_them_for_heights_and_are_rounded_for_colours() {
        let wide =
            image::ImageBuffer::from_fn(2, 1, |x, _| image::Luma([if x == 0 { 257_u16 * 100 + 129 } else { 40 }]));
        for format in [ImageFormat::Png, ImageFormat::Tiff] {
            let mut bytes = Vec::new();
            DynamicImage::ImageLuma16(wide.clone()).write_to(&mut Cursor::new(&mut bytes), format).expect("written");
            let picture = decode_image(&bytes, Path::new("heights")).expect("decoded");
            assert_eq!(picture.rgba8(ColorSpace::Linear).as_raw()[..], [101, 101, 101, 255, 0, 0, 0, 255]);
            let deep = picture.beyond_8_bits().expect("16 bits");
            assert!((deep.get_pixel(1, 0).0[0] - 40.0 / 65535.0).abs() < 1e-7);
        }
        let mut bytes = Vec::new();
        RgbaImage::new(1, 1).write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
        assert!(decode_image(&bytes, Path::new("a.png")).expect("decoded").beyond_8_bits().is_none());
    }

    #[test]
    fn a_png_without_its_end_is_read_and_one_without_texels_is_not() {
        let mut png = Vec::new();
        RgbaImage::from_pixel(9, 9, image::Rgba([7; 4]))
            .write_to(&mut Cursor::new(&mut png), ImageFormat::Png)
            .unwrap();
        let whole = png.len() - END_OF_PNG.len();
        let picture = decode_image(&png[..whole], Path::new("a.png")).expect("decoded");
        assert_eq!(picture.rgba8(ColorSpace::Linear).get_pixel(8, 8).0, [7; 4]);
        assert!(error_of(&png[..whole - 10], "a.png").contains("cannot be decoded"));
    }

    #[test]
    fn a_jpeg_for_printers_has_the_colours_of_its_inks() {
        // Of cyan, magenta, yellow and black, inverted as Adobe writes them: a picture that is red, green, blue and yellow.
        let jpeg = include_bytes!("../../../../fuzz/corpus/image/cmyk-quarters.jpg");
        let texels = decode_image(jpeg, Path::new("wall.jpg")).expect("decoded").rgba8(ColorSpace::Srgb);
        for (x, y, expected) in
            [(3, 3, [255, 0, 0]), (12, 3, [0, 255, 0]), (3, 12, [0, 0, 255]), (12, 12, [255, 255, 0])]
        {
            let [red, green, blue, alpha] = texels.get_pixel(x, y).0;
            let error =
                [red, green, blue].iter().zip(expected).map(|(own, other): (&u8, u8)| own.abs_diff(other)).max();
            assert!(error <= Some(6) && alpha == 255, "{x} {y}: {red} {green} {blue}");
        }
    }

    #[test]
    fn float_images_are_encoded_for_srgb() {
        let image = image::Rgba32FImage::from_pixel(1, 1, image::Rgba([0.2159, 2.0, -1.0, 0.5]));
        let encoded = to_rgba8(&DynamicImage::ImageRgba32F(image), ColorSpace::Srgb);
        assert_eq!(encoded.get_pixel(0, 0).0, [128, 255, 0, 128]);
    }
}
