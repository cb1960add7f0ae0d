//! The shadow atlas: one layered depth image for all maps, and set 2, through which whatever shades looks them up.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec4};

use crate::gpu::sync::Dependency;
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Image, ImageDesc, Location, MemoryKind, Owned, SetLayout, SetWriter, binding,
};
use crate::plan::{DEPTH, MAX_SHADOW_VIEWS, ShadowPlan};
use crate::scene::Camera;
use crate::visible::Visible;

/// `ShadowView` of `shaders/shared/shadows.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ShadowRecord {
    rows: [Vec4; 4],
    low: Vec2,
    edge: f32,
    layer: u32,
    texel: f32,
    light_size: f32,
    end: f32,
    blend: f32,
}

const _: () = {
    use crate::shaders::lighting::structs::shadow_view as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<ShadowRecord>() == wgsl::SIZE);
    assert!(offset_of!(ShadowRecord, rows) == wgsl::U);
    assert!(offset_of!(ShadowRecord, low) == wgsl::LOW);
    assert!(offset_of!(ShadowRecord, edge) == wgsl::EDGE);
    assert!(offset_of!(ShadowRecord, layer) == wgsl::LAYER);
    assert!(offset_of!(ShadowRecord, texel) == wgsl::TEXEL);
    assert!(offset_of!(ShadowRecord, light_size) == wgsl::LIGHT_SIZE);
    assert!(offset_of!(ShadowRecord, end) == wgsl::END);
    assert!(offset_of!(ShadowRecord, blend) == wgsl::BLEND);
};

/// Layout of the atlas whenever no map is being drawn.
pub const ATLAS_LAYOUT: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL;

/// The barriers around the atlas's first clear.
#[derive(Debug, Clone, Copy)]
pub struct ClearOrder {
    /// The layout change of the new image, before the clear.
    pub clear: Dependency,
    /// The clear, before lookups of the maps.
    pub look_up: Dependency,
}

/// The image of all maps, and a set for each frame in flight: binding 0 the image, binding 1 the lights' parts of it.
pub struct ShadowAtlas {
    pub image: Image,
    /// Of one layer each, to draw into.
    pub layers: Vec<Owned<vk::ImageView>>,
    pub set_layout: Owned<vk::DescriptorSetLayout>,
    frames: Vec<(Buffer, vk::DescriptorSet)>,
    _array: Owned<vk::ImageView>,
    _pool: DescriptorPool,
}

impl ShadowAtlas {
    /// An empty atlas, which any stage that shades can read.
    pub fn new(
        device: &Arc<Device>,
        plan: &ShadowPlan,
        frames_in_flight: usize,
        order: ClearOrder,
    ) -> gpu::Result<Self> {
        let image = Image::new(
            device,
            &ImageDesc {
                name: "shadow atlas",
                format: DEPTH,
                extent: vk::Extent2D { width: plan.size, height: plan.size },
                layers: plan.layers,
                usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
                    | vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::TRANSFER_DST,
                location: Location::Device,
                kind: MemoryKind::ShadowMap,
                ..ImageDesc::default()
            },
        )?;
        clear::submit(device, &image, order)?;
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::DEPTH,
            level_count: 1,
            layer_count: plan.layers,
            ..Default::default()
        };
        // An array for the shader, also with one layer.
        let array = image.view_of("shadow atlas, all layers", vk::ImageViewType::TYPE_2D_ARRAY, range)?;
        let layers = (0..plan.layers).map(|layer| image.layer_view(layer)).collect::<gpu::Result<_>>()?;
        let stages = vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE;
        let (texture, uniform) = (vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::UNIFORM_BUFFER);
        let set_layout =
            SetLayout::new(device, "shadow set layout", &[binding(0, texture, stages), binding(1, uniform, stages)])?;
        let count = frames_in_flight as u32;
        let pool = DescriptorPool::new(device, "shadow pool", count, &[(texture, count), (uniform, count)])?;
        let frame = |index| {
            let size = (MAX_SHADOW_VIEWS * size_of::<ShadowRecord>()) as u64;
            let name = format!("shadow maps of frame {index}");
            let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
            let buffer = Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Uniform)?;
            let set = pool.allocate(&format!("shadow set of frame {index}"), set_layout.raw)?;
            SetWriter::new()
                .sampled_image(0, array.raw, ATLAS_LAYOUT)
                .uniform_buffer(1, &buffer, buffer.size)
                .update(device, set);
            Ok((buffer, set))
        };
        let frames = (0..frames_in_flight).map(frame).collect::<gpu::Result<_>>()?;
        Ok(Self { image, layers, set_layout, frames, _array: array, _pool: pool })
    }

    /// Set 2 of one frame in flight.
    pub fn set(&self, frame: usize) -> vk::DescriptorSet {
        self.frames[frame].1
    }

    /// Writes the places of the maps, relative to the camera. The frame that used the buffer before must be done.
    pub fn write(&self, frame: usize, visible: &Visible, camera: &Camera) -> gpu::Result<()> {
        let records: Vec<ShadowRecord> = visible
            .shadows
            .iter()
            .map(|view| match view {
                // An edge of 0: there is nothing to look up.
                None => ShadowRecord::zeroed(),
                Some(view) => ShadowRecord {
                    rows: view.texel_rows(camera),
                    low: Vec2::new(view.tile.x as f32, view.tile.y as f32),
                    edge: view.tile.edge as f32,
                    layer: view.tile.layer,
                    texel: view.texel as f32,
                    light_size: view.light_size as f32,
                    end: view.end as f32,
                    blend: view.blend as f32,
                },
            })
            .collect();
        self.frames[frame].0.write(0, &records)
    }
}

/// The clear that the atlas begins with.
pub mod clear {
    use std::sync::Arc;

    use ash::vk;

    use super::{ATLAS_LAYOUT, ClearOrder};
    use crate::gpu::sync::Use;
    use crate::gpu::{self, CommandBuffer, Device, Image, barrier};

    /// Clears the whole image.
    pub const WRITE: Use = Use::new(vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE);

    /// Clears all maps to "nothing is there" and takes them to where they are read from.
    pub(super) fn submit(device: &Arc<Device>, image: &Image, order: ClearOrder) -> gpu::Result<()> {
        let mut cmd = CommandBuffer::new(device, "clear shadow atlas")?;
        cmd.begin()?;
        let cleared = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        barrier::image_barrier(device, cmd.raw, image, order.clear, [vk::ImageLayout::UNDEFINED, cleared]);
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::DEPTH,
            level_count: 1,
            layer_count: image.layers,
            ..Default::default()
        };
        // SAFETY: recording, outside a render pass; the image is in this layout and has the usage.
        unsafe {
            let far = vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 };
            device.raw.cmd_clear_depth_stencil_image(cmd.raw, image.raw, cleared, &far, &[range]);
        }
        barrier::image_barrier(device, cmd.raw, image, order.look_up, [cleared, ATLAS_LAYOUT]);
        cmd.end()?;
        device.submit(&cmd)?;
        Ok(())
    }
}
