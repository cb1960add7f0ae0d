//! Lobes of a material's extensions.

use super::json::TextureInfo;
use super::json_extensions::{AnisotropyExtension, DiffuseTransmissionExtension, Iridescence, SheenExtension};
use super::materials::{MaterialBuilder, Pending, lie_alike};
use super::textures::{ImageWithFallback, Recipe, picture};
use crate::{
    AlphaMode, Anisotropy, ColorSpace, DiffuseTransmission, MIN_SHEEN_ROUGHNESS, MOST_DISPERSION, Refraction, Sheen,
    TextureSlot, ThinFilm,
};

/// The extensions that make no sense beside a lobe: each says so in its section "Exclusions".
fn is_excluded(reader: &mut MaterialBuilder, extension: &str) -> bool {
    let extensions = &reader.json.extensions;
    let other = match () {
        () if extensions.unlit.is_some() => "KHR_materials_unlit",
        () if extensions.glossy.is_some() => "KHR_materials_pbrSpecularGlossiness",
        () => return false,
    };
    reader.warnings.push(format!("{extension} does not go with {other} and is left out"));
    true
}

impl MaterialBuilder<'_> {
    /// Reads the lobes of a material into it.
    pub(super) fn lobes(&mut self, pending: &mut Pending) {
        let json = self.json;
        if let Some(own) = &json.extensions.sheen
            && !is_excluded(self, "KHR_materials_sheen")
        {
            self.sheen(pending, own);
        }
        if let Some(own) = &json.extensions.iridescence
            && !is_excluded(self, "KHR_materials_iridescence")
        {
            self.film(pending, own);
        }
        if let Some(own) = &json.extensions.anisotropy
            && !is_excluded(self, "KHR_materials_anisotropy")
        {
            self.anisotropy(pending, own);
        }
        if let Some(own) = &json.extensions.diffuse_transmission
            && !is_excluded(self, "KHR_materials_diffuse_transmission")
        {
            self.diffuse_transmission(pending, own);
        }
        match &json.extensions.transmission {
            Some(own) if own.transmission_factor > 0.0 => self.refraction(pending),
            _ => self.tell_of_lone_volume(),
        }
    }

    /// Volume and dispersion are of light that passes: without transmission none does.
    fn tell_of_lone_volume(&mut self) {
        let extensions = &self.json.extensions;
        if extensions.volume.as_ref().is_some_and(|own| own.thickness_factor != 0.0) {
            self.warnings.push("it has a thickness but transmits no light: KHR_materials_volume is left out".into());
        }
        if extensions.dispersion.as_ref().is_some_and(|own| own.dispersion != 0.0) {
            self.warnings.push("it transmits no light: KHR_materials_dispersion is left out".into());
        }
    }

    fn refraction(&mut self, pending: &mut Pending) {
        let extensions = &self.json.extensions;
        if pending.material.alpha_mode != AlphaMode::Glass || is_excluded(self, "KHR_materials_transmission") {
            return;
        }
        // 0 stands for an infinite index, through which nothing passes; one below 1 was told of with the reflectance.
        let ior = extensions.ior.as_ref().and_then(|own| own.ior).filter(|own| *own >= 1.0).unwrap_or(1.5);
        let mut own = Refraction { ior: self.number("ior", ior, 1.0, 100.0), ..Refraction::THIN };
        if let Some(volume) = &extensions.volume {
            own.thickness = self.number("thicknessFactor", volume.thickness_factor, 0.0, 1e18);
            let distance = volume.attenuation_distance.unwrap_or(f64::INFINITY);
            if distance > 0.0 {
                // f32 has no 0 for it.
                own.distance = distance.max(1e-9) as f32;
                own.color = self.color("attenuationColor", volume.attenuation_color.unwrap_or([1.0; 3]));
            } else {
                self.warnings.push(format!("its attenuationDistance is {distance}, not above 0: nothing is absorbed"));
            }
            if let Some(info) = volume.thickness_texture.as_ref().filter(|_| own.thickness > 0.0) {
                match pending.requests.iter().any(|(slot, _)| *slot == TextureSlot::Film) {
                    true => {
                        self.warnings.push("its thicknessTexture beside a texture of iridescence is left out".into())
                    }
                    false => self.ask(pending, TextureSlot::Film, info, Recipe::Thickness),
                }
            }
        }
        if let Some(dispersion) = &extensions.dispersion {
            own.dispersion = self.number("dispersion", dispersion.dispersion, 0.0, f64::from(MOST_DISPERSION));
        }
        pending.material.refraction = Some(own);
    }

    fn sheen(&mut self, pending: &mut Pending, own: &SheenExtension) {
        let color = self.color("sheenColorFactor", own.sheen_color_factor.unwrap_or([0.0; 3]));
        let roughness = self.share("sheenRoughnessFactor", own.sheen_roughness_factor);
        let sheen = Sheen { color, roughness };
        if !sheen.is_seen() {
            return;
        }
        if roughness < MIN_SHEEN_ROUGHNESS {
            self.warnings.push(format!(
                "its sheenRoughnessFactor is {roughness}, below the least of the model, taken for {MIN_SHEEN_ROUGHNESS}"
            ));
        }
        pending.material.sheen = sheen;
        let textures = (own.sheen_color_texture.as_ref(), own.sheen_roughness_texture.as_ref());
        self.color_and_share(
            pending,
            TextureSlot::Sheen,
            textures,
            "sheenRoughnessTexture lies otherwise than sheenColorTexture",
        );
    }

    fn anisotropy(&mut self, pending: &mut Pending, own: &AnisotropyExtension) {
        let strength = self.share("anisotropyStrength", own.anisotropy_strength);
        if strength == 0.0 {
            return;
        }
        let rotation = self.number("anisotropyRotation", own.anisotropy_rotation, -1e6, 1e6);
        pending.material.anisotropy = Anisotropy { strength, rotation };
        if let Some(info) = &own.anisotropy_texture {
            let plain = |own| Recipe::Plain(own, ColorSpace::Linear);
            self.ask(pending, TextureSlot::Anisotropy, info, plain);
        }
    }

    fn diffuse_transmission(&mut self, pending: &mut Pending, own: &DiffuseTransmissionExtension) {
        let strength = self.share("diffuseTransmissionFactor", own.diffuse_transmission_factor);
        if strength == 0.0 {
            return;
        }
        let color = own.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
        let color = self.color("diffuseTransmissionColorFactor", color);
        pending.material.diffuse_transmission = DiffuseTransmission { strength, color };
        self.color_and_share(
            pending,
            TextureSlot::DiffuseTransmission,
            (own.diffuse_transmission_color_texture.as_ref(), own.diffuse_transmission_texture.as_ref()),
            "diffuseTransmissionTexture lies otherwise than diffuseTransmissionColorTexture",
        );
    }

    fn film(&mut self, pending: &mut Pending, own: &Iridescence) {
        let strength = self.share("iridescenceFactor", own.iridescence_factor);
        if strength == 0.0 {
            return;
        }
        let usual = ThinFilm::NONE;
        let ior = own.iridescence_ior.unwrap_or(f64::from(usual.ior));
        let ior = self.number("iridescenceIor", ior, 1.0, 100.0);
        let [least, most] = [
            ("iridescenceThicknessMinimum", own.iridescence_thickness_minimum, usual.nanometres[0]),
            ("iridescenceThicknessMaximum", own.iridescence_thickness_maximum, usual.nanometres[1]),
        ]
        .map(|(what, value, usual)| self.number(what, value.unwrap_or(f64::from(usual)), 0.0, 1e6));
        let (share, thickness) = (own.iridescence_texture.as_ref(), own.iridescence_thickness_texture.as_ref());
        let least = if thickness.is_some() { least } else { most };
        let film = ThinFilm { strength, ior, nanometres: [least, most] };
        if !film.is_seen() {
            self.warnings.push("its film of KHR_materials_iridescence is 0 nm thick, drawn without it".into());
            return;
        }
        pending.material.film = film;
        let Some(info) = share.or(thickness) else { return };
        let lie = share.is_none_or(|a| thickness.is_none_or(|b| lie_alike(a, b)));
        if !lie {
            self.warnings
                .push("iridescenceTexture lies otherwise than iridescenceThicknessTexture and is left out".into());
        }
        let (info, share) = if lie { (info, share) } else { (thickness.unwrap_or(info), None) };
        let mut of = |info: Option<&TextureInfo>| {
            info.and_then(|info| picture(self.document, info.index, &mut self.warnings)).map(|(found, _)| found)
        };
        let [strength, thickness] = [of(share), of(thickness)];
        self.ask(pending, TextureSlot::Film, info, |_| Recipe::Film { strength, thickness });
    }

    /// Asks for one texture of two: the colour of the first, and the alpha of the second. The second is left out where it lies otherwise.
    pub(super) fn color_and_share(
        &mut self,
        pending: &mut Pending,
        slot: TextureSlot,
        (color, mut share): (Option<&TextureInfo>, Option<&TextureInfo>),
        otherwise: &str,
    ) {
        let Some(info) = color.or(share) else { return };
        if let (Some(a), Some(b)) = (color, share)
            && !lie_alike(a, b)
        {
            self.warnings.push(format!("{otherwise} and is left out"));
            share = None;
        }
        let mut of = |info: Option<&TextureInfo>| -> Option<ImageWithFallback> {
            let found = info.and_then(|info| picture(self.document, info.index, &mut self.warnings));
            found.map(|(found, _)| found)
        };
        let [color, strength] = [of(color), of(share)];
        self.ask(pending, slot, info, |_| Recipe::Specular { color, strength });
    }
}
