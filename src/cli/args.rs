//! Options that several commands share, and how their values are read.

use std::fmt::Display;
use std::str::FromStr;

use afterlight::gpu::DeviceChoice;
use afterlight::scene::{Brdf, Camera, GbufferChoice, SettingsPatch, Tonemap, View};
use clap::Args;

/// Which device draws, and whether its use is checked.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Device")]
pub struct DeviceArgs {
    /// The device: its number in `afterlight doctor`, or a part of its name [default: a real GPU before a CPU]
    #[arg(long, value_name = "N|NAME", value_parser = value::<DeviceChoice>)]
    pub device: Option<DeviceChoice>,
    /// Turn on the validation layer with its synchronization checks; any message ends the command with exit code 1
    #[arg(long)]
    pub validate: bool,
}

/// What the command line says about how to draw. It wins over the scene file.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Drawing (each overrides the scene file)")]
pub struct SettingsArgs {
    /// Width and height of the picture in pixels [default: 1280x720]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Where the camera stands and looks to, in metres, and its vertical field of view in degrees:
    /// `x,y,z/tx,ty,tz[/fov]`
    #[arg(long, value_name = "CAMERA", value_parser = camera, allow_hyphen_values = true)]
    pub camera: Option<Camera>,
    /// Exposure as EV100 [default: metered from the scene's lights]
    #[arg(long, value_name = "EV100", value_parser = exposure, allow_hyphen_values = true)]
    pub exposure: Option<f32>,
    /// Layout of the G-buffer: lean, fat or float32, and overrides by target, as `lean,normal=rgb10a2`
    #[arg(long, value_name = "LAYOUT", value_parser = value::<GbufferChoice>)]
    pub gbuffer: Option<GbufferChoice>,
    /// Reflection model of all materials: cook-torrance, phong, blinn-phong or lambert
    #[arg(long, value_name = "MODEL", value_parser = value::<Brdf>)]
    pub brdf: Option<Brdf>,
    /// Tone mapper: neutral, agx, aces or none
    #[arg(long, value_name = "NAME", value_parser = value::<Tonemap>)]
    pub tonemap: Option<Tonemap>,
    /// Shadows: on or off
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub shadows: Option<bool>,
    /// Edge of the sun's shadow map in texels, 1 to 16384
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub shadow_size: Option<u32>,
}

impl SettingsArgs {
    pub fn patch(&self) -> SettingsPatch {
        SettingsPatch {
            size: self.size,
            exposure: self.exposure,
            tonemap: self.tonemap,
            brdf: self.brdf,
            gbuffer: self.gbuffer,
            shadows: self.shadows,
            shadow_size: self.shadow_size,
            ..SettingsPatch::default()
        }
    }
}

/// One view of the buffers, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewChoice {
    One(View),
    All,
}

pub fn view(text: &str) -> Result<ViewChoice, String> {
    if text.eq_ignore_ascii_case("all") { Ok(ViewChoice::All) } else { value(text).map(ViewChoice::One) }
}

/// Settings that `--vary` changes: `key=value`, several separated by blanks.
pub fn variation(text: &str) -> Result<SettingsPatch, String> {
    let mut patch = SettingsPatch::default();
    for pair in text.split_whitespace() {
        let (key, text) = pair.split_once('=').ok_or_else(|| format!("'{pair}' is not key=value"))?;
        match key {
            "size" => patch.size = Some(size(text)?),
            "exposure" => patch.exposure = Some(exposure(text)?),
            "tonemap" => patch.tonemap = Some(value(text)?),
            "brdf" => patch.brdf = Some(value(text)?),
            "gbuffer" => patch.gbuffer = Some(value(text)?),
            "shadows" => patch.shadows = Some(on_off(text)?),
            "shadow-size" => patch.shadow_size = Some(shadow_size(text)?),
            "view" => patch.view = Some(value(text)?),
            _ => return Err(unknown_key(key)),
        }
    }
    if patch == SettingsPatch::default() { Err("nothing is varied".into()) } else { Ok(patch) }
}

fn unknown_key(key: &str) -> String {
    const KEYS: [&str; 8] = ["size", "exposure", "tonemap", "brdf", "gbuffer", "shadows", "shadow-size", "view"];
    let nearest = KEYS.into_iter().min_by_key(|known| strsim::damerau_levenshtein(key, known));
    match nearest.filter(|known| strsim::damerau_levenshtein(key, known) <= 2) {
        Some(nearest) => format!("there is no setting '{key}'; did you mean '{nearest}'?"),
        None => format!("there is no setting '{key}'; there are {}", KEYS.join(", ")),
    }
}

/// Any value that says itself what is wrong with a text.
pub fn value<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: T::Err| error.to_string())
}

fn camera(text: &str) -> Result<Camera, String> {
    Camera::parse(text).map_err(|error| error.to_string())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let malformed = || "expected width and height in pixels, as 1280x720".to_owned();
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(malformed)?;
    let edge = |edge: &str| match edge.parse::<u32>() {
        Ok(0) => Err("width and height must be at least 1".to_owned()),
        Ok(pixels) => Ok(pixels),
        // Digits that do not fit are a size beyond any device, not a malformed one.
        Err(_) if !edge.is_empty() && edge.bytes().all(|byte| byte.is_ascii_digit()) => {
            Err(format!("{edge} pixels are more than any device draws"))
        }
        Err(_) => Err(malformed()),
    };
    Ok([edge(width)?, edge(height)?])
}

fn exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(ev100) if (-50.0..=50.0).contains(&ev100) => Ok(ev100),
        Ok(_) => Err("expected an EV100 between -50 and 50".into()),
        Err(_) => Err("expected a number".into()),
    }
}

fn shadow_size(text: &str) -> Result<u32, String> {
    let texels = text.parse::<u32>().ok().filter(|texels| (1..=16384).contains(texels));
    texels.ok_or_else(|| "expected 1 to 16384 texels".into())
}

fn on_off(text: &str) -> Result<bool, String> {
    match text {
        "on" | "true" | "yes" => Ok(true),
        "off" | "false" | "no" => Ok(false),
        _ => Err("expected on or off".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_bad_ones_explained() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        assert_eq!(size("1X1"), Ok([1, 1]));
        for (text, part) in [
            ("0x0", "at least 1"),
            ("640x0", "at least 1"),
            ("640", "as 1280x720"),
            ("x", "as 1280x720"),
            ("-1x5", "as 1280x720"),
            ("1x2x3", "as 1280x720"),
            ("99999999999x1", "more than any device"),
        ] {
            let error = size(text).expect_err(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn exposures_are_finite_and_sane() {
        assert_eq!(exposure("-3.5"), Ok(-3.5));
        for text in ["nan", "inf", "1e9", "bright", ""] {
            assert!(exposure(text).is_err(), "{text}");
        }
    }

    #[test]
    fn variations_change_what_they_name() {
        let patch = variation("shadows=off  shadow-size=512").expect("two known settings");
        assert_eq!((patch.shadows, patch.shadow_size, patch.size), (Some(false), Some(512), None));
        assert!(variation("").is_err());
        assert!(variation("shadows").is_err_and(|error| error.contains("key=value")));
        assert!(variation("shadwos=off").is_err_and(|error| error.contains("'shadows'")));
        assert!(variation("colour=red").is_err_and(|error| error.contains("gbuffer")));
    }
}
