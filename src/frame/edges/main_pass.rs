//! The rows of the main pass and of those that draw the picture after it: G-buffer, light, what is blended over it, and the output.
//!
//! Rows from OUTSIDE order the last frame's stores before this frame's loads, and nothing besides: "The load operation for each sample in an
//! attachment happens-before any recorded command which accesses the sample in the first subpass where the attachment is used", and the
//! store operation after those of the last one (specification, `VkAttachmentDescription`). Loads of colour and stores happen in
//! COLOR_ATTACHMENT_OUTPUT; those of depth in EARLY_FRAGMENT_TESTS and in LATE_FRAGMENT_TESTS. CLEAR and DONT_CARE write.

use super::fog::{fog_after_reflections, to_fog, transparent_after_fog};
use super::forward::{forward_edge, transparent_after_forward};
use super::spread::bloom_rows;
use super::{Carrier, Edge, Place, RowName, ao, particles, presentation, reflections, row, subpass, taa};
use crate::frame::list::{BLEND_PASS, FXAA_PASS, GBUFFER_PASS, MAIN_PASS, RESOLVE, SHARPEN_PASS, TONEMAP_PASS};
use crate::gpu::sync::Use;
use crate::passes::{
    composite, copy, fog, forward, fxaa, geometry, hiz, lighting, present, reflect_resolve, sharpen, tone, tonemap,
    transparent,
};
use crate::plan::{FramePlan, Shading, Target};
use crate::scene::Transparency;

impl RowName {
    pub(crate) const GBUFFER_REUSE: Self = Self("gbuffer-reuse");
    pub(crate) const GBUFFER_TO_LIGHTING: Self = Self("gbuffer-to-lighting");
    pub(crate) const HDR_REUSE: Self = Self("hdr-reuse");
    pub(crate) const SAMPLES_REUSE: Self = Self("samples-reuse");
    pub(crate) const OUTPUT_REUSE: Self = Self("output-reuse");
    pub(crate) const TARGETS_REUSE: Self = Self("targets-reuse");
    pub(crate) const LIGHTING_TO_TRANSPARENT: Self = Self("lighting-to-transparent");
    pub(crate) const LIGHTING_TO_COMPOSITE: Self = Self("lighting-to-composite");
    pub(crate) const SUMS_REUSE: Self = Self("sums-reuse");
    pub(crate) const SUMS_TO_COMPOSITE: Self = Self("sums-to-composite");
    pub(crate) const HDR_TO_TONEMAP: Self = Self("hdr-to-tonemap");
    pub(crate) const OUTPUT_TO_FXAA: Self = Self("output-to-fxaa");
    pub(crate) const PICTURE_REUSE: Self = Self("picture-reuse");
    pub(crate) const PICTURE_TO_TONE: Self = Self("picture-to-tone");
    pub(crate) const READ_BACK: Self = Self("read-back");
}

/// All of them, in the order of a frame.
pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    let mut table = Vec::new();
    let lights = plan.light_target();
    if plan.is_forward() {
        table.push(forward_edge(plan));
    } else {
        if plan.has_geometry() {
            table.push(gbuffer_reuse(plan));
        }
        if !plan.emissive && lights == Target::Hdr {
            table.push(hdr_reuse(plan));
        }
    }
    let (last_light, light_use) = last_light(plan);
    // The first to touch the output, and the last. Where emissive light goes straight there, GEOMETRY is the first.
    let ((first, first_use), (last, last_use)) = match lights {
        Target::Hdr => ((tonemap::PASS.place, tonemap::OUTPUT_WRITE), (tonemap::PASS.place, tonemap::OUTPUT_WRITE)),
        Target::Samples => ((last_light, lighting::LIGHT_WRITE), (last_light, light_use)),
        _ => ((lighting::PASS.place, lighting::LIGHT_WRITE), (last_light, light_use)),
    };
    // Rows above order that, where GEOMETRY or FORWARD is the first.
    let output_is_ordered = match lights {
        Target::Hdr => false,
        Target::Samples => first == forward::PASS.place,
        _ => plan.emissive || plan.is_forward(),
    };
    if lights == Target::Samples && !plan.emissive && !plan.is_forward() && first != lighting::PASS.place {
        table.push(samples_reuse(plan));
    }
    // The subpass that finishes the picture, and its render pass.
    let mut pass = match (&plan.bloom, &plan.taa) {
        (Some(_), _) => TONEMAP_PASS,
        (None, Some(_)) => SHARPEN_PASS,
        (None, None) if plan.reflects() => BLEND_PASS,
        (None, None) => MAIN_PASS,
    };
    // A row of BLOOM's orders it, too, where there is that, or that from reflections.
    if !output_is_ordered && plan.bloom.is_none() && !plan.tone_maps_reflected() {
        table.push(taa::of_sharpen_pass(plan, output_reuse(plan, (first, first_use))));
    }
    if plan.reflects() {
        table.extend(reflections::rows(light_write(plan)));
    }
    if plan.has_fog() {
        table.push(if plan.reflects() { fog_after_reflections(plan) } else { to_fog(plan, light_write(plan)) });
    }
    if let Some(transparency) = plan.transparency {
        table.extend(transparent_edges(plan, transparency));
    }
    let mut shown = (last_light, light_use);
    if plan.taa.is_some() {
        table.extend(taa::rows(plan, shown));
        shown = (sharpen::PASS.place, sharpen::LIGHT_WRITE);
    }
    if plan.bloom.is_some() {
        table.extend(bloom_rows(plan, shown));
    } else if plan.tone_maps_reflected() {
        table.push(reflections::to_tonemap(plan));
    } else if plan.has_tonemap_subpass() {
        table.push(taa::of_sharpen_pass(plan, hdr_to_tonemap(shown.0, shown.1)));
    }
    let (read, read_back) = match plan.draws_into_swapchain() {
        true => (
            presentation::IN_TURN,
            "what comes over the picture waits for TRANSFER, and so for the layout that the pass leaves it in",
        ),
        false => (copy::READ, "COPY reads the picture after the pass, in the layout that the pass leaves it in"),
    };
    if plan.has_geometry() && !plan.is_forward() {
        let row = gbuffer_to_lighting(plan, &table);
        let before = table.iter().position(|row| row.name == RowName::GBUFFER_REUSE);
        table.insert(before.map_or(0, |before| before + 1), row);
    }
    let mut finish = (last, last_use);
    if plan.fxaa {
        let [output, picture] = fxaa_edges(plan, last, last_use);
        table.extend([Edge { carrier: Carrier::Subpass(pass), ..output }, picture]);
        (finish, pass) = ((fxaa::PASS.place, fxaa::PICTURE_WRITE), FXAA_PASS);
    }
    if (tone::PASS.presence)(plan).is_in() {
        let why = "TONE multiplies what is finished of its pixel";
        let row = row(RowName::PICTURE_TO_TONE, Carrier::Subpass(pass)).from(finish.0, &[finish.1]);
        table.push(Edge { by_region: true, ..row.to(tone::PASS.place, &[tone::PICTURE_BLEND]).because(why) });
        finish = (tone::PASS.place, tone::PICTURE_BLEND);
    }
    let row = row(RowName::READ_BACK, Carrier::Subpass(pass)).from(finish.0, &[finish.1]);
    table.push(row.to(Place::OUTSIDE, &[read]).because(read_back));
    table.into_iter().map(|row| reflections::in_blend_pass(plan, row)).collect()
}

/// Returns true if TONE is the last subpass of the pass that draws the output.
pub(super) fn is_toned(plan: &FramePlan) -> bool {
    !plan.fxaa && (tone::PASS.presence)(plan).is_in()
}

/// Why an image of the swapchain waits.
const ACQUIRED: &str =
    "the image is drawn into when it is acquired, which its semaphore says; its layout changes before the write";

/// The first place that touches the picture itself.
pub(super) fn first_of_picture(plan: &FramePlan) -> Place {
    match plan.light_target() {
        _ if plan.fxaa => fxaa::PASS.place,
        Target::Hdr => tonemap::PASS.place,
        Target::Output if !plan.is_forward() => lighting::PASS.place,
        _ => last_light(plan).0,
    }
}

/// Frames in flight share one G-buffer, and the HDR target where there is one.
fn gbuffer_reuse(plan: &FramePlan) -> Edge {
    let mut before = match plan.reflects() {
        // The last to read the G-buffer; it has waited for what is stored.
        true if plan.ends_with_reflections() => vec![hiz::GBUFFER_READ],
        true if plan.taa.is_none() => vec![depth_dropped(plan), hiz::GBUFFER_READ],
        _ => vec![depth_dropped(plan)],
    };
    let mut after = vec![geometry::DEPTH_CLEAR];
    // LIGHTING or VIEW reads and drops the G-buffer. Where it is the last subpass, the picture's reader has waited for that.
    let is_last = plan.transparency.is_none() && !plan.has_fog() && !plan.has_tonemap_subpass();
    let waits_for_reader = plan.fxaa || plan.emissive && plan.light_target() == Target::Output;
    if plan.geometry_locations() > 0 {
        // Where LIGHTING is the last to write light, TAA has waited for those drops as well, and so has HIZ in any frame that has it.
        let waits_for_taa = plan.taa.is_some() && plan.transparency.is_none() && !plan.has_fog();
        if !(is_last && waits_for_reader || waits_for_taa || plan.reflects()) {
            before.push(lighting::COLOR_DROP);
        }
        after.push(geometry::COLOR_WRITE);
    }
    if plan.emissive {
        before.push(match plan.light_target() {
            // Its clear waits for TONEMAP of the last frame to have let go of it.
            Target::Hdr => dropped_last(plan, tonemap::HDR_DROP),
            Target::Samples => dropped_last(plan, RESOLVE),
            _ => copy::READ,
        });
    }
    let row = subpass(RowName::GBUFFER_REUSE).from(Place::OUTSIDE, &before).to(geometry::PASS.place, &after).because(
        "frames in flight share the targets: the last frame must have read and dropped them, and a DONT_CARE \
         store is a write",
    );
    of_gbuffer_pass(plan, row)
}

/// The last frame's last use of depth. TAA has waited for the uses before its own.
pub(super) fn depth_dropped(plan: &FramePlan) -> Use {
    match plan.transparency {
        _ if plan.taa.is_some() => crate::passes::taa::FRAME_READ,
        Some(_) => transparent::DEPTH_DROP,
        None if plan.has_fog() => fog::DEPTH_DROP,
        None if plan.is_forward() => forward::DEPTH_DROP,
        None => lighting::DEPTH_DROP,
    }
}

/// Returns the last read of the previous frame's output, or the use that waits for its image to be acquired.
pub(super) fn output_reader(plan: &FramePlan) -> Use {
    match (plan.fxaa, plan.draws_into_swapchain()) {
        (true, _) => fxaa::OUTPUT_READ,
        (false, true) => present::ATTACH,
        (false, false) => copy::READ,
    }
}

/// The output, and with it the samples where LIGHTING is the first to touch both.
fn output_reuse(plan: &FramePlan, (first, first_use): (Place, Use)) -> Edge {
    let why = match (plan.fxaa, plan.draws_into_swapchain()) {
        (true, _) => "FXAA of the last frame may still sample the output when this one clears it",
        (false, true) => ACQUIRED,
        (false, false) => {
            "the last picture may still be copied when this one is cleared; its layout changes before the write"
        }
    };
    let read = output_reader(plan);
    let (name, before, why) = match plan.resolves_output() {
        // LIGHTING is the first and the last to touch both: the picture's reader has waited for LIGHTING's drops.
        true if first == lighting::PASS.place && !plan.emissive => (
            RowName::TARGETS_REUSE,
            if read == present::ATTACH { RESOLVE } else { read },
            "frames in flight share the samples and the output: the last frame must have resolved the ones and let go of the other",
        ),
        true if !plan.draws_into_swapchain() || plan.fxaa => (
            RowName::OUTPUT_REUSE,
            read,
            "the last picture may still be copied when samples are resolved into this one; its layout changes before the write",
        ),
        _ => (RowName::OUTPUT_REUSE, read, why),
    };
    // TONE comes after the resolve: the reader of TONE's picture has not waited for the samples.
    let resolved = (name == RowName::TARGETS_REUSE && is_toned(plan)).then_some(RESOLVE);
    let before: Vec<_> = [before].into_iter().chain(resolved).collect();
    subpass(name).from(Place::OUTSIDE, &before).to(first, &[first_use]).because(why)
}

/// Where GEOMETRY has a render pass of its own, that pass carries GEOMETRY's rows; a row between two render passes is not by region.
fn of_gbuffer_pass(plan: &FramePlan, row: Edge) -> Edge {
    match plan.stores_gbuffer {
        true => Edge { carrier: Carrier::Subpass(GBUFFER_PASS), by_region: false, across_samples: false, ..row },
        false => row,
    }
}

/// Returns the last use of a target that the last subpass drops by `drop`. FXAA has waited for all that the subpass wrote, so it is FXAA's read if
/// there is one.
pub(super) fn dropped_last(plan: &FramePlan, drop: Use) -> Use {
    if plan.fxaa { fxaa::OUTPUT_READ } else { drop }
}

fn color_use(plan: &FramePlan) -> Use {
    if plan.shading == Shading::ShowOverdraw { geometry::COUNT_BLEND } else { geometry::COLOR_WRITE }
}

/// `others`: the rows besides it.
fn gbuffer_to_lighting(plan: &FramePlan, others: &[Edge]) -> Edge {
    // A store comes after the tests.
    let mut before = vec![if plan.stores_gbuffer { geometry::DEPTH_STORE } else { geometry::DEPTH_TEST }];
    let mut after = Vec::new();
    // Where LIGHTING waits for an earlier user of its own target in one of these stages, it waits for GEOMETRY's stores as well.
    let waits_for_colors = |row: &Edge| {
        let is_first = (row.from, row.to) == (Place::OUTSIDE, lighting::PASS.place);
        is_first && row.before.stage.intersects(lighting::COLOR_DROP.stage | lighting::GBUFFER_READ.stage)
    };
    let drops_in_turn = plan.stores_gbuffer && !plan.has_ao() && others.iter().any(waits_for_colors);
    if plan.lighting_tests_depth() {
        after.push(lighting::DEPTH_READ);
    }
    // Between two render passes depth changes its layout, and its last user writes it after that change; where AO reads depth, the change comes
    // before AO.
    let light_is_last = plan.transparency.is_none() && !plan.has_fog();
    if light_is_last || plan.stores_gbuffer && !plan.has_ao() || plan.reflects() {
        after.push(lighting::DEPTH_DROP);
    }
    if plan.geometry_locations() > 0 {
        before.push(color_use(plan));
        after.push(lighting::GBUFFER_READ);
        if !drops_in_turn {
            after.push(lighting::COLOR_DROP);
        }
    }
    if plan.emissive {
        after.push(lighting::LIGHT_BLEND);
    }
    if plan.stores_gbuffer {
        // The main pass loads what the G-buffer pass stored.
        after.push(lighting::DEPTH_LOAD);
        if plan.geometry_locations() > 0 {
            after.push(lighting::COLOR_LOAD);
        }
    }
    if plan.has_ao() {
        return ao::to_lighting(&after);
    }
    let why = match plan.transparency.is_some() || plan.has_fog() {
        true => "LIGHTING reads what GEOMETRY wrote, tests against its depth, and as the last user drops all but that",
        false => "LIGHTING reads what GEOMETRY wrote, tests against its depth, and as the last user drops it all",
    };
    let row = subpass(RowName::GBUFFER_TO_LIGHTING).from(geometry::PASS.place, &before);
    let row = row.to(lighting::PASS.place, &after).across_samples(lighting::reads_all_samples(plan));
    of_gbuffer_pass(plan, row.because(why))
}

/// Samples that LIGHTING is the first to touch, and a later subpass resolves.
fn samples_reuse(plan: &FramePlan) -> Edge {
    subpass(RowName::SAMPLES_REUSE)
        .from(Place::OUTSIDE, &[dropped_last(plan, RESOLVE)])
        .to(lighting::PASS.place, &[lighting::LIGHT_WRITE])
        .because(
            "frames in flight share the samples: the last frame must have resolved and dropped what this one \
             clears",
        )
}

/// The use by which LIGHTING writes the light's target.
fn light_write(plan: &FramePlan) -> Use {
    if plan.blends_light() { lighting::LIGHT_BLEND } else { lighting::LIGHT_WRITE }
}

/// The subpass that is the last to write the light's target before it is shown, and its use of the target.
fn last_light(plan: &FramePlan) -> (Place, Use) {
    match plan.transparency {
        Some(Transparency::Sorted) => (transparent::PASS.place, transparent::BLEND),
        Some(Transparency::Oit) => (composite::PASS.place, composite::LIGHT_BLEND),
        None if plan.has_fog() => (fog::PASS.place, fog::LIGHT_BLEND),
        None if plan.is_forward() => (forward::PASS.place, forward::LIGHT_WRITE),
        None if plan.reflects() => (reflect_resolve::PASS.place, reflect_resolve::LIGHT_BLEND),
        None => (lighting::PASS.place, light_write(plan)),
    }
}

fn transparent_edges(plan: &FramePlan, transparency: Transparency) -> Vec<Edge> {
    let to_composite = (transparency == Transparency::Oit).then(sums_to_composite);
    if plan.has_fog() {
        let mut rows = match plan.reflects() {
            true => reflections::to_transparent(plan, transparency),
            false => to_composite.iter().map(|_| sums_reuse()).collect(),
        };
        rows.extend(transparent_after_fog(plan, transparency).into_iter().chain(to_composite));
        return rows;
    }
    if plan.is_forward() {
        return transparent_after_forward(plan, transparency);
    }
    if plan.reflects() {
        return reflections::to_transparent(plan, transparency).into_iter().chain(to_composite).collect();
    }
    let light = light_write(plan);
    // A G-buffer that is stored is visible to all of the main pass already.
    let mut depth = match plan.stores_gbuffer {
        true => vec![transparent::DEPTH_WAIT],
        false => vec![transparent::DEPTH_READ, transparent::DEPTH_DROP],
    };
    depth.extend(particles::depth(plan).filter(|_| !plan.stores_gbuffer));
    // LIGHTING tests depth, and reads it as an input where no target has the position.
    let lit = [lighting::DEPTH_READ, lighting::GBUFFER_READ];
    match transparency {
        Transparency::Sorted => vec![
            subpass(RowName::LIGHTING_TO_TRANSPARENT)
                .from(lighting::PASS.place, &[lit[0], lit[1], light])
                .to(transparent::PASS.place, &[&depth[..], &[transparent::BLEND]].concat())
                .across_samples(lighting::reads_all_samples(plan))
                .because(
                    "TRANSPARENT blends over what LIGHTING wrote, tests against the depth that LIGHTING read, and as the \
                     last user drops that",
                ),
        ],
        Transparency::Oit => vec![
            sums_reuse(),
            subpass(RowName::LIGHTING_TO_TRANSPARENT)
                .from(lighting::PASS.place, &lit)
                .to(transparent::PASS.place, &depth)
                .across_samples(lighting::reads_all_samples(plan))
                .because("TRANSPARENT tests against the depth that LIGHTING read, and as the last user drops it"),
            subpass(RowName::LIGHTING_TO_COMPOSITE)
                .from(lighting::PASS.place, &[light])
                .to(composite::PASS.place, &[composite::LIGHT_BLEND])
                .because("COMPOSITE blends over what LIGHTING wrote"),
            sums_to_composite(),
        ],
    }
}

pub(super) fn sums_reuse() -> Edge {
    subpass(RowName::SUMS_REUSE)
        .from(Place::OUTSIDE, &[composite::SUM_DROP])
        .to(transparent::PASS.place, &[transparent::SUM_CLEAR])
        .because(
            "frames in flight share the sums: COMPOSITE of the last frame must have read and dropped what this \
             one clears",
        )
}

pub(super) fn sums_to_composite() -> Edge {
    subpass(RowName::SUMS_TO_COMPOSITE)
        .from(transparent::PASS.place, &[transparent::BLEND])
        .to(composite::PASS.place, &[composite::SUM_READ, composite::SUM_DROP])
        .because("COMPOSITE reads the sums of its pixel, and as the last user drops them")
}

fn hdr_to_tonemap(from: Place, light: Use) -> Edge {
    subpass(RowName::HDR_TO_TONEMAP)
        .from(from, &[light])
        .to(tonemap::PASS.place, &[tonemap::HDR_READ, tonemap::HDR_DROP])
        .because("TONEMAP reads the light of its pixel, and as the last user drops the HDR target")
}

/// Where no surface emits, LIGHTING is the first to touch the HDR target.
fn hdr_reuse(plan: &FramePlan) -> Edge {
    subpass(RowName::HDR_REUSE)
        .from(Place::OUTSIDE, &[dropped_last(plan, tonemap::HDR_DROP)])
        .to(lighting::PASS.place, &[lighting::LIGHT_WRITE])
        .because(
            "frames in flight share the HDR target: TONEMAP of the last frame must have read and dropped what \
             this one clears",
        )
}

/// Returns the rows that FXAA waits for. The main pass hands it the output.
fn fxaa_edges(plan: &FramePlan, last: Place, output_write: Use) -> [Edge; 2] {
    [
        subpass(RowName::OUTPUT_TO_FXAA)
            .from(last, &[output_write])
            .to(fxaa::PASS.place, &[fxaa::OUTPUT_READ])
            .because(
                "FXAA samples a pixel's neighbours, so that the whole output must be there, in the layout that the \
                 pass leaves it in",
            ),
        row(RowName::PICTURE_REUSE, Carrier::Subpass(FXAA_PASS))
            .from(Place::OUTSIDE, &[if plan.draws_into_swapchain() { present::ATTACH } else { copy::READ }])
            .to(fxaa::PASS.place, &[fxaa::PICTURE_WRITE])
            .because(match plan.draws_into_swapchain() {
                true => ACQUIRED,
                false => {
                    "the last picture may still be copied when this one is drawn; its layout changes before the write"
                }
            }),
    ]
}
