//! Hints for a missing part of Vulkan on this system: the variable that hides it, or the packages to install.

use std::fs;

#[cfg(feature = "caches")]
use super::manifests;

/// A part of Vulkan that can be missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VulkanComponent {
    /// The loader library, `libvulkan.so.1` or `vulkan-1.dll`.
    Loader,
    /// A driver (ICD).
    Driver,
    /// The Khronos validation layer.
    ValidationLayer,
}

/// The families of systems whose packages are known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum System {
    Debian,
    Fedora,
    Suse,
    Arch,
    Alpine,
    MacOs,
    Windows,
    Other,
}

/// Returns one line without a line end: the variable that keeps the loader from the missing part, or else the step that installs it on this system.
pub fn hint(what: VulkanComponent) -> String {
    #[cfg(feature = "caches")]
    if let Some(hint) = manifests::overriding_hint(what) {
        return hint;
    }
    hint_for(this_system(), what)
}

fn this_system() -> System {
    if cfg!(target_os = "macos") {
        System::MacOs
    } else if cfg!(target_os = "windows") {
        System::Windows
    } else {
        // freedesktop.org's os-release(5): the second path is the fall-back of the first.
        let text = fs::read_to_string("/etc/os-release").or_else(|_| fs::read_to_string("/usr/lib/os-release"));
        system_of(&text.unwrap_or_default())
    }
}

/// The family that `ID`, or else `ID_LIKE`, names in an os-release file.
fn system_of(os_release: &str) -> System {
    let value = |key: &str| {
        let line = os_release.lines().find_map(|line| line.trim().strip_prefix(key)?.strip_prefix('='));
        line.unwrap_or("").trim_matches(['"', '\'']).to_ascii_lowercase()
    };
    let ids = format!("{} {}", value("ID"), value("ID_LIKE"));
    let known = ids.split_whitespace().find_map(|id| match id {
        "debian" | "ubuntu" | "linuxmint" | "raspbian" => Some(System::Debian),
        "fedora" | "rhel" | "centos" => Some(System::Fedora),
        "suse" | "opensuse" => Some(System::Suse),
        id if id.starts_with("opensuse") => Some(System::Suse),
        "arch" | "manjaro" => Some(System::Arch),
        "alpine" => Some(System::Alpine),
        _ => None,
    });
    known.unwrap_or(System::Other)
}

fn hint_for(system: System, what: VulkanComponent) -> String {
    let (manager, loader, driver, layer) = match system {
        System::Debian => ("sudo apt-get install", "libvulkan1", "mesa-vulkan-drivers", "vulkan-validationlayers"),
        System::Fedora => ("sudo dnf install", "vulkan-loader", "mesa-vulkan-drivers", "vulkan-validation-layers"),
        System::Suse => ("sudo zypper install", "libvulkan1", "libvulkan_lvp", "vulkan-validationlayers"),
        System::Arch => ("sudo pacman -S", "vulkan-icd-loader", "vulkan-swrast", "vulkan-validation-layers"),
        System::Alpine => ("sudo apk add", "vulkan-loader", "mesa-vulkan-swrast", "vulkan-validation-layers"),
        System::MacOs => ("brew install", "vulkan-loader", "molten-vk", "vulkan-validationlayers"),
        System::Windows => return windows_hint(what).to_owned(),
        System::Other => return other_hint(what).to_owned(),
    };
    match what {
        // A loader alone draws nothing: name the driver beside it.
        VulkanComponent::Loader => format!("install it with: {manager} {loader} {driver}"),
        VulkanComponent::Driver => {
            format!("install your GPU vendor's driver, or Mesa's or MoltenVK with: {manager} {driver}")
        }
        VulkanComponent::ValidationLayer => format!("install it with: {manager} {layer}"),
    }
}

fn windows_hint(what: VulkanComponent) -> &'static str {
    match what {
        VulkanComponent::Loader | VulkanComponent::Driver => {
            "install your GPU vendor's driver, which brings the Vulkan loader along"
        }
        VulkanComponent::ValidationLayer => "install the Vulkan SDK from https://vulkan.lunarg.com",
    }
}

fn other_hint(what: VulkanComponent) -> &'static str {
    match what {
        VulkanComponent::Loader => "install your system's Vulkan loader (libvulkan.so.1) and a driver, such as Mesa's",
        VulkanComponent::Driver => "install a Vulkan driver: your GPU vendor's, or Mesa's",
        VulkanComponent::ValidationLayer => {
            "install your system's Vulkan validation layers (VK_LAYER_KHRONOS_validation)"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derived_systems_are_known_by_what_they_are_like() {
        assert_eq!(system_of("NAME=\"Debian GNU/Linux\"\nID=debian\n"), System::Debian);
        assert_eq!(system_of("ID=neon\nID_LIKE=\"ubuntu debian\"\n"), System::Debian);
        assert_eq!(system_of("ID=\"rocky\"\nID_LIKE=\"rhel centos fedora\"\n"), System::Fedora);
        assert_eq!(system_of("ID=opensuse-tumbleweed\n"), System::Suse);
        assert_eq!(system_of("ID=endeavouros\nID_LIKE=arch\n"), System::Arch);
        assert_eq!(system_of(""), System::Other);
    }

    #[test]
    fn every_hint_is_one_line_that_says_what_to_install() {
        use System::*;
        for system in [Debian, Fedora, Suse, Arch, Alpine, MacOs, Windows, Other] {
            for what in [VulkanComponent::Loader, VulkanComponent::Driver, VulkanComponent::ValidationLayer] {
                let hint = hint_for(system, what);
                assert!(hint.contains("install") || hint.contains("add"), "{hint}");
                assert!(!hint.contains('\n'), "{hint}");
            }
        }
    }
}
