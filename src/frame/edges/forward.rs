//! The rows of a frame without a G-buffer, in the place of those of GEOMETRY and LIGHTING.

use super::main_pass::{depth_dropped, dropped_last, is_toned, sums_reuse, sums_to_composite};
use super::{Edge, Place, RowName, particles, subpass};
use crate::frame::list::RESOLVE;
use crate::passes::{composite, copy, forward, fxaa, present, tonemap, transparent};
use crate::plan::{FramePlan, Target};
use crate::scene::Transparency;

impl RowName {
    pub(crate) const FORWARD_TO_TRANSPARENT: Self = Self("forward-to-transparent");
    pub(crate) const FORWARD_TO_COMPOSITE: Self = Self("forward-to-composite");
}

/// FORWARD is the first to touch all that it draws into.
pub(super) fn forward_edge(plan: &FramePlan) -> Edge {
    // The last uses of depth, and of the light, in the last frame.
    let depth = depth_dropped(plan);
    let output = match (plan.fxaa, plan.draws_into_swapchain()) {
        (true, _) => fxaa::OUTPUT_READ,
        (false, true) => present::ATTACH,
        (false, false) => copy::READ,
    };
    let before = match plan.light_target() {
        Target::Hdr => dropped_last(plan, tonemap::HDR_DROP),
        // Samples are resolved into the output. A later subpass writes it, else FORWARD does, and the output's reader has waited for the resolve.
        Target::Samples if plan.transparency.is_some() => dropped_last(plan, RESOLVE),
        Target::Samples if output == present::ATTACH => RESOLVE,
        Target::Samples if is_toned(plan) => output.or(RESOLVE),
        _ => output,
    };
    subpass(RowName::TARGETS_REUSE)
        .from(Place::OUTSIDE, &[depth, before])
        .to(forward::PASS.place, &[forward::DEPTH_CLEAR, forward::LIGHT_WRITE])
        .because(
            "frames in flight share the targets: the last frame must have read or copied what this one clears, \
             and dropped the rest",
        )
}

pub(super) fn transparent_after_forward(plan: &FramePlan, transparency: Transparency) -> Vec<Edge> {
    let depth = [transparent::DEPTH_READ, transparent::DEPTH_DROP];
    let depth: Vec<_> = depth.into_iter().chain(particles::depth(plan)).collect();
    let (from, light) = (forward::PASS.place, forward::LIGHT_WRITE);
    match transparency {
        Transparency::Sorted => {
            vec![
                subpass(RowName::FORWARD_TO_TRANSPARENT)
                    .from(from, &[forward::DEPTH_TEST, light])
                    .to(transparent::PASS.place, &[&depth[..], &[transparent::BLEND]].concat())
                    .because("TRANSPARENT blends over what FORWARD wrote, tests against depth, and as the last user drops that"),
            ]
        }
        Transparency::Oit => vec![
            sums_reuse(),
            subpass(RowName::FORWARD_TO_TRANSPARENT)
                .from(from, &[forward::DEPTH_TEST])
                .to(transparent::PASS.place, &depth)
                .because("TRANSPARENT tests against depth, and as the last user drops it"),
            subpass(RowName::FORWARD_TO_COMPOSITE)
                .from(from, &[light])
                .to(composite::PASS.place, &[composite::LIGHT_BLEND])
                .because("COMPOSITE blends over what FORWARD wrote"),
            sums_to_composite(),
        ],
    }
}
