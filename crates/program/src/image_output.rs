//! Pictures as files.

use std::io::Cursor;
use std::path::Path;

use afterlight::frame::{Picture, Pixels};
use exr::image::{Encoding, Image, Layer, SpecificChannels};
use exr::math::Vec2;
use exr::meta::attribute::LineOrder;
use exr::meta::header::LayerAttributes;
use exr::prelude::WritableImage as _;
use image::codecs::png::PngEncoder;
use image::error::EncodingError;
use image::{ExtendedColorType, ImageEncoder, ImageError, ImageFormat, ImageResult};

use super::failure::{Exit, Failure};
use super::output::Sink;
use super::video::{self, Video};

/// The format of a picture's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// 8-bit sRGB.
    Png,
    /// Linear 32-bit floats, in nits.
    Exr,
    /// A video of several pictures in 8-bit sRGB.
    Video,
}

/// The destination of a picture, and its format there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Destination {
    pub sink: Sink,
    pub format: PictureFormat,
}

impl Destination {
    /// The format follows from the file's name; standard output is PNG.
    pub fn parse(text: &str) -> Result<Self, String> {
        match Self::parse_with_videos(text)? {
            Self { format: PictureFormat::Video, .. } => Err("a video is of several pictures; use .png or .exr".into()),
            picture => Ok(picture),
        }
    }

    /// As [`Destination::parse`], for commands that may draw several pictures.
    pub fn parse_with_videos(text: &str) -> Result<Self, String> {
        let sink = Sink::parse(text)?;
        let extension = Path::new(text).extension().map(|extension| extension.to_string_lossy().to_lowercase());
        let format = match (&sink, extension.as_deref()) {
            (Sink::Stdout, _) | (Sink::File(_), Some("png")) => PictureFormat::Png,
            (Sink::File(_), Some("exr")) => PictureFormat::Exr,
            (Sink::File(_), Some(other)) if video::EXTENSIONS.contains(&other) => PictureFormat::Video,
            // Writing refuses a folder as a folder; a message about its extension would mislead.
            (Sink::File(path), _) if path.is_dir() => PictureFormat::Png,
            (Sink::File(_), Some(other)) => {
                return Err(format!(
                    "'.{other}' is not written; use .png or .exr; of several pictures `render` makes .mp4, .webm, .mov or .gif"
                ));
            }
            (Sink::File(_), None) => return Err("the name must end in .png or .exr".into()),
        };
        Ok(Self { sink, format })
    }

    /// Returns the destination of one scene of several: `{name}` becomes the scene's name.
    pub fn named(&self, name: &str) -> Self {
        let Sink::File(path) = &self.sink else { return self.clone() };
        Self { sink: Sink::File(path.to_string_lossy().replace("{name}", name).into()), format: self.format }
    }

    /// Returns the destination of one picture of several: `walk.png` becomes `walk-0007.png`. Standard output takes them one after another.
    pub fn numbered(&self, index: u32, count: u32) -> Self {
        let Sink::File(path) = &self.sink else { return self.clone() };
        let digits = count.saturating_sub(1).to_string().len().max(4);
        let mut name = path.file_stem().unwrap_or_default().to_os_string();
        name.push(format!("-{index:0digits$}."));
        name.push(path.extension().unwrap_or_default());
        Self { sink: Sink::File(path.with_file_name(name)), format: self.format }
    }

    /// Starts a video with this frame rate, if the destination is a video.
    ///
    /// # Errors
    /// As [`Video::begin`].
    pub fn video(&self, fps: f64) -> Result<Option<Video>, Failure> {
        let Sink::File(path) = &self.sink else { return Ok(None) };
        let extension = path.extension().map(|own| own.to_string_lossy().to_lowercase()).unwrap_or_default();
        (self.format == PictureFormat::Video).then(|| Video::begin(&extension, fps)).transpose()
    }

    /// Adds the picture to a video.
    ///
    /// # Errors
    /// When it cannot be encoded.
    pub fn add_to(&self, video: &mut Video, picture: &Picture) -> Result<(), Failure> {
        video.add(&self.encoded(picture, false)?)
    }

    /// Encodes and writes the picture.
    ///
    /// # Errors
    /// When it cannot be encoded or written; then no file is left behind.
    pub fn write(&self, picture: &Picture) -> Result<(), Failure> {
        self.write_as(picture, false)
    }

    /// Writes a picture with its alpha.
    ///
    /// # Errors
    /// As [`Destination::write`].
    pub fn write_with_alpha(&self, picture: &Picture) -> Result<(), Failure> {
        self.write_as(picture, true)
    }

    fn write_as(&self, picture: &Picture, has_alpha: bool) -> Result<(), Failure> {
        self.sink.write(&self.encoded(picture, has_alpha)?)
    }

    fn encoded(&self, picture: &Picture, has_alpha: bool) -> Result<Vec<u8>, Failure> {
        encode(picture, self.format, has_alpha)
            .map_err(|error| Failure::new(Exit::BadInput, format!("cannot encode {}: {error}", self.sink)))
    }
}

/// Threads compress the tiles of an EXR file, and by default each tile stands where its thread was done: equal pictures had different bytes.
const ORDERED: Encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::FAST_LOSSLESS };

/// The bytes of a file with the picture, with or without its alpha. Pixels that are not of the format's kind are refused by the encoder.
fn encode(picture: &Picture, format: PictureFormat, has_alpha: bool) -> ImageResult<Vec<u8>> {
    let [width, height] = picture.size;
    let mut file = Cursor::new(Vec::new());
    match (&picture.pixels, format) {
        (Pixels::Srgb8(rgba), PictureFormat::Png | PictureFormat::Video) if has_alpha => {
            PngEncoder::new(&mut file).write_image(rgba, width, height, ExtendedColorType::Rgba8)?;
        }
        (Pixels::Srgb8(rgba), PictureFormat::Png | PictureFormat::Video) => {
            // Pictures are opaque: a quarter of the bytes would say so.
            let rgb = without_alpha(rgba);
            PngEncoder::new(&mut file).write_image(&rgb, width, height, ExtendedColorType::Rgb8)?;
        }
        (Pixels::LinearF32(rgba), PictureFormat::Exr) => {
            let size = Vec2(width as usize, height as usize);
            let at = |Vec2(x, y): Vec2<usize>| 4 * (y * size.0 + x);
            let attributes = LayerAttributes::default();
            let written = match has_alpha {
                true => {
                    let channels = SpecificChannels::rgba(|place| {
                        let at = at(place);
                        (rgba[at], rgba[at + 1], rgba[at + 2], rgba[at + 3])
                    });
                    Image::from_layer(Layer::new(size, attributes, ORDERED, channels)).write().to_buffered(&mut file)
                }
                false => {
                    let channels = SpecificChannels::rgb(|place| {
                        let at = at(place);
                        (rgba[at], rgba[at + 1], rgba[at + 2])
                    });
                    Image::from_layer(Layer::new(size, attributes, ORDERED, channels)).write().to_buffered(&mut file)
                }
            };
            written.map_err(|error| ImageError::Encoding(EncodingError::new(ImageFormat::OpenExr.into(), error)))?;
        }
        (Pixels::Srgb8(_), PictureFormat::Exr) => {
            return Err(mismatch("an EXR file needs linear pixels"));
        }
        (Pixels::LinearF32(_), PictureFormat::Png | PictureFormat::Video) => {
            return Err(mismatch("a PNG file needs 8-bit pixels"));
        }
    }
    Ok(file.into_inner())
}

fn without_alpha<T: Copy>(rgba: &[T]) -> Vec<T> {
    rgba.as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect()
}

fn mismatch(what: &str) -> image::ImageError {
    let kind = image::error::ParameterErrorKind::Generic(what.to_owned());
    image::ImageError::Parameter(image::error::ParameterError::from_kind(kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_follows_from_the_name() {
        let format = |text| Destination::parse(text).map(|target| target.format);
        assert_eq!(format("a.png"), Ok(PictureFormat::Png));
        assert_eq!(format("dir.x/a.EXR"), Ok(PictureFormat::Exr));
        assert_eq!(format("-"), Ok(PictureFormat::Png));
        for text in ["", "a", "a.jpg", ".png", "a.mp4"] {
            assert!(format(text).is_err(), "{text}");
        }
        assert_eq!(Destination::parse_with_videos("a.GIF").map(|target| target.format), Ok(PictureFormat::Video));
    }

    #[test]
    fn pictures_of_several_are_numbered_before_the_extension() {
        let name =
            |text, index, count| Destination::parse(text).expect("is a name").numbered(index, count).sink.to_string();
        assert_eq!(name("dir.x/walk.png", 7, 100), "dir.x/walk-0007.png");
        assert_eq!(name("a.b.EXR", 12_345, 100_001), "a.b-012345.EXR");
        assert_eq!(Destination::parse("-").map(|out| out.numbered(3, 9)), Destination::parse("-"));
    }

    #[test]
    fn equal_pictures_have_equal_bytes_whatever_thread_is_first() {
        let noise = (0..512 * 512).flat_map(|index: u32| {
            // Some tiles take longer than others.
            let value = if index % 512 < 64 { index.wrapping_mul(2_654_435_761) as f32 } else { 0.5 };
            [value, value * 0.5, index as f32, 1.0]
        });
        let picture = Picture { size: [512, 512], pixels: Pixels::LinearF32(noise.collect()) };
        let first = encode(&picture, PictureFormat::Exr, false).expect("encodes");
        for _ in 0..10 {
            assert!(encode(&picture, PictureFormat::Exr, false).expect("encodes") == first);
        }
        let header = exr::meta::MetaData::read_from_buffered(Cursor::new(first), true).expect("is an EXR");
        assert_eq!(header.headers[0].line_order, LineOrder::Increasing);
    }

    #[test]
    fn what_is_written_reads_back() {
        let png = Picture { size: [2, 1], pixels: Pixels::Srgb8(vec![1, 2, 3, 255, 4, 5, 6, 255]) };
        let bytes = encode(&png, PictureFormat::Png, false).expect("encodes");
        let back = image::load_from_memory(&bytes).expect("is a PNG").into_rgb8();
        assert_eq!((back.dimensions(), back.into_raw()), ((2, 1), vec![1, 2, 3, 4, 5, 6]));

        let clear = Picture { size: [1, 1], pixels: Pixels::Srgb8(vec![9, 8, 7, 100]) };
        let bytes = encode(&clear, PictureFormat::Png, true).expect("encodes");
        assert_eq!(image::load_from_memory(&bytes).expect("is a PNG").into_rgba8().into_raw(), vec![9, 8, 7, 100]);
        let clear = Picture { size: [1, 1], pixels: Pixels::LinearF32(vec![0.5, 1.0, 2.0, 0.25]) };
        let bytes = encode(&clear, PictureFormat::Exr, true).expect("encodes");
        assert_eq!(
            image::load_from_memory(&bytes).expect("is an EXR").into_rgba32f().into_raw(),
            vec![0.5, 1.0, 2.0, 0.25]
        );

        let exr = Picture { size: [1, 1], pixels: Pixels::LinearF32(vec![0.25, 70_000.0, 1e-6, 1.0]) };
        let bytes = encode(&exr, PictureFormat::Exr, false).expect("encodes");
        let back = image::load_from_memory(&bytes).expect("is an EXR").into_rgb32f();
        assert_eq!(back.into_raw(), vec![0.25, 70_000.0, 1e-6]);
    }

    #[test]
    fn pixels_of_the_wrong_kind_are_refused() {
        let picture = Picture { size: [1, 1], pixels: Pixels::LinearF32(vec![0.0; 4]) };
        assert!(encode(&picture, PictureFormat::Png, false).is_err());
    }
}
