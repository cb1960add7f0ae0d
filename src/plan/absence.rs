//! The reasons why frames lack what a setting would give them, decided where the settings are known. Passes and parts print them.

use super::FramePlan;
use super::shadows::shadow_reason;
use crate::scene::{Fog, Scene, Settings, View};

/// Each is true of a plan that lacks the thing, and means nothing for one that has it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Absences {
    pub fog: &'static str,
    pub bloom: &'static str,
    pub taa: &'static str,
    pub shadow: String,
}

const NOT_ASKED_FOR: &str = "not asked for";

impl Absences {
    /// `asked`: the settings as they were given, where `settings` are those that the plan was made by.
    pub(super) fn of(scene: &Scene, asked: &Settings, settings: &Settings, plan: &FramePlan) -> Self {
        let unless = |asked_for: bool, why: &'static str| if asked_for { why } else { NOT_ASKED_FOR };
        let fog = match asked.fog_density > 0.0 {
            true => "this view shows no fog",
            false => "its density is 0",
        };
        Self {
            fog: unless(asked.fog != Fog::Off, fog),
            bloom: unless(asked.bloom > 0.0, "this view shows no bloom"),
            taa: unless(asked.taa, "the values that this view shows have no mean"),
            shadow: shadow(scene, settings, plan),
        }
    }
}

/// Why a plan has no shadow maps.
pub(super) fn shadow(scene: &Scene, settings: &Settings, plan: &FramePlan) -> String {
    match shadow_reason(scene, settings, plan.light_numbers()) {
        Err(_) if settings.shadows.enabled && settings.view == View::Ambient => "this view shows no shadows".into(),
        Err(why) => why,
        Ok(()) if plan.shadow_warnings.is_empty() => "this view shows no shadows".into(),
        Ok(()) => plan.shadow_warnings.join("; "),
    }
}
