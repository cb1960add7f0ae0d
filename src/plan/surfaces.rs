//! The demands of a scene's surfaces on its frames, and their data on the device: materials, pipelines, meshes, textures.

pub(super) mod anisotropy;
mod deforms;
mod lobes;
mod materials;
mod meshes;
mod numbering;
mod pipelines;
mod rules;
mod textures;
mod uploads;

use std::collections::BTreeSet;

pub use deforms::{DeformPlan, PlannedDeform};
pub use lobes::LobeMask;
pub(in crate::plan) use lobes::are_drawn as lobes_are_drawn;
pub use materials::EffectiveMaterials;
pub use meshes::{IndexWidth, MeshPlan, PlannedLevel, PlannedMesh};
pub use numbering::NumberedMesh;
pub use pipelines::{Extras, ForwardKey, GeometryKey, Opacity, Streams, TextureMask};
pub(crate) use rules::{Cuts, SurfaceRules};
pub use textures::{PlannedTexture, SetSamplers, TexturePlan, TextureSource, texture_format};
pub use uploads::Uploads;

use super::{Capabilities, FramePlan, PlanError, Refusal, RefusalReason, is_tiled, lacks_gbuffer};
use crate::scene::{Brdf, LightPath, Material, Object, OptionalPart, Scene, Settings, Transparency, View};
use crate::shaders::shared::shading::MIXED_BRDF;

/// The reflection models that LIGHTING evaluates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlannedBrdf {
    /// One model for all materials, so a constant.
    One(Brdf),
    /// Stored for each pixel.
    PerPixel,
}

impl PlannedBrdf {
    /// As the shaders' constant BRDF has it.
    pub fn constant(self) -> u32 {
        match self {
            Self::One(brdf) => brdf as u32,
            Self::PerPixel => MIXED_BRDF,
        }
    }
}

/// The choices for the surfaces that can be drawn.
pub(super) struct SurfacePlan {
    pub materials: EffectiveMaterials,
    pub brdf: PlannedBrdf,
    pub emissive: bool,
    /// Some opaque Cook-Torrance surface reflects otherwise than a usual dielectric.
    pub reflectance: bool,
    pub transparency: Option<Transparency>,
    pub metal: bool,
    /// Some metal is in the G-buffer.
    pub opaque_metal: bool,
    /// Some geometric normal differs from the shading normal, or some surface receives no shadows, which is stored in the same channels.
    pub two_normals: bool,
}

impl SurfacePlan {
    pub(super) fn of(scene: &Scene, settings: &Settings, path: LightPath) -> Result<Self, PlanError> {
        let (keep, is_final, tiled) = (settings.keep, settings.view == View::Final, is_tiled(path));
        let materials = EffectiveMaterials::of(scene, settings);
        let material = |object: &Object| &materials.all[object.material];
        let (transparent, opaque): (Vec<_>, Vec<_>) =
            scene.objects.iter().partition(|object| material(object).is_transparent());
        if tiled && is_final && !transparent.is_empty() {
            let (what, why) = ("transparent surfaces", RefusalReason::WritesPicture(path));
            return Err(PlanError::Refused(Refusal { what, why }));
        }
        let brdf = |material: &Material| material.model(settings.brdf);
        let metal = |object: &&Object| brdf(material(object)) == Brdf::CookTorrance && material(object).metallic > 0.0;
        let any = |what: &dyn Fn(&Material) -> bool| opaque.iter().any(|object| what(material(object)));
        let blends = is_final
            && !tiled
            && (!transparent.is_empty()
                || super::effects::asked_for(scene, settings).any(|effect| effect.blended.is_some())
                || keep.has(OptionalPart::Transparent));
        let opaque_metal = opaque.iter().any(metal);
        let per_pixel = keep.has(OptionalPart::BrdfByPixel);
        Ok(Self {
            brdf: match per_pixel {
                true => PlannedBrdf::PerPixel,
                false => planned_brdf(opaque.iter().map(|object| brdf(material(object)))),
            },
            // Where there is no G-buffer, emitted light is added as surfaces are lit.
            emissive: !lacks_gbuffer(path)
                && settings.view.shows_emission()
                && (any(&Material::is_emissive) || keep.has(OptionalPart::Emissive)),
            reflectance: any(&|own| brdf(own) == Brdf::CookTorrance && own.has_reflectance()),
            transparency: blends.then_some(settings.transparency),
            metal: opaque_metal || blends && transparent.iter().any(metal) || keep.has(OptionalPart::MetallicChannel),
            opaque_metal,
            two_normals: any(&|material| material.normal_texture.is_some())
                || opaque.iter().any(|object| !object.receives_shadow),
            materials,
        })
    }
}

/// Textures, and their filtering.
pub(super) struct FilteredTextures {
    pub textures: TexturePlan,
    pub anisotropy: u32,
    pub places_by_shaders: bool,
    pub footprint: f32,
    pub warning: Option<String>,
}

impl FilteredTextures {
    pub(super) fn of(scene: &Scene, settings: &Settings, device: &Capabilities, rules: &SurfaceRules) -> Self {
        let degree = anisotropy::degree(settings, device);
        let textures = TexturePlan::of(scene, rules, device);
        let have_levels = textures.have_levels();
        let used = if have_levels { degree } else { 1 };
        Self {
            anisotropy: used,
            places_by_shaders: used > 1 && anisotropy::by_shaders(scene, device, rules.looked_up),
            footprint: if have_levels { anisotropy::footprint(settings) } else { 1.0 },
            warning: anisotropy::warning(settings, device, degree).filter(|_| have_levels),
            textures,
        }
    }
}

impl FramePlan {
    /// Maximum anisotropy in shaders: texture samples per pixel; 1 if samplers filter.
    pub fn places_of_shaders(&self) -> u32 {
        if self.places_by_shaders { self.anisotropy } else { 1 }
    }

    /// Maximum anisotropy of samplers; 1 if shaders filter.
    pub fn places_of_samplers(&self) -> u32 {
        if self.places_by_shaders { 1 } else { self.anisotropy }
    }

    /// Returns true if drawn instances have looks.
    pub fn has_looks(&self) -> bool {
        self.keys().any(|key| key.extras.looks)
    }

    /// Returns true if atlas cells cut the holes in shadows.
    pub fn has_caster_looks(&self) -> bool {
        self.textures.holes.values().any(|&image| self.textures.images[image].cells.is_some())
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
