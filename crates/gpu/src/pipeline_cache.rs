//! The pipeline cache of a device. With the feature `caches` it is kept from run to run; without, it begins empty and is gone with the device.

#[cfg(feature = "caches")]
mod cache_file;

use ash::vk;

#[cfg(feature = "caches")]
pub use cache_file::DriverHeader;

#[cfg(not(feature = "caches"))]
use super::physical::PhysicalDevice;

/// A device's pipeline cache.
pub(super) struct PipelineCache {
    /// Null if the driver could not make one.
    pub(super) raw: vk::PipelineCache,
    #[cfg(feature = "caches")]
    cache_file: cache_file::CacheFile,
}

impl PipelineCache {
    /// Makes an empty cache.
    #[cfg(not(feature = "caches"))]
    pub(super) fn open(device: &ash::Device, _: &PhysicalDevice) -> PipelineCache {
        // SAFETY: the device is alive.
        let created = unsafe { device.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) };
        PipelineCache { raw: created.unwrap_or_default() }
    }

    /// Destroys the cache. No pipeline is being made with it, now or later.
    pub(super) fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller's promise; destroying null does nothing.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}
