//! The options of the sky.

use afterlight::scene::{Scene, SkyChoice, fit_to_light, put_sky};
use clap::{Arg, ArgMatches};

use super::value;
use crate::failure::Failure;

/// The sky in place of the scene's, and its turn and strength.
#[derive(Debug, Clone, Default)]
pub struct SkyArgs {
    choice: Option<SkyChoice>,
    degrees: Option<f64>,
    nits: Option<f32>,
}

const SKY_HELP: &str = "Set the sky: an equirectangular picture (.hdr, .exr); `atmosphere`, or `atmosphere:ELEVATION,AZIMUTH` with the sun's angles in \
                        degrees, above the horizon and from -Z over +X; or none. A bare model without light of its own is lit by the sky alone [default: the scene's]";
const ROTATION_HELP: &str =
    "Turn the sky about the vertical, counter-clockwise from above, in degrees [default: the scene's]";
const STRENGTH_HELP: &str = "Radiance of a 1 in the sky's picture, in nits [0 to 1e9; default: the scene's]";

pub fn options() -> [Arg; 3] {
    let sky = Arg::new("sky").value_name("SKY").value_parser(value::<SkyChoice>).help(SKY_HELP);
    let turned = Arg::new("sky-rotation").value_name("DEGREES").value_parser(degrees).help(ROTATION_HELP);
    let strength = Arg::new("sky-strength").value_name("NITS").value_parser(nits).help(STRENGTH_HELP);
    [
        sky.long("sky"),
        turned.long("sky-rotation").allow_hyphen_values(true),
        strength.long("sky-strength").allow_hyphen_values(true),
    ]
}

fn degrees(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|degrees: &f64| degrees.abs() <= 1e6);
    parsed.ok_or_else(|| "expected a number from -1e6 to 1e6".to_owned())
}

fn nits(text: &str) -> Result<f32, String> {
    let parsed = text.parse().ok().filter(|nits| (0.0..=1e9).contains(nits));
    parsed.ok_or_else(|| "expected a number from 0 to 1e9".to_owned())
}

impl SkyArgs {
    pub fn of(matches: &ArgMatches) -> Self {
        Self {
            choice: matches.get_one("sky").cloned(),
            degrees: matches.get_one("sky-rotation").copied(),
            nits: matches.get_one("sky-strength").copied(),
        }
    }

    /// Gives the scene its sky, turned and dimmed.
    pub fn put(&self, scene: &mut Scene) -> Result<(), Failure> {
        if let Some(choice) = &self.choice {
            put_sky(scene, choice)?;
        }
        if self.nits.is_some() && scene.fitted.studio {
            return Err(Failure::usage("--sky-strength is for a picture or an atmosphere: a studio has one strength")
                .with_hint("--exposure makes the picture lighter"));
        }
        let Some(sky) = &mut scene.sky else {
            return match (self.degrees, self.nits) {
                (None, None) => Ok(()),
                _ => Err(Failure::usage(
                    "--sky-rotation and --sky-strength are for a scene with a sky: give one by --sky",
                )),
            };
        };
        sky.rotation_degrees = self.degrees.unwrap_or(sky.rotation_degrees);
        sky.nits = self.nits.unwrap_or(sky.nits);
        if self.degrees.is_some() || self.nits.is_some() {
            fit_to_light(scene);
        }
        Ok(())
    }
}
