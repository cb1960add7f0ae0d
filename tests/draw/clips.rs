//! `render --time`, `--clip` and `--duration`: a sequence has the pictures of its moments, clips are picked by name, and unknown ones are told.

use std::path::Path;
use std::process::Output;

use tempfile::TempDir;

use crate::common::program::program;

const SCENE: &str = "builtin:seaweed?count=3&joints=3";
const COMMON: [&str; 6] = ["--size", "96x54", "--samples", "1", "--exposure", "4"];

fn run(folder: &Path, arguments: &[&str]) -> Output {
    program().current_dir(folder).args(arguments).output().expect("the program starts")
}

fn render(folder: &TempDir, more: &[&str]) -> Vec<u8> {
    let output = run(folder.path(), &[&["render", SCENE, "--validate"], &COMMON[..], more].concat());
    assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

fn picture(folder: &TempDir, name: &str) -> Vec<u8> {
    image::open(folder.path().join(name)).expect("a picture").into_rgb8().into_raw()
}

/// A sequence deforms meshes on the device, a still scene has them deformed already: edges and shadows may differ by rounding.
fn assert_alike(found: &[u8], expected: &[u8], what: &str) {
    let far = found.iter().zip(expected).filter(|(a, b)| a.abs_diff(**b) > 8).count();
    assert!(found.len() == expected.len() && far * 100 < found.len(), "{what}: {far} of {} channels", found.len());
}

#[test]
fn a_sequence_has_the_pictures_of_its_moments() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    render(&folder, &["--time", "1", "--duration", "2", "--fps", "1.5", "-o", "sea.png"]);
    let names = ["sea-0000.png", "sea-0001.png", "sea-0002.png"];
    for (name, time) in names.into_iter().zip(["1", "1.6666666666666665", "2.333333333333333"]) {
        render(&folder, &["--time", time, "-o", "still.png"]);
        assert_alike(&picture(&folder, name), &picture(&folder, "still.png"), name);
    }
    assert!(!folder.path().join("sea-0003.png").exists(), "the end of a loop is its beginning");
    assert!(picture(&folder, names[0]) != picture(&folder, names[1]), "nothing moves");
    // A whole loop later all is where it was: 24 s are whole loops of 6, 8 and 12 s.
    render(&folder, &["--time", "25", "-o", "later.png"]);
    assert_alike(&picture(&folder, "later.png"), &picture(&folder, names[0]), "a loop later");
}

#[test]
fn clips_are_picked_by_name_and_none_is_rest() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |clips: &[&str]| {
        let chosen: Vec<&str> = clips.iter().flat_map(|clip| ["--clip", clip]).collect();
        render(&folder, &[&["--time", "2.3", "-o", "own.png"], &chosen[..]].concat());
        picture(&folder, "own.png")
    };
    let pictures = [at(&[]), at(&["none"]), at(&["sway"]), at(&["swim"]), at(&["turn"])];
    for (index, own) in pictures.iter().enumerate() {
        assert!(pictures[index + 1..].iter().all(|other| other != own), "choice {index}");
    }
    assert!(at(&["sway", "swim", "2"]) == pictures[0], "all three, one of them by its number");
}

#[test]
fn what_cannot_be_played_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refused = |arguments: &[&str], code: i32, what: &str| {
        let output = run(folder.path(), arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(code) && error.contains(what), "{arguments:?}: {error}");
    };
    refused(&["render", SCENE, "--clip", "sweim"], 2, "did you mean \"swim\"? (possible: sway, swim, turn, all, none)");
    refused(&["render", "builtin:spheres", "--clip", "walk"], 2, "the scene has no clips");
    refused(&["render", "builtin:spheres", "--fps", "3"], 2, "of a scene in which a clip plays");
    refused(&["render", SCENE, "--duration", "1e6", "--fps", "1e4"], 2, "at most 1e6");
    refused(&["render", SCENE, "--time", "-1"], 2, "from 0 to 1e9");
    refused(&["render", SCENE, "--duration", "2", "--view", "all"], 2, "--view all");
}

#[test]
fn the_plan_and_the_truth_are_of_the_moment() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let json = |more: &[&str]| {
        let output = run(folder.path(), &[&["inspect", SCENE, "--json"], more].concat());
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
    };
    let (own, other) = (json(&["--time", "2"]), json(&["--clip", "none"]));
    assert_eq!(own["motion"]["clips"][1]["name"], "swim");
    assert_eq!(
        (&own["motion"]["duration_s"], own["motion"]["skins"].as_array().map(Vec::len)),
        (&12.0.into(), Some(3))
    );
    assert_ne!(own["bounds"], other["bounds"], "the box is that of the moment");
    assert!(json(&[])["motion"]["nodes"].as_array().is_some_and(|nodes| nodes.len() > 12));
    let truth = |time: &str| {
        let more = ["--time", time, "--size", "32x18", "--point", "--no-cache", "-o", "truth.png"];
        let output = run(folder.path(), &[&["reference", SCENE], &more[..]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        picture(&folder, "truth.png")
    };
    assert!(truth("0") != truth("3") && truth("3") == truth("27"));
}
