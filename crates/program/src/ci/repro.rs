//! The case of a bundle, tried again in this process, so that a debugger can watch.

use std::fs;
use std::path::Path;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use afterlight_files::regular_file::read_regular;

use super::suite::SuiteCase;
use super::verdict::{CaseReport, Verdict};
use super::{Args, one, publish, results, runner, verdict_of};
use crate::failure::Failure;
use crate::output;

/// Tries the case again, and says so where its verdict is another one than the bundle's.
///
/// # Errors
/// For a bad verdict, and where the bundle cannot be read.
pub fn again(args: &Args, case: &SuiteCase, bundle: &Path) -> Result<(), Failure> {
    let kept = Arc::new(kept(bundle));
    let is_over = Arc::new(AtomicBool::new(false));
    end_in_time(args, case, (&kept, &is_over));
    let report = one(args, case, Some(bundle))?;
    // The case may end in the moment in which it is stopped, and only one verdict is printed.
    if is_over.swap(true, Ordering::SeqCst) {
        loop {
            thread::park();
        }
    }
    publish(args, &report)?;
    conclude(&report, kept.as_ref().as_ref())
}

/// The bundle's own verdict, if it is there.
fn kept(bundle: &Path) -> Option<CaseReport> {
    serde_json::from_slice(&read_regular(&bundle.join(runner::VERDICT), results::MOST_BYTES).ok()?).ok()
}

fn conclude(report: &CaseReport, kept: Option<&CaseReport>) -> Result<(), Failure> {
    if let Some(line) = kept.and_then(|kept| difference(kept, report)) {
        output::print(&format!("{line}\n"), true)?;
    }
    verdict_of(report)
}

/// Says that the verdict was another one before.
fn difference(kept: &CaseReport, now: &CaseReport) -> Option<String> {
    let before = kept.reason.as_deref().map_or_else(String::new, |reason| format!(" ({reason})"));
    (kept.verdict != now.verdict)
        .then(|| format!("the bundle's verdict is {:?}{before}, and this one {:?}", kept.verdict, now.verdict))
}

/// Stops this process, as a run stops a case that takes longer than it may. A debugger stops time itself: while one watches, nothing is stopped.
fn end_in_time(args: &Args, case: &SuiteCase, (kept, is_over): (&Arc<Option<CaseReport>>, &Arc<AtomicBool>)) {
    let (args, name, seconds) = (args.clone(), case.name.clone(), case.timeout);
    let (kept, is_over) = (Arc::clone(kept), Arc::clone(is_over));
    thread::spawn(move || {
        thread::sleep(Duration::from_secs_f64(seconds));
        if is_watched() || is_over.swap(true, Ordering::SeqCst) {
            return;
        }
        let label = args.output.as_deref().map_or_else(String::new, runner::last_label);
        let report = CaseReport::ended(&name, Verdict::Timeout, format!("stopped after {seconds} s{label}"));
        let told = publish(&args, &report).and_then(|()| conclude(&report, kept.as_ref().as_ref()));
        // A timeout is always a failure; printing may fail, too.
        let exit = told.err().and_then(|failure| {
            let _ = failure.report();
            failure.exit()
        });
        process::exit(exit.map_or(0, |exit| exit.code().into()));
    });
}

/// Returns true while a debugger is attached to this process, where the system says so.
fn is_watched() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let tracer = status.lines().find_map(|line| line.strip_prefix("TracerPid:"));
    tracer.is_some_and(|tracer| tracer.trim() != "0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_verdict_than_the_bundles_is_told_with_its_reason() {
        let failed =
            CaseReport { verdict: Verdict::Fail, reason: Some("picture: FLIP 0.2".into()), ..CaseReport::new("a.b") };
        let passed = CaseReport::new("a.b");
        assert_eq!(difference(&failed, &failed), None);
        let told = difference(&failed, &passed).expect("they differ");
        assert_eq!(told, "the bundle's verdict is Fail (picture: FLIP 0.2), and this one Pass");
        assert!(conclude(&failed, Some(&passed)).is_err() && conclude(&passed, None).is_ok());
    }
}
