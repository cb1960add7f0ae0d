//! OVERLAY: panels of a user interface over the finished picture. It has a separate render pass, which exists only while something is shown.
//!
//! Panels come as plain triangles, so that nothing here depends on the UI library.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::screen::{WindowPass, over, sampled_bindings, sampled_set, stages};
use super::{
    COLOR_BLEND, ContentsIfFirst, Endpoint, NO_WINDOW, Pass, Presence, Resource, ResourceUse, SAMPLED, Slot, UseKind,
    needed, shown,
};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, GraphicsPipeline, GraphicsPipelineDesc, Image, ImageDesc, Location,
    MemoryKind, Owned, OwnedSampler, SetLayout, UploadOrder, Uploader, pipeline_layout,
    sync::{Layouts, SyncVersion, Use},
};
use crate::shaders::overlay::{self as shader, Flags, constants};

/// Blends over the picture, which it reads and writes as an attachment.
pub const BLEND: Use = COLOR_BLEND;
/// Samples its textures.
pub const TEXTURE_READ: Use = SAMPLED;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("OVERLAY"),
    time: "overlay",
    what: "draws panels over the picture",
    presence: |plan| Presence::when(plan.presented.is_some(), "only while panels are shown", NO_WINDOW),
    touches: |plan| {
        let drawn = UseKind::Color { location: 0, first: ContentsIfFirst::Undefined };
        vec![ResourceUse::new(shown(plan), drawn, BLEND), ResourceUse::resource(Resource::PanelTextures, TEXTURE_READ)]
    },
    leave_out: None,
    make: None,
};

/// A corner of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PanelVertex {
    /// Position in points from the top left of the window.
    pub position: [f32; 2],
    /// Texture coordinates, 0 to 1 from the top left.
    pub uv: [f32; 2],
    /// Colour, sRGB-encoded and premultiplied by alpha.
    pub color: [u8; 4],
}

/// Triangles with one texture, within a part of the window.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelDraw {
    pub texture: u64,
    /// Scissor in pixels, within the window.
    pub scissor: vk::Rect2D,
    /// Range in [`Panels::indices`].
    pub indices: Range<u32>,
}

/// A texture that is new or has changed.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelTexture {
    pub id: u64,
    pub size: [u32; 2],
    /// RGBA, sRGB-encoded, times alpha, rows from the top.
    pub rgba: Vec<u8>,
}

/// The panels of one frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panels {
    pub vertices: Vec<PanelVertex>,
    pub indices: Vec<u32>,
    /// Draw calls, from back to front.
    pub draws: Vec<PanelDraw>,
    pub pixels_per_point: f32,
    /// Textures that are new or changed from this frame on.
    pub textures: Vec<PanelTexture>,
    /// Textures that no later frame needs.
    pub spent: Vec<u64>,
}

/// The shader's push constants.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct OverlayPush {
    scale: [f32; 2],
}

const _: () = assert!(size_of::<OverlayPush>() == shader::push::SIZE);
const _: () = assert!(size_of::<PanelVertex>() == 20);

const PUSH_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::VERTEX;

/// The pass, its pipeline, and the resources that it draws with.
pub struct OverlayPass {
    pass: WindowPass,
    pipeline: Owned<vk::Pipeline>,
    layout: Owned<vk::PipelineLayout>,
    set_layout: SetLayout,
    sampler: OwnedSampler,
    uploads: UploadOrder,
    textures: HashMap<u64, OverlayTexture>,
    /// One for each frame in flight.
    buffers: Vec<Option<OverlayBuffers>>,
}

/// A texture with its set.
struct OverlayTexture {
    set: vk::DescriptorSet,
    _pool: DescriptorPool,
    _image: Image,
}

/// Vertices and indices of a frame.
struct OverlayBuffers {
    vertices: Buffer,
    indices: Buffer,
}

impl OverlayPass {
    /// For images of this format; `encodes` says whether that encodes sRGB by itself.
    pub fn new(
        device: &Arc<Device>,
        format: vk::Format,
        encodes: bool,
        uploads: UploadOrder,
        in_flight: usize,
    ) -> gpu::Result<Self> {
        let pass =
            WindowPass::new(device, "overlay", format, vk::AttachmentLoadOp::LOAD, (uploads.layouts, uploads.sync))?;
        let set_layout = SetLayout::new(device, "overlay set layout", &sampled_bindings())?;
        let range =
            vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: size_of::<OverlayPush>() as u32 };
        let layout = pipeline_layout(device, "overlay layout", &[set_layout.raw], &[range])?;
        let pipeline = pipeline(device, layout.raw, pass.render_pass.raw, encodes)?;
        Ok(Self {
            pass,
            pipeline,
            layout,
            set_layout,
            sampler: OwnedSampler::bilinear(device, "overlay sampler")?,
            uploads,
            textures: HashMap::new(),
            buffers: (0..in_flight).map(|_| None).collect(),
        })
    }

    /// The format of the images that it draws into, the layouts of images, and the API that it is made by.
    pub fn form(&self) -> (vk::Format, Layouts, SyncVersion) {
        (self.pass.format, self.pass.layouts, self.pass.sync)
    }

    /// Draws into these images from now on.
    pub fn resize(&mut self, images: &[vk::ImageView], extent: vk::Extent2D) -> gpu::Result<()> {
        self.pass.resize(images, extent)
    }

    /// Takes over the panels of a frame in flight. The frame that used its buffers before must be done.
    pub fn write(&mut self, frame: usize, panels: &Panels) -> gpu::Result<()> {
        self.upload(&panels.textures)?;
        let vertices: &[u8] = bytemuck::cast_slice(&panels.vertices);
        let indices: &[u8] = bytemuck::cast_slice(&panels.indices);
        if vertices.is_empty() || indices.is_empty() {
            return Ok(());
        }
        let fits = |buffer: &Buffer, bytes: &[u8]| buffer.size >= bytes.len() as u64;
        if !self.buffers[frame].as_ref().is_some_and(|own| fits(&own.vertices, vertices) && fits(&own.indices, indices))
        {
            // The old ones are destroyed when no frame uses them.
            let buffer = |what: &str, bytes: &[u8], usage| {
                let name = format!("overlay {what} of frame {frame}");
                let size = (bytes.len() as u64).next_power_of_two().max(1 << 16);
                Buffer::new(&self.pass.device, &name, size, usage, Location::Upload, MemoryKind::Geometry)
            };
            self.buffers[frame] = Some(OverlayBuffers {
                vertices: buffer("vertices", vertices, vk::BufferUsageFlags::VERTEX_BUFFER)?,
                indices: buffer("indices", indices, vk::BufferUsageFlags::INDEX_BUFFER)?,
            });
        }
        if let Some(own) = &self.buffers[frame] {
            // The submission makes them visible to the device: the row "host-to-frame".
            own.vertices.write(0, vertices)?;
            own.indices.write(0, indices)?;
        }
        Ok(())
    }

    /// Each change makes a new image: textures that frames in flight still sample are left as they are, and go to the retire queue.
    fn upload(&mut self, textures: &[PanelTexture]) -> gpu::Result<()> {
        if textures.is_empty() {
            return Ok(());
        }
        let bytes: usize = textures.iter().map(|texture| texture.rgba.len()).sum();
        let mut uploader = Uploader::new(&self.pass.device, 2 * bytes as u64, self.uploads)?;
        let mut bound = Vec::new();
        for texture in textures {
            let [width, height] = texture.size;
            let desc = ImageDesc {
                name: "overlay texture",
                // Encoded values are sampled and blended.
                format: vk::Format::R8G8B8A8_UNORM,
                extent: vk::Extent2D { width, height },
                usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
                location: Location::Device,
                kind: MemoryKind::Texture,
                ..ImageDesc::default()
            };
            let image = Image::new(&self.pass.device, &desc)?;
            uploader.texture(&image, &[&texture.rgba])?;
            bound.push((texture.id, self.bind(image)?));
        }
        uploader.finish()?;
        self.textures.extend(bound);
        Ok(())
    }

    fn bind(&self, image: Image) -> gpu::Result<OverlayTexture> {
        let (pool, set) = sampled_set(
            &self.pass.device,
            "overlay",
            &self.set_layout,
            (image.view, self.pass.layouts),
            &self.sampler,
        )?;
        Ok(OverlayTexture { set, _pool: pool, _image: image })
    }

    /// Begins the render pass over one of its images, draws what [`OverlayPass::write`] took over for this frame, and ends it.
    pub fn record(&self, cmd: vk::CommandBuffer, image: usize, frame: usize, panels: &Panels) {
        self.pass.device.begin_label(cmd, "OVERLAY");
        self.pass.record(cmd, image, |_| {
            if let Some(buffers) = &self.buffers[frame] {
                self.draw(cmd, buffers, panels);
            }
        });
        self.pass.device.end_label(cmd);
    }

    fn draw(&self, cmd: vk::CommandBuffer, buffers: &OverlayBuffers, panels: &Panels) {
        let (gpu, layout) = (&self.pass.device.raw, self.layout.raw);
        let [width, height] = [self.pass.extent.width, self.pass.extent.height].map(|edge| edge as f32);
        let viewport = vk::Viewport { width, height, max_depth: 1.0, ..vk::Viewport::default() };
        let push = OverlayPush { scale: [width, height].map(|edge| 2.0 * panels.pixels_per_point / edge) };
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: `cmd` is being recorded inside the pass that the pipeline was made for; the buffers live until their frame is done, and hold the
        // data that the draws refer to, as `write` stored it; the sets match the pipeline's layout.
        unsafe {
            gpu.cmd_bind_pipeline(cmd, graphics, self.pipeline.raw);
            gpu.cmd_set_viewport(cmd, 0, &[viewport]);
            gpu.cmd_push_constants(cmd, layout, PUSH_STAGES, 0, bytemuck::bytes_of(&push));
            gpu.cmd_bind_vertex_buffers(cmd, 0, &[buffers.vertices.raw], &[0]);
            gpu.cmd_bind_index_buffer(cmd, buffers.indices.raw, 0, vk::IndexType::UINT32);
            for draw in &panels.draws {
                // Each texture was sent with this frame or one before it.
                let Some(texture) = self.textures.get(&draw.texture) else { continue };
                gpu.cmd_set_scissor(cmd, 0, &[draw.scissor]);
                gpu.cmd_bind_descriptor_sets(cmd, graphics, layout, 0, &[texture.set], &[]);
                gpu.cmd_draw_indexed(cmd, draw.indices.len() as u32, 1, draw.indices.start, 0, 0);
            }
        }
    }

    /// Lets go of textures that no later frame draws with.
    pub fn forget(&mut self, spent: &[u64]) {
        for id in spent {
            self.textures.remove(id);
        }
    }
}

fn pipeline(
    device: &Arc<Device>,
    layout: vk::PipelineLayout,
    render_pass: vk::RenderPass,
    encodes: bool,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let variant = needed("overlay", shader::variant, Flags::NONE)?;
    let vertices = vk::VertexInputBindingDescription::default().stride(size_of::<PanelVertex>() as u32);
    let attribute =
        |location, offset, format| vk::VertexInputAttributeDescription { location, binding: 0, format, offset };
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: "overlay",
            stages: &stages(variant, &[(constants::ENCODED_OUTPUT, u32::from(encodes))]),
            vertex_bindings: &[vertices],
            vertex_attributes: &[
                attribute(0, 0, vk::Format::R32G32_SFLOAT),
                attribute(1, 8, vk::Format::R32G32_SFLOAT),
                attribute(2, 16, vk::Format::R8G8B8A8_UNORM),
            ],
            cull_mode: vk::CullModeFlags::NONE,
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            depth: None,
            depth_bias: false,
            depth_clamp: false,
            blend: &[over()],
            samples: vk::SampleCountFlags::TYPE_1,
            layout,
            place: &Slot::Subpass(render_pass, 0),
        },
    )
}
