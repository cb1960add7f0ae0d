//! A device's figures, kept from run to run: `afterlight_lab::report::calibrate` measures them, and plans choose by them. This module needs
//! the feature `caches`.

use std::io;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::gpu::PhysicalDevice;
use crate::plan::{ABSENT, Basis, COMPARED, CostModel, CullingCost, PathCost};

/// The file's layout. Files of another layout or of another version of the program are ignored.
const LAYOUT: u32 = 1;

/// The measured figures of one device and driver.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    layout: u32,
    /// The program's version.
    version: String,
    /// Somebody asked for it: it then also decides between pictures that differ in their last digits.
    pub asked: bool,
    /// One entry for each of [`COMPARED`]; `None` where the device cannot take the path.
    pub paths: [Option<PathCost>; COMPARED.len()],
    /// `None` on CPU devices, on which the two ways take the same within what can be measured.
    pub culling: Option<CullingCost>,
}

impl Calibration {
    /// Makes a calibration of this version of the program.
    pub fn new(asked: bool, paths: [Option<PathCost>; COMPARED.len()], culling: Option<CullingCost>) -> Self {
        Self { layout: LAYOUT, version: env!("CARGO_PKG_VERSION").into(), asked, paths, culling }
    }

    /// Reads the figures that an earlier run of this version has kept.
    pub fn of(device: &PhysicalDevice) -> Option<Self> {
        let kept: Self = serde_json::from_slice(device.calibration.as_deref()?).ok()?;
        (kept.layout == LAYOUT && kept.version == env!("CARGO_PKG_VERSION")).then_some(kept)
    }

    /// Writes the figures to a file for later runs, and returns its path. Figures that nobody asked for do not replace figures that were asked for.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn keep(&self, device: &PhysicalDevice) -> io::Result<PathBuf> {
        let now = device.clone().with_calibration();
        if !self.asked && Self::of(&now).is_some_and(|kept| kept.asked) {
            return device.calibration_place();
        }
        device.keep_calibration(&serde_json::to_vec(self)?)
    }

    /// The figures for plans.
    pub fn costs(&self, software: bool) -> CostModel {
        let kind = CostModel::of_kind(software);
        let basis = if self.asked { Basis::Asked } else { Basis::Unasked };
        let paths = self.paths.map(|cost| cost.unwrap_or(ABSENT));
        CostModel { basis, paths, culling: self.culling.unwrap_or(kind.culling) }
    }
}
