//! Step 1: a triangle. A pipeline says how it is drawn; a render pass clears the picture, draws, and stores it.
//!
//! The rows that this step teaches are `read-back` and `reuse`. Two frames are drawn, since `reuse` orders a frame after the one before.

use std::process::ExitCode;

use afterlight_steps::{Buffer, Gpu, Image, Needs, Result, entry, run};
use ash::Device;
use ash::vk::{self, AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
use ash::vk::{AttachmentLoadOp as LoadOp, AttachmentStoreOp as StoreOp};

const SIZE: vk::Extent2D = vk::Extent2D { width: 320, height: 180 };
/// Four bytes a pixel. The device encodes the light that it writes as sRGB, as PNG files have it.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
const BYTES: u64 = SIZE.width as u64 * SIZE.height as u64 * 4;
/// Linear light, as all colours in these steps.
const COLOR: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
const FRAMES: u64 = 2;

/// The objects that a frame uses.
struct Frame {
    pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    pipeline: vk::Pipeline,
    picture: Image,
    pixels: Buffer,
}

fn main() -> ExitCode {
    run(&Needs::default(), draw)
}

fn draw(gpu: &Gpu) -> Result<()> {
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let picture = target(gpu, "picture", FORMAT, usage)?;
    let pass = render_pass(gpu)?;
    let framebuffer = framebuffer(gpu, pass, &[picture.view])?;
    let pipeline = pipeline(gpu, pass, layout(gpu)?)?;
    let frame = Frame { pass, framebuffer, pipeline, picture, pixels: pixels(gpu, BYTES * FRAMES)? };
    let cmd = command_buffer(gpu)?;
    let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new, and what it names lives until the device is idle.
    unsafe {
        gpu.device.begin_command_buffer(cmd, &once)?;
        for number in 0..FRAMES {
            frame.record(gpu, cmd);
            frame.copy(gpu, cmd, number);
        }
        gpu.device.end_command_buffer(cmd)?;
    }
    submit(gpu, cmd)?;
    gpu.save(SIZE, &gpu.read(&frame.pixels)?[(BYTES * (FRAMES - 1)) as usize..])
}

impl Frame {
    /// Draws the picture.
    fn record(&self, gpu: &Gpu, cmd: vk::CommandBuffer) {
        let clear = [vk::ClearValue { color: vk::ClearColorValue { float32: COLOR } }];
        let begin = vk::RenderPassBeginInfo::default().render_pass(self.pass).framebuffer(self.framebuffer);
        let begin = begin.render_area(SIZE.into()).clear_values(&clear);
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_begin_render_pass(cmd, &begin, vk::SubpassContents::INLINE);
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            gpu.device.cmd_draw(cmd, 3, 1, 0, 0);
            gpu.device.cmd_end_render_pass(cmd);
        }
    }

    /// Copies the picture to the place of frame `number` in the buffer.
    fn copy(&self, gpu: &Gpu, cmd: vk::CommandBuffer, number: u64) {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(SIZE.into());
        let region = [region.buffer_offset(BYTES * number)];
        // `picture-to-host`: the host reads the copied picture. The fence makes the host wait until the copy is done. It does not make the copied picture visible
        // to the host, as this barrier does: without it the picture may stay in a cache of the device.
        let to_host = vk::MemoryBarrier::default().src_access_mask(Access::TRANSFER_WRITE);
        let to_host = [to_host.dst_access_mask(Access::HOST_READ)];
        let none = vk::DependencyFlags::empty();
        let layout = Layout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_copy_image_to_buffer(cmd, self.picture.raw, layout, self.pixels.raw, &region);
            if gpu.keep("picture-to-host", true) {
                gpu.device.cmd_pipeline_barrier(cmd, Stage::TRANSFER, Stage::HOST, none, &to_host, &[], &[]);
            }
        }
    }
}

/// One subpass that draws the picture.
fn render_pass(gpu: &Gpu) -> Result<vk::RenderPass> {
    // CLEAR and UNDEFINED: old texels are not needed; LOAD would draw over them. STORE: DONT_CARE would allow the device to forget the picture when the pass ends.
    // The pass leaves the picture in the layout in which the copy reads it.
    let (clear, store) = (LoadOp::CLEAR, StoreOp::STORE);
    let attachments = [attachment(FORMAT, clear, store, [Layout::UNDEFINED, Layout::TRANSFER_SRC_OPTIMAL])];
    let color = [vk::AttachmentReference { attachment: 0, layout: Layout::COLOR_ATTACHMENT_OPTIMAL }];
    let subpass = vk::SubpassDescription::default().color_attachments(&color);
    // `reuse`: this frame overwrites the picture that the copy of the last one reads. The read must be over; it has written nothing, so it needs no mask. Without
    // this row the picture changes its layout, and is cleared, while the copy still reads.
    let reuse = vk::SubpassDependency::default().src_subpass(vk::SUBPASS_EXTERNAL).dst_subpass(0);
    let reuse = reuse.src_stage_mask(Stage::TRANSFER).dst_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT);
    let reuse = reuse.dst_access_mask(gpu.keep("reuse-write", Access::COLOR_ATTACHMENT_WRITE));
    // `read-back`: the copy reads the picture of this subpass, and may read it before it is drawn if this row is missing.
    let read_back = vk::SubpassDependency::default().src_subpass(0).dst_subpass(vk::SUBPASS_EXTERNAL);
    let read_back = read_back.src_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT).dst_stage_mask(Stage::TRANSFER);
    let read_back = read_back.src_access_mask(Access::COLOR_ATTACHMENT_WRITE);
    let read_back = read_back.dst_access_mask(gpu.keep("copy-read", Access::TRANSFER_READ));
    let rows = [gpu.keep("reuse", vec![reuse]), gpu.keep("read-back", vec![read_back])].concat();
    let subpasses = [subpass];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses).dependencies(&rows);
    // SAFETY: what the structure points to lives until the call returns.
    gpu.own("render pass", unsafe { gpu.device.create_render_pass(&info, None)? }, Device::destroy_render_pass)
}

/// An attachment with its layouts before and after the pass.
fn attachment(format: vk::Format, load: LoadOp, store: StoreOp, layouts: [Layout; 2]) -> vk::AttachmentDescription {
    let attachment = vk::AttachmentDescription::default().format(format).samples(vk::SampleCountFlags::TYPE_1);
    attachment.load_op(load).store_op(store).initial_layout(layouts[0]).final_layout(layouts[1])
}

/// The images that a render pass draws to, in the order of its attachments.
fn framebuffer(gpu: &Gpu, pass: vk::RenderPass, views: &[vk::ImageView]) -> Result<vk::Framebuffer> {
    let info = vk::FramebufferCreateInfo::default().render_pass(pass).attachments(views);
    let info = info.width(SIZE.width).height(SIZE.height).layers(1);
    // SAFETY: pass and views are alive.
    gpu.own("framebuffer", unsafe { gpu.device.create_framebuffer(&info, None)? }, Device::destroy_framebuffer)
}

/// The resources of shaders: none yet.
fn layout(gpu: &Gpu) -> Result<vk::PipelineLayout> {
    let info = vk::PipelineLayoutCreateInfo::default();
    // SAFETY: what the structure points to lives until the call returns.
    gpu.own("layout", unsafe { gpu.device.create_pipeline_layout(&info, None)? }, Device::destroy_pipeline_layout)
}

fn pipeline(gpu: &Gpu, pass: vk::RenderPass, layout: vk::PipelineLayout) -> Result<vk::Pipeline> {
    let vertex = gpu.stage(vk::ShaderStageFlags::VERTEX, entry!("vertex"))?;
    let stages = [vertex, gpu.stage(vk::ShaderStageFlags::FRAGMENT, entry!("fragment"))?];
    let input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewports = [vk::Viewport::default().width(SIZE.width as f32).height(SIZE.height as f32).max_depth(1.0)];
    let scissors = [SIZE.into()];
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
    // Seen from the front, the corners of a triangle run counter-clockwise. Triangles that are seen from behind are left out.
    let raster = vk::PipelineRasterizationStateCreateInfo::default().cull_mode(vk::CullModeFlags::BACK).line_width(1.0);
    let raster = raster.front_face(vk::FrontFace::COUNTER_CLOCKWISE);
    let samples = vk::PipelineMultisampleStateCreateInfo::default();
    let samples = samples.rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let targets = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&targets);
    // SAFETY: what the structures point to lives until the calls return.
    unsafe {
        let info = vk::GraphicsPipelineCreateInfo::default().stages(&stages).layout(layout).render_pass(pass);
        let info = info.vertex_input_state(&input).input_assembly_state(&assembly).viewport_state(&viewport);
        let info = [info.rasterization_state(&raster).multisample_state(&samples).color_blend_state(&blend)];
        let made = gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None);
        gpu.own("triangle", made.map_err(|(_, error)| error)?[0], Device::destroy_pipeline)
    }
}

/// An image that only the device sees, so that it may order texels as suits it.
fn target(gpu: &Gpu, name: &str, format: vk::Format, usage: vk::ImageUsageFlags) -> Result<Image> {
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(SIZE.into())
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(usage);
    gpu.image(name, &info, &[vk::MemoryPropertyFlags::DEVICE_LOCAL])
}

/// A buffer for pictures, row after row, that the host sees. Were its memory not coherent, the host would have to call
/// vkInvalidateMappedMemoryRanges before it reads.
fn pixels(gpu: &Gpu, size: u64) -> Result<Buffer> {
    let info = vk::BufferCreateInfo::default().size(size).usage(vk::BufferUsageFlags::TRANSFER_DST);
    gpu.buffer("pixels", &info, vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT)
}

fn command_buffer(gpu: &Gpu) -> Result<vk::CommandBuffer> {
    let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family);
    // SAFETY: the device is alive, and the pool outlives its buffers.
    unsafe {
        let pool = gpu.own("commands", gpu.device.create_command_pool(&info, None)?, Device::destroy_command_pool)?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        gpu.name("frame", gpu.device.allocate_command_buffers(&info)?[0])
    }
}

/// Hands the commands to the queue, and waits until they are done.
fn submit(gpu: &Gpu, cmd: vk::CommandBuffer) -> Result<()> {
    let (commands, info) = ([cmd], vk::FenceCreateInfo::default());
    // SAFETY: the command buffer is recorded, and what it uses is alive.
    unsafe {
        let done = gpu.own("frame is done", gpu.device.create_fence(&info, None)?, Device::destroy_fence)?;
        gpu.device.queue_submit(gpu.queue, &[vk::SubmitInfo::default().command_buffers(&commands)], done)?;
        // The queue works on its own. Without this line the host reads the buffer before the device has written it.
        if gpu.keep("fence", true) {
            gpu.device.wait_for_fences(&[done], true, u64::MAX)?;
        }
    }
    Ok(())
}
