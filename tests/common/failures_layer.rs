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

/// A folder where the loader finds the layer.
pub fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/failures-layer/failures.json"))
        .expect("a manifest");
    let mut manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
    manifest["layer"]["library_path"] = library().to_str().expect("a path of UTF-8").into();
    fs::write(folder.path().join("failures.json"), manifest.to_string()).expect("a manifest");
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
