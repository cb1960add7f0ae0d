//! Frames with a dependency missing: their hazards by the specification's rules, the messages of the validation layer, and changes of this device's
//! picture. `afterlight inspect --drop` prints them, and `afterlight render --drop` fails for them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use afterlight::frame::rows::{self, Row, RowPart, Rows};
use afterlight::frame::{Picture, Pixels, plan_for};
use afterlight::gpu::{DeviceChoice, Error, Message};
use afterlight::plan::FramePlan;
use afterlight::scene::{Settings, SettingsPatch, counted};
use afterlight_lab::mutants::unreported::{LAYER, reason};
use afterlight_lab::mutants::{Drawn, LayerDevice, NO_EXTENSIONS};
use afterlight_proof::{FrameModel, Hazard};

use super::args::{DeviceArgs, SettingsArgs};
use super::compare::differing;
use super::failure::{Exit, Failure};
use super::table::{TextTable, version};
use super::workload::Workload;
use super::{output, progress};

/// The table without the row of this name.
///
/// # Errors
/// When this plan has no such row, with the reason for that, or the row cannot be dropped.
pub fn without(plan: &FramePlan, table: &Rows, name: &str) -> Result<Rows, Failure> {
    let row = row_of(plan, table, name, |row| table.without(row.name).is_ok())?;
    table.without(row.name).map_err(|error| Failure::usage(error.to_string()))
}

/// Returns the hazards of frames with these dependencies in words, the worst first.
pub fn in_words(plan: &FramePlan, rows: &Rows) -> Vec<String> {
    describe_hazards(&FrameModel::of(plan, rows).hazards())
}

fn describe_hazards(hazards: &[Hazard]) -> Vec<String> {
    afterlight_proof::in_words(hazards.iter().map(|hazard| &hazard.consequence))
}

/// The row of this name.
///
/// # Errors
/// When this plan has no such row, with the reason for that.
pub fn row<'a>(plan: &FramePlan, table: &'a Rows, name: &str) -> Result<&'a Row, Failure> {
    row_of(plan, table, name, |_| true)
}

/// The row of this name. An error lists the rows for which `is_possible` returns true.
fn row_of<'a>(
    plan: &FramePlan,
    table: &'a Rows,
    name: &str,
    is_possible: impl Fn(&Row) -> bool,
) -> Result<&'a Row, Failure> {
    table.named(name, is_possible).map_err(|error| match rows::lack(plan, name) {
        Some(why) => Failure::usage(format!("these frames have no dependency {name}: {why}")),
        None => Failure::usage(error.to_string()),
    })
}

/// Draws the scene without the dependency of this name, in each mode that the layer has, or without each dependency in turn if it is `all`, and
/// prints the findings.
pub fn run(
    name: &str,
    scene: &str,
    settings: &SettingsArgs,
    variation: &SettingsPatch,
    args: &DeviceArgs,
    is_verbose: bool,
) -> Result<(), Failure> {
    let workload = Workload::open(scene, settings, false)?;
    let text = match name {
        "all" => all(&workload, variation, args)?,
        name => one(name, &workload, variation, args, is_verbose)?,
    };
    output::print(&text, false)
}

/// The layer's version, or why no layer watches.
type LayerVersion = Result<u32, String>;

/// The device, watched by the synchronization layer where that is installed, and its picture with all dependencies.
struct DropExperiment<'a> {
    workload: &'a Workload,
    watched: LayerDevice,
    layer: LayerVersion,
    settings: Settings,
    plan: FramePlan,
    table: Rows,
    picture: Picture,
}

impl<'a> DropExperiment<'a> {
    /// `None` where the layer does not have the heuristic.
    fn open(
        workload: &'a Workload,
        variation: &SettingsPatch,
        args: &DeviceArgs,
        sync_shader_heuristic: bool,
    ) -> Result<Option<Self>, Failure> {
        let Some((watched, layer)) = watched(&args.device.clone().unwrap_or_default(), sync_shader_heuristic)? else {
            return Ok(None);
        };
        let mut settings = workload.settings(variation, &watched.device().physical)?;
        // Each frame draws its maps, so that their rows have something to order.
        settings.shadows.cache = false;
        let plan = plan_for(watched.device(), &workload.scene, &settings)?;
        let table = rows::table(&plan);
        let picture = Picture { size: settings.size, pixels: Pixels::Srgb8(Vec::new()) };
        let mut own = Self { workload, watched, layer, settings, plan, table, picture };
        // Messages about the whole table are not about a dropped row.
        let Drawn { picture, messages, .. } = own.draw(own.table.clone())?;
        if let Some(first) = messages.first() {
            let message = format!("with all its dependencies the layer already says {}", first.id_name);
            return Err(Failure::new(Exit::FailedCheck, message).with_hint("--validate lists all of it"));
        }
        own.picture = picture;
        Ok(Some(own))
    }

    fn draw(&self, rows: Rows) -> Result<Drawn, Failure> {
        // SAFETY: only whether their picture is another one is asked of these frames, and nothing else is on the device; the layer speaks of
        // them before the driver runs them.
        Ok(unsafe { self.watched.draw(&self.workload.scene, &self.settings, rows, None) }?)
    }

    fn heading(&self, without: &str) -> String {
        let [width, height] = self.settings.size;
        let (scene, gpu) = (&self.workload.scene.name, &self.watched.device().physical.name);
        format!("{scene}: {width}x{height} on {gpu}, frames without {without}\n")
    }
}

/// A device under the synchronization layer, with the layer's version; where the layer is not installed or too old for that check, a device without it,
/// with the reason. The proof and the picture need no layer. `None` where no layer has the heuristic.
fn watched(choice: &DeviceChoice, heuristic: bool) -> Result<Option<(LayerDevice, LayerVersion)>, Failure> {
    match LayerDevice::open(choice, heuristic, NO_EXTENSIONS) {
        Ok(watched) => Ok(watched.map(|watched| {
            let layer = watched.layer();
            (watched, Ok(layer))
        })),
        Err(Error::MissingLayer { .. } | Error::Unsupported(_)) if heuristic => Ok(None),
        Err(why @ (Error::MissingLayer { .. } | Error::Unsupported(_))) => {
            Ok(Some((LayerDevice::without_layer(choice)?, Err(why.to_string()))))
        }
        Err(error) => Err(error.into()),
    }
}

fn one(
    name: &str,
    workload: &Workload,
    variation: &SettingsPatch,
    args: &DeviceArgs,
    is_verbose: bool,
) -> Result<String, Failure> {
    let mut text = String::new();
    let mut silent = None;
    for sync_shader_heuristic in [false, true] {
        let Some(own) = DropExperiment::open(workload, variation, args, sync_shader_heuristic)? else { break };
        let without = without(&own.plan, &own.table, name)?;
        let row = row(&own.plan, &own.table, name)?;
        let hazards = FrameModel::of(&own.plan, &without).hazards();
        let found = own.draw(without)?;
        if !sync_shader_heuristic {
            // A former name stands for the row that has taken its place.
            let without = if row.label == name { name.to_owned() } else { format!("{} (formerly {name})", row.label) };
            text.push_str(&own.heading(&without));
            text.push_str(&described(row, &hazards, is_verbose));
            let _ = writeln!(text, "The picture on this device: {}\n", difference(&own.picture, &found.picture));
        }
        let layer = match &own.layer {
            Ok(layer) => *layer,
            Err(why) => return Ok(text + &unwatched(&own.plan, row, why)),
        };
        let mode = if sync_shader_heuristic { "with its shader heuristic" } else { "as it is by default" };
        let _ = write!(text, "Layer {}, {mode}:\n{}", version(layer), listing(&found, is_verbose));
        silent = match found.messages.is_empty() {
            true if !sync_shader_heuristic || silent.is_some() => Some((own.plan.clone(), row.clone(), layer)),
            _ => None,
        };
    }
    if let Some((plan, row, layer)) = silent {
        let _ = writeln!(text, "\n{}", silence(&plan, &row, layer));
    }
    Ok(text)
}

fn described(row: &Row, hazards: &[Hazard], is_verbose: bool) -> String {
    let Row { from, to, carrier, why, .. } = row;
    let words =
        describe_hazards(hazards).into_iter().fold(String::new(), |text, sentence| format!("{text}  {sentence}\n"));
    let words = if words.is_empty() { "  nothing: other dependencies order the same\n" } else { &words };
    let rules = match is_verbose {
        true => format!("\nThe specification's rules:\n{}", proved(hazards)),
        false => String::new(),
    };
    format!("  {from} -> {to}, {carrier}\n  why it is there: {why}\n\nWhat may go wrong:\n{words}{rules}\n")
}

/// A row for each dependency.
fn all(workload: &Workload, variation: &SettingsPatch, args: &DeviceArgs) -> Result<String, Failure> {
    // With its heuristic the layer knows every access that it knows without, and the accesses of shaders besides.
    let own = match DropExperiment::open(workload, variation, args, true)? {
        Some(own) => own,
        None => DropExperiment::open(workload, variation, args, false)?
            .ok_or_else(|| Failure::new(Exit::NoVulkan, "frames without a dependency cannot be drawn"))?,
    };
    let mut table = TextTable::new();
    let layer = own.layer.as_ref().map_or("no layer".into(), |&layer| format!("layer {}", version(layer)));
    table.row(["dependency", "by the rules", &layer, "picture", "what may go wrong"]);
    let bar = progress::bar("drawing without each".into(), own.table.iter().count() as u64, false);
    let (mut dropped, mut by_rules, mut by_layer, mut changed) = (0, 0, 0, 0);
    for row in own.table.iter() {
        bar.step();
        if let Some(why) = row.carrier.stays() {
            table.row([row.label.to_owned(), format!("cannot be dropped: {why}")]);
            continue;
        }
        let without = own.table.without(row.name).map_err(|error| Failure::usage(error.to_string()))?;
        let words = in_words(&own.plan, &without);
        let found = own.draw(without)?;
        let is_other = differing(&own.picture, &found.picture) > 0;
        dropped += 1;
        by_rules += u32::from(!words.is_empty());
        by_layer += u32::from(!found.messages.is_empty());
        changed += u32::from(is_other);
        // Rules are printed without their common prefix.
        let short = |rule: &str| {
            ["SYNC-HAZARD-", "DrawState-"].iter().find_map(|start| Some(rule.split_once(start)?.1.to_owned()))
        };
        let rules: Vec<_> = rules(&found.messages)
            .into_iter()
            .map(|(rule, _)| short(rule).unwrap_or_else(|| rule.to_owned()))
            .collect();
        table.row([
            row.label.to_owned(),
            if words.is_empty() { "nothing" } else { "hazard" }.to_owned(),
            match &own.layer {
                Ok(_) if rules.is_empty() => "nothing".to_owned(),
                Ok(_) => rules.join(", "),
                Err(_) => "-".to_owned(),
            },
            if is_other { "changed" } else { "the same" }.to_owned(),
            match words.as_slice() {
                [] => "nothing: other dependencies order the same".to_owned(),
                [only] => only.clone(),
                [first, others @ ..] => format!("{first} (and {} more)", others.len()),
            },
        ]);
    }
    let heading = own.heading("each dependency in turn");
    let (layer, added) = match &own.layer {
        Ok(_) => (format!(", and the layer notices {by_layer}"), String::new()),
        Err(why) => (String::new(), format!("\n{}\n", without_layer(why))),
    };
    Ok(format!(
        "{heading}\n{}\nOf {dropped} that can be dropped, the specification's rules need {by_rules}{layer}; \
         {changed} changed the picture on this device.\n{added}",
        table.render()
    ))
}

/// What the layer would add to the verdict on all dependencies.
fn without_layer(why: &str) -> String {
    format!(
        "No validation layer watched: {why}. The proof and the picture need none. A layer would add which of its own rules it sees broken \
         (SYNC-HAZARD-...), a test of the layer; `afterlight ci --mutants` has what layers are known to miss."
    )
}

/// What the layer would add to the verdict on one.
fn unwatched(plan: &FramePlan, row: &Row, why: &str) -> String {
    let adds = match reason(plan, row, RowPart::Row) {
        Some(_) => silence(plan, row, LAYER),
        None => format!(
            "Layer {} names its rule (SYNC-HAZARD-...), and how often these frames break it, where they give {} something to order.",
            version(LAYER),
            row.name
        ),
    };
    format!("No validation layer watched: {why}. The verdict above needs none. What a layer would add:\n  {adds}\n")
}

/// The layer's rules, in the order in which it found them broken, with how often.
fn rules(messages: &[Message]) -> Vec<(&str, usize)> {
    let mut rules: Vec<(&str, usize)> = Vec::new();
    for message in messages {
        match rules.iter_mut().find(|(rule, _)| *rule == message.id_name) {
            Some((_, count)) => *count += 1,
            None => rules.push((&message.id_name, 1)),
        }
    }
    rules
}

/// Lists the layer's messages: their rules, or its own words.
fn listing(found: &Drawn, is_verbose: bool) -> String {
    let mut text = match found.messages.is_empty() {
        true => "  nothing\n".to_owned(),
        false if is_verbose => texts(&found.messages),
        false => rules(&found.messages)
            .iter()
            .fold(String::new(), |text, (rule, count)| format!("{text}  {rule}, {}\n", counted(*count, "time"))),
    };
    if found.more > 0 {
        let _ = writeln!(text, "  and {}, not kept", counted(found.more, "more message"));
    }
    text
}

fn difference(with: &Picture, without: &Picture) -> &'static str {
    match differing(with, without) == 0 {
        true => "the same as with all dependencies; another device, or another run, may show a difference",
        false => "not the same as with all dependencies",
    }
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

/// Explains why the layer says nothing.
fn silence(plan: &FramePlan, row: &Row, layer: u32) -> String {
    let (own, known) = (version(layer), version(LAYER));
    match reason(plan, row, RowPart::Row) {
        Some(reason) => {
            let notices = match reason.seen_from {
                Some(newer) => format!("No layer before {} is known to notice", version(newer)),
                None => "No layer is known to notice".into(),
            };
            format!("{notices}: {}. The specification says ({}): \"{}.\"", reason.why, reason.section, reason.says)
        }
        None if layer >= LAYER => {
            let name = row.name;
            format!("These frames gave {name} nothing to order: where it orders something, layer {known} notices.")
        }
        None => format!(
            "Layer {own} says nothing of these frames. Layer {known} notices where the dependency orders something."
        ),
    }
}

/// Each hazard once, with how often it came: messages that differ in handles, frames and counters alone are one.
fn texts(messages: &[Message]) -> String {
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
        let _ = writeln!(list, "  {rule}, {}, as:\n    {}", counted(counts[&key], "time"), text.trim_end());
    }
    list
}

#[cfg(test)]
mod tests {
    use afterlight::frame::list::SHADOW_PASS;
    use afterlight::frame::rows::{Endpoint, RowName, SyncKind};
    use afterlight::gpu::sync::Use;
    use afterlight::plan::Capabilities;
    use afterlight::scene::{Scene, Settings};

    use super::*;

    fn row(name: RowName, to: Endpoint) -> Row {
        let (from, why) = (Endpoint::OUTSIDE, "");
        let (carrier, by_region) = (SyncKind::Subpass(SHADOW_PASS), false);
        Row {
            name,
            label: name.name(),
            carrier,
            from,
            to,
            waiting: Vec::new(),
            resources: Vec::new(),
            before: Use::START,
            after: Use::END,
            by_region,
            across_samples: false,
            why: why.into(),
        }
    }

    #[test]
    fn silence_is_explained_by_what_is_known_of_the_layer() {
        let plan = FramePlan::of(&Scene::default(), &Settings::default(), &Capabilities::ample()).expect("a plan");
        let reuse = row(RowName::Reuse(Endpoint::pass("SHADOW")), Endpoint::pass("SHADOW"));
        let (new, old) = (silence(&plan, &reuse, LAYER), silence(&plan, &reuse, LAYER - 1));
        assert!(new.contains("gave shadow-reuse nothing to order"), "{new}");
        assert!(old.contains("says nothing of these frames") && !old.contains("gave"), "{old}");
        let argued = silence(&plan, &row(RowName::PICTURE_TO_HOST, Endpoint::HOST), LAYER);
        assert!(argued.contains("No layer is known to notice") && argued.contains("Signaling a fence"), "{argued}");
    }
}
