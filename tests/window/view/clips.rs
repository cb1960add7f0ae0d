//! Clips in the window: the window opens with clips that play, they rest at a requested moment, and keys pause them, go through time and pick the
//! ones that play.

use std::fs;

use super::harness::{SIZE, Server, View, key, rendered, rgb, size_text, until};

/// A block that goes to and fro and turns under a lamp that grows, for two seconds.
const SCENE: &str = r##"
[[models]]
name = "floor"
shape = { kind = "plane", size = [6, 6] }
[[models]]
name = "block"
shape = { kind = "box", size = [0.6, 0.8, 0.6] }
translation = [-0.6, 0.4, 0]
[[lights]]
name = "lamp"
kind = "point"
position = [0, 2, 1]
intensity = 4
[environment]
ambient = [0.1, 0.1, 0.12]
background = [0.3, 0.5, 0.8]
[camera]
position = [0.4, 1, 2.2]
target = [0, 0.3, 0]
[settings]
exposure = -1
[[clips]]
name = "go"
channels = [
    { target = "models.block", property = "translation", times = [0, 1, 2], values = [[-0.6, 0.4, 0], [0.6, 0.4, 0], [-0.6, 0.4, 0]] },
    { target = "models.block", property = "rotation", axis = [0, 1, 0], times = [0, 2], values = [0, 90] },
]
[[clips]]
name = "glow"
channels = [{ target = "lights.lamp", property = "intensity", times = [0, 1, 2], values = [4, 1, 4] }]
"##;

#[test]
fn clips_rest_at_a_moment_play_pause_and_are_picked() {
    let (server, folder) = (Server::start(), tempfile::tempdir().expect("a temporary folder"));
    let path = folder.path().join("move.toml");
    fs::write(&path, SCENE).expect("a file");
    let scene = path.to_str().expect("UTF-8");
    let at = |time: &str, clip: &str| {
        let clip = if clip.is_empty() { vec![] } else { vec!["--clip", clip] };
        rendered(SIZE, &[&[scene, "--time", time], &clip[..]].concat())
    };
    let mut view = View::open(&server, &[scene, "--time", "0.75", "--size", &size_text(SIZE)]);
    let moment = at("0.75", "");
    view.shows(&moment, "at rest");
    view.rests();
    // A thirtieth of a second on, and back.
    server.tap(key::BRACKET_RIGHT);
    view.shows(&at("0.7833333333333333", ""), "a step on");
    server.tap(key::BRACKET_LEFT);
    view.shows(&moment, "and back");
    // All, then each alone, then none.
    for (clip, what) in [("go", "the first clip"), ("glow", "the second"), ("none", "none")] {
        server.tap(key::N);
        view.shows(&at("0.75", clip), what);
    }
    server.tap(key::N);
    view.shows(&moment, "all again");
    server.tap(key::ENTER);
    view.waits_to_tell("clips: all plays at");
    let first = view.moves_on(&moment);
    view.moves_on(&first);
    server.tap(key::ENTER);
    view.waits_to_tell("clips: all rests at");
    view.rests();
    // A screenshot is the picture that is shown.
    server.tap(key::P);
    view.waits_to_tell("screenshot: ");
    let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
    view.shows(&kept, "after the screenshot");
    view.closes_well();
}

/// A moving scene's clips go on under the panels, and when they are closed again.
#[test]
fn panels_that_are_opened_do_not_stop_clips() {
    let (server, folder) = (Server::start(), tempfile::tempdir().expect("a temporary folder"));
    let path = folder.path().join("move.toml");
    fs::write(&path, SCENE).expect("a file");
    // As high as the panel with its section of clips.
    let mut view = View::open(&server, &[path.to_str().expect("UTF-8"), "--size", "480x680"]);
    let playing = |view: &mut View| {
        for _ in 0..3 {
            // Right of the panels, where the block moves.
            let before = view.part([400, 0], [80, 680]);
            until("the clip goes on", || (view.part([400, 0], [80, 680]) != before).then_some(()));
        }
    };
    playing(&mut view);
    server.tap(key::G);
    let covered = view.part([20, 20], [200, 200]);
    until("the panels", || (view.part([20, 20], [200, 200]) != covered).then_some(()));
    playing(&mut view);
    server.tap(key::G);
    playing(&mut view);
    server.tap(key::ENTER);
    view.waits_to_tell("clips: all rests at");
    view.closes_well();
}
