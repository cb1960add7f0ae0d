//! Light that a thin surface lets through diffusely (KHR_materials_diffuse_transmission): the base is a mix of a lambert surface that reflects and of one that
//! transmits.
//!
//! Limits: nothing is scattered twice between the two sides, and the surface has no thickness.

use nalgebra::Vector3;

use super::real::{Real, vector};
use crate::reference::SurfaceLobes;

/// The shares of a diffuse albedo that reflect and that transmit, the latter in its own colour: the extension's `mix`. A metal has neither.
pub(super) fn split<R: Real>(diffuse: Vector3<R>, lobes: &SurfaceLobes, metallic: R) -> (Vector3<R>, Vector3<R>) {
    if lobes.transmitting == 0.0 {
        return (diffuse, Vector3::zeros());
    }
    let share = R::of(lobes.transmitting);
    (diffuse * (R::one() - share), vector::<R>(lobes.transmission) * (share * (R::one() - metallic)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use glam::{DVec2, DVec3};

    use super::*;
    use crate::reference::light::{Collector, Collects, Reflector};
    use crate::reference::sky::SkySampler;
    use crate::reference::{ShadingPoint, Smith};
    use afterlight_scene::{Brdf, Sky, SkyImage};

    /// A white leaf that faces up, seen under an angle to its normal.
    fn leaf(transmitting: f64, degrees: f64) -> ShadingPoint {
        let (sin, cos) = degrees.to_radians().sin_cos();
        ShadingPoint {
            position: DVec3::new(sin, -cos, 0.0),
            ray: None,
            normal: DVec3::Y,
            geometric_normal: DVec3::Y,
            brdf: Brdf::CookTorrance,
            albedo: DVec3::ONE,
            metallic: 0.0,
            roughness: 0.5,
            specular: DVec3::ZERO,
            reflectance: DVec3::splat(0.04),
            grazing: 1.0,
            shininess: 0.0,
            lobes: SurfaceLobes { transmitting, ..SurfaceLobes::NONE },
            occlusion: 1.0,
            emissive: DVec3::ZERO,
            alpha: 1.0,
            receives_shadow: false,
        }
    }

    fn reflector(surface: &ShadingPoint) -> Reflector<f64> {
        Reflector::new(surface, Smith::default())
    }

    fn direction(up: f64, angle: f64) -> Vector3<f64> {
        let level = (1.0 - up * up).sqrt();
        Vector3::new(level * angle.cos(), up, level * angle.sin())
    }

    /// Light of an even furnace of 1 around both sides that a surface sends to the eye.
    fn furnace(surface: &ShadingPoint) -> f64 {
        let own = reflector(surface);
        let count = 400;
        let mut sum = 0.0;
        for across in 0..count {
            for around in 0..count {
                let up = (f64::from(across) + 0.5) / f64::from(count);
                let light = direction(up, (f64::from(around) + 0.5) / f64::from(count) * 2.0 * PI);
                let front = own.reflect(&light);
                let back = own.transmit(&Vector3::new(light.x, -light.y, light.z));
                sum += (front.base.x + front.lobe.x + back.x) * up;
            }
        }
        sum * 2.0 * PI / f64::from(count * count)
    }

    #[test]
    fn light_through_a_surface_is_lamberts_of_the_other_side() {
        let own = ShadingPoint {
            reflectance: DVec3::ZERO,
            grazing: 0.0,
            albedo: DVec3::new(0.2, 0.4, 0.8),
            lobes: SurfaceLobes { transmission: DVec3::new(0.9, 0.5, 0.1), ..leaf(0.25, 30.0).lobes },
            ..leaf(0.25, 30.0)
        };
        for angle in [0.0, 1.0, 4.0] {
            let light = direction(0.6, angle);
            let front = reflector(&own).reflect(&light).base * PI;
            assert!((front - Vector3::new(0.15, 0.3, 0.6)).amax() < 1e-12, "{front}");
            let back = reflector(&own).transmit(&-light) * PI;
            assert!((back - Vector3::new(0.225, 0.125, 0.025)).amax() < 1e-12, "{back}");
        }
        // A metal transmits nothing, and half a metal half.
        for (metallic, share) in [(1.0, 0.0), (0.5, 0.5)] {
            let back = reflector(&ShadingPoint { metallic, ..leaf(0.25, 0.0) }).through.x;
            assert!((back - 0.25 * share).abs() < 1e-12, "{back}");
        }
    }

    #[test]
    fn a_highlight_weakens_light_from_either_side_alike() {
        let own = leaf(0.5, 50.0);
        for (up, angle) in [(0.9, 0.3), (0.3, 2.0), (0.05, 3.1)] {
            let light = direction(up, angle);
            let back = reflector(&own).transmit(&Vector3::new(light.x, -light.y, light.z));
            let front = reflector(&own).reflect(&light).base;
            assert!((front - back).amax() < 1e-12, "{front} {back}");
        }
    }

    #[test]
    fn a_white_surface_gives_back_as_much_light_of_a_furnace_whatever_share_it_lets_through() {
        for degrees in [0.0, 40.0, 70.0] {
            let opaque = furnace(&leaf(0.0, degrees));
            for transmitting in [0.25, 0.5, 1.0] {
                let own = furnace(&leaf(transmitting, degrees));
                assert!((own - opaque).abs() < 1e-9, "{degrees} {transmitting}: {own}, opaque {opaque}");
            }
            // The base knows nothing of the highlight's share (`super::brdf`), so only the eye above it sees no more than arrives.
            assert!(degrees > 0.0 || opaque < 1.0, "{opaque}");
        }
    }

    /// Mean of the estimates by many directions, with light only from directions that `arrives` accepts.
    fn estimated(sky: &SkySampler, surface: &Collector, arrives: fn(DVec3) -> bool) -> f64 {
        const COUNT: u32 = 4000;
        const STEPS: [(f64, f64); 3] = [(0.7549, 0.5698), (0.8192, 0.6711), (0.3247, 0.2207)];
        let estimate = |index: u32| {
            let points = STEPS.map(|(x, y)| (DVec2::splat(0.5) + DVec2::new(x, y) * f64::from(index)).fract());
            let [base, lobe] = sky
                .estimate(surface, points, &mut |direction| if arrives(direction) { DVec3::ONE } else { DVec3::ZERO });
            (base + lobe).x
        };
        (0..COUNT).map(estimate).sum::<f64>() / f64::from(COUNT)
    }

    #[test]
    fn an_even_sky_comes_back_whole_from_front_and_back_together() {
        let image = Arc::new(SkyImage::of("even", 256, |_| DVec3::ONE));
        let sky =
            SkySampler::of(&Sky { nits: 1.0, rotation_degrees: 0.0, image, shown: true, lights: true, sun: None });
        for (transmitting, degrees) in [(0.0, 20.0), (0.3, 20.0), (1.0, 20.0), (0.0, 75.0), (0.6, 75.0)] {
            let surface = reflector(&leaf(transmitting, degrees)).collector();
            let [base, lobe] = sky.collected(&surface);
            let sum = (base + lobe).x;
            assert!((sum - 1.0).abs() < 1e-3, "{transmitting} {degrees}: {sum}");
            let all = estimated(&sky, &surface, |_| true);
            assert!((all - 1.0).abs() < 0.02, "{transmitting} {degrees}: {all}");
            // Where nothing arrives from below, the share that comes through is missing.
            let (front, through) = (estimated(&sky, &surface, |direction| direction.y > 0.0), base.x * transmitting);
            assert!((front - (1.0 - through)).abs() < 0.02, "{transmitting} {degrees}: {front}, without {through}");
        }
    }
}
