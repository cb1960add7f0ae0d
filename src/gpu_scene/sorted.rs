//! Indices of transparent triangles from back to front, written anew for each frame.

use std::sync::Arc;

use ash::vk;

use crate::gpu::{self, Buffer, Device, Location, MemoryKind};
use crate::plan::World;

/// The index buffer of one frame in flight.
pub struct SortedIndices {
    buffer: Buffer,
}

impl SortedIndices {
    /// With room for all that may be seen; `None` where nothing is sorted.
    ///
    /// # Errors
    /// When the device has no memory for it.
    pub fn new(device: &Arc<Device>, index: usize, world: &World) -> gpu::Result<Option<Self>> {
        let sorted =
            world.objects.iter().filter(|object| object.transparent && world.sortable.contains_key(&object.mesh));
        let triangles: usize = sorted.map(|object| object.triangles).sum();
        if triangles == 0 {
            return Ok(None);
        }
        let name = format!("sorted indices of frame {index}");
        let (size, usage) = (triangles as u64 * 12, vk::BufferUsageFlags::INDEX_BUFFER);
        let buffer = Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Geometry)?;
        Ok(Some(Self { buffer }))
    }

    pub fn raw(&self) -> vk::Buffer {
        self.buffer.raw
    }

    /// Writes this frame's order. The frame that used the buffer before must be done.
    ///
    /// # Errors
    /// When mapped memory cannot be flushed.
    pub fn write(&self, indices: &[u32]) -> gpu::Result<()> {
        self.buffer.write(0, indices)
    }
}
