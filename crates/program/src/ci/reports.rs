//! Reports of a run, for programs and for people: JSON lines, JUnit's XML, a table in Markdown.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

use afterlight::scene::counted;
use quick_junit::{NonSuccessKind, Property, Report, TestCase, TestCaseStatus, TestRerun, TestSuite};
use serde::Serialize;

use super::verdict::{CaseReport, CheckOutcome, Status, Verdict};
use crate::failure::{Exit, Failure};
use crate::table::TextTable;

/// A line of `results.jsonl`.
#[derive(Serialize)]
struct ResultRecord<'a> {
    status: String,
    #[serde(flatten)]
    report: &'a CaseReport,
    bundle: Option<String>,
}

/// A case with its status and its bundle, if it has one.
pub struct CaseResult<'a> {
    pub status: Status,
    pub report: &'a CaseReport,
    pub bundle: Option<&'a Path>,
}

/// One JSON object a line.
pub fn json_lines(judged: &[CaseResult]) -> Result<String, Failure> {
    let line = |own: &CaseResult| {
        let bundle = own.bundle.map(|path| path.display().to_string());
        let line = ResultRecord { status: own.status.name(), report: own.report, bundle };
        let cannot = |error| Failure::new(Exit::BadInput, format!("cannot write a verdict as JSON: {error}"));
        Ok(serde_json::to_string(&line).map_err(cannot)? + "\n")
    };
    judged.iter().map(line).collect()
}

/// A suite for each group. An expected failure is a skipped test there, as JUnit has no word for it.
pub fn junit(suite: &str, judged: &[CaseResult]) -> Result<String, Failure> {
    let mut groups: BTreeMap<&str, TestSuite> = BTreeMap::new();
    for own in judged {
        let (group, name) = own.report.case.split_once('.').unwrap_or(("", &own.report.case));
        groups.entry(group).or_insert_with(|| TestSuite::new(group)).add_test_case(test_case(name, group, own));
    }
    let mut report = Report::new(format!("afterlight ci {suite}"));
    report.add_test_suites(groups.into_values());
    report.to_string().map_err(|error| Failure::new(Exit::BadInput, format!("cannot write JUnit XML: {error}")))
}

fn test_case(name: &str, group: &str, own: &CaseResult) -> TestCase {
    let report = own.report;
    let reason = report.reason.clone().unwrap_or_default();
    let kind = match report.verdict {
        Verdict::Fail => NonSuccessKind::Failure,
        _ => NonSuccessKind::Error,
    };
    let mut status = match own.status {
        Status::Pass => TestCaseStatus::success(),
        Status::Flake | Status::KnownFlake => {
            let mut rerun = TestRerun::new(kind);
            rerun.set_type(format!("{:?}", report.verdict)).set_message(reason.clone());
            let mut status = TestCaseStatus::success();
            status.add_rerun(rerun);
            status
        }
        Status::Skip | Status::ExpectedFail => TestCaseStatus::skipped(),
        Status::Fail | Status::Crash | Status::Timeout | Status::UnexpectedImprovement(_) => {
            TestCaseStatus::non_success(kind)
        }
    };
    if own.status != Status::Pass {
        let improved = "the baseline says that it fails: take it out of there".to_owned();
        let is_improved = matches!(own.status, Status::UnexpectedImprovement(_));
        status.set_type(own.status.name()).set_message(if is_improved { improved } else { reason });
        status.set_description(findings(report));
    }
    let mut case = TestCase::new(name, status);
    case.set_classname(group).set_time(Duration::from_secs_f64(report.seconds));
    case.add_property(Property::new("verdict", format!("{:?}", report.verdict)));
    case.add_property(Property::new("device", report.on.device.as_str()));
    case.add_property(Property::new("driver", report.on.driver.as_str()));
    if let Some(bundle) = own.bundle {
        // As Jenkins and GitLab read it.
        case.set_system_out(format!("[[ATTACHMENT|{}]]", bundle.display()));
    }
    case
}

/// A line for each check.
fn findings(report: &CaseReport) -> String {
    report.findings.iter().fold(String::new(), |mut text, finding| {
        let outcome = match finding.outcome {
            CheckOutcome::Held => "held",
            CheckOutcome::Failed => "FAILED",
            CheckOutcome::Skipped => "skipped",
        };
        let _ = writeln!(text, "{outcome} {}: {}", finding.check.name(), finding.detail);
        text
    })
}

/// The number of cases with each status, as `12 Pass, 1 Fail`.
pub fn counts(judged: &[CaseResult]) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for own in judged {
        let name = match own.status {
            Status::UnexpectedImprovement(_) => "UnexpectedImprovement".to_owned(),
            status => status.name(),
        };
        *counts.entry(name).or_default() += 1;
    }
    let passed = counts.remove("Pass").unwrap_or_default();
    let others = counts.into_iter().map(|(name, count)| format!(", {count} {name}"));
    format!("{passed} Pass{}", others.collect::<String>())
}

/// A line for each reason for which checks could not be made, with their number: a machine without a validation layer is told of, and fails nothing.
pub fn skipped_checks(judged: &[CaseResult]) -> Vec<String> {
    let mut reasons: BTreeMap<&str, usize> = BTreeMap::new();
    let findings = judged.iter().flat_map(|own| &own.report.findings);
    for finding in findings.filter(|finding| finding.outcome == CheckOutcome::Skipped) {
        *reasons.entry(&finding.detail).or_default() += 1;
    }
    let line = |(reason, count): (&str, usize)| {
        format!("{} {} skipped: {reason}", counted(count, "check"), if count == 1 { "was" } else { "were" })
    };
    reasons.into_iter().map(line).collect()
}

/// Everything but passes, for a terminal.
pub fn table(judged: &[CaseResult]) -> String {
    let mut table = TextTable::new();
    for own in judged.iter().filter(|own| own.status != Status::Pass) {
        let reason = own.report.reason.clone().unwrap_or_default();
        table.row([own.status.name(), own.report.case.clone(), reason]);
    }
    table.render()
}

/// Returns the results in Markdown, as a step of a GitHub workflow shows them.
pub fn markdown(suite: &str, seconds: f64, judged: &[CaseResult], changes: &[String]) -> String {
    let on = judged.iter().map(|own| &own.report.on).find(|on| !on.device.is_empty());
    let on = on.map_or_else(String::new, |on| format!(" on {} ({})", on.device, on.driver));
    let mut text = format!("## afterlight ci {suite}\n\n{} in {seconds:.0} s{on}\n", counts(judged));
    let mut told = judged.iter().filter(|own| own.status != Status::Pass).peekable();
    if told.peek().is_some() {
        text.push_str("\n| status | case | why |\n|---|---|---|\n");
        for own in told {
            let reason = own.report.reason.as_deref().unwrap_or_default().replace('|', "\\|").replace('<', "&lt;");
            let _ = writeln!(text, "| {} | {} | {reason} |", own.status.name(), own.report.case);
        }
    }
    let skipped: Vec<String> = skipped_checks(judged);
    if !skipped.is_empty() {
        text.push('\n');
        text.extend(skipped.iter().map(|line| format!("- {line}\n")));
    }
    if !changes.is_empty() {
        text.push_str("\n### What changed\n\n");
        text.extend(changes.iter().map(|change| format!("- {change}\n")));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::verdict::CheckKind;
    use super::*;

    fn reports() -> Vec<CaseReport> {
        let mut failed = CaseReport::new("paths.loop");
        failed.hold(CheckKind::Truth, false, "mean error 0.2 <b> & | \u{1}".into());
        failed.seconds = 1.5;
        let flaky = CaseReport {
            verdict: Verdict::Flake,
            reason: Some("first Crash".into()),
            ..CaseReport::new("paths.tiled")
        };
        let skipped =
            CaseReport { verdict: Verdict::Skip, reason: Some("lacks".into()), ..CaseReport::new("looks.aces") };
        vec![CaseReport::new("paths.plain"), failed, flaky, skipped]
    }

    fn judged(reports: &[CaseReport]) -> Vec<CaseResult<'_>> {
        let bundle =
            |report: &CaseReport| (report.verdict == Verdict::Fail).then_some(Path::new("out/bundles/paths.loop"));
        reports
            .iter()
            .map(|report| CaseResult { status: report.verdict.status(), report, bundle: bundle(report) })
            .collect()
    }

    #[test]
    fn junit_has_a_suite_a_group_with_skips_reruns_and_attachments() {
        let reports = reports();
        let xml = junit("smoke", &judged(&reports)).expect("XML");
        let document = roxmltree::Document::parse(&xml).unwrap_or_else(|error| panic!("{error}: {xml}"));
        let suites: Vec<_> = document.root_element().children().filter(|node| node.has_tag_name("testsuite")).collect();
        let names: Vec<_> = suites.iter().filter_map(|suite| suite.attribute("name")).collect();
        assert_eq!(names, ["looks", "paths"]);
        assert_eq!((suites[1].attribute("tests"), suites[1].attribute("failures")), (Some("3"), Some("1")));
        assert_eq!(suites[0].attribute("disabled").or(suites[0].attribute("skipped")), Some("1"));
        for part in ["failure", "flakyError", "skipped"] {
            assert!(document.descendants().any(|node| node.has_tag_name(part)), "{part}: {xml}");
        }
        assert!(xml.contains("[[ATTACHMENT|out/bundles/paths.loop]]"), "{xml}");
    }

    #[test]
    fn json_lines_are_an_object_each() {
        let reports = reports();
        let text = json_lines(&judged(&reports)).expect("JSON");
        let lines: Vec<serde_json::Value> =
            text.lines().map(|line| serde_json::from_str(line).expect("an object")).collect();
        assert_eq!(lines.len(), 4);
        assert_eq!((&lines[1]["status"], &lines[1]["verdict"]), (&"Fail".into(), &"Fail".into()));
        assert_eq!(lines[1]["findings"][0]["outcome"], "failed");
        assert_eq!(lines[1]["bundle"], "out/bundles/paths.loop");
    }

    #[test]
    fn markdown_tells_what_is_not_a_pass() {
        let reports = reports();
        let text = markdown("smoke", 12.0, &judged(&reports), &["paths.loop: Pass before, Fail now".into()]);
        assert!(text.contains("1 Pass, 1 Fail, 1 Flake, 1 Skip in 12 s"), "{text}");
        assert!(text.contains("| Fail | paths.loop | truth: mean error 0.2 &lt;b> & \\| \u{1} |"), "{text}");
        assert!(text.contains("- paths.loop: Pass before, Fail now"), "{text}");
    }
}
