//! Lights, the ways to find them, and their shadow maps.

use super::{Part, part};
use crate::plan::lights::MIXED_FALLOFF;
use crate::plan::{
    FramePlan, Grid, MapProjection, PlannedBrdf, PlannedLights, SLICES, Shading, ShadowLight, ShadowPlan, shadow_reason,
};
use crate::scene::{OptionalPart, Scene, Settings, TRAITS};

pub(super) fn shading(plan: &FramePlan) -> Vec<Part> {
    let count = plan.light_order.order.len();
    // A buffer for each of two frames in flight.
    let slots = count.max(1);
    let brdf = match plan.brdf {
        _ if plan.is_forward() => "a constant of each pipeline that lights what it draws".into(),
        PlannedBrdf::One(brdf) => format!("all materials are {brdf:?}: a constant in LIGHTING"),
        PlannedBrdf::PerPixel if plan.triangles.is_some() => "materials differ: each says its own".into(),
        PlannedBrdf::PerPixel => "materials differ: chosen for each pixel".into(),
    };
    let lights = &plan.lights;
    let kind = |name: &str, present: bool, optional| {
        let reason = if present { "the scene has some" } else { "no such light, or this view needs none" };
        part(name, present, reason, 0).is(optional)
    };
    let froxels = Grid::of(plan.size);
    let lists = match plan.has_clusters() {
        true => format!(
            "{}x{} tiles by {SLICES} slices, and as many entries as lights reach into them",
            froxels.columns, froxels.rows
        ),
        false => "no pass goes over lists of lights".into(),
    };
    let path = format!("light path {}", plan.light_path);
    let traits = TRAITS.iter().map(|own| kind(own.name, lights.traits & own.bit != 0, own.part));
    let emissive = plan.emissive || plan.keys().any(|key| key.forward.is_some_and(|key| key.emissive));
    let mut parts = vec![
        part(&path, matches!(plan.shading, Shading::Light { .. }), plan.light_path_reason.clone(), 0),
        part("BRDF by pixel", plan.brdf == PlannedBrdf::PerPixel && !plan.is_forward(), brdf, 0)
            .is(OptionalPart::BrdfByPixel),
        part("lists of lights by froxel", plan.has_clusters(), lists, 2 * 8 * froxels.clusters() as u64)
            .is(OptionalPart::LightLists),
        part(
            "light buffers",
            lights.any(),
            format!("{count} {} on the scene", if count == 1 { "light shines" } else { "lights shine" }),
            2 * 64 * slots as u64,
        ),
        idle_lights(plan),
        kind("directional lights", lights.directional, OptionalPart::DirectionalLights),
        kind("point and spot lights", lights.punctual, OptionalPart::PunctualLights),
    ];
    parts.extend(traits);
    parts.push(falloffs(lights));
    parts.push(kind("ambient light", lights.ambient, OptionalPart::AmbientLight));
    parts.push(kind("emissive surfaces", emissive, OptionalPart::Emissive));
    parts.extend(sky(plan));
    parts
}

/// The cube of the sky, and the light of it that surfaces collect.
fn sky(plan: &FramePlan) -> [Part; 2] {
    let Some(sky) = &plan.sky else {
        let why = "the scene has none, or this view needs none";
        return [part("sky", false, why, 0), part("light of the sky", false, why, 0)];
    };
    let [cube, light] = sky.bytes();
    let faces = format!("6 faces of {0}x{0} half floats, in all levels", sky.edge);
    let collected = match sky.lights {
        true => format!("computed once, from {} directions a texel", sky.samples),
        false => "the sky is seen alone".into(),
    };
    [part("sky", true, faces, cube), part("light of the sky", sky.lights, collected, light)]
}

/// The fall-off: chosen for each light, or a constant.
fn falloffs(lights: &PlannedLights) -> Part {
    let mixed = lights.punctual && lights.falloff == MIXED_FALLOFF;
    let reason = match (lights.punctual, mixed) {
        (false, _) => "no light has one",
        (true, false) => "all lights have the same: a constant",
        (true, true) => "lights differ",
    };
    part("fall-off by light", mixed, reason, 0).is(OptionalPart::Falloffs)
}

/// Lights that reach no object. On a CPU each frame leaves out those, too, that its camera does not see.
fn idle_lights(plan: &FramePlan) -> Part {
    let kept = plan.light_order.needless() > 0;
    let reason = match plan.light_order.idle.count() {
        _ if kept => "asked to stay, whether or not they reach anything".into(),
        0 if plan.light_order.idle.moves => "something moves, and may come into reach of any light".into(),
        0 => "every light reaches some object".into(),
        1 => "1 light reaches no object".into(),
        count => format!("{count} lights reach no object"),
    };
    part("lights that reach nothing", kept, reason, 0).is(OptionalPart::IdleLights)
}

pub(super) fn shadow(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Part {
    let missing = plan.shadow_warnings.iter().map(|warning| format!("; {warning}")).collect::<String>();
    let (reason, bytes) = match (shadow_reason(scene, settings, &plan.light_order.order), &plan.shadow) {
        (Err(reason), kept) => (reason, kept.as_ref().map_or(0, ShadowPlan::bytes)),
        (Ok(()), Some(shadow)) => (shadow_maps(shadow) + &missing, shadow.bytes()),
        (Ok(()), None) if missing.is_empty() => ("this view shows no shadows".into(), 0),
        (Ok(()), None) => (missing.trim_start_matches("; ").into(), 0),
    };
    part("shadow maps", plan.shadow.is_some(), reason, bytes).is(OptionalPart::ShadowMaps)
}

/// The lights with their numbers of maps, and the filter: `sun (3 cascades), lamp (6 faces): 10 maps in 5 layers, 3x3`.
fn shadow_maps(shadow: &ShadowPlan) -> String {
    const MOST: usize = 8;
    let one = |light: &ShadowLight| match light.projection {
        MapProjection::Cascades(1) => format!("{} (1 map)", light.name),
        MapProjection::Cascades(count) => format!("{} ({count} cascades)", light.name),
        MapProjection::Single => format!("{} (1 map)", light.name),
        MapProjection::Cube => format!("{} (6 faces)", light.name),
    };
    let mut names = shadow.lights.iter().take(MOST).map(one).collect::<Vec<_>>().join(", ");
    if let Some(more) = shadow.lights.len().checked_sub(MOST).filter(|&more| more > 0) {
        names += &format!(" and {more} more");
    }
    let plural = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let (maps, layers) = (plural(shadow.tiles.len(), "map"), plural(shadow.layers as usize, "layer"));
    format!("{names}: {maps} in {layers} of {}x{}, filter {}", shadow.size, shadow.size, shadow.filter)
}
