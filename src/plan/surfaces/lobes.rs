//! The lobes that a surface is drawn with beside its base and its highlight.

use super::SurfaceRules;
use crate::plan::Shading;
use crate::scene::{Brdf, Material, TextureSlot, Transparency};

/// Lobes, a bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct LobeMask(u8);

impl LobeMask {
    /// No lobe beside the usual ones.
    pub const NONE: Self = Self(0);
    /// [`Material::sheen`].
    pub const SHEEN: Self = Self(1);
    /// [`Material::film`].
    pub const FILM: Self = Self(2);
    /// [`Material::anisotropy`].
    pub const GROOVES: Self = Self(4);
    /// [`Material::refraction`].
    pub const GLASS: Self = Self(8);
    /// [`Material::diffuse_transmission`].
    pub const DIFFUSE_TRANSMISSION: Self = Self(16);

    /// Returns true if it has all lobes of the other one.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns true if it has none.
    pub fn is_empty(self) -> bool {
        self == Self::NONE
    }

    fn of(material: &Material, model: Brdf) -> Self {
        let own = [
            (material.sheen.is_seen(), Self::SHEEN),
            (material.film.is_seen(), Self::FILM),
            (material.anisotropy.is_seen(), Self::GROOVES),
            (material.refracts(model).is_some(), Self::GLASS),
            (material.diffuse_transmission.is_seen(), Self::DIFFUSE_TRANSMISSION),
        ];
        let own = own.into_iter().filter(|(seen, _)| *seen && material.has_lobes(model));
        own.fold(Self::NONE, |all, (_, lobe)| Self(all.0 | lobe.0))
    }
}

/// Returns true if frames with this shading draw lobes. The view of the light alone has no material, and textbooks' models are the usual ones.
pub(in crate::plan) fn are_drawn(shading: Shading, textbook: bool) -> bool {
    shading == Shading::Light { light_only: false } && !textbook
}

impl SurfaceRules<'_> {
    /// The lobes that a material is drawn with.
    pub(crate) fn lobes_of(&self, material: &Material) -> LobeMask {
        // Sums have no variant with lobes: FORWARD's shader would have 30 variants more, each with the code of all lobes.
        let summed = material.is_transparent() && self.transparency == Some(Transparency::Oit);
        match self.lobes && !summed {
            true => LobeMask::of(material, self.brdf(material)),
            false => LobeMask::NONE,
        }
    }

    /// Returns true if a material is drawn with the lobe that looks at a slot.
    pub(super) fn has_lobe_of(&self, material: &Material, slot: TextureSlot) -> bool {
        let lobe = match slot {
            TextureSlot::Sheen => LobeMask::SHEEN,
            TextureSlot::Film if self.lobes_of(material).contains(LobeMask::GLASS) => LobeMask::GLASS,
            TextureSlot::Film => LobeMask::FILM,
            TextureSlot::Anisotropy => LobeMask::GROOVES,
            TextureSlot::DiffuseTransmission => LobeMask::DIFFUSE_TRANSMISSION,
            _ => return false,
        };
        self.lobes_of(material).contains(lobe)
    }
}
