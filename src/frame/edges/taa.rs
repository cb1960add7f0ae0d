//! The rows of VELOCITY, TAA and SHARPEN, between the main pass and the passes that finish the picture.

use ash::vk;

use super::{Carrier, Edge, Place, RowName, barrier, row};
use crate::frame::list::{MAIN_PASS, SHARPEN_PASS, VELOCITY_PASS};
use crate::gpu::sync::Use;
use crate::passes::{fog, forward, lighting, reflect_resolve, sharpen, taa, transparent, velocity};
use crate::plan::FramePlan;

impl RowName {
    pub(crate) const LIGHT_TO_TAA: Self = Self("light-to-taa");
    pub(crate) const DEPTH_TO_TAA: Self = Self("depth-to-taa");
    pub(crate) const DEPTH_TO_VELOCITY: Self = Self("depth-to-velocity");
    pub(crate) const VELOCITY_REUSE: Self = Self("velocity-reuse");
    pub(crate) const VELOCITY_TO_TAA: Self = Self("velocity-to-taa");
    /// Lets the last frame's SHARPEN read its history before TAA goes on from it.
    pub const HISTORY_REUSE: Self = Self("history-reuse");
    pub(crate) const TAA_TO_SHARPEN: Self = Self("taa-to-sharpen");
}

/// `light` is how the last subpass of the main pass writes the light, or REFLECT_RESOLVE.
pub(super) fn rows(plan: &FramePlan, (last_light, light): (Place, Use)) -> Vec<Edge> {
    let (depth, stored) = match plan.transparency {
        Some(_) => (transparent::PASS.place, transparent::DEPTH_DROP),
        None if plan.has_fog() => (fog::PASS.place, fog::DEPTH_DROP),
        None if plan.is_forward() => (forward::PASS.place, forward::DEPTH_DROP),
        None => (lighting::PASS.place, lighting::DEPTH_DROP),
    };
    let main = Carrier::Subpass(MAIN_PASS);
    let looks = "TAA looks at the light of a pixel and its neighbours, in the layout that the main pass leaves it in";
    let to_taa = |name, from, uses: &[Use], why| {
        row(name, main).from(from, uses).to(taa::PASS.place, &[taa::FRAME_READ]).because(why)
    };
    let mut rows = Vec::new();
    match plan.averages_reflected() {
        true => {
            let (written, readable) = (vk::ImageLayout::GENERAL, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
            // HIZ has waited for depth.
            rows.push(
                barrier(RowName::LIGHT_TO_TAA, written, readable)
                    .from(last_light, &[light])
                    .to(taa::PASS.place, &[taa::FRAME_READ])
                    .because(
                        "TAA looks at the light of a pixel and its neighbours, to which REFLECT_RESOLVE has added",
                    ),
            );
            rows.extend(plan.has_velocity().then(|| {
                row(RowName::DEPTH_TO_VELOCITY, Carrier::Subpass(VELOCITY_PASS))
                    // TAA of the last frame is compute as well, and has read the vectors before.
                    .from(last_light, &[reflect_resolve::GBUFFER_READ])
                    .to(velocity::PASS.place, &[velocity::DEPTH_READ, velocity::DEPTH_STORE, velocity::VECTOR_WRITE])
                    .because(
                        "VELOCITY draws where depth is what the main pass stored, and stores it again, after REFLECT_RESOLVE has read it; and \
                         frames in flight share the vectors: TAA of the last frame must have read what this one clears",
                    )
            }));
        }
        false if plan.has_velocity() => rows.extend([
            row(RowName::DEPTH_TO_VELOCITY, main)
                .from(depth, &[stored])
                .to(velocity::PASS.place, &[velocity::DEPTH_READ, velocity::DEPTH_STORE])
                .because("VELOCITY draws where depth is what the main pass stored, and stores it again"),
            to_taa(RowName::LIGHT_TO_TAA, last_light, &[light], looks),
        ]),
        false if depth == last_light => rows.push(to_taa(
            RowName::LIGHT_TO_TAA,
            last_light,
            &[light, stored],
            "TAA looks at light and depth of a pixel and its neighbours, which the main pass stores",
        )),
        false => rows.extend([
            to_taa(RowName::LIGHT_TO_TAA, last_light, &[light], looks),
            to_taa(
                RowName::DEPTH_TO_TAA,
                depth,
                &[stored],
                "TAA looks at the depth of a pixel and its neighbours, which the main pass stores",
            ),
        ]),
    }
    if plan.has_velocity() {
        let pass = Carrier::Subpass(VELOCITY_PASS);
        let reuse = row(RowName::VELOCITY_REUSE, pass)
            .from(Place::OUTSIDE, &[taa::FRAME_READ])
            .to(velocity::PASS.place, &[velocity::VECTOR_WRITE])
            .because("frames in flight share the vectors: TAA of the last frame must have read what this one clears");
        rows.extend((!plan.averages_reflected()).then_some(reuse));
        rows.push(
            row(RowName::VELOCITY_TO_TAA, pass)
                .from(velocity::PASS.place, &[velocity::VECTOR_WRITE, velocity::DEPTH_STORE])
                .to(taa::PASS.place, &[taa::FRAME_READ])
                .because("TAA reads the vectors, and the depth that VELOCITY stored"),
        );
    }
    rows.extend([
        row(RowName::HISTORY_REUSE, Carrier::BufferBarrier)
            // SHARPEN of the last frame has waited for what TAA wrote then, so waiting for SHARPEN covers it.
            .from(Place::OUTSIDE, &[sharpen::HISTORY_READ, taa::HISTORY_READ])
            // The overwritten history was written two frames ago, and has become visible to TAA of the last frame by this row.
            .to(taa::PASS.place, &[taa::HISTORY_READ])
            .because(
                "TAA goes on from what the last frame left for it, and overwrites what the last frame went on from",
            ),
        row(RowName::TAA_TO_SHARPEN, Carrier::Subpass(SHARPEN_PASS))
            .from(taa::PASS.place, &[taa::HISTORY_WRITE, taa::FRAME_READ])
            .to(sharpen::PASS.place, &[sharpen::HISTORY_READ, sharpen::LIGHT_WRITE])
            .because("SHARPEN reads what TAA averaged, and overwrites the light that TAA has read"),
    ]);
    rows
}

/// SHARPEN's light for BLOOM or TONEMAP: a row of the main pass from the last that writes it, carried by SHARPEN's.
pub(super) fn of_sharpen_pass(plan: &FramePlan, edge: Edge) -> Edge {
    match plan.taa {
        Some(_) => Edge { carrier: Carrier::Subpass(SHARPEN_PASS), ..edge },
        None => edge,
    }
}
