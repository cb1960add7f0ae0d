//! The uploads of a scene before its first frame.

use super::{MeshPlan, PlannedTexture, TexturePlan};

/// Kinds of data that are uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uploads {
    /// Meshes, with their indices.
    pub vertices: bool,
    /// Meshes of the volumes of lights, without indices.
    pub volumes: bool,
    /// Textures, of materials or of particles, or a sky.
    pub textures: bool,
    /// One of them has levels that are made from each other.
    pub mip_levels: bool,
}

impl Uploads {
    /// `has_cube` is true if a sky's cube is uploaded, `more` are textures that no material has.
    pub(in crate::plan) fn of(
        meshes: &MeshPlan,
        textures: &TexturePlan,
        volumes: bool,
        (has_cube, more): (bool, &[PlannedTexture]),
    ) -> Self {
        let images = || textures.images.iter().chain(more);
        Self {
            vertices: meshes.vertices > 0 || meshes.deforms.vertices > 0,
            volumes,
            textures: images().next().is_some() || has_cube,
            mip_levels: images().any(|image| image.makes_levels),
        }
    }
}
