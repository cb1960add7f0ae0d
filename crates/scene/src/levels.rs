//! Levels of detail of a mesh: the same surface with ever fewer triangles, drawn at distances from which nobody sees the difference.
//!
//! A level has vertices of its mesh alone, so that it costs indices and nothing else (but where triangles are told by their vertices, one for each of its
//! triangles).

#[cfg(feature = "readers")]
mod make;

/// More than halve any mesh down to nothing.
pub const MOST_LEVELS: usize = 16;

/// True if meshes have levels of detail: the feature `readers` makes them.
pub const HAS_LEVELS: bool = cfg!(feature = "readers");

/// A mesh with fewer triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Three a triangle, of the mesh's vertices.
    pub indices: Vec<u32>,
    /// The Hausdorff distance to the mesh (how far any point of the one is from the other at most), in metres of mesh space. It is measured at
    /// vertices, edges and faces, and taken a tenth larger. It never falls from a level to the next coarser one.
    pub error: f64,
}

/// The levels of a mesh, as soon as a plan has asked for them.
#[derive(Debug, Clone, Default)]
pub struct Levels(#[cfg(feature = "readers")] make::LevelCache);

#[cfg(not(feature = "readers"))]
impl super::Mesh {
    /// The levels of detail of the mesh. Only the feature `readers` makes any.
    pub fn levels_of_detail(&self) -> std::sync::Arc<[Level]> {
        Default::default()
    }
}
