//! The machine on which times are taken.

use super::model::Machine;
use afterlight::frame::calibration::Calibration;
use afterlight::gpu::PhysicalDevice;
use afterlight::shaders;
use ash::vk;

/// The variable that says how many threads lavapipe draws with.
pub const DRIVER_THREADS: &str = "LP_NUM_THREADS";

/// This machine, with the device that draws.
pub fn here(device: &PhysicalDevice) -> Machine {
    let software = device.kind == vk::PhysicalDeviceType::CPU;
    let driver_threads = std::env::var(DRIVER_THREADS).ok().and_then(|text| text.parse().ok());
    Machine {
        device: device.name.clone(),
        driver: format!("{} {}{}", device.driver_name, device.driver_info, calibrated(device)).trim().to_owned(),
        software,
        os: os(),
        cpu: cpu().unwrap_or_else(|| std::env::consts::ARCH.into()),
        threads: threads(),
        driver_threads: driver_threads.filter(|_| software),
    }
}

/// The figures that `auto` chooses by, told apart: with others the same settings may draw in another way.
fn calibrated(device: &PhysicalDevice) -> String {
    let figures = device.calibration.as_ref().filter(|_| Calibration::of(device).is_some());
    figures.map_or_else(String::new, |figures| format!(", calibrated ({:08x})", crc32fast::hash(figures)))
}

/// The shaders' hash, and a note in a build with debug assertions, whose frames take longer.
pub fn build() -> String {
    let hash = shaders::hash();
    format!("{}{}", &hash[..16], if cfg!(debug_assertions) { " with debug assertions" } else { "" })
}

/// Threads that this process may use.
pub fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The system and, where it tells, its version.
fn os() -> String {
    let release = std::fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    format!("{} {}", std::env::consts::OS, version(&release)).trim().to_owned()
}

/// Drops the suffix of builders and hosts, which names them.
fn version(release: &str) -> &str {
    let end = release.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(release.len());
    release[..end].trim_end_matches('.')
}

fn cpu() -> Option<String> {
    model(&std::fs::read_to_string("/proc/cpuinfo").ok()?)
}

fn model(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cpu_is_named_as_the_system_names_it() {
        let text = "processor\t: 0\nmodel name\t: A CPU @ 2 GHz\nmodel name\t: another\n";
        assert_eq!(model(text).as_deref(), Some("A CPU @ 2 GHz"));
        assert_eq!(model("processor : 0\n"), None);
    }

    #[test]
    fn a_system_is_told_by_its_version_alone() {
        for (release, expected) in
            [("6.1.0-28-cloud-amd64\n", "6.1.0"), ("5.15.90.1-host", "5.15.90.1"), ("4.4.", "4.4"), ("", "")]
        {
            assert_eq!(version(release), expected, "{release}");
        }
    }
}
