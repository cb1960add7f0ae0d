//! The pipeline cache on disk: the driver's data, in a [device's file](crate::device_file). A fault here costs time later and is never an error.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use ash::vk;

use super::PipelineCache;
use crate::PhysicalDevice;
use crate::device_file::{HEADER_BYTES, MOST_BYTES, PIPELINES, checksum, read, write};

/// `VkPipelineCacheHeaderVersionOne`: length, version, vendor and device (u32 each), then the UUID.
const DRIVER_HEADER_BYTES: usize = 16 + vk::UUID_SIZE;

/// The file behind a pipeline cache.
pub(super) struct CacheFile {
    file: Option<PathBuf>,
    /// The checksum of the file's content.
    on_disk: Mutex<Option<u64>>,
}

impl PipelineCache {
    pub(crate) fn open(device: &ash::Device, physical: &PhysicalDevice) -> PipelineCache {
        PipelineCache::open_as(device, physical, PIPELINES.place(physical))
    }

    fn open_as(device: &ash::Device, physical: &PhysicalDevice, file: Option<PathBuf>) -> PipelineCache {
        let own = DriverHeader::of(physical);
        let data = file.as_deref().and_then(read).filter(|data| own.begins(data));
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device is alive; the data is what this driver wrote, as its header and our checksum say.
            unsafe { device.create_pipeline_cache(&info, None) }
        };
        let created = create(data.as_deref().unwrap_or_default()).or_else(|_| create(&[]));
        let kept = CacheFile { file, on_disk: Mutex::new(data.as_deref().map(checksum)) };
        PipelineCache { raw: created.unwrap_or_default(), cache_file: kept }
    }

    /// Replaces the file, whole or not at all, if the cache holds anything else than it does.
    pub(crate) fn save(&self, device: &ash::Device) {
        let Some(file) = &self.cache_file.file else { return };
        if self.raw == vk::PipelineCache::null() {
            return;
        }
        // SAFETY: the cache belongs to this device and is alive.
        let Ok(data) = (unsafe { device.get_pipeline_cache_data(self.raw) }) else { return };
        let mut on_disk = self.cache_file.on_disk.lock().unwrap_or_else(PoisonError::into_inner);
        let sum = checksum(&data);
        // A driver that caches elsewhere returns its header only; a file of that would tell nothing.
        // One that is too large would not be read again.
        let fits = (DRIVER_HEADER_BYTES + 1..=MOST_BYTES as usize - HEADER_BYTES).contains(&data.len());
        let is_new = fits && *on_disk != Some(sum);
        if is_new && write(file, &data).is_ok() {
            *on_disk = Some(sum);
        }
    }
}

/// The names in the driver's own header (Vulkan 1.3, section 10.7.4). They need the feature `caches`.
#[derive(Debug, Clone, Copy)]
pub struct DriverHeader {
    /// The number of the device's vendor.
    pub vendor: u32,
    /// The vendor's number of the device.
    pub device: u32,
    /// The identifier of the driver and its version.
    pub uuid: [u8; vk::UUID_SIZE],
}

impl DriverHeader {
    fn of(physical: &PhysicalDevice) -> Self {
        Self { vendor: physical.vendor_id, device: physical.device_id, uuid: physical.pipeline_cache_uuid }
    }

    /// Returns true if data of a driver begins so.
    pub fn begins(&self, data: &[u8]) -> bool {
        let number = |at: usize| data.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_ne_bytes);
        number(0).is_some_and(|length| length as usize >= DRIVER_HEADER_BYTES)
            && number(4) == Some(vk::PipelineCacheHeaderVersion::ONE.as_raw().cast_unsigned())
            && number(8) == Some(self.vendor)
            && number(12) == Some(self.device)
            && data.get(16..DRIVER_HEADER_BYTES) == Some(&self.uuid[..])
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{Device, DeviceChoice, Instance, InstanceOptions};

    #[test]
    fn a_corrupt_or_foreign_file_is_ignored() -> Result<(), Box<dyn std::error::Error>> {
        let instance = Instance::new(&InstanceOptions::default())?;
        let device = Device::new(&instance, &DeviceChoice::Auto)?;
        let dir = tempfile::tempdir()?;
        let file = PIPELINES.place_in(dir.path(), &device.physical);
        // Whole by our header, but of another device by the driver's.
        let mut foreign = vec![0_u8; 64];
        foreign[0] = 32;
        foreign[4] = 1;
        write(&file, &foreign)?;
        for content in [None, Some(&b""[..]), Some(&b"AFTLPC01"[..]), Some(&[0xff; 1000][..])] {
            if let Some(content) = content {
                fs::write(&file, content)?;
            }
            let cache = PipelineCache::open_as(&device.raw, &device.physical, Some(file.clone()));
            assert_ne!(cache.raw, vk::PipelineCache::null());
            assert_eq!(*cache.cache_file.on_disk.lock().unwrap_or_else(PoisonError::into_inner), None);
            cache.destroy(&device.raw);
        }
        Ok(())
    }

    #[test]
    fn a_directory_that_cannot_be_written_is_no_error() -> Result<(), Box<dyn std::error::Error>> {
        let instance = Instance::new(&InstanceOptions::default())?;
        let device = Device::new(&instance, &DeviceChoice::Auto)?;
        let dir = tempfile::tempdir()?;
        let not_a_directory = dir.path().join("file");
        fs::write(&not_a_directory, b"")?;
        let cache = PipelineCache::open_as(&device.raw, &device.physical, Some(not_a_directory.join("cache.bin")));
        cache.save(&device.raw);
        cache.destroy(&device.raw);
        Ok(())
    }
}
