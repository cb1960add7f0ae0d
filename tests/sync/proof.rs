//! Every dependency of every plan is needed and enough, by the specification's rules alone: no device, driver or layer is asked
//! (`afterlight::frame::proof`).

use std::collections::{BTreeMap, HashSet};

use afterlight::frame::edges::{self, Edges};
use afterlight::frame::proof::{Frames, superfluous};
use afterlight::gpu::vk;
use afterlight::plan::{Canvas, FramePlan, OUTPUT_PLAIN, OUTPUT_SRGB};
use afterlight::scene::builtin::CATALOGUE;
use afterlight::scene::{HdrFormat, LightPath, Output, Resolve, Scene, Settings, Transparency, View};

use super::combinations;
use super::necessity::samples::{self, gbuffers};
use super::necessity::{Way, cases, presented};
use crate::common::stage::{open, own};

/// Plans whose frames differ in what they touch or in what synchronizes that.
#[derive(Default)]
struct Different {
    seen: HashSet<(String, Frames)>,
    plans: Vec<(String, FramePlan, Edges)>,
    tried: usize,
}

impl Different {
    fn add(&mut self, name: &str, plan: FramePlan) {
        let shows = [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output) && plan.presented.is_none();
        if shows {
            for (way, canvas) in [("straight", Way::Straight), ("encoded", Way::Encoded)] {
                self.add_one(format!("{name}, {way} in a window"), presented(plan.clone(), canvas));
            }
            let beside = plan.clone().copied_to(Canvas::Straight(vk::Format::B8G8R8A8_SRGB));
            self.add_one(format!("{name}, beside another in a window"), beside);
        }
        self.add_one(name.to_owned(), plan);
    }

    fn add_one(&mut self, name: String, plan: FramePlan) {
        self.tried += 1;
        let rows = edges::table(&plan);
        let masks: String = rows.iter().map(|row| format!("{} {:?} {:?};", row.name, row.before, row.after)).collect();
        if self.seen.insert((masks, Frames::of(&plan, &rows))) {
            self.plans.push((name, plan, rows));
        }
    }

    fn are_proved(&self) {
        println!("{} plans, {} different frames", self.tried, self.plans.len());
        let (mut hazards, mut idle) = (Vec::new(), BTreeMap::new());
        for (name, plan, rows) in &self.plans {
            hazards.extend(Frames::of(plan, rows).hazards().iter().map(|hazard| format!("{name}: {hazard}")));
            for (row, part) in superfluous(plan, rows) {
                idle.entry(format!("{row} {part:?}")).or_insert_with(Vec::new).push(name.as_str());
            }
        }
        let idle: Vec<_> = idle.iter().map(|(part, names)| format!("{part}: {}, as {}", names.len(), names[0])).collect();
        assert!(hazards.is_empty(), "{} hazards:\n{}", hazards.len(), hazards[..hazards.len().min(30)].join("\n"));
        assert!(idle.is_empty(), "{} parts of rows order nothing:\n{}", idle.len(), idle.join("\n"));
    }
}

#[test]
fn sample_plans_have_no_hazard_and_no_superfluous_row_stage_or_access() {
    let mut plans = Different::default();
    for (name, plan) in [samples::plans(), samples::forward_plans(), samples::tiled_plans()].concat() {
        plans.add(&name, plan);
    }
    for case in cases() {
        plans.add(&case.name, case.plan(&samples::device()).unwrap_or_else(|error| panic!("{}: {error}", case.name)));
    }
    plans.are_proved();
}

#[test]
fn every_combination_of_settings_and_every_built_in_scene_is_proved() {
    let mut plans = Different::default();
    let scenes = [combinations::scene(false), combinations::scene(true)];
    let combinations = combinations::combinations();
    assert_eq!(combinations.len(), 1152);
    for (named, is_transparent, settings) in combinations {
        let scene = &scenes[usize::from(is_transparent)];
        let settings = Settings { exposure: Some(0.0), ..settings };
        if let Ok(plan) = FramePlan::of(scene, &settings, &samples::device()) {
            plans.add(&format!("{named:?}"), plan);
        }
    }
    for builtin in CATALOGUE {
        let scene = open(&format!("builtin:{}", builtin.name));
        for &(_, light_path) in LightPath::NAMES {
            let settings = Settings { light_path, ..own(&scene, 64, 36) };
            if let Ok(plan) = FramePlan::of(&scene, &settings, &samples::device()) {
                plans.add(&format!("{} {light_path:?}", builtin.name), plan);
            }
        }
    }
    plans.are_proved();
}

/// Settings that go with each other or not, of scenes with whatever a scene may have.
fn random(scenes: &[(&str, Scene)], random: &mut fastrand::Rng) -> Option<(String, FramePlan)> {
    fn one<T: Copy>(of: &[(&str, T)], random: &mut fastrand::Rng) -> T {
        of[random.usize(..of.len())].1
    }
    let (name, scene) = &scenes[random.usize(..scenes.len())];
    let settings = Settings {
        light_path: one(LightPath::NAMES, random),
        view: if random.bool() { View::Final } else { one(View::NAMES, random) },
        gbuffer: one(&gbuffers(), random),
        hdr_format: one(HdrFormat::NAMES, random),
        output: one(Output::NAMES, random),
        transparency: one(Transparency::NAMES, random),
        resolve: one(Resolve::NAMES, random),
        msaa: [1, 1, 2, 4][random.usize(..4)],
        samples: [1, 1, 4][random.usize(..3)],
        fxaa: random.bool(),
        depth_prepass: [None, Some(false), Some(true)][random.usize(..3)],
        light_cutoff: random.bool(),
        exposure: Some(0.0),
        ..Settings::default()
    };
    let plan = FramePlan::of(scene, &settings, &samples::device()).ok()?;
    Some((format!("{name} {settings:?}"), plan))
}

#[test]
fn ten_thousand_random_plans_are_proved() {
    let mut plans = Different::default();
    let mut scenes = samples::scenes();
    scenes.extend([("everything", combinations::scene(true)), ("all but glass", combinations::scene(false))]);
    let mut rng = fastrand::Rng::with_seed(1);
    let mut found = 0;
    while found < 10_000 {
        if let Some((name, plan)) = random(&scenes, &mut rng) {
            plans.add(&name, plan);
            found += 1;
        }
    }
    plans.are_proved();
}
