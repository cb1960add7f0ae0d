//! Indices of transparent triangles from back to front, written anew for each frame.

use std::sync::Arc;

use ash::vk;

use crate::gpu::{self, Buffer, Device, Location, MemoryKind};
use crate::plan::{FramePlan, IndexWidth};

use super::index_type;

/// The index buffer of one frame in flight.
pub struct SortedIndices {
    buffer: Buffer,
    width: IndexWidth,
}

impl SortedIndices {
    /// With room for all that may be seen; `None` where nothing is sorted.
    pub fn new(device: &Arc<Device>, index: usize, plan: &FramePlan) -> gpu::Result<Option<Self>> {
        let Some(width) = plan.meshes.sorted_width else { return Ok(None) };
        let name = format!("sorted indices of frame {index}");
        let (size, usage) = (plan.sorted_index_bytes(), vk::BufferUsageFlags::INDEX_BUFFER);
        let buffer = Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Geometry)?;
        Ok(Some(Self { buffer, width }))
    }

    /// The buffer and the width of its indices.
    pub fn raw(&self) -> (vk::Buffer, vk::IndexType) {
        (self.buffer.raw, index_type(self.width))
    }

    /// Writes this frame's order. The frame that used the buffer before must be done.
    pub fn write(&self, indices: &[u32]) -> gpu::Result<()> {
        match self.width {
            // No transparent mesh has a vertex of a higher number.
            IndexWidth::Bits16 => self.buffer.write(0, &indices.iter().map(|&index| index as u16).collect::<Vec<_>>()),
            IndexWidth::Bits32 => self.buffer.write(0, indices),
        }
    }
}
