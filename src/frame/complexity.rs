//! The view `complexity` in numbers.

use super::{Picture, Pixels};

/// Pixels of a frame with several samples each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Complexity {
    /// Pixels with a surface in some sample.
    pub covered: usize,
    /// Covered pixels whose samples are shaded one by one.
    pub complex: usize,
}

impl Complexity {
    /// Counts the colours of a picture of the complexity view (`shaders/view.wgsl`): red is 1 where samples differ, blue above 0 on any surface.
    pub fn of(picture: &Picture) -> Self {
        let count = |high: &dyn Fn(usize) -> bool| {
            (0..picture.size[0] as usize * picture.size[1] as usize).filter(|i| high(*i)).count()
        };
        match &picture.pixels {
            Pixels::Srgb8(rgba) => {
                Self { covered: count(&|i| rgba[4 * i + 2] > 0), complex: count(&|i| rgba[4 * i] > 127) }
            }
            Pixels::LinearF32(rgba) => {
                Self { covered: count(&|i| rgba[4 * i + 2] > 0.0), complex: count(&|i| rgba[4 * i] > 0.5) }
            }
        }
    }

    /// Share of complex pixels among the covered ones, 0 to 1.
    pub fn share(&self) -> f64 {
        self.complex as f64 / self.covered.max(1) as f64
    }
}
