//! Verdicts and missing dependencies, as they are printed. The layer's own verdict is left out of the snapshots: layers differ.

use std::fs;

use super::{assert_prints, assert_text, folder};
use crate::common::program::program;

use serde_json::Value;

const QUAD: [&str; 5] = ["builtin:quad", "--light-path", "loop", "--size", "64x36"];

/// Exit code, standard output, standard error.
fn run(folder: &std::path::Path, arguments: &[&str]) -> (i32, String, String) {
    let output = program().current_dir(folder).args(arguments).output().expect("the program starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().expect("an exit code"), text(&output.stdout), text(&output.stderr))
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn a_validated_picture_ends_with_checks_layer_and_messages() {
    let folder = folder();
    let (code, told, errors) = run(folder.path(), &["render", "builtin:quad", "--size", "8x8", "--validate"]);
    assert_eq!(code, 0, "{errors}");
    let last = told.lines().last().expect("a line");
    assert!(last.starts_with("validation: core and synchronization, layer 1."), "{told}");
    assert!(last.ends_with(": no messages"), "{told}");
    let (_, told, _) = run(folder.path(), &["render", "builtin:quad", "--size", "8x8"]);
    assert!(!told.contains("validation:"), "{told}");
}

#[test]
fn a_scene_that_fails_keeps_no_other_from_being_drawn_and_the_gravest_code_stays() {
    let folder = folder();
    let scenes =
        ["render", "builtin:nothing", "missing.obj", "builtin:quad", "-o", "{name}.png", "--size", "8x8", "-q"];
    let (code, told, errors) =
        run(folder.path(), &[&scenes[..], &["--validate", "--json", "-", "--junit", "passed.xml"]].concat());
    assert_eq!(code, 3, "{errors}");
    assert!(folder.path().join("quad.png").exists() && !folder.path().join("missing.png").exists());
    assert!(errors.contains("error: 2 of 3 scenes failed: builtin:nothing, missing.obj"), "{errors}");
    assert!(errors.contains("missing.obj failed: cannot read missing.obj"), "{errors}");

    let report = json(&told);
    assert_eq!(report["verdict"], "failed");
    let scenes = report["scenes"].as_array().expect("a list");
    let of = |key: &str| scenes.iter().map(|scene| scene[key].clone()).collect::<Vec<Value>>();
    assert_eq!(of("verdict"), ["failed", "failed", "passed"]);
    assert_eq!(of("exit_code"), [3, 3, 0]);
    assert_eq!(of("output"), ["nothing.png", "missing.png", "quad.png"]);
    assert!(scenes[1]["error"].as_str().is_some_and(|error| error.contains("missing.obj")), "{told}");
    assert_eq!((&scenes[2]["messages"], &scenes[2]["error"]), (&Value::Array(Vec::new()), &Value::Null));
    assert_eq!(scenes[2]["validation"]["checks"], "core and synchronization");
    assert!(scenes[2]["device"].is_string() && scenes[2]["seconds"].is_f64(), "{told}");

    let xml = fs::read_to_string(folder.path().join("passed.xml")).expect("it was written");
    let document = roxmltree::Document::parse(&xml).unwrap_or_else(|error| panic!("{error}: {xml}"));
    let suite = document.root_element().first_element_child().expect("a suite");
    assert_eq!(["tests", "failures", "errors"].map(|key| suite.attribute(key)), [Some("3"), Some("0"), Some("2")]);
}

#[test]
fn a_build_fails_without_a_dependency_and_its_messages_are_data() {
    let folder = folder();
    let render = [&["render"], &QUAD[..], &["-q", "--validate", "--drop", "geometry-to-lighting"]].concat();
    let (code, _, errors) =
        run(folder.path(), &[&render[..], &["--json", "verdict.json", "--junit", "failed.xml"]].concat());
    assert_eq!(code, 1, "{errors}");
    assert!(errors.contains("error: without geometry-to-lighting LIGHTING may read"), "{errors}");
    assert!(folder.path().join("afterlight.png").exists(), "it is drawn all the same");
    let report = json(&fs::read_to_string(folder.path().join("verdict.json")).expect("it was written"));
    let messages = report["scenes"][0]["messages"].as_array().expect("a list");
    let hazard = messages.iter().find(|own| own["rule"].as_str().is_some_and(|rule| rule.starts_with("SYNC-HAZARD-")));
    let hazard = hazard.unwrap_or_else(|| panic!("{report}"));
    assert!(hazard["count"].as_u64() > Some(0) && hazard["objects"].is_array(), "{hazard}");
    assert_eq!((&hazard["severity"], &hazard["kind"]), (&"error".into(), &"validation".into()));
    let named = messages.iter().any(|own| own["objects"].as_array().is_some_and(|names| !names.is_empty()));
    assert!(named, "no message has the name of an object: {report}");
    let xml = fs::read_to_string(folder.path().join("failed.xml")).expect("it was written");
    let document = roxmltree::Document::parse(&xml).unwrap_or_else(|error| panic!("{error}: {xml}"));
    let failure = document.descendants().find(|node| node.has_tag_name("failure")).expect("a failure");
    assert!(failure.text().is_some_and(|text| text.contains("SYNC-HAZARD-")), "{xml}");

    // The rules find the hazard, even if the layer misses it.
    let missed = [&["render"], &QUAD[..], &["-q", "--validate", "--drop", "picture-to-host"]].concat();
    let (code, _, errors) = run(folder.path(), &missed);
    assert_eq!(code, 1, "{errors}");
    assert!(errors.contains("the CPU may read the copy of the picture that COPY"), "{errors}");
}

#[test]
fn what_does_not_go_together_is_told_in_a_line() {
    let folder = folder();
    assert_prints(
        "several_scenes",
        folder.path(),
        &[
            &["render", "builtin:quad", "builtin:cornell"],
            &["render", "builtin:quad", "builtin:cornell", "-o", "-"],
            &["render", "a/x.obj", "a/x.obj", "-o", "{name}.png"],
            &["render", "builtin:quad", "--json", "-", "--junit", "-"],
            &["render", "builtin:quad", "-o", "-", "--json", "-"],
            &["render", "builtin:quad", "--drop", "read-back"],
            &["render", "builtin:quad", "--validate", "--drop", "shadow-reuse"],
            &["render", "builtin:quad", "--validate", "--drop", "read-back", "--view", "all"],
            &["inspect", "builtin:quad", "--light-path", "loop", "--drop", "geometry-to-tiled"],
            &["inspect", "builtin:quad", "--drop", "acquire"],
            &["inspect", "builtin:quad", "--drop", "read-bck"],
        ],
    );
}

#[test]
fn a_missing_dependency_is_told_in_plain_words() {
    let folder = folder();
    let (code, told, errors) =
        run(folder.path(), &[&["inspect"], &QUAD[..], &["--drop", "geometry-to-lighting"]].concat());
    assert_eq!(code, 0, "{errors}");
    assert!(told.contains("LIGHTING may read depth, albedo and normals"), "{told}");
    assert!(told.contains("that GEOMETRY has not finished writing"), "{told}");
    assert!(told.contains("The picture on this device: "), "{told}");
    assert!(told.contains("SYNC-HAZARD-") && !told.contains("nothing orders"), "{told}");
    let before = told.split("The picture on this device").next().expect("what may go wrong comes first");
    assert_text("dropped", before);
}

#[test]
fn all_dependencies_are_dropped_in_one_table() {
    let folder = folder();
    let (code, told, errors) = run(folder.path(), &[&["inspect"], &QUAD[..], &["--drop", "all"]].concat());
    assert_eq!(code, 0, "{errors}");
    let (_, listed, _) = run(folder.path(), &[&["inspect"], &QUAD[..], &["--json"]].concat());
    let listed = json(&listed);
    for row in listed["dependencies"].as_array().expect("a list") {
        let name = row["name"].as_str().expect("a name");
        let line = told.lines().find(|line| line.trim_start().split(' ').next() == Some(name));
        let line = line.unwrap_or_else(|| panic!("{name} is not in {told}"));
        assert!(line.contains("cannot be dropped") || line.contains("hazard") && line.contains(" may "), "{line}");
    }
    // Parts of a row that other rows order as well are listed.
    let bloom = ["inspect", "builtin:spheres", "--bloom", "0.1", "--json"];
    let (_, listed, _) = run(folder.path(), &bloom);
    let listed = json(&listed);
    let row = listed["dependencies"].as_array().expect("a list").iter().find(|row| row["name"] == "tonemap-reuse");
    let covered = row.expect("TONEMAP draws over the last picture")["covered"].as_array().expect("a list");
    assert!(covered.iter().any(|part| part == "after.COLOR_ATTACHMENT_WRITE"), "{covered:?}");
    assert!(covered.iter().all(|part| part != "row"), "{covered:?}");
}

#[test]
fn compare_and_doctor_tell_programs_what_they_tell_people() {
    let folder = folder();
    for (name, more) in [("a.png", "0.5"), ("b.png", "0.9")] {
        let (code, _, errors) =
            run(folder.path(), &["render", "builtin:quad", "--size", "16x16", "--vignette", more, "-q", "-o", name]);
        assert_eq!(code, 0, "{errors}");
    }
    let compare = |more: &[&str]| {
        let (code, told, _) = run(folder.path(), &[&["compare", "a.png", "b.png", "--json"][..], more].concat());
        (code, json(&told))
    };
    let (code, report) = compare(&[]);
    assert_eq!((code, &report["verdict"], &report["limits"]), (0, &Value::Null, &Value::Array(Vec::new())));
    let (code, report) = compare(&["--max", "rmse=1", "--max", "differing=0"]);
    assert_eq!((code, &report["verdict"]), (1, &"failed".into()));
    let limits = report["limits"].as_array().expect("a list");
    assert_eq!(limits.iter().map(|limit| limit["holds"] == true).collect::<Vec<_>>(), [true, false]);
    assert_eq!((&limits[1]["metric"], &limits[1]["limit"]), (&"differing".into(), &0.0.into()));
    assert_eq!(limits[1]["value"].as_f64(), report["differing_pixels"].as_f64());
    assert_eq!(compare(&["--max", "rmse=1"]).1["verdict"], "passed");

    let (code, told, _) = run(folder.path(), &["doctor", "--json"]);
    let doctor = json(&told);
    assert_eq!((code, &doctor["error"]), (0, &Value::Null));
    let device = &doctor["devices"][doctor["device"].as_u64().expect("a number") as usize];
    assert!(device["name"].is_string() && device["unusable"].is_null(), "{device}");
    assert!(device["formats"].as_array().is_some_and(|all| all.iter().any(|own| own["usable"] == true)), "{device}");
    assert!(doctor["loader"].as_str().is_some_and(|version| version.starts_with("1.")), "{told}");
}
