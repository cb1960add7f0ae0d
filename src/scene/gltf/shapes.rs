//! Morph targets.

use super::json::Mesh as JsonMesh;
use super::source::Source;
use crate::scene::{Mesh, Morph};

/// Reads the shapes of a primitive. `uv_set` is the set that became the mesh's first.
pub(super) fn read(source: &Source, json: &JsonMesh, mesh: &Mesh, uv_set: Option<usize>) -> Result<Vec<Morph>, String> {
    let names = json.extras.get("targetNames").and_then(|names| names.as_array());
    let name = |index: usize| names.and_then(|names| names.get(index)?.as_str()).unwrap_or_default().to_owned();
    let read = |index: usize| {
        let target = Target { source, index, vertices: mesh.positions.len() };
        let uvs = match uv_set {
            Some(set) if !mesh.uvs.is_empty() => target.list::<2>(&format!("TEXCOORD_{set}"), &["VEC2"])?,
            _ => Vec::new(),
        };
        let has_normals = !mesh.normals.is_empty();
        let if_normals = |list: Vec<[f32; 3]>| if has_normals { list } else { Vec::new() };
        Ok(Morph {
            name: name(index),
            positions: target.list("POSITION", &["VEC3"])?,
            normals: if_normals(target.list("NORMAL", &["VEC3"])?),
            tangents: if mesh.tangents.is_empty() { Vec::new() } else { target.list("TANGENT", &["VEC3"])? },
            uvs,
            colors: if mesh.colors.is_empty() { Vec::new() } else { target.list("COLOR_0", &["VEC3", "VEC4"])? },
        })
    };
    (0..source.targets()).map(|index| read(index).map_err(|what: String| format!("target {index}: {what}"))).collect()
}

struct Target<'a> {
    source: &'a Source<'a>,
    index: usize,
    vertices: usize,
}

impl Target<'_> {
    /// Returns what a shape adds to an attribute of each vertex; empty where it adds nothing.
    fn list<const N: usize>(&self, semantic: &str, kinds: &[&str]) -> Result<Vec<[f32; N]>, String> {
        let Some(list) = self.source.of_target::<N>(self.index, semantic, kinds)? else { return Ok(Vec::new()) };
        if list.len() != self.vertices {
            return Err(format!("{semantic} has {} elements, but POSITION has {}", list.len(), self.vertices));
        }
        if let Some(vertex) = list.iter().position(|value| !value.iter().all(|number| number.is_finite())) {
            return Err(format!("the {semantic} of vertex {vertex} is not finite"));
        }
        let is_nothing = list.as_flattened().iter().all(|&number| number == 0.0);
        Ok(if is_nothing { Vec::new() } else { list })
    }
}
