//! Tinted shadows: a second map beside each shadow map has what transparent surfaces let through, and TINT draws it.

use ash::vk;
use glam::{DAffine3, DVec3, Vec3};

use crate::plan::effect::{Effect, Variation};
use crate::plan::parts::part;
use crate::plan::{PartGroup, ShadowPlan, SurfaceRules};
use crate::scene::{AlphaMode, CastsShadow, Material, Object, Refraction, Scene, Settings};

/// Transparent surfaces cast shadows.
pub(crate) const EFFECT: Effect = Effect {
    name: "tinted shadows",
    is_plural: true,
    is_asked_for: are_asked_for,
    off: Some(("--tinted-shadows off", |settings| settings.shadows.tinted = false)),
    is_set_aside: true,
    is_in: |plans| plans.tints,
    absence: |own| match () {
        () if !own.planned.shadows.tinted => "not asked for: transparent surfaces cast no shadow",
        () if !any_veil(own.scene) => "no transparent surface casts a shadow",
        () => "no shadow map, or a view in which nothing transparent is drawn",
    },
    parts: |_, _, plan| {
        let (reason, bytes) = match &plan.shadow {
            Some(own) if own.tinted => (
                "the share of light that transparent surfaces let through, and how near to the light they are",
                own.tint_bytes(),
            ),
            _ => (plan.reasons.lack_of(EFFECT.name), 0),
        };
        vec![part("shadow tints", plan.effects.tints, reason, bytes).of(PartGroup::Shadows)]
    },
    variations: &[Variation::with("with tinted shadows", hang_veils, |settings| settings.shadows.tinted = true)],
    ..Effect::PLAIN
};

/// Returns true if shadow maps would have tints.
pub fn are_asked_for(scene: &Scene, settings: &Settings) -> bool {
    settings.shadows.tinted && any_veil(scene)
}

/// Returns true if a surface lets a part of the light through. A coat lies on an opaque surface, which stops all of it.
fn is_veil(material: &Material) -> bool {
    let is_there = material.alpha_mode == AlphaMode::Blend && material.alpha > 0.0;
    is_there || material.alpha_mode == AlphaMode::Glass
}

fn any_veil(scene: &Scene) -> bool {
    let is_one = |object: &Object| {
        let casts = object.casts_shadow != CastsShadow::No && !scene.meshes[object.mesh].is_strokes;
        casts && is_veil(&scene.materials[object.material])
    };
    scene.objects.iter().any(is_one)
}

/// Puts a veil and a body of glass before the first object, of the same shape.
fn hang_veils(scene: &mut Scene) {
    let Some((mesh, transform)) = scene.objects.first().map(|own| (own.mesh, own.transform)) else { return };
    let body = Refraction { thickness: 0.5, distance: 0.5, color: Vec3::new(0.5, 0.8, 0.6), ..Refraction::THIN };
    let glass = Material { alpha_mode: AlphaMode::Glass, alpha: 0.1, refraction: Some(body), ..Material::default() };
    let veil = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..Material::default() };
    for (name, material, along) in [("veil", veil, 0.4), ("body", glass, 0.8)] {
        let before = DAffine3::from_translation(DVec3::Z * along) * transform;
        scene.objects.push(Object::new(name, mesh, scene.materials.len(), before));
        scene.materials.push(material);
    }
}

impl SurfaceRules<'_> {
    /// Returns true if an object's shadow is the light that it lets through.
    pub(in crate::plan) fn is_veil(&self, object: &Object) -> bool {
        let is_tinted = self.shadow.is_some_and(|own| own.tinted);
        is_tinted && is_veil(self.material(object)) && !self.is_strokes(object)
    }
}

impl ShadowPlan {
    /// The format of tints: every device blends it.
    pub const TINT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
}
