//! Dependencies of the crates, feature by feature, and the content of the library's package, asked of cargo, which needs no network for either.

use std::collections::BTreeSet;
use std::process::Command;

fn cargo(package: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO"));
    command.current_dir(env!("AFTERLIGHT_ROOT")).args(arguments).args(["--offline", "--package", package]);
    let output = command.output().expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The crates that a package is built with, itself among them.
fn crates(package: &str, features: &str) -> BTreeSet<String> {
    let tree = ["tree", "--edges", "normal", "--prefix", "none", "--no-default-features", "--features", features];
    cargo(package, &tree).lines().filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect()
}

#[test]
fn each_feature_brings_what_it_needs_and_the_library_alone_no_program_and_no_window() {
    let vulkan = ["ash", "gpu-allocator"];
    let program = ["clap", "indicatif", "tracing-subscriber"];
    let rays = ["afterlight-truth"];
    let surface = ["ash-window", "raw-window-handle"];
    let window = ["egui", "egui-winit", "winit", "notify"];
    let report = ["csv", "maud", "nv-flip", "plotters"];
    let all = [&vulkan[..], &program, &rays, &surface, &window, &report].concat();
    for (package, features, expected) in [
        ("afterlight-scene", "", vec![]),
        ("afterlight-gpu", "", vulkan.to_vec()),
        ("afterlight", "", vulkan.to_vec()),
        ("afterlight", "present", [&vulkan[..], &surface].concat()),
        ("afterlight-proof", "", vulkan.to_vec()),
        ("afterlight-truth", "", rays.to_vec()),
        ("afterlight-truth", "flip", [&rays[..], &["nv-flip"]].concat()),
        ("afterlight-window", "", [&vulkan[..], &rays, &surface, &window].concat()),
        ("afterlight-lab", "", [&vulkan[..], &rays].concat()),
        ("afterlight-lab", "report", [&vulkan[..], &rays, &report].concat()),
        ("afterlight-cli", "", [&vulkan[..], &rays, &program].concat()),
        ("afterlight-cli", "report", [&vulkan[..], &rays, &program, &report].concat()),
        ("afterlight-cli", "window", [&vulkan[..], &rays, &program, &surface, &window].concat()),
        ("afterlight-cli", "default", all.clone()),
    ] {
        let crates = crates(package, features);
        assert!(crates.contains(package), "{crates:?}");
        let found: BTreeSet<&str> = all.iter().copied().filter(|name| crates.contains(*name)).collect();
        assert_eq!(found, expected.into_iter().collect(), "{package} with the features '{features}'");
    }
}

/// A program with its own meshes compiles Vulkan, arithmetic and the unpacking of shaders, and nothing that reads a file.
#[test]
fn the_library_alone_is_few_crates_without_a_reader_and_without_rays() {
    let crates = crates("afterlight", "");
    assert!(crates.len() <= 45, "{} crates: {crates:?}", crates.len());
    let heavy = [
        "basisu",
        "bvh",
        "draco-core",
        "exr",
        "image",
        "meshoptimizer-rs",
        "nalgebra",
        "serde",
        "serde_json",
        "tempfile",
        "tobj",
        "toml",
    ];
    let found: Vec<&str> = heavy.into_iter().filter(|name| crates.contains(*name)).collect();
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn the_package_holds_what_the_library_is_built_from() {
    let files = cargo("afterlight", &["package", "--list", "--allow-dirty"]);
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
    // Golden images, documents and scenes are megabytes, and the other crates have separate packages.
    let strays = ["tests/", "docs/", "crates/"];
    assert!(!files.lines().any(|line| strays.iter().any(|folder| line.starts_with(folder))), "{files}");
}
