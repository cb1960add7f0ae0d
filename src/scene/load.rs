//! Opens whatever a user names as a scene.

use std::path::Path;

use glam::DAffine3;

use super::{Error, LoadOptions, Progress, Scene, builtin, file, fit, obj};

/// How to open a scene.
#[derive(Clone, Copy)]
pub struct OpenOptions<'a> {
    /// Told how far long work has come; called from several threads.
    pub progress: Option<&'a (dyn Fn(Progress) + Sync)>,
    /// Width over height of the picture that a fitted camera must hold the model in; above 0.
    pub aspect: f64,
}

impl Default for OpenOptions<'_> {
    fn default() -> Self {
        Self { progress: None, aspect: 16.0 / 9.0 }
    }
}

impl<'a> OpenOptions<'a> {
    pub(super) fn load_options(&self) -> LoadOptions<'a> {
        LoadOptions { progress: self.progress }
    }
}

/// What can be opened, and what a scene file may take its models from, for messages.
const READS: &str = "scene files (.toml), Wavefront models (.obj) and builtin:NAME";
const READS_MODELS: &str = "models from .obj files (a scene file goes under base)";

/// Opens `builtin:NAME?key=value&…`, a scene file (`.toml`) or a bare model (`.obj`), which gets a camera and a sun that fit it.
///
/// # Errors
/// [`Error`], one line that names what is wrong with what; see its variants.
pub fn open(spec: &str, options: &OpenOptions) -> Result<Scene, Error> {
    if spec.starts_with(builtin::PREFIX) {
        return builtin::open(spec);
    }
    // Each number is looked at when it is read. Products of them may still overflow, which a plan finds out.
    open_file(Path::new(spec), options)
}

fn open_file(path: &Path, options: &OpenOptions) -> Result<Scene, Error> {
    if path.is_dir() {
        return Err(Error::Read {
            path: path.to_owned(),
            cause: format!("it is a directory; afterlight reads {READS}"),
        });
    }
    match extension(path).as_str() {
        "toml" => file::load(path, options),
        "obj" => open_model(path, options),
        _ => Err(unreadable(path, READS)),
    }
}

/// A bare model: nothing in it says how it is seen or lit.
fn open_model(path: &Path, options: &OpenOptions) -> Result<Scene, Error> {
    let mut scene = Scene { name: path.display().to_string(), ..Scene::default() };
    load_model(path, options, DAffine3::IDENTITY, &mut scene)?;
    let stand = fit::fit_camera(&mut scene, options.aspect);
    fit::add_daylight(&mut scene);
    fit::fit_exposure(&mut scene, stand);
    Ok(scene)
}

/// Adds a model file's content to a scene.
pub(super) fn load_model(
    path: &Path,
    options: &OpenOptions,
    transform: DAffine3,
    scene: &mut Scene,
) -> Result<(), Error> {
    if extension(path) != "obj" {
        return Err(unreadable(path, READS_MODELS));
    }
    obj::load(path, &options.load_options())?.append_to(scene, transform);
    Ok(())
}

fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// `reads` is what could be read in its place.
fn unreadable(path: &Path, reads: &str) -> Error {
    // A missing file is the likelier slip than a wrong format.
    if let Err(error) = std::fs::metadata(path) {
        return Error::Read { path: path.to_owned(), cause: error.to_string() };
    }
    let what = match extension(path).as_str() {
        extension @ ("gltf" | "glb") => format!(".{extension} (glTF) is not read yet"),
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
    fn what_cannot_be_opened_says_what_can() {
        let directory = tempfile::tempdir().unwrap();
        let file = |name: &str| {
            let path = directory.path().join(name);
            std::fs::write(&path, "x").unwrap();
            open(path.to_str().unwrap(), &OpenOptions::default()).unwrap_err().to_string()
        };
        assert!(file("a.gltf").contains("glTF) is not read yet; afterlight reads scene files (.toml)"));
        assert!(file("a.fbx").contains(".fbx is not a format"));
        assert!(file("a").contains("no extension"));
        let says = |spec: &str| open(spec, &OpenOptions::default()).unwrap_err().to_string();
        assert!(says(directory.path().to_str().unwrap()).contains("is a directory"));
        for missing in ["/no/such.obj", "/no/such.toml", "/no/such", ""] {
            assert!(says(missing).starts_with("cannot read"), "{}", says(missing));
        }
    }
}
