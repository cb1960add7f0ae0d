//! `afterlight inspect --drop`: frames with a dependency missing, and what the specification's rules and the validation layer have to say of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::edges::unreported_mutants::{Part, reason};
use afterlight::frame::edges::{self, Edge, Edges};
use afterlight::frame::proof::{Frames, Hazard};
use afterlight::frame::{experiment, plan_for};
use afterlight::gpu::{Device, Instance, InstanceOptions, Message, MessageKind, Validation, vk};
use afterlight::scene::SettingsPatch;

use super::args::{DeviceArgs, SettingsArgs};
use super::failure::{Exit, Failure};
use super::output;
use super::workload::Workload;

/// From this version on the layer has its shader heuristic.
const HEURISTIC: u32 = vk::make_api_version(0, 1, 4, 304);

/// Draws the scene without the dependency of this name, in each mode that the layer has, and prints what it says.
pub fn run(
    name: &str,
    scene: &str,
    settings: &SettingsArgs,
    variation: &SettingsPatch,
    args: &DeviceArgs,
) -> Result<(), Failure> {
    let workload = Workload::open(scene, settings, false)?;
    let mut text = String::new();
    let mut silent = true;
    let mut dropped: Option<(Edge, u32)> = None;
    for sync_shader_heuristic in [false, true] {
        let options = InstanceOptions { validation: Validation::Synchronization, sync_shader_heuristic };
        let instance = Instance::new(&options)?;
        let layer = layer_version(&instance);
        if sync_shader_heuristic && layer < HEURISTIC {
            break;
        }
        let device = Device::new(&instance, &args.device.clone().unwrap_or_default())?;
        let mut settings = workload.settings(variation, &device.physical)?;
        // Each frame draws its maps, so that their rows have something to order.
        settings.shadows.cache = false;
        let plan = plan_for(&device, &workload.scene, &settings)?;
        let table = edges::table(&plan);
        let without = table
            .named(name)
            .and_then(|row| table.without(row.name))
            .map_err(|error| Failure::usage(error.to_string()))?;
        let draw = |edges: Edges| {
            // SAFETY: nobody looks at what these frames draw, and nothing else is on the device: all that is wanted is what the layer says
            // of them before the driver runs them.
            said(&instance, &device, |device| unsafe { experiment::draw(device, &workload.scene, &settings, edges) })
        };
        // What it says of the whole table is not about what is dropped.
        let (before, _) = draw(table.clone())?;
        if !before.is_empty() {
            let message = format!("with all its dependencies the layer already says {}", before[0].id_name);
            return Err(Failure::new(Exit::FailedCheck, message).with_hint("--validate lists all of it"));
        }
        if dropped.is_none() {
            let edge = table.named(name).map_err(|error| Failure::usage(error.to_string()))?;
            let [width, height] = settings.size;
            let (scene, gpu) = (&workload.scene.name, &device.physical.name);
            let _ = writeln!(text, "{scene}: {width}x{height} on {gpu}, frames without {name}");
            text.push_str(&described(edge, &Frames::of(&plan, &without).hazards()));
            dropped = Some((edge.clone(), layer));
        }
        let mode = if sync_shader_heuristic { "with its shader heuristic" } else { "as it is by default" };
        let (messages, more) = draw(without)?;
        silent &= messages.is_empty();
        let _ = writeln!(text, "Layer {}, {mode}:", version(layer));
        match messages.is_empty() {
            true => text.push_str("  nothing\n"),
            false => text.push_str(&listing(&messages, more)),
        }
        text.push('\n');
    }
    if let Some((edge, layer)) = dropped.filter(|_| silent) {
        let _ = writeln!(text, "{}", silence(&edge, layer));
    }
    output::print(text.trim_end(), false)
}

fn described(edge: &Edge, hazards: &[Hazard]) -> String {
    let Edge { from, to, carrier, why, .. } = edge;
    let rules = proved(hazards);
    format!("  {from} -> {to}, {carrier}\n  why it is there: {why}\n\nThe specification's rules:\n{rules}\n")
}

/// Each kind of hazard of each memory once, with how many pairs of touches have it.
fn proved(hazards: &[Hazard]) -> String {
    let mut kinds: Vec<(&Hazard, usize)> = Vec::new();
    for hazard in hazards {
        match kinds.iter_mut().find(|(own, _)| own.kind == hazard.kind && own.memory == hazard.memory) {
            Some((_, count)) => *count += 1,
            None => kinds.push((hazard, 1)),
        }
    }
    kinds.iter().fold(String::new(), |text, (hazard, count)| {
        let others = match count - 1 {
            0 => String::new(),
            1 => " (and one more)".into(),
            more => format!(" (and {more} more)"),
        };
        format!("{text}  {hazard}{others}\n")
    })
}

/// What it means that the layer says nothing.
fn silence(edge: &Edge, layer: u32) -> String {
    let (own, known) = (version(layer), version(edges::unreported_mutants::LAYER));
    match reason(edge, Part::Row) {
        Some(reason) => format!(
            "No layer is known to notice: {}. The specification says ({}): \"{}.\"",
            reason.why, reason.section, reason.says
        ),
        None if layer >= edges::unreported_mutants::LAYER => {
            let name = edge.name;
            format!("These frames gave {name} nothing to order: where it orders something, layer {known} notices.")
        }
        None => format!(
            "Layer {own} says nothing of these frames. Layer {known} notices where the dependency orders something."
        ),
    }
}

/// What the layer has to say of some work, and how many messages it had no room for.
fn said(
    instance: &Instance,
    device: &Arc<Device>,
    work: impl FnOnce(&Arc<Device>) -> Result<(), afterlight::frame::Error>,
) -> Result<(Vec<Message>, u64), Failure> {
    instance.take_messages();
    work(device)?;
    let more = instance.message_log().dropped();
    let ours = instance.take_messages().into_iter().filter(|message| message.kind != MessageKind::General);
    Ok((ours.collect(), more))
}

/// Each hazard once, with how often it came: messages that differ in handles, frames and counters alone are one.
fn listing(messages: &[Message], more: u64) -> String {
    let alike = |text: &str| -> String {
        let handle = |word: &str| {
            if word.starts_with("0x") { String::new() } else { word.replace(|c: char| c.is_ascii_digit(), "") }
        };
        text.split(|c: char| !c.is_alphanumeric()).map(handle).collect()
    };
    // Old layers repeat the rule and name the first object before they come to the point.
    let point =
        |text: &str| -> String { text.rsplit_once(" | ").map_or(text, |(_, point)| point).replace('\n', "\n    ") };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let mut first = Vec::new();
    for message in messages {
        let (text, key) = (point(&message.text), alike(&point(&message.text)));
        let count = counts.entry(key.clone()).or_default();
        *count += 1;
        if *count == 1 {
            first.push((&message.id_name, text, key));
        }
    }
    let mut list = String::new();
    for (rule, text, key) in first {
        let _ = writeln!(list, "  {rule}, {} times, as:\n    {}", counts[&key], text.trim_end());
    }
    if more > 0 {
        let _ = writeln!(list, "  and {more} more messages that were not kept");
    }
    list
}

fn layer_version(instance: &Instance) -> u32 {
    let layers = instance.layers().iter().filter(|layer| layer.name == "VK_LAYER_KHRONOS_validation");
    layers.map(|layer| layer.spec_version).max().unwrap_or_default()
}

fn version(packed: u32) -> String {
    let [major, minor] = [vk::api_version_major(packed), vk::api_version_minor(packed)];
    format!("{major}.{minor}.{}", vk::api_version_patch(packed))
}

#[cfg(test)]
mod tests {
    use afterlight::frame::edges::unreported_mutants::LAYER;
    use afterlight::frame::edges::{Carrier, Place, RowName};
    use afterlight::frame::list::SHADOW_PASS;
    use afterlight::gpu::sync::Use;

    use super::*;

    fn row(name: RowName) -> Edge {
        let (from, to, why) = (Place::OUTSIDE, Place::OUTSIDE, "");
        let (carrier, by_region) = (Carrier::Subpass(SHADOW_PASS), false);
        Edge { name, carrier, from, to, before: Use::START, after: Use::END, by_region, why }
    }

    #[test]
    fn silence_is_explained_by_what_is_known_of_the_layer() {
        let (new, old) =
            (silence(&row(RowName::SHADOW_MAP_REUSE), LAYER), silence(&row(RowName::SHADOW_MAP_REUSE), LAYER - 1));
        assert!(new.contains("gave shadow-map-reuse nothing to order"), "{new}");
        assert!(old.contains("says nothing of these frames") && !old.contains("gave"), "{old}");
        let argued = silence(&row(RowName::PICTURE_TO_HOST), LAYER);
        assert!(argued.contains("No layer is known to notice") && argued.contains("Signaling a fence"), "{argued}");
    }
}
