//! A scene as glTF 2.0: one `.glb` that other programs read, with its meshes, materials, textures, camera and lights.
//!
//! [`expressible`](expressible::expressible) reduces a scene to the parts that glTF can express, and lists the parts that it leaves out. The rest of
//! the module writes the reduced scene without loss: floats keep their bits, transforms their f64, and this program reads the same scene back.
//!
//! | Part of the file | Module |
//! |---|---|
//! | the part of a scene that glTF can express | `expressible`, `surfaces` |
//! | buffer views, accessors, the binary chunk | `binary` |
//! | meshes, objects, cameras, lights | `nodes`, `placing` |
//! | materials, textures, images | `materials`, `images` |

mod binary;
mod emitters;
mod expressible;
mod images;
mod materials;
mod nodes;
mod placing;
mod surfaces;

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use self::binary::Binary;
use self::materials::MaterialTable;
use self::nodes::NodeWriter;
use crate::{Environment, Error, SETTINGS, Scene, SettingsPatch, drop_fitted_light, exposure_scale, luminance};

/// The picture's data in the file, besides the scene.
#[derive(Debug, Clone)]
pub struct ExportedView {
    /// Width and height in pixels, both at least 1.
    pub size: [u32; 2],
    /// The exposure as EV100.
    pub exposure: f32,
    /// All given settings.
    pub settings: SettingsPatch,
    /// The author and the licence.
    pub copyright: Option<String>,
}

/// The result of writing a scene.
#[derive(Debug)]
pub struct Exported {
    /// The `.glb`.
    pub bytes: Vec<u8>,
    /// The scene that the file contains.
    pub scene: Scene,
    /// The parts of the given scene that glTF cannot express, a line each.
    pub left_out: Vec<String>,
    /// The extensions in use, by name.
    pub extensions: Vec<&'static str>,
}

/// Writes a scene at the start of its clips, without motion. Particles, skies, ambient light and other parts that glTF lacks are left out, with a
/// line each.
///
/// # Errors
/// [`Error::Scene`] for a fault of the scene, for a picture without pixels, for a scene without a triangle, and for one that is too large for a `.glb`.
pub fn write(scene: Scene, shot: &ExportedView) -> Result<Exported, Error> {
    scene.check()?;
    if shot.size.contains(&0) {
        return Err(Error::Scene(format!(
            "{}: a picture of {}x{} shows nothing",
            scene.name, shot.size[0], shot.size[1]
        )));
    }
    // Any program that opens the file fits light again.
    let mut scene = scene;
    let is_fitted = drop_fitted_light(&mut scene);
    let is_dark = !is_fitted && scene.lights.is_empty() && scene.sky.is_none();
    let (mut scene, left_out) = expressible::expressible(scene);
    scene.settings =
        SettingsPatch { exposure: shot.settings.exposure.or(Some(shot.exposure)), ..shot.settings.clone() };
    let surroundings = extras(shot, &scene.environment, is_dark);
    if scene.objects.is_empty() {
        return Err(Error::Scene(format!("{}: has no triangle to export", scene.name)));
    }
    let mut document = DocumentBuilder::default();
    let materials = MaterialTable::write(&scene, &mut document)?;
    NodeWriter { scene: &scene, materials: &materials, aspect: f64::from(shot.size[0]) / f64::from(shot.size[1]) }
        .write(&mut document, json!({ "afterlight": exposure(shot) }));
    let bytes = document.finish(shot, surroundings).map_err(|what| Error::Scene(format!("{}: {what}", scene.name)))?;
    // A reader makes the smaller levels itself, so the returned scene gets the same ones.
    scene.textures.par_iter_mut().for_each(|texture| {
        texture.rgba8_mut();
        texture.make_levels();
    });
    let extensions = document.extensions.into_iter().collect();
    Ok(Exported { bytes, scene, left_out, extensions })
}

/// The lists of a file while they are filled.
#[derive(Default)]
struct DocumentBuilder {
    lists: Map<String, Value>,
    binary: Binary,
    extensions: BTreeSet<&'static str>,
    lights: Vec<Value>,
    /// The nodes without a parent.
    roots: Vec<usize>,
}

impl DocumentBuilder {
    /// Adds an entry to a list of the file. Returns its number there.
    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.lists.entry(list).or_insert_with(|| Value::Array(Vec::new()));
        match list {
            Value::Array(list) => {
                list.push(value);
                list.len() - 1
            }
            _ => unreachable!("lists alone are in it"),
        }
    }

    /// Registers a used extension, and returns its name.
    fn uses(&mut self, extension: &'static str) -> &'static str {
        self.extensions.insert(extension);
        extension
    }

    /// The bytes of the file.
    fn finish(&mut self, shot: &ExportedView, surroundings: Value) -> Result<Vec<u8>, String> {
        let mut asset = json!({ "version": "2.0", "generator": concat!("afterlight ", env!("CARGO_PKG_VERSION")) });
        if let Some(copyright) = &shot.copyright {
            asset["copyright"] = copyright.as_str().into();
        }
        let mut file = std::mem::take(&mut self.lists);
        file.insert("asset".into(), asset);
        file.insert("scene".into(), 0.into());
        file.insert("scenes".into(), json!([{ "nodes": self.roots, "extras": surroundings }]));
        if !self.extensions.is_empty() {
            file.insert("extensionsUsed".into(), json!(self.extensions));
        }
        if !self.lights.is_empty() {
            file.insert("extensions".into(), json!({ "KHR_lights_punctual": { "lights": self.lights } }));
        }
        let binary = std::mem::take(&mut self.binary);
        binary.finish(file)
    }
}

/// Returns the exposure that a renderer needs to draw the same picture.
fn exposure(shot: &ExportedView) -> Value {
    json!({ "exposure_ev100": number(shot.exposure), "exposure_scale": number(exposure_scale(shot.exposure)) })
}

/// The exposure, and all other values that glTF has no property for, as [`surroundings`](super::surroundings) reads them. A scene without light is
/// marked as intentionally dark, since a reader would light it otherwise.
fn extras(shot: &ExportedView, environment: &Environment, is_dark: bool) -> Value {
    let color = |color: glam::Vec3| color.to_array().map(number);
    let mut extras = exposure(shot);
    extras["size"] = json!(shot.size);
    if environment.is_lit() || is_dark {
        extras["ambient_nits"] = json!(color(environment.ambient));
        if let Some(ground) = environment.ground {
            extras["ambient_from_below_nits"] = json!(color(ground));
        }
    }
    if luminance(environment.background) > 0.0 {
        extras["background_nits"] = json!(color(environment.background));
    }
    let said =
        SETTINGS.iter().filter_map(|setting| Some((setting.key.to_owned(), setting.text(&shot.settings)?.into())));
    let said: Map<String, Value> = said.collect();
    if !said.is_empty() {
        extras["settings"] = Value::Object(said);
    }
    json!({ "afterlight": extras })
}

/// A float as JSON, with the fewest digits that are read back as the same float.
fn number(value: f32) -> Value {
    let short = value.to_string().parse::<f64>().ok().filter(|short| *short as f32 == value);
    json!(short.unwrap_or(f64::from(value)))
}
