//! Traces that gfxreconstruct captures replay to the pixels that the program draws, and the list for gpu-trace-perf says so.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use super::harness::{rendered, text};

/// The size and the scenes that `scripts/capture-traces` draws.
const SIZE: [u16; 2] = [128, 72];
const TRACES: [(&str, &[&str]); 2] = [
    ("spheres", &["builtin:spheres"]),
    ("panes-oit", &[concat!(env!("AFTERLIGHT_ROOT"), "/assets/gallery/transparency.toml"), "--transparency", "oit"]),
];

fn capture(folder: &Path, names: &[&str]) -> (bool, String) {
    let mut command = Command::new(Path::new(env!("AFTERLIGHT_ROOT")).join("scripts/capture-traces"));
    command.env("AFTERLIGHT", env!("CARGO_BIN_EXE_afterlight")).arg("-o").arg(folder).args(names);
    let output = command.output().unwrap_or_else(|error| panic!("scripts/capture-traces does not start: {error}"));
    (output.status.success(), text(&output.stdout) + &text(&output.stderr))
}

/// Letters and digits, and a dash for all between them.
fn key_of(name: &str) -> String {
    name.to_lowercase()
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect::<Vec<_>>()
        .join("-")
}

/// By the system's own program, not by the code that wrote the list.
fn sha256(bytes: &[u8]) -> String {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    fs::write(&file, bytes).expect("it is written");
    let output = Command::new("sha256sum").stdin(fs::File::open(&file).expect("it is there")).output();
    text(&output.expect("sha256sum starts").stdout).split(' ').next().unwrap_or_default().to_owned()
}

#[test]
fn a_trace_replays_to_the_pixels_of_the_program_and_gpu_trace_perf_can_read_the_pack() {
    let is_installed = Command::new("gfxrecon-replay").arg("--version").stdout(Stdio::null()).status().is_ok();
    let (named, on_other) =
        (std::env::var_os("AFTERLIGHT_GFXRECONSTRUCT"), std::env::var_os("AFTERLIGHT_RUNNER").is_some());
    if named.is_none() && (!is_installed || on_other) {
        let why = if on_other { "this stack has no gfxreconstruct" } else { "gfxreconstruct is not installed" };
        return eprintln!("NOT RUN: {why}");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let pack = folder.path().join("pack");
    let (succeeded, said) = capture(&pack, &TRACES.map(|(name, _)| name));
    assert!(succeeded, "{said}");
    let list = fs::read_to_string(pack.join("traces-afterlight.toml")).expect("the list is there");
    let list: toml::Table = list.parse().unwrap_or_else(|error| panic!("{error}: {list}"));
    assert!(list["traces_db"]["download_url"].is_str(), "gpu-trace-perf wants one: {list}");
    let traces = list["traces"].as_array().expect("an array of tables");
    assert_eq!(traces.len(), TRACES.len(), "{said}");
    for (trace, (name, arguments)) in traces.iter().zip(TRACES) {
        let path = trace["path"].as_str().expect("a path");
        assert_eq!(path, format!("afterlight/{name}.gfxr"));
        assert!(fs::metadata(pack.join(path)).is_ok_and(|file| file.len() > 10_000), "{path} is not there");
        let expected = sha256(&rendered(SIZE, arguments));
        // The key names the CPU, because a checksum holds for one driver on one kind of CPU.
        let cpu = key_of(&afterlight_truth::measure::cpu_kind());
        assert_eq!(trace["devices"][&*format!("lavapipe-{cpu}")]["checksum"].as_str(), Some(&*expected), "{name}");
    }
    let (succeeded, said) = capture(&pack, &["spheres"]);
    assert!(!succeeded && said.contains("is there already"), "a pack is never written over: {said}");
}
