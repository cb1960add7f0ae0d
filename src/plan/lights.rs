//! The lights of a plan: the kinds that shaders have code for, their order, their reach, and the light path.

pub(crate) mod box_tree;
mod grid;
mod order;
mod path;
mod reach;

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

pub use grid::{Grid, SLICES, TILE};
pub(super) use order::is_misplaced;
pub(crate) use order::{IdleLights, LightOrder, shows_all};
pub use reach::Reach;
use reach::bounded;
#[cfg(test)]
pub use reach::steepest;
pub(crate) use reach::{LightCutoff, range_of, sphere_of, weakens};

use super::shadows::ShadowPlan;
use super::{Capabilities, FramePlan, PlanError, Shading, effects};
use crate::scene::{Keep, Light, LightPath, OptionalPart, Scene, Settings, TRAITS, Transparency, View};
use crate::shaders::lighting::host as lighting;
use crate::shaders::shared::lights as wgsl;

/// Lights that fit into the least uniform buffer that a device must have.
pub const UNIFORM_LIGHTS: usize = wgsl::UNIFORM_LIGHTS as usize;

/// The numbers of point and spot lights that a loop takes four at a time, on devices that gain by it. Fewer lights are not worth the larger shader
/// (docs/FIGURES.md has the gain of more). The end of the range is the most that the shader can count.
const BY_FOURS: RangeInclusive<usize> = 8..=4 * PLACES * PLACES;
const PLACES: usize = lighting::PLACES as usize;

/// The fall-off is each light's own.
pub(super) const MIXED_FALLOFF: u32 = wgsl::MIXED_FALLOFF;

/// The lights of frames, the light path, and their shadow maps.
pub(super) struct LightingPlan {
    pub order: LightOrder,
    pub lights: PlannedLights,
    pub path: LightPath,
    /// Why this path was chosen.
    pub reason: String,
    pub shadow: Option<ShadowPlan>,
    pub shadow_warnings: Vec<String>,
}

impl LightingPlan {
    pub(super) fn of(
        scene: &Scene,
        settings: &Settings,
        device: &Capabilities,
        shading: Shading,
    ) -> Result<Self, PlanError> {
        let keep = settings.keep;
        let order = LightOrder::of(scene, settings);
        let needed = planned_lights(scene, settings, shading, order.needed());
        let (path, reason) = path::choose(scene, settings, &needed, order.needed(), device)?;
        let lights = planned_lights(scene, settings, shading, &order.order);
        let lights = if shading.is_lit() { lights.kept(keep) } else { lights };
        let loops_over = |light: &Light| match path {
            LightPath::Loop => !light.kind.is_directional(),
            // Beside lists LIGHTING has no variant for it.
            LightPath::Volumes => !light.kind.is_directional() && !bounded(light, settings),
            _ => false,
        };
        let looped = order.order.iter().filter(|&&index| loops_over(&scene.lights[index])).count();
        let directional = order.order.iter().filter(|&&index| scene.lights[index].kind.is_directional()).count();
        // Places are counted from the first light of any kind.
        let fits = *BY_FOURS.start() <= looped && looped + directional <= *BY_FOURS.end();
        let lights = PlannedLights { by_fours: device.reads_pushed_places_once && fits && lights.punctual, ..lights };
        let (shadow, shadow_warnings) = ShadowPlan::wanted(scene, settings, device, shading, &order)?;
        // Shadows that are switched off are not wanted, not just not needed.
        let possible = settings.shadows.enabled && settings.shadows.size <= device.max_extent;
        let kept = shading.is_lit() && lights.any() && possible && keep.has(OptionalPart::ShadowMaps);
        let shadow = shadow.or_else(|| kept.then(|| ShadowPlan::without_lights(settings, device)));
        if settings.depth_prepass == Some(true) && path == LightPath::ForwardNaive {
            return Err(PlanError::NaivePrepass);
        }
        Ok(Self { order, lights, path, reason, shadow, shadow_warnings })
    }

    /// Returns true if frames have a depth pre-pass. Views that only count fragments or draw depth gain nothing from it.
    pub(super) fn has_prepass(&self, settings: &Settings, shading: Shading) -> bool {
        settings.depth_prepass.unwrap_or(self.path == LightPath::Forward) && shading.reads_gbuffer()
    }
}

impl FramePlan {
    /// The number of storage buffers in the frame's set that every lighting stage sees: lights, lists of clusters, volumes, and the effects' buffers.
    pub(crate) fn frame_buffers(&self) -> u32 {
        u32::from(self.lights.any() && !self.lights.uniform)
            + 2 * u32::from(self.has_clusters())
            + u32::from(self.lists_volumes())
            + effects::frame_buffers(self)
    }

    /// Leaves out the light lists of surfaces that are lit as they are drawn if a fragment shader cannot name both the lists and its targets. These
    /// surfaces then loop over all lights.
    ///
    /// # Errors
    /// [`PlanError::FragmentResources`] where the light path itself needs more.
    pub(super) fn within_fragment_resources(mut self, device: &Capabilities) -> Result<Self, PlanError> {
        let most = device.fragment_resources;
        self.lists_as_drawn = self.lit_resources() <= most;
        match self.lit_resources() {
            needed if needed <= most => Ok(self),
            needed => Err(PlanError::FragmentResources(self.light_path, needed, most)),
        }
    }

    /// Storage buffers and colour attachments that a fragment shader names if it lights surfaces as it draws them; 0 without such a shader. Blended
    /// effects do not count, as they are lit before they are drawn.
    fn lit_resources(&self) -> u32 {
        let blends = !self.transparent.is_empty();
        if !blends && !self.is_forward() && !self.relights() {
            return 0;
        }
        let targets = if blends && self.transparency == Some(Transparency::Oit) { 2 } else { 1 };
        // Such shaders draw no volumes.
        self.frame_buffers() - u32::from(self.lists_volumes()) + targets
    }

    /// Returns true if volumes of lights are drawn, or their spheres tested.
    pub(crate) fn lists_volumes(&self) -> bool {
        match self.light_path {
            LightPath::Compute | LightPath::Visibility => true,
            LightPath::Volumes => self.lights.bounded,
            _ => false,
        }
    }
}

/// Kinds of light that LIGHTING has code for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlannedLights {
    /// Some light is directional, or code for such lights is kept.
    pub directional: bool,
    /// Some light is a point light, a spot light or a beam, or code for such lights is kept.
    pub punctual: bool,
    /// The traits of lights that need code: bits of [`TRAITS`].
    pub traits: u32,
    /// The index of the one fall-off that all have, `MIXED_FALLOFF` where they differ.
    pub falloff: u32,
    /// Some light reaches only so far, by its range or the certified cut-off.
    pub bounded: bool,
    /// Some point or spot light reaches everywhere.
    pub unbounded: bool,
    /// The environment has ambient light, or code for it is kept.
    pub ambient: bool,
    /// One directional light is all there is, so that no loop goes over lights.
    pub one_directional: bool,
    /// Few enough for a uniform buffer.
    pub uniform: bool,
    /// LIGHTING's loop over point and spot lights takes four at a time, with indices from push constants.
    pub by_fours: bool,
}

impl PlannedLights {
    /// Returns true if there is a buffer of lights.
    pub fn any(&self) -> bool {
        self.directional || self.punctual
    }

    /// Adds code for the kinds of light that are kept although no light needs them. All inputs are neutral: the light count is 0, ranges are infinite
    /// and cones are whole spheres.
    fn kept(self, keep: Keep) -> Self {
        let punctual = keep.has(OptionalPart::PunctualLights);
        Self {
            ambient: self.ambient || keep.has(OptionalPart::AmbientLight),
            directional: self.directional || keep.has(OptionalPart::DirectionalLights),
            punctual: self.punctual || punctual,
            unbounded: self.unbounded || punctual,
            traits: TRAITS.iter().filter(|own| keep.has(own.part)).fold(self.traits, |all, own| all | own.bit),
            falloff: if keep.has(OptionalPart::Falloffs) { MIXED_FALLOFF } else { self.falloff },
            ..self
        }
    }
}

/// Returns true if each light is a separate draw, full-screen or cut to the light's reach.
pub(super) fn adds_lights(path: LightPath, lights: &PlannedLights) -> bool {
    match path {
        LightPath::PerLight => lights.punctual,
        LightPath::Volumes => lights.bounded,
        _ => false,
    }
}

/// The kinds of the lights with these numbers, as far as the view shows them.
fn planned_lights(scene: &Scene, settings: &Settings, shading: Shading, planned: &[usize]) -> PlannedLights {
    if shading == Shading::ShowGbuffer(View::Complexity) {
        // The view compares the values that LIGHTING would read, and ambient light has occlusion stored.
        return PlannedLights { ambient: scene.environment.is_lit(), ..Default::default() };
    }
    if !matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(View::LightsPerPixel)) {
        return PlannedLights::default();
    }
    let mut lights = PlannedLights { ambient: scene.environment.is_lit(), ..Default::default() };
    let mut falloffs = BTreeSet::new();
    lights.uniform = planned.len() <= UNIFORM_LIGHTS;
    lights.one_directional = matches!(planned[..], [one] if scene.lights[one].kind.is_directional());
    for light in planned.iter().map(|&index| &scene.lights[index]) {
        let (form, bounded) = (light.kind.form(), bounded(light, settings));
        let directional = form.place.is_none();
        lights.directional |= directional;
        lights.punctual |= !directional;
        lights.bounded |= bounded;
        lights.unbounded |= !bounded && !directional;
        lights.traits |= form.traits();
        falloffs.extend(form.falloff.map(|falloff| falloff.index()));
    }
    lights.falloff = if falloffs.len() == 1 { *falloffs.first().expect("there is one") } else { MIXED_FALLOFF };
    lights
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::plan::{CostModel, samples};
    use crate::scene::{AlphaMode, Emitter, Material};

    #[test]
    fn surfaces_that_are_lit_as_they_are_drawn_go_over_all_lights_where_there_is_no_room_for_lists() {
        let glass = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..Material::default() };
        let lamps = vec![samples::lamp(DVec3::Z, Some(2.0)); UNIFORM_LIGHTS + 1];
        let scene = samples::scene(vec![Material::default(), glass], lamps);
        let planned = |light_path, transparency, fragment_resources| {
            let settings = Settings { light_path, transparency, ..Settings::default() };
            FramePlan::of(&scene, &settings, &Capabilities { fragment_resources, ..samples::device() })
        };
        let has_lists = |path, transparency, room| planned(path, transparency, room).map(|plan| plan.has_clusters());
        // Lights, two of lists, froxels and a target.
        let (looped, clustered) = (LightPath::Loop, LightPath::Clustered);
        assert_eq!(has_lists(looped, Transparency::Sorted, 5), Ok(true));
        assert_eq!(has_lists(looped, Transparency::Sorted, 4), Ok(false));
        assert_eq!(has_lists(looped, Transparency::Oit, 6), Ok(true));
        assert_eq!(has_lists(looped, Transparency::Oit, 5), Ok(false));
        assert_eq!(has_lists(looped, Transparency::Oit, 4), Ok(false));
        assert_eq!(has_lists(LightPath::Volumes, Transparency::Oit, 4), Ok(false));
        assert_eq!(has_lists(LightPath::Forward, Transparency::Sorted, 5), Ok(true));
        assert_eq!(has_lists(LightPath::Forward, Transparency::Sorted, 4), Ok(false));
        assert_eq!(has_lists(clustered, Transparency::Sorted, 5), Ok(true));
        let refused = planned(clustered, Transparency::Sorted, 4).map(|_| ()).expect_err("too little room");
        assert_eq!(refused, PlanError::FragmentResources(clustered, 5, 4));
        assert!(refused.to_string().ends_with("has room for 4: choose loop"), "{refused}");
        // Nobody asked for it: another path is taken.
        let costs = CostModel::CPU;
        let chosen = |fragment_resources| {
            let device = Capabilities { fragment_resources, costs, software: true, ..samples::device() };
            let plan = FramePlan::of(&scene, &Settings::default(), &device).expect("a plan");
            (plan.light_path, plan.reasons.light_path)
        };
        assert_eq!(chosen(5).0, clustered);
        let (path, why) = chosen(4);
        assert!(path == looped && why.starts_with("clustered names 5 "), "{path}: {why}");
    }

    #[test]
    fn particles_alone_leave_lists_to_lighting() {
        let lamps = vec![samples::lamp(DVec3::Z, Some(2.0)); UNIFORM_LIGHTS + 1];
        let plain = samples::scene(vec![Material::default()], lamps);
        let scene = Scene { emitters: vec![Emitter::default()], ..plain };
        let settings = Settings { light_path: LightPath::Clustered, ..Settings::default() };
        let device = Capabilities { fragment_resources: 4, ..samples::device() };
        let plan = FramePlan::of(&scene, &settings, &device).expect("a plan");
        assert!(plan.effects.particles.is_some() && plan.lights_by_clusters());
    }
}
