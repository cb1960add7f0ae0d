//! The values that settings choose among.

use serde::{Deserialize, Serialize};

/// The form of a picture's pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Output {
    /// Tone-mapped, 8 bits a channel, sRGB-encoded.
    #[default]
    Srgb8,
    /// Linear scene light in nits, as 32-bit floats; of a view its values, as docs/SCENES.md says.
    Nits,
    /// The exposed light that the tone-mapped frame of the same settings would tone-map, as 32-bit floats; at 1 the sensor saturates.
    /// It shows the effect of that frame on light: if the frame has an HDR target, light goes through that target's format here too. Several
    /// samples are averaged as light, with any [`Resolve`]. A view is the same as in `Nits`.
    Exposed,
}

impl Output {
    /// Returns true if pixels are floats, and not tone-mapped.
    pub fn is_linear(self) -> bool {
        self != Self::Srgb8
    }
}

/// The format that light is kept in until it is tone-mapped, with the error of storing it: a driver may truncate.
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

/// The way that transparent surfaces are laid over one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transparency {
    /// From back to front, by object and by triangle within one: exact where surfaces do not pass through each other.
    #[default]
    Sorted,
    /// Weighted blended, in any order (McGuire and Bavoil 2013): an estimate where surfaces overlap, exact where there is one.
    Oit,
}

/// The way that ambient occlusion is found on the screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AmbientOcclusion {
    /// Surfaces hide nothing from each other.
    #[default]
    Off,
    /// Places in the hemisphere above a surface are hidden where something nearer is seen in front of them (after M. Mittring, "Finding Next Gen",
    /// 2007).
    Ssao,
    /// Slices of the hemisphere are marched, and a visibility bitmask keeps the angles that samples hide (O. Therrien, Y. Levesque and G. Gilet,
    /// "Screen Space Indirect Lighting with Visibility Bitmask", 2023).
    #[serde(alias = "gtao")]
    Bitmask,
}

/// For which pixels something is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AoResolution {
    /// Each.
    #[default]
    Full,
    /// One of two across and of two down.
    Half,
}

/// Reflections of surfaces in each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reflections {
    /// They mirror lights and the sky alone.
    #[default]
    Off,
    /// Surfaces mirror what the picture shows of others, as far as a ray through its depth buffer meets it.
    Screen,
}

/// The processor that culls opaque objects. The picture is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Culling {
    /// The plan chooses by a rule, and says which and why.
    #[default]
    Auto,
    /// The CPU, by a tree of boxes.
    Cpu,
    /// The device, by compute passes that write the commands which draw.
    Gpu,
}

/// The way that pixels meet their lights. All give the same picture, at different costs.
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
    /// No G-buffer: which triangle each pixel shows is stored, and the compute pass looks surfaces up and lights them as `Compute` does.
    Visibility,
    /// No G-buffer: surfaces are lit as they are drawn, with the lists of `Clustered`.
    Forward,
    /// No G-buffer, no lists, no depth pre-pass: every fragment meets every light.
    ForwardNaive,
}

/// The curve from exposed light, of which 1 saturates the sensor, to what a display shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tonemap {
    /// Khronos PBR Neutral.
    #[default]
    Neutral,
    /// Troy Sobotka's AgX, in the polynomial fit of Benjamin Wrensch.
    Agx,
    /// Stephen Hill's fit of the ACES reference and output transforms.
    Aces,
    /// Clamp only.
    None,
}

/// The scale on which the samples of a pixel are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Resolve {
    /// As scene light, as a sensor does. An edge against something far too bright stays jagged.
    Linear,
    /// As display light, after tone mapping: no sample counts for more than white.
    #[default]
    ToneMapped,
}

/// The filter that makes a share of light of a shadow map's texels; the numbers are those of `shaders/shared/shadows.wgsl`.
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

/// The content of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// The lit picture.
    #[default]
    Final,
    /// Sign-log map of the world position, scaled by the scene's extent.
    Position,
    /// Shading normal, half-encoded: n * 0.5 + 0.5.
    Normal,
    /// Shading normal, absolute value.
    NormalAbsolute,
    /// Base colour with its textures, linear.
    Albedo,
    /// 0 black, 1 white.
    Metallic,
    /// Perceptual roughness, or its equivalent of the Phong models: 0 black, 1 white.
    Roughness,
    /// Near is white, infinitely far black, at half the radius of the scene grey; in metres along the view axis where the output is linear.
    Depth,
    /// The maps of the shadow atlas.
    ShadowMap,
    /// Lit with albedo 1.
    Lighting,
    /// Lit by what comes from everywhere alone: half-spheres and the sky.
    Ambient,
    /// The light that bloom spreads, without the picture that it is spread from.
    Bloom,
    /// Layers of particles on each pixel: one more step of grey each, and their number where the output is linear.
    Particles,
    /// Fragments shaded for each pixel, as a heat map.
    Overdraw,
    /// Lights that reach each pixel, as a heat map.
    LightsPerPixel,
    /// Pixels whose multisamples differ, so that each of them is shaded.
    Complexity,
    /// The triangle that each pixel shows, in a colour of its own; transparent ones are not looked at.
    Triangle,
    /// The light that fog scatters to the eye, without what is seen through it.
    Fog,
    /// The share of light from everywhere that arrives, by materials and by ambient occlusion: 0 black, 1 white.
    Ao,
    /// The motion of each pixel's surface on the picture since the frame before: the direction is a colour, and far is bright; in pixels to the
    /// right and down where the output is linear.
    Velocity,
    /// The light that each pixel finds on the screen to mirror, times the share of the lobe that found any; black where none did.
    Reflections,
}

/// The air between the eye and the surfaces, which takes light away and scatters some of it to the eye.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Fog {
    /// The air is clear.
    #[default]
    Off,
    /// Fog that grows thinner with height, by formulas in closed form: lit by what comes from everywhere and by directional lights, without shadows.
    Height,
    /// The same fog with all lights in it and their shadows, found in a grid of froxels.
    Froxels,
}

/// The format of each target of the G-buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GbufferChoice {
    /// The formats of targets without an override below.
    pub preset: GbufferPreset,
    /// `Depth`, `Rgba16f` or `Rgba32f`.
    pub position: Option<TargetChoice>,
    /// Any but `Depth` and `Rgba8`.
    pub normal: Option<TargetChoice>,
    /// `Rgba8`, `Rgba16f` or `Rgba32f`.
    pub albedo: Option<TargetChoice>,
    /// As `albedo`.
    pub material: Option<TargetChoice>,
}

/// A format for each target of the G-buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GbufferPreset {
    /// Position from depth, `Oct16` normals, `Rgba8` for the rest.
    #[default]
    Lean,
    /// `Rgba16f` for all, with a target for the position.
    Fat,
    /// `Rgba32f` for all, with a target for the position.
    Float32,
}

/// A format that a G-buffer target can be given; which ones a target takes: `GbufferChoice`'s parser says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TargetChoice {
    /// Position only: rebuilt from depth, no target.
    Depth,
    /// Normal only: octahedral, two 16-bit normalized channels (R16G16_UNORM).
    Oct16,
    /// Normal only: octahedral in R16G16_UINT, for devices without R16G16_UNORM targets.
    Oct16Uint,
    /// Normal only: octahedral, two 8-bit normalized channels.
    Oct8,
    /// Normal only: half-encoded xyz, 8 bits each.
    Rgb8,
    /// Normal only: half-encoded xyz, 10 bits each.
    Rgb10a2,
    /// Albedo (sRGB-encoded) and material.
    Rgba8,
    /// Every target: half floats, 8 bytes a pixel.
    Rgba16f,
    /// Every target: single floats, 16 bytes a pixel.
    Rgba32f,
}

/// Samples a pixel that multisampling can have; a device may have fewer.
pub const MSAA: [u32; 4] = [1, 2, 4, 8];
