//! Step 0: one colour. The device fills an image and copies it to memory that the host reads.
//!
//! The row that this step teaches is `picture-to-host`.

use std::process::ExitCode;

use afterlight_steps::{Buffer, Gpu, Image, Needs, Result, run};
use ash::Device;
use ash::vk::{self, AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};

const SIZE: vk::Extent2D = vk::Extent2D { width: 320, height: 180 };
/// Four bytes a pixel. The device encodes the light that it writes as sRGB, as PNG files have it.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
const BYTES: u64 = SIZE.width as u64 * SIZE.height as u64 * 4;
/// Linear light, as all colours in these steps.
const COLOR: [f32; 4] = [0.05, 0.2, 0.5, 1.0];

/// The objects that a frame uses.
struct Frame {
    picture: Image,
    pixels: Buffer,
}

fn main() -> ExitCode {
    run(&Needs::default(), draw)
}

fn draw(gpu: &Gpu) -> Result<()> {
    let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
    let picture = target(gpu, "picture", FORMAT, usage)?;
    let frame = Frame { picture, pixels: pixels(gpu, BYTES)? };
    let cmd = command_buffer(gpu)?;
    let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new, and what it names lives until the device is idle.
    unsafe {
        gpu.device.begin_command_buffer(cmd, &once)?;
        frame.record(gpu, cmd);
        frame.copy(gpu, cmd, 0);
        gpu.device.end_command_buffer(cmd)?;
    }
    submit(gpu, cmd)?;
    gpu.save(SIZE, &gpu.read(&frame.pixels)?)
}

impl Frame {
    /// Fills the picture.
    fn record(&self, gpu: &Gpu, cmd: vk::CommandBuffer) {
        // The image is new, so the barrier waits for nothing. Its texels mean nothing either: UNDEFINED lets the device drop them. Without this barrier the clear
        // would write in a layout that the image does not have.
        let to_clear = vk::ImageMemoryBarrier::default().image(self.picture.raw).subresource_range(self.picture.range);
        let to_clear = to_clear.old_layout(Layout::UNDEFINED).new_layout(Layout::TRANSFER_DST_OPTIMAL);
        let to_clear = [to_clear.dst_access_mask(Access::TRANSFER_WRITE)];
        // The copy reads the cleared image, in another layout. Commands of one stage overlap, too: without this barrier the copy may read before the clear has
        // written. Without the first mask the clear's texels may stay in a cache, without the second one the copy may read older texels out of its own.
        let read_back = vk::ImageMemoryBarrier::default().image(self.picture.raw).subresource_range(self.picture.range);
        let read_back = read_back.old_layout(Layout::TRANSFER_DST_OPTIMAL).new_layout(Layout::TRANSFER_SRC_OPTIMAL);
        let read_back = read_back.src_access_mask(gpu.keep("clear-write", Access::TRANSFER_WRITE));
        let read_back = [read_back.dst_access_mask(gpu.keep("copy-read", Access::TRANSFER_READ))];
        let (none, color) = (vk::DependencyFlags::empty(), vk::ClearColorValue { float32: COLOR });
        let (layout, range) = (Layout::TRANSFER_DST_OPTIMAL, [self.picture.range]);
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            if gpu.keep("new-to-clear", true) {
                gpu.device.cmd_pipeline_barrier(cmd, Stage::TOP_OF_PIPE, Stage::TRANSFER, none, &[], &[], &to_clear);
            }
            gpu.device.cmd_clear_color_image(cmd, self.picture.raw, layout, &color, &range);
            if gpu.keep("read-back", true) {
                gpu.device.cmd_pipeline_barrier(cmd, Stage::TRANSFER, Stage::TRANSFER, none, &[], &[], &read_back);
            }
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
