//! The operating system's figures of this process.

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

/// Files that this process has open now, devices and sockets among them. `None` where the system does not tell (only Linux does).
pub fn open_files() -> Option<usize> {
    // The folder that is read is open itself.
    Some(std::fs::read_dir("/proc/self/fd").ok()?.count().saturating_sub(1))
}

/// Threads that this process has now, a driver's among them. `None` where the system does not tell (only Linux does).
pub fn threads() -> Option<usize> {
    Some(std::fs::read_dir("/proc/self/task").ok()?.count())
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
    fn an_open_file_and_a_thread_are_counted() {
        // Other tests of this process open files and start threads meanwhile: more of either than all of them.
        let (files, threads_before) = (open_files().expect("Linux tells"), threads().expect("Linux tells"));
        let opened: Vec<_> =
            (0..200).map(|_| std::fs::File::open("/proc/self/status").expect("there is one")).collect();
        assert!(open_files().expect("Linux tells") >= files + 100);
        drop(opened);
        let barrier = std::sync::Barrier::new(101);
        std::thread::scope(|scope| {
            (0..100).for_each(|_| _ = scope.spawn(|| barrier.wait()));
            let now = threads().expect("Linux tells");
            barrier.wait();
            assert!(now >= threads_before + 50);
        });
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
