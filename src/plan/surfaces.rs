//! What the surfaces of a scene ask of its frames.

use std::collections::BTreeSet;

use super::EffectiveMaterials;
use crate::scene::{Brdf, Material, Object, Scene, Settings};

/// Which reflection models LIGHTING evaluates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannedBrdf {
    /// The same for all materials, so a constant.
    One(Brdf),
    /// Stored for each pixel.
    PerPixel,
}

impl PlannedBrdf {
    /// As the shaders' constant BRDF has it (`shaders/shared/shading.wgsl`).
    pub fn constant(self) -> u32 {
        match self {
            Self::One(brdf) => brdf as u32,
            Self::PerPixel => 4,
        }
    }
}

/// What a plan must know of the surfaces that can be drawn.
pub(super) struct Surfaces {
    /// Of the opaque ones, as all below but the first.
    pub brdf: PlannedBrdf,
    pub transparent: bool,
    pub emissive: bool,
    pub metal: bool,
    pub transparent_metal: bool,
    /// Somewhere the normal of the surface is not that of its shading, or no shadow falls, which is stored in its place.
    pub two_normals: bool,
}

impl Surfaces {
    pub(super) fn of(scene: &Scene, materials: &EffectiveMaterials, settings: &Settings) -> Self {
        let material = |object: &Object| &materials.all[object.material];
        let (transparent, opaque): (Vec<_>, Vec<_>) =
            scene.objects.iter().partition(|object| material(object).is_transparent());
        let brdf = |material: &Material| settings.brdf.unwrap_or(material.brdf);
        let metal = |material: &Material| brdf(material) == Brdf::CookTorrance && material.metallic > 0.0;
        let any = |what: &dyn Fn(&Material) -> bool| opaque.iter().any(|object| what(material(object)));
        Self {
            brdf: planned_brdf(opaque.iter().map(|object| brdf(material(object)))),
            transparent: !transparent.is_empty(),
            emissive: any(&Material::is_emissive),
            metal: any(&metal),
            transparent_metal: transparent.iter().any(|object| metal(material(object))),
            two_normals: any(&|material| material.normal_texture.is_some())
                || opaque.iter().any(|object| !object.receives_shadow),
        }
    }
}

fn planned_brdf(all: impl Iterator<Item = Brdf>) -> PlannedBrdf {
    let distinct: BTreeSet<Brdf> = all.collect();
    match distinct.len() {
        0 => PlannedBrdf::One(Brdf::Lambert),
        1 => PlannedBrdf::One(*distinct.first().expect("there is one")),
        _ => PlannedBrdf::PerPixel,
    }
}
