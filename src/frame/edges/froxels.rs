//! The rows of the fog's froxels: SCATTER, INTEGRATE and all passes in fog share one buffer, which all frames in flight have in common.

use super::{Carrier, Edge, Place, RowName, row};
use crate::passes::{FROXEL_READ, fog, integrate, scatter};

impl RowName {
    /// Lets the last frame look its froxels up before SCATTER writes anew.
    pub const FROXELS_REUSE: Self = Self("froxels-reuse");
    pub(crate) const SCATTER_TO_INTEGRATE: Self = Self("scatter-to-integrate");
    pub(crate) const FROXELS_TO_FOG: Self = Self("froxels-to-fog");
}

pub(super) fn rows() -> [Edge; 3] {
    [
        row(RowName::FROXELS_REUSE, Carrier::BufferBarrier)
            // Readers already wait for the earlier writes, so waiting for the readers covers it.
            .from(Place::OUTSIDE, &[FROXEL_READ])
            .to(scatter::PASS.place, &[scatter::LIGHT_WRITE])
            .because("frames share the froxels: FOG, TRANSPARENT and PARTICLES of the last one may still look up what SCATTER overwrites"),
        row(RowName::SCATTER_TO_INTEGRATE, Carrier::BufferBarrier)
            .from(scatter::PASS.place, &[scatter::LIGHT_WRITE])
            .to(integrate::PASS.place, &[integrate::LIGHT_READ, integrate::SUM_WRITE])
            .because("INTEGRATE adds up the light that SCATTER wrote, and writes its sums beside it"),
        row(RowName::FROXELS_TO_FOG, Carrier::BufferBarrier)
            .from(integrate::PASS.place, &[integrate::SUM_WRITE])
            .to(fog::PASS.place, &[FROXEL_READ])
            .because("FOG, and what is transparent after it, look up the light and the sums of their places"),
    ]
}
