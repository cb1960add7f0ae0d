//! What is drawn: meshes, materials, textures, lights and a camera, as pure data. No Vulkan.
//!
//! World space is right-handed with +Y up; a camera looks along its -Z. Lengths are metres, light is linear Rec. 709 RGB.
//! Positions and transforms of the world are f64: a mesh keeps its `origin` apart and only what is left becomes f32, and a
//! frame moves the world to the camera before it drops to f32.

mod bounds;
pub mod builtin;
mod camera;
mod error;
mod exposure;
pub mod file;
mod fit;
mod import;
mod light;
mod load;
mod material;
pub(crate) mod mesh;
mod names;
pub mod obj;
mod settings;
mod suggest;
mod temperature;
mod texture;

pub use bounds::Aabb;
pub use camera::Camera;
pub use error::Error;
pub use exposure::{exposure_scale, luminance, metered_ev100};
pub use fit::{add_daylight, fit_camera};
pub use import::{Imported, LoadOptions, Progress};
pub use light::{Falloff, Light, LightKind};
pub use load::{OpenOptions, open};
pub use material::{AlphaMode, Brdf, Material, TextureSlot};
pub use mesh::{Mesh, Object};
pub use names::TARGETS;
pub use settings::{
    GbufferChoice, GbufferPreset, LightPath, MAX_SHADOW_SIZE, Settings, SettingsPatch, ShadowSettings, TargetChoice,
    Tonemap, View, parse_size,
};
pub use suggest::{nearest, unknown};
pub use temperature::{KELVIN, black_body_color};
pub use texture::{ColorSpace, Texture};

use glam::Vec3;

/// Everything that a frame can show.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// What the scene is called in reports: a file's name or `builtin:…`.
    pub name: String,
    pub meshes: Vec<Mesh>,
    pub objects: Vec<Object>,
    /// At least one when there is an object; `Object::material` indexes it.
    pub materials: Vec<Material>,
    /// `Material`'s texture slots index it.
    pub textures: Vec<Texture>,
    pub lights: Vec<Light>,
    pub environment: Environment,
    pub camera: Camera,
    /// What the scene file asks for; the command line overrides it.
    pub settings: SettingsPatch,
    /// What was odd about the input and how it was handled, a line each, naming file and line where there is one.
    pub warnings: Vec<String>,
}

/// Light from everywhere, and what is seen where nothing is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Environment {
    /// Ambient radiance that reaches a surface from every direction, in nits; a lambert surface reflects albedo times this,
    /// a metal what its lobe reflects of light from everywhere.
    pub ambient: Vec3,
    /// Radiance of the background, in nits.
    pub background: Vec3,
}

impl Scene {
    /// World-space box around all objects; empty when nothing is drawn.
    pub fn bounds(&self) -> Aabb {
        self.objects.iter().fold(Aabb::EMPTY, |all, object| all.union(&object.bounds(&self.meshes)))
    }

    /// Triangles after instancing.
    pub fn triangle_count(&self) -> usize {
        self.objects.iter().map(|object| self.meshes[object.mesh].indices.len() / 3).sum()
    }
}
