//! The textures that an MTL's maps ask for: masks packed into alpha, heights turned into normals, shininess into roughness.

use std::path::{Path, PathBuf};

use image::imageops::{FilterType, resize};
use image::{GrayImage, Luma, Rgba, RgbaImage};

use super::normal_maps::{downwardness, looks_like_normals, normals_of_heights};
use crate::scene::texture::read_image;
use crate::scene::{ColorSpace, Error, Texture};

/// An image and which of its channels is meant (`-imfchan`), where only one is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Source {
    pub path: PathBuf,
    pub channel: Option<char>,
}

/// A texture that is to be made. Equal requests share one.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Request {
    /// sRGB colour (white without), and opacity from the mask or, without one, from the image itself.
    Color { image: Option<Source>, mask: Option<Source> },
    /// A normal map, or a height map of which one is made; `bump_scale` is f32 bits.
    Normal { image: Source, must_be_normals: bool, is_color_too: bool, bump_scale: u32 },
    /// Roughness in green and metalness in blue; with `shininess` (f32 bits) the first image scales that Phong exponent.
    MetallicRoughness { roughness: Option<Source>, shininess: Option<u32>, metallic: Option<Source> },
}

/// The result of a request.
pub(super) struct Made {
    /// None when the warning says why not.
    pub texture: Option<Texture>,
    pub warning: Option<String>,
    /// Some texel's opacity is below a half.
    pub has_holes: bool,
    /// For a normal map that came as such: the evidence that its green points down. The bump scale is still to be applied.
    pub downwardness: Option<f32>,
}

impl Request {
    /// The images that it is made of.
    pub fn sources(&self) -> impl Iterator<Item = &Source> {
        let (first, second) = match self {
            Self::Color { image, mask } => (image.as_ref(), mask.as_ref()),
            Self::Normal { image, .. } => (Some(image), None),
            Self::MetallicRoughness { roughness, metallic, .. } => (roughness.as_ref(), metallic.as_ref()),
        };
        first.into_iter().chain(second)
    }

    /// Reads the images and makes the texture.
    ///
    /// # Errors
    /// As `read_image`.
    pub fn make(&self) -> Result<Made, Error> {
        let made = |texture| Made { texture: Some(texture), warning: None, has_holes: false, downwardness: None };
        match self {
            Self::Color { image, mask } => {
                let texels = color(image.as_ref(), mask.as_ref())?;
                let has_holes = texels.pixels().any(|texel| texel.0[3] < 128);
                let name = file_name([image, mask].into_iter().flatten());
                Ok(Made { has_holes, ..made(Texture::from_image(name, texels, ColorSpace::Srgb)) })
            }
            Self::Normal { image, must_be_normals, is_color_too, bump_scale } => {
                let texels = read_image(&image.path, ColorSpace::Linear)?;
                let name = file_name([image]);
                if *must_be_normals || looks_like_normals(&texels) {
                    let downwardness = Some(downwardness(&texels));
                    return Ok(Made { downwardness, ..made(Texture::from_image(name, texels, ColorSpace::Linear)) });
                }
                if *is_color_too {
                    // A slip of exporters, Crytek's Sponza among them: colours are no heights.
                    let warning = Some(format!("bump map {} is the colour map too and left out", image.path.display()));
                    return Ok(Made { texture: None, warning, has_holes: false, downwardness: None });
                }
                let normals = normals_of_heights(&channel(&texels, image.channel), f32::from_bits(*bump_scale));
                Ok(made(Texture::from_image(name, normals, ColorSpace::Linear)))
            }
            Self::MetallicRoughness { roughness, shininess, metallic } => {
                let texels = metallic_roughness(roughness.as_ref(), shininess.map(f32::from_bits), metallic.as_ref())?;
                let name = file_name([roughness, metallic].into_iter().flatten());
                Ok(made(Texture::from_image(name, texels, ColorSpace::Linear)))
            }
        }
    }
}

/// Perceptual roughness whose GGX highlight is as wide as Phong's with this exponent: alpha = sqrt(2 / (Ns + 2)) (Walter et al.
/// 2007, by way of Karis 2013), of which perceptual roughness is the square root.
pub(super) fn roughness_of_shininess(shininess: f32) -> f32 {
    (2.0 / (shininess.max(0.0) + 2.0)).powf(0.25)
}

fn file_name<'a>(sources: impl IntoIterator<Item = &'a Source>) -> String {
    let name = |path: &Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    sources.into_iter().map(|source| name(&source.path)).collect::<Vec<_>>().join("+")
}

fn color(image: Option<&Source>, mask: Option<&Source>) -> Result<RgbaImage, Error> {
    let color = image.map(|source| read_image(&source.path, ColorSpace::Srgb)).transpose()?;
    let Some(mask) = mask else {
        return Ok(color.unwrap_or_else(|| RgbaImage::from_pixel(1, 1, Rgba([255; 4]))));
    };
    let opacity = read_image(&mask.path, ColorSpace::Linear)?;
    // An alpha channel that is not opaque all over is the mask; else the image's brightness is.
    let has_alpha = mask.channel.is_none() && opacity.pixels().any(|texel| texel.0[3] < 255);
    let opacity = channel(&opacity, if has_alpha { Some('m') } else { mask.channel });
    let color = color.unwrap_or_else(|| RgbaImage::from_pixel(opacity.width(), opacity.height(), Rgba([255; 4])));
    let size = (color.width().max(opacity.width()), color.height().max(opacity.height()));
    let mut color = resized_rgba(color, size);
    let opacity = resized(opacity, size);
    for (texel, opacity) in color.pixels_mut().zip(opacity.pixels()) {
        texel.0[3] = opacity.0[0];
    }
    Ok(color)
}

fn resized_rgba(image: RgbaImage, size: (u32, u32)) -> RgbaImage {
    if image.dimensions() == size { image } else { resize(&image, size.0, size.1, FilterType::Triangle) }
}

fn resized(image: GrayImage, size: (u32, u32)) -> GrayImage {
    if image.dimensions() == size { image } else { resize(&image, size.0, size.1, FilterType::Triangle) }
}

/// One channel by `-imfchan`'s letter; Rec. 709 luma without.
fn channel(image: &RgbaImage, letter: Option<char>) -> GrayImage {
    let pick = |[r, g, b, a]: [u8; 4]| match letter {
        Some('r') => r,
        Some('g') => g,
        Some('b') => b,
        Some('m') => a,
        // In 1/256: 0.2126, 0.7152, 0.0722.
        _ => ((u32::from(r) * 54 + u32::from(g) * 183 + u32::from(b) * 19) >> 8) as u8,
    };
    GrayImage::from_fn(image.width(), image.height(), |x, y| Luma([pick(image.get_pixel(x, y).0)]))
}

fn metallic_roughness(
    roughness: Option<&Source>,
    shininess: Option<f32>,
    metallic: Option<&Source>,
) -> Result<RgbaImage, Error> {
    let read = |source: Option<&Source>| -> Result<GrayImage, Error> {
        let Some(source) = source else { return Ok(GrayImage::from_pixel(1, 1, Luma([255]))) };
        Ok(channel(&read_image(&source.path, ColorSpace::Linear)?, source.channel))
    };
    let (mut roughness, metallic) = (read(roughness)?, read(metallic)?);
    if let Some(shininess) = shininess {
        for texel in roughness.pixels_mut() {
            let exponent = f32::from(texel.0[0]) / 255.0 * shininess;
            texel.0[0] = (roughness_of_shininess(exponent) * 255.0).round() as u8;
        }
    }
    let size = (roughness.width().max(metallic.width()), roughness.height().max(metallic.height()));
    let (roughness, metallic) = (resized(roughness, size), resized(metallic, size));
    let mut packed = RgbaImage::new(size.0, size.1);
    for ((texel, roughness), metallic) in packed.pixels_mut().zip(roughness.pixels()).zip(metallic.pixels()) {
        *texel = Rgba([0, roughness.0[0], metallic.0[0], 255]);
    }
    Ok(packed)
}
