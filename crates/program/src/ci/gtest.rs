//! `afterlight gtest`: the cases of a suite behind googletest's protocol, as runners of that know it: a list of tests, a filter, and a line before and
//! after each. Cases run in this process, one after the other; the runner watches for crashes and hangs.

use std::env;
use std::path::PathBuf;
use std::time::Instant;

use afterlight::gpu::DeviceChoice;
use afterlight::scene::counted;
use regex::Regex;

use super::evidence::EvidenceFolder;
use super::examine::{self, CaseContext};
use super::suite::{Suite, SuiteCase};
use super::verdict::{CaseReport, Verdict};
use crate::failure::{Exit, Failure};
use crate::output;

/// The suite that is listed and run, and the folder for the files of bad cases; without one they leave none.
const SUITE: &str = "AFTERLIGHT_SUITE";
const EVIDENCE: &str = "AFTERLIGHT_EVIDENCE";
const DEVICE: &str = "AFTERLIGHT_DEVICE";

/// List and run a suite's cases as a googletest program does, for runners that know that protocol
#[derive(Debug, clap::Args)]
#[command(after_help = "\
`afterlight-gtest` is the same as a program without arguments, for deqp-runner's [[gtest]].

Variables:
  AFTERLIGHT_SUITE     the suite: smoke, quick, full, soak, or a file [default: quick]
  AFTERLIGHT_DEVICE    the device, as --device takes it [default: auto]
  AFTERLIGHT_EVIDENCE  a folder in which cases leave pictures, plans and shaders

Examples:
  afterlight gtest --gtest_list_tests
  afterlight gtest --gtest_filter=paths.loop")]
pub struct Args {
    /// Print the names of all tests, and run none
    #[arg(long = "gtest_list_tests")]
    list: bool,
    /// Run the tests whose names match: patterns with * and ?, between colons; those behind a minus sign are left out
    #[arg(long = "gtest_filter", value_name = "PATTERNS", default_value = "*", value_parser = TestFilter::parse)]
    filter: TestFilter,
}

/// googletest's filter.
#[derive(Debug, Clone)]
struct TestFilter {
    taken: Vec<Regex>,
    left_out: Vec<Regex>,
}

impl TestFilter {
    fn parse(text: &str) -> Result<Self, String> {
        let (taken, left_out) =
            text.split_once('-').filter(|(before, _)| before.is_empty() || before.ends_with(':')).map_or_else(
                || text.split_once(":-").map_or((text, ""), |(taken, out)| (taken, out)),
                |(taken, out)| (taken.trim_end_matches(':'), out),
            );
        let patterns = |text: &str| -> Result<Vec<Regex>, String> {
            let patterns = text.split(':').filter(|pattern| !pattern.is_empty());
            patterns.map(|pattern| pattern_of(pattern).map_err(|error| error.to_string())).collect()
        };
        Ok(Self { taken: patterns(if taken.is_empty() { "*" } else { taken })?, left_out: patterns(left_out)? })
    }

    fn takes(&self, name: &str) -> bool {
        let any = |patterns: &[Regex]| patterns.iter().any(|pattern| pattern.is_match(name));
        any(&self.taken) && !any(&self.left_out)
    }
}

fn pattern_of(pattern: &str) -> Result<Regex, regex::Error> {
    let escaped = regex::escape(pattern).replace("\\*", ".*").replace("\\?", ".");
    Regex::new(&format!("^{escaped}$"))
}

/// Lists or runs the tests.
///
/// # Errors
/// When the suite cannot be read, and [`Exit::FailedCheck`] where a test failed.
pub fn run(args: &Args) -> Result<(), Failure> {
    let variable = |name: &str| env::var(name).ok().filter(|value| !value.is_empty());
    let suite = Suite::open(&variable(SUITE).unwrap_or_else(|| "quick".into()))?;
    let cases: Vec<&SuiteCase> = suite.cases.iter().filter(|case| args.filter.takes(&case.name)).collect();
    if args.list {
        return output::print(&list(&cases), false);
    }
    let device: DeviceChoice = variable(DEVICE).unwrap_or_default().parse().unwrap_or_default();
    let place = CaseContext { device: &device, baseline: None, is_shared: true };
    let evidence = variable(EVIDENCE).map(PathBuf::from);
    say(&format!("[==========] Running {}.\n", counted(cases.len(), "test")))?;
    let mut failed = Vec::new();
    for case in &cases {
        say(&format!("[ RUN      ] {}\n", case.name))?;
        let folder = evidence.as_ref().map(|folder| folder.join(&case.name));
        if let Some(folder) = &folder {
            output::make_folder(folder)?;
        }
        let begun = Instant::now();
        let report = examine::examine(case, &place, &EvidenceFolder::new(folder));
        say(&result_lines(&report, begun.elapsed().as_millis()))?;
        if report.verdict.is_bad() {
            failed.push(case.name.as_str());
        }
    }
    let passed = cases.len() - failed.len();
    say(&format!("[==========] {} ran.\n[  PASSED  ] {}.\n", counted(cases.len(), "test"), counted(passed, "test")))?;
    match failed.as_slice() {
        [] => Ok(()),
        _ => Err(Failure::new(
            Exit::FailedCheck,
            format!("{} failed: {}", counted(failed.len(), "test"), failed.join(", ")),
        )),
    }
}

/// Writes at once: the runner watches the tests as they begin.
fn say(text: &str) -> Result<(), Failure> {
    output::write_stdout(text.as_bytes())
}

fn result_lines(report: &CaseReport, milliseconds: u128) -> String {
    let (name, reason) = (&report.case, report.reason.as_deref().unwrap_or_default());
    match report.verdict {
        Verdict::Pass => format!("[       OK ] {name} ({milliseconds} ms)\n"),
        Verdict::Skip => format!("{reason}\n[  SKIPPED ] {name} ({milliseconds} ms)\n"),
        verdict => format!("{verdict:?}: {reason}\n[  FAILED  ] {name} ({milliseconds} ms)\n"),
    }
}

fn list(cases: &[&SuiteCase]) -> String {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for case in cases {
        let (group, name) = case.name.split_once('.').unwrap_or(("", &case.name));
        match groups.iter_mut().find(|(own, _)| *own == group) {
            Some((_, names)) => names.push(name),
            None => groups.push((group, vec![name])),
        }
    }
    let lines = groups.into_iter().map(|(group, names)| {
        let names: String = names.into_iter().map(|name| format!("  {name}\n")).collect();
        format!("{group}.\n{names}")
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_those_of_googletest() {
        let takes = |filter: &str, name: &str| TestFilter::parse(filter).expect("a filter").takes(name);
        for (filter, name, expected) in [
            ("*", "paths.loop", true),
            ("paths.loop", "paths.loop", true),
            ("paths.loop", "paths.loops", false),
            ("paths.*:looks.aces", "looks.aces", true),
            ("paths.l??p", "paths.loop", true),
            ("paths.per-light", "paths.per-light", true),
            ("*:-paths.*", "paths.loop", false),
            ("-paths.*", "looks.aces", true),
            ("-paths.*", "paths.loop", false),
            ("paths.*:-paths.loop:paths.tiled", "paths.tiled", false),
            ("pathsXloop", "paths.loop", false),
        ] {
            assert_eq!(takes(filter, name), expected, "{filter} {name}");
        }
    }

    #[test]
    fn a_list_is_indented_below_its_groups_and_has_no_dot_in_a_name() {
        let suite = Suite::open("quick").expect("it is shipped");
        let text = list(&suite.cases.iter().collect::<Vec<_>>());
        for line in text.lines() {
            assert_eq!(line.starts_with("  "), !line.ends_with('.'), "{line}");
            assert!(!line.trim_end_matches('.').contains('.'), "{line}");
        }
    }
}
