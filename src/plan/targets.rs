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
    /// Colour of the layers, weighted and added up; alpha is the share of the picture that they leave.
    pub accumulation: vk::Format,
    /// Their weights, added up.
    pub weights: vk::Format,
}

impl OitTargets {
    /// For devices that blend 32-bit floats: 20 bytes a pixel.
    pub const SINGLE: Self = Self { accumulation: vk::Format::R32G32B32A32_SFLOAT, weights: vk::Format::R32_SFLOAT };
    /// Mandatory to blend. The share that is left is exact to 1/2048, which is 1% of what a pane of alpha 0.04 hides.
    pub const HALF: Self = Self { accumulation: vk::Format::R16G16B16A16_SFLOAT, weights: vk::Format::R16_SFLOAT };

    pub(super) fn of(device: &Capabilities) -> Self {
        if device.float32_blends { Self::SINGLE } else { Self::HALF }
    }
}

/// Buffers of an effect, by the name that sentences have for their content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BufferName(pub &'static str);

/// The name of an effect's target, and its number among those at the same place in framebuffers. Pictures that are drawn anew have the numbers of their passes in the
/// order of a frame: an effect samples the one before its own ([`FramePlan::picture_before`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TargetName(pub u8, pub &'static str);

/// A target of an effect, as the effect's file declares it.
pub struct OwnTarget {
    /// Its place in framebuffers, and its name.
    pub target: Target,
    /// The noun that sentences have for its content.
    pub noun: &'static str,
    /// The name of its line in `inspect`, if it has one.
    pub line: Option<&'static str>,
    /// `None` where the frames have no such target.
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
    /// Relative to the camera, in metres.
    Position,
    /// Fragments for each pixel.
    Count,
    /// Depth of the largest objects alone, to find out what they hide.
    Occluders,
    /// The findings of an effect that reads depth and normals.
    FromDepth(TargetName),
    /// The number of the object that is seen, from 1, and of the triangle in its mesh, from 0; or in 32 bits the place of its instance and the triangle ([`super::TriangleCode`]).
    Triangle,
    /// Transparent surfaces, weighted and summed up; alpha is the share of the picture that they leave.
    Accumulation,
    /// The sum of their weights.
    Weights,
    /// Light before it is tone-mapped.
    Hdr,
    /// Values that an effect draws of surfaces that are seen.
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

    /// Returns true if it holds the picture: the output, or what an effect makes of it.
    pub fn is_picture(self) -> bool {
        self >= Self::Output
    }
}

/// As names of objects have it.
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FromDepth(name) | Self::OfSurfaces(name) | Self::Redrawn(name) => f.write_str(name.1),
            common => write!(f, "{common:?}"),
        }
    }
}

impl FramePlan {
    /// The format of a target; `None` where the frames have no such target.
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

    /// Bytes of a pixel of a target with all its samples; 0 where there is none.
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
