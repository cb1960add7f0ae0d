//! The steps of a frame: its passes and lights in their order, and how the real frame is halted or viewed to show its picture after each.

mod descriptions;
mod stepper;

pub use stepper::Stepper;

use afterlight::frame::list::StepList;
use afterlight::passes::{
    Endpoint, Pass, Resource, UseKind, composite, forward, geometry, lighting, shadow, tiled, tonemap, transparent,
};
use afterlight::plan::{FramePlan, PlannedBrdf, Shading, ToneMapping, effects};
use afterlight::scene::{Brdf, Settings, Tonemap, Transparency, View};

/// Up to this many lights have a step each; more lights come in groups that double.
const SINGLE_LIGHTS: usize = 24;

/// A pass, or a part of its work, after which the picture is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameStep {
    ShadowMaps,
    /// A buffer that GEOMETRY has written.
    Buffer(View),
    /// The buffer that a pass of an effect has made of one of them.
    Rewritten(Endpoint, View),
    /// Adds the plan's lights from `first` to before `end`; an empty range stands for the picture before the first light.
    Lights {
        first: usize,
        end: usize,
    },
    /// Transparent surfaces are in separate sums, which are not in the picture yet.
    TransparentSums,
    Transparent,
    Composite,
    /// The light as TONEMAP finds it.
    Light,
    Tonemap,
    /// A pass over the whole picture that settings can leave out.
    Effect(Endpoint),
}

impl FrameStep {
    /// Returns the steps of a plan's frames. Steps before tone mapping are shown tone-mapped as well, unless stated otherwise.
    pub fn all(plan: &FramePlan) -> Vec<Self> {
        let mut steps: Vec<_> = StepList::of(plan).passes().flat_map(|pass| Self::of(pass, plan)).collect();
        // A pass that is recorded several times is one step.
        steps.dedup();
        steps
    }

    /// Returns the steps of one pass. The window's own passes, and passes that only show a buffer, have none.
    fn of(pass: &Pass, plan: &FramePlan) -> Vec<Self> {
        let is = |other: &Pass| pass.name == other.name;
        if is(&shadow::PASS) {
            return vec![Self::ShadowMaps];
        }
        if is(&geometry::PASS) {
            return buffers(plan).into_iter().map(Self::Buffer).collect();
        }
        if let Some(view) = rewritten(pass, plan) {
            return vec![Self::Rewritten(pass.name, view)];
        }
        if is(&lighting::PASS) || is(&forward::PASS) || is(&tiled::PASS) {
            let groups = light_groups(plan.light_numbers().len()).into_iter();
            return groups.map(|[first, end]| Self::Lights { first, end }).collect();
        }
        if is(&transparent::PASS) {
            let sums = plan.transparency == Some(Transparency::Oit);
            return vec![if sums { Self::TransparentSums } else { Self::Transparent }];
        }
        if is(&composite::PASS) {
            return vec![Self::Composite];
        }
        if let (true, ToneMapping::Subpass(curve)) = (is(&tonemap::PASS), plan.tone_mapping) {
            let light = (curve != Tonemap::None).then_some(Self::Light);
            return light.into_iter().chain([Self::Tonemap]).collect();
        }
        pass.leave_out.map(|_| Self::Effect(pass.name)).into_iter().collect()
    }

    /// Returns the settings of frames that show this step, where `whole` are the settings of the frames of `plan`.
    pub fn settings(self, whole: &Settings, plan: &FramePlan) -> Settings {
        // Another view must not make another choice.
        let mut settings = Settings { light_path: plan.light_path, ..whole.clone() };
        // Effects that come later are left out.
        let list = StepList::of(plan);
        let is_own = |pass: &&Pass| pass.name.name() == self.pass(plan);
        let later = list.passes().skip_while(|pass| !is_own(pass)).skip_while(is_own);
        let mut later = later.filter_map(|pass| pass.leave_out).peekable();
        if let (Self::Effect(_), None) = (self, later.peek()) {
            return whole.clone();
        }
        later.for_each(|leave_out| leave_out(&mut settings));
        match self {
            Self::ShadowMaps => (settings.view, settings.msaa) = (View::ShadowMap, 1),
            Self::Buffer(view) | Self::Rewritten(_, view) => {
                settings.view = view;
                // Other views show the values of one sample.
                settings.msaa = if view == View::Complexity { whole.msaa } else { 1 };
            }
            Self::Light => settings.tonemap = Tonemap::None,
            Self::Lights { .. }
            | Self::TransparentSums
            | Self::Transparent
            | Self::Composite
            | Self::Tonemap
            | Self::Effect(_) => {}
        }
        settings
    }

    /// The number of lights after which its frames are halted; none where they are not.
    pub fn halt(self, plan: &FramePlan) -> Option<usize> {
        match self {
            Self::Lights { end, .. } => Some(end),
            Self::TransparentSums => Some(plan.light_numbers().len()),
            _ => None,
        }
    }

    /// The pass that it belongs to.
    pub fn pass(self, plan: &FramePlan) -> &'static str {
        match self {
            Self::ShadowMaps => "SHADOW",
            Self::Buffer(_) => "GEOMETRY",
            Self::Lights { .. } if plan.is_forward() => "FORWARD",
            Self::Lights { .. } if plan.is_tiled() => "TILED",
            Self::Lights { .. } => "LIGHTING",
            Self::TransparentSums | Self::Transparent => "TRANSPARENT",
            Self::Composite => "COMPOSITE",
            Self::Light | Self::Tonemap => "TONEMAP",
            Self::Rewritten(place, _) | Self::Effect(place) => place.name(),
        }
    }
}

/// The views of the G-buffer of a plan.
fn buffers(plan: &FramePlan) -> Vec<View> {
    let Some(gbuffer) = plan.gbuffer.filter(|_| matches!(plan.shading, Shading::Light { .. })) else {
        return Vec::new();
    };
    let rough = gbuffer.material.is_some() && plan.brdf != PlannedBrdf::One(Brdf::Lambert);
    let views = [
        (View::Depth, true),
        (View::Position, gbuffer.position.is_some()),
        (View::Normal, true),
        (View::Albedo, true),
        (View::Metallic, gbuffer.material.is_some() && gbuffer.metallic),
        (View::Roughness, rough),
        (View::Complexity, plan.msaa > 1),
    ];
    views.into_iter().filter_map(|(view, stored)| stored.then_some(view)).collect()
}

/// The view of a target of the G-buffer, if a pass of an effect stores to one.
fn rewritten(pass: &Pass, plan: &FramePlan) -> Option<View> {
    let touches = pass.uses(plan);
    let is_stored = |target| {
        let resource = Resource::Target(target);
        touches.iter().any(|touch| touch.resource == resource && matches!(touch.how, UseKind::Storage { .. }))
    };
    effects::of_gbuffer(plan).find_map(|(target, view, _)| is_stored(target).then_some(view))
}

/// Returns the first light and the light after the last of each step; the first step has none. A few lights come one by one; if there are many, each
/// step after the first doubles them.
fn light_groups(count: usize) -> Vec<[usize; 2]> {
    let mut groups = vec![[0, 0]];
    let mut first = 0;
    while first < count {
        let more = if count <= SINGLE_LIGHTS { 1 } else { first.max(1) };
        groups.push([first, (first + more).min(count)]);
        first += more;
    }
    groups
}

/// Returns the next or previous step of `count`, where `None` is the whole frame: before the first step, and after the last.
fn turned(now: Option<usize>, count: usize, back: bool) -> Option<usize> {
    match (now, back) {
        (None, true) => count.checked_sub(1),
        (None, false) => (count > 0).then_some(0),
        (Some(now), true) => now.checked_sub(1),
        (Some(now), false) => Some(now + 1).filter(|&next| next < count),
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use afterlight::plan::samples;
    use afterlight::scene::{AmbientOcclusion, Falloff, GbufferChoice, LightPath, Material, Scene};

    #[test]
    fn groups_have_each_light_once_and_in_order_and_double_where_there_are_many() {
        for count in [0, 1, 2, 17, 24, 25, 32, 64, 65, 10_000] {
            let groups = light_groups(count);
            assert_eq!(groups[0], [0, 0], "{count}");
            let mut next = 0;
            for &[first, end] in &groups[1..] {
                assert!(first == next && end > first, "{count}: {groups:?}");
                next = end;
            }
            assert_eq!(next, count);
            let expected = if count <= SINGLE_LIGHTS { count } else { 1 + count.next_power_of_two().ilog2() as usize };
            assert_eq!(groups.len() - 1, expected, "{count}: {groups:?}");
        }
    }

    #[test]
    fn steps_lead_forward_and_back_through_all_and_to_the_whole_frame() {
        let mut way = vec![None];
        loop {
            let next = turned(way[way.len() - 1], 3, false);
            way.push(next);
            if next.is_none() {
                break;
            }
        }
        assert_eq!(way, [None, Some(0), Some(1), Some(2), None]);
        let back: Vec<_> = way.iter().rev().skip(1).copied().collect();
        let mut now = None;
        for expected in back {
            now = turned(now, 3, true);
            assert_eq!(now, expected);
        }
        assert_eq!([turned(None, 0, false), turned(None, 0, true)], [None; 2]);
    }

    fn street() -> Scene {
        let materials =
            vec![Material::default(), Material { metallic: 1.0, ..Material::default() }, samples::emissive()];
        let lights = vec![samples::point(Falloff::Quadratic), samples::sun(), samples::spot(Falloff::InverseSquare)];
        samples::scene(materials, lights)
    }

    fn passes(scene: &Scene, settings: &Settings) -> Vec<&'static str> {
        let plan = FramePlan::of(scene, settings, &samples::device()).expect("a plan");
        let mut passes: Vec<_> = FrameStep::all(&plan).into_iter().map(|step| step.pass(&plan)).collect();
        passes.dedup();
        passes
    }

    #[test]
    fn passes_come_in_the_order_of_the_frame_and_only_those_that_it_has() {
        let deferred = samples::deferred();
        assert_eq!(passes(&street(), &deferred), ["SHADOW", "GEOMETRY", "LIGHTING", "TONEMAP"]);
        let plain = samples::scene(vec![Material::default()], vec![samples::sky()]);
        assert_eq!(passes(&plain, &deferred), ["GEOMETRY", "LIGHTING"]);
        assert_eq!(passes(&plain, &Settings::default()), ["FORWARD"]);
        assert_eq!(passes(&plain, &Settings { fxaa: true, ..deferred.clone() }), ["GEOMETRY", "LIGHTING", "FXAA"]);
        let mut shaded = plain.clone();
        shaded.environment.ambient = Vec3::splat(0.1);
        let effects = Settings { ao: AmbientOcclusion::Bitmask, bloom: 0.1, vignette: 0.5, ..deferred.clone() };
        let all = ["GEOMETRY", "AO_DENOISE", "LIGHTING", "SPREAD", "TONEMAP", "TONE"];
        assert_eq!(passes(&shaded, &effects), all);
        let tiled = Settings { light_path: LightPath::Compute, ..deferred.clone() };
        assert_eq!(passes(&street(), &tiled), ["SHADOW", "GEOMETRY", "TILED"]);
        let glass = samples::scene(vec![Material::default(), samples::glass()], vec![samples::sky()]);
        assert_eq!(passes(&glass, &deferred), ["GEOMETRY", "LIGHTING", "TRANSPARENT", "TONEMAP"]);
        let sums = Settings { transparency: Transparency::Oit, ..deferred };
        assert_eq!(passes(&glass, &sums), ["GEOMETRY", "LIGHTING", "TRANSPARENT", "COMPOSITE", "TONEMAP"]);
    }

    #[test]
    fn only_what_the_gbuffer_holds_is_shown() {
        let views = |scene: &Scene, settings: &Settings| {
            buffers(&FramePlan::of(scene, settings, &samples::device()).expect("a plan"))
        };
        let lambert = samples::scene(vec![samples::material(Brdf::Lambert)], vec![samples::sky()]);
        let deferred = samples::deferred();
        assert_eq!(views(&lambert, &deferred), [View::Depth, View::Normal, View::Albedo]);
        let all = [View::Depth, View::Normal, View::Albedo, View::Metallic, View::Roughness];
        assert_eq!(views(&street(), &deferred), all);
        let fat = GbufferChoice { preset: afterlight::scene::GbufferPreset::Fat, ..GbufferChoice::default() };
        assert!(views(&lambert, &Settings { gbuffer: fat, ..deferred.clone() }).contains(&View::Position));
        assert!(views(&street(), &Settings { msaa: 4, ..deferred }).contains(&View::Complexity));
    }

    #[test]
    fn effects_are_left_out_of_the_steps_before_them() {
        let mut plain = samples::scene(vec![Material::default()], vec![samples::sky()]);
        plain.environment.ambient = Vec3::splat(0.1);
        let whole =
            Settings { ao: AmbientOcclusion::Bitmask, bloom: 0.1, vignette: 0.5, fxaa: true, ..samples::deferred() };
        let plan = FramePlan::of(&plain, &whole, &samples::device()).expect("a plan");
        let seen: Vec<_> = FrameStep::all(&plan)
            .into_iter()
            .map(|step| {
                let own = step.settings(&whole, &plan);
                let has = [own.ao != AmbientOcclusion::Off, own.bloom > 0.0, own.fxaa, own.vignette > 0.0];
                (step.pass(&plan), has.into_iter().filter(|&has| has).count())
            })
            .collect();
        let expected = [
            ("GEOMETRY", 0),
            ("AO_DENOISE", 1),
            ("LIGHTING", 1),
            ("SPREAD", 2),
            ("TONEMAP", 2),
            ("FXAA", 3),
            ("TONE", 4),
        ];
        let mut passes = seen.clone();
        passes.dedup();
        assert_eq!(passes, expected, "{seen:?}");
    }

    /// A step shows the frame's own work: its plan differs in nothing but the subject of the step.
    #[test]
    fn every_step_can_be_planned_and_those_of_lights_have_the_frames_own_plan() {
        let glass = samples::scene(vec![Material::default(), samples::glass()], vec![samples::sky(), samples::sun()]);
        for scene in [street(), glass] {
            for &(name, light_path) in LightPath::NAMES {
                for (fxaa, msaa, transparency, ao) in [
                    (false, 1, Transparency::Sorted, AmbientOcclusion::Off),
                    (true, 1, Transparency::Oit, AmbientOcclusion::Bitmask),
                    (true, 4, Transparency::Sorted, AmbientOcclusion::Off),
                ] {
                    let whole = Settings { light_path, fxaa, msaa, transparency, ao, ..Settings::default() };
                    // Settings that do not go together are refused.
                    let Ok(plan) = FramePlan::of(&scene, &whole, &samples::device()) else { continue };
                    for step in FrameStep::all(&plan) {
                        let settings = step.settings(&whole, &plan);
                        let what = format!("{name}, FXAA {fxaa}, {msaa}: {step:?}");
                        let own = FramePlan::of(&scene, &settings, &samples::device());
                        let own = own.unwrap_or_else(|error| panic!("{what}: {error}"));
                        let is_buffer =
                            matches!(step, FrameStep::ShadowMaps | FrameStep::Buffer(_) | FrameStep::Rewritten(..));
                        assert!(is_buffer || own.light_path == plan.light_path, "{what}: {}", own.light_path);
                        if matches!(step, FrameStep::Lights { .. }) {
                            assert_eq!(
                                (
                                    own.light_numbers(),
                                    &own.gbuffer,
                                    &own.shadow,
                                    own.hdr,
                                    &own.geometry,
                                    own.tone_mapping
                                ),
                                (
                                    plan.light_numbers(),
                                    &plan.gbuffer,
                                    &plan.shadow,
                                    plan.hdr,
                                    &plan.geometry,
                                    plan.tone_mapping
                                ),
                                "{what}"
                            );
                        }
                    }
                    let last = *FrameStep::all(&plan).last().expect("a frame lights something");
                    let own = FramePlan::of(&scene, &last.settings(&whole, &plan), &samples::device()).expect("a plan");
                    assert_eq!(
                        (own.output, own.effects.fxaa, own.tone_mapping),
                        (plan.output, plan.effects.fxaa, plan.tone_mapping)
                    );
                }
            }
        }
    }
}
