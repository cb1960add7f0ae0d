//! Shared by full-screen passes: pipelines of one triangle that reads input attachments, or the picture before it.

use std::sync::Arc;

use ash::vk;

use super::{FrameContext, Making, PassRecorder, Slot};
use crate::gpu::sync::{Layouts, SyncVersion};
use crate::gpu::{
    self, DepthState, DescriptorPool, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, OwnedSampler,
    RecordedPass, RenderPass, RenderPassParts, SetLayout, SetLayoutBinding, SetWriter, ShaderStage, SubpassDesc,
    binding, framebuffer, pipeline_layout,
};
use crate::plan::Target;
use crate::shaders::Variant;
use crate::targets::Framebuffers;

/// A full-screen pass, before it exists.
pub struct ScreenDesc<'a> {
    pub name: &'a str,
    pub slot: &'a Slot,
    pub shader: &'a Variant,
    pub constants: &'a [(u32, u32)],
    pub set_layouts: &'a [vk::DescriptorSetLayout],
    /// Leaves out pixels at depth 0: the sky.
    pub skip_sky: bool,
    pub blend: vk::PipelineColorBlendAttachmentState,
}

/// A pipeline that draws one triangle over everything.
pub struct Screen {
    pub layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
}

impl Screen {
    pub fn new(device: &Arc<Device>, desc: &ScreenDesc) -> gpu::Result<Self> {
        Self::multisampled(device, desc, vk::SampleCountFlags::TYPE_1)
    }

    /// Makes a pipeline for attachments of `samples` samples a pixel.
    pub fn multisampled(device: &Arc<Device>, desc: &ScreenDesc, samples: vk::SampleCountFlags) -> gpu::Result<Self> {
        // The triangle lies at depth 0: LESS lets surfaces nearer than infinity through.
        Self::tested(device, desc, desc.skip_sky.then_some(vk::CompareOp::LESS), samples)
    }

    /// Makes a pipeline that draws over the sky only: where depth equals its clear value.
    pub fn behind(device: &Arc<Device>, desc: &ScreenDesc, samples: vk::SampleCountFlags) -> gpu::Result<Self> {
        Self::tested(device, desc, Some(vk::CompareOp::EQUAL), samples)
    }

    fn tested(
        device: &Arc<Device>,
        desc: &ScreenDesc,
        test: Option<vk::CompareOp>,
        samples: vk::SampleCountFlags,
    ) -> gpu::Result<Self> {
        // The shader has the size of its push constants, for its fragments alone.
        let size = desc.shader.fragment().map_or(0, |entry| entry.push_constant_size);
        let range = vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::FRAGMENT, offset: 0, size };
        let ranges: &[_] = if size > 0 { &[range] } else { &[] };
        let layout = pipeline_layout(device, desc.name, desc.set_layouts, ranges)?;
        let pipeline = GraphicsPipeline::new(
            device,
            &GraphicsPipelineDesc {
                name: desc.name,
                stages: &stages(desc.shader, desc.constants),
                vertex_bindings: &[],
                vertex_attributes: &[],
                cull_mode: vk::CullModeFlags::NONE,
                front_face: vk::FrontFace::COUNTER_CLOCKWISE,
                depth: test.map(|test| DepthState { test, write: false }),
                depth_bias: false,
                depth_clamp: false,
                blend: &[desc.blend],
                samples,
                layout: layout.raw,
                place: desc.slot,
            },
        )?;
        Ok(Self { layout, pipeline })
    }

    pub fn record(&self, context: &FrameContext, sets: &[(u32, vk::DescriptorSet)]) {
        context.bind_pipeline(self.pipeline.raw);
        for &(index, set) in sets {
            context.bind_set(self.layout.raw, index, set);
        }
        // SAFETY: pipeline and sets are bound; the vertex stage makes its three vertices from their index.
        unsafe { context.device.raw.cmd_draw(context.cmd, 3, 1, 0, 0) };
    }

    /// Draws outside of a frame's own passes, over this part of an attachment, with one set.
    pub fn record_over(&self, device: &Device, cmd: vk::CommandBuffer, area: vk::Rect2D, set: vk::DescriptorSet) {
        let [width, height] = [area.extent.width, area.extent.height].map(|edge| edge as f32);
        let viewport = vk::Viewport { width, height, max_depth: 1.0, ..vk::Viewport::default() };
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: `cmd` is being recorded inside the subpass that the pipeline was made for; the recorder owns the pipeline and the set, which has
        // the layout of the pipeline.
        unsafe {
            device.raw.cmd_bind_pipeline(cmd, graphics, self.pipeline.raw);
            device.raw.cmd_set_viewport(cmd, 0, &[viewport]);
            device.raw.cmd_set_scissor(cmd, 0, &[area]);
            device.raw.cmd_bind_descriptor_sets(cmd, graphics, self.layout.raw, 0, &[set], &[]);
            device.raw.cmd_draw(cmd, 3, 1, 0, 0);
        }
    }
}

/// The stages of a shader's variant, each with all constants.
pub fn stages<'a>(variant: &'a Variant, constants: &'a [(u32, u32)]) -> Vec<ShaderStage<'a>> {
    [(variant.vertex(), vk::ShaderStageFlags::VERTEX), (variant.fragment(), vk::ShaderStageFlags::FRAGMENT)]
        .into_iter()
        .filter_map(|(entry, stage)| {
            entry.map(|entry| ShaderStage { spirv: entry.spirv.words(), entry: entry.name, stage, constants })
        })
        .collect()
}

/// A set of input attachments.
pub struct InputSet {
    name: String,
    pub set_layout: Owned<vk::DescriptorSetLayout>,
    pub set: vk::DescriptorSet,
    pool: DescriptorPool,
}

/// An input attachment as a descriptor: its binding, view, and layout in the subpass.
pub type InputDescriptor = (u32, vk::ImageView, vk::ImageLayout);

impl InputSet {
    pub fn new(device: &Arc<Device>, name: &str, inputs: &[InputDescriptor]) -> gpu::Result<Self> {
        let input = |&(index, ..): &InputDescriptor| {
            binding(index, vk::DescriptorType::INPUT_ATTACHMENT, vk::ShaderStageFlags::FRAGMENT)
        };
        let bindings: Vec<_> = inputs.iter().map(input).collect();
        let set_layout = SetLayout::new(device, name, &bindings)?;
        let count = inputs.len().max(1) as u32;
        let pool = input_pool(device, name, count)?;
        let set = input_set(device, name, (&pool, &set_layout), inputs)?;
        Ok(Self { name: name.to_owned(), set_layout, set, pool })
    }

    /// Binds other images for the same attachments. The set is a new one, as frames in flight may still read the old set.
    pub fn rebind(&mut self, device: &Arc<Device>, inputs: &[InputDescriptor]) -> gpu::Result<()> {
        let pool = input_pool(device, &self.name, inputs.len().max(1) as u32)?;
        self.set = input_set(device, &self.name, (&pool, &self.set_layout), inputs)?;
        self.pool = pool;
        Ok(())
    }
}

fn input_pool(device: &Arc<Device>, name: &str, count: u32) -> gpu::Result<DescriptorPool> {
    DescriptorPool::new(device, name, 1, &[(vk::DescriptorType::INPUT_ATTACHMENT, count)])
}

fn input_set(
    device: &Arc<Device>,
    name: &str,
    (pool, layout): (&DescriptorPool, &SetLayout),
    inputs: &[InputDescriptor],
) -> gpu::Result<vk::DescriptorSet> {
    let set = pool.allocate(name, layout.raw)?;
    let mut writer = SetWriter::new();
    for &(binding, view, layout) in inputs {
        writer = writer.input_attachment(binding, view, layout);
    }
    writer.update(device, set);
    Ok(set)
}

/// A separate render pass over images of the swapchain, for the passes of a window's frame after its picture. The images keep their layout throughout
/// the render pass; barriers around it, which are rows of the table, change the layout.
pub struct WindowPass {
    pub device: Arc<Device>,
    pub format: vk::Format,
    pub layouts: Layouts,
    /// The API by which its render pass is made.
    pub sync: SyncVersion,
    pub render_pass: RenderPass,
    pub extent: vk::Extent2D,
    name: &'static str,
    framebuffers: Framebuffers,
}

impl WindowPass {
    /// Makes the pass for images of `format`; `load` is the load operation.
    pub fn new(
        device: &Arc<Device>,
        name: &'static str,
        format: vk::Format,
        load: vk::AttachmentLoadOp,
        (layouts, sync): (Layouts, SyncVersion),
    ) -> gpu::Result<Self> {
        let layout = layouts.of(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
        let attachment = vk::AttachmentDescription::default()
            .format(format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(load)
            .store_op(vk::AttachmentStoreOp::STORE)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(layout)
            .final_layout(layout);
        let color = [vk::AttachmentReference { attachment: 0, layout }];
        let subpass = SubpassDesc { color: &color, ..SubpassDesc::default() };
        let parts = RenderPassParts { sync, attachments: &[attachment], subpasses: &[subpass], dependencies: &[] };
        let render_pass = RenderPass::new(device, &format!("{name} pass"), parts)?;
        let (framebuffers, extent) = (Framebuffers(Vec::new()), vk::Extent2D::default());
        Ok(Self { device: Arc::clone(device), format, layouts, sync, render_pass, extent, name, framebuffers })
    }

    /// Draws into these images from now on, all of one size.
    pub fn resize(&mut self, images: &[vk::ImageView], extent: vk::Extent2D) -> gpu::Result<()> {
        let name = format!("{} framebuffer", self.name);
        let one = |view: &vk::ImageView| framebuffer(&self.device, &name, self.render_pass.raw, &[*view], extent);
        (self.framebuffers, self.extent) = (Framebuffers(images.iter().map(one).collect::<gpu::Result<_>>()?), extent);
        Ok(())
    }

    /// Begins the render pass over an image, draws into this area, and ends it.
    pub fn record(&self, cmd: vk::CommandBuffer, image: usize, draw: impl FnOnce(vk::Rect2D)) {
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: self.extent };
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass.raw)
            .framebuffer(self.framebuffers.of(image))
            .render_area(area);
        let begun = RecordedPass::begin(&self.device, cmd, &begin);
        draw(area);
        begun.end();
    }
}

/// The kinds of descriptors of a set that is sampled from: the image, and how.
const SAMPLED: [vk::DescriptorType; 2] = [vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::SAMPLER];

/// The bindings of a set that [`sampled_set`] makes.
pub fn sampled_bindings() -> [SetLayoutBinding; 2] {
    [0, 1].map(|index| binding(index, SAMPLED[index as usize], vk::ShaderStageFlags::FRAGMENT))
}

/// A set of one readable image and its sampler.
pub fn sampled_set(
    device: &Arc<Device>,
    name: &str,
    layout: &SetLayout,
    (image, layouts): (vk::ImageView, Layouts),
    sampler: &OwnedSampler,
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let pool = DescriptorPool::new(device, &format!("{name} pool"), 1, &SAMPLED.map(|kind| (kind, 1)))?;
    let set = pool.allocate(&format!("{name} set"), layout.raw)?;
    let readable = layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    SetWriter::new().sampled_image(0, image, readable).sampler(1, sampler.raw).update(device, set);
    Ok((pool, set))
}

/// A pass that draws the picture anew from the picture before it, of which each pixel reads others.
pub struct RedrawPass {
    name: &'static str,
    /// The target that it draws.
    target: Target,
    screen: Screen,
    set: vk::DescriptorSet,
    set_layout: SetLayout,
    pool: DescriptorPool,
    sampler: OwnedSampler,
}

impl RedrawPass {
    /// `name` is the pass's, for the names of its objects; shader and constants are its own.
    pub fn new(
        own: &Making,
        (name, target): (&'static str, Target),
        shader: &Variant,
        constants: &[(u32, u32)],
    ) -> gpu::Result<Self> {
        let set_layout = SetLayout::new(own.device, &format!("{name} set layout"), &sampled_bindings())?;
        let sampler = OwnedSampler::bilinear(own.device, &format!("{name} sampler"))?;
        let (pool, set) =
            sampled_set(own.device, name, &set_layout, (picture_before(own, target), own.plan.layouts), &sampler)?;
        let screen = Screen::new(
            own.device,
            &ScreenDesc {
                name: &name.to_lowercase(),
                slot: own.slot()?,
                shader,
                constants,
                set_layouts: &[set_layout.raw],
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { name, target, screen, set, set_layout, pool, sampler })
    }
}

/// The picture that a pass samples which draws this target.
fn picture_before(own: &Making, target: Target) -> vk::ImageView {
    own.targets.image(own.plan.picture_before(target)).view
}

impl PassRecorder for RedrawPass {
    /// Draws the picture. Runs inside its render pass.
    fn record(&self, context: &FrameContext) {
        context.set_area();
        self.screen.record(context, &[(0, self.set)]);
    }

    /// Samples another image, as of another size.
    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        let image = picture_before(own, self.target);
        (self.pool, self.set) =
            sampled_set(own.device, self.name, &self.set_layout, (image, own.plan.layouts), &self.sampler)?;
        Ok(())
    }
}

/// Writes all channels as they are.
pub fn replace() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// Adds to the content of the target.
pub fn add() -> vk::PipelineColorBlendAttachmentState {
    replace()
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ZERO)
        .alpha_blend_op(vk::BlendOp::ADD)
}

/// The operator `over` of Porter and Duff, for colours that are times their alpha already. The picture itself stays opaque.
pub fn over() -> vk::PipelineColorBlendAttachmentState {
    add()
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
        .src_alpha_blend_factor(vk::BlendFactor::ZERO)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
}
