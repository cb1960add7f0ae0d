//! Decoded images.

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// RGB is sRGB-encoded, alpha linear.
    Srgb,
    Linear,
}

/// A decoded image of 8-bit RGBA texels, rows from the top, repeated outside 0..1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Texture {
    pub name: String,
    /// Width and height in texels, both at least 1.
    pub size: [u32; 2],
    pub color_space: ColorSpace,
    /// 4 bytes a texel.
    pub texels: Vec<u8>,
}
