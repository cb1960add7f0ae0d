//! `afterlight bench --path`: which moment of a camera path each frame shows.

use std::path::Path;

use afterlight::frame::FrameTimes;
use afterlight::scene::{Camera, CameraPath};
use serde::Serialize;

use crate::failure::Failure;
use crate::workload::Workload;

/// A path that the measured frames are spread over evenly, the first at its start and the last at its end.
pub struct Walk {
    pub file: String,
    path: CameraPath,
    frames: u32,
}

/// One measured frame of a path.
#[derive(Serialize)]
pub struct Moment {
    /// Seconds from the path's start.
    pub at_s: f64,
    pub wall_ms: f64,
    gpu_ms: Option<f64>,
    pub triangles: usize,
}

impl Walk {
    pub fn of(file: &Path, workload: &mut Workload, frames: u32) -> Result<Self, Failure> {
        Ok(Self { file: file.display().to_string(), path: workload.follow(file)?, frames })
    }

    pub fn seconds(&self) -> f64 {
        self.path.seconds()
    }

    /// Returns the camera of the measured frame of this number.
    pub fn camera(&self, index: u32) -> Camera {
        self.path.at(self.at(index))
    }

    /// Returns the row of the measured frame of this number in the table of moments.
    pub fn moment(&self, index: u32, frame: &FrameTimes) -> Moment {
        let triangles = frame.drawn.triangles;
        Moment { at_s: self.at(index), wall_ms: frame.wall_ms, gpu_ms: frame.gpu_ms, triangles }
    }

    fn at(&self, index: u32) -> f64 {
        self.path.seconds() * f64::from(index) / f64::from(self.frames.max(2) - 1)
    }
}
