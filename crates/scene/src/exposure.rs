//! Exposure by incident-light metering, as a photographer's dome meter has it, with the calibration of Lagarde and de Rousiers,
//! "Moving Frostbite to Physically Based Rendering" (2014), section 4.5.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{Scene, Settings, Sky};

/// Incident-light meter constant C, in lux seconds, for a flat-receptor meter.
const CALIBRATION: f64 = 250.0;

/// Photometric luminance of a linear Rec. 709 colour.
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Returns the factor of pre-exposed radiance: 1 / (1.2 * 2^EV100), so that 1 is where a sensor saturates.
///
/// Finite and positive for EV100 in -100 to 100; an exposure beyond is clamped to that.
// ANCHOR: exposure-scale
pub fn exposure_scale(ev100: f32) -> f32 {
    (1.0 / (1.2 * f64::from(ev100.clamp(-100.0, 100.0)).exp2())) as f32
}
// ANCHOR_END: exposure-scale

/// EV100 = log2(E * 100 / 250), where E is the illuminance in lux at the point that the scene is about: the centre of its
/// bounds, for a receptor turned to each light in turn, without shadows or cones of spots.
///
/// Lights nearer than a quarter of the scene's radius count as that far away, so that a lamp that happens to hang in the centre
/// does not blacken the picture. A scene without light (or one that only emits) meters as 0.
pub fn metered_ev100(scene: &Scene) -> f32 {
    let bounds = scene.model_bounds();
    let point = if bounds.is_empty() { scene.camera.position } else { bounds.center() };
    // Averaged over all ways that the receptor may be turned.
    let (ambient, _) = scene.environment.hemispheres();
    let sky = scene.sky.as_ref().filter(|sky| sky.lights).map_or(Vec3::ZERO, Sky::mean);
    let ambient = PI * (f64::from(luminance(ambient)) + f64::from(luminance(sky)));
    let lights: f64 = scene.lights.iter().map(|light| light.illuminance(point, bounds.radius())).sum();
    let ev100 = ((ambient + lights) * 100.0 / CALIBRATION).log2();
    if ev100.is_finite() { ev100.clamp(-100.0, 100.0) as f32 } else { 0.0 }
}

/// EV100 for the side of a model that the scene's camera sees: as [`metered_ev100`], for the mean illuminance of the half of a ball in the model's
/// place that is turned to the camera. A light behind the model counts for little, one from the camera's side for two thirds.
pub fn seen_ev100(scene: &Scene) -> f32 {
    let bounds = scene.model_bounds();
    let point = if bounds.is_empty() { scene.camera.position } else { bounds.center() };
    let viewer = (scene.camera.position - point).normalize_or(-scene.camera.forward());
    let (mean, tilt) = scene.environment.hemispheres();
    // The mean normal of a ball's visible half is two thirds of the viewer's direction.
    let even = PI * (f64::from(luminance(mean)) + f64::from(luminance(tilt)) * viewer.y * 2.0 / 3.0);
    let of_sky = |sky: &Sky| {
        let parts = sky.image.directions().map(|(to, share, value)| {
            f64::from(luminance(value.as_vec3())) * share * seen_share(sky.turned(viewer).dot(to))
        });
        parts.sum::<f64>() * f64::from(sky.nits)
    };
    let sky = scene.sky.as_ref().filter(|sky| sky.lights).map_or(0.0, of_sky);
    let lights = scene.lights.iter().map(|light| {
        let form = light.kind.form();
        let toward = match (form.place, form.direction) {
            (Some(place), _) => place - point,
            (None, direction) => -direction.unwrap_or(DVec3::NEG_Y),
        };
        // One in the model's middle shines to all sides.
        let share = toward.try_normalize().map_or(0.25, |toward| seen_share(toward.dot(viewer)));
        light.illuminance(point, bounds.radius()) * share
    });
    let ev100 = ((even + sky + lights.sum::<f64>()) * 100.0 / CALIBRATION).log2();
    if ev100.is_finite() { ev100.clamp(-100.0, 100.0) as f32 } else { 0.0 }
}

/// Mean, over a ball's visible half, of the cosine at which light falls on it, 0 in shadow: two thirds of the phase function of a lambert ball (F.
/// Schoenberg, "Photometrische Untersuchungen", 1929), for the cosine between the directions to the light and to the viewer.
fn seen_share(cosine: f64) -> f64 {
    let angle = cosine.clamp(-1.0, 1.0).acos();
    2.0 / 3.0 / PI * (angle.sin() + (PI - angle) * angle.cos())
}

/// Returns the exposure of a picture as EV100: as the settings have it, else metered.
pub fn ev100_of(scene: &Scene, settings: &Settings) -> f32 {
    settings.exposure.unwrap_or_else(|| metered_ev100(scene))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::{Light, LightKind};
    use super::*;

    fn sun(lux: f32) -> Light {
        Light {
            name: "sun".into(),
            intensity: lux,
            casts_shadow: true,
            ..Light::of(LightKind::Directional { direction: DVec3::NEG_Y })
        }
    }

    #[test]
    fn the_sunny_sixteen_rule_holds() {
        // f/16 at 1/100 s and ISO 100 is EV 14.6; bright sun of 100,000 lux meters within a stop of it.
        let scene = Scene { lights: vec![sun(100_000.0)], ..Scene::default() };
        assert!((metered_ev100(&scene) - 15.29).abs() < 0.01, "{}", metered_ev100(&scene));
    }

    #[test]
    fn darkness_and_overflow_meter_finitely() {
        assert_eq!(metered_ev100(&Scene::default()), 0.0);
        let blinding = Scene { lights: vec![sun(f32::MAX); 3], ..Scene::default() };
        assert!(metered_ev100(&blinding).is_finite());
        assert!(exposure_scale(f32::INFINITY) > 0.0 && exposure_scale(-1e30).is_finite());
    }

    #[test]
    fn sky_and_ground_meter_as_their_mean() {
        let metered = |sky: f32, ground: Option<f32>| {
            let (ambient, ground) = (Vec3::splat(sky), ground.map(Vec3::splat));
            let environment = super::super::Environment { ambient, ground, background: Vec3::ZERO };
            metered_ev100(&Scene { environment, ..Scene::default() })
        };
        assert_eq!(metered(300.0, Some(100.0)), metered(200.0, None));
        assert_eq!(metered(0.0, Some(400.0)), metered(200.0, None));
    }

    #[test]
    fn a_white_lambert_surface_under_metered_light_is_a_mid_tone() {
        // E / pi exposed at log2(E / 2.5): 1 / (pi * 1.2 * 0.4) = 0.66 of the sensor's saturation.
        let ev100 = (1000.0f32 * 100.0 / 250.0).log2();
        let white = 1000.0 / std::f32::consts::PI * exposure_scale(ev100);
        assert!((white - 0.663).abs() < 0.001, "{white}");
    }
}
