//! Step 5b: step 5 without render pass. Rows are barriers of Vulkan 1.3, and one of them stands inside the rendering (VK_KHR_dynamic_rendering_local_read).
//!
//! The row that this step teaches is `gbuffer-to-lighting`, as a barrier inside the rendering, where BY_REGION is required.

use std::process::ExitCode;
use std::time::Instant;

use afterlight_steps::scene::{self, EYE, FOV_Y_DEGREES, NEAR, TARGET, Vertex};
use afterlight_steps::{Buffer, Entry, Gpu, Image, Needs, Result, entry, run};
use ash::Device;
use ash::khr::dynamic_rendering_local_read as local_read;
use ash::vk::{self, AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
use ash::vk::{AttachmentLoadOp as LoadOp, AttachmentStoreOp as StoreOp, RenderingAttachmentInfo as Attachment};
use glam::dcamera::rh::view::look_at_mat4;
use glam::{DMat4, DVec3, Mat4};

const SIZE: vk::Extent2D = vk::Extent2D { width: 320, height: 180 };
/// Four bytes a pixel. The device encodes the light that it writes as sRGB, as PNG files have it.
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// Position (and 1 where a surface is seen), normal, albedo: 48 bytes a pixel that nobody stores.
const GBUFFER: [vk::Format; 3] = [vk::Format::R32G32B32A32_SFLOAT; 3];
const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;
const BYTES: u64 = SIZE.width as u64 * SIZE.height as u64 * 4;
/// Linear light, as all colours in these steps.
const COLOR: [f32; 4] = [0.02, 0.03, 0.05, 1.0];
const FRAMES: u64 = 2;

type Descriptors = (vk::DescriptorSetLayout, vk::DescriptorSet);

/// The pipelines: name, entry points with their code, and number of targets.
const PIPELINES: [(&str, &[Entry], usize); 2] = [
    ("geometry", &[entry!("vertex"), entry!("geometry")], 3),
    ("lighting", &[entry!("screen"), entry!("lighting")], 1),
];

/// The objects that a frame uses.
struct Frame {
    rows: Rows,
    /// The G-buffer, depth and the picture.
    views: [vk::ImageView; 5],
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    lighting: vk::Pipeline,
    set: vk::DescriptorSet,
    vertices: Buffer,
    indices: Buffer,
    picture: Image,
    pixels: Buffer,
}

fn main() -> ExitCode {
    // To count the fragments that pass the depth test, and not only say whether any do.
    let features = vk::PhysicalDeviceFeatures::default().occlusion_query_precise(true).independent_blend(true);
    let mut newer = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
    let mut read = vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR::default().dynamic_rendering_local_read(true);
    let features = vk::PhysicalDeviceFeatures2::default().features(features).push_next(&mut newer).push_next(&mut read);
    let (api_version, extensions) = (vk::API_VERSION_1_3, &[local_read::NAME][..]);
    run(&Needs { api_version, extensions, features, ..Needs::default() }, draw)
}

fn draw(gpu: &Gpu) -> Result<()> {
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let picture = target(gpu, "picture", FORMAT, usage)?;
    let transient = vk::ImageUsageFlags::TRANSIENT_ATTACHMENT;
    let depth = target(gpu, "depth", DEPTH_FORMAT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | transient)?;
    let lights = lights(gpu)?;
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::INPUT_ATTACHMENT | transient;
    let [position, normal, albedo] = GBUFFER.map(|format| target(gpu, "G-buffer", format, usage));
    let images = [position?, normal?, albedo?, depth, picture];
    let (views, rows) = (images.map(|image| image.view), rows(gpu, &images));
    let (set_layout, set) = descriptors(gpu, &lights, &views[..3])?;
    let layout = layout(gpu, set_layout)?;
    let (pipeline, lighting) = (pipeline(gpu, layout, 0)?, pipeline(gpu, layout, 1)?);
    let (mesh, pixels) = (scene::mesh(), pixels(gpu, BYTES * FRAMES)?);
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION);
    // SAFETY: a structure without pointers.
    let queries = unsafe { gpu.device.create_query_pool(&info.query_count(FRAMES as u32), None)? };
    let queries = gpu.own("fragments", queries, Device::destroy_query_pool)?;
    let cmd = command_buffer(gpu)?;
    let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the command buffer is new, and what it names lives until the device is idle.
    unsafe {
        gpu.device.begin_command_buffer(cmd, &once)?;
        let vertices = upload(gpu, cmd, "vertices", &bytes(mesh.0.as_flattened(), |value| value.to_ne_bytes()))?;
        let indices = upload(gpu, cmd, "indices", &bytes(&mesh.1, |value| value.to_ne_bytes()))?;
        let frame = Frame { rows, views, layout, pipeline, lighting, set, vertices, indices, picture, pixels };
        gpu.device.cmd_reset_query_pool(cmd, queries, 0, FRAMES as u32);
        for number in 0..FRAMES {
            frame.record(gpu, cmd);
            gpu.device.cmd_begin_query(cmd, queries, number as u32, vk::QueryControlFlags::PRECISE);
            frame.light(gpu, cmd);
            gpu.device.cmd_end_query(cmd, queries, number as u32);
            gpu.device.cmd_end_rendering(cmd);
            let end = gpu.keep("read-back", &frame.rows.2[..]);
            gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().image_memory_barriers(end));
            frame.copy(gpu, cmd, number);
        }
        gpu.device.end_command_buffer(cmd)?;
    }
    let start = Instant::now();
    submit(gpu, cmd)?;
    let (time, mut lit) = (start.elapsed() / FRAMES as u32, [0u32; FRAMES as usize]);
    // SAFETY: the queries have ended, as the fence says.
    unsafe { gpu.device.get_query_pool_results(queries, 0, &mut lit, vk::QueryResultFlags::empty())? };
    println!("{} fragments of {} pixels lit by 64 lights, {time:.1?} a frame", lit[0], SIZE.width * SIZE.height);
    gpu.save(SIZE, &gpu.read(&pixels)?[(BYTES * (FRAMES - 1)) as usize..])
}

fn bytes<T: Copy>(values: &[T], bytes: impl Fn(T) -> [u8; 4]) -> Vec<u8> {
    values.iter().flat_map(|value| bytes(*value)).collect()
}

impl Frame {
    /// Draws the G-buffer.
    fn record(&self, gpu: &Gpu, cmd: vk::CommandBuffer) {
        let none = vk::ClearValue { color: vk::ClearColorValue { float32: [0.0; 4] } };
        // Reversed Z: 0 is infinitely far.
        let depth = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } };
        let sky = vk::ClearValue { color: vk::ClearColorValue { float32: COLOR } };
        // Nobody reads the G-buffer or depth after the pass: DONT_CARE saves writing them to memory.
        let (store, drop) = (StoreOp::STORE, StoreOp::DONT_CARE);
        let [a, b, c, d, e] = self.views;
        let [a, b, c] = [a, b, c].map(|view| attachment(view, Layout::RENDERING_LOCAL_READ_KHR, drop, none));
        let color = [a, b, c, attachment(e, Layout::COLOR_ATTACHMENT_OPTIMAL, store, sky)];
        let depth = attachment(d, Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, drop, depth);
        let matrix = bytes(&clip_from_world().to_cols_array(), f32::to_ne_bytes);
        let begin = vk::RenderingInfo::default().color_attachments(&color).depth_attachment(&depth);
        let start = vk::DependencyInfo::default().image_memory_barriers(&self.rows.0);
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_pipeline_barrier2(cmd, &start);
            gpu.device.cmd_begin_rendering(cmd, &begin.render_area(SIZE.into()).layer_count(1));
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            gpu.device.cmd_push_constants(cmd, self.layout, vk::ShaderStageFlags::VERTEX, 0, &matrix);
            let sets = [self.set];
            gpu.device.cmd_bind_descriptor_sets(cmd, vk::PipelineBindPoint::GRAPHICS, self.layout, 0, &sets, &[]);
            gpu.device.cmd_bind_vertex_buffers(cmd, 0, &[self.vertices.raw], &[0]);
            gpu.device.cmd_bind_index_buffer(cmd, self.indices.raw, 0, vk::IndexType::UINT32);
            gpu.device.cmd_draw_indexed(cmd, (self.indices.size / 4) as u32, 1, 0, 0, 0);
        }
    }

    /// Draws the picture: one triangle that covers it. The set is still bound.
    fn light(&self, gpu: &Gpu, cmd: vk::CommandBuffer) {
        let read =
            vk::DependencyInfo::default().dependency_flags(gpu.keep("by-region", vk::DependencyFlags::BY_REGION));
        let read = read.memory_barriers(gpu.keep("gbuffer-to-lighting", &self.rows.1[..]));
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_pipeline_barrier2(cmd, &read);
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.lighting);
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
        let to_host = vk::MemoryBarrier2::default().src_access_mask(Access::TRANSFER_WRITE);
        let to_host = to_host.src_stage_mask(Stage::TRANSFER).dst_stage_mask(Stage::HOST);
        let to_host = [to_host.dst_access_mask(Access::HOST_READ)];
        let layout = Layout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: the command buffer is recording, and what it names is alive.
        unsafe {
            gpu.device.cmd_copy_image_to_buffer(cmd, self.picture.raw, layout, self.pixels.raw, &region);
            if gpu.keep("picture-to-host", true) {
                gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&to_host));
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
    let row = vk::MemoryBarrier2::default().src_access_mask(Access::TRANSFER_WRITE);
    let row = row.src_stage_mask(Stage::TRANSFER).dst_stage_mask(Stage::VERTEX_INPUT);
    let row = [row.dst_access_mask(gpu.keep("fetch", Access::VERTEX_ATTRIBUTE_READ | Access::INDEX_READ))];
    let copy = vk::BufferCopy::default().size(staging.size);
    // SAFETY: the command buffer is recording, and the buffers are alive.
    unsafe {
        gpu.device.cmd_copy_buffer(cmd, staging.raw, buffer.raw, &[copy]);
        if gpu.keep("upload-to-vertices", true) {
            gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&row));
        }
    }
    Ok(buffer)
}

/// The lights, which the host writes: x, y, z in metres, and red, green, blue in candela, each padded to four floats, as uniform buffers have them.
/// `host-to-frame`: shaders read lights that the host wrote. Submitting makes earlier writes of the host visible, so this row is the order of two calls. Written after the
/// submission, the lights may come too late; without this line they never come.
fn lights(gpu: &Gpu) -> Result<Buffer> {
    let floats: Vec<_> = scene::lights().iter().flat_map(|light| [light.position, light.candela]).collect();
    let floats: Vec<_> = floats.iter().flat_map(|vector| vector.extend(0.0).to_array()).collect();
    let info = vk::BufferCreateInfo::default().size(floats.len() as u64 * 4);
    let info = info.usage(vk::BufferUsageFlags::UNIFORM_BUFFER);
    let host = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
    let buffer = gpu.buffer("lights", &info, host)?;
    if gpu.keep("host-to-frame", true) {
        gpu.write(&buffer, &bytes(&floats, f32::to_ne_bytes))?;
    }
    Ok(buffer)
}

/// The descriptor set of all that fragment shaders read: binding 0 has the lights, 1 to 3 the G-buffer.
fn descriptors(gpu: &Gpu, lights: &Buffer, gbuffer: &[vk::ImageView]) -> Result<Descriptors> {
    let image = vk::DescriptorType::INPUT_ATTACHMENT;
    let kinds = [vk::DescriptorType::UNIFORM_BUFFER, image, image, image];
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
            let read =
                [vk::DescriptorImageInfo::default().image_view(*view).image_layout(Layout::RENDERING_LOCAL_READ_KHR)];
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding).descriptor_type(image);
            gpu.device.update_descriptor_sets(&[write.image_info(&read)], &[]);
        }
        Ok((layout, set))
    }
}

/// The barriers before, inside and after a rendering.
type Rows =
    ([vk::ImageMemoryBarrier2<'static>; 5], [vk::MemoryBarrier2<'static>; 1], [vk::ImageMemoryBarrier2<'static>; 1]);

fn rows(gpu: &Gpu, images: &[Image; 5]) -> Rows {
    let row = |number: usize, layouts: [Layout; 2]| {
        let row = vk::ImageMemoryBarrier2::default().old_layout(layouts[0]).new_layout(layouts[1]);
        row.image(images[number].raw).subresource_range(images[number].range)
    };
    // `gbuffer-reuse`: this frame overwrites the G-buffer that the lighting of the last one reads, and then drops: DONT_CARE counts as a write to the attachment.
    // Depth was written last by its store, which belongs to the late tests; DONT_CARE counts as a write, too. The early tests clear it.
    let reuse = row(3, [Layout::UNDEFINED, Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL]);
    let last = Stage::FRAGMENT_SHADER | Stage::COLOR_ATTACHMENT_OUTPUT;
    let reuse = reuse.src_stage_mask(last | gpu.keep("last-depth", Stage::LATE_FRAGMENT_TESTS));
    let last_depth = gpu.keep("last-depth", Access::DEPTH_STENCIL_ATTACHMENT_WRITE);
    let reuse = reuse.src_access_mask(gpu.keep("last-drop", Access::COLOR_ATTACHMENT_WRITE) | last_depth);
    let reuse = reuse.dst_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT | Stage::EARLY_FRAGMENT_TESTS);
    let clear_depth = gpu.keep("clear-depth", Access::DEPTH_STENCIL_ATTACHMENT_WRITE);
    let reuse = reuse.dst_access_mask(Access::COLOR_ATTACHMENT_WRITE | clear_depth);
    let gbuffer = [0, 1, 2].map(|number| reuse.image(images[number].raw).subresource_range(images[number].range));
    let [position, normal, albedo] = gbuffer.map(|row| row.new_layout(Layout::RENDERING_LOCAL_READ_KHR));
    // `gbuffer-to-lighting`: a pixel reads the texels that geometry wrote there, and as the last user drops it, which is a write. BY_REGION: a pixel waits for its own region
    // alone. Without that flag all pixels wait for all, and the G-buffer has to leave the tile.
    let read = vk::MemoryBarrier2::default();
    let read = read.src_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT);
    let read = read.dst_stage_mask(Stage::FRAGMENT_SHADER | Stage::COLOR_ATTACHMENT_OUTPUT);
    let read = read.src_access_mask(gpu.keep("gbuffer-write", Access::COLOR_ATTACHMENT_WRITE));
    let input = gpu.keep("gbuffer-read", Access::INPUT_ATTACHMENT_READ);
    let read = read.dst_access_mask(input | gpu.keep("gbuffer-drop", Access::COLOR_ATTACHMENT_WRITE));
    // `reuse`: this frame overwrites the picture that the copy of the last one reads. The read must be over; it has written nothing, so it needs no mask. Without
    // this row the picture changes its layout, and is cleared, while the copy still reads.
    let again = row(4, [Layout::UNDEFINED, Layout::COLOR_ATTACHMENT_OPTIMAL]);
    let again = again.src_stage_mask(Stage::TRANSFER).dst_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT);
    let again = again.dst_access_mask(Access::COLOR_ATTACHMENT_WRITE);
    // `read-back`: the copy reads the picture of this subpass, and may read it before it is drawn if this row is missing.
    let read_back = row(4, [Layout::COLOR_ATTACHMENT_OPTIMAL, Layout::TRANSFER_SRC_OPTIMAL]);
    let read_back = read_back.src_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT).dst_stage_mask(Stage::TRANSFER);
    let read_back = read_back.src_access_mask(Access::COLOR_ATTACHMENT_WRITE);
    let read_back = read_back.dst_access_mask(gpu.keep("copy-read", Access::TRANSFER_READ));
    ([position, normal, albedo, reuse, again], [read], [read_back])
}

/// An attachment that is cleared, in the layout that it has during the rendering.
fn attachment(view: vk::ImageView, layout: Layout, store: StoreOp, clear: vk::ClearValue) -> Attachment<'static> {
    let attachment = Attachment::default().image_view(view).image_layout(layout).clear_value(clear);
    attachment.load_op(LoadOp::CLEAR).store_op(store)
}

/// The resources of shaders: a matrix, which is recorded with the commands, and a set.
fn layout(gpu: &Gpu, set: vk::DescriptorSetLayout) -> Result<vk::PipelineLayout> {
    let matrix = [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::VERTEX, offset: 0, size: 64 }];
    let sets = [set];
    let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&matrix).set_layouts(&sets);
    // SAFETY: what the structure points to lives until the call returns.
    gpu.own("layout", unsafe { gpu.device.create_pipeline_layout(&info, None)? }, Device::destroy_pipeline_layout)
}

fn pipeline(gpu: &Gpu, layout: vk::PipelineLayout, number: usize) -> Result<vk::Pipeline> {
    let (name, entries, _) = PIPELINES[number];
    let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT].into_iter().zip(entries);
    let stages = stages.map(|(stage, entry)| gpu.stage(stage, *entry)).collect::<Result<Vec<_>>>()?;
    // The entry point `screen` has no inputs and ignores these; lighting tests no depth.
    let stride = [vk::VertexInputBindingDescription::default().stride(size_of::<Vertex>() as u32)];
    let attribute = vk::VertexInputAttributeDescription::default().format(vk::Format::R32G32B32_SFLOAT);
    // Position, normal, colour.
    let attributes = [0, 1, 2].map(|location| attribute.location(location).offset(location * 12));
    let input = vk::PipelineVertexInputStateCreateInfo::default();
    let input = input.vertex_binding_descriptions(&stride).vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewports = [vk::Viewport::default().width(SIZE.width as f32).height(SIZE.height as f32).max_depth(1.0)];
    let scissors = [SIZE.into()];
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
    // Seen from the front, the corners of a triangle run counter-clockwise. Triangles that are seen from behind are left out.
    let raster = vk::PipelineRasterizationStateCreateInfo::default().cull_mode(vk::CullModeFlags::BACK).line_width(1.0);
    let raster = raster.front_face(vk::FrontFace::COUNTER_CLOCKWISE);
    let samples = vk::PipelineMultisampleStateCreateInfo::default();
    let samples = samples.rasterization_samples(vk::SampleCountFlags::TYPE_1);
    // Reversed Z: nearer surfaces have a greater depth.
    let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true);
    let depth = depth.depth_write_enable(true).depth_compare_op(vk::CompareOp::GREATER);
    let depth = depth.depth_test_enable(number == 0);
    // The outputs of a shader have the numbers of the attachments. A pipeline leaves the others as they are.
    let target = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
    let other = vk::PipelineColorBlendAttachmentState::default();
    let targets = if number == 0 { [target, target, target, other] } else { [other, other, other, target] };
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&targets);
    // SAFETY: what the structures point to lives until the calls return.
    unsafe {
        let formats = [GBUFFER[0], GBUFFER[1], GBUFFER[2], FORMAT];
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        rendering = rendering.depth_attachment_format(DEPTH_FORMAT);
        let info = vk::GraphicsPipelineCreateInfo::default().stages(&stages).layout(layout).push_next(&mut rendering);
        let info = info.vertex_input_state(&input).input_assembly_state(&assembly).viewport_state(&viewport);
        let info = info.depth_stencil_state(&depth);
        let info = [info.rasterization_state(&raster).multisample_state(&samples).color_blend_state(&blend)];
        let made = gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &info, None);
        gpu.own(name, made.map_err(|(_, error)| error)?[0], Device::destroy_pipeline)
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
