//! Scenes: meshes, materials, textures, lights and a camera, as pure data. No Vulkan.
//!
//! World space is right-handed with +Y up; a camera looks along its -Z. Lengths are metres, light is linear Rec. 709 RGB.
//! Positions and transforms of the world are f64: a mesh keeps its `origin` apart and only the offsets from it are f32, and a
//! frame moves the world to the camera before it drops to f32.
//!
//! Features of this crate:
//!
//! - `readers`, on by default, reads and writes files: glTF, OBJ, scene files and settings in TOML, pictures and skies. It also has the built-in scenes,
//!   and work on meshes: tangents, the order of triangles, and levels of detail. Without it a program fills a [`Scene`] itself, with tangents where a
//!   material has a normal map. Meshes then have no levels of detail, messages about unknown names propose none, and textures in compressed blocks are
//!   drawn only by devices that can sample them compressed ([`Texture::is_readable`]).
//! - `serde` serializes the choices that settings consist of. `readers` includes it.

#![deny(missing_docs)]

mod bounds;
#[cfg(feature = "readers")]
pub mod builtin;
mod camera;
pub mod check;
mod counted;
pub mod emitter;
mod error;
mod exposure;
#[cfg(feature = "readers")]
pub mod file;
mod fit;
mod framing;
#[cfg(feature = "readers")]
pub mod gltf;
#[cfg(feature = "readers")]
mod import;
mod lens;
mod levels;
mod light;
#[cfg(feature = "readers")]
mod load;
mod lobes;
mod look;
mod material;
pub mod mesh;
mod mips;
mod motion;
#[cfg(feature = "readers")]
pub mod obj;
mod optional_parts;
mod path;
mod settings;
mod sky;
mod suggest;
mod temperature;
mod texels;
mod texture;
#[cfg(feature = "readers")]
mod uvs;

pub use bounds::Aabb;
pub use camera::{Camera, HEIGHT as ORTHOGRAPHIC_HEIGHT, Projection, decimal};
pub use counted::{counted, plural};
pub use emitter::Emitter;
pub use error::Error;
pub use error::without_controls;
pub use exposure::{ev100_of, exposure_scale, luminance, metered_ev100, seen_ev100};
#[cfg(feature = "readers")]
pub use fit::LightChoice;
pub use fit::{add_daylight, add_studio, drop_fitted_light, fit_camera, remove_ground, turntable};
#[cfg(feature = "readers")]
pub use import::{Imported, LoadOptions, Progress, Surroundings};
pub use lens::{Aperture, ThinLens};
pub use levels::{HAS_LEVELS, MOST_LEVELS};
pub use levels::{Level, Levels};
pub use light::{
    Falloff, Light, LightForm, LightKind, LightTrait, NO_FALLOFF, Outline, ShadowProjection, Solid, TRAITS, unit,
};
#[cfg(feature = "readers")]
pub use load::{OpenOptions, Up, open};
pub use lobes::{Anisotropy, DiffuseTransmission, MIN_SHEEN_ROUGHNESS, MOST_DISPERSION, Refraction, Sheen, ThinFilm};
pub use look::{HIGHLIGHT, HIGHLIGHT_SHARE, Look, MAX_ATLAS_EDGE};
pub(crate) use material::FORMS;
pub use material::{AlphaMode, Brdf, DIELECTRIC, Material, SlotForm, TextureSlot, UvMap, scaled};
pub use mesh::{CastsShadow, Mesh, Object, STROKE_ENDS, STROKE_VERTICES, TriangleId, stroke_indices};
// Tests of vertex order measure with these, here and in the renderer.
#[doc(hidden)]
pub use mesh::{grid_indices, transformed_vertices};
pub use motion::{
    CameraValue, Channel, ChannelTarget, Clip, ClipChoice, DeformBounds, Influences, Interpolation, LightValue, Local,
    MaterialValue, Morph, Motion, Node, Placement, Playing, Pose, Skin, deform, deform_frame,
};
pub use optional_parts::{Keep, OptionalPart};
pub use path::{CameraKey, CameraPath};
pub use settings::*;
pub use sky::{
    Atmosphere, CubeLevel, FACES, MOST_LIGHT, Sky, SkyCube, SkyDirection, SkyDistribution, SkyImage, SkyOrigin, Studio,
    SunDisc, face_direction,
};
#[cfg(feature = "readers")]
pub use sky::{SkyChoice, fit_to_light, put_sky, read_faces, read_panorama};
pub use suggest::{nearest, unknown};
pub use temperature::{KELVIN, black_body_color};
pub use texels::{BlockFormat, Texels};
pub use texels::{level_size, most_levels};
#[cfg(feature = "readers")]
// The program decodes pictures with it.
#[doc(hidden)]
pub use texture::decode;
pub use texture::{ColorSpace, Filter, Sampler, Texture, Wrap};

use std::path::PathBuf;

use glam::Vec3;

/// All content that a frame can show.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// The scene's name in reports: a file's name or `builtin:…`.
    pub name: String,
    /// The meshes; `Object::mesh` indexes them.
    pub meshes: Vec<Mesh>,
    /// The objects that are drawn: each is a mesh with a material at a place.
    pub objects: Vec<Object>,
    /// The materials, at least one if there is an object; `Object::material` indexes them.
    pub materials: Vec<Material>,
    /// The textures; the texture slots of `Material` index them.
    pub textures: Vec<Texture>,
    /// The sources of light besides the environment.
    pub lights: Vec<Light>,
    /// Light from everywhere.
    pub environment: Environment,
    /// The sky. It is drawn where no surface is, in place of the environment's background, and lights surfaces in addition to the ambient light.
    pub sky: Option<Sky>,
    /// The camera that sees the scene.
    pub camera: Camera,
    /// The cameras of the scene's files, as alternative views.
    pub cameras: Vec<NamedCamera>,
    /// The index in `cameras` of the camera that `camera` follows; `None` if it stands still.
    pub looks_through: Option<usize>,
    /// The scene's nodes, skins, shapes and clips.
    pub motion: Motion,
    /// Sources of particles.
    pub emitters: Vec<Emitter>,
    /// The moment at which particles stand still, in seconds; if `None`, they move, from 0 on.
    pub moment: Option<f64>,
    /// The parts that neither a file nor the caller chose.
    pub fitted: FittedParts,
    /// The settings that the scene file asks for; the command line overrides it.
    pub settings: SettingsPatch,
    /// Oddities of the input and how each was handled, a line each, with file and line where known.
    pub warnings: Vec<String>,
    /// The files that it was read from; empty for a built-in scene.
    pub files: Vec<PathBuf>,
}

/// A camera of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// The name, as `--camera` takes it.
    pub name: String,
    /// The camera when no clip plays.
    pub camera: Camera,
    /// The node of [`Motion::nodes`] that it is attached to.
    pub node: Option<usize>,
}

/// The parts of a scene that were fitted to its objects because nothing else gave them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FittedParts {
    /// True if the camera was fitted.
    pub camera: bool,
    /// True if [`SettingsPatch::exposure`] was fitted: to the studio, or to the visible part of the model.
    pub exposure: bool,
    /// True for a bare model. Unless an exposure is given, it is metered from the camera's view of the model.
    pub is_bare: bool,
    /// True if all light was fitted, so that a sky can replace it.
    pub light: bool,
    /// True if the sky, the background and the last light are a [`Studio`]'s. If `light` is false, lights of the file are there too.
    pub studio: bool,
    /// The index of the shadow-catching ground object below the model.
    pub ground: Option<usize>,
    /// The radiance in nits that an emission of 1 was scaled to, if materials give emission as shares of white.
    pub white: Option<f32>,
}

/// Light from everywhere, and the background.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Environment {
    /// Ambient radiance that reaches a surface from every direction, in nits, or with `ground` from every direction above the
    /// horizon. A lambert surface in even ambient light reflects albedo times this, a metal its lobe's share of this.
    pub ambient: Vec3,
    /// Radiance from every direction below the horizon (-Y), in nits; `None` means `ambient`.
    pub ground: Option<Vec3>,
    /// Radiance of the background, in nits.
    pub background: Vec3,
}

impl Environment {
    /// Radiance from below the horizon.
    pub fn ground(&self) -> Vec3 {
        self.ground.unwrap_or(self.ambient)
    }

    /// Returns true if ambient light comes from anywhere.
    pub fn is_lit(&self) -> bool {
        self.ambient.max(self.ground()).max_element() > 0.0
    }

    /// Mean and half difference of the two hemispheres' radiance. The irradiance on a surface whose normal n is tilted from straight up is
    /// pi (mean + half n.y): the surface faces shares of (1 + n.y) / 2 and (1 - n.y) / 2 of the hemispheres, exactly (B. Y. H. Liu and R. C. Jordan,
    /// "The Long-Term Average Performance of Flat-Plate Solar-Energy Collectors", 1963).
    pub fn hemispheres(&self) -> (Vec3, Vec3) {
        // Halved first: the sum of the largest radiances would overflow. Even light stays the same, to the last bit.
        let (sky, ground) = (self.ambient * 0.5, self.ground() * 0.5);
        (sky + ground, sky - ground)
    }
}

impl Scene {
    /// World-space box around all objects; empty when nothing is drawn.
    pub fn bounds(&self) -> Aabb {
        self.objects.iter().fold(Aabb::EMPTY, |all, object| all.union(&object.bounds(&self.meshes)))
    }

    /// The objects without the [fitted](FittedParts::ground) ground.
    pub fn model_objects(&self) -> impl Iterator<Item = &Object> {
        let own = self.objects.iter().enumerate().filter(|(index, _)| self.fitted.ground != Some(*index));
        own.map(|(_, object)| object)
    }

    /// World-space box around [`Scene::model_objects`].
    pub fn model_bounds(&self) -> Aabb {
        self.model_objects().fold(Aabb::EMPTY, |all, object| all.union(&object.bounds(&self.meshes)))
    }

    /// Returns true if a skin or shapes deform an object's mesh, so that the object needs separate vertices.
    pub fn deforms(&self, object: &Object) -> bool {
        let Some(mesh) = self.meshes.get(object.mesh) else { return false };
        let skinned = object.skin.is_some() && mesh.influences.is_some();
        let blended =
            object.node.and_then(|node| self.motion.nodes.get(node)).is_some_and(|node| !node.weights.is_empty());
        skinned || (blended && !mesh.morphs.is_empty())
    }

    /// Triangles of [`Scene::model_objects`], after instancing; two for each point or line.
    pub fn triangle_count(&self) -> usize {
        self.model_objects().filter_map(|object| self.meshes.get(object.mesh)).map(|mesh| mesh.indices.len() / 3).sum()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// The irradiance on a surface, summed over directions with equal steps of the cosine.
    fn summed(sky: f64, ground: f64, normal: DVec3) -> f64 {
        const STEPS: usize = 400;
        let across = normal.any_orthonormal_vector();
        let other = normal.cross(across);
        let share = |index: usize| (index as f64 + 0.5) / STEPS as f64;
        let directions = (0..STEPS * STEPS).map(|index| {
            let (radius, angle) = (share(index % STEPS).sqrt(), share(index / STEPS) * std::f64::consts::TAU);
            normal * (1.0 - radius * radius).sqrt() + (across * angle.cos() + other * angle.sin()) * radius
        });
        let sum: f64 = directions.map(|direction| if direction.y > 0.0 { sky } else { ground }).sum();
        sum / (STEPS * STEPS) as f64
    }

    #[test]
    fn half_spheres_light_a_surface_by_mean_and_tilt() {
        let environment =
            Environment { ambient: Vec3::splat(5.0), ground: Some(Vec3::splat(0.5)), background: Vec3::ZERO };
        let (mean, tilt) = environment.hemispheres();
        for degrees in [0.0, 20.0, 45.0, 90.0, 130.0, 180.0f64] {
            let normal = DVec3::new(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.0);
            let found = f64::from(mean.x) + f64::from(tilt.x) * normal.y;
            let expected = summed(5.0, 0.5, normal);
            assert!((found - expected).abs() < 5e-3, "{degrees}: {found} {expected}");
        }
    }

    #[test]
    fn even_light_has_no_tilt_and_stays_what_it_is() {
        for ambient in [Vec3::new(0.1, 1e18, 3e-30), Vec3::splat(f32::MAX)] {
            for ground in [None, Some(ambient)] {
                let environment = Environment { ambient, ground, background: Vec3::ZERO };
                assert_eq!(environment.hemispheres(), (ambient, Vec3::ZERO));
            }
        }
        let below = Environment { ambient: Vec3::ZERO, ground: Some(Vec3::X), background: Vec3::ZERO };
        assert!(below.is_lit() && !Environment::default().is_lit());
    }
}
