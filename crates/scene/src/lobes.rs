//! Parameters of the lobes that a material may have beside its base and its highlight.

use glam::Vec3;

/// Sheen of fibres such as velvet (KHR_materials_sheen): a lobe over the base and the highlight. Only Cook-Torrance materials have one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheen {
    /// Share of the light that the fibres scatter, 0 to 1; black is no sheen.
    pub color: Vec3,
    /// Perceptual, 0 to 1; alpha of the distribution is its square. The model has at least [`MIN_SHEEN_ROUGHNESS`].
    pub roughness: f32,
}

/// The least roughness of a sheen. The distribution has 1 / alpha, and below this the fit of its visibility reflects more than twice the light that
/// arrives at grazing angles.
pub const MIN_SHEEN_ROUGHNESS: f32 = 0.07;

impl Sheen {
    /// A surface without fibres.
    pub const NONE: Self = Self { color: Vec3::ZERO, roughness: 0.0 };

    /// Returns true if it scatters any light.
    pub fn is_seen(&self) -> bool {
        self.color.max_element() > 0.0
    }
}

/// A thin film on a surface, as of oil or on a soap bubble, that reflects each colour at other angles (KHR_materials_iridescence). Only Cook-Torrance
/// materials have one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinFilm {
    /// Share of the film's reflectance in the surface's, 0 to 1; 0 is no film.
    pub strength: f32,
    /// Index of refraction, 1 and up.
    pub ior: f32,
    /// Minimum and maximum thickness in nanometres, at least 0: a black texel has the first, a white one the second. An untextured film has the maximum.
    pub nanometres: [f32; 2],
}

impl ThinFilm {
    /// A surface without a film.
    pub const NONE: Self = Self { strength: 0.0, ior: 1.3, nanometres: [100.0, 400.0] };

    /// Returns true if the film changes the reflection.
    pub fn is_seen(&self) -> bool {
        self.strength > 0.0 && self.nanometres != [0.0; 2]
    }
}

impl Default for ThinFilm {
    fn default() -> Self {
        Self::NONE
    }
}

/// Grooves along a surface, as of brushed metal, that stretch its highlight (KHR_materials_anisotropy). They need a Cook-Torrance material and a mesh
/// with tangents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anisotropy {
    /// The strength, 0 to 1: across the grooves the roughness goes from the material's own (0, no anisotropy) to fully rough (1).
    pub strength: f32,
    /// The direction of greater roughness: counter-clockwise from the tangent towards the bitangent, in radians.
    pub rotation: f32,
}

impl Anisotropy {
    /// No anisotropy: equally rough in all directions.
    pub const NONE: Self = Self { strength: 0.0, rotation: 0.0 };

    /// Returns true if the highlight is stretched.
    pub fn is_seen(&self) -> bool {
        self.strength > 0.0
    }
}

/// A thin surface, as a leaf or a lampshade, that lets a share of the light through diffusely (KHR_materials_diffuse_transmission): light that
/// arrives at its back leaves its front evenly. Only Cook-Torrance materials have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of the base that transmits in place of reflecting, 0 to 1; 0 is an opaque surface.
    pub strength: f32,
    /// Colour of the transmitted light, 0 to 1. Reflected light has the base colour.
    pub color: Vec3,
}

impl DiffuseTransmission {
    /// A surface that lets no light through.
    pub const NONE: Self = Self { strength: 0.0, color: Vec3::ONE };

    /// Returns true if the base reflects less because of it.
    pub fn is_seen(&self) -> bool {
        self.strength > 0.0
    }
}

impl Default for DiffuseTransmission {
    fn default() -> Self {
        Self::NONE
    }
}

impl Default for Anisotropy {
    fn default() -> Self {
        Self::NONE
    }
}

/// Refraction and absorption in glass (KHR_materials_transmission, KHR_materials_volume, KHR_materials_dispersion). Only Cook-Torrance materials of
/// [`AlphaMode::Glass`](crate::AlphaMode::Glass) have it: their transmission is 1 - alpha, tinted by the base colour once and blurred by the
/// roughness. Glass without it only fades the light from behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refraction {
    /// Index of refraction, 1 and up.
    pub ior: f32,
    /// Thickness of the body below the surface, in units of the mesh, at least 0. 0 is a thin wall, which bends no light.
    pub thickness: f32,
    /// Colour of white light after `distance` within the body, 0 to 1.
    pub color: Vec3,
    /// Metres, above 0; infinite where the body absorbs nothing.
    pub distance: f32,
    /// 20 over the Abbe number, at least 0; 0 bends all colours alike.
    pub dispersion: f32,
}

/// The largest dispersion: indices of refraction of red and blue stay at least 1.
pub const MOST_DISPERSION: f32 = 40.0;

/// In 1/m: nothing that is seen is left after a hundredth of a millimetre.
pub const MOST_ABSORPTION: f32 = 1e6;

impl Refraction {
    /// A thin wall of common glass.
    pub const THIN: Self =
        Self { ior: 1.5, thickness: 0.0, color: Vec3::ONE, distance: f32::INFINITY, dispersion: 0.0 };

    /// The indices of refraction of red, green and blue (KHR_materials_dispersion).
    pub fn iors(&self) -> [f32; 3] {
        let half = (self.ior - 1.0) * 0.025 * self.dispersion;
        [(self.ior - half).max(1.0), self.ior, self.ior + half]
    }

    /// How much of each colour a metre within the body absorbs, in 1/m: at most [`MOST_ABSORPTION`]. Nothing is absorbed in a thin wall.
    pub fn absorption(&self) -> Vec3 {
        if self.thickness <= 0.0 || self.distance.is_infinite() {
            return Vec3::ZERO;
        }
        self.color.map(|channel| match channel > 0.0 {
            true => (-channel.ln() / self.distance.max(1e-30)).clamp(0.0, MOST_ABSORPTION),
            false => MOST_ABSORPTION,
        })
    }
}

impl Default for Refraction {
    fn default() -> Self {
        Self::THIN
    }
}

impl Default for Sheen {
    fn default() -> Self {
        Self::NONE
    }
}
