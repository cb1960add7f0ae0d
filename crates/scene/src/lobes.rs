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

/// The least roughness of a sheen. The distribution has 1 / alpha, and below this the fit of its visibility reflects more than twice the light that arrives at grazing angles.
pub const MIN_SHEEN_ROUGHNESS: f32 = 0.07;

impl Sheen {
    /// A surface without fibres.
    pub const NONE: Self = Self { color: Vec3::ZERO, roughness: 0.0 };

    /// Returns true if it scatters any light.
    pub fn is_seen(&self) -> bool {
        self.color.max_element() > 0.0
    }
}

/// A thin film on a surface, as of oil or on a soap bubble, that reflects each colour at other angles (KHR_materials_iridescence). Cook-Torrance materials alone have it.
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

/// Grooves along a surface, as of brushed metal, that stretch its highlight (KHR_materials_anisotropy). Cook-Torrance materials alone have them, and meshes with tangents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anisotropy {
    /// From the material's roughness along the grooves to fully rough across: 0 to 1; 0 is no anisotropy.
    pub strength: f32,
    /// The direction of greater roughness: counter-clockwise from the tangent towards the bitangent, in radians.
    pub rotation: f32,
}

impl Anisotropy {
    /// As rough in each direction.
    pub const NONE: Self = Self { strength: 0.0, rotation: 0.0 };

    /// Returns true if the highlight is stretched.
    pub fn is_seen(&self) -> bool {
        self.strength > 0.0
    }
}

impl Default for Anisotropy {
    fn default() -> Self {
        Self::NONE
    }
}

impl Default for Sheen {
    fn default() -> Self {
        Self::NONE
    }
}
