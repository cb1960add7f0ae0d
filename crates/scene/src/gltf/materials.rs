//! Reads metallic-roughness materials, with the extensions that are drawn.

use std::collections::BTreeSet;

use glam::{DVec2, Vec3};

use super::json::{Document, Material as JsonMaterial, TextureInfo, Whole, named};
use super::json_extensions::{Clearcoat, SpecularGlossiness, Transmission};
use super::movement::Movement;
use super::textures::{ImageWithFallback, Recipe, TextureRequest, picture};
use crate::{AlphaMode, ColorSpace, Material, MaterialValue, Sampler, TextureSlot, UvMap, Wrap};

/// The largest number in a texture's transform.
const MOST_MOVED: f64 = 1e15;

/// A material of the file, or the default one of primitives without a material, as it is drawn.
#[derive(Debug, Default)]
pub(super) struct DrawnMaterial {
    pub base: Pending,
    /// The clear coat on it.
    pub coat: Option<Pending>,
    /// The sets of texture coordinates that become a mesh's first and second.
    pub uv_sets: [Option<usize>; 2],
    /// True for each set of coordinates from which whole repeats may be taken off.
    pub repeats: [bool; 2],
    /// True if a normal map or an anisotropy needs tangents.
    pub tangents: bool,
    /// True if the material is anisotropic.
    pub anisotropic: bool,
}

/// A material whose textures are still to be made.
#[derive(Debug, Default)]
pub(super) struct Pending {
    pub material: Material,
    pub requests: Vec<(TextureSlot, TextureRequest)>,
}

/// Reads a material; `None` is the default one.
pub(super) fn read(
    document: &Document,
    index: Option<usize>,
    movement: &Movement,
    warnings: &mut Vec<String>,
) -> DrawnMaterial {
    let plain = JsonMaterial::default();
    let json = index.and_then(|index| document.materials.get(index)).unwrap_or(&plain);
    let name = index.map_or("the default material".into(), |index| named("material", index, json.name.as_ref()));
    let nothing = BTreeSet::new();
    let moving = index.and_then(|index| movement.materials.get(&index)).unwrap_or(&nothing);
    let mut reader = MaterialBuilder { document, json, moving, warnings: Vec::new(), used: Vec::new() };
    let mut dress = DrawnMaterial::default();
    dress.base.material = reader.factors(index);
    reader.textures(&mut dress.base);
    reader.lobes(&mut dress.base);
    if let Some(own) = &json.extensions.clearcoat {
        if own.clearcoat_factor > 0.0 {
            dress.coat = Some(reader.coat(own, &dress.base.material));
        } else {
            reader.share("clearcoatFactor", own.clearcoat_factor);
        }
    }
    reader.map_sets(&mut dress);
    let mut told = BTreeSet::new();
    reader.warnings.retain(|what| told.insert(what.clone()));
    warnings.extend(reader.warnings.iter().map(|what| format!("{name}: {what}")));
    dress
}

/// A texture in use: its set of coordinates and its placement on them.
struct Used {
    set: usize,
    map: UvMap,
    sampler: Sampler,
    slot: TextureSlot,
    /// True if clips turn or scale it.
    moves: bool,
}

pub(super) struct MaterialBuilder<'a> {
    pub document: &'a Document,
    pub json: &'a JsonMaterial,
    /// The material's values that clips change.
    moving: &'a BTreeSet<MaterialValue>,
    pub warnings: Vec<String>,
    used: Vec<Used>,
}

impl MaterialBuilder<'_> {
    /// Clamps a number to its range, as the nearest f32.
    pub(super) fn number(&mut self, what: &str, value: f64, least: f64, most: f64) -> f32 {
        if !(least..=most).contains(&value) {
            self.warnings.push(format!("its {what} is {value}, not from {least} to {most}, taken for the nearest"));
        }
        value.clamp(least, most) as f32
    }

    pub(super) fn share(&mut self, what: &str, value: f64) -> f32 {
        self.number(what, value, 0.0, 1.0)
    }

    pub(super) fn color(&mut self, what: &str, value: [f64; 3]) -> Vec3 {
        Vec3::from(value.map(|channel| self.share(what, channel)))
    }

    fn factors(&mut self, index: Option<usize>) -> Material {
        let json = self.json;
        let pbr = &json.pbr_metallic_roughness;
        let glossy = json.extensions.glossy.as_ref();
        let (metallic, roughness) = match glossy {
            Some(own) => (0.0, 1.0 - self.gloss(own)),
            None => (
                self.share("metallicFactor", pbr.metallic_factor.unwrap_or(1.0)),
                self.share("roughnessFactor", pbr.roughness_factor.unwrap_or(1.0)),
            ),
        };
        let color = glossy.map_or(pbr.base_color_factor, |own| own.diffuse_factor);
        let [red, green, blue, alpha] = color.unwrap_or([1.0; 4]);
        let fallback = || index.map_or("default".into(), |index| format!("material {index}"));
        let (alpha_mode, alpha) = self.alpha(alpha);
        let (reflectance, grazing) = self.reflectance();
        Material {
            name: json.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(fallback),
            base_color: self.color("base colour", [red, green, blue]),
            alpha,
            alpha_mode,
            metallic,
            roughness,
            reflectance,
            grazing,
            emissive: self.emissive(),
            normal_scale: json
                .normal_texture
                .as_ref()
                .and_then(|own| own.scale)
                .map_or(1.0, |scale| self.number("normal scale", scale, f64::from(-1e6f32), f64::from(1e6f32))),
            two_sided: json.double_sided,
            unlit: json.extensions.unlit.is_some(),
            ..Material::default()
        }
    }

    fn alpha(&mut self, factor: f64) -> (AlphaMode, f32) {
        let json = self.json;
        let alpha = self.share("alpha", factor);
        let glass = json.extensions.transmission.as_ref().filter(|own| own.transmission_factor > 0.0);
        let named = json.alpha_mode.as_deref().unwrap_or("OPAQUE");
        let mode = match named.trim().to_ascii_uppercase().as_str() {
            "MASK" => {
                let cutoff = json.alpha_cutoff.unwrap_or(0.5);
                if cutoff > 1.0 {
                    // No alpha reaches it (glTF 2.0, "Alpha Coverage").
                    self.warnings.push(format!("its alphaCutoff is {cutoff}, above 1: nothing of it is seen"));
                    return (AlphaMode::Mask { cutoff: 1.0 }, 0.0);
                }
                AlphaMode::Mask { cutoff: self.share("alphaCutoff", cutoff) }
            }
            "BLEND" => AlphaMode::Blend,
            "OPAQUE" => AlphaMode::Opaque,
            _ => {
                self.warnings.push(format!("its alpha mode `{}` is unknown, drawn opaque", named.escape_debug()));
                AlphaMode::Opaque
            }
        };
        match (mode, glass) {
            (AlphaMode::Opaque | AlphaMode::Blend, Some(glass)) => {
                self.share("transmissionFactor", glass.transmission_factor);
                let body = if mode == AlphaMode::Blend { alpha } else { 1.0 };
                (AlphaMode::Glass, body * held_back(glass) as f32)
            }
            (AlphaMode::Opaque, None) => (mode, 1.0),
            _ => (mode, alpha),
        }
    }

    /// The reflectances of a dielectric at normal and at grazing incidence (KHR_materials_ior, KHR_materials_specular).
    fn reflectance(&mut self) -> (Vec3, f32) {
        let extensions = &self.json.extensions;
        if let Some(own) = &extensions.glossy {
            return (self.color("specularFactor", own.specular_factor.unwrap_or([1.0; 3])), 1.0);
        }
        let ior = extensions.ior.as_ref().and_then(|own| own.ior).unwrap_or(1.5);
        // An index of 0 means infinity, for materials converted from specular-glossiness.
        let straight = if ior == 0.0 { 1.0 } else { ((ior - 1.0) / (ior + 1.0)).powi(2) };
        let is_index = (1.0..=f64::MAX).contains(&ior) || ior == 0.0;
        if !is_index {
            self.warnings.push(format!("its ior is {ior}, below 1, taken for 1.5"));
        }
        let straight = if is_index { straight } else { 0.04 };
        let specular = extensions.specular.as_ref();
        let color = specular.and_then(|own| own.specular_color_factor).unwrap_or([1.0; 3]);
        let strength = specular.and_then(|own| own.specular_factor).unwrap_or(1.0);
        let strength = self.share("specularFactor", strength);
        if color.iter().any(|channel| *channel < 0.0) {
            self.warnings.push("its specularColorFactor is negative, taken for 0".into());
        }
        // The result equals the default exactly if neither extension is given.
        let reflectance = color.map(|channel| (straight * channel.max(0.0)).min(1.0) as f32 * strength);
        (Vec3::from(reflectance), strength)
    }

    fn emissive(&mut self) -> Vec3 {
        let extension = self.json.extensions.emissive.as_ref();
        let strength = extension.and_then(|own| own.emissive_strength).unwrap_or(1.0);
        let strength = self.number("emissiveStrength", strength, 0.0, f64::from(1e30f32));
        self.color("emissiveFactor", self.json.emissive_factor) * strength
    }

    fn gloss(&mut self, own: &SpecularGlossiness) -> f32 {
        self.share("glossinessFactor", own.glossiness_factor.unwrap_or(1.0))
    }

    /// Requests a texture for a slot, from the picture that a texture info names.
    pub(super) fn ask(
        &mut self,
        pending: &mut Pending,
        slot: TextureSlot,
        info: &TextureInfo,
        recipe: impl FnOnce(ImageWithFallback) -> Recipe,
    ) {
        let Some((found, sampler)) = picture(self.document, info.index, &mut self.warnings) else { return };
        let transform = info.extensions.transform.as_ref();
        let set = transform.and_then(|own| own.tex_coord).unwrap_or(info.tex_coord).0;
        let map = UvMap {
            set: 0,
            offset: transform.and_then(|own| own.offset).map_or(DVec2::ZERO, DVec2::from),
            rotation: transform.and_then(|own| own.rotation).unwrap_or(0.0),
            scale: transform.and_then(|own| own.scale).map_or(DVec2::ONE, DVec2::from),
        };
        let numbers = [map.offset.x, map.offset.y, map.scale.x, map.scale.y, map.rotation];
        let map = if numbers.iter().all(|number| number.abs() <= MOST_MOVED) {
            map
        } else {
            self.warnings
                .push(format!("a transform of its {slot:?} texture is not from -1e15 to 1e15, taken for none"));
            UvMap::IDENTITY
        };
        pending.material.uv_maps[slot as usize] = UvMap { set: u8::try_from(set).unwrap_or(u8::MAX), ..map };
        pending.requests.push((slot, TextureRequest { recipe: recipe(found), sampler }));
        let number = slot as u8;
        let turns = [MaterialValue::UvRotation(number), MaterialValue::UvScale(number)];
        let moves = turns.iter().any(|value| self.moving.contains(value));
        self.used.push(Used { set, map, sampler, slot, moves });
    }

    fn textures(&mut self, pending: &mut Pending) {
        let json = self.json;
        self.base_color(pending);
        if let Some(info) = &json.normal_texture {
            self.ask(pending, TextureSlot::Normal, info, |own| Recipe::Plain(own, ColorSpace::Linear));
        }
        if let Some(own) = &json.extensions.glossy {
            self.glossiness(pending, own);
        } else if let Some(info) = &json.pbr_metallic_roughness.metallic_roughness_texture {
            let plain = |own| Recipe::Plain(own, ColorSpace::Linear);
            self.ask(pending, TextureSlot::MetallicRoughness, info, plain);
        }
        if let Some(info) = &json.occlusion_texture {
            let strength = f64::from(self.share("occlusion strength", info.strength.unwrap_or(1.0)));
            // An occlusion strength of 0 has no effect.
            if strength > 0.0 {
                self.ask(pending, TextureSlot::Occlusion, info, |own| match strength {
                    1.0 => Recipe::Plain(own, ColorSpace::Linear),
                    _ => Recipe::Occlusion(own, strength.to_bits()),
                });
            }
        }
        let glows = pending.material.is_emissive() || self.moving.contains(&MaterialValue::Emissive);
        if let Some(info) = json.emissive_texture.as_ref().filter(|_| glows) {
            self.ask(pending, TextureSlot::Emissive, info, |own| Recipe::Plain(own, ColorSpace::Srgb));
        }
        if json.extensions.glossy.is_none() {
            self.specular(pending);
        }
    }

    /// The texture of KHR_materials_pbrSpecularGlossiness: its colour is the reflectance, and its alpha, the glossiness, becomes the roughness.
    fn glossiness(&mut self, pending: &mut Pending, own: &SpecularGlossiness) {
        let Some(info) = &own.specular_glossiness_texture else { return };
        let factor = f64::from(self.gloss(own)).to_bits();
        self.ask(pending, TextureSlot::Specular, info, |own| Recipe::Specular { color: Some(own), strength: None });
        let before = pending.requests.len();
        self.ask(pending, TextureSlot::MetallicRoughness, info, |own| Recipe::Gloss(own, factor));
        if pending.requests.len() > before {
            // The texture already includes the factor.
            pending.material.roughness = 1.0;
        }
    }

    fn base_color(&mut self, pending: &mut Pending) {
        let json = self.json;
        let color = match &json.extensions.glossy {
            Some(own) => own.diffuse_texture.as_ref(),
            None => json.pbr_metallic_roughness.base_color_texture.as_ref(),
        };
        let glass = json.extensions.transmission.as_ref().filter(|_| pending.material.alpha_mode == AlphaMode::Glass);
        let through = glass.and_then(|own| Some((own.transmission_texture.as_ref()?, own.transmission_factor)));
        let Some((info, factor)) = through else {
            let Some(info) = color else { return };
            return self.ask(pending, TextureSlot::BaseColor, info, |own| Recipe::Plain(own, ColorSpace::Srgb));
        };
        let factor = factor.clamp(0.0, 1.0).to_bits();
        let base = color.and_then(|info| picture(self.document, info.index, &mut self.warnings));
        if color.is_some_and(|color| !lie_alike(color, info)) {
            let what = "its textures of colour and of transmission lie differently, drawn as that of transmission lies";
            self.warnings.push(what.into());
        }
        let color = base.map(|(picture, _)| picture);
        self.ask(pending, TextureSlot::BaseColor, info, |transmission| Recipe::Glass { color, transmission, factor });
    }

    /// The colour and the strength of a dielectric's specular reflection, as one texture.
    fn specular(&mut self, pending: &mut Pending) {
        let Some(own) = &self.json.extensions.specular else { return };
        let textures = (own.specular_color_texture.as_ref(), own.specular_texture.as_ref());
        self.color_and_share(
            pending,
            TextureSlot::Specular,
            textures,
            "specularTexture lies otherwise than specularColorTexture",
        );
    }

    /// Reads KHR_materials_clearcoat as a separate material, for a second object in the same place.
    fn coat(&mut self, json: &Clearcoat, base: &Material) -> Pending {
        let normal_scale = json.clearcoat_normal_texture.as_ref().and_then(|own| own.scale).unwrap_or(1.0);
        let material = Material {
            name: format!("{} (coat)", base.name),
            base_color: Vec3::ONE,
            alpha: self.share("clearcoatFactor", json.clearcoat_factor),
            alpha_mode: AlphaMode::Coat,
            roughness: self.share("clearcoatRoughnessFactor", json.clearcoat_roughness_factor),
            normal_scale: self.number("clearcoat normal scale", normal_scale, -1e6, 1e6),
            two_sided: base.two_sided,
            ..Material::default()
        };
        let mut pending = Pending { material, ..Pending::default() };
        if let Some(info) = &json.clearcoat_texture {
            self.ask(&mut pending, TextureSlot::BaseColor, info, Recipe::Coat);
        }
        if let Some(info) = &json.clearcoat_roughness_texture {
            let plain = |own| Recipe::Plain(own, ColorSpace::Linear);
            self.ask(&mut pending, TextureSlot::MetallicRoughness, info, plain);
        }
        if let Some(info) = &json.clearcoat_normal_texture {
            self.ask(&mut pending, TextureSlot::Normal, info, |own| Recipe::Plain(own, ColorSpace::Linear));
        }
        pending
    }

    /// Decides which sets of texture coordinates of the file become a mesh's two. The normal map's set comes first, since tangents follow it. If
    /// there are more than two, the sets of colour and emission come next.
    fn map_sets(&mut self, dress: &mut DrawnMaterial) {
        let mut sets: Vec<usize> =
            self.used.iter().filter(|used| along_tangents(used.slot)).map(|used| used.set).take(1).collect();
        let all: BTreeSet<usize> = self.used.iter().map(|used| used.set).collect();
        if all.len() > 2 {
            let most_seen = [TextureSlot::BaseColor, TextureSlot::Emissive];
            sets.extend(
                most_seen
                    .iter()
                    .flat_map(|slot| self.used.iter().filter(|used| used.slot == *slot))
                    .map(|used| used.set),
            );
        }
        sets.extend(&all);
        let mut seen = BTreeSet::new();
        sets.retain(|set| seen.insert(*set));
        if let [a, b, _, ..] = sets[..] {
            let named: Vec<String> = all.iter().map(ToString::to_string).collect();
            let others = self.used.iter().filter(|used| used.set != a && used.set != b);
            let others: Vec<String> = others.map(|used| format!("{:?}", used.slot)).collect();
            let what = if others.len() == 1 { "texture lies" } else { "textures lie" };
            let (all, others) = (named.join(", "), others.join(", "));
            self.warnings.push(format!(
                "its textures use the sets {all} of texture coordinates, of which {a} and {b} are read: its {others} {what} on set {a} instead"
            ));
        }
        dress.uv_sets = [sets.first().copied(), sets.get(1).copied()];
        for (slot, repeats) in dress.repeats.iter_mut().enumerate() {
            let own = self.used.iter().filter(|used| Some(used.set) == dress.uv_sets[slot]);
            *repeats = own.into_iter().all(Used::repeats);
        }
        dress.anisotropic = dress.base.material.anisotropy.is_seen();
        dress.tangents = dress.anisotropic || self.used.iter().any(|used| used.slot == TextureSlot::Normal);
        for Pending { material, requests } in [Some(&mut dress.base), dress.coat.as_mut()].into_iter().flatten() {
            for (slot, _) in requests {
                let map = &mut material.uv_maps[*slot as usize];
                map.set = u8::from(dress.uv_sets[1] == Some(usize::from(map.set)));
            }
        }
    }
}

/// Returns true if a slot's texture is defined in tangent space.
fn along_tangents(slot: TextureSlot) -> bool {
    matches!(slot, TextureSlot::Normal | TextureSlot::Anisotropy)
}

impl Used {
    /// Returns true if coordinates that are a whole number larger show the same texels.
    fn repeats(&self) -> bool {
        let UvMap { rotation, scale, .. } = self.map;
        !self.moves && self.sampler.wrap == [Wrap::Repeat; 2] && rotation == 0.0 && scale == scale.round()
    }
}

/// The share of light that glass does not transmit. A transmission texture contains the factor in its texels.
pub(super) fn held_back(glass: &Transmission) -> f64 {
    if glass.transmission_texture.is_some() { 1.0 } else { 1.0 - glass.transmission_factor.clamp(0.0, 1.0) }
}

/// Returns true if two textures have the same placement on a mesh, so that their texels can be merged.
pub(super) fn lie_alike(a: &TextureInfo, b: &TextureInfo) -> bool {
    let of = |info: &TextureInfo| {
        let own = info.extensions.transform.clone().unwrap_or_default();
        let set: Whole = own.tex_coord.unwrap_or(info.tex_coord);
        (set, own.offset.unwrap_or([0.0; 2]), own.rotation.unwrap_or(0.0), own.scale.unwrap_or([1.0; 2]))
    };
    of(a) == of(b)
}
