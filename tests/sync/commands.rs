//! `afterlight inspect --commands` lists the commands that a layer sees. The layer of `tests/failures-layer` writes each command into a file, and the listing
//! must have the same commands with the same arguments in the same order.

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;

use crate::common::failures_layer::{environment, folder};
use crate::common::program::program;

const SIZE: [&str; 4] = ["--size", "64x36", "--shadow-size", "64"];

/// Frames that together have every kind of pass that a picture can have but SPLIT, OVERLAY, PRESENT and ENCODE, which a window records.
const FRAMES: [&[&str]; 12] = [
    &["builtin:hall"],
    &["builtin:hall", "--ao", "bitmask"],
    &["builtin:hall", "--reflections", "screen"],
    &["builtin:hall", "--bloom", "0.1", "--taa", "on"],
    &["builtin:hall", "--light-path", "compute"],
    &["builtin:hall", "--light-path", "per-light", "--fxaa", "on", "--vignette", "0.5"],
    &["builtin:hall", "--msaa", "4"],
    &["builtin:hall", "--sync", "2"],
    &["assets/gallery/particles.toml", "--fog", "froxels"],
    &["builtin:layers", "--transparency", "oit"],
    &["builtin:field?objects=400&detail=8&lights=16", "--culling", "gpu"],
    &["builtin:seaweed", "--playing", "--time", "1.5"],
];

/// The listing as JSON, and the lines that the layer wrote.
fn listed_and_seen(frame: &[&str]) -> (Value, Vec<String>) {
    let layers = folder();
    let file = layers.path().join("commands.txt");
    let mut command = program();
    command.current_dir(env!("AFTERLIGHT_ROOT")).arg("inspect").args(frame).args(SIZE).args(["--commands", "--json"]);
    command.envs(environment(layers.path())).env("AFTERLIGHT_COMMANDS", &file);
    let output = command.output().expect("the program starts");
    assert!(output.status.success(), "{frame:?}: {}", String::from_utf8_lossy(&output.stderr));
    let seen = fs::read_to_string(&file).expect("the layer writes its file");
    (serde_json::from_slice(&output.stdout).expect("JSON"), seen.lines().map(str::to_owned).collect())
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_else(|| panic!("{key} of {value}"))
}

fn items<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

/// A command of the listing as the layer writes it.
fn lines(command: &Value) -> Vec<String> {
    let mut line = format!("{}: {}", text(command, "command_buffer"), text(command, "command"));
    for object in items(command, "objects") {
        line += &format!(" \"{}\"", object.as_str().expect("a name"));
    }
    for number in items(command, "numbers") {
        line += &format!(" {number}");
    }
    let mut lines = vec![line];
    let barrier = &command["barrier"];
    if !barrier.is_null() {
        lines.push(format!("  stages {} / {}", text(barrier, "src_stages"), text(barrier, "dst_stages")));
    }
    for part in items(barrier, "parts") {
        let object = part["object"].as_str().map_or_else(|| "memory".to_owned(), |name| format!("\"{name}\""));
        let accesses = format!("{} / {}", text(part, "src_access"), text(part, "dst_access"));
        let layouts = items(part, "layouts").iter().map(|layout| format!(" / {}", layout.as_str().expect("a layout")));
        lines.push(format!("  {object} {accesses}{}", layouts.collect::<String>()));
    }
    for own in items(command, "attachments") {
        let [old, new] = [0, 1].map(|side| own["layouts"][side].as_str().expect("a layout"));
        let operations = format!("{} {}", text(own, "load"), text(own, "store"));
        lines.push(format!("  attachment {} {} {operations} {old} {new}", text(own, "format"), own["samples"]));
    }
    for row in items(command, "dependencies") {
        let [before, writes] = [text(row, "src_stages"), text(row, "src_access")];
        let [after, uses] = [text(row, "dst_stages"), text(row, "dst_access")];
        lines.push(format!("  dependency {before} / {writes} / {after} / {uses} / {}", row["by_region"]));
    }
    lines
}

/// The first line in which the listing and the layer differ.
fn difference(listed: &[String], seen: &[String]) -> Option<String> {
    let at = |lines: &[String], index: usize| lines.get(index).map_or("nothing", String::as_str).to_owned();
    let longest = listed.len().max(seen.len());
    let index = (0..longest).find(|&index| listed.get(index) != seen.get(index))?;
    Some(format!("line {index}: listed\n{}\nrecorded\n{}", at(listed, index), at(seen, index)))
}

#[test]
fn the_listed_commands_are_those_that_a_layer_sees() {
    let mut kinds = BTreeSet::new();
    for frame in FRAMES {
        let (report, seen) = listed_and_seen(frame);
        let commands = items(&report, "commands");
        assert!(commands.len() > 10, "{frame:?}: {report}");
        let listed: Vec<String> = commands.iter().flat_map(lines).collect();
        // Uploads are recorded before the frame, into other command buffers, and the copy of the picture is recorded last.
        let frame_buffer = format!("{}: ", text(&commands[0], "command_buffer"));
        let begin = seen.iter().position(|line| line.starts_with(&frame_buffer)).unwrap_or(seen.len());
        if let Some(difference) = difference(&listed, &seen[begin..]) {
            panic!("{frame:?}: {difference}");
        }
        kinds.extend(commands.iter().map(|command| text(command, "command").to_owned()));
        assert_reasons(frame, commands);
    }
    // Copies into textures and clears of maps are uploads.
    for kind in ["vkCmdDraw", "vkCmdDrawIndexed", "vkCmdDrawIndexedIndirect", "vkCmdDispatch", "vkCmdCopyImageToBuffer"]
    {
        assert!(kinds.contains(kind), "no frame has {kind}: {kinds:?}");
    }
}

/// Every barrier of a frame carries out a row, and says why; so does every dependency, and every label of a pass.
fn assert_reasons(frame: &[&str], commands: &[Value]) {
    for command in commands {
        let has_reason = !command["why"].is_null();
        if !command["barrier"].is_null() {
            assert!(has_reason && !text(&command["barrier"], "row").is_empty(), "{frame:?}: {command}");
        }
        if text(command, "command") == "vkCmdBeginDebugUtilsLabelEXT" {
            assert!(has_reason, "{frame:?}: {command}");
        }
        let rows = items(command, "dependencies");
        assert!(rows.iter().all(|row| !text(row, "why").is_empty()), "{frame:?}: {command}");
    }
}

/// The comparison above sees a missing command, another argument and another order.
#[test]
fn a_listing_that_is_not_what_was_recorded_is_found_out() {
    let (report, _) = listed_and_seen(&["builtin:cornell", "--ao", "bitmask"]);
    let commands = items(&report, "commands");
    let whole: Vec<String> = commands.iter().flat_map(lines).collect();
    assert_eq!(difference(&whole, &whole), None);
    let barrier = commands.iter().position(|command| !command["barrier"].is_null()).expect("a barrier");
    let without: Vec<String> =
        commands.iter().enumerate().filter(|(index, _)| *index != barrier).flat_map(|(_, own)| lines(own)).collect();
    assert!(difference(&without, &whole).is_some_and(|text| text.contains("vkCmdPipelineBarrier")));
    let mut weaker = commands[barrier].clone();
    weaker["barrier"]["dst_stages"] = "-".into();
    assert!(difference(&lines(&weaker), &lines(&commands[barrier])).is_some());
    let (first, second) = (lines(&commands[0]), lines(&commands[1]));
    assert!(difference(&[first.clone(), second.clone()].concat(), &[second, first].concat()).is_some());
}

#[test]
fn the_text_counts_the_same_commands() {
    let run = |more: &[&str]| {
        let mut command = program();
        let output = command.args(["inspect", "builtin:hall", "--commands"]).args(SIZE).args(more).output();
        String::from_utf8(output.expect("the program starts").stdout).expect("UTF-8")
    };
    let report: Value = serde_json::from_str(&run(&["--json"])).expect("JSON");
    let text_of = run(&[]);
    for kind in ["vkCmdBeginRenderPass", "vkCmdNextSubpass", "vkCmdPipelineBarrier", "vkCmdDrawIndexed", "vkCmdDraw"] {
        let listed = items(&report, "commands").iter().filter(|own| text(own, "command") == kind).count();
        let lines = text_of.lines().filter(|line| line.split_whitespace().next() == Some(kind));
        let count = |line: &str| match line.split_whitespace().nth(1).and_then(|word| word.strip_prefix('x')) {
            Some(number) => number.parse().unwrap_or(1),
            None => 1,
        };
        assert_eq!(lines.map(count).sum::<usize>(), listed, "{kind}\n{text_of}");
    }
}
