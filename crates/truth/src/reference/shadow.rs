//! The visibility of a light from a surface: rays to the light, in f64.
//!
//! A ray begins a little above the visible triangle, on its visible side, and meets every triangle, that one too. So a triangle stops light that
//! comes from behind it, even where its interpolated normal faces the light: on a coarse sphere shadow begins at whole faces, as in the renderer's
//! shadow maps, which have these faces dark, too. Objects that cast no shadow do not stop light. Where the surface lets light through, rays to lights
//! behind it begin on its other side.
//!
//! A light with a size is a disc of its radius around its place that faces the receiver; a directional one is a disc of its angular diameter. The
//! share of the disc that is not blocked is the share of light that arrives; shading treats the light as if it had no size. (A ball of the radius is
//! wider than the disc by (radius / distance)^2 / 2, which is left out.)

use glam::{DVec2, DVec3};

use super::geometry::{Geometry, Hit};
use super::intersect::Ray;
use super::light::to_light;
use super::surface::ShadingPoint;
use afterlight_scene::Light;

/// The height above its triangle at which a ray begins, in units of the last place of the coordinates' size: places are sums and products of
/// a few of them.
const LIFT: f64 = 256.0 * f64::EPSILON;

/// A place from which rays to lights begin.
#[derive(Debug, Clone, Copy)]
pub struct Receiver {
    /// World position on the triangle.
    place: DVec3,
    /// A point above it, on the visible side.
    pub start: DVec3,
}

impl Receiver {
    /// Returns the receiver where `ray`, from the eye, meets a surface.
    pub fn of(geometry: &Geometry, hit: &Hit, ray: &Ray) -> Self {
        let [a, b, c] = geometry.triangles[hit.triangle].corners;
        let place = ray.at(hit.crossing.distance);
        let plane = (b - a).cross(c - a).normalize_or_zero();
        let side = if hit.crossing.counter_clockwise { plane } else { -plane };
        let size = [a, b, c, place, ray.origin].into_iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        Self { place, start: place + side * (size * LIFT) }
    }

    /// Returns the receiver on the other side of the triangle.
    #[must_use]
    pub fn behind(&self) -> Self {
        Self { start: self.place + (self.place - self.start), ..*self }
    }

    /// Returns the receiver on the side at which the light arrives, if the surface lets light through.
    #[must_use]
    pub fn towards(&self, light: &Light, surface: &ShadingPoint) -> Self {
        let is_behind = || surface.normal.dot(to_light(light, self.place).0) < 0.0;
        if surface.lobes.transmits() && is_behind() { self.behind() } else { *self }
    }

    /// A place on no triangle.
    pub fn floating(place: DVec3) -> Self {
        Self { place, start: place }
    }

    /// A ray from there on; `None` for directions into the triangle.
    pub fn leaving(&self, direction: DVec3) -> Option<Ray> {
        ((self.start - self.place).dot(direction) > 0.0).then(|| Ray::new(self.start, direction))
    }

    /// Returns true if light from a point of the disc arrives; `on_disc` is in the unit circle.
    pub fn sees(&self, geometry: &Geometry, light: &Light, on_disc: DVec2) -> bool {
        self.way_to(light, on_disc).is_none_or(|(ray, limit)| !geometry.is_blocked(&ray, limit))
    }

    /// The ray to a point of the disc, and how far along it the light is; `None` in the middle of the light.
    pub fn way_to(&self, light: &Light, on_disc: DVec2) -> Option<(Ray, f64)> {
        let (towards, distance) = to_light(light, self.place);
        if distance == 0.0 {
            return None;
        }
        let is_parallel = light.kind.form().is_parallel();
        let radius = if is_parallel { (light.size.to_radians() * 0.5).tan() } else { light.size / distance };
        let direction = moved(towards, on_disc * radius);
        let (direction, limit) = match distance.is_infinite() {
            true => (direction, f64::INFINITY),
            // To the light and no further; from the start, which is a hair nearer.
            false => (self.place + direction * distance - self.start, 1.0),
        };
        Some((Ray::new(self.start, direction), limit))
    }
}

/// A unit vector, moved across itself.
fn moved(direction: DVec3, by: DVec2) -> DVec3 {
    if by == DVec2::ZERO {
        return direction;
    }
    let (x, y) = direction.any_orthonormal_pair();
    direction + x * by.x + y * by.y
}
