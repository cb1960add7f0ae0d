//! The plans that mutants are made of: every kind of plan that has dependencies of its own.

use super::Case;
#[cfg(feature = "present")]
use super::Way;
use super::scenes::{
    deformed, glazed, glowing, lamplit, lit, moved, plain, polished, smoking, sunlit, textured, under_sky,
};
use crate::scene::{
    AmbientOcclusion, Culling, Fog, GbufferPreset, LightPath, OptionalPart, Output, Reflections, Resolve, Scene,
    Settings, ShadowSettings, Transparency, View,
};

type Change = fn(&mut Settings);

/// Maps are drawn in each frame, so that their rows have something to order.
fn settings_of(scene: &Scene) -> Settings {
    let shadows = ShadowSettings { cache: false, size: 64, ..ShadowSettings::default() };
    Settings { size: [32, 18], shadows, light_path: LightPath::Loop, ..scene.settings.decide() }
}

/// Every kind of plan that has dependencies of its own.
pub fn cases() -> Vec<Case> {
    let sorted: Change = |_| {};
    let weighted: Change = |settings| settings.transparency = Transparency::Oit;
    let fxaa: Change = |settings| settings.fxaa = true;
    let toned: Change = |settings| (settings.vignette, settings.grain) = (0.5, 0.1);
    let samples: Change = |settings| settings.msaa = 4;
    let occluded: Change = |settings| settings.ao = AmbientOcclusion::Bitmask;
    let fat: Change = |settings| settings.gbuffer.preset = GbufferPreset::Fat;
    let linear: Change = |settings| settings.resolve = Resolve::Linear;
    let hdr: Change = |settings| settings.output = Output::Nits;
    let forward: Change = |settings| settings.light_path = LightPath::Forward;
    let compute: Change = |settings| settings.light_path = LightPath::Compute;
    let visibility: Change = |settings| settings.light_path = LightPath::Visibility;
    let stored: Change = |settings| settings.keep = settings.keep.with(OptionalPart::StoredGbuffer);
    let mut all = Vec::new();
    let mut case = |name: &str, scene: Scene, changes: &[Change]| {
        let mut settings = settings_of(&scene);
        changes.iter().for_each(|change| change(&mut settings));
        all.push(Case { name: name.into(), scene, settings, presented: None });
    };
    case("plain", plain(), &[]);
    case("nothing", Scene { name: "nothing".into(), ..Scene::default() }, &[]);
    case("textured", textured(4), &[]);
    case("sunlit", sunlit(), &[]);
    case("deformed", deformed(), &[]);
    case("deformed, view of positions", deformed(), &[|settings| settings.view = View::Position]);
    case("deformed, view of shadow maps", deformed(), &[|settings| settings.view = View::ShadowMap]);
    case("deformed, culled on the device", deformed(), &[|settings| settings.culling = Culling::Gpu]);
    case("culled on the device", sunlit(), &[|settings| settings.culling = Culling::Gpu]);
    case("glowing", glowing(plain()), &[]);
    for (name, transparency) in [("sorted", sorted), ("weighted", weighted)] {
        case(name, glazed(plain()), &[transparency]);
        case(&format!("{name}, linear"), glazed(plain()), &[transparency, hdr]);
        case(&format!("{name}, glowing and sunlit"), glazed(glowing(sunlit())), &[transparency]);
        case(&format!("{name}, samples"), glazed(plain()), &[transparency, samples]);
        case(&format!("{name}, linear samples"), glazed(plain()), &[transparency, samples, hdr]);
        case(&format!("{name}, forward"), glazed(plain()), &[transparency, forward]);
        case(&format!("{name}, forward samples"), glazed(plain()), &[transparency, forward, samples]);
        case(&format!("{name}, forward, linear"), glazed(plain()), &[transparency, forward, hdr]);
        case(&format!("{name}, forward, linear samples"), glazed(plain()), &[transparency, forward, samples, hdr]);
    }
    for (name, change) in [("skylit", sorted), ("skylit, forward", forward), ("skylit, samples", samples)] {
        case(name, under_sky(plain()), &[change]);
    }
    case("fxaa", plain(), &[fxaa]);
    case("fxaa, glowing", glowing(plain()), &[fxaa]);
    case("fxaa, glazed", glazed(plain()), &[fxaa]);
    case("glowing and glazed, linear", glazed(glowing(plain())), &[hdr]);
    case("view of samples", plain(), &[samples, |settings| settings.view = View::Complexity]);
    case("samples", plain(), &[samples]);
    case("samples averaged as light", plain(), &[samples, linear]);
    case("samples, glowing", glowing(plain()), &[samples]);
    case("linear", plain(), &[hdr]);
    case("linear, glowing", glowing(plain()), &[hdr]);
    case("linear samples", plain(), &[hdr, samples]);
    case("linear samples, glowing", glowing(plain()), &[hdr, samples]);
    case("view of normals", plain(), &[|settings| settings.view = View::Normal]);
    case("view of overdraw", plain(), &[|settings| settings.view = View::Overdraw]);
    case("view of shadow maps", sunlit(), &[|settings| settings.view = View::ShadowMap]);
    case("light by light", lamplit(), &[|settings| settings.light_path = LightPath::PerLight]);
    case("volumes", lamplit(), &[|settings| settings.light_path = LightPath::Volumes]);
    case("clustered", lamplit(), &[|settings| settings.light_path = LightPath::Clustered]);
    case("compute", lamplit(), &[compute]);
    case("compute, glowing and sunlit", glowing(sunlit()), &[compute]);
    case("compute, linear", lamplit(), &[compute, hdr]);
    case("compute, samples", lamplit(), &[compute, samples]);
    case("compute, samples averaged as light, glowing and sunlit", glowing(sunlit()), &[compute, samples, linear]);
    case("visibility, glowing and sunlit", glowing(sunlit()), &[visibility]);
    case("forward", plain(), &[forward]);
    case("forward, naive", lamplit(), &[|settings| settings.light_path = LightPath::ForwardNaive]);
    case("forward, sunlit", sunlit(), &[forward]);
    let culled: Change = |settings| (settings.culling, settings.depth_prepass) = (Culling::Gpu, Some(false));
    case("forward, culled on the device", plain(), &[forward, culled]);
    case("forward, glazed and sunlit", glazed(lit(sunlit())), &[forward]);
    case("forward, fxaa", plain(), &[forward, fxaa]);
    case("forward, fxaa, glazed", glazed(plain()), &[forward, fxaa]);
    case("forward, samples", plain(), &[forward, samples]);
    case("forward, samples averaged as light", plain(), &[forward, samples, linear]);
    case("forward, samples and fxaa", plain(), &[forward, samples, fxaa]);
    case("samples and fxaa", plain(), &[samples, fxaa]);
    case("toned", plain(), &[toned]);
    case("toned, glowing", glowing(plain()), &[toned]);
    case("toned, glazed", glazed(plain()), &[toned]);
    case("toned, samples", plain(), &[toned, samples]);
    case("toned, forward", plain(), &[toned, forward]);
    case("toned and smoothed", plain(), &[toned, fxaa]);
    let bloom: Change = |settings| settings.bloom = 0.1;
    case("bloom", plain(), &[bloom]);
    case("bloom, glowing", glowing(plain()), &[bloom]);
    case("bloom, sorted", glazed(plain()), &[bloom, sorted]);
    case("bloom, weighted", glazed(plain()), &[bloom, weighted]);
    case("bloom, linear", plain(), &[bloom, hdr]);
    case("bloom, samples averaged as light", plain(), &[bloom, samples, linear]);
    case("bloom and fxaa", plain(), &[bloom, fxaa]);
    case("bloom, toned", plain(), &[bloom, toned]);
    case("bloom, toned and smoothed", plain(), &[bloom, toned, fxaa]);
    case("bloom, stored", plain(), &[bloom, stored]);
    case("bloom, stored and glowing", glowing(plain()), &[bloom, stored]);
    case("bloom, stored and sorted", glazed(plain()), &[bloom, stored, sorted]);
    case("bloom, light by light", lamplit(), &[bloom, |settings| settings.light_path = LightPath::PerLight]);
    case("bloom, forward", plain(), &[bloom, forward]);
    case("bloom, forward and sorted", glazed(plain()), &[bloom, forward, sorted]);
    case("bloom, forward and weighted", glazed(plain()), &[bloom, forward, weighted]);
    let taa: Change = |settings| settings.taa = true;
    case("over time", plain(), &[taa]);
    case("over time, glowing", glowing(plain()), &[taa]);
    case("over time, sorted", glazed(plain()), &[taa, sorted]);
    case("over time, weighted", glazed(plain()), &[taa, weighted]);
    case("over time, linear", plain(), &[taa, hdr]);
    case("over time, smoothed and toned", plain(), &[taa, fxaa, toned]);
    case("over time, toned", plain(), &[taa, toned]);
    case("over time, spread", plain(), &[taa, bloom]);
    case("over time, spread and smoothed", plain(), &[taa, bloom, fxaa]);
    case("over time, stored", plain(), &[taa, stored]);
    case("over time, stored and sorted", glazed(plain()), &[taa, stored, sorted]);
    case("over time, forward", plain(), &[taa, forward]);
    case("over time, forward and sorted", glazed(plain()), &[taa, forward, sorted]);
    case("over time, forward and weighted", glazed(plain()), &[taa, forward, weighted]);
    case("over time, glowing and smoothed", glowing(plain()), &[taa, fxaa]);
    case("over time, glowing and stored", glowing(plain()), &[taa, stored]);
    case("over time, deformed", deformed(), &[taa]);
    case("over time, moving", moved(plain()), &[taa]);
    case("over time, moving and glowing", glowing(moved(plain())), &[taa]);
    case("over time, moving and weighted", glazed(moved(plain())), &[taa, weighted]);
    case("over time, moving and sorted", glazed(moved(plain())), &[taa, sorted]);
    case("over time, moving, stored", moved(plain()), &[taa, stored]);
    case("over time, moving, forward", moved(plain()), &[taa, forward]);
    case("over time, moving, forward and weighted", glazed(moved(plain())), &[taa, forward, weighted]);
    case("over time, moving, forward and sorted", glazed(moved(plain())), &[taa, forward, sorted]);
    let fog: Change = |settings| settings.fog = Fog::Height;
    case("fog", plain(), &[fog]);
    case("fog, glowing", glowing(plain()), &[fog]);
    case("fog, linear", plain(), &[fog, hdr]);
    case("fog, samples", plain(), &[fog, samples]);
    case("fog, linear samples", plain(), &[fog, samples, hdr]);
    case("fog, smoothed and toned", plain(), &[fog, fxaa, toned]);
    case("fog, light by light", lamplit(), &[fog, |settings| settings.light_path = LightPath::PerLight]);
    case("fog, in floats", plain(), &[fog, fat]);
    case("fog, stored", plain(), &[fog, stored]);
    case("fog, stored and glowing, linear", glowing(plain()), &[fog, stored, hdr]);
    case("fog and bloom", plain(), &[fog, bloom]);
    case("fog, occluded", plain(), &[fog, occluded]);
    case("fog, forward", plain(), &[fog, forward]);
    case("fog, forward samples", plain(), &[fog, forward, samples]);
    for (name, transparency) in [("sorted", sorted), ("weighted", weighted)] {
        case(&format!("fog, {name}"), glazed(plain()), &[fog, transparency]);
        case(&format!("fog, {name}, linear samples"), glazed(plain()), &[fog, transparency, samples, hdr]);
        case(&format!("fog, {name} and stored"), glazed(plain()), &[fog, transparency, stored]);
        case(&format!("fog, {name} and occluded"), glazed(plain()), &[fog, transparency, occluded]);
        case(&format!("fog, {name}, forward"), glazed(plain()), &[fog, transparency, forward]);
        case(&format!("fog, particles {name}"), smoking(sunlit()), &[fog, transparency]);
    }
    case("fog, particles and stored", smoking(plain()), &[fog, stored]);
    case("fog, particles summed and stored", smoking(plain()), &[fog, weighted, stored]);
    case("fog, particles summed, forward", smoking(plain()), &[fog, weighted, forward]);
    case("fog, particles and occluded", smoking(plain()), &[fog, occluded]);
    case("fog over time", plain(), &[fog, taa]);
    case("fog over time, stored", plain(), &[fog, taa, stored]);
    case("fog over time, forward", plain(), &[fog, taa, forward]);
    case("fog over time, deformed and stored", deformed(), &[fog, taa, stored]);
    case("fog over time, deformed, forward", deformed(), &[fog, taa, forward]);
    case("fog over time, moving", moved(plain()), &[fog, taa]);
    case("fog over time, moving, forward and weighted", glazed(moved(plain())), &[fog, taa, forward, weighted]);
    let froxels: Change = |settings| (settings.fog, settings.fog_froxels) = (Fog::Froxels, [5, 4, 3]);
    case("lit fog", lamplit(), &[froxels]);
    case("lit fog, sunlit and stored", sunlit(), &[froxels, stored]);
    case("lit fog, forward", sunlit(), &[froxels, forward]);
    case("lit fog, weighted", glazed(sunlit()), &[froxels, weighted]);
    case("lit fog, sorted", glazed(sunlit()), &[froxels, sorted]);
    case("occluded", plain(), &[occluded]);
    case("occluded, glowing and sunlit", glowing(lit(sunlit())), &[occluded]);
    case("occluded, sorted and glowing", glazed(glowing(plain())), &[occluded, sorted]);
    case("occluded, sorted", glazed(plain()), &[occluded, sorted]);
    case("occluded, weighted", glazed(plain()), &[occluded, weighted]);
    case("occluded, linear", plain(), &[occluded, hdr]);
    case("occluded, in floats", plain(), &[occluded, fat]);
    case("occluded, linear and glowing", glowing(plain()), &[occluded, hdr]);
    case("occluded, smoothed and toned", plain(), &[occluded, fxaa, toned]);
    case("occluded, toned", plain(), &[occluded, toned]);
    case("occluded, view of it", plain(), &[occluded, |settings| settings.view = View::Ao]);
    case("occluded, light by light", lit(lamplit()), &[occluded, |settings| settings.light_path = LightPath::PerLight]);
    case("occluded, compute", lit(lamplit()), &[occluded, compute]);
    case("occluded, compute, glowing and sunlit", glowing(lit(sunlit())), &[occluded, compute]);
    case("particles", smoking(plain()), &[]);
    case("particles, sunlit and glowing", smoking(glowing(sunlit())), &[]);
    case("particles, glazed", smoking(glazed(plain())), &[sorted]);
    case("particles, summed", smoking(plain()), &[weighted]);
    case("particles, linear", smoking(plain()), &[hdr]);
    case("particles, forward", smoking(plain()), &[forward]);
    case("particles, forward and summed", smoking(sunlit()), &[forward, weighted]);
    case("particles, stored", smoking(plain()), &[stored]);
    case("particles, stored and summed", smoking(plain()), &[stored, weighted]);
    case("particles, occluded", smoking(plain()), &[occluded]);
    let mirrored: Change = |settings| settings.reflections = Reflections::Screen;
    case("mirrored", polished(plain()), &[mirrored]);
    case("mirrored and sunlit under a sky", under_sky(polished(sunlit())), &[mirrored]);
    case("mirrored, glowing, occluded and toned", polished(glowing(lit(plain()))), &[mirrored, occluded, toned]);
    case("mirrored, sorted and occluded", polished(glazed(lit(plain()))), &[mirrored, sorted, occluded]);
    case("mirrored, sorted and glowing", polished(glazed(glowing(plain()))), &[mirrored, sorted, fxaa]);
    case("mirrored and glowing", polished(glowing(plain())), &[mirrored]);
    case("mirrored, glowing and smoothed", polished(glowing(plain())), &[mirrored, fxaa]);
    case("mirrored and smoothed", polished(plain()), &[mirrored, fxaa]);
    case("mirrored, sorted, glowing and unsmoothed", polished(glazed(glowing(plain()))), &[mirrored, sorted]);
    case("mirrored, sorted and spread", polished(glazed(plain())), &[mirrored, sorted, bloom]);
    case("mirrored, weighted", polished(glazed(plain())), &[mirrored, weighted]);
    case("mirrored, spread", polished(plain()), &[mirrored, bloom]);
    case("mirrored in fog", polished(plain()), &[mirrored, fog]);
    case("mirrored in fog, smoothed", polished(plain()), &[mirrored, fog, fxaa]);
    case("mirrored in fog, sorted and occluded", polished(glazed(lit(plain()))), &[mirrored, fog, sorted, occluded]);
    case("mirrored in fog, weighted", polished(glazed(plain())), &[mirrored, fog, weighted]);
    case("mirrored in fog, spread", polished(plain()), &[mirrored, fog, bloom]);
    case("mirrored in fog, sorted and spread", polished(glazed(plain())), &[mirrored, fog, sorted, bloom]);
    case("mirrored in fog, over time", polished(plain()), &[mirrored, fog, taa]);
    case("mirrored in fog, over time and sorted", polished(glazed(plain())), &[mirrored, fog, taa, sorted]);
    case("mirrored in fog, over time and weighted", polished(glazed(plain())), &[mirrored, fog, taa, weighted]);
    case("mirrored in fog, over time and moving", polished(moved(plain())), &[mirrored, fog, taa]);
    case("mirrored in fog, with particles", polished(smoking(plain())), &[mirrored, fog]);
    case("mirrored, weighted and spread", polished(glazed(plain())), &[mirrored, weighted, bloom]);
    case("mirrored, linear", polished(plain()), &[mirrored, hdr]);
    case("mirrored over time", polished(plain()), &[mirrored, taa]);
    case("mirrored over time and sorted", polished(glazed(plain())), &[mirrored, taa, sorted]);
    case("mirrored over time and weighted", polished(glazed(plain())), &[mirrored, taa, weighted]);
    case("mirrored over time and moving", polished(moved(plain())), &[mirrored, taa]);
    case("mirrored over time, moving and sorted", polished(glazed(moved(plain()))), &[mirrored, taa, sorted]);
    case(
        "mirrored, light by light",
        polished(lamplit()),
        &[mirrored, |settings| settings.light_path = LightPath::PerLight],
    );
    case("stored", plain(), &[stored]);
    case("stored, glowing and sunlit", glowing(sunlit()), &[stored]);
    case("stored, sorted and glowing", glazed(glowing(plain())), &[stored, sorted]);
    case("stored, weighted", glazed(plain()), &[stored, weighted]);
    case("stored, linear and glowing", glowing(plain()), &[stored, hdr]);
    case("stored, samples", plain(), &[stored, samples]);
    case("stored, samples and glowing", glowing(plain()), &[stored, samples]);
    case("stored, view of normals", plain(), &[stored, |settings| settings.view = View::Normal]);
    case("stored, light by light", lamplit(), &[stored, |settings| settings.light_path = LightPath::PerLight]);
    all.extend(shown());
    all
}

/// Each way for a picture to come to a window.
#[cfg(feature = "present")]
fn shown() -> Vec<Case> {
    let stored: Change = |settings| settings.keep = settings.keep.with(OptionalPart::StoredGbuffer);
    let ways: [(&str, Scene, Change); 18] = [
        ("lighting", sunlit(), |_| {}),
        ("a view of shadow maps", sunlit(), |settings| settings.view = View::ShadowMap),
        ("particles over a stored G-buffer", smoking(plain()), stored),
        ("forward", plain(), |settings| settings.light_path = LightPath::Forward),
        ("forward and tone mapping", glazed(plain()), |settings| settings.light_path = LightPath::Forward),
        ("tone mapping", glazed(plain()), |_| {}),
        ("emission", glowing(plain()), |_| {}),
        ("samples", plain(), |settings| settings.msaa = 4),
        ("fxaa", plain(), |settings| settings.fxaa = true),
        ("over time", plain(), |settings| settings.taa = true),
        ("over time, toned", plain(), |settings| (settings.taa, settings.vignette) = (true, 0.5)),
        ("bloom", plain(), |settings| settings.bloom = 0.1),
        ("bloom, toned", plain(), |settings| (settings.bloom, settings.vignette) = (0.1, 0.5)),
        ("bloom, toned and smoothed", plain(), |settings| {
            (settings.bloom, settings.vignette, settings.fxaa) = (0.1, 0.5, true);
        }),
        ("mirrored", polished(plain()), |settings| settings.reflections = Reflections::Screen),
        ("mirrored, sorted", polished(glazed(plain())), |settings| settings.reflections = Reflections::Screen),
        ("mirrored in fog", polished(plain()), |settings| {
            (settings.reflections, settings.fog) = (Reflections::Screen, Fog::Height);
        }),
        ("compute", lamplit(), |settings| settings.light_path = LightPath::Compute),
    ];
    let case = |(name, scene, change): (&str, Scene, Change), way: Way| {
        let mut settings = settings_of(&scene);
        change(&mut settings);
        let encoded = if way == Way::Encoded { " and ENCODE" } else { "" };
        Case { name: format!("in a window, by {name}{encoded}"), scene, settings, presented: Some(way) }
    };
    let straight = ways.iter().cloned().map(|one| case(one, Way::Straight));
    straight.chain(ways.iter().cloned().map(|one| case(one, Way::Encoded))).collect()
}

#[cfg(not(feature = "present"))]
fn shown() -> Vec<Case> {
    Vec::new()
}
