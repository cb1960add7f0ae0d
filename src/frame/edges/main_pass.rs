//! The rows of the main pass and of FXAA's: G-buffer, light, what is blended over it, and the output.
//!
//! Rows from OUTSIDE order the last frame's stores before this frame's loads, and nothing besides: "The load operation for each sample in an
//! attachment happens-before any recorded command which accesses the sample in the first subpass where the attachment is used", and the
//! store operation after those of the last one (specification, `VkAttachmentDescription`). Loads of colour and stores happen in
//! COLOR_ATTACHMENT_OUTPUT; those of depth in EARLY_FRAGMENT_TESTS and in LATE_FRAGMENT_TESTS. CLEAR and DONT_CARE write.

use super::forward::{forward_edge, transparent_after_forward};
use super::{Carrier, Edge, Place, RowName, presentation, subpass};
use crate::frame::render_pass;
use crate::gpu::sync::Use;
use crate::passes::{composite, copy, forward, fxaa, geometry, lighting, present, tonemap, transparent};
use crate::plan::{FramePlan, Shading};
use crate::scene::Transparency;
use crate::targets::{Target, light_target};

/// All of them, in the order of a frame.
pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    let mut table = Vec::new();
    let lights = light_target(plan);
    if plan.is_forward() {
        table.push(forward_edge(plan));
    } else {
        if plan.has_geometry() {
            table.push(gbuffer_reuse(plan));
            table.push(gbuffer_to_lighting(plan));
        }
        if !plan.emissive && lights == Target::Hdr {
            table.push(hdr_reuse(plan));
        }
    }
    let (last_light, light_use) = last_light(plan);
    // The first to touch the output, and the last. Where emissive light goes straight there, GEOMETRY is the first.
    let ((first, first_use), (last, last_use)) = match lights {
        Target::Hdr => ((Place::Tonemap, tonemap::OUTPUT_WRITE), (Place::Tonemap, tonemap::OUTPUT_WRITE)),
        Target::Samples => ((last_light, lighting::LIGHT_WRITE), (last_light, light_use)),
        _ => ((Place::Lighting, lighting::LIGHT_WRITE), (last_light, light_use)),
    };
    // Rows above order that, where GEOMETRY or FORWARD is the first.
    let output_is_ordered = match lights {
        Target::Hdr => false,
        Target::Samples => first == Place::Forward,
        _ => plan.emissive || plan.is_forward(),
    };
    if lights == Target::Samples && !plan.emissive && !plan.is_forward() && first != Place::Lighting {
        table.push(samples_reuse(plan));
    }
    if !output_is_ordered {
        let (read, why) = match (plan.fxaa, plan.draws_into_swapchain()) {
            (true, _) => {
                (fxaa::OUTPUT_READ, "FXAA of the last frame may still sample the output when this one clears it")
            }
            (false, true) => (present::ATTACH, ACQUIRED),
            (false, false) => (
                copy::READ,
                "the last picture may still be copied when this one is cleared; its layout changes before the write",
            ),
        };
        let (name, before, why) = match plan.resolves_output() {
            // LIGHTING is the first to touch both, and the last: whoever reads the picture has waited for what it dropped.
            true if first == Place::Lighting && !plan.emissive => (
                RowName::TargetsReuse,
                if read == present::ATTACH { render_pass::RESOLVE } else { read },
                "frames in flight share the samples and the output: the last frame must have resolved the ones and let go of the other",
            ),
            true if !plan.draws_into_swapchain() || plan.fxaa => (
                RowName::OutputReuse,
                read,
                "the last picture may still be copied when samples are resolved into this one; its layout changes before the write",
            ),
            _ => (RowName::OutputReuse, read, why),
        };
        table.push(subpass(name, (Place::Outside, first), &[before], &[first_use], why));
    }
    if let Some(transparency) = plan.transparency {
        table.extend(transparent_edges(plan, transparency));
    }
    if plan.has_tonemap_subpass() {
        table.push(hdr_to_tonemap(last_light, light_use));
    }
    let (read, read_back) = match plan.draws_into_swapchain() {
        true => (
            presentation::IN_TURN,
            "what comes over the picture waits for TRANSFER, and so for the layout that the pass leaves it in",
        ),
        false => (copy::READ, "COPY reads the picture after the pass, in the layout that the pass leaves it in"),
    };
    if plan.fxaa {
        table.extend(fxaa_edges(plan, last, last_use));
        let fxaa = (Place::Fxaa, Place::Outside);
        table.push(fxaa_pass(RowName::ReadBack, fxaa, fxaa::PICTURE_WRITE, read, read_back));
    } else {
        table.push(subpass(RowName::ReadBack, (last, Place::Outside), &[last_use], &[read], read_back));
    }
    table
}

/// Why an image of the swapchain waits.
const ACQUIRED: &str =
    "the image is drawn into when it is acquired, which its semaphore says; its layout changes before the write";

/// The first place that touches the picture itself.
pub(super) fn first_of_picture(plan: &FramePlan) -> Place {
    match light_target(plan) {
        _ if plan.fxaa => Place::Fxaa,
        Target::Hdr => Place::Tonemap,
        Target::Output if !plan.is_forward() => Place::Lighting,
        _ => last_light(plan).0,
    }
}

/// Frames in flight share one G-buffer, and the HDR target where there is one.
fn gbuffer_reuse(plan: &FramePlan) -> Edge {
    let mut before = match plan.transparency {
        Some(_) => vec![transparent::DEPTH_DROP],
        None => vec![lighting::DEPTH_DROP],
    };
    let mut after = vec![geometry::DEPTH_CLEAR];
    // What LIGHTING or VIEW read and dropped; where it is the last subpass, whoever reads the picture has waited for that.
    let is_last = plan.transparency.is_none() && !plan.has_tonemap_subpass();
    let waits_for_reader = plan.fxaa || plan.emissive && light_target(plan) == Target::Output;
    if plan.geometry_locations() > 0 {
        if !(is_last && waits_for_reader) {
            before.push(lighting::COLOR_DROP);
        }
        after.push(geometry::COLOR_WRITE);
    }
    if plan.emissive {
        before.push(match light_target(plan) {
            // Its clear waits for TONEMAP of the last frame to have let go of it.
            Target::Hdr => dropped_last(plan, tonemap::HDR_DROP),
            Target::Samples => dropped_last(plan, render_pass::RESOLVE),
            _ => copy::READ,
        });
    }
    subpass(
        RowName::GbufferReuse,
        (Place::Outside, Place::Geometry),
        &before,
        &after,
        "frames in flight share the targets: the last frame must have read and dropped them, and a DONT_CARE store is a write",
    )
}

/// What is over when the last subpass of the last frame has dropped something: FXAA has waited for all that it wrote.
pub(super) fn dropped_last(plan: &FramePlan, drop: Use) -> Use {
    if plan.fxaa { fxaa::OUTPUT_READ } else { drop }
}

fn color_use(plan: &FramePlan) -> Use {
    if plan.shading == Shading::ShowOverdraw { geometry::COUNT_BLEND } else { geometry::COLOR_WRITE }
}

fn gbuffer_to_lighting(plan: &FramePlan) -> Edge {
    let mut before = vec![geometry::DEPTH_TEST];
    let mut after = Vec::new();
    if plan.lighting_tests_depth() {
        after.push(lighting::DEPTH_READ);
    }
    if plan.transparency.is_none() {
        after.push(lighting::DEPTH_DROP);
    }
    if plan.geometry_locations() > 0 {
        before.push(color_use(plan));
        after.extend([lighting::GBUFFER_READ, lighting::COLOR_DROP]);
    }
    if plan.emissive {
        after.push(lighting::LIGHT_BLEND);
    }
    let why = match plan.transparency {
        Some(_) => {
            "LIGHTING reads what GEOMETRY wrote, tests against its depth, and as the last user drops all but that"
        }
        None => "LIGHTING reads what GEOMETRY wrote, tests against its depth, and as the last user drops it all",
    };
    subpass(RowName::GbufferToLighting, (Place::Geometry, Place::Lighting), &before, &after, why)
}

/// Samples that LIGHTING is the first to touch, and a later subpass resolves.
fn samples_reuse(plan: &FramePlan) -> Edge {
    subpass(
        RowName::SamplesReuse,
        (Place::Outside, Place::Lighting),
        &[dropped_last(plan, render_pass::RESOLVE)],
        &[lighting::LIGHT_WRITE],
        "frames in flight share the samples: the last frame must have resolved and dropped what this one clears",
    )
}

/// How LIGHTING writes the light's target.
fn light_write(plan: &FramePlan) -> Use {
    if plan.blends_light() { lighting::LIGHT_BLEND } else { lighting::LIGHT_WRITE }
}

/// The subpass that is the last to write the light's target before it is shown, and how it does.
fn last_light(plan: &FramePlan) -> (Place, Use) {
    match plan.transparency {
        Some(Transparency::Sorted) => (Place::Transparent, transparent::BLEND),
        Some(Transparency::Oit) => (Place::Composite, composite::LIGHT_BLEND),
        None if plan.is_forward() => (Place::Forward, forward::LIGHT_WRITE),
        None => (Place::Lighting, light_write(plan)),
    }
}

fn transparent_edges(plan: &FramePlan, transparency: Transparency) -> Vec<Edge> {
    if plan.is_forward() {
        return transparent_after_forward(transparency);
    }
    let light = light_write(plan);
    let depth = [transparent::DEPTH_READ, transparent::DEPTH_DROP];
    // LIGHTING tests depth, and reads it as an input where no target has the position.
    let lit = [lighting::DEPTH_READ, lighting::GBUFFER_READ];
    match transparency {
        Transparency::Sorted => vec![subpass(
            RowName::LightingToTransparent,
            (Place::Lighting, Place::Transparent),
            &[lit[0], lit[1], light],
            &[depth[0], depth[1], transparent::BLEND],
            "TRANSPARENT blends over what LIGHTING wrote, tests against the depth that LIGHTING read, and as the last user drops that",
        )],
        Transparency::Oit => vec![
            sums_reuse(),
            subpass(
                RowName::LightingToTransparent,
                (Place::Lighting, Place::Transparent),
                &lit,
                &depth,
                "TRANSPARENT tests against the depth that LIGHTING read, and as the last user drops it",
            ),
            subpass(
                RowName::LightingToComposite,
                (Place::Lighting, Place::Composite),
                &[light],
                &[composite::LIGHT_BLEND],
                "COMPOSITE blends over what LIGHTING wrote",
            ),
            sums_to_composite(),
        ],
    }
}

pub(super) fn sums_reuse() -> Edge {
    subpass(
        RowName::SumsReuse,
        (Place::Outside, Place::Transparent),
        &[composite::SUM_DROP],
        &[transparent::SUM_CLEAR],
        "frames in flight share the sums: COMPOSITE of the last frame must have read and dropped what this one clears",
    )
}

pub(super) fn sums_to_composite() -> Edge {
    subpass(
        RowName::SumsToComposite,
        (Place::Transparent, Place::Composite),
        &[transparent::BLEND],
        &[composite::SUM_READ, composite::SUM_DROP],
        "COMPOSITE reads the sums of its pixel, and as the last user drops them",
    )
}

fn hdr_to_tonemap(from: Place, light: Use) -> Edge {
    subpass(
        RowName::HdrToTonemap,
        (from, Place::Tonemap),
        &[light],
        &[tonemap::HDR_READ, tonemap::HDR_DROP],
        "TONEMAP reads the light of its pixel, and as the last user drops the HDR target",
    )
}

/// Where no surface emits, LIGHTING is the first to touch the HDR target.
fn hdr_reuse(plan: &FramePlan) -> Edge {
    subpass(
        RowName::HdrReuse,
        (Place::Outside, Place::Lighting),
        &[dropped_last(plan, tonemap::HDR_DROP)],
        &[lighting::LIGHT_WRITE],
        "frames in flight share the HDR target: TONEMAP of the last frame must have read and dropped what this one clears",
    )
}

/// What FXAA waits for. The main pass hands it the output.
fn fxaa_edges(plan: &FramePlan, last: Place, output_write: Use) -> [Edge; 2] {
    [
        subpass(
            RowName::OutputToFxaa,
            (last, Place::Fxaa),
            &[output_write],
            &[fxaa::OUTPUT_READ],
            "FXAA samples a pixel's neighbours, so that the whole output must be there, in the layout that the pass leaves it in",
        ),
        fxaa_pass(
            RowName::PictureReuse,
            (Place::Outside, Place::Fxaa),
            if plan.draws_into_swapchain() { present::ATTACH } else { copy::READ },
            fxaa::PICTURE_WRITE,
            match plan.draws_into_swapchain() {
                true => ACQUIRED,
                false => {
                    "the last picture may still be copied when this one is drawn; its layout changes before the write"
                }
            },
        ),
    ]
}

fn fxaa_pass(name: RowName, (from, to): (Place, Place), before: Use, after: Use, why: &'static str) -> Edge {
    Edge::new(name, Carrier::FxaaPass, (from, to), (before, after), why)
}
