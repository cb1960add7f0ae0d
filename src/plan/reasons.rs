//! The reasons for a plan's decisions, beside them: two plans of one structure may give different ones. Passes and parts print them.

use std::collections::BTreeMap;

use super::effect::Absence;
use super::effects::EFFECTS;
use super::shadows::shadow_reason;
use super::{FramePlan, Part};
use crate::scene::{Scene, Settings, View};

/// Why a plan is as it is, in clauses without a capital or a full stop. A reason against something means nothing in a plan that has it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reasons {
    /// Why the light path is this one.
    pub light_path: String,
    /// Why the device culls, or why it does not.
    pub culling: String,
    /// Why the device finds out which objects are hidden, or why it does not.
    pub hiding: String,
    /// Why there is no shadow map.
    pub shadow: String,
    /// Why effects are absent, by their names.
    pub(super) absences: BTreeMap<&'static str, &'static str>,
    pub(super) parts: Vec<Part>,
    pub(super) warnings: Vec<String>,
    /// The warnings about lights that go without their maps.
    pub(super) shadow_warnings: Vec<String>,
}

impl Reasons {
    /// Adds the reasons against effects and shadow maps that frames lack. `asked` are the settings as given, `planned` the ones that the plan was made by.
    pub(super) fn with_absences(self, scene: &Scene, asked: &Settings, planned: &Settings, plan: &FramePlan) -> Self {
        let own = Absence { scene, asked, planned };
        Self {
            absences: EFFECTS.iter().map(|effect| (effect.name, (effect.absence)(&own))).collect(),
            shadow: without_shadow_maps(scene, planned, plan),
            ..self
        }
    }

    /// Why frames lack an effect, by its name in refusals.
    pub fn lack_of(&self, effect: &str) -> &'static str {
        self.absences.get(effect).copied().unwrap_or_default()
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
