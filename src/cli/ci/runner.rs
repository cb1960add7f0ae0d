//! Runs cases, each in a process of its own: one that crashes, hangs or loses its device ends alone.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::evidence::{DEVICE, LAST_LABEL};
use super::suite::Case;
use super::verdict::{CaseReport, Verdict, Where};
use crate::cli::failure::{Exit, Failure};
use crate::cli::output;

/// The file in a case's folder with the verdict of its process.
pub const VERDICT: &str = "verdict.json";
/// The file with what its process has printed.
const LOG: &str = "log.txt";
/// How often a process is looked after.
const POLL: Duration = Duration::from_millis(5);

/// How cases are run.
pub struct Runner<'a> {
    /// This program, behind whatever starts it, and what all processes are told besides their case and its folder.
    pub command: Vec<OsString>,
    /// A folder for each case is made here.
    pub cases: &'a Path,
    /// Processes at a time.
    pub jobs: usize,
}

impl Runner<'_> {
    /// Runs all cases, and those that end badly once more: one that then passes is a flake. `told` hears of each as it is done.
    ///
    /// # Errors
    /// When a process cannot be started, or a folder cannot be made.
    pub fn run(&self, cases: &[&Case], told: &(dyn Fn(&CaseReport) + Sync)) -> Result<Vec<CaseReport>, Failure> {
        let queue: Mutex<VecDeque<(usize, &Case)>> = Mutex::new(cases.iter().copied().enumerate().collect());
        let done: Mutex<Vec<(usize, CaseReport)>> = Mutex::default();
        let failed: Mutex<Option<Failure>> = Mutex::default();
        let next = || locked(&queue).pop_front();
        thread::scope(|scope| {
            for _ in 0..self.jobs.clamp(1, cases.len().max(1)) {
                scope.spawn(|| {
                    while let Some((index, case)) = next() {
                        match self.twice(case) {
                            Ok(report) => {
                                told(&report);
                                locked(&done).push((index, report));
                            }
                            Err(failure) => {
                                locked(&queue).clear();
                                *locked(&failed) = Some(failure);
                            }
                        }
                    }
                });
            }
        });
        if let Some(failure) = locked(&failed).take() {
            return Err(failure);
        }
        let mut done = std::mem::take(&mut *locked(&done));
        done.sort_by_key(|(index, _)| *index);
        Ok(done.into_iter().map(|(_, report)| report).collect())
    }

    fn twice(&self, case: &Case) -> Result<CaseReport, Failure> {
        let first = self.once(case, &self.cases.join(&case.name))?;
        if !first.verdict.is_bad() {
            return Ok(first);
        }
        let folder = self.cases.join(format!("{}.again", case.name));
        let again = self.once(case, &folder)?;
        let _ = fs::remove_dir_all(&folder);
        let was = first.reason.clone().unwrap_or_default();
        Ok(match again.verdict {
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
        })
    }

    /// Runs a case's process to its end, or stops it.
    fn once(&self, case: &Case, folder: &Path) -> Result<CaseReport, Failure> {
        let cannot = |what: &str, error: &io::Error| Failure::new(Exit::BadInput, format!("{what}: {error}"));
        if folder.exists() {
            fs::remove_dir_all(folder)
                .map_err(|error| cannot(&format!("cannot remove {}", folder.display()), &error))?;
        }
        output::make_folder(folder)?;
        let log = fs::File::create(folder.join(LOG)).map_err(|error| Failure::write(LOG, &error))?;
        let errors = log.try_clone().map_err(|error| Failure::write(LOG, &error))?;
        let mut words = self.command.iter();
        let mut command = Command::new(words.next().map_or("".as_ref(), OsString::as_os_str));
        command.args(words).args(["--case", &case.name, "-o"]).arg(folder);
        command.stdin(Stdio::null()).stdout(log).stderr(errors);
        let begun = Instant::now();
        let mut child = command
            .spawn()
            .map_err(|error| cannot(&format!("cannot start {}", command.get_program().display()), &error))?;
        let ended = wait(&mut child, Duration::from_secs_f64(case.timeout));
        let mut report = match ended.map_err(|error| cannot("cannot wait for a case's process", &error))? {
            Some(status) => judge(case, folder, status),
            None => {
                let why = format!("stopped after {} s{}", case.timeout, last_label(folder));
                CaseReport { on: place(folder), ..CaseReport::ended(&case.name, Verdict::Timeout, why) }
            }
        };
        report.seconds = begun.elapsed().as_secs_f64();
        Ok(report)
    }
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How the process ended; `None` for one that was stopped.
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

/// The verdict that the process left, or a crash where it left none.
fn judge(case: &Case, folder: &Path, status: ExitStatus) -> CaseReport {
    let left = fs::read(folder.join(VERDICT)).ok().and_then(|json| serde_json::from_slice(&json).ok());
    left.unwrap_or_else(|| {
        let said = fs::read_to_string(folder.join(LOG)).unwrap_or_default();
        let said = said
            .lines()
            .rev()
            .find(|line| !line.trim().is_empty())
            .map_or_else(String::new, |line| format!(": {line}"));
        let why = format!("its process ended without a verdict, {status}{}{said}", last_label(folder));
        CaseReport { on: place(folder), ..CaseReport::ended(&case.name, Verdict::Crash, why) }
    })
}

/// As the end of a sentence.
fn last_label(folder: &Path) -> String {
    let label = fs::read_to_string(folder.join(LAST_LABEL)).unwrap_or_default();
    match label.trim() {
        "" => ", before a label was recorded".to_owned(),
        label => format!(", after the label {label}"),
    }
}

/// Where the case was drawn, as far as its process came.
fn place(folder: &Path) -> Where {
    let device: Option<serde_json::Value> =
        fs::read(folder.join(DEVICE)).ok().and_then(|json| serde_json::from_slice(&json).ok());
    let text = |key: &str| device.as_ref().and_then(|device| device[key].as_str()).unwrap_or_default().to_owned();
    Where { device: text("name"), driver: text("driver") }
}
