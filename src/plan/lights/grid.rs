//! Froxels: tiles of the picture, cut into slices of depth. Each has a list of lights in a frame that bins them.

/// `TILE` is the edge of a tile in pixels. The last of `SLICES` reaches to infinity: 16 octaves, 65536 times the near plane.
pub use crate::shaders::shared::clusters::{SLICES, TILE};

/// The froxels of one picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    pub columns: u32,
    pub rows: u32,
}

impl Grid {
    pub fn of(size: [u32; 2]) -> Self {
        Self { columns: size[0].div_ceil(TILE), rows: size[1].div_ceil(TILE) }
    }

    pub fn clusters(self) -> usize {
        self.columns as usize * self.rows as usize * SLICES as usize
    }
}
