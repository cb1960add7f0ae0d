//! `afterlight doctor`: the parts of Vulkan that are here, which of them work, and the packages to install for the rest. It must work where nothing
//! else does, so no missing part stops it.

mod calibration;
mod device;

use std::env::consts::{ARCH, OS};
use std::fmt::Write as _;

use afterlight::gpu::system::{VulkanComponent, hint};
use afterlight::gpu::{self, DeviceChoice, Instance, InstanceOptions, LoaderInfo, PhysicalDevice, manifests};
use serde::Serialize;

use super::args;
use super::failure::{Exit, Failure, with_causes};
use super::output;
use super::table::{TextTable, version};
pub use device::DeviceReport;

/// Tell what of Vulkan is here, what works, and what to install; measure a device
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight doctor
  afterlight doctor >/dev/null && make test
  afterlight doctor --json | jq -r '.devices[].name'
  afterlight doctor --calibrate

Ends with exit code 4 when no device can draw.")]
pub struct Args {
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
    /// Measure what frames take on a device, and keep the figures: `auto` then chooses by them and not by those of another device of its kind
    #[arg(long)]
    calibrate: bool,
    /// The device to calibrate: its number in `afterlight doctor`, or a part of its name [default: a real GPU before a CPU]
    #[arg(long, value_name = "N|NAME", value_parser = args::device, allow_hyphen_values = true, requires = "calibrate")]
    device: Option<DeviceChoice>,
    /// Measure for a window: the figures leave every picture as it is, and the process ends with its standard input
    #[arg(long, hide = true, requires = "calibrate")]
    unasked: bool,
}

/// Prints the findings.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.calibrate {
        return calibration::run(args.device.clone(), !args.unasked, args.json);
    }
    let found = Findings::gather();
    output::print(&if args.json { output::json(&found)? } else { found.text() }, false)?;
    found.error.map_or(Ok(()), |error| Err(Failure::new(Exit::NoVulkan, error)))
}

/// Returns loader, layers and devices of this machine with their versions, and missing parts, a line each.
pub fn versions() -> String {
    Findings::gather().versions()
}

/// The parts of Vulkan that are here; docs/COMMANDS.md has the keys.
#[derive(Debug, Serialize)]
struct Findings {
    afterlight: &'static str,
    os: &'static str,
    arch: &'static str,
    manifests: Vec<ManifestReport>,
    manifests_note: Option<String>,
    /// The loader's Vulkan version; `None` without one.
    loader: Option<String>,
    layers: Vec<LayerReport>,
    /// The validation layer's version; `None`: `--validate` does not work.
    validation_layer: Option<String>,
    devices: Vec<DeviceReport>,
    /// The number of the device that is used by default.
    device: Option<usize>,
    /// Why nothing can be drawn.
    error: Option<String>,
}

#[derive(Debug, Serialize)]
struct ManifestReport {
    path: String,
    fault: Option<String>,
}

#[derive(Debug, Serialize)]
struct LayerReport {
    name: String,
    vulkan: String,
    description: String,
}

impl Findings {
    fn gather() -> Self {
        let (manifests, manifests_note) = manifests::find();
        let manifests = manifests
            .into_iter()
            .map(|manifest| ManifestReport { path: manifest.path.display().to_string(), fault: manifest.fault() });
        let mut found = Self {
            afterlight: env!("CARGO_PKG_VERSION"),
            os: OS,
            arch: ARCH,
            manifests: manifests.collect(),
            manifests_note,
            loader: None,
            layers: Vec::new(),
            validation_layer: None,
            devices: Vec::new(),
            device: None,
            error: None,
        };
        match found.look() {
            Ok(number) => found.device = Some(number),
            Err(error) => found.error = Some(with_causes(&error)),
        }
        found
    }

    /// Adds loader, layers and devices, and returns the number of the device that is used when none is asked for.
    fn look(&mut self) -> gpu::Result<usize> {
        let loader = LoaderInfo::find()?;
        self.loader = Some(version(loader.version));
        self.validation_layer = loader.validation_layer().map(version);
        let layers = loader.layers.into_iter().map(|layer| LayerReport {
            name: layer.name,
            vulkan: version(layer.spec_version),
            description: layer.description,
        });
        self.layers = layers.collect();
        let instance = Instance::new(&InstanceOptions { calibrated: true, ..InstanceOptions::default() })?;
        let devices = instance.physical_devices()?;
        let report = |(number, device)| DeviceReport::of(number, device);
        self.devices = devices.iter().enumerate().map(report).collect::<gpu::Result<_>>()?;
        usable(&devices)
    }

    /// Returns loader, layers and devices with their versions, and missing parts, a line each.
    fn versions(&self) -> String {
        let mut text = String::new();
        if let Some(loader) = &self.loader {
            let _ = writeln!(text, "loader: Vulkan {loader}");
            for LayerReport { name, vulkan, .. } in &self.layers {
                let _ = writeln!(text, "layer: {name} {vulkan}");
            }
            if self.validation_layer.is_none() {
                let _ = writeln!(text, "layer: no VK_LAYER_KHRONOS_validation");
            }
        }
        for device in &self.devices {
            let _ = writeln!(text, "{}", device.line());
        }
        if let Some(error) = &self.error {
            let _ = writeln!(text, "drawing does not work: {error}");
        }
        text
    }

    fn text(&self) -> String {
        let mut text = format!("Afterlight {} on {OS}, {ARCH}\n\n", self.afterlight);
        let mut table = TextTable::new();
        for ManifestReport { path, fault } in &self.manifests {
            table.row([path.as_str(), fault.as_deref().unwrap_or("found")]);
        }
        for line in self.manifests_note.as_deref().into_iter().chain(self.manifests.is_empty().then_some("none")) {
            table.row([line]);
        }
        let error = self.error.as_deref().unwrap_or_default();
        let loader = self.loader.as_ref().map_or_else(|| error.to_owned(), |version| format!("Vulkan {version}"));
        let _ = writeln!(text, "Driver manifests\n{}\nLoader\n  {loader}\n", table.render());
        if self.loader.is_some() {
            text.push_str(&self.layer_table());
            for device in &self.devices {
                let _ = writeln!(text, "{}", device.text(self.device.is_some_and(|number| device.is(number))));
            }
            if self.devices.is_empty() {
                let _ = writeln!(text, "Devices\n  {error}\n");
            }
        }
        let _ = match self.device {
            Some(number) => writeln!(text, "Drawing works, on device {number}."),
            None => writeln!(text, "Drawing does not work: {error}."),
        };
        text
    }

    fn layer_table(&self) -> String {
        let mut table = TextTable::new();
        for LayerReport { name, vulkan, description } in &self.layers {
            table.row([name.clone(), format!("for Vulkan {vulkan}"), description.clone()]);
        }
        let works = match self.validation_layer {
            Some(_) => "--validate works".to_owned(),
            None => {
                let hint = hint(VulkanComponent::ValidationLayer);
                format!("--validate does not work, VK_LAYER_KHRONOS_validation is missing: {hint}")
            }
        };
        format!("Layers\n{}  {works}\n\n", table.render())
    }
}

fn usable(devices: &[PhysicalDevice]) -> gpu::Result<usize> {
    let index = gpu::choose(devices, &DeviceChoice::Auto)?;
    match device::unusable(&devices[index]) {
        None => Ok(index),
        Some(reason) => Err(gpu::Error::Unsupported(format!("device {index}, {}: {reason}", devices[index].name))),
    }
}
