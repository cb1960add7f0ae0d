//! Messages and signs over the picture, and pictures that lie ready under them.

use std::thread::sleep;
use std::time::{Duration, Instant};

use super::harness::{MOTION, Server, View, key, rendered, rgb, size_text, until};

const LARGE: [u16; 2] = [480, 300];

/// The rows of pixels that differ, from the first to the last.
fn rows(own: &[u8], other: &[u8]) -> Option<(usize, usize)> {
    let line = 3 * usize::from(LARGE[0]);
    let differ = own.chunks(line).zip(other.chunks(line)).enumerate().filter(|(_, (own, other))| own != other);
    let rows: Vec<usize> = differ.map(|(row, _)| row).collect();
    Some((*rows.first()?, *rows.last()?))
}

#[test]
fn a_message_lies_over_the_picture_for_some_seconds_and_is_not_in_a_screenshot() {
    let server = Server::start();
    let scene = "builtin:spheres";
    let expected = rendered(LARGE, &[scene]);
    let mut view = View::open(&server, &[scene, "--size", &size_text(LARGE), "--messages", "on"]);
    view.shows(&expected, "as it was opened");
    for (number, what) in [(1, "the first"), (2, "one with a message over it")] {
        server.tap(key::P);
        view.waits_to_tell(&format!("afterlight-000{number}.png"));
        let kept = rgb(&view.folder.path().join(format!("afterlight-000{number}.png")));
        assert!(kept == expected, "{what}: the screenshot is another picture");
        let told = view.settles_elsewhere(&expected);
        let (first, last) = rows(&told, &expected).expect("something is told");
        assert!(first > 220 && last < 299, "{what}: rows {first} to {last}");
    }
    let begun = Instant::now();
    view.shows(&expected, "when the message has gone");
    assert!(begun.elapsed() > Duration::from_secs(2), "it was gone after {:?}", begun.elapsed());
    // A warning is shown as well: nothing is kept there.
    server.tap(key::DIGIT_1);
    view.waits_to_tell("no camera is kept as 1");
    view.settles_elsewhere(&expected);
    view.closes_well();
}

/// Each move of the mouse over open panels makes a redraw, and so does each step of a widget's animation. These redraws do not draw the scene.
#[test]
fn the_picture_under_panels_is_not_drawn_again() {
    for resolution in ["on", "off"] {
        under_panels(resolution);
    }
}

fn under_panels(resolution: &str) {
    let server = Server::start();
    let mut view = View::start(
        &server,
        &["builtin:hall", "--size", &size_text(LARGE), "--light-path", "loop", "--dynamic-resolution", resolution],
    );
    view.rests();
    let first = view.pixels();
    let nearer = view.goes_nearer(&first, Duration::from_millis(100));
    view.keeps_camera_1();
    let cost = |view: &mut View, act: &dyn Fn(i16)| {
        let before = view.cpu_seconds();
        for step in 0..6 {
            act(step);
            view.rests();
        }
        view.cpu_seconds() - before
    };
    // The camera jumps: a frame each.
    let of_frames = cost(&mut view, &|step| server.tap(if step % 2 == 0 { key::R } else { key::DIGIT_1 }));
    assert!(view.pixels() == nearer, "at the camera that was kept");
    server.tap(key::G);
    view.settles_elsewhere(&nearer);
    let of_panels = cost(&mut view, &|step| server.fake(MOTION, 0, [60 + 20 * step, 100 + 20 * step]));
    assert!(of_panels < 0.7 * of_frames, "{resolution}: {of_panels} s under panels, {of_frames} s for as many frames");
    server.tap(key::G);
    view.shows(&nearer, "with the panels closed");
    view.closes_well();
}

/// A frame that takes long is announced, and the sign goes with it.
#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_frame_that_takes_long_is_announced_over_the_picture_before() {
    let server = Server::start();
    // Many samples a pixel make a frame of a second out of few pixels.
    let scene = ["builtin:hall?lights=64", "--light-path", "loop", "--msaa", "4"];
    let size = size_text(LARGE);
    let mut view = View::start(
        &server,
        &[&scene[..], &["--size", &size, "--messages", "on", "--dynamic-resolution", "on"]].concat(),
    );
    view.rests();
    server.press(key::W);
    sleep(Duration::from_millis(300));
    server.release(key::W);
    // Light blue letters at the lower edge, where the hall's floor is.
    let sign = |pixels: &[u8]| {
        let is_of_it = |&&[r, g, b]: &&[u8; 3]| b > 150 && b > r.saturating_add(20) && g > r;
        pixels.as_chunks::<3>().0.iter().filter(is_of_it).count() > 20
    };
    assert!(!sign(&view.part([100, 260], [280, 40])), "the floor is no sign");
    until("a sign", || sign(&view.part([100, 260], [280, 40])).then_some(()));
    view.rests();
    assert!(!sign(&view.part([100, 260], [280, 40])), "the sign stays");
    view.closes_well();
}
