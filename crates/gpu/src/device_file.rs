//! Files that are one device's and one driver's, on disk from run to run. A fault in one costs time later and is never an error of its reader.
//!
//! An environment variable names the folder of each kind (empty: no file); without it, the files are in the user's cache. A file's content stands
//! behind a header with length and checksum: drivers check their own header, but not all of them survive a file that is cut off or damaged behind it.

use std::env;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::physical::PhysicalDevice;
use afterlight_files::regular_file::read_regular;
use afterlight_files::user_cache::user_cache;
use afterlight_files::whole_file::WholeFile;

const MAGIC: [u8; 8] = *b"AFTLPC01";
/// Magic, length (u64) and checksum (u64), little-endian.
pub(super) const HEADER_BYTES: usize = 24;
/// A larger file is not read: it is not ours, or reading it would take longer than it saves.
pub(super) const MOST_BYTES: u64 = 256 << 20;

/// A kind of file that a device has.
#[derive(Debug, Clone, Copy)]
pub(super) struct FileKind {
    /// The beginning of their names.
    pub name: &'static str,
    /// The variable that names their folder.
    pub variable: &'static str,
}

/// The driver's pipeline cache.
pub(super) const PIPELINES: FileKind = FileKind { name: "pipelines", variable: "AFTERLIGHT_PIPELINE_CACHE" };
/// The measured figures of the device.
pub(super) const CALIBRATION: FileKind = FileKind { name: "calibration", variable: "AFTERLIGHT_CALIBRATION" };

impl FileKind {
    fn folder(self) -> Option<PathBuf> {
        if let Some(dir) = env::var_os(self.variable) {
            return (!dir.is_empty()).then(|| PathBuf::from(dir));
        }
        user_cache()
    }

    /// A place for each device and driver, so that two of them on one machine do not push each other out.
    pub(super) fn place_in(self, folder: &Path, physical: &PhysicalDevice) -> PathBuf {
        let uuid: String = physical.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        folder.join(format!(
            "{}-{:08x}-{:08x}-{:08x}-{uuid}.bin",
            self.name, physical.vendor_id, physical.device_id, physical.driver_version
        ))
    }

    /// The file's path; `None` if the variable is empty or the user has no cache.
    pub(super) fn place(self, physical: &PhysicalDevice) -> Option<PathBuf> {
        Some(self.place_in(&self.folder()?, physical))
    }
}

/// Returns a file's content, if it is there and whole.
pub(super) fn read(file: &Path) -> Option<Vec<u8>> {
    decode(read_regular(file, MOST_BYTES).ok()?)
}

/// Returns the content of a file's bytes, if they are whole. Needs the feature `caches`.
pub fn decode(mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    let number = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
    let (length, sum) = (number(8)?, number(16)?);
    if !bytes.starts_with(&MAGIC) {
        return None;
    }
    let data = bytes.split_off(HEADER_BYTES);
    (data.len() as u64 == length && checksum(&data) == sum).then_some(data)
}

/// The bytes of a file that holds this. Needs the feature `caches`.
pub fn encode(data: &[u8]) -> Vec<u8> {
    [&MAGIC, &(data.len() as u64).to_le_bytes()[..], &checksum(data).to_le_bytes(), data].concat()
}

/// Checks that the file can be written: to try is the only way to know.
pub(super) fn check(file: &Path) -> io::Result<()> {
    let Some(dir) = file.parent() else { return Ok(()) };
    fs::create_dir_all(dir)?;
    WholeFile::begin_in(dir).map(drop)
}

/// Replaces the file, whole or not at all.
pub(super) fn write(file: &Path, data: &[u8]) -> io::Result<()> {
    let Some(dir) = file.parent() else { return Ok(()) };
    fs::create_dir_all(dir)?;
    // Renamed into place when it is whole, so that a reader sees the old file or the new one.
    let mut temporary = WholeFile::begin_in(dir)?;
    temporary.write_all(&encode(data))?;
    temporary.persist(file)
}

/// FNV-1a, 64 bits: against damage, not against malice.
pub(super) fn checksum(data: &[u8]) -> u64 {
    data.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back_and_damage_is_noticed() -> io::Result<()> {
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
}
