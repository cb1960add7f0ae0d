//! The rows of deformed vertices.

use super::{Carrier, Edge, Place, RowName, row};
use crate::gpu_scene::VERTEX_READ;
use crate::passes::skin;

impl RowName {
    /// Lets the last frame's draws fetch their vertices before SKIN writes them anew.
    pub const DEFORMED_REUSE: Self = Self("deformed-reuse");
    pub(crate) const SKIN_TO_DRAWS: Self = Self("skin-to-draws");
}

pub(super) fn rows() -> [Edge; 2] {
    [
        row(RowName::DEFORMED_REUSE, Carrier::BufferBarrier)
            // Readers already wait for what SKIN wrote before, so waiting for the readers covers it.
            .from(Place::OUTSIDE, &[VERTEX_READ])
            // Where SKIN reads the vertices that it wrote last, a row to TAA has made them visible to compute, with everything that draws had waited
            // for.
            .to(skin::PASS.place, &[skin::VERTEX_WRITE])
            .because("frames share the deformed vertices: draws of the last one may still fetch what SKIN overwrites"),
        row(RowName::SKIN_TO_DRAWS, Carrier::BufferBarrier)
            .from(skin::PASS.place, &[skin::VERTEX_WRITE])
            .to(Place::DRAWS, &[VERTEX_READ])
            .because(
                "draws fetch the vertices that SKIN wrote, in this frame and in those after it with the same pose",
            ),
    ]
}
