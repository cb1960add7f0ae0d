//! Lobes of materials beside base and highlight, as a sheen: the G-buffer has no room for their values, so that surfaces with them are lit once more, as they are drawn.

use std::collections::BTreeSet;

use glam::Vec3;

use crate::plan::effect::{Effect, EffectRequest, LightReaders, Variation};
use crate::plan::parts::part;
use crate::plan::surfaces::lobes_are_drawn;
use crate::plan::{FramePlan, PartGroup, Shading, SurfaceRules};
use crate::scene::{Anisotropy, Brdf, DiffuseTransmission, Scene, Settings, Sheen, ThinFilm, counted};
use crate::shaders::shared::lobes::SHEEN_SHARES;

/// The name of its line in `inspect`.
const LINE: &str = "lobes of materials";

/// Materials scatter light otherwise than by base and highlight.
pub(crate) const EFFECT: Effect = Effect {
    name: "lobes of materials",
    is_plural: true,
    is_asked_for: |scene, settings| has_some(scene, settings),
    not_by_compute: Some("they cannot draw lobes of materials"),
    is_in: |plans| plans.lobes.is_some(),
    needs_light_buffer: LightReaders::AsDrawn,
    // Rows, and the picture behind glass, which the same shaders name.
    frame_buffers: |plan| 2 * u32::from(plan.effects.lobes.is_some()),
    absence: |own| if has_some(own.scene, own.planned) { "this view needs none" } else { "no material has one" },
    check: |request| match lobes_are_drawn(request.shading, request.settings.textbook) {
        true if has_some(request.scene, request.settings) => EFFECT.check_path(request.path),
        _ => Ok(()),
    },
    parts: |_, _, plan| {
        let reason = match &plan.effects.lobes {
            Some(own) => {
                let who = if plan.is_forward() { "FORWARD draws" } else { "LOBES lights once more" };
                format!("{who} what has them: {}", counted(own.materials.len(), "material"))
            }
            None => plan.reasons.lack_of(EFFECT.name).into(),
        };
        let bytes = plan.effects.lobes.as_ref().map_or(0, LobesPlan::bytes);
        vec![part(LINE, plan.effects.lobes.is_some(), reason, 2 * bytes).of(PartGroup::Lights)]
    },
    variations: &[
        Variation::with("with a sheen", dress_in_velvet, |_| {}),
        Variation::with("under thin films", lay_films, |_| {}),
        Variation::with("with grooves", brush, |_| {}),
        Variation::with("letting light through", make_leaves, |_| {}),
    ],
    ..Effect::PLAIN
};

fn dress_in_velvet(scene: &mut Scene) {
    let sheen = Sheen { color: Vec3::new(0.9, 0.5, 0.7), roughness: 0.4 };
    for material in &mut scene.materials {
        material.sheen = sheen;
        // A matt one has no lobe.
        if material.brdf == Brdf::Lambert {
            material.brdf = Brdf::CookTorrance;
        }
    }
}

fn brush(scene: &mut Scene) {
    let anisotropy = Anisotropy { strength: 0.75, rotation: 0.5 };
    scene.materials.iter_mut().for_each(|material| material.anisotropy = anisotropy);
}

fn make_leaves(scene: &mut Scene) {
    let diffuse_transmission = DiffuseTransmission { strength: 0.5, color: Vec3::new(0.6, 0.8, 0.2) };
    scene.materials.iter_mut().for_each(|material| material.diffuse_transmission = diffuse_transmission);
}

fn lay_films(scene: &mut Scene) {
    let film = ThinFilm { strength: 0.75, ior: 1.4, nanometres: [200.0, 500.0] };
    scene.materials.iter_mut().for_each(|material| material.film = film);
}

/// Returns true if an object of the scene wears a material that has a lobe, drawn with the model of the settings.
fn has_some(scene: &Scene, settings: &Settings) -> bool {
    let has = |material: usize| {
        let material = &scene.materials[material];
        material.has_lobes(material.model(settings.brdf))
    };
    !settings.textbook && scene.objects.iter().any(|object| has(object.material))
}

/// The materials with lobes of a plan's frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LobesPlan {
    /// Indices into the scene's materials, in the order of their rows in the frame's buffer.
    pub materials: Vec<usize>,
}

impl LobesPlan {
    /// Returns `None` if no drawn material has a lobe.
    pub(super) fn of(request: &EffectRequest, rules: &SurfaceRules) -> Option<Self> {
        let Shading::Light { .. } = request.shading else { return None };
        let drawn = rules.drawn(request.scene);
        let materials = drawn.filter(|object| !rules.lobes_of(rules.material(object)).is_empty());
        let materials: BTreeSet<usize> = materials.map(|object| object.material).collect();
        (!materials.is_empty()).then(|| Self { materials: materials.into_iter().collect() })
    }

    /// Bytes of the buffer of one frame: the table of shares, and 28 floats a material.
    pub fn bytes(&self) -> u64 {
        4 * u64::from(SHEEN_SHARES) + 112 * self.materials.len() as u64
    }

    /// The row of a material.
    pub fn row(&self, material: usize) -> Option<u32> {
        self.materials.binary_search(&material).ok().map(|row| row as u32)
    }
}

impl FramePlan {
    /// Returns true if LOBES lights surfaces of the G-buffer once more.
    pub fn relights(&self) -> bool {
        !self.lobes.is_empty()
    }
}
