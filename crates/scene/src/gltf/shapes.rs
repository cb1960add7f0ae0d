//! Morph targets.

use super::json::Mesh as JsonMesh;
use super::primitive::of_each;
use super::source::PrimitiveSource;
use crate::{Mesh, Morph};

/// Reads the shapes of a primitive. `uv_set` is the set that became the mesh's first. Parts that cannot be read add nothing.
pub(super) fn read(
    source: &PrimitiveSource,
    json: &JsonMesh,
    mesh: &Mesh,
    uv_set: Option<usize>,
    warnings: &mut Vec<String>,
) -> Vec<Morph> {
    let names = json.extras.get("targetNames").and_then(|names| names.as_array());
    let name = |index: usize| names.and_then(|names| names.get(index)?.as_str()).unwrap_or_default().to_owned();
    let mut read = |index: usize| {
        let mut target = MorphTarget { source, index, vertices: mesh.positions.len(), warnings: Vec::new() };
        let morph = Morph {
            name: name(index),
            positions: target.list("POSITION", &["VEC3"]),
            normals: if mesh.normals.is_empty() { Vec::new() } else { target.list("NORMAL", &["VEC3"]) },
            tangents: if mesh.tangents.is_empty() { Vec::new() } else { target.list("TANGENT", &["VEC3"]) },
            uvs: match uv_set {
                Some(set) if !mesh.uvs.is_empty() => target.list::<2>(&format!("TEXCOORD_{set}"), &["VEC2"]),
                _ => Vec::new(),
            },
            colors: if mesh.colors.is_empty() { Vec::new() } else { target.list("COLOR_0", &["VEC3", "VEC4"]) },
        };
        warnings.extend(target.warnings.into_iter().map(|what| format!("target {index}: {what}")));
        morph
    };
    (0..source.targets()).map(&mut read).collect()
}

struct MorphTarget<'a> {
    source: &'a PrimitiveSource<'a>,
    index: usize,
    vertices: usize,
    warnings: Vec<String>,
}

impl MorphTarget<'_> {
    /// Returns the offsets that a shape adds to an attribute, one for each vertex; empty if all are zero.
    fn list<const N: usize>(&mut self, semantic: &str, kinds: &[&str]) -> Vec<[f32; N]> {
        let read = self.source.of_target::<N>(self.index, semantic, kinds);
        let Some(mut list) = of_each(semantic, read, self.vertices, &mut self.warnings) else { return Vec::new() };
        let bad = list.iter_mut().enumerate().filter(|(_, value)| !value.iter().all(|number| number.is_finite()));
        let bad: Vec<usize> = bad.map(|(vertex, value)| (vertex, *value = [0.0; N]).0).collect();
        if let Some(vertex) = bad.first() {
            self.warnings.push(format!("the {semantic} of vertex {vertex} is not finite, taken for 0"));
        }
        let is_nothing = list.as_flattened().iter().all(|&number| number == 0.0);
        if is_nothing { Vec::new() } else { list }
    }
}
