//! What a scene brings to the device before its first frame.

use super::FramePlan;
use crate::scene::LightPath;

/// Kinds of data that are uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uploads {
    /// Meshes, with their indices.
    pub vertices: bool,
    /// Meshes of the volumes of lights, without indices.
    pub volumes: bool,
    /// Textures.
    pub textures: bool,
    /// One of them has more than one level.
    pub mip_levels: bool,
}

impl Uploads {
    /// Meshes and textures must be planned.
    pub(super) fn of(plan: &FramePlan) -> Self {
        Self {
            vertices: plan.meshes.vertices > 0,
            volumes: plan.light_path == LightPath::Volumes && plan.adds_lights(),
            textures: !plan.textures.images.is_empty(),
            mip_levels: plan.textures.images.iter().any(|image| image.levels > 1),
        }
    }
}
