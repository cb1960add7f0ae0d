//! The dependencies of every plan are enough, and nearly all of their parts are needed, by the specification's rules alone: no device, driver or layer is asked
//! (`afterlight_proof`).

use std::collections::{BTreeMap, HashSet};

use afterlight::frame::rows::{self, Row, RowPart, Rows, Side};
use afterlight::gpu::sync::{Layouts, SyncVersion, Use};
use afterlight::gpu::vk;
use afterlight::plan::samples::{self, gbuffers};
use afterlight::plan::{FramePlan, OUTPUT_PLAIN, OUTPUT_SRGB, OtherQueues, PresentTarget};
use afterlight::scene::builtin::CATALOGUE;
use afterlight::scene::{
    AmbientOcclusion, Fog, HdrFormat, ImageLayouts, Keep, LightPath, OptionalPart, Output, Passes, Queues, Reflections,
    Resolve, Scene, Settings, SyncApi, Transparency, View,
};
use afterlight_proof::{FrameModel, is_superfluous};

use rayon::prelude::*;

use super::combinations;
use crate::common::stage::{open, own};
use crate::common::{one_of, tries_all};
use afterlight_lab::mutants::{PresentPath, cases, presented};

/// Plans whose frames differ in their accesses or in their synchronization.
#[derive(Default)]
struct Different {
    seen: HashSet<(String, FrameModel)>,
    plans: Vec<(String, FramePlan, Rows)>,
    tried: usize,
}

impl Different {
    /// A plan as it is, and as windows have it. `make test` takes turns with the latter.
    fn add(&mut self, name: &str, plan: FramePlan) {
        if [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output) && plan.presented.is_none() {
            let ways = [
                ("straight in a window", presented(plan.clone(), PresentPath::Straight)),
                ("encoded in a window", presented(plan.clone(), PresentPath::Encoded)),
                ("encoded and kept in a window", presented(plan.clone(), PresentPath::EncodedKept)),
                ("enlarged in a window", presented(plan.clone(), PresentPath::Enlarged)),
                (
                    "beside another in a window",
                    plan.clone().copied_to(PresentTarget::Straight(vk::Format::B8G8R8A8_SRGB)),
                ),
            ];
            for (way, plan) in one_of(&ways, self.tried) {
                self.add_one(format!("{name}, {way}"), plan.clone());
            }
        }
        self.add_one(name.to_owned(), plan);
    }

    fn add_one(&mut self, name: String, plan: FramePlan) {
        self.tried += 1;
        let rows = rows::table(&plan);
        if self.seen.insert((rows.iter().map(masks).collect(), FrameModel::of(&plan, &rows))) {
            self.plans.push((name, plan, rows));
        }
    }

    /// Asserts that there is no hazard, and that nearly each part of a row is needed for that. `make test` asks the latter of each row once, `make test-all`
    /// in all frames that have it.
    fn are_proved(&self) {
        let told = |(name, plan, rows): &(String, FramePlan, Rows)| -> Vec<String> {
            FrameModel::of(plan, rows).hazards().iter().map(|hazard| format!("{name}: {hazard}")).collect()
        };
        let hazards: Vec<_> = self.plans.par_iter().flat_map_iter(told).collect();
        let mut asked = HashSet::new();
        let mut parts = Vec::new();
        for own @ (_, _, rows) in &self.plans {
            let mut droppable: Vec<_> = rows.iter().filter(|row| row.carrier.stays().is_none()).collect();
            droppable.retain(|row| asked.insert(masks(row)) || tries_all());
            parts.extend(
                droppable.into_iter().flat_map(|row| row.parts().into_iter().map(move |part| (own, row, part))),
            );
        }
        parts.retain(|((_, plan, _), row, part)| !is_for_the_layer(plan, row, *part));
        let orders_nothing = |((name, plan, rows), row, part): &(&(String, FramePlan, Rows), &Row, RowPart)| {
            let is_idle = is_superfluous(plan, rows, row.name, *part).unwrap_or_else(|error| panic!("{error}"));
            is_idle.then(|| (format!("{} {part:?}", row.name), name.clone()))
        };
        let mut idle: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (part, name) in parts.par_iter().filter_map(orders_nothing).collect::<Vec<_>>() {
            idle.entry(part).or_default().push(name);
        }
        let idle_parts: usize = idle.values().map(Vec::len).sum();
        let (plans, frames, all) = (self.tried, self.plans.len(), parts.len());
        println!("{plans} plans, {frames} different frames, {all} parts of rows, of which {idle_parts} order nothing");
        let idle: Vec<_> =
            idle.iter().map(|(part, names)| format!("{part}: {}, as {}", names.len(), names[0])).collect();
        assert!(hazards.is_empty(), "{} hazards:\n{}", hazards.len(), hazards[..hazards.len().min(30)].join("\n"));
        // A pass waits for everything that it uses, whether another row happens to order it or not. If many parts were idle, the look-up of
        // predecessors would be too coarse.
        assert!(idle_parts * 8 < all, "{idle_parts} of {all} parts of rows order nothing:\n{}", idle.join("\n"));
    }
}

/// TILED looks up data that was copied, and waits for the copy through GEOMETRY: the upload's barrier makes GEOMETRY wait, and the render pass's
/// dependency makes TILED wait. Debian 13's layer follows this chain for attachments and not for buffers, so the barrier names TILED's reads as well.
fn is_for_the_layer(plan: &FramePlan, row: &Row, part: RowPart) -> bool {
    let reads = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
    let is_read = match part {
        RowPart::Bits(Side::After, bits) => reads.stage.contains(bits.stage) && reads.access.contains(bits.access),
        _ => false,
    };
    plan.triangles.is_some() && row.name.name().starts_with("upload-to-") && is_read
}

/// A row without its reason, of which some have several.
fn masks(row: &Row) -> String {
    let Row { name, carrier, before, after, from, to, .. } = row;
    format!("{name} {carrier:?} {before:?} {after:?} {from} {to}{};", row.region())
}

#[test]
fn sample_plans_have_no_hazard_and_hardly_a_superfluous_row_stage_or_access() {
    let mut plans = Different::default();
    for (name, plan) in samples::of_every_kind() {
        plans.add(&name, plan);
    }
    for case in cases() {
        plans.add(&case.name, case.plan(&samples::device()).unwrap_or_else(|error| panic!("{}: {error}", case.name)));
    }
    plans.are_proved();
}

const ONE: OtherQueues = OtherQueues { compute: false, transfer: false };
const ALL: OtherQueues = OtherQueues { compute: true, transfer: true };

/// Ways to carry a plan's passes: render passes or rendering, the API's version, the layouts of images, the queues.
const CARRIERS: [(Passes, SyncVersion, Layouts, OtherQueues); 9] = [
    (Passes::Stored, SyncVersion::One, Layouts::Optimal, ONE),
    (Passes::LocalRead, SyncVersion::One, Layouts::Optimal, ONE),
    (Passes::Subpasses, SyncVersion::Two, Layouts::Optimal, ONE),
    (Passes::Subpasses, SyncVersion::One, Layouts::Unified, ONE),
    (Passes::LocalRead, SyncVersion::Two, Layouts::Unified, ONE),
    (Passes::Stored, SyncVersion::Two, Layouts::Unified, ONE),
    (Passes::Subpasses, SyncVersion::One, Layouts::Optimal, ALL),
    (Passes::Stored, SyncVersion::Two, Layouts::Optimal, OtherQueues { transfer: false, ..ALL }),
    (Passes::Subpasses, SyncVersion::Two, Layouts::Unified, OtherQueues { compute: false, ..ALL }),
];

#[test]
fn sample_plans_are_proved_in_each_way_to_carry_them() {
    let mut plans = Different::default();
    for (index, (name, plan)) in samples::of_every_kind().into_iter().enumerate() {
        for &(passes, sync, layouts, queues) in one_of(&CARRIERS, index) {
            let mut plan = plan.clone();
            (plan.passes, plan.sync, plan.layouts, plan.queues) = (passes, sync, layouts, queues);
            plans.add(&format!("{name}, {passes}, {sync:?}, {layouts:?}, {queues:?}"), plan);
        }
    }
    plans.are_proved();
}

#[test]
fn every_combination_of_settings_and_every_built_in_scene_is_proved() {
    let mut plans = Different::default();
    let scenes = combinations::scenes();
    let combinations = combinations::combinations();
    assert_eq!(combinations.len(), 7488);
    for (named, scene, settings) in combinations {
        let scene = &scenes[scene];
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

/// Draws settings at random, whether they go with each other or not, for one of the scenes. Returns none where the plan refuses them.
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
        bloom: [0.0, 0.2][random.usize(..2)],
        aberration: [0.0, 0.02][random.usize(..2)],
        vignette: [0.0, 0.5][random.usize(..2)],
        ao: one(AmbientOcclusion::NAMES, random),
        reflections: one(Reflections::NAMES, random),
        fog: one(Fog::NAMES, random),
        depth_prepass: [None, Some(false), Some(true)][random.usize(..3)],
        light_cutoff: random.bool(),
        keep: if random.bool() { Keep::NONE } else { Keep::NONE.with(OptionalPart::StoredGbuffer) },
        passes: one(Passes::NAMES, random),
        sync: one(SyncApi::NAMES, random),
        layouts: one(ImageLayouts::NAMES, random),
        queues: one(Queues::NAMES, random),
        exposure: Some(0.0),
        ..Settings::default()
    };
    let plan = FramePlan::of(scene, &settings, &samples::device()).ok()?;
    Some((format!("{name} {settings:?}"), plan))
}

#[test]
fn thousands_of_random_plans_are_proved() {
    let wanted = if tries_all() { 10_000 } else { 4_000 };
    let mut plans = Different::default();
    let mut scenes = samples::scenes();
    let [opaque, glazed, ..] = combinations::scenes();
    scenes.extend([("everything", glazed), ("all but glass", opaque)]);
    let mut rng = fastrand::Rng::with_seed(1);
    let mut found = 0;
    while found < wanted {
        if let Some((name, plan)) = random(&scenes, &mut rng) {
            plans.add(&name, plan);
            found += 1;
        }
    }
    plans.are_proved();
}
