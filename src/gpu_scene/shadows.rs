//! The shadow atlas: one layered depth image for all maps, and set 2, through which whatever shades looks them up.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec4};

use crate::gpu::barrier::ImageRange;
use crate::gpu::sync::{Dependency, Layouts, SyncVersion};
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
/// Layout of the tints whenever no map is being drawn.
pub const TINT_LAYOUT: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

/// Tint of a texel without transparent surfaces: all light passes.
const NOTHING_TINTED: [f32; 4] = [1.0, 1.0, 1.0, 0.0];

/// The barriers around an image's first clear.
#[derive(Debug, Clone, Copy)]
pub struct ClearOrder {
    /// The layout change of the new image, before the clear.
    pub clear: Dependency,
    /// The clear, before lookups of the maps.
    pub look_up: Dependency,
    /// The API by which both are recorded.
    pub sync: SyncVersion,
}

/// The clear barriers of all images.
#[derive(Debug, Clone, Copy)]
pub struct ClearOrders {
    pub maps: ClearOrder,
    /// Present if the plan has tints.
    pub tints: Option<ClearOrder>,
    /// The layouts of the images.
    pub layouts: Layouts,
}

/// The image of all maps, and a set for each frame in flight: binding 0 the image, binding 1 the lights' parts of it, binding 2 their tints.
pub struct ShadowAtlas {
    pub maps: LayeredImage,
    /// Beside each map, where transparent surfaces cast shadows.
    pub tints: Option<LayeredImage>,
    pub set_layout: Owned<vk::DescriptorSetLayout>,
    frames: Vec<(Buffer, vk::DescriptorSet)>,
    _pool: DescriptorPool,
}

/// An image with a layer for each of the atlas.
pub struct LayeredImage {
    pub image: Image,
    /// A view of each layer, to draw into.
    pub layers: Vec<Owned<vk::ImageView>>,
    /// View of all layers: an array for shaders, even with one layer.
    array: Owned<vk::ImageView>,
}

impl LayeredImage {
    /// Cleared, and in the layout in which it is read.
    fn new(
        device: &Arc<Device>,
        plan: &ShadowPlan,
        (name, format, attachment): (&str, vk::Format, vk::ImageUsageFlags),
        (order, layouts): (ClearOrder, [vk::ImageLayout; 2]),
    ) -> gpu::Result<Self> {
        let image = Image::new(
            device,
            &ImageDesc {
                name,
                format,
                extent: vk::Extent2D { width: plan.size, height: plan.size },
                layers: plan.layers,
                usage: attachment | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST,
                location: Location::Device,
                kind: MemoryKind::ShadowMap,
                ..ImageDesc::default()
            },
        )?;
        let range = vk::ImageSubresourceRange {
            aspect_mask: if format == DEPTH { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR },
            level_count: 1,
            layer_count: plan.layers,
            ..Default::default()
        };
        clear::submit(device, (&image, range), order, layouts)?;
        let array = image.view_of(&format!("{name}, all layers"), vk::ImageViewType::TYPE_2D_ARRAY, range)?;
        let layers = (0..plan.layers).map(|layer| image.layer_view(layer)).collect::<gpu::Result<_>>()?;
        Ok(Self { image, layers, array })
    }

    fn attachment(&self, clear: vk::ClearValue) -> MapAttachment<'_> {
        MapAttachment { image: &self.image, views: &self.layers, clear }
    }
}

impl ShadowAtlas {
    /// An empty atlas, which any stage that shades can read.
    pub fn new(
        device: &Arc<Device>,
        plan: &ShadowPlan,
        frames_in_flight: usize,
        orders: ClearOrders,
    ) -> gpu::Result<Self> {
        let depth = ("shadow atlas", DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
        let layouts = orders.layouts;
        let (readable, tinted) = (layouts.of(ATLAS_LAYOUT), layouts.of(TINT_LAYOUT));
        let written = layouts.of(vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let maps = LayeredImage::new(device, plan, depth, (orders.maps, [written, readable]))?;
        let color = ("shadow tints", ShadowPlan::TINT, vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let tints =
            orders.tints.map(|order| LayeredImage::new(device, plan, color, (order, [written, tinted]))).transpose()?;
        let stages = vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE;
        let (texture, uniform) = (vk::DescriptorType::SAMPLED_IMAGE, vk::DescriptorType::UNIFORM_BUFFER);
        let set_layout = SetLayout::new(
            device,
            "shadow set layout",
            &[binding(0, texture, stages), binding(1, uniform, stages), binding(2, texture, stages)],
        )?;
        let count = frames_in_flight as u32;
        let pool = DescriptorPool::new(device, "shadow pool", count, &[(texture, 2 * count), (uniform, count)])?;
        // Shaders name the tints, whether or not they look any up.
        let tint = tints.as_ref().map_or((maps.array.raw, readable), |own| (own.array.raw, tinted));
        let frame = |index| {
            let size = (MAX_SHADOW_VIEWS * size_of::<ShadowRecord>()) as u64;
            let name = format!("shadow maps of frame {index}");
            let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
            let buffer = Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Uniform)?;
            let set = pool.allocate(&format!("shadow set of frame {index}"), set_layout.raw)?;
            SetWriter::new()
                .sampled_image(0, maps.array.raw, readable)
                .uniform_buffer(1, &buffer, buffer.size)
                .sampled_image(2, tint.0, tint.1)
                .update(device, set);
            Ok((buffer, set))
        };
        let frames = (0..frames_in_flight).map(frame).collect::<gpu::Result<_>>()?;
        Ok(Self { maps, tints, set_layout, frames, _pool: pool })
    }

    /// The maps as attachments.
    pub fn depth(&self) -> MapAttachment<'_> {
        // Reversed depth: infinity.
        let clear = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } };
        self.maps.attachment(clear)
    }

    /// The tints as attachments, if the plan has any.
    pub fn tints(&self) -> Option<MapAttachment<'_>> {
        let clear = vk::ClearValue { color: vk::ClearColorValue { float32: NOTHING_TINTED } };
        self.tints.as_ref().map(|own| own.attachment(clear))
    }

    /// The number of layers of each image.
    pub fn layers(&self) -> usize {
        self.maps.layers.len()
    }

    /// The size of a layer.
    pub fn extent(&self) -> vk::Extent2D {
        self.maps.image.extent
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

/// An image of maps whose layers are drawn into.
pub struct MapAttachment<'a> {
    image: &'a Image,
    /// A view of each layer.
    pub views: &'a [Owned<vk::ImageView>],
    /// The value that a map is cleared to.
    pub clear: vk::ClearValue,
}

impl MapAttachment<'_> {
    /// One layer of the image.
    pub fn layer(&self, layer: usize) -> ImageRange {
        let mut all = ImageRange::from(self.image);
        (all.range.base_array_layer, all.range.layer_count) = (layer as u32, 1);
        all
    }
}

/// The clear that each of the images begins with.
pub mod clear {
    use std::sync::Arc;

    use ash::vk;

    use super::{ClearOrder, NOTHING_TINTED};
    use crate::gpu::sync::Use;
    use crate::gpu::{self, CommandBuffer, Device, Image, barrier};

    /// Clears the whole image.
    pub const WRITE: Use = Use::new(vk::PipelineStageFlags2::CLEAR, vk::AccessFlags2::TRANSFER_WRITE);

    /// Clears all maps to "nothing is there" and takes them to the layout in which they are read.
    pub(super) fn submit(
        device: &Arc<Device>,
        (image, range): (&Image, vk::ImageSubresourceRange),
        order: ClearOrder,
        [cleared, readable]: [vk::ImageLayout; 2],
    ) -> gpu::Result<()> {
        let mut cmd = CommandBuffer::new(device, "clear shadow maps")?;
        cmd.begin_by(order.sync)?;
        barrier::image_barrier(device, cmd.raw, image, order.clear, [vk::ImageLayout::UNDEFINED, cleared]);
        let is_depth = range.aspect_mask == vk::ImageAspectFlags::DEPTH;
        // SAFETY: recording, outside a render pass; the image is in this layout and has the usage.
        unsafe {
            if is_depth {
                let far = vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 };
                device.raw.cmd_clear_depth_stencil_image(cmd.raw, image.raw, cleared, &far, &[range]);
            } else {
                let clear = vk::ClearColorValue { float32: NOTHING_TINTED };
                device.raw.cmd_clear_color_image(cmd.raw, image.raw, cleared, &clear, &[range]);
            }
        }
        barrier::image_barrier(device, cmd.raw, image, order.look_up, [cleared, readable]);
        cmd.end()?;
        device.submit(&cmd)?;
        Ok(())
    }
}
