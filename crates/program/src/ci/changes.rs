//! Differences from an earlier run.

use std::collections::BTreeMap;
use std::path::Path;

use afterlight_files::regular_file::read_regular;

use super::reports::CaseResult;
use super::results::{self, MOST_BYTES};
use super::verdict::{CaseReport, Status};
use crate::failure::{Exit, Failure};

/// A frame's time is told of as another from here on: the ratio of both.
const TOLD_RATIO: f64 = 1.2;

/// An earlier run.
pub struct Earlier {
    statuses: BTreeMap<String, Status>,
    /// The reports of its `results.jsonl`, by case; none where that file is not there.
    reports: BTreeMap<String, CaseReport>,
}

impl Earlier {
    /// From a run's folder, or a `results.csv` alone.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        if !path.is_dir() {
            return Ok(Self { statuses: results::read(path)?, reports: BTreeMap::new() });
        }
        let statuses = results::read(&path.join("results.csv"))?;
        let file = path.join("results.jsonl");
        let mut reports = BTreeMap::new();
        if let Ok(text) = read_regular(&file, MOST_BYTES) {
            for (index, line) in String::from_utf8_lossy(&text).lines().enumerate() {
                let report: CaseReport = serde_json::from_str(line).map_err(|error| {
                    Failure::new(Exit::BadInput, format!("{}:{}: {error}", file.display(), index + 1))
                })?;
                reports.insert(report.case.clone(), report);
            }
        }
        Ok(Self { statuses, reports })
    }

    /// Returns a line for each difference.
    pub fn changes(&self, judged: &[CaseResult]) -> Vec<String> {
        let mut changes = Vec::new();
        for CaseResult { status, report, .. } in judged {
            let case = &report.case;
            match self.statuses.get(case) {
                None => changes.push(format!("{case}: new, {}", status.name())),
                Some(before) if before.name() != status.name() => {
                    changes.push(format!("{case}: {} before, {} now", before.name(), status.name()));
                }
                Some(_) => {}
            }
            let Some(before) = self.reports.get(case) else { continue };
            if let (Some(one), Some(other)) = (&before.picture, &report.picture)
                && one != other
            {
                changes.push(format!("{case}: another picture"));
            }
            if let (Some(one), Some(other)) = (before.gpu_ms, report.gpu_ms)
                && !(1.0 / TOLD_RATIO..TOLD_RATIO).contains(&(other / one))
            {
                changes.push(format!("{case}: {other:.3} ms a frame, {:.2} times as long", other / one));
            }
        }
        let is_here = |case: &str| judged.iter().any(|own| own.report.case == case);
        changes.extend(self.statuses.keys().filter(|case| !is_here(case)).map(|case| format!("{case}: not tried")));
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::super::verdict::Verdict;
    use super::*;

    fn report(case: &str, verdict: Verdict, picture: &str, gpu_ms: f64) -> CaseReport {
        CaseReport { verdict, picture: Some(picture.into()), gpu_ms: Some(gpu_ms), ..CaseReport::new(case) }
    }

    #[test]
    fn statuses_pictures_and_times_that_are_others_are_told() {
        let earlier = Earlier {
            statuses: [("a.b", Status::Pass), ("c.d", Status::Pass), ("e.f", Status::Skip)]
                .map(|(case, status)| (case.to_owned(), status))
                .into(),
            reports: [report("a.b", Verdict::Pass, "one", 1.0), report("c.d", Verdict::Pass, "two", 1.0)]
                .map(|report| (report.case.clone(), report))
                .into(),
        };
        let now = [
            report("a.b", Verdict::Crash, "one", 1.1),
            report("c.d", Verdict::Pass, "other", 1.5),
            CaseReport::new("g.h"),
        ];
        let judged: Vec<_> =
            now.iter().map(|report| CaseResult { status: report.verdict.status(), report, bundle: None }).collect();
        assert_eq!(
            earlier.changes(&judged),
            [
                "a.b: Pass before, Crash now",
                "c.d: another picture",
                "c.d: 1.500 ms a frame, 1.50 times as long",
                "g.h: new, Pass",
                "e.f: not tried",
            ]
        );
    }
}
