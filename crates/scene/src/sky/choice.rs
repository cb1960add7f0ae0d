//! A sky that replaces a scene's own.

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{Atmosphere, Sky, read_panorama};
use crate::exposure::seen_ev100;
use crate::fit::{drop_fitted_light, fit_emission, meter, remove_ground};
use crate::{Error, Light, LightKind, Scene};

/// The sky as a command line gives it. Needs the feature `readers`.
#[derive(Debug, Clone, PartialEq)]
pub enum SkyChoice {
    /// No sky.
    Nothing,
    /// An atmosphere, with the sun in this direction; `None` takes the direction of the scene's first directional light.
    Atmosphere(Option<DVec3>),
    /// An equirectangular picture.
    Picture(PathBuf),
}

impl FromStr for SkyChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "none" => Ok(Self::Nothing),
            "atmosphere" => Ok(Self::Atmosphere(None)),
            "" => Err("expected a picture (.hdr, .exr), atmosphere, or none".into()),
            _ => {
                let Some(angles) = text.strip_prefix("atmosphere:") else { return Ok(Self::Picture(text.into())) };
                let wrong = || "expected atmosphere:ELEVATION,AZIMUTH in degrees, as atmosphere:35,140".to_owned();
                let (elevation, azimuth) = angles.split_once(',').ok_or_else(wrong)?;
                let number = |text: &str, most: f64| {
                    text.trim().parse().ok().filter(|own: &f64| own.abs() <= most).ok_or_else(wrong)
                };
                Ok(Self::Atmosphere(Some(Atmosphere::sun_at(number(elevation, 90.0)?, number(azimuth, 1e6)?))))
            }
        }
    }
}

/// Gives a scene another sky. Light that was fitted to the scene is replaced by the sky's. Needs the feature `readers`.
///
/// # Errors
/// [`Error::Read`] for a picture that cannot be read.
pub fn put_sky(scene: &mut Scene, choice: &SkyChoice) -> Result<(), Error> {
    // The ground goes with the studio's sky.
    remove_ground(scene);
    match choice {
        SkyChoice::Nothing if scene.sky.is_none() => return Ok(()),
        SkyChoice::Nothing => scene.sky = None,
        SkyChoice::Picture(path) => {
            let image = Arc::new(read_panorama(path, &mut scene.warnings)?);
            scene.files.push(path.clone());
            drop_fitted_light(scene);
            scene.sky = Some(Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None });
        }
        SkyChoice::Atmosphere(sun) => {
            let adds = drop_fitted_light(scene);
            put_atmosphere(scene, Atmosphere::default(), *sun, adds);
        }
    }
    fit_to_light(scene);
    Ok(())
}

/// Exposes a bare model anew for its light, and scales its emission to shares of that light, unless either was given. Needs the feature `readers`.
pub fn fit_to_light(scene: &mut Scene) {
    if scene.fitted.is_bare && !scene.fitted.studio {
        meter(scene);
        tell_faint(scene);
    }
    if scene.fitted.white.is_some() {
        fit_emission(scene);
    }
}

/// The difference in stops, between all light and the sky's, beyond which the sky has no visible effect: a fiftieth of the light.
const FAINT_STOPS: f32 = 5.6;

/// Adds a warning if the lights of a bare model's file outshine its sky.
fn tell_faint(scene: &mut Scene) {
    let all = seen_ev100(scene);
    let lights = std::mem::take(&mut scene.lights);
    let of_sky = seen_ev100(scene);
    scene.lights = lights;
    let is_lit = scene.sky.as_ref().is_some_and(|sky| sky.lights);
    if is_lit && !scene.lights.is_empty() && of_sky < all - FAINT_STOPS {
        let warning = "the lights of the file outshine the sky more than 50 times, so that it is seen and lights nothing to speak of: --light \
                       studio, sun or a picture leaves them out, and --sky-strength makes the sky brighter";
        scene.warnings.push(warning.into());
    }
}

/// Puts an atmosphere with its sun in this direction; `None` takes the direction of the scene's first directional light. If `adds`, a directional
/// light like its sun is added.
pub fn put_atmosphere(scene: &mut Scene, air: Atmosphere, sun: Option<DVec3>, adds: bool) {
    let directional = scene.lights.iter().find_map(|light| match light.kind {
        LightKind::Directional { direction } => Some(-direction.normalize()),
        _ => None,
    });
    let air = Atmosphere { sun: sun.or(directional).unwrap_or(air.sun), ..air };
    let light = air.sunlight();
    if adds && light != Vec3::ZERO {
        let brightest = light.max_element();
        let disc = air.disc();
        scene.lights.push(Light {
            name: "sun".into(),
            color: light / brightest,
            intensity: brightest,
            casts_shadow: true,
            size: disc.degrees,
            ..Light::of(LightKind::Directional { direction: -air.sun })
        });
    }
    let (image, nits) = air.image();
    let sun = Some(air.disc()).filter(|disc| disc.radiance != Vec3::ZERO);
    scene.sky = Some(Sky { image: Arc::new(image), rotation_degrees: 0.0, nits, lights: true, shown: true, sun });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{LightKind, add_daylight, builtin};

    #[test]
    fn a_choice_is_a_picture_an_atmosphere_or_none() {
        assert_eq!("none".parse(), Ok(SkyChoice::Nothing));
        assert_eq!("a/b.hdr".parse(), Ok(SkyChoice::Picture("a/b.hdr".into())));
        assert_eq!("atmosphere".parse(), Ok(SkyChoice::Atmosphere(None)));
        assert_eq!("atmosphere:90,0".parse(), Ok(SkyChoice::Atmosphere(Some(Atmosphere::sun_at(90.0, 0.0)))));
        for text in ["", "atmosphere:", "atmosphere:91,0", "atmosphere:1", "atmosphere:nan,0"] {
            assert!(text.parse::<SkyChoice>().is_err(), "{text}");
        }
    }

    #[test]
    fn an_atmosphere_takes_the_place_of_fitted_light_and_agrees_with_its_sun() {
        let mut scene = builtin::open("builtin:quad").expect("a scene");
        scene.lights.clear();
        add_daylight(&mut scene);
        let sun = Atmosphere::sun_at(20.0, 60.0);
        put_sky(&mut scene, &SkyChoice::Atmosphere(Some(sun))).expect("a sky");
        assert!(
            matches!(scene.lights[..], [Light { kind: LightKind::Directional { direction }, .. }] if direction == -sun)
        );
        assert!(!scene.environment.is_lit() && scene.check().is_ok());
        // A directional light of the scene stays, and the sky's sun follows it.
        put_sky(&mut scene, &SkyChoice::Atmosphere(None)).expect("a sky");
        assert_eq!(scene.lights.len(), 1);
        assert!((scene.sky.and_then(|sky| sky.sun).expect("a sun").direction - sun).length() < 1e-12);
    }
}
