//! The layer of `tests/failures-layer`, as programs are started with it.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

const NAME: &str = "VK_LAYER_AFTERLIGHT_failures";

/// Tells a child where the library is.
pub const LIBRARY: &str = "AFTERLIGHT_FAILURES_LIBRARY";

/// The library, which cargo builds for these tests.
fn library() -> PathBuf {
    let deps = Path::new(env!("CARGO_BIN_EXE_afterlight")).with_file_name("deps");
    let own = deps.join(libloading::library_filename("afterlight_failures_layer"));
    assert!(own.exists(), "{} is not there", own.display());
    own
}

/// The layer's manifests, relative to its folder. Loaders look for an implicit layer's manifest below `XDG_DATA_HOME`.
const EXPLICIT: &str = "failures.json";
const IMPLICIT: &str = "vulkan/implicit_layer.d/failures.json";

/// Copies a manifest, with the place of the library that cargo has built.
fn write_manifest(name: &str, to: &Path) {
    let from = Path::new(env!("AFTERLIGHT_ROOT")).join("tests/failures-layer").join(name);
    let manifest = fs::read_to_string(from).expect("a manifest");
    let mut manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
    manifest["layer"]["library_path"] = library().to_str().expect("a path of UTF-8").into();
    fs::write(to, manifest.to_string()).expect("a folder");
}

/// A folder where loaders find the layer: by one manifest as an explicit layer, by another as an implicit one.
pub fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir_all(folder.path().join(IMPLICIT).with_file_name("")).expect("a folder in it");
    for manifest in [EXPLICIT, IMPLICIT] {
        write_manifest(manifest, &folder.path().join(manifest));
    }
    folder
}

/// Returns the environment in which a program has the layer on top of all others.
pub fn environment(folder: &Path) -> Vec<(&'static str, OsString)> {
    // Loaders look for layers in the folders of `VK_LAYER_PATH` alone where that is set, as on Debian 13's stack: then the folder is added there.
    let folders = match std::env::var_os("VK_LAYER_PATH") {
        Some(only) => {
            let all = [folder.to_owned()].into_iter().chain(std::env::split_paths(&only));
            ("VK_LAYER_PATH", std::env::join_paths(all).expect("folders"))
        }
        None => ("VK_ADD_LAYER_PATH", folder.into()),
    };
    vec![
        ("VK_INSTANCE_LAYERS", NAME.into()),
        folders,
        ("AFTERLIGHT_LAYERS", folder.into()),
        (LIBRARY, library().into()),
    ]
}

/// Returns the environment in which the layer is an implicit one, which loaders ask for commands without an instance, too.
pub fn implicit_environment(folder: &Path) -> Vec<(&'static str, OsString)> {
    vec![
        ("XDG_DATA_HOME", folder.into()),
        ("AFTERLIGHT_FAILURES_IMPLICIT", "1".into()),
        // Debian 13's stack turns other implicit layers off. Loaders before 1.3.262 do not know this variable.
        ("VK_LOADER_LAYERS_ALLOW", NAME.into()),
        (LIBRARY, library().into()),
    ]
}
