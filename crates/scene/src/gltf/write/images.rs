//! Textures as PNG files in the binary chunk, 8 bits a channel as they are. Smaller levels are left to the reader.

use std::borrow::Cow;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::DocumentBuilder;
use crate::{Error, Filter, Sampler, Texture, Wrap};

/// A texture of the scene, in one of its forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TextureForm {
    pub texture: usize,
    pub channels: Channels,
}

/// The places of its channels in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Channels {
    AsTheyAre,
    /// Where the strength of a coat is looked up.
    AlphaAsRed,
    /// Where the thickness of glass is looked up.
    BlueAsGreen,
}

/// Writes the textures that are asked for: one in each place of the file's list.
///
/// # Errors
/// [`Error::Scene`] where an image cannot be encoded.
pub(super) fn write(textures: &[Texture], asked: &[TextureForm], document: &mut DocumentBuilder) -> Result<(), Error> {
    let encode = |asked: &TextureForm| encoded(&textures[asked.texture], asked.channels);
    let files: Vec<_> = asked.par_iter().map(encode).collect();
    let mut samplers: Vec<Sampler> = Vec::new();
    for (TextureForm { texture, .. }, file) in asked.iter().zip(files) {
        let Texture { name, sampler, .. } = &textures[*texture];
        let file = file.map_err(|error| Error::Scene(format!("texture {texture} (`{name}`): {error}")))?;
        let view = document.binary.view(&file, None);
        let image = json!({ "name": name, "bufferView": view, "mimeType": "image/png" });
        let source = document.push("images", image);
        let sampler = samplers.iter().position(|own| own == sampler).unwrap_or_else(|| {
            samplers.push(*sampler);
            document.push("samplers", sampler_of(sampler))
        });
        document.push("textures", json!({ "source": source, "sampler": sampler }));
    }
    Ok(())
}

fn encoded(texture: &Texture, channels: Channels) -> image::ImageResult<Vec<u8>> {
    let mut texels: Cow<[u8]> = texture.rgba8(0);
    let mut change = |to: fn([u8; 4]) -> [u8; 4]| {
        texels.to_mut().as_chunks_mut::<4>().0.iter_mut().for_each(|texel| *texel = to(*texel));
    };
    match channels {
        Channels::AsTheyAre => {}
        Channels::AlphaAsRed => change(|[.., alpha]| [alpha, 255, 255, 255]),
        Channels::BlueAsGreen => change(|[_, _, blue, _]| [255, blue, 255, 255]),
    }
    let mut color = ExtendedColorType::Rgba8;
    if texels.as_chunks::<4>().0.iter().all(|texel| texel[3] == 255) {
        color = ExtendedColorType::Rgb8;
        texels = texels.as_chunks::<4>().0.iter().flat_map(|&[red, green, blue, _]| [red, green, blue]).collect();
    }
    let mut file = Vec::new();
    let [width, height] = texture.size;
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::Adaptive);
    encoder.write_image(&texels, width, height, color)?;
    Ok(file)
}

/// The codes of OpenGL ES (glTF 2.0, "Samplers").
fn sampler_of(sampler: &Sampler) -> Value {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    };
    let magnify = match sampler.magnify {
        Filter::Nearest => 9728,
        Filter::Linear => 9729,
    };
    let minify = match (sampler.minify, sampler.levels) {
        (Filter::Nearest, None) => 9728,
        (Filter::Linear, None) => 9729,
        (Filter::Nearest, Some(Filter::Nearest)) => 9984,
        (Filter::Linear, Some(Filter::Nearest)) => 9985,
        (Filter::Nearest, Some(Filter::Linear)) => 9986,
        (Filter::Linear, Some(Filter::Linear)) => 9987,
    };
    let [u, v] = sampler.wrap.map(wrap);
    json!({ "magFilter": magnify, "minFilter": minify, "wrapS": u, "wrapT": v })
}
