//! A photographer's studio as a formula: soft areas of light in a neutral room, and a lamp, which casts the shadow.

use std::f64::consts::PI;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::{Sky, SkyImage, SkyOrigin};

/// The width of the studio's image in texels. An area's edge is soft over several of them.
const WIDTH: u32 = 512;
/// The viewer's direction, for which the studio is lit: the view of a fitted camera. The azimuth is in degrees from +Z towards +X.
const VIEWER_AZIMUTH: f64 = 45.0;
const VIEWER_ELEVATION: f64 = 23.7;
/// The lamp stands to the left of the viewer and above, in degrees.
const LAMP: [f64; 2] = [52.0, -42.0];
/// The lamp's share of the light on a card that faces the viewer.
const LAMP_SHARE: f64 = 0.37;
/// Radiance of white that faces the viewer, in nits. A grey card of 18% is then shown as 18%: the tone mapper Khronos PBR Neutral takes 0.04 from every dielectric.
const CARD_NITS: f64 = 0.22 / 0.18;
/// The share of an area's half edge over which its light fades out.
const EDGE: f64 = 0.2;

/// A rectangular area of even light on the room's wall.
struct Softbox {
    /// Elevation above the horizon, and azimuth from the viewer, to the right; in degrees.
    place: [f64; 2],
    /// Tangents of the angles over which it reaches to either side, and up and down.
    half: [f64; 2],
    /// The radiance relative to the room's, which is about 1.
    radiance: f64,
}

/// The lamp's own area, a broad one behind the viewer, which dark gloss mirrors, a fill across from the lamp, one above, and two strips behind the model,
/// whose light draws its outline.
const SOFTBOXES: [Softbox; 6] = [
    Softbox { place: LAMP, half: [0.45, 0.35], radiance: 9.0 },
    Softbox { place: [30.0, 12.0], half: [0.7, 0.5], radiance: 2.5 },
    Softbox { place: [20.0, 65.0], half: [0.6, 0.6], radiance: 5.0 },
    Softbox { place: [86.0, 180.0], half: [0.9, 0.6], radiance: 4.0 },
    Softbox { place: [22.0, -140.0], half: [0.16, 0.7], radiance: 8.0 },
    Softbox { place: [26.0, 142.0], half: [0.2, 0.7], radiance: 8.0 },
];

/// A studio for an exposure at which 1 nit is white: a grey card that faces the viewer is shown as grey.
#[derive(Debug, Clone, PartialEq)]
pub struct Studio {
    /// The areas of light and the room.
    pub image: Arc<SkyImage>,
    /// The direction towards the lamp, of length 1.
    pub lamp: DVec3,
    /// The lamp's illuminance, in lux.
    pub lux: f64,
    /// Radiance of white that lies on the ground with nothing beside it, in nits.
    pub ground_white: f64,
}

impl Studio {
    /// The angular diameter of the lamp in degrees, for the softness of its shadow.
    pub const LAMP_DEGREES: f64 = 8.0;

    /// The studio; it is computed once.
    pub fn get() -> &'static Self {
        static STUDIO: OnceLock<Studio> = OnceLock::new();
        STUDIO.get_or_init(Self::compute)
    }

    /// The studio's room as the light of a scene, `nits` times as strong. It is not drawn behind the model.
    pub fn sky(&self, nits: f32) -> Sky {
        Sky { image: Arc::clone(&self.image), rotation_degrees: 0.0, nits, lights: true, shown: false, sun: None }
    }

    fn compute() -> Self {
        let card = toward([VIEWER_ELEVATION, 0.0]);
        let raw = SkyImage::of("studio", WIDTH, room);
        let scale = (1.0 - LAMP_SHARE) * PI * CARD_NITS / irradiance(&raw, card);
        let mut image = SkyImage { origin: SkyOrigin::Studio, ..raw };
        image.texels.iter_mut().flatten().for_each(|channel| *channel = (f64::from(*channel) * scale) as f32);
        let lamp = toward(LAMP);
        let lux = LAMP_SHARE * PI * CARD_NITS / lamp.dot(card);
        let ground_white = (irradiance(&image, DVec3::Y) + lux * lamp.y) / PI;
        Self { image: Arc::new(image), lamp, lux, ground_white }
    }
}

/// The direction at an elevation above the horizon, and an azimuth from the viewer to the right, in degrees.
fn toward([elevation, azimuth]: [f64; 2]) -> DVec3 {
    let ((up, level), (across, ahead)) =
        (elevation.to_radians().sin_cos(), (azimuth + VIEWER_AZIMUTH).to_radians().sin_cos());
    DVec3::new(across * level, up, ahead * level)
}

/// The radiance that comes from a direction: grey walls, lighter above and, by the floor, below.
fn room(to: DVec3) -> DVec3 {
    let wall = if to.y > 0.0 { 0.9 + 0.5 * to.y } else { 0.9 - 0.5 * to.y };
    let light: f64 = SOFTBOXES.iter().map(|own| own.radiance * own.coverage(to)).sum();
    DVec3::splat(wall + light)
}

impl Softbox {
    /// 1 where a direction meets it, 0 beside it, and between along its edge.
    fn coverage(&self, to: DVec3) -> f64 {
        let middle = toward(self.place);
        let ahead = to.dot(middle);
        if ahead <= 0.0 {
            return 0.0;
        }
        let across = DVec3::Y.cross(middle).normalize();
        let up = middle.cross(across);
        let within = |axis: DVec3, half: f64| {
            let share = ((1.0 - (to.dot(axis) / ahead).abs() / half) / EDGE).clamp(0.0, 1.0);
            share * share * (3.0 - 2.0 * share)
        };
        within(across, self.half[0]) * within(up, self.half[1])
    }
}

/// The light that a surface collects from an image, its channels' mean.
fn irradiance(image: &SkyImage, normal: DVec3) -> f64 {
    image.directions().map(|(to, share, value)| value.element_sum() / 3.0 * share * to.dot(normal).max(0.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_card_that_faces_the_viewer_is_shown_as_grey_and_has_no_colour() {
        let studio = Studio::get();
        let card = toward([VIEWER_ELEVATION, 0.0]);
        let sum = irradiance(&studio.image, card) + studio.lux * studio.lamp.dot(card);
        // What the tone mapper leaves of it.
        assert!((0.18 * sum / PI - 0.04 - 0.18).abs() < 1e-6, "{sum}");
        assert!(studio.image.texels.iter().all(|texel| texel[0] == texel[1] && texel[1] == texel[2]));
    }

    #[test]
    fn the_lamp_shines_from_its_own_area_and_behind_the_model_are_strips() {
        let studio = Studio::get();
        let look = |place| studio.image.look(toward(place)).x;
        let wall = look([0.0, 100.0]);
        assert!(look(LAMP) > 6.0 * wall && look([22.0, -140.0]) > 5.0 * wall && look([26.0, 142.0]) > 5.0 * wall);
        assert!(studio.lamp.distance(toward(LAMP)) < 1e-12 && studio.lamp.y > 0.5);
        // No direction is dark: metal mirrors something everywhere.
        assert!(studio.image.texels.iter().all(|texel| texel[0] > 0.1));
    }
}
