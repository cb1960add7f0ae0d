//! The textures that an MTL's maps ask for: masks packed into alpha, heights turned into normals, shininess into roughness.

use std::path::{Path, PathBuf};

use image::imageops::{FilterType, resize};
use image::{GrayImage, Luma, Rgba, RgbaImage};

use super::normal_maps::{Heights, downwardness, looks_like_normals, normals_of_heights};
use crate::texture::{DecodedImage, read_image};
use crate::{ColorSpace, Sampler, Texture, Wrap};

/// An image and which of its channels is meant (`-imfchan`), where only one is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct MapImage {
    pub path: PathBuf,
    pub channel: Option<char>,
    /// True if the edge texels continue outside 0..1 (`-clamp on`).
    pub is_clamped: bool,
}

/// A texture that is to be made. Equal requests share one.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum MapRequest {
    /// sRGB colour (white without), and opacity from the mask or, without one, from the image itself.
    Color { image: Option<MapImage>, mask: Option<MapImage> },
    /// A normal map, or a height map of which one is made; `bump_scale` is f32 bits.
    Normal { image: MapImage, must_be_normals: bool, is_color_too: bool, bump_scale: u32 },
    /// Roughness in green and metalness in blue; with `shininess` (f32 bits) the first image scales that Phong exponent.
    MetallicRoughness { roughness: Option<MapImage>, shininess: Option<u32>, metallic: Option<MapImage> },
}

/// The opacity of a colour texture's texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum TextureOpacity {
    /// Every texel is at least half opaque, and most are nearly opaque.
    #[default]
    Whole,
    /// Below a half somewhere: a sheet with holes.
    Holes,
    /// Neither nearly 0 nor nearly whole in most texels: glass, smoke.
    Soft,
}

/// The result of a request.
#[derive(Default)]
pub(super) struct MapTexture {
    /// `None` if no image could be used; a warning says why.
    pub texture: Option<Texture>,
    pub warnings: Vec<String>,
    /// Which of the request's two images were named and could not be read.
    pub lost: [bool; 2],
    pub opacity: TextureOpacity,
    /// For a normal map that came as such: the evidence that its green points down. The bump scale is still to be applied.
    pub downwardness: Option<f32>,
}

impl MapRequest {
    /// The images that it is made of: of colour and mask, of roughness and metalness, or one.
    fn pair(&self) -> [Option<&MapImage>; 2] {
        match self {
            Self::Color { image, mask } => [image.as_ref(), mask.as_ref()],
            Self::Normal { image, .. } => [Some(image), None],
            Self::MetallicRoughness { roughness, metallic, .. } => [roughness.as_ref(), metallic.as_ref()],
        }
    }

    /// The images that it is made of.
    pub fn sources(&self) -> impl Iterator<Item = &MapImage> {
        self.pair().into_iter().flatten()
    }

    /// Reads the images and makes the texture from the readable ones.
    pub fn make(&self) -> MapTexture {
        let mut made = MapTexture::default();
        let mut read = |source: Option<&MapImage>| {
            let picture = read_image(&source?.path);
            let picture = picture.map_err(|error| made.warnings.push(format!("{error}; drawn without this texture")));
            made.warnings.extend(picture.as_ref().ok().and_then(|picture| picture.warning.clone()));
            picture.ok()
        };
        let pictures = self.pair().map(&mut read);
        made.lost = [0, 1].map(|at| self.pair()[at].is_some() && pictures[at].is_none());
        let found: Vec<&MapImage> =
            (0..2).filter(|&at| pictures[at].is_some()).filter_map(|at| self.pair()[at]).collect();
        let Some(first) = found.first() else { return made };
        let wrap = [if first.is_clamped { Wrap::Clamp } else { Wrap::Repeat }; 2];
        let name = found.iter().map(|source| file_name(&source.path)).collect::<Vec<_>>().join("+");
        let texture = |texels, color_space| Texture {
            sampler: Sampler { wrap, ..Sampler::DEFAULT },
            ..Texture::from_image(name, texels, color_space)
        };
        let [first, second] = pictures;
        match self {
            Self::Color { mask, .. } => {
                let mut texels = color(first, second, mask.as_ref().and_then(|mask| mask.channel));
                made.opacity = opacity(&mut texels, &found, &mut made.warnings);
                made.texture = Some(texture(texels, ColorSpace::Srgb));
            }
            Self::Normal { image, must_be_normals, is_color_too, bump_scale } => {
                let Some(picture) = first else { return made };
                let texels = picture.rgba8(ColorSpace::Linear);
                if *must_be_normals || looks_like_normals(&texels) {
                    made.downwardness = Some(downwardness(&texels));
                    made.texture = Some(texture(texels, ColorSpace::Linear));
                } else if *is_color_too {
                    // A slip of exporters, Crytek's Sponza among them: colours are no heights.
                    made.warnings.push(format!("bump map {} is the colour map too and left out", image.path.display()));
                } else {
                    let heights = heights(&picture, &texels, image.channel);
                    let normals = normals_of_heights(&heights, f32::from_bits(*bump_scale));
                    made.texture = Some(texture(normals, ColorSpace::Linear));
                }
            }
            Self::MetallicRoughness { roughness, shininess, metallic } => {
                let grey = |picture: Option<DecodedImage>, source: &Option<MapImage>| {
                    let letter = source.as_ref().and_then(|source| source.channel);
                    picture.map(|picture| channel(&picture.rgba8(ColorSpace::Linear), letter))
                };
                let (first, second) = (grey(first, roughness), grey(second, metallic));
                let texels = metallic_roughness(first, shininess.map(f32::from_bits), second);
                made.texture = Some(texture(texels, ColorSpace::Linear));
            }
        }
        made
    }
}

/// Perceptual roughness whose GGX highlight is as wide as Phong's with this exponent: alpha = sqrt(2 / (Ns + 2)) (Walter et al.
/// 2007, by way of Karis 2013), of which perceptual roughness is the square root.
pub(super) fn roughness_of_shininess(shininess: f32) -> f32 {
    (2.0 / (shininess.max(0.0) + 2.0)).powf(0.25)
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The image, or white without one, with the mask's opacity if there is a mask.
fn color(image: Option<DecodedImage>, mask: Option<DecodedImage>, letter: Option<char>) -> RgbaImage {
    let color = image.map(|picture| picture.rgba8(ColorSpace::Srgb));
    let Some(mask) = mask else {
        return color.unwrap_or_else(|| RgbaImage::from_pixel(1, 1, Rgba([255; 4])));
    };
    let opacity = mask.rgba8(ColorSpace::Linear);
    // An alpha channel that is not opaque all over is the mask; else the image's brightness is.
    let has_alpha = letter.is_none() && opacity.pixels().any(|texel| texel.0[3] < 255);
    let opacity = channel(&opacity, if has_alpha { Some('m') } else { letter });
    let color = color.unwrap_or_else(|| RgbaImage::from_pixel(opacity.width(), opacity.height(), Rgba([255; 4])));
    let size = (color.width().max(opacity.width()), color.height().max(opacity.height()));
    let mut color = resized_rgba(color, size);
    let opacity = resized(opacity, size);
    for (texel, opacity) in color.pixels_mut().zip(opacity.pixels()) {
        texel.0[3] = opacity.0[0];
    }
    color
}

/// Classifies the opacity. An image with opacity 0 everywhere becomes opaque, with a warning: nobody models an invisible surface.
fn opacity(texels: &mut RgbaImage, sources: &[&MapImage], warnings: &mut Vec<String>) -> TextureOpacity {
    let alphas = || texels.pixels().map(|texel| texel.0[3]);
    if alphas().all(|alpha| alpha == 0) {
        if let Some(source) = sources.last() {
            let path = source.path.display();
            warnings
                .push(format!("{path}: its opacity is 0 everywhere, which would leave nothing to see; drawn opaque"));
        }
        texels.pixels_mut().for_each(|texel| texel.0[3] = 255);
        return TextureOpacity::Whole;
    }
    let soft = alphas().filter(|alpha| (16..240).contains(alpha)).count();
    if soft * 2 > texels.pixels().len() {
        TextureOpacity::Soft
    } else if alphas().any(|alpha| alpha < 128) {
        TextureOpacity::Holes
    } else {
        TextureOpacity::Whole
    }
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

/// Heights from 0 to 1, with all bits that the file has: steps of 8 bits are terraces on a gentle slope.
fn heights(picture: &DecodedImage, texels: &RgbaImage, letter: Option<char>) -> Heights {
    let values = match picture.beyond_8_bits() {
        Some(image) => image.pixels().map(|texel| pick(texel.0, letter).clamp(0.0, 1.0)).collect(),
        None => channel(texels, letter).pixels().map(|texel| f32::from(texel.0[0]) / 255.0).collect(),
    };
    Heights { size: texels.dimensions(), values }
}

/// One channel by `-imfchan`'s letter; Rec. 709 luma without.
fn pick([r, g, b, a]: [f32; 4], letter: Option<char>) -> f32 {
    match letter {
        Some('r') => r,
        Some('g') => g,
        Some('b') => b,
        Some('m') => a,
        _ => 0.2126 * r + 0.7152 * g + 0.0722 * b,
    }
}

/// Packs roughness into green and metalness into blue; a missing one is white.
fn metallic_roughness(roughness: Option<GrayImage>, shininess: Option<f32>, metallic: Option<GrayImage>) -> RgbaImage {
    let white = || GrayImage::from_pixel(1, 1, Luma([255]));
    let roughness = roughness.map(|mut roughness| {
        for texel in roughness.pixels_mut().filter(|_| shininess.is_some()) {
            let exponent = f32::from(texel.0[0]) / 255.0 * shininess.unwrap_or(0.0);
            texel.0[0] = (roughness_of_shininess(exponent) * 255.0).round() as u8;
        }
        roughness
    });
    let (roughness, metallic) = (roughness.unwrap_or_else(white), metallic.unwrap_or_else(white));
    let size = (roughness.width().max(metallic.width()), roughness.height().max(metallic.height()));
    let (roughness, metallic) = (resized(roughness, size), resized(metallic, size));
    let mut packed = RgbaImage::new(size.0, size.1);
    for ((texel, roughness), metallic) in packed.pixels_mut().zip(roughness.pixels()).zip(metallic.pixels()) {
        *texel = Rgba([0, roughness.0[0], metallic.0[0], 255]);
    }
    packed
}
