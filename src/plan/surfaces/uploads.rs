//! The uploads of a scene before its first frame.

use super::{MeshPlan, TexturePlan};
use crate::plan::{ParticlePlan, SkyPlan};

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
    pub(in crate::plan) fn of(
        meshes: &MeshPlan,
        textures: &TexturePlan,
        volumes: bool,
        (sky, particles): (Option<SkyPlan>, Option<&ParticlePlan>),
    ) -> Self {
        let images = || textures.images.iter().chain(particles.map_or(&[][..], |own| &own.textures));
        Self {
            vertices: meshes.vertices > 0 || meshes.deforms.vertices > 0,
            volumes,
            textures: images().next().is_some() || sky.is_some(),
            mip_levels: images().any(|image| image.makes_levels),
        }
    }
}
