//! `afterlight inspect --commands`: the commands of one recorded frame, as text and as JSON.
//!
//! The text has labels, render passes and barriers one by one, and between them counts commands of one kind. Rows are printed whole where they act
//! first, and by name where they act again. The JSON has every command.

mod blocks;
mod report;

use std::sync::Arc;

use afterlight::gpu::Device;
use afterlight::scene::Settings;
use afterlight_lab::report::commands;
use serde::Serialize;

use super::failure::Failure;
use super::output;
use super::workload::Workload;
use blocks::Blocks;
use report::CommandReport;

/// The output of `--commands --json`.
#[derive(Serialize)]
struct CommandListing {
    scene: String,
    device: String,
    size: [u32; 2],
    commands: Vec<CommandReport>,
}

/// Records a frame and prints its commands.
pub fn print(device: &Arc<Device>, workload: &Workload, settings: &Settings, json: bool) -> Result<(), Failure> {
    let lines = commands::record(device, &workload.scene, settings, &workload.playing);
    let lines = lines.map_err(|error| workload.blame(error, &device.physical, settings))?;
    let (scene, device) = (workload.scene.name.clone(), device.physical.name.clone());
    if json {
        let commands = lines.iter().map(CommandReport::of).collect();
        return output::print(&output::json(&CommandListing { scene, device, size: settings.size, commands })?, false);
    }
    let [width, height] = settings.size;
    let count = lines.len();
    let head = format!(
        "{scene}: {width}x{height} on {device}\nThe first frame, and the copy of its picture for the CPU, in {count} commands. It draws every shadow map and \
         deforms every mesh, as later\nframes do only after a change. Commands of one kind are counted between labels, render passes and barriers, and names of \
         pipelines\nleave out what is false; --json has all.\n"
    );
    output::print(&(head + &Blocks::of(&lines).text()), false)
}
