//! Puts a scene of formulas together: indices are handed out here, so that the scenes read as lists of things and their places.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::shapes::MeshBuilder;
use crate::{Light, LightKind, Material, Object, Scene, Texture};

/// A scene on its way.
#[derive(Default)]
pub struct SceneBuilder {
    /// All that was added so far.
    pub scene: Scene,
}

impl SceneBuilder {
    /// Adds a texture and returns its index, as a material's slot holds it.
    pub fn texture(&mut self, texture: Texture) -> Option<usize> {
        self.scene.textures.push(texture);
        Some(self.scene.textures.len() - 1)
    }

    /// Adds a material and returns its index.
    pub fn material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    /// Adds a mesh. It gets tangents when a material with a normal map is to wear it.
    pub fn mesh(&mut self, name: &str, shape: MeshBuilder, material: usize) -> usize {
        let mut mesh = shape.finish(name);
        if self.scene.materials[material].needs_tangents() {
            mesh.compute_tangents();
        }
        self.scene.meshes.push(mesh);
        self.scene.meshes.len() - 1
    }

    /// Places an object that has the mesh and the material of these indices.
    pub fn place(&mut self, mesh: usize, material: usize, transform: DAffine3) {
        let name = self.scene.meshes[mesh].name.clone();
        self.scene.objects.push(Object::new(name, mesh, material, transform));
    }

    /// Adds a mesh and places it where it was built.
    pub fn add(&mut self, name: &str, shape: MeshBuilder, material: usize) {
        let mesh = self.mesh(name, shape, material);
        self.place(mesh, material, DAffine3::IDENTITY);
    }

    /// Hangs the object that was placed last on a node, and on a skin if there is one.
    pub fn hang(&mut self, node: usize, skin: Option<usize>) {
        if let Some(object) = self.scene.objects.last_mut() {
            (object.node, object.skin) = (Some(node), skin);
        }
    }

    /// A directional light of `lux` that travels along `direction`.
    pub fn sun(&mut self, direction: DVec3, lux: f32, color: Vec3, casts_shadow: bool) {
        let kind = LightKind::Directional { direction: direction.normalize_or(DVec3::NEG_Y) };
        self.light(Light { name: "sun".into(), kind, color, intensity: lux, casts_shadow, size: 0.53 });
    }

    /// Adds a light.
    pub fn light(&mut self, light: Light) {
        self.scene.lights.push(light);
    }
}

pub(super) fn translation(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// Turned about +Y by degrees, then moved.
pub(super) fn turned(degrees: f64, x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(degrees.to_radians()), DVec3::new(x, y, z))
}

/// A small generator of the same numbers everywhere: SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    /// Returns the next number: all of its 64 bits are as good.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform from 0 up to, not including, 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform from `low` up to, not including, `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// A fully saturated colour; `hue` from 0 to 1 runs from red over green and blue back to red.
pub fn hue(hue: f64) -> Vec3 {
    let channel = |shift: f64| (((hue + shift).rem_euclid(1.0) * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0) as f32;
    Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}
