//! The cheapest scene, a lambert mesh under one directional light, drawn by the renderer and by the least of a forward frame that draws it:
//! one render pass, one pipeline, one vertex buffer, one index buffer, one block of push constants. Frames take turns, both pictures
//! must be the same within a code, and the median of the ratios is the cost of the renderer's generality.
//!
//! `cargo bench --bench cheapest -- [--frames N] [--validate]`. Without `--bench`, as `cargo test --bench cheapest` runs it, only the
//! pictures are compared, under validation.

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::ffi::CString;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{Pixels, Renderer};
use afterlight::gpu::barrier::memory_barrier;
use afterlight::gpu::sync::{Dependency, SyncVersion, Use};
use afterlight::gpu::{
    Buffer, CommandBuffer, DepthState, Device, DeviceChoice, Framebuffer, GraphicsPipeline, GraphicsPipelineDesc,
    Image, ImageDesc, Instance, InstanceOptions, Location, MemoryKind, MessageKind, Owned, PipelinePlace, RenderPass,
    RenderPassParts, ShaderStage, SubpassDesc, SubpassOrder, UploadOrder, Uploader, Validation, framebuffer,
    pipeline_layout, vk,
};
use afterlight::passes::copy;
use afterlight::scene::{
    AlphaMode, Brdf, Camera, Light, LightKind, Material, Mesh, Object, Projection, Scene, Settings, exposure_scale,
};
use afterlight_truth::measure::Distribution;
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat4, DVec3, DVec4, Mat4, Vec3};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const EV100: f32 = 10.0;
/// Lux.
const ILLUMINANCE: f32 = 2500.0;
const ALBEDO: Vec3 = Vec3::new(0.8, 0.5, 0.3);

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let measured = given.iter().any(|word| word == "--bench");
    let validate = !measured || given.iter().any(|word| word == "--validate");
    let frames = given.iter().position(|word| word == "--frames").and_then(|at| given.get(at + 1)?.parse().ok());
    let frames: usize = frames.unwrap_or(if measured { 100 } else { 2 });
    let validation = if validate { Validation::Synchronization } else { Validation::Off };
    let instance = Instance::new(&InstanceOptions { validation, ..InstanceOptions::default() })?;
    let log = instance.message_log();
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    println!("{}, {}; medians of {frames} frames", device.physical.name, device.physical.driver_info);
    println!(
        "{:>10} {:>11} {:>12} {:>9} {:>7} {:>15}",
        "triangles", "size", "renderer ms", "least ms", "ratio", "p5..p95"
    );
    for triangles in [10_000, 100_000] {
        for size in [[1280, 720], [1920, 1080]] {
            compare(&device, triangles, size, frames)?;
        }
    }
    drop((device, instance));
    let said = log.take().into_iter().filter(|message| validate && message.kind != MessageKind::General);
    let messages: Vec<_> = said.collect();
    if messages.is_empty() { Ok(()) } else { Err(format!("validation: {messages:?}").into()) }
}

/// Draws both in turn.
fn compare(device: &Arc<Device>, triangles: usize, size: [u32; 2], frames: usize) -> Result<()> {
    let scene = scene(triangles);
    let settings = Settings { size, exposure: Some(EV100), ..Settings::default() };
    let mut renderer = Renderer::new(device, &scene, &settings)?;
    let mut least = Least::new(device, &scene, size)?;
    let mut pairs = Vec::new();
    for round in 0..frames + 5 {
        let mut own = || -> Result<f64> {
            let start = Instant::now();
            renderer.render(&scene.camera)?;
            renderer.wait()?;
            Ok(start.elapsed().as_secs_f64() * 1e3)
        };
        // The first of the two changes, so that both profit from the other's traces in caches.
        let pair = match round % 2 {
            0 => {
                let first = own()?;
                (first, least.draw(&scene.camera)?)
            }
            _ => {
                let first = least.draw(&scene.camera)?;
                (own()?, first)
            }
        };
        // The first few are to warm up.
        pairs.extend((round >= 5).then_some(pair));
    }
    let Pixels::Srgb8(picture) = renderer.read_back()?.pixels else { return Err("a linear picture".into()) };
    let differing = picture.iter().zip(least.read_back()?).map(|(own, least)| own.abs_diff(least));
    let worst = differing.max().unwrap_or(0);
    assert!(worst <= 1, "the pictures differ by {worst} codes");
    assert!(picture.iter().any(|&code| code > 100 && code < 255), "nothing is seen");
    let median = |of: fn(&(f64, f64)) -> f64| Distribution::of(pairs.iter().map(of)).ok_or("no frame was measured");
    let ratio = median(|(own, least)| own / least)?;
    println!(
        "{:>10} {:>11} {:>12.3} {:>9.3} {:>7.3} {:>15}",
        scene.triangle_count(),
        format!("{}x{}", size[0], size[1]),
        median(|(own, _)| *own)?.median,
        median(|(_, least)| *least)?.median,
        ratio.median,
        format!("{:.3}..{:.3}", ratio.p5, ratio.p95)
    );
    Ok(())
}

/// A sphere of a metre's radius, of about so many triangles, three metres away.
fn scene(triangles: usize) -> Scene {
    let rings = ((triangles as f64 / 4.0).sqrt()) as usize;
    let columns = 2 * rings;
    let mut points = Vec::new();
    for ring in 0..=rings {
        let (y, radius) = ((PI * ring as f64 / rings as f64).cos(), (PI * ring as f64 / rings as f64).sin());
        for column in 0..=columns {
            let around = TAU * column as f64 / columns as f64;
            points.push(DVec3::new(radius * around.sin(), y, radius * around.cos()));
        }
    }
    let mut mesh = Mesh::from_points("sphere", &points);
    mesh.normals = points.iter().map(|point| point.as_vec3().to_array()).collect();
    for ring in 0..rings {
        for column in 0..columns {
            let corner = |down: usize, right: usize| ((ring + down) * (columns + 1) + column + right) as u32;
            mesh.indices.extend([corner(0, 0), corner(1, 0), corner(1, 1)]);
            mesh.indices.extend([corner(0, 0), corner(1, 1), corner(0, 1)]);
        }
    }
    let material = Material {
        name: "clay".into(),
        base_color: ALBEDO,
        brdf: Brdf::Lambert,
        alpha_mode: AlphaMode::Opaque,
        ..Material::default()
    };
    let light = Light {
        name: "sky".into(),
        kind: LightKind::Directional { direction: -to_light() },
        color: Vec3::ONE,
        intensity: ILLUMINANCE,
        casts_shadow: false,
        size: 0.0,
    };
    Scene {
        name: "sphere".into(),
        objects: vec![Object::new("sphere", 0, 0, DAffine3::IDENTITY)],
        meshes: vec![mesh],
        materials: vec![material],
        lights: vec![light],
        camera: Camera {
            position: DVec3::new(0.0, 0.0, 3.0),
            projection: Projection::perspective(45.0),
            ..Camera::default()
        },
        ..Scene::default()
    }
}

fn to_light() -> DVec3 {
    DVec3::new(0.4, 0.7, 0.6).normalize()
}

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    clip_from_mesh: Mat4,
    to_light: Vec3,
    _padding: f32,
    color: Vec3,
    _end: f32,
}

/// The least of a forward frame. Two command buffers, so that one frame is recorded while another is drawn, as the renderer has.
struct Least {
    device: Arc<Device>,
    size: [u32; 2],
    output: Image,
    _depth: Image,
    pass: RenderPass,
    framebuffer: Framebuffer,
    layout: Owned<vk::PipelineLayout>,
    pipeline: GraphicsPipeline,
    vertices: Buffer,
    indices: Buffer,
    index_count: u32,
    commands: [CommandBuffer; 2],
    next: usize,
}

impl Least {
    fn new(device: &Arc<Device>, scene: &Scene, size: [u32; 2]) -> Result<Self> {
        let extent = vk::Extent2D { width: size[0], height: size[1] };
        let image = |name, format, usage| {
            Image::new(device, &ImageDesc { name, format, extent, usage, ..ImageDesc::default() })
        };
        let depth_usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT;
        let color_usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let depth = image("least depth", vk::Format::D32_SFLOAT, depth_usage)?;
        let output = image("least output", vk::Format::R8G8B8A8_SRGB, color_usage)?;
        let pass = render_pass(device)?;
        let framebuffer = framebuffer(device, "least", pass.raw, &[depth.view, output.view], extent)?;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let range = vk::PushConstantRange { stage_flags: stages, offset: 0, size: size_of::<Push>() as u32 };
        let layout = pipeline_layout(device, "least", &[], &[range])?;
        let pipeline = pipeline(device, pass.raw, layout.raw)?;
        let mesh = &scene.meshes[0];
        let vertices: Vec<[f32; 6]> =
            mesh.positions.iter().zip(&mesh.normals).map(|(p, n)| [p[0], p[1], p[2], n[0], n[1], n[2]]).collect();
        let indices: Vec<u16> =
            mesh.indices.iter().map(|&index| u16::try_from(index)).collect::<std::result::Result<_, _>>()?;
        let reads = vk::AccessFlags2::VERTEX_ATTRIBUTE_READ | vk::AccessFlags2::INDEX_READ;
        let drawn = Use::new(vk::PipelineStageFlags2::VERTEX_INPUT, reads);
        let mut uploader = Uploader::new(device, 4 << 20, UploadOrder::before(drawn, drawn))?;
        let mut upload = |name: &str, bytes: &[u8], usage| -> Result<Buffer> {
            let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
            let buffer = Buffer::new(device, name, bytes.len() as u64, usage, Location::Device, MemoryKind::Geometry)?;
            uploader.buffer(&buffer, 0, bytes)?;
            Ok(buffer)
        };
        let vertices = upload("least vertices", bytemuck::cast_slice(&vertices), vk::BufferUsageFlags::VERTEX_BUFFER)?;
        let index_count = indices.len() as u32;
        let indices = upload("least indices", bytemuck::cast_slice(&indices), vk::BufferUsageFlags::INDEX_BUFFER)?;
        uploader.finish()?;
        let commands = [CommandBuffer::new(device, "least 0")?, CommandBuffer::new(device, "least 1")?];
        let device = device.clone();
        Ok(Self {
            device,
            size,
            output,
            _depth: depth,
            pass,
            framebuffer,
            layout,
            pipeline,
            vertices,
            indices,
            index_count,
            commands,
            next: 0,
        })
    }

    /// Draws a frame and waits for it: milliseconds.
    fn draw(&mut self, camera: &Camera) -> Result<f64> {
        let start = Instant::now();
        let [width, height] = self.size;
        let push = Push {
            clip_from_mesh: clip_from_mesh(camera, f64::from(width) / f64::from(height)),
            to_light: to_light().as_vec3(),
            _padding: 0.0,
            color: ALBEDO * (ILLUMINANCE * exposure_scale(EV100) / std::f32::consts::PI),
            _end: 0.0,
        };
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let viewport =
            vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() };
        let clears = [
            vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } },
            vk::ClearValue { color: vk::ClearColorValue { float32: [0.0, 0.0, 0.0, 1.0] } },
        ];
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass.raw)
            .framebuffer(self.framebuffer.raw)
            .render_area(area)
            .clear_values(&clears);
        let command = &mut self.commands[self.next];
        self.next = 1 - self.next;
        command.begin()?;
        let (gpu, cmd) = (&self.device.raw, command.raw);
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        // SAFETY: all objects are alive and were made for each other in `new`; `cmd` is being recorded.
        unsafe {
            gpu.cmd_begin_render_pass(cmd, &begin, vk::SubpassContents::INLINE);
            gpu.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.pipeline.raw);
            gpu.cmd_set_viewport(cmd, 0, &[viewport]);
            gpu.cmd_set_scissor(cmd, 0, &[area]);
            gpu.cmd_bind_vertex_buffers(cmd, 0, &[self.vertices.raw], &[0]);
            gpu.cmd_bind_index_buffer(cmd, self.indices.raw, 0, vk::IndexType::UINT16);
            gpu.cmd_push_constants(cmd, self.layout.raw, stages, 0, bytemuck::bytes_of(&push));
            gpu.cmd_draw_indexed(cmd, self.index_count, 1, 0, 0, 0);
            gpu.cmd_end_render_pass(cmd);
        }
        command.end()?;
        let ticket = self.device.submit(command)?;
        self.device.wait(ticket)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// The last picture.
    fn read_back(&mut self) -> Result<Vec<u8>> {
        let [width, height] = self.size;
        let bytes = u64::from(width) * u64::from(height) * 4;
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let buffer =
            Buffer::new(&self.device, "least picture", bytes, usage, Location::ReadBack, MemoryKind::ReadBack)?;
        let command = &mut self.commands[self.next];
        command.begin()?;
        let region = vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(vk::Extent3D { width, height, depth: 1 });
        // SAFETY: the image is in this layout after its pass, and the buffer holds all of it.
        unsafe {
            let (gpu, cmd, layout) = (&self.device.raw, command.raw, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
            gpu.cmd_copy_image_to_buffer(cmd, self.output.raw, layout, buffer.raw, &[region]);
        }
        memory_barrier(&self.device, command.raw, Dependency::between(copy::WRITE, copy::HOST_READ));
        command.end()?;
        let ticket = self.device.submit(command)?;
        self.device.wait(ticket)?;
        Ok(buffer.read(0, bytes)?)
    }
}

fn render_pass(device: &Arc<Device>) -> Result<RenderPass> {
    let attachment = |format, store, last| {
        vk::AttachmentDescription::default()
            .format(format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(store)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(vk::ImageLayout::UNDEFINED)
            .final_layout(last)
    };
    let depth = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    let attachments = [
        attachment(vk::Format::D32_SFLOAT, vk::AttachmentStoreOp::DONT_CARE, depth),
        attachment(vk::Format::R8G8B8A8_SRGB, vk::AttachmentStoreOp::STORE, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
    ];
    let color = vk::AttachmentReference { attachment: 1, layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL };
    let subpass = SubpassDesc {
        color: &[color],
        depth: Some(vk::AttachmentReference { attachment: 0, layout: depth }),
        ..SubpassDesc::default()
    };
    let tests = vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS;
    let written = vk::AccessFlags2::COLOR_ATTACHMENT_WRITE
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let drawn = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
    let dependencies = [
        // Frames share both images: the last one must be over, and copied.
        SubpassOrder {
            between: [vk::SUBPASS_EXTERNAL, 0],
            before: Use::new(
                tests | vk::PipelineStageFlags2::TRANSFER,
                vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE,
            ),
            after: Use::new(tests | drawn, written),
            by_region: false,
        },
        SubpassOrder {
            between: [0, vk::SUBPASS_EXTERNAL],
            before: Use::new(drawn, vk::AccessFlags2::COLOR_ATTACHMENT_WRITE),
            after: copy::READ,
            by_region: false,
        },
    ];
    let parts = RenderPassParts {
        sync: SyncVersion::One,
        attachments: &attachments,
        subpasses: &[subpass],
        dependencies: &dependencies,
    };
    Ok(RenderPass::new(device, "least", parts)?)
}

fn pipeline(device: &Arc<Device>, render_pass: vk::RenderPass, layout: vk::PipelineLayout) -> Result<GraphicsPipeline> {
    let source = ("benches/cheapest.wgsl", include_str!("cheapest.wgsl"));
    let shader = afterlight_shader_compiler::compile_source(source, &[]);
    let shader = shader.map_err(|errors| errors.iter().map(ToString::to_string).collect::<String>())?;
    let entries = &shader.variants[0].entry_points;
    let names: Vec<CString> =
        entries.iter().map(|entry| CString::new(&*entry.name)).collect::<std::result::Result<_, _>>()?;
    let stages: Vec<ShaderStage> = entries
        .iter()
        .zip(&names)
        .zip([vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT])
        .map(|((entry, name), stage)| ShaderStage { spirv: &entry.spirv, entry: name, stage, constants: &[] })
        .collect();
    let attribute = |location| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .format(vk::Format::R32G32B32_SFLOAT)
            .offset(12 * location)
    };
    let opaque = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
    Ok(GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: "least",
            stages: &stages,
            vertex_bindings: &[vk::VertexInputBindingDescription::default().stride(24)],
            vertex_attributes: &[attribute(0), attribute(1)],
            cull_mode: vk::CullModeFlags::BACK,
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            depth: Some(DepthState { test: vk::CompareOp::GREATER, write: true }),
            depth_bias: false,
            depth_clamp: false,
            blend: &[opaque],
            samples: vk::SampleCountFlags::TYPE_1,
            layout,
            place: &PipelinePlace::Subpass(render_pass, 0),
        },
    )?)
}

/// Reversed Z with an infinite far plane, Y down: z = near, w = distance.
fn clip_from_mesh(camera: &Camera, aspect: f64) -> Mat4 {
    let tan_y = camera.half_height();
    let (right, down) = (camera.right() / (tan_y * aspect), -camera.up() / tan_y);
    let rows = [right.extend(0.0), down.extend(0.0), DVec4::W * camera.near, camera.forward().extend(0.0)];
    let clip_from_world = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
    (clip_from_world * DMat4::from_translation(-camera.position)).as_mat4()
}
