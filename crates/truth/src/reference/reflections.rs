//! Reflections of surfaces in smooth ones: one bounce, by rays.
//!
//! The lobe of Cook-Torrance looks along directions distributed like its visible facets (Heitz 2018). The first opaque surface that a direction meets
//! shines as it does for an eye there: by lights with their shadows, ambient light, the sky and its own emission, but it mirrors nothing itself. The
//! light of this surface replaces the sky and ambient light for the share of the lobe that meets a surface. Light that facets scatter again is taken
//! from the lobe's directions, too, by the share that [`super::sky`] has of it. Transparent surfaces mirror nothing and are not met.
//!
//! Surfaces mirror less from four fifths of the roughest on, and rougher ones nothing: a part of the model, as frames have it.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::fingerprint::Fingerprint;
use super::geometry::Hit;
use super::intersect::Ray;
use super::light::{self, Collector, Reflector};
use super::render::{Points, Reference};
use super::shadow::Receiver;
use super::sky::{self, visible_facet};
use super::{ShadingPoint, Smith, SurfaceLobes, sampling};
use afterlight_scene::{Brdf, Scene};

/// Directions of a point that is computed by itself.
const DIRECTIONS: u32 = 256;
/// Directions of each of a pixel's many samples.
const DIRECTIONS_OF_A_SAMPLE: u32 = 4;

/// Adds the greatest roughness of surfaces that mirror others.
pub(super) fn hash(roughest: f64, fingerprint: &mut Fingerprint) {
    fingerprint.bytes(b"reflections");
    fingerprint.real(roughest);
}

/// A direction that a lobe looks along.
#[derive(Debug, Clone, Copy)]
pub struct Mirrored {
    /// Unit vector.
    pub direction: DVec3,
    /// The share that is not masked on the way out, 0 to 1; its mean over the directions is the lobe's share of even light where nothing is absorbed.
    pub share: f64,
    /// Schlick's Fresnel.
    pub fresnel: DVec3,
}

/// Returns the share of reflections that a surface takes from others, 0 to 1; surfaces rougher than `roughest` take none.
pub fn smooth_enough(roughness: f64, roughest: f64) -> f64 {
    let edge = if roughness <= roughest { 1e-3 } else { 0.0 };
    ((roughest - roughness) / (0.2 * roughest).max(1e-6) + edge).clamp(0.0, 1.0)
}

/// The direction that a point of the unit square stands for; `None` where the facet mirrors into the surface.
pub fn mirrored(lobe: &Collector, point: DVec2) -> Option<Mirrored> {
    let (x, y) = lobe.normal.any_orthonormal_pair();
    let view = DVec3::new(lobe.view.dot(x), lobe.view.dot(y), lobe.n_dot_v).normalize();
    let half = visible_facet(view, point, lobe.roughness);
    let v_dot_h = view.dot(half);
    let out = half * (2.0 * v_dot_h) - view;
    if out.z <= 0.0 {
        return None;
    }
    let alpha2 = lobe.roughness.powi(4);
    // Smith's term of a direction over its cosine.
    let hidden = |cosine: f64| (cosine * cosine + alpha2 * (1.0 - cosine * cosine)).sqrt() / cosine;
    let grazing = (1.0 - v_dot_h).clamp(0.0, 1.0).powi(5);
    Some(Mirrored {
        direction: (x * out.x + y * out.y + lobe.normal * out.z).normalize(),
        share: (hidden(view.z) + 1.0) / (hidden(view.z) + hidden(out.z)),
        fresnel: lobe.specular + (DVec3::splat(lobe.grazing) - lobe.specular) * grazing,
    })
}

/// Returns the mirrored light of the directions that meet a surface, and the share of the lobe that does. `met` returns the light along a direction,
/// in any unit, and its weight, 0 to 1.
pub fn gathered(
    lobe: &Collector,
    points: &[DVec2],
    met: &mut dyn FnMut(DVec3) -> Option<(DVec3, f64)>,
) -> (DVec3, f64) {
    let (mut light, mut share, mut all) = (DVec3::ZERO, 0.0, 0.0);
    for own in points.iter().filter_map(|&point| mirrored(lobe, point)) {
        all += own.share;
        if let Some((radiance, confidence)) = met(own.direction) {
            light += own.fresnel * radiance * (own.share * confidence);
            share += own.share * confidence;
        }
    }
    if all <= 0.0 {
        return (DVec3::ZERO, 0.0);
    }
    let mean = lobe.specular + (DVec3::splat(lobe.grazing) - lobe.specular) / 21.0;
    let missing = 1.0 - even_share(lobe.n_dot_v, lobe.roughness);
    // The mean includes the directions into the surface.
    (light / points.len() as f64 / (DVec3::ONE - mean * missing), share / all)
}

/// The points of the unit square that stand for all directions.
pub fn all_points() -> Vec<DVec2> {
    (0..DIRECTIONS).map(sky::spread).collect()
}

/// The share of even light that a lobe mirrors once where nothing is absorbed.
fn even_share(n_dot_v: f64, roughness: f64) -> f64 {
    static TABLE: OnceLock<Vec<DVec2>> = OnceLock::new();
    sky::tabulated(TABLE.get_or_init(sky::shares_table), n_dot_v, roughness).element_sum()
}

/// Returns the part of a surface's ambient light that its lobe mirrors, of both half-spheres: reflections replace it.
pub fn ambient_lobe(scene: &Scene, surface: &ShadingPoint) -> DVec3 {
    light::mirrored_ambient(surface, &scene.environment) * surface.occlusion
}

impl Reference<'_> {
    /// Returns the change of a visible opaque surface's light by reflections of others: their light, less the light that it replaces.
    pub(super) fn mirrored(
        &self,
        hit: &Hit,
        (ray, along): (&Ray, Option<DVec3>),
        smith: Smith,
        points: Points,
    ) -> DVec3 {
        let Some(roughest) = self.effects.reflections else { return DVec3::ZERO };
        let (surface, _) = self.surface_of(hit, ray);
        // The rays stand for the highlight alone, as if the surface had no other lobe.
        let surface = ShadingPoint { ray: along, lobes: SurfaceLobes::NONE, ..surface };
        let amount = smooth_enough(surface.roughness, roughest);
        if surface.brdf != Brdf::CookTorrance || amount <= 0.0 {
            return DVec3::ZERO;
        }
        let lobe = Reflector::<f64>::new(&surface, smith).collector();
        let receiver = Receiver::of(self.geometry(), hit, ray);
        let chosen = match points {
            Points::All => all_points(),
            Points::One { sample, pixel } => (0..DIRECTIONS_OF_A_SAMPLE)
                .map(|index| sampling::on_lobe(sample * DIRECTIONS_OF_A_SAMPLE + index, pixel))
                .collect(),
        };
        let mut met = |direction: DVec3| {
            let bounced = receiver.leaving(direction)?;
            let hit = self.geometry().seen(&bounced, 0.0, &mut Vec::new())?;
            // Each direction has few shadow rays, because it is one of many.
            let points = match points {
                Points::All => {
                    Points::One { sample: 0, pixel: sampling::hash(direction.x.to_bits() ^ direction.y.to_bits()) }
                }
                one => one,
            };
            Some((self.shown(&hit, (&bounced, None), smith, points, DVec3::ZERO), 1.0))
        };
        let (light, share) = gathered(&lobe, &chosen, &mut met);
        // Rays to the sky have left out its hidden part already: only a sky without such rays is replaced.
        let open_sky = self.visible_sky(hit, ray, &surface, points).filter(|own| own.is_open());
        let sky = open_sky.map_or(DVec3::ZERO, |own| own.lobe(&lobe) * surface.occlusion);
        (light - (ambient_lobe(self.scene, &surface) + sky) * share) * amount
    }

    /// Returns the place, relative to the camera, at which a direction from the opaque surface at a place of the picture meets another; `None` where
    /// it meets none.
    pub fn met(&self, view: &super::CameraView, pixel: DVec2, direction: DVec3) -> Option<DVec3> {
        let lens = super::rays::CameraRays::of(view);
        let ray = lens.ray(pixel);
        let hit = self.geometry().seen(&ray, view.camera.near, &mut Vec::new())?;
        let bounced = Receiver::of(self.geometry(), &hit, &ray).leaving(direction)?;
        let next = self.geometry().seen(&bounced, 0.0, &mut Vec::new())?;
        Some(bounced.at(next.crossing.distance) - view.camera.position)
    }
}
