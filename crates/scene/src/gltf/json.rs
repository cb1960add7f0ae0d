//! The JSON of a glTF file as plain data: the properties that readers here look at, by the names of the specification.
//!
//! Every property is optional here, also where the specification requires it: one that is missing or odd concerns only the readers that need it.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer};

use super::json_extensions::{
    AnimationTargetExtensions, DocumentExtensions, MaterialExtensions, NodeExtensions, PrimitiveExtensions,
    TextureExtensions, TextureInfoExtensions, ViewExtensions,
};

/// A whole number, not negative: an index, a count or a length. JSON may write it as 3.0 (glTF 2.0, "JSON Encoding").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub(super) struct Whole(pub usize);

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WholeVisitor;
        impl Visitor<'_> for WholeVisitor {
            type Value = Whole;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a whole number that is not negative")
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Whole, E> {
                usize::try_from(value).map(Whole).map_err(E::custom)
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Whole, E> {
                // Above 2^53 neighbours are more than 1 apart.
                let is_whole = value.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&value);
                if is_whole {
                    Ok(Whole(value as usize))
                } else {
                    Err(E::invalid_value(de::Unexpected::Float(value), &self))
                }
            }
        }
        deserializer.deserialize_any(WholeVisitor)
    }
}

/// The attributes of a primitive or a shape: semantics with the numbers of accessors.
pub(super) type Attributes = BTreeMap<String, Whole>;

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub asset: Option<Asset>,
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub scene: Option<Whole>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub samplers: Vec<Sampler>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    pub cameras: Vec<Camera>,
    pub extensions: DocumentExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub name: Option<String>,
    pub nodes: Vec<Whole>,
    pub extras: serde_json::Value,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub name: Option<String>,
    pub children: Vec<Whole>,
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub mesh: Option<Whole>,
    pub skin: Option<Whole>,
    pub camera: Option<Whole>,
    pub weights: Option<Vec<f64>>,
    pub extensions: NodeExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    pub weights: Option<Vec<f64>>,
    pub extras: serde_json::Value,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<Whole>,
    pub material: Option<Whole>,
    pub mode: Option<Whole>,
    pub targets: Vec<Attributes>,
    pub extensions: PrimitiveExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Accessor {
    pub name: Option<String>,
    pub buffer_view: Option<Whole>,
    pub byte_offset: Whole,
    pub component_type: Whole,
    pub normalized: bool,
    pub count: Whole,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Sparse>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Sparse {
    pub count: Whole,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct SparseIndices {
    pub buffer_view: Option<Whole>,
    pub byte_offset: Whole,
    pub component_type: Whole,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct SparseValues {
    pub buffer_view: Option<Whole>,
    pub byte_offset: Whole,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct BufferView {
    pub name: Option<String>,
    pub buffer: Option<Whole>,
    pub byte_offset: Whole,
    pub byte_length: Whole,
    pub byte_stride: Option<Whole>,
    pub extensions: ViewExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Buffer {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub byte_length: Option<Whole>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub name: Option<String>,
    pub pbr_metallic_roughness: MetallicRoughness,
    pub normal_texture: Option<TextureInfo>,
    pub occlusion_texture: Option<TextureInfo>,
    pub emissive_texture: Option<TextureInfo>,
    pub emissive_factor: [f64; 3],
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f64>,
    pub double_sided: bool,
    pub extensions: MaterialExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct MetallicRoughness {
    pub base_color_factor: Option<[f64; 4]>,
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: Option<f64>,
    pub roughness_factor: Option<f64>,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

/// A texture in a slot. `scale` is for normal maps, `strength` for occlusion.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct TextureInfo {
    pub index: Option<Whole>,
    pub tex_coord: Whole,
    pub scale: Option<f64>,
    pub strength: Option<f64>,
    pub extensions: TextureInfoExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    pub name: Option<String>,
    pub sampler: Option<Whole>,
    pub source: Option<Whole>,
    pub extensions: TextureExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub buffer_view: Option<Whole>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Sampler {
    pub mag_filter: Option<Whole>,
    pub min_filter: Option<Whole>,
    pub wrap_s: Option<Whole>,
    pub wrap_t: Option<Whole>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Skin {
    pub name: Option<String>,
    pub inverse_bind_matrices: Option<Whole>,
    pub joints: Vec<Whole>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<AnimationChannel>,
    pub samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct AnimationChannel {
    pub sampler: Option<Whole>,
    pub target: AnimationTarget,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct AnimationTarget {
    pub node: Option<Whole>,
    pub path: Option<String>,
    pub extensions: AnimationTargetExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct AnimationSampler {
    pub input: Option<Whole>,
    pub output: Option<Whole>,
    pub interpolation: Option<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Camera {
    pub name: Option<String>,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Perspective {
    pub yfov: Option<f64>,
    pub znear: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Orthographic {
    pub ymag: Option<f64>,
    pub znear: Option<f64>,
}

/// A thing of the file in messages: "node 3 (`Arm`)".
pub(super) fn named(what: &str, index: usize, name: Option<&String>) -> String {
    match name {
        // Quoted as Rust has it, which keeps a name with a line break on one line.
        Some(name) if !name.is_empty() => format!("{what} {index} (`{}`)", name.escape_debug()),
        _ => format!("{what} {index}"),
    }
}

/// Faults of several places as a line for each fault: the first place, and how many more have it.
pub(super) fn gathered(faults: Vec<(String, String)>, ending: &str) -> Vec<String> {
    let mut order: Vec<String> = Vec::new();
    let mut places: BTreeMap<String, (String, usize)> = BTreeMap::new();
    for (place, fault) in faults {
        places.entry(fault.clone()).and_modify(|own| own.1 += 1).or_insert_with(|| {
            order.push(fault);
            (place, 0)
        });
    }
    let line = |fault: String| match &places[&fault] {
        (place, 0) => format!("{place}: {fault}{ending}"),
        (place, more) => format!("{place}: {fault}{ending}, and {more} more like it"),
    };
    order.into_iter().map(line).collect()
}

/// Returns one of a list by its number, or a sentence that this one is missing.
pub(super) fn entry<'a, T>(what: &str, list: &'a [T], index: Whole) -> Result<&'a T, String> {
    list.get(index.0).ok_or_else(|| format!("{what} {} does not exist: the file has {}", index.0, list.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_have_a_point_and_nothing_behind_it() {
        let read = |text: &str| serde_json::from_str::<Whole>(text).ok().map(|whole| whole.0);
        assert_eq!([read("3"), read("3.0"), read("2e2")], [Some(3), Some(3), Some(200)]);
        for text in ["-1", "0.5", "1e300", "\"3\"", "null", "[1]"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
