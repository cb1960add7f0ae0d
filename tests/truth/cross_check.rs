//! Foundations of `tests/mitsuba/cross_check.py`: scenes that export, a standard error that is a picture, and refusals. `make cross-check` asks
//! Mitsuba itself.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::program::program;

fn reference(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = program();
    command.current_dir(folder).arg("reference").args(arguments).output().expect("the program starts")
}

/// The one line of error of a run that ends with this code.
fn refusal(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = reference(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{said}");
    said.lines().find(|line| line.starts_with("error: ")).unwrap_or_default().to_owned()
}

fn scene(name: &str) -> String {
    let path = PathBuf::from(env!("AFTERLIGHT_ROOT")).join("tests/mitsuba").join(name);
    path.to_string_lossy().into_owned()
}

#[test]
fn the_scenes_of_the_cross_check_export_whole() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, lights, objects) in [("lambert", 1, 4), ("ggx", 1, 8), ("lights", 3, 8)] {
        let output = reference(folder.path(), &[&scene(&format!("{name}.toml")), "--export", name]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let place = folder.path().join(name);
        let text = fs::read_to_string(place.join("scene.xml")).expect("it was written");
        let document = roxmltree::Document::parse(&text).expect("it is XML");
        let count = |tag: &str| document.descendants().filter(|node| node.has_tag_name(tag)).count();
        assert_eq!((count("emitter"), count("shape"), count("sensor")), (lights, objects, 1), "{name}");
        for file in document.descendants().filter(|node| node.attribute("name") == Some("filename")) {
            let mesh = fs::read_to_string(place.join(file.attribute("value").unwrap_or_default())).expect("a mesh");
            assert!(mesh.lines().any(|line| line.starts_with("f ")), "a mesh without faces");
        }
        // Each surface wears a material that is there, once.
        let worn =
            document.descendants().filter(|node| node.has_tag_name("ref")).filter_map(|node| node.attribute("id"));
        let made = |id: &str| {
            document.descendants().filter(|node| node.has_tag_name("bsdf") && node.attribute("id") == Some(id)).count()
        };
        assert!(worn.map(made).all(|count| count == 1), "{text}");
    }
}

#[test]
fn what_mitsuba_has_otherwise_is_not_exported() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let said = refusal(folder.path(), &["builtin:hall", "--export", "hall"], 3);
    assert!(said.contains("cannot export builtin:hall") && said.contains("cannot be expressed"), "{said}");
    assert!(!folder.path().join("hall").exists());
    refusal(folder.path(), &["builtin:hall", "--export", "hall", "--samples", "4"], 2);
}

#[test]
fn the_standard_error_is_a_picture_that_shrinks_with_more_samples() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lambert = scene("lambert.toml");
    let mean = |samples: &str| {
        let arguments =
            [&lambert, "--size", "24x16", "--samples", samples, "--no-cache", "-q", "--standard-error", "error.exr"];
        let output = reference(folder.path(), &arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let error = image::open(folder.path().join("error.exr")).expect("an EXR").into_rgb32f();
        assert_eq!(error.dimensions(), (24, 16));
        assert!(error.iter().all(|value| *value >= 0.0));
        error.iter().map(|value| f64::from(*value)).sum::<f64>()
    };
    let ratio = mean("16") / mean("256");
    assert!((3.0..5.0).contains(&ratio), "a sixteenth of the samples, four times the error: {ratio}");
    assert!(refusal(folder.path(), &[&lambert, "--samples", "1", "--standard-error", "e.exr"], 2).contains("two"));
    assert!(refusal(folder.path(), &[&lambert, "--standard-error", "e.png"], 2).contains(".exr"));
}
