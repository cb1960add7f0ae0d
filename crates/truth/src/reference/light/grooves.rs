//! The stretched highlight of grooves along a surface (KHR_materials_anisotropy): GGX with two roughnesses, after Burley, "Physically Based Shading at
//! Disney", 2012, and Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014.

use glam::DVec3;
use nalgebra::Vector3;

use super::real::{Real, unit, vector, widened};
use crate::reference::SurfaceLobes;

/// Grooves of a surface with a normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grooves {
    /// The direction of greater roughness and the one across it, in the surface, of length 1.
    axes: [DVec3; 2],
    /// Alpha of either.
    alphas: [f64; 2],
}

impl Grooves {
    /// `None` where the highlight is as wide in each direction, or the direction of the grooves is the normal's.
    pub fn of(lobes: &SurfaceLobes, normal: DVec3, roughness: f64) -> Option<Self> {
        let flat = lobes.across - normal * normal.dot(lobes.across);
        let across = flat.try_normalize().filter(|_| lobes.anisotropy > 0.0 && flat.length_squared() > 1e-12)?;
        let alpha = roughness * roughness;
        let wide = alpha + (1.0 - alpha) * lobes.anisotropy * lobes.anisotropy;
        Some(Self { axes: [across, normal.cross(across)], alphas: [wide, alpha] })
    }

    /// D V for light from a direction.
    pub fn microfacets<R: Real>(
        &self,
        (normal, view, n_dot_v): (&Vector3<R>, &Vector3<R>, R),
        light: &Vector3<R>,
    ) -> R {
        let Some(half) = unit(&(light + view)) else { return R::zero() };
        let axes = self.axes.map(vector::<R>);
        let [wide, narrow] = self.alphas.map(R::of);
        let [x, y] = [axes[0].dot(&half) / wide, axes[1].dot(&half) / narrow];
        let z = normal.dot(&half);
        let spread = x * x + y * y + z * z;
        let distribution = R::one() / (R::PI() * wide * narrow * spread * spread);
        // The stretched length of a direction.
        let root = |direction: &Vector3<R>, z: R| {
            let [x, y] = [axes[0].dot(direction) * wide, axes[1].dot(direction) * narrow];
            (x * x + y * y + z * z).sqrt()
        };
        let n_dot_l = normal.dot(light);
        let masked = n_dot_l * root(view, n_dot_v) + n_dot_v * root(light, n_dot_l);
        distribution * R::of(0.5) / masked
    }

    /// Turns a half vector of an isotropic highlight about +Z, as wide as this one is along its grooves, into one of this highlight.
    pub fn stretched(&self, facet: DVec3, normal: DVec3) -> DVec3 {
        let [wide, narrow] = self.alphas;
        (self.axes[0] * (facet.x * wide / narrow) + self.axes[1] * facet.y + normal * facet.z).normalize()
    }

    /// Returns the density, per steradian of half vectors, with which [`Self::stretched`] gives one.
    pub fn density(&self, half: DVec3, normal: DVec3) -> f64 {
        let [wide, narrow] = self.alphas;
        let [x, y, z] = [self.axes[0].dot(half) / wide, self.axes[1].dot(half) / narrow, normal.dot(half)];
        z / (std::f64::consts::PI * wide * narrow * (x * x + y * y + z * z).powi(2))
    }
}

/// Returns the grooves of a surface whose normal and roughness are in either precision.
pub(super) fn grooves<R: Real>(lobes: &SurfaceLobes, normal: &Vector3<R>, roughness: R) -> Option<Grooves> {
    Grooves::of(lobes, widened(*normal), roughness.wide())
}
