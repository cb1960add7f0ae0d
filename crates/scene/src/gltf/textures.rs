//! The textures that materials request. Images are decoded once each and in parallel; a texture is an image in the form that a slot needs.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use image::imageops::{FilterType, resize};
use image::{Rgba, RgbaImage};
use rayon::prelude::*;

use super::buffers::Buffers;
use super::json::{Document, Whole, entry, named};
use super::ktx;
use super::uri::Resources;
use crate::texture::decode_image;
use crate::{ColorSpace, Error, Filter, LoadOptions, Sampler, Texels, Texture, Wrap};

/// The largest size of an image file, in bytes.
const MOST_BYTES: u64 = 1 << 30;

/// An image, and a fallback for readers without a decoder for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct ImageWithFallback {
    pub image: usize,
    pub fallback: Option<usize>,
}

/// The pictures that a texture is made of, and the way that they are combined. A number is the bits of an f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Recipe {
    Plain(ImageWithFallback, ColorSpace),
    /// Occlusion of some strength: r' = 1 + strength (r - 1).
    Occlusion(ImageWithFallback, u64),
    /// RGB from `color`, alpha from `strength`.
    Specular {
        color: Option<ImageWithFallback>,
        strength: Option<ImageWithFallback>,
    },
    /// Red from `strength`, green from `thickness`.
    Film {
        strength: Option<ImageWithFallback>,
        thickness: Option<ImageWithFallback>,
    },
    /// Glass thickness: green is copied to blue; the film's channels are white.
    Thickness(ImageWithFallback),
    /// Alpha is multiplied by 1 - `factor` r, with r from `transmission`.
    Glass {
        color: Option<ImageWithFallback>,
        transmission: ImageWithFallback,
        factor: u64,
    },
    /// White, with red as alpha.
    Coat(ImageWithFallback),
    /// Roughness in green, computed from glossiness in alpha: 1 - `factor` a. Blue, the metalness, is 0.
    Gloss(ImageWithFallback, u64),
}

/// A texture to be made. Equal requests share one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct TextureRequest {
    pub recipe: Recipe,
    pub sampler: Sampler,
}

impl Recipe {
    fn pictures(&self) -> impl Iterator<Item = ImageWithFallback> {
        let (first, second) = match *self {
            Self::Plain(picture, _)
            | Self::Occlusion(picture, _)
            | Self::Coat(picture)
            | Self::Thickness(picture)
            | Self::Gloss(picture, _) => (Some(picture), None),
            Self::Specular { color: first, strength: second } | Self::Film { strength: first, thickness: second } => {
                (first, second.filter(|second| Some(*second) != first))
            }
            Self::Glass { color, transmission, .. } => (color, Some(transmission).filter(|own| Some(*own) != color)),
        };
        first.into_iter().chain(second)
    }

    fn color_space(&self) -> ColorSpace {
        match self {
            Self::Plain(_, color_space) => *color_space,
            Self::Occlusion(..) | Self::Gloss(..) | Self::Film { .. } | Self::Thickness(_) => ColorSpace::Linear,
            Self::Specular { .. } | Self::Glass { .. } | Self::Coat(_) => ColorSpace::Srgb,
        }
    }
}

/// The picture and the sampler of one of a file's textures; `None` for a texture that does not exist or names no image.
pub(super) fn picture(
    document: &Document,
    texture: Option<Whole>,
    warnings: &mut Vec<String>,
) -> Option<(ImageWithFallback, Sampler)> {
    let Some(texture) = texture else {
        warnings.push("a texture of it has no index, drawn without it".into());
        return None;
    };
    let json = entry("texture", &document.textures, texture);
    let json = json.map_err(|what| warnings.push(format!("{what}, drawn without it"))).ok()?;
    let name = named("texture", texture.0, json.name.as_ref());
    let extended = [json.extensions.basisu.as_ref(), json.extensions.webp.as_ref()];
    let sources = extended.into_iter().flatten().filter_map(|own| own.source).chain(json.source);
    let mut sources: Vec<usize> = sources.map(|source| source.0).collect();
    sources.retain(|&source| {
        let image = entry("image", &document.images, Whole(source));
        image.map_err(|what| warnings.push(format!("{name}: {what}"))).is_ok()
    });
    let sampler = match json.sampler.map(|sampler| entry("sampler", &document.samplers, sampler)) {
        Some(Ok(sampler)) => sampler_of(sampler, &name, warnings),
        Some(Err(what)) => {
            warnings.push(format!("{name}: {what}, sampled as by default"));
            Sampler::DEFAULT
        }
        None => Sampler::DEFAULT,
    };
    let Some(&image) = sources.first() else {
        warnings.push(format!("{name} names no image, drawn without it"));
        return None;
    };
    Some((ImageWithFallback { image, fallback: sources.get(1).copied() }, sampler))
}

/// Reads a sampler. Unknown values become the default, with a warning.
fn sampler_of(json: &super::json::Sampler, texture: &str, warnings: &mut Vec<String>) -> Sampler {
    let mut unknown = |key: &str, value: usize, instead: &str| {
        warnings.push(format!("{texture}: {key} of its sampler is {value}, taken for {instead}"));
    };
    let mut wrap = |key: &str, mode: Option<Whole>| match mode.map(|mode| mode.0) {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        None | Some(10497) => Wrap::Repeat,
        Some(other) => {
            unknown(key, other, "10497, to repeat");
            Wrap::Repeat
        }
    };
    let wrap = [wrap("wrapS", json.wrap_s), wrap("wrapT", json.wrap_t)];
    let (minify, levels) = match json.min_filter.map(|filter| filter.0) {
        Some(9728) => (Filter::Nearest, None),
        Some(9729) => (Filter::Linear, None),
        Some(9984) => (Filter::Nearest, Some(Filter::Nearest)),
        Some(9985) => (Filter::Linear, Some(Filter::Nearest)),
        Some(9986) => (Filter::Nearest, Some(Filter::Linear)),
        other => {
            if let Some(other) = other.filter(|&other| other != 9987) {
                unknown("minFilter", other, "9987, linear between texels and levels");
            }
            (Filter::Linear, Some(Filter::Linear))
        }
    };
    let magnify = match json.mag_filter.map(|filter| filter.0) {
        Some(9728) => Filter::Nearest,
        other => {
            if let Some(other) = other.filter(|&other| other != 9729) {
                unknown("magFilter", other, "9729, linear");
            }
            Filter::Linear
        }
    };
    Sampler { wrap, magnify, minify, levels }
}

/// Reads and decodes a file's images.
pub(super) struct Images<'a> {
    pub path: &'a Path,
    pub document: &'a Document,
    pub resources: &'a Resources,
    pub buffers: &'a Buffers<'a>,
}

/// Textures by request, warnings, and the files that images came from.
#[derive(Default)]
pub(super) struct ReadTextures {
    pub textures: Vec<Option<Texture>>,
    pub warnings: Vec<String>,
    pub files: Vec<PathBuf>,
}

/// An image as stored in its file: texels, or compressed blocks.
#[derive(Clone)]
pub(super) struct SourceImage {
    pub size: [u32; 2],
    pub texels: Texels,
    /// The colour space that the levels were computed in.
    levels_in: Option<ColorSpace>,
}

impl SourceImage {
    pub fn new(size: [u32; 2], texels: Texels) -> Self {
        Self { size, texels, levels_in: None }
    }

    /// Makes a texture with all its levels.
    fn named(self, name: String, color_space: ColorSpace, sampler: Sampler) -> Texture {
        let mut texture = Texture { name, size: self.size, color_space, sampler, texels: self.texels };
        if self.levels_in.is_some_and(|made| made != color_space) {
            texture.rgba8_mut();
        }
        texture.make_levels();
        texture
    }

    /// Makes the levels that a texture of this colour space and sampler needs.
    fn with_levels(self, color_space: ColorSpace, sampler: Sampler) -> Self {
        let Texture { size, texels, .. } = self.named(String::new(), color_space, sampler);
        let levels_in = matches!(texels, Texels::Rgba8Levels(_)).then_some(color_space);
        Self { size, texels, levels_in }
    }

    /// The largest level, decoded.
    fn into_image(self) -> Option<RgbaImage> {
        let [width, height] = self.size;
        let whole = Sampler { levels: None, ..Sampler::DEFAULT };
        let mut texture = self.named(String::new(), ColorSpace::Linear, whole);
        RgbaImage::from_raw(width, height, std::mem::take(texture.rgba8_mut()))
    }
}

impl From<RgbaImage> for SourceImage {
    fn from(image: RgbaImage) -> Self {
        Self::new([image.width(), image.height()], image.into_raw().into())
    }
}

/// An image, and the file that it came from.
struct Decoded {
    pixels: SourceImage,
    file: Option<PathBuf>,
    odd: Vec<String>,
}

impl Images<'_> {
    /// Makes textures. A texture whose images cannot be read is `None`, with a warning.
    pub fn make(&self, requests: &[TextureRequest], options: &LoadOptions) -> ReadTextures {
        let mut left: HashMap<ImageWithFallback, usize> = HashMap::new();
        let mut pictures = Vec::new();
        for picture in requests.iter().flat_map(|request| request.recipe.pictures()) {
            let count = left.entry(picture).or_insert(0);
            if *count == 0 {
                pictures.push(picture);
            }
            *count += 1;
        }
        // Nearly every picture becomes one texture unchanged, so its levels are made at once, while others are still decoded.
        let mut plain = HashMap::new();
        for request in requests {
            if let Recipe::Plain(picture, color_space) = request.recipe {
                plain.entry(picture).or_insert((color_space, request.sampler));
            }
        }
        let done = AtomicUsize::new(0);
        let decode = |picture: &ImageWithFallback| {
            let (decoded, warnings) = self.decode(picture);
            let decoded = decoded.map(|Decoded { pixels, file, .. }| match plain.get(picture) {
                Some(&(color_space, sampler)) => (pixels.with_levels(color_space, sampler), file),
                None => (pixels, file),
            });
            options.report("textures", done.fetch_add(1, Ordering::Relaxed) + 1, pictures.len());
            (decoded, warnings)
        };
        let decoded: Vec<_> = pictures.par_iter().map(decode).collect();
        let mut made = ReadTextures::default();
        let mut images = HashMap::new();
        for (picture, decoded) in pictures.into_iter().zip(decoded) {
            let (image, warnings) = decoded;
            made.warnings.extend(warnings);
            if let Some((image, file)) = image {
                made.files.extend(file);
                images.insert(picture, image);
            }
        }
        let mut pixels_of = |request: &TextureRequest| {
            let found = request.recipe.pictures().map(|picture| {
                let count = left.get_mut(&picture).map(|count| {
                    *count -= 1;
                    *count
                });
                // The last request gets the image itself instead of a copy.
                if count == Some(0) { images.remove(&picture) } else { images.get(&picture).cloned() }
            });
            found.collect()
        };
        let found: Vec<Vec<Option<SourceImage>>> = requests.iter().map(&mut pixels_of).collect();
        let textures = requests.par_iter().zip(found).map(|(request, found)| self.texture(request, found));
        ReadTextures { textures: textures.collect(), ..made }
    }

    fn texture(&self, request: &TextureRequest, found: Vec<Option<SourceImage>>) -> Option<Texture> {
        let names = request.recipe.pictures().map(|picture| self.name(picture.image));
        let name = names.collect::<Vec<_>>().join("+");
        let pixels = match request.recipe {
            Recipe::Plain(..) => found.into_iter().next()??,
            other => cooked(other, found.into_iter().map(|own| own.and_then(SourceImage::into_image)))?.into(),
        };
        Some(pixels.named(name, request.recipe.color_space(), request.sampler))
    }

    fn name(&self, image: usize) -> String {
        let json = self.document.images.get(image);
        let is_data = |uri: &&String| uri.get(..5).is_some_and(|start| start.eq_ignore_ascii_case("data:"));
        let own = json.and_then(|json| json.name.clone().filter(|name| !name.is_empty()));
        let file = || json.and_then(|json| json.uri.as_ref().filter(|uri| !is_data(uri)).cloned());
        own.or_else(file).unwrap_or_else(|| format!("image {image}"))
    }

    /// Decodes an image, or its fallback. The warnings say why the image, or both, could not be read.
    fn decode(&self, picture: &ImageWithFallback) -> (Option<Decoded>, Vec<String>) {
        let mut warnings = Vec::new();
        for image in [Some(picture.image), picture.fallback].into_iter().flatten() {
            let name = self.document.images.get(image).and_then(|json| json.name.as_ref());
            let place = || format!("{}: {}", self.path.display(), named("image", image, name));
            match self.read(image) {
                Ok(decoded) => {
                    warnings.extend(decoded.odd.iter().map(|what| format!("{}: {what}", place())));
                    return (Some(decoded), warnings);
                }
                Err(what) => warnings.push(format!("{}: {what}, drawn without it", place())),
            }
        }
        (None, warnings)
    }

    fn read(&self, index: usize) -> Result<Decoded, String> {
        let json = entry("image", &self.document.images, Whole(index))?;
        let owned;
        let (bytes, file, mut odd) = match (json.uri.as_ref().filter(|uri| !uri.is_empty()), json.buffer_view) {
            (Some(uri), _) => {
                owned = self.resources.read(uri, MOST_BYTES)?;
                (owned.bytes.as_slice(), owned.file.clone(), owned.odd.iter().cloned().collect())
            }
            (None, Some(view)) => (self.buffers.view(view)?.bytes, None, Vec::new()),
            (None, None) => return Err("has neither a URI nor a buffer view".into()),
        };
        if ktx::is_ktx(bytes) {
            return Ok(Decoded { pixels: ktx::read(bytes)?, file, odd });
        }
        // Byte 24 of a PNG is its bit depth (PNG, third edition, section 11.2.1).
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.get(24) == Some(&16) {
            odd.push("has 16 bits a channel, of which 8 are kept".into());
        }
        // A glTF image is never a float image, so the colour space does not matter.
        let decoded = decode_image(bytes, Path::new(""));
        let decoded = decoded.map_err(|error| match error {
            Error::Content { what, .. } => what,
            other => other.to_string(),
        });
        Ok(Decoded { pixels: decoded?.rgba8(ColorSpace::Linear).into(), file, odd })
    }
}

/// Makes a texture's image from its pictures, by a recipe.
fn cooked(recipe: Recipe, mut found: impl Iterator<Item = Option<RgbaImage>>) -> Option<RgbaImage> {
    Some(match recipe {
        Recipe::Plain(..) => found.next()??,
        Recipe::Occlusion(_, strength) => faded(found.next()??, f64::from_bits(strength)),
        Recipe::Coat(_) => with_alpha(None, &found.next()??, |red, _| red),
        Recipe::Gloss(_, factor) => {
            let white = || RgbaImage::from_pixel(1, 1, Rgba([255; 4]));
            rough(found.next()?.unwrap_or_else(white), f64::from_bits(factor))
        }
        Recipe::Specular { color, strength } => {
            let (color, strength) = two((color, strength), found)?;
            merged(color, strength, |color, [.., alpha]| color[3] = alpha)?
        }
        Recipe::Film { strength, thickness } => {
            let (strength, thickness) = two((strength, thickness), found)?;
            merged(strength, thickness, |own, [_, green, ..]| *own = [own[0], green, 255, 255])?
        }
        Recipe::Thickness(_) => {
            let mut image = found.next()??;
            image.pixels_mut().for_each(|texel| texel.0 = [255, 255, texel.0[1], 255]);
            image
        }
        Recipe::Glass { color, transmission, factor } => {
            let first = if color.is_some() { found.next()? } else { None };
            let second = if Some(transmission) == color { first.clone() } else { found.next()? };
            let white = || RgbaImage::from_pixel(1, 1, Rgba([255; 4]));
            let factor = f64::from_bits(factor);
            with_alpha(first, &second.unwrap_or_else(white), |red, own| {
                let share = 1.0 - factor * f64::from(red) / 255.0;
                (f64::from(own) * share).round() as u8
            })
        }
    })
}

/// Scales occlusion by a strength below 1.
fn faded(mut image: RgbaImage, strength: f64) -> RgbaImage {
    let table: Vec<u8> =
        (0..=255u8).map(|red| (255.0 + strength * (f64::from(red) - 255.0)).round().clamp(0.0, 255.0) as u8).collect();
    image.pixels_mut().for_each(|texel| texel.0[0] = table[usize::from(texel.0[0])]);
    image
}

/// Converts glossiness to roughness, in the layout of metallic-roughness textures.
fn rough(mut image: RgbaImage, factor: f64) -> RgbaImage {
    let table: Vec<u8> =
        (0..=255u8).map(|gloss| (255.0 - factor * f64::from(gloss)).round().clamp(0.0, 255.0) as u8).collect();
    image.pixels_mut().for_each(|texel| texel.0 = [255, table[usize::from(texel.0[3])], 0, 255]);
    image
}

/// Combines a colour (white if absent) with an alpha computed from another image's red and the colour's own alpha.
fn with_alpha(color: Option<RgbaImage>, other: &RgbaImage, alpha: impl Fn(u8, u8) -> u8) -> RgbaImage {
    let color = color.unwrap_or_else(|| RgbaImage::from_pixel(1, 1, Rgba([255; 4])));
    let (mut color, other) = alike(color, other.clone());
    for (texel, other) in color.pixels_mut().zip(other.pixels()) {
        texel.0[3] = alpha(other.0[0], texel.0[3]);
    }
    color
}

/// The images of two pictures. Either picture may be absent, and both may be the same. `None` if an image is missing.
fn two(
    (first, second): (Option<ImageWithFallback>, Option<ImageWithFallback>),
    mut found: impl Iterator<Item = Option<RgbaImage>>,
) -> Option<(Option<RgbaImage>, Option<RgbaImage>)> {
    let own = if first.is_some() { found.next()? } else { None };
    let other = match second {
        Some(_) if second == first => own.clone(),
        Some(_) => found.next()?,
        None => None,
    };
    Some((own, other))
}

/// Combines the texels of two textures; a missing texture counts as white. Returns `None` if both are missing.
fn merged(
    own: Option<RgbaImage>,
    other: Option<RgbaImage>,
    change: impl Fn(&mut [u8; 4], [u8; 4]),
) -> Option<RgbaImage> {
    if own.is_none() && other.is_none() {
        return None;
    }
    let white = || RgbaImage::from_pixel(1, 1, Rgba([255; 4]));
    let (mut own, other) = alike(own.unwrap_or_else(white), other.unwrap_or_else(white));
    own.pixels_mut().zip(other.pixels()).for_each(|(own, other)| change(&mut own.0, other.0));
    Some(own)
}

/// Scales both images to the larger of their sizes.
fn alike(a: RgbaImage, b: RgbaImage) -> (RgbaImage, RgbaImage) {
    let size = (a.width().max(b.width()), a.height().max(b.height()));
    let of = |image: RgbaImage| {
        if image.dimensions() == size { image } else { resize(&image, size.0, size.1, FilterType::Triangle) }
    };
    (of(a), of(b))
}
