//! The kind of the host's CPU, as far as the pictures of a software driver may follow from it.
//!
//! A software driver compiles shaders for the CPU at hand. Approximations such as `rsqrtps` give other last digits on CPUs of another vendor, and
//! wider vectors or fused operations other orders of rounding: a picture is the same to the last bit only on CPUs of one kind.

/// The vendor and the width of the widest vectors, as "Intel, 512-bit vectors".
pub fn cpu_kind() -> String {
    format!("{}, {}-bit vectors", vendor(), vector_bits())
}

#[cfg(target_arch = "x86_64")]
fn vendor() -> String {
    let leaf = std::arch::x86_64::__cpuid(0);
    let bytes = [leaf.ebx, leaf.edx, leaf.ecx].map(u32::to_le_bytes);
    name_of(&String::from_utf8_lossy(bytes.as_flattened())).to_owned()
}

/// The name that people know a vendor by.
#[cfg(target_arch = "x86_64")]
fn name_of(cpuid: &str) -> &str {
    match cpuid {
        "GenuineIntel" => "Intel",
        "AuthenticAMD" => "AMD",
        other => other.trim_matches(|c: char| c.is_whitespace() || c == '\0'),
    }
}

#[cfg(target_arch = "x86_64")]
fn vector_bits() -> u32 {
    if std::is_x86_feature_detected!("avx512f") {
        512
    } else if std::is_x86_feature_detected!("avx2") {
        256
    } else {
        128
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn vendor() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let of =
        |key: &str| cpuinfo.lines().find(|line| line.starts_with(key))?.split_once(':').map(|(_, value)| value.trim());
    let implementer = of("CPU implementer").map(|number| format!(" of implementer {number}"));
    std::env::consts::ARCH.to_owned() + &implementer.unwrap_or_default()
}

#[cfg(not(target_arch = "x86_64"))]
fn vector_bits() -> u32 {
    128
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the kernel's own list, which this code does not read on x86-64.
    #[cfg(all(target_arch = "x86_64", target_os = "linux"))]
    #[test]
    fn the_kind_is_what_the_kernel_lists() {
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").expect("Linux has it");
        let of = |key: &str| {
            let line = cpuinfo.lines().find(|line| line.starts_with(key)).expect("each CPU has one");
            line.split_once(": ").expect("a value").1.to_owned()
        };
        let flags = of("flags");
        let has = |flag: &str| flags.split(' ').any(|own| own == flag);
        let bits = if has("avx512f") {
            512
        } else if has("avx2") {
            256
        } else {
            128
        };
        assert_eq!(cpu_kind(), format!("{}, {bits}-bit vectors", name_of(&of("vendor_id"))));
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn vendors_have_the_names_that_people_know() {
        let names = ["GenuineIntel", "AuthenticAMD", "HygonGenuine", "VIA VIA VIA ", "\0\0\0"].map(name_of);
        assert_eq!(names, ["Intel", "AMD", "HygonGenuine", "VIA VIA VIA", ""]);
    }
}
