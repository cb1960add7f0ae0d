//! Output of `bench` on why frames are slow, and on the meaning of its times.

use serde_json::Value;

use super::{assert_prints, folder};
use crate::common::program::program;

#[test]
fn what_does_not_go_together_is_refused() {
    assert_prints(
        "bench_refusals",
        folder().path(),
        &[
            &["bench", "builtin:hall", "--why", "--vary", "fxaa=on"],
            &["bench", "builtin:hall", "--still", "--moving"],
            &["tune", "builtin:hall", "--max-ms", "9", "--still", "--shadow-cache", "off"],
        ],
    );
}

/// Times and errors differ between drivers; the trials, their order and the sentences about them do not.
#[test]
#[ignore = "test-all: the program and its window at length"]
fn why_names_the_costs_that_are_in_the_frame_and_no_others() {
    let frames = ["--size", "64x36", "--frames", "2", "--warmup", "0"];
    let of = |scene: &str, more: &[&str]| {
        let why = ["bench", scene, "--why", "--json", "-"];
        let output = program().args([&why[..], &frames, more].concat()).output().expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (said, report["scenes"][0].clone())
    };
    let (said, scene) = of("builtin:hall?detail=8", &["--vignette", "0.5"]);
    assert!(said.contains("\ntimes: everything moves: shadow maps are drawn in each frame\n"), "{said}");
    assert!(said.contains("within noise, as --frames are fewer than 6: --size 32x18, "), "{said}");
    assert_eq!((&scene["moving"], &scene["plan_cost"]), (&Value::Bool(true), &Value::Null));
    let costs = scene["why"]["costs"].as_array().expect("a list");
    let options: Vec<&str> = costs.iter().filter_map(|cost| cost["option"].as_str()).collect();
    for option in ["--size 32x18", "--vignette 0", "--shadows off", "--shadow-size 512", "--cascades 1"] {
        assert!(options.contains(&option), "{option} is not among {options:?}");
    }
    assert!(!options.iter().any(|option| option.contains("fxaa")), "{options:?}");
    for cost in costs {
        let ms = |key: &str| cost[key].as_f64().expect("a number");
        assert_eq!((&cost["verdict"], &cost["ratio"]["count"]), (&"within-noise".into(), &2.into()), "{cost}");
        assert!(
            (scene["why"]["given_ms"].as_f64().expect("a number") - ms("ms") - ms("saved_ms")).abs() < 1e-6,
            "{cost}"
        );
        let picture = &cost["picture"];
        assert_eq!(picture["same"] == true, picture["rmse"] == 0.0, "{cost}");
        assert_eq!(picture["scaled"] == true, cost["setting"] == "size", "{cost}");
    }

    let (said, scene) = of("builtin:quad", &["--still"]);
    assert!(said.contains("\ntimes: nothing moves: shadow maps are kept\n"), "{said}");
    let costs = scene["why"]["costs"].as_array().expect("a list");
    assert!(scene["moving"] == false && !costs.iter().any(|cost| cost["setting"] == "cascades"), "{costs:?}");
}
