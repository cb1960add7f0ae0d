//! `afterlight stress`: the catalogue of extreme cases on this device, and the claims that hold or fail.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::time::Instant;

use afterlight::scene::nearest;
#[cfg(feature = "report")]
use afterlight_lab::stress::page;
use afterlight_lab::stress::{
    self, Case, Errors, RunInfo, StressOutcome, StressResult, ValueFinding, catalogue, range,
};
use serde::Serialize;

use super::args::DeviceArgs;
use super::failure::{Exit, Failure};
use super::output::{self, Sink};
use super::table::TextTable;
use super::workload::milliseconds_since;
use super::{progress, session};

/// Try extreme cases on this device against the truth in 64 bits, and tell how far each goes
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Every value of every case must give pixels that are finite and not negative;
within the claimed range the error of each pixel, relative to its light, must
keep the bound. Else the exit code is 1.

Examples:
  afterlight stress --quick
  afterlight stress lights
  afterlight stress lights/distance --json stress.json
  afterlight stress --html stress.html
  afterlight stress random --seeds 0..1000
  afterlight stress --list")]
pub struct Args {
    /// Cases, or groups of them, as --list tells them [default: all]
    #[arg(value_name = "NAME", value_parser = name)]
    names: Vec<String>,
    /// Try the ends of each sweep, those of its claim, and every third value
    #[arg(long)]
    quick: bool,
    /// Seeds of random scenes to try, up to the second and without it, in place of the catalogue's
    #[arg(long, value_name = "FIRST..END", value_parser = seeds)]
    seeds: Option<[u32; 2]>,
    /// Print the names of all cases and what they claim, and try none
    #[arg(long, conflicts_with_all = ["quick", "json", "DeviceArgs"])]
    list: bool,
    /// Write each value of each case as JSON, or to standard output for -
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    json: Option<Sink>,
    /// Write a page with a plot of each case and pictures of what is not as claimed
    #[cfg(feature = "report")]
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    html: Option<Sink>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    device: DeviceArgs,
}

fn name(text: &str) -> Result<String, String> {
    if !catalogue::named(text).is_empty() {
        return Ok(text.into());
    }
    let all = catalogue::all();
    let known = all.iter().flat_map(|case| [case.group(), case.name]);
    let guess = nearest(text, known).map_or_else(String::new, |guess| format!(": did you mean \"{guess}\"?"));
    let groups: BTreeSet<&str> = all.iter().map(|case| case.group()).collect();
    let groups: Vec<&str> = groups.into_iter().collect();
    Err(format!("unknown case {text:?}{guess} (groups: {}; --list has all cases)", groups.join(", ")))
}

fn seeds(text: &str) -> Result<[u32; 2], String> {
    let ends = text.split_once("..").and_then(|(first, end)| Some([first.parse().ok()?, end.parse().ok()?]));
    ends.filter(|[first, end]| first < end).ok_or_else(|| "expected two numbers, as 0..1000".into())
}

/// Tries the cases, and prints a table.
pub fn run(args: &Args) -> Result<(), Failure> {
    let cases = chosen(args);
    if args.list {
        return output::print(&list(&cases), false);
    }
    let sinks = sinks(args);
    sinks.iter().try_for_each(|sink| sink.check())?;
    if let [first, second] = sinks[..]
        && first.is_same(second)
    {
        return Err(Failure::usage("--json and --html name the same file"));
    }
    session::with_device(&args.device, |device| {
        let begun = Instant::now();
        let bar = progress::bar("cases".into(), cases.len() as u64, args.quiet);
        let lines = progress::Spaced::new(args.quiet);
        let mut verdicts: Vec<StressResult> = Vec::new();
        for (done, case) in cases.iter().enumerate() {
            bar.at(done as u64);
            // A line as each group begins, and within one now and then.
            let begins_group = done == 0 || cases[done - 1].group() != case.group();
            let told = |value, values| {
                lines.line(begins_group && value == 0, || so_far((done, &cases), (value, values), &verdicts));
            };
            let verdict = stress::run_told(&device, case, args.quick, &told)?;
            verdicts.push(verdict);
        }
        drop(bar);
        let run = RunInfo {
            device: device.physical.name.clone(),
            driver: device.physical.driver_name.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            quick: args.quick,
            seconds: milliseconds_since(begun) / 1e3,
        };
        let on_stdout = sinks.iter().any(|sink| sink.is_stdout());
        if let Some(sink) = &args.json {
            let report = StressReport { run: &run, cases: verdicts.iter().map(StressCaseReport::of).collect() };
            sink.write(output::json(&report)?.as_bytes())?;
        }
        #[cfg(feature = "report")]
        if let Some(sink) = &args.html {
            sink.write(page::html(&run, &verdicts).as_bytes())?;
        }
        if !args.quiet {
            output::print(&text(&run, &verdicts), on_stdout)?;
        }
        let broken: Vec<&str> =
            verdicts.iter().filter(|verdict| !verdict.passes()).map(|verdict| verdict.case.name).collect();
        match broken.as_slice() {
            [] => Ok(()),
            _ => Err(Failure::new(Exit::FailedCheck, format!("not as claimed: {}", broken.join(", ")))),
        }
    })
}

/// A line off a terminal: how far the cases have come, and how many of them are not as claimed.
fn so_far((done, cases): (usize, &[Case]), (value, values): (usize, usize), verdicts: &[StressResult]) -> String {
    let broken = verdicts.iter().filter(|verdict| !verdict.passes()).count();
    let broken = if broken == 0 { String::new() } else { format!("; {broken} not as claimed so far") };
    format!("case {}/{}: {}, value {}/{values}{broken}", done + 1, cases.len(), cases[done].name, value + 1)
}

/// The files that are written.
fn sinks(args: &Args) -> Vec<&Sink> {
    let sinks = args.json.iter();
    #[cfg(feature = "report")]
    let sinks = sinks.chain(&args.html);
    sinks.collect()
}

/// Each once, in the order of the catalogue.
fn chosen(args: &Args) -> Vec<Case> {
    let names = &args.names;
    let mut cases = catalogue::all();
    cases.retain(|case| names.is_empty() || names.iter().any(|name| name == case.name || name == case.group()));
    match args.seeds {
        Some([first, end]) => cases.into_iter().map(|case| case.with_seeds(first, end)).collect(),
        None => cases,
    }
}

fn list(cases: &[Case]) -> String {
    let mut table = TextTable::new();
    table.row(["case", "values", "claimed", "bound", "what is extreme"]);
    for case in cases {
        let count = case.values.all().len().to_string();
        table.row([
            case.name.into(),
            count,
            range(Some(case.claim), case.unit),
            case.bound.to_string(),
            case.extreme.into(),
        ]);
    }
    table.render()
}

fn text(run: &RunInfo, verdicts: &[StressResult]) -> String {
    let mut table = TextTable::new();
    table.row(["case", "tried", "claimed", "holds", "worst", "mean", "bound", "not finite", "negative", "verdict"]);
    for verdict in verdicts {
        let case = &verdict.case;
        let tried = verdict.findings.first().zip(verdict.findings.last());
        let tried = range(tried.map(|(first, last)| [first.value, last.value]), case.unit);
        let outcome = if verdict.passes() { "holds" } else { "BROKEN" };
        let begin = [case.name.to_owned(), tried];
        table.row(begin.into_iter().chain(verdict.cells()).chain([outcome.to_owned()]));
    }
    let mut text = table.render();
    for verdict in verdicts.iter().filter(|verdict| !verdict.passes()) {
        let _ = writeln!(text, "\n{}, {}:", verdict.case.name, verdict.case.extreme);
        for finding in &verdict.findings {
            let _ = writeln!(text, "  {}", sentence(finding, &verdict.case));
        }
    }
    let inputs = verdicts.iter().filter(|verdict| verdict.passes());
    for (verdict, input) in inputs.filter_map(|verdict| Some((verdict, verdict.worst().worst_input?))) {
        let _ = writeln!(text, "{}: worst at {input}", verdict.case.name);
    }
    let _ = writeln!(text, "\n{}, {}: {:.1} s", run.device, run.driver, run.seconds);
    text
}

fn sentence(finding: &ValueFinding, case: &Case) -> String {
    let value = range(Some([finding.value; 2]), case.unit);
    let mark = if finding.holds(case) { "" } else { " <- breaks the bound" };
    match &finding.outcome {
        StressOutcome::Refused(why) => format!("{value}: refused: {why}"),
        StressOutcome::Measured(errors) => format!(
            "{value}: worst {:.2e}, mean {:.2e} of {} {}, {} elsewhere, {} not finite, {} negative{mark}{}",
            errors.worst,
            errors.mean,
            errors.compared,
            case.check.compared(),
            errors.elsewhere,
            errors.not_finite,
            errors.negative,
            worst_place(errors).filter(|_| !finding.holds(case) || errors.worst_input.is_some()).unwrap_or_default(),
        ),
    }
}

/// The input or the pixel of the greatest error.
fn worst_place(errors: &Errors) -> Option<String> {
    let input = errors.worst_input.map(|input| input.to_string());
    input.or_else(|| errors.worst_pixel.map(|pixel| pixel.to_string())).map(|place| format!("\n    worst at {place}"))
}

/// The output of `--json`.
#[derive(Serialize)]
struct StressReport<'a> {
    #[serde(flatten)]
    run: &'a RunInfo,
    cases: Vec<StressCaseReport>,
}

#[derive(Serialize)]
struct StressCaseReport {
    name: &'static str,
    extreme: &'static str,
    unit: &'static str,
    claim: [f64; 2],
    /// The bounds of any pixel and of the mean.
    bound: [f64; 2],
    passes: bool,
    holds: Option<[f64; 2]>,
    findings: Vec<FindingReport>,
}

/// Errors are `null` where the value was refused; so is one that is not finite, which JSON has no number for.
#[derive(Serialize)]
struct FindingReport {
    value: f64,
    holds: bool,
    refused: Option<String>,
    worst: Option<f64>,
    mean: Option<f64>,
    compared: Option<usize>,
    elsewhere: Option<usize>,
    not_finite: Option<usize>,
    negative: Option<usize>,
    /// The input at which a formula errs most, its output there and the true one; `null` for pictures.
    worst_input: Option<String>,
    /// The pixel at which a picture errs most, its light and the true one, exposed; `null` for formulas and where no pixel errs.
    worst_pixel: Option<String>,
}

impl StressCaseReport {
    fn of(verdict: &StressResult) -> Self {
        let case = &verdict.case;
        let report = |finding: &ValueFinding| {
            let (errors, refused) = match &finding.outcome {
                StressOutcome::Measured(errors) => (Some(errors), None),
                StressOutcome::Refused(why) => (None, Some(why.clone())),
            };
            FindingReport {
                value: finding.value,
                holds: finding.holds(case),
                refused,
                worst: errors.map(|errors| errors.worst),
                mean: errors.map(|errors| errors.mean),
                compared: errors.map(|errors| errors.compared),
                elsewhere: errors.map(|errors| errors.elsewhere),
                not_finite: errors.map(|errors| errors.not_finite),
                negative: errors.map(|errors| errors.negative),
                worst_input: errors.and_then(|errors| errors.worst_input).map(|input| input.to_string()),
                worst_pixel: errors.and_then(|errors| errors.worst_pixel).map(|pixel| pixel.to_string()),
            }
        };
        Self {
            name: case.name,
            extreme: case.extreme,
            unit: case.unit,
            claim: case.claim,
            bound: [case.bound.worst, case.bound.mean],
            passes: verdict.passes(),
            holds: verdict.holds(),
            findings: verdict.findings.iter().map(report).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_a_range_that_is_not_empty() {
        assert_eq!(seeds("3..70"), Ok([3, 70]));
        for text in ["", "3", "3..", "5..5", "7..5", "-1..5", "1..=5", "0..4294967296"] {
            assert!(seeds(text).is_err(), "{text}");
        }
    }
}
