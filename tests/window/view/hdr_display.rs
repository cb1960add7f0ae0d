//! A display that seems to show more than white: an X server of depth 30, and the layer of `tests/hdr-layer` below the validation layer.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use std::{env, fs};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::harness::{Server, text};

const NAME: &str = "VK_LAYER_AFTERLIGHT_hdr";

/// The layer's library. Cargo builds no other member's for a test, so the first test here does, in a folder where no other cargo waits for it.
static LIBRARY: LazyLock<PathBuf> = LazyLock::new(|| {
    let mut command = Command::new(env!("CARGO"));
    // Frozen: all that the layer needs, the program has needed as well.
    command.args(["build", "--package", "afterlight-hdr-layer", "--frozen", "--message-format", "json"]);
    command.current_dir(env!("AFTERLIGHT_ROOT")).arg("--target-dir");
    command.arg(Path::new(env!("CARGO_TARGET_TMPDIR")).join("hdr-layer"));
    let output = command.output().expect("cargo starts");
    assert!(output.status.success(), "the layer is not built: {}", text(&output.stderr));
    let told = text(&output.stdout);
    let artifacts = told.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let own = artifacts.filter(|told| told["target"]["name"] == "afterlight_hdr_layer");
    let library = own.filter_map(|told| Some(PathBuf::from(told["filenames"][0].as_str()?))).next();
    library.unwrap_or_else(|| panic!("cargo tells of no library: {told}"))
});

/// Holds the display's server, and the folder where the loader finds the layer.
pub struct HdrDisplay {
    pub server: Server,
    _layers: TempDir,
}

impl HdrDisplay {
    pub fn start() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let manifest = json!({
            "file_format_version": "1.2.0",
            "layer": {
                "name": NAME,
                "type": "GLOBAL",
                "library_path": *LIBRARY,
                "api_version": "1.3.281",
                "implementation_version": "1",
                "description": "Displays without HDR seem to have it",
            },
        });
        fs::write(folder.path().join("hdr.json"), manifest.to_string()).expect("a manifest");
        let server = Server::of_depth(30).with_environment(environment(folder.path()));
        Self { server, _layers: folder }
    }
}

fn environment(layers: &Path) -> Vec<(&'static str, OsString)> {
    // Layers in the order from the program down to the driver. Other layers that the program asks for come below these. Loaders about 1.3.239 have
    // layers in the order of their folders instead (KhronosGroup/Vulkan-Loader#1170): there validation is not told of the colour space.
    let order = format!("VK_LAYER_KHRONOS_validation:{NAME}");
    // Loaders look for layers in the folders of `VK_LAYER_PATH` alone where that is set, as on Debian 13's stack: then the folder is added there.
    let folders = match env::var_os("VK_LAYER_PATH") {
        Some(only) => {
            let all = env::split_paths(&only).chain([layers.to_owned()]);
            ("VK_LAYER_PATH", env::join_paths(all).expect("folders"))
        }
        None => ("VK_ADD_LAYER_PATH", layers.into()),
    };
    vec![("VK_INSTANCE_LAYERS", order.into()), folders, ("AFTERLIGHT_LAYERS", layers.into())]
}
