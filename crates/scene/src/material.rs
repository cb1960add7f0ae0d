//! Surface descriptions.

use glam::{DVec2, DVec3, Vec3};

use super::settings::choice;
use super::{Anisotropy, ColorSpace, DiffuseTransmission, OptionalPart, Refraction, Sheen, ThinFilm};

choice! {
    /// A reflection model (docs/FORMULAS.md has the formulas; `shaders/shared/brdf.wgsl` is the code).
    #[derive(Default, PartialOrd, Ord)]
    pub enum Brdf: "brdf" {
        /// GGX with height-correlated Smith, Schlick Fresnel and a lambert base.
        #[default]
        CookTorrance => "cook-torrance",
        /// (R.E)^n
        Phong => "phong",
        /// (N.H)^n
        BlinnPhong => "blinn-phong",
        /// Diffuse only.
        Lambert => "lambert",
    }
}

/// The effect of alpha.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// Fragments with an alpha below the cut-off are discarded.
    Mask {
        /// 0 to 1.
        cutoff: f32,
    },
    /// Reflected and emitted light, multiplied by alpha, is blended over the light from behind: a thin cover, as gauze or smoke.
    Blend,
    /// Alpha belongs to the body only, so a clear pane still shines: diffuse light is multiplied by alpha, the light from behind by 1 - alpha.
    /// Highlights and emitted light are not scaled.
    Glass,
    /// A clear lacquer on a surface that is coplanar with it, an object with the same mesh and transform (KHR_materials_clearcoat). The light of that
    /// surface is multiplied by 1 - alpha F and the lacquer's highlights by alpha F, where F = 0.04 + 0.96 (1 - N.E)^5. A coat has no body and no
    /// colour, emits nothing, and casts no shadow.
    Coat,
}

/// The texture slots of a material, in the order of their descriptor bindings. [`TextureSlot::form`] has the properties of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TextureSlot {
    /// sRGB colour; linear alpha.
    BaseColor,
    /// Tangent-space normal, +Y up; (128, 128, 255) decodes to exactly (0, 0, 1).
    Normal,
    /// Roughness in green, metallic in blue, as glTF has it. Linear.
    MetallicRoughness,
    /// Ambient occlusion in red. Linear.
    Occlusion,
    /// sRGB colour.
    Emissive,
    /// Ks of the Phong models, or the reflectance of a dielectric: sRGB colour. Linear alpha is the strength of the latter.
    Specular,
    /// Green is a share of the Phong models' Ns, where other models have their roughness. Linear.
    Shininess,
    /// The colour of a sheen: sRGB colour. Linear alpha is a share of its roughness.
    Sheen,
    /// Thin film: red is the strength, green interpolates between the least and the greatest thickness. Glass: blue scales the thickness. Linear.
    Film,
    /// Anisotropy: red and green are the direction, where 128 is 0 as in a normal map; blue is the strength. Linear.
    Anisotropy,
    /// Diffuse transmission: RGB is an sRGB colour, alpha the strength, linear.
    DiffuseTransmission,
}

impl TextureSlot {
    /// All slots, in order.
    pub const ALL: [Self; 11] = [
        Self::BaseColor,
        Self::Normal,
        Self::MetallicRoughness,
        Self::Occlusion,
        Self::Emissive,
        Self::Specular,
        Self::Shininess,
        Self::Sheen,
        Self::Film,
        Self::Anisotropy,
        Self::DiffuseTransmission,
    ];

    /// The number of slots whose values a G-buffer stores. The slots after them belong to [lobes](super::Sheen).
    pub const STORED: usize = Self::Shininess as usize + 1;

    /// Returns true if only a lobe uses the slot.
    pub fn is_of_lobe(self) -> bool {
        self as usize >= Self::STORED
    }

    /// Returns all properties of the slot.
    pub fn form(self) -> &'static SlotForm {
        let forms: &'static [SlotForm] = &FORMS;
        &forms[self as usize]
    }
}

/// All properties of a texture slot.
#[derive(Debug, Clone, Copy)]
pub struct SlotForm {
    /// The key in scene files.
    pub key: &'static str,
    /// The name of its textures in reports.
    pub name: &'static str,
    /// The part's entry in `--plan`.
    pub part: OptionalPart,
    /// The colour space of textures in the slot.
    pub color_space: ColorSpace,
    /// The channels in use: red, green, blue and alpha.
    pub channels: [bool; 4],
    /// True if only the Phong models use it, false if only the others do; `None` if all do.
    pub phong: Option<bool>,
    /// Multiplies the factors by the value of a constant texture, in linear values.
    pub fold: fn(&mut Material, [f64; 4]),
    get: fn(&Material) -> Option<usize>,
    get_mut: fn(&mut Material) -> &mut Option<usize>,
}

const RED: [bool; 4] = [true, false, false, false];
const RGB: [bool; 4] = [true, true, true, false];

/// The properties of all slots, in the order of [`TextureSlot`]. White is neutral for all but normal maps.
pub(crate) const FORMS: [SlotForm; 11] = [
    SlotForm {
        key: "base_color_texture",
        name: "base colour textures",
        part: OptionalPart::BaseColorTextures,
        color_space: ColorSpace::Srgb,
        // Alpha is used if the material uses it.
        channels: RGB,
        phong: None,
        fold: |material, color| material.base_color = times(material.base_color, color),
        get: |material| material.base_color_texture,
        get_mut: |material| &mut material.base_color_texture,
    },
    SlotForm {
        key: "normal_texture",
        name: "normal maps",
        part: OptionalPart::NormalMaps,
        color_space: ColorSpace::Linear,
        channels: RGB,
        phong: None,
        // Only a flat normal map can be left out.
        fold: |_, _| {},
        get: |material| material.normal_texture,
        get_mut: |material| &mut material.normal_texture,
    },
    SlotForm {
        key: "metallic_roughness_texture",
        name: "metallic-roughness textures",
        part: OptionalPart::MetallicRoughnessTextures,
        color_space: ColorSpace::Linear,
        channels: [false, true, true, false],
        phong: Some(false),
        fold: |material, color| {
            material.roughness = scaled(material.roughness, color[1]);
            material.metallic = scaled(material.metallic, color[2]);
        },
        get: |material| material.metallic_roughness_texture,
        get_mut: |material| &mut material.metallic_roughness_texture,
    },
    SlotForm {
        key: "occlusion_texture",
        name: "ambient occlusion textures",
        part: OptionalPart::OcclusionTextures,
        color_space: ColorSpace::Linear,
        channels: RED,
        phong: None,
        fold: |material, color| material.ambient = scaled(material.ambient, color[0]),
        get: |material| material.occlusion_texture,
        get_mut: |material| &mut material.occlusion_texture,
    },
    SlotForm {
        key: "emissive_texture",
        name: "emissive textures",
        part: OptionalPart::EmissiveTextures,
        color_space: ColorSpace::Srgb,
        channels: RGB,
        phong: None,
        fold: |material, color| material.emissive = times(material.emissive, color),
        get: |material| material.emissive_texture,
        get_mut: |material| &mut material.emissive_texture,
    },
    SlotForm {
        key: "specular_texture",
        name: "specular textures",
        part: OptionalPart::SpecularTextures,
        color_space: ColorSpace::Srgb,
        channels: RGB,
        phong: Some(true),
        fold: |material, color| match material.reflectance_texture() {
            Some(_) => {
                let [red, green, blue, alpha] = color;
                material.reflectance = times(material.reflectance, [red * alpha, green * alpha, blue * alpha, 1.0]);
                material.grazing = scaled(material.grazing, alpha);
            }
            None => material.specular = times(material.specular, color),
        },
        get: |material| material.specular_texture,
        get_mut: |material| &mut material.specular_texture,
    },
    SlotForm {
        key: "shininess_texture",
        name: "shininess textures",
        part: OptionalPart::ShininessTextures,
        color_space: ColorSpace::Linear,
        channels: [false, true, false, false],
        phong: Some(true),
        fold: |material, color| material.shininess = scaled(material.shininess, color[1]),
        get: |material| material.shininess_texture,
        get_mut: |material| &mut material.shininess_texture,
    },
    SlotForm {
        key: "sheen_texture",
        name: "sheen textures",
        part: OptionalPart::SheenTextures,
        color_space: ColorSpace::Srgb,
        channels: [true; 4],
        phong: Some(false),
        fold: |material, color| {
            material.sheen.color = times(material.sheen.color, color);
            material.sheen.roughness = scaled(material.sheen.roughness, color[3]);
        },
        get: |material| material.sheen_texture,
        get_mut: |material| &mut material.sheen_texture,
    },
    SlotForm {
        key: "film_texture",
        name: "thin film textures",
        part: OptionalPart::FilmTextures,
        color_space: ColorSpace::Linear,
        channels: [true, true, true, false],
        phong: Some(false),
        fold: |material, color| {
            if let Some(own) = &mut material.refraction {
                own.thickness = scaled(own.thickness, color[2]);
            }
            let ThinFilm { strength, nanometres: [least, most], .. } = &mut material.film;
            *strength = scaled(*strength, color[0]);
            let own = f64::from(*least) + (f64::from(*most) - f64::from(*least)) * color[1];
            (*least, *most) = (own as f32, own as f32);
        },
        get: |material| material.film_texture,
        get_mut: |material| &mut material.film_texture,
    },
    SlotForm {
        key: "anisotropy_texture",
        name: "anisotropy textures",
        part: OptionalPart::AnisotropyTextures,
        color_space: ColorSpace::Linear,
        channels: RGB,
        phong: Some(false),
        fold: |material, [red, green, blue, _]| {
            // The shader decodes this code as in a normal map, and takes the middle one for 0.
            let [x, y] = [red, green].map(|value| (value * 255.0 - 128.0) / 127.0);
            let [x, y] = [x, y].map(|value| if value.abs() < 0.01 / 127.0 { 0.0 } else { value });
            let Anisotropy { strength, rotation } = &mut material.anisotropy;
            // A direction of length 0 means no anisotropy.
            *strength = if x == 0.0 && y == 0.0 { 0.0 } else { scaled(*strength, blue) };
            *rotation = (f64::from(*rotation) + y.atan2(x)) as f32;
        },
        get: |material| material.anisotropy_texture,
        get_mut: |material| &mut material.anisotropy_texture,
    },
    SlotForm {
        key: "diffuse_transmission_texture",
        name: "diffuse transmission textures",
        part: OptionalPart::DiffuseTransmissionTextures,
        color_space: ColorSpace::Srgb,
        channels: [true; 4],
        phong: Some(false),
        fold: |material, color| {
            let DiffuseTransmission { strength, color: own } = &mut material.diffuse_transmission;
            (*own, *strength) = (times(*own, color), scaled(*strength, color[3]));
        },
        get: |material| material.diffuse_transmission_texture,
        get_mut: |material| &mut material.diffuse_transmission_texture,
    },
];

/// Multiplies a material's factor by a texel's value, both of f32 precision, with a single rounding.
pub fn scaled(factor: f32, by: f64) -> f32 {
    (f64::from(factor) * by) as f32
}

fn times(factor: Vec3, color: [f64; 4]) -> Vec3 {
    Vec3::new(scaled(factor.x, color[0]), scaled(factor.y, color[1]), scaled(factor.z, color[2]))
}

/// The mapping of a slot's texture onto a mesh (KHR_texture_transform): the coordinates of a set, scaled, then rotated, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UvMap {
    /// The mesh's coordinates that it uses: 0 for `Mesh::uvs`, 1 for `Mesh::uvs_1`.
    pub set: u8,
    /// The offset in image widths and heights.
    pub offset: DVec2,
    /// The rotation about the image's upper left corner, counter-clockwise, in radians.
    pub rotation: f64,
    /// The scale, in images a unit.
    pub scale: DVec2,
}

impl UvMap {
    /// The first set, unchanged.
    pub const IDENTITY: Self = Self { set: 0, offset: DVec2::ZERO, rotation: 0.0, scale: DVec2::ONE };

    /// The rows of the map from the set's coordinates and 1 to the image's (KHR_texture_transform, "Overview": translation * rotation * scale).
    pub fn rows(&self) -> [DVec3; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let DVec2 { x, y } = self.scale;
        [DVec3::new(cos * x, sin * y, self.offset.x), DVec3::new(-sin * x, cos * y, self.offset.y)]
    }
}

impl Default for UvMap {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// Reflectance of a dielectric of index of refraction 1.5 at normal incidence.
pub const DIELECTRIC: f32 = 0.04;

/// A material; factors multiply the values of textures. Colours are linear RGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// The name in messages and reports.
    pub name: String,
    /// The reflection model.
    pub brdf: Brdf,
    /// Albedo (Kd), 0 to 1.
    pub base_color: Vec3,
    /// Opacity, 0 to 1; `AlphaMode::Opaque` ignores it.
    pub alpha: f32,
    /// The effect of `alpha`. Opaque, the default, ignores it.
    pub alpha_mode: AlphaMode,
    /// 0 to 1.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1; alpha of GGX is its square.
    pub roughness: f32,
    /// Ks of the Phong models, 0 to 1.
    pub specular: Vec3,
    /// Reflectance of the dielectric share of a Cook-Torrance surface at normal incidence, 0 to 1: [`DIELECTRIC`], or
    /// min(((ior - 1) / (ior + 1))^2 specularColor, 1) specular (KHR_materials_ior, KHR_materials_specular).
    pub reflectance: Vec3,
    /// Reflectance of the dielectric share at grazing incidence, 0 to 1: 1, or specular (KHR_materials_specular).
    pub grazing: f32,
    /// Ns of the Phong models, 0 and up.
    pub shininess: f32,
    /// Share of the ambient light that is reflected besides the albedo, 0 to 1: luminance(Ka) / luminance(Kd). Only the Phong models use it.
    pub ambient: f32,
    /// Emitted radiance in nits.
    pub emissive: Vec3,
    /// Scale of the normal map's X and Y.
    pub normal_scale: f32,
    /// True if back faces are drawn, with their normals turned.
    pub two_sided: bool,
    /// The sheen of fibres; black if there are none.
    pub sheen: Sheen,
    /// A thin film on the surface; strength 0 if there is none.
    pub film: ThinFilm,
    /// The anisotropy of the highlight; strength 0 if there is none.
    pub anisotropy: Anisotropy,
    /// The transmitted diffuse light; strength 0 if there is none.
    pub diffuse_transmission: DiffuseTransmission,
    /// Refraction and absorption, for glass that bends, blurs or tints light.
    pub refraction: Option<Refraction>,
    /// True if it emits its base colour, in nits, in any light, and reflects nothing (KHR_materials_unlit).
    pub unlit: bool,
    /// Rows and columns of cells that each of its textures is made of, 1 to 256 each: all texture coordinates, from 0 to 1 and beyond, lie
    /// in the one cell that an object shows ([`Look::cell`](super::Look::cell)). Cells do not bleed into each other, however they are filtered.
    pub atlas: [u32; 2],
    /// The texture mapping of each slot.
    pub uv_maps: [UvMap; TextureSlot::ALL.len()],
    /// Multiplies `base_color` and `alpha`; index in `Scene::textures`.
    pub base_color_texture: Option<usize>,
    /// Bends the normals of meshes that have tangents.
    pub normal_texture: Option<usize>,
    /// Multiplies `metallic` and `roughness`.
    pub metallic_roughness_texture: Option<usize>,
    /// Darkens ambient light.
    pub occlusion_texture: Option<usize>,
    /// Multiplies `emissive`.
    pub emissive_texture: Option<usize>,
    /// Multiplies `specular`, or `reflectance` by its colour and alpha and `grazing` by its alpha where a Cook-Torrance material has no `specular`.
    pub specular_texture: Option<usize>,
    /// Multiplies `shininess`.
    pub shininess_texture: Option<usize>,
    /// Multiplies the colour of `sheen`, and its roughness by alpha.
    pub sheen_texture: Option<usize>,
    /// Multiplies the strength of `film`, chooses its thickness, and multiplies the thickness of `refraction`.
    pub film_texture: Option<usize>,
    /// Turns the direction of `anisotropy`, and multiplies its strength.
    pub anisotropy_texture: Option<usize>,
    /// Multiplies the colour of `diffuse_transmission`, and its strength by alpha.
    pub diffuse_transmission_texture: Option<usize>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            brdf: Brdf::default(),
            base_color: Vec3::splat(0.8),
            alpha: 1.0,
            alpha_mode: AlphaMode::Opaque,
            metallic: 0.0,
            roughness: 0.5,
            specular: Vec3::ZERO,
            reflectance: Vec3::splat(DIELECTRIC),
            grazing: 1.0,
            shininess: 0.0,
            ambient: 1.0,
            emissive: Vec3::ZERO,
            normal_scale: 1.0,
            two_sided: false,
            sheen: Sheen::NONE,
            film: ThinFilm::NONE,
            anisotropy: Anisotropy::NONE,
            diffuse_transmission: DiffuseTransmission::NONE,
            refraction: None,
            unlit: false,
            atlas: [1, 1],
            uv_maps: [UvMap::IDENTITY; TextureSlot::ALL.len()],
            base_color_texture: None,
            normal_texture: None,
            metallic_roughness_texture: None,
            occlusion_texture: None,
            emissive_texture: None,
            specular_texture: None,
            shininess_texture: None,
            sheen_texture: None,
            film_texture: None,
            anisotropy_texture: None,
            diffuse_transmission_texture: None,
        }
    }
}

impl Material {
    /// The textures in use, by slot.
    pub fn textures(&self) -> impl Iterator<Item = (TextureSlot, usize)> {
        TextureSlot::ALL.into_iter().filter_map(|slot| self.texture(slot).map(|texture| (slot, texture)))
    }

    /// The texture in a slot.
    pub fn texture(&self, slot: TextureSlot) -> Option<usize> {
        (slot.form().get)(self)
    }

    /// The texture in a slot, to be changed.
    pub fn texture_mut(&mut self, slot: TextureSlot) -> &mut Option<usize> {
        (slot.form().get_mut)(self)
    }

    /// The reflection model that it is drawn with where `overridden` stands in for all materials' own: an unlit surface and a coat have theirs.
    pub fn model(&self, overridden: Option<Brdf>) -> Brdf {
        match self.alpha_mode {
            _ if self.unlit => Brdf::Lambert,
            AlphaMode::Coat => Brdf::CookTorrance,
            _ => overridden.unwrap_or(self.brdf),
        }
    }

    /// The specular slot's texture, if it gives the reflectance of a dielectric (KHR_materials_specular). That holds for Cook-Torrance materials
    /// without Ks, which only the Phong models have.
    pub fn reflectance_texture(&self) -> Option<usize> {
        let is_dielectric = self.brdf == Brdf::CookTorrance && self.specular == Vec3::ZERO;
        self.specular_texture.filter(|_| is_dielectric && self.alpha_mode != AlphaMode::Coat)
    }

    /// Returns true if its dielectric share reflects anything but [`DIELECTRIC`] at normal and 1 at grazing incidence.
    pub fn has_reflectance(&self) -> bool {
        let usual = self.reflectance == Vec3::splat(DIELECTRIC) && self.grazing == 1.0;
        !usual || self.reflectance_texture().is_some()
    }

    /// Returns true if the material, drawn with this model, has a lobe beside its base and its highlight.
    pub fn has_lobes(&self, model: Brdf) -> bool {
        let is_over = self.sheen.is_seen() || self.film.is_seen() || self.anisotropy.is_seen();
        let is_seen = is_over || self.diffuse_transmission.is_seen() || self.refracts(model).is_some();
        model == Brdf::CookTorrance && self.alpha_mode != AlphaMode::Coat && is_seen
    }

    /// Polished glass without a colour on its surface.
    pub fn clear_glass(refraction: Refraction) -> Self {
        Self {
            base_color: Vec3::ONE,
            alpha: 0.0,
            alpha_mode: AlphaMode::Glass,
            roughness: 0.0,
            reflectance: Vec3::splat(((refraction.ior - 1.0) / (refraction.ior + 1.0)).powi(2)),
            refraction: Some(refraction),
            ..Self::default()
        }
    }

    /// The refraction, if the material is drawn as glass with this model.
    pub fn refracts(&self, model: Brdf) -> Option<Refraction> {
        self.refraction.filter(|_| self.alpha_mode == AlphaMode::Glass && model == Brdf::CookTorrance)
    }

    /// Returns true if it uses the tangents of meshes.
    pub fn needs_tangents(&self) -> bool {
        self.normal_texture.is_some() || self.anisotropy.is_seen()
    }

    /// Returns true if texels below a cut-off are discarded.
    pub fn is_masked(&self) -> bool {
        matches!(self.alpha_mode, AlphaMode::Mask { .. })
    }

    /// Returns true if surfaces behind it show through.
    pub fn is_transparent(&self) -> bool {
        matches!(self.alpha_mode, AlphaMode::Blend | AlphaMode::Glass | AlphaMode::Coat)
    }

    /// Returns true if it emits light.
    pub fn is_emissive(&self) -> bool {
        self.emissive.max_element() > 0.0
    }
}
