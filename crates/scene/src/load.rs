//! Opens the scene that a user names: built-in, scene file or bare model.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

#[cfg(doc)]
use super::Mesh;
use super::gltf::{self, GltfOptions};
use super::{Aabb, Error, Imported, LightChoice, LoadOptions, Progress, Scene, builtin, file, fit, obj};

/// Options for opening a scene. They need the feature `readers`.
#[derive(Clone, Copy)]
pub struct OpenOptions<'a> {
    /// Called with the progress of long work, from several threads.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    /// The aspect ratio, width over height, of the picture in which a fitted camera frames the model; above 0.
    pub aspect: f64,
    /// The length of a unit of a bare model's file, in metres, above 0.
    pub scale: f64,
    /// The upward axis of a bare model's file.
    pub up: Up,
    /// The scene of a bare glTF file to open, by its name or its number.
    pub scene: Option<&'a str>,
    /// The material variant of a bare glTF file (KHR_materials_variants).
    pub variant: Option<&'a str>,
    /// The light of a bare model. `None` takes the light of the file, else a studio, or the sun if the model is a hall.
    pub light: Option<&'a LightChoice>,
    /// True if glTF files may read files outside their folders.
    pub allow_outside: bool,
}

/// An axis of a file that points up. The other two stay right-handed. Needs the feature `readers`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// +Y, as in this program's world.
    #[default]
    Y,
    /// +Z, as in many modelling and CAD programs: their Y leads away from the viewer, as -Z does here.
    Z,
}

impl Default for OpenOptions<'_> {
    fn default() -> Self {
        Self {
            progress: None,
            aspect: 16.0 / 9.0,
            scale: 1.0,
            up: Up::Y,
            scene: None,
            variant: None,
            light: None,
            allow_outside: false,
        }
    }
}

impl<'a> OpenOptions<'a> {
    /// The transform from a bare model's file to metres with +Y up.
    fn placed(&self) -> DAffine3 {
        let turned = match self.up {
            Up::Y => DMat3::IDENTITY,
            Up::Z => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
        };
        DAffine3::from_mat3(turned * self.scale)
    }

    pub(super) fn load_options(&self) -> LoadOptions<'a> {
        LoadOptions { progress: self.progress }
    }
}

/// A bare model that is longer than this, in metres, is assumed to use another unit.
const LONG: f64 = 500.0;

/// The files that can be opened, and the files that a scene file may take models from, for messages.
const READS: &str = "scene files (.toml), models (.gltf, .glb, .obj) and builtin:NAME";
const READS_MODELS: &str = "models from .gltf, .glb and .obj files (a scene file goes under base)";

/// A model file by its extension.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ModelFormat {
    Obj,
    Gltf,
}

impl ModelFormat {
    fn of(path: &Path) -> Option<Self> {
        match extension(path).as_str() {
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            _ => None,
        }
    }
}

/// Opens `builtin:NAME?key=value&…`, a scene file (`.toml`) or a bare model (`.gltf`, `.glb`, `.obj`). If the file has no camera or no light, one is
/// fitted to the model. Needs the feature `readers`.
///
/// # Errors
/// [`Error`], one line that names the fault and the place; see its variants. [`Error::Setting`] for a scale or an upward axis of anything but a bare
/// model, and for a scene or a variant of anything but a bare glTF file.
pub fn open(spec: &str, options: &OpenOptions) -> Result<Scene, Error> {
    let mut scene = open_base(spec, options)?;
    if !spec.starts_with(builtin::PREFIX) {
        order_triangles(&mut scene);
    }
    Ok(scene)
}

/// Opens the base of a scene file as [`open`] does, but without ordering triangles: that is done once, for the whole scene.
///
/// # Errors
/// As [`open`].
pub(super) fn open_base(spec: &str, options: &OpenOptions) -> Result<Scene, Error> {
    let format = ModelFormat::of(Path::new(spec)).filter(|_| !spec.starts_with(builtin::PREFIX));
    if options.placed() != DAffine3::IDENTITY && format.is_none() {
        let why = "--scale and --up are for a bare model (.gltf, .glb, .obj): a scene file has scale and rotation for each of its models";
        return Err(Error::Setting(why.into()));
    }
    if options.light.is_some() && format.is_none() {
        let why = "--light is for a bare model (.gltf, .glb, .obj): a scene file says its own, and --sky gives any scene a sky";
        return Err(Error::Setting(why.into()));
    }
    if (options.scene.is_some() || options.variant.is_some()) && format != Some(ModelFormat::Gltf) {
        let why = "--scene and --variant are for a bare glTF file (.gltf, .glb): a scene file has scene and variant for each of its models";
        return Err(Error::Setting(why.into()));
    }
    if spec.starts_with(builtin::PREFIX) {
        return builtin::open(spec);
    }
    // Each number is checked when it is read. Products of them may still overflow, which a plan detects.
    open_file(Path::new(spec), options)
}

fn open_file(path: &Path, options: &OpenOptions) -> Result<Scene, Error> {
    if path.is_dir() {
        return Err(Error::Read {
            path: path.to_owned(),
            cause: format!("it is a directory; afterlight reads {READS}"),
        });
    }
    match (extension(path).as_str(), ModelFormat::of(path)) {
        ("toml", _) => file::load(path, options),
        (_, Some(format)) => open_model(path, format, options),
        _ => Err(unreadable(path, READS)),
    }
}

/// Orders the triangles of meshes for devices ([`Mesh::order_triangles`]). Meshes of blended objects keep their order.
fn order_triangles(scene: &mut Scene) {
    let mut are_blended = vec![false; scene.meshes.len()];
    for object in &scene.objects {
        are_blended[object.mesh] |= scene.materials[object.material].is_transparent();
    }
    let others = scene.meshes.par_iter_mut().zip(are_blended).filter(|(_, is_blended)| !is_blended);
    others.for_each(|(mesh, _)| mesh.order_triangles());
}

/// Opens a bare model; missing cameras and lights are fitted to it.
fn open_model(path: &Path, format: ModelFormat, options: &OpenOptions) -> Result<Scene, Error> {
    let mut scene = Scene { name: path.display().to_string(), ..Scene::default() };
    let chosen = Chosen { scene: options.scene, variant: options.variant };
    let mut model = load_model(path, &chosen, options)?;
    let surroundings = model.surroundings.take();
    let keeps_lights = options.light.is_none_or(LightChoice::keeps_lights);
    if !keeps_lights {
        model.drop_lights();
    }
    model.append_to(&mut scene, options.placed());
    // The other formats are in metres by their specification.
    let doubt = if format == ModelFormat::Obj { doubt(&scene.bounds(), options) } else { None };
    scene.warnings.extend(doubt);
    let stand = fit::fit_camera(&mut scene, options.aspect);
    if let Some(own) = scene.cameras.first() {
        (scene.camera, scene.fitted.camera, scene.looks_through) = (own.camera, false, Some(0));
    }
    scene.fitted.is_bare = surroundings.is_none();
    match surroundings.filter(|own| keeps_lights && (own.is_lit || !scene.lights.is_empty())) {
        Some(own) => (scene.environment, scene.settings) = (own.environment, own.settings),
        None => fit::light_model(&mut scene, options.light, stand)?,
    }
    // Emission becomes shares of white: by the format's definition, or because the fitted light is not the light that its nits were meant for.
    if format == ModelFormat::Obj || scene.fitted.light {
        fit::fit_emission(&mut scene);
    }
    Ok(scene)
}

/// Returns a warning if the model is too large for its unit to be the metre.
fn doubt(bounds: &Aabb, options: &OpenOptions) -> Option<String> {
    let longest = bounds.size().max_element();
    let is_odd = options.scale == 1.0 && !bounds.is_empty() && longest > LONG;
    is_odd.then(|| {
        format!("the model is {longest:.0} m long, and an .obj file has no units: were they centimetres, --scale 0.01 makes metres of them")
    })
}

/// The parts of a glTF file that are shown.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Chosen<'a> {
    pub scene: Option<&'a str>,
    pub variant: Option<&'a str>,
}

/// Reads a model file.
pub(super) fn load_model(path: &Path, chosen: &Chosen, options: &OpenOptions) -> Result<Imported, Error> {
    match ModelFormat::of(path) {
        Some(ModelFormat::Obj) if *chosen != Chosen::default() => {
            let what = "scene and variant are of glTF files, which an .obj file is not".into();
            Err(Error::Content { path: path.to_owned(), line: None, what })
        }
        Some(ModelFormat::Obj) => obj::load(path, &options.load_options()),
        Some(ModelFormat::Gltf) => {
            let Chosen { scene, variant } = *chosen;
            let (allow_outside, load) = (options.allow_outside, options.load_options());
            gltf::load(path, &GltfOptions { scene, variant, allow_outside, load })
        }
        None => Err(unreadable(path, READS_MODELS)),
    }
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// `reads` lists the formats that could be read in its place.
fn unreadable(path: &Path, reads: &str) -> Error {
    // A missing file is the likelier slip than a wrong format.
    if let Err(error) = std::fs::metadata(path) {
        let name = path.to_string_lossy();
        let meant = builtin::CATALOGUE.iter().find(|own| own.name == name);
        let meant = meant.map_or_else(String::new, |own| format!("; did you mean builtin:{}?", own.name));
        return Error::Read { path: path.to_owned(), cause: format!("{error}{meant}") };
    }
    let what = match extension(path).as_str() {
        "toml" => "a scene file is not a model".into(),
        "" => "the file has no extension that tells what it is".into(),
        extension => format!(".{extension} is not a format that is read"),
    };
    Error::Content { path: path.to_owned(), line: None, what: format!("{what}; afterlight reads {reads}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bare_model_is_scaled_and_put_upright_and_one_too_long_is_told() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("tower.obj");
        std::fs::write(&path, "v 0 0 0\nv 100 200 3000\nv 0 200 0\nf 1 2 3\n").unwrap();
        let open = |options| open(path.to_str().unwrap(), &options).unwrap();
        let plain = open(OpenOptions::default());
        assert!(
            plain.warnings.iter().any(|warning| warning.contains("3000 m long") && warning.contains("--scale 0.01"))
        );
        assert!(plain.fitted.camera);
        let up = open(OpenOptions { scale: 0.01, up: Up::Z, ..OpenOptions::default() });
        assert!(up.warnings.iter().all(|warning| !warning.contains("long")), "{:?}", up.warnings);
        let bounds = up.model_bounds();
        assert!(
            bounds.min.distance(DVec3::new(0.0, 0.0, -2.0)) < 1e-9
                && bounds.max.distance(DVec3::new(1.0, 30.0, 0.0)) < 1e-9
        );
        let scaled = OpenOptions { scale: 2.0, ..OpenOptions::default() };
        assert!(super::open("builtin:hall", &scaled).unwrap_err().to_string().contains("bare model"));
    }

    #[test]
    fn triangles_are_ordered_but_where_they_are_blended() {
        let directory = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = directory.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        // Two strips in turn: no triangle shares a vertex with the one before it.
        let vertices: String = (0..50).map(|i| format!("v {} {} {}\n", i / 2, i % 2, i / 25)).collect();
        let faces = (0..40u32).map(|i| i / 2 + 25 * (i % 2) + 1).map(|i| format!("f {i} {} {}\n", i + 1, i + 2));
        let strips = write("strips.obj", &(vertices + &faces.collect::<String>()));
        let named = "base_color = [1, 1, 1]\n";
        let plain = write(
            "plain.toml",
            &format!("[[models]]\npath = \"strips.obj\"\nmaterial = \"own\"\n[[materials]]\nname = \"own\"\n{named}"),
        );
        let blend = format!("{named}alpha_mode = \"blend\"\nalpha = 0.5\n");
        let glass = write(
            "glass.toml",
            &format!("[[models]]\npath = \"strips.obj\"\nmaterial = \"own\"\n[[materials]]\nname = \"own\"\n{blend}"),
        );
        let shared = |path: &Path| {
            let scene = open(path.to_str().unwrap(), &OpenOptions::default()).unwrap();
            let triangles = scene.meshes[0].indices.as_chunks::<3>().0.to_vec();
            assert_eq!(triangles.len(), 40);
            triangles.windows(2).filter(|pair| pair[0].iter().any(|vertex| pair[1].contains(vertex))).count()
        };
        assert_eq!((shared(&glass), shared(&plain) > 30, shared(&strips) > 30), (0, true, true));
    }

    #[test]
    fn what_cannot_be_opened_says_what_can() {
        let directory = tempfile::tempdir().unwrap();
        let file = |name: &str| {
            let path = directory.path().join(name);
            std::fs::write(&path, "x").unwrap();
            open(path.to_str().unwrap(), &OpenOptions::default()).unwrap_err().to_string()
        };
        assert!(file("a.fbx").contains(".fbx is not a format that is read; afterlight reads scene files (.toml)"));
        assert!(file("a.gltf").contains("a.gltf:1: is no glTF"));
        assert!(file("a").contains("no extension"));
        let says = |spec: &str| open(spec, &OpenOptions::default()).unwrap_err().to_string();
        assert!(says(directory.path().to_str().unwrap()).contains("is a directory"));
        for missing in ["/no/such.obj", "/no/such.toml", "/no/such", ""] {
            assert!(says(missing).starts_with("cannot read"), "{}", says(missing));
        }
    }
}
