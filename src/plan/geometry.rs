//! Which pipelines draw surfaces and which vertex attributes they read.

use super::{FramePlan, Shading};
use crate::scene::{AlphaMode, Brdf, Object, Scene, Settings, TextureSlot, View};

/// The texture slots that a material fills, a bit each in the order of [`TextureSlot`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct TextureMask(u8);

impl TextureMask {
    pub fn contains(self, slot: TextureSlot) -> bool {
        self.0 & (1 << slot as u8) != 0
    }

    pub fn with(self, slot: TextureSlot) -> Self {
        Self(self.0 | 1 << slot as u8)
    }

    pub fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// How a surface goes with what lies behind it; the numbers are those of `shaders/forward.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Opacity {
    Hides = 0,
    Blend = 1,
    Glass = 2,
}

/// What sets pipelines apart that light surfaces while they draw them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ForwardKey {
    pub brdf: Brdf,
    pub opacity: Opacity,
    pub emissive: bool,
}

/// All that sets one pipeline for surfaces apart from another within a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GeometryKey {
    /// Only slots that this plan samples.
    pub textures: TextureMask,
    pub masked: bool,
    pub two_sided: bool,
    /// The transform swaps left and right, and with them front and back.
    pub mirrored: bool,
    /// Stores a shininess, not a roughness.
    pub phong: bool,
    /// Shadows fall on it; always where there are none.
    pub receives: bool,
    /// What is lit as it is drawn; none for what goes into the G-buffer.
    pub forward: Option<ForwardKey>,
}

impl GeometryKey {
    pub(super) fn of(scene: &Scene, object: &Object, settings: &Settings, plan: &FramePlan) -> Self {
        let material = &scene.materials[object.material];
        let brdf = settings.brdf.unwrap_or(material.brdf);
        let phong = matches!(brdf, Brdf::Phong | Brdf::BlinnPhong);
        let masked = material.is_masked();
        let counting = plan.shading == Shading::ShowOverdraw;
        let forward = (material.is_transparent() || plan.is_forward()).then(|| ForwardKey {
            brdf,
            opacity: match material.alpha_mode {
                AlphaMode::Opaque | AlphaMode::Mask { .. } => Opacity::Hides,
                AlphaMode::Blend => Opacity::Blend,
                AlphaMode::Glass => Opacity::Glass,
            },
            emissive: settings.view == View::Final && material.is_emissive(),
        });
        let emissive = forward.map_or(plan.emissive && material.is_emissive(), |forward| forward.emissive);
        let wanted = |slot| match slot {
            TextureSlot::BaseColor => !counting || masked,
            TextureSlot::Normal => !counting,
            TextureSlot::MetallicRoughness => !counting && !phong && brdf != Brdf::Lambert,
            // Albedo's alpha takes it in either case; only the ambient light looks at it.
            TextureSlot::Occlusion => !counting && plan.lights.ambient,
            TextureSlot::Emissive => emissive,
            TextureSlot::Specular => !counting && phong,
        };
        let needs_roughness = matches!(settings.view, View::Metallic | View::Roughness) && !phong;
        let textures = material
            .textures()
            .filter(|&(slot, _)| wanted(slot) || (needs_roughness && slot == TextureSlot::MetallicRoughness))
            .fold(TextureMask::default(), |mask, (slot, _)| mask.with(slot));
        Self {
            textures,
            // Without a texture alpha is the same all over: the object is drawn whole, or not at all (World leaves it out).
            masked: masked && textures.contains(TextureSlot::BaseColor),
            two_sided: material.two_sided,
            mirrored: object.transform.matrix3.determinant() < 0.0,
            phong,
            receives: object.receives_shadow || plan.shadow.is_none(),
            forward,
        }
    }
}

/// Vertex attributes besides positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Streams {
    pub normals: bool,
    pub uvs: bool,
    pub tangents: bool,
}

impl Streams {
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            normals: self.normals || other.normals,
            uvs: self.uvs || other.uvs,
            tangents: self.tangents || other.tangents,
        }
    }

    /// Bytes of a vertex.
    pub fn bytes(&self) -> u64 {
        12 + 12 * u64::from(self.normals) + 8 * u64::from(self.uvs) + 16 * u64::from(self.tangents)
    }
}
