//! Every dependency is needed: without any one row of the table, or any one bit of a row, the validation layer complains. Where it is silent,
//! `afterlight_lab::mutants::unreported` argues from the specification, and is held against the layer here.
//!
//! Each mutant is a separate renderer that draws a few small frames (`afterlight_lab::mutants::experiment`), in both modes of the layer's shader
//! heuristic (`afterlight_lab::mutants`). `afterlight_lab::mutants::older` lists the mutants that layers before 1.4.309 miss besides.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use crate::common::gpu::{not_run, on_gpu};
use crate::common::{some_of, tries_all};
use afterlight::frame::capabilities;
use afterlight::frame::list::StepList;
use afterlight::frame::rows::{self, Row, RowPart};
use afterlight::gpu::{self, DeviceChoice, vk};
use afterlight::plan::{FramePlan, OUTPUT_PLAIN, OUTPUT_SRGB, samples};
use afterlight::scene::Queues;
use afterlight_lab::mutants::unreported::{LAYER, UNREPORTED_MUTANTS};
use afterlight_lab::mutants::{
    BrokenRules, Laboratory, Miss, Mutant, MutantCase, MutantVerdict, PresentPath, cases, mutants, presented, verdict,
};
use afterlight_proof::FrameModel;

/// A frame records the passes that the proof assumes, in the same order.
#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn passes_are_recorded_in_the_order_of_the_list() {
    on_gpu(|gpu| {
        let mut orders = BTreeSet::new();
        let device = capabilities(&gpu.device.physical);
        // Times of passes on another queue are read apart.
        let is_drawn = |case: &&MutantCase| {
            case.presented.is_none() && case.is_for(&device) && case.settings.queues == Queues::One
        };
        for case in some_of(cases().iter().filter(is_drawn), 6) {
            let mut renderer = gpu.renderer(&case.scene, &case.settings);
            renderer.render(&case.scene.camera).unwrap_or_else(|error| panic!("{}: {error}", case.name));
            let list = StepList::of(renderer.plan());
            let places = FrameModel::of(renderer.plan(), &rows::table(renderer.plan())).passes();
            let times = |place| {
                let mut own: Vec<_> = list.passes_at(place).into_iter().map(|pass| pass.time).collect();
                // SPREAD and SORT stand in the list twice, and PER_LIGHT shares the time of LIGHTING.
                own.dedup();
                own
            };
            let mut listed: Vec<_> = places.into_iter().flat_map(times).collect();
            // Maps are drawn one after the other, and all of them have one time.
            listed.dedup();
            assert_eq!(renderer.recorded_passes(), listed, "{}", case.name);
            orders.insert(listed);
        }
        assert!(orders.len() >= 12, "so few different frames have been tried: {orders:?}");
    });
}

/// Rows of sample plans that no mutant of these plans is made of.
fn untried(tried: &[FramePlan]) -> BTreeSet<String> {
    // Reasons and waiting passes are not compared: plans may have the same masks for others. Nor are the samples that a row between subpasses orders: no
    // layer looks at them, and `proof` tries them in every plan.
    let rows = |plan: &FramePlan| -> Vec<Row> {
        let compared = |row: &Row| {
            let by_region = row.is_between_subpasses();
            Row {
                why: String::new(),
                waiting: Vec::new(),
                resources: Vec::new(),
                by_region,
                across_samples: false,
                ..row.clone()
            }
        };
        rows::table(plan).iter().map(compared).collect()
    };
    let tried: Vec<Row> = tried.iter().flat_map(rows).collect();
    let shows = |plan: &FramePlan| cfg!(feature = "window") && [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output);
    let samples = samples::of_every_kind().into_iter().flat_map(|(name, plan)| {
        let in_window = |way| (format!("{name}, in a window"), presented(plan.clone(), way));
        let shown = shows(&plan).then(|| [in_window(PresentPath::Straight), in_window(PresentPath::Encoded)]);
        [(name, plan)].into_iter().chain(shown.into_iter().flatten()).collect::<Vec<_>>()
    });
    let mut seen = Vec::new();
    let mut missing = BTreeSet::new();
    for (name, plan) in samples {
        for row in rows(&plan).into_iter().filter(|row| !tried.contains(row)) {
            if !seen.contains(&row) {
                missing.insert(format!("{name}: {row:?}"));
                seen.push(row);
            }
        }
    }
    missing
}

/// Needs no device.
#[test]
fn each_dependency_of_the_sample_plans_is_tried() {
    let plan = |case: MutantCase| case.plan(&samples::device()).expect("a plan");
    let missing = untried(&cases().into_iter().map(plan).collect::<Vec<_>>());
    assert!(missing.is_empty(), "{} rows are not tried; draw plans that have them: {missing:#?}", missing.len());
}

#[test]
fn without_any_row_or_bit_the_layer_complains_or_the_specification_does() {
    let begun = Instant::now();
    let laboratory = match Laboratory::open(&DeviceChoice::Auto) {
        Ok(laboratory) => laboratory,
        Err(error @ gpu::Error::Unsupported(_)) => return not_run(&error.to_string()),
        Err(error) => panic!("{error}"),
    };
    let (layer, physical) = (laboratory.layer(), &laboratory.device().physical);
    let named = |version| {
        format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        )
    };
    if layer < LAYER && !tries_all() {
        let (own, first) = (named(layer), named(LAYER));
        return not_run(&format!(
            "`make test-all` holds layer {own} against what it does not see; `make test` asks {first}"
        ));
    }
    let device = capabilities(physical);
    let is_drawn = |case: &MutantCase| (laboratory.presents() || case.presented.is_none()) && case.is_for(&device);
    let cases: Vec<MutantCase> = cases().into_iter().filter(is_drawn).collect();
    let plan = |case: &MutantCase| case.plan_or_ample(&device).unwrap_or_else(|error| panic!("{}: {error}", case.name));
    let plans: Vec<FramePlan> = cases.iter().map(plan).collect();
    let missing = if laboratory.presents() || !cfg!(feature = "window") { untried(&plans) } else { BTreeSet::new() };
    assert!(missing.is_empty(), "on this device {} rows are not tried: {missing:#?}", missing.len());
    if tries_all() {
        let of_all = self::cases();
        let their_plans: Vec<FramePlan> = of_all.iter().map(plan).collect();
        let all = mutants(&of_all, &their_plans);
        let plans: BTreeSet<&str> = all.iter().map(|mutant| mutant.case.name.as_str()).collect();
        let told = format!(": {} mutants of {} plans", all.len(), plans.len());
        let page = format!("{}/docs/layers/{}.md", env!("AFTERLIGHT_ROOT"), named(layer));
        // Pages are about these two layers alone.
        let is_told = std::fs::read_to_string(&page).map_or(true, |text| text.contains(&told));
        assert!(is_told, "there are{told}: {page} is of others; `afterlight ci --mutants` writes it");
    }
    let mut mutants = mutants(&cases, &plans);
    if !tries_all() {
        // `proof` applies the rules to all mutants. The layer sees a sample here: a reason that no longer holds may wait for the daily `make
        // test-all`.
        let (all, mut index) = (mutants.len(), 0);
        mutants.retain(|_| (index += 1, index % 256 == 0).1);
        println!("{} of {all} mutants", mutants.len());
    }
    // The others are silent in `validation`.
    let is_asked = |case: &MutantCase| tries_all() || mutants.iter().any(|mutant| std::ptr::eq(mutant.case, case));
    let whole: Vec<_> = cases.iter().zip(&plans).filter(|(case, _)| is_asked(case)).collect();
    // SAFETY: nobody looks at the pictures, and the layer speaks before the driver runs a mutant. Software drivers, on which this runs, do one thing
    // after another.
    let heard = unsafe { laboratory.judge(&whole, &mutants, &|| ()) };
    let heard = heard.unwrap_or_else(|error| panic!("{error}: {:?}", std::error::Error::source(&error)));

    let mut summary = Summary::default();
    let (mut unlisted, mut rotten) = (Vec::new(), Vec::new());
    let mut argued = BTreeSet::new();
    for (mutant, heard) in mutants.iter().zip(&heard) {
        let place = || format!("{} without {:?} in \"{}\"", mutant.row.name, mutant.part, mutant.case.name);
        let verdict = verdict(layer, mutant, heard);
        summary.count(mutant, heard, &verdict);
        match verdict {
            MutantVerdict::Noticed => {}
            MutantVerdict::ExpectedMiss(Miss::Argued(reason)) => _ = argued.insert(std::ptr::from_ref(reason)),
            MutantVerdict::ExpectedMiss(Miss::Older(_) | Miss::Newer(_) | Miss::Carried(_)) => {}
            MutantVerdict::UnexpectedMiss => unlisted.push(place()),
            MutantVerdict::UnexpectedNotice(_) => rotten.push(format!("{}: {heard:?}", place())),
        }
    }
    let names: BTreeSet<rows::RowName> =
        plans.iter().flat_map(|plan| rows::table(plan).iter().map(|row| row.name).collect::<Vec<_>>()).collect();
    println!(
        "layer {}, {} {}: {} plans, {} dependencies by name; {summary} in {:.0} s",
        named(layer),
        physical.name,
        physical.driver_info,
        plans.len(),
        names.len(),
        begun.elapsed().as_secs_f64()
    );
    assert!(unlisted.is_empty(), "nobody notices, and no reason is listed:\n{}", unlisted.join("\n"));
    assert!(rotten.is_empty(), "listed as unnoticed, but the layer says so:\n{}", rotten.join("\n"));
    let idle: Vec<_> =
        UNREPORTED_MUTANTS.iter().filter(|reason| !argued.contains(&std::ptr::from_ref(*reason))).collect();
    // Newer layers miss less.
    let is_judged = tries_all() && laboratory.presents() && layer <= LAYER;
    assert!(idle.is_empty() || !is_judged, "reasons that no mutant needs: {idle:#?}");
}

/// Mutants by their verdict: whole rows, and bits.
#[derive(Default)]
struct Summary {
    rows: Counts,
    bits: Counts,
    rules: BTreeMap<String, usize>,
}

#[derive(Default)]
struct Counts {
    tried: usize,
    plain: usize,
    heuristic: usize,
    noticed: usize,
    argued: usize,
}

impl Summary {
    fn count(&mut self, mutant: &Mutant, heard: &BrokenRules, verdict: &MutantVerdict) {
        let counts = if mutant.part == RowPart::Row { &mut self.rows } else { &mut self.bits };
        counts.tried += 1;
        counts.plain += usize::from(!heard.plain.is_empty());
        counts.heuristic += usize::from(heard.heuristic.as_ref().is_some_and(|rules| !rules.is_empty()));
        counts.noticed += usize::from(heard.anything());
        counts.argued +=
            usize::from(matches!(verdict, MutantVerdict::ExpectedMiss(_) | MutantVerdict::UnexpectedNotice(_)));
        for rule in heard.rules() {
            *self.rules.entry(rule.to_owned()).or_default() += 1;
        }
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { tried, plain, heuristic, noticed, argued } = self;
        write!(f, "{tried} tried, {noticed} noticed ({plain} plainly, {heuristic} by the heuristic), {argued} argued")
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rows: {}; bits: {}; by rule: {:?};", self.rows, self.bits, self.rules)
    }
}
