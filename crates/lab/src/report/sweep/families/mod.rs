//! The points of a sweep: for each setting of a picture's quality, its values, as far as a scene needs it and a device has it.
//!
//! All of this is decided from the scene, the settings as given and the device's capabilities, before anything is drawn. Values that draw the same
//! frames as the settings as given are not drawn again, a setting that changes nothing is left out, and the report names both.

mod axes;
mod joint;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::model::{LeftOut, Member, Shard};
use afterlight::plan::{Capabilities, FramePlan};
use afterlight::scene::{SETTINGS, Scene, Settings, SettingsPatch, counted, ev100_of, exposure_scale};
use afterlight::visible::World;
use axes::SweepAxis;

/// The key of the family in which several settings change at once.
pub const JOINT: &str = "joint";

/// Why a value is left out that only a whole sweep tries.
const QUICK: &str = "--quick tries fewer values";

/// The extent of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Only the families with these keys; `None` for all families.
    pub families: Option<Vec<String>>,
    /// The most members of the joint family; 0 for none.
    pub joint: usize,
    /// Few values of each setting.
    pub quick: bool,
    /// Decides the combinations of the joint family.
    pub seed: u64,
}

/// A scene's points and families, in the order in which they are measured and shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The differences from the settings as given. The first says nothing; each stands here once.
    pub points: Vec<SettingsPatch>,
    pub families: Vec<PlannedFamily>,
    pub left_out: Vec<LeftOut>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlannedFamily {
    pub key: String,
    pub title: String,
    pub members: Vec<Member>,
}

/// The keys of all families, for any scene.
pub fn family_keys() -> Vec<&'static str> {
    axes::swept().map(|setting| setting.key).chain([JOINT]).collect()
}

/// The name of a point: its settings, or "default" for the settings as given.
pub fn name_of(patch: &SettingsPatch) -> String {
    let text = patch.to_string();
    if text.is_empty() { "default".into() } else { text }
}

/// The settings of a point: the settings as given, overridden by the point's.
pub fn settings_of(patch: &SettingsPatch, base: &SettingsPatch) -> Settings {
    patch.or(base).decide()
}

/// The settings as given, planned: all points are compared with them.
pub(super) struct Base<'a> {
    pub scene: &'a Scene,
    pub device: &'a Capabilities,
    pub patch: &'a SettingsPatch,
    pub settings: Settings,
    pub plan: FramePlan,
}

/// The result of trying a value: its frames, or why there are none.
enum Admission {
    /// The value draws other frames than the settings as given.
    Point,
    /// The value draws the same frames as the settings as given.
    Same,
    /// Why the scene or the device cannot have it.
    Refused(String),
}

impl<'a> Base<'a> {
    pub fn of(
        scene: &'a Scene,
        patch: &'a SettingsPatch,
        device: &'a Capabilities,
    ) -> Result<Self, afterlight::plan::PlanError> {
        let settings = patch.decide();
        let plan = FramePlan::of(scene, &settings, device)?;
        Ok(Self { scene, device, patch, settings, plan })
    }

    fn try_out(&self, patch: &SettingsPatch) -> Admission {
        let settings = settings_of(patch, self.patch);
        if settings == self.settings {
            return Admission::Same;
        }
        let plan = match FramePlan::of(self.scene, &settings, self.device) {
            Ok(plan) => plan,
            Err(error) => return Admission::Refused(error.to_string()),
        };
        // A point without one of its parts would be drawn under a wrong name.
        if let Some(new) = plan.warnings().iter().find(|warning| !self.plan.warnings().contains(warning)) {
            return Admission::Refused(new.clone());
        }
        if self.draws_the_same(&settings, &plan) { Admission::Same } else { Admission::Point }
    }

    /// Returns true if other settings draw the same frames as the settings as given, in the same way.
    fn draws_the_same(&self, settings: &Settings, plan: &FramePlan) -> bool {
        if !plan.has_structure_of(&self.plan) {
            return false;
        }
        // The plan leaves out the settings that are looked up anew for each frame.
        let (own, other) = (self.settings.patch(), settings.patch());
        let mut changed = SETTINGS.iter().filter(|setting| setting.text(&own) != setting.text(&other));
        changed.all(|setting| match setting.key {
            "shadow-normal-offset" | "shadow-slope-bias" => plan.shadow.is_none(),
            "shadow-lambda" => !self.has_cascades(),
            "light-cutoff" => self.reaches(settings, plan),
            _ => setting.changes_plan,
        })
    }

    /// Returns true if a directional light has more than one map.
    pub fn has_cascades(&self) -> bool {
        self.has_sun_shadow() && self.settings.shadows.cascades > 1
    }

    /// Returns true if a directional light has maps.
    pub fn has_sun_shadow(&self) -> bool {
        let casts = |light: &afterlight::scene::Light| light.kind.is_directional() && light.casts_shadow;
        self.plan.shadow.is_some() && self.scene.lights.iter().any(casts)
    }

    /// Returns true if lights reach as far as with the settings as given.
    fn reaches(&self, settings: &Settings, plan: &FramePlan) -> bool {
        let exposure = exposure_scale(ev100_of(self.scene, settings));
        let of = |settings: &Settings, plan: &FramePlan| World::of(self.scene, settings, plan, exposure).reaches;
        of(settings, plan) == of(&self.settings, &self.plan)
    }
}

impl Sweep {
    /// Decides the points to measure.
    ///
    /// # Errors
    /// When the settings as given cannot be planned on the device.
    pub fn of(
        scene: &Scene,
        base: &SettingsPatch,
        device: &Capabilities,
        selection: &Selection,
    ) -> Result<Self, afterlight::plan::PlanError> {
        let base = Base::of(scene, base, device)?;
        let mut builder = SweepBuilder::default();
        builder.point(SettingsPatch::default());
        let mut kept = Vec::new();
        let is_wanted =
            |axis: &SweepAxis| selection.families.as_ref().is_none_or(|keys| keys.iter().any(|key| axis.is_of(key)));
        let tried = axes::all(&base, selection.quick);
        if selection.quick {
            let names = |axis: &SweepAxis| axis.candidates.iter().map(|one| name_of(&one.patch)).collect::<Vec<_>>();
            let quick: Vec<_> = tried.iter().flat_map(names).collect();
            let whole = axes::all(&base, false).into_iter().filter(|axis| axis.without.is_none() && is_wanted(axis));
            let others = whole.flat_map(|axis| names(&axis)).filter(|name| !quick.contains(name));
            others.for_each(|name| builder.leave_out(name, QUICK));
        }
        for axis in tried {
            let wanted = is_wanted(&axis);
            if let Some(valid) = builder.family(&base, axis, wanted) {
                kept.push(valid);
            }
        }
        let wanted = selection.families.as_ref().is_none_or(|keys| keys.iter().any(|key| key == JOINT));
        if wanted && selection.joint > 0 {
            builder.joint(&base, &kept, selection);
        }
        Ok(Self { points: builder.points, families: builder.families, left_out: builder.left_out })
    }

    /// Returns a line about the settings of which `--quick` did not try all values.
    pub fn quick_words(left_out: &[LeftOut]) -> Option<String> {
        /// More names would hide the line's message.
        const MOST: usize = 8;
        let names: Vec<_> = left_out.iter().filter(|own| own.reason == QUICK).map(|own| own.name.as_str()).collect();
        let keys = names.iter().flat_map(|name| name.split_whitespace()).filter_map(|pair| pair.split('=').next());
        let keys: BTreeSet<&str> = keys.collect();
        let named: Vec<_> = keys.iter().copied().take(MOST).collect();
        let more = keys.len().saturating_sub(MOST);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let (values, settings) = (counted(names.len(), "value"), counted(keys.len(), "setting"));
        (!names.is_empty()).then(|| {
            format!("--quick left out {values} of {settings} ({}{more}): without it all are tried", named.join(", "))
        })
    }

    /// The points that are measured: the shard's, or all. The first is always among them, as all others are timed beside it.
    pub fn own(&self, shard: Option<Shard>) -> Vec<usize> {
        let is_own = |index: usize| index == 0 || shard.is_none_or(|shard| shard.owns(index));
        (0..self.points.len()).filter(|&index| is_own(index)).collect()
    }
}

/// A sweep on its way.
#[derive(Default)]
struct SweepBuilder {
    points: Vec<SettingsPatch>,
    /// The indices of the points, by name.
    known: BTreeMap<String, usize>,
    families: Vec<PlannedFamily>,
    left_out: Vec<LeftOut>,
}

impl SweepBuilder {
    fn point(&mut self, patch: SettingsPatch) -> usize {
        let next = self.points.len();
        let index = *self.known.entry(name_of(&patch)).or_insert(next);
        if index == next {
            self.points.push(patch);
        }
        index
    }

    fn leave_out(&mut self, name: impl Into<String>, reason: impl Into<String>) {
        let left = LeftOut { name: name.into(), reason: reason.into() };
        if !self.left_out.contains(&left) {
            self.left_out.push(left);
        }
    }

    /// Tries an axis' values, and returns for the joint family the values that draw other frames, if any. Only a family that is `wanted` becomes one.
    fn family(&mut self, base: &Base, axis: SweepAxis, wanted: bool) -> Option<SweepAxis> {
        if let Some(why) = axis.without {
            if wanted {
                self.leave_out(axis.key, why);
            }
            return None;
        }
        let (mut valid, mut refused) = (Vec::new(), Vec::new());
        let mut default = None;
        for candidate in axis.candidates {
            match base.try_out(&candidate.patch) {
                Admission::Point => valid.push(candidate),
                Admission::Same => default = default.or(Some(candidate)),
                Admission::Refused(why) => refused.push((name_of(&candidate.patch), why)),
            }
        }
        if wanted {
            refused.into_iter().for_each(|(name, why)| self.leave_out(name, why));
        }
        if valid.is_empty() {
            if wanted {
                self.leave_out(&axis.key, "no value that this device has changes anything in this scene");
            }
            return None;
        }
        let axis = SweepAxis { candidates: valid, without: None, ..axis };
        if wanted {
            let own = default.map(|one| Member { point: 0, label: one.label, value: one.value });
            let own = own.or_else(|| axis.as_given.then(|| Member { point: 0, label: "as given".into(), value: None }));
            let members = axis.candidates.iter().map(|one| Member {
                point: self.point(one.patch.clone()),
                label: one.label.clone(),
                value: one.value,
            });
            let members: Vec<Member> = members.collect();
            let members = ordered(own.into_iter().chain(members).collect());
            self.families.push(PlannedFamily { key: axis.key.clone(), title: axis.title.clone(), members });
        }
        Some(axis)
    }

    fn joint(&mut self, base: &Base, axes: &[SweepAxis], selection: &Selection) {
        if selection.joint < 2 {
            return self.leave_out(JOINT, "one combination, as was asked for, is that of the settings as given");
        }
        let patches = joint::combinations(base, axes, selection);
        if patches.is_empty() {
            return self.leave_out(JOINT, "fewer than two settings change anything in this scene");
        }
        let mut members = vec![Member { point: 0, label: "as given".into(), value: None }];
        for patch in patches {
            let label = name_of(&patch);
            members.push(Member { point: self.point(patch), label, value: None });
        }
        let title = "Several settings at once".to_owned();
        self.families.push(PlannedFamily { key: JOINT.into(), title, members: ordered(members) });
    }
}

/// Numbers by their size, all else by when its point is measured: the same however the points were dealt to shards.
pub(super) fn ordered(mut members: Vec<Member>) -> Vec<Member> {
    members.sort_by(|a, b| match (a.value, b.value) {
        (Some(a), Some(b)) => a.total_cmp(&b),
        _ => a.point.cmp(&b.point),
    });
    members
}
