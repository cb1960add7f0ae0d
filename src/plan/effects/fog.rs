//! Fog: the decision whether frames have some, and its parameters.

use super::froxels;
use crate::plan::checks::out_of_range;
use crate::plan::effect::{
    Effect, EffectRequest, EffectView, Hdr, LightReaders, LitAir, NOT_ASKED_FOR, Shows, Variation,
};
use crate::plan::parts::{Part, part};
use crate::plan::{FramePlan, FroxelPlan, PartGroup};
use crate::scene::{Fog, Settings, View};

/// Fog lies between the eye and the surfaces.
pub(crate) const EFFECT: Effect = Effect {
    name: "fog",
    is_asked_for: |_, settings| is_asked_for(settings),
    off: Some(("--fog off", |settings| settings.fog = Fog::Off)),
    view: Some(EffectView { view: View::Fog, shows: Shows::Light, is_alone: false, plan: |_| {} }),
    changes_light: true,
    shines_beyond: true,
    is_set_aside: true,
    unswept: |key, _, plan| match key {
        "fog" if !plan.has_fog() => Some("no fog is asked for"),
        "fog-froxels" | "fog-samples" if plan.froxels().is_none() => {
            Some("no lit fog is asked for, or no light shines into it")
        }
        _ => None,
    },
    reaches_all_lights: |settings| {
        (settings.fog == Fog::Froxels).then_some("fog is everywhere, and any light may shine into it")
    },
    lit_air: |plan| if plan.froxels().is_some() { LitAir::Shadowed } else { LitAir::Directional },
    is_in: |plans| plans.fog.is_some(),
    needs_light_buffer: LightReaders::Own,
    frame_buffers: |plan| u32::from(plan.names_froxels()),
    hdr: Some(Hdr::Blends("fog is blended over the light before tone mapping")),
    absence: |own| match (own.asked.fog, own.asked.fog_density > 0.0) {
        (Fog::Off, _) => NOT_ASKED_FOR,
        (_, true) => "this view shows no fog",
        (_, false) => "its density is 0",
    },
    parts: |_, _, plan| [part_of(plan), froxels::part_of(plan)].map(|part| part.of(PartGroup::Lights)).into(),
    not_by_compute: Some("they cannot draw fog"),
    check: |request| {
        if !is_asked_for(request.settings) {
            return Ok(());
        }
        EFFECT.check_path(request.path)?;
        let wrong = if is_shown(request.settings) { out_of_range(request.settings, "fog-") } else { None };
        // Titles of its settings begin with the effect's name, and so does the refusal.
        wrong.map_or(Ok(()), |wrong| EFFECT.refuse(wrong.strip_prefix("fog ").unwrap_or(&wrong).to_owned()))
    },
    variations: &[
        Variation::of("fog", |settings| settings.fog = Fog::Height).carried_with(&[&["sorted"], &["mirrored"]]),
        Variation::of("lit fog", |settings| (settings.fog, settings.fog_froxels) = (Fog::Froxels, [5, 4, 3])),
        Variation::view("view of fog", |_| {}, |settings| settings.view = View::Fog),
    ],
    draws: &["fog"],
    former_rows: &[
        ("froxels-reuse", &["scatter-reuse"]),
        ("froxels-to-fog", &["integrate-to-readers"]),
        ("ao-to-fog", &["ao-denoise-to-fog"]),
        ("resolve-to-fog", &["reflect-resolve-to-fog"]),
    ],
    ..Effect::PLAIN
};

/// The fog of a plan's frames. The extinction per metre at an altitude y is `density` times e to the power of (`base` - y) / `height`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FogPlan {
    /// Never `Off`.
    pub kind: Fog,
    /// Extinction at the base, in 1/m.
    pub density: f32,
    /// Metres over which extinction falls to 1/e.
    pub height: f32,
    /// Metres above the world's origin.
    pub base: f32,
    /// The share of the extinguished light that is scattered.
    pub albedo: f32,
    /// The mean cosine of the angle of scattering.
    pub anisotropy: f32,
    /// The picture shows the light that the fog scatters, and nothing else.
    pub alone: bool,
    /// The grid of the light in it; `None` if no lights shine into it.
    pub(super) froxels: Option<FroxelPlan>,
}

impl FogPlan {
    /// Returns `None` if the air is clear or a view shows something else.
    pub(super) fn of(request: &EffectRequest, any_light: bool) -> Option<Self> {
        let settings = request.settings;
        let alone = settings.view == View::Fog;
        if !is_asked_for(settings) || !is_shown(settings) {
            return None;
        }
        let &Settings { fog_density: density, fog_height: height, fog_base: base, .. } = settings;
        // The view shows fog even if no fog is asked for.
        let kind = if settings.fog == Fog::Off { Fog::Height } else { settings.fog };
        let (albedo, anisotropy) = (settings.fog_albedo, settings.fog_anisotropy);
        let froxels = FroxelPlan::of(settings, kind, any_light);
        let own = Self { kind, density, height, base, albedo, anisotropy, alone, froxels };
        (alone || density > 0.0).then_some(own)
    }
}

/// Returns true if there is fog, or it is to be shown.
fn is_asked_for(settings: &Settings) -> bool {
    settings.fog != Fog::Off || settings.view == View::Fog
}

/// Views of other values leave it out.
fn is_shown(settings: &Settings) -> bool {
    matches!(settings.view, View::Final | View::Fog)
}

impl FramePlan {
    /// Returns true if FOG comes after the pass that lights opaque surfaces.
    pub fn has_fog(&self) -> bool {
        self.effects.fog.is_some()
    }
}

fn part_of(plan: &FramePlan) -> Part {
    let reason = match &plan.effects.fog {
        Some(fog) => format!(
            "{} of {} 1/m at a height of {} m, e times thinner {} m above; albedo {}, anisotropy {}",
            fog.kind, fog.density, fog.base, fog.height, fog.albedo, fog.anisotropy
        ),
        None => plan.reasons.lack_of(EFFECT.name).into(),
    };
    part("fog", plan.effects.fog.is_some(), reason, 0)
}
