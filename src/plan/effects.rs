//! The table of effects. It lies above all of them: each declares itself in its own file, and whoever asks about effects goes through this list.

pub(super) mod ao;
pub(super) mod bloom;
mod fog;
mod froxels;
mod fxaa;
pub(super) mod particles;
pub(super) mod reflections;
mod sky;
mod taa;

/// The public types and names of effects, which are the plan's.
pub mod types {
    pub use super::ao::AoPlan;
    pub use super::bloom::{BLOOM_LEVELS, Bloom, BloomLevel};
    pub use super::fog::FogPlan;
    pub use super::froxels::{FROXELS, FroxelPlan};
    pub use super::particles::{PARTICLES, ParticlePlan, SORT_BLOCK, sort_places};
    pub use super::reflections::{Hiz, ReflectionPlan};
    pub use super::sky::SkyPlan;
    pub use super::taa::{TAA_MEAN, TaaPlan, Vectors};
}

use std::borrow::Cow;

use super::effect::{Effect, EffectView, Hdr, LitAir, Request, Shows};
use super::{Error, FramePlan, Part, PartGroup, Target};
use crate::scene::{Scene, Settings, View};
use types::{AoPlan, Bloom, FogPlan, ParticlePlan, ReflectionPlan, SkyPlan, TaaPlan};

/// Every effect, in the order in which `inspect` lists them. Settings that work on the finished picture say so in their own table (`on_picture`).
pub(crate) const EFFECTS: &[&Effect] = &[
    &particles::EFFECT,
    &sky::EFFECT,
    &fog::EFFECT,
    &bloom::EFFECT,
    &fxaa::EFFECT,
    &taa::EFFECT,
    &ao::EFFECT,
    &reflections::EFFECT,
];

/// The effects of a plan's frames, each with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectPlans {
    /// The scene's sky, where it is seen or lights surfaces.
    pub sky: Option<SkyPlan>,
    /// The way in which ambient occlusion is found, where it is.
    pub ao: Option<AoPlan>,
    /// The reflections of the picture in surfaces, where there are some.
    pub reflections: Option<ReflectionPlan>,
    /// The particles of the scene's emitters, where they are drawn.
    pub particles: Option<ParticlePlan>,
    /// Fog lies between the eye and the surfaces.
    pub fog: Option<FogPlan>,
    /// Light is spread before it is tone-mapped.
    pub bloom: Option<Bloom>,
    /// Frames are averaged over time.
    pub taa: Option<TaaPlan>,
    /// A pass after the main one smooths edges.
    pub fxaa: bool,
}

/// Refuses effects that do not go with the settings, the light path or the device.
pub(super) fn check(request: &Request) -> Result<(), Error> {
    EFFECTS.iter().try_for_each(|effect| (effect.check)(request))
}

/// The effects that settings or the scene ask for.
pub(super) fn asked_for(scene: &Scene, settings: &Settings) -> impl Iterator<Item = &'static Effect> {
    EFFECTS.iter().copied().filter(move |effect| (effect.is_asked_for)(scene, settings))
}

/// The effects of a plan's frames.
pub(crate) fn of(plan: &FramePlan) -> impl Iterator<Item = &'static Effect> {
    EFFECTS.iter().copied().filter(|effect| (effect.is_in)(plan))
}

fn shown_by(view: View) -> Option<(&'static Effect, &'static EffectView)> {
    EFFECTS.iter().find_map(|&effect| Some((effect, effect.view.as_ref().filter(|own| own.view == view)?)))
}

/// Returns the settings to plan by: the view of an effect turns it on, and leaves out effects that would hide it.
pub(super) fn planned(asked: &Settings) -> Cow<'_, Settings> {
    let Some((shown, view)) = shown_by(asked.view) else { return Cow::Borrowed(asked) };
    let mut settings = asked.clone();
    let others = EFFECTS.iter().filter(|other| other.name != shown.name);
    let hiding = others.filter(|other| other.spreads || view.is_alone && other.changes_light);
    hiding.filter_map(|other| other.off).for_each(|(_, off)| off(&mut settings));
    (view.plan)(&mut settings);
    Cow::Owned(settings)
}

/// Returns true if a view shows an effect of the lit picture.
pub fn shows_effect(view: View) -> bool {
    shown_by(view).is_some_and(|(_, own)| !matches!(own.shows, Shows::Gbuffer(..)))
}

/// The targets of the G-buffer that effects of a plan write, each with the view that shows it and its content after that.
pub(crate) fn of_gbuffer(plan: &FramePlan) -> impl Iterator<Item = (Target, View, &'static str)> {
    of(plan).filter_map(|effect| match effect.view.as_ref()? {
        &EffectView { view, shows: Shows::Gbuffer(target, content), .. } => Some((target, view, content)),
        _ => None,
    })
}

/// Returns true if frames of a view are lit.
pub(super) fn is_lit(view: View) -> bool {
    matches!(view, View::Final | View::Lighting | View::Ambient) || shows_effect(view)
}

/// Returns true if a view shows light, so that the samples of a pixel have a mean.
pub fn averages_samples(view: View) -> bool {
    is_lit(view) && shown_by(view).is_none_or(|(_, own)| own.shows == Shows::Light)
}

/// Returns the settings without the effects that a frame's error is not taken apart with.
pub(crate) fn set_aside(settings: &Settings) -> Settings {
    let mut plain = settings.without_effects();
    EFFECTS
        .iter()
        .filter(|effect| effect.is_set_aside)
        .filter_map(|effect| effect.off)
        .for_each(|(_, off)| off(&mut plain));
    plain
}

/// Why a report does not sweep a setting of an effect.
pub(crate) fn unswept(key: &str, scene: &Scene, plan: &FramePlan) -> Option<&'static str> {
    EFFECTS.iter().find_map(|effect| (effect.unswept)(key, scene, plan))
}

/// The reason that no light is out of reach, if an effect has one.
pub(super) fn reach_all_lights(settings: &Settings) -> Option<&'static str> {
    EFFECTS.iter().find_map(|effect| (effect.reaches_all_lights)(settings))
}

/// The lights that a plan's frames need where no surface is seen.
pub(crate) fn lit_air(plan: &FramePlan) -> LitAir {
    of(plan).map(|effect| (effect.lit_air)(plan)).max().unwrap_or(LitAir::None)
}

/// Jittered frames that effects average to one picture.
pub(super) fn frames(settings: &Settings) -> u32 {
    EFFECTS.iter().map(|effect| (effect.frames)(settings)).max().unwrap_or(1)
}

/// Returns the parts that effects have in a group. `read_gbuffer` selects effects that read the G-buffer, else all others.
pub(super) fn parts(
    scene: &Scene,
    settings: &Settings,
    plan: &FramePlan,
    (group, read_gbuffer): (PartGroup, bool),
) -> Vec<Part> {
    let wanted = EFFECTS.iter().filter(|effect| effect.reads_gbuffer.is_some() == read_gbuffer);
    let parts = wanted.flat_map(|effect| (effect.parts)(scene, settings, plan));
    parts.filter(|part| part.group == group).collect()
}

/// Returns why an HDR target is needed: by the first effect that blends over the light, and by the first that reads it.
pub(super) fn hdr(plan: &FramePlan) -> [Option<&'static str>; 2] {
    let blends = of(plan).find_map(|effect| match effect.hdr {
        Some(Hdr::Blends(why)) => Some(why),
        _ => None,
    });
    let reads = of(plan).find_map(|effect| match effect.hdr {
        Some(Hdr::Reads(why)) => Some(why),
        _ => None,
    });
    [blends, reads]
}
