//! The uploads of a scene before its first frame.

use super::{MeshPlan, PlannedTexture, TexturePlan};

/// Kinds of data that are uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uploads {
    /// Meshes, with their indices.
    pub vertices: bool,
    /// Meshes of the volumes of lights, without indices.
    pub volumes: bool,
    /// Textures, of materials or of effects.
    pub textures: bool,
    /// One of them has levels that are made from each other.
    pub mip_levels: bool,
}

impl Uploads {
    /// The uploads of surfaces and lights.
    pub(in crate::plan) fn of(meshes: &MeshPlan, textures: &TexturePlan, volumes: bool) -> Self {
        let vertices = meshes.vertices > 0 || meshes.deforms.vertices > 0;
        Self { vertices, volumes, ..Self::of_textures(&textures.images) }
    }

    pub(in crate::plan) fn of_textures(images: &[PlannedTexture]) -> Self {
        let mip_levels = images.iter().any(|image| image.makes_levels);
        Self { textures: !images.is_empty(), mip_levels, ..Self::default() }
    }

    pub(in crate::plan) fn and(self, other: Self) -> Self {
        Self {
            vertices: self.vertices || other.vertices,
            volumes: self.volumes || other.volumes,
            textures: self.textures || other.textures,
            mip_levels: self.mip_levels || other.mip_levels,
        }
    }
}
