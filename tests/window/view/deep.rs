//! Windows of 10 bits a channel, whose images no hardware encodes: on every way to the picture ENCODE shows it, with all that lies over it.

use afterlight::passes::curves::{encode_srgb, tone_map};
use afterlight::scene::{Tonemap, exposure_scale};
use glam::Vec3;

use super::WAYS;
use super::harness::{SIZE, Server, View, floats, key, render, rendered, rgb, size_text, text, until};
use crate::common::program::program;
use crate::common::some_of;

/// An exposure at which a part of the spheres is brighter than white, and most of them is not.
pub const EV100: &str = "6";

/// All codes of 10 bits are up to this.
pub const MOST: f64 = 1023.0;

/// Returns true if the driver brings pictures into windows of 10 bits. Mesa's software drivers once called every window's image one of depth 24 (`24`
/// in 22.3's `x11_present_to_x11_sw`, `chain->depth` later). The server refuses these images for a window of another depth, which stays black.
pub fn shows() -> bool {
    let told = program().arg("doctor").output().expect("the program starts").stdout;
    let told = text(&told);
    let driver = told.lines().find_map(|line| line.split("llvmpipe Mesa ").nth(1));
    let version = driver.and_then(|rest| rest.split('.').next()?.parse::<u32>().ok());
    let shows = version.is_none_or(|major| major >= 24);
    if !shows {
        let version = version.map_or_else(|| "of no known version".to_owned(), |version| version.to_string());
        println!("NOT RUN: Mesa {version} shows nothing in windows of 10 bits");
    }
    shows
}

/// Returns a code of 8 bits on the scale of 10-bit codes.
fn widened(code: u8) -> f64 {
    f64::from(code) / 255.0 * MOST
}

/// Half a code of 8 bits and half a one of 10 are rounded away, and hardware may encode by a code of 8 bits off.
const AS_8_BITS: f64 = 0.5 + 1.5 * MOST / 255.0;

/// The greatest distance of the window's codes from the expected ones, and the share of codes that may be farther off.
#[derive(Clone, Copy)]
pub struct Within(pub f64, pub f64);

impl Within {
    fn of(arguments: &[&str]) -> Self {
        // FXAA finds and follows edges by differences that rounding to 8 bits makes or hides.
        Self(AS_8_BITS, if arguments.contains(&"--fxaa") { 0.02 } else { 0.0 })
    }

    pub fn check(self, far: impl Iterator<Item = f64>, what: &str) {
        let far: Vec<f64> = far.collect();
        let beyond = far.iter().filter(|&&far| far > self.0).count() as f64 / far.len() as f64;
        let most = far.iter().copied().fold(0.0, f64::max);
        assert!(beyond <= self.1, "{what}: {beyond} of the codes are off by more than {}, up to {most}", self.0);
    }
}

/// Returns the codes that the window shows, which must be near the expected ones.
pub fn shown(view: &mut View, expected: &[f64], within: Within, what: &str) -> Vec<u16> {
    view.rests();
    let codes = view.codes_of_10_bits();
    assert_eq!(codes.len(), expected.len(), "{what}");
    within.check(codes.iter().zip(expected).map(|(&code, expected)| (f64::from(code) - expected).abs()), what);
    codes
}

/// Returns the codes that a window must show of the light that `render` draws, exposed.
pub fn codes_of_light(arguments: &[&str], ev100: &str, codes: impl Fn(Vec3) -> [f64; 3]) -> Vec<f64> {
    let scale = exposure_scale(ev100.parse().expect("a number"));
    let light = floats(&render(SIZE, arguments, "light.exr").path().join("light.exr"));
    light.as_chunks::<3>().0.iter().flat_map(|rgb| codes(Vec3::from(*rgb) * scale)).collect()
}

/// A tone-mapped colour where white is the brightest.
pub fn srgb_codes(shown: Vec3) -> [f64; 3] {
    shown.to_array().map(|value| encode_srgb(value.into()) * MOST)
}

/// Splits the window, and returns the name of the view beside the picture and the codes that the window shows.
pub fn split(view: &mut View, server: &Server) -> (String, Vec<u16>) {
    server.tap(key::X);
    view.waits_to_tell("split: final | ");
    view.rests();
    let told = view.errors();
    let beside = told.rsplit("split: final | ").next().and_then(|rest| rest.lines().next()).expect("a view");
    (beside.to_owned(), view.codes_of_10_bits())
}

/// Returns the indices of a split window's codes: of the picture, and of the view beside it.
pub fn sides() -> (Vec<usize>, Vec<usize>) {
    let (width, height) = (usize::from(SIZE[0]), usize::from(SIZE[1]));
    // Below the names of the views, and beside the divider.
    let codes = (3 * width * 40..3 * width * height).map(|index| (index, index / 3 % width));
    let (left, right): (Vec<_>, Vec<_>) =
        codes.filter(|(_, column)| column.abs_diff(width / 2) > 3).partition(|(_, column)| *column < width / 2);
    [left, right].map(|side| side.into_iter().map(|(index, _)| index).collect()).into()
}

#[test]
fn a_window_of_10_bits_shows_the_picture_on_every_way() {
    if !shows() {
        return;
    }
    let server = Server::of_depth(30);
    for arguments in WAYS {
        let (what, size) = (format!("{arguments:?}"), size_text(SIZE));
        let of_8_bits = rendered(SIZE, arguments);
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        let expected: Vec<f64> = of_8_bits.iter().map(|&code| widened(code)).collect();
        let codes = shown(&mut view, &expected, Within::of(arguments), &what);
        // Codes of 8 bits made longer would be one of 4.
        let between = codes.iter().zip(&of_8_bits).filter(|&(&code, &byte)| f64::from(code) != widened(byte).round());
        let between = between.count() as f64 / codes.len() as f64;
        assert!(between > 0.2, "{what}: {between} of the codes lie between those of 8 bits");

        server.tap(key::G);
        until("panels", || (view.codes_of_10_bits() != codes).then_some(()));
        server.tap(key::G);
        view.rests();
        assert!(view.codes_of_10_bits() == codes, "{what}: when the panels are closed");

        let last = [200u16, 120];
        view.resize(last.map(u32::from));
        let expected: Vec<f64> = rendered(last, arguments).into_iter().map(widened).collect();
        shown(&mut view, &expected, Within::of(arguments), &format!("{what} of another size"));
        view.closes_well();
    }
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn screenshots_of_a_window_of_10_bits_are_the_picture_in_8() {
    let server = Server::of_depth(30);
    for arguments in some_of(WAYS, 3) {
        let (what, size) = (format!("{arguments:?}"), size_text(SIZE));
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        server.tap(key::P);
        view.waits_to_tell("screenshot: ");
        let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
        let expected = rendered(SIZE, arguments);
        assert_eq!(kept.len(), expected.len(), "{what}");
        let far = kept.iter().zip(&expected).map(|(own, other)| f64::from(own.abs_diff(*other)));
        Within(1.0, Within::of(arguments).1).check(far, &what);
        view.closes_well();
    }
}

#[test]
fn ten_bits_are_those_of_the_light() {
    if !shows() {
        return;
    }
    let server = Server::of_depth(30);
    let size = size_text(SIZE);
    for arguments in [
        ["builtin:spheres", "--light-path", "loop"],
        ["builtin:spheres", "--light-path", "compute"],
        ["builtin:layers", "--light-path", "auto"],
    ] {
        let expected = codes_of_light(&arguments, EV100, |light| srgb_codes(tone_map(light, Tonemap::default())));
        let mut view = View::open(&server, &[&arguments[..], &["--exposure", EV100, "--size", &size]].concat());
        // Half a code is rounded away, and light has come through half floats: 2^-11 of it is a third of a code of white.
        shown(&mut view, &expected, Within(1.0, 0.0), &format!("{arguments:?}"));
        view.closes_well();
    }
}

#[test]
fn a_split_window_of_10_bits_shows_each_view_as_it_is_alone() {
    if !shows() {
        return;
    }
    let server = Server::of_depth(30);
    let size = size_text(SIZE);
    for path in ["loop", "compute"] {
        let arguments = ["builtin:spheres", "--light-path", path];
        let mut view = View::open(&server, &[&arguments[..], &["--size", &size]].concat());
        view.rests();
        let alone = view.codes_of_10_bits();
        let (beside, split) = split(&mut view, &server);
        let beside_alone = rendered(SIZE, &[&arguments[..], &["--view", &beside]].concat());
        let (left, right) = sides();
        assert!(left.iter().all(|&index| split[index] == alone[index]), "{path}: left of the divider");
        let far = right.into_iter().map(|index| (f64::from(split[index]) - widened(beside_alone[index])).abs());
        Within(AS_8_BITS, 0.0).check(far, &format!("{path}: {beside}"));
        view.closes_well();
    }
}
