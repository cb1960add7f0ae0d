//! The driver manifests that a Vulkan loader would look at: small JSON files that name a driver's library. They need
//! the feature `caches`.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use super::system::VulkanComponent;
use afterlight_files::regular_file::read_regular;

/// The most bytes of a manifest. A driver's has a few hundred.
const MOST_BYTES: u64 = 1 << 20;

/// A driver's manifest.
#[derive(Debug, PartialEq, Eq)]
pub struct Manifest {
    /// The manifest's file.
    pub path: PathBuf,
    /// The library that it names, or why it names none.
    pub library: Result<PathBuf, String>,
}

impl Manifest {
    fn read(path: PathBuf) -> Self {
        let library = library_of(&path);
        Self { path, library }
    }

    /// Returns its fault, as far as that shows without loading the library.
    pub fn fault(&self) -> Option<String> {
        match &self.library {
            Err(why) => Some(why.clone()),
            Ok(library) => {
                // A bare file name is looked up by the system's linker; a path is relative to the manifest.
                let folder = self.path.parent().unwrap_or(Path::new("."));
                let is_path = library.components().count() > 1;
                let missing = is_path && !folder.join(library).exists();
                missing.then(|| format!("its library {} does not exist", library.display()))
            }
        }
    }
}

fn library_of(manifest: &Path) -> Result<PathBuf, String> {
    let text = read_regular(manifest, MOST_BYTES).map_err(|error| format!("cannot be read: {error}"))?;
    let json: serde_json::Value = serde_json::from_slice(&text).map_err(|error| format!("is no JSON: {error}"))?;
    let library = json.pointer("/ICD/library_path").and_then(serde_json::Value::as_str);
    library.map(PathBuf::from).ok_or_else(|| "has no ICD.library_path".to_owned())
}

/// The manifests in the places where the loader looks, in its order, and a note when variables override these.
pub fn find() -> (Vec<Manifest>, Option<String>) {
    find_with(|name| env::var_os(name))
}

fn find_with(variable: impl Fn(&str) -> Option<OsString>) -> (Vec<Manifest>, Option<String>) {
    let set = |name: &str| variable(name).filter(|value| !value.is_empty());
    // The newer name wins; either replaces the usual places.
    let overriding = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].into_iter().find(|name| set(name).is_some());
    let mut places: Vec<PathBuf> = Vec::new();
    match overriding.and_then(set) {
        Some(value) => places.extend(env::split_paths(&value)),
        None => {
            let added = set("VK_ADD_DRIVER_FILES");
            places.extend(added.iter().flat_map(env::split_paths));
            places.extend(usual_folders(&set));
        }
    }
    let mut found: Vec<Manifest> = Vec::new();
    for path in places.into_iter().flat_map(manifests_at) {
        if found.iter().all(|manifest| manifest.path != path) {
            found.push(Manifest::read(path));
        }
    }
    let note = overriding.map(|name| format!("{name} is set: only what it names counts"));
    (found, note)
}

/// Returns the environment variable that keeps the loader from a missing part of Vulkan, with the fault of its value. Returns `None` if no such variable
/// is set.
pub fn overriding_hint(what: VulkanComponent) -> Option<String> {
    overriding_hint_with(what, |name| env::var_os(name))
}

fn overriding_hint_with(what: VulkanComponent, variable: impl Fn(&str) -> Option<OsString>) -> Option<String> {
    let names: &[&str] = match what {
        VulkanComponent::Loader => &[],
        // The newer name wins.
        VulkanComponent::Driver => &["VK_DRIVER_FILES", "VK_ICD_FILENAMES"],
        VulkanComponent::ValidationLayer => &["VK_LAYER_PATH"],
    };
    let (name, value) =
        names.iter().find_map(|&name| Some((name, variable(name).filter(|value| !value.is_empty())?)))?;
    let places: Vec<PathBuf> = env::split_paths(&value).collect();
    let faulty = places.iter().find_map(|place| match fs::metadata(place) {
        Err(error) => Some(format!("{name} names {}, which cannot be read: {error}", place.display())),
        Ok(_) if what != VulkanComponent::Driver => None,
        Ok(_) => manifests_at(place.clone()).into_iter().find_map(|path| {
            let fault = Manifest::read(path.clone()).fault()?;
            Some(format!("{name} names {}: {fault}", path.display()))
        }),
    });
    let wanted = if what == VulkanComponent::Driver { "drivers" } else { "layers" };
    let said = faulty.unwrap_or_else(|| format!("{name} is set to {}", value.display()));
    Some(format!("{said}; while {name} is set, no other {wanted} are looked for: correct it or unset it"))
}

/// The folders of the loader on Linux and other Unix systems, by the XDG base directory specification. Windows keeps its
/// list in the registry.
fn usual_folders(set: &impl Fn(&str) -> Option<OsString>) -> Vec<PathBuf> {
    let home = |below: &str| set("HOME").map(|home| PathBuf::from(home).join(below));
    let list = |name: &str, usual: &str| {
        let value = set(name).unwrap_or_else(|| usual.into());
        env::split_paths(&value).collect::<Vec<_>>()
    };
    let mut bases = Vec::new();
    bases.extend(set("XDG_CONFIG_HOME").map(PathBuf::from).or_else(|| home(".config")));
    bases.extend(list("XDG_CONFIG_DIRS", "/etc/xdg"));
    bases.push("/etc".into());
    bases.extend(set("XDG_DATA_HOME").map(PathBuf::from).or_else(|| home(".local/share")));
    bases.extend(list("XDG_DATA_DIRS", "/usr/local/share:/usr/share"));
    bases.into_iter().map(|base| base.join("vulkan/icd.d")).collect()
}

/// The manifests in a folder, sorted; or the file itself, also one that is not there if it was asked for by name.
fn manifests_at(place: PathBuf) -> Vec<PathBuf> {
    let is_manifest = |path: &Path| path.extension().is_some_and(|extension| extension == "json");
    let Ok(entries) = fs::read_dir(&place) else {
        return if is_manifest(&place) { vec![place] } else { Vec::new() };
    };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut found: Vec<PathBuf> = paths.filter(|path| is_manifest(path)).collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("inside the folder")).expect("created");
            fs::write(path, text).expect("written");
        }
        folder
    }

    #[test]
    fn manifests_are_found_by_data_folder_and_judged() {
        let folder = folder_with(&[
            ("vulkan/icd.d/a.json", r#"{"ICD": {"library_path": "libvulkan_a.so"}}"#),
            ("vulkan/icd.d/b.json", r#"{"ICD": {"library_path": "/nowhere/libvulkan_b.so"}}"#),
            ("vulkan/icd.d/c.json", "not JSON"),
            ("vulkan/icd.d/readme.txt", ""),
        ]);
        let path = folder.path().as_os_str().to_owned();
        let elsewhere = folder.path().join("elsewhere").into_os_string();
        let (found, note) = find_with(|name| match name {
            "XDG_DATA_DIRS" => Some(path.clone()),
            "HOME" | "XDG_CONFIG_DIRS" => Some(elsewhere.clone()),
            _ => None,
        });
        // The system's own /etc may hold others.
        let ours: Vec<_> = found.iter().filter(|manifest| manifest.path.starts_with(folder.path())).collect();
        assert_eq!((ours.len(), note), (3, None));
        assert_eq!(ours[0].fault(), None);
        assert!(ours[1].fault().is_some_and(|fault| fault.contains("/nowhere")));
        assert!(ours[2].fault().is_some_and(|fault| fault.contains("no JSON")));
    }

    #[test]
    fn a_hint_names_the_file_that_a_variable_asks_for_in_vain() {
        let folder = folder_with(&[
            ("good.json", r#"{"ICD": {"library_path": "libx.so"}}"#),
            ("odd.json", r#"{"ICD": {"library_path": "./libgone.so"}}"#),
        ]);
        let at = |name: &str| folder.path().join(name);
        let hint = |what, set: &str, names: &[&str]| {
            let value = env::join_paths(names.iter().map(|name| at(name))).expect("joins");
            overriding_hint_with(what, |name| (name == set).then(|| value.clone()))
        };
        let missing = hint(VulkanComponent::Driver, "VK_DRIVER_FILES", &["good.json", "gone.json"]).expect("a hint");
        let named = format!("VK_DRIVER_FILES names {}, which cannot be read: ", at("gone.json").display());
        assert!(missing.starts_with(&named) && missing.ends_with("correct it or unset it"), "{missing}");
        let odd = hint(VulkanComponent::Driver, "VK_ICD_FILENAMES", &["odd.json"]).expect("a hint");
        assert!(odd.contains("odd.json: its library ./libgone.so does not exist"), "{odd}");
        let good = hint(VulkanComponent::Driver, "VK_DRIVER_FILES", &["good.json"]).expect("a hint");
        assert!(good.starts_with("VK_DRIVER_FILES is set to ") && good.contains("no other drivers"), "{good}");
        let layers = hint(VulkanComponent::ValidationLayer, "VK_LAYER_PATH", &["gone"]).expect("a hint");
        assert!(layers.contains("VK_LAYER_PATH names ") && layers.contains("no other layers"), "{layers}");
        assert_eq!(hint(VulkanComponent::Driver, "VK_LAYER_PATH", &["gone"]), None);
        assert_eq!(hint(VulkanComponent::Loader, "VK_DRIVER_FILES", &["gone"]), None);
    }

    #[test]
    fn a_variable_replaces_the_usual_places() {
        let folder = folder_with(&[("x.json", r#"{"ICD": {"library_path": "./libx.so"}}"#), ("libx.so", "")]);
        let list = env::join_paths([folder.path().join("x.json"), folder.path().join("gone.json")]).expect("joins");
        let (found, note) = find_with(|name| (name == "VK_DRIVER_FILES").then(|| list.clone()));
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].fault(), None);
        assert!(found[1].fault().is_some_and(|fault| fault.starts_with("cannot be read")));
        assert!(note.is_some_and(|note| note.contains("VK_DRIVER_FILES")));
    }
}
