//! Frames whose work goes to several queues, on the families that the layer of `tests/devices-layer` plays on any device: the bytes of one queue, and silent
//! validation.

use std::fs;

use super::devices::LayerSetup;

/// The exit code, the picture, and the standard error.
fn draw(setup: &LayerSetup, profile: Option<&str>, arguments: &[&str]) -> (Option<i32>, Vec<u8>, String) {
    // Two frames are in flight, and later ones take their places.
    let usual = ["render", "--size", "96x54", "--samples", "4", "--validate", "--output", "-"];
    let output = setup.run(profile, &[&usual[..], arguments].concat());
    (output.status.code(), output.stdout, String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn frames_on_all_queues_are_those_of_one_to_the_byte() {
    let setup = LayerSetup::new();
    let frames: [&[&str]; 5] = [
        // Shadow maps, air and particles run beside ambient occlusion, and textures with levels come from the transfer queue.
        &["builtin:hall", "--ao", "ssao", "--fog", "froxels"],
        &["builtin:hall", "--ao", "bitmask", "--light-path", "compute", "--sync", "2"],
        &["builtin:hall", "--ao", "ssao", "--passes", "stored", "--reflections", "screen"],
        // No shadow maps: nothing runs beside it.
        &["builtin:cornell", "--ao", "ssao", "--light-path", "loop"],
        // Only uploads.
        &["builtin:cornell"],
    ];
    for frame in frames {
        let (code, one, told) = draw(&setup, Some("queues"), frame);
        assert_eq!(code, Some(0), "{frame:?}: {told}");
        let (code, all, told) = draw(&setup, Some("queues"), &[frame, &["--queues", "all"]].concat());
        assert!(code == Some(0) && told.contains("no messages"), "{frame:?}: {told}");
        assert!(one == all, "{frame:?} differs");
    }
}

/// Runs the suite's cases, frames of a window among them, and the mutants that lack a row between queues.
#[test]
fn the_suite_and_its_mutants_pass_on_all_queues() {
    let setup = LayerSetup::new();
    let run = |arguments: &[&str]| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().to_str().expect("UTF-8");
        let output = setup.run(Some("queues"), &[&["ci"], arguments, &["--jobs", "2", "-o", path]].concat());
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        let results = fs::read_to_string(folder.path().join("results.csv")).expect("results");
        results.lines().map(|line| line.split(',').nth(1).unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let passed = run(&["quick", "--only", r"^carriers\.(neighbours-queues-2|window-queues)$"]);
    assert_eq!(passed.iter().filter(|status| *status == "Pass").count(), 2, "{passed:?}");
    let mutants = run(&["--mutants", "--only", "on-all-queues$"]);
    let is_held = |status: &String| ["Pass", "ExpectedFail"].contains(&status.as_str());
    assert!(mutants.len() > 40 && mutants[..].iter().all(is_held), "{mutants:?}");
    assert!(mutants.iter().any(|status| status == "Pass"), "the layer has noticed nothing: {mutants:?}");
}

/// Most software drivers have one queue.
#[test]
fn a_device_with_one_queue_is_refused_more_of_them_by_name() {
    let setup = LayerSetup::new();
    let frame = ["builtin:cornell", "--ao", "ssao", "--light-path", "loop"];
    let (code, one, told) = draw(&setup, None, &frame);
    assert_eq!(code, Some(0), "{told}");
    let (code, all, told) = draw(&setup, None, &[&frame[..], &["--queues", "all"]].concat());
    match code {
        Some(0) => assert!(one == all, "another picture"),
        _ => assert!(
            code == Some(2)
                && told.contains(
                    "--queues all: this device has no queue family for compute alone, and none for copies alone"
                )
                && told.contains("ask for --queues one"),
            "{told}"
        ),
    }
}
