//! The catalogue of extreme cases holds on this driver: every case in `make test-all`, and in `make test` a quarter of the cheap ones, another quarter at each
//! commit, so that a claim which no longer holds is noticed within a few commits.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::common::gpu::on_gpu;
use crate::common::tries_all;
use crate::stress::told;
use afterlight_lab::stress::{self, Case, SweepValues, catalogue};
use afterlight_truth::measure::cpu_seconds;

/// The measured cost of each case: its name, and the milliseconds of processor time, on all threads, that its quick values took.
/// `AFTERLIGHT_BLESS=1 scripts/test machine truth catalogue::every_case_has_a_measured_cost` measures them.
const COSTS: &str = include_str!("catalogue.txt");

/// A case is cheap if its quick values took at most so long. 100 of 199 are, and a quarter of them takes 6 s of one core.
const CHEAP_MS: u32 = 400;

/// The number of parts of the catalogue. `make test` tries one part at each commit.
const PARTS: usize = 4;

fn costs() -> BTreeMap<&'static str, u32> {
    let rows = COSTS.lines().filter(|line| !line.starts_with('#'));
    rows.map(|row| {
        let (name, cost) = row.rsplit_once(' ').unwrap_or_else(|| panic!("catalogue.txt: no cost in \"{row}\""));
        (name, cost.parse().unwrap_or_else(|error| panic!("catalogue.txt: \"{row}\": {error}")))
    })
    .collect()
}

/// A part of the cheap cases. The costliest are dealt first, there and back, so that all parts cost about as much.
fn part_of_cheap(part: usize) -> Vec<Case> {
    let costs = costs();
    let mut cheap = catalogue::all();
    cheap.retain(|case| costs.get(case.name).is_some_and(|&cost| cost <= CHEAP_MS));
    cheap.sort_by_key(|case| std::cmp::Reverse((costs[case.name], case.name)));
    let dealt = cheap.into_iter().enumerate().filter(|(index, _)| {
        let (round, turn) = (index / PARTS, index % PARTS);
        part == if round.is_multiple_of(2) { turn } else { PARTS - 1 - turn }
    });
    dealt.map(|(_, case)| case).collect()
}

/// The commit whose hash chooses the part: `AFTERLIGHT_COMMIT`, or else the checkout's. A folder that is no checkout has none, whatever repository it lies in.
fn commit() -> Option<String> {
    if let Ok(commit) = std::env::var("AFTERLIGHT_COMMIT") {
        return Some(commit);
    }
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).current_dir(env!("AFTERLIGHT_ROOT")).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    git(&["ls-files", "--error-unmatch", "Cargo.toml"])?;
    git(&["rev-parse", "HEAD"])
}

/// The part that a commit chooses: by the first digits of its hash, which are as good as random.
fn chosen_by(commit: &str) -> Option<usize> {
    let digits = commit.get(..8)?;
    Some(u32::from_str_radix(digits, 16).ok()? as usize % PARTS)
}

fn tried() -> Vec<Case> {
    if tries_all() {
        return catalogue::all();
    }
    match commit().and_then(|commit| Some((chosen_by(&commit)?, commit))) {
        Some((part, commit)) => {
            eprintln!("part {part} of {PARTS} of the cheap cases, by AFTERLIGHT_COMMIT={commit}");
            part_of_cheap(part)
        }
        None => {
            eprintln!(
                "NOT RUN: {} of {PARTS} parts of the extreme cases: no commit chooses one here, so part 0 was tried \
                 (AFTERLIGHT_COMMIT=HASH chooses)",
                PARTS - 1
            );
            part_of_cheap(0)
        }
    }
}

/// Two tests, so that they run side by side.
#[test]
fn cases_of_even_number_hold_as_they_are_claimed() {
    hold(0);
}

#[test]
fn cases_of_odd_number_hold_as_they_are_claimed() {
    hold(1);
}

fn hold(half: usize) {
    on_gpu(|gpu| {
        let own = tried().into_iter().skip(half).step_by(2);
        let run =
            |case: Case| stress::run(&gpu.device, &case, true).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let broken: Vec<String> =
            own.map(run).filter(|verdict| !verdict.passes()).map(|verdict| told(&verdict)).collect();
        assert!(broken.is_empty(), "{}", broken.join("\n\n"));
    });
}

#[test]
fn every_case_has_a_measured_cost() {
    if std::env::var("AFTERLIGHT_BLESS").is_ok_and(|value| value == "1") {
        return measure();
    }
    let costs = costs();
    let missing: Vec<&str> =
        catalogue::all().iter().map(|case| case.name).filter(|name| !costs.contains_key(name)).collect();
    let gone: Vec<&str> = costs.keys().copied().filter(|name| catalogue::named(name).is_empty()).collect();
    assert!(
        missing.is_empty() && gone.is_empty(),
        "tests/truth/catalogue.txt lacks {missing:?}, and has {gone:?}, which are no cases: \
         AFTERLIGHT_BLESS=1 scripts/test machine truth catalogue::every_case_has_a_measured_cost measures all"
    );
}

/// Measures what each case costs, and writes it into the list. A case that is no longer cheap after some of its values is broken off.
fn measure() {
    on_gpu(|gpu| {
        let spent = || cpu_seconds().expect("the system tells what this process has used");
        let mut text = format!(
            "# Processor time of the quick values of each case, in ms, up to the value with which it is more than {CHEAP_MS}: {}\n",
            gpu.device.physical.name
        );
        for case in catalogue::all() {
            let (before, mut cost) = (spent(), 0);
            for value in case.tried(true) {
                let one = Case { values: SweepValues::List(vec![value].leak()), ..case };
                stress::run(&gpu.device, &one, false).unwrap_or_else(|error| panic!("{}: {error}", case.name));
                cost = ((spent() - before) * 1e3).round() as u32;
                if cost > CHEAP_MS {
                    break;
                }
            }
            eprintln!("{} {cost}", case.name);
            text += &format!("{} {cost}\n", case.name);
        }
        let file = Path::new(env!("AFTERLIGHT_ROOT")).join("tests/truth/catalogue.txt");
        std::fs::write(&file, text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    });
}

#[test]
fn parts_of_the_cheap_cases_are_all_of_them_and_cost_alike() {
    let costs = costs();
    let parts: Vec<Vec<Case>> = (0..PARTS).map(part_of_cheap).collect();
    let mut names: Vec<&str> = parts.iter().flatten().map(|case| case.name).collect();
    names.sort_unstable();
    let mut cheap: Vec<&str> = costs.iter().filter(|(_, cost)| **cost <= CHEAP_MS).map(|(name, _)| *name).collect();
    cheap.sort_unstable();
    assert_eq!(names, cheap);
    let cost = |part: &Vec<Case>| part.iter().map(|case| costs[case.name]).sum::<u32>();
    let (least, most) = (parts.iter().map(cost).min().unwrap_or(0), parts.iter().map(cost).max().unwrap_or(0));
    assert!(most - least <= CHEAP_MS, "parts of {least} to {most} ms");
    // Many claims are cheap to try, and a quarter of them costs `make test` some seconds.
    assert!(3 * cheap.len() > costs.len(), "{} of {} cases are cheap", cheap.len(), costs.len());
    assert!(most < 10_000, "{most} ms");
}

#[test]
fn commits_choose_every_part() {
    let chosen: Vec<usize> =
        ["0000000012", "00000001ab", "00000002ff", "b94ad767e7"].map(|hash| chosen_by(hash).expect("a hash")).into();
    assert_eq!(chosen, [0, 1, 2, 3]);
    assert_eq!([chosen_by("unknown"), chosen_by("0")], [None, None]);
}

/// The tables of docs/STRESS.md are made from what `stress --json` writes on two devices; what each case claims must be in them as it is in the catalogue.
#[test]
fn the_page_has_the_claim_and_the_bound_of_each_case() {
    let page = include_str!("../../docs/STRESS.md");
    let rows: BTreeMap<&str, Vec<&str>> = page
        .lines()
        .filter_map(|line| Some((line.strip_prefix("| `")?.split_once('`')?.0, line)))
        .map(|(name, line)| (name, line.split('|').map(str::trim).collect()))
        .collect();
    let wrong: Vec<String> = catalogue::all()
        .iter()
        .filter_map(|case| {
            let claim = stress::range(Some(case.claim), case.unit);
            let bound = format!("{:e}, {:e}", case.bound.worst, case.bound.mean);
            let row = rows.get(case.name);
            let is_right = row.is_some_and(|row| row.get(2) == Some(&&*claim) && row.get(4) == Some(&&*bound));
            (!is_right).then(|| format!("| `{}` | {claim} | ... | {bound} | for {row:?}", case.name))
        })
        .collect();
    assert!(wrong.is_empty(), "docs/STRESS.md should have\n{}", wrong.join("\n"));
}
