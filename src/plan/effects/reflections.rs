//! Reflections: the decision whether surfaces mirror others as the picture shows them, and the parameters of the search.

use std::fmt;

use ash::vk;

use crate::plan::checks::out_of_range;
use crate::plan::effect::{Effect, EffectRequest, EffectView, Hdr, NOT_ASKED_FOR, Shows, Variation};
use crate::plan::parts::line_of_target;
use crate::plan::{FramePlan, OwnTarget, PlanError, Target, TargetName, format_bytes};
use crate::scene::{Brdf, HdrFormat, Object, Reflections, Scene, Settings, TextureSlot, View};
use crate::shaders::shared::hiz;

/// The nearest and the farthest depth of squares of pixels, in levels ([`Hiz`]).
pub const HIZ: Target = Target::FromDepth(TargetName(1, "Hiz"));
/// The hit of each pixel's reflection ray: light, confidence, and place.
pub const RAYS: Target = Target::FromDepth(TargetName(2, "Rays"));

/// Surfaces mirror others.
pub(crate) const EFFECT: Effect = Effect {
    name: "reflections",
    is_plural: true,
    is_asked_for: is_used,
    off: Some(("--reflections off", |settings| settings.reflections = Reflections::Off)),
    view: Some(EffectView {
        view: View::Reflections,
        shows: Shows::Values,
        is_alone: false,
        plan: |settings| settings.reflections = Reflections::Screen,
    }),
    changes_light: true,
    // REFLECT_RESOLVE takes back what AMBIENT has added of it.
    computes_with_sky: true,
    is_set_aside: true,
    unswept: |key, _, plan| {
        (key.starts_with("reflection") && !plan.reflects())
            .then_some("no reflections were asked for, or nothing mirrors any")
    },
    not_by_compute: Some("they cannot draw reflections"),
    reads_gbuffer: Some("reflections read a G-buffer"),
    stores_gbuffer: Some("REFLECT reads the depth and the normals of all pixels"),
    hdr: Some(Hdr::Reads("REFLECT reads the light of all pixels before it is tone-mapped")),
    is_in: |plans| plans.reflections.is_some(),
    absence: |own| match shows(own.planned.view) {
        _ if own.planned.reflections == Reflections::Off => NOT_ASKED_FOR,
        true => "no opaque surface has a lobe of Cook-Torrance that is smooth enough",
        false => "this view does not show them",
    },
    targets: TARGETS,
    parts: |_, _, plan| {
        vec![
            line_of_target(plan, EFFECT.name, &TARGETS[0], "REFLECT takes long steps through it"),
            line_of_target(plan, EFFECT.name, &TARGETS[1], "REFLECT hands them to REFLECT_RESOLVE"),
        ]
    },
    check,
    variations: &[
        Variation::with("mirrored", polish, |settings| {
            (settings.reflections, settings.reflection_roughness) = (Reflections::Screen, 1.0);
        }),
        Variation::view("view of reflections", polish, |settings| {
            (settings.view, settings.reflection_roughness) = (View::Reflections, 1.0);
        }),
    ],
    draws: &["reflect-resolve"],
    former_rows: &[
        ("rays-to-resolve", &["rays-to-reflect-resolve"]),
        ("light-to-resolve", &["hdr-to-reflect-resolve"]),
        ("resolve-to-transparent", &["reflect-resolve-to-transparent"]),
        ("resolve-to-composite", &["reflect-resolve-to-composite"]),
    ],
    ..Effect::PLAIN
};

/// Gives the first material a lobe that is smooth enough.
fn polish(scene: &mut Scene) {
    if let Some(material) = scene.materials.first_mut() {
        (material.brdf, material.roughness) = (Brdf::CookTorrance, 0.3);
    }
}

/// The parameters of REFLECT, all fixed in its pipelines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReflectionPlan {
    /// The greatest perceptual roughness of surfaces that mirror others.
    pub roughness: f32,
    /// Maximum steps of a ray through the depth pyramid.
    pub steps: u32,
    /// The thickness in metres that surfaces are assumed to have behind their visible side.
    pub thickness: f32,
    /// The picture shows the hits instead of the light.
    pub shown: bool,
}

/// The formats are mandatory to store to.
const TARGETS: &[OwnTarget] = &[
    OwnTarget {
        target: HIZ,
        noun: "depths of squares",
        line: Some("pyramid of depths of the picture"),
        format: |plan| plan.reflects().then_some(vk::Format::R32_SFLOAT),
        extent: |plan| Hiz::of(plan.size).extent(),
        bytes_per_pixel: |_| Hiz::BYTES_PER_PIXEL,
    },
    OwnTarget {
        target: RAYS,
        noun: "rays",
        line: Some("rays"),
        format: |plan| plan.reflects().then_some(HIT),
        extent: |plan| plan.size,
        bytes_per_pixel: |_| format_bytes(HIT),
    },
];
const HIT: vk::Format = vk::Format::R32G32B32A32_UINT;

/// In `inspect`: `screen, up to a roughness of 0.6, 64 steps at most, surfaces 0.2 m thick`.
impl fmt::Display for ReflectionPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { roughness, steps, thickness, shown: _ } = self;
        write!(f, "screen, up to a roughness of {roughness}, {steps} steps at most, surfaces {thickness} m thick")
    }
}

/// The places of the levels of the pyramid of depths in one image. Level n has a texel for each square of 2^n pixels; level 0 is the depth buffer.
/// The first level lies at the left, the others below one another at its right; the nearest depths in the upper half, the farthest in the lower
/// (`shaders/shared/hiz.wgsl`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hiz {
    /// Squares of [`Hiz::TILE`] pixels across and down.
    pub tiles: [u32; 2],
}

impl Hiz {
    /// Edge of a square of the last level, in pixels: the part that a work group sees.
    pub const TILE: u32 = hiz::TILE as u32;
    /// Two single floats for each of 1/4 + 1/16 + ... pixels, and the unused part beside the smaller levels.
    pub const BYTES_PER_PIXEL: u32 = 3;

    /// The pyramid of a picture.
    pub fn of(size: [u32; 2]) -> Self {
        Self { tiles: size.map(|edge| edge.div_ceil(Self::TILE)) }
    }

    /// Width and height of the image in texels.
    pub fn extent(&self) -> [u32; 2] {
        let [across, down] = self.tiles.map(|count| count * Self::TILE);
        [across * 3 / 4, down]
    }
}

fn check(request: &EffectRequest) -> Result<(), PlanError> {
    let settings = request.settings;
    if settings.reflections == Reflections::Off {
        return Ok(());
    }
    if let Some(wrong) = out_of_range(settings, "reflection-") {
        return EFFECT.refuse(wrong);
    }
    if !is_used(request.scene, settings) {
        return Ok(());
    }
    EFFECT.check_path(request.path)?;
    if settings.msaa > 1 {
        return EFFECT.refuse(format!(
            "they are found by one depth a pixel, and with --msaa {} there are several: choose --samples",
            settings.msaa
        ));
    }
    if settings.hdr_format == HdrFormat::B10g11r11 {
        return EFFECT.refuse(format!("no shader stores to an HDR target of {}: choose rgba16f", settings.hdr_format));
    }
    Ok(())
}

impl ReflectionPlan {
    /// Returns `None` if no surface mirrors others.
    pub(super) fn of(request: &EffectRequest) -> Option<Self> {
        let settings = request.settings;
        is_used(request.scene, settings).then_some(Self {
            roughness: settings.reflection_roughness,
            steps: settings.reflection_steps,
            thickness: settings.reflection_thickness,
            shown: settings.view == View::Reflections,
        })
    }
}

fn shows(view: View) -> bool {
    matches!(view, View::Final | View::Ambient | View::Reflections)
}

/// Returns true if some surface mirrors others.
fn is_used(scene: &Scene, settings: &Settings) -> bool {
    let mirrors = |object: &Object| {
        let material = &scene.materials[object.material];
        let may_be_smooth = material.texture(TextureSlot::MetallicRoughness).is_some()
            || material.roughness <= settings.reflection_roughness;
        let has_lobe = material.model(settings.brdf) == Brdf::CookTorrance && !material.unlit;
        has_lobe && may_be_smooth && !material.is_transparent()
    };
    settings.reflections != Reflections::Off && shows(settings.view) && scene.objects.iter().any(mirrors)
}

impl FramePlan {
    /// Returns true if surfaces mirror others as the picture shows them.
    pub fn reflects(&self) -> bool {
        self.effects.reflections.is_some()
    }
}
