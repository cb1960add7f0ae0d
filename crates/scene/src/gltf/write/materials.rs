//! Writes metallic-roughness materials, with the extensions that are drawn, so that the reader finds the same factors to the last bit.

use std::collections::HashMap;

use glam::{DVec2, Vec3};
use serde_json::{Value, json};

use super::expressible::power_of_two_above;
use super::images::{self, Channels, TextureForm};
use super::{DocumentBuilder, number, surfaces};
use crate::{
    AlphaMode, Anisotropy, DIELECTRIC, DiffuseTransmission, Error, Material, Refraction, Scene, Sheen, TextureSlot,
    ThinFilm, UvMap,
};

/// A material and the coat on it, by their indices in the scene.
pub(super) type CoatedMaterial = (usize, Option<usize>);

/// The materials of a file.
pub(super) struct MaterialTable {
    numbers: HashMap<CoatedMaterial, usize>,
    /// The material that each object wears; `None` for a coat, which is a part of the object before it.
    pub worn: Vec<Option<CoatedMaterial>>,
}

impl MaterialTable {
    /// Writes the materials that objects wear, with their textures.
    ///
    /// # Errors
    /// As [`images::write`].
    pub fn write(scene: &Scene, document: &mut DocumentBuilder) -> Result<Self, Error> {
        let is_coat = |index: usize| surfaces::is_coat(&scene.materials[scene.objects[index].material]);
        let worn: Vec<Option<CoatedMaterial>> = (0..scene.objects.len())
            .map(|index| {
                let coat = (index + 1 < scene.objects.len() && is_coat(index + 1)).then_some(index + 1);
                let material = |index: usize| scene.objects[index].material;
                (!is_coat(index)).then(|| (material(index), coat.map(material)))
            })
            .collect();
        let mut writer = Writer { scene, document, asked: Vec::new() };
        let mut numbers = HashMap::new();
        for &own in worn.iter().flatten() {
            numbers.entry(own).or_insert_with(|| {
                let material = writer.material(own);
                writer.document.push("materials", material)
            });
        }
        let asked = writer.asked;
        images::write(&scene.textures, &asked, document)?;
        Ok(Self { numbers, worn })
    }

    /// The number of a worn material in the file.
    pub fn number(&self, worn: CoatedMaterial) -> Option<usize> {
        self.numbers.get(&worn).copied()
    }
}

struct Writer<'a, 'b> {
    scene: &'a Scene,
    document: &'b mut DocumentBuilder,
    /// The texture forms that materials ask for, in the order of the file's textures.
    asked: Vec<TextureForm>,
}

impl Writer<'_, '_> {
    fn material(&mut self, (base, coat): CoatedMaterial) -> Value {
        let scene = self.scene;
        let material = &scene.materials[base];
        let [red, green, blue] = material.base_color.to_array().map(number);
        // Glass writes its alpha as transmission; without an alpha mode alpha is 1.
        let blends = matches!(material.alpha_mode, AlphaMode::Mask { .. } | AlphaMode::Blend);
        let alpha = number(if blends { material.alpha } else { 1.0 });
        let mut pbr = json!({
            "baseColorFactor": [red, green, blue, alpha],
            "metallicFactor": number(material.metallic),
            "roughnessFactor": number(material.roughness),
        });
        let mut json = json!({ "name": material.name });
        self.texture(&mut pbr, "baseColorTexture", material, TextureSlot::BaseColor);
        self.normal_map(&mut json, "normalTexture", material);
        self.texture(&mut pbr, "metallicRoughnessTexture", material, TextureSlot::MetallicRoughness);
        self.texture(&mut json, "occlusionTexture", material, TextureSlot::Occlusion);
        self.texture(&mut json, "emissiveTexture", material, TextureSlot::Emissive);
        json["pbrMetallicRoughness"] = pbr;
        match material.alpha_mode {
            AlphaMode::Mask { cutoff } => {
                (json["alphaMode"], json["alphaCutoff"]) = ("MASK".into(), number(cutoff));
            }
            AlphaMode::Blend => json["alphaMode"] = "BLEND".into(),
            AlphaMode::Glass => {
                let transmission = json!({ "transmissionFactor": 1.0 - f64::from(material.alpha) });
                self.extend(&mut json, "KHR_materials_transmission", transmission);
                self.volume(&mut json, material);
            }
            AlphaMode::Opaque | AlphaMode::Coat => {}
        }
        if material.two_sided {
            json["doubleSided"] = true.into();
        }
        self.emission(&mut json, material);
        self.reflectance(&mut json, material);
        self.sheen(&mut json, material);
        self.film(&mut json, material);
        self.anisotropy(&mut json, material);
        self.diffuse_transmission(&mut json, material);
        if material.unlit {
            self.extend(&mut json, "KHR_materials_unlit", json!({}));
        }
        if let Some(coat) = coat {
            self.coat(&mut json, &scene.materials[coat]);
        }
        json
    }

    fn extend(&mut self, json: &mut Value, extension: &'static str, content: Value) {
        json["extensions"][self.document.uses(extension)] = content;
    }

    /// Writes the emission in nits: a colour from 0 to 1 times a power of 2, which rounds nothing.
    fn emission(&mut self, json: &mut Value, material: &Material) {
        if !material.is_emissive() {
            return;
        }
        let strength = power_of_two_above(material.emissive.max_element());
        json["emissiveFactor"] = json!((material.emissive / strength).to_array().map(number));
        if strength > 1.0 {
            self.extend(json, "KHR_materials_emissive_strength", json!({ "emissiveStrength": strength }));
        }
    }

    /// The reflectances of a dielectric. The strength is the one at grazing incidence; the index of refraction and a colour give the one at normal
    /// incidence (KHR_materials_ior, KHR_materials_specular).
    fn reflectance(&mut self, json: &mut Value, material: &Material) {
        // Glass has its own index of refraction.
        let glass = material.refraction.map(|own| f64::from(own.ior)).filter(|own| *own != 1.5);
        if !(material.has_reflectance() || glass.is_some()) || material.unlit {
            return;
        }
        let strength = f64::from(material.grazing);
        let straight = material.reflectance.as_dvec3() / if strength > 0.0 { strength } else { 1.0 };
        let facing = |ior: f64| ((ior - 1.0) / (ior + 1.0)).powi(2);
        let most = material.refraction.map_or(straight.max_element().min(1.0), |own| facing(f64::from(own.ior)));
        let usual = material.reflectance == Vec3::splat(DIELECTRIC) * material.grazing || strength == 0.0;
        if !usual || glass.is_some() {
            // ((ior - 1) / (ior + 1))^2 = most; 0 stands for an infinite index.
            let root = most.sqrt();
            let ior = if most < 1.0 { (1.0 + root) / (1.0 - root) } else { 0.0 };
            self.extend(json, "KHR_materials_ior", json!({ "ior": glass.unwrap_or(ior) }));
        }
        let is_told = (usual && glass.is_none()) || most == 0.0;
        let color = if is_told { glam::DVec3::ONE } else { straight / most };
        // The reflectance computed from an index of refraction was rounded.
        let color = if color.abs_diff_eq(glam::DVec3::ONE, 1e-6) { glam::DVec3::ONE } else { color };
        let mut specular = json!({});
        if strength != 1.0 {
            specular["specularFactor"] = number(material.grazing);
        }
        if color != glam::DVec3::ONE {
            specular["specularColorFactor"] = json!(color.to_array());
        }
        // One texture has both: the colour, and the strength in its alpha.
        self.texture(&mut specular, "specularColorTexture", material, TextureSlot::Specular);
        self.texture(&mut specular, "specularTexture", material, TextureSlot::Specular);
        if specular != json!({}) {
            self.extend(json, "KHR_materials_specular", specular);
        }
    }

    fn sheen(&mut self, json: &mut Value, material: &Material) {
        let Sheen { color, roughness } = material.sheen;
        if material.unlit || !material.sheen.is_seen() {
            return;
        }
        let mut own = json!({
            "sheenColorFactor": color.to_array().map(number),
            "sheenRoughnessFactor": number(roughness),
        });
        // One texture has both: the colour, and a share of the roughness in its alpha.
        self.texture(&mut own, "sheenColorTexture", material, TextureSlot::Sheen);
        self.texture(&mut own, "sheenRoughnessTexture", material, TextureSlot::Sheen);
        self.extend(json, "KHR_materials_sheen", own);
    }

    fn film(&mut self, json: &mut Value, material: &Material) {
        let ThinFilm { strength, ior, nanometres: [least, most] } = material.film;
        if material.unlit || !material.film.is_seen() {
            return;
        }
        let mut own = json!({
            "iridescenceFactor": number(strength),
            "iridescenceIor": number(ior),
            "iridescenceThicknessMinimum": number(least),
            "iridescenceThicknessMaximum": number(most),
        });
        self.texture(&mut own, "iridescenceTexture", material, TextureSlot::Film);
        self.texture(&mut own, "iridescenceThicknessTexture", material, TextureSlot::Film);
        self.extend(json, "KHR_materials_iridescence", own);
    }

    fn anisotropy(&mut self, json: &mut Value, material: &Material) {
        let Anisotropy { strength, rotation } = material.anisotropy;
        if material.unlit || !material.anisotropy.is_seen() {
            return;
        }
        let mut own = json!({ "anisotropyStrength": number(strength), "anisotropyRotation": number(rotation) });
        self.texture(&mut own, "anisotropyTexture", material, TextureSlot::Anisotropy);
        self.extend(json, "KHR_materials_anisotropy", own);
    }

    fn volume(&mut self, json: &mut Value, material: &Material) {
        let Some(Refraction { ior: _, thickness, color, distance, dispersion }) = material.refraction else { return };
        if thickness > 0.0 {
            let mut own = json!({ "thicknessFactor": number(thickness) });
            if let Some(texture) = material.film_texture {
                let map = &material.uv_maps[TextureSlot::Film as usize];
                own["thicknessTexture"] = self.info(TextureForm { texture, channels: Channels::BlueAsGreen }, map);
            }
            if distance.is_finite() {
                own["attenuationDistance"] = number(distance);
                own["attenuationColor"] = json!(color.to_array().map(number));
            }
            self.extend(json, "KHR_materials_volume", own);
        }
        if dispersion > 0.0 {
            self.extend(json, "KHR_materials_dispersion", json!({ "dispersion": number(dispersion) }));
        }
    }

    fn diffuse_transmission(&mut self, json: &mut Value, material: &Material) {
        let DiffuseTransmission { strength, color } = material.diffuse_transmission;
        if material.unlit || !material.diffuse_transmission.is_seen() {
            return;
        }
        let mut own = json!({
            "diffuseTransmissionFactor": number(strength),
            "diffuseTransmissionColorFactor": color.to_array().map(number),
        });
        // One texture has both: the colour, and the strength in its alpha.
        self.texture(&mut own, "diffuseTransmissionColorTexture", material, TextureSlot::DiffuseTransmission);
        self.texture(&mut own, "diffuseTransmissionTexture", material, TextureSlot::DiffuseTransmission);
        self.extend(json, "KHR_materials_diffuse_transmission", own);
    }

    fn coat(&mut self, json: &mut Value, coat: &Material) {
        let mut own = json!({
            "clearcoatFactor": number(coat.alpha),
            "clearcoatRoughnessFactor": number(coat.roughness),
        });
        if let Some(texture) = coat.base_color_texture {
            let map = &coat.uv_maps[TextureSlot::BaseColor as usize];
            own["clearcoatTexture"] = self.info(TextureForm { texture, channels: Channels::AlphaAsRed }, map);
        }
        self.texture(&mut own, "clearcoatRoughnessTexture", coat, TextureSlot::MetallicRoughness);
        self.normal_map(&mut own, "clearcoatNormalTexture", coat);
        self.extend(json, "KHR_materials_clearcoat", own);
    }

    fn normal_map(&mut self, json: &mut Value, key: &str, material: &Material) {
        self.texture(json, key, material, TextureSlot::Normal);
        if material.normal_texture.is_some() && material.normal_scale != 1.0 {
            json[key]["scale"] = number(material.normal_scale);
        }
    }

    /// The texture of a slot, if there is one.
    fn texture(&mut self, json: &mut Value, key: &str, material: &Material, slot: TextureSlot) {
        if let Some(texture) = material.texture(slot) {
            json[key] =
                self.info(TextureForm { texture, channels: Channels::AsTheyAre }, &material.uv_maps[slot as usize]);
        }
    }

    fn info(&mut self, asked: TextureForm, map: &UvMap) -> Value {
        let index = self.asked.iter().position(|own| *own == asked).unwrap_or_else(|| {
            self.asked.push(asked);
            self.asked.len() - 1
        });
        let mut info = json!({ "index": index });
        if map.set > 0 {
            info["texCoord"] = map.set.into();
        }
        let UvMap { set: _, offset, rotation, scale } = *map;
        if (UvMap { set: 0, ..*map }) != UvMap::IDENTITY {
            let mut transform = json!({});
            if offset != DVec2::ZERO {
                transform["offset"] = json!(offset.to_array());
            }
            if rotation != 0.0 {
                transform["rotation"] = rotation.into();
            }
            if scale != DVec2::ONE {
                transform["scale"] = json!(scale.to_array());
            }
            self.extend(&mut info, "KHR_texture_transform", transform);
        }
        info
    }
}
