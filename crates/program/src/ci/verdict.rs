//! Verdicts on cases, and the findings that lead to them.

use serde::{Deserialize, Serialize};

/// The verdict on a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// All checks hold.
    Pass,
    /// A check failed; the findings say which.
    Fail,
    /// The process ended without a verdict.
    Crash,
    /// The process was stopped.
    Timeout,
    /// The device was lost.
    Lost,
    /// The device or the system ran out of memory.
    OutOfMemory,
    /// The device lacks something that the case needs.
    Skip,
    /// A repeat had another verdict.
    Flake,
}

impl Verdict {
    /// The status that deqp-runner has for it: a lost device is a crash there, and a lack of memory a failure.
    pub fn status(self) -> Status {
        match self {
            Self::Pass => Status::Pass,
            Self::Fail | Self::OutOfMemory => Status::Fail,
            Self::Crash | Self::Lost => Status::Crash,
            Self::Timeout => Status::Timeout,
            Self::Skip => Status::Skip,
            Self::Flake => Status::Flake,
        }
    }

    /// Returns true for verdicts after which the case is run again, to tell a flake from a fault.
    pub fn is_bad(self) -> bool {
        !matches!(self, Self::Pass | Self::Skip | Self::Flake)
    }
}

/// A status as deqp-runner writes it into its CSV files, by comparison with the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    Pass,
    Fail,
    Skip,
    Crash,
    Timeout,
    /// A repeat had another verdict.
    Flake,
    /// A flake of a case that is known to flake.
    KnownFlake,
    /// It failed as the baseline says.
    ExpectedFail,
    /// It did not fail as the baseline says; how it fares now.
    UnexpectedImprovement(&'static str),
}

impl Status {
    /// Returns deqp-runner's word for it.
    pub fn name(self) -> String {
        match self {
            Self::UnexpectedImprovement(now) => format!("UnexpectedImprovement({now})"),
            other => format!("{other:?}"),
        }
    }

    /// Parses a status of a CSV file; `None` for a word that deqp-runner does not write. An `UnexpectedImprovement(X)` becomes X.
    pub fn parse(word: &str) -> Option<Self> {
        let word = word.strip_prefix("UnexpectedImprovement(").and_then(|now| now.strip_suffix(')')).unwrap_or(word);
        Some(match word {
            "Pass" | "Warn" => Self::Pass,
            "Fail" | "Missing" => Self::Fail,
            "Skip" => Self::Skip,
            "Crash" => Self::Crash,
            "Timeout" => Self::Timeout,
            "Flake" => Self::Flake,
            "KnownFlake" => Self::KnownFlake,
            "ExpectedFail" => Self::ExpectedFail,
            _ => return None,
        })
    }

    /// Returns the status in view of the baseline's, by deqp-runner's rules.
    pub fn against(self, baseline: Option<Self>) -> Self {
        use Status::{Crash, ExpectedFail, Fail, Pass, Skip, Timeout, UnexpectedImprovement};
        let Some(baseline) = baseline else { return self };
        match (self, baseline) {
            (Fail, Fail | ExpectedFail) | (Crash, Crash | ExpectedFail) | (Timeout, Timeout) => ExpectedFail,
            (Fail, Crash | Timeout) => UnexpectedImprovement("Fail"),
            (Pass, Fail | Crash | Timeout) => UnexpectedImprovement("Pass"),
            (Skip, Fail | Crash | Timeout) => UnexpectedImprovement("Skip"),
            _ => self,
        }
    }

    /// Returns true if it leaves the run's exit code at 0.
    pub fn is_expected(self) -> bool {
        !matches!(self, Self::Fail | Self::Crash | Self::Timeout | Self::UnexpectedImprovement(_))
    }

    /// Returns true if it is worse than expected.
    pub fn is_regression(self) -> bool {
        matches!(self, Self::Fail | Self::Crash | Self::Timeout)
    }
}

/// The subject of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckKind {
    /// The case can be drawn at all.
    Drawing,
    Determinism,
    /// Against the baseline's.
    Picture,
    Truth,
    LayerMessage,
    ResourcesLeft,
    Memory,
    Resizes,
    /// Frames as a window has them.
    Window,
    Time,
}

/// The outcome of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CheckOutcome {
    Held,
    Failed,
    /// It could not be made here.
    Skipped,
}

/// A check that was made, or could not be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub check: CheckKind,
    pub outcome: CheckOutcome,
    /// One line: the measured value and its bound, or the reason for having none.
    pub detail: String,
}

/// The device and driver that drew a case.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Where {
    pub device: String,
    pub driver: String,
}

/// The result of a case, as its process reports it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseReport {
    pub case: String,
    pub verdict: Verdict,
    /// One line: why it is not a pass.
    pub reason: Option<String>,
    pub findings: Vec<Finding>,
    #[serde(flatten)]
    pub on: Where,
    pub seconds: f64,
    /// Median of the device's time for a frame.
    pub gpu_ms: Option<f64>,
    /// BLAKE3 of the picture's pixels.
    pub picture: Option<String>,
}

impl CaseReport {
    /// Begins a report: a pass without findings.
    pub fn new(case: &str) -> Self {
        Self {
            case: case.to_owned(),
            verdict: Verdict::Pass,
            reason: None,
            findings: Vec::new(),
            on: Where::default(),
            seconds: 0.0,
            gpu_ms: None,
            picture: None,
        }
    }

    /// Makes a report for a case whose process left no verdict.
    pub fn ended(case: &str, verdict: Verdict, reason: String) -> Self {
        Self { verdict, reason: Some(reason), ..Self::new(case) }
    }

    /// Notes how a check went. The first that fails is the reason.
    pub fn note(&mut self, check: CheckKind, outcome: CheckOutcome, detail: String) {
        if outcome == CheckOutcome::Failed && self.verdict == Verdict::Pass {
            self.verdict = Verdict::Fail;
            self.reason = Some(format!("{}: {detail}", check.name()));
        }
        self.findings.push(Finding { check, outcome, detail });
    }

    pub fn hold(&mut self, check: CheckKind, holds: bool, detail: String) {
        self.note(check, if holds { CheckOutcome::Held } else { CheckOutcome::Failed }, detail);
    }

    pub fn skip(&mut self, check: CheckKind, why: impl Into<String>) {
        self.note(check, CheckOutcome::Skipped, why.into());
    }
}

impl CheckKind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Drawing => "drawing",
            Self::Determinism => "determinism",
            Self::Picture => "picture",
            Self::Truth => "truth",
            Self::LayerMessage => "layer message",
            Self::ResourcesLeft => "resources left",
            Self::Memory => "memory",
            Self::Resizes => "resizes",
            Self::Window => "window",
            Self::Time => "time",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statuses_meet_baselines_by_the_rules_of_deqp_runner() {
        use Status::{Crash, ExpectedFail, Fail, Flake, Pass, Skip, Timeout, UnexpectedImprovement};
        let rules = [
            (Fail, None, Fail),
            (Fail, Some(Fail), ExpectedFail),
            (Fail, Some(ExpectedFail), ExpectedFail),
            (Fail, Some(Crash), UnexpectedImprovement("Fail")),
            (Fail, Some(Timeout), UnexpectedImprovement("Fail")),
            (Fail, Some(Pass), Fail),
            (Pass, Some(Fail), UnexpectedImprovement("Pass")),
            (Pass, Some(Flake), Pass),
            (Crash, Some(Crash), ExpectedFail),
            (Crash, Some(Fail), Crash),
            (Timeout, Some(Timeout), ExpectedFail),
            (Timeout, Some(Crash), Timeout),
            (Skip, Some(Crash), UnexpectedImprovement("Skip")),
            (Flake, Some(Fail), Flake),
        ];
        for (now, baseline, expected) in rules {
            assert_eq!(now.against(baseline), expected, "{now:?} against {baseline:?}");
        }
        for status in [Pass, Fail, Skip, Crash, Timeout, Flake, Status::KnownFlake, ExpectedFail] {
            assert_eq!(Status::parse(&status.name()), Some(status));
        }
        assert_eq!(Status::parse("UnexpectedImprovement(Pass)"), Some(Pass));
        assert_eq!(Status::parse("Passed"), None);
    }

    #[test]
    fn the_first_failed_check_is_the_reason() {
        let mut report = CaseReport::new("a.b");
        report.hold(CheckKind::Determinism, true, "2 pictures are equal".into());
        report.skip(CheckKind::Picture, "no baseline");
        assert_eq!((report.verdict, &report.reason), (Verdict::Pass, &None));
        report.hold(CheckKind::Truth, false, "mean .2, at most .1".into());
        report.hold(CheckKind::Memory, false, "grew".into());
        assert_eq!(report.verdict, Verdict::Fail);
        assert_eq!(report.reason.as_deref(), Some("truth: mean .2, at most .1"));
        let json = serde_json::to_string(&report).expect("JSON");
        assert_eq!(serde_json::from_str::<CaseReport>(&json).expect("read back"), report);
    }
}
