//! Refraction: glass shows the picture behind it bent, blurred and tinted, for which BACKDROP keeps that picture.

use glam::{DAffine3, DVec3, Vec3};

use crate::plan::effect::{Effect, EffectRequest, Hdr, Variation};
use crate::plan::parts::part;
use crate::plan::{BufferName, Capabilities, FramePlan, LobeMask, PartGroup, PlanError, Shading, SurfaceRules};
use crate::scene::{AlphaMode, Material, Object, Refraction, Scene, Settings, Transparency};
use crate::shaders::shared::backdrop::LAST_LEVEL;

/// The picture behind glass, with the means of its squares.
pub const BACKDROP: BufferName = BufferName("backdrop");

/// Glass bends light.
pub(crate) const EFFECT: Effect = Effect {
    name: "refraction",
    is_asked_for: is_used,
    is_in: |plans| plans.refraction.is_some(),
    hdr: Some(Hdr::Reads("BACKDROP reads the light of all pixels before it is tone-mapped")),
    check_plan,
    absence: |own| match has_glass(own.scene, own.planned) {
        _ if own.planned.textbook => "textbooks' models let no light through",
        false => "no material is glass that bends light",
        true if own.planned.transparency == Transparency::Oit => "transparent surfaces are not sorted",
        true => "this view does not show it",
    },
    parts: |_, _, plan| {
        let own = match &plan.effects.refraction {
            Some(own) => part(
                "picture behind glass",
                true,
                "depth and light of each pixel, and the means of squares of 2 to 32 pixels",
                own.bytes(plan.size),
            ),
            None => part("picture behind glass", false, plan.reasons.lack_of(EFFECT.name), 0),
        };
        vec![own.of(PartGroup::Targets)]
    },
    variations: &[Variation::with("through glass", make_glass, |settings| {
        settings.transparency = Transparency::Sorted
    })],
    ..Effect::PLAIN
};

/// Puts a body of coloured glass before the first object, of the same shape.
fn make_glass(scene: &mut Scene) {
    if let Some(object) = scene.objects.first() {
        let body = Refraction { thickness: 0.5, distance: 0.5, color: Vec3::new(0.5, 0.8, 0.6), ..Refraction::THIN };
        let glass =
            Material { alpha_mode: AlphaMode::Glass, alpha: 0.1, refraction: Some(body), ..Material::default() };
        let before = DAffine3::from_translation(DVec3::Z * 0.5) * object.transform;
        let glazed = Object::new("glass", object.mesh, scene.materials.len(), before);
        scene.materials.push(glass);
        scene.objects.push(glazed);
    }
}

fn has_glass(scene: &Scene, settings: &Settings) -> bool {
    let is_glass = |material: usize| {
        let material = &scene.materials[material];
        material.refracts(material.model(settings.brdf)).is_some()
    };
    scene.objects.iter().any(|object| is_glass(object.material))
}

fn is_used(scene: &Scene, settings: &Settings) -> bool {
    settings.transparency == Transparency::Sorted && !settings.textbook && has_glass(scene, settings)
}

/// Refuses devices whose shaders cannot look at a buffer of that size.
fn check_plan(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    let bytes = plan.effects.refraction.map_or(0, |own| own.bytes(plan.size));
    if bytes <= u64::from(device.storage_range) {
        return Ok(());
    }
    let most = device.storage_range;
    EFFECT.refuse(format!(
        "the picture behind glass takes {bytes} bytes at this size, and this device allows {most} in one buffer: ask for a smaller picture, or for --transparency oit, which bends no light"
    ))
}

/// The picture that glass shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefractionPlan;

impl RefractionPlan {
    /// Returns `None` if no drawn glass bends light.
    pub(super) fn of(request: &EffectRequest, rules: &SurfaceRules) -> Option<Self> {
        let Shading::Light { .. } = request.shading else { return None };
        let mut drawn = rules.drawn(request.scene);
        drawn.any(|object| rules.lobes_of(rules.material(object)).contains(LobeMask::GLASS)).then_some(Self)
    }

    /// Bytes of the buffer: a word for the depth of each pixel, and two for the light of each texel of each level.
    pub fn bytes(self, size: [u32; 2]) -> u64 {
        let texels = |level: u32| size.map(|edge| u64::from(edge.div_ceil(1 << level))).iter().product::<u64>();
        4 * texels(0) + 8 * (0..=LAST_LEVEL).map(texels).sum::<u64>()
    }
}
