//! Surface descriptions.

use glam::Vec3;

/// A reflection model (docs/FORMULAS.md has the formulas; `shaders/shared/brdf.wgsl` is the code).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, PartialOrd, Ord)]
pub enum Brdf {
    /// GGX with height-correlated Smith, Schlick Fresnel and a lambert base.
    #[default]
    CookTorrance,
    /// (R.E)^n
    Phong,
    /// (N.H)^n
    BlinnPhong,
    /// Diffuse only.
    Lambert,
}

/// What alpha does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// A fragment whose alpha is below the cut-off is not there.
    Mask { cutoff: f32 },
    /// What the surface reflects and emits, times alpha, over what lies behind it: a thin cover, as gauze or smoke.
    Blend,
    /// Alpha is that of the body only: its diffuse light is times alpha, its highlights and what it emits are whole, and what lies
    /// behind is times 1 - alpha. So that a clear pane still shines.
    Glass,
}

/// The texture slots of a material, in the order of their descriptor bindings.
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
    /// Ks of the Phong models, sRGB colour.
    Specular,
}

impl TextureSlot {
    /// All slots, in order.
    pub const ALL: [Self; 6] =
        [Self::BaseColor, Self::Normal, Self::MetallicRoughness, Self::Occlusion, Self::Emissive, Self::Specular];
}

/// A material; factors multiply what the textures say. Colours are linear RGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// For messages and reports.
    pub name: String,
    /// The reflection model.
    pub brdf: Brdf,
    /// Albedo (Kd), 0 to 1.
    pub base_color: Vec3,
    /// Opacity, 0 to 1; all modes but `AlphaMode::Opaque` look at it.
    pub alpha: f32,
    pub alpha_mode: AlphaMode,
    /// 0 to 1.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1; alpha of GGX is its square.
    pub roughness: f32,
    /// Ks of the Phong models, 0 to 1.
    pub specular: Vec3,
    /// Ns of the Phong models, 0 and up.
    pub shininess: f32,
    /// Share of the ambient light that is reflected besides the albedo, 0 to 1: luminance of Ka over that of Kd. Only the
    /// Phong models look at it.
    pub ambient: f32,
    /// Emitted radiance in nits.
    pub emissive: Vec3,
    /// Scale of the normal map's X and Y.
    pub normal_scale: f32,
    /// Whether back faces are drawn, with their normals turned.
    pub two_sided: bool,
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
    /// Multiplies `specular`.
    pub specular_texture: Option<usize>,
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
            shininess: 0.0,
            ambient: 1.0,
            emissive: Vec3::ZERO,
            normal_scale: 1.0,
            two_sided: false,
            base_color_texture: None,
            normal_texture: None,
            metallic_roughness_texture: None,
            occlusion_texture: None,
            emissive_texture: None,
            specular_texture: None,
        }
    }
}

impl Material {
    /// The textures in use, by slot.
    pub fn textures(&self) -> impl Iterator<Item = (TextureSlot, usize)> {
        [
            (TextureSlot::BaseColor, self.base_color_texture),
            (TextureSlot::Normal, self.normal_texture),
            (TextureSlot::MetallicRoughness, self.metallic_roughness_texture),
            (TextureSlot::Occlusion, self.occlusion_texture),
            (TextureSlot::Emissive, self.emissive_texture),
            (TextureSlot::Specular, self.specular_texture),
        ]
        .into_iter()
        .filter_map(|(slot, texture)| texture.map(|texture| (slot, texture)))
    }

    /// The texture in a slot.
    pub fn texture(&self, slot: TextureSlot) -> Option<usize> {
        self.textures().find(|&(own, _)| own == slot).map(|(_, texture)| texture)
    }

    /// The texture slots, in the order of [`Material::textures`].
    pub fn texture_slots_mut(&mut self) -> [&mut Option<usize>; 6] {
        [
            &mut self.base_color_texture,
            &mut self.normal_texture,
            &mut self.metallic_roughness_texture,
            &mut self.occlusion_texture,
            &mut self.emissive_texture,
            &mut self.specular_texture,
        ]
    }

    /// Whether texels below a cut-off are left out.
    pub fn is_masked(&self) -> bool {
        matches!(self.alpha_mode, AlphaMode::Mask { .. })
    }

    /// Whether what lies behind shows through.
    pub fn is_transparent(&self) -> bool {
        matches!(self.alpha_mode, AlphaMode::Blend | AlphaMode::Glass)
    }

    /// Whether it emits light.
    pub fn is_emissive(&self) -> bool {
        self.emissive.max_element() > 0.0
    }
}
