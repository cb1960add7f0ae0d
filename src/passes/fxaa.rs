//! FXAA: edges of the finished picture, smoothed. A render pass of its own, because each pixel reads its neighbours.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace};
use super::{Recording, Slot};
use crate::gpu::{
    self, DescriptorPool, Device, Image, ImageDesc, Location, MemoryKind, Sampler, SetLayout, SetWriter, framebuffer,
    sync::Use,
};
use crate::plan::FramePlan;
use crate::shaders::fxaa::{self as shader, Flags};
use crate::targets::{Framebuffers, Target, Touch, picture_layout, picture_usage};

/// Samples what the main pass left in the output.
pub const OUTPUT_READ: Use = Use::new(vk::PipelineStageFlags::FRAGMENT_SHADER, vk::AccessFlags::SHADER_READ);
/// Writes every pixel of the picture; its undefined load is a write too.
pub const PICTURE_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags::COLOR_ATTACHMENT_WRITE);

/// The pass and the picture that it draws.
pub struct Fxaa {
    /// None where the swapchain has it.
    picture: Option<Image>,
    render_pass: vk::RenderPass,
    framebuffers: Framebuffers,
    screen: Screen,
    set: vk::DescriptorSet,
    set_layout: SetLayout,
    pool: DescriptorPool,
    sampler: Sampler,
}

/// What it reads of the main pass. It reads neighbours, and so is no subpass.
pub fn touches(_: &FramePlan) -> [Touch; 1] {
    [Touch::Sampled(Target::Output)]
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
        .final_layout(picture_layout(plan))
}

/// The kinds of descriptors: what is sampled, and how.
const KINDS: [vk::DescriptorType; 2] = [vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::SAMPLER];

impl Fxaa {
    /// `output` is what is sampled, `swapchain` the views of the images that are drawn into where there is one.
    ///
    /// # Errors
    /// When there is no memory for the picture or the pipeline cannot be made.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: Slot,
        output: vk::ImageView,
        swapchain: &[vk::ImageView],
    ) -> gpu::Result<Self> {
        let (picture, framebuffers) = canvas(device, plan, slot.render_pass, swapchain)?;
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
        let render_pass = slot.render_pass;
        Ok(Self { picture, render_pass, framebuffers, screen, set, set_layout, pool, sampler })
    }

    /// Samples and draws images of another size.
    ///
    /// # Errors
    /// When there is no memory for them.
    pub fn resize(
        &mut self,
        device: &Arc<Device>,
        plan: &FramePlan,
        output: vk::ImageView,
        swapchain: &[vk::ImageView],
    ) -> gpu::Result<()> {
        (self.picture, self.framebuffers) = canvas(device, plan, self.render_pass, swapchain)?;
        (self.pool, self.set) = sampled(device, &self.set_layout, output, &self.sampler)?;
        Ok(())
    }

    /// The smoothed picture, in TRANSFER_SRC_OPTIMAL after the pass, unless it is in an image of the swapchain.
    pub fn picture(&self) -> Option<&Image> {
        self.picture.as_ref()
    }

    /// Begins the render pass, smooths the picture, ends it.
    pub fn record(&self, recording: &Recording) {
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass)
            .framebuffer(self.framebuffers.of(recording.image))
            .render_area(recording.area());
        // SAFETY: `cmd` is being recorded outside a render pass; pass and framebuffer belong together.
        unsafe { recording.device.raw.cmd_begin_render_pass(recording.cmd, &begin, vk::SubpassContents::INLINE) };
        recording.set_area();
        self.screen.record(recording, &[(0, self.set)]);
        // SAFETY: begun above.
        unsafe { recording.device.raw.cmd_end_render_pass(recording.cmd) };
    }
}

/// What is drawn into: an image of the pass's own with its framebuffer, or a framebuffer for each image of the swapchain.
fn canvas(
    device: &Arc<Device>,
    plan: &FramePlan,
    pass: vk::RenderPass,
    swapchain: &[vk::ImageView],
) -> gpu::Result<(Option<Image>, Framebuffers)> {
    let extent = vk::Extent2D { width: plan.size[0], height: plan.size[1] };
    if plan.draws_into_swapchain() {
        let one = |view: &vk::ImageView| framebuffer(device, "FXAA framebuffer", pass, &[*view], extent);
        return Ok((None, Framebuffers(swapchain.iter().map(one).collect::<gpu::Result<_>>()?)));
    }
    let picture = Image::new(
        device,
        &ImageDesc {
            name: "smoothed picture",
            format: plan.output,
            extent,
            usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | picture_usage(plan),
            location: Location::Device,
            kind: MemoryKind::Attachment,
            ..ImageDesc::default()
        },
    )?;
    let framebuffer = framebuffer(device, "FXAA framebuffer", pass, &[picture.view], extent)?;
    Ok((Some(picture), Framebuffers(vec![framebuffer])))
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
