//! Dependencies of the library, feature by feature, and the content of its package, asked of cargo, which needs no network for either.

use std::collections::BTreeSet;
use std::process::Command;

fn cargo(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO"));
    let output = command
        .current_dir(env!("AFTERLIGHT_ROOT"))
        .args(arguments)
        .args(["--offline", "--package", "afterlight"])
        .output();
    let output = output.expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The crates that the library is built with.
fn crates(features: &str) -> BTreeSet<String> {
    let tree = ["tree", "--edges", "normal", "--prefix", "none", "--no-default-features", "--features", features];
    cargo(&tree).lines().filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect()
}

#[test]
fn each_feature_brings_what_it_needs_and_the_library_alone_no_program_and_no_window() {
    let program = ["clap", "indicatif", "tracing-subscriber"];
    let surface = ["ash-window", "raw-window-handle"];
    let window = ["egui", "egui-winit", "winit", "notify"];
    let report = ["maud", "nv-flip", "plotters"];
    for (features, expected) in [
        ("", vec![]),
        ("cli", program.to_vec()),
        ("present", surface.to_vec()),
        ("report", report.to_vec()),
        ("window", [&surface[..], &window].concat()),
        ("cli,report,window", [&program[..], &surface, &window, &report].concat()),
    ] {
        let crates = crates(features);
        assert!(crates.contains("ash") && crates.contains("glam"), "{crates:?}");
        let found: BTreeSet<&str> = program.iter().chain(&surface).chain(&window).chain(&report).copied().collect();
        let found: Vec<&str> = found.into_iter().filter(|name| crates.contains(*name)).collect();
        let expected: BTreeSet<&str> = expected.into_iter().collect();
        assert_eq!(found, expected.into_iter().collect::<Vec<_>>(), "with the features '{features}'");
    }
}

#[test]
fn the_package_holds_what_the_library_is_built_from() {
    let files = cargo(&["package", "--list", "--allow-dirty"]);
    let has = |name: &str| files.lines().any(|line| line == name);
    for name in [
        "build.rs",
        "README.md",
        "LICENSE-MIT",
        "LICENSE-APACHE",
        "src/lib.rs",
        "shaders/fog.wgsl",
        "examples/triangle.rs",
    ] {
        assert!(has(name), "{name} is missing of\n{files}");
    }
    // Golden images, documents and scenes are megabytes.
    assert!(!files.lines().any(|line| line.starts_with("tests/") || line.starts_with("docs/")), "{files}");
}
