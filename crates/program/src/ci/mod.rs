//! `afterlight ci`: a suite of cases, each in a separate process, with a verdict that build servers and users of deqp-runner can read.

mod baseline;
mod bundle;
mod changes;
mod coverage;
mod evidence;
mod examine;
pub mod gtest;
mod mutants;
mod reports;
mod repro;
mod resizes;
mod results;
mod runner;
mod soak;
mod stage;
mod suite;
mod verdict;
mod window;

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, available_parallelism};
use std::time::{Duration, Instant};

use afterlight::gpu::{DeviceChoice, Instance, InstanceOptions, choose, vk};
use afterlight_lab::report::sweep::model::Shard;
use afterlight_truth::measure::cpu_kind;
use regex::Regex;

use super::args;
use super::failure::{Exit, Failure};
use super::output::{self, Sink};
use super::{progress, session};
use baseline::{Baseline, DeviceKey};
use evidence::EvidenceFolder;
use examine::CaseContext;
use reports::CaseResult;
use results::Expectations;
use runner::Runner;
use suite::{Suite, SuiteCase};
use verdict::{CaseReport, Status};

/// The most processes at a time by default: each has its own device, pictures and reference renderer.
const MOST_JOBS: usize = 8;
/// Folders inside the output's: running cases, and bundles of cases that ended badly.
const CASES: &str = "cases";
const BUNDLES: &str = "bundles";
/// Files that are written once all cases are done.
const RESULTS: [&str; 6] =
    ["results.csv", "failures.csv", "failures-all.csv", "results.jsonl", "junit.xml", "summary.md"];
/// The folder of the curves of all soaks, also of soaks that pass.
const CURVES: &str = "curves";

/// Run a suite of cases on a driver, each in a process of its own, and give each a verdict
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Exit codes are those of deqp-runner: 1 where something is worse than expected,
2 where something is only better than the baseline says. A suite or an option
that is wrong is 3 here.

Examples:
  afterlight ci smoke -o out
  afterlight ci quick -o out --baseline baselines --bless
  afterlight ci quick -o out --baseline baselines --since last
  afterlight ci full -o out --shard 2/4 --jobs 4
  afterlight ci mine.toml -o out --skips skips.txt --flakes flakes.txt
  afterlight ci --repro out/bundles/paths.loop
  afterlight ci quick --coverage
  afterlight ci --mutants -o out --shard 1/4
  afterlight ci quick --list")]
pub struct Args {
    /// The suite: smoke, quick, full, soak, or a file [default: quick]
    #[arg(value_name = "SUITE", conflicts_with = "repro")]
    suite: Option<String>,
    /// Write results, reports and bundles into this folder
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["list", "coverage", "repro", "case", "probe", "mutants"])]
    output: Option<PathBuf>,
    /// The device: its number in `afterlight doctor`, or a part of its name [default: a real GPU before a CPU]
    #[arg(long, value_name = "N|NAME", value_parser = args::device, allow_hyphen_values = true)]
    device: Option<DeviceChoice>,
    /// Compare with a folder of pictures, times and failures by driver and device, or with a failures.csv
    #[arg(long, value_name = "DIR|CSV")]
    baseline: Option<PathBuf>,
    /// Store this run's pictures, times and failures in --baseline, without comparing with what is there
    #[arg(long, requires = "baseline", conflicts_with_all = ["case", "list", "coverage", "repro"])]
    bless: bool,
    /// Skip the cases that match a regular expression of this file, one a line
    #[arg(long, value_name = "FILE")]
    skips: Vec<PathBuf>,
    /// Expect the cases that match one of this file to fail now and then
    #[arg(long, value_name = "FILE")]
    flakes: Vec<PathBuf>,
    /// Show what changed since an earlier run: its folder, or its results.csv
    #[arg(long, value_name = "RUN")]
    since: Option<PathBuf>,
    /// Run only cases whose names match
    #[arg(long, value_name = "REGEX")]
    only: Option<Regex>,
    /// Run every N-th case, from the I-th on
    #[arg(long, value_name = "I/N", value_parser = args::shard)]
    shard: Option<Shard>,
    /// Processes at a time, which share the device; with --mutants, frames [default: one a core, at most 8]
    #[arg(long, value_name = "N", value_parser = args::whole::<u16>(1..=1024), allow_negative_numbers = true)]
    jobs: Option<u16>,
    /// Start each case by this command, with this program's own command line behind it: a debugger, another stack's
    /// script. Without, AFTERLIGHT_RUNNER names one
    #[arg(long, value_name = "COMMAND", conflicts_with_all = ["case", "repro", "list", "coverage"])]
    runner: Option<String>,
    /// Try this case in this process, and print its verdict as JSON; with -o, what it finds out is kept there
    #[arg(long, value_name = "NAME", conflicts_with_all = ["repro", "list", "coverage", "since", "only", "shard", "skips", "flakes", "jobs"])]
    case: Option<String>,
    /// Other cases run on the device meanwhile: times are not judged
    #[arg(long, requires = "case", hide = true)]
    shared: bool,
    /// A run has started this process, which ends with it
    #[arg(long, hide = true)]
    of_run: bool,
    /// Print the names of the driver and the device as JSON
    #[arg(long, hide = true, conflicts_with_all = ["case", "repro", "list", "coverage"])]
    probe: bool,
    /// Try the case of a bundle again, in this process, with all that the bundle holds; the bundle may have been moved
    #[arg(long, value_name = "BUNDLE", conflicts_with_all = ["list", "coverage", "since", "only", "shard", "skips", "flakes", "jobs"])]
    repro: Option<PathBuf>,
    /// Test the validation layer instead: draw frames with one dependency, or one bit of one, missing, and tell which it notices. With -o, a
    /// page and tables of all are kept there. Such frames may hang a real GPU: they are meant for software drivers
    #[arg(long, conflicts_with_all = ["suite", "repro", "list", "coverage", "case", "baseline", "bless", "skips", "flakes", "since"])]
    mutants: bool,
    /// Print the names of the cases, and try none
    #[arg(long, conflicts_with_all = ["baseline", "since", "skips", "flakes", "jobs"])]
    list: bool,
    /// Print which passes, light paths, dependencies, formats and features the cases use, counted from their plans, and try none
    #[arg(long, conflicts_with_all = ["list", "baseline", "since", "skips", "flakes", "jobs"])]
    coverage: bool,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the suite, or one case of it.
///
/// # Errors
/// [`Exit::FailedCheck`] for regressions, [`Exit::Improved`] for improvements alone, and faults that keep the suite from running.
pub fn run(args: &Args) -> Result<(), Failure> {
    // Code 2 is taken: it says that something has improved.
    run_suite(args).map_err(|failure| match failure.exit() {
        Some(Exit::Usage) => failure.with_exit(Exit::BadInput),
        _ => failure,
    })
}

fn run_suite(args: &Args) -> Result<(), Failure> {
    if args.mutants {
        let device = args.device.clone().unwrap_or_default();
        let choice =
            mutants::MutantSelection { device: &device, only: args.only.as_ref(), shard: args.shard, jobs: jobs(args) };
        return mutants::run(&choice, args.output.as_deref(), args.quiet);
    }
    if args.of_run {
        end_with_parent();
    }
    if args.probe {
        return output::print(&output::json(&key(&args.device.clone().unwrap_or_default())?)?, false);
    }
    if let Some(bundle) = &args.repro {
        let file = bundle.join(evidence::SUITE);
        let suite = Suite::open(&file.display().to_string())?;
        return repro::again(args, &suite.cases[0], bundle);
    }
    let name = args.suite.as_deref().unwrap_or("quick");
    let suite = Suite::open(name)?;
    if let Some(case) = &args.case {
        let report = one(args, suite.case(case)?, None)?;
        publish(args, &report)?;
        return verdict_of(&report);
    }
    let cases = chosen(args, &suite)?;
    if args.list {
        return output::print(&cases.iter().map(|case| format!("{}\n", case.name)).collect::<String>(), false);
    }
    if args.coverage {
        return output::print(&coverage::of(&cases)?, false);
    }
    // clap has seen to it that there is one.
    let Some(folder) = &args.output else { return Err(Failure::usage("-o DIR is needed")) };
    all(args, &suite, &cases, folder)
}

/// The cases, or mutants, to draw at a time.
fn jobs(args: &Args) -> usize {
    args.jobs.map_or_else(|| available_parallelism().map_or(1, usize::from).min(MOST_JOBS), usize::from)
}

/// The cases that `--only` and `--shard` leave.
fn chosen<'a>(args: &Args, suite: &'a Suite) -> Result<Vec<&'a SuiteCase>, Failure> {
    let is_named = |case: &&SuiteCase| args.only.as_ref().is_none_or(|only| only.is_match(&case.name));
    let named: Vec<&SuiteCase> = suite.cases.iter().filter(is_named).collect();
    if named.is_empty() {
        let only = args.only.as_ref().map_or("", Regex::as_str);
        return Err(Failure::new(Exit::BadInput, format!("--only {only}: no case of {} matches", suite.name)));
    }
    let is_own = |index: usize| args.shard.is_none_or(|shard| shard.owns(index));
    Ok(named.into_iter().enumerate().filter(|(index, _)| is_own(*index)).map(|(_, case)| case).collect())
}

/// Tries a case in this process. A case of a bundle is compared with the bundle's own picture and time, unless `--baseline` names others.
fn one(args: &Args, case: &SuiteCase, bundle: Option<&Path>) -> Result<CaseReport, Failure> {
    let choice = args.device.clone().unwrap_or_default();
    let baseline = match &args.baseline {
        Some(folder) if folder.is_dir() => Some(Baseline::open(folder, &key(&choice)?)?),
        Some(other) => {
            let why = format!("one case is compared with a folder of pictures, and {} is none", other.display());
            return Err(Failure::new(Exit::BadInput, why));
        }
        None => bundle.map(Baseline::of_bundle).transpose()?.flatten(),
    };
    if let Some(folder) = &args.output {
        output::make_folder(folder)?;
    }
    let place = CaseContext { device: &choice, baseline: baseline.as_ref(), is_shared: args.shared };
    Ok(examine::examine(case, &place, &EvidenceFolder::new(args.output.clone())))
}

/// Writes and prints the verdict on a case.
fn publish(args: &Args, report: &CaseReport) -> Result<(), Failure> {
    let json = output::json(report)?;
    if let Some(folder) = &args.output {
        Sink::File(folder.join(runner::VERDICT)).write(json.as_bytes())?;
    }
    if args.quiet { Ok(()) } else { output::print(&json, false) }
}

/// A bad verdict as a failure.
fn verdict_of(report: &CaseReport) -> Result<(), Failure> {
    if !report.verdict.is_bad() {
        return Ok(());
    }
    let why = report.reason.as_deref().unwrap_or_default();
    Err(Failure::new(Exit::FailedCheck, format!("{}: {:?}: {why}", report.case, report.verdict)))
}

/// The device that the choice means.
fn key(choice: &DeviceChoice) -> Result<DeviceKey, Failure> {
    let instance = Instance::new(&InstanceOptions::default())?;
    let mut devices = instance.physical_devices()?;
    let index = choose(&devices, choice)?;
    let physical = devices.swap_remove(index);
    let cpu = (physical.kind == vk::PhysicalDeviceType::CPU).then(cpu_kind);
    Ok(DeviceKey { driver: physical.driver_name, device: physical.name, cpu })
}

/// As [`key`], found out in a separate process: a driver that crashes does not end the run.
fn probe(command: &[OsString], choice: &DeviceChoice) -> Result<DeviceKey, Failure> {
    let mut words = command.iter();
    let mut probe = Command::new(words.next().map_or("".as_ref(), OsString::as_os_str));
    probe.args(words).args(["ci", "--probe", "--device", &choice.to_string()]).stdin(Stdio::null());
    let output = probe.output().map_err(|error| {
        Failure::new(Exit::BadInput, format!("cannot start {}: {error}", probe.get_program().display()))
    })?;
    if let Ok(key) = serde_json::from_slice(&output.stdout) {
        return Ok(key);
    }
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let error = said.lines().find_map(|line| line.strip_prefix("error: ")).map(str::to_owned);
    let why = error.unwrap_or_else(|| format!("asking for the device ended with {}", output.status));
    let exit =
        if output.status.code() == Some(i32::from(Exit::BadInput.code())) { Exit::BadInput } else { Exit::NoVulkan };
    Err(Failure::new(exit, why))
}

/// Ends this process when the one that has started it is gone, so that the device draws nothing that nobody waits for.
fn end_with_parent() {
    #[cfg(unix)]
    {
        use std::os::unix::process::parent_id;
        let parent = parent_id();
        thread::spawn(move || {
            while parent_id() == parent {
                thread::sleep(Duration::from_millis(200));
            }
            std::process::exit(1);
        });
    }
}

/// Expectations of a run, read before its first case.
struct RunExpectations {
    baseline: Option<Baseline>,
    expectations: Expectations,
    /// Statuses of an earlier run, and its reports by case.
    since: Option<changes::Earlier>,
}

impl RunExpectations {
    fn of(args: &Args, device: &DeviceKey) -> Result<Self, Failure> {
        let given = args.baseline.as_ref();
        if let Some(missing) = given.filter(|path| !path.exists() && !args.bless) {
            let why = format!("there is no baseline {}: --bless makes one", missing.display());
            return Err(Failure::new(Exit::BadInput, why));
        }
        // Anything but a folder has known failures: a file, or a pipe.
        let is_csv = |path: &&PathBuf| path.exists() && !path.is_dir();
        let csv = given.filter(is_csv);
        if let Some(file) = csv.filter(|_| args.bless) {
            let why = format!(
                "--bless writes pictures and times, too: --baseline needs a folder, and {} is a file",
                file.display()
            );
            return Err(Failure::new(Exit::BadInput, why));
        }
        let folder = given.filter(|path| !is_csv(path));
        let baseline = folder.map(|folder| Baseline::open(folder, device)).transpose()?;
        let failures = match (&baseline, csv) {
            (Some(baseline), _) => baseline.failures()?,
            (None, Some(file)) => results::read(file)?,
            (None, None) => BTreeMap::new(),
        };
        let with = |given: &[PathBuf], name: &str| {
            let own = baseline.as_ref().and_then(|baseline| baseline.expressions(name));
            results::expressions(&given.iter().cloned().chain(own).collect::<Vec<_>>())
        };
        let expectations = Expectations {
            failures,
            skips: with(&args.skips, "skips.txt")?,
            flakes: with(&args.flakes, "flakes.txt")?,
        };
        let since = args.since.as_deref().map(changes::Earlier::open).transpose()?;
        Ok(Self { baseline, expectations, since })
    }
}

/// Runs all cases, and writes their results.
fn all(args: &Args, suite: &Suite, cases: &[&SuiteCase], folder: &Path) -> Result<(), Failure> {
    let begun = Instant::now();
    let choice = args.device.clone().unwrap_or_default();
    let mut command = match &args.runner {
        Some(runner) => {
            let words = runner.split_whitespace().map(OsString::from);
            words.chain([session::own_program()?.into()]).collect()
        }
        None => session::own_command()?,
    };
    let device = probe(&command, &choice)?;
    let known = RunExpectations::of(args, &device)?;
    let missing = known.baseline.as_ref().and_then(Baseline::missing).filter(|_| !args.bless && !args.quiet);
    if let Some(why) = missing {
        output::print(&format!("warning: {why}\n"), true)?;
    }
    let (working, bundles, curves) = (folder.join(CASES), folder.join(BUNDLES), folder.join(CURVES));
    for own in [&working, &bundles, &curves] {
        remove_own(own)?;
    }
    remove_results(folder)?;
    make_own(&working)?;
    let (skipped, tried): (Vec<&SuiteCase>, Vec<&SuiteCase>) =
        cases.iter().partition(|case| known.expectations.skips(&case.name));
    let jobs = jobs(args);
    command.extend(arguments(args, suite, &choice, jobs > 1));
    let runner = Runner { command, cases: &working, jobs };
    let bar = progress::bar(format!("{} on {}", suite.name, device.device), tried.len() as u64, args.quiet);
    // Written anew at the end. A run that is stopped before leaves its results so far.
    let path = folder.join("results.jsonl");
    let lines = fs::File::create(&path).map_err(|error| Failure::write(&path.display().to_string(), &error))?;
    let lines = Mutex::new(lines);
    let reports = runner.run(&tried, &|report| {
        bar.step();
        let status = known.expectations.status(report);
        let line = reports::json_lines(&[CaseResult { status, report, bundle: None }]).unwrap_or_default();
        // A line that cannot be written now fails the run at its end.
        let _ = lines.lock().unwrap_or_else(PoisonError::into_inner).write_all(line.as_bytes());
    });
    drop(bar);
    if args.bless
        && let Some(baseline) = known.baseline.clone()
    {
        baseline.bless(&reports, &working, jobs > 1)?;
    }
    let skips = skipped.iter().map(|case| CaseReport {
        verdict: verdict::Verdict::Skip,
        reason: Some("a file of --skips says so".into()),
        ..CaseReport::new(&case.name)
    });
    let reports: Vec<CaseReport> = reports.into_iter().chain(skips).collect();
    keep_curves(&reports, &working, &curves)?;
    let kept = bundle::keep(&reports, &tried, (&working, &bundles), args)?;
    let judge = |report| {
        let status = if args.bless { blessed(report) } else { known.expectations.status(report) };
        CaseResult { status, report, bundle: kept.get(&report.case).map(PathBuf::as_path) }
    };
    let judged: Vec<CaseResult> = reports.iter().map(judge).collect();
    let changes = known.since.map(|earlier| earlier.changes(&judged)).unwrap_or_default();
    write(suite, folder, begun, &judged, &changes)?;
    if !args.quiet {
        let compares = known.baseline.is_some() && !args.bless;
        let more: Vec<String> = uncompared(&tried).filter(|_| compares).into_iter().chain(changes).collect();
        output::print(&closing_words(suite, folder, begun, &judged, &more), false)?;
    }
    conclude(&judged)
}

/// The status of a case of a blessed run: every failure is expected.
fn blessed(report: &CaseReport) -> Status {
    let status = report.verdict.status();
    status.against(Some(status))
}

/// Returns the arguments that all cases' processes share.
fn arguments(args: &Args, suite: &Suite, choice: &DeviceChoice, is_shared: bool) -> Vec<OsString> {
    let mut arguments: Vec<OsString> =
        ["ci", &suite.name, "--quiet", "--device", &choice.to_string()].map(Into::into).into();
    arguments.push("--of-run".into());
    // Blessed results are not compared with the results that they replace.
    if let Some(folder) = args.baseline.as_ref().filter(|path| path.is_dir() && !args.bless) {
        arguments.extend(["--baseline".into(), folder.into()]);
    }
    if is_shared {
        arguments.push("--shared".into());
    }
    arguments
}

/// A file in folders of this command's own: without it a folder is somebody else's, and is not removed.
const OWN: &str = ".afterlight-ci";

fn make_own(folder: &Path) -> Result<(), Failure> {
    output::make_folder(folder)?;
    Sink::File(folder.join(OWN)).write(b"afterlight ci makes this folder anew with each run\n")
}

/// Removes a folder of an earlier run.
fn remove_own(folder: &Path) -> Result<(), Failure> {
    if !folder.exists() {
        return Ok(());
    }
    let failed = |error: &io::Error| Failure::write(&folder.display().to_string(), error);
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let entries = entries.map_err(|error| failed(&error))?;
    let is_file = |entry: &fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_file());
    let is_unfinished = |entry: &fs::DirEntry| {
        let name = entry.file_name();
        is_file(entry) && name.to_str().is_some_and(|name| name.starts_with(".afterlight-") && name.ends_with(".part"))
    };
    // A run that was killed before it wrote its mark, or after it removed it, leaves at most unfinished files.
    if !entries.iter().any(|entry| entry.file_name() == OWN && is_file(entry)) && !entries.iter().all(is_unfinished) {
        let why =
            format!("{} is there, and no earlier run has made it: choose another folder for -o", folder.display());
        return Err(Failure::new(Exit::BadInput, why));
    }
    // Removes the mark last, so that the next run recognises a half-removed folder.
    for entry in entries.iter().filter(|entry| entry.file_name() != OWN) {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let path = entry.path();
        if is_folder { remove_folder(&path) } else { fs::remove_file(&path) }.map_err(|error| failed(&error))?;
    }
    remove_folder(folder).map_err(|error| failed(&error))
}

/// Removes the results of an earlier run, so that nobody mistakes them for the results of a run that is stopped.
fn remove_results(folder: &Path) -> Result<(), Failure> {
    RESULTS.into_iter().try_for_each(|name| remove_file(&folder.join(name)))
}

fn remove_file(path: &Path) -> Result<(), Failure> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(Failure::write(&path.display().to_string(), &error))
        }
        _ => Ok(()),
    }
}

/// Removes a folder into which the case of a killed run may still write, for a second at most.
fn remove_folder(folder: &Path) -> io::Result<()> {
    let mut removed = fs::remove_dir_all(folder);
    for _ in 0..20 {
        match &removed {
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => thread::sleep(Duration::from_millis(50)),
            _ => break,
        }
        removed = fs::remove_dir_all(folder);
    }
    removed
}

/// Copies the curves of soaks into a separate folder, as `CASE.csv`.
fn keep_curves(reports: &[CaseReport], working: &Path, curves: &Path) -> Result<(), Failure> {
    for report in reports {
        let (from, to) = (working.join(&report.case).join(soak::CURVE), curves.join(format!("{}.csv", report.case)));
        if from.exists() {
            make_own(curves)?;
            let curve = fs::read(&from).map_err(|error| Failure::write(&to.display().to_string(), &error))?;
            Sink::File(to).write(&curve)?;
        }
    }
    Ok(())
}

/// Writes all result files, and appends to the summary of a GitHub workflow's step when run in one.
fn write(
    suite: &Suite,
    folder: &Path,
    begun: Instant,
    judged: &[CaseResult],
    changes: &[String],
) -> Result<(), Failure> {
    let statuses: Vec<(Status, &CaseReport)> = judged.iter().map(|own| (own.status, own.report)).collect();
    let summary = reports::markdown(&suite.name, begun.elapsed().as_secs_f64(), judged, changes);
    let texts = [
        results::results(&statuses),
        results::failures(&statuses, false),
        results::failures(&statuses, true),
        reports::json_lines(judged)?,
        reports::junit(&suite.name, judged)?,
        summary.clone(),
    ];
    for (name, text) in RESULTS.into_iter().zip(texts) {
        Sink::File(folder.join(name)).write(text.as_bytes())?;
    }
    if let Some(path) = env::var_os("GITHUB_STEP_SUMMARY").filter(|path| !path.is_empty()) {
        let file = fs::OpenOptions::new().append(true).create(true).open(&path);
        if let Err(error) = file.and_then(|mut file| file.write_all(summary.as_bytes())) {
            // The verdict is worth more than its summary.
            output::print(&format!("warning: cannot write {}: {error}\n", path.display()), true)?;
        }
    }
    Ok(())
}

/// Says how many cases no baseline's picture is compared with, if there are such cases.
fn uncompared(tried: &[&SuiteCase]) -> Option<String> {
    let told = |cases: &str, pictures: &str| format!("{cases} no `flip`: {pictures} not compared with the baseline's");
    match tried.iter().filter(|case| case.holds.flip.is_none()).count() {
        0 => None,
        1 => Some(told("1 case has", "its picture was")),
        count => Some(told(&format!("{count} cases have"), "their pictures were")),
    }
}

/// `more` are lines about the run, before the last one.
fn closing_words(suite: &Suite, folder: &Path, begun: Instant, judged: &[CaseResult], more: &[String]) -> String {
    let mut text = reports::table(judged);
    text.extend(reports::skipped_checks(judged).iter().map(|line| format!("{line}\n")));
    text.extend(more.iter().map(|line| format!("{line}\n")));
    let (counts, seconds) = (reports::counts(judged), begun.elapsed().as_secs_f64());
    text + &format!("{}: {counts}, in {seconds:.1} s -> {}\n", suite.name, folder.display())
}

fn conclude(judged: &[CaseResult]) -> Result<(), Failure> {
    let names = |is_told: &dyn Fn(Status) -> bool| -> Vec<&str> {
        judged.iter().filter(|own| is_told(own.status)).map(|own| own.report.case.as_str()).collect()
    };
    let (worse, better) =
        (names(&Status::is_regression), names(&|status| matches!(status, Status::UnexpectedImprovement(_))));
    match (worse.as_slice(), better.as_slice()) {
        ([], []) => Ok(()),
        ([], better) => {
            Err(Failure::new(Exit::Improved, format!("better than the baseline says: {}", better.join(", "))))
        }
        (worse, _) => Err(Failure::new(Exit::FailedCheck, format!("worse than expected: {}", worse.join(", ")))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_a_killed_run_is_removed_and_a_foreign_one_is_not() {
        let parent = tempfile::tempdir().expect("a folder");
        let folder = parent.path().join("cases");
        let is_removed = |names: &[&str]| {
            fs::create_dir_all(&folder).expect("made");
            for name in names {
                fs::write(folder.join(name), b"x").expect("written");
            }
            remove_own(&folder).is_ok() && !folder.exists()
        };
        // Killed before and while it wrote its file; whole.
        assert!(is_removed(&[]) && is_removed(&[".afterlight-x.part"]) && is_removed(&[OWN, "picture.png"]));
        assert!(!is_removed(&["picture.png"]) && folder.join("picture.png").exists());
        fs::remove_file(folder.join("picture.png")).expect("removed");
        // Names like the program's own do not make a folder its own.
        assert!(!is_removed(&[".afterlight-notes"]) && folder.join(".afterlight-notes").exists());
        fs::remove_file(folder.join(".afterlight-notes")).expect("removed");
        fs::create_dir(folder.join(".afterlight-x.part")).expect("made");
        assert!(!is_removed(&[]) && folder.join(".afterlight-x.part").exists());
        fs::remove_dir(folder.join(".afterlight-x.part")).expect("removed");
        fs::create_dir(folder.join(OWN)).expect("made");
        assert!(!is_removed(&[]) && folder.join(OWN).exists());
    }
}
