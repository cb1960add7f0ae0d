//! Dependencies of the crates, feature by feature, and the content of the library's package, asked of cargo, which needs no network for either.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Runs cargo on a crate in its folder: elsewhere cargo ignores features that are asked of it.
fn cargo(folder: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO"));
    let folder = Path::new(env!("AFTERLIGHT_ROOT")).join(folder);
    let output = command.current_dir(folder).args(arguments).arg("--offline").output();
    let output = output.expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The crates that a package is built with, itself among them.
fn crates(folder: &str, package: &str, features: &str) -> BTreeSet<String> {
    let tree = ["tree", "--edges", "normal", "--prefix", "none", "--no-default-features", "--features", features];
    let told = cargo(folder, &[&tree[..], &["--package", package]].concat());
    told.lines().filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect()
}

#[test]
fn each_feature_brings_what_it_needs_and_the_library_alone_no_program_and_no_window() {
    let vulkan = ["ash", "gpu-allocator"];
    let program = ["clap", "indicatif", "tracing-subscriber"];
    let rays = ["afterlight-truth"];
    let surface = ["ash-window", "raw-window-handle"];
    let window = ["egui", "egui-winit", "winit", "notify"];
    let report = ["maud", "nv-flip", "plotters"];
    let all = [&vulkan[..], &program, &rays, &surface, &window, &report].concat();
    for (folder, package, features, expected) in [
        ("crates/scene", "afterlight-scene", "", vec![]),
        ("crates/gpu", "afterlight-gpu", "", vulkan.to_vec()),
        (".", "afterlight", "", vulkan.to_vec()),
        (".", "afterlight", "present", [&vulkan[..], &surface].concat()),
        ("crates/truth", "afterlight-truth", "", rays.to_vec()),
        ("crates/truth", "afterlight-truth", "flip", [&rays[..], &["nv-flip"]].concat()),
        ("crates/window", "afterlight-window", "", [&vulkan[..], &rays, &surface, &window].concat()),
        ("crates/lab", "afterlight-lab", "", [&vulkan[..], &rays].concat()),
        ("crates/lab", "afterlight-lab", "report", [&vulkan[..], &rays, &report].concat()),
        ("crates/program", "afterlight-cli", "", [&vulkan[..], &rays, &program].concat()),
        ("crates/program", "afterlight-cli", "present", [&vulkan[..], &rays, &program, &surface].concat()),
        ("crates/program", "afterlight-cli", "report", [&vulkan[..], &rays, &program, &report].concat()),
        ("crates/program", "afterlight-cli", "window", [&vulkan[..], &rays, &program, &surface, &window].concat()),
        ("crates/program", "afterlight-cli", "default", all.clone()),
    ] {
        let crates = crates(folder, package, features);
        assert!(crates.contains(package), "{crates:?}");
        let found: BTreeSet<&str> = all.iter().copied().filter(|name| crates.contains(*name)).collect();
        assert_eq!(found, expected.into_iter().collect(), "{package} with the features '{features}'");
    }
}

#[test]
fn the_package_holds_what_the_library_is_built_from() {
    let files = cargo(".", &["package", "--package", "afterlight", "--list", "--allow-dirty"]);
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
    // Golden images, documents and scenes are megabytes, and the other crates have packages of their own.
    let strays = ["tests/", "docs/", "crates/"];
    assert!(!files.lines().any(|line| strays.iter().any(|folder| line.starts_with(folder))), "{files}");
}
