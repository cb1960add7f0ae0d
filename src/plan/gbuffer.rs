//! The G-buffer's targets: which exist, in which format.

use ash::vk;

use super::{Capabilities, DEPTH, PlannedBrdf};
use crate::scene::{Brdf, GbufferChoice, GbufferPreset, Keep, OptionalPart, TargetChoice, View};
use crate::shaders::shared::encodings as wgsl;

/// The encoding that fits a normal into its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum NormalEncoding {
    /// Octahedral, in two channels of 16 bits.
    Octahedral = wgsl::OCTAHEDRAL,
    /// From -1..1 to 0..1, in three channels.
    HalfEncoded = wgsl::HALF_ENCODED,
    /// Unencoded, in signed channels.
    Signed = wgsl::SIGNED,
    /// Octahedral, in two channels of 8 bits.
    Octahedral8 = wgsl::OCTAHEDRAL_8,
}

/// Formats of the targets that GEOMETRY writes besides depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gbuffer {
    /// RGB albedo, sRGB-encoded if it has 8 bits; alpha: ambient occlusion.
    pub albedo: vk::Format,
    /// Shading normal.
    pub normal: vk::Format,
    /// The encoding of directions in the normal target.
    pub normal_encoding: NormalEncoding,
    /// Perceptual roughness (or shininess), metallic, geometric normal octahedral in the last two; as many channels as are needed.
    pub material: Option<vk::Format>,
    /// The material's second channel is in use.
    pub metallic: bool,
    /// The material's last two channels are in use. Otherwise the shading normal is the geometric one.
    pub geometric_normal: bool,
    /// A pass reads geometric normals that differ from the shading normals. Channels that are kept without that need mark the two normals as equal in
    /// every pixel, so that they change no bit.
    pub normals_differ: bool,
    /// Ks, and the BRDF's index in alpha. If some Cook-Torrance surface reflects otherwise than a usual dielectric, such surfaces store the square
    /// root of the reflectance at normal incidence, and alpha stores the grazing reflectance times 2/3, or the index b of another BRDF as (b + 6) /
    /// 9.
    pub specular: Option<vk::Format>,
    /// Position relative to the camera; rebuilt from depth if absent.
    pub position: Option<vk::Format>,
}

/// The properties of surfaces that a G-buffer has to store.
#[derive(Debug, Clone, Copy)]
pub(super) struct GbufferNeeds {
    pub brdf: PlannedBrdf,
    /// Some surface is a metal.
    pub metal: bool,
    /// Some Cook-Torrance surface reflects otherwise than a usual dielectric.
    pub reflectance: bool,
    /// Shadow biases need a geometric normal that differs from the shading normal, or some surfaces receive no shadows.
    pub geometric_normal: bool,
    /// Is it looked at?
    pub view: View,
    pub keep: Keep,
}

impl Gbuffer {
    pub(super) fn choose(choice: &GbufferChoice, stored: GbufferNeeds, device: &Capabilities) -> Self {
        use TargetChoice as T;
        // ANCHOR: formats
        let (position, normal, rest) = match choice.preset {
            // 32 + 32 + 32 bits and depth: 128 bits a pixel.
            GbufferPreset::Lean => (T::Depth, T::Oct16, T::Rgba8),
            GbufferPreset::Fat => (T::Rgba16f, T::Rgba16f, T::Rgba16f),
            GbufferPreset::Float32 => (T::Rgba32f, T::Rgba32f, T::Rgba32f),
        };
        let (normal, normal_encoding) = match choice.normal.unwrap_or(normal) {
            T::Oct16 if device.unorm_2x16_attachment => (vk::Format::R16G16_UNORM, NormalEncoding::Octahedral),
            T::Oct16 | T::Oct16Uint => (vk::Format::R16G16_UINT, NormalEncoding::Octahedral),
            T::Oct8 => (vk::Format::R8G8_UNORM, NormalEncoding::Octahedral8),
            T::Rgb8 => (vk::Format::R8G8B8A8_UNORM, NormalEncoding::HalfEncoded),
            T::Rgb10a2 => (vk::Format::A2B10G10R10_UNORM_PACK32, NormalEncoding::HalfEncoded),
            T::Rgba16f => (vk::Format::R16G16B16A16_SFLOAT, NormalEncoding::Signed),
            T::Rgba32f | T::Depth | T::Rgba8 => (vk::Format::R32G32B32A32_SFLOAT, NormalEncoding::Signed),
            // ANCHOR_END: formats
        };
        let material = choice.material.unwrap_or(rest);
        let keep = |part| stored.keep.has(part);
        // For the lobe, for the shadow's bias, or because they are looked at.
        let all = keep(OptionalPart::MaterialTarget);
        let geometric_normal = stored.geometric_normal || all || keep(OptionalPart::GeometricNormalChannels);
        let metallic = stored.metal || stored.view == View::Metallic || all || keep(OptionalPart::MetallicChannel);
        let roughness = stored.brdf != PlannedBrdf::One(Brdf::Lambert) || stored.view == View::Roughness;
        let needs_specular = !matches!(stored.brdf, PlannedBrdf::One(Brdf::CookTorrance | Brdf::Lambert))
            || stored.reflectance
            || keep(OptionalPart::SpecularTarget);
        let channels = match (geometric_normal, metallic, roughness || needs_specular) {
            (true, ..) => 4,
            (_, true, _) => 2,
            (_, _, true) => 1,
            _ => 0,
        };
        Self {
            albedo: color_format(choice.albedo.unwrap_or(rest), vk::Format::R8G8B8A8_SRGB),
            normal,
            normal_encoding,
            material: (channels > 0).then(|| channel_format(material, channels)),
            metallic,
            geometric_normal,
            normals_differ: stored.geometric_normal,
            specular: needs_specular.then(|| color_format(material, vk::Format::R8G8B8A8_UNORM)),
            position: match choice.position.unwrap_or(position) {
                T::Rgba16f => Some(vk::Format::R16G16B16A16_SFLOAT),
                T::Rgba32f => Some(vk::Format::R32G32B32A32_SFLOAT),
                _ => None,
            },
        }
    }

    /// Depth included.
    pub fn bytes_per_pixel(&self) -> u32 {
        self.formats().map(format_bytes).sum::<u32>() + format_bytes(DEPTH)
    }

    /// Formats of the colour targets.
    pub fn formats(&self) -> impl Iterator<Item = vk::Format> {
        [Some(self.albedo), Some(self.normal), self.material, self.specular, self.position].into_iter().flatten()
    }

    /// Codes of a material channel that holds half of the geometric normal: 255 of 8 bits, and no more than the mantissa
    /// of a half float between 0.5 and 1 tells apart. 0 where no channel holds it.
    pub fn geometric_steps(&self) -> f32 {
        match self.material.filter(|_| self.geometric_normal) {
            None => 0.0,
            Some(vk::Format::R16G16B16A16_SFLOAT) => 1023.0,
            Some(vk::Format::R32G32B32A32_SFLOAT) => 65535.0,
            _ => 255.0,
        }
    }
}

fn color_format(choice: TargetChoice, eight_bits: vk::Format) -> vk::Format {
    match choice {
        TargetChoice::Rgba16f => vk::Format::R16G16B16A16_SFLOAT,
        TargetChoice::Rgba32f => vk::Format::R32G32B32A32_SFLOAT,
        _ => eight_bits,
    }
}

/// The format of 1, 2 or 4 channels. Vulkan requires all of them to be renderable.
fn channel_format(choice: TargetChoice, channels: u32) -> vk::Format {
    match (choice, channels) {
        (TargetChoice::Rgba16f, 1) => vk::Format::R16_SFLOAT,
        (TargetChoice::Rgba16f, 2) => vk::Format::R16G16_SFLOAT,
        (TargetChoice::Rgba32f, 1) => vk::Format::R32_SFLOAT,
        (TargetChoice::Rgba32f, 2) => vk::Format::R32G32_SFLOAT,
        (TargetChoice::Rgba16f | TargetChoice::Rgba32f, _) => color_format(choice, vk::Format::UNDEFINED),
        (_, 1) => vk::Format::R8_UNORM,
        (_, 2) => vk::Format::R8G8_UNORM,
        _ => vk::Format::R8G8B8A8_UNORM,
    }
}

/// Bytes of a texel, for the formats that targets have.
pub fn format_bytes(format: vk::Format) -> u32 {
    match format {
        vk::Format::R32G32B32A32_SFLOAT | vk::Format::R32G32B32A32_UINT => 16,
        vk::Format::R16G16B16A16_SFLOAT | vk::Format::R32G32_SFLOAT | vk::Format::R32G32_UINT => 8,
        vk::Format::R16_SFLOAT | vk::Format::R8G8_UNORM => 2,
        vk::Format::R8_UNORM => 1,
        _ => 4,
    }
}
