//! Files that a case writes while it runs. They become its bundle if it ends badly.

use std::collections::BTreeMap;
use std::env;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::PathBuf;
use std::sync::Arc;

use afterlight::frame::{Picture, Pixels};
use afterlight::gpu::{Device, Message};
use afterlight::plan::FramePlan;
use afterlight_lab::stress;
use afterlight_truth::measure::Srgb8Image;
use afterlight_truth::reference::tonemap::encode_srgb;

use super::baseline::Baseline;
use super::examine::{self, CaseSetup};
use crate::doctor::DeviceReport;
use crate::image_output::{Destination, PictureFormat};
use crate::output::{self, Sink};
use crate::session::listing;
use crate::workload::plan_table;

/// The file with the last label that was recorded.
pub const LAST_LABEL: &str = "last-label.txt";
/// The file that says which of the case's devices was in use.
pub const STAGE: &str = "stage.txt";
/// The file with the device's properties.
pub const DEVICE: &str = "device.json";
/// The suite with this case alone, for `--repro`.
pub const SUITE: &str = "suite.toml";
/// The file with the scene's files: the hash of each, two spaces and its path, a line for each.
pub const SCENE_FILES: &str = "scene-files.txt";

/// Variables of drivers, loaders and layers, by how they begin.
const VARIABLES: [&str; 12] = [
    "VK_",
    "MESA_",
    "LIBGL_",
    "LP_",
    "GALLIUM_",
    "GALLIVM_",
    "LVP_",
    "RADV_",
    "ANV_",
    "NVK_",
    "SWIFTSHADER_",
    "AFTERLIGHT_",
];

/// The folder that files are kept in; without one nothing is kept. A file that cannot be written is told of, and does not stop the case: its verdict
/// is worth more.
pub struct EvidenceFolder {
    folder: Option<PathBuf>,
}

impl EvidenceFolder {
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder }
    }

    pub fn write(&self, name: &str, bytes: &[u8]) {
        let Some(folder) = &self.folder else { return };
        if let Err(failure) = Sink::File(folder.join(name)).write(bytes) {
            tracing::warn!("{}", failure.one_line());
        }
    }

    pub fn picture(&self, name: &str, picture: &Picture) {
        let Some(folder) = &self.folder else { return };
        let format = if matches!(picture.pixels, Pixels::Srgb8(_)) { PictureFormat::Png } else { PictureFormat::Exr };
        let path = folder.join(name).with_extension(if format == PictureFormat::Png { "png" } else { "exr" });
        if let Err(failure) = (Destination { sink: Sink::File(path), format }).write(picture) {
            tracing::warn!("{}", failure.one_line());
        }
    }

    pub fn shown(&self, name: &str, picture: &Srgb8Image) {
        let rgba = picture.pixels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        self.picture(name, &Picture { size: picture.size, pixels: Pixels::Srgb8(rgba) });
    }

    /// Writes the drawn light and the truth as pictures, without a tone mapper, and their difference.
    pub fn compared(&self, seen: &stress::PicturePair) {
        let code = |light: f64| (encode_srgb(light.clamp(0.0, 1.0)) * 255.0).round() as u8;
        let shown = |pixels: Vec<[u8; 3]>| Srgb8Image { size: seen.size, pixels };
        let drawn = seen.drawn.iter().map(|light| light.map(|channel| code(f64::from(channel)))).collect();
        let truth: Vec<[u8; 3]> = seen.expected.iter().map(|light| light.map(code)).collect();
        let (drawn, truth) = (shown(drawn), shown(truth));
        self.shown("light.png", &drawn);
        self.shown("truth.png", &truth);
        if let Ok(map) = afterlight_truth::measure::flip(&drawn, &truth) {
            self.shown("truth-difference.png", &map.heat());
        }
    }

    pub fn of_device(&self, device: &Arc<Device>) {
        if let Ok(report) = DeviceReport::of(0, &device.physical)
            && let Ok(json) = output::json(&report)
        {
            self.write(DEVICE, json.as_bytes());
        }
    }

    /// Keeps the last label that is recorded on a device, and the stage for which the device was opened.
    pub fn labels(&self, stage: &str, device: &Arc<Device>) {
        let Some(folder) = &self.folder else { return };
        if let Ok(file) = File::create(folder.join(LAST_LABEL)) {
            self.write(STAGE, stage.as_bytes());
            device.tell_labels_to(file);
        }
    }

    /// The file that takes the layer's messages as they come, so that a process that crashes or is stopped leaves them behind.
    pub fn layer_log(&self, stage: &str) -> Option<File> {
        File::create(self.folder.as_ref()?.join(layer_log(stage))).ok()
    }

    /// Replaces that file by one in which each different message stands once; removes it where the layer had nothing to say.
    pub fn layer_messages(&self, stage: &str, messages: &[Message], dropped: u64) {
        let Some(folder) = &self.folder else { return };
        if messages.is_empty() && dropped == 0 {
            let _ = fs::remove_file(folder.join(layer_log(stage)));
        } else {
            self.write(&layer_log(stage), listing(messages, dropped).as_bytes());
        }
    }

    /// Writes the scene's files with the hash of each, so that another try of the case can tell if they are the same.
    pub fn scene_files(&self, files: &[PathBuf]) {
        if self.folder.is_none() || files.is_empty() {
            return;
        }
        let line = |path: &PathBuf| {
            let hash = fs::read(path)
                .map_or_else(|error| error.to_string(), |bytes| blake3::hash(&bytes).to_hex().to_string());
            format!("{hash}  {}\n", path.display())
        };
        self.write(SCENE_FILES, files.iter().map(line).collect::<String>().as_bytes());
    }

    /// Writes the baseline's picture and time of the case.
    pub fn baseline(&self, baseline: &Baseline, case: &str) {
        let Some(folder) = &self.folder else { return };
        if let Err(failure) = baseline.keep(case, folder) {
            tracing::warn!("{}", failure.one_line());
        }
    }

    pub fn of_plan(&self, plan: &FramePlan, setup: &CaseSetup, device: &Arc<Device>) {
        let [width, height] = setup.settings.size;
        let mut text = format!("{}: {width}x{height} on {}\n", setup.scene.name, device.physical.name);
        let _ = writeln!(text, "settings: {}\n", setup.settings.patch());
        let _ = write!(text, "{}\nDependencies\n{}", plan_table(plan).render(), examine::dependencies(plan));
        self.write("plan.txt", text.as_bytes());
    }

    /// The SPIR-V of all pipelines, a file each.
    pub fn shaders(&self, shaders: BTreeMap<String, Vec<u32>>) {
        let Some(folder) = &self.folder else { return };
        let folder = folder.join("shaders");
        if let Err(failure) = output::make_folder(&folder) {
            return tracing::warn!("{}", failure.one_line());
        }
        let mut index = String::new();
        for (name, words) in shaders {
            let file = shader_file(&name);
            let _ = writeln!(index, "{file}  {name}");
            self.write(&format!("shaders/{file}"), bytemuck::cast_slice(&words));
        }
        self.write("shaders/index.txt", index.as_bytes());
    }
}

fn layer_log(stage: &str) -> String {
    format!("layer-{stage}.log")
}

/// The picture as it is shown; `None` for linear light.
pub fn shown(picture: &Picture) -> Option<Srgb8Image> {
    match &picture.pixels {
        Pixels::Srgb8(rgba) => Some(Srgb8Image::from_rgba(picture.size, rgba)),
        Pixels::LinearF32(_) => None,
    }
}

/// The file of a pipeline's stage. Names of pipelines may be long, and differ in characters that no file's name has.
fn shader_file(name: &str) -> String {
    const MOST: usize = 100;
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(MOST).collect();
    format!("{plain}-{}.spv", &blake3::hash(name.as_bytes()).to_hex()[..8])
}

/// The program and the environment variables that affect drivers, loaders and layers.
pub fn environment() -> String {
    let mut text = format!("afterlight {} on {} {}\n", env!("CARGO_PKG_VERSION"), env::consts::OS, env::consts::ARCH);
    for (name, value) in variables() {
        let _ = writeln!(text, "{name}={value}");
    }
    text
}

/// Environment variables that affect drivers, loaders and layers, by name.
pub fn variables() -> Vec<(String, String)> {
    let mut variables: Vec<_> = env::vars_os()
        .map(|(name, value)| (name.to_string_lossy().into_owned(), value.to_string_lossy().into_owned()))
        .filter(|(name, _)| VARIABLES.iter().any(|start| name.starts_with(start)))
        .collect();
    variables.sort();
    variables
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_shaders_are_short_and_each_its_own() {
        let long = "forward GeometryKey { streams: Streams(7) } ".repeat(20);
        let names = [shader_file(&long), shader_file(&format!("{long}!")), shader_file("a b"), shader_file("a-b")];
        assert!(names.iter().all(|name| name.len() < 128 && !name.contains(' ')), "{names:?}");
        assert_eq!(names.iter().collect::<std::collections::BTreeSet<_>>().len(), 4, "{names:?}");
    }
}
