//! The light of a bare model.

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use super::{CameraPlace, add_daylight, add_studio, add_studio_beside_lights, fit_exposure, meter};
use crate::sky::{Sky, read_panorama};
use crate::{Error, Scene};

/// Light for a bare model, as a command line asks for it. Needs the feature `readers`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LightChoice {
    /// A photographer's studio alone.
    Studio,
    /// Sun and sky light alone.
    Sun,
    /// The lights of the file.
    File,
    /// The lights of the file, and as much light of the studio.
    Both,
    /// An equirectangular picture alone.
    Picture(PathBuf),
}

impl LightChoice {
    /// Returns true if the file's lights stay.
    pub fn keeps_lights(&self) -> bool {
        matches!(self, Self::File | Self::Both)
    }
}

impl FromStr for LightChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "studio" => Self::Studio,
            "sun" => Self::Sun,
            "file" => Self::File,
            "both" => Self::Both,
            _ => {
                let path = PathBuf::from(text);
                let is_picture = path
                    .extension()
                    .is_some_and(|own| ["hdr", "exr", "pic"].iter().any(|end| own.eq_ignore_ascii_case(end)));
                if !is_picture {
                    return Err("expected studio, sun, file, both, or a picture of surroundings (.hdr, .exr)".into());
                }
                Self::Picture(path)
            }
        })
    }
}

/// Lights a bare model that has a camera. Without a choice a model keeps its lights; one that has none stands in a studio, or, seen from inside, in the sun.
///
/// # Errors
/// [`Error::Read`] for a picture that cannot be read, [`Error::Setting`] for lights of a file that has none.
pub fn light_model(scene: &mut Scene, choice: Option<&LightChoice>, stand: CameraPlace) -> Result<(), Error> {
    let has_own = !scene.lights.is_empty() || scene.environment.is_lit();
    // A file with a camera is a picture that somebody has lit.
    let fitted = match (has_own, stand) {
        (true, CameraPlace::Outside) if scene.fitted.camera => &LightChoice::Both,
        (true, _) => &LightChoice::File,
        (false, CameraPlace::Outside) => &LightChoice::Studio,
        (false, CameraPlace::Inside) => &LightChoice::Sun,
    };
    let choice = choice.unwrap_or(fitted);
    if choice.keeps_lights() && !has_own {
        let name = &scene.name;
        return Err(Error::Setting(format!(
            "--light: {name} has no light of its own; expected studio, sun or a picture (.hdr, .exr)"
        )));
    }
    match choice {
        LightChoice::Studio => add_studio(scene),
        LightChoice::Sun => {
            add_daylight(scene);
            fit_exposure(scene, stand);
        }
        LightChoice::File => meter(scene),
        LightChoice::Both => add_studio_beside_lights(scene),
        LightChoice::Picture(path) => {
            let image = Arc::new(read_panorama(path, &mut scene.warnings)?);
            scene.files.push(path.clone());
            scene.sky = Some(Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None });
            scene.fitted.light = true;
            meter(scene);
        }
    }
    Ok(())
}
