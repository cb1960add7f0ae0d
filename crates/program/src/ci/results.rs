//! deqp-runner's files: results and baselines as `CASE,STATUS[,SECONDS]`, skips and flakes as regular expressions, one a line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use afterlight_files::regular_file::read_given;
use regex::RegexSet;

use super::verdict::{CaseReport, Status};
use crate::failure::{Exit, Failure};

/// Expected statuses, and the cases to skip.
#[derive(Debug, Default)]
pub struct Expectations {
    pub failures: BTreeMap<String, Status>,
    pub skips: Option<RegexSet>,
    pub flakes: Option<RegexSet>,
}

impl Expectations {
    pub fn skips(&self, case: &str) -> bool {
        self.skips.as_ref().is_some_and(|set| set.is_match(case))
    }

    /// Returns the status of a case, by comparison with its expected one.
    pub fn status(&self, report: &CaseReport) -> Status {
        let is_known = || self.flakes.as_ref().is_some_and(|set| set.is_match(&report.case));
        let status = report.verdict.status().against(self.failures.get(&report.case).copied());
        let is_flaky = status == Status::Flake || !status.is_expected();
        if is_flaky && is_known() { Status::KnownFlake } else { status }
    }
}

/// The most bytes of a file that this command is given.
pub const MOST_BYTES: u64 = 64 << 20;

/// The lines of a file that say something, with their numbers. It may be a pipe.
pub fn lines(path: &Path) -> Result<Vec<(usize, String)>, Failure> {
    let cannot = |why: String| Failure::new(Exit::BadInput, format!("cannot read {}: {why}", path.display()));
    let bytes = read_given(path, MOST_BYTES).map_err(|error| cannot(error.to_string()))?;
    let text =
        String::from_utf8(bytes).map_err(|error| cannot(format!("it is not UTF-8 text ({})", error.utf8_error())))?;
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    Ok(lines.map(|(index, line)| (index + 1, line.to_owned())).collect())
}

pub fn bad(path: &Path, line: usize, why: &str) -> Failure {
    Failure::new(Exit::BadInput, format!("{}:{line}: {why}", path.display()))
}

/// Statuses by case, from a file that this program or deqp-runner has written.
///
/// # Errors
/// When it cannot be read, or a line is none of theirs.
pub fn read(path: &Path) -> Result<BTreeMap<String, Status>, Failure> {
    let mut statuses = BTreeMap::new();
    for (line, text) in lines(path)? {
        let mut fields = text.split(',');
        let (Some(case), Some(word)) = (fields.next(), fields.next()) else {
            return Err(bad(path, line, "expected CASE,STATUS, as in deqp-runner's failures.csv"));
        };
        let status = Status::parse(word).ok_or_else(|| bad(path, line, &format!("\"{word}\" is no status")))?;
        if statuses.insert(case.to_owned(), status).is_some() {
            return Err(bad(path, line, &format!("{case} stands there twice")));
        }
    }
    Ok(statuses)
}

/// The regular expressions of all files; `None` without any.
///
/// # Errors
/// When a file cannot be read, or a line is no regular expression.
pub fn expressions(paths: &[PathBuf]) -> Result<Option<RegexSet>, Failure> {
    let mut all = Vec::new();
    for path in paths {
        for (line, text) in lines(path)? {
            if text.rsplit_once(',').is_some_and(|(_, word)| Status::parse(word).is_some()) {
                return Err(bad(path, line, "a regular expression is expected, and this line is one of results"));
            }
            // A plain name means itself: its dots are dots.
            let is_name = text.chars().all(|c| c.is_ascii_alphanumeric() || "._-/,#".contains(c));
            let expression = if is_name { text.replace('.', "\\.") } else { text };
            if let Err(error) = regex::Regex::new(&expression) {
                let why = error.to_string().lines().last().unwrap_or_default().trim().to_owned();
                return Err(bad(path, line, &format!("no regular expression: {why}")));
            }
            all.push(expression);
        }
    }
    let set = RegexSet::new(&all).map_err(|error| Failure::new(Exit::BadInput, error.to_string()))?;
    Ok((!all.is_empty()).then_some(set))
}

/// `results.csv`, in the order of names.
pub fn results(judged: &[(Status, &CaseReport)]) -> String {
    sorted(judged)
        .map(|(status, report)| format!("{},{},{}\n", report.case, status.name(), report.seconds as f32))
        .collect()
}

/// `failures.csv`: unexpected results, and with `all` expected failures, too.
pub fn failures(judged: &[(Status, &CaseReport)], all: bool) -> String {
    let is_told = |status: Status| !status.is_expected() || all && status == Status::ExpectedFail;
    let told = sorted(judged).filter(|(status, _)| is_told(*status));
    told.map(|(status, report)| format!("{},{}\n", report.case, status.name())).collect()
}

fn sorted<'a>(judged: &[(Status, &'a CaseReport)]) -> impl Iterator<Item = (Status, &'a CaseReport)> {
    let mut sorted = judged.to_vec();
    sorted.sort_by(|one, other| one.1.case.cmp(&other.1.case));
    sorted.into_iter()
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use tempfile::NamedTempFile;

    use super::super::verdict::Verdict;
    use super::*;

    fn file(text: &str) -> NamedTempFile {
        let mut file = NamedTempFile::new().expect("a temporary file");
        file.write_all(text.as_bytes()).expect("written");
        file
    }

    #[test]
    fn baselines_are_read_and_bad_lines_are_named() {
        let good = file("# known\n\na.b,Fail\nc.d,Crash,1.25\ne.f,UnexpectedImprovement(Pass)\n");
        let read_back = read(good.path()).expect("read");
        assert_eq!(read_back["a.b"], Status::Fail);
        assert_eq!((read_back["c.d"], read_back["e.f"]), (Status::Crash, Status::Pass));
        for (text, part) in
            [("a.b\n", ":1: expected CASE,STATUS"), ("#\na,Odd\n", ":2: \"Odd\""), ("a,Fail\na,Fail\n", ":2: a stands")]
        {
            let bad = file(text);
            let message = read(bad.path()).expect_err(text).one_line();
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn expressions_match_as_deqp_runner_has_them() {
        let skips = file("# slow\nsoak\\..*\npaths.loop\n");
        let set = expressions(&[skips.path().to_owned()]).expect("read").expect("two");
        assert!(set.is_match("soak.hall") && set.is_match("paths.loop") && !set.is_match("paths-loop"));
        for text in ["a.b,Fail\n", "(\n"] {
            let bad = file(text);
            assert!(expressions(&[bad.path().to_owned()]).is_err(), "{text}");
        }
        assert!(expressions(&[]).expect("no file").is_none());
    }

    #[test]
    fn results_are_sorted_and_failures_are_what_nobody_expects() {
        let report = |name: &str, verdict| CaseReport { verdict, seconds: 0.5, ..CaseReport::new(name) };
        let reports = [
            report("b.fails", Verdict::Fail),
            report("a.lost", Verdict::Lost),
            report("c.known", Verdict::Fail),
            report("d.flaky", Verdict::Flake),
            report("e.mended", Verdict::Pass),
            report("f.shaky", Verdict::Timeout),
        ];
        let failures_known = [("c.known", Status::Fail), ("e.mended", Status::Fail)];
        let expectations = Expectations {
            failures: failures_known.map(|(case, status)| (case.to_owned(), status)).into(),
            flakes: Some(RegexSet::new(["shaky"]).expect("an expression")),
            skips: None,
        };
        let judged: Vec<_> = reports.iter().map(|report| (expectations.status(report), report)).collect();
        assert_eq!(
            results(&judged),
            "a.lost,Crash,0.5\nb.fails,Fail,0.5\nc.known,ExpectedFail,0.5\nd.flaky,Flake,0.5\n\
             e.mended,UnexpectedImprovement(Pass),0.5\nf.shaky,KnownFlake,0.5\n"
        );
        assert_eq!(failures(&judged, false), "a.lost,Crash\nb.fails,Fail\ne.mended,UnexpectedImprovement(Pass)\n");
        assert!(failures(&judged, true).contains("c.known,ExpectedFail\n"));
    }
}
