//! The studio that a model without light stands in.

use glam::Vec3;

use super::ground;
use crate::exposure::{exposure_scale, seen_ev100};
use crate::sky::Studio;
use crate::{Environment, FittedParts, Light, LightKind, Scene, SettingsPatch, ShadowFilter};

/// EV100 at which 1 nit is white: [`exposure_scale`](crate::exposure_scale) is 1.
const WHITE_IS_A_NIT: f32 = -0.263_034_4;

/// The lamp's name.
const NAME: &str = "studio";

/// The radius of ambient occlusion over the model's.
const OCCLUSION_REACH: f64 = 0.2;

/// A studio about a model that the camera stands before, with a ground below it, and an exposure at which 1 nit is white, as models of glTF state their
/// emission.
pub fn add_studio(scene: &mut Scene) {
    put_up(scene, 1.0, ground::ALBEDO);
    let exposure = scene.settings.exposure.is_none() || scene.fitted.exposure;
    if exposure {
        scene.settings.exposure = Some(WHITE_IS_A_NIT);
    }
    scene.fitted = FittedParts { light: true, exposure, ..scene.fitted };
}

/// A studio beside a model's own lights, as bright as they are, and an exposure for both.
pub(super) fn add_studio_beside_lights(scene: &mut Scene) {
    // What faces the viewer has about pi lux in a studio of strength 1.
    let lux = 2.5 * f64::from(seen_ev100(scene)).exp2();
    put_up(scene, (lux / std::f64::consts::PI).min(1e9) as f32, ground::ALBEDO_BESIDE_LIGHTS);
    meter(scene);
    if let (None, Some(ev100)) = (scene.fitted.ground, scene.settings.exposure) {
        // With no ground to send it, the background is as bright as alone in the studio.
        scene.environment.background = Vec3::splat(ground::radiance(ground::ALBEDO) / exposure_scale(ev100));
    }
}

/// Adds the room, the lamp and the ground, at this strength.
fn put_up(scene: &mut Scene, nits: f32, albedo: f32) {
    // A light from far away would show the ground's edge.
    let is_even = scene.lights.iter().all(|light| !matches!(light.kind, LightKind::Directional { .. }));
    let studio = Studio::get();
    scene.lights.push(Light {
        name: NAME.into(),
        color: Vec3::ONE,
        intensity: studio.lux as f32 * nits,
        casts_shadow: true,
        size: Studio::LAMP_DEGREES,
        ..Light::of(LightKind::Directional { direction: -studio.lamp })
    });
    scene.sky = Some(studio.sky(nits));
    scene.environment.background = Vec3::splat(ground::radiance(albedo) * nits);
    // Occlusion near by, and a shadow as soft as the lamp is large.
    let reach = scene.model_bounds().radius() * OCCLUSION_REACH;
    let usual = SettingsPatch { shadow_filter: Some(ShadowFilter::Pcss), ..SettingsPatch::default() };
    scene.settings = scene.settings.or(&usual).hiding_within(reach);
    if is_even {
        ground::add(scene, albedo);
    }
    scene.fitted.studio = true;
}

/// Stops by which a model is exposed for longer than a scene, so that a grey card of 18% in the mean of the light is shown as 18%, as in the studio: metering
/// shows white at 2.5 / 1.2 / pi.
const GREY_STOPS: f32 = 0.882;

/// Exposes for the visible side of the model, unless an exposure was given.
pub fn meter(scene: &mut Scene) {
    if scene.settings.exposure.is_none() || scene.fitted.exposure {
        scene.settings.exposure = Some(seen_ev100(scene) - GREY_STOPS);
        scene.fitted.exposure = true;
    }
}

/// Takes fitted light away, with the ground and the settings that belong to it. Lights of a file stay. Returns true if the scene then has no light.
pub fn drop_fitted_light(scene: &mut Scene) -> bool {
    let FittedParts { light, studio, exposure, .. } = scene.fitted;
    if !light && !studio {
        return false;
    }
    if light {
        scene.lights.clear();
        scene.environment = Environment::default();
    } else {
        let lamp = scene.lights.iter().rposition(|light| light.name == NAME);
        if let Some(lamp) = lamp {
            scene.lights.remove(lamp);
        }
        scene.environment.background = Vec3::ZERO;
    }
    scene.sky = None;
    ground::remove(scene);
    if exposure {
        scene.settings.exposure = None;
    }
    if studio {
        scene.settings = SettingsPatch {
            shadow_filter: scene.settings.shadow_filter.filter(|own| *own != ShadowFilter::Pcss),
            ..scene.settings.clone().without_hiding()
        };
    }
    scene.fitted = FittedParts { light: false, studio: false, exposure: false, ..scene.fitted };
    light
}
