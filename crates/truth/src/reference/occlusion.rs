//! Ambient occlusion by rays: the share of the light from everywhere that surfaces nearby leave to a point.
//!
//! The share is the mean over the hemisphere around the shading normal, weighted by the cosine, of each direction's share: 1 - [`hidden`] of the
//! distance to the nearest opaque surface, whichever side of it is met and whether or not it casts shadows. Rays begin a little above the visible
//! triangle, like rays to lights ([`super::shadow`]): if the normal is bent, directions below the triangle are blocked.

use glam::{DVec2, DVec3};

use super::fingerprint::Fingerprint;
use super::geometry::Geometry;
use super::intersect::Ray;
use super::sampling;

/// Rays of a point that is computed by itself. They are a net of 32 x 32 cells with a ray in each, so that only cells on an outline err, by a
/// variance of at most 1/4 each. A convex outline crosses at most 4 x 32 cells: the error is sqrt(128 / 4) / 1024 = .0055, a ninth of the bound that
/// docs/AO.md sets for a pass.
pub const RAYS: u32 = 1024;
/// Rays of each of a pixel's many samples: four samples are a net of 64.
const RAYS_OF_A_SAMPLE: u32 = 16;

/// The share of light that a surface so far away hides, where occlusion ends at `radius`: all of it when it touches, and smoothly nothing there.
pub fn hidden(distance: f64, radius: f64) -> f64 {
    (1.0 - (distance / radius).powi(2)).max(0.0)
}

/// Adds the radius.
pub(super) fn hash(radius: f64, fingerprint: &mut Fingerprint) {
    fingerprint.bytes(b"ambient occlusion");
    fingerprint.real(radius);
}

/// The rays to send.
#[derive(Debug, Clone, Copy)]
pub(super) enum RaySubset {
    /// [`RAYS`] of them.
    All,
    /// The rays of one sample of a pixel.
    Of { sample: u32, pixel: u64 },
}

/// The share of light from everywhere that arrives at `start`, a place above a surface with this unit normal.
pub(super) fn visibility(geometry: &Geometry, (start, normal): (DVec3, DVec3), radius: f64, rays: RaySubset) -> f64 {
    let (x, y) = normal.any_orthonormal_pair();
    let (first, count, pixel) = match rays {
        RaySubset::All => (0, RAYS, 0),
        RaySubset::Of { sample, pixel } => (sample * RAYS_OF_A_SAMPLE, RAYS_OF_A_SAMPLE, pixel),
    };
    let mut sum = 0.0;
    for index in first..first + count {
        let direction = cosine_weighted(sampling::on_hemisphere(index, pixel));
        let ray = Ray::new(start, x * direction.x + y * direction.y + normal * direction.z);
        sum += 1.0 - geometry.nearest_opaque(&ray, radius).map_or(0.0, |distance| hidden(distance, radius));
    }
    sum / f64::from(count)
}

/// From the unit disc up to the hemisphere above it: as dense as the cosine (Malley's method).
fn cosine_weighted(disc: DVec2) -> DVec3 {
    disc.extend((1.0 - disc.length_squared()).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight_scene::builtin::shapes::{self, MeshBuilder};
    use afterlight_scene::builtin::stage::SceneBuilder;
    use afterlight_scene::{Material, Scene};
    use std::f64::consts::PI;

    /// A floor in the plane y = 0, and something else.
    fn over_floor(other: MeshBuilder, transform: glam::DAffine3) -> Scene {
        let mut stage = SceneBuilder::default();
        let matt = stage.material(Material::default());
        stage.add("floor", shapes::plane([400.0; 2]), matt);
        let mesh = stage.mesh("other", other, matt);
        stage.place(mesh, matt, transform);
        stage.scene
    }

    fn on_floor(scene: &Scene, place: DVec3, radius: f64) -> f64 {
        visibility(&Geometry::of(scene), (place + DVec3::Y * 1e-9, DVec3::Y), radius, RaySubset::All)
    }

    /// All of a hemisphere's cosine lies over the unit disc, so that the share which something hides is an area of it. Of a ceiling at the height h
    /// with m = h / radius: V = m^2 (1 - 2 ln m).
    #[test]
    fn a_ceiling_leaves_what_its_integral_says() {
        for height in [0.05, 0.2, 0.5, 0.9, 0.999] {
            let scene = over_floor(shapes::plane([400.0; 2]), glam::DAffine3::from_translation(DVec3::Y * height));
            let (found, m) = (on_floor(&scene, DVec3::new(0.1, 0.0, 0.2), 1.0), height);
            let wanted = m * m * (1.0 - 2.0 * m.ln());
            assert!((found - wanted).abs() < 0.0055, "{height}: {found} {wanted}");
        }
    }

    /// Of an endless wall at the distance a with m = a / radius, which hides where x > m: 1 - V is the integral of 1 - (m / x)^2 there, over pi:
    /// ((1 + 2 m^2) acos m - 3 m sqrt(1 - m^2)) / pi. Half of the light where the wall begins.
    #[test]
    fn a_wall_leaves_what_its_integral_says() {
        let upright = glam::DAffine3::from_rotation_z(PI / 2.0);
        let scene = over_floor(shapes::plane([400.0; 2]), upright);
        for distance in [1e-6, 0.1, 0.5, 1.0, 1.9, 2.5] {
            let (m, radius) = (f64::min(distance / 2.0, 1.0), 2.0);
            let wanted = 1.0 - ((1.0 + 2.0 * m * m) * m.acos() - 3.0 * m * (1.0 - m * m).sqrt()) / PI;
            // The wall hides light with its front and with its back.
            for side in [1.0, -1.0] {
                let found = on_floor(&scene, DVec3::new(side * distance, 0.0, 0.3), radius);
                assert!((found - wanted).abs() < 0.0055, "{side} {distance}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn rays_of_samples_come_to_the_same_in_the_mean() {
        let scene = over_floor(shapes::sphere(0.5, 48), glam::DAffine3::from_translation(DVec3::Y * 0.5));
        let geometry = Geometry::of(&scene);
        let point = (DVec3::new(0.45, 1e-9, 0.1), DVec3::Y);
        let all = visibility(&geometry, point, 1.5, RaySubset::All);
        let some =
            (0..64).map(|sample| visibility(&geometry, point, 1.5, RaySubset::Of { sample, pixel: 77 })).sum::<f64>();
        assert!((some / 64.0 - all).abs() < 2.0 * 0.0055, "{} {all}", some / 64.0);
        assert!(all > 0.3 && all < 0.9);
    }

    #[test]
    fn what_hides_ends_at_the_radius() {
        assert_eq!([0.0, 1.0, 2.0, 9.0].map(|distance| hidden(distance, 2.0)), [1.0, 0.75, 0.0, 0.0]);
    }
}
