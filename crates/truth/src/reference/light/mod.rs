//! The light model: a surface's radiance towards the eye, from the formulas, in single or double precision.
//!
//! Guards and limits are part of the model and are named constants here: least roughness, least cosine to the view, least distance. The model
//! leaves out shadows (the caller's visibility), the light behind transparent surfaces, and exposure.

mod ambient;
mod brdf;
mod falloff;
mod film;
mod grooves;
mod real;
mod sheen;
#[cfg(test)]
mod tests;
mod transmission;

pub use brdf::{Collector, DIELECTRIC, MIN_N_DOT_V, MIN_PHONG_COSINE, MIN_ROUGHNESS, Reflectance, Reflector};
pub use falloff::{MIN_CONE, MIN_DISTANCE, MIN_POLYNOMIAL, arriving, to_light, weakened};
pub use film::interference;
pub use real::Real;
pub(super) use real::{vector, widened};
pub use sheen::{MIN_SHEEN_ROUGHNESS, sheen_share, summed_sheen_share};

use glam::DVec3;
use nalgebra::Vector3;

use super::{ShadingPoint, Smith, SurfaceLobes};
use afterlight_scene::{Environment, Light};

/// The light that reaches a surface.
#[derive(Clone, Copy)]
pub struct Illumination<'a> {
    /// Numbered in this order for `visibility`.
    pub lights: &'a [Light],
    /// Ambient light, before a surface's own occlusion; the background does not count.
    pub environment: &'a Environment,
    /// The share of ambient light that other surfaces leave, 0 to 1; `sky` takes its own occlusion into account.
    pub open: f64,
    /// Share of ambient light that other surfaces leave at the back of the surface, 0 to 1.
    pub open_behind: f64,
    /// The camera's place in the world: surfaces' positions are relative to it.
    pub eye: DVec3,
    /// Light of the sky beside the ambient light; occlusion reduces it as well.
    pub sky: Option<&'a dyn Collects>,
    /// Masking and shadowing function of the Cook-Torrance lobe.
    pub smith: Smith,
}

/// Light that surfaces collect from all directions that they face.
pub trait Collects: Sync {
    /// Returns the light that a surface's base and lobe reflect to the eye, in nits.
    fn collected(&self, surface: &Collector) -> [DVec3; 2];
}

/// Radiance towards the eye in nits, in two parts, as [`AlphaMode::Glass`](afterlight_scene::AlphaMode::Glass) needs it:
/// glass shows `body * alpha + shine` over the light behind it times 1 - alpha. Everything else shows the sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radiance {
    /// The light that the base reflects and lets through, of lights and ambient light.
    pub body: DVec3,
    /// The light that the lobes reflect and the surface emits.
    pub shine: DVec3,
}

/// Returns a surface's radiance towards the eye, in nits: ambient light, emission and each light.
///
/// `visibility(i)` is the share of light number `i` that arrives, 0 to 1 of each colour. It is asked only where that light would add something, casts
/// shadows, and the surface receives them.
pub fn radiance<R: Real>(
    surface: &ShadingPoint,
    illumination: &Illumination,
    visibility: &mut dyn FnMut(usize) -> DVec3,
) -> DVec3 {
    let Radiance { body, shine } = split_radiance::<R>(surface, illumination, visibility);
    body + shine
}

/// Returns a surface's radiance in two parts, each finite and not negative.
pub fn split_radiance<R: Real>(
    surface: &ShadingPoint,
    illumination: &Illumination,
    visibility: &mut dyn FnMut(usize) -> DVec3,
) -> Radiance {
    let reflector = Reflector::<R>::new(surface, illumination.smith);
    let occlusion = R::of(surface.occlusion);
    let open = [illumination.open, illumination.open_behind].map(R::of);
    let [mut body, mut shine] = ambient::ambient(&reflector, illumination.environment, open);
    if let Some(sky) = illumination.sky {
        let [base, lobe] = sky.collected(&reflector.collector());
        body += vector::<R>(base);
        shine += vector::<R>(lobe);
    }
    let (mut body, mut shine) = (body * occlusion, shine * occlusion + vector(surface.emissive));
    for (index, light) in illumination.lights.iter().enumerate() {
        let Some(Reflectance { base, lobe }) = unshadowed(surface, &reflector, light, illumination.eye) else {
            continue;
        };
        let casts = light.casts_shadow && surface.receives_shadow;
        let visible = vector::<R>(if casts { visibility(index) } else { DVec3::ONE });
        body += base.component_mul(&visible);
        shine += lobe.component_mul(&visible);
    }
    Radiance { body: widened(body), shine: widened(shine) }
}

/// Returns the ambient light that the lobe mirrors, unoccluded, in nits: of the bare surface, without its other lobes.
pub fn mirrored_ambient(surface: &ShadingPoint, environment: &Environment) -> DVec3 {
    let bare = ShadingPoint { lobes: SurfaceLobes::NONE, ..*surface };
    let [_, lobe] = ambient::ambient(&Reflector::<f64>::new(&bare, Smith::default()), environment, [1.0; 2]);
    widened(lobe)
}

/// The share of light that a clear coat mirrors, by the angle to its normal: Schlick's Fresnel of a dielectric.
pub fn coat_share(surface: &ShadingPoint) -> f64 {
    let view = -surface.ray.unwrap_or(surface.position).normalize_or(-surface.normal);
    let n_dot_v = surface.normal.dot(view).max(MIN_N_DOT_V);
    DIELECTRIC + (1.0 - DIELECTRIC) * (1.0 - n_dot_v).max(0.0).powi(5)
}

/// Returns the light that a surface reflects of one light, or lets through, if nothing hides it, in nits; `None` where that is nothing: out of its range or cone,
/// or behind an opaque surface.
fn unshadowed<R: Real>(
    surface: &ShadingPoint,
    reflector: &Reflector<R>,
    light: &Light,
    eye: DVec3,
) -> Option<Reflectance<R>> {
    let arriving = falloff::arriving_at(light, eye, &vector(surface.position));
    let n_dot_l = reflector.normal.dot(&arriving.direction);
    let is_behind = n_dot_l < R::zero() && reflector.through != Vector3::zeros();
    if !is_behind && n_dot_l <= R::zero() || arriving.strength <= R::zero() {
        return None;
    }
    let intensity: Vector3<R> = real::color::<R>(light.color) * R::of(f64::from(light.intensity));
    let irradiance = intensity * (arriving.strength * n_dot_l.abs());
    let Reflectance { base, lobe } = match is_behind {
        true => Reflectance { base: reflector.transmit(&arriving.direction), lobe: Vector3::zeros() },
        false => reflector.reflect(&arriving.direction),
    };
    let (base, lobe) = (base.component_mul(&irradiance), lobe.component_mul(&irradiance));
    (base + lobe != Vector3::zeros()).then_some(Reflectance { base, lobe })
}
