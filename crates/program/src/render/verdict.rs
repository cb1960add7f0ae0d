//! The verdict on each scene that was drawn, for programs: as JSON, and as JUnit's XML.

use std::fmt::Write as _;

use afterlight_lab::report::graph::escape;
use serde::Serialize;

use crate::failure::{Exit, Failure};
use crate::session::{MessageReport, ValidationLog};

/// The output of `--json`; docs/COMMANDS.md has the keys.
#[derive(Debug, Serialize)]
pub struct RenderReport {
    afterlight: &'static str,
    verdict: RenderVerdict,
    scenes: Vec<SceneVerdict>,
}

/// A scene.
#[derive(Debug, Serialize)]
pub struct SceneVerdict {
    scene: String,
    output: String,
    device: Option<String>,
    /// As [`ValidationLog::checks`].
    validation: Option<ValidationReport>,
    seconds: f64,
    verdict: RenderVerdict,
    exit_code: u8,
    error: Option<String>,
    /// The dependency of `--drop`.
    dropped: Option<String>,
    /// The hazards without it, a sentence each.
    hazards: Vec<String>,
    messages: Vec<MessageReport>,
    messages_not_kept: u64,
    /// The messages as people read them.
    #[serde(skip)]
    listing: String,
}

#[derive(Debug, Serialize)]
struct ValidationReport {
    checks: &'static str,
    layer: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum RenderVerdict {
    Passed,
    Failed,
}

impl RenderVerdict {
    fn when(passed: bool) -> Self {
        if passed { Self::Passed } else { Self::Failed }
    }
}

impl SceneVerdict {
    pub fn of(scene: &str, output: &str, seconds: f64, heard: &ValidationLog, outcome: &Result<(), Failure>) -> Self {
        let failure = outcome.as_ref().err();
        Self {
            scene: scene.to_owned(),
            output: output.to_owned(),
            device: heard.device.clone(),
            validation: heard.checks().map(|(checks, layer)| ValidationReport { checks, layer }),
            seconds,
            verdict: RenderVerdict::when(failure.is_none()),
            exit_code: failure.and_then(Failure::exit).map_or(0, Exit::code),
            error: failure.map(Failure::one_line),
            dropped: None,
            hazards: Vec::new(),
            messages: heard.reports(),
            messages_not_kept: heard.dropped,
            listing: heard.listing(),
        }
    }

    /// Adds a dependency that was left out, and the hazards without it.
    pub fn without(mut self, dropped: Option<String>, hazards: Vec<String>) -> Self {
        self.listing.extend(hazards.iter().map(|hazard| format!("{hazard}\n")));
        Self { dropped, hazards, ..self }
    }

    /// Returns true if a check failed; any other failure is an error of JUnit's.
    fn is_failed_check(&self) -> bool {
        self.exit_code == Exit::FailedCheck.code()
    }
}

impl RenderReport {
    pub fn of(scenes: Vec<SceneVerdict>) -> Self {
        let passed = scenes.iter().all(|case| case.verdict == RenderVerdict::Passed);
        Self { afterlight: env!("CARGO_PKG_VERSION"), verdict: RenderVerdict::when(passed), scenes }
    }

    /// One suite with a test case for each scene, as Jenkins, GitLab and others read it.
    pub fn junit(&self) -> String {
        let failed = self.scenes.iter().filter(|case| case.verdict == RenderVerdict::Failed);
        let (failures, errors): (Vec<_>, Vec<_>) = failed.partition(|case| case.is_failed_check());
        let seconds: f64 = self.scenes.iter().map(|case| case.seconds).sum();
        let (tests, failures, errors) = (self.scenes.len(), failures.len(), errors.len());
        let counts = format!("tests=\"{tests}\" failures=\"{failures}\" errors=\"{errors}\" time=\"{seconds:.3}\"");
        let mut xml = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {counts}>\n<testsuite name=\"afterlight render\" {counts}>\n"
        );
        for case in &self.scenes {
            // A line break in an attribute would be read as a blank.
            let (name, seconds) = (escape(&case.scene).replace('\n', "&#10;"), case.seconds);
            let _ = write!(xml, "<testcase classname=\"afterlight.render\" name=\"{name}\" time=\"{seconds:.3}\">");
            if let Some(error) = &case.error {
                let kind = if case.is_failed_check() { "failure" } else { "error" };
                let (error, text) = (escape(error), escape(&case.listing));
                let _ =
                    write!(xml, "<{kind} type=\"exit code {}\" message=\"{error}\">{text}</{kind}>", case.exit_code);
            }
            xml.push_str("</testcase>\n");
        }
        xml + "</testsuite>\n</testsuites>\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn junit_counts_failures_apart_from_errors_and_holds_any_text() {
        let heard = ValidationLog::default();
        let case = |scene: &str, outcome| SceneVerdict::of(scene, "a.png", 0.25, &heard, &outcome);
        let odd = "a <b> & \"c\"\n\u{1}d";
        let report = RenderReport::of(vec![
            case("good", Ok(())),
            case(odd, Err(Failure::new(Exit::FailedCheck, odd))),
            case("bad", Err(Failure::new(Exit::BadInput, "cannot read bad"))),
        ]);
        let xml = report.junit();
        let document = roxmltree::Document::parse(&xml).unwrap_or_else(|error| panic!("{error}: {xml}"));
        let suite = document.root_element().first_element_child().expect("a suite");
        let count = |key| suite.attribute(key).expect("a count");
        assert_eq!(["tests", "failures", "errors", "time"].map(count), ["3", "1", "1", "0.750"]);
        let cases: Vec<_> = suite.children().filter(|node| node.is_element()).collect();
        assert_eq!(cases[1].attribute("name"), Some("a <b> & \"c\"\n\u{fffd}d"));
        let found: Vec<_> =
            cases.iter().map(|case| case.first_element_child().map(|own| own.tag_name().name())).collect();
        assert_eq!(found, [None, Some("failure"), Some("error")]);
        let json = serde_json::to_value(&report).expect("JSON");
        assert_eq!((&json["verdict"], &json["scenes"][0]["verdict"]), (&"failed".into(), &"passed".into()));
        assert_eq!(json["scenes"][2]["exit_code"], 3);
        assert_eq!(json["scenes"][1]["error"], "a <b> & \"c\" \u{1}d", "one line");
    }
}
