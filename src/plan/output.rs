//! The way from light to the picture: the format that light is summed in, the place of tone mapping, and the output.

use ash::vk;

use super::{Capabilities, FramePlan, PlanError, parts};
use crate::scene::{HdrFormat, OptionalPart, Output, Resolve, Settings, Tonemap};

/// The place where scene light becomes display light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ToneMapping {
    /// Inside LIGHTING: no HDR target, no TONEMAP subpass.
    InLighting(Tonemap),
    /// A separate subpass, because something is blended before it.
    Subpass(Tonemap),
    /// The TONEMAP subpass without a curve: the output holds the light before the curve.
    Kept,
    /// On the CPU: the output holds exposed light, and many frames are averaged into one picture.
    AfterFrames(Tonemap),
    /// No tone mapping: the output holds nits or exposed light from LIGHTING, or a view.
    Absent,
}

/// Tone-mapped pictures: 8 bits a channel, encoded by the hardware.
pub const OUTPUT_SRGB: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// Tone-mapped pictures with the bytes of [`OUTPUT_SRGB`], encoded by a compute shader, as sRGB formats cannot be stored to.
pub const OUTPUT_PLAIN: vk::Format = vk::Format::R8G8B8A8_UNORM;
/// The formats of swapchains whose images the hardware encodes.
const PRESENTED_SRGB: [vk::Format; 3] = [OUTPUT_SRGB, vk::Format::B8G8R8A8_SRGB, vk::Format::A8B8G8R8_SRGB_PACK32];
/// The default HDR format: half floats resolve visible differences and blend on all devices.
pub const HDR: vk::Format = vk::Format::R16G16B16A16_SFLOAT;

/// The conversion of a picture's light to the values of images that no hardware encodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transfer {
    /// IEC 61966-2-1.
    Srgb,
    /// SMPTE ST 2084 of nits, up to 10000, with the primaries of ITU-R BT.2020: HDR10.
    Pq,
    /// Linear in units of 80 nits, with the primaries of sRGB and beyond 0 and 1 (IEC 61966-2-2): scRGB.
    Linear,
}

/// The output of ENCODE. Its input is linear, with a white of 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoding {
    /// The transfer function of stored values.
    pub transfer: Transfer,
    /// The brightest value of the display in units of white: 1 without headroom above white.
    pub headroom: f32,
}

/// The images that a window's pictures are drawn into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PresentTarget {
    /// Images of a swapchain that have this format. The output of a compute pass is copied there.
    Straight(vk::Format),
    /// An image of the frame's own with the format of the swapchain's, of any size, which PRESENT copies into the swapchain's, enlarged where that is
    /// larger.
    Enlarge(vk::Format),
    /// An image of the frame's own, from which ENCODE draws into the swapchain's.
    Encode(Encoding),
    /// An image of the frame's own, which PRESENT copies into another: panels are drawn over that one, and ENCODE draws from it into the swapchain's.
    EncodeKept(Encoding),
}

/// The format asked for, which must blend.
fn hdr_format(asked: HdrFormat, device: &Capabilities) -> Result<vk::Format, PlanError> {
    let (format, blends) = match asked {
        HdrFormat::Rgba16f => (HDR, true),
        HdrFormat::B10g11r11 => (vk::Format::B10G11R11_UFLOAT_PACK32, device.packed_float_blends),
        HdrFormat::Rgba32f => (vk::Format::R32G32B32A32_SFLOAT, device.float32_blends),
    };
    if blends { Ok(format) } else { Err(PlanError::HdrFormat(asked)) }
}

impl FramePlan {
    /// Returns the plan of these frames in a window. The last pass draws straight into the images of a swapchain; pictures to be enlarged and the
    /// output of a compute pass, which may not store to swapchain images, are copied there. ENCODE draws into images that no hardware encodes,
    /// whatever the last pass was.
    pub fn presented_as(self, present_target: PresentTarget) -> Self {
        let presented = Some(present_target);
        match present_target {
            PresentTarget::Straight(_) | PresentTarget::Enlarge(_) if self.is_tiled() => Self { presented, ..self },
            PresentTarget::Straight(format) | PresentTarget::Enlarge(format) => {
                Self { presented, output: format, ..self }
            }
            PresentTarget::Encode(encoding) | PresentTarget::EncodeKept(encoding) => {
                Self { presented, ..self.with_encoding(encoding) }
            }
        }
    }

    /// Returns the plan of these frames with the other plan's window, if it has one.
    pub(super) fn presented_like(self, other: &Self) -> Self {
        match other.presented {
            Some(target) => self.presented_as(target),
            None => self,
        }
    }

    /// Returns the plan of these frames with pictures in the target's texel layout, so that they can be copied there whether the hardware encodes one
    /// or the other.
    pub fn copied_to(self, present_target: PresentTarget) -> Self {
        let format = match present_target {
            PresentTarget::Straight(format) | PresentTarget::Enlarge(format) => format,
            PresentTarget::Encode(encoding) | PresentTarget::EncodeKept(encoding) => {
                return self.with_encoding(encoding);
            }
        };
        let blue_first = [vk::Format::B8G8R8A8_SRGB, vk::Format::B8G8R8A8_UNORM].contains(&format);
        match self.is_tiled() {
            // Every device can store to one order of channels only.
            true => Self { swaps_red_and_blue: blue_first, ..self },
            false if blue_first => Self { output: vk::Format::B8G8R8A8_SRGB, ..self },
            // A8B8G8R8 has the bytes of R8G8B8A8 on machines that store the low byte first.
            false => Self { output: OUTPUT_SRGB, ..self },
        }
    }

    /// Half floats tell apart more than 10 bits of any of the curves do, in the range where that shows; they blend, and can be stored to.
    fn with_encoding(self, encoding: Encoding) -> Self {
        let mut new = Self { output: HDR, encoding: Some(encoding), ..self };
        new.reasons.parts = parts::with_output(std::mem::take(&mut new.reasons.parts), &new);
        new
    }

    /// Returns the plan of these frames at another size in pixels. The listed parts keep the bytes of the previous size.
    pub fn of_size(self, size: [u32; 2]) -> Self {
        Self { size, ..self }
    }

    /// Returns the plan of these frames at one pixel; objects of the picture's size can be created later.
    pub fn of_one_pixel(self) -> Self {
        self.of_size([1, 1])
    }

    /// Returns true if the last pass draws into an image of the swapchain, and not into one of the frame's own.
    pub fn draws_into_swapchain(&self) -> bool {
        matches!(self.presented, Some(PresentTarget::Straight(_))) && !self.is_tiled()
    }

    /// Returns true if PRESENT copies the picture into the image that the window shows, so that the picture itself stays as it is.
    pub fn is_copied_to_be_shown(&self) -> bool {
        match self.presented {
            Some(PresentTarget::Straight(_)) => self.is_tiled(),
            Some(PresentTarget::Enlarge(_) | PresentTarget::EncodeKept(_)) => true,
            Some(PresentTarget::Encode(_)) | None => false,
        }
    }

    /// Returns true if samples of a pixel are averaged before they are tone-mapped.
    pub fn averages_light(&self) -> bool {
        self.msaa > 1 && self.resolve == Resolve::Linear
    }

    /// Returns true if the output's values are encoded later, by the hardware or by ENCODE.
    pub fn encodes_output(&self) -> bool {
        self.encoding.is_some() || PRESENTED_SRGB.contains(&self.output)
    }

    /// The largest value of a tone-mapped picture: 1, or the display's headroom above white.
    pub fn headroom(&self) -> f32 {
        self.encoding.map_or(1.0, |encoding| encoding.headroom)
    }

    /// Returns true if the scene's data on the device also serves the other plan, so that meshes and textures can stay.
    pub fn uploads_as(&self, other: &Self) -> bool {
        (&self.meshes, &self.textures, &self.uploads, self.places_of_samplers())
            == (&other.meshes, &other.textures, &other.uploads, other.places_of_samplers())
            && self.effects.upload_as(&other.effects)
            && self.layouts == other.layouts
            // Only plans with triangle codes look up buffers and textures in shaders.
            && self.triangles.is_some() == other.triangles.is_some()
    }

    /// Returns true if the two plans differ in the size of their attachments only.
    pub fn differs_in_size_only(&self, other: &Self) -> bool {
        Self { size: other.size, reasons: other.reasons.clone(), ..self.clone() } == *other
    }
}

/// The properties that the output chain depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blending {
    /// The frame is lit, not a view of values.
    pub lit: bool,
    /// A compute pass writes the picture by itself.
    pub tiled: bool,
    /// GEOMETRY writes emissive light.
    pub emissive: bool,
    /// Lights are added one by one.
    pub adds_lights: bool,
    /// TRANSPARENT blends over the lit surfaces.
    pub transparent: bool,
    /// An effect adds to LIGHTING's light, or blends over it.
    pub by_effects: bool,
    /// An effect reads the light of a pixel and its neighbours.
    pub filters: bool,
}

/// The formats and the tone mapping between light and picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct OutputChain {
    pub hdr: Option<vk::Format>,
    pub output: vk::Format,
    pub tone_mapping: ToneMapping,
}

impl OutputChain {
    pub(super) fn of(settings: &Settings, device: &Capabilities, what: Blending) -> Result<Self, PlanError> {
        // Light that is averaged over frames must not be clamped before.
        let linear =
            settings.output == Output::Nits || settings.samples > 1 || !what.lit && settings.output.is_linear();
        let (hdr, output) = match what.tiled {
            true => Self::tiled_formats(settings, device, what, linear)?,
            false => Self::formats(settings, device, what, linear)?,
        };
        // Light to be measured takes the way of a tone-mapped frame, but without the curve.
        let measured = settings.output == Output::Exposed;
        let output = if measured && !linear { vk::Format::R32G32B32A32_SFLOAT } else { output };
        let tone_mapping = match (settings.output, hdr) {
            (Output::Exposed, Some(_)) if what.lit && !what.tiled => ToneMapping::Kept,
            _ if !what.lit || settings.output.is_linear() => ToneMapping::Absent,
            (_, Some(_)) if !what.tiled && !linear => ToneMapping::Subpass(settings.tonemap),
            _ if settings.samples > 1 => ToneMapping::AfterFrames(settings.tonemap),
            _ => ToneMapping::InLighting(settings.tonemap),
        };
        Ok(Self { hdr, output, tone_mapping })
    }

    fn formats(
        settings: &Settings,
        device: &Capabilities,
        what: Blending,
        linear: bool,
    ) -> Result<(Option<vk::Format>, vk::Format), PlanError> {
        let blends = what.emissive || what.adds_lights || what.transparent || what.by_effects;
        // Samples that are averaged before tone mapping are kept until then.
        let averaged = what.lit && settings.msaa > 1 && settings.resolve == Resolve::Linear;
        let kept = what.lit && settings.keep.has(OptionalPart::HdrTarget);
        let single = vk::Format::R32G32B32A32_SFLOAT;
        Ok(match linear {
            // The HDR target is as precise as the output.
            true if what.filters => (Some(if blends && !device.float32_blends { HDR } else { single }), single),
            true if blends && !device.float32_blends => (None, HDR),
            true => (None, single),
            // Blending into fewer bits truncates: each light that is added would lose a share.
            false if what.adds_lights => (Some(single), OUTPUT_SRGB),
            false if blends || averaged || kept || what.filters => {
                (Some(hdr_format(settings.hdr_format, device)?), OUTPUT_SRGB)
            }
            false => (None, OUTPUT_SRGB),
        })
    }

    /// The formats for a compute pass. It gets emissive light in a separate target.
    fn tiled_formats(
        settings: &Settings,
        device: &Capabilities,
        what: Blending,
        linear: bool,
    ) -> Result<(Option<vk::Format>, vk::Format), PlanError> {
        Ok(match (linear, what.emissive) {
            (true, false) => (None, vk::Format::R32G32B32A32_SFLOAT),
            (true, true) => {
                let emissive = if device.float32_blends { vk::Format::R32G32B32A32_SFLOAT } else { HDR };
                (Some(emissive), vk::Format::R32G32B32A32_SFLOAT)
            }
            (false, true) => (Some(hdr_format(settings.hdr_format, device)?), OUTPUT_PLAIN),
            (false, false) => (None, OUTPUT_PLAIN),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{format_bytes, samples};
    use crate::scene::{Brdf, Falloff, LightPath};

    const BLUE_FIRST: vk::Format = vk::Format::B8G8R8A8_UNORM;

    #[test]
    fn what_images_a_window_needs_does_not_depend_on_its_size() {
        for lights in [0, 1, 4, 5, 40] {
            let scene = samples::scene(
                vec![samples::material(Brdf::CookTorrance)],
                vec![samples::point(Falloff::InverseSquare); lights],
            );
            for light_path in [LightPath::Auto, LightPath::Compute, LightPath::Loop] {
                let of = |size| {
                    let settings = Settings { size, light_path, ..Settings::default() };
                    FramePlan::of(&scene, &settings, &samples::device()).expect("a plan").is_tiled()
                };
                let all = [[1, 1], [1, 4000], [640, 360], [16384, 16384]].map(of);
                assert!(all.iter().all(|&tiled| tiled == all[0]), "{lights} lights, {light_path}: {all:?}");
            }
        }
    }

    #[test]
    fn pictures_that_are_copied_to_a_swapchain_have_its_order_of_channels_whoever_encodes_them() {
        let shown = |plan: &FramePlan| [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output);
        let all = samples::of_every_kind();
        for (name, plan) in all.into_iter().filter(|(_, plan)| shown(plan)) {
            for (format, blue_first) in [(vk::Format::B8G8R8A8_SRGB, true), (BLUE_FIRST, true), (OUTPUT_PLAIN, false)] {
                let copied = plan.clone().copied_to(PresentTarget::Straight(format));
                assert_eq!(format_bytes(copied.output), format_bytes(format), "{name}");
                assert_eq!((copied.presented, copied.encodes_output()), (None, plan.encodes_output()), "{name}");
                let own = copied.swaps_red_and_blue || copied.output == vk::Format::B8G8R8A8_SRGB;
                assert_eq!((own, copied.swaps_red_and_blue), (blue_first, blue_first && plan.is_tiled()), "{name}");
                // The size does not change this.
                let larger = FramePlan { size: plan.size.map(|edge| 2 * edge), ..plan.clone() }
                    .copied_to(PresentTarget::Straight(format));
                assert!(copied.differs_in_size_only(&larger) && copied.uploads_as(&plan), "{name}");
                assert!(!copied.differs_in_size_only(&plan) || copied == plan, "{name}");
            }
        }
    }

    #[test]
    fn pictures_that_a_shader_encodes_are_light_in_an_image_of_the_frames_own_whoever_draws_them() {
        let encoded = Encoding { transfer: Transfer::Pq, headroom: 4.0 };
        let all = samples::of_every_kind();
        for (name, plan) in all {
            let shown = plan.clone().presented_as(PresentTarget::Encode(encoded));
            assert_eq!((shown.output, shown.headroom()), (HDR, 4.0), "{name}");
            assert!(shown.encodes_output() && !shown.draws_into_swapchain(), "{name}");
            let told: u64 =
                shown.parts().iter().filter(|part| part.name.contains("output")).map(|part| part.bytes).sum();
            let pixels = u64::from(shown.size[0]) * u64::from(shown.size[1]);
            let samples = if shown.resolves_output() { 1 + shown.msaa } else { 1 };
            assert_eq!(told, 8 * u64::from(samples) * pixels, "{name}: {:?}", shown.parts());
            let kept = plan.clone().presented_as(PresentTarget::EncodeKept(encoded));
            assert_eq!((kept.output, kept.is_copied_to_be_shown(), shown.is_copied_to_be_shown()), (HDR, true, false));
            let beside = plan.clone().copied_to(PresentTarget::Encode(encoded));
            assert_eq!((beside.output, beside.headroom(), beside.presented), (HDR, 4.0, None), "{name}");
            assert!(shown.uploads_as(&plan) && beside.uploads_as(&plan), "{name}");
            let direct = plan.presented_as(PresentTarget::Straight(vk::Format::B8G8R8A8_SRGB));
            assert_eq!((direct.headroom(), direct.draws_into_swapchain()), (1.0, !direct.is_tiled()), "{name}");
        }
    }
}
