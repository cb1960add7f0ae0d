//! Parameters of the lobes that a material may have beside its base and its highlight.

use glam::Vec3;

/// Fibres that stand on a surface, as on velvet (KHR_materials_sheen): a lobe of its own over base and highlight. Cook-Torrance materials alone have it.
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

impl Default for Sheen {
    fn default() -> Self {
        Self::NONE
    }
}
