//! From a motion of the mouse to the first picture on the screen that shows it, in a real window on an X server of its own (Xvfb): in
//! milliseconds, and in frames, by the same window's time from one to the next.
//!
//! The times in which the X server hands the motion on and is asked for its pixels are in it; a display's time to light up is not. A window
//! that draws without a pause has a frame under way when the mouse moves, and the next one may be recorded; one that stands still has none.
//!
//! `cargo bench --bench input_to_photon -- [SCENE] [--size WxH] [--trials N]`

/// Modules that the harness shares with the tests.
#[path = "../tests/common"]
mod common {
    pub mod program;
}
#[path = "../tests/window/view/harness.rs"]
#[allow(dead_code)]
mod harness;

use std::thread::sleep;
use std::time::{Duration, Instant};

use afterlight_truth::measure::Distribution;
use harness::{BUTTON_PRESS, BUTTON_RELEASE, MOTION, Server, View, key};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Milliseconds that a picture stands still before the mouse moves: another number each time, so that motions come at any moment of a frame.
const REST: std::ops::Range<u64> = 400..700;
/// The part of the window that is looked at.
const PART: [u16; 2] = [64, 64];

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let option = |name: &str| Some(given.get(given.iter().position(|word| word == name)? + 1)?.clone());
    let named = given.first().filter(|word| !word.starts_with("--")).cloned();
    let scene = named.unwrap_or_else(|| "builtin:spheres".into());
    let size = option("--size").unwrap_or_else(|| "1280x720".into());
    let trials: usize = option("--trials").map_or(Ok(20), |text| text.parse())?;
    println!("{scene}, {size}, {trials} motions each; medians, and from the 5th to the 95th percentile");
    println!("{:>28} {:>10} {:>16} {:>8} {:>12}", "window", "ms", "p5..p95", "frames", "ms a frame");
    let frame_ms = frame_ms(&scene, &size)?;
    for (name, mode) in [("draws without a pause", &["--frames", "1000000"][..]), ("stands still", &[])] {
        let server = Server::start();
        let arguments = [&[scene.as_str(), "--size", &size, "--vsync", "off"], mode].concat();
        let latencies = latencies(&server, &arguments, trials);
        let all = Distribution::of(latencies).ok_or("no trial")?;
        let spread = format!("{:.1}..{:.1}", all.p5, all.p95);
        println!("{name:>28} {:>10.1} {spread:>16} {:>8.2} {frame_ms:>12.1}", all.median, all.median / frame_ms);
    }
    Ok(())
}

/// From one frame to the next, as the program tells it.
fn frame_ms(scene: &str, size: &str) -> Result<f64> {
    let server = Server::start();
    let view = View::start(&server, &[scene, "--size", size, "--vsync", "off", "--frames", "60"]);
    let (_, output, errors) = view.ends();
    let line = output.lines().find(|line| line.contains("from frame to frame")).ok_or(errors)?;
    let number = line.split_whitespace().find_map(|word| word.parse().ok());
    Ok(number.ok_or_else(|| format!("no time in `{line}`"))?)
}

/// Milliseconds of each motion.
fn latencies(server: &Server, arguments: &[&str], trials: usize) -> Vec<f64> {
    let view = View::start(server, arguments);
    server.fake(MOTION, 0, [300, 300]);
    server.fake(BUTTON_PRESS, 1, [0; 2]);
    // The first motion of a drag only tells where it begins.
    server.fake(MOTION, 0, [301, 300]);
    let mut random = fastrand::Rng::with_seed(3);
    let mut to_the_right = true;
    let measured = (0..trials).map(|_| {
        let before = rest(&view, random.u64(REST));
        to_the_right = !to_the_right;
        let begun = Instant::now();
        server.fake(MOTION, 0, [if to_the_right { 301 } else { 340 }, 300]);
        while middle(&view) == before {
            assert!(begun.elapsed() < harness::PATIENCE, "nothing moves: {}", view.errors());
        }
        begun.elapsed().as_secs_f64() * 1e3
    });
    let measured = measured.collect();
    server.fake(BUTTON_RELEASE, 1, [0; 2]);
    server.tap(key::ESCAPE);
    measured
}

/// Waits until the picture has been the same for so many milliseconds.
fn rest(view: &View, milliseconds: u64) -> Vec<u8> {
    let (mut last, mut since) = (middle(view), Instant::now());
    while since.elapsed() < Duration::from_millis(milliseconds) {
        sleep(Duration::from_millis(5));
        let next = middle(view);
        if next != last {
            (last, since) = (next, Instant::now());
        }
    }
    last
}

fn middle(view: &View) -> Vec<u8> {
    let corner = view.size().map(|edge| (edge / 2) as i16);
    view.part(corner, PART)
}
