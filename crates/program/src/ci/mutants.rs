//! `afterlight ci --mutants`: frames with one dependency, or one bit of one, missing, and the reports of the validation layer at hand.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use afterlight::frame::capabilities;
use afterlight::frame::rows::RowPart;
use afterlight::gpu::{DeviceChoice, PhysicalDevice};
use afterlight::plan::FramePlan;
use afterlight::scene::counted;
use afterlight_lab::mutants::{
    BrokenRules, Laboratory, Miss, Mutant, MutantCase, MutantError, MutantVerdict, PartName, cases, mutants, verdict,
};
use rayon::prelude::*;
use regex::Regex;
use serde::Serialize;

use super::results;
use super::verdict::{CaseReport, Status};
use crate::failure::{Exit, Failure, with_causes};
use crate::output::{self, Sink};
use crate::progress;
use crate::table::version;
use afterlight_lab::report::sweep::model::Shard;

/// The files that are written at the end.
const RESULTS: [&str; 4] = ["results.csv", "failures.csv", "mutants.jsonl", "mutants.md"];

/// The mutants to draw, and the device.
pub struct MutantSelection<'a> {
    pub device: &'a DeviceChoice,
    pub only: Option<&'a Regex>,
    pub shard: Option<Shard>,
    /// Mutants to draw at a time; each mode of the layer draws one.
    pub jobs: usize,
}

/// A mutant with its outcome. `heard` is `None` if the mutant cannot be drawn here.
struct MutantResult<'a> {
    name: String,
    mutant: Mutant<'a>,
    must_follow: BTreeSet<String>,
    heard: Option<(BrokenRules, MutantVerdict)>,
}

impl MutantResult<'_> {
    fn status(&self) -> Status {
        match &self.heard {
            None => Status::Skip,
            Some((_, MutantVerdict::Noticed)) => Status::Pass,
            Some((_, MutantVerdict::ExpectedMiss(_))) => Status::ExpectedFail,
            Some((_, MutantVerdict::UnexpectedMiss)) => Status::Fail,
            Some((_, MutantVerdict::UnexpectedNotice(_))) => Status::UnexpectedImprovement("Pass"),
        }
    }

    fn miss(&self) -> Option<Miss> {
        match self.heard {
            Some((_, MutantVerdict::ExpectedMiss(miss) | MutantVerdict::UnexpectedNotice(miss))) => Some(miss),
            _ => None,
        }
    }
}

/// Draws the mutants, and prints the layer's messages about them or writes them into a folder.
///
/// # Errors
/// [`Exit::FailedCheck`] where the layer misses a mutant without a known reason, [`Exit::Improved`] where it reports one that it was argued to miss.
pub fn run(choice: &MutantSelection, folder: Option<&Path>, quiet: bool) -> Result<(), Failure> {
    let begun = Instant::now();
    if let Some(folder) = folder {
        output::make_folder(folder)?;
        // Old results would be mistaken for the results of this run if it is stopped.
        RESULTS.into_iter().try_for_each(|name| super::remove_file(&folder.join(name)))?;
    }
    let laboratory = Laboratory::open(choice.device)?.with_jobs(choice.jobs);
    let device = capabilities(&laboratory.device().physical);
    let cases = cases();
    let refused =
        |case: &MutantCase, error| Failure::new(Exit::BadInput, format!("cannot plan \"{}\": {error}", case.name));
    let plans: Result<Vec<FramePlan>, Failure> =
        cases.iter().map(|case| case.plan_or_ample(&device).map_err(|error| refused(case, error))).collect();
    let plans = plans?;
    let judged = judge(&laboratory, choice, (&cases, &plans), quiet)?;
    let report = MutationReport { laboratory: &laboratory, judged: &judged, seconds: begun.elapsed().as_secs_f64() };
    match folder {
        Some(folder) => {
            report.write(folder)?;
            if !quiet {
                output::print(&format!("{} -> {}\n", report.line(), folder.display()), false)?;
            }
        }
        None => output::print(&report.markdown(), false)?,
    }
    report.conclude()
}

fn judge<'a>(
    laboratory: &Laboratory,
    choice: &MutantSelection,
    (cases, plans): (&'a [MutantCase], &'a [FramePlan]),
    quiet: bool,
) -> Result<Vec<MutantResult<'a>>, Failure> {
    let named = mutants(cases, plans).into_iter().map(|mutant| (mutant.name(), mutant));
    let named = named.filter(|(name, _)| choice.only.is_none_or(|only| only.is_match(name)));
    let is_own = |index: usize| choice.shard.is_none_or(|shard| shard.owns(index));
    let chosen: Vec<_> = named.enumerate().filter(|(index, _)| is_own(*index)).map(|(_, named)| named).collect();
    if chosen.is_empty() {
        return Err(Failure::new(Exit::BadInput, "no mutant has such a name; `afterlight ci --mutants` names all"));
    }
    let device = capabilities(&laboratory.device().physical);
    let can_be_drawn = |case: &MutantCase| (laboratory.presents() || case.presented.is_none()) && case.is_for(&device);
    let drawn: Vec<Mutant> =
        chosen.iter().map(|(_, mutant)| mutant).filter(|mutant| can_be_drawn(mutant.case)).cloned().collect();
    let is_used = |case: &MutantCase| drawn.iter().any(|mutant| std::ptr::eq(mutant.case, case));
    let whole: Vec<_> = cases.iter().zip(plans).filter(|(case, _)| is_used(case)).collect();
    let what = format!("layer {} on {}", version(laboratory.layer()), laboratory.device().physical.name);
    let bar = progress::shares(what, laboratory.steps(drawn.len()) as u64, quiet);
    let done = AtomicU64::new(0);
    let step = || bar.at(done.fetch_add(1, Ordering::Relaxed) + 1);
    // SAFETY: nothing of these frames is looked at, and the layer speaks of them before the driver runs them. The help text says what a real GPU may make
    // of them.
    let heard = unsafe { laboratory.judge(&whole, &drawn, &step) };
    let mut heard = heard
        .map_err(|error| match error {
            MutantError::Gpu(error) => error.into(),
            error => Failure::new(Exit::FailedCheck, with_causes(&error)),
        })?
        .into_iter();
    drop(bar);
    let layer = laboratory.layer();
    let must_follow = |mutant: &Mutant| mutant.hazards().iter().map(|hazard| hazard.kind.to_string()).collect();
    let must_follow: Vec<BTreeSet<String>> = chosen.par_iter().map(|(_, mutant)| must_follow(mutant)).collect();
    let judged = chosen.into_iter().zip(must_follow).map(|((name, mutant), must_follow)| {
        let heard = if can_be_drawn(mutant.case) { heard.next() } else { None };
        let heard = heard.map(|heard| {
            let verdict = verdict(layer, &mutant, &heard);
            (heard, verdict)
        });
        MutantResult { name, mutant, must_follow, heard }
    });
    Ok(judged.collect())
}

struct MutationReport<'a> {
    laboratory: &'a Laboratory,
    judged: &'a [MutantResult<'a>],
    seconds: f64,
}

/// A line of `mutants.jsonl`.
#[derive(Serialize)]
struct MutantRecord<'a> {
    name: &'a str,
    dependency: &'a str,
    missing: String,
    plan: &'a str,
    /// Rules that the mutant breaks by the specification.
    must_follow: &'a BTreeSet<String>,
    /// The rules that the layer finds broken without its shader heuristic, and with it; null where it was not asked.
    plain: Option<&'a BTreeSet<String>>,
    heuristic: Option<&'a BTreeSet<String>>,
    verdict: String,
    why: Option<&'static str>,
}

/// The mutants of one part of one dependency.
struct MutantGroup<'a> {
    dependency: &'a str,
    part: RowPart,
    mutants: Vec<&'a MutantResult<'a>>,
}

impl<'a> MutationReport<'a> {
    fn write(&self, folder: &Path) -> Result<(), Failure> {
        let of = |own: &MutantResult| {
            let seconds = own.heard.as_ref().map_or(0.0, |(heard, _)| heard.seconds);
            (own.status(), CaseReport { seconds, ..CaseReport::new(&own.name) })
        };
        let reports: Vec<_> = self.judged.iter().map(of).collect();
        let statuses: Vec<_> = reports.iter().map(|(status, report)| (*status, report)).collect();
        let texts =
            [results::results(&statuses), results::failures(&statuses, false), self.json_lines()?, self.markdown()];
        RESULTS.into_iter().zip(texts).try_for_each(|(name, text)| Sink::File(folder.join(name)).write(text.as_bytes()))
    }

    fn json_lines(&self) -> Result<String, Failure> {
        let mut text = String::new();
        for own in self.judged {
            let heard = own.heard.as_ref().map(|(heard, _)| heard);
            let line = MutantRecord {
                name: &own.name,
                dependency: own.mutant.row.name.name(),
                missing: PartName(own.mutant.part).to_string(),
                plan: &own.mutant.case.name,
                must_follow: &own.must_follow,
                plain: heard.map(|heard| &heard.plain),
                heuristic: heard.and_then(|heard| heard.heuristic.as_ref()),
                verdict: own.status().name(),
                why: own.miss().map(Miss::why),
            };
            let line = serde_json::to_string(&line)
                .map_err(|error| Failure::new(Exit::BadInput, format!("cannot write JSON: {error}")))?;
            text += &(line + "\n");
        }
        Ok(text)
    }

    fn physical(&self) -> &PhysicalDevice {
        &self.laboratory.device().physical
    }

    fn count(&self, is_counted: impl Fn(&MutantResult) -> bool) -> usize {
        self.judged.iter().filter(|own| is_counted(own)).count()
    }

    /// `layer 1.4.309: 3706 mutants, ...`.
    fn line(&self) -> String {
        let with = |status| self.count(|own| own.status() == status);
        format!(
            "layer {}: {}, {} noticed, {}, {}, {}, {} not drawn, in {:.0} s",
            version(self.laboratory.layer()),
            counted(self.judged.len(), "mutant"),
            with(Status::Pass),
            counted(with(Status::ExpectedFail), "expected miss"),
            counted(with(Status::Fail), "unexpected miss"),
            counted(with(Status::UnexpectedImprovement("Pass")), "unexpected notice"),
            with(Status::Skip),
            self.seconds
        )
    }

    fn conclude(&self) -> Result<(), Failure> {
        let names = |status| -> Vec<&str> {
            let with = self.judged.iter().filter(|own| own.status() == status);
            with.map(|own| own.name.as_str()).collect()
        };
        let (missed, noticed) = (names(Status::Fail), names(Status::UnexpectedImprovement("Pass")));
        match (missed.as_slice(), noticed.as_slice()) {
            ([], []) => Ok(()),
            ([], noticed) => {
                let text = format!("the layer notices what it was expected to miss: {}", noticed.join(", "));
                Err(Failure::new(Exit::Improved, text))
            }
            (missed, _) => Err(Failure::new(
                Exit::FailedCheck,
                format!("the layer misses, for no known reason: {}", missed.join(", ")),
            )),
        }
    }

    /// The results as a page.
    fn markdown(&self) -> String {
        let (layer, physical) = (version(self.laboratory.layer()), self.physical());
        let mut text = format!("# Mutants, and what layer {layer} says of them\n\n");
        let plans: BTreeSet<&str> = self.judged.iter().map(|own| own.mutant.case.name.as_str()).collect();
        let _ = writeln!(
            text,
            "`afterlight ci --mutants` on {}, {}: {} of {}, in {:.0} s.\n",
            physical.name,
            physical.driver_info,
            counted(self.judged.len(), "mutant"),
            counted(plans.len(), "plan"),
            self.seconds
        );
        text += &self.summary();
        text += "\n| Dependency | Missing | Mutants | Must follow | Noticed plainly | By the heuristic | The layer says | Missed because |\n\
                 |---|---|---|---|---|---|---|---|\n";
        let reasons = self.reasons();
        for group in self.groups() {
            text += &group.row(&reasons);
        }
        if !reasons.is_empty() {
            text += "\n## Reasons\n\n";
        }
        for (index, miss) in reasons.iter().enumerate() {
            let number = index + 1;
            let _ = match miss {
                Miss::Argued(entry) => {
                    writeln!(
                        text,
                        "{number}. {}. The specification (\"{}\"): \"{}\".",
                        sentence(entry.why),
                        entry.section,
                        plain(entry.says)
                    )
                }
                Miss::Newer(entry) => {
                    writeln!(
                        text,
                        "{number}. {}. Layers before {} notice it.",
                        sentence(entry.why),
                        version(entry.from)
                    )
                }
                Miss::Carried(entry) => writeln!(text, "{number}. {}.", sentence(entry.why)),
                Miss::Older(entry) => {
                    writeln!(text, "{number}. {}. Layer {} notices it.", sentence(entry.why), version(entry.seen_from))
                }
            };
        }
        text
    }

    fn summary(&self) -> String {
        let mut text = "| | Rows | Parts of rows |\n|---|---|---|\n".to_owned();
        let mut line = |what: &str, is_counted: &dyn Fn(&MutantResult) -> bool| {
            let rows = self.count(|own| own.mutant.part == RowPart::Row && is_counted(own));
            let bits = self.count(|own| own.mutant.part != RowPart::Row && is_counted(own));
            let _ = writeln!(text, "| {what} | {rows} | {bits} |");
        };
        let is_said = |own: &MutantResult, said: &dyn Fn(&BrokenRules) -> bool| {
            own.heard.as_ref().is_some_and(|(heard, _)| said(heard))
        };
        line("mutants", &|_| true);
        line("noticed", &|own| own.status() == Status::Pass);
        line("noticed without the shader heuristic", &|own| is_said(own, &|heard| !heard.plain.is_empty()));
        line("noticed with the shader heuristic", &|own| {
            is_said(own, &|heard| heard.heuristic.as_ref().is_some_and(|rules| !rules.is_empty()))
        });
        line("expected misses: no layer notices them", &|own| {
            own.status() == Status::ExpectedFail && matches!(own.miss(), Some(Miss::Argued(_)))
        });
        line("expected misses: later layers notice them", &|own| {
            own.status() == Status::ExpectedFail && matches!(own.miss(), Some(Miss::Older(_)))
        });
        line("expected misses: older layers notice them", &|own| {
            own.status() == Status::ExpectedFail && matches!(own.miss(), Some(Miss::Newer(_)))
        });
        line("expected misses: frames are carried otherwise", &|own| {
            own.status() == Status::ExpectedFail && matches!(own.miss(), Some(Miss::Carried(_)))
        });
        line("unexpected misses", &|own| own.status() == Status::Fail);
        line("unexpected notices", &|own| matches!(own.status(), Status::UnexpectedImprovement(_)));
        line("not drawn: no surface without a display, or the device cannot carry frames so", &|own| {
            own.status() == Status::Skip
        });
        text
    }

    /// Returns each reason for a miss once: misses that older layers notice, misses that later layers notice, argued misses, then carried frames,
    /// each kind in the order of its list.
    fn reasons(&self) -> Vec<Miss> {
        let mut reasons: Vec<Miss> = Vec::new();
        for miss in self.judged.iter().filter_map(MutantResult::miss) {
            if !reasons.iter().any(|known| is_same(*known, miss)) {
                reasons.push(miss);
            }
        }
        // A sentence may continue the one before it in the list.
        reasons.sort_by_key(|miss| match miss {
            Miss::Newer(entry) => (0, std::ptr::from_ref(*entry).addr()),
            Miss::Older(entry) => (1, std::ptr::from_ref(*entry).addr()),
            Miss::Argued(entry) => (2, std::ptr::from_ref(*entry).addr()),
            Miss::Carried(entry) => (3, std::ptr::from_ref(*entry).addr()),
        });
        reasons
    }

    /// Groups the mutants by dependency and part, in the order of frames.
    fn groups(&self) -> Vec<MutantGroup<'_>> {
        let mut groups: Vec<MutantGroup> = Vec::new();
        for own in self.judged {
            let (dependency, part) = (own.mutant.row.name.name(), own.mutant.part);
            match groups.iter_mut().find(|group| group.dependency == dependency && group.part == part) {
                Some(group) => group.mutants.push(own),
                None => groups.push(MutantGroup { dependency, part, mutants: vec![own] }),
            }
        }
        let mut order: Vec<&str> = Vec::new();
        for group in &groups {
            if !order.contains(&group.dependency) {
                order.push(group.dependency);
            }
        }
        groups.sort_by_key(|group| order.iter().position(|name| *name == group.dependency));
        groups
    }
}

impl MutantGroup<'_> {
    fn row(&self, reasons: &[Miss]) -> String {
        let all = |of: &dyn Fn(&MutantResult) -> Vec<String>| -> String {
            let each: BTreeSet<String> = self.mutants.iter().flat_map(|own| of(own)).collect();
            each.into_iter().collect::<Vec<_>>().join(", ")
        };
        let heard = |said: &dyn Fn(&BrokenRules) -> bool| {
            self.mutants.iter().filter(|own| own.heard.as_ref().is_some_and(|(heard, _)| said(heard))).count()
        };
        let must_follow = all(&|own| own.must_follow.iter().cloned().collect());
        let rules = all(&|own| {
            let rules = own.heard.iter().flat_map(|(heard, _)| heard.rules());
            rules.map(|rule| rule.trim_start_matches("SYNC-HAZARD-").to_owned()).collect()
        });
        let mut missed: Vec<String> = Vec::new();
        for (index, reason) in reasons.iter().enumerate() {
            let is_it = |own: &&&MutantResult| {
                own.status() == Status::ExpectedFail && own.miss().is_some_and(|miss| is_same(miss, *reason))
            };
            match self.mutants.iter().filter(is_it).count() {
                0 => {}
                count if count == self.mutants.len() => missed.push(format!("{}", index + 1)),
                count => missed.push(format!("{} ({count})", index + 1)),
            }
        }
        for (status, word) in [
            (Status::Fail, "UNEXPECTED"),
            (Status::UnexpectedImprovement("Pass"), "NOTICED"),
            (Status::Skip, "not drawn"),
        ] {
            match self.mutants.iter().filter(|own| own.status() == status).count() {
                0 => {}
                count => missed.push(format!("{word} ({count})")),
            }
        }
        format!(
            "| `{}` | {} | {} | {must_follow} | {} | {} | {rules} | {} |\n",
            self.dependency,
            PartName(self.part),
            self.mutants.len(),
            heard(&|heard| !heard.plain.is_empty()),
            heard(&|heard| heard.heuristic.as_ref().is_some_and(|rules| !rules.is_empty())),
            missed.join(", ")
        )
    }
}

fn is_same(one: Miss, other: Miss) -> bool {
    match (one, other) {
        (Miss::Argued(one), Miss::Argued(other)) => std::ptr::eq(one, other),
        (Miss::Older(one), Miss::Older(other)) => std::ptr::eq(one, other),
        (Miss::Newer(one), Miss::Newer(other)) => std::ptr::eq(one, other),
        (Miss::Carried(one), Miss::Carried(other)) => std::ptr::eq(one, other),
        _ => false,
    }
}

/// The text with a capital at its front, on one line.
fn sentence(text: &str) -> String {
    let text = plain(text);
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// On one line: sentences in the source are broken by a backslash and blanks.
fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
