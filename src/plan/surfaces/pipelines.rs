//! The pipelines that draw surfaces, and the vertex attributes that they read.

use std::fmt;

use super::{LobeMask, SurfaceRules};
use crate::plan::Shading;
use crate::scene::{AlphaMode, Brdf, Material, Object, OptionalPart, TextureSlot, UvMap, View};
use crate::shaders::forward::host as forward;

/// The texture slots that a material fills, a bit each in the order of [`TextureSlot`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct TextureMask(u16);

impl TextureMask {
    pub(crate) const BASE_COLOR: Self = Self(1 << TextureSlot::BaseColor as u8);

    /// Returns true if the bit of a slot is set.
    pub fn contains(self, slot: TextureSlot) -> bool {
        self.0 & (1 << slot as u8) != 0
    }

    pub(crate) fn with(self, slot: TextureSlot) -> Self {
        Self(self.0 | 1 << slot as u8)
    }

    /// As shaders have it.
    pub fn bits(self) -> u32 {
        u32::from(self.0)
    }

    /// Returns true if the material samples nothing.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    #[must_use]
    pub(crate) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The slots whose bits are set, in the order of [`TextureSlot`].
    pub fn slots(self) -> impl Iterator<Item = TextureSlot> {
        TextureSlot::ALL.into_iter().filter(move |&slot| self.contains(slot))
    }
}

/// The way in which a surface covers the one behind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum Opacity {
    /// Replaces it: opaque and masked materials.
    Hides = forward::HIDES,
    /// [`AlphaMode::Blend`].
    Blend = forward::BLEND,
    /// [`AlphaMode::Glass`].
    Glass = forward::GLASS,
    /// [`AlphaMode::Coat`].
    Coat = forward::COAT,
}

/// The key by which forward pipelines differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ForwardKey {
    /// [`Material::brdf`], or the override of the settings.
    pub brdf: Brdf,
    /// The opacity, from [`Material::alpha_mode`].
    pub opacity: Opacity,
    /// True if emission is added; false in views without emission.
    pub emissive: bool,
}

/// Rare attributes of vertices and instances, which need separate shader variants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Extras {
    /// Colours of vertices multiply the base colour and alpha.
    pub colors: bool,
    /// Vertex colours and instance tints also multiply the emitted light, as the surface is unlit.
    pub colored_light: bool,
    /// Textures use other coordinates than the mesh's first set, or may come to.
    pub uv_maps: bool,
    /// Some textures use the mesh's second coordinates.
    pub second_uvs: bool,
    /// Instances have looks: a tint, a selection flag, and a cell.
    pub looks: bool,
    /// Textures are atlases, and each instance shows a cell.
    pub cells: bool,
    /// The mesh is points and lines.
    pub strokes: bool,
}

impl Extras {
    /// Returns true if at least one extra is in use.
    pub fn any(self) -> bool {
        self.colors || self.uv_maps || self.looks || self.strokes
    }
}

/// The key by which surface pipelines differ within a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GeometryKey {
    /// The texture slots that this plan samples.
    pub textures: TextureMask,
    /// Each texture has a separate sampler, as their samplers differ.
    pub own_samplers: bool,
    /// Vertex colours and UV maps.
    pub extras: Extras,
    /// Discards fragments by the alpha of the base-colour texture, or of vertices.
    pub masked: bool,
    /// Compares alpha with the cut-off: for masked surfaces and, if that code is kept, for all opaque ones with a cut-off of 0.
    pub discards: bool,
    /// Draws back faces as well, with their normals turned.
    pub two_sided: bool,
    /// The transform swaps left and right, and with them front and back.
    pub mirrored: bool,
    /// Stores a shininess, not a roughness.
    pub phong: bool,
    /// Evaluates or stores an explicit dielectric reflectance, because its own is unusual or the G-buffer stores reflectance.
    pub reflectance: bool,
    /// The lobes beside base and highlight.
    pub lobes: LobeMask,
    /// Receives shadows; always true in plans without shadows.
    pub receives: bool,
    /// The forward lighting; none for surfaces that go into the G-buffer.
    pub forward: Option<ForwardKey>,
}

/// The names of the slots.
impl fmt::Display for TextureMask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.slots().map(|slot| format!("{slot:?}")).collect();
        f.pad(&names.join(" + "))
    }
}

impl FromIterator<TextureSlot> for TextureMask {
    fn from_iter<I: IntoIterator<Item = TextureSlot>>(slots: I) -> Self {
        slots.into_iter().fold(Self::default(), Self::with)
    }
}

impl ForwardKey {
    pub(super) fn of(material: &Material, rules: &SurfaceRules) -> Self {
        Self {
            brdf: rules.brdf(material),
            opacity: match material.alpha_mode {
                AlphaMode::Opaque | AlphaMode::Mask { .. } => Opacity::Hides,
                AlphaMode::Blend => Opacity::Blend,
                AlphaMode::Glass => Opacity::Glass,
                AlphaMode::Coat => Opacity::Coat,
            },
            emissive: shows_emission(material, rules),
        }
    }
}

impl GeometryKey {
    /// Returns true if its shader has code for extras. A shader with lobes always has it, which halves the number of variants.
    pub fn has_extras(&self) -> bool {
        self.extras.any() || self.forward.is_some() && !self.lobes.is_empty()
    }

    /// Returns true if a depth pre-pass would draw these surfaces.
    pub fn is_in_prepass(&self) -> bool {
        !self.masked && !self.extras.strokes
    }

    /// The key by which a surface of the G-buffer is lit once more, as it is drawn.
    pub(crate) fn relit(self, forward: Option<ForwardKey>) -> Option<Self> {
        forward.map(|own| Self { forward: Some(own), ..self })
    }

    pub(crate) fn of(object: &Object, rules: &SurfaceRules) -> Self {
        let material = rules.material(object);
        let brdf = rules.brdf(material);
        let forward = (material.is_transparent() || rules.forward).then(|| ForwardKey::of(material, rules));
        let textures = Self::own_textures(object, rules).union(Self::kept_textures(object, rules));
        let extras = Self::extras(object, textures, rules);
        let masked = material.is_masked() && (textures.contains(TextureSlot::BaseColor) || extras.colors);
        let keeps_masks = rules.keep.has(OptionalPart::AlphaMasks) && !material.is_transparent();
        Self {
            textures,
            own_samplers: rules.materials.samplers_differ(material, Self::own_textures(object, rules)),
            extras,
            masked,
            discards: masked || (keeps_masks && !textures.is_empty()),
            // The front of a stroke faces the camera.
            two_sided: material.two_sided && !extras.strokes,
            mirrored: object.transform.matrix3.determinant() < 0.0 && !extras.strokes,
            phong: is_phong(brdf),
            reflectance: brdf == Brdf::CookTorrance
                && if forward.is_some() { material.has_reflectance() } else { rules.reflectance },
            lobes: rules.lobes_of(material),
            receives: object.receives_shadow || rules.shadow.is_none(),
            forward,
        }
    }

    fn extras(object: &Object, textures: TextureMask, rules: &SurfaceRules) -> Extras {
        let material = rules.material(object);
        let moving = rules.materials.moving_maps.contains(&object.material);
        let maps = || textures.slots().map(|slot| material.uv_maps[slot as usize]);
        let colors = rules.is_colored(object) && (!rules.shading.only_covers() || material.is_masked());
        let cells = material.has_atlas() && !textures.is_empty();
        let says = rules.materials.looks.contains(&object.material) || rules.keep.has(OptionalPart::Looks);
        let looks = cells || says && !rules.shading.only_covers();
        Extras {
            looks,
            cells,
            colors,
            colored_light: (colors || looks) && rules.materials.emits_color(material),
            uv_maps: !textures.is_empty() && (moving || maps().any(|map| map != UvMap::IDENTITY)),
            second_uvs: maps().any(|map| map.set == 1),
            strokes: rules.is_strokes(object),
        }
    }

    /// The slots of an object's material that its pipeline samples.
    pub(super) fn own_textures(object: &Object, rules: &SurfaceRules) -> TextureMask {
        let material = rules.material(object);
        let counting = rules.shading.only_covers();
        let brdf = rules.brdf(material);
        let phong = is_phong(brdf);
        let shown = matches!(rules.shading, Shading::ShowGbuffer(View::Metallic | View::Roughness));
        let of_model = |slot: TextureSlot| !counting && slot.form().phong.is_none_or(|own| own == phong);
        let wanted = |slot| match slot {
            TextureSlot::BaseColor => !counting || material.is_masked(),
            TextureSlot::MetallicRoughness => of_model(slot) && (brdf != Brdf::Lambert || shown),
            TextureSlot::Occlusion => of_model(slot) && rules.ambient,
            TextureSlot::Emissive => shows_emission(material, rules),
            TextureSlot::Specular if brdf == Brdf::CookTorrance => {
                !counting && material.reflectance_texture().is_some()
            }
            lobe if lobe.is_of_lobe() => rules.has_lobe_of(material, lobe),
            _ => of_model(slot),
        };
        material.textures().map(|(slot, _)| slot).filter(|&slot| wanted(slot)).collect()
    }

    /// Slots that an object's pipeline samples because they are kept: all that its shader has code for.
    fn kept_textures(object: &Object, rules: &SurfaceRules) -> TextureMask {
        if rules.shading.only_covers() {
            return TextureMask::default();
        }
        let material = rules.material(object);
        let phong = is_phong(rules.brdf(material));
        let has_code = |slot| match slot {
            TextureSlot::MetallicRoughness => !phong,
            TextureSlot::Emissive if material.is_transparent() || rules.forward => shows_emission(material, rules),
            TextureSlot::Emissive => rules.emissive,
            lobe if lobe.is_of_lobe() => rules.has_lobe_of(material, lobe),
            _ => true,
        };
        // Tangents come with normal maps, so that grooves have a flat one where the material has none.
        let grooved = rules.lobes_of(material).contains(LobeMask::GROOVES);
        let is_kept = |slot: TextureSlot| rules.keep.has(slot.form().part) || grooved && slot == TextureSlot::Normal;
        TextureSlot::ALL.into_iter().filter(|&slot| has_code(slot) && is_kept(slot)).collect()
    }
}

fn is_phong(brdf: Brdf) -> bool {
    matches!(brdf, Brdf::Phong | Brdf::BlinnPhong)
}

/// Returns true if the pipeline of a material writes emitted light.
fn shows_emission(material: &Material, rules: &SurfaceRules) -> bool {
    let forward = material.is_transparent() || rules.forward;
    let is_final = rules.shading == Shading::Light { light_only: false };
    material.is_emissive() && if forward { is_final } else { rules.emissive }
}

/// Vertex attributes besides positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Streams {
    /// Three floats a vertex.
    pub normals: bool,
    /// Two floats a vertex.
    pub uvs: bool,
    /// Four floats a vertex; the last one is the sign of the bitangent.
    pub tangents: bool,
    /// Two floats a vertex.
    pub second_uvs: bool,
    /// Four floats a vertex.
    pub colors: bool,
}

impl Streams {
    #[must_use]
    pub(crate) fn union(self, other: Self) -> Self {
        Self {
            normals: self.normals || other.normals,
            uvs: self.uvs || other.uvs,
            tangents: self.tangents || other.tangents,
            second_uvs: self.second_uvs || other.second_uvs,
            colors: self.colors || other.colors,
        }
    }
}
