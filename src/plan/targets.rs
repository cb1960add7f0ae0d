//! The images that a plan's frames draw into, and their formats. The passes declare the use of each.

use ash::vk;

use super::{Capabilities, FramePlan, Hiz, Shading, effects::reflections, format_bytes};

/// The format of the picture's depth and of shadow maps; mandatory to draw into.
pub(crate) const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// Counts fragments in steps of 1/255; mandatory to blend.
pub(crate) const COUNT: vk::Format = vk::Format::R8_UNORM;
/// Numbers of an object and of a triangle; mandatory to draw into.
pub(crate) const TRIANGLE: vk::Format = vk::Format::R32G32_UINT;
/// Pixels, of which half floats tell apart a 64th up to 32, a share of a distance, and a flag for a vector; mandatory to draw into.
pub(crate) const VELOCITY: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Mandatory to store to.
pub(crate) const VISIBILITY: vk::Format = vk::Format::R32_UINT;

/// Formats of the targets of weighted blending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sums {
    /// Colour of the layers, weighted and added up; alpha is the share of the picture that they leave.
    pub accumulation: vk::Format,
    /// Their weights, added up.
    pub weights: vk::Format,
}

impl Sums {
    /// For devices that blend 32-bit floats: 20 bytes a pixel.
    pub const SINGLE: Self = Self { accumulation: vk::Format::R32G32B32A32_SFLOAT, weights: vk::Format::R32_SFLOAT };
    /// Mandatory to blend. The share that is left is exact to 1/2048, which is 1% of what a pane of alpha 0.04 hides.
    pub const HALF: Self = Self { accumulation: vk::Format::R16G16B16A16_SFLOAT, weights: vk::Format::R16_SFLOAT };

    pub(super) fn of(device: &Capabilities) -> Self {
        if device.float32_blends { Self::SINGLE } else { Self::HALF }
    }
}

/// Buffers of an effect, by the name that sentences have for their content: `levels of bloom`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BufferName(pub &'static str);

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
    /// AO's output: a share of the light from everywhere in 10 bits, and 22 of the depth of its pixel.
    Visibility,
    /// The nearest and the farthest depth of squares of pixels, in levels ([`super::Hiz`]).
    Hiz,
    /// The hit of each pixel's reflection ray: light, confidence, and place.
    Rays,
    /// The number of the object that is seen, from 1, and of the triangle in its mesh, from 0; or in 32 bits the place of its instance and the triangle ([`super::TriangleCode`]).
    Triangle,
    /// Transparent surfaces, weighted and summed up; alpha is the share of the picture that they leave.
    Accumulation,
    /// The sum of their weights.
    Weights,
    /// Light before it is tone-mapped.
    Hdr,
    /// The movement of surfaces that move by themselves: pixels to the right and down since the frame before, and how much farther away the surface
    /// was then.
    Velocity,
    /// The output's light before it is resolved, several samples a pixel.
    Samples,
    /// The picture, before passes over the whole of it.
    Output,
    /// The picture with its edges smoothed.
    Smoothed,
}

impl Target {
    /// In the order of framebuffers.
    pub const ALL: [Self; 19] = [
        Self::Depth,
        Self::Albedo,
        Self::Normal,
        Self::Material,
        Self::Specular,
        Self::Position,
        Self::Count,
        Self::Occluders,
        Self::Visibility,
        Self::Hiz,
        Self::Rays,
        Self::Triangle,
        Self::Accumulation,
        Self::Weights,
        Self::Hdr,
        Self::Velocity,
        Self::Samples,
        Self::Output,
        Self::Smoothed,
    ];
}

impl FramePlan {
    /// The format of a target; `None` where the frames have no such target.
    pub fn format_of(&self, target: Target) -> Option<vk::Format> {
        let gbuffer = self.gbuffer.as_ref();
        let shown = |shading, format| (self.shading == shading).then_some(format);
        match target {
            Target::Depth => self.has_geometry().then_some(DEPTH),
            Target::Occluders => self.hides_on_device.then_some(DEPTH),
            Target::Visibility => self.effects.ao.is_some().then_some(VISIBILITY),
            Target::Hiz => self.reflects().then_some(reflections::HIZ),
            Target::Rays => self.reflects().then_some(reflections::RAYS),
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
            Target::Velocity => self.has_velocity().then_some(VELOCITY),
            Target::Samples => self.resolves_output().then_some(self.output),
            Target::Output => Some(self.output),
            Target::Smoothed => self.effects.fxaa.then_some(self.output),
        }
    }

    /// The targets that the frames have, in the order of framebuffers.
    pub fn targets(&self) -> impl Iterator<Item = Target> {
        Target::ALL.into_iter().filter(|&target| self.format_of(target).is_some())
    }

    /// The samples a pixel of a target.
    pub fn samples_of(&self, target: Target) -> u32 {
        if target >= Target::Output { 1 } else { self.msaa }
    }

    /// Width and height of a target in texels.
    pub fn extent_of(&self, target: Target) -> [u32; 2] {
        if target == Target::Hiz {
            return Hiz::of(self.size).extent();
        }
        let scale = self.texels_apart(target);
        self.size.map(|edge| edge.div_ceil(scale))
    }

    /// Pixels of the picture across and down for each of a target's texels.
    fn texels_apart(&self, target: Target) -> u32 {
        match (&self.effects.ao, target) {
            (Some(ao), Target::Visibility) => ao.scale,
            _ => 1,
        }
    }

    /// Bytes of a pixel of a target with all its samples; 0 where there is none.
    pub fn bytes_of(&self, target: Target) -> u32 {
        if target == Target::Hiz && self.reflects() {
            return Hiz::BYTES_PER_PIXEL;
        }
        let bytes = self.format_of(target).map_or(0, format_bytes) * self.samples_of(target);
        bytes / self.texels_apart(target).pow(2)
    }

    /// Bytes of all targets for each pixel.
    pub fn target_bytes_per_pixel(&self) -> u64 {
        Target::ALL.iter().map(|&target| u64::from(self.bytes_of(target))).sum()
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
        if self.effects.fxaa { Target::Smoothed } else { Target::Output }
    }
}
