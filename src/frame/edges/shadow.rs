//! The rows of the shadow maps, and of the clear that their image begins with.

use ash::vk;

use super::{Carrier, Edge, Edges, Place, RowName, barrier, row};
use crate::frame::list::SHADOW_PASS;
use crate::gpu::sync::Use;
use crate::gpu_scene::{ATLAS_LAYOUT, ClearOrder, shadow_clear};
use crate::passes::{forward, lighting, scatter, shadow, simulate, tiled, transparent};
use crate::plan::FramePlan;
use crate::scene::LightPath;

impl RowName {
    pub(crate) const SHADOW_ATLAS_TO_CLEAR: Self = Self("shadow-atlas-to-clear");
    pub(crate) const CLEAR_TO_SHADOW_MAPS: Self = Self("clear-to-shadow-maps");
    /// Lets the last reader of a shadow map finish before SHADOW clears the map.
    pub const SHADOW_MAP_REUSE: Self = Self("shadow-map-reuse");
    pub(crate) const SHADOW_MAP_TO_LIGHTING: Self = Self("shadow-map-to-lighting");
}

const CLEARED: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

pub(super) fn rows(plan: &FramePlan) -> [Edge; 4] {
    let (reader, map_read) = reader(plan);
    // SIMULATE and SCATTER look up as well, by compute.
    let particles = plan.particles.as_ref().map(|_| simulate::MAP_READ);
    let froxels = plan.froxels().map(|_| scatter::MAP_READ);
    let all: Vec<_> = [map_read].into_iter().chain(particles).chain(froxels).collect();
    [
        barrier(RowName::SHADOW_ATLAS_TO_CLEAR, vk::ImageLayout::UNDEFINED, CLEARED)
            .from(Place::OUTSIDE, &[Use::START])
            .to(Place::CLEAR, &[shadow_clear::WRITE])
            .because("the image is new: there is nothing to wait for, but its layout changes before the write"),
        barrier(RowName::CLEAR_TO_SHADOW_MAPS, CLEARED, ATLAS_LAYOUT)
            // SHADOW waits for these readers and so for the clear as well.
            .from(Place::CLEAR, &[shadow_clear::WRITE])
            .to(reader, &all)
            .because("a map that no frame has drawn yet is sampled, or drawn by SHADOW, which waits for samplers"),
        row(RowName::SHADOW_MAP_REUSE, Carrier::Subpass(SHADOW_PASS))
            // Readers already wait for the store, so waiting for the readers covers it.
            .from(Place::OUTSIDE, if waits_for_compute(plan) { &all[..1] } else { &all })
            .to(shadow::PASS.place, &[shadow::MAP_CLEAR])
            .because(
                "frames share the maps: whatever looks maps up in the last one may still read what this one clears; \
                 and maps of one layer follow each other",
            ),
        row(RowName::SHADOW_MAP_TO_LIGHTING, Carrier::Subpass(SHADOW_PASS))
            .from(shadow::PASS.place, &[shadow::MAP_STORE])
            .to(reader, &all)
            .because("whatever looks maps up loads any texel of a map that SHADOW wrote and stored"),
    ]
}

/// Returns true if the fragments that look maps up have waited for all that ran by compute before them: LIGHTING's for AO, and TRANSPARENT's for reflections.
fn waits_for_compute(plan: &FramePlan) -> bool {
    let over_reflections = plan.reflects() && (transparent::PASS.presence)(plan).is_in();
    !plan.is_tiled() && (plan.has_ao() || over_reflections)
}

/// Returns the pass that samples shadow maps, and its use of them.
fn reader(plan: &FramePlan) -> (Place, Use) {
    match plan.light_path {
        LightPath::Compute | LightPath::Visibility => (tiled::PASS.place, tiled::MAP_READ),
        LightPath::Forward | LightPath::ForwardNaive => (forward::PASS.place, forward::MAP_READ),
        _ => (lighting::PASS.place, lighting::MAP_READ),
    }
}

impl Edges {
    /// The rows that the atlas is made with; `None` without shadow maps.
    pub(in crate::frame) fn clear_order(&self) -> Option<ClearOrder> {
        let clear = self.find(RowName::SHADOW_ATLAS_TO_CLEAR)?.order();
        Some(ClearOrder { clear, look_up: self.find(RowName::CLEAR_TO_SHADOW_MAPS)?.order() })
    }
}
