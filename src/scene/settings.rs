//! How a frame is asked to be drawn: `SettingsPatch` is what a scene file or a command line says, `Settings` what is decided.

use serde::{Deserialize, Serialize};

use super::{Brdf, Error, Keep};

/// The decided settings of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Width and height in pixels, at least 1.
    pub size: [u32; 2],
    /// EV100; `None` is metered from the scene's lights.
    pub exposure: Option<f32>,
    pub tonemap: Tonemap,
    /// Overrides every material's own.
    pub brdf: Option<Brdf>,
    pub gbuffer: GbufferChoice,
    pub shadows: ShadowSettings,
    pub view: View,
    pub light_path: LightPath,
    /// Gives a light without a range one, beyond which all that is dropped stays below half a step of the output. A setting of the
    /// light path: lights themselves have none, and `loop` drops nothing.
    pub light_cutoff: bool,
    /// Draw the depth of opaque surfaces first, so that each pixel is shaded once. `None`: as the light path has it.
    pub depth_prepass: Option<bool>,
    /// The reflection models as textbooks have them, without what keeps them right where single floats do not: to be measured beside.
    pub textbook: bool,
    /// Of the target between LIGHTING and tone mapping, where a plan has one.
    pub hdr_format: HdrFormat,
    pub transparency: Transparency,
    /// What a picture holds.
    pub output: Output,
    /// Jittered frames that are averaged into one picture, 1 to [`MAX_SAMPLES`].
    pub samples: u32,
    /// Where the samples of a pixel are averaged, whether they are frames or the hardware's.
    pub resolve: Resolve,
    /// Smooths the edges of the tone-mapped picture.
    pub fxaa: bool,
    /// Samples of depth and G-buffer in each pixel: 1, 2, 4 or 8, as far as the device has them.
    pub msaa: u32,
    /// How much longer than wide a pixel's place on a texture may be before it is blurred, 1 to [`MAX_ANISOTROPY`], as far as the device
    /// goes: 1 takes the level of the long side.
    pub anisotropy: u32,
    /// What stays in the plan although nothing needs it.
    pub keep: Keep,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            exposure: None,
            tonemap: Tonemap::default(),
            brdf: None,
            gbuffer: GbufferChoice::default(),
            shadows: ShadowSettings::default(),
            view: View::default(),
            light_path: LightPath::default(),
            light_cutoff: false,
            depth_prepass: None,
            textbook: false,
            hdr_format: HdrFormat::default(),
            transparency: Transparency::default(),
            output: Output::default(),
            samples: 1,
            resolve: Resolve::default(),
            fxaa: false,
            msaa: 1,
            anisotropy: 8,
            keep: Keep::NONE,
        }
    }
}

/// What the pixels of a picture are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Output {
    /// Tone-mapped, 8 bits a channel, sRGB-encoded.
    #[default]
    Srgb8,
    /// Linear scene light in nits, as 32-bit floats; of a view its values, as docs/SCENES.md says.
    Nits,
    /// The exposed light that the tone-mapped frame of the same settings would tone-map, as 32-bit floats; 1 is where the sensor
    /// saturates. To measure what that frame does to light: where it has an HDR target, light goes through that target's format
    /// here too. Several samples are averaged as light, whatever [`Resolve`] says. A view is the same as in `Nits`.
    Exposed,
}

impl Output {
    /// Whether pixels are floats, and not tone-mapped.
    pub fn is_linear(self) -> bool {
        self != Self::Srgb8
    }
}

/// The format that light is kept in until it is tone-mapped, and what storing it may cost: a driver may truncate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum HdrFormat {
    /// 8 bytes a pixel, 10 bits of mantissa: an error of at most 0.1%. Blends everywhere.
    #[default]
    Rgba16f,
    /// 4 bytes a pixel, without sign and alpha. 6 bits of mantissa in red and green, 5 in blue: 1.6% and 3.1%, each time that
    /// something is added.
    B10g11r11,
    /// 16 bytes a pixel, 23 bits of mantissa.
    Rgba32f,
}

/// How surfaces that show what lies behind them are laid over one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transparency {
    /// From back to front, by object and by triangle within one: exact where surfaces do not pass through each other.
    #[default]
    Sorted,
    /// Weighted blended, in any order (McGuire and Bavoil 2013): an estimate where surfaces overlap, exact where there is one.
    Oit,
}

/// How pixels meet their lights. All give the same picture; what they cost differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightPath {
    /// The plan chooses by a rule, and says which and why.
    #[default]
    Auto,
    /// One full-screen draw, every light on every pixel.
    Loop,
    /// A draw for each light, cut to the rectangle that it reaches, added by blending.
    PerLight,
    /// A sphere or cone for each light, drawn where surfaces lie before its back, added by blending.
    Volumes,
    /// Lists of lights for each froxel, made on the CPU.
    Clustered,
    /// The G-buffer is stored and a compute pass lights tiles with lists in shared memory.
    Compute,
    /// No G-buffer: surfaces are lit as they are drawn, with the lists of `Clustered`.
    Forward,
    /// No G-buffer, no lists, no depth pre-pass: every fragment meets every light.
    ForwardNaive,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowSettings {
    pub enabled: bool,
    /// Edge in texels of a layer of maps: a cascade has a whole one, a spot light and each face of a point light a quarter.
    pub size: u32,
    pub filter: ShadowFilter,
    /// Maps of a directional light, 1 to 4.
    pub cascades: u32,
    /// How the cascades part the view: 0 evenly, 1 logarithmically (Zhang et al. 2006).
    pub lambda: f32,
    /// MiB that all maps may take together.
    pub budget: u32,
    /// Whether a map is drawn only when something in it moved.
    pub cache: bool,
    /// Offset along the geometric normal, in texels of the map at that place; for the 3x3 filter, the others scale it by their
    /// reach.
    pub normal_offset: f32,
    /// Slope-scaled depth bias (`depthBiasSlopeFactor`), scaled likewise.
    pub slope_bias: f32,
}

impl Default for ShadowSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            size: 2048,
            filter: ShadowFilter::default(),
            cascades: 2,
            lambda: 0.7,
            budget: 256,
            cache: true,
            normal_offset: 0.25,
            slope_bias: 0.5,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tonemap {
    /// Khronos PBR Neutral.
    #[default]
    Neutral,
    Agx,
    /// Stephen Hill's fit of the ACES reference and output transforms.
    Aces,
    /// Clamp only.
    None,
}

/// Where the samples of a pixel are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Resolve {
    /// As scene light: what a sensor would do. An edge against something far too bright stays jagged.
    Linear,
    /// As display light, after tone mapping: no sample counts for more than white.
    #[default]
    ToneMapped,
}

/// How texels of a shadow map become a share of light; the numbers are those of `shaders/shared/shadows.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ShadowFilter {
    /// The nearest texel: lit or not.
    None = 0,
    /// Percentage-closer filtering of two by two texels, bilinearly weighted.
    #[default]
    Box2 = 1,
    /// Three by three.
    Box3 = 2,
    /// Five by five.
    Box5 = 3,
    /// Sixteen texels on a disc that is turned from pixel to pixel.
    Poisson = 4,
    /// Percentage-closer soft shadows (Fernando 2005): the disc is as wide as the penumbra of a light that has a size.
    Pcss = 5,
}

/// What the picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    #[default]
    Final,
    /// Sign-log map of the world position, scaled by the scene's extent.
    Position,
    /// Shading normal, half-encoded: n * 0.5 + 0.5.
    Normal,
    /// Shading normal, absolute value.
    NormalAbsolute,
    Albedo,
    Metallic,
    Roughness,
    Depth,
    ShadowMap,
    /// Lit with albedo 1.
    Lighting,
    /// Fragments shaded for each pixel, as a heat map.
    Overdraw,
    /// Lights that reach each pixel, as a heat map.
    LightsPerPixel,
    /// Pixels whose multisamples differ, so that each of them is shaded.
    Complexity,
    /// The triangle that each pixel shows, in a colour of its own; transparent ones are not looked at.
    Triangle,
}

/// Which format each target of the G-buffer has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GbufferChoice {
    pub preset: GbufferPreset,
    /// Overrides of the preset by target.
    pub position: Option<TargetChoice>,
    pub normal: Option<TargetChoice>,
    pub albedo: Option<TargetChoice>,
    pub material: Option<TargetChoice>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GbufferPreset {
    #[default]
    Lean,
    Fat,
    Float32,
}

/// A format that a G-buffer target can be given; which ones a target takes: `GbufferChoice`'s parser says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TargetChoice {
    /// Position only: rebuilt from depth, no target.
    Depth,
    /// Normal only: octahedral, two 16-bit normalized channels (R16G16_UNORM).
    Oct16,
    /// Normal only: octahedral in R16G16_UINT, what devices without R16G16_UNORM targets get.
    Oct16Uint,
    /// Normal only: half-encoded xyz, 10 bits each.
    Rgb10a2,
    /// Albedo (sRGB-encoded) and material.
    Rgba8,
    Rgba16f,
    Rgba32f,
}

/// Settings as far as somebody has said them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SettingsPatch {
    pub size: Option<[u32; 2]>,
    pub exposure: Option<f32>,
    pub tonemap: Option<Tonemap>,
    pub brdf: Option<Brdf>,
    pub gbuffer: Option<GbufferChoice>,
    pub shadows: Option<bool>,
    pub shadow_size: Option<u32>,
    pub shadow_filter: Option<ShadowFilter>,
    pub cascades: Option<u32>,
    pub shadow_lambda: Option<f32>,
    pub shadow_budget: Option<u32>,
    pub shadow_cache: Option<bool>,
    pub shadow_normal_offset: Option<f32>,
    pub shadow_slope_bias: Option<f32>,
    pub view: Option<View>,
    pub light_path: Option<LightPath>,
    pub light_cutoff: Option<bool>,
    pub textbook: Option<bool>,
    pub depth_prepass: Option<bool>,
    pub samples: Option<u32>,
    pub resolve: Option<Resolve>,
    pub fxaa: Option<bool>,
    pub hdr_format: Option<HdrFormat>,
    pub transparency: Option<Transparency>,
    pub msaa: Option<u32>,
    pub anisotropy: Option<u32>,
    pub keep: Option<Keep>,
}

impl Settings {
    /// For the values that a view shows: what a buffer holds does not depend on how its pixels are lit, and not every way of that has
    /// buffers.
    pub(crate) fn showing(&self, view: View) -> Self {
        Self {
            view,
            light_path: LightPath::Auto,
            light_cutoff: false,
            output: Output::Nits,
            samples: 1,
            msaa: 1,
            fxaa: false,
            ..self.clone()
        }
    }
}

impl SettingsPatch {
    /// `self` where it says something, `other` elsewhere: `command_line.or(&scene_file)`.
    pub fn or(&self, other: &Self) -> Self {
        Self {
            size: self.size.or(other.size),
            exposure: self.exposure.or(other.exposure),
            tonemap: self.tonemap.or(other.tonemap),
            brdf: self.brdf.or(other.brdf),
            gbuffer: self.gbuffer.or(other.gbuffer),
            shadows: self.shadows.or(other.shadows),
            shadow_size: self.shadow_size.or(other.shadow_size),
            shadow_filter: self.shadow_filter.or(other.shadow_filter),
            cascades: self.cascades.or(other.cascades),
            shadow_lambda: self.shadow_lambda.or(other.shadow_lambda),
            shadow_budget: self.shadow_budget.or(other.shadow_budget),
            shadow_cache: self.shadow_cache.or(other.shadow_cache),
            shadow_normal_offset: self.shadow_normal_offset.or(other.shadow_normal_offset),
            shadow_slope_bias: self.shadow_slope_bias.or(other.shadow_slope_bias),
            view: self.view.or(other.view),
            light_path: self.light_path.or(other.light_path),
            light_cutoff: self.light_cutoff.or(other.light_cutoff),
            textbook: self.textbook.or(other.textbook),
            depth_prepass: self.depth_prepass.or(other.depth_prepass),
            samples: self.samples.or(other.samples),
            resolve: self.resolve.or(other.resolve),
            fxaa: self.fxaa.or(other.fxaa),
            hdr_format: self.hdr_format.or(other.hdr_format),
            transparency: self.transparency.or(other.transparency),
            msaa: self.msaa.or(other.msaa),
            anisotropy: self.anisotropy.or(other.anisotropy),
            keep: self.keep.or(other.keep),
        }
    }

    /// The defaults, with what was said laid over them.
    pub fn decide(&self) -> Settings {
        let default = Settings::default();
        Settings {
            size: self.size.unwrap_or(default.size),
            exposure: self.exposure.or(default.exposure),
            tonemap: self.tonemap.unwrap_or(default.tonemap),
            brdf: self.brdf.or(default.brdf),
            gbuffer: self.gbuffer.unwrap_or(default.gbuffer),
            shadows: ShadowSettings {
                enabled: self.shadows.unwrap_or(default.shadows.enabled),
                size: self.shadow_size.unwrap_or(default.shadows.size),
                filter: self.shadow_filter.unwrap_or(default.shadows.filter),
                cascades: self.cascades.unwrap_or(default.shadows.cascades),
                lambda: self.shadow_lambda.unwrap_or(default.shadows.lambda),
                budget: self.shadow_budget.unwrap_or(default.shadows.budget),
                cache: self.shadow_cache.unwrap_or(default.shadows.cache),
                normal_offset: self.shadow_normal_offset.unwrap_or(default.shadows.normal_offset),
                slope_bias: self.shadow_slope_bias.unwrap_or(default.shadows.slope_bias),
            },
            view: self.view.unwrap_or(default.view),
            light_path: self.light_path.unwrap_or(default.light_path),
            light_cutoff: self.light_cutoff.unwrap_or(default.light_cutoff),
            textbook: self.textbook.unwrap_or(default.textbook),
            depth_prepass: self.depth_prepass.or(default.depth_prepass),
            hdr_format: self.hdr_format.unwrap_or(default.hdr_format),
            transparency: self.transparency.unwrap_or(default.transparency),
            output: default.output,
            samples: self.samples.unwrap_or(default.samples),
            resolve: self.resolve.unwrap_or(default.resolve),
            fxaa: self.fxaa.unwrap_or(default.fxaa),
            msaa: self.msaa.unwrap_or(default.msaa),
            anisotropy: self.anisotropy.unwrap_or(default.anisotropy),
            keep: self.keep.unwrap_or(default.keep),
        }
    }

    /// Whether each value that was said is in its range.
    ///
    /// # Errors
    /// [`Error::Setting`], which names the setting, what it was and what it may be.
    pub fn check(&self) -> Result<(), Error> {
        let wrong = |what: String| Err(Error::Setting(what));
        if let Some([width, height]) = self.size
            && (width == 0 || height == 0)
        {
            return wrong(format!("size {width}x{height}: width and height must be at least 1"));
        }
        if let Some(ev100) = self.exposure
            && !(-100.0..=100.0).contains(&ev100)
        {
            return wrong(format!("exposure {ev100}: must be an EV100 from -100 to 100"));
        }
        if let Some(size) = self.shadow_size
            && !(MIN_SHADOW_SIZE..=MAX_SHADOW_SIZE).contains(&size)
        {
            return wrong(format!("shadow size {size}: must be {MIN_SHADOW_SIZE} to {MAX_SHADOW_SIZE} texels"));
        }
        if let Some(cascades) = self.cascades
            && !(1..=4).contains(&cascades)
        {
            return wrong(format!("cascades {cascades}: must be 1 to 4"));
        }
        if let Some(lambda) = self.shadow_lambda
            && !(0.0..=1.0).contains(&lambda)
        {
            return wrong(format!("shadow lambda {lambda}: must be 0 to 1"));
        }
        if self.shadow_budget == Some(0) {
            return wrong("shadow budget 0: must be at least 1 MiB".into());
        }
        if let Some(samples) = self.samples
            && !(1..=MAX_SAMPLES).contains(&samples)
        {
            return wrong(format!("samples {samples}: must be 1 to {MAX_SAMPLES} frames"));
        }
        if let Some(msaa) = self.msaa
            && !MSAA.contains(&msaa)
        {
            return wrong(format!("msaa {msaa}: must be 1, 2, 4 or 8 samples a pixel"));
        }
        if let Some(anisotropy) = self.anisotropy
            && !(1..=MAX_ANISOTROPY).contains(&anisotropy)
        {
            return wrong(format!("anisotropy {anisotropy}: must be 1 to {MAX_ANISOTROPY}"));
        }
        for (name, bias) in [("normal offset", self.shadow_normal_offset), ("slope bias", self.shadow_slope_bias)] {
            if let Some(bias) = bias
                && !(0.0..=1000.0).contains(&bias)
            {
                return wrong(format!("shadow {name} {bias}: must be 0 to 1000"));
            }
        }
        Ok(())
    }
}

/// The smallest edge of a layer of shadow maps in texels: a quarter of it still has room for a filter.
pub const MIN_SHADOW_SIZE: u32 = 32;
/// The largest edge in texels; a device may allow less.
pub const MAX_SHADOW_SIZE: u32 = 16384;

/// The most frames that are averaged into one picture.
pub const MAX_SAMPLES: u32 = 4096;

/// Samples a pixel that multisampling can have; a device may have fewer.
pub const MSAA: [u32; 4] = [1, 2, 4, 8];

/// The most anisotropy that textures can be filtered with; a device may have less.
pub const MAX_ANISOTROPY: u32 = 16;

/// Width and height from `1280x720`, each at least 1.
///
/// # Errors
/// [`Error::Setting`] when the text is something else.
pub fn parse_size(text: &str) -> Result<[u32; 2], Error> {
    let number = |text: &str| text.trim().parse::<u32>().ok().filter(|_| !text.trim().starts_with('+'));
    let size = text.split_once(['x', 'X']).and_then(|(width, height)| Some([number(width)?, number(height)?]));
    let Some(size) = size else {
        return Err(Error::Setting(format!("size \"{text}\": expected WIDTHxHEIGHT in pixels, as in 1280x720")));
    };
    SettingsPatch { size: Some(size), ..SettingsPatch::default() }.check()?;
    Ok(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_parse_or_say_why_not() {
        assert_eq!(parse_size("1280x720").unwrap(), [1280, 720]);
        for text in ["0x0", "10x0", "10", "axb", "-1x5", "1x2x3", "99999999999x1", ""] {
            assert!(parse_size(text).unwrap_err().to_string().starts_with("size "), "{text}");
        }
    }

    #[test]
    fn settings_out_of_range_are_refused() {
        let refused = |patch: SettingsPatch| patch.check().is_err();
        assert!(refused(SettingsPatch { exposure: Some(f32::NAN), ..Default::default() }));
        assert!(refused(SettingsPatch { shadow_size: Some(0), ..Default::default() }));
        assert!(refused(SettingsPatch { shadow_size: Some(16385), ..Default::default() }));
        assert!(refused(SettingsPatch { shadow_slope_bias: Some(-1.0), ..Default::default() }));
        assert!(refused(SettingsPatch { samples: Some(0), ..Default::default() }));
        assert!(refused(SettingsPatch { msaa: Some(3), ..Default::default() }));
        assert!(refused(SettingsPatch { anisotropy: Some(0), ..Default::default() }));
        assert!(refused(SettingsPatch { anisotropy: Some(17), ..Default::default() }));
        assert!(refused(SettingsPatch { samples: Some(4097), ..Default::default() }));
        assert!(!refused(SettingsPatch { shadow_size: Some(16384), exposure: Some(15.0), ..Default::default() }));
    }
}
