//! COPY: the output into memory that the CPU reads.

use std::sync::Arc;

use ash::vk;

use super::{Endpoint, Pass, Presence, Resource, ResourceUse, UseKind, shown};
use crate::gpu::{
    self, Buffer, Device, Location, MemoryKind,
    sync::{Layouts, Use},
};
use crate::plan::FramePlan;

/// Reads the output.
pub const READ: Use = Use::new(vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_READ);
/// Writes the buffer.
pub const WRITE: Use = Use::new(vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE);
/// The CPU maps it.
pub const HOST_READ: Use = Use::new(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("COPY"),
    time: "copy",
    what: "brings the picture to the CPU, when one is asked for",
    presence: |_| Presence::In("only when a picture is read back".into()),
    touches: |plan| {
        vec![
            ResourceUse::new(shown(plan), UseKind::CopiedFrom, READ),
            ResourceUse::new(Resource::ReadBack, UseKind::Buffer, WRITE),
        ]
    },
    leave_out: None,
    make: None,
};

/// A buffer for one picture.
pub struct Copy {
    pub buffer: Buffer,
    size: [u32; 2],
}

impl Copy {
    pub fn new(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<Self> {
        let bytes = u64::from(gpu::format_bytes(plan.output)) * u64::from(plan.size[0]) * u64::from(plan.size[1]);
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = Buffer::new(device, "picture", bytes, usage, Location::ReadBack, MemoryKind::ReadBack)?;
        Ok(Self { buffer, size: plan.size })
    }

    /// Copies an image of the plan's size and format, which is in TRANSFER_SRC_OPTIMAL.
    pub fn record(&self, device: &Device, cmd: vk::CommandBuffer, (output, layouts): (vk::Image, Layouts)) {
        let region = vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(vk::Extent3D { width: self.size[0], height: self.size[1], depth: 1 });
        // SAFETY: `cmd` is being recorded outside a render pass; the buffer holds the whole picture.
        unsafe {
            let layout = layouts.of(vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
            device.raw.cmd_copy_image_to_buffer(cmd, output, layout, self.buffer.raw, &[region]);
        }
    }
}
