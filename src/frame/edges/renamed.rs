//! Names that rows had when each was written for a pair of passes, so that commands which name them still work, and the reason why a plan has no row of a name.

use super::{Edge, Edges};
use crate::frame::list;
use crate::gpu::vk;
use crate::passes::{Place, Presence};
use crate::plan::{Canvas, Encoding, FramePlan, Transfer};

/// Former names, each with the names of today of which the first that a plan has takes its place. `*` stands for any place.
const RENAMED: &[(&str, &[&str])] = &[
    ("deformed-reuse", &["skin-reuse"]),
    ("skin-to-draws", &["skin-to-readers"]),
    ("culled-reuse", &["cull-reuse"]),
    ("fill-to-draws", &["fill-to-readers"]),
    ("froxels-reuse", &["scatter-reuse"]),
    ("froxels-to-fog", &["integrate-to-readers"]),
    ("shadow-map-reuse", &["shadow-reuse"]),
    ("shadow-map-to-lighting", &["shadow-to-*"]),
    ("particles-reuse", &["simulate-reuse"]),
    ("particles-to-draw", &["sort-to-readers", "simulate-to-readers"]),
    ("pyramid-to-cull", &["pyramid-to-readers"]),
    ("spread-to-tonemap", &["spread-to-readers"]),
    ("gbuffer-reuse", &["geometry-reuse"]),
    ("gbuffer-to-lighting", &["geometry-to-lighting"]),
    ("gbuffer-to-ao", &["geometry-to-ao"]),
    ("gbuffer-to-tiled", &["geometry-to-tiled"]),
    ("visibility-to-denoise", &["visibility-to-ao-denoise"]),
    ("occlusion-to-lighting", &["ao-denoise-to-lighting"]),
    ("occlusion-to-tiled", &["albedo-to-tiled"]),
    ("ao-to-fog", &["ao-denoise-to-fog"]),
    ("ao-to-transparent", &["ao-denoise-to-transparent"]),
    ("hdr-reuse", &["lighting-reuse"]),
    ("samples-reuse", &["lighting-reuse"]),
    ("output-reuse", &["tonemap-reuse", "lighting-reuse"]),
    ("targets-reuse", &["forward-reuse", "lighting-reuse"]),
    ("sums-reuse", &["transparent-reuse"]),
    ("sums-to-composite", &["transparent-to-composite"]),
    ("rays-to-resolve", &["rays-to-reflect-resolve"]),
    ("light-to-resolve", &["hdr-to-reflect-resolve"]),
    ("resolve-to-fog", &["reflect-resolve-to-fog"]),
    ("resolve-to-transparent", &["reflect-resolve-to-transparent"]),
    ("resolve-to-composite", &["reflect-resolve-to-composite"]),
    ("hdr-to-tonemap", &["*-to-tonemap"]),
    ("hdr-to-bloom", &["*-to-bloom"]),
    ("light-to-taa", &["hdr-to-taa", "*-to-taa"]),
    ("depth-to-taa", &["*-to-taa"]),
    ("depth-to-velocity", &["*-to-velocity"]),
    ("history-reuse", &["taa-reuse"]),
    ("output-to-fxaa", &["*-to-fxaa"]),
    ("picture-reuse", &["fxaa-reuse"]),
    ("picture-to-tone", &["*-to-tone"]),
];

/// The row that has taken the place of one which had this name.
pub(super) fn successor<'a>(table: &'a Edges, name: &str) -> Option<&'a Edge> {
    let (_, patterns) = RENAMED.iter().find(|(former, _)| *former == name)?;
    // Where several wait for a pass, it has one row for all of them.
    let readers = |pattern: &str| Some(format!("{}-to-readers", pattern.split_once("-to-")?.0));
    let named = |pattern: &str| table.iter().find(|edge| fits(pattern, edge.label));
    patterns.iter().find_map(|pattern| named(pattern).or_else(|| named(&readers(pattern)?)))
}

fn fits(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        Some((before, after)) => name.starts_with(before) && name.ends_with(after),
        None => pattern == name,
    }
}

/// The reason why a plan has no row of a name: the window or the pass that it lacks.
pub fn lack(plan: &FramePlan, name: &str) -> Option<String> {
    let format = vk::Format::B8G8R8A8_SRGB;
    let encoding = Encoding { transfer: Transfer::Srgb, headroom: 1.0 };
    let presented = [Canvas::Straight(format), Canvas::Enlarge(format), Canvas::Encode(encoding)];
    let has = |canvas| super::table(&plan.clone().presented_as(canvas)).iter().any(|edge| edge.label == name);
    if plan.presented.is_none() && presented.into_iter().any(has) {
        return Some("no window".into());
    }
    let own = RENAMED.iter().find(|(former, _)| *former == name).map_or(name, |(_, patterns)| patterns[0]);
    let (from, to) = own.split_once("-to-").or(own.strip_suffix("-reuse").map(|to| ("", to)))?;
    [from, to].into_iter().find_map(|one| {
        let pass = list::passes().into_iter().find(|pass| spelled(pass.place) == one)?;
        match (pass.presence)(plan) {
            Presence::Out(why) => Some(format!("no {} pass ({why})", pass.place)),
            Presence::In(_) => None,
        }
    })
}

/// A place as rows' names have it: `ao-denoise`.
pub(super) fn spelled(place: Place) -> String {
    place.name().to_lowercase().replace('_', "-")
}
