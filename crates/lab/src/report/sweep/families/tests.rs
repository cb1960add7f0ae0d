use std::sync::LazyLock;

use super::*;
use afterlight::plan::samples as plans;
use afterlight::scene::{OpenOptions, open};

/// One bay decides about a sweep as seven do.
const HALL: &str = "builtin:hall?bays=1&detail=6";

fn selection() -> Selection {
    Selection { families: None, joint: 40, quick: false, seed: 1 }
}

fn scene(spec: &str) -> Scene {
    open(spec, &OpenOptions::default()).expect("a built-in scene")
}

fn sweep(scene: &Scene, selection: &Selection) -> Sweep {
    Sweep::of(scene, &scene.settings, &plans::device(), selection).expect("planned")
}

/// The hall's, with the selection of these tests, made once.
fn hall() -> &'static Sweep {
    static SWEEP: LazyLock<Sweep> = LazyLock::new(|| sweep(&scene(HALL), &selection()));
    &SWEEP
}

fn members(sweep: &Sweep, key: &str) -> Vec<String> {
    let family = sweep.families.iter().find(|family| family.key == key);
    let family = family.unwrap_or_else(|| panic!("no {key} among {:?}", keys(sweep)));
    family.members.iter().map(|member| member.label.clone()).collect()
}

fn keys(sweep: &Sweep) -> Vec<&str> {
    sweep.families.iter().map(|family| family.key.as_str()).collect()
}

fn reason<'a>(sweep: &'a Sweep, name: &str) -> &'a str {
    let found = sweep.left_out.iter().find(|left| left.name == name);
    found.map_or_else(|| panic!("{name} is not left out: {:?}", sweep.left_out), |left| &left.reason)
}

#[test]
fn points_are_shared_and_the_first_is_the_settings_as_given() {
    let sweep = hall();
    assert_eq!(sweep.points[0], SettingsPatch::default());
    let names: std::collections::BTreeSet<String> = sweep.points.iter().map(name_of).collect();
    assert_eq!(names.len(), sweep.points.len());
    for family in &sweep.families {
        assert!(family.members.len() > 1, "{}", family.key);
        assert!(family.members.iter().all(|member| member.point < sweep.points.len()));
        let own: std::collections::BTreeSet<usize> = family.members.iter().map(|member| member.point).collect();
        assert_eq!(own.len(), family.members.len(), "{}: {:?}", family.key, family.members);
        assert!(own.contains(&0) || family.key.contains('/'), "{} lacks the settings as given", family.key);
    }
}

#[test]
fn the_values_that_quick_left_out_are_told_in_one_short_line() {
    let left_out = |count: usize| {
        let left = |index: usize| LeftOut { name: format!("setting{}={index}", index % 11), reason: QUICK.to_owned() };
        let other = LeftOut { name: "fog".into(), reason: "no fog".into() };
        (0..count).map(left).chain([other]).collect::<Vec<_>>()
    };
    assert_eq!(Sweep::quick_words(&left_out(0)), None);
    let one = Sweep::quick_words(&left_out(1)).expect("a line");
    assert_eq!(one, "--quick left out 1 value of 1 setting (setting0): without it all are tried");
    let many = Sweep::quick_words(&left_out(400)).expect("a line");
    let named = "--quick left out 400 values of 11 settings (setting0, setting1, setting10, setting2, ";
    assert!(many.starts_with(named) && many.ends_with(" and 3 more): without it all are tried"), "{many}");
    // A sweep of the program's own fits on two lines of a terminal.
    let quick = sweep(&scene(HALL), &Selection { quick: true, ..selection() });
    let hall = Sweep::quick_words(&quick.left_out).expect("it tries fewer values");
    assert!(hall.len() <= 240, "{hall}");
}

#[test]
fn names_of_points_are_settings_again() {
    for point in hall().points.iter().skip(1) {
        assert_eq!(name_of(point).parse::<SettingsPatch>().expect("settings"), *point);
    }
}

#[test]
fn a_family_has_the_values_of_its_setting_in_order() {
    let sweep = hall();
    assert_eq!(members(sweep, "samples"), ["1", "2", "4", "8", "16", "32", "64"]);
    let sizes = members(sweep, "shadow-size");
    assert!(sizes.starts_with(&["256", "512", "1024", "2048", "4096"].map(str::to_owned)), "{sizes:?}");
    let gbuffer = members(sweep, "gbuffer");
    assert_eq!(gbuffer[0], "lean");
    assert!(["fat", "float32", "normal rgb10a2"].iter().all(|label| gbuffer.contains(&(*label).into())), "{gbuffer:?}");
}

#[test]
fn what_a_scene_does_not_need_is_left_out_with_its_reason() {
    let mut scene = scene("builtin:spheres");
    for light in &mut scene.lights {
        light.casts_shadow = false;
        light.size = 0.0;
    }
    let sweep = sweep(&scene, &selection());
    assert!(!keys(&sweep).iter().any(|key| key.starts_with("shadow") || *key == "cascades"), "{:?}", keys(&sweep));
    assert!(reason(&sweep, "shadow-size").contains("no shadow map"));
    assert!(reason(&sweep, "transparency").contains("transparent"));
    assert!(reason(&sweep, "hdr-format").contains("HDR target"));
}

#[test]
fn what_the_plan_refuses_is_left_out_in_its_words() {
    let scene = scene(HALL);
    let device = Capabilities { msaa: 1 | 4, ..plans::device() };
    let sweep = Sweep::of(&scene, &scene.settings, &device, &selection()).expect("planned");
    assert!(reason(&sweep, "msaa=8").contains("cannot draw 8 samples"));
    assert_eq!(members(&sweep, "msaa"), ["1", "4"]);
    let small = Capabilities { compute_invocations: 64, ..device };
    let sweep = Sweep::of(&scene, &scene.settings, &small, &selection()).expect("planned");
    assert!(reason(&sweep, "light-path=compute").contains("work groups"));
}

#[test]
fn the_soft_filter_is_for_lights_that_have_a_size() {
    let mut scene = scene(HALL);
    for (size, has) in [(0.0, false), (0.5, true)] {
        scene.lights.iter_mut().for_each(|light| light.size = size);
        let filters = members(&sweep(&scene, &selection()), "shadow-filter");
        assert_eq!(filters.contains(&"pcss".to_owned()), has, "{filters:?}");
    }
}

#[test]
fn combinations_are_many_different_and_the_same_for_a_seed() {
    let scene = scene(HALL);
    let joint = |selection: &Selection| {
        let sweep = sweep(&scene, selection);
        let family = sweep.families.iter().find(|family| family.key == JOINT).expect("there").clone();
        family.members.iter().map(|member| name_of(&sweep.points[member.point])).collect::<Vec<_>>()
    };
    let one = joint(&selection());
    assert!(one.len() <= 40 && one.len() > 30, "{}", one.len());
    assert_eq!(one, joint(&selection()));
    assert_ne!(one, joint(&Selection { seed: 2, ..selection() }));
    assert!(one.contains(&"default".to_owned()));
    assert!(one.iter().filter(|name| name.split(' ').count() > 2).count() > 15, "{one:?}");
    let few = joint(&Selection { joint: 10, quick: true, ..selection() });
    assert!(few.len() <= 10 && few.iter().any(|name| name.contains(' ')), "{few:?}");
}

#[test]
fn more_combinations_than_there_are_cost_nothing_and_one_is_the_settings_as_given() {
    let scene = scene("builtin:spheres");
    let base = Base::of(&scene, &scene.settings, &plans::device()).map(|base| {
        let axes = ["msaa", "fxaa"]
            .map(|key| axes::all(&base, true).into_iter().find(|axis| axis.key == key).expect("an axis"));
        joint::combinations(&base, &axes, &Selection { joint: usize::MAX, ..selection() }).len()
    });
    assert!(base.is_ok_and(|found| (2..12).contains(&found)));
    let one = sweep(&scene, &Selection { joint: 1, ..selection() });
    assert!(reason(&one, "joint").contains("settings as given"), "{}", reason(&one, "joint"));
}

#[test]
fn numbers_are_labelled_as_somebody_would_write_them() {
    let sweep = hall();
    for family in &sweep.families {
        for member in &family.members {
            assert!(member.value.is_none_or(|value| member.label == value.to_string()), "{member:?}");
            assert!(member.value.is_none() || member.label.len() < 7, "{}: {}", family.key, member.label);
        }
    }
}

#[test]
fn families_are_chosen_by_their_keys() {
    let scene = scene(HALL);
    let only = |keys: &[&str]| {
        let families = Some(keys.iter().map(|&key| key.to_owned()).collect());
        sweep(&scene, &Selection { families, ..selection() })
    };
    assert_eq!(keys(&only(&["samples", "gbuffer"])), ["gbuffer", "samples"]);
    assert_eq!(keys(&only(&["shadow-size"])), ["shadow-size", "shadow-size/none", "shadow-size/5x5"]);
    assert_eq!(keys(&only(&["joint"])), ["joint"]);
    assert_eq!(only(&[]).points.len(), 1);
    assert!(family_keys().contains(&"joint") && family_keys().contains(&"msaa"));
}

#[test]
fn points_are_dealt_to_shards_each_once_but_the_first() {
    let sweep = sweep(&scene(HALL), &Selection { quick: true, joint: 0, ..selection() });
    let words = Sweep::quick_words(&sweep.left_out).expect("fewer values");
    assert!(words.contains("cascades") && words.ends_with(": without it all are tried"), "{words}");
    let mut dealt: Vec<usize> = (1..=3).flat_map(|index| sweep.own(Some(Shard { index, count: 3 }))).collect();
    assert_eq!(dealt.iter().filter(|&&index| index == 0).count(), 3);
    dealt.sort_unstable();
    dealt.dedup();
    assert_eq!(dealt, sweep.own(None));
}
