//! scripts/setup on systems that it does not install on: it tells people what to type.

use std::path::Path;
use std::process::{Command, Output};

fn list(family: &str) -> (bool, String) {
    let script = Path::new(env!("AFTERLIGHT_ROOT")).join("scripts/setup");
    let Output { status, stdout, stderr } =
        Command::new(script).args(["list", family]).output().expect("bash is there");
    (status.success(), String::from_utf8_lossy(if status.success() { &stdout } else { &stderr }).into_owned())
}

#[test]
fn every_known_system_has_a_command_with_a_package_for_each_thing() {
    let things = [
        // A word of the command that a family is told, then its packages for the loader, lavapipe, the layers and the X server.
        ("debian", "apt-get install", ["libvulkan1", "mesa-vulkan-drivers", "vulkan-validationlayers", "xvfb"]),
        (
            "fedora",
            "dnf install",
            ["vulkan-loader", "mesa-vulkan-drivers", "vulkan-validation-layers", "xorg-x11-server-Xvfb"],
        ),
        ("arch", "pacman -S", ["vulkan-icd-loader", "vulkan-swrast", "vulkan-validation-layers", "xorg-server-xvfb"]),
        ("suse", "zypper install", ["libvulkan1", "libvulkan_lvp", "vulkan-validationlayers", "xorg-x11-server-Xvfb"]),
        ("nixos", "nix-shell -E", ["vulkan-loader", "mesa", "vulkan-validation-layers", "xorg.xorgserver"]),
    ];
    for (family, command, packages) in things {
        let (success, told) = list(family);
        assert!(success && told.lines().count() == 1, "{family}: {told}");
        assert!(told.contains(command), "{family}: {told}");
        for package in packages.into_iter().chain(["gcc", "spirv-tools", "weston", "hunspell"]) {
            assert_eq!(
                told.split([' ', '\n']).filter(|word| *word == package).count(),
                1,
                "{package} for {family}: {told}"
            );
        }
    }
}

#[test]
fn an_unknown_system_is_told_what_is_needed_by_the_names_of_files() {
    let (success, told) = list("other");
    assert!(success, "{told}");
    for file in
        ["cc", "c++", "libvulkan.so.1", "lvp_icd", "VkLayer_khronos_validation.json", "spirv-val", "Xvfb", "libXcursor"]
    {
        assert!(told.contains(file), "{file}: {told}");
    }
    let (success, told) = list("plan9");
    assert!(!success && told.contains("'plan9'") && told.contains("nixos"), "{told}");
}
