//! `-V` and `--version`: the facts that a report of a fault needs, also where Vulkan is missing.

use std::path::Path;
use std::process::Output;

use crate::common::program::program;

fn told(arguments: &[&str], environment: &[(&str, &Path)]) -> String {
    let Output { status, stdout, stderr } =
        program().args(arguments).envs(environment.iter().copied()).output().expect("the program starts");
    let (told, errors) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    assert!(status.success() && errors.is_empty(), "{arguments:?}: {status}: {told}{errors}");
    told.into_owned()
}

/// The rest of the first line that starts with a word.
fn line<'text>(told: &'text str, start: &str) -> &'text str {
    told.lines().find_map(|line| line.strip_prefix(start)).unwrap_or_else(|| panic!("no line `{start}` in: {told}"))
}

#[test]
fn the_short_version_is_a_line_and_the_long_one_tells_the_build_and_its_vulkan() {
    let short = concat!("afterlight ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(told(&["-V"], &[]), short);
    let long = told(&["--version"], &[]);
    assert!(long.starts_with(short), "{long}");
    // A checkout knows no commit unless its build names one.
    let commit = option_env!("AFTERLIGHT_COMMIT").unwrap_or("unknown, built from a working tree");
    assert!(line(&long, "commit: ").starts_with(commit), "{long}");
    let has_window = line(&long, "features: ").split(", ").any(|feature| feature == "window");
    assert_eq!(has_window, cfg!(feature = "window"), "{long}");
    let target = line(&long, "target: ");
    assert!(target.starts_with(std::env::consts::ARCH) && target.contains(", rustc 1."), "{long}");
    let doctor: serde_json::Value = serde_json::from_str(&told(&["doctor", "--json"], &[])).expect("JSON");
    let word = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    assert_eq!(line(&long, "loader: Vulkan "), word(&doctor["loader"]));
    let layer = word(&doctor["validation_layer"]);
    assert_eq!(line(&long, "layer: VK_LAYER_KHRONOS_validation "), layer);
    for (number, device) in doctor["devices"].as_array().expect("a list").iter().enumerate() {
        let own = line(&long, &format!("device {number}: "));
        for key in ["name", "driver", "vulkan"] {
            assert!(own.contains(&word(&device[key])), "{key} in {own}");
        }
    }
}

#[test]
fn the_version_is_told_without_a_driver_and_without_a_loader() {
    // Debian 13's runner names loader and driver itself.
    if std::env::var_os("AFTERLIGHT_RUNNER").is_some() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let nowhere = folder.path().join("none.json");
    let without_driver = told(&["--version"], &[("VK_DRIVER_FILES", &nowhere), ("VK_ICD_FILENAMES", &nowhere)]);
    assert!(line(&without_driver, "loader: Vulkan ").starts_with("1."), "{without_driver}");
    let why = line(&without_driver, "drawing does not work: ");
    assert!(
        why.contains("VK_DRIVER_FILES names ") && why.contains("none.json, which cannot be read"),
        "{without_driver}"
    );
    assert!(!without_driver.contains("device 0"), "{without_driver}");
    // An empty library in the first folder that is searched: the search ends there.
    std::fs::write(folder.path().join("libvulkan.so.1"), "").expect("a writable folder");
    let without_loader = told(&["--version"], &[("LD_LIBRARY_PATH", folder.path())]);
    assert!(line(&without_loader, "drawing does not work: ").contains("loader"), "{without_loader}");
    assert!(!without_loader.contains("\nloader: "), "{without_loader}");
    assert_eq!(told(&["-V"], &[("LD_LIBRARY_PATH", folder.path())]).lines().count(), 1);
}
