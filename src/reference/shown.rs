//! What a display shows of the truth: exposed light through the tone curve, as codes of 8 bits.

use glam::DVec3;

use super::tonemap::{encode_srgb, tone_map};
use crate::scene::Settings;

/// Where a pixel is in a picture: its column and row from the top left, and the picture's width and height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pixel {
    pub place: [u32; 2],
    pub size: [u32; 2],
}

impl Pixel {
    /// The pixel with this number, row by row from the top left.
    pub fn numbered(index: usize, size: [u32; 2]) -> Self {
        let index = index as u32;
        Self { place: [index % size[0], index / size[0]], size }
    }
}

/// The sRGB codes of exposed light (1 is where the sensor saturates) at a pixel.
pub fn shown(exposed: DVec3, settings: &Settings, _: Pixel) -> [u8; 3] {
    tone_map::<f64>(exposed, settings.tonemap).to_array().map(|linear| (encode_srgb(linear) * 255.0).round() as u8)
}
