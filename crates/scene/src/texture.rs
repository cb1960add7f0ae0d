//! Decoded images.

#[cfg(feature = "readers")]
mod read;

use super::Texels;

#[cfg(feature = "readers")]
pub use read::{DecodedImage, decode, decode_image, read_image};
#[cfg(feature = "readers")]
pub(super) use read::{decode_light, format_of, srgb_decode};

/// Longest edge of a texture, in texels: the limit of desktop devices.
pub const MAX_TEXTURE_EDGE: u32 = 16384;

/// The meaning of the values of texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// RGB is sRGB-encoded, alpha linear.
    Srgb,
    /// The values are linear.
    Linear,
}

/// The texture's continuation outside 0..1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Wrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Mirrors the image, and repeats.
    Mirror,
    /// Repeats the texels of the edge.
    Clamp,
}

/// The filter over the texels, or the levels, around a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Filter {
    /// Takes the value of the nearest one.
    Nearest,
    /// Interpolates linearly.
    #[default]
    Linear,
}

/// The sampling of a texture: how it goes on beyond its edges, and its filters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sampler {
    /// Continuation along U and V.
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
    /// The name in messages and reports.
    pub name: String,
    /// Width and height in texels, both at least 1.
    pub size: [u32; 2],
    /// The encoding of RGB.
    pub color_space: ColorSpace,
    /// The sampling.
    pub sampler: Sampler,
    /// The contents.
    pub texels: Texels,
}

/// IEC 61966-2-1, for 0 to 1; clamps.
pub(super) fn srgb_encode(linear: f32) -> f32 {
    let linear = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
