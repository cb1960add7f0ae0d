//! Step 11b: a proof. From the uses of images and the rows it finds every pair of uses that no row orders, without a device.
//!
//! It finds more than layers do: each row that is deleted, and each bit that orders something. It also finds the bits that order nothing.

use std::process::ExitCode;
use std::time::Instant;

use afterlight_steps::scene::{self, EYE, FOV_Y_DEGREES, NEAR, SUN, SUN_LUX, TARGET, Vertex};
use afterlight_steps::{Buffer, Entry, Gpu, Image, Needs, Result, entry, run};
use ash::Device;
use ash::vk::{self, AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
use ash::vk::{AttachmentLoadOp as LoadOp, AttachmentStoreOp as StoreOp};
use glam::dcamera::rh::view::look_at_mat4;
use glam::{DMat4, DVec3, Mat4};

const SIZE: vk::Extent2D = vk::Extent2D { width: 160, height: 90 };
/// Four bytes a pixel. The device encodes the light that it writes as sRGB, as PNG files have it.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// Normal; albedo, and in alpha roughness and metal.
const GBUFFER: [vk::Format; 2] = [vk::Format::R16G16_UNORM, vk::Format::R8G8B8A8_SRGB];
/// Light in nits, half floats: 65504 at most.
const LIGHT_FORMAT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;
const BYTES: u64 = SIZE.width as u64 * SIZE.height as u64 * 4;
/// Linear light, as all colours in these steps.
const COLOR: [f32; 4] = [0.02, 0.03, 0.05, 1.0];
const FRAMES: usize = 10;
/// The shadow map: 12 m along each side.
const MAP_SIZE: vk::Extent2D = vk::Extent2D { width: 1024, height: 1024 };

type Descriptors = (vk::DescriptorSetLayout, vk::DescriptorSet);

/// The pipelines: name, entry points with their code, and number of targets.
const PIPELINES: [(&str, &[Entry], usize); 4] = [
    ("geometry", &[entry!("vertex"), entry!("geometry")], 2),
    ("lighting", &[entry!("screen"), entry!("lighting")], 1),
    ("tonemap", &[entry!("screen"), entry!("tonemap")], 1),
    ("shadow", &[entry!("vertex")], 0),
];

const SHADOW: usize = 0;
const MAIN: usize = 1;
const COPY: usize = 2;
/// Commands before and after a render pass.
const OUTSIDE: u32 = vk::SUBPASS_EXTERNAL;

/// A row: its name, its render pass, the subpasses that it orders, the stages with their accesses that must be over, and the same of the waiting subpass.
type Row = (&'static str, usize, [u32; 2], [(Stage, Access); 2]);

/// The objects that a frame uses. Commands, lights with their set, and pixels belong to one frame in flight, since the host uses them. All frames share the rest.
struct Frame {
    pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    layout: vk::PipelineLayout,
    pipelines: Vec<vk::Pipeline>,
    shadow: (vk::RenderPass, vk::Framebuffer, vk::Pipeline),
    set: vk::DescriptorSet,
    vertices: Buffer,
    indices: Buffer,
    picture: Image,
    pixels: Buffer,
    lights: Buffer,
    cmd: vk::CommandBuffer,
    done: vk::Fence,
}

fn main() -> ExitCode {
    run(&Needs::default(), draw)
}

fn draw(gpu: &Gpu) -> Result<()> {
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let picture = target(gpu, "picture", FORMAT, usage)?;
    let read = vk::ImageUsageFlags::INPUT_ATTACHMENT | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT;
    let depth = target(gpu, "depth", DEPTH_FORMAT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | read)?;
    let lights = [lights(gpu)?, lights(gpu)?];
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | read;
    let [normal, albedo] = GBUFFER.map(|format| target(gpu, "G-buffer", format, usage));
    let light = target(gpu, "light", LIGHT_FORMAT, usage)?;
    let views = [depth.view, normal?.view, albedo?.view, light.view, picture.view];
    let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
    let map = target(gpu, "shadow map", DEPTH_FORMAT, usage)?.view;
    let reads = [views[0], views[1], views[2], views[3], map];
    let sets = [descriptors(gpu, &lights[0], &reads)?, descriptors(gpu, &lights[1], &reads)?];
    let (pass, layout) = (render_pass(gpu)?, layout(gpu, sets[0].0)?);
    let shadow = shadow_pass(gpu)?;
    let shadow = (shadow, framebuffer(gpu, shadow, MAP_SIZE, &[map])?, pipeline(gpu, shadow, layout, 3)?);
    let framebuffer = framebuffer(gpu, pass, SIZE, &views)?;
    let pipelines: Vec<_> = (0..3).map(|number| pipeline(gpu, pass, layout, number)).collect::<Result<_>>()?;
    let mesh = scene::mesh();
    let cmd = command_buffer(gpu)?;
    let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new, and what it names lives until the device is idle.
    let (vertices, indices) = unsafe {
        gpu.device.begin_command_buffer(cmd, &once)?;
        let vertices = upload(gpu, cmd, "vertices", &bytes(mesh.0.as_flattened(), |value| value.to_ne_bytes()))?;
        let indices = upload(gpu, cmd, "indices", &bytes(&mesh.1, |value| value.to_ne_bytes()))?;
        gpu.device.end_command_buffer(cmd)?;
        (vertices, indices)
    };
    submit(gpu, cmd)?;
    let frame = |number: usize| -> Result<Frame> {
        // A frame that shares the lights of the other one is lit as the next frame should be.
        let own = if gpu.keep("own-lights", true) { number } else { 0 };
        let (set, lights, pixels, pipelines) = (sets[own].1, lights[own], pixels(gpu, BYTES)?, pipelines.clone());
        let info = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        // SAFETY: a structure without pointers. (Signalled, since at first there is nothing to wait for.)
        let done = gpu.own("frame is done", unsafe { gpu.device.create_fence(&info, None)? }, Device::destroy_fence)?;
        Ok(Frame {
            pass,
            framebuffer,
            layout,
            pipelines,
            shadow,
            set,
            vertices,
            indices,
            picture,
            pixels,
            lights,
            cmd: command_buffer(gpu)?,
            done,
        })
    };
    // On a device that is a CPU host and device share the cores, and neither way is faster.
    let frames = [frame(0)?, frame(1)?];
    let (start, in_flight) = (Instant::now(), animate(gpu, &frames)?);
    let (middle, single) = (Instant::now(), animate(gpu, &frames[..1])?);
    println!("{FRAMES} frames: {:.1?} with two in flight, {:.1?} one at a time", middle - start, middle.elapsed());
    gpu.save(SIZE, &in_flight[FRAMES - 1])?;
    prove(gpu)?;
    let other = (0..FRAMES).find(|number| in_flight[*number] != single[*number]);
    other.map_or(Ok(()), |number| Err(format!("frame {number} differs from the one that was drawn alone").into()))
}

/// Draws the frames with as many in flight as there are objects for. Returns the pictures.
fn animate(gpu: &Gpu, frames: &[Frame]) -> Result<Vec<Vec<u8>>> {
    let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    let mut pictures = Vec::new();
    for number in 0..FRAMES + frames.len() {
        let frame = &frames[number % frames.len()];
        let (commands, cmd) = ([frame.cmd], frame.cmd);
        let lights = bytes(&lights_at(number), f32::to_ne_bytes);
        if !gpu.keep("frame-to-host", true) {
            gpu.write(&frame.lights, &lights)?;
        }
        // SAFETY: the commands are recorded anew when the device is done with them, and what they name lives until it is idle.
        unsafe {
            // `frame-to-host`: the host reads the picture, and writes commands and lights anew, when the last frame that used them is done. An earlier write would
            // change data that the device still reads. No barrier can help, since barriers order the device's work alone.
            gpu.device.wait_for_fences(&[frame.done], true, u64::MAX)?;
            if number >= frames.len() {
                pictures.push(gpu.read(&frame.pixels)?);
            }
            if number < FRAMES {
                gpu.device.reset_fences(&[frame.done])?;
                gpu.write(&frame.lights, &lights)?;
                gpu.device.begin_command_buffer(cmd, &once)?;
                frame.cast(gpu, cmd);
                frame.record(gpu, cmd);
                gpu.device.cmd_next_subpass(cmd, vk::SubpassContents::INLINE);
                frame.screen(gpu, cmd, frame.pipelines[1]);
                gpu.device.cmd_next_subpass(cmd, vk::SubpassContents::INLINE);
                frame.screen(gpu, cmd, frame.pipelines[2]);
                gpu.device.cmd_end_render_pass(cmd);
                frame.copy(gpu, cmd, 0);
                gpu.device.end_command_buffer(cmd)?;
                let info = [vk::SubmitInfo::default().command_buffers(&commands)];
                gpu.device.queue_submit(gpu.queue, &info, frame.done)?;
            }
        }
    }
    Ok(pictures)
}

fn bytes<T: Copy>(values: &[T], bytes: impl Fn(T) -> [u8; 4]) -> Vec<u8> {
    values.iter().flat_map(|value| bytes(*value)).collect()
}

impl Frame {
    /// Draws the shadow map.
    fn cast(&self, gpu: &Gpu, cmd: vk::CommandBuffer) {
        let (pass, framebuffer, pipeline) = self.shadow;
        // Reversed Z: 0 is farthest from the sun.
        let clear = [vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } }];
        let begin = vk::RenderPassBeginInfo::default().render_pass(pass).framebuffer(framebuffer);
        let begin = begin.render_area(MAP_SIZE.into()).clear_values(&clear);
        let matrix = bytes(&map_from_world().to_cols_array(), f32::to_ne_bytes);
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_begin_render_pass(cmd, &begin, vk::SubpassContents::INLINE);
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, pipeline);
            gpu.device.cmd_push_constants(cmd, self.layout, vk::ShaderStageFlags::ALL_GRAPHICS, 0, &matrix);
            gpu.device.cmd_bind_vertex_buffers(cmd, 0, &[self.vertices.raw], &[0]);
            gpu.device.cmd_bind_index_buffer(cmd, self.indices.raw, 0, vk::IndexType::UINT32);
            gpu.device.cmd_draw_indexed(cmd, (self.indices.size / 4) as u32, 1, 0, 0, 0);
            gpu.device.cmd_end_render_pass(cmd);
        }
    }

    /// Draws the G-buffer.
    fn record(&self, gpu: &Gpu, cmd: vk::CommandBuffer) {
        let none = vk::ClearValue { color: vk::ClearColorValue { float32: [0.0; 4] } };
        // Reversed Z: 0 is infinitely far.
        let depth = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } };
        let sky = vk::ClearValue { color: vk::ClearColorValue { float32: COLOR } };
        let clear = [depth, none, none, sky, none];
        let camera = bytes(&camera(), f32::to_ne_bytes);
        let begin = vk::RenderPassBeginInfo::default().render_pass(self.pass).framebuffer(self.framebuffer);
        let begin = begin.render_area(SIZE.into()).clear_values(&clear);
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_begin_render_pass(cmd, &begin, vk::SubpassContents::INLINE);
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.pipelines[0]);
            gpu.device.cmd_push_constants(cmd, self.layout, vk::ShaderStageFlags::ALL_GRAPHICS, 0, &camera);
            let sets = [self.set];
            gpu.device.cmd_bind_descriptor_sets(cmd, vk::PipelineBindPoint::GRAPHICS, self.layout, 0, &sets, &[]);
            gpu.device.cmd_bind_vertex_buffers(cmd, 0, &[self.vertices.raw], &[0]);
            gpu.device.cmd_bind_index_buffer(cmd, self.indices.raw, 0, vk::IndexType::UINT32);
            gpu.device.cmd_draw_indexed(cmd, (self.indices.size / 4) as u32, 1, 0, 0, 0);
        }
    }

    /// Draws one triangle that covers the picture. The set is still bound.
    fn screen(&self, gpu: &Gpu, cmd: vk::CommandBuffer, pipeline: vk::Pipeline) {
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, pipeline);
            gpu.device.cmd_draw(cmd, 3, 1, 0, 0);
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

/// Maps the world to clip space. The device divides x, y and z by w. With w the distance d along the view, x / d and y / d are a perspective, and z = near
/// makes depth = near / d: 1 at the near plane, 0 infinitely far away (reversed Z). Floats are finest around 0, so depth is as exact far away as near by. The
/// other way round, d = 2 near would have a depth of 0.5, and half of the range from 0 to 1 would be left for all that is farther.
fn clip_from_world() -> Mat4 {
    let y = 1.0 / (FOV_Y_DEGREES.to_radians() / 2.0).tan();
    let x = y * f64::from(SIZE.height) / f64::from(SIZE.width);
    // Columns: what x, y, z and 1 of the camera's space add. The camera looks along -z, and Vulkan's y points down.
    let columns = [[x, 0.0, 0.0, 0.0], [0.0, -y, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, NEAR, 0.0]];
    (DMat4::from_cols_array_2d(&columns) * look_at_mat4(EYE, TARGET, DVec3::Y)).as_mat4()
}

/// The matrix, and how to find a place from a pixel and its depth: eye + (corner + x across + y down) / depth. Depth is near / distance, and the sum in brackets is
/// the way from the eye to the pixel's place on the near plane.
fn camera() -> Vec<f32> {
    let world_from_view = look_at_mat4(EYE, TARGET, DVec3::Y).inverse();
    let up = (FOV_Y_DEGREES.to_radians() / 2.0).tan() * NEAR;
    let right = up * f64::from(SIZE.width) / f64::from(SIZE.height);
    let way = |x, y, z| world_from_view.transform_vector3(DVec3::new(x, y, z));
    let across = way(2.0 * right / f64::from(SIZE.width), 0.0, 0.0);
    let down = way(0.0, -2.0 * up / f64::from(SIZE.height), 0.0);
    let vectors = [EYE, way(-right, up, -NEAR), across, down].map(|vector| vector.as_vec3().extend(0.0).to_array());
    [&clip_from_world().to_cols_array()[..], vectors.as_flattened()].concat()
}

/// Maps the world to the shadow map. The sun's rays are parallel, so depth is linear: from 1, 12 m towards the sun from the scene's middle, to 0, 12 m away from it.
fn map_from_world() -> Mat4 {
    let columns =
        [[1.0 / 6.0, 0.0, 0.0, 0.0], [0.0, -1.0 / 6.0, 0.0, 0.0], [0.0, 0.0, 1.0 / 24.0, 0.0], [0.0, 0.0, 0.5, 1.0]];
    (DMat4::from_cols_array_2d(&columns) * look_at_mat4(DVec3::ZERO, -SUN, DVec3::Y)).as_mat4()
}

/// Makes a buffer that the device alone sees, where it reads fastest, and records a copy to it from one that the host has written. What the host writes
/// before it submits is visible to all commands, so the copy needs no row.
fn upload(gpu: &Gpu, cmd: vk::CommandBuffer, name: &str, data: &[u8]) -> Result<Buffer> {
    let info = vk::BufferCreateInfo::default().size(data.len() as u64);
    let host = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
    let staging = gpu.buffer("staging", &info.usage(vk::BufferUsageFlags::TRANSFER_SRC), host)?;
    gpu.write(&staging, data)?;
    let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::INDEX_BUFFER;
    let info = info.usage(usage | vk::BufferUsageFlags::TRANSFER_DST);
    let buffer = gpu.buffer(name, &info, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
    // `upload-to-vertices`: draws fetch the copied vertices and indices. Without this row the first frame may fetch before it is there, without the masks out of a stale cache.
    let row = vk::MemoryBarrier::default().src_access_mask(Access::TRANSFER_WRITE);
    let row = [row.dst_access_mask(gpu.keep("fetch", Access::VERTEX_ATTRIBUTE_READ | Access::INDEX_READ))];
    let none = vk::DependencyFlags::empty();
    let copy = vk::BufferCopy::default().size(staging.size);
    // SAFETY: the command buffer is recording, and the buffers are alive.
    unsafe {
        gpu.device.cmd_copy_buffer(cmd, staging.raw, buffer.raw, &[copy]);
        if gpu.keep("upload-to-vertices", true) {
            gpu.device.cmd_pipeline_barrier(cmd, Stage::TRANSFER, Stage::VERTEX_INPUT, none, &row, &[], &[]);
        }
    }
    Ok(buffer)
}

/// The lights, which the host writes: x, y, z in metres, and red, green, blue in candela, each padded to four floats, as uniform buffers have them.
/// `host-to-frame`: shaders read lights that the host wrote. Submitting makes earlier writes of the host visible, so this row is the order of two calls. Written after the
/// submission, the lights may come too late; without this line they never come.
fn lights_at(number: usize) -> Vec<f32> {
    // The lights rise and fall. The last one is the sun: a direction and lux.
    let rise = glam::Vec3::Y * (number as f32 / 8.0).sin() * 0.2;
    let lights = scene::lights().into_iter().flat_map(|light| [light.position + rise, light.candela]);
    let lights = lights.chain([SUN.as_vec3(), SUN_LUX]).flat_map(|vector| vector.extend(0.0).to_array());
    map_from_world().to_cols_array().into_iter().chain(lights).collect()
}

fn lights(gpu: &Gpu) -> Result<Buffer> {
    let info = vk::BufferCreateInfo::default().size(lights_at(0).len() as u64 * 4);
    let info = info.usage(vk::BufferUsageFlags::UNIFORM_BUFFER);
    gpu.buffer("lights", &info, vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT)
}

/// The descriptor set of all that fragment shaders read: binding 0 has the lights, 1 to 3 depth and the G-buffer, 4 the light, 5 the shadow map.
fn descriptors(gpu: &Gpu, lights: &Buffer, gbuffer: &[vk::ImageView]) -> Result<Descriptors> {
    let image = vk::DescriptorType::INPUT_ATTACHMENT;
    let kinds = [vk::DescriptorType::UNIFORM_BUFFER, image, image, image, image, vk::DescriptorType::SAMPLED_IMAGE];
    let binding = vk::DescriptorSetLayoutBinding::default().stage_flags(vk::ShaderStageFlags::FRAGMENT);
    let binding = |(number, kind)| binding.binding(number).descriptor_type(kind).descriptor_count(1);
    let bindings: Vec<_> = (0..).zip(kinds).map(binding).collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    let sizes = kinds.map(|ty| vk::DescriptorPoolSize { ty, descriptor_count: 1 });
    let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
    // SAFETY: what the structures point to lives until the calls return, and the buffer as long as the set.
    unsafe {
        let layout = gpu.device.create_descriptor_set_layout(&info, None)?;
        let layouts = [gpu.own("set layout", layout, Device::destroy_descriptor_set_layout)?];
        let pool = gpu.own("sets", gpu.device.create_descriptor_pool(&pool, None)?, Device::destroy_descriptor_pool)?;
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        let set = gpu.name("set", gpu.device.allocate_descriptor_sets(&info)?[0])?;
        let buffer = [vk::DescriptorBufferInfo::default().buffer(lights.raw).range(vk::WHOLE_SIZE)];
        let write = vk::WriteDescriptorSet::default().dst_set(set).descriptor_type(kinds[0]).buffer_info(&buffer);
        gpu.device.update_descriptor_sets(&[write], &[]);
        for (binding, view) in (1..).zip(gbuffer) {
            let depth = Layout::DEPTH_STENCIL_READ_ONLY_OPTIMAL;
            let layout = if binding == 1 || binding == 5 { depth } else { Layout::SHADER_READ_ONLY_OPTIMAL };
            let read = [vk::DescriptorImageInfo::default().image_view(*view).image_layout(layout)];
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding);
            let write = write.descriptor_type(kinds[binding as usize]);
            gpu.device.update_descriptor_sets(&[write.image_info(&read)], &[]);
        }
        Ok((layout, set))
    }
}

/// Everything that orders one use of an image after another.
fn rows() -> Vec<Row> {
    let (fragment, color, transfer) = (Stage::FRAGMENT_SHADER, Stage::COLOR_ATTACHMENT_OUTPUT, Stage::TRANSFER);
    // Early and late tests write depth. Clearing belongs to the early ones, storing and dropping to the late ones.
    let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
    let (color_write, depth_write) = (Access::COLOR_ATTACHMENT_WRITE, Access::DEPTH_STENCIL_ATTACHMENT_WRITE);
    let (all, none, input) = (color_write | depth_write, Access::empty(), Access::INPUT_ATTACHMENT_READ);
    vec![
        // This frame clears the map that the lighting of the last one reads. A read must be over; it has written nothing, so it needs no access.
        ("shadow-reuse", SHADOW, [OUTSIDE, 0], [(fragment, none), (tests, depth_write)]),
        // Lighting reads any texel of the map.
        ("shadow-to-lighting", SHADOW, [0, OUTSIDE], [(tests, depth_write), (fragment, Access::SHADER_READ)]),
        // This frame overwrites the G-buffer that the lighting of the last one reads, and then drops: DONT_CARE counts as a write.
        ("gbuffer-reuse", MAIN, [OUTSIDE, 0], [(fragment | color | tests, all), (color | tests, all)]),
        // A pixel reads the texels that geometry wrote there, and as the last user drops it.
        ("gbuffer-to-lighting", MAIN, [0, 1], [(color | tests, all), (fragment | color | tests, input | all)]),
        // This frame overwrites the light that the tone mapping of the last one reads, and then drops.
        ("hdr-reuse", MAIN, [OUTSIDE, 1], [(fragment | color, color_write), (color, color_write)]),
        // Tone mapping reads the light of its pixel, and drops it.
        ("hdr-to-tonemap", MAIN, [1, 2], [(color, color_write), (fragment | color, input | color_write)]),
        // This frame overwrites the picture that the copy of the last one reads.
        ("reuse", MAIN, [OUTSIDE, 2], [(transfer, none), (color, color_write)]),
        // The copy reads the picture of tone mapping.
        ("read-back", MAIN, [2, OUTSIDE], [(color, color_write), (transfer, Access::TRANSFER_READ)]),
    ]
}

/// A use of an image: where, by which stage and access, and in words. Uses of one frame stand in their order.
#[derive(Clone, Copy)]
struct Use {
    frame: usize,
    pass: usize,
    subpass: u32,
    image: &'static str,
    stage: Stage,
    access: Access,
    what: &'static str,
}

/// All uses of a frame. Clearing is a write before the draws; DONT_CARE drops, which is a write after the last read.
fn uses(frame: usize) -> Vec<Use> {
    let (early, late, color) =
        (Stage::EARLY_FRAGMENT_TESTS, Stage::LATE_FRAGMENT_TESTS, Stage::COLOR_ATTACHMENT_OUTPUT);
    let (fragment, input) = (Stage::FRAGMENT_SHADER, Access::INPUT_ATTACHMENT_READ);
    let (color_write, depth_write) = (Access::COLOR_ATTACHMENT_WRITE, Access::DEPTH_STENCIL_ATTACHMENT_WRITE);
    let list = [
        (SHADOW, 0, "map", early, depth_write, "shadow clears the map"),
        (SHADOW, 0, "map", late, depth_write, "shadow draws the map"),
        (MAIN, 0, "depth", early, depth_write, "geometry clears depth"),
        (MAIN, 0, "depth", late, depth_write, "geometry draws depth"),
        (MAIN, 0, "G-buffer", color, color_write, "geometry draws the G-buffer"),
        (MAIN, 1, "depth", fragment, input, "lighting reads depth"),
        (MAIN, 1, "depth", late, depth_write, "lighting drops depth"),
        (MAIN, 1, "G-buffer", fragment, input, "lighting reads the G-buffer"),
        (MAIN, 1, "G-buffer", color, color_write, "lighting drops the G-buffer"),
        (MAIN, 1, "map", fragment, Access::SHADER_READ, "lighting reads the map"),
        (MAIN, 1, "light", color, color_write, "lighting draws the light"),
        (MAIN, 2, "light", fragment, input, "tone mapping reads the light"),
        (MAIN, 2, "light", color, color_write, "tone mapping drops the light"),
        (MAIN, 2, "picture", color, color_write, "tone mapping draws the picture"),
        (COPY, 0, "picture", Stage::TRANSFER, Access::TRANSFER_READ, "the copy reads the picture"),
    ];
    let named = |(pass, subpass, image, stage, access, what)| Use { frame, pass, subpass, image, stage, access, what };
    list.map(named).to_vec()
}

impl Use {
    fn writes(&self) -> bool {
        self.access.intersects(Access::COLOR_ATTACHMENT_WRITE | Access::DEPTH_STENCIL_ATTACHMENT_WRITE)
    }

    /// Uses of one subpass are ordered by rasterization, and the store of an attachment comes last.
    fn is_beside(&self, other: &Use) -> bool {
        (self.frame, self.pass, self.subpass) == (other.frame, other.pass, other.subpass)
    }

    /// True if the row orders this use before a later one. Between them the layout changes, which is a write: the later use must see it, and waits for it even
    /// where it only overwrites what this one has read.
    fn is_before(&self, later: &Use, (_, pass, [from, to], [after, before]): &Row) -> bool {
        let (starts, ends) = ((self.pass, self.subpass) == (*pass, *from), (later.pass, later.subpass) == (*pass, *to));
        let is_inside = (self.frame, self.pass) == (later.frame, later.pass);
        let is_between = match (*from, *to) {
            (OUTSIDE, _) => ends && !is_inside,
            (_, OUTSIDE) => starts && !is_inside,
            _ => starts && ends && is_inside,
        };
        let waits = after.0.contains(self.stage) && before.0.contains(later.stage);
        let sees = (!self.writes() || after.1.contains(self.access)) && before.1.contains(later.access);
        is_between && waits && sees
    }
}

/// Pairs of uses, one of them a write, that no row orders. Each use is held against the uses back to the last write, which has waited for everything before
/// it; and not against that write if a read between the two has waited for it.
fn hazards(rows: &[Row]) -> Vec<String> {
    // Two frames, since images are used again.
    let (mut found, all) = (Vec::new(), [uses(0), uses(1)].concat());
    for (number, later) in all.iter().enumerate() {
        let (mut write, mut is_read): (Option<&Use>, bool) = (None, false);
        for earlier in all[..number].iter().rev().filter(|earlier| earlier.image == later.image) {
            if write.is_some_and(|write| !(earlier.writes() && earlier.is_beside(write))) {
                break;
            }
            let conflict = if earlier.writes() { !is_read } else { later.writes() };
            is_read |= !earlier.writes() && !earlier.is_beside(later);
            if conflict && !earlier.is_beside(later) && !rows.iter().any(|row| earlier.is_before(later, row)) {
                found.push(format!("{}, then {}", earlier.what, later.what));
            }
            write = write.or(earlier.writes().then_some(earlier));
        }
    }
    found
}

/// Proves the rows, and shows that the proof would notice if one was missing.
fn prove(gpu: &Gpu) -> Result<()> {
    for number in 0..rows().len() {
        let mut fewer = rows();
        let name = fewer.remove(number).0;
        println!("without {name}: {}", hazards(&fewer).first().map_or("no hazard", |first| first));
    }
    let (mut needed, mut idle) = (0, Vec::new());
    for (number, row) in rows().into_iter().enumerate() {
        for (side, half) in ["after", "before"].iter().zip(0..) {
            for bit in 0..32 {
                let (stage, access) = (Stage::from_raw(1 << bit), Access::from_raw(1 << bit));
                for (kind, has) in
                    [("stage", row.3[half].0.contains(stage)), ("access", row.3[half].1.contains(access))]
                {
                    let mut fewer = rows();
                    match kind {
                        "stage" => fewer[number].3[half].0 &= !stage,
                        _ => fewer[number].3[half].1 &= !access,
                    }
                    // Stages from bit 7 on.
                    let stages = ["FRAGMENT_SHADER", "EARLY_FRAGMENT_TESTS", "LATE_FRAGMENT_TESTS"];
                    let named = if kind == "stage" { stages.get(usize::wrapping_sub(bit, 7)) } else { None };
                    match has && hazards(&fewer).is_empty() {
                        true => idle.push(format!("{} {side}: {}", row.0, named.unwrap_or(&"another bit"))),
                        false => needed += usize::from(has),
                    }
                }
            }
        }
    }
    println!("{needed} bits are needed; without these nothing changes: {}", idle.join(", "));
    let kept: Vec<_> = rows().into_iter().filter(|row| gpu.keep(row.0, true)).collect();
    let found = hazards(&kept);
    if found.is_empty() { Ok(()) } else { Err(format!("no row orders this: {}", found.join("; ")).into()) }
}

/// The rows of a render pass. Between two subpasses a pixel waits for its own region alone.
fn dependencies(gpu: &Gpu, pass: usize) -> Vec<vk::SubpassDependency> {
    let rows = rows().into_iter().filter(|row| gpu.keep(row.0, true) && row.1 == pass);
    let dependency = |(_, _, pair, [after, before]): Row| vk::SubpassDependency {
        src_subpass: pair[0],
        dst_subpass: pair[1],
        src_stage_mask: after.0,
        src_access_mask: after.1,
        dst_stage_mask: before.0,
        dst_access_mask: before.1,
        dependency_flags: match pair.contains(&OUTSIDE) {
            true => vk::DependencyFlags::empty(),
            false => vk::DependencyFlags::BY_REGION,
        },
    };
    rows.map(dependency).collect()
}

/// One subpass that draws depth.
fn shadow_pass(gpu: &Gpu) -> Result<vk::RenderPass> {
    // STORE: lighting reads the map in another render pass.
    let layouts = [Layout::UNDEFINED, Layout::DEPTH_STENCIL_READ_ONLY_OPTIMAL];
    let attachments = [attachment(DEPTH_FORMAT, LoadOp::CLEAR, StoreOp::STORE, layouts)];
    let depth = vk::AttachmentReference { attachment: 0, layout: Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL };
    let subpasses = [vk::SubpassDescription::default().depth_stencil_attachment(&depth)];
    let rows = dependencies(gpu, SHADOW);
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses).dependencies(&rows);
    // SAFETY: what the structure points to lives until the call returns.
    gpu.own("shadow pass", unsafe { gpu.device.create_render_pass(&info, None)? }, Device::destroy_render_pass)
}

/// Three subpasses: geometry draws the G-buffer, lighting reads it and adds up light, and tone mapping reads that and draws the picture.
fn render_pass(gpu: &Gpu) -> Result<vk::RenderPass> {
    // Nobody reads the G-buffer or depth after the pass: DONT_CARE saves writing them to memory.
    let (clear, store, drop) = (LoadOp::CLEAR, StoreOp::STORE, gpu.keep("drop", StoreOp::DONT_CARE));
    let read = [Layout::UNDEFINED, Layout::SHADER_READ_ONLY_OPTIMAL];
    let [normal, albedo] = GBUFFER.map(|format| attachment(format, clear, drop, read));
    let depth = attachment(DEPTH_FORMAT, clear, drop, [Layout::UNDEFINED, Layout::DEPTH_STENCIL_READ_ONLY_OPTIMAL]);
    // CLEAR and UNDEFINED: old texels are not needed; LOAD would draw over them. STORE: DONT_CARE would allow the device to forget the picture when the pass ends.
    // The pass leaves the picture in the layout in which the copy reads it.
    let picture = attachment(FORMAT, clear, store, [Layout::UNDEFINED, Layout::TRANSFER_SRC_OPTIMAL]);
    let light = attachment(LIGHT_FORMAT, clear, drop, read);
    let attachments = [depth, normal, albedo, light, picture];
    let stored = attachments.iter().filter(|attachment| attachment.store_op == store);
    println!("{} bytes stored a pixel of {}", stored.count() * 4, attachments.len() * 4 + 4);
    let reference = |attachment, layout| vk::AttachmentReference { attachment, layout };
    let gbuffer = [1, 2].map(|number| reference(number, Layout::COLOR_ATTACHMENT_OPTIMAL));
    let depth = reference(0, Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
    let geometry = vk::SubpassDescription::default().color_attachments(&gbuffer).depth_stencil_attachment(&depth);
    let [normal, albedo] = [1, 2].map(|number| reference(number, Layout::SHADER_READ_ONLY_OPTIMAL));
    let inputs = [reference(0, Layout::DEPTH_STENCIL_READ_ONLY_OPTIMAL), normal, albedo];
    let light = [reference(3, Layout::COLOR_ATTACHMENT_OPTIMAL)];
    let lighting = vk::SubpassDescription::default().input_attachments(&inputs).color_attachments(&light);
    // The shaders of a file number their inputs together.
    let none = reference(vk::ATTACHMENT_UNUSED, Layout::UNDEFINED);
    let lit = [none, none, none, reference(3, Layout::SHADER_READ_ONLY_OPTIMAL)];
    let picture = [reference(4, Layout::COLOR_ATTACHMENT_OPTIMAL)];
    let tonemap = vk::SubpassDescription::default().input_attachments(&lit).color_attachments(&picture);
    let rows = dependencies(gpu, MAIN);
    let subpasses = [geometry, lighting, tonemap];
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
fn framebuffer(
    gpu: &Gpu,
    pass: vk::RenderPass,
    size: vk::Extent2D,
    views: &[vk::ImageView],
) -> Result<vk::Framebuffer> {
    let info = vk::FramebufferCreateInfo::default().render_pass(pass).attachments(views);
    let info = info.width(size.width).height(size.height).layers(1);
    // SAFETY: pass and views are alive.
    gpu.own("framebuffer", unsafe { gpu.device.create_framebuffer(&info, None)? }, Device::destroy_framebuffer)
}

/// The resources of shaders: a camera, which is recorded with the commands, and a set.
fn layout(gpu: &Gpu, set: vk::DescriptorSetLayout) -> Result<vk::PipelineLayout> {
    let matrix = [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::ALL_GRAPHICS, offset: 0, size: 128 }];
    let sets = [set];
    let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&matrix).set_layouts(&sets);
    // SAFETY: what the structure points to lives until the call returns.
    gpu.own("layout", unsafe { gpu.device.create_pipeline_layout(&info, None)? }, Device::destroy_pipeline_layout)
}

fn pipeline(gpu: &Gpu, pass: vk::RenderPass, layout: vk::PipelineLayout, number: usize) -> Result<vk::Pipeline> {
    let (name, entries, targets) = PIPELINES[number];
    let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT].into_iter().zip(entries);
    let stages = stages.map(|(stage, entry)| gpu.stage(stage, *entry)).collect::<Result<Vec<_>>>()?;
    // The entry point `screen` has no inputs and ignores these; lighting tests no depth.
    let stride = [vk::VertexInputBindingDescription::default().stride(size_of::<Vertex>() as u32)];
    let attribute = vk::VertexInputAttributeDescription::default().format(vk::Format::R32G32B32_SFLOAT);
    // Position, normal, colour, roughness with metal.
    let mut attributes = [0, 1, 2, 3].map(|location| attribute.location(location).offset(location * 12));
    attributes[3].format = vk::Format::R32G32_SFLOAT;
    let input = vk::PipelineVertexInputStateCreateInfo::default();
    let input = input.vertex_binding_descriptions(&stride).vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let size = if number == 3 { MAP_SIZE } else { SIZE };
    let viewports = [vk::Viewport::default().width(size.width as f32).height(size.height as f32).max_depth(1.0)];
    let scissors = [size.into()];
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
    // Seen from the front, the corners of a triangle run counter-clockwise. Triangles that are seen from behind are left out.
    let raster = vk::PipelineRasterizationStateCreateInfo::default().cull_mode(vk::CullModeFlags::BACK).line_width(1.0);
    let raster = raster.front_face(vk::FrontFace::COUNTER_CLOCKWISE);
    // A texel has one depth for all of its area, and the filter looks at its neighbours: a slanted surface must go back by its rise within two texels, or it
    // shadows itself.
    let raster = raster.depth_bias_enable(number == 3 && gpu.keep("bias", true)).depth_bias_slope_factor(-2.5);
    let samples = vk::PipelineMultisampleStateCreateInfo::default();
    let samples = samples.rasterization_samples(vk::SampleCountFlags::TYPE_1);
    // Reversed Z: nearer surfaces have a greater depth.
    let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true);
    let depth = depth.depth_write_enable(true).depth_compare_op(vk::CompareOp::GREATER);
    let target = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
    let targets = vec![target; targets];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&targets);
    // SAFETY: what the structures point to lives until the calls return.
    unsafe {
        let info = vk::GraphicsPipelineCreateInfo::default().stages(&stages).layout(layout).render_pass(pass);
        let info = info.subpass(number as u32 % 3);
        let info = info.vertex_input_state(&input).input_assembly_state(&assembly).viewport_state(&viewport);
        let info = info.depth_stencil_state(&depth);
        let info = [info.rasterization_state(&raster).multisample_state(&samples).color_blend_state(&blend)];
        let made = gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None);
        gpu.own(name, made.map_err(|(_, error)| error)?[0], Device::destroy_pipeline)
    }
}

/// An image that only the device sees, so that it may order texels as suits it.
fn target(gpu: &Gpu, name: &str, format: vk::Format, usage: vk::ImageUsageFlags) -> Result<Image> {
    let size = if usage.contains(vk::ImageUsageFlags::SAMPLED) { MAP_SIZE } else { SIZE };
    let info = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(size.into())
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(usage);
    // Lazily allocated memory is for transient images alone: a device has none to allocate as long as they stay in its tiles.
    gpu.image(name, &info, &[vk::MemoryPropertyFlags::LAZILY_ALLOCATED, vk::MemoryPropertyFlags::DEVICE_LOCAL])
}

/// A buffer for pictures, row after row, that the host sees. Were its memory not coherent, the host would have to call
/// vkInvalidateMappedMemoryRanges before it reads.
fn pixels(gpu: &Gpu, size: u64) -> Result<Buffer> {
    let info = vk::BufferCreateInfo::default().size(size).usage(vk::BufferUsageFlags::TRANSFER_DST);
    gpu.buffer("pixels", &info, vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT)
}

fn command_buffer(gpu: &Gpu) -> Result<vk::CommandBuffer> {
    let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family);
    let info = info.flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
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
