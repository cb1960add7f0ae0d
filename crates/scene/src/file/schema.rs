//! The keys of a scene file, table by table. docs/SCENES.md explains each; a test holds the two together. The keys of settings are the rows of
//! [`SETTINGS`](crate::SETTINGS), and docs/SETTINGS.md has them.

use crate::settings;

use super::lights::LIGHT;
use super::{emitters, sky};
use crate::FORMS;

/// A table of the scene file and the keys that it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Schema {
    /// As the documentation calls it: `root`, `camera`, `models.shape`.
    pub table: &'static str,
    /// Keys in no particular order.
    pub keys: &'static [&'static str],
}

pub(super) const ROOT: Schema = Schema {
    table: "root",
    keys: &[
        "base",
        "base_lights",
        "camera",
        "clips",
        "emitters",
        "environment",
        "lights",
        "materials",
        "models",
        "scattered_lights",
        "settings",
        "sky",
    ],
};
pub(super) const MODEL: Schema = Schema {
    table: "models",
    keys: &[
        "name",
        "path",
        "builtin",
        "shape",
        "scene",
        "variant",
        "lights",
        "material",
        "materials",
        "casts_shadow",
        "receives_shadow",
        "cell",
        "tint",
        "selected",
        "movable",
        "translation",
        "rotation",
        "scale",
        "instances",
        "grid",
    ],
};
pub(super) const SHAPE: Schema =
    Schema { table: "models.shape", keys: &["kind", "size", "radius", "height", "tube", "segments"] };
pub(super) const INSTANCE: Schema =
    Schema { table: "models.instances", keys: &["translation", "rotation", "scale", "cell", "tint", "selected"] };
pub(super) const ROTATION: Schema = Schema { table: "rotation", keys: &["quaternion", "axis", "degrees"] };
pub(super) const GRID: Schema = Schema { table: "models.grid", keys: &["count", "spacing"] };
/// Keys of materials besides the texture slots'.
const FACTORS: &[&str] = &[
    "name",
    "brdf",
    "base_color",
    "alpha",
    "alpha_mode",
    "alpha_cutoff",
    "metallic",
    "roughness",
    "ior",
    "specular_strength",
    "specular_tint",
    "specular",
    "shininess",
    "ambient",
    "sheen_color",
    "sheen_roughness",
    "film",
    "film_ior",
    "film_thickness",
    "anisotropy",
    "anisotropy_rotation_degrees",
    "thickness",
    "attenuation_color",
    "attenuation_distance",
    "dispersion",
    "diffuse_transmission",
    "diffuse_transmission_color",
    "emissive",
    "emissive_strength",
    "normal_scale",
    "two_sided",
    "unlit",
    "atlas",
];
const MATERIAL_KEYS: [&str; FACTORS.len() + FORMS.len()] = {
    let mut keys = [""; FACTORS.len() + FORMS.len()];
    let mut index = 0;
    while index < keys.len() {
        keys[index] = if index < FACTORS.len() { FACTORS[index] } else { FORMS[index - FACTORS.len()].key };
        index += 1;
    }
    keys
};
pub(super) const MATERIAL: Schema = Schema { table: "materials", keys: &MATERIAL_KEYS };
/// A texture with how it is sampled and how it lies on meshes.
pub(super) const TEXTURE: Schema = Schema {
    table: "materials.texture",
    keys: &["file", "wrap", "filter", "uv_set", "offset", "rotation_degrees", "scale"],
};
pub(super) const CAMERA: Schema = Schema {
    table: "camera",
    keys: &["position", "target", "up", "rotation", "fov_y_degrees", "orthographic_height", "near", "exposure"],
};
pub(super) const FALLOFF: Schema =
    Schema { table: "lights.falloff", keys: &["constant", "linear", "quadratic", "cutoff"] };
pub(super) const SCATTER: Schema = Schema {
    table: "scattered_lights",
    keys: &["name", "count", "min", "max", "intensity", "range", "falloff", "saturation", "seed"],
};
pub(super) const ENVIRONMENT: Schema = Schema {
    table: "environment",
    keys: &[
        "ambient",
        "ambient_strength",
        "sky",
        "sky_strength",
        "ground",
        "ground_strength",
        "background",
        "background_strength",
    ],
};
pub(super) const CLIP: Schema = Schema { table: "clips", keys: &["name", "channels"] };
pub(super) const CHANNEL: Schema = Schema {
    table: "clips.channels",
    keys: &["target", "property", "times", "values", "axis", "interpolation", "in_tangents", "out_tangents"],
};
pub(super) const SETTINGS: Schema = Schema { table: "settings", keys: settings::KEYS };
/// A file with a camera's path.
pub(super) const PATH: Schema = Schema { table: "path", keys: &["keys"] };
pub(super) const KEY: Schema = Schema {
    table: "path.keys",
    keys: &["time", "position", "target", "up", "rotation", "fov_y_degrees", "orthographic_height"],
};
/// The top of a settings file, which is no scene.
pub(super) const SETTINGS_FILE: Schema = Schema { table: "settings file", keys: &["settings", "evidence"] };
pub(super) const SHADOWS: Schema = Schema { table: "settings.shadows", keys: settings::SHADOW_KEYS };

/// All tables, in the order of the documentation.
pub const TABLES: &[Schema] = &[
    ROOT,
    MODEL,
    SHAPE,
    INSTANCE,
    ROTATION,
    GRID,
    MATERIAL,
    TEXTURE,
    CAMERA,
    LIGHT,
    FALLOFF,
    SCATTER,
    ENVIRONMENT,
    sky::TABLE,
    sky::ATMOSPHERE,
    emitters::TABLE,
    CLIP,
    CHANNEL,
    SETTINGS,
    SHADOWS,
    PATH,
    KEY,
];
