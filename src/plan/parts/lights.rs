//! Lights, the ways to find them, and their shadow maps.

use super::{Part, part};
use crate::plan::lights::{MIXED_FALLOFF, is_misplaced, shows_all};
use crate::plan::shadows::shadow_reason;
use crate::plan::{
    FramePlan, Grid, MapProjection, PlannedBrdf, SLICES, Shading, ShadowLight, ShadowPlan, effects, reasons,
};
use crate::scene::{Light, OptionalPart, Scene, Settings, TRAITS, View, counted};

pub(super) fn shading(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Vec<Part> {
    let brdf = match plan.brdf {
        _ if plan.is_forward() => "a constant of each pipeline, which lights what it draws".into(),
        PlannedBrdf::One(brdf) => format!("all opaque materials are {brdf}: a constant of the shader"),
        PlannedBrdf::PerPixel if plan.triangles.is_some() => "materials differ: each names its own".into(),
        PlannedBrdf::PerPixel => "materials differ: chosen for each pixel".into(),
    };
    let lights = &plan.lights;
    let kind = |name: &str, present: bool, is: &dyn Fn(&Light) -> bool, optional| {
        let absent = || lack(settings, plan, scene.lights.iter().any(is));
        part(name, present, if present { "the scene has some" } else { absent() }, 0).is(optional)
    };
    let grid = Grid::of(plan.size);
    let lists = match plan.has_clusters() {
        true => format!(
            "{}x{} tiles by {SLICES} slices, and as many entries as lights reach into them",
            grid.columns, grid.rows
        ),
        false if !plan.lists_as_drawn => {
            "fragment shaders of the device name too few buffers: surfaces that are lit as they are drawn go over all lights".into()
        }
        false => "no pass goes over lists of lights".into(),
    };
    let path = format!("light path {}", plan.light_path);
    let traits = TRAITS.iter().map(|own| {
        kind(own.name, lights.traits & own.bit != 0, &|light| light.kind.form().traits() & own.bit != 0, own.part)
    });
    let directional = |light: &Light| light.kind.is_directional();
    let mut parts = vec![
        part(&path, matches!(plan.shading, Shading::Light { .. }), plan.reasons.light_path.clone(), 0),
        part("BRDF by pixel", plan.brdf == PlannedBrdf::PerPixel && !plan.is_forward(), brdf, 0)
            .is(OptionalPart::BrdfByPixel),
        part("lists of lights by froxel", plan.has_clusters(), lists, 2 * 8 * grid.clusters() as u64)
            .is(OptionalPart::LightLists),
        buffers(settings, plan),
        idle_lights(scene, settings, plan),
        kind("directional lights", lights.directional, &directional, OptionalPart::DirectionalLights),
        kind("point and spot lights", lights.punctual, &|light| !directional(light), OptionalPart::PunctualLights),
    ];
    parts.extend(traits);
    parts.push(falloffs(settings, plan));
    parts.push(ambient(plan));
    parts.push(emissive(scene, settings, plan));
    parts
}

/// Why frames have no lights of a kind, of which the scene may have some.
fn lack(settings: &Settings, plan: &FramePlan, scene_has: bool) -> &'static str {
    match scene_has {
        _ if !shows_lights(plan) => NOT_LIT,
        false => "the scene has none",
        true if settings.view == View::Ambient => "this view shows ambient light alone",
        true => "the scene's reach no object",
    }
}

const NOT_LIT: &str = "this view is not lit";

fn shows_lights(plan: &FramePlan) -> bool {
    matches!(plan.shading, Shading::Light { .. } | Shading::ShowGbuffer(View::LightsPerPixel))
}

fn buffers(settings: &Settings, plan: &FramePlan) -> Part {
    let count = plan.light_order.order.len();
    let reason = match count {
        _ if !shows_lights(plan) => NOT_LIT.into(),
        0 if settings.view == View::Ambient => "this view shows ambient light alone".into(),
        0 => "no light shines on the scene".into(),
        1 => "1 light shines on the scene".into(),
        _ => format!("{count} lights shine on the scene"),
    };
    // A buffer for each of two frames in flight.
    part("light buffers", plan.lights.any(), reason, 2 * 64 * count.max(1) as u64)
}

fn ambient(plan: &FramePlan) -> Part {
    let reason = match plan.lights.ambient {
        true => "the scene has some",
        false if plan.shading.is_lit() => "the scene has none",
        false => NOT_LIT,
    };
    part("ambient light", plan.lights.ambient, reason, 0).is(OptionalPart::AmbientLight)
}

fn emissive(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Part {
    let emits = plan.emissive || plan.keys().any(|key| key.forward.is_some_and(|key| key.emissive));
    let reason = match emits {
        true => "the scene has some",
        false if scene.materials.iter().all(|material| !material.is_emissive()) => "the scene has none",
        false if !settings.view.shows_emission() => "this view shows none",
        false => "no drawn surface emits light",
    };
    part("emissive surfaces", emits, reason, 0).is(OptionalPart::Emissive)
}

/// The fall-off: chosen for each light, or a constant.
fn falloffs(settings: &Settings, plan: &FramePlan) -> Part {
    let lights = &plan.lights;
    let mixed = lights.punctual && lights.falloff == MIXED_FALLOFF;
    let reason = match (lights.punctual, mixed) {
        (false, _) if !shows_lights(plan) => NOT_LIT,
        (false, _) if settings.view == View::Ambient => "this view shows ambient light alone",
        (false, _) => "no light has one",
        (true, false) => "all lights have the same: a constant",
        (true, true) => "lights differ",
    };
    part("fall-off by light", mixed, reason, 0).is(OptionalPart::Falloffs)
}

/// Lights that reach no object. On CPU devices each frame also leaves out lights that reach nothing visible.
fn idle_lights(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Part {
    let kept = plan.light_order.needless() > 0;
    let everywhere = effects::reach_all_lights(settings);
    let reason = match plan.light_order.idle.count() {
        _ if kept => "kept on request".into(),
        _ if scene.lights.is_empty() => "the scene has no lights".into(),
        0 if plan.light_order.idle.moves => "something moves, and may come into reach of any light".into(),
        0 if everywhere.is_some() => everywhere.unwrap_or_default().into(),
        0 if shows_all(settings.view) => "this view is about all lights".into(),
        0 if settings.view == View::Ambient => "this view shows ambient light alone".into(),
        0 if is_misplaced(settings) => "surfaces are lit too far beside where they are to rule any light out".into(),
        0 => "every light reaches some object".into(),
        1 => "1 light reaches no object".into(),
        count => format!("{count} lights reach no object"),
    };
    part("lights that reach nothing", kept, reason, 0).is(OptionalPart::IdleLights)
}

pub(super) fn shadow(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Part {
    let reason = match &plan.shadow {
        Some(shadow) if shadow_reason(scene, settings, plan.light_numbers()).is_ok() => {
            let missing = plan.reasons.shadow_warnings.iter().map(|warning| format!("; {warning}")).collect::<String>();
            shadow_maps(shadow) + &missing
        }
        _ => reasons::without_shadow_maps(scene, settings, plan),
    };
    let bytes = plan.shadow.as_ref().map_or(0, |own| own.bytes() - own.tint_bytes());
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
    let (maps, layers) = (counted(shadow.tiles.len(), "map"), counted(shadow.layers as usize, "layer"));
    format!("{names}: {maps} in {layers} of {}x{}, filter {}", shadow.size, shadow.size, shadow.filter)
}
