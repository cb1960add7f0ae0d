//! Figures of a device that are kept from run to run, in a [device's file](crate::device_file).

use std::io;
use std::path::PathBuf;

use super::PhysicalDevice;
use crate::device_file::{CALIBRATION, check, read, write};

/// Figures that are kept from run to run, which needs the feature `caches`.
impl PhysicalDevice {
    /// With the data that [`PhysicalDevice::keep_calibration`] has kept by now.
    pub fn with_calibration(self) -> PhysicalDevice {
        let calibration = CALIBRATION.place(&self).as_deref().and_then(read);
        PhysicalDevice { calibration, ..self }
    }

    /// Returns the path that [`PhysicalDevice::keep_calibration`] will write: `calibration-...` in `AFTERLIGHT_CALIBRATION`, else in `afterlight` in
    /// the user's cache.
    ///
    /// # Errors
    /// When nothing can be written there, or there is no place for it.
    pub fn calibration_place(&self) -> io::Result<PathBuf> {
        let place = CALIBRATION.place(self).ok_or_else(|| io::Error::other("there is no folder for them"))?;
        check(&place)?;
        Ok(place)
    }

    /// Keeps measurements of the device for later runs.
    ///
    /// # Errors
    /// As [`PhysicalDevice::calibration_place`].
    pub fn keep_calibration(&self, measured: &[u8]) -> io::Result<PathBuf> {
        let place = self.calibration_place()?;
        write(&place, measured)?;
        Ok(place)
    }
}
