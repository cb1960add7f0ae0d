//! Pictures from files, as they are or as they are shown.

use std::path::Path;

use afterlight::scene::{Tonemap, decode, exposure_scale};
use afterlight_files::regular_file::read_regular;
use afterlight_truth::measure::{LinearImage, Srgb8Image};
use afterlight_truth::reference::tonemap::{encode_srgb, tone_map};
use glam::DVec3;
use image::{ColorType, DynamicImage, Limits};

use crate::failure::{Exit, Failure, with_causes};

/// The longest file that is read: some 60 million pixels of single floats.
const MOST_BYTES: u64 = 1 << 30;

/// The contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageFile {
    /// 8-bit sRGB.
    Shown(Srgb8Image),
    /// Linear; in nits where this program wrote it.
    Light(LinearImage),
}

impl ImageFile {
    /// Reads a file of any format that is known, by its content and not its name.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let failed = |why: String| Failure::new(Exit::BadInput, format!("cannot read {}: {why}", path.display()));
        let bytes = read_regular(path, MOST_BYTES).map_err(|error| failed(error.to_string()))?;
        let format = image::guess_format(&bytes).map_err(|error| failed(error.to_string()))?;
        let image = decode(&bytes, format, Limits::default()).map_err(|error| failed(with_causes(&error)))?;
        let size = [image.width(), image.height()];
        match image.color() {
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
                let pixels = image.into_rgb8().pixels().map(|pixel| pixel.0).collect();
                Ok(Self::Shown(Srgb8Image { size, pixels }))
            }
            ColorType::Rgb32F | ColorType::Rgba32F => Ok(Self::Light(light(size, image))),
            other => Err(failed(format!("its samples are {other:?}; 8-bit sRGB and linear floats are compared"))),
        }
    }

    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Shown(image) => image.size,
            Self::Light(image) => image.size,
        }
    }

    /// The picture as a screen has it. Only light needs the exposure and the tone mapper.
    pub fn shown(&self, ev100: f32, tonemap: Tonemap) -> Srgb8Image {
        match self {
            Self::Shown(image) => image.clone(),
            Self::Light(image) => show(&image.scaled(f64::from(exposure_scale(ev100))), tonemap),
        }
    }
}

fn light(size: [u32; 2], image: DynamicImage) -> LinearImage {
    let pixels = image.into_rgb32f().pixels().map(|pixel| pixel.0.map(f64::from)).collect();
    LinearImage { size, pixels }
}

/// Exposed light as codes. A pixel that is not finite is black, and light below 0 counts as none.
fn show(exposed: &LinearImage, tonemap: Tonemap) -> Srgb8Image {
    let code = |linear: f64| (encode_srgb(linear) * 255.0).round() as u8;
    let shown = |pixel: &[f64; 3]| {
        if pixel.iter().any(|sample| !sample.is_finite()) {
            return [0; 3];
        }
        let mapped = tone_map::<f64>(DVec3::from_array(*pixel).max(DVec3::ZERO), tonemap);
        mapped.to_array().map(code)
    };
    Srgb8Image { size: exposed.size, pixels: exposed.pixels.iter().map(shown).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_shown_exposed_and_what_is_not_finite_is_black() {
        // At EV100 0 the sensor saturates at 1.2 nits.
        let pixels = vec![[1.2; 3], [-1.0, 0.0, 0.0], [f64::NAN, 1.0, 1.0], [f64::INFINITY; 3], [0.6; 3]];
        let light = ImageFile::Light(LinearImage { size: [5, 1], pixels });
        let shown = light.shown(0.0, Tonemap::None).pixels;
        assert_eq!(shown, [[255; 3], [0; 3], [0; 3], [0; 3], [188; 3]]);
        assert_eq!(light.shown(1.0, Tonemap::None).pixels[0], [188; 3]);
        assert!(light.shown(0.0, Tonemap::Neutral).pixels[0][0] < 255);
    }
}
