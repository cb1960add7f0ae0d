//! The plans that mutants are made of: a plain frame, varied and varied again as long as that gives rows which no plan before it has.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::MutantCase;
use super::scenes::{deformed, glaze, glow, lamplit, plain, sunlit, textured};
use afterlight::frame::rows::{self, Row};
use afterlight::plan::{self, Capabilities, Variation};
use afterlight::scene::{
    Culling, GbufferPreset, ImageLayouts, LightPath, OptionalPart, Output, Passes, Queues, Resolve, Scene, Settings,
    ShadowSettings, SyncApi, Transparency, View,
};

/// Variations of the whole frame. Each is tried alone, and with each other one.
const FRAME: &[Variation] = &[
    Variation::with("nothing", |scene| *scene = Scene::default(), |_| {}),
    Variation::with("deformed", |scene| *scene = deformed(), |_| {}),
    Variation::with("textured", |scene| *scene = textured(4), |_| {}),
    Variation::with("lamplit", |scene| *scene = lamplit(), |_| {}),
    by_lamps("light by light", |settings| settings.light_path = LightPath::PerLight),
    by_lamps("volumes", |settings| settings.light_path = LightPath::Volumes),
    by_lamps("clustered", |settings| settings.light_path = LightPath::Clustered),
    by_lamps("compute", |settings| settings.light_path = LightPath::Compute),
    by_lamps("forward, naive", |settings| settings.light_path = LightPath::ForwardNaive),
    Variation::of("visibility", |settings| settings.light_path = LightPath::Visibility),
    Variation::of("in floats", |settings| settings.gbuffer.preset = GbufferPreset::Fat),
    Variation::of("culled on the device", |settings| settings.culling = Culling::Gpu),
    Variation::of("no pre-pass", |settings| settings.depth_prepass = Some(false)),
    Variation::of("view of positions", |settings| settings.view = View::Position),
    Variation::of("view of normals", |settings| settings.view = View::Normal),
    Variation::of("view of overdraw", |settings| settings.view = View::Overdraw),
    Variation::of("view of shadow maps", |settings| settings.view = View::ShadowMap),
    Variation::of("view of samples", |settings| settings.view = View::Complexity),
    Variation::of("view of light", |settings| settings.view = View::Lighting),
];

/// Variations that decide, together with the variations of effects, which passes draw and in which render passes. Up to [`MOST`] of them are tried
/// together.
const PASSES: &[Variation] = &[
    Variation::with("sunlit", |scene| *scene = sunlit(), |_| {}),
    Variation::of("forward", |settings| settings.light_path = LightPath::Forward),
    Variation::of("samples", |settings| settings.msaa = 4),
    Variation::of("averaged as light", |settings| settings.resolve = Resolve::Linear),
    Variation::of("linear", |settings| settings.output = Output::Nits),
    Variation::of("stored", |settings| settings.keep = settings.keep.with(OptionalPart::StoredGbuffer)),
    Variation::with("glowing", glow, |_| {}),
    Variation::with("sorted", glaze, |_| {}),
    Variation::with("weighted", glaze, |settings| settings.transparency = Transparency::Oit),
    Variation::of("summed", |settings| settings.transparency = Transparency::Oit),
    Variation::of("toned", |settings| (settings.vignette, settings.grain) = (0.5, 0.1)),
];

/// The most variations of one plan. Four find every row that sample plans of the tests have (`tests/sync/necessity.rs`).
const MOST: usize = 4;

/// A light path that lamps need.
const fn by_lamps(name: &'static str, settings: fn(&mut Settings)) -> Variation {
    Variation::with(name, |scene| *scene = lamplit(), settings)
}

/// A plain frame with these variations, in their order.
fn varied(variations: &[&Variation]) -> MutantCase {
    let mut scene = plain();
    variations.iter().for_each(|variation| (variation.scene)(&mut scene));
    // Maps are drawn in each frame, so that their rows have something to order.
    let shadows = ShadowSettings { cache: false, size: 64, ..ShadowSettings::default() };
    let mut settings = Settings { size: [32, 18], shadows, light_path: LightPath::Loop, ..Settings::default() };
    variations.iter().for_each(|variation| (variation.settings)(&mut settings));
    let names: Vec<&str> = variations.iter().map(|variation| variation.name).collect();
    let name = if names.is_empty() { "plain".into() } else { names.join(", ") };
    MutantCase { name, scene, settings, presented: None }
}

/// All sets of variations that are tried, smaller ones first.
fn sets() -> Vec<Vec<&'static Variation>> {
    let (alone, combined): (Vec<&Variation>, Vec<&Variation>) = plan::variations().partition(|own| own.is_alone);
    let few = FRAME.len() + alone.len();
    let all: Vec<&Variation> = FRAME.iter().chain(alone).chain(PASSES).chain(combined).collect();
    // Sets hold indices into `all`. Sets of more than two leave out the first `few` variations.
    let mut last: Vec<Vec<usize>> = vec![Vec::new()];
    let mut sets = last.clone();
    for size in 1..=MOST {
        let from = if size > 2 { few } else { 0 };
        let larger = |set: &Vec<usize>| {
            let set = set.clone();
            let first = set.last().map_or(from, |last| from.max(last + 1));
            (first..all.len()).map(move |next| [&set[..], &[next]].concat())
        };
        last = last.iter().filter(|set| set.iter().all(|&place| place >= from)).flat_map(larger).collect();
        sets.extend(last.iter().cloned());
    }
    sets.into_iter().map(|set| set.into_iter().map(|place| all[place]).collect()).collect()
}

/// The rows of a case's frames on a device that can do everything; none where the settings do not go together.
fn rows(case: &MutantCase) -> Vec<Row> {
    let table = case.plan(&Capabilities::ample()).map(|plan| rows::table(&plan));
    table.map_or(Vec::new(), |table| table.iter().filter(|row| row.carrier.stays().is_none()).map(Row::masks).collect())
}

/// Keeps only the cases with a row that no case before has. `seen` holds the rows of the cases before.
fn with_new_rows(cases: Vec<MutantCase>, seen: &mut Vec<Row>) -> Vec<MutantCase> {
    let tables: Vec<Vec<Row>> = cases.par_iter().map(rows).collect();
    let mut has_new = |rows: Vec<Row>| {
        let before = seen.len();
        rows.into_iter().for_each(|row| {
            if !seen.contains(&row) {
                seen.push(row);
            }
        });
        seen.len() > before
    };
    cases.into_iter().zip(tables).filter_map(|(case, rows)| has_new(rows).then_some(case)).collect()
}

/// The cases: frames as they are read back, and as a window shows them.
pub fn cases() -> Vec<MutantCase> {
    static FOUND: OnceLock<Vec<MutantCase>> = OnceLock::new();
    FOUND.get_or_init(find).clone()
}

fn find() -> Vec<MutantCase> {
    let mut seen = Vec::new();
    let mut cases = with_new_rows(sets().iter().map(|set| varied(set)).collect(), &mut seen);
    let shown = with_new_rows(shown(&cases), &mut seen);
    cases.extend(shown);
    let carried = with_new_rows(carried(), &mut seen);
    cases.extend(carried);
    cases
}

/// Ways to carry a frame beside render passes with subpasses.
const CARRIERS: &[Variation] = &[
    Variation::of("each subpass stored", |settings| settings.passes = Passes::Stored),
    Variation::of("by local read", |settings| settings.passes = Passes::LocalRead),
    Variation::of("synchronization 2", |settings| settings.sync = SyncApi::Two),
    Variation::of("unified layouts", |settings| settings.layouts = ImageLayouts::Unified),
    Variation::of("on all queues", |settings| settings.queues = Queues::All),
];

/// The variations that [`CARRIERS`] are tried with, by name: each set gives another kind of rows. Effects have further sets.
const CARRIED: &[&[&str]] = &[
    &[],
    &["textured"],
    &["sunlit", "glowing", "weighted", "toned"],
    &["occluded", "glowing"],
    &["forward", "weighted"],
    &["compute"],
    &["in floats", "glowing"],
    &["with tinted shadows"],
];

/// Frames carried in other ways.
fn carried() -> Vec<MutantCase> {
    let all: Vec<&Variation> = FRAME.iter().chain(PASSES).chain(plan::variations()).collect();
    let named = |name: &&str| all.iter().copied().find(|own| own.name == *name);
    let sets = CARRIED.iter().map(|names| names.iter().filter_map(named).collect::<Vec<_>>());
    let of_one = |own: &'static Variation| {
        own.carried_with.iter().map(move |others| std::iter::once(own).chain(others.iter().filter_map(named)).collect())
    };
    let sets = sets.chain(plan::variations().flat_map(of_one));
    let with = |set: Vec<&'static Variation>| {
        CARRIERS.iter().map(move |carrier| varied(&[&set[..], &[carrier]].concat())).collect::<Vec<_>>()
    };
    sets.flat_map(with).collect()
}

/// The cases with a tone-mapped picture as a window shows them, by both paths of a picture into the window.
#[cfg(feature = "present")]
fn shown(cases: &[MutantCase]) -> Vec<MutantCase> {
    use super::PresentPath;

    let tone_mapped = cases.iter().filter(|case| case.settings.output == Output::Srgb8);
    let ways = |case: &MutantCase| {
        [("in a window", PresentPath::Straight), ("in a window by ENCODE", PresentPath::Encoded)].map(|(how, path)| {
            MutantCase { name: format!("{}, {how}", case.name), presented: Some(path), ..case.clone() }
        })
    };
    tone_mapped.flat_map(ways).collect()
}

#[cfg(not(feature = "present"))]
fn shown(_: &[MutantCase]) -> Vec<MutantCase> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carried_frames_are_of_variations_that_exist() {
        let all: Vec<&str> = FRAME.iter().chain(PASSES).chain(plan::variations()).map(|own| own.name).collect();
        for name in CARRIED.iter().copied().flatten() {
            assert!(all.contains(name), "no variation is named {name}");
        }
        let cases = cases();
        for carrier in CARRIERS {
            let count = cases.iter().filter(|case| case.name.ends_with(carrier.name)).count();
            assert!(count >= 2, "{count} cases {}", carrier.name);
        }
    }
}
