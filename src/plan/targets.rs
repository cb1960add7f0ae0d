//! The images that a plan's frames draw into, and their formats. The passes declare the use of each.

use std::fmt;

use ash::vk;

use super::{Capabilities, FramePlan, Shading, effects, format_bytes};

/// The format of the picture's depth and of shadow maps; mandatory to draw into.
pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// Counts fragments in steps of 1/255; mandatory to blend.
pub(crate) const COUNT: vk::Format = vk::Format::R8_UNORM;
/// Numbers of an object and of a triangle; mandatory to draw into.
pub(crate) const TRIANGLE: vk::Format = vk::Format::R32G32_UINT;

/// Formats of the targets of weighted blending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OitTargets {
    /// Weighted sum of the layers' colours; alpha is the share of the picture that they leave.
    pub accumulation: vk::Format,
    /// Sum of the layers' weights.
    pub weights: vk::Format,
}

impl OitTargets {
    /// Formats for devices that blend 32-bit floats: 20 bytes a pixel.
    pub const SINGLE: Self = Self { accumulation: vk::Format::R32G32B32A32_SFLOAT, weights: vk::Format::R32_SFLOAT };
    /// Formats that every device must blend. The remaining share of the picture is exact to 1/2048, which is 1% of the share that a pane of alpha
    /// 0.04 hides.
    pub const HALF: Self = Self { accumulation: vk::Format::R16G16B16A16_SFLOAT, weights: vk::Format::R16_SFLOAT };

    pub(super) fn of(device: &Capabilities) -> Self {
        if device.float32_blends { Self::SINGLE } else { Self::HALF }
    }
}

/// The buffers of an effect, by the noun that sentences use for their content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BufferName(pub &'static str);

/// The name of an effect's target, and its number among the targets at the same place in framebuffers. Redrawn pictures are numbered in the order of
/// their passes in a frame: an effect samples the picture before its own ([`FramePlan::picture_before`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TargetName(pub u8, pub &'static str);

/// A target of an effect, as the effect's file declares it.
pub struct OwnTarget {
    /// The place in framebuffers, and the name.
    pub target: Target,
    /// The noun that sentences use for its content.
    pub noun: &'static str,
    /// The name of its line in `inspect`, if it has one.
    pub line: Option<&'static str>,
    /// `None` if frames lack the target.
    pub format: fn(&FramePlan) -> Option<vk::Format>,
    /// Width and height in texels.
    pub extent: fn(&FramePlan) -> [u32; 2],
    /// Bytes for each pixel of the picture.
    pub bytes_per_pixel: fn(&FramePlan) -> u32,
}

/// The content of a frame's image. Framebuffers have them in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Target {
    /// Reversed Z: cleared to 0, which is infinitely far.
    Depth,
    /// RGB albedo; alpha is ambient occlusion.
    Albedo,
    /// The shading normal, encoded as [`super::Gbuffer::normal_encoding`] says.
    Normal,
    /// Roughness or shininess, metallic, and the geometric normal.
    Material,
    /// Specular colour of the Phong models; alpha is the index of the BRDF.
    Specular,
    /// Position relative to the camera, in metres.
    Position,
    /// Fragments for each pixel.
    Count,
    /// Depth of the largest objects alone, for occlusion culling.
    Occluders,
    /// The result of an effect that reads depth and normals.
    FromDepth(TargetName),
    /// The number of the visible object, from 1, and of the triangle in its mesh, from 0; or the instance's place and the triangle in 32 bits
    /// ([`super::TriangleCode`]).
    Triangle,
    /// Weighted sum of transparent surfaces; alpha is the share of the picture that they leave.
    Accumulation,
    /// Sum of the weights of transparent surfaces.
    Weights,
    /// Light before it is tone-mapped.
    Hdr,
    /// Values of visible surfaces that an effect draws.
    OfSurfaces(TargetName),
    /// The output's light before it is resolved, several samples a pixel.
    Samples,
    /// The picture, before passes over the whole of it.
    Output,
    /// The picture, after an effect has drawn the whole of it anew.
    Redrawn(TargetName),
}

impl Target {
    /// The targets that belong to no effect.
    const COMMON: [Self; 14] = [
        Self::Depth,
        Self::Albedo,
        Self::Normal,
        Self::Material,
        Self::Specular,
        Self::Position,
        Self::Count,
        Self::Occluders,
        Self::Triangle,
        Self::Accumulation,
        Self::Weights,
        Self::Hdr,
        Self::Samples,
        Self::Output,
    ];

    /// All targets, in the order of framebuffers.
    fn all() -> Vec<Self> {
        let mut all: Vec<_> = Self::COMMON.into_iter().chain(effects::targets().map(|own| own.target)).collect();
        all.sort_unstable();
        all
    }

    /// The declaration of an effect's target.
    pub fn own(self) -> Option<&'static OwnTarget> {
        effects::targets().find(|own| own.target == self)
    }

    /// Returns true for the output and for pictures that effects make from it.
    pub fn is_picture(self) -> bool {
        self >= Self::Output
    }
}

/// The name within Vulkan object names.
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FromDepth(name) | Self::OfSurfaces(name) | Self::Redrawn(name) => f.write_str(name.1),
            common => write!(f, "{common:?}"),
        }
    }
}

impl FramePlan {
    /// The format of a target; `None` if frames lack the target.
    pub fn format_of(&self, target: Target) -> Option<vk::Format> {
        let gbuffer = self.gbuffer.as_ref();
        let shown = |shading, format| (self.shading == shading).then_some(format);
        match target {
            Target::Depth => self.has_geometry().then_some(DEPTH),
            Target::Occluders => self.hides_on_device.then_some(DEPTH),
            Target::Albedo => gbuffer.map(|own| own.albedo),
            Target::Normal => gbuffer.map(|own| own.normal),
            Target::Material => gbuffer?.material,
            Target::Specular => gbuffer?.specular,
            Target::Position => gbuffer?.position,
            Target::Count => shown(Shading::ShowOverdraw, COUNT),
            Target::Triangle if self.triangles.is_some() => Some(vk::Format::R32_UINT),
            Target::Triangle => shown(Shading::ShowTriangle, TRIANGLE),
            Target::Accumulation => self.sums.map(|sums| sums.accumulation),
            Target::Weights => self.sums.map(|sums| sums.weights),
            Target::Hdr => self.hdr,
            Target::Samples => self.resolves_output().then_some(self.output),
            Target::Output => Some(self.output),
            own => (own.own()?.format)(self),
        }
    }

    /// The targets that the frames have, in the order of framebuffers.
    pub fn targets(&self) -> impl Iterator<Item = Target> {
        Target::all().into_iter().filter(|&target| self.format_of(target).is_some())
    }

    /// The samples a pixel of a target.
    pub fn samples_of(&self, target: Target) -> u32 {
        if target.is_picture() { 1 } else { self.msaa }
    }

    /// Width and height of a target in texels.
    pub fn extent_of(&self, target: Target) -> [u32; 2] {
        target.own().map_or(self.size, |own| (own.extent)(self))
    }

    /// Bytes of a pixel of a target with all its samples; 0 if the plan lacks the target.
    pub fn bytes_of(&self, target: Target) -> u32 {
        match (self.format_of(target), target.own()) {
            (None, _) => 0,
            (Some(_), Some(own)) => (own.bytes_per_pixel)(self),
            (Some(format), None) => format_bytes(format) * self.samples_of(target),
        }
    }

    /// Bytes of all targets for each pixel.
    pub fn target_bytes_per_pixel(&self) -> u64 {
        Target::all().into_iter().map(|target| u64::from(self.bytes_of(target))).sum()
    }

    /// The target that LIGHTING or FORWARD writes and, where surfaces emit light, GEOMETRY before it.
    pub fn light_target(&self) -> Target {
        match self.hdr {
            Some(_) => Target::Hdr,
            None if self.resolves_output() => Target::Samples,
            None => Target::Output,
        }
    }

    /// The target that holds the finished picture.
    pub fn picture(&self) -> Target {
        self.redrawn().max().unwrap_or(Target::Output)
    }

    /// The target that holds the picture before an effect draws it anew.
    pub(crate) fn picture_before(&self, target: Target) -> Target {
        self.redrawn().filter(|own| *own < target).max().unwrap_or(Target::Output)
    }

    /// The targets of effects that draw the picture anew.
    fn redrawn(&self) -> impl Iterator<Item = Target> {
        let present = effects::targets().filter(|own| own.target.is_picture() && (own.format)(self).is_some());
        present.map(|own| own.target)
    }
}
