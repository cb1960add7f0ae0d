//! `afterlight view` in a real window: on an X server of each test's own (Xvfb), with synthetic keys and mouse, and the window's pixels read back
//! from the server; under Wayland on a compositor. All under core and synchronization validation, any message of which is exit code 1.

mod changes;
mod clips;
mod deep;
mod dependencies;
mod examples;
mod failures;
mod harness;
mod hdr;
mod hdr_display;
mod light;
mod messages;
mod openings;
mod panels;
mod resolution;
mod split;
mod steps;
mod traces;
mod wayland;

use std::thread::sleep;
use std::time::Duration;

use self::harness::{
    BUTTON_PRESS, BUTTON_RELEASE, MOTION, SIZE, Server, View, key, rendered, rgb, size_text, text, until,
};
use crate::common::program::program;
use x11rb::protocol::xproto::{ConnectionExt, InputFocus};

/// Each way in which the last pass writes the picture: LIGHTING, FORWARD, TONEMAP after blending, a resolve, FXAA's pass, and the copy of a compute
/// pass's output.
const WAYS: &[&[&str]] = &[
    &["builtin:hall", "--light-path", "loop"],
    &["builtin:spheres", "--light-path", "forward"],
    &["builtin:layers"],
    &["builtin:spheres", "--msaa", "4"],
    &["builtin:spheres", "--fxaa", "on"],
    &["builtin:spheres", "--light-path", "compute"],
];

#[test]
fn the_window_shows_bit_by_bit_what_render_draws_and_so_does_a_screenshot() {
    let server = Server::start();
    for arguments in WAYS {
        let expected = rendered(SIZE, arguments);
        let size = size_text(SIZE);
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        view.shows(&expected, &format!("{arguments:?}"));
        server.tap(key::P);
        view.waits_to_tell("screenshot: ");
        let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
        assert!(kept == expected, "{arguments:?}: the screenshot is another picture");
        server.tap(key::ESCAPE);
        view.ends_well();
    }
}

#[test]
fn keys_and_the_mouse_move_the_camera_and_bring_it_back() {
    let server = Server::start();
    let size = size_text(SIZE);
    let scene = ["builtin:spheres"];
    let first = rendered(SIZE, &scene);
    let mut view = View::open(&server, &[scene[0], "--size", &size]);
    view.shows(&first, "before anything is pressed");

    let nearer = view.goes_nearer(&first, Duration::from_millis(300));
    view.keeps_camera_1();

    server.fake(MOTION, 0, [40, 40]);
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(MOTION, 0, [60, 45]);
    server.fake(MOTION, 0, [70, 45]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    let turned = view.settles_elsewhere(&nearer);
    // A mouse move without a button has no effect.
    server.fake(MOTION, 0, [100, 60]);
    sleep(Duration::from_millis(300));
    assert!(view.pixels() == turned, "the mouse turns the camera without a button");

    server.tap(key::DIGIT_1);
    view.shows(&nearer, "where a camera was kept");
    server.tap(key::R);
    view.shows(&first, "after a reset");
    server.tap(key::O);
    view.waits_to_tell("camera: orbit");
    server.tap(key::H);
    view.waits_to_tell("Ctrl+1 to Ctrl+9");
    view.closes_well();
}

#[test]
fn a_hundred_resizes_end_in_the_picture_of_the_last_size() {
    let server = Server::start();
    let scene = ["builtin:spheres"];
    let size = size_text(SIZE);
    let mut view = View::open(&server, &[scene[0], "--size", &size]);
    view.shows(&rendered(SIZE, &scene), "as it was opened");
    let mut random = fastrand::Rng::with_seed(7);
    for number in 0..100 {
        let size = match number {
            10 | 60 => [1, 1],
            20 => [1, 300],
            30 => [300, 1],
            _ => [random.u32(1..400), random.u32(1..300)],
        };
        view.resize(size);
        // Some come while a frame is drawn, some after it.
        sleep(Duration::from_millis(random.u64(0..60)));
        view.assert_running();
    }
    let last = [200u16, 120];
    view.resize(last.map(u32::from));
    view.shows(&rendered(last, &scene), "after a hundred resizes");
    view.closes_well();
}

#[test]
fn a_hidden_or_still_window_draws_nothing_and_comes_back_as_it_was() {
    let server = Server::start();
    let scene = ["builtin:spheres"];
    let expected = rendered(SIZE, &scene);
    let size = size_text(SIZE);
    let mut view = View::open(&server, &[scene[0], "--size", &size]);
    view.shows(&expected, "as it was opened");
    let idles = |view: &View, what: &str| {
        sleep(Duration::from_millis(500));
        let before = view.cpu_seconds();
        sleep(Duration::from_secs(2));
        let used = view.cpu_seconds() - before;
        assert!(used < 0.2, "{what} window took {used} s of CPU time in 2 s");
    };
    idles(&view, "a still");
    server.connection.unmap_window(view.window).expect("sent").check().expect("a window");
    idles(&view, "a hidden");
    server.connection.map_window(view.window).expect("sent").check().expect("a window");
    view.shows(&expected, "when it is back");
    let focused = server.connection.set_input_focus(InputFocus::PARENT, view.window, x11rb::CURRENT_TIME);
    focused.expect("sent").check().expect("the window takes the keys");
    server.tap(key::G);
    view.settles_elsewhere(&expected);
    idles(&view, "with panels, a still");
    view.closes_well();
}

/// Drivers read events in separate threads and keep the window's: a program that waits for its connection to have something to read would not come to
/// know of them.
#[test]
fn the_driver_has_a_connection_of_its_own() {
    let server = Server::start();
    let without = server.connections();
    let size = size_text(SIZE);
    let mut view = View::open(&server, &["builtin:spheres", "--size", &size]);
    view.shows(&rendered(SIZE, &["builtin:spheres"]), "as it was opened");
    assert_eq!(server.connections(), without + 2, "one for the window's events, one for the driver");
    view.closes_well();
    until("both to be closed", || (server.connections() == without).then_some(()));
}

#[test]
fn a_number_of_frames_is_drawn_timed_and_then_the_window_closes() {
    let server = Server::start();
    let size = size_text(SIZE);
    let view = View::open(&server, &["builtin:spheres", "--size", &size, "--frames", "30", "--vsync", "off"]);
    let output = view.ends_well();
    assert!(output.contains("30 frames shown") && output.contains("from frame to frame, median"), "{output}");
}

#[test]
fn a_window_that_is_closed_while_it_draws_ends_well() {
    let server = Server::start();
    let size = size_text(SIZE);
    let view = View::open(&server, &["builtin:spheres", "--size", &size, "--frames", "1000000"]);
    sleep(Duration::from_millis(500));
    view.closes_well();
}

#[test]
fn a_server_that_goes_away_is_an_error_and_no_panic() {
    let server = Server::start();
    let size = size_text(SIZE);
    let mut view = View::open(&server, &["builtin:spheres", "--size", &size, "--frames", "1000000"]);
    sleep(Duration::from_millis(500));
    view.assert_running();
    server.kill();
    let (code, _, errors) = view.ends();
    assert_eq!(code, Some(5), "{errors}");
    assert!(errors.contains("error: the window system failed"), "{errors}");
}

#[test]
fn without_a_display_it_says_so_and_names_render() {
    for display in [None, Some(":7654")] {
        let mut command = program();
        command.arg("view").env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.envs(display.map(|display| ("DISPLAY", display)));
        let output = command.output().expect("the program starts");
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(5), "{errors}");
        assert!(
            errors.starts_with("error: no window can be opened here: ") && errors.contains("`afterlight render`"),
            "{errors}"
        );
        assert!(!errors.contains(".rs"), "{errors}");
    }
}

/// winit panics at such values, once it has found a monitor.
#[test]
fn a_scale_factor_that_is_none_is_refused_before_a_window_is_opened() {
    let refused = |factor: &str| {
        let mut command = program();
        command.arg("view").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        // No server has this number: a factor that passes the check ends for lack of a server.
        command.env("DISPLAY", ":7654").env("WINIT_X11_SCALE_FACTOR", factor);
        let output = command.output().expect("the program starts");
        let errors = text(&output.stderr);
        assert!(errors.starts_with("error: ") && !errors.contains("panic"), "{factor}: {errors}");
        match output.status.code() {
            Some(2) => assert!(errors.contains(&format!("WINIT_X11_SCALE_FACTOR={factor}: must be ")), "{errors}"),
            code => assert_eq!(code, Some(5), "{factor}: {errors}"),
        }
        output.status.code() == Some(2)
    };
    assert!(["x", "0", "-1", "-0.0", "inf", "nan", "1e-320", "1,5", " 2"].into_iter().all(refused));
    assert!(!["", "1", "1.5", "2e0", "randr", "RandR"].into_iter().any(refused));
}
