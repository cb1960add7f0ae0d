//! The Fresnel term of a thin film (KHR_materials_iridescence): Belcour and Barla, "A Practical Extension to Microfacet Theory for the Modeling of
//! Varying Iridescence", 2017, in the form of the extension: Schlick's Fresnel at both interfaces, no polarization, three orders of interference.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::reference::SurfaceLobes;

/// A thin film: its optics, the reflectances below it, and how it is mixed with the bare surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Film {
    strength: f64,
    ior: f64,
    nanometres: f64,
    /// Reflectance facing the eye of the surface below: of its dielectric share, and of its metallic one.
    below: [DVec3; 2],
    metallic: f64,
}

impl Film {
    /// Returns the film of these lobes; `None` without one.
    pub fn of(lobes: &SurfaceLobes, dielectric: DVec3, (albedo, metallic): (DVec3, f64)) -> Option<Self> {
        let SurfaceLobes { film, film_ior, film_nanometres, .. } = *lobes;
        // A film without thickness has no effect: it is faded in over the first 0.03 nm, where the formula still mixes two interfaces.
        let grown = (film_nanometres / 0.03).clamp(0.0, 1.0);
        let strength = film * grown * grown * (3.0 - 2.0 * grown);
        (strength > 0.0).then_some(Self {
            strength,
            ior: film_ior,
            nanometres: film_nanometres,
            below: [dielectric, albedo],
            metallic,
        })
    }

    /// The reflectance by the cosine between the view and the half vector, of a surface that has `bare` without the film.
    pub fn reflectance(&self, cosine: f64, bare: DVec3) -> DVec3 {
        let [dielectric, metal] = self.below.map(|below| interference(self.ior, self.nanometres, below, cosine));
        bare.lerp(dielectric.lerp(metal, self.metallic), self.strength)
    }

    /// The reflectance facing the eye that gives Schlick's Fresnel the film's at this angle; `facing` and `grazing` are the bare surface's.
    pub fn even(&self, n_dot_v: f64, facing: DVec3, grazing: f64) -> DVec3 {
        let share = (1.0 - n_dot_v).max(0.0).powi(5);
        let bare = facing + (DVec3::splat(grazing) - facing) * share;
        let seen = self.reflectance(n_dot_v, bare);
        // Grazing angles tell nothing of the reflectance facing the eye.
        let share = share.min(MOST_GRAZING);
        ((seen - DVec3::splat(grazing * share)) / (1.0 - share)).clamp(DVec3::ZERO, DVec3::ONE)
    }
}

/// The most of Schlick's grazing share that a film's reflectance facing the eye is found from.
const MOST_GRAZING: f64 = 0.9;

/// The reflectance of a film in air over a surface with a reflectance facing the eye.
pub fn interference(ior: f64, nanometres: f64, below: DVec3, cosine: f64) -> DVec3 {
    let inner2 = 1.0 - (1.0 - cosine * cosine) / (ior * ior);
    if inner2 < 0.0 {
        return DVec3::ONE;
    }
    let inner = inner2.sqrt();
    let (upper, passed) = {
        let upper = schlick(facing(ior, 1.0), cosine);
        (upper, 1.0 - upper)
    };
    // The phase shift is 0 for reflection at a denser medium, else pi.
    let phase_upper = if ior < 1.0 { 0.0 } else { PI };
    let path = 2.0 * ior * nanometres * inner;
    let channel = |below: f64| {
        let root = (below + 1e-4).min(0.9999).sqrt();
        let base = (1.0 + root) / (1.0 - root);
        (schlick(facing(base, ior), inner), phase_upper + if base < ior { PI } else { 0.0 })
    };
    let below = below.to_array().map(channel);
    let (lower, shift) = (DVec3::from(below.map(|own| own.0)), DVec3::from(below.map(|own| own.1)));
    let both = (lower * upper).clamp(DVec3::splat(1e-5), DVec3::splat(0.9999));
    let root = both.map(f64::sqrt);
    let returned = lower * passed * passed / (DVec3::ONE - both);
    let mut sum = returned + DVec3::splat(upper);
    let mut order = returned - DVec3::splat(passed);
    for number in [1.0, 2.0] {
        order *= root;
        sum += order * 2.0 * sensitivity(path * number, shift * number);
    }
    sum.max(DVec3::ZERO)
}

/// ((n1 - n2) / (n1 + n2))^2.
fn facing(inside: f64, outside: f64) -> f64 {
    ((inside - outside) / (inside + outside)).powi(2)
}

fn schlick(facing: f64, cosine: f64) -> f64 {
    facing + (1.0 - facing) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// The eye's sensitivities in the Fourier domain, as Gaussians (section 4 of the paper), by the path in nanometres, in linear Rec. 709. The numbers are the extension's.
fn sensitivity(path: f64, shift: DVec3) -> DVec3 {
    let phase = 2.0 * PI * path * 1e-9;
    let gauss = |value: f64, place: f64, variance: f64, shift: f64| {
        value * (2.0 * PI * variance).sqrt() * (place * phase + shift).cos() * (-phase * phase * variance).exp()
    };
    let x = gauss(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + gauss(9.7470e-14, 2.2399e6, 4.5282e9, shift.x);
    let y = gauss(4.4201e-13, 1.7953e6, 9.3046e9, shift.y);
    let z = gauss(5.2481e-13, 2.2084e6, 6.6121e9, shift.z);
    let to_rgb = DMat3::from_cols_array(&[
        3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.0415560, 1.0572252,
    ]);
    to_rgb * (DVec3::new(x, y, z) / 1.0685e-7)
}
