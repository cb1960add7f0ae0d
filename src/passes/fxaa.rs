//! FXAA: edges of the finished picture, smoothed. A render pass of its own, because each pixel reads its neighbours.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace};
use super::{First, Pass, Place, Presence, Recording, Slot, Touch};
use crate::gpu::{self, DescriptorPool, Device, Sampler, SetLayout, SetWriter, sync::Use};
use crate::plan::Target;
use crate::shaders::fxaa::{self as shader, Flags};

/// Samples what the main pass left in the output.
pub const OUTPUT_READ: Use = Use::new(vk::PipelineStageFlags::FRAGMENT_SHADER, vk::AccessFlags::SHADER_READ);
/// Writes every pixel of the picture; its undefined load is a write too.
pub const PICTURE_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);

/// The pass.
pub struct Fxaa {
    screen: Screen,
    set: vk::DescriptorSet,
    set_layout: SetLayout,
    pool: DescriptorPool,
    sampler: Sampler,
}

pub const PASS: Pass = Pass {
    place: Place::pass("FXAA"),
    time: "fxaa",
    what: "smooths edges, and so reads each pixel's neighbours",
    presence: |plan| Presence::when(plan.fxaa, "asked for", "not asked for"),
    touches: |_| {
        vec![
            Touch::sampled(0, Target::Output, OUTPUT_READ),
            Touch::color(0, Target::Smoothed, First::Undefined, PICTURE_WRITE),
        ]
    },
    leave_out: Some(|settings| settings.fxaa = false),
};

/// The kinds of descriptors: what is sampled, and how.
const KINDS: [vk::DescriptorType; 2] = [vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::SAMPLER];

impl Fxaa {
    /// `output` is what is sampled.
    ///
    /// # Errors
    /// When the pipeline cannot be made.
    pub fn new(device: &Arc<Device>, slot: Slot, output: vk::ImageView) -> gpu::Result<Self> {
        let binding = |index, kind| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(index)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        };
        let set_layout = SetLayout::new(device, "FXAA set layout", &[binding(0, KINDS[0]), binding(1, KINDS[1])])?;
        // Beyond the border lies the border.
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge);
        let sampler = Sampler::new(device, "FXAA sampler", &info)?;
        let (pool, set) = sampled(device, &set_layout, output, &sampler)?;
        let Some(shader) = shader::variant(Flags::NONE) else {
            return Err(gpu::Error::Unsupported("fxaa.wgsl has no variant".into()));
        };
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "fxaa",
                slot,
                shader,
                constants: &[],
                set_layouts: &[set_layout.raw],
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { screen, set, set_layout, pool, sampler })
    }

    /// Samples another image, as of another size.
    ///
    /// # Errors
    /// When there is no memory for its descriptors.
    pub fn read_from(&mut self, device: &Arc<Device>, output: vk::ImageView) -> gpu::Result<()> {
        (self.pool, self.set) = sampled(device, &self.set_layout, output, &self.sampler)?;
        Ok(())
    }

    /// Smooths the picture. Runs inside its render pass.
    pub fn record(&self, recording: &Recording) {
        recording.set_area();
        self.screen.record(recording, &[(0, self.set)]);
    }
}

/// The set with what is sampled.
fn sampled(
    device: &Arc<Device>,
    layout: &SetLayout,
    output: vk::ImageView,
    sampler: &Sampler,
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let pool = DescriptorPool::new(device, "FXAA pool", 1, &KINDS.map(|kind| (kind, 1)))?;
    let set = pool.allocate("FXAA set", layout.raw)?;
    SetWriter::new()
        .sampled_image(0, output, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
        .sampler(1, sampler.raw)
        .update(device, set);
    Ok((pool, set))
}
