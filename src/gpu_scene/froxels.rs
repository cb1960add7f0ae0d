//! The buffer of the fog's froxels, which frames in flight share.

use std::sync::Arc;

use ash::vk;

use crate::gpu::{self, Buffer, Device, Location, MemoryKind};
use crate::plan::FramePlan;

/// None where the plan has no froxels.
///
/// # Errors
/// When the device lacks the memory.
pub fn froxel_buffer(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<Option<Buffer>> {
    let Some(own) = plan.froxels() else { return Ok(None) };
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    Buffer::new(device, "froxels of fog", own.bytes(), usage, Location::Device, MemoryKind::Attachment).map(Some)
}
