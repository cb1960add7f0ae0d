//! What a scene brings to the device before its first frame.

use super::{MeshPlan, TexturePlan};
use crate::plan::SkyPlan;

/// Kinds of data that are uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uploads {
    /// Meshes, with their indices.
    pub vertices: bool,
    /// Meshes of the volumes of lights, without indices.
    pub volumes: bool,
    /// Textures, or a sky.
    pub textures: bool,
    /// One of them has levels that are made from each other.
    pub mip_levels: bool,
}

impl Uploads {
    pub(in crate::plan) fn of(meshes: &MeshPlan, textures: &TexturePlan, volumes: bool, sky: Option<SkyPlan>) -> Self {
        Self {
            vertices: meshes.vertices > 0 || meshes.deforms.vertices > 0,
            volumes,
            textures: !textures.images.is_empty() || sky.is_some(),
            mip_levels: textures.images.iter().any(|image| image.makes_levels),
        }
    }
}
