//! The rows of AO and AO_DENOISE, between the pass that stores the G-buffer and the light.

use ash::vk;

use super::{Carrier, Edge, Place, RowName, barrier, particles, row};
use crate::frame::list::{GBUFFER_PASS, MAIN_PASS};
use crate::gpu::sync::Use;
use crate::passes::{ao, ao_denoise, geometry, lighting, tiled, transparent};
use crate::plan::FramePlan;

impl RowName {
    pub(crate) const GBUFFER_TO_AO: Self = Self("gbuffer-to-ao");
    pub(crate) const VISIBILITY_REUSE: Self = Self("visibility-reuse");
    pub(crate) const VISIBILITY_TO_DENOISE: Self = Self("visibility-to-denoise");
    pub(crate) const OCCLUSION_TO_LIGHTING: Self = Self("occlusion-to-lighting");
    pub(crate) const AO_TO_TRANSPARENT: Self = Self("ao-to-transparent");
    pub(crate) const OCCLUSION_TO_TILED: Self = Self("occlusion-to-tiled");
}

/// All but the row to LIGHTING, which [`to_lighting`] makes.
pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    let readable = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
    let stored = Carrier::Subpass(if plan.is_tiled() { MAIN_PASS } else { GBUFFER_PASS });
    let mut rows = vec![
        row(RowName::GBUFFER_TO_AO, stored)
            .from(geometry::PASS.place, &[geometry::DEPTH_STORE, geometry::COLOR_WRITE])
            .to(ao::PASS.place, &[ao::GBUFFER_READ, ao_denoise::ALBEDO_BLEND])
            .because("AO reads the depth and the normals that GEOMETRY stored, and AO_DENOISE writes its occlusion"),
        barrier(RowName::VISIBILITY_REUSE, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL)
            .from(Place::OUTSIDE, &[ao_denoise::VISIBILITY_READ])
            .to(ao::PASS.place, &[ao::VISIBILITY_WRITE])
            .because("frames in flight share it: AO_DENOISE of the last frame may still read what this one overwrites"),
        barrier(RowName::VISIBILITY_TO_DENOISE, vk::ImageLayout::GENERAL, readable)
            .from(ao::PASS.place, &[ao::VISIBILITY_WRITE])
            .to(ao_denoise::PASS.place, &[ao_denoise::VISIBILITY_READ])
            .because("AO_DENOISE reads what AO found around each pixel"),
    ];
    if plan.is_tiled() {
        rows.push(
            barrier(RowName::OCCLUSION_TO_TILED, vk::ImageLayout::GENERAL, readable)
                .from(ao_denoise::PASS.place, &[ao_denoise::ALBEDO_BLEND])
                .to(tiled::PASS.place, &[tiled::GBUFFER_READ])
                .because("TILED reads the albedo, in which AO_DENOISE wrote the occlusion"),
        );
    }
    // Where reflections read depth after LIGHTING, FOG and TRANSPARENT wait for them instead.
    if plan.has_fog() && !plan.reflects() {
        rows.push(super::fog::after_ao(plan));
    }
    if plan.transparency.is_some() && !plan.reflects() {
        let row = row(RowName::AO_TO_TRANSPARENT, Carrier::Subpass(MAIN_PASS));
        let depth = [transparent::DEPTH_READ, transparent::DEPTH_DROP];
        let depth: Vec<_> = depth.into_iter().chain(particles::depth(plan)).collect();
        rows.push(
            row.from(ao_denoise::PASS.place, &[ao::GBUFFER_READ])
                .to(transparent::PASS.place, &depth)
                .because("TRANSPARENT tests against the depth that AO read, and as its last user drops it"),
        );
    }
    rows
}

/// Replaces the row from GEOMETRY: AO's wait made GEOMETRY's stores available, and this row makes them visible to LIGHTING. `uses` are those of
/// LIGHTING.
pub(super) fn to_lighting(uses: &[Use]) -> Edge {
    row(RowName::OCCLUSION_TO_LIGHTING, Carrier::Subpass(MAIN_PASS))
        .from(ao_denoise::PASS.place, &[ao_denoise::ALBEDO_BLEND])
        .to(lighting::PASS.place, uses)
        .because(
            "LIGHTING reads the albedo, in which AO_DENOISE wrote the occlusion, and all else that GEOMETRY stored; as the last user it drops that",
        )
}
