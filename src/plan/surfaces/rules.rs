//! The objects of a scene that are drawn, and their parts: the rules from which pipelines, meshes and textures follow.

use std::collections::BTreeSet;

use super::{EffectiveMaterials, Extras, ForwardKey, GeometryKey, SurfacePlan, lobes};
use crate::plan::lights::LightingPlan;
use crate::plan::{FramePlan, Shading, ShadowPlan, is_tiled, lacks_gbuffer};
use crate::scene::{
    AlphaMode, Brdf, CastsShadow, Keep, LightPath, Material, Object, Scene, Settings, TextureSlot, Transparency, UvMap,
};

/// The decisions of a plan before its pipelines, meshes and textures.
#[derive(Clone, Copy)]
pub(crate) struct SurfaceRules<'a> {
    pub materials: &'a EffectiveMaterials,
    pub shading: Shading,
    /// There is no G-buffer: surfaces are lit as they are drawn, or looked up.
    pub forward: bool,
    /// Surfaces are looked up.
    pub looked_up: bool,
    /// The shadow maps, if the plan has any.
    pub shadow: Option<&'a ShadowPlan>,
    pub emissive: bool,
    /// The G-buffer has the reflectance of Cook-Torrance surfaces.
    pub reflectance: bool,
    pub ambient: bool,
    /// Lobes beside base and highlight are drawn.
    pub lobes: bool,
    pub transparency: Option<Transparency>,
    pub brdf_override: Option<Brdf>,
    /// The greatest error of levels of detail, in pixels; 0 without levels.
    pub lod: f32,
    pub keep: Keep,
}

/// The parts of a caster's material that differ from place to place: the holes of a mask, or the colour and alpha of a surface that lets light through.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cuts {
    /// The texture whose alpha counts, and whose colour where light is let through; none where vertices alone differ.
    pub texture: Option<usize>,
    pub extras: Extras,
}

/// The pipelines that draw a scene.
pub(in crate::plan) struct Pipelines {
    pub geometry: BTreeSet<GeometryKey>,
    pub lobes: BTreeSet<GeometryKey>,
    pub transparent: BTreeSet<GeometryKey>,
    pub transparent_triangles: u32,
}

impl<'a> SurfaceRules<'a> {
    pub(in crate::plan) fn of(
        settings: &Settings,
        shading: Shading,
        lighting: &LightingPlan,
        shadow: Option<&'a ShadowPlan>,
        surfaces: &'a SurfacePlan,
    ) -> Self {
        Self {
            materials: &surfaces.materials,
            shading,
            forward: lacks_gbuffer(lighting.path),
            looked_up: lighting.path == LightPath::Visibility,
            shadow,
            emissive: surfaces.emissive,
            reflectance: surfaces.reflectance,
            ambient: lighting.lights.ambient,
            lobes: lobes::are_drawn(shading, settings.textbook) && !is_tiled(lighting.path),
            transparency: surfaces.transparency,
            brdf_override: settings.brdf,
            // The triangles of levels are none of the scene's.
            lod: if shading == Shading::ShowTriangle { 0.0 } else { settings.lod },
            keep: settings.keep,
        }
    }

    pub fn material(&self, object: &Object) -> &Material {
        &self.materials.all[object.material]
    }

    pub fn brdf(&self, material: &Material) -> Brdf {
        material.model(self.brdf_override)
    }

    /// How an opaque surface of the G-buffer is lit once more, as it is drawn; `None` where LIGHTING's light is all.
    pub fn relit(&self, object: &Object) -> Option<ForwardKey> {
        let material = self.material(object);
        let is_stored = !self.forward && !material.is_transparent();
        (is_stored && !self.lobes_of(material).is_empty()).then(|| ForwardKey::of(material, self))
    }

    /// Returns true if GEOMETRY exists: all but the view of the shadow map.
    pub fn has_geometry(&self) -> bool {
        self.shading != Shading::ShowShadowMap
    }

    pub fn has_gbuffer(&self) -> bool {
        !self.forward && self.shading.reads_gbuffer()
    }

    /// Returns true if an object of the scene is in the world of the plan's frames.
    pub fn draws(&self, scene: &Scene, object: &Object) -> bool {
        let material = self.material(object);
        let left_out = material.is_transparent() && self.transparency.is_none();
        !self.is_cut_away(object) && !left_out && !scene.meshes[object.mesh].indices.is_empty()
    }

    pub fn drawn<'s>(&'s self, scene: &'s Scene) -> impl Iterator<Item = &'s Object> {
        scene.objects.iter().filter(|object| self.draws(scene, object))
    }

    /// Returns true if a pass draws an object's mesh.
    pub fn needs_mesh(&self, scene: &Scene, object: &Object) -> bool {
        let casts = self.shadow_of(object) != CastsShadow::No;
        self.draws(scene, object) && (self.has_geometry() || casts)
    }

    fn casts(&self, object: &Object) -> bool {
        self.shadow_of(object) != CastsShadow::No
    }

    /// How an object casts shadows into maps, as far as there are some.
    pub fn shadow_of(&self, object: &Object) -> CastsShadow {
        // Light goes through a surface that the eye looks through.
        let is_cast = !self.material(object).is_transparent() || self.is_veil(object);
        if self.shadow.is_some() && is_cast { object.casts_shadow } else { CastsShadow::No }
    }

    /// The texture through whose holes light falls past an object, in some shadow map.
    pub fn holes_of(&self, object: &Object) -> Option<usize> {
        self.cuts_of(object)?.texture
    }

    /// Returns the holes in an object's shadow, in some shadow map.
    pub fn cuts_of(&self, object: &Object) -> Option<Cuts> {
        Some(self.cuts(object)).filter(|cuts| self.casts(object) && cuts.any())
    }

    /// Returns the holes that its shadow would have.
    pub fn cuts(&self, object: &Object) -> Cuts {
        let material = self.material(object);
        // Light that is let through depends on the same texture and colours of vertices.
        let varies = material.is_masked() || self.is_veil(object);
        let texture = material.base_color_texture.filter(|_| varies);
        let map = material.uv_maps[TextureSlot::BaseColor as usize];
        let moving = self.materials.moving_maps.contains(&object.material);
        let cells = texture.is_some() && material.has_atlas();
        let extras = Extras {
            colors: varies && self.is_colored(object),
            colored_light: false,
            uv_maps: texture.is_some() && (moving || map != UvMap::IDENTITY),
            second_uvs: texture.is_some() && map.set == 1,
            looks: cells,
            cells,
            // They have no area, and cast no shadow.
            strokes: false,
        };
        Cuts { texture, extras }
    }

    /// Returns true if an object's mesh has colours that are not all white.
    pub fn is_colored(&self, object: &Object) -> bool {
        self.materials.colored.contains(&object.mesh)
    }

    /// Returns true if an object's mesh is points and lines.
    pub fn is_strokes(&self, object: &Object) -> bool {
        self.materials.strokes.contains(&object.mesh)
    }

    /// Returns true if a constant alpha makes the whole object invisible.
    fn is_cut_away(&self, object: &Object) -> bool {
        let material = self.material(object);
        match material.alpha_mode {
            AlphaMode::Mask { cutoff } => {
                let varies = material.base_color_texture.is_some() || self.is_colored(object);
                !varies && material.alpha < cutoff
            }
            // An alpha of 0 leaves these no highlight either, unlike glass.
            AlphaMode::Blend | AlphaMode::Coat => material.alpha <= 0.0,
            AlphaMode::Opaque | AlphaMode::Glass => false,
        }
    }

    /// Returns true if an object's triangles are sorted for each frame.
    pub fn sorts(&self, scene: &Scene, object: &Object) -> bool {
        let sorted = self.transparency == Some(Transparency::Sorted);
        sorted && self.material(object).is_transparent() && self.draws(scene, object)
    }

    pub(in crate::plan) fn pipelines(&self, scene: &Scene) -> Pipelines {
        let drawn = self.drawn(scene).filter(|_| self.has_geometry());
        let (transparent, opaque): (Vec<_>, Vec<_>) = drawn.partition(|object| self.material(object).is_transparent());
        let mirrors = scene.motion.mirrors();
        let keys = |objects: &[&Object], key: &dyn Fn(&Object) -> Option<GeometryKey>| -> BTreeSet<GeometryKey> {
            let both = |object: &&Object| {
                let Some(key) = key(object) else { return [None; 2] };
                let other = mirrors && object.moves();
                [Some(key), other.then_some(GeometryKey { mirrored: !key.mirrored, ..key })]
            };
            objects.iter().flat_map(both).flatten().collect()
        };
        let triangles: usize = transparent.iter().map(|object| scene.meshes[object.mesh].indices.len() / 3).sum();
        let own = |object: &Object| Some(GeometryKey::of(object, self));
        let relit = |object: &Object| GeometryKey::of(object, self).relit(self.relit(object));
        Pipelines {
            geometry: keys(&opaque, &own),
            lobes: keys(&opaque, &relit),
            transparent: keys(&transparent, &own),
            transparent_triangles: u32::try_from(triangles).unwrap_or(u32::MAX),
        }
    }
}

impl Cuts {
    pub fn any(self) -> bool {
        self.texture.is_some() || self.extras.colors
    }
}

impl FramePlan {
    pub(crate) fn surface_rules(&self) -> SurfaceRules<'_> {
        SurfaceRules {
            materials: &self.materials,
            shading: self.shading,
            forward: lacks_gbuffer(self.light_path),
            looked_up: self.triangles.is_some(),
            shadow: self.shadow.as_ref(),
            emissive: self.emissive,
            reflectance: self.reflectance,
            ambient: self.lights.ambient,
            lobes: self.effects.lobes.is_some(),
            transparency: self.transparency,
            brdf_override: self.brdf_override,
            lod: self.lod,
            keep: self.keep,
        }
    }
}
