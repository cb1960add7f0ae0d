//! Runs cases, each in a separate process: a case that crashes, hangs or loses its device ends alone.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::evidence::{DEVICE, LAST_LABEL, STAGE};
use super::suite::SuiteCase;
use super::verdict::{CaseReport, Verdict, Where};

/// The file in a case's folder with the verdict of its process.
pub const VERDICT: &str = "verdict.json";
/// The file with the output of its process.
const LOG: &str = "log.txt";
/// The time between two looks at a process.
const POLL: Duration = Duration::from_millis(5);

/// The way that cases are run.
pub struct Runner<'a> {
    /// This program, behind the command that starts it, and the arguments of all processes besides their case and its folder.
    pub command: Vec<OsString>,
    /// A folder for each case is made here.
    pub cases: &'a Path,
    /// Processes at a time.
    pub jobs: usize,
}

impl Runner<'_> {
    /// Runs all cases, and cases that end badly once more: a case that then passes is a flake. `told` is called with each report as its case is done.
    pub fn run(&self, cases: &[&SuiteCase], told: &(dyn Fn(&CaseReport) + Sync)) -> Vec<CaseReport> {
        let queue: Mutex<VecDeque<(usize, &SuiteCase)>> = Mutex::new(cases.iter().copied().enumerate().collect());
        let done: Mutex<Vec<(usize, CaseReport)>> = Mutex::default();
        let next = || locked(&queue).pop_front();
        thread::scope(|scope| {
            for _ in 0..self.jobs.clamp(1, cases.len().max(1)) {
                scope.spawn(|| {
                    while let Some((index, case)) = next() {
                        let report = self.twice(case);
                        told(&report);
                        locked(&done).push((index, report));
                    }
                });
            }
        });
        let mut done = std::mem::take(&mut *locked(&done));
        done.sort_by_key(|(index, _)| *index);
        done.into_iter().map(|(_, report)| report).collect()
    }

    // ANCHOR: twice
    fn twice(&self, case: &SuiteCase) -> CaseReport {
        let first = self.once(case, &self.cases.join(&case.name));
        if !first.verdict.is_bad() {
            return first;
        }
        let folder = self.cases.join(format!("{}.again", case.name));
        let again = self.once(case, &folder);
        let _ = fs::remove_dir_all(&folder);
        let was = first.reason.clone().unwrap_or_default();
        match again.verdict {
            Verdict::Pass => CaseReport {
                verdict: Verdict::Flake,
                reason: Some(format!("first {:?} ({was}), then Pass", first.verdict)),
                ..first
            },
            verdict if verdict != first.verdict => {
                let reason = format!("{was}; the repeat: {verdict:?} ({})", again.reason.unwrap_or_default());
                CaseReport { reason: Some(reason), ..first }
            }
            _ => first,
        }
    }
    // ANCHOR_END: twice

    /// Runs a case's process to its end, or stops it.
    fn once(&self, case: &SuiteCase, folder: &Path) -> CaseReport {
        let begun = Instant::now();
        let report = self.watched(case, folder).unwrap_or_else(|error| {
            let why = format!("its process could not be run: {error}");
            CaseReport::ended(&case.name, Verdict::Crash, why)
        });
        CaseReport { seconds: begun.elapsed().as_secs_f64(), ..report }
    }

    fn watched(&self, case: &SuiteCase, folder: &Path) -> io::Result<CaseReport> {
        if folder.exists() {
            fs::remove_dir_all(folder)?;
        }
        fs::create_dir_all(folder)?;
        let log = fs::File::create(folder.join(LOG))?;
        let errors = log.try_clone()?;
        let mut words = self.command.iter();
        let mut command = Command::new(words.next().map_or("".as_ref(), OsString::as_os_str));
        command.args(words).args(["--case", &case.name, "-o"]).arg(folder);
        command.stdin(Stdio::null()).stdout(log).stderr(errors);
        let mut child = command.spawn()?;
        Ok(match wait(&mut child, Duration::from_secs_f64(case.timeout))? {
            Some(status) => judge(case, folder, status),
            None => {
                let why = format!("stopped after {} s{}", case.timeout, last_label(folder));
                CaseReport { on: place(folder), ..CaseReport::ended(&case.name, Verdict::Timeout, why) }
            }
        })
    }
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for the process. Returns its exit status; `None` if it was stopped.
fn wait(child: &mut Child, timeout: Duration) -> io::Result<Option<ExitStatus>> {
    let deadline = Instant::now() + timeout;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if Instant::now() >= deadline {
            // It may have ended by itself meanwhile.
            let _ = child.kill();
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(POLL);
    }
}

/// The verdict that the process left. Without one, or where the process ended otherwise than one with that verdict does, it has crashed: a driver may
/// do so at its very end.
fn judge(case: &SuiteCase, folder: &Path, status: ExitStatus) -> CaseReport {
    let left = fs::read(folder.join(VERDICT)).ok().and_then(|json| serde_json::from_slice::<CaseReport>(&json).ok());
    let expected = |report: &CaseReport| i32::from(report.verdict.is_bad());
    match left {
        Some(report) if status.code() == Some(expected(&report)) => report,
        Some(report) => {
            let why = format!("its process ended after the verdict {:?}, {status}", report.verdict);
            CaseReport { verdict: Verdict::Crash, reason: Some(why), ..report }
        }
        None => {
            let said = fs::read_to_string(folder.join(LOG)).unwrap_or_default();
            let said = said.lines().rev().find(|line| !line.trim().is_empty());
            let said = said.map_or_else(String::new, |line| format!(": {line}"));
            let why = format!("its process ended without a verdict, {status}{}{said}", last_label(folder));
            CaseReport { on: place(folder), ..CaseReport::ended(&case.name, Verdict::Crash, why) }
        }
    }
}

/// As the end of a sentence.
pub fn last_label(folder: &Path) -> String {
    let text = |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_default().trim().to_owned();
    match (text(STAGE).as_str(), text(LAST_LABEL).as_str()) {
        ("", _) => ", before there was a device".to_owned(),
        (stage, "") => format!(", before a label was recorded ({stage})"),
        (stage, label) => format!(", after the label {label} ({stage})"),
    }
}

/// Returns the device and driver of the case, if its process came so far.
fn place(folder: &Path) -> Where {
    let device: Option<serde_json::Value> =
        fs::read(folder.join(DEVICE)).ok().and_then(|json| serde_json::from_slice(&json).ok());
    let text = |key: &str| device.as_ref().and_then(|device| device[key].as_str()).unwrap_or_default().to_owned();
    Where { device: text("name"), driver: text("driver") }
}
