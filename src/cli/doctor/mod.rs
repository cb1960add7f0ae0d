//! `afterlight doctor`: what of Vulkan is here, what works, and what to install for the rest. It must work where nothing
//! else does, so nothing that it finds missing stops it.

mod device;
mod manifests;

use std::env::consts::{ARCH, OS};
use std::fmt::Write as _;

use afterlight::gpu::system::{Missing, install_hint};
use afterlight::gpu::{self, DeviceChoice, Instance, InstanceOptions, PhysicalDevice};

use super::failure::{Exit, Failure, with_causes};
use super::output;
use super::table::Table;
use device::version;

const VALIDATION_LAYER: &str = "VK_LAYER_KHRONOS_validation";

/// Tell what of Vulkan is here, what works, and what to install
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight doctor
  afterlight doctor >/dev/null && make test

Ends with exit code 4 when no device can draw.")]
pub struct Args {}

/// Prints the findings.
pub fn run(_: &Args) -> Result<(), Failure> {
    let mut text = format!("Afterlight {} on {OS}, {ARCH}\n\n", env!("CARGO_PKG_VERSION"));
    text.push_str(&drivers());
    let verdict = match Instance::new(&InstanceOptions::default()) {
        Ok(instance) => {
            text.push_str(&loader(&instance));
            devices(&instance, &mut text)
        }
        Err(error) => {
            let _ = writeln!(text, "Loader\n  {}\n", with_causes(&error));
            Err(error)
        }
    };
    let _ = match &verdict {
        Ok(index) => writeln!(text, "Drawing works, on device {index}."),
        Err(error) => writeln!(text, "Drawing does not work: {}.", with_causes(error)),
    };
    output::print(&text, false)?;
    verdict.map(drop).map_err(|error| Failure::new(Exit::NoVulkan, with_causes(&error)))
}

fn drivers() -> String {
    let (found, note) = manifests::find();
    let mut table = Table::new();
    for manifest in &found {
        table.row([manifest.path.display().to_string(), manifest.fault().unwrap_or_else(|| "found".to_owned())]);
    }
    for line in note.into_iter().chain(found.is_empty().then(|| "none".to_owned())) {
        table.row([line]);
    }
    format!("Driver manifests\n{}\n", table.render())
}

fn loader(instance: &Instance) -> String {
    let mut text = format!("Loader\n  Vulkan {}\n\nLayers\n", version(instance.loader_version()));
    let mut table = Table::new();
    for layer in instance.layers() {
        let written_for = format!("for Vulkan {}", version(layer.spec_version));
        table.row([layer.name.clone(), written_for, layer.description.clone()]);
    }
    text.push_str(&table.render());
    let _ = match instance.layers().iter().any(|layer| layer.name == VALIDATION_LAYER) {
        true => writeln!(text, "  --validate works\n"),
        false => {
            let hint = install_hint(Missing::ValidationLayer);
            writeln!(text, "  --validate does not work, {VALIDATION_LAYER} is missing: {hint}\n")
        }
    };
    text
}

/// Appends every device, and returns the number of the one that is used when none is asked for.
fn devices(instance: &Instance, text: &mut String) -> gpu::Result<usize> {
    let devices = instance.physical_devices().inspect_err(|error| {
        let _ = writeln!(text, "Devices\n  {}\n", with_causes(error));
    })?;
    let chosen = usable(&devices);
    for (index, device) in devices.iter().enumerate() {
        let _ = writeln!(text, "{}", device::describe(index, device, chosen.as_ref().ok() == Some(&index)));
    }
    chosen
}

fn usable(devices: &[PhysicalDevice]) -> gpu::Result<usize> {
    let index = gpu::choose(devices, &DeviceChoice::Auto)?;
    match device::unusable(&devices[index]) {
        None => Ok(index),
        Some(reason) => Err(gpu::Error::Unsupported(format!("device {index}, {}: {reason}", devices[index].name))),
    }
}
