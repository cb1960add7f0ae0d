//! Windows on a display that shows more than white (HDR10): the codes encode the light, as computed here in f64 from the standards.

use afterlight::passes::curves::{encode_srgb, tone_map, tone_map_up_to};
use afterlight::scene::Tonemap;
use glam::{DVec3, Vec3};

use super::deep::{EV100, MOST, Within, codes_of_light, shown, shows, sides, split, srgb_codes};
use super::harness::{SIZE, Server, View, key, rendered, rgb, size_text, until};
use super::hdr_display::HdrDisplay;
use crate::common::hdr::{perceptual_quantizer, to_rec2020};

/// The brightness of the display in nits, and the option that says it.
const NITS: f32 = 1000.0;
const HDR: &str = "--hdr=1000";
/// The brightness of white in nits: reference white of ITU-R BT.2408.
const WHITE_NITS: f32 = 203.0;
const PATHS: [&str; 2] = ["loop", "compute"];
/// Each pass that tone-maps: LIGHTING, a compute pass, FORWARD, and TONEMAP after blending; and an EV100 at which a part is brighter than white.
const WAYS: [([&str; 3], &str); 4] = [
    (["builtin:spheres", "--light-path", "loop"], EV100),
    (["builtin:spheres", "--light-path", "compute"], EV100),
    (["builtin:spheres", "--light-path", "forward"], EV100),
    (["builtin:layers", "--light-path", "auto"], "4"),
];
const CURVES: [Tonemap; 4] = [Tonemap::None, Tonemap::Neutral, Tonemap::Aces, Tonemap::Agx];

/// Half a code is rounded away; ITU-R BT.2087's primaries have four digits, which is up to 0.4 of a code of a pure blue; light has come through
/// half floats, 2^-11 of it, which is 0.1.
const AS_10_BITS: Within = Within(1.0, 0.0);

/// The code, 0 to 1023, of a brightness in nits.
fn pq_code(nits: f64) -> f64 {
    perceptual_quantizer(nits) * MOST
}

/// The codes of a colour, where 1 is white.
fn hdr_codes(shown: DVec3) -> [f64; 3] {
    (to_rec2020() * shown.max(DVec3::ZERO) * f64::from(WHITE_NITS)).to_array().map(pq_code)
}

/// The linear value of a code of 8 bits, or between two (IEC 61966-2-1).
fn decode_srgb(code: f64) -> f64 {
    let value = code.clamp(0.0, 255.0) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn mapped(light: Vec3, curve: Tonemap) -> Vec3 {
    tone_map_up_to(NITS / WHITE_NITS, light, curve)
}

fn arguments(path: &str) -> [&str; 3] {
    ["builtin:spheres", "--light-path", path]
}

/// A window, exposed so that a part of the picture is brighter than white.
fn open<'a>(server: &'a Server, way: &[&str], more: &[&str]) -> View<'a> {
    open_exposed(server, (way, EV100), more)
}

fn open_exposed<'a>(server: &'a Server, (way, ev100): (&[&str], &str), more: &[&str]) -> View<'a> {
    let size = size_text(SIZE);
    View::open(server, &[way, &["--exposure", ev100, "--size", &size], more].concat())
}

#[test]
fn codes_are_those_of_the_light_up_to_what_the_display_shows() {
    if !shows() {
        return;
    }
    let display = HdrDisplay::start();
    let [white, brightest] = [f64::from(WHITE_NITS), f64::from(NITS)].map(pq_code);
    for ((way, ev100), curve) in WAYS.into_iter().flat_map(|way| CURVES.map(|curve| (way, curve))) {
        let what = format!("{way:?}, {curve}");
        let codes = |light: Vec3| hdr_codes(mapped(light, curve).as_dvec3());
        let expected = codes_of_light(&way, ev100, codes);
        let mut view = open_exposed(&display.server, (&way, ev100), &[HDR, "--tonemap", &curve.to_string()]);
        let codes = shown(&mut view, &expected, AS_10_BITS, &what);
        let beyond = codes.iter().filter(|&&code| f64::from(code) > white + 1.0).count() as f64 / codes.len() as f64;
        assert!((0.005..0.5).contains(&beyond), "{what}: {beyond} of the codes are brighter than white");
        let most = codes.iter().max().copied().unwrap_or_default();
        assert!(f64::from(most) <= brightest + 1.0, "{what}: a code of {most}");
        view.closes_well();
    }
}

#[test]
fn who_does_not_ask_for_more_than_white_is_shown_none() {
    if !shows() {
        return;
    }
    let display = HdrDisplay::start();
    for path in PATHS {
        let expected = codes_of_light(&arguments(path), EV100, |light| srgb_codes(tone_map(light, Tonemap::default())));
        let mut view = open(&display.server, &arguments(path), &[]);
        shown(&mut view, &expected, Within(1.0, 0.0), path);
        view.closes_well();
    }
}

#[test]
fn a_display_that_shows_no_more_than_white_is_told_of_and_shows_what_it_always_does() {
    let server = Server::start();
    for path in PATHS {
        let expected = rendered(SIZE, &[&arguments(path)[..], &["--exposure", EV100]].concat());
        let mut view = open(&server, &arguments(path), &[HDR]);
        view.waits_to_tell("warning: this window has no --hdr");
        view.shows(&expected, path);
        view.closes_well();
    }
}

#[test]
fn a_screenshot_is_the_picture_up_to_white_and_panels_leave_no_trace() {
    if !shows() {
        return;
    }
    let display = HdrDisplay::start();
    let server = &display.server;
    for path in PATHS {
        let mut view = open(server, &arguments(path), &[HDR]);
        view.rests();
        let alone = view.codes_of_10_bits();
        let up_to_white = |light: Vec3| {
            let shown = mapped(light, Tonemap::default()).min(Vec3::ONE);
            shown.to_array().map(|value| encode_srgb(value.into()) * 255.0)
        };
        let expected = codes_of_light(&arguments(path), EV100, up_to_white);
        server.tap(key::P);
        view.waits_to_tell("screenshot: ");
        let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
        assert_eq!(kept.len(), expected.len(), "{path}");
        assert!(kept.iter().filter(|&&code| code == 255).count() > kept.len() / 100, "{path}: nothing is white");
        let far = kept.iter().zip(&expected).map(|(&code, expected)| (f64::from(code) - expected).abs());
        Within(1.0, 0.0).check(far, &format!("{path}: a screenshot"));

        server.tap(key::G);
        until("panels", || (view.codes_of_10_bits() != alone).then_some(()));
        server.tap(key::G);
        view.rests();
        assert!(view.codes_of_10_bits() == alone, "{path}: when the panels are closed");
        view.closes_well();
    }
}

#[test]
fn a_split_window_shows_each_view_as_it_is_alone_and_views_up_to_white() {
    if !shows() {
        return;
    }
    let display = HdrDisplay::start();
    for path in PATHS {
        let mut view = open(&display.server, &arguments(path), &[HDR]);
        view.rests();
        let alone = view.codes_of_10_bits();
        let (beside, split) = split(&mut view, &display.server);
        view.closes_well();
        let (left, right) = sides();
        assert!(left.iter().all(|&index| split[index] == alone[index]), "{path}: left of the divider");

        let of_8_bits = rendered(SIZE, &[&arguments(path)[..], &["--view", &beside]].concat());
        // Half a code of 8 bits is rounded away, and hardware may encode by a code off: where it lies, with half a code of 10 bits around.
        let between = |by: f64| {
            let color = |rgb: &[u8; 3]| hdr_codes(DVec3::from(rgb.map(|code| decode_srgb(f64::from(code) + by))));
            of_8_bits.as_chunks::<3>().0.iter().flat_map(color).collect::<Vec<_>>()
        };
        let (least, most) = (between(-1.5), between(1.5));
        let far = right.into_iter().map(|index| {
            let code = f64::from(split[index]);
            (least[index] - code).max(code - most[index]).max(0.0)
        });
        AS_10_BITS.check(far, &format!("{path}: {beside}"));
    }
}
