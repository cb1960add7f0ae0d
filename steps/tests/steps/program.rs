//! Steps as tests start them.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use ash::{Entry, vk};
use image::RgbaImage;

/// Layers from about this one on follow masks of subpasses, and look from one submission to the next.
pub const FIRST_OF_NEWER: u32 = vk::make_api_version(0, 1, 4, 300);

/// What a program that has ended leaves behind.
#[derive(Clone)]
pub struct Ended {
    pub succeeded: bool,
    pub stdout: String,
    pub messages: String,
    /// Black where the program wrote none.
    pub picture: RgbaImage,
    /// The path of the picture.
    pub path: PathBuf,
}

/// Returns what a step with all of its lines leaves behind. It is started once for all tests.
fn run_once(step: &str) -> Arc<OnceLock<Ended>> {
    static ENDED: Mutex<BTreeMap<String, Arc<OnceLock<Ended>>>> = Mutex::new(BTreeMap::new());
    let cell = Arc::clone(ENDED.lock().expect("no test has failed here").entry(step.to_owned()).or_default());
    cell.get_or_init(|| start(step, None));
    cell
}

/// Returns what a step leaves behind, which must succeed in silence.
pub fn whole(step: &str) -> Ended {
    whole_if_possible(step).unwrap_or_else(|| panic!("{step} cannot run here"))
}

/// Does the same where there is what the step needs: a feature of the device, which the stacks have that are fetched for tests, or Xvfb. Elsewhere it says that
/// the test is not run, and returns nothing.
pub fn whole_if_possible(step: &str) -> Option<Ended> {
    let cell = run_once(step);
    let ended = cell.get()?;
    let lacks = ended.messages.contains("this device lacks") && std::env::var_os("AFTERLIGHT_NEEDS_LAYER").is_none();
    if lacks || ended.messages.contains("there is no X server") || ended.messages.contains("the feature `window`") {
        println!("NOT RUN: {step}: {}", ended.messages.trim());
        return None;
    }
    assert!(ended.succeeded && ended.messages.is_empty(), "{step} on {}: {}", layer_text(), ended.messages);
    Some(ended.clone())
}

/// Starts a step, without the line `without` if there is one.
pub fn start(step: &str, without: Option<&str>) -> Ended {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join(format!("{step}-{}-{number}.png", std::process::id()));
    // Cargo builds all steps into one folder.
    let binary = Path::new(env!("CARGO_BIN_EXE_step-00-clear")).with_file_name(step);
    if !binary.exists() {
        let messages = format!("{step} is built with the feature `window` alone");
        return Ended { succeeded: false, stdout: String::new(), messages, picture: RgbaImage::default(), path };
    }
    // The program that starts others on the Vulkan stack of the tests, where that is not the machine's own.
    let runner = std::env::var_os("AFTERLIGHT_RUNNER");
    let mut command = Command::new(runner.clone().unwrap_or_else(|| binary.clone().into()));
    if runner.is_some() {
        command.arg(&binary);
    }
    let screen = if step == WINDOW { Screen::start() } else { None };
    if let Some(screen) = &screen {
        command.env("DISPLAY", &screen.display);
    } else {
        command.env_remove("DISPLAY");
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

/// The step that needs an X server.
const WINDOW: &str = "step-10-window";

/// An X server without a screen, which ends with the test.
struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// Starts it, if it is installed.
    fn start() -> Option<Self> {
        let arguments = ["-displayfd", "1", "-screen", "0", "800x600x24", "-nolisten", "tcp"];
        let started = Command::new("Xvfb").args(arguments).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut server = started.ok()?;
        // It writes its number when it listens.
        let mut number = String::new();
        BufReader::new(server.stdout.take()?).read_line(&mut number).ok()?;
        Some(Self { server, display: format!(":{}", number.trim()) })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
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
