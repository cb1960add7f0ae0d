//! Windows of 10 bits a channel, whose images no hardware encodes: on every way to the picture ENCODE shows it, with what lies over it.

use afterlight::passes::tonemap::{encode_srgb, tone_map};
use afterlight::scene::{Tonemap, exposure_scale};
use glam::Vec3;

use super::WAYS;
use super::harness::{SIZE, Server, View, floats, key, program, render, rendered, rgb, size_text, text, until};

const EV100: &str = "1";

/// Whether the driver brings pictures into such windows. Mesa's software drivers once called every window's image one of depth 24 (`24` in 22.3's
/// `x11_present_to_x11_sw`, `chain->depth` later), which the server refuses where that is not so: the window stays black.
fn shows() -> bool {
    let told = program().arg("doctor").output().expect("the program starts").stdout;
    let told = text(&told);
    let driver = told.lines().find_map(|line| line.split("llvmpipe Mesa ").nth(1));
    let version = driver.and_then(|rest| rest.split('.').next()?.parse::<u32>().ok());
    let shows = version.is_none_or(|major| major >= 24);
    if !shows {
        println!("NOT RUN: Mesa {version:?} shows nothing in windows of 10 bits");
    }
    shows
}

/// Where a code of 8 bits lies among those of 10.
fn widened(code: u8) -> f64 {
    f64::from(code) / 255.0 * 1023.0
}

/// Half a code of 8 bits and half a one of 10 are rounded away, and hardware may encode by a code of 8 bits off.
const AS_8_BITS: f64 = 0.5 + 1.5 * 1023.0 / 255.0;

/// How far the window may be from what is expected, and which share of its codes may be farther.
#[derive(Clone, Copy)]
struct Within(f64, f64);

impl Within {
    fn of(arguments: &[&str]) -> Self {
        // Where FXAA finds edges, and how they go, hangs on differences that rounding to 8 bits makes or hides.
        Self(AS_8_BITS, if arguments.contains(&"--fxaa") { 0.02 } else { 0.0 })
    }

    fn check(self, far: impl Iterator<Item = f64>, what: &str) {
        let far: Vec<f64> = far.collect();
        let beyond = far.iter().filter(|&&far| far > self.0).count() as f64 / far.len() as f64;
        let most = far.iter().copied().fold(0.0, f64::max);
        assert!(beyond <= self.1, "{what}: {beyond} of the codes are off by more than {}, up to {most}", self.0);
    }
}

/// What the window shows when that is near what is expected.
fn shown(view: &mut View, expected: &[f64], within: Within, what: &str) -> Vec<u16> {
    view.rests();
    let codes = view.codes_of_10_bits();
    assert_eq!(codes.len(), expected.len(), "{what}");
    within.check(codes.iter().zip(expected).map(|(&code, expected)| (f64::from(code) - expected).abs()), what);
    codes
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
        // Not 8 bits made longer: of 4 codes those are one.
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
        view.close();
        view.ends_well();
    }
}

#[test]
fn screenshots_of_a_window_of_10_bits_are_the_picture_in_8() {
    let server = Server::of_depth(30);
    for arguments in WAYS {
        let (what, size) = (format!("{arguments:?}"), size_text(SIZE));
        let mut view = View::open(&server, &[arguments, &["--size", size.as_str()][..]].concat());
        server.tap(key::P);
        view.waits_to_tell("screenshot: ");
        let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
        let expected = rendered(SIZE, arguments);
        assert_eq!(kept.len(), expected.len(), "{what}");
        let far = kept.iter().zip(&expected).map(|(own, other)| f64::from(own.abs_diff(*other)));
        Within(1.0, Within::of(arguments).1).check(far, &what);
        view.close();
        view.ends_well();
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
        let scale = exposure_scale(EV100.parse().expect("a number"));
        let light = floats(&render(SIZE, &arguments, "light.exr").path().join("light.exr"));
        let seen = |rgb: &[f32; 3]| tone_map(Vec3::from(*rgb) * scale, Tonemap::default()).to_array();
        let expected = light.as_chunks::<3>().0.iter().flat_map(seen);
        let expected: Vec<f64> = expected.map(|value| encode_srgb(f64::from(value)) * 1023.0).collect();
        let mut view = View::open(&server, &[&arguments[..], &["--exposure", EV100, "--size", &size]].concat());
        // Half a code is rounded away, and light has come through half floats: 2^-11 of it is a third of a code of white.
        shown(&mut view, &expected, Within(1.0, 0.0), &format!("{arguments:?}"));
        view.close();
        view.ends_well();
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
        server.tap(key::X);
        view.waits_to_tell("split: final | ");
        view.rests();
        let (split, told) = (view.codes_of_10_bits(), view.errors());
        let beside = told.rsplit("split: final | ").next().and_then(|rest| rest.lines().next()).expect("a view");
        let beside_alone = rendered(SIZE, &[&arguments[..], &["--view", beside]].concat());
        let width = usize::from(SIZE[0]);
        // Below the names of the views, and beside the divider.
        let columns = (width * 40..split.len() / 3).map(|index| (index, index % width));
        let (left, right): (Vec<_>, Vec<_>) =
            columns.filter(|(_, column)| column.abs_diff(width / 2) > 3).partition(|(_, column)| *column < width / 2);
        let of = |index: usize| 3 * index..3 * index + 3;
        assert!(left.iter().all(|&(index, _)| split[of(index)] == alone[of(index)]), "{path}: left of the divider");
        let far = right.iter().flat_map(|&(index, _)| of(index));
        let far = far.map(|index| (f64::from(split[index]) - widened(beside_alone[index])).abs());
        Within(AS_8_BITS, 0.0).check(far, &format!("{path}: {beside}"));
        view.close();
        view.ends_well();
    }
}
