//! The reasons for a plan's decisions, beside them: two plans of one structure may give different ones. Passes and parts print them.

use super::shadows::shadow_reason;
use super::{FramePlan, Part};
use crate::scene::{Fog, Scene, Settings, View};

/// Why a plan is as it is, in clauses without a capital or a full stop. A reason against something means nothing in a plan that has it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reasons {
    /// Why the light path is this one.
    pub light_path: String,
    /// Why the device culls, or why it does not.
    pub culling: String,
    /// Why the device finds out which objects are hidden, or why it does not.
    pub hiding: String,
    /// Why there is no ambient occlusion.
    pub ao: String,
    /// Why surfaces mirror no others.
    pub reflections: String,
    /// Why there is no shadow map.
    pub shadow: String,
    /// Why there is no fog.
    pub fog: &'static str,
    /// Why there is no bloom.
    pub bloom: &'static str,
    /// Why frames are not averaged over time.
    pub taa: &'static str,
    pub(super) parts: Vec<Part>,
    pub(super) warnings: Vec<String>,
    /// The warnings about lights that go without their maps.
    pub(super) shadow_warnings: Vec<String>,
}

const NOT_ASKED_FOR: &str = "not asked for";

impl Reasons {
    /// With those why frames lack what a setting would give them.
    /// `asked`: the settings as they were given, where `settings` are those that the plan was made by.
    pub(super) fn with_absences(self, scene: &Scene, asked: &Settings, settings: &Settings, plan: &FramePlan) -> Self {
        let unless = |asked_for: bool, why: &'static str| if asked_for { why } else { NOT_ASKED_FOR };
        let fog = match asked.fog_density > 0.0 {
            true => "this view shows no fog",
            false => "its density is 0",
        };
        Self {
            fog: unless(asked.fog != Fog::Off, fog),
            bloom: unless(asked.bloom > 0.0, "this view shows no bloom"),
            taa: unless(asked.taa, "the values that this view shows have no mean"),
            shadow: without_shadow_maps(scene, settings, plan),
            ..self
        }
    }
}

/// The reason that a choice is as it is, whichever it is.
pub(super) fn either(choice: Result<String, String>) -> String {
    choice.unwrap_or_else(|why| why)
}

/// Why a plan has no shadow maps.
pub(super) fn without_shadow_maps(scene: &Scene, settings: &Settings, plan: &FramePlan) -> String {
    match shadow_reason(scene, settings, plan.light_numbers()) {
        Err(_) if settings.shadows.enabled && settings.view == View::Ambient => "this view shows no shadows".into(),
        Err(why) => why,
        Ok(()) if plan.reasons.shadow_warnings.is_empty() => "this view shows no shadows".into(),
        Ok(()) => plan.reasons.shadow_warnings.join("; "),
    }
}

impl FramePlan {
    /// Each part that a frame can have: in or out, why, and its bytes.
    pub fn parts(&self) -> &[Part] {
        &self.reasons.parts
    }

    /// Returns the requests that were not met, a line each.
    pub fn warnings(&self) -> &[String] {
        &self.reasons.warnings
    }
}
