//! FXAA: edges of the finished picture, smoothed. A render pass of its own, because each pixel reads its neighbours.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace};
use super::{Recording, Slot};
use crate::gpu::{
    self, DescriptorPool, Device, Framebuffer, Image, ImageDesc, Location, MemoryKind, Sampler, SetLayout, SetWriter,
    framebuffer, sync::Use,
};
use crate::plan::FramePlan;
use crate::shaders::fxaa::{self as shader, Flags};

/// Samples what the main pass left in the output.
pub const OUTPUT_READ: Use = Use::new(vk::PipelineStageFlags::FRAGMENT_SHADER, vk::AccessFlags::SHADER_READ);
/// Writes every pixel of the picture; its undefined load is a write too.
pub const PICTURE_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);

/// The pass and the picture that it draws.
pub struct Fxaa {
    picture: Image,
    render_pass: vk::RenderPass,
    framebuffer: Framebuffer,
    screen: Screen,
    set: vk::DescriptorSet,
    _set_layout: SetLayout,
    _pool: DescriptorPool,
    _sampler: Sampler,
}

/// The picture, as the render pass takes it.
pub fn attachment(plan: &FramePlan) -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(plan.output)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::DONT_CARE)
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
        .initial_layout(vk::ImageLayout::UNDEFINED)
        .final_layout(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
}

impl Fxaa {
    /// `output` is what is sampled.
    ///
    /// # Errors
    /// When there is no memory for the picture or the pipeline cannot be made.
    pub fn new(device: &Arc<Device>, plan: &FramePlan, slot: Slot, output: vk::ImageView) -> gpu::Result<Self> {
        let extent = vk::Extent2D { width: plan.size[0], height: plan.size[1] };
        let picture = Image::new(
            device,
            &ImageDesc {
                name: "smoothed picture",
                format: plan.output,
                extent,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
                location: Location::Device,
                kind: MemoryKind::Attachment,
                ..ImageDesc::default()
            },
        )?;
        let framebuffer = framebuffer(device, "FXAA framebuffer", slot.render_pass, &[picture.view], extent)?;
        let binding = |index, kind| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(index)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)
        };
        let kinds = [vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::SAMPLER];
        let set_layout = SetLayout::new(device, "FXAA set layout", &[binding(0, kinds[0]), binding(1, kinds[1])])?;
        let pool = DescriptorPool::new(device, "FXAA pool", 1, &kinds.map(|kind| (kind, 1)))?;
        let set = pool.allocate("FXAA set", set_layout.raw)?;
        // Beyond the border lies the border.
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge);
        let sampler = Sampler::new(device, "FXAA sampler", &info)?;
        SetWriter::new()
            .sampled_image(0, output, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
            .sampler(1, sampler.raw)
            .update(device, set);
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
        let render_pass = slot.render_pass;
        Ok(Self {
            picture,
            render_pass,
            framebuffer,
            screen,
            set,
            _set_layout: set_layout,
            _pool: pool,
            _sampler: sampler,
        })
    }

    /// The smoothed picture, in TRANSFER_SRC_OPTIMAL after the pass.
    pub fn picture(&self) -> &Image {
        &self.picture
    }

    /// Begins the render pass, smooths the picture, ends it.
    pub fn record(&self, recording: &Recording) {
        let extent = self.picture.extent;
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass)
            .framebuffer(self.framebuffer.raw)
            .render_area(vk::Rect2D { offset: vk::Offset2D::default(), extent });
        // SAFETY: `cmd` is being recorded outside a render pass; pass and framebuffer belong together.
        unsafe { recording.device.raw.cmd_begin_render_pass(recording.cmd, &begin, vk::SubpassContents::INLINE) };
        recording.set_area(extent.width, extent.height);
        self.screen.record(recording, &[(0, self.set)]);
        // SAFETY: begun above.
        unsafe { recording.device.raw.cmd_end_render_pass(recording.cmd) };
    }
}
