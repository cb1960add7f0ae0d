//! Steps as tests start them.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

use ash::{Entry, vk};
use image::RgbaImage;

/// Layers from about this one on follow masks of subpasses, and look from one submission to the next.
pub const FIRST_OF_NEWER: u32 = vk::make_api_version(0, 1, 4, 300);

/// What a program that has ended leaves behind.
pub struct Ended {
    pub succeeded: bool,
    pub stdout: String,
    pub messages: String,
    /// Black where the program wrote none.
    pub picture: RgbaImage,
    /// The path of the picture.
    pub path: PathBuf,
}

/// Starts a step with all of its lines, which must succeed in silence.
pub fn whole(step: &str) -> Ended {
    silent(step, start(step, None))
}

fn silent(step: &str, ended: Ended) -> Ended {
    assert!(ended.succeeded && ended.messages.is_empty(), "{step} on {}: {}", layer_text(), ended.messages);
    ended
}

/// Does the same on a device that has what the step needs. On another one it says that the test is not run, and returns nothing; the stacks that are fetched for
/// tests have all.
pub fn whole_if_possible(step: &str) -> Option<Ended> {
    let ended = start(step, None);
    if ended.messages.contains("this device lacks") && std::env::var_os("AFTERLIGHT_NEEDS_LAYER").is_none() {
        println!("NOT RUN: {step}: {}", ended.messages.trim());
        return None;
    }
    Some(silent(step, ended))
}

/// Starts a step, without the line `without` if there is one.
pub fn start(step: &str, without: Option<&str>) -> Ended {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join(format!("{step}-{}-{number}.png", std::process::id()));
    // Tests lie in a folder beside the programs.
    let binary = Path::new(env!("CARGO_BIN_EXE_step-00-clear")).with_file_name(step);
    // The program that starts others on the Vulkan stack of the tests, where that is not the machine's own.
    let runner = std::env::var_os("AFTERLIGHT_RUNNER");
    let mut command = Command::new(runner.clone().unwrap_or_else(|| binary.clone().into()));
    if runner.is_some() {
        command.arg(&binary);
    }
    if let Some(name) = without {
        command.args(["--without", name]);
    }
    let output = command.arg(&path).output().unwrap_or_else(|error| panic!("{}: {error}", binary.display()));
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let picture = image::open(&path).map(|picture| picture.to_rgba8()).unwrap_or_default();
    Ended {
        succeeded: output.status.success(),
        stdout: text(output.stdout),
        messages: text(output.stderr),
        picture,
        path,
    }
}

/// The version of the validation layer, which the tests cannot do without.
pub fn layer() -> u32 {
    static LAYER: OnceLock<u32> = OnceLock::new();
    *LAYER.get_or_init(|| {
        // SAFETY: loading the system's Vulkan loader runs its initializers, as intended.
        let entry = unsafe { Entry::load() }.expect("a Vulkan loader");
        // SAFETY: a global function without preconditions.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.expect("a list of layers");
        let layer = layers.iter().find(|one| one.layer_name_as_c_str() == Ok(c"VK_LAYER_KHRONOS_validation"));
        layer.expect("the validation layer: type `make setup`").spec_version
    })
}

pub fn layer_text() -> String {
    let layer = layer();
    let [major, minor, patch] =
        [vk::api_version_major(layer), vk::api_version_minor(layer), vk::api_version_patch(layer)];
    format!("validation layer {major}.{minor}.{patch}")
}
