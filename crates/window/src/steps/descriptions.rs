//! The description of a step: its name, and a sentence about the pass or the lights.

use std::collections::BTreeMap;

use super::FrameStep;
use afterlight::frame::DrawCounts;
use afterlight::frame::list::StepList;
use afterlight::gpu::vk;
use afterlight::passes::Endpoint;
use afterlight::plan::{DEPTH, FramePlan, Gbuffer, ToneMapping, effects};
use afterlight::scene::{Light, LightForm, LightPath, Resolve, Scene, View, counted};

/// The most lights of a group that are named.
const MOST_NAMES: usize = 6;

impl FrameStep {
    /// Returns the step's name, to be shown beside its pass's name.
    pub fn name(self, plan: &FramePlan, scene: &Scene) -> String {
        match self {
            Self::ShadowMaps => "shadow maps".into(),
            Self::Buffer(View::Complexity) => "samples that differ".into(),
            Self::Buffer(view) | Self::Rewritten(_, view) => view.name().into(),
            Self::Lights { end: 0, .. } => "no light".into(),
            Self::Lights { first, end } if end == first + 1 => light_name(plan, scene, first),
            Self::Lights { first, end } => format!("lights {} to {end}", first + 1),
            Self::TransparentSums => "transparent surfaces, in sums".into(),
            Self::Transparent => "transparent surfaces".into(),
            Self::Composite => "transparent surfaces, laid over".into(),
            Self::Light => "light before the curve".into(),
            Self::Tonemap => "the curve".into(),
            Self::Effect(_) => "the picture after it".into(),
        }
    }

    /// Describes the step, in a sentence or two.
    pub fn sentence(self, plan: &FramePlan, scene: &Scene) -> String {
        match self {
            Self::ShadowMaps => shadow_maps(plan),
            Self::Buffer(view) | Self::Rewritten(_, view) => buffer(view, plan),
            Self::Lights { end: 0, .. } => before_lights(plan),
            Self::Lights { first, end } if end == first + 1 => one_light(plan, scene, first),
            Self::Lights { first, end } => lights(plan, scene, first..end),
            Self::TransparentSums => {
                "Adds up transparent surfaces in any order, with weights, in targets of their own: the picture is as it was.".into()
            }
            Self::Transparent => "Blends transparent surfaces over the light, the farthest first.".into(),
            Self::Composite => "Lays the sums of transparent surfaces over the light as one layer.".into(),
            Self::Light => "The exposed light as TONEMAP finds it, cut off at 1.".into(),
            Self::Tonemap => tonemap(plan),
            Self::Effect(place) => effect(plan, place),
        }
    }

    /// Returns the last frame's figures of it.
    pub fn counts(self, drawn: &DrawCounts) -> String {
        match self {
            Self::ShadowMaps => format!(
                "{} of {} drawn anew in this frame, with {}.",
                counted(drawn.shadow_maps_drawn, "map"),
                drawn.shadow_maps,
                counted(drawn.casters, "draw")
            ),
            Self::Rewritten(..) => "One invocation a pixel.".into(),
            Self::Buffer(_) => match drawn.on_device {
                0 => format!("{}, {} out of view.", counted(drawn.objects, "opaque object"), drawn.culled),
                all => format!("What the device sees of {}.", counted(all, "opaque object")),
            },
            Self::Lights { .. } => format!("{} in this frame.", counted(drawn.lights, "light")),
            Self::TransparentSums | Self::Transparent | Self::Composite => {
                format!("{} of all surfaces in view.", counted(drawn.triangles, "triangle"))
            }
            Self::Light | Self::Tonemap | Self::Effect(_) => "One triangle over the whole picture.".into(),
        }
    }
}

/// Describes a pass over the picture.
fn effect(plan: &FramePlan, place: Endpoint) -> String {
    let what = StepList::of(plan).passes_at(place).first().map_or("", |pass| pass.what);
    let mut letters = what.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

fn shadow_maps(plan: &FramePlan) -> String {
    let Some(shadow) = &plan.shadow else { return String::new() };
    let (maps, lights) = (counted(shadow.tiles.len(), "depth map"), counted(shadow.lights.len(), "light"));
    let (layers, edge) = (counted(shadow.layers as usize, "layer"), shadow.size);
    format!("Draws casters into {maps} of {lights}, in {layers} of {edge} x {edge} texels.")
}

fn buffer(view: View, plan: &FramePlan) -> String {
    let Some(gbuffer) = &plan.gbuffer else { return String::new() };
    let what = match view {
        View::Depth if plan.depth_prepass => format!("Depth ({DEPTH:?}), drawn before all else"),
        View::Depth => format!("Depth ({DEPTH:?})"),
        View::Position => stored("Position", gbuffer.position),
        View::Normal => stored("Shading normals", Some(gbuffer.normal)),
        View::Albedo => stored("Albedo", Some(gbuffer.albedo)),
        View::Metallic => stored("How metallic surfaces are", gbuffer.material),
        View::Roughness => stored("Roughness", gbuffer.material),
        View::Complexity => return complexity(gbuffer, plan),
        other => effects::of_gbuffer(plan)
            .find(|&(_, view, _)| view == other)
            .map_or_else(|| other.name().into(), |(target, _, content)| stored(content, plan.format_of(target))),
    };
    let sampled = if plan.msaa > 1 { "; this view has one sample a pixel" } else { "" };
    format!("{what}: {} bytes a pixel with all that GEOMETRY writes{sampled}.", plan.gbuffer_bytes_per_pixel())
}

fn stored(what: &str, format: Option<vk::Format>) -> String {
    format.map_or_else(|| what.into(), |format| format!("{what} ({format:?})"))
}

fn complexity(gbuffer: &Gbuffer, plan: &FramePlan) -> String {
    let bytes = gbuffer.bytes_per_pixel();
    format!("Pixels whose {} samples of {bytes} bytes differ: LIGHTING shades each of their samples.", plan.msaa)
}

fn before_lights(plan: &FramePlan) -> String {
    let how = match plan.light_path {
        LightPath::PerLight => {
            "One triangle lights all pixels, and then each point or spot light is a draw, cut to the rectangle that it reaches."
        }
        LightPath::Volumes => {
            "One triangle lights all pixels, and then each light of limited reach is drawn as a sphere or cone."
        }
        LightPath::Clustered => "One triangle; each pixel goes over the list of its froxel.",
        LightPath::Compute => "A compute pass: each tile of pixels finds the lights that reach it.",
        LightPath::Visibility => {
            "A compute pass: each tile of pixels looks its surfaces up by the numbers of their triangles, and finds the lights that reach it."
        }
        LightPath::Forward if plan.has_clusters() => {
            "Surfaces are lit as they are drawn; each pixel goes over the list of its froxel."
        }
        LightPath::Forward | LightPath::ForwardNaive => "Surfaces are lit as they are drawn, each by every light.",
        LightPath::Auto | LightPath::Loop => "One triangle; each pixel goes over all lights.",
    };
    let so_far = match (plan.lights.ambient, plan.emissive) {
        (true, true) => "So far there are ambient light and what surfaces emit.",
        (true, false) => "So far there is ambient light.",
        (false, true) => "So far there is what surfaces emit.",
        (false, false) => "So far nothing is lit.",
    };
    format!("{how} {so_far}")
}

/// A light of the plan, by its place there.
fn light_of<'a>(plan: &FramePlan, scene: &'a Scene, place: usize) -> Option<(usize, &'a Light)> {
    let number = *plan.light_numbers().get(place)?;
    Some((number, scene.lights.get(number)?))
}

fn light_name(plan: &FramePlan, scene: &Scene, place: usize) -> String {
    match light_of(plan, scene, place) {
        Some((number, light)) if light.name.is_empty() => format!("light {number}"),
        Some((number, light)) if has_namesake(scene, number) => format!("{}, light {number}", light.name),
        Some((_, light)) => light.name.clone(),
        None => String::new(),
    }
}

/// Returns true if another light has the same name.
fn has_namesake(scene: &Scene, number: usize) -> bool {
    let mut others = scene.lights.iter().enumerate().filter(|&(other, _)| other != number);
    others.any(|(_, other)| other.name == scene.lights[number].name)
}

fn maps_of(plan: &FramePlan, place: usize) -> usize {
    let lights = plan.shadow.iter().flat_map(|shadow| &shadow.lights);
    lights.filter(|own| own.light == place).map(|own| own.projection.views()).sum()
}

fn one_light(plan: &FramePlan, scene: &Scene, place: usize) -> String {
    let Some((_, light)) = light_of(plan, scene, place) else { return String::new() };
    let LightForm { name, unit, range, .. } = light.kind.form();
    let range = range.map_or_else(String::new, |range| format!(" that reaches {} m", short(range)));
    let maps = match maps_of(plan, place) {
        0 if light.casts_shadow => "without the shadow map that it asks for".into(),
        0 => "without a shadow".into(),
        maps => format!("with {}", counted(maps, "shadow map")),
    };
    let intensity = short(f64::from(light.intensity));
    format!(
        "Adds light {} of {}: a {name} light of {intensity} {unit}{range}, {maps}.",
        place + 1,
        plan.light_numbers().len()
    )
}

fn lights(plan: &FramePlan, scene: &Scene, places: std::ops::Range<usize>) -> String {
    let mut kinds = BTreeMap::new();
    for (_, light) in places.clone().filter_map(|place| light_of(plan, scene, place)) {
        let form = light.kind.form();
        *kinds.entry((form.number, form.name)).or_insert(0) += 1;
    }
    let kinds: Vec<String> = kinds.into_iter().map(|((_, kind), number)| format!("{number} {kind}")).collect();
    let maps = match places.clone().map(|place| maps_of(plan, place)).sum() {
        0 => "without shadow maps".into(),
        maps => format!("with {}", counted(maps, "shadow map")),
    };
    let names: Vec<String> = places.clone().take(MOST_NAMES).map(|place| light_name(plan, scene, place)).collect();
    let more = places.len().saturating_sub(MOST_NAMES);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let (first, end, all) = (places.start + 1, places.end, plan.light_numbers().len());
    format!("Adds lights {first} to {end} of {all}: {}, {maps}: {}{more}.", kinds.join(", "), names.join(", "))
}

fn tonemap(plan: &FramePlan) -> String {
    let curve = match plan.tone_mapping {
        ToneMapping::Subpass(curve) | ToneMapping::InLighting(curve) | ToneMapping::AfterFrames(curve) => curve.name(),
        ToneMapping::Kept | ToneMapping::Absent => "none",
    };
    let samples = match (plan.msaa > 1, plan.resolve) {
        (true, Resolve::Linear) => ", after the samples of a pixel are averaged",
        (true, Resolve::ToneMapped) => ", sample by sample, and then they are averaged",
        _ => "",
    };
    format!("Brings light to what the display shows, by the curve {curve}{samples}.")
}

/// Three digits after the point at most, or a power of ten where they would not tell.
fn short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let digits = format!("{value:.3}");
    digits.trim_end_matches('0').trim_end_matches('.').into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight::plan::samples;
    use afterlight::scene::{Falloff, Material, Settings};

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.25, "0.25"),
            (120.0, "120"),
            (12.3456, "12.346"),
            (2e-5, "2.00e-5"),
            (3e7, "3.00e7"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn a_light_is_told_by_its_name_kind_unit_and_maps() {
        let unnamed =
            Light { name: String::new(), intensity: 2.5, casts_shadow: true, ..samples::point(Falloff::Quadratic) };
        let scene = samples::scene(vec![Material::default()], vec![unnamed, samples::sun()]);
        let plan = FramePlan::of(&scene, &Settings::default(), &samples::device()).expect("a plan");
        let [sun, lamp] = [0, 1].map(|first| FrameStep::Lights { first, end: first + 1 });
        assert_eq!((sun.name(&plan, &scene), lamp.name(&plan, &scene)), ("sun".into(), "light 0".into()));
        assert_eq!(
            sun.sentence(&plan, &scene),
            "Adds light 1 of 2: a directional light of 100 lx, with 2 shadow maps."
        );
        assert_eq!(
            lamp.sentence(&plan, &scene),
            "Adds light 2 of 2: a point light of 2.5 cd that reaches 5 m, with 6 shadow maps."
        );
        let both = FrameStep::Lights { first: 0, end: 2 };
        assert_eq!(
            both.sentence(&plan, &scene),
            "Adds lights 1 to 2 of 2: 1 directional, 1 point, with 8 shadow maps: sun, light 0."
        );
        assert_eq!(both.name(&plan, &scene), "lights 1 to 2");
        assert!(
            FrameStep::ShadowMaps.sentence(&plan, &scene).starts_with("Draws casters into 8 depth maps of 2 lights")
        );
    }

    #[test]
    fn every_step_of_every_plan_has_a_name_and_a_sentence() {
        for (_, scene) in samples::scenes() {
            for settings in
                [Settings::default(), samples::deferred(), Settings { msaa: 4, fxaa: true, ..samples::deferred() }]
            {
                let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
                for step in FrameStep::all(&plan) {
                    let said =
                        [step.name(&plan, &scene), step.sentence(&plan, &scene), step.counts(&DrawCounts::default())];
                    assert!(said.iter().all(|text| !text.is_empty() && !text.contains("  ")), "{step:?}: {said:?}");
                }
            }
        }
    }
}
