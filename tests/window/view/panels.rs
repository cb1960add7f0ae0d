//! Panels over the picture: they change nothing but the part that they cover, on every way to the picture, and a change made there is drawn.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use afterlight::scene::Camera;
use afterlight::scene::file::load_path;

use super::WAYS;
use super::harness::{
    BUTTON_PRESS, BUTTON_RELEASE, FXAA_BOX, MOTION, SIZE, Server, View, key, rendered, rgb, size_text, until,
};
use crate::common::some_of;

const LARGE: [u16; 2] = [480, 300];

/// The columns of pixels that differ, from the first to the last.
fn covered(own: &[u8], other: &[u8], [width, _]: [u16; 2]) -> Option<(usize, usize)> {
    let differs = |&index: &usize| own[3 * index..3 * index + 3] != other[3 * index..3 * index + 3];
    let columns: Vec<usize> = (0..own.len() / 3).filter(differs).map(|index| index % usize::from(width)).collect();
    Some((*columns.iter().min()?, *columns.iter().max()?))
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn panels_lie_over_the_picture_and_leave_no_trace_when_they_are_closed() {
    let server = Server::start();
    for arguments in some_of(WAYS, 3) {
        let expected = rendered(LARGE, arguments);
        let size = size_text(LARGE);
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        view.shows(&expected, &format!("{arguments:?}"));
        server.tap(key::G);
        let with_panels = view.settles_elsewhere(&expected);
        let (left, right) = covered(&with_panels, &expected, LARGE).expect("something is covered");
        assert!(left > 4 && right - left > 200 && right < 440, "{arguments:?}: columns {left} to {right}");
        // A screenshot is of the picture.
        server.tap(key::P);
        view.waits_to_tell("screenshot: ");
        assert!(rgb(&view.folder.path().join("afterlight-0001.png")) == expected, "{arguments:?}: the screenshot");
        server.tap(key::G);
        view.shows(&expected, &format!("{arguments:?} when the panels are closed"));
        view.closes_well();
    }
}

/// A quarter of a whole factor, as desktops offer: no edge of a panel falls on an edge of a pixel by itself.
#[test]
#[ignore = "test-all: the program and its window at length"]
fn on_a_fine_screen_panels_are_larger_and_the_picture_is_the_same() {
    const WIDE: [u16; 2] = [1200, 700];
    const SMALL: [u16; 2] = [333, 211];
    let scene = "builtin:spheres";
    let [wide, small] = [WIDE, SMALL].map(|size| rendered(size, &[scene]));
    let covers = |factor: &str| {
        let server = Server::start().with_environment(vec![("WINIT_X11_SCALE_FACTOR", factor.into())]);
        let mut view = View::open(&server, &[scene, "--size", &size_text(WIDE)]);
        view.shows(&wide, &format!("at {factor}, as it was opened"));
        server.tap(key::G);
        let with_panels = view.settles_elsewhere(&wide);
        let (left, right) = covered(&with_panels, &wide, WIDE).expect("something is covered");
        view.resize(SMALL.map(u32::from));
        until("the window's new size", || (view.size() == SMALL).then_some(()));
        view.rests();
        assert!(view.pixels() != small, "at {factor}: the panels are gone");
        server.tap(key::G);
        view.shows(&small, &format!("at {factor}, smaller, with the panels closed"));
        view.resize(WIDE.map(u32::from));
        view.shows(&wide, &format!("at {factor}, as large as before"));
        view.closes_well();
        right - left
    };
    let (plain, fine) = (covers("1"), covers("3.75"));
    assert!((3 * plain..=4 * plain).contains(&fine), "{fine} columns at 3.75, and {plain} at 1");
}

#[test]
fn panels_stay_through_changes_of_size_and_take_the_mouse() {
    let server = Server::start();
    let scene = "builtin:spheres";
    let size = size_text(LARGE);
    let mut view = View::open(&server, &[scene, "--size", &size]);
    let before = rendered(LARGE, &[scene]);
    view.shows(&before, "as it was opened");
    server.tap(key::G);
    view.settles_elsewhere(&before);
    for size in [[300, 200], [1, 1], [200, 400], [480, 300]] {
        view.resize(size);
        sleep(Duration::from_millis(150));
        view.assert_running();
    }
    let shown = view.settles_elsewhere(&before);
    // Dragging on a panel moves the panel, and not the camera.
    server.fake(MOTION, 0, [100, 24]);
    view.rests();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    // While a button is held over a panel frames go on; the panel reads its events once a frame.
    sleep(Duration::from_millis(250));
    server.fake(MOTION, 0, [140, 24]);
    // A frame of panels alone is too fast for all of these to come in the course of several.
    sleep(Duration::from_millis(100));
    server.fake(MOTION, 0, [180, 24]);
    sleep(Duration::from_millis(100));
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    view.settles_elsewhere(&shown);
    server.tap(key::G);
    view.shows(&before, "with the panels closed");
    view.closes_well();
}

#[test]
fn what_is_changed_on_a_panel_is_drawn_as_if_it_had_been_asked_for() {
    let server = Server::start();
    let (scene, tall) = ("builtin:spheres", [480, 680]);
    let size = size_text(tall);
    let mut view = View::open(&server, &[scene, "--size", &size]);
    let before = rendered(tall, &[scene]);
    view.shows(&before, "as it was opened");
    server.tap(key::G);
    view.settles_elsewhere(&before);
    server.fake(MOTION, 0, FXAA_BOX);
    view.rests();
    let pointed = view.pixels();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    view.settles_elsewhere(&pointed);
    server.tap(key::G);
    view.shows(&rendered(tall, &[scene, "--fxaa", "on"]), "with FXAA");
    // A size that is asked for later has it too.
    view.resize([200, 120]);
    view.shows(&rendered([200, 120], &[scene, "--fxaa", "on"]), "with FXAA, smaller");
    view.closes_well();
}

#[test]
fn keys_go_through_the_views_and_come_back() {
    let server = Server::start();
    let scene = "builtin:spheres";
    let size = size_text(SIZE);
    let mut view = View::open(&server, &[scene, "--size", &size]);
    view.shows(&rendered(SIZE, &[scene]), "as it was opened");
    for name in ["position", "normal", "normal-absolute", "albedo", "metallic", "roughness", "depth"] {
        server.tap(key::V);
        view.waits_to_tell(&format!("view: {name}\n"));
        view.shows(&rendered(SIZE, &[scene, "--view", name]), name);
    }
    server.press(key::SHIFT);
    for _ in 0..7 {
        server.tap(key::V);
        sleep(Duration::from_millis(100));
    }
    server.release(key::SHIFT);
    view.waits_to_tell("view: final");
    view.shows(&rendered(SIZE, &[scene]), "back where it began");
    view.closes_well();
}

#[test]
fn a_flight_is_recorded_as_a_path_that_render_takes() {
    let server = Server::start();
    let scene = "builtin:spheres";
    let size = size_text(SIZE);
    let first = rendered(SIZE, &[scene]);
    let mut view = View::open(&server, &[scene, "--size", &size]);
    view.shows(&first, "as it was opened");
    server.tap(key::K);
    view.waits_to_tell("path: recording");
    server.press(key::W);
    sleep(Duration::from_millis(400));
    server.release(key::W);
    let last = view.settles_elsewhere(&first);
    server.tap(key::K);
    view.waits_to_tell("afterlight-0001.toml");
    let file = view.folder.path().join("afterlight-0001.toml");
    let path = load_path(&file, &Camera::default()).expect("is a path");
    assert!(path.seconds() > 0.3 && path.keys().len() > 2, "{path:?}");
    let picture = last_of(&file, scene);
    assert!(picture == last, "the last picture of the path is not what the window shows");
    view.closes_well();
}

/// The last picture of a path.
fn last_of(path: &Path, scene: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let size = size_text(SIZE);
    let mut command = crate::common::program::program();
    command.current_dir(folder.path()).args(["render", scene, "--samples", "1", "--quiet", "--size", &size]);
    // So few pictures that the last one stands at the end.
    let text = fs::read_to_string(path).expect("a path");
    let times: Vec<f64> = text.lines().filter_map(|line| line.strip_prefix("time = ")?.parse().ok()).collect();
    let fps = 1.0 / (times.last().expect("keys") - times.first().expect("keys"));
    command.args(["--fps", &fps.to_string(), "-o", "out.png", "--path"]).arg(path);
    let output = command.output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    rgb(&folder.path().join("out-0001.png"))
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_click_selects_and_t_compares_and_escape_ends_both_before_it_quits() {
    let server = Server::start();
    let scene = "builtin:spheres";
    let size = size_text(LARGE);
    let mut view = View::open(&server, &[scene, "--size", &size]);
    let before = rendered(LARGE, &[scene]);
    view.shows(&before, "as it was opened");
    server.fake(MOTION, 0, [240, 200]);
    view.rests();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    let selected = view.settles_elsewhere(&before);
    let (_, right) = covered(&selected, &before, LARGE).expect("a panel tells what it is");
    assert!(right > 440, "the panel is not at the right: {right}");
    server.tap(key::ESCAPE);
    view.shows(&before, "with nothing selected");
    server.tap(key::T);
    view.settles_elsewhere(&before);
    // The camera moves: it is another picture, which nobody has compared. It moves for a while: frames are slow while the comparison is computed.
    server.press(key::W);
    sleep(Duration::from_secs(2));
    server.release(key::W);
    view.rests();
    server.tap(key::R);
    view.shows(&before, "when the camera has moved and is back");
    server.tap(key::T);
    view.settles_elsewhere(&before);
    server.tap(key::ESCAPE);
    view.shows(&before, "with nothing compared");
    server.tap(key::ESCAPE);
    view.ends_well();
}
