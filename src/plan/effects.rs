//! The table of effects. It lies above all of them: each declares itself in its own file, and whoever asks about effects goes through this list.

mod aberration;
mod ao;
mod bloom;
mod fog;
mod froxels;
mod fxaa;
mod lobes;
mod particles;
mod reflections;
mod refraction;
mod sky;
mod taa;
mod tints;

/// The public types and names of effects, which are the plan's.
pub mod types {
    pub use super::aberration::APART;
    pub use super::ao::{AoPlan, VISIBILITY};
    pub use super::bloom::{BLOOM_LEVELS, BloomLevel, BloomPlan};
    pub use super::fog::FogPlan;
    pub use super::froxels::{FROXELS, FroxelPlan};
    pub use super::fxaa::SMOOTHED;
    pub use super::lobes::LobesPlan;
    pub use super::particles::{PARTICLES, ParticlePlan, SORT_BLOCK, sort_places};
    pub use super::reflections::{HIZ, Hiz, RAYS, ReflectionPlan};
    pub use super::refraction::{BACKDROP, RefractionPlan};
    pub use super::sky::SkyPlan;
    pub use super::taa::{TAA_MEAN, TaaPlan, VECTORS, Vectors};
}

pub(super) use sky::sky_directions;
pub(super) use tints::are_asked_for as tints_are_asked_for;

use std::borrow::Cow;

use super::effect::{Effect, EffectRequest, EffectView, Hdr, LightReaders, LitAir, Shows, Variation};
use super::{
    Capabilities, FramePlan, OwnTarget, Part, PartGroup, PlanError, PlannedTexture, SurfaceRules, Target, Uploads,
    is_forward,
};
use crate::scene::{LightPath, Scene, Settings, View};
use types::{AoPlan, BloomPlan, FogPlan, LobesPlan, ParticlePlan, ReflectionPlan, RefractionPlan, SkyPlan, TaaPlan};

/// Every effect, in the order in which `inspect` lists them. Settings that work on the finished picture say so in their own table (`on_picture`).
pub const EFFECTS: &[&Effect] = &[
    &particles::EFFECT,
    &sky::EFFECT,
    &lobes::EFFECT,
    &refraction::EFFECT,
    &tints::EFFECT,
    &fog::EFFECT,
    &bloom::EFFECT,
    &fxaa::EFFECT,
    &aberration::EFFECT,
    &taa::EFFECT,
    &ao::EFFECT,
    &reflections::EFFECT,
];

/// The forms of all effects, to make sample plans of.
pub fn variations() -> impl Iterator<Item = &'static Variation> {
    EFFECTS.iter().flat_map(|effect| effect.variations)
}

/// The effects of a plan's frames, each with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectPlans {
    /// The scene's sky, if it is visible or lights surfaces.
    pub sky: Option<SkyPlan>,
    /// The drawn materials that have lobes beside base and highlight.
    pub lobes: Option<LobesPlan>,
    /// Glass that bends or blurs light, and shows the picture behind it.
    pub refraction: Option<RefractionPlan>,
    /// Transparent surfaces cast shadows.
    pub tints: bool,
    /// Ambient occlusion and its method.
    pub ao: Option<AoPlan>,
    /// Screen-space reflections.
    pub reflections: Option<ReflectionPlan>,
    /// The drawn particles of the scene's emitters.
    pub particles: Option<ParticlePlan>,
    /// Fog lies between the eye and the surfaces.
    pub fog: Option<FogPlan>,
    /// Light is spread before it is tone-mapped.
    pub bloom: Option<BloomPlan>,
    /// Frames are averaged over time.
    pub taa: Option<TaaPlan>,
    /// A pass after the main one smooths edges.
    pub fxaa: bool,
    /// The share of the distance from the middle by which red and blue of the picture lie apart from green, where they do.
    pub aberration: Option<f32>,
}

impl EffectPlans {
    /// Decides on all of them. `any_light`: the frames have lights.
    pub(super) fn of(request: &EffectRequest, rules: &SurfaceRules, any_light: bool) -> Self {
        Self {
            sky: SkyPlan::of(request),
            lobes: LobesPlan::of(request, rules),
            refraction: RefractionPlan::of(request, rules),
            tints: rules.shadow.is_some_and(|own| own.tinted),
            ao: AoPlan::of(request),
            reflections: ReflectionPlan::of(request),
            particles: ParticlePlan::of(request),
            fog: FogPlan::of(request, any_light),
            bloom: BloomPlan::of(request.settings, request.shading),
            taa: TaaPlan::of(request, rules),
            fxaa: request.settings.fxaa,
            aberration: Some(request.settings.aberration).filter(|share| *share > 0.0),
        }
    }

    /// The effects that frames have.
    pub(super) fn present(&self) -> impl Iterator<Item = &'static Effect> {
        EFFECTS.iter().copied().filter(|effect| (effect.is_in)(self))
    }

    /// Returns why an HDR target is needed: by the first effect that blends over the light or adds to it, and by the first that reads it.
    pub(super) fn hdr(&self, path: LightPath) -> [Option<&'static str>; 2] {
        let blends = self.present().find_map(|effect| match effect.hdr {
            Some(Hdr::Adds(why)) if !is_forward(path) => Some(why),
            Some(Hdr::Blends(why)) => Some(why),
            _ => None,
        });
        let reads = self.present().find_map(|effect| match effect.hdr {
            Some(Hdr::Reads(why)) => Some(why),
            _ => None,
        });
        [blends, reads]
    }

    /// Returns true if an effect's light is added to LIGHTING's.
    pub(super) fn add_light(&self, path: LightPath) -> bool {
        !is_forward(path) && self.present().any(|effect| matches!(effect.hdr, Some(Hdr::Adds(_))))
    }

    /// Returns true if the lights must be in a storage buffer. `as_drawn`: some surfaces are lit as they are drawn.
    pub(super) fn need_light_buffer(&self, as_drawn: bool) -> bool {
        self.present().any(|effect| match effect.needs_light_buffer {
            LightReaders::None => false,
            LightReaders::AsDrawn => as_drawn,
            LightReaders::Own => true,
        })
    }

    /// Returns why the CPU lists the objects that move by themselves.
    pub(super) fn list_moving(&self) -> Option<&'static str> {
        EFFECTS.iter().find_map(|effect| (effect.lists_moving)(self))
    }

    /// The uploads of all effects.
    pub(super) fn uploads(&self) -> Uploads {
        EFFECTS.iter().map(|effect| (effect.uploads)(self)).fold(Uploads::default(), Uploads::and)
    }

    /// Returns true if the data of all effects can stay on the device for the other plans.
    pub(super) fn upload_as(&self, other: &Self) -> bool {
        EFFECTS.iter().all(|effect| (effect.uploads_as)(self, other))
    }
}

/// Refuses devices that are too small for the effects of a plan.
pub(super) fn check_plan(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    EFFECTS.iter().try_for_each(|effect| (effect.check_plan)(plan, device))
}

/// Refuses effects that do not go with the settings, the light path or the device.
pub(super) fn check(request: &EffectRequest) -> Result<(), PlanError> {
    EFFECTS.iter().try_for_each(|effect| (effect.check)(request))
}

/// The effects that settings or the scene ask for.
pub(super) fn asked_for(scene: &Scene, settings: &Settings) -> impl Iterator<Item = &'static Effect> {
    EFFECTS.iter().copied().filter(move |effect| (effect.is_asked_for)(scene, settings))
}

/// The targets of all effects.
pub fn targets() -> impl Iterator<Item = &'static OwnTarget> {
    EFFECTS.iter().flat_map(|effect| effect.targets)
}

/// The effects of a plan's frames.
pub fn of(plan: &FramePlan) -> impl Iterator<Item = &'static Effect> {
    plan.effects.present()
}

fn shown_by(view: View) -> Option<(&'static Effect, &'static EffectView)> {
    EFFECTS.iter().find_map(|&effect| Some((effect, effect.view.as_ref().filter(|own| own.view == view)?)))
}

/// Returns the settings to plan by: the view of an effect turns it on, and leaves out effects that would hide it.
pub(super) fn effective_settings(asked: &Settings) -> Cow<'_, Settings> {
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
    shown_by(view).is_some_and(|(_, own)| !matches!(own.shows, Shows::Gbuffer { .. }))
}

/// The targets of the G-buffer that effects of a plan write, each with the view that shows it and its content after that.
pub fn of_gbuffer(plan: &FramePlan) -> impl Iterator<Item = (Target, View, &'static str)> {
    of(plan).filter_map(|effect| match effect.view.as_ref()? {
        &EffectView { view, shows: Shows::Gbuffer { target, content, .. }, .. } => Some((target, view, content)),
        _ => None,
    })
}

/// VIEW's code for the effect's G-buffer value that `view` shows, if it shows one.
pub fn shown_in_gbuffer(view: View) -> Option<u32> {
    match shown_by(view)?.1.shows {
        Shows::Gbuffer { code, .. } => Some(code),
        Shows::Light | Shows::Values => None,
    }
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
pub fn set_aside(settings: &Settings) -> Settings {
    let mut plain = settings.without_effects();
    EFFECTS
        .iter()
        .filter(|effect| effect.is_set_aside)
        .filter_map(|effect| effect.off)
        .for_each(|(_, off)| off(&mut plain));
    plain
}

/// Why a report does not sweep a setting of an effect.
pub fn unswept(key: &str, scene: &Scene, plan: &FramePlan) -> Option<&'static str> {
    EFFECTS.iter().find_map(|effect| (effect.unswept)(key, scene, plan))
}

/// The reason why every light reaches all pixels, if an effect has one.
pub(super) fn reach_all_lights(settings: &Settings) -> Option<&'static str> {
    EFFECTS.iter().find_map(|effect| (effect.reaches_all_lights)(settings))
}

impl FramePlan {
    /// The name of an effect that also changes pixels without surfaces, if frames have one.
    pub fn shines_beyond_surfaces(&self) -> Option<&'static str> {
        of(self).find(|effect| effect.shines_beyond).map(|effect| effect.name)
    }
}

/// The most layers that effects blend over a pixel.
pub fn layers(plan: &FramePlan) -> u32 {
    let blended = of(plan).filter_map(|effect| effect.blended.as_ref());
    blended.map(|own| (own.layers)(&plan.effects)).fold(0, u32::saturating_add)
}

/// The textures of the one effect that has some.
pub fn textures(plan: &FramePlan) -> &[PlannedTexture] {
    of(plan).map(|effect| (effect.textures)(&plan.effects)).find(|own| !own.is_empty()).unwrap_or_default()
}

/// Returns true if compute shaders of a plan's frames look up the sky's light.
pub(crate) fn compute_with_sky(plan: &FramePlan) -> bool {
    of(plan).any(|effect| effect.computes_with_sky)
}

/// The lights that a plan's frames need where no surface is seen.
pub(crate) fn lit_air(plan: &FramePlan) -> LitAir {
    of(plan).map(|effect| (effect.lit_air)(plan)).max().unwrap_or(LitAir::None)
}

/// Storage buffers of effects that every shader which lights names in the frame's set.
pub(super) fn frame_buffers(plan: &FramePlan) -> u32 {
    EFFECTS.iter().map(|effect| (effect.frame_buffers)(plan)).sum()
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
