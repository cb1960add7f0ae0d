//! Pictures of light that are taken in a window equal `render`'s bit by bit.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use afterlight::scene::exposure_scale;

use super::harness::{
    BUTTON_PRESS, BUTTON_RELEASE, MOTION, SIZE, Server, View, floats, key, render, rendered, size_text,
};
use crate::common::some_of;

/// Arguments of the window, and of `render` for the same light: FXAA smooths tone-mapped pictures only.
const WAYS: &[(&[&str], &[&str])] = &[
    (&["builtin:hall", "--light-path", "loop"], &["builtin:hall", "--light-path", "loop"]),
    (&["builtin:layers"], &["builtin:layers"]),
    (&["builtin:spheres", "--light-path", "forward"], &["builtin:spheres", "--light-path", "forward"]),
    (&["builtin:spheres", "--msaa", "4"], &["builtin:spheres", "--msaa", "4"]),
    (&["builtin:spheres", "--fxaa", "on"], &["builtin:spheres"]),
    (&["builtin:spheres", "--light-path", "compute"], &["builtin:spheres", "--light-path", "compute"]),
];

fn keep_light(server: &Server, view: &mut View, number: u32) -> Vec<u32> {
    server.press(key::SHIFT);
    server.tap(key::P);
    server.release(key::SHIFT);
    let name = format!("afterlight-{number:04}.exr");
    view.waits_to_tell(&name);
    bits(&view.folder.path().join(name))
}

fn rendered_light(arguments: &[&str], file: &str) -> Vec<u32> {
    bits(&render(SIZE, arguments, "light.exr").path().join(file))
}

/// Files of the same picture may have their blocks in another order.
fn bits(path: &Path) -> Vec<u32> {
    floats(path).into_iter().map(f32::to_bits).collect()
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_picture_of_light_is_bit_by_bit_what_render_writes() {
    let server = Server::start();
    for (arguments, told) in some_of(WAYS, 3) {
        let size = size_text(SIZE);
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        view.shows(&rendered(SIZE, arguments), &format!("{arguments:?}"));
        assert!(keep_light(&server, &mut view, 1) == rendered_light(told, "light.exr"), "{arguments:?}: other light");
        // The window shows the same picture as before, and a file whose name is taken stays.
        view.shows(&rendered(SIZE, arguments), &format!("{arguments:?} afterwards"));
        let again = [2, 3].map(|number| keep_light(&server, &mut view, number));
        assert!(again[0] == again[1], "{arguments:?}: not twice the same");
        let left: Vec<_> = fs::read_dir(view.folder.path()).expect("a folder").flatten().collect();
        assert_eq!(left.len(), 4, "three pictures and what it told: {left:?}");
        view.closes_well();
    }
}

#[test]
fn views_keep_their_values_and_a_camera_that_has_moved_is_that_of_the_light_too() {
    let server = Server::start();
    let (scene, size) = ("builtin:spheres", size_text(SIZE));
    let mut view = View::open(&server, &[scene, "--size", &size]);
    let first = rendered(SIZE, &[scene]);
    view.shows(&first, "as it was opened");
    server.tap(key::K);
    view.waits_to_tell("path: recording");
    server.press(key::W);
    sleep(Duration::from_millis(400));
    server.release(key::W);
    view.settles_elsewhere(&first);
    server.tap(key::K);
    view.waits_to_tell("afterlight-0001.toml");
    let kept = keep_light(&server, &mut view, 1);
    let path = view.folder.path().join("afterlight-0001.toml");
    let written = fs::read_to_string(&path).expect("a path");
    let times: Vec<f64> = written.lines().filter_map(|line| line.strip_prefix("time = ")?.parse().ok()).collect();
    // So few pictures that the last one stands at the end.
    let fps = (1.0 / (times.last().expect("keys") - times.first().expect("keys"))).to_string();
    let path = path.to_str().expect("a name");
    let last = rendered_light(&[scene, "--path", path, "--fps", &fps], "light-0001.exr");
    assert!(kept == last, "the light is not that of the camera");

    server.tap(key::R);
    view.shows(&first, "back where it began");
    for (index, name) in ["position", "normal"].into_iter().enumerate() {
        server.tap(key::V);
        view.waits_to_tell(&format!("view: {name}\n"));
        let kept = keep_light(&server, &mut view, 2 + index as u32);
        assert!(kept == rendered_light(&[scene, "--view", name], "light.exr"), "{name}: other values");
    }
    view.closes_well();
}

#[test]
fn what_is_changed_on_a_panel_is_in_the_light() {
    let server = Server::start();
    let (scene, tall) = ("builtin:spheres", [480u16, 560]);
    let size = size_text(tall);
    // Light is shown unchanged, so that the picture gives the expected light.
    let exposure = "2";
    let arguments = [scene, "--size", &size, "--tonemap", "none", "--exposure", exposure];
    let mut view = View::open(&server, &arguments);
    let shown = ["builtin:spheres", "--tonemap", "none", "--exposure", exposure];
    view.shows(&rendered(tall, &shown), "as it was opened");
    let before = keep_light(&server, &mut view, 1);
    server.tap(key::G);
    view.rests();
    // The box before "all roughness", as the panel is laid out.
    server.fake(MOTION, 0, ROUGHNESS);
    view.rests();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    view.rests();
    assert!(keep_light(&server, &mut view, 2) != before, "the roughness is as it was");
    server.tap(key::P);
    view.waits_to_tell("afterlight-0001.png");
    let light = floats(&view.folder.path().join("afterlight-0002.exr"));
    let codes = super::harness::rgb(&view.folder.path().join("afterlight-0001.png"));
    let scale = exposure_scale(2.0);
    for (index, (&nits, &code)) in light.iter().zip(&codes).enumerate() {
        let exposed = f64::from(nits * scale).clamp(0.0, 1.0);
        let encoded = if exposed <= 0.003_130_8 { 12.92 * exposed } else { 1.055 * exposed.powf(1.0 / 2.4) - 0.055 };
        let off = (encoded * 255.0 - f64::from(code)).abs();
        assert!(off < 1.5, "byte {index}: {nits} nits, shown as {code}, should be {:.1}", encoded * 255.0);
    }
    view.closes_well();
}

const ROUGHNESS: [i16; 2] = [44, 201];

#[test]
fn a_scene_file_that_is_written_draws_what_is_seen() {
    let server = Server::start();
    let (scene, size) = ("builtin:spheres", size_text(SIZE));
    let mut view = View::open(&server, &[scene, "--size", &size, "--fxaa", "on"]);
    let first = rendered(SIZE, &[scene, "--fxaa", "on"]);
    view.shows(&first, "as it was opened");
    server.press(key::W);
    sleep(Duration::from_millis(300));
    server.release(key::W);
    let moved = view.settles_elsewhere(&first);
    server.tap(key::F);
    view.waits_to_tell("scene: ./afterlight-0001.toml; afterlight render ./afterlight-0001.toml");
    let file = view.folder.path().join("afterlight-0001.toml");
    assert!(rendered(SIZE, &[file.to_str().expect("a name")]) == moved, "{:?}", fs::read_to_string(&file));
    view.closes_well();
}
