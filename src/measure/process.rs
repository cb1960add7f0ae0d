//! What the operating system counts for this process.

/// The most resident memory that this process has had so far, in bytes. `None` where the system does not tell (only
/// Linux does, as `VmHWM`).
pub fn peak_memory_bytes() -> Option<u64> {
    bytes_of("VmHWM:", &std::fs::read_to_string("/proc/self/status").ok()?)
}

/// The resident memory of this process now, in bytes. `None` where the system does not tell (only Linux does, as `VmRSS`).
pub fn resident_memory_bytes() -> Option<u64> {
    bytes_of("VmRSS:", &std::fs::read_to_string("/proc/self/status").ok()?)
}

/// The CPU time that all threads of this process have used so far, in seconds; `None` where the system does not tell. A software driver's
/// threads are among them.
pub fn cpu_seconds() -> Option<f64> {
    cpu_time::ProcessTime::try_now().ok().map(|time| time.as_duration().as_secs_f64())
}

/// A line of the status file, which the system writes in KiB.
fn bytes_of(key: &str, status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_from_the_status_file() {
        let status = "Name:\tx\nVmPeak:\t  9 kB\nVmHWM:\t    2048 kB\nVmRSS:\t 1 kB\n";
        assert_eq!(["VmHWM:", "VmRSS:"].map(|key| bytes_of(key, status)), [Some(2048 * 1024), Some(1024)]);
        assert_eq!(bytes_of("VmHWM:", "Name:\tx\n"), None);
        assert_eq!(bytes_of("VmHWM:", "VmHWM:\t many kB\n"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn this_process_has_used_memory() {
        assert!(peak_memory_bytes().is_some_and(|bytes| bytes > 100_000));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn cpu_time_passes_while_work_is_done() {
        let start = cpu_seconds().expect("Linux tells");
        let mut sum = 0.0f64;
        while cpu_seconds().expect("Linux tells") < start + 0.01 {
            sum = std::hint::black_box(sum + 1.0).sqrt();
        }
        assert!(sum > 0.0);
    }
}
