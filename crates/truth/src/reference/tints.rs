//! Shadows of transparent surfaces: the share of light that they let through, along straight rays to the light. Refraction, and so caustics, are left out.

use glam::DVec3;

use super::intersect::Ray;
use super::refraction::Body;
use super::render::Reference;
use afterlight_scene::CastsShadow;

impl Reference<'_> {
    /// Share of light that surfaces on a ray leave.
    pub(super) fn left_by(&self, ray: &Ray, limit: f64) -> DVec3 {
        match self.geometry().is_blocked(ray, limit) {
            true => DVec3::ZERO,
            false if self.effects.tints => self.left_by_veils(ray, limit),
            false => DVec3::ONE,
        }
    }

    /// The share of light that transparent surfaces before `limit` let through, on a straight ray from a receiver to a light. Sides count as an eye
    /// at the light would see them. A blended surface lets 1 - alpha through; glass reflects a part at each surface, and a body of glass absorbs
    /// light along the way in it.
    pub(super) fn left_by_veils(&self, ray: &Ray, limit: f64) -> DVec3 {
        let stretch = ray.direction.length();
        let mut left = DVec3::ONE;
        // Metres of the ray within each body.
        let mut ways: Vec<(u32, Body, f64)> = Vec::new();
        for hit in self.geometry().veils(ray, limit) {
            let material = self.geometry().object(&hit).material;
            // A surface that shows its back to the receiver turns its front to the light.
            let enters = !hit.front;
            let body = self.body_of(&hit);
            let is_solid = body.is_some_and(|own| !own.is_thin);
            let is_front_alone = self.geometry().object(&hit).casts_shadow == CastsShadow::Front;
            let is_met = enters || !is_front_alone && (material.two_sided || is_solid);
            if !is_met && !is_solid {
                continue;
            }
            let (surface, _) = self.surface_of(&hit, ray);
            let open = 1.0 - surface.alpha;
            let Some(body) = body else {
                left *= open;
                continue;
            };
            let [a, b, c] = self.geometry().triangles[hit.triangle].corners;
            let cosine = ((b - a).cross(c - a).normalize_or_zero().dot(ray.direction) / stretch).abs().min(1.0);
            let facing = f64::from(material.reflectance.max_element());
            if is_met {
                left *= 1.0 - (facing + (1.0 - facing) * (1.0 - cosine).powi(5));
            }
            if enters || body.is_thin {
                left *= surface.albedo * ((1.0 - surface.metallic) * open);
            }
            if is_solid {
                let object = self.geometry().triangles[hit.triangle].id.object;
                let metres = hit.crossing.distance * stretch * if enters { 1.0 } else { -1.0 };
                match ways.iter_mut().find(|(own, ..)| *own == object) {
                    Some((.., way)) => *way += metres,
                    None => ways.push((object, body, metres)),
                }
            }
        }
        // A way below 0 has an end alone: the light is within the body.
        let whole = |way: f64| if way < 0.0 { way + limit * stretch } else { way };
        ways.into_iter().fold(left, |left, (_, body, way)| left * body.left_after(whole(way)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::refraction::tests::alone;
    use super::*;
    use crate::reference::Effects;
    use afterlight_scene::builtin::shapes;
    use afterlight_scene::{AlphaMode, Material, Refraction};
    use glam::Vec3;

    #[test]
    fn light_that_goes_straight_through_has_its_share_of_each_surface() {
        let blue = Vec3::new(0.3, 0.6, 0.9);
        let solid = Refraction { thickness: 0.3, color: blue, distance: 0.6, ..Refraction::THIN };
        let wall =
            Material { base_color: blue, alpha: 0.25, two_sided: true, ..Material::clear_glass(Refraction::THIN) };
        let veil = Material { alpha_mode: AlphaMode::Blend, alpha: 0.25, ..Material::default() };
        let both = Material { two_sided: true, ..veil.clone() };
        let block = || shapes::cuboid([1.0, 1.0, 0.6]);
        let kept = DVec3::splat(0.96 * 0.96);
        let tint = blue.as_dvec3() * 0.75;
        let cases = [
            ("a body", block(), Material::clear_glass(solid), kept * blue.as_dvec3()),
            ("a wall on both sides", block(), wall, kept * tint * tint),
            ("a veil on one side", block(), veil.clone(), DVec3::splat(0.75)),
            ("a veil on both", block(), both, DVec3::splat(0.75 * 0.75)),
            ("a coat", block(), Material { alpha_mode: AlphaMode::Coat, ..veil }, DVec3::ONE),
        ];
        for (name, mesh, material, expected) in cases {
            let scene = alone(mesh, material);
            let reference =
                Reference::new(&scene).expect("a scene").with_effects(Effects { tints: true, ..Effects::default() });
            let found = reference.left_by(&Ray::new(DVec3::Z * -2.0, DVec3::Z), 4.0);
            // A reflectance is in single precision.
            assert!((found - expected).abs().max_element() < 1e-7, "{name}: {found}, not {expected}");
        }
        let scene = alone(block(), Material::clear_glass(solid));
        let reference = Reference::new(&scene).expect("a scene");
        let ray = |limit| reference.left_by_veils(&Ray::new(DVec3::Z * -2.0, DVec3::Z * 2.0), limit);
        // A ray from within has the rest of the way through the glass before it, and one surface.
        let within = reference.left_by_veils(&Ray::new(DVec3::ZERO, DVec3::Z), f64::INFINITY);
        assert!((within - 0.96 * blue.as_dvec3().powf(0.5)).abs().max_element() < 1e-7, "{within}");
        assert_eq!(ray(0.5), DVec3::ONE, "nothing that near");
        assert!((ray(2.0) - kept * blue.as_dvec3()).abs().max_element() < 1e-7);
        assert_eq!(reference.left_by(&Ray::new(DVec3::Z * -2.0, DVec3::Z), 4.0), DVec3::ONE, "not asked for");
    }
}
