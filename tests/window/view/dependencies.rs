//! The panel of dependencies: rows that are switched off there, the layer's messages about the frames without them, and simulated pictures of hazards.

use super::harness::{BUTTON_PRESS, BUTTON_RELEASE, MOTION, Server, View, key, rendered, rgb, size_text};
use crate::common::program::program;

const LARGE: [u16; 2] = [640, 400];
/// The middle of the button "all on", as the panel is laid out in a window of this size.
const ALL_ON: [i16; 2] = [180, 122];
/// The middle of the first row's box, while no row is off.
const FIRST_BOX: [i16; 2] = [200, 169];

fn click(server: &Server, view: &mut View, place: [i16; 2]) {
    server.fake(MOTION, 0, place);
    view.rests();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    view.rests();
}

/// A screenshot, which has no panels.
fn picture(server: &Server, view: &mut View, number: usize) -> Vec<u8> {
    let name = format!("afterlight-{number:04}.png");
    server.tap(key::P);
    view.waits_to_tell(&name);
    view.rests();
    rgb(&view.folder.path().join(name))
}

#[test]
fn a_row_is_switched_off_shows_its_hazard_and_leaves_no_trace_when_it_is_on_again() {
    let server = Server::start();
    let scene = ["builtin:hall", "--light-path", "loop"];
    let expected = rendered(LARGE, &scene);
    let size = size_text(LARGE);
    let row = ["--size", &size, "--without", "geometry-to-lighting", "--hazard", "cleared"];
    let mut view = View::start(&server, &[&scene[..], &row].concat());
    view.rests();
    // The background is all that LIGHTING leaves of a scene that is not drawn.
    let cleared = picture(&server, &mut view, 1);
    let first = &cleared[..3];
    assert!(cleared.chunks(3).all(|pixel| pixel == first), "something is drawn");
    assert!(first.iter().any(|&code| code > 0), "nothing is cleared to the background");
    // The label is over the picture, with the panel or without.
    let with_panel = view.pixels();
    server.tap(key::B);
    let with_label = view.settles_elsewhere(&with_panel);
    assert!(with_label != cleared, "a picture that is simulated has no label");
    server.tap(key::B);
    view.settles_elsewhere(&with_label);
    click(&server, &mut view, ALL_ON);
    assert!(picture(&server, &mut view, 2) == expected, "a row that is on again");
    // It was an upload's: the same scene is uploaded without it, and has no picture of the hazard.
    click(&server, &mut view, FIRST_BOX);
    let told = view.pixels();
    assert!(picture(&server, &mut view, 3) == expected, "a row without a picture");
    click(&server, &mut view, ALL_ON);
    assert!(view.pixels() != told, "a row that is off is told on the panel");
    server.tap(key::B);
    view.shows(&expected, "with the panel closed");
    view.closes_well();
}

#[test]
fn the_layers_message_about_a_row_that_is_off_is_told_while_the_window_is_open() {
    let server = Server::start();
    let size = size_text(LARGE);
    let row = ["--without", "lighting-to-tonemap"];
    let mut view = View::open(&server, &[&["builtin:hall", "--size", &size][..], &row].concat());
    view.waits_to_tell("warning: the validation layer says SYNC-HAZARD-");
    view.close();
    let (code, _, errors) = view.ends();
    assert_eq!(code, Some(1), "{errors}");
    assert!(errors.contains("validation failed"), "{errors}");
}

#[test]
fn a_row_that_frames_do_not_have_is_refused_before_a_window_is_opened() {
    let server = Server::start();
    let told = |arguments: &[&str]| {
        let mut command = program();
        command.arg("view").args(arguments);
        server.serves(&mut command);
        let output = command.output().expect("the program starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, errors) = told(&["builtin:spheres", "--without", "lighting-to-nothing"]);
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("lighting-to-nothing"), "{errors}");
    let (code, errors) = told(&["builtin:spheres", "--without", "frame-to-host"]);
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("cannot be dropped"), "{errors}");
    assert_eq!(told(&["builtin:spheres", "--hazard", "stale"]).0, Some(2), "a picture of no row");
}
