//! The pipeline cache on disk. Whatever goes wrong here costs time later and is never an error.
//!
//! One file a device and driver, in `AFTERLIGHT_PIPELINE_CACHE` (empty: no file), else `XDG_CACHE_HOME/afterlight`, else
//! `~/.cache/afterlight`. The file is the driver's data behind a header of our own with length and checksum: drivers
//! check their own header, but not all of them survive a file that is cut off or damaged behind it.

use std::env;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ash::vk;

use super::physical::PhysicalDevice;
use crate::regular_file::read_regular;
use crate::whole_file::WholeFile;

const MAGIC: [u8; 8] = *b"AFTLPC01";
/// Magic, length (u64) and checksum (u64), little-endian.
const HEADER_BYTES: usize = 24;
/// `VkPipelineCacheHeaderVersionOne`: length, version, vendor and device (u32 each), then the UUID.
const DRIVER_HEADER_BYTES: usize = 16 + vk::UUID_SIZE;
/// A larger file is not read: it is not ours, or it would take longer than compiling.
const MOST_BYTES: u64 = 256 << 20;

/// A device's pipeline cache and the file behind it.
pub(super) struct PipelineCache {
    /// Null if the driver could not make one.
    pub(super) raw: vk::PipelineCache,
    file: Option<PathBuf>,
    /// The checksum of what the file holds.
    on_disk: Mutex<Option<u64>>,
}

impl PipelineCache {
    pub(super) fn open(device: &ash::Device, physical: &PhysicalDevice) -> PipelineCache {
        PipelineCache::open_in(device, physical, cache_dir().as_deref())
    }

    fn open_in(device: &ash::Device, physical: &PhysicalDevice, dir: Option<&Path>) -> PipelineCache {
        let file = dir.map(|dir| dir.join(file_name(physical)));
        let own = DriverHeader::of(physical);
        let data = file.as_deref().and_then(read).filter(|data| own.begins(data));
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the device is alive; the data is what this driver wrote, as its header and our checksum say.
            unsafe { device.create_pipeline_cache(&info, None) }
        };
        let created = create(data.as_deref().unwrap_or_default()).or_else(|_| create(&[]));
        PipelineCache { raw: created.unwrap_or_default(), file, on_disk: Mutex::new(data.as_deref().map(checksum)) }
    }

    /// Replaces the file, whole or not at all, if the cache holds anything else than it does.
    pub(super) fn save(&self, device: &ash::Device) {
        let Some(file) = &self.file else { return };
        if self.raw == vk::PipelineCache::null() {
            return;
        }
        // SAFETY: the cache belongs to this device and is alive.
        let Ok(data) = (unsafe { device.get_pipeline_cache_data(self.raw) }) else { return };
        let mut on_disk = self.on_disk.lock().unwrap_or_else(PoisonError::into_inner);
        let sum = checksum(&data);
        // A driver that caches elsewhere returns its header only; a file of that would tell nothing.
        // One that is too large would not be read again.
        let fits = (DRIVER_HEADER_BYTES + 1..=MOST_BYTES as usize - HEADER_BYTES).contains(&data.len());
        let is_new = fits && *on_disk != Some(sum);
        if is_new && write(file, &data).is_ok() {
            *on_disk = Some(sum);
        }
    }

    /// Destroys the cache. No pipeline is being made with it, now or later.
    pub(super) fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller's promise; destroying null does nothing.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

fn cache_dir() -> Option<PathBuf> {
    if let Some(dir) = env::var_os("AFTERLIGHT_PIPELINE_CACHE") {
        return (!dir.is_empty()).then(|| PathBuf::from(dir));
    }
    // The XDG base directory specification: a path that is not absolute is to be ignored.
    let absolute = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")))
        .or_else(|| absolute("LOCALAPPDATA"));
    base.map(|base| base.join("afterlight"))
}

/// A name for each device and driver, so that two of them on one machine do not push each other out.
fn file_name(physical: &PhysicalDevice) -> String {
    let uuid: String = physical.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect();
    format!(
        "pipelines-{:08x}-{:08x}-{:08x}-{uuid}.bin",
        physical.vendor_id, physical.device_id, physical.driver_version
    )
}

/// The driver's data in a file, if the file is there and whole.
fn read(file: &Path) -> Option<Vec<u8>> {
    decode(read_regular(file, MOST_BYTES).ok()?)
}

/// The driver's data in the bytes of a file, if they are whole.
pub fn decode(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let number = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
    let (length, sum) = (number(8)?, number(16)?);
    if !bytes.starts_with(&MAGIC) {
        return None;
    }
    let data = bytes.split_off(HEADER_BYTES);
    (data.len() as u64 == length && checksum(&data) == sum).then_some(data)
}

/// What the driver's own header names (Vulkan 1.3, section 10.7.4).
#[derive(Debug, Clone, Copy)]
pub struct DriverHeader {
    /// The number of the device's vendor.
    pub vendor: u32,
    /// The vendor's number of the device.
    pub device: u32,
    /// Of the driver and its version.
    pub uuid: [u8; vk::UUID_SIZE],
}

impl DriverHeader {
    fn of(physical: &PhysicalDevice) -> Self {
        Self { vendor: physical.vendor_id, device: physical.device_id, uuid: physical.pipeline_cache_uuid }
    }

    /// Whether data of a driver begins so.
    pub fn begins(&self, data: &[u8]) -> bool {
        let number = |at: usize| data.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_ne_bytes);
        number(0).is_some_and(|length| length as usize >= DRIVER_HEADER_BYTES)
            && number(4) == Some(vk::PipelineCacheHeaderVersion::ONE.as_raw().cast_unsigned())
            && number(8) == Some(self.vendor)
            && number(12) == Some(self.device)
            && data.get(16..DRIVER_HEADER_BYTES) == Some(&self.uuid[..])
    }
}

/// The bytes of a file that holds a driver's data.
pub fn encode(data: &[u8]) -> Vec<u8> {
    [&MAGIC, &(data.len() as u64).to_le_bytes()[..], &checksum(data).to_le_bytes(), data].concat()
}

fn write(file: &Path, data: &[u8]) -> std::io::Result<()> {
    let Some(dir) = file.parent() else { return Ok(()) };
    fs::create_dir_all(dir)?;
    // Renamed into place when it is whole, so that a reader sees the old file or the new one.
    let mut temporary = WholeFile::begin_in(dir)?;
    temporary.write_all(&encode(data))?;
    temporary.persist(file)
}

/// FNV-1a, 64 bits: against damage, not against malice.
fn checksum(data: &[u8]) -> u64 {
    data.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Device, DeviceChoice, Instance, InstanceOptions};

    #[test]
    fn what_is_written_is_read_back_and_damage_is_noticed() -> std::io::Result<()> {
        let dir = tempfile::tempdir()?;
        let file = dir.path().join("deeper").join("cache.bin");
        let data = b"what a driver has to say".to_vec();
        write(&file, &data)?;
        assert_eq!(read(&file), Some(data));
        let whole = fs::read(&file)?;
        for length in 0..whole.len() {
            assert_eq!(decode(whole[..length].to_vec()), None, "cut off after {length} bytes");
        }
        for index in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[index] ^= 0x10;
            assert_eq!(decode(damaged), None, "byte {index} damaged");
        }
        Ok(())
    }

    #[test]
    fn a_corrupt_or_foreign_file_is_ignored() -> Result<(), Box<dyn std::error::Error>> {
        let instance = Instance::new(&InstanceOptions::default())?;
        let device = Device::new(&instance, &DeviceChoice::Auto)?;
        let dir = tempfile::tempdir()?;
        let file = dir.path().join(file_name(&device.physical));
        // Whole by our header, but of another device by the driver's.
        let mut foreign = vec![0_u8; 64];
        foreign[0] = 32;
        foreign[4] = 1;
        write(&file, &foreign)?;
        for content in [None, Some(&b""[..]), Some(&b"AFTLPC01"[..]), Some(&[0xff; 1000][..])] {
            if let Some(content) = content {
                fs::write(&file, content)?;
            }
            let cache = PipelineCache::open_in(&device.raw, &device.physical, Some(dir.path()));
            assert_ne!(cache.raw, vk::PipelineCache::null());
            assert_eq!(*cache.on_disk.lock().unwrap_or_else(PoisonError::into_inner), None);
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
        let cache = PipelineCache::open_in(&device.raw, &device.physical, Some(&not_a_directory));
        cache.save(&device.raw);
        cache.destroy(&device.raw);
        Ok(())
    }
}
