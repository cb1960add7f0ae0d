//! The device, as far as plans depend on it.

use super::CostModel;
use crate::gpu::lack::Support;
use crate::scene::BlockFormat;

/// The device's capabilities that a plan depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities {
    /// Largest edge of an attachment in pixels.
    pub max_extent: u32,
    /// Colour attachments of one subpass.
    pub max_color_attachments: u32,
    /// Input attachments of one subpass.
    pub max_input_attachments: u32,
    /// Layers of an image.
    pub max_layers: u32,
    /// Depth can be clamped instead of clipped.
    pub depth_clamp: bool,
    /// R16G16_UNORM can be a colour attachment; not mandatory in Vulkan.
    pub unorm_2x16_attachment: bool,
    /// R32G32B32A32_SFLOAT and R32_SFLOAT blend; not mandatory in Vulkan.
    pub float32_blends: bool,
    /// B10G11R11_UFLOAT_PACK32 blends; not mandatory in Vulkan.
    pub packed_float_blends: bool,
    /// Samples a pixel that every attachment can have, as bits (2 for 2, 4 for 4), at their standard places and shaded one by one.
    pub msaa: u32,
    /// The sample counts that a compute shader can read one by one, of every attachment.
    pub sampled_msaa: u32,
    /// The sample counts that a compute shader can read one by one, of a target of triangles' numbers, which are integers of 32 bits.
    pub numbered_msaa: u32,
    /// Maximum anisotropy of samplers; 1 if the device has no anisotropic filtering.
    pub anisotropy: u32,
    /// Anisotropic samplers read every texel that a pixel covers, which is slow: shaders take a few samples instead.
    pub slow_anisotropy: bool,
    /// The device reads a buffer once for many invocations if the index comes from push constants.
    pub reads_pushed_places_once: bool,
    /// Shaders are told which triangle of a draw they shade.
    pub primitive_index: bool,
    /// Sampled images that a compute shader can name, by numbers that differ from invocation to invocation; 0 where it cannot do so.
    pub non_uniform_textures: u32,
    /// Sampled images that a shader can name.
    pub sampled_images: u32,
    /// Storage buffers that a compute shader can name.
    pub storage_buffers: u32,
    /// Storage buffers, storage images and colour attachments that a fragment shader can name, all together.
    pub fragment_resources: u32,
    /// Bytes of a storage buffer that a compute shader can see.
    pub storage_range: u32,
    /// The device has lazily allocated memory, for attachments that stay in tile memory.
    pub lazily_allocated: bool,
    /// Invocations of a compute work group.
    pub compute_invocations: u32,
    /// Bytes that the invocations of a compute work group share.
    pub shared_memory: u32,
    /// Compute passes can write the commands that draw instances, many at once.
    pub indirect_draws: bool,
    /// The device is a CPU.
    pub software: bool,
    /// The figures that `auto` chooses by.
    pub costs: CostModel,
    /// Barriers, submissions and dependencies of render passes take finer masks.
    pub synchronization2: Support,
    /// Draws outside of render passes read attachments at their own pixel, and blend states may differ from attachment to attachment.
    pub local_read: Support,
    /// They can read depth.
    pub local_read_depth: bool,
    /// They can read attachments of several samples.
    pub local_read_samples: bool,
    /// Images in the layout GENERAL are as fast as in specialized layouts.
    pub unified_layouts: Support,
    /// A queue that computes and does not draw, with semaphores that count.
    pub compute_queue: Support,
    /// A queue that only copies, likewise.
    pub transfer_queue: Support,
    /// BC7 can be sampled, with linear filtering.
    pub bc7: bool,
    /// Every format of ETC2 can be.
    pub etc2: bool,
}

impl Capabilities {
    /// Returns a device that lacks nothing but tile memory: if it refuses a plan, the settings are the reason.
    pub const fn ample() -> Self {
        Self {
            max_extent: 16384,
            max_layers: 2048,
            depth_clamp: true,
            max_color_attachments: 8,
            max_input_attachments: 8,
            unorm_2x16_attachment: true,
            float32_blends: true,
            packed_float_blends: true,
            msaa: 1 | 2 | 4 | 8,
            sampled_msaa: 1 | 2 | 4 | 8,
            numbered_msaa: 1 | 2 | 4 | 8,
            anisotropy: 16,
            slow_anisotropy: false,
            reads_pushed_places_once: false,
            primitive_index: true,
            non_uniform_textures: 1 << 20,
            sampled_images: 1 << 20,
            storage_buffers: 1 << 20,
            fragment_resources: 1 << 20,
            storage_range: u32::MAX,
            lazily_allocated: false,
            indirect_draws: true,
            software: false,
            costs: CostModel::GPU,
            compute_invocations: 1024,
            shared_memory: 1 << 15,
            synchronization2: Ok(()),
            local_read: Ok(()),
            local_read_depth: true,
            local_read_samples: true,
            unified_layouts: Ok(()),
            compute_queue: Ok(()),
            transfer_queue: Ok(()),
            bc7: true,
            etc2: true,
        }
    }

    /// Returns true if textures can be sampled in this block format.
    pub fn samples(&self, format: BlockFormat) -> bool {
        match format {
            BlockFormat::Bc7 => self.bc7,
            BlockFormat::Etc2Rgb8 | BlockFormat::Etc2Rgb8A1 | BlockFormat::Etc2Rgba8 => self.etc2,
        }
    }
}
