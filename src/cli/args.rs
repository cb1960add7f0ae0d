//! Options that several commands share, and how their values are read.

use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

use afterlight::gpu::{DeviceChoice, Validation};
use afterlight::scene::{
    Brdf, Camera, GbufferChoice, HdrFormat, Keep, LightPath, Resolve, SettingsPatch, ShadowFilter, Tonemap,
    Transparency, View, parse_size, unknown,
};
use clap::Args;

/// Which device draws, and whether its use is checked.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Device")]
pub struct DeviceArgs {
    /// The device: its number in `afterlight doctor`, or a part of its name [default: a real GPU before a CPU]
    #[arg(long, value_name = "N|NAME", value_parser = device, allow_hyphen_values = true)]
    pub device: Option<DeviceChoice>,
    /// Turn on the validation layer: core checks and synchronization (sync, the default), checks on the GPU of what shaders access
    /// (gpu-assisted), or core checks and advice (best-practices). Any message but advice ends the command with exit code 1
    // With an equals sign, so that a scene that follows is not taken for the value.
    #[arg(
        long,
        value_name = "CHECKS",
        value_parser = checks,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "sync"
    )]
    pub validate: Option<Validation>,
}

/// What `--validate` can ask for, by its names.
const CHECKS: [(&str, Validation); 3] = [
    ("sync", Validation::Synchronization),
    ("gpu-assisted", Validation::GpuAssisted),
    ("best-practices", Validation::BestPractices),
];

fn checks(text: &str) -> Result<Validation, String> {
    let found = CHECKS.iter().find(|(name, _)| *name == text);
    found.map(|&(_, checks)| checks).ok_or_else(|| unknown("checks", text, &CHECKS.map(|(name, _)| name)))
}

/// What the command line says about how to draw. It wins over the scene file.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Drawing (each overrides the scene file)")]
pub struct SettingsArgs {
    /// Take settings from a TOML file with a table [settings] as in a scene file, as `afterlight tune` writes it; they win over the
    /// scene file, other options over them
    #[arg(long, value_name = "FILE")]
    pub settings: Option<PathBuf>,
    /// Width and height of the picture in pixels [default: 1280x720]
    #[arg(long, value_name = "WxH", value_parser = size, allow_hyphen_values = true)]
    pub size: Option<[u32; 2]>,
    /// Where the camera stands and looks to, in metres, and its vertical field of view in degrees, or what an orthographic one
    /// shows from top to bottom in metres: `x,y,z/tx,ty,tz[/fov]` or `x,y,z/tx,ty,tz/<height>m`
    #[arg(long, value_name = "CAMERA", value_parser = value::<Camera>, allow_hyphen_values = true)]
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
    /// How pixels meet their lights: loop, per-light, volumes, clustered, compute, forward, forward-naive, or auto
    #[arg(long, value_name = "NAME", value_parser = value::<LightPath>)]
    pub light_path: Option<LightPath>,
    /// Lights without a range get one, beyond which all that is dropped stays below half a step of the output: on or off
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub light_cutoff: Option<bool>,
    /// Draw the depth of opaque surfaces first, so that each pixel is shaded once: on or off
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub depth_prepass: Option<bool>,
    /// Reflection models as textbooks have them, wrong where single floats are at their end: to see what is gained, on or off
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub textbook: Option<bool>,
    /// What light is kept in until it is tone-mapped, where something blends: rgba16f, b10g11r11 or rgba32f
    #[arg(long, value_name = "NAME", value_parser = value::<HdrFormat>)]
    pub hdr_format: Option<HdrFormat>,
    /// How transparent surfaces are laid over one another: sorted, or oit (weighted blended, in any order)
    #[arg(long, value_name = "NAME", value_parser = value::<Transparency>)]
    pub transparency: Option<Transparency>,
    /// Shadows: on or off
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub shadows: Option<bool>,
    /// Edge of a layer of shadow maps in texels, 32 to 16384: a cascade has a whole layer, a spot light and each of a point
    /// light's six faces a quarter [default: 2048]
    #[arg(long, value_name = "TEXELS", value_parser = shadow_size, allow_hyphen_values = true)]
    pub shadow_size: Option<u32>,
    /// Smooth edges of the finished picture (FXAA): on or off
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub fxaa: Option<bool>,
    /// Samples of the hardware in each pixel: 1, 2, 4 or 8, as far as the device has them; edges are shaded once a sample
    #[arg(long, value_name = "N", value_parser = msaa, allow_hyphen_values = true)]
    pub msaa: Option<u32>,
    /// How much longer than wide a pixel's place on a texture may be before it is blurred, 1 to 16, as far as the device goes
    /// [default: 8]
    #[arg(long, value_name = "N", value_parser = anisotropy, allow_hyphen_values = true)]
    pub anisotropy: Option<u32>,
    /// Where the samples of a pixel are averaged: linear (as light), or tone-mapped
    #[arg(long, value_name = "NAME", value_parser = value::<Resolve>)]
    pub resolve: Option<Resolve>,
    /// Filter of shadows: none, 2x2, 3x3, 5x5, poisson, or pcss (as soft as the light is large) [default: 2x2]
    #[arg(long, value_name = "NAME", value_parser = value::<ShadowFilter>)]
    pub shadow_filter: Option<ShadowFilter>,
    /// Shadow maps of each directional light, 1 to 4 [default: 2]
    #[arg(long, value_name = "N", value_parser = cascades, allow_hyphen_values = true)]
    pub cascades: Option<u32>,
    /// How the cascades part the view: 0 evenly, 1 logarithmically [default: 0.7]
    #[arg(long, value_name = "0..1", value_parser = shadow_lambda, allow_hyphen_values = true)]
    pub shadow_lambda: Option<f32>,
    /// MiB that all shadow maps may take; the most important lights get theirs first [default: 256]
    #[arg(long, value_name = "MIB", value_parser = shadow_budget, allow_hyphen_values = true)]
    pub shadow_budget: Option<u32>,
    /// Draw a shadow map only when something in it moved: on or off [default: on]
    #[arg(long, value_name = "on|off", value_parser = on_off)]
    pub shadow_cache: Option<bool>,
    /// Where shadows are looked up: this many texels of the map along the surface's normal, 0 to 1000 [default: 0.25]
    #[arg(long, value_name = "TEXELS", value_parser = shadow_normal_offset, allow_hyphen_values = true)]
    pub shadow_normal_offset: Option<f32>,
    /// Depth bias of shadow maps by the slope of what is drawn, 0 to 1000 [default: 0.5]
    #[arg(long, value_name = "FACTOR", value_parser = shadow_slope_bias, allow_hyphen_values = true)]
    pub shadow_slope_bias: Option<f32>,
    /// What stays in the frame although the scene does not need it: lean (nothing), full (everything), or names of parts as
    /// `inspect` lists them, separated by commas [default: lean]
    #[arg(long, value_name = "PLAN", value_parser = value::<Keep>)]
    pub plan: Option<Keep>,
}

impl SettingsArgs {
    /// What the options say, without the settings file.
    pub fn patch(&self) -> SettingsPatch {
        SettingsPatch {
            size: self.size,
            exposure: self.exposure,
            tonemap: self.tonemap,
            light_path: self.light_path,
            light_cutoff: self.light_cutoff,
            depth_prepass: self.depth_prepass,
            textbook: self.textbook,
            hdr_format: self.hdr_format,
            transparency: self.transparency,
            brdf: self.brdf,
            gbuffer: self.gbuffer,
            shadows: self.shadows,
            shadow_size: self.shadow_size,
            fxaa: self.fxaa,
            msaa: self.msaa,
            anisotropy: self.anisotropy,
            resolve: self.resolve,
            shadow_filter: self.shadow_filter,
            cascades: self.cascades,
            shadow_lambda: self.shadow_lambda,
            shadow_budget: self.shadow_budget,
            shadow_cache: self.shadow_cache,
            shadow_normal_offset: self.shadow_normal_offset,
            shadow_slope_bias: self.shadow_slope_bias,
            keep: self.plan,
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

/// Any value that says itself what is wrong with a text.
pub fn value<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: T::Err| error.to_string())
}

/// An empty name, as an unset variable of a script leaves it, would be a part of every device's name.
fn device(text: &str) -> Result<DeviceChoice, String> {
    if text.trim().is_empty() { Err("a number or a part of a name is needed".into()) } else { value(text) }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    parse_size(text).map_err(|error| error.to_string())
}

pub fn exposure(text: &str) -> Result<f32, String> {
    let ev100 = text.parse().map_err(|_| "expected a number".to_owned())?;
    checked(SettingsPatch { exposure: Some(ev100), ..SettingsPatch::default() })?;
    Ok(ev100)
}

fn shadow_size(text: &str) -> Result<u32, String> {
    let texels = text.parse().map_err(|_| "expected a number of texels".to_owned())?;
    checked(SettingsPatch { shadow_size: Some(texels), ..SettingsPatch::default() })?;
    Ok(texels)
}

fn msaa(text: &str) -> Result<u32, String> {
    let msaa = text.parse().map_err(|_| "expected a number of samples".to_owned())?;
    checked(SettingsPatch { msaa: Some(msaa), ..SettingsPatch::default() })?;
    Ok(msaa)
}

fn anisotropy(text: &str) -> Result<u32, String> {
    let anisotropy = text.parse().map_err(|_| "expected a whole number from 1 to 16".to_owned())?;
    checked(SettingsPatch { anisotropy: Some(anisotropy), ..SettingsPatch::default() })?;
    Ok(anisotropy)
}

pub fn samples(text: &str) -> Result<u32, String> {
    let samples = text.parse().map_err(|_| "expected a number of frames".to_owned())?;
    checked(SettingsPatch { samples: Some(samples), ..SettingsPatch::default() })?;
    Ok(samples)
}

/// Pictures for each second.
pub fn fps(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|fps| (1e-3..=1e4).contains(fps));
    parsed.ok_or_else(|| "expected a number from 0.001 to 10000".to_owned())
}

fn cascades(text: &str) -> Result<u32, String> {
    let count = text.parse().map_err(|_| "expected a number from 1 to 4".to_owned())?;
    checked(SettingsPatch { cascades: Some(count), ..SettingsPatch::default() })?;
    Ok(count)
}

fn shadow_lambda(text: &str) -> Result<f32, String> {
    let lambda = text.parse().map_err(|_| "expected a number from 0 to 1".to_owned())?;
    checked(SettingsPatch { shadow_lambda: Some(lambda), ..SettingsPatch::default() })?;
    Ok(lambda)
}

fn shadow_budget(text: &str) -> Result<u32, String> {
    let budget = text.parse().map_err(|_| "expected a number of MiB".to_owned())?;
    checked(SettingsPatch { shadow_budget: Some(budget), ..SettingsPatch::default() })?;
    Ok(budget)
}

fn shadow_normal_offset(text: &str) -> Result<f32, String> {
    let texels = text.parse().map_err(|_| "expected a number of texels".to_owned())?;
    checked(SettingsPatch { shadow_normal_offset: Some(texels), ..SettingsPatch::default() })?;
    Ok(texels)
}

fn shadow_slope_bias(text: &str) -> Result<f32, String> {
    let factor = text.parse().map_err(|_| "expected a number from 0 to 1000".to_owned())?;
    checked(SettingsPatch { shadow_slope_bias: Some(factor), ..SettingsPatch::default() })?;
    Ok(factor)
}

/// The scene module knows the ranges.
fn checked(patch: SettingsPatch) -> Result<(), String> {
    patch.check().map_err(|error| error.to_string())
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
    fn values_out_of_range_are_refused() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        assert_eq!(exposure("-3.5"), Ok(-3.5));
        assert_eq!(shadow_size("512"), Ok(512));
        for text in ["nan", "inf", "bright", ""] {
            assert!(exposure(text).is_err(), "{text}");
        }
        assert!(size("0x0").is_err() && shadow_size("0").is_err() && on_off("maybe").is_err());
    }
}
