//! A split window: each side is bit by bit the same as its view alone, whatever draws the one and the other.

use std::thread::sleep;
use std::time::Duration;

use x11rb::protocol::xfixes::ConnectionExt as _;
use x11rb::protocol::xproto::ConnectionExt as _;

use super::harness::{
    BUTTON_PRESS, BUTTON_RELEASE, FXAA_BOX, MOTION, SIZE, Server, View, key, rendered, rgb, size_text,
};
use crate::common::some_of;

/// Arguments of the window, and true where the picture is a buffer and the other side is lit.
const WAYS: &[(&[&str], bool)] = &[
    (&["builtin:spheres", "--light-path", "forward"], false),
    (&["builtin:layers"], false),
    (&["builtin:hall", "--light-path", "loop"], false),
    (&["builtin:spheres", "--msaa", "4"], false),
    (&["builtin:spheres", "--fxaa", "on"], false),
    // Here the one side is encoded by the hardware and the other by a shader.
    (&["builtin:spheres", "--light-path", "compute"], false),
    (&["builtin:spheres", "--light-path", "compute"], true),
];

/// A window with how many screenshots were taken of it.
struct Shots<'a> {
    view: View<'a>,
    taken: usize,
}

impl Shots<'_> {
    fn take(&mut self, server: &Server) -> Vec<u8> {
        self.taken += 1;
        server.tap(key::P);
        let name = format!("afterlight-{:04}.png", self.taken);
        self.view.waits_to_tell(&name);
        rgb(&self.view.folder.path().join(name))
    }
}

fn with_shift(server: &Server, key: u8) {
    server.press(key::SHIFT);
    server.tap(key);
    server.release(key::SHIFT);
}

/// The left picture up to a column, and the right one from there on.
fn joined(left: &[u8], right: &[u8], width: usize, column: usize) -> Vec<u8> {
    assert_eq!(left.len(), right.len());
    let pixel = |index: usize| if index % width < column { left } else { right };
    (0..left.len()).map(|byte| pixel(byte / 3)[byte]).collect()
}

/// The views that it has last told of.
fn told(view: &View) -> [String; 2] {
    let errors = view.errors();
    let line = errors.lines().rev().find_map(|line| line.strip_prefix("split: ")).expect("it tells of the split");
    let (left, right) = line.split_once(" | ").unwrap_or_else(|| panic!("no two views: {line}"));
    [left.to_owned(), right.to_owned()]
}

fn drag(server: &Server, view: &mut View, from: [i16; 2], to: [i16; 2]) {
    server.fake(MOTION, 0, from);
    // A panel reads its events once a frame.
    view.rests();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    view.rests();
    server.fake(MOTION, 0, [(from[0] + to[0]) / 2, to[1]]);
    server.fake(MOTION, 0, to);
    view.rests();
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    view.rests();
}

/// Three tests, so that they run side by side.
#[test]
fn each_side_of_the_divider_is_bit_by_bit_what_its_view_shows_alone() {
    sides_show_their_views(0);
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn each_side_of_the_divider_shows_its_view_with_several_samples() {
    sides_show_their_views(1);
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn each_side_of_the_divider_shows_its_view_where_compute_draws_the_other() {
    sides_show_their_views(2);
}

fn sides_show_their_views(third: usize) {
    let server = Server::start();
    for &(arguments, buffer_first) in some_of(&WAYS[3 * third..(3 * third + 3).min(WAYS.len())], 3) {
        let what = format!("{arguments:?}, {buffer_first}");
        let size = size_text(SIZE);
        let mut shots =
            Shots { view: View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat()), taken: 0 };
        shots.view.shows(&rendered(SIZE, arguments), &what);
        if buffer_first {
            with_shift(&server, key::V);
            shots.view.waits_to_tell("view: ");
        }
        server.tap(key::X);
        shots.view.waits_to_tell(" | ");
        let views = told(&shots.view);
        assert_eq!(views[usize::from(buffer_first)], "final", "{what}: {views:?}");
        let of = |size, name: &str| rendered(size, &[arguments, &["--view", name]].concat());
        let [left, right] = [of(SIZE, &views[0]), of(SIZE, &views[1])];
        assert!(left != right, "{what}: {views:?} look the same");
        let width = usize::from(SIZE[0]);
        let shown = shots.take(&server);
        assert!(shown == joined(&left, &right, width, width / 2), "{what}: split in the middle");

        drag(&server, &mut shots.view, [80, 50], [40, 60]);
        assert!(shots.take(&server) == joined(&left, &right, width, 40), "{what}: the divider was dragged");
        // Besides the divider, and below the names, the window shows the same.
        let (window, expected) = (shots.view.pixels(), joined(&left, &right, width, 40));
        let differs = (width * 40..window.len() / 3).find(|index| {
            let beside = (index % width).abs_diff(40) > 3;
            beside && window[3 * index..3 * index + 3] != expected[3 * index..3 * index + 3]
        });
        assert_eq!(differs.map(|index| [index % width, index / width]), None, "{what}: in the window itself");

        let last = [200u16, 120];
        shots.view.resize(last.map(u32::from));
        shots.view.rests();
        let [left, right] = [of(last, &views[0]), of(last, &views[1])];
        assert!(shots.take(&server) == joined(&left, &right, 200, 50), "{what}: of another size");

        server.tap(key::X);
        shots.view.waits_to_tell("split: none");
        shots.view.shows(&left, &format!("{what}: the split is closed"));
        shots.view.close();
        shots.view.ends_well();
    }
}

/// A number that is another one for another shape of the mouse.
fn shape_of_the_mouse(server: &Server) -> u32 {
    let connection = &server.connection;
    connection.xfixes_query_version(5, 0).expect("sent").reply().expect("the server has XFIXES");
    connection.xfixes_get_cursor_image().expect("sent").reply().expect("there is a mouse").cursor_serial
}

#[test]
fn the_divider_shows_where_it_can_be_held_and_a_double_click_ends_the_split() {
    let server = Server::start();
    let (scene, size) = ("builtin:spheres", size_text(SIZE));
    let mut view = View::open(&server, &[scene, "--size", &size]);
    let whole = rendered(SIZE, &[scene]);
    view.shows(&whole, "as it was opened");
    server.fake(MOTION, 0, [20, 60]);
    server.tap(key::X);
    view.waits_to_tell("split: final | position");
    let split = view.settles_elsewhere(&whole);
    // Away from the divider.
    let arrow = shape_of_the_mouse(&server);
    server.fake(MOTION, 0, [83, 60]);
    let over = super::harness::until("another mouse over the divider", || {
        Some(shape_of_the_mouse(&server)).filter(|&shape| shape != arrow)
    });

    // Beside the divider the mouse turns the camera, on it it does not.
    drag(&server, &mut view, [82, 60], [82, 30]);
    let shown = view.pixels();
    let rows = shown.chunks_exact(3 * usize::from(SIZE[0])).zip(split.chunks_exact(3 * usize::from(SIZE[0])));
    // The words and the divider are in the middle.
    let stays = rows.into_iter().all(|(own, other)| own[..60] == other[..60]);
    assert!(stays, "the camera stays while the divider is held");
    server.tap(key::R);

    // Shift and X show the next view, and go around; they never show the picture's own view.
    with_shift(&server, key::X);
    view.waits_to_tell("split: final | normal\n");
    for _ in 0..2 {
        server.fake(BUTTON_PRESS, 1, [0; 2]);
        server.fake(BUTTON_RELEASE, 1, [0; 2]);
    }
    view.waits_to_tell("split: none");
    view.shows(&whole, "when the split is ended");
    super::harness::until("the arrow again", || (shape_of_the_mouse(&server) != over).then_some(()));
    server.tap(key::X);
    view.waits_to_tell("split: final | position");
    // A window that nobody sees, and comes back, is still split.
    let split = view.settles_elsewhere(&whole);
    server.connection.unmap_window(view.window).expect("sent").check().expect("a window");
    sleep(Duration::from_millis(200));
    server.connection.map_window(view.window).expect("sent").check().expect("a window");
    view.shows(&split, "when it is back");
    view.closes_well();
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn what_is_changed_on_a_panel_is_so_on_both_sides_and_what_only_one_can_do_ends_the_split() {
    let server = Server::start();
    let (scene, tall) = ("builtin:spheres", [480u16, 680]);
    let size = size_text(tall);
    let fxaa = ["builtin:spheres", "--fxaa", "on"];
    let view = View::open(&server, &[scene, "--size", &size]);
    let mut shots = Shots { view, taken: 0 };
    shots.view.shows(&rendered(tall, &[scene]), "as it was opened");
    // The view "lighting".
    server.tap(key::X);
    shots.view.waits_to_tell("split: final | position");
    while !shots.view.errors().contains("split: final | lighting") {
        let told_before = shots.view.errors().len();
        with_shift(&server, key::X);
        super::harness::until("the next view", || (shots.view.errors().len() > told_before).then_some(()));
    }
    server.tap(key::G);
    shots.view.rests();
    // Exposure, on its slider; then the box before "FXAA".
    drag(&server, &mut shots.view, EXPOSURE, [EXPOSURE[0] - 12, EXPOSURE[1]]);
    let exposed = shots.take(&server);
    let alone = [rendered(tall, &[scene]), rendered(tall, &[scene, "--view", "lighting"])];
    assert!(exposed != joined(&alone[0], &alone[1], 480, 240), "the exposure is as it was");
    server.tap(key::X);
    shots.view.waits_to_tell("split: none");
    let left = shots.take(&server);
    while !shots.view.errors().contains("view: lighting") {
        let told_before = shots.view.errors().len();
        server.tap(key::V);
        super::harness::until("the next view", || (shots.view.errors().len() > told_before).then_some(()));
    }
    let right = shots.take(&server);
    assert!(exposed == joined(&left, &right, 480, 240), "both sides have the exposure");
    shots.view.close();
    shots.view.ends_well();

    let view = View::open(&server, &[scene, "--size", &size]);
    let mut shots = Shots { view, taken: 0 };
    shots.view.shows(&rendered(tall, &[scene]), "as it was opened");
    server.tap(key::X);
    shots.view.waits_to_tell("split: final | position");
    server.tap(key::G);
    shots.view.rests();
    server.fake(MOTION, 0, FXAA_BOX);
    shots.view.rests();
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    shots.view.waits_to_tell("the window cannot be split so: anti-aliasing: FXAA would change");
    assert!(shots.take(&server) == rendered(tall, &fxaa), "the picture has FXAA");
    shots.view.close();
    shots.view.ends_well();
}

/// A place on the slider of the exposure, as the panel is laid out.
const EXPOSURE: [i16; 2] = [92, 188];
