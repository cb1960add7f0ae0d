//! Exposure and emission of a model that comes from a file without light.

use super::CameraPlace;
use crate::{Scene, exposure_scale, metered_ev100};

/// Stops by which the exposure opens indoors, where most surfaces lie in the shade.
const SHADE_STOPS: f32 = 2.0;

/// Exposes a lit model for where its fitted camera stands. Metering knows no shadows, so that inside, where most lies in the
/// shade, it opens by [`SHADE_STOPS`].
pub fn fit_exposure(scene: &mut Scene, stand: CameraPlace) {
    let is_open = scene.settings.exposure.is_none() || scene.fitted.exposure;
    if stand == CameraPlace::Inside && is_open {
        scene.settings.exposure = Some(metered_ev100(scene) - SHADE_STOPS);
        scene.fitted.exposure = true;
    }
}

/// Makes nits of emission that materials give as shares of white: 1 becomes the radiance at which the picture saturates. Called again, it
/// follows a change of the light.
pub fn fit_emission(scene: &mut Scene) {
    let ev100 = scene.settings.exposure.unwrap_or_else(|| metered_ev100(scene));
    let white = 1.0 / exposure_scale(ev100);
    let gain = white / scene.fitted.white.unwrap_or(1.0);
    scene.materials.iter_mut().for_each(|material| material.emissive *= gain);
    scene.fitted.white = Some(white);
}
