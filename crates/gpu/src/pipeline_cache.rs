//! The pipeline cache of a device.

mod kept;

use std::path::PathBuf;
use std::sync::Mutex;

use ash::vk;

pub use kept::DriverHeader;

/// A device's pipeline cache and the file behind it.
pub(super) struct PipelineCache {
    /// Null if the driver could not make one.
    pub(super) raw: vk::PipelineCache,
    file: Option<PathBuf>,
    /// The checksum of the file's content.
    on_disk: Mutex<Option<u64>>,
}

impl PipelineCache {
    /// Destroys the cache. No pipeline is being made with it, now or later.
    pub(super) fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller's promise; destroying null does nothing.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}
