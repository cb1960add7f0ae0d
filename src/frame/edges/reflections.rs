//! The rows of HIZ, REFLECT and REFLECT_RESOLVE, between the main pass, which stores the G-buffer and the light, and the blend pass, which goes on from them.

use ash::vk;

use super::main_pass::output_reader;
use super::{Carrier, Edge, Place, RowName, barrier, particles, row};
use crate::frame::list::{BLEND_PASS, MAIN_PASS};
use crate::gpu::sync::Use;
use crate::passes::{composite, hiz, lighting, reflect, reflect_resolve, tonemap, transparent};
use crate::plan::FramePlan;
use crate::scene::Transparency;

impl RowName {
    pub(crate) const LIGHTING_TO_HIZ: Self = Self("lighting-to-hiz");
    pub(crate) const HIZ_REUSE: Self = Self("hiz-reuse");
    pub(crate) const HIZ_TO_REFLECT: Self = Self("hiz-to-reflect");
    pub(crate) const RAYS_REUSE: Self = Self("rays-reuse");
    pub(crate) const RAYS_TO_RESOLVE: Self = Self("rays-to-resolve");
    pub(crate) const LIGHT_TO_RESOLVE: Self = Self("light-to-resolve");
    pub(crate) const RESOLVE_TO_TRANSPARENT: Self = Self("resolve-to-transparent");
    pub(crate) const RESOLVE_TO_COMPOSITE: Self = Self("resolve-to-composite");
}

/// All but those of the passes after them, which [`to_transparent`] and [`in_blend_pass`] make. `light` is how LIGHTING writes the light.
pub(super) fn rows(light: Use) -> Vec<Edge> {
    let (new, written, readable) =
        (vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    vec![
        row(RowName::LIGHTING_TO_HIZ, Carrier::Subpass(MAIN_PASS))
            .from(lighting::PASS.place, &[light, lighting::COLOR_DROP, lighting::DEPTH_DROP])
            .to(hiz::PASS.place, &[hiz::GBUFFER_READ])
            .because("HIZ reads the depth that the main pass stores, and REFLECT behind it the G-buffer and the light of all pixels"),
        barrier(RowName::HIZ_REUSE, new, written)
            .from(Place::OUTSIDE, &[reflect::HIZ_READ])
            .to(hiz::PASS.place, &[hiz::HIZ_WRITE])
            .because("frames in flight share the pyramid: REFLECT of the last frame may still read what this one overwrites"),
        barrier(RowName::HIZ_TO_REFLECT, written, readable)
            .from(hiz::PASS.place, &[hiz::HIZ_WRITE])
            .to(reflect::PASS.place, &[reflect::HIZ_READ])
            .because("REFLECT reads squares that other work groups of HIZ wrote"),
        barrier(RowName::RAYS_REUSE, new, written)
            .from(Place::OUTSIDE, &[reflect_resolve::RAYS_READ])
            .to(reflect::PASS.place, &[reflect::RAYS_WRITE])
            .because("frames in flight share it: REFLECT_RESOLVE of the last frame may still read what this one overwrites"),
        barrier(RowName::RAYS_TO_RESOLVE, written, readable)
            .from(reflect::PASS.place, &[reflect::RAYS_WRITE])
            .to(reflect_resolve::PASS.place, &[reflect_resolve::RAYS_READ])
            .because("REFLECT_RESOLVE reads what rays found around each pixel"),
        barrier(RowName::LIGHT_TO_RESOLVE, readable, written)
            .from(reflect::PASS.place, &[reflect::LIGHT_READ])
            .to(reflect_resolve::PASS.place, &[reflect_resolve::LIGHT_BLEND])
            .because("REFLECT must have read the light of all pixels before REFLECT_RESOLVE adds to it; its layout changes in between"),
    ]
}

/// These stand in the place of the rows from LIGHTING, and of those by which the blend pass's first subpass waits for the last frame.
pub(super) fn to_transparent(plan: &FramePlan, transparency: Transparency) -> Vec<Edge> {
    let row = |name| row(name, Carrier::Subpass(BLEND_PASS));
    let (resolve, light) = (reflect_resolve::PASS.place, reflect_resolve::LIGHT_BLEND);
    let depth: Vec<Use> =
        [transparent::DEPTH_READ, transparent::DEPTH_DROP].into_iter().chain(particles::depth(plan)).collect();
    let with = |last: Use| [&depth[..], &[last]].concat();
    match transparency {
        Transparency::Sorted if plan.has_fog() => vec![
            row(RowName::RESOLVE_TO_TRANSPARENT)
                .from(resolve, &[hiz::GBUFFER_READ])
                .to(transparent::PASS.place, &depth)
                .because("TRANSPARENT tests against the depth that REFLECT_RESOLVE read, and as the last user drops it"),
        ],
        Transparency::Sorted => vec![
            row(RowName::RESOLVE_TO_TRANSPARENT)
                .from(resolve, &[light])
                .to(transparent::PASS.place, &with(transparent::BLEND))
                .because(
                    "TRANSPARENT blends over what REFLECT_RESOLVE wrote, tests against the depth that it read, and as the last user drops that",
                ),
        ],
        Transparency::Oit => {
            // TAA and BLOOM have waited for COMPOSITE of the last frame, and are compute as well.
            let sums = (plan.bloom.is_none() && plan.taa.is_none()).then_some(composite::SUM_DROP);
            let before: Vec<Use> = [hiz::GBUFFER_READ].into_iter().chain(sums).collect();
            let mut rows = vec![
                row(RowName::RESOLVE_TO_TRANSPARENT)
                    .from(resolve, &before)
                    .to(transparent::PASS.place, &with(transparent::SUM_CLEAR))
                    .because(
                        "TRANSPARENT tests against the depth that REFLECT_RESOLVE read, and as the last user drops it; and COMPOSITE of the last frame \
                         must have dropped the sums that this one clears",
                    ),
            ];
            let to_composite = row(RowName::RESOLVE_TO_COMPOSITE)
                .from(resolve, &[light])
                .to(composite::PASS.place, &[composite::LIGHT_BLEND])
                .because("COMPOSITE blends over what REFLECT_RESOLVE wrote");
            rows.extend((!plan.has_fog()).then_some(to_composite));
            rows
        }
    }
}

/// TONEMAP behind REFLECT_RESOLVE, where nothing is blended in between.
pub(super) fn to_tonemap(plan: &FramePlan) -> Edge {
    row(RowName::HDR_TO_TONEMAP, Carrier::Subpass(BLEND_PASS))
        .from(reflect_resolve::PASS.place, &[reflect_resolve::LIGHT_BLEND, output_reader(plan)])
        .to(
            tonemap::PASS.place,
            &[tonemap::HDR_LOAD, tonemap::HDR_READ, tonemap::HDR_DROP, tonemap::OUTPUT_WRITE],
        )
        .because(
            "TONEMAP loads and reads the light to which REFLECT_RESOLVE has added and as the last user drops it, and the last picture may still be \
             read when this one is drawn",
        )
}

/// The rows of subpasses that come after reflections are those of the blend pass.
pub(super) fn in_blend_pass(plan: &FramePlan, row: Edge) -> Edge {
    let before = row.to == lighting::PASS.place || row.name == RowName::LIGHTING_TO_HIZ;
    match row.carrier {
        Carrier::Subpass(pass) if plan.reflects() && pass == MAIN_PASS && !before => {
            Edge { carrier: Carrier::Subpass(BLEND_PASS), ..row }
        }
        _ => row,
    }
}
