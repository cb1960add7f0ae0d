//! `doctor --calibrate`: its figures are kept, each choice says whose figures it rests on, and a file that cannot be used counts as none.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread;
use std::time::Duration;

use afterlight::gpu::{decode_device_file, encode_device_file};
use serde_json::Value;

use crate::common::program::program;

/// A scene with lights of limited reach, for which `auto` has a choice on every device.
const SCENE: &str = "builtin:field?objects=10&lights=9";

/// Runs the program with a folder for figures, and returns its exit code, standard output and standard error.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = program().env("AFTERLIGHT_CALIBRATION", folder).args(arguments).output().expect("started");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Returns the plan's reason for its light path.
fn reason(folder: &Path) -> String {
    let (code, out, err) = run(folder, &["inspect", SCENE, "--json"]);
    assert_eq!(code, Some(0), "{err}");
    let plan: Value = serde_json::from_str(&out).expect("JSON");
    let parts = plan["parts"].as_array().expect("parts");
    let path = parts.iter().find(|part| part["name"].as_str().is_some_and(|name| name.starts_with("light path ")));
    path.expect("a light path")["reason"].as_str().expect("a reason").to_owned()
}

fn kept(folder: &Path) -> PathBuf {
    let mut files = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let file = files.next().expect("a file");
    assert_eq!(files.next(), None, "nothing beside it");
    file
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn figures_of_a_device_are_kept_and_chosen_by() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().join("deeper");
    assert!(reason(&folder).contains("doctor --calibrate` measures this device"));
    let (code, out, err) = run(&folder, &["doctor", "--calibrate", "--json"]);
    assert_eq!(code, Some(0), "{err}");
    let report: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((report["measured"].as_str(), report["of"].is_null()), (Some("asked"), true), "{out}");
    let paths = report["paths"].as_array().expect("paths");
    for path in
        paths.iter().filter(|path| ["loop", "clustered", "compute"].contains(&path["path"].as_str().expect("a name")))
    {
        assert!(path["base"].as_u64().is_some_and(|picoseconds| picoseconds > 0), "{path}");
    }
    let each = |name: &str, figure: &str| {
        let path = paths.iter().find(|path| path["path"] == name).expect("a path");
        path[figure].as_u64().expect("a figure")
    };
    // Each pixel of a loop meets each light: hundreds of them take longer than the rest of a frame, whatever else the machine does.
    assert!(300 * each("loop", "limited") > each("loop", "base"), "{out}");
    assert!(each("clustered", "limited") < each("loop", "limited"), "{out}");

    let why = reason(&folder);
    assert!(why.contains("(by the figures of this device)"), "{why}");
    let (_, out, _) = run(&folder, &["doctor"]);
    assert!(out.contains("`auto` chooses by what was measured on this device\n"), "{out}");

    let file = kept(&folder);
    let whole = fs::read(&file).expect("read");
    let mut flipped = whole.clone();
    *flipped.last_mut().expect("bytes") ^= 1;
    for (what, bytes) in [("cut off", &whole[..whole.len() / 2]), ("flipped", &flipped), ("empty", b"")] {
        fs::write(&file, bytes).expect("written");
        assert!(reason(&folder).contains("doctor --calibrate` measures this device"), "{what}");
    }
    // Figures of another version, of another layout, and whole files that are no figures.
    let figures = decode_device_file(whole.clone()).expect("whole");
    let text = String::from_utf8(figures).expect("JSON");
    let version = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{text}");
        fs::write(&file, encode_device_file(text.replace(from, to).as_bytes())).expect("written");
    };
    for (from, to) in
        [(version.as_str(), "\"version\":\"0.0.1\""), ("\"layout\":1", "\"layout\":0"), ("\"asked\"", "\"else\"")]
    {
        changed(from, to);
        assert!(reason(&folder).contains("doctor --calibrate` measures this device"), "{to}");
    }
    // Figures measured beside a window decide between loop and clustered, and say nothing of the other paths.
    changed("\"asked\":true", "\"asked\":false");
    let why = reason(&folder);
    assert!(
        why.contains("(by the figures of this device)") && !why.contains("compute 0") && !why.contains("compute 1"),
        "{why}"
    );
    let (_, out, _) = run(&folder, &["doctor"]);
    assert!(out.contains("what was measured on this device beside a window\n"), "{out}");
    fs::write(&file, &whole).expect("written");
    assert!(reason(&folder).contains("(by the figures of this device)"));
    // No figures are read without a folder.
    let (code, out, err) = run(Path::new(""), &["inspect", SCENE]);
    assert!(code == Some(0) && out.contains("doctor --calibrate` measures this device"), "{err}");
}

/// The window that a measurement runs beside may have been killed.
#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_measurement_beside_a_window_ends_when_the_window_is_gone() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = program();
    command.env("AFTERLIGHT_CALIBRATION", folder.path()).args(["doctor", "--calibrate", "--unasked"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().expect("started");
    thread::sleep(Duration::from_millis(300));
    assert!(child.try_wait().expect("asked").is_none(), "it measures while the pipe is open");
    drop(child.stdin.take());
    // The exit status does not matter: the driver may still have been compiling.
    child.wait().expect("ended");
    let files = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(files, 0, "half a measurement is kept as none");
}

#[test]
fn figures_that_cannot_be_kept_are_an_error_and_options_alone_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, b"").expect("written");
    // Asked before anything is measured.
    let (code, _, err) = run(&file, &["doctor", "--calibrate"]);
    assert!(code == Some(3) && err.contains("AFTERLIGHT_CALIBRATION"), "{code:?} {err}");
    let (code, _, err) = run(Path::new(""), &["doctor", "--calibrate"]);
    assert!(code == Some(3) && err.contains("AFTERLIGHT_CALIBRATION"), "{code:?} {err}");
    for arguments in [&["doctor", "--device", "0"][..], &["doctor", "--unasked"]] {
        assert_eq!(run(folder.path(), arguments).0, Some(2), "{arguments:?}");
    }
    assert_eq!(run(folder.path(), &["doctor", "--calibrate", "--device", "no such device"]).0, Some(2));
}
