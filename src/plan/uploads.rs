//! What a scene brings to the device before its first frame.

use super::{FramePlan, GeometryKey};
use crate::scene::{LightPath, Scene, Settings, TextureSlot};

/// Kinds of data that are uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uploads {
    /// Meshes, with their indices.
    pub vertices: bool,
    /// Meshes of the volumes of lights, without indices.
    pub volumes: bool,
    /// Textures that some pipeline samples.
    pub textures: bool,
    /// One of them has more than one level.
    pub mip_levels: bool,
}

impl Uploads {
    pub(super) fn of(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Self {
        let mut uploads = Self {
            vertices: plan.meshes.vertices > 0,
            volumes: plan.light_path == LightPath::Volumes && plan.adds_lights(),
            ..Self::default()
        };
        for object in &scene.objects {
            let key = GeometryKey::of(scene, object, settings, plan);
            let material = &scene.materials[object.material];
            for (slot, texture) in material.textures() {
                // SHADOW samples masks whatever GEOMETRY does.
                let masks = slot == TextureSlot::BaseColor && material.is_masked() && plan.shadow.is_some();
                if masks || key.textures.contains(slot) {
                    uploads.textures = true;
                    uploads.mip_levels |= scene.textures.get(texture).is_none_or(|texture| texture.size != [1, 1]);
                }
            }
        }
        uploads
    }
}
