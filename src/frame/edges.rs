//! Every dependency of a frame, in one table.
//!
//! A row orders all uses of one place before all uses of another: one row for each pair, because rows of the same pair
//! overlap and would hide each other's missing bits. The table is a pure function of the plan; the render passes and the
//! barriers are made from it, and `afterlight inspect` prints it.

use std::fmt;

use ash::vk;

use super::render_pass;
use crate::gpu::sync::Use;
use crate::passes::{composite, copy, forward, fxaa, geometry, lighting, shadow, tiled, tonemap, transparent};
use crate::plan::{FramePlan, Shading};
use crate::scene::{LightPath, Transparency};
use crate::targets::{Target, light_target};

/// Where something happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// Before or after the render pass, in this frame or another.
    Outside,
    Shadow,
    Geometry,
    /// LIGHTING, or VIEW in its place: they touch the same things in the same way.
    Lighting,
    /// GEOMETRY and LIGHTING at once.
    Forward,
    Transparent,
    Composite,
    Tonemap,
    Fxaa,
    /// The compute pass that lights a stored G-buffer.
    Tiled,
    Copy,
    Host,
}

/// What a row becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carrier {
    /// A subpass dependency of the shadow render pass, of which each map that is drawn has an instance.
    ShadowPass,
    /// A subpass dependency of the main render pass.
    MainPass,
    /// A subpass dependency of FXAA's render pass.
    FxaaPass,
    /// A pipeline barrier on an image, with its layouts before and after.
    ImageBarrier(vk::ImageLayout, vk::ImageLayout),
    /// A pipeline barrier on a buffer.
    BufferBarrier,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Outside => "OUTSIDE",
            Self::Shadow => "SHADOW",
            Self::Geometry => "GEOMETRY",
            Self::Lighting => "LIGHTING",
            Self::Forward => "FORWARD",
            Self::Transparent => "TRANSPARENT",
            Self::Composite => "COMPOSITE",
            Self::Tonemap => "TONEMAP",
            Self::Fxaa => "FXAA",
            Self::Tiled => "TILED",
            Self::Copy => "COPY",
            Self::Host => "HOST",
        })
    }
}

impl fmt::Display for Carrier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ShadowPass => f.write_str("dependency of the shadow pass"),
            Self::MainPass => f.write_str("dependency of the main pass"),
            Self::FxaaPass => f.write_str("dependency of the FXAA pass"),
            Self::ImageBarrier(old, new) => write!(f, "image barrier {old:?} -> {new:?}"),
            Self::BufferBarrier => f.write_str("buffer barrier"),
        }
    }
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edge {
    pub name: &'static str,
    pub carrier: Carrier,
    pub from: Place,
    pub to: Place,
    /// All uses that must be over, in one.
    pub before: Use,
    /// All uses that must wait, in one.
    pub after: Use,
    pub by_region: bool,
    pub why: &'static str,
}

/// The dependencies of a plan's frames.
pub fn table(plan: &FramePlan) -> Vec<Edge> {
    let mut table = Vec::new();
    if plan.shadow.is_some() {
        table.extend(shadow_edges(plan));
    }
    if plan.is_tiled() {
        table.extend(tiled_edges());
        table.push(picture_to_host());
        return table;
    }
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
        Target::Samples => ((last_light, render_pass::RESOLVE), (last_light, light_use)),
        _ => ((Place::Lighting, light_write(plan)), (last_light, light_use)),
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
        let (read, why) = match plan.fxaa {
            true => (fxaa::OUTPUT_READ, "FXAA of the last frame may still sample the output when this one clears it"),
            false => (
                copy::READ,
                "the last picture may still be copied when this one is cleared; its layout changes before the write",
            ),
        };
        let (before, after, why) = match plan.resolves_output() {
            true if first == Place::Lighting => (
                vec![read, render_pass::RESOLVE],
                first_use.or(light_write(plan)),
                "frames in flight share the samples and the output: the last frame must have resolved the ones and let go of the other",
            ),
            true => (
                vec![read, render_pass::RESOLVE],
                first_use,
                "the last picture may still be copied when samples are resolved into this one; its layout changes before the write",
            ),
            false => (vec![read], first_use, why),
        };
        table.push(subpass("output-reuse", (Place::Outside, first), &before, &[after], why));
    }
    if let Some(transparency) = plan.transparency {
        table.extend(transparent_edges(plan, transparency));
    }
    if plan.has_tonemap_subpass() {
        table.push(hdr_to_tonemap(last_light, light_use));
    }
    let read_back = "COPY reads the picture after the pass, in the layout that the pass leaves it in";
    if plan.fxaa {
        table.extend(fxaa_edges(last, last_use));
        let fxaa = (Place::Fxaa, Place::Outside);
        table.push(fxaa_pass("read-back", fxaa, fxaa::PICTURE_WRITE, copy::READ, read_back));
    } else {
        table.push(subpass("read-back", (last, Place::Outside), &[last_use], &[copy::READ], read_back));
    }
    table.push(picture_to_host());
    table
}

fn picture_to_host() -> Edge {
    Edge {
        name: "picture-to-host",
        carrier: Carrier::BufferBarrier,
        from: Place::Copy,
        to: Place::Host,
        before: copy::WRITE,
        after: copy::HOST_READ,
        by_region: false,
        why: "a fence alone does not make the copy's writes visible to the CPU",
    }
}

/// The row of this name. The frame asks only for rows that its plan has.
///
/// # Panics
/// When the plan has no such row: a mistake in the frame, not in its input.
pub fn row(plan: &FramePlan, name: &str) -> Edge {
    let found = table(plan).into_iter().find(|edge| edge.name == name);
    found.unwrap_or_else(|| panic!("the plan has no dependency {name}"))
}

fn subpass(name: &'static str, (from, to): (Place, Place), before: &[Use], after: &[Use], why: &'static str) -> Edge {
    Edge {
        name,
        carrier: Carrier::MainPass,
        from,
        to,
        before: Use::all(before),
        after: Use::all(after),
        // Between two subpasses each pixel reads only itself, so a tiler never leaves the tile.
        by_region: ![from, to].iter().any(|place| matches!(place, Place::Outside | Place::Fxaa)),
        why,
    }
}

/// What FXAA waits for. The main pass hands it the output.
fn fxaa_edges(last: Place, output_write: Use) -> [Edge; 2] {
    [
        subpass(
            "output-to-fxaa",
            (last, Place::Fxaa),
            &[output_write],
            &[fxaa::OUTPUT_READ],
            "FXAA samples a pixel's neighbours, so that the whole output must be there, in the layout that the pass leaves it in",
        ),
        fxaa_pass(
            "picture-reuse",
            (Place::Outside, Place::Fxaa),
            copy::READ,
            fxaa::PICTURE_WRITE,
            "the last picture may still be copied when this one is drawn; its layout changes before the write",
        ),
    ]
}

fn fxaa_pass(name: &'static str, (from, to): (Place, Place), before: Use, after: Use, why: &'static str) -> Edge {
    Edge { name, carrier: Carrier::FxaaPass, from, to, before, after, by_region: false, why }
}

fn shadow_edges(plan: &FramePlan) -> [Edge; 2] {
    let (reader, map_read) = match plan.light_path {
        LightPath::Compute => (Place::Tiled, tiled::MAP_READ),
        LightPath::Forward | LightPath::ForwardNaive => (Place::Forward, shadow::MAP_READ),
        _ => (Place::Lighting, shadow::MAP_READ),
    };
    [
        Edge {
            name: "shadow-map-reuse",
            carrier: Carrier::ShadowPass,
            from: Place::Outside,
            to: Place::Shadow,
            before: map_read.or(shadow::MAP_WRITE),
            after: shadow::MAP_WRITE,
            by_region: false,
            why: "frames share the maps: LIGHTING of the last one may still read what this one clears; and maps of one layer follow each other",
        },
        Edge {
            name: "shadow-map-to-lighting",
            carrier: Carrier::ShadowPass,
            from: Place::Shadow,
            to: reader,
            before: shadow::MAP_WRITE,
            after: map_read,
            by_region: false,
            why: "LIGHTING loads any texel of a map that SHADOW wrote and stored",
        },
    ]
}

/// Frames in flight share one G-buffer, and the HDR target where there is one.
fn gbuffer_reuse(plan: &FramePlan) -> Edge {
    let mut before = match plan.transparency {
        Some(_) => vec![transparent::DEPTH_DROP, transparent::DEPTH_READ],
        None => vec![lighting::DEPTH_DROP, lighting::DEPTH_READ],
    };
    let mut after = vec![geometry::DEPTH_TEST];
    // What LIGHTING or VIEW read and dropped.
    if plan.geometry_locations() > 0 {
        before.extend([lighting::GBUFFER_READ, lighting::COLOR_DROP]);
        after.push(color_use(plan));
    }
    if plan.emissive {
        before.push(match light_target(plan) {
            // Its clear waits for TONEMAP of the last frame to have let go of it.
            Target::Hdr => tonemap::HDR_READ.or(tonemap::HDR_DROP),
            Target::Samples => render_pass::RESOLVE,
            _ => copy::READ,
        });
    }
    subpass(
        "gbuffer-reuse",
        (Place::Outside, Place::Geometry),
        &before,
        &after,
        "frames in flight share the targets: the last frame must have read and dropped them, and a DONT_CARE store is a write",
    )
}

fn color_use(plan: &FramePlan) -> Use {
    if plan.shading == Shading::ShowOverdraw { geometry::COUNT_BLEND } else { geometry::COLOR_WRITE }
}

fn gbuffer_to_lighting(plan: &FramePlan) -> Edge {
    let mut before = vec![geometry::DEPTH_TEST];
    let mut after = vec![lighting::DEPTH_READ];
    if plan.transparency.is_none() {
        after.push(lighting::DEPTH_DROP);
    }
    if plan.geometry_locations() > 0 {
        before.push(color_use(plan));
        after.extend([lighting::GBUFFER_READ, lighting::COLOR_DROP]);
    }
    if plan.blends_light() {
        after.push(lighting::LIGHT_BLEND);
    }
    let why = match plan.transparency {
        Some(_) => {
            "LIGHTING reads what GEOMETRY wrote, tests against its depth, and as the last user drops all but that"
        }
        None => "LIGHTING reads what GEOMETRY wrote, tests against its depth, and as the last user drops it all",
    };
    subpass("gbuffer-to-lighting", (Place::Geometry, Place::Lighting), &before, &after, why)
}

/// Samples that LIGHTING is the first to touch, and a later subpass resolves.
fn samples_reuse(plan: &FramePlan) -> Edge {
    subpass(
        "samples-reuse",
        (Place::Outside, Place::Lighting),
        &[render_pass::RESOLVE],
        &[light_write(plan)],
        "frames in flight share the samples: the last frame must have resolved and dropped what this one clears",
    )
}

/// The subpass after which the pass resolves the samples into the output, where it does.
pub(super) fn resolving(plan: &FramePlan) -> Option<Place> {
    plan.resolves_output().then(|| last_light(plan).0)
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

/// FORWARD is the first to touch all that it draws into.
fn forward_edge(plan: &FramePlan) -> Edge {
    // How the last frame let go of depth, and of the light.
    let depth = match plan.transparency {
        Some(_) => transparent::DEPTH_DROP.or(transparent::DEPTH_READ),
        None => forward::DEPTH_TEST,
    };
    let output = if plan.fxaa { fxaa::OUTPUT_READ } else { copy::READ };
    let (before, after) = match light_target(plan) {
        Target::Hdr => (tonemap::HDR_READ.or(tonemap::HDR_DROP), forward::LIGHT_WRITE),
        // With its samples FORWARD has the output, into which they are resolved; else a later subpass has.
        Target::Samples if plan.transparency.is_none() => (output.or(render_pass::RESOLVE), render_pass::RESOLVE),
        Target::Samples => (render_pass::RESOLVE, forward::LIGHT_WRITE),
        _ => (output, forward::LIGHT_WRITE),
    };
    subpass(
        "targets-reuse",
        (Place::Outside, Place::Forward),
        &[depth, before],
        &[forward::DEPTH_TEST, after],
        "frames in flight share the targets: the last frame must have read or copied what this one clears, and dropped the rest",
    )
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
            "lighting-to-transparent",
            (Place::Lighting, Place::Transparent),
            &[lit[0], lit[1], light],
            &[depth[0], depth[1], transparent::BLEND],
            "TRANSPARENT blends over what LIGHTING wrote, tests against the depth that LIGHTING read, and as the last user drops that",
        )],
        Transparency::Oit => vec![
            sums_reuse(),
            subpass(
                "lighting-to-transparent",
                (Place::Lighting, Place::Transparent),
                &lit,
                &depth,
                "TRANSPARENT tests against the depth that LIGHTING read, and as the last user drops it",
            ),
            subpass(
                "lighting-to-composite",
                (Place::Lighting, Place::Composite),
                &[light],
                &[composite::LIGHT_BLEND],
                "COMPOSITE blends over what LIGHTING wrote",
            ),
            sums_to_composite(),
        ],
    }
}

fn transparent_after_forward(transparency: Transparency) -> Vec<Edge> {
    let depth = [transparent::DEPTH_READ, transparent::DEPTH_DROP];
    let (from, light) = (Place::Forward, forward::LIGHT_WRITE);
    match transparency {
        Transparency::Sorted => vec![subpass(
            "forward-to-transparent",
            (from, Place::Transparent),
            &[forward::DEPTH_TEST, light],
            &[depth[0], depth[1], transparent::BLEND],
            "TRANSPARENT blends over what FORWARD wrote, tests against depth, and as the last user drops that",
        )],
        Transparency::Oit => vec![
            sums_reuse(),
            subpass(
                "forward-to-transparent",
                (from, Place::Transparent),
                &[forward::DEPTH_TEST],
                &depth,
                "TRANSPARENT tests against depth, and as the last user drops it",
            ),
            subpass(
                "forward-to-composite",
                (from, Place::Composite),
                &[light],
                &[composite::LIGHT_BLEND],
                "COMPOSITE blends over what FORWARD wrote",
            ),
            sums_to_composite(),
        ],
    }
}

fn sums_reuse() -> Edge {
    subpass(
        "sums-reuse",
        (Place::Outside, Place::Transparent),
        &[composite::SUM_READ, composite::SUM_DROP],
        &[transparent::BLEND],
        "frames in flight share the sums: COMPOSITE of the last frame must have read and dropped what this one clears",
    )
}

fn sums_to_composite() -> Edge {
    subpass(
        "sums-to-composite",
        (Place::Transparent, Place::Composite),
        &[transparent::BLEND],
        &[composite::SUM_READ, composite::SUM_DROP],
        "COMPOSITE reads the sums of its pixel, and as the last user drops them",
    )
}

fn hdr_to_tonemap(from: Place, light: Use) -> Edge {
    subpass(
        "hdr-to-tonemap",
        (from, Place::Tonemap),
        &[light],
        &[tonemap::HDR_READ, tonemap::HDR_DROP],
        "TONEMAP reads the light of its pixel, and as the last user drops the HDR target",
    )
}

/// Where no surface emits, LIGHTING is the first to touch the HDR target.
fn hdr_reuse(plan: &FramePlan) -> Edge {
    subpass(
        "hdr-reuse",
        (Place::Outside, Place::Lighting),
        &[tonemap::HDR_READ, tonemap::HDR_DROP],
        &[light_write(plan)],
        "frames in flight share the HDR target: TONEMAP of the last frame must have read and dropped what this one clears",
    )
}

/// The main pass ends with GEOMETRY; a compute pass reads what it stored and writes the output.
fn tiled_edges() -> [Edge; 4] {
    let row = |name, carrier, (from, to), before, after, why| Edge {
        name,
        carrier,
        from,
        to,
        before,
        after,
        // A work group reads pixels that other fragments wrote.
        by_region: false,
        why,
    };
    let written = geometry::DEPTH_TEST.or(geometry::COLOR_WRITE);
    [
        row(
            "gbuffer-reuse",
            Carrier::MainPass,
            (Place::Outside, Place::Geometry),
            tiled::GBUFFER_READ,
            written,
            "frames in flight share the targets: TILED of the last frame must have read what this one overwrites",
        ),
        row(
            "gbuffer-to-tiled",
            Carrier::MainPass,
            (Place::Geometry, Place::Tiled),
            written,
            tiled::GBUFFER_READ,
            "TILED reads what GEOMETRY stored, in the layout that the pass leaves it in",
        ),
        row(
            "output-reuse",
            Carrier::ImageBarrier(vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL),
            (Place::Outside, Place::Tiled),
            copy::READ,
            tiled::OUTPUT_WRITE,
            "the last picture may still be copied when this one is written",
        ),
        row(
            "read-back",
            Carrier::ImageBarrier(vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
            (Place::Tiled, Place::Outside),
            tiled::OUTPUT_WRITE,
            copy::READ,
            "COPY reads the picture that TILED wrote",
        ),
    ]
}

#[cfg(test)]
mod tests;
