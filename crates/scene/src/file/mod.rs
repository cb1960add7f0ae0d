//! Scene files: TOML that names models, materials, lights, a camera and settings; and the smaller files beside them, with settings or a camera's
//! path alone. docs/SCENES.md explains every key. This module needs the feature `readers`.
//!
//! Values are read from TOML's own tree with their places, so that every message names file, line and key; [`schema`] lists the keys that a
//! table may have. Paths are relative to the scene file.

mod clips;
mod emitters;
mod lights;
mod lobes;
mod materials;
mod models;
mod node;
mod path;
mod place;
mod scatter;
pub mod schema;
mod settings;
mod sky;
mod write;

pub use path::{load_path, parse_path};
pub use write::{Model, Origin, to_toml};

use std::cell::Cell;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::DeTable;

use self::materials::Textures;
use self::models::Models;
use self::node::{KeyedValue, SourceText, Table};
use super::load::OpenOptions;
use super::{Error, Scene, SettingsPatch, builtin, drop_fitted_light, fit, load};
use afterlight_files::regular_file::{read_given, read_regular};

/// The longest text that is read.
const MOST_BYTES: u64 = 64 << 20;
/// The most scene files that may build on each other.
const MAX_BASES: u32 = 8;

/// Opens a scene file.
///
/// # Errors
/// [`Error::Read`] when it cannot be read; [`Error::Content`] with the line when something in it is wrong.
pub fn load(path: &Path, options: &OpenOptions) -> Result<Scene, Error> {
    let mut scene = parse(&read_file(path)?, path, options)?;
    scene.files.push(path.to_owned());
    Ok(scene)
}

/// The text of a scene file, or of one that another names.
fn read_file(path: &Path) -> Result<String, Error> {
    let bytes = read_regular(path, MOST_BYTES);
    text_of(bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?, path)
}

/// The text of a file that a command line names, which may be a pipe.
fn read_text(path: &Path) -> Result<String, Error> {
    let bytes = read_given(path, MOST_BYTES);
    text_of(bytes.map_err(|error| Error::Read { path: path.to_owned(), cause: error.to_string() })?, path)
}

fn text_of(bytes: Vec<u8>, path: &Path) -> Result<String, Error> {
    let read = |cause: String| Error::Read { path: path.to_owned(), cause };
    String::from_utf8(bytes).map_err(|error| {
        read(format!("it is not UTF-8 text (byte {}), as TOML must be", error.utf8_error().valid_up_to()))
    })
}

fn parse_root<'a>(source: SourceText<'a>) -> Result<Spanned<DeTable<'a>>, Error> {
    DeTable::parse(source.text).map_err(|error| {
        let message = error.message().lines().collect::<Vec<_>>().join(", ");
        source.error(error.span().map_or(0, |span| span.start), message)
    })
}

/// Reads the text of a scene file that stands, or would stand, at `path`.
///
/// # Errors
/// As [`fn@load`].
pub fn parse(text: &str, path: &Path, options: &OpenOptions) -> Result<Scene, Error> {
    let source = SourceText { path, text };
    let root = parse_root(source)?;
    let root = Table::open(source, 0, String::new(), root.get_ref(), schema::ROOT)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scene = base(&root, folder, options)?;
    scene.name = path.display().to_string();
    let mut models = Models::new(folder, options, clips::moved_models(&root)?);
    let dresses =
        root.list("models")?.iter().map(|node| models.add(node, &mut scene)).collect::<Result<Vec<_>, _>>()?;
    let mut textures = Textures::in_folder(folder);
    for node in root.list("materials")? {
        materials::material(&node, &mut scene, &mut textures)?;
    }
    for dress in &dresses {
        dress.put_on(&mut scene)?;
    }
    add_tangents(&mut scene);
    lobes::warn(&root, &mut scene)?;
    let first_light = light_and_view(&root, &mut scene, folder, options)?;
    let emitters = root.list("emitters")?;
    for (index, node) in emitters.iter().enumerate() {
        emitters::emitter(node, index, &mut scene, &mut textures)?;
    }
    if let Some(last) = emitters.last() {
        emitters::check(&scene, last)?;
    }
    clips::add(&root, &mut scene, &dresses, first_light)?;
    if scene.objects.is_empty() && scene.emitters.is_empty() {
        let warning =
            format!("{}: nothing is drawn, as the file has neither models nor a base with some", path.display());
        scene.warnings.push(warning);
    }
    Ok(scene)
}

/// The settings that scene files say themselves, by their keys, each with `FILE:LINE`. Files that cannot be read say none.
pub fn said_where(files: &[PathBuf]) -> Vec<(&'static str, String)> {
    let of = |path: &PathBuf| {
        let text = read_file(path).ok()?;
        let source = SourceText { path, text: &text };
        let root = parse_root(source).ok()?;
        let root = Table::open(source, 0, String::new(), root.get_ref(), schema::ROOT).ok()?;
        Some(settings::lines(&root.get("settings")?))
    };
    let scene_files = files.iter().filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    scene_files.filter_map(of).flatten().collect()
}

/// Opens a settings file: `[settings]` as in a scene file, and beside it at most `[evidence]`, which is not read.
///
/// # Errors
/// [`Error::Read`] when it cannot be read; [`Error::Content`] with the line when something in it is wrong.
pub fn load_settings(path: &Path) -> Result<SettingsPatch, Error> {
    parse_settings(&read_text(path)?, path)
}

/// Reads the text of a settings file that stands, or would stand, at `path`.
///
/// # Errors
/// As [`load_settings`].
pub fn parse_settings(text: &str, path: &Path) -> Result<SettingsPatch, Error> {
    let source = SourceText { path, text };
    let root = parse_root(source)?;
    let root = Table::open(source, 0, String::new(), root.get_ref(), schema::SETTINGS_FILE)?;
    let Some(node) = root.get("settings") else {
        return Err(source.error(0, "a settings file needs [settings]".into()));
    };
    if let Some(from) = node.table(schema::SETTINGS)?.get("from") {
        return Err(from.wrong("only a scene file takes settings from another"));
    }
    settings::settings(&node)
}

thread_local! {
    /// This thread's depth in files that build on each other.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Returns the scene that the file starts from: empty, or the one that `base` names.
fn base(root: &Table, folder: &Path, options: &OpenOptions) -> Result<Scene, Error> {
    let Some(node) = root.get("base") else {
        return match root.get("base_lights") {
            Some(node) => Err(node.wrong("base_lights goes with base")),
            None => Ok(Scene::default()),
        };
    };
    let spec = node.string()?;
    let depth = DEPTH.get();
    if depth >= MAX_BASES {
        return Err(node.wrong(format!("more than {MAX_BASES} files build on each other: is one its own base?")));
    }
    let path = folder.join(spec);
    DEPTH.set(depth + 1);
    let opened = match path.to_str() {
        _ if spec.starts_with(builtin::PREFIX) => builtin::open(spec),
        Some(path) => load::open_base(path, options),
        None => Err(Error::Read { path, cause: "its name is not UTF-8".into() }),
    };
    DEPTH.set(depth);
    let mut scene = opened.map_err(|error| from_another(&node, error))?;
    // Scene files give emission in nits, so the base's emission is not fitted again.
    scene.fitted.white = None;
    if root.read("base_lights", KeyedValue::boolean)? == Some(false) {
        drop_fitted_light(&mut scene);
        scene.lights.clear();
        scene.motion.forget_lights();
    }
    // The fitted ground must still be the last object, mesh and material, so that it can be taken away.
    if brings_light(root) {
        drop_fitted_light(&mut scene);
    }
    if root.get("models").is_some() {
        fit::remove_ground(&mut scene);
    }
    Ok(scene)
}

/// Returns true if a scene file has lights, an environment or a sky.
fn brings_light(root: &Table) -> bool {
    ["lights", "scattered_lights", "environment", "sky"].iter().any(|key| root.get(key).is_some())
}

/// The error of a file that another file names: at its own line if it has one, else at the key that names the file.
fn from_another(node: &KeyedValue, error: Error) -> Error {
    match error {
        Error::Content { line: Some(_), .. } => error,
        other => node.wrong(other),
    }
}

/// A mesh whose material came by a normal map only here still lacks tangents.
fn add_tangents(scene: &mut Scene) {
    for object in &scene.objects {
        let mesh = &mut scene.meshes[object.mesh];
        if scene.materials[object.material].needs_tangents() && mesh.tangents.is_empty() {
            mesh.compute_tangents();
        }
    }
}

/// Reads lights, environment, camera and settings. A file without a base may leave some out: these are fitted to its models.
/// Returns the number of the file's own first light.
fn light_and_view(root: &Table, scene: &mut Scene, folder: &Path, options: &OpenOptions) -> Result<usize, Error> {
    let says = |key: &str| root.get(key).is_some();
    let own = root.read("settings", settings::settings)?.unwrap_or_default();
    let of_camera = root.read("camera", settings::camera_exposure)?.unwrap_or_default();
    let from =
        root.read("settings", |node| settings::from(node, folder, &mut scene.files))?.flatten().unwrap_or_default();
    let said = own.or(&of_camera).or(&from);
    let is_lit = brings_light(root);
    scene.fitted.exposure &= said.exposure.is_none();
    scene.settings = said.or(&scene.settings);
    let first_light = scene.lights.len();
    for (index, node) in root.list("lights")?.iter().enumerate() {
        scene.lights.push(lights::light(node, index)?);
    }
    for node in root.list("scattered_lights")? {
        scatter::lights(&node, &mut scene.lights)?;
    }
    if let Some(node) = root.get("environment") {
        scene.environment = settings::environment(&node, scene.environment)?;
    }
    if let Some(node) = root.get("sky") {
        sky::sky(&node, scene, folder)?;
    }
    if !says("base") {
        let aspect = scene.settings.size.map_or(options.aspect, |[width, height]| f64::from(width) / f64::from(height));
        let stand = fit::fit_camera(scene, aspect);
        // Models of glTF bring their own.
        if !is_lit && scene.lights.is_empty() {
            fit::light_model(scene, None, stand)?;
        }
    }
    if scene.fitted.studio && scene.fitted.ground.is_none() && scene.fitted.light {
        fit::ground::add(scene, fit::ground::ALBEDO);
    }
    if let Some(node) = root.get("camera") {
        scene.camera = settings::camera(&node, scene.camera)?;
        (scene.fitted.camera, scene.looks_through) = (false, None);
    }
    Ok(first_light)
}
