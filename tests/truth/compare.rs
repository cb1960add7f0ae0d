//! `afterlight compare` from outside: figures that are known, limits that break, pictures of the difference, and refusals.

use std::path::Path;
use std::process::Output;

use crate::common::program::program;

use image::{Rgb, Rgb32FImage, RgbImage};
use serde_json::Value;
use tempfile::TempDir;

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    let mut command = program();
    command.current_dir(folder.path()).arg("compare").args(arguments).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn succeed(folder: &TempDir, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// The one line of error, of a run that ends with this code.
fn fail(folder: &TempDir, arguments: &[&str], code: i32) -> String {
    let output = run(folder, arguments);
    let errors = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
    let lines: Vec<&str> = errors.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(lines.len(), 1, "{arguments:?}: {errors}");
    lines[0].to_owned()
}

fn json(folder: &TempDir, arguments: &[&str]) -> Value {
    let printed = succeed(folder, &[arguments, &["--json"]].concat());
    serde_json::from_str(&printed).unwrap_or_else(|error| panic!("{error}: {printed}"))
}

fn close(value: &Value, expected: f64) {
    let found = value.as_f64().unwrap_or_else(|| panic!("{value} is no number"));
    assert!((found - expected).abs() <= 1e-5 * expected.abs(), "{found} instead of {expected}");
}

const SIZE: (u32, u32) = (32, 16);

fn save_shown(folder: &Path, name: &str, pixel: impl Fn(u32, u32) -> [u8; 3]) {
    RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| Rgb(pixel(x, y))).save(folder.join(name)).expect("it is written");
}

fn save_light(folder: &Path, name: &str, pixel: impl Fn(u32, u32) -> [f32; 3]) {
    Rgb32FImage::from_fn(SIZE.0, SIZE.1, |x, y| Rgb(pixel(x, y))).save(folder.join(name)).expect("it is written");
}

/// A grey picture and one with a red pixel; the same light in nits, and one that is a tenth too bright in its left half.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path();
    save_shown(path, "grey.png", |_, _| [100; 3]);
    save_shown(path, "spot.png", |x, y| if (x, y) == (20, 8) { [255, 100, 100] } else { [100; 3] });
    save_light(path, "even.exr", |_, _| [50.0; 3]);
    save_light(path, "bright.exr", |x, _| if x < SIZE.0 / 2 { [55.0; 3] } else { [50.0; 3] });
    save_light(path, "broken.exr", |x, y| if (x, y) == (3, 3) { [f32::NAN, 1.0, 1.0] } else { [50.0; 3] });
    folder
}

#[test]
fn pictures_as_shown_have_the_figures_that_can_be_worked_out() {
    let folder = folder();
    let report = json(&folder, &["spot.png", "grey.png"]);
    let pixels = f64::from(SIZE.0 * SIZE.1);
    let rmse = (155.0 / 255.0) / (3.0 * pixels).sqrt();
    close(&report["shown"]["rmse"], rmse);
    close(&report["shown"]["max"], 155.0 / 255.0);
    close(&report["psnr_db"], -20.0 * rmse.log10());
    assert_eq!((&report["differing_pixels"], &report["not_finite"]), (&1.into(), &0.into()));
    assert!(report["light"].is_null() && report["exposure_ev100"].is_null() && report["shown"]["rel_mse"].is_null());
    assert_eq!(report["flip"].is_number(), cfg!(feature = "report"));
    let equal = json(&folder, &["grey.png", "grey.png"]);
    assert!(equal["psnr_db"].is_null());
    assert_eq!((&equal["shown"]["rmse"], &equal["differing_pixels"]), (&0.0.into(), &0.into()));
    let table = succeed(&folder, &["spot.png", "grey.png"]);
    for word in ["mean FLIP", "PSNR", "99.9th percentile", "differing", "not finite"] {
        assert!(table.contains(word), "{table}");
    }
    assert_eq!(table.contains("not built in"), cfg!(not(feature = "report")), "{table}");
}

#[test]
fn light_is_compared_exposed_and_its_unit_does_not_matter() {
    let folder = folder();
    let report = json(&folder, &["bright.exr", "even.exr"]);
    // The mean of 50 nits becomes 0.18; half of the channels are off by a tenth.
    let relative = 0.5 * 0.018f64.powi(2) / (0.18f64.powi(2) + 0.01);
    close(&report["light"]["rel_mse"], relative);
    close(&report["light"]["rmse"], 0.018 * 0.5f64.sqrt());
    close(&report["light"]["max"], 0.018);
    close(&report["exposure_ev100"], (50.0 / (1.2 * 0.18f64)).log2());
    assert_eq!((&report["tonemap"], &report["differing_pixels"]), (&"neutral".into(), &256.into()));
    save_light(folder.path(), "even-k.exr", |_, _| [0.05; 3]);
    save_light(folder.path(), "bright-k.exr", |x, _| if x < SIZE.0 / 2 { [0.055; 3] } else { [0.05; 3] });
    close(&json(&folder, &["bright-k.exr", "even-k.exr"])["light"]["rel_mse"], relative);
    // At EV100 0 a nit is 1/1.2.
    let exposed = json(&folder, &["bright.exr", "even.exr", "--exposure", "0", "--tonemap", "aces"]);
    close(&exposed["light"]["max"], 5.0 / 1.2);
    assert_eq!(exposed["tonemap"], "aces");
}

#[test]
fn light_and_a_shown_picture_are_compared_as_shown() {
    let folder = folder();
    // 0.5 of the sensor's saturation is the code 188.
    save_light(folder.path(), "half.exr", |_, _| [0.6; 3]);
    save_shown(folder.path(), "half.png", |_, _| [188; 3]);
    let arguments = ["half.exr", "half.png", "--exposure", "0", "--tonemap", "none"];
    let report = json(&folder, &arguments);
    assert_eq!((&report["differing_pixels"], &report["light"]), (&0.into(), &Value::Null));
    succeed(&folder, &["half.png", "half.exr", "--exposure", "0", "--tonemap", "none", "--max", "differing=0"]);
    assert!(fail(&folder, &["half.exr", "half.png"], 2).contains("--exposure"));
    assert!(fail(&folder, &[&arguments[..], &["--max", "relmse=1"]].concat(), 2).contains("relmse"));
}

#[test]
fn a_limit_that_breaks_ends_with_exit_code_1_and_is_named() {
    let folder = folder();
    let spot = |limits: &[&'static str]| {
        let limits: Vec<&str> = limits.iter().flat_map(|&limit| ["--max", limit]).collect();
        [&["spot.png", "grey.png"][..], &limits].concat()
    };
    succeed(&folder, &spot(&["rmse=0.02", "max=0.7", "psnr=30", "differing=1"]));
    let said = fail(&folder, &spot(&["rmse=0.02", "max=0.5", "psnr=60"]), 1);
    assert!(
        said.contains("max is 0.6078, above 0.5") && said.contains("psnr is") && said.contains("below 60"),
        "{said}"
    );
    assert!(!said.contains("rmse"), "{said}");
    let light = ["bright.exr", "even.exr", "--max"];
    succeed(&folder, &[&light[..], &["relmse=0.01"]].concat());
    assert!(fail(&folder, &[&light[..], &["relmse=0.001"]].concat(), 1).contains("relmse is"));
    assert!(fail(&folder, &[&light[..], &["p99.9=0.001"]].concat(), 1).contains("p99.9 is"));
    // The figures are printed all the same.
    assert!(text(&run(&folder, &spot(&["max=0"])).stdout).contains("PSNR"));
    // Equal pictures have an infinite PSNR, which is above any limit.
    succeed(&folder, &["grey.png", "grey.png", "--max", "psnr=1000", "--max", "rmse=0"]);
}

#[test]
#[cfg(feature = "report")]
fn flip_has_a_limit_too() {
    let folder = folder();
    succeed(&folder, &["spot.png", "grey.png", "--max", "flip=0.05"]);
    assert!(fail(&folder, &["spot.png", "grey.png", "--max", "flip=0.0001"], 1).contains("flip is"));
}

#[test]
fn a_pixel_that_is_not_finite_breaks_any_limit() {
    let folder = folder();
    let report = json(&folder, &["broken.exr", "even.exr"]);
    assert_eq!((&report["not_finite"], &report["expected_not_finite"]), (&1.into(), &0.into()));
    assert_eq!(report["light"]["max"], 0.0);
    let said = fail(&folder, &["broken.exr", "even.exr", "--max", "rmse=9"], 1);
    assert!(said.contains("1 pixel(s) are not finite"), "{said}");
    assert_eq!(json(&folder, &["even.exr", "broken.exr"])["expected_not_finite"], 1);
}

#[test]
fn the_picture_of_a_difference_shows_where_it_is() {
    let folder = folder();
    let open = |name: &str| image::open(folder.path().join(name)).expect("a picture").into_rgb8();
    succeed(&folder, &["spot.png", "grey.png", "-o", "signed.png", "--difference", "signed"]);
    let signed = open("signed.png");
    assert_eq!((signed.get_pixel(20, 8).0, signed.get_pixel(0, 0).0), ([255, 128, 128], [128; 3]));
    succeed(&folder, &["even.exr", "bright.exr", "-o", "signed.png", "--difference", "signed"]);
    let signed = open("signed.png");
    assert_eq!((signed.get_pixel(0, 0).0, signed.get_pixel(31, 0).0), ([1; 3], [128; 3]));
    succeed(&folder, &["spot.png", "grey.png", "-o", "difference.png"]);
    let shown = open("difference.png");
    let brightness = |x, y| shown.get_pixel(x, y).0.iter().map(|&code| u32::from(code)).sum::<u32>();
    assert!(brightness(20, 8) > brightness(0, 0) + 50, "{} {}", brightness(20, 8), brightness(0, 0));
    let output = run(&folder, &["spot.png", "grey.png", "-o", "-"]);
    assert!(image::load_from_memory(&output.stdout).is_ok() && text(&output.stderr).contains("PSNR"));
}

#[test]
fn what_cannot_be_compared_is_told() {
    let folder = folder();
    let path = folder.path();
    RgbImage::new(4, 4).save(path.join("small.png")).expect("it is written");
    image::ImageBuffer::<Rgb<u16>, _>::new(SIZE.0, SIZE.1).save(path.join("deep.png")).expect("it is written");
    std::fs::write(path.join("text.png"), "no picture at all").expect("it is written");
    let said = fail(&folder, &["grey.png", "small.png"], 3);
    assert!(said.contains("32x16") && said.contains("4x4") && said.contains("small.png"), "{said}");
    assert!(fail(&folder, &["grey.png", "deep.png"], 3).contains("deep.png"));
    assert!(fail(&folder, &["grey.png", "text.png"], 3).contains("text.png"));
    assert!(fail(&folder, &["grey.png", "absent.png"], 3).contains("absent.png"));
    assert!(fail(&folder, &["grey.png", "spot.png", "--exposure", "3"], 2).contains("--exposure"));
    assert!(fail(&folder, &["grey.png", "spot.png", "--max", "fip=1"], 2).contains("flip"));
    assert!(fail(&folder, &["grey.png", "spot.png", "-o", "a.exr"], 2).contains(".png"));
    assert!(fail(&folder, &["grey.png", "spot.png", "-o", "-", "--json"], 2).contains("standard output"));
    assert!(!path.join("a.exr").exists());
}
