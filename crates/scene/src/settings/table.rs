//! The table of settings: a row declares everything about a setting but its effect, which is its consumer's.
//!
//! A row opens with its help text, which is the text of the documents, too. Then come its key on the command line and in a scene file, its field in
//! [`SettingsPatch`] (for a shadow setting also its field in [`ShadowSettings`]), its type, and its default or the rule that decides instead.
//! Properties that its braces leave out are taken from [`plain`].

mod ao;
mod fog;
mod reflections;
mod taa;

pub use ao::{AmbientOcclusion, AoResolution};
pub use fog::Fog;
pub use reflections::Reflections;

use super::choices::{
    Culling, HdrFormat, ImageLayouts, LightPath, MSAA, Output, Passes, Queues, Resolve, ShadowFilter, SyncApi, Tonemap,
    Transparency, choice,
};
use super::gbuffer::GbufferChoice;
use super::setting::{Setting, SettingValue, SweepMode, ValueKind};
use crate::{Aperture, Brdf, Keep};

choice! {
    /// The content of the picture.
    #[derive(Default)]
    pub enum View: "view" {
        /// The lit picture.
        #[default]
        Final => "final",
        /// Sign-log map of the world position, scaled by the scene's extent.
        Position => "position",
        /// Shading normal, half-encoded: n * 0.5 + 0.5.
        Normal => "normal",
        /// Shading normal, absolute value.
        NormalAbsolute => "normal-absolute",
        /// Base colour with its textures, linear.
        Albedo => "albedo",
        /// 0 black, 1 white.
        Metallic => "metallic",
        /// Perceptual roughness, or its equivalent for the Phong models: 0 black, 1 white.
        Roughness => "roughness",
        /// Near is white, infinitely far black, at half the radius of the scene grey; a linear output gives metres along the view axis.
        Depth => "depth",
        /// The maps of the shadow atlas.
        ShadowMap => "shadow-map",
        /// Lit with albedo 1.
        Lighting => "lighting",
        /// Lit by ambient light and the sky only.
        Ambient => "ambient",
        /// The light that bloom spreads, without the picture that it is spread from.
        Bloom => "bloom",
        /// The light that fog scatters to the eye, without the light that passes through it.
        Fog => "fog",
        /// Layers of particles on each pixel: one more step of grey each; a linear output gives their number.
        Particles => "particles",
        /// Fragments shaded for each pixel, as a heat map.
        Overdraw => "overdraw",
        /// Lights that reach each pixel, as a heat map.
        LightsPerPixel => "lights-per-pixel",
        /// Pixels whose multisamples differ, so that each of them is shaded.
        Complexity => "complexity",
        /// The triangle that each pixel shows, each in a different colour; transparent ones are ignored.
        Triangle => "triangle",
        /// The share of ambient and sky light that arrives, by materials and by ambient occlusion: 0 black, 1 white.
        Ao => "ao",
        /// The motion of each pixel's surface on the picture since the frame before: the colour gives the direction, and far is bright; a linear
        /// output gives pixels to the right and down.
        Velocity => "velocity",
        /// The reflected light that each pixel finds on the screen, times the share of the lobe whose rays found any; black if none did.
        Reflections => "reflections",
    }
}

impl View {
    /// Returns true if it shows emitted light or its reflections.
    pub fn shows_emission(self) -> bool {
        matches!(self, Self::Final | Self::Reflections)
    }
}

/// Makes the decided settings, their defaults, the patch of given ones, and [`SETTINGS`] of the rows below.
macro_rules! settings {
    (
        frame { $(
            $(#[doc = $help:literal])+
            $key:literal, $toml:literal => $field:ident: $type:ty
                $(= $default:expr)? $(, where unset $unset:literal)?, { $($more:tt)* }
        )+ }
        shadows { $(
            $(#[doc = $shadow_help:literal])+
            $shadow_key:literal, $shadow_toml:literal => $said:ident, $shadow_field:ident: $shadow_type:ty
                = $shadow_default:expr, { $($shadow_more:tt)* }
        )+ }
    ) => {
        /// The decided settings of a frame.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Settings {
            $($(#[doc = $help])+ $(#[doc = concat!(" (`None`: ", $unset, ")")])?
            pub $field: decided!($type $(, $default)?),)+
            /// The settings of shadows.
            pub shadows: ShadowSettings,
            /// The form of a picture's pixels.
            pub output: Output,
        }

        /// The decided settings of shadows.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct ShadowSettings {
            $($(#[doc = $shadow_help])+ pub $shadow_field: $shadow_type,)+
        }

        /// Settings as far as somebody has said them.
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct SettingsPatch {
            $($(#[doc = $help])+ pub $field: Option<$type>,)+
            $($(#[doc = $shadow_help])+ pub $said: Option<$shadow_type>,)+
        }

        impl Default for Settings {
            fn default() -> Self {
                Self {
                    $($field: default!($($default)?),)+
                    shadows: ShadowSettings::default(),
                    output: Output::default(),
                }
            }
        }

        impl Default for ShadowSettings {
            fn default() -> Self {
                Self { $($shadow_field: $shadow_default,)+ }
            }
        }

        impl Settings {
            /// Returns a patch with all settings given.
            pub fn patch(&self) -> SettingsPatch {
                SettingsPatch {
                    $($field: said!(self.$field $(, $default)?),)+
                    $($said: Some(self.shadows.$shadow_field),)+
                }
            }
        }

        impl SettingsPatch {
            /// `self`'s settings, then `other`'s for settings that are not given: `command_line.or(&scene_file)`.
            pub fn or(&self, other: &Self) -> Self {
                Self { $($field: self.$field.or(other.$field),)+ $($said: self.$said.or(other.$said),)+ }
            }

            /// The defaults, overridden by the given settings.
            pub fn decide(&self) -> Settings {
                Settings {
                    $($field: decide!(self.$field $(, $default)?),)+
                    shadows: ShadowSettings { $($shadow_field: self.$said.unwrap_or($shadow_default),)+ },
                    output: Output::default(),
                }
            }
        }

        /// Every setting, in the order in which they are written and shown. Shadow settings come last, as TOML needs it.
        pub const SETTINGS: &[Setting] = &[
            $(row!($field: $type, $key, $toml, concat!($($help),+), concat!($($unset)?), $($more)*),)+
            $(row!(
                $said: $shadow_type, $shadow_key, concat!("shadows.", $shadow_toml), concat!($($shadow_help),+), "",
                $($shadow_more)*
            ),)+
        ];

        /// The keys of a scene file's `[settings]`.
        pub const KEYS: &[&str] = &[$($toml,)+ "shadows", "from"];
        /// The keys of `[settings.shadows]`.
        pub const SHADOW_KEYS: &[&str] = &[$($shadow_toml),+];
    };
}

/// A setting without a default may be left open.
macro_rules! decided {
    ($type:ty) => { Option<$type> };
    ($type:ty, $default:expr) => { $type };
}

macro_rules! default {
    () => {
        None
    };
    ($default:expr) => {
        $default
    };
}

macro_rules! decide {
    ($said:expr) => {
        $said
    };
    ($said:expr, $default:expr) => {
        $said.unwrap_or($default)
    };
}

macro_rules! said {
    ($decided:expr) => {
        $decided
    };
    ($decided:expr, $default:expr) => {
        Some($decided)
    };
}

macro_rules! row {
    ($field:ident: $type:ty, $key:expr, $toml:expr, $help:expr, $unset:expr, $($more:tt)*) => {
        Setting {
            key: $key,
            toml: $toml,
            help: $help.trim_ascii(),
            unset: $unset,
            get: |patch| patch.$field.map(SettingValue::text),
            set: |setting, patch, text| {
                patch.$field = text.map(|text| setting.value::<$type>(text)).transpose()?;
                Ok(())
            },
            $($more)*
            ..plain::<$type>()
        }
    };
}

/// A setting with the properties that rows leave out.
const fn plain<T: SettingValue>() -> Setting {
    Setting {
        key: "",
        toml: "",
        help: "",
        title: "",
        values: T::VALUES,
        unit: "",
        unset: "",
        changes_plan: true,
        of_truth: false,
        on_picture: false,
        of_lit_picture: false,
        smooths: false,
        beyond_gltf: false,
        only: "",
        option_default: "",
        in_panel: true,
        sweep: SweepMode::No,
        tried: &[],
        quick: &[],
        cheaper: &[],
        get: |_| None,
        set: |_, _, _| Ok(()),
    }
}

settings! {
    frame {
        /// Width and height of the picture in pixels
        "size", "size" => size: [u32; 2] = [1280, 720], {
            title: "size", of_truth: true, in_panel: false,
        }
        /// Exposure of the picture
        "exposure", "exposure" => exposure: f32, where unset "metered from the scene's lights", {
            title: "exposure", values: ValueKind::Number(-100.0, 100.0), unit: "EV100",
            changes_plan: false, of_truth: true, in_panel: false,
        }
        /// Tone mapper: Khronos PBR Neutral, AgX, ACES, or none, which clamps
        "tonemap", "tonemap" => tonemap: Tonemap = Tonemap::Neutral, {
            title: "tone mapper", of_truth: true, cheaper: &["none"],
        }
        /// Reflection model of all materials
        "brdf", "brdf" => brdf: Brdf, where unset "each material's own", {
            title: "reflection model", of_truth: true, cheaper: &["lambert"],
        }
        /// Layout of the G-buffer
        "gbuffer", "gbuffer" => gbuffer: GbufferChoice = GbufferChoice::default(), {
            title: "G-buffer", sweep: SweepMode::Joint, cheaper: &["lean,normal=oct8"],
        }
        /// Show the lit picture (final), or one of the frame's values
        "view", "view" => view: View = View::Final, {
            title: "view", only: "render, inspect",
        }
        /// Light pixels by this path; the picture is the same
        "light-path", "light_path" => light_path: LightPath = LightPath::Auto, {
            title: "light path", of_lit_picture: true, sweep: SweepMode::Joint, quick: &["loop", "clustered", "compute", "visibility", "forward"],
            cheaper: &["loop", "clustered", "compute", "visibility", "forward"],
        }
        /// Cull opaque objects on the CPU or on the device (gpu); the picture is the same
        "culling", "culling" => culling: Culling = Culling::Auto, {
            title: "culling", in_panel: false, sweep: SweepMode::Alone, cheaper: &["gpu", "cpu"],
        }
        /// Draw in render passes with subpasses, in rendering whose draws read attachments locally (local-read), or in a render pass for each subpass
        /// (stored); the picture is the same
        "passes", "passes" => passes: Passes = Passes::Subpasses, {
            title: "passes", in_panel: false, sweep: SweepMode::Alone, cheaper: &["stored", "local-read"],
        }
        /// Record barriers, render passes and submissions by the API of Vulkan 1.0, or by VK_KHR_synchronization2 (2), with its finer stages; the
        /// picture is the same
        "sync", "sync" => sync: SyncApi = SyncApi::One, {
            title: "synchronization", in_panel: false, sweep: SweepMode::Alone, cheaper: &["2"],
        }
        /// Use images in the layout of each kind of use, or in GENERAL alone (unified); the picture is the same
        "layouts", "layouts" => layouts: ImageLayouts = ImageLayouts::Optimal, {
            title: "layouts", in_panel: false, sweep: SweepMode::Alone, cheaper: &["unified"],
        }
        /// Use one queue of the device, or those beside it (all): ambient occlusion then runs beside the shadow maps, and uploads are copied on the transfer
        /// queue; the picture is the same
        "queues", "queues" => queues: Queues = Queues::One, {
            title: "queues", in_panel: false, sweep: SweepMode::Alone, cheaper: &["all"],
        }
        /// Draw levels of detail: meshes of fewer triangles, off by at most this many pixels; 0 draws the meshes in full
        "lod", "lod" => lod: f32 = 0.0, {
            title: "levels of detail", values: ValueKind::Number(0.0, 100.0), unit: "pixels",
            sweep: SweepMode::Alone, tried: &["0", "0.25", "0.5", "1", "2", "4", "8"], cheaper: &["1"],
        }
        /// Mirror in glossy surfaces what the picture shows of others (screen): each pixel's rays are marched through the depth buffer. Where they find
        /// nothing, light of the sky stays
        "reflections", "reflections" => reflections: Reflections = Reflections::Off, {
            title: "reflections", of_lit_picture: true, beyond_gltf: true, of_truth: true, sweep: SweepMode::Alone,
        }
        /// Leave out reflections of surfaces at least this rough; they fade out over the last fifth below it
        "reflection-roughness", "reflection_roughness" => reflection_roughness: f32 = 0.6, {
            title: "reflection roughness", values: ValueKind::Number(0.0, 1.0), of_truth: true,
        }
        /// Steps of each ray through the pyramid of depths, at most
        "reflection-steps", "reflection_steps" => reflection_steps: u32 = 64, {
            title: "reflection ray steps", values: ValueKind::Whole(1, 1024), sweep: SweepMode::Joint,
            tried: &["16", "32", "64", "128", "256"], quick: &["16", "64"],
        }
        /// Take surfaces to be this thick where a ray passes behind them
        "reflection-thickness", "reflection_thickness" => reflection_thickness: f32 = 0.2, {
            title: "reflection thickness", values: ValueKind::Number(0.0, 1000.0), unit: "m", sweep: SweepMode::Joint,
            tried: &["0.05", "0.1", "0.2", "0.5", "1"], quick: &["0.2"],
        }
        /// Give lights without a range one, beyond which all that is dropped stays below half a step of the output; the path `loop`
        /// drops nothing
        "light-cutoff", "light_cutoff" => light_cutoff: bool = false, {
            title: "light cut-off", of_lit_picture: true, beyond_gltf: true, sweep: SweepMode::Alone, cheaper: &["on"],
        }
        /// Draw the depth of opaque surfaces first, so that each pixel is shaded once
        "depth-prepass", "depth_prepass" => depth_prepass: bool, where unset "on for forward, else off", {
            title: "depth pre-pass", sweep: SweepMode::Alone, cheaper: &["off"],
        }
        /// Use reflection models as textbooks have them, wrong where single floats are at their end: to see what is gained
        "textbook", "textbook" => textbook: bool = false, {
            title: "textbook formulas", sweep: SweepMode::Alone,
        }
        /// Keep light in this format until it is tone-mapped, where something blends
        "hdr-format", "hdr_format" => hdr_format: HdrFormat = HdrFormat::Rgba16f, {
            title: "HDR target", sweep: SweepMode::Joint, cheaper: &["b10g11r11"],
        }
        /// Blend transparent surfaces sorted from back to front, or with weights in any order (oit)
        "transparency", "transparency" => transparency: Transparency = Transparency::Sorted, {
            title: "transparency", sweep: SweepMode::Joint, cheaper: &["oit"],
        }
        /// Draw the particles of the scene's emitters, in the order that transparency says
        "particles", "particles" => particles: bool = true, {
            title: "particles", of_truth: true, sweep: SweepMode::Alone, cheaper: &["off"],
        }
        /// Jittered frames that are averaged into one picture
        "samples", "samples" => samples: u32 = 1, {
            title: "accumulated frames", of_lit_picture: true, smooths: true, values: ValueKind::Whole(1, 4096), only: "render", in_panel: false,
            option_default: "8, or 1 with --view, --msaa, --taa and what works on the finished picture: --fxaa, --aberration, --vignette, --grain",
            sweep: SweepMode::Joint, tried: &["1", "2", "4", "8", "16", "32", "64"], quick: &["1", "4"],
        }
        /// Resolve a pixel's samples: average them before tone mapping (linear) or after it (tone-mapped)
        "resolve", "resolve" => resolve: Resolve = Resolve::ToneMapped, {
            title: "resolve",
        }
        /// Open the lens to this diameter: with several samples, what is out of focus blurs. 0 is a pinhole; an f-number is of the focal length that
        /// sees as much on full frame (36 x 24 mm)
        "aperture", "aperture" => aperture: Aperture = Aperture::PINHOLE, {
            title: "aperture", beyond_gltf: true, changes_plan: false, of_truth: true, in_panel: false,
        }
        /// Distance along the view at which a lens is sharp
        "focus", "focus" => focus: f32, where unset "none; an aperture needs it", {
            title: "focus", values: ValueKind::Number(0.001, 1e6), unit: "metres",
            changes_plan: false, of_truth: true, in_panel: false,
        }
        /// Keep the shutter open for this long, from --time on: each of several samples has its own moment
        "shutter", "shutter" => shutter: f32 = 0.0, {
            title: "shutter", beyond_gltf: true, values: ValueKind::Number(0.0, 1e6), unit: "seconds",
            changes_plan: false, of_truth: true, in_panel: false,
        }
        /// Smooth edges of the tone-mapped picture (FXAA)
        "fxaa", "fxaa" => fxaa: bool = false, {
            title: "FXAA", smooths: true, on_picture: true, sweep: SweepMode::Joint,
        }
        /// Draw red and blue of the picture apart as a simple lens does (chromatic aberration): by this share of the distance from the middle
        "aberration", "aberration" => aberration: f32 = 0.0, {
            title: "chromatic aberration", beyond_gltf: true, values: ValueKind::Number(0.0, 0.05), on_picture: true,
        }
        /// Darken the picture towards its corners as a lens does: by the fourth power of the cosine, to a quarter in the corners at 1
        "vignette", "vignette" => vignette: f32 = 0.0, {
            title: "vignette", beyond_gltf: true, values: ValueKind::Number(0.0, 1.0), on_picture: true,
        }
        /// Grain of film: the most that a pixel loses of its light at random
        "grain", "grain" => grain: f32 = 0.0, {
            title: "film grain", beyond_gltf: true, values: ValueKind::Number(0.0, 1.0), on_picture: true,
        }
        /// Samples of the hardware in each pixel, as far as the device has them; edges are shaded once a sample
        "msaa", "msaa" => msaa: u32 = 1, {
            title: "MSAA", of_lit_picture: true, smooths: true, values: ValueKind::Among(&MSAA), sweep: SweepMode::Joint,
        }
        /// Filter textures that are seen at a low angle by at most this many taps, as far as the device goes; 1 blurs them
        "anisotropy", "anisotropy" => anisotropy: u32 = 8, {
            title: "anisotropy", values: ValueKind::Whole(1, 16),
            sweep: SweepMode::Joint, tried: &["1", "2", "4", "8", "16"], quick: &["1"], cheaper: &["1", "2"],
        }
        /// Light surfaces by the scene's sky, where it has one that lights
        "sky-light", "sky_light" => sky_light: bool = true, {
            title: "sky light", of_truth: true, cheaper: &["off"],
        }
        /// Directions sampled for each texel of the sky's prefiltered reflections, once when it is uploaded
        "sky-samples", "sky_samples" => sky_samples: u32 = 64, {
            title: "sky prefilter samples", values: ValueKind::Whole(1, 4096), in_panel: false,
            sweep: SweepMode::Alone, tried: &["1", "4", "16", "64", "256", "1024"],
        }
        /// Shadowed directions of the sky that each frame lights by, drawn as often as the sky is bright there, in place of light that nothing hides; 0 draws no
        /// shadows of the sky
        "sky-shadows", "sky_shadows" => sky_shadows: u32, where unset "16 from 8 samples, 8 from 32", {
            title: "sky shadows", values: ValueKind::Whole(0, 32), sweep: SweepMode::Alone,
            tried: &["0", "1", "2", "4", "8", "16", "32"], quick: &["0", "8"], cheaper: &["0"],
        }
        /// Weaken ambient and sky light where surfaces nearby hide it (ambient occlusion), found on the screen by samples of the hemisphere (ssao), or by
        /// slices of it, each with a visibility bitmask of the angles that are hidden (bitmask)
        "ao", "ao" => ao: AmbientOcclusion = AmbientOcclusion::Off, {
            title: "ambient occlusion", beyond_gltf: true, sweep: SweepMode::Alone,
        }
        /// Radius within which surfaces hide ambient and sky light: all of it where they touch, none from the radius on
        "ao-radius", "ao_radius" => ao_radius: f32 = 0.5, {
            title: "AO radius", values: ValueKind::Number(0.001, 1000.0), unit: "m", of_truth: true,
        }
        /// Samples of the depth buffer for each pixel of ambient occlusion
        "ao-samples", "ao_samples" => ao_samples: u32 = 16, {
            title: "AO samples", values: ValueKind::Among(&[4, 8, 16, 32, 64, 128]), sweep: SweepMode::Joint,
            quick: &["8", "16", "64"],
        }
        /// Pixels for which ambient occlusion is found: each (full), or one of four (half); the others take it from those around them
        "ao-resolution", "ao_resolution" => ao_resolution: AoResolution = AoResolution::Full, {
            title: "AO resolution", sweep: SweepMode::Joint,
        }
        /// Fill the air with fog that takes light away and scatters some of it to the eye (docs/FOG.md): fog that grows thinner with height, in closed
        /// form (height), or with lamps and shadows in it, found in a grid of froxels (froxels)
        "fog", "fog" => fog: Fog = Fog::Off, {
            title: "fog", beyond_gltf: true, of_truth: true, sweep: SweepMode::Alone, cheaper: &["off"],
        }
        /// Extinction of the fog at its base, per metre
        "fog-density", "fog_density" => fog_density: f32 = 0.02, {
            title: "fog density", values: ValueKind::Number(0.0, 1e6), unit: "1/m", of_truth: true,
        }
        /// Height over which the fog's density falls to 1/e
        "fog-height", "fog_height" => fog_height: f32 = 20.0, {
            title: "fog scale height", values: ValueKind::Number(0.001, 1e6), unit: "m", of_truth: true,
        }
        /// Height (the world's Y) at which the fog has its density
        "fog-base", "fog_base" => fog_base: f32 = 0.0, {
            title: "fog base height", values: ValueKind::Number(-1e6, 1e6), unit: "m", of_truth: true,
        }
        /// Share of the lost light that the fog scatters; it absorbs the rest
        "fog-albedo", "fog_albedo" => fog_albedo: f32 = 1.0, {
            title: "fog albedo", values: ValueKind::Number(0.0, 1.0), of_truth: true,
        }
        /// Mean cosine of the angle by which the fog scatters light (g of Henyey and Greenstein 1941): 0 evenly, near 1 straight on
        "fog-anisotropy", "fog_anisotropy" => fog_anisotropy: f32 = 0.6, {
            title: "fog phase anisotropy", values: ValueKind::Number(-0.999, 0.999), of_truth: true,
        }
        /// Froxels of fog across the picture, down it, and in depth
        "fog-froxels", "fog_froxels" => fog_froxels: [u32; 3] = [160, 90, 64], {
            title: "fog froxels", values: fog::FROXELS, sweep: SweepMode::Alone,
            tried: &["40x23x16", "80x45x32", "160x90x64", "320x180x128"], cheaper: &["80x45x32"],
        }
        /// Places in each froxel where its light is found
        "fog-samples", "fog_samples" => fog_samples: u32 = 1, {
            title: "froxel samples", values: ValueKind::Among(&[1, 2, 4, 8, 16]), sweep: SweepMode::Alone,
        }
        /// End froxels at this distance along the view; beyond it fog is as by height alone
        "fog-distance", "fog_distance" => fog_distance: f32, where unset "the scene's far end", {
            title: "froxel distance", values: ValueKind::Number(0.01, 1e6), unit: "m",
        }
        /// Spread this share of all light around where it comes from, as lenses and eyes do
        "bloom", "bloom" => bloom: f32 = 0.0, {
            title: "bloom", of_lit_picture: true, beyond_gltf: true, values: ValueKind::Number(0.0, 1.0), of_truth: true, cheaper: &["0"],
        }
        /// Root mean square distance over which bloom spreads light, as a part of the picture's height
        "bloom-radius", "bloom_radius" => bloom_radius: f32 = 0.05, {
            title: "bloom radius", values: ValueKind::Number(0.001, 1.0), of_truth: true,
        }
        /// Taps of bloom's filter along each axis: the more, the less the glow of a small light changes as that moves
        "bloom-taps", "bloom_taps" => bloom_taps: u32 = 6, {
            title: "bloom filter taps", values: ValueKind::Among(&[2, 4, 6]), sweep: SweepMode::Alone, cheaper: &["4"],
        }
        /// Average frames over time (temporal anti-aliasing): each looks through another place of its pixels, and takes what frames before it saw of the
        /// same surfaces
        "taa", "taa" => taa: bool = false, {
            title: "temporal anti-aliasing",
        }
        /// Frames that a picture has with temporal anti-aliasing, the last of which is written; what moves goes on between them, by 60 a second
        "taa-frames", "taa_frames" => taa_frames: u32 = 8, {
            title: "TAA frames per picture", smooths: true, values: ValueKind::Whole(1, 4096), in_panel: false,
            sweep: SweepMode::Joint, tried: &["1", "2", "4", "8", "16", "32", "64"], quick: &["4", "16"],
        }
        /// Frames that temporal anti-aliasing averages at most, where nothing moves
        "taa-history", "taa_history" => taa_history: u32 = 64, {
            title: "TAA history length", values: ValueKind::Whole(1, 1024),
            sweep: SweepMode::Alone, tried: &["4", "8", "16", "32", "64", "128"],
        }
        /// Sharpen the average of temporal anti-aliasing by this share of each pixel's difference from its neighbours
        "sharpness", "sharpness" => sharpness: f32 = 0.0, {
            title: "TAA sharpness", values: ValueKind::Number(0.0, 1.0), sweep: SweepMode::Alone, tried: &["0", "0.25", "0.5", "1"],
        }
        /// Keep parts that the scene does not need, to compare with
        "plan", "plan" => keep: Keep = Keep::NONE, {
            title: "parts kept", in_panel: false,
        }
    }
    shadows {
        /// Draw shadows
        "shadows", "enabled" => shadows, enabled: bool = true, {
            title: "shadow maps", of_truth: true, cheaper: &["off"],
        }
        /// Make each layer of shadow maps this wide and high: a cascade has a whole layer, a spot light and each of a point light's six faces a quarter
        "shadow-size", "size" => shadow_size, size: u32 = 2048, {
            // A quarter of the smallest still has room for a filter.
            title: "shadow map size", values: ValueKind::Whole(32, 16384), unit: "texels",
            sweep: SweepMode::Joint, tried: &["256", "512", "1024", "2048", "4096", "8192"], quick: &["512", "2048", "4096"],
            cheaper: &["512"],
        }
        /// Filter shadow lookups; pcss is as wide as the light is large
        "shadow-filter", "filter" => shadow_filter, filter: ShadowFilter = ShadowFilter::Box2, {
            title: "shadow filter", sweep: SweepMode::Joint, quick: &["none", "5x5", "pcss"], cheaper: &["none"],
        }
        /// Draw shadows of transparent surfaces, in the colour of the light that they let through
        "tinted-shadows", "tinted" => tinted_shadows, tinted: bool = false, {
            title: "tinted shadows", of_truth: true,
        }
        /// Shadow maps of each directional light, one behind the other along the view
        "cascades", "cascades" => cascades, cascades: u32 = 2, {
            title: "cascades", values: ValueKind::Whole(1, 4), sweep: SweepMode::Joint, tried: &["1", "2", "3", "4"], quick: &["1"],
            cheaper: &["1"],
        }
        /// Split the view among cascades: 0 evenly, 1 logarithmically (Zhang et al. 2006)
        "shadow-lambda", "lambda" => shadow_lambda, lambda: f32 = 0.7, {
            title: "cascade split", values: ValueKind::Number(0.0, 1.0), changes_plan: false,
            sweep: SweepMode::Alone, tried: &["0", "0.25", "0.5", "0.7", "0.85", "1"],
        }
        /// Memory for all shadow maps; the most important lights get theirs first
        "shadow-budget", "budget" => shadow_budget, budget: u32 = 256, {
            title: "shadow map budget", values: ValueKind::Whole(1, u32::MAX), unit: "MiB", in_panel: false,
        }
        /// Redraw a shadow map only after its light, or something in it, has moved
        "shadow-cache", "cache" => shadow_cache, cache: bool = true, {
            title: "shadow map cache", changes_plan: false,
        }
        /// Offset the shadow lookup along the geometric normal, in texels of the map; other filters than 3x3 scale it by their reach
        "shadow-normal-offset", "normal_offset" => shadow_normal_offset, normal_offset: f32 = 0.25, {
            title: "shadow normal offset", values: ValueKind::Number(0.0, 1000.0), unit: "texels", changes_plan: false,
            sweep: SweepMode::Alone, tried: &["0", "0.25", "0.5", "1", "2", "4", "8"],
        }
        /// Depth bias of shadow maps by the slope of what is drawn (`depthBiasSlopeFactor`), scaled likewise
        "shadow-slope-bias", "slope_bias" => shadow_slope_bias, slope_bias: f32 = 0.5, {
            title: "shadow slope bias", values: ValueKind::Number(0.0, 1000.0), changes_plan: false,
            sweep: SweepMode::Alone, tried: &["0", "0.5", "0.75", "1.5", "3", "6"],
        }
    }
}
