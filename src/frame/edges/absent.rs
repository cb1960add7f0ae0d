//! Why a plan lacks a row: a pass at one of its ends is not in the frame, another row orders the same, or a sentence says it.

use super::{Edges, RowName};
use crate::passes::{
    NO_WINDOW, Pass, Presence, ao, ao_denoise, arrange, bloom, composite, cull, encode, fill, fog, forward, fxaa,
    geometry, hiz, integrate, lighting, occluders, overlay, present, pyramid, reflect, reflect_resolve, scatter,
    shadow, simulate, skin, sort, split, taa, tiled, tone, tonemap, transparent, velocity,
};
use crate::plan::{Canvas, FramePlan, Target};

/// A row that a plan's frames do not have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Absent {
    /// The row's name.
    pub name: RowName,
    /// The part that these frames lack, or the row that orders the same.
    pub why: String,
}

/// The parts that a row needs. The first one missing is the reason why the row is absent.
struct Needs {
    row: RowName,
    passes: &'static [&'static Pass],
    /// Says what else is missing.
    lacks: fn(&FramePlan) -> Option<&'static str>,
    /// Rows that order the same, of which a plan has one at most in this row's place.
    instead: &'static [RowName],
}

const NOTHING: fn(&FramePlan) -> Option<&'static str> = |_| None;
const WINDOW: fn(&FramePlan) -> Option<&'static str> = |plan| plan.presented.is_none().then_some(NO_WINDOW);
const TEXTURES: fn(&FramePlan) -> Option<&'static str> =
    |plan| (!plan.uploads.textures).then_some("no texture is uploaded");
const LEVELS: fn(&FramePlan) -> Option<&'static str> =
    |plan| (!plan.uploads.mip_levels).then_some("no texture has levels that are made from each other");

const NO_SKY: fn(&FramePlan) -> Option<&'static str> =
    |plan| (!plan.is_lit_by_sky()).then_some("no sky lights the scene");

const fn needs(row: RowName, passes: &'static [&'static Pass]) -> Needs {
    Needs { row, passes, lacks: NOTHING, instead: &[] }
}

const fn lacks(row: RowName, lacks: fn(&FramePlan) -> Option<&'static str>) -> Needs {
    Needs { row, passes: &[], lacks, instead: &[] }
}

/// Every row that some plan has.
static ROWS: &[Needs] = &[
    lacks(RowName::UPLOAD_TO_VERTICES, |plan| {
        let uploads = plan.uploads.vertices || plan.uploads.volumes;
        (!uploads).then_some("no mesh is uploaded")
    }),
    lacks(RowName::TEXTURE_TO_COPY, TEXTURES),
    lacks(RowName::LEVEL_TO_BLIT, LEVELS),
    lacks(RowName::BLIT_TO_TEXTURES, LEVELS),
    lacks(RowName::UPLOAD_TO_TEXTURES, TEXTURES),
    lacks(RowName::SKY_LIGHT_TO_PREFILTER, NO_SKY),
    lacks(RowName::PREFILTER_TO_LIGHTING, NO_SKY),
    needs(RowName::DEFORMED_REUSE, &[&skin::PASS]),
    needs(RowName::SKIN_TO_DRAWS, &[&skin::PASS]),
    needs(RowName::OCCLUDERS_REUSE, &[&occluders::PASS]),
    needs(RowName::OCCLUDERS_TO_PYRAMID, &[&occluders::PASS]),
    needs(RowName::PYRAMID_REUSE, &[&pyramid::PASS]),
    needs(RowName::PYRAMID_TO_CULL, &[&pyramid::PASS]),
    needs(RowName::CULLED_REUSE, &[&cull::PASS]),
    needs(RowName::CULL_TO_ARRANGE, &[&cull::PASS]),
    needs(RowName::ARRANGE_TO_FILL, &[&fill::PASS]),
    needs(RowName::FOUND_TO_HOST, &[&arrange::PASS]),
    needs(RowName::FILL_TO_DRAWS, &[&fill::PASS]),
    needs(RowName::FROXELS_REUSE, &[&scatter::PASS]),
    needs(RowName::SCATTER_TO_INTEGRATE, &[&integrate::PASS]),
    needs(RowName::FROXELS_TO_FOG, &[&integrate::PASS, &fog::PASS]),
    needs(RowName::SHADOW_ATLAS_TO_CLEAR, &[&shadow::PASS]),
    needs(RowName::CLEAR_TO_SHADOW_MAPS, &[&shadow::PASS]),
    needs(RowName::SHADOW_MAP_REUSE, &[&shadow::PASS]),
    needs(RowName::SHADOW_MAP_TO_LIGHTING, &[&shadow::PASS]),
    needs(RowName::PARTICLES_REUSE, &[&simulate::PASS]),
    needs(RowName::SIMULATE_TO_SORT, &[&sort::PASS]),
    needs(RowName::SORT_TO_SORT, &[&sort::PASS]),
    needs(RowName::PARTICLES_TO_DRAW, &[&simulate::PASS]),
    needs(RowName::GBUFFER_REUSE, &[&geometry::PASS]),
    Needs {
        instead: &[RowName::OCCLUSION_TO_LIGHTING],
        ..needs(RowName::GBUFFER_TO_LIGHTING, &[&geometry::PASS, &lighting::PASS])
    },
    Needs { instead: &[RowName::GBUFFER_REUSE], ..needs(RowName::HDR_REUSE, &[&lighting::PASS, &tonemap::PASS]) },
    Needs {
        lacks: |plan| {
            let has_samples = plan.light_target() == Target::Samples;
            (!has_samples).then_some("no samples are resolved into the output")
        },
        instead: &[RowName::TARGETS_REUSE, RowName::GBUFFER_REUSE],
        ..needs(RowName::SAMPLES_REUSE, &[&lighting::PASS])
    },
    Needs {
        instead: &[RowName::SPREAD_TO_TONEMAP, RowName::HDR_TO_TONEMAP, RowName::TARGETS_REUSE, RowName::GBUFFER_REUSE],
        ..needs(RowName::OUTPUT_REUSE, &[])
    },
    Needs {
        instead: &[RowName::OUTPUT_REUSE, RowName::GBUFFER_REUSE, RowName::HDR_REUSE],
        ..needs(RowName::TARGETS_REUSE, &[])
    },
    Needs { instead: &[RowName::RESOLVE_TO_FOG], ..needs(RowName::LIGHTING_TO_FOG, &[&lighting::PASS, &fog::PASS]) },
    needs(RowName::FORWARD_TO_FOG, &[&forward::PASS, &fog::PASS]),
    Needs {
        instead: &[RowName::FOG_TO_TRANSPARENT, RowName::RESOLVE_TO_TRANSPARENT],
        ..needs(RowName::LIGHTING_TO_TRANSPARENT, &[&lighting::PASS, &transparent::PASS])
    },
    Needs {
        instead: &[RowName::FOG_TO_COMPOSITE, RowName::RESOLVE_TO_COMPOSITE],
        ..needs(RowName::LIGHTING_TO_COMPOSITE, &[&lighting::PASS, &composite::PASS])
    },
    Needs {
        instead: &[RowName::FOG_TO_TRANSPARENT],
        ..needs(RowName::FORWARD_TO_TRANSPARENT, &[&forward::PASS, &transparent::PASS])
    },
    Needs {
        instead: &[RowName::FOG_TO_COMPOSITE],
        ..needs(RowName::FORWARD_TO_COMPOSITE, &[&forward::PASS, &composite::PASS])
    },
    needs(RowName::FOG_TO_TRANSPARENT, &[&fog::PASS, &transparent::PASS]),
    needs(RowName::FOG_TO_COMPOSITE, &[&fog::PASS, &composite::PASS]),
    Needs { instead: &[RowName::RESOLVE_TO_TRANSPARENT], ..needs(RowName::SUMS_REUSE, &[&composite::PASS]) },
    needs(RowName::SUMS_TO_COMPOSITE, &[&composite::PASS]),
    Needs { instead: &[RowName::SPREAD_TO_TONEMAP], ..needs(RowName::HDR_TO_TONEMAP, &[&tonemap::PASS]) },
    needs(RowName::LIGHT_TO_TAA, &[&taa::PASS]),
    Needs {
        lacks: |plan| {
            let is_last = plan.sums.is_none() && !plan.averages_reflected();
            is_last.then_some("the subpass that writes the light last is the last to use depth, too")
        },
        instead: &[RowName::DEPTH_TO_VELOCITY, RowName::LIGHTING_TO_HIZ],
        ..needs(RowName::DEPTH_TO_TAA, &[&taa::PASS])
    },
    needs(RowName::DEPTH_TO_VELOCITY, &[&velocity::PASS]),
    Needs { instead: &[RowName::DEPTH_TO_VELOCITY], ..needs(RowName::VELOCITY_REUSE, &[&velocity::PASS]) },
    needs(RowName::VELOCITY_TO_TAA, &[&velocity::PASS]),
    needs(RowName::HISTORY_REUSE, &[&taa::PASS]),
    needs(RowName::TAA_TO_SHARPEN, &[&taa::PASS]),
    needs(RowName::HDR_TO_BLOOM, &[&bloom::PASS]),
    needs(RowName::BLOOM_REUSE, &[&bloom::PASS]),
    needs(RowName::BLOOM_TO_SPREAD, &[&bloom::SPREAD]),
    needs(RowName::SPREAD_TO_SPREAD, &[&bloom::SPREAD]),
    needs(RowName::SPREAD_TO_TONEMAP, &[&bloom::SPREAD]),
    needs(RowName::OUTPUT_TO_FXAA, &[&fxaa::PASS]),
    needs(RowName::PICTURE_REUSE, &[&fxaa::PASS]),
    needs(RowName::PICTURE_TO_TONE, &[&tone::PASS]),
    needs(RowName::GBUFFER_TO_AO, &[&ao::PASS]),
    needs(RowName::VISIBILITY_REUSE, &[&ao::PASS]),
    needs(RowName::VISIBILITY_TO_DENOISE, &[&ao_denoise::PASS]),
    needs(RowName::OCCLUSION_TO_LIGHTING, &[&ao_denoise::PASS, &lighting::PASS]),
    Needs {
        instead: &[RowName::RESOLVE_TO_TRANSPARENT, RowName::RESOLVE_TO_FOG],
        ..needs(RowName::AO_TO_TRANSPARENT, &[&ao::PASS, &transparent::PASS])
    },
    needs(RowName::LIGHTING_TO_HIZ, &[&hiz::PASS]),
    needs(RowName::HIZ_REUSE, &[&hiz::PASS]),
    needs(RowName::HIZ_TO_REFLECT, &[&reflect::PASS]),
    needs(RowName::RAYS_REUSE, &[&reflect::PASS]),
    needs(RowName::RAYS_TO_RESOLVE, &[&reflect_resolve::PASS]),
    needs(RowName::LIGHT_TO_RESOLVE, &[&reflect_resolve::PASS]),
    needs(RowName::RESOLVE_TO_TRANSPARENT, &[&reflect_resolve::PASS, &transparent::PASS]),
    Needs {
        instead: &[RowName::FOG_TO_COMPOSITE],
        ..needs(RowName::RESOLVE_TO_COMPOSITE, &[&reflect_resolve::PASS, &composite::PASS])
    },
    needs(RowName::RESOLVE_TO_FOG, &[&reflect_resolve::PASS, &fog::PASS]),
    Needs { instead: &[RowName::RESOLVE_TO_FOG], ..needs(RowName::AO_TO_FOG, &[&ao::PASS, &fog::PASS]) },
    needs(RowName::OCCLUSION_TO_TILED, &[&ao_denoise::PASS, &tiled::PASS]),
    Needs { instead: &[RowName::GBUFFER_TO_AO], ..needs(RowName::GBUFFER_TO_TILED, &[&tiled::PASS]) },
    needs(RowName::READ_BACK, &[]),
    lacks(RowName::ACQUIRE, WINDOW),
    needs(RowName::SWAPCHAIN_TO_PRESENT, &[&present::PASS]),
    needs(RowName::PRESENT_TO_SWAPCHAIN, &[&present::PASS]),
    needs(RowName::PICTURE_TO_SPLIT, &[&split::PASS]),
    needs(RowName::SPLIT_TO_PICTURE, &[&split::PASS]),
    lacks(RowName::PICTURE_TO_COPY, COPIED_FROM_SWAPCHAIN),
    lacks(RowName::COPY_TO_PICTURE, COPIED_FROM_SWAPCHAIN),
    needs(RowName::PICTURE_TO_OVERLAY, &[&overlay::PASS]),
    needs(RowName::OVERLAY_TO_PICTURE, &[&overlay::PASS]),
    needs(RowName::PICTURE_TO_ENCODE, &[&encode::PASS]),
    needs(RowName::SWAPCHAIN_TO_ENCODE, &[&encode::PASS]),
    needs(RowName::ENCODE_TO_PICTURE, &[&encode::PASS]),
    needs(RowName::ENCODE_TO_SWAPCHAIN, &[&encode::PASS]),
    needs(RowName::PANEL_TO_COPY, &[&overlay::PASS]),
    needs(RowName::UPLOAD_TO_PANELS, &[&overlay::PASS]),
    lacks(RowName::PRESENT, WINDOW),
    needs(RowName::HOST_TO_FRAME, &[]),
    needs(RowName::FRAME_TO_HOST, &[]),
    needs(RowName::LAST_USE_TO_DESTROY, &[]),
    needs(RowName::PICTURE_TO_HOST, &[]),
    needs(RowName::COPY_TO_HOST, &[]),
    lacks(RowName::RESULTS_TO_HOST, |_| Some("only the formulas of `afterlight stress` have results")),
];

const COPIED_FROM_SWAPCHAIN: fn(&FramePlan) -> Option<&'static str> = |plan| match plan.presented {
    None => Some(NO_WINDOW),
    Some(Canvas::Straight(_) | Canvas::Enlarge(_)) => None,
    Some(Canvas::Encode(_) | Canvas::EncodeKept(_)) => Some("COPY takes the picture in the layout that it lies in"),
};

/// The rows that a plan's table lacks, each with why.
pub fn absent(plan: &FramePlan, table: &Edges) -> Vec<Absent> {
    let missing = ROWS.iter().filter(|needs| table.find(needs.row).is_none());
    missing.map(|needs| Absent { name: needs.row, why: needs.why(plan, table) }).collect()
}

impl Needs {
    fn why(&self, plan: &FramePlan, table: &Edges) -> String {
        let no_pass = self.passes.iter().find_map(|pass| match (pass.presence)(plan) {
            Presence::In(_) => None,
            Presence::Out(why) => Some(format!("no {} pass ({why})", pass.place)),
        });
        let instead = || self.instead.iter().find(|row| table.find(**row).is_some());
        no_pass
            .or_else(|| (self.lacks)(plan).map(str::to_owned))
            .or_else(|| instead().map(|row| format!("{row} orders it")))
            .unwrap_or_else(|| UNKNOWN.to_owned())
    }
}

/// No plan's rows are absent for this; a test looks for it.
const UNKNOWN: &str = "these frames have nothing for it to order";

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    use ash::vk;

    use super::super::table;
    use super::*;
    use crate::plan::{Encoding, OUTPUT_PLAIN, OUTPUT_SRGB, Transfer, samples};

    /// Sample plans, and those of pictures as windows have them.
    fn plans() -> Vec<(String, FramePlan)> {
        let mut all = samples::of_every_kind();
        let pictures: Vec<_> =
            all.iter().filter(|(_, plan)| [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output)).collect();
        let encoding = Encoding { transfer: Transfer::Srgb, headroom: 1.0 };
        let presented: Vec<_> = pictures
            .into_iter()
            .flat_map(|(name, plan)| {
                let format = if plan.is_tiled() { vk::Format::B8G8R8A8_UNORM } else { vk::Format::B8G8R8A8_SRGB };
                [
                    Canvas::Straight(format),
                    Canvas::Enlarge(format),
                    Canvas::Encode(encoding),
                    Canvas::EncodeKept(encoding),
                ]
                .map(|canvas| (format!("{name}, {canvas:?}"), plan.clone().presented_as(canvas)))
            })
            .collect();
        all.extend(presented);
        all
    }

    #[test]
    fn every_row_is_in_the_table_or_has_a_reason() {
        let mut reasons = BTreeSet::new();
        for (name, plan) in plans() {
            let table = table(&plan);
            let absent = absent(&plan, &table);
            assert_eq!(absent.len() + table.iter().count(), ROWS.len(), "{name}: a row is not listed, or listed twice");
            for Absent { name: row, why } in absent {
                assert_ne!(why, UNKNOWN, "{name}: {row}");
                reasons.insert((row, why));
            }
        }
        let has = |row, why: &str| reasons.iter().any(|(own, reason)| *own == row && reason == why);
        assert!(has(RowName::SHADOW_MAP_REUSE, "no SHADOW pass (no light casts a shadow)"));
        assert!(has(RowName::GBUFFER_TO_LIGHTING, "no GEOMETRY pass (surfaces are lit as they are drawn)"));
        assert!(has(RowName::GBUFFER_TO_LIGHTING, "no LIGHTING pass (TILED lights every pixel, by compute)"));
        assert!(has(RowName::OUTPUT_REUSE, "targets-reuse orders it"));
    }

    /// Each constant `RowName::... = Self("...")` of the sources.
    #[test]
    fn every_name_of_a_row_is_listed_once() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/frame/edges");
        let mut constants = BTreeSet::new();
        for entry in fs::read_dir(folder).expect("the sources") {
            let text = fs::read_to_string(entry.expect("a file").path()).expect("a source");
            let names = text.lines().filter_map(|line| {
                let is_public = ["pub const ", "pub(crate) const "].iter().any(|start| line.trim().starts_with(start));
                line.split_once(": Self = Self(\"").filter(|_| is_public)
            });
            constants.extend(names.filter_map(|(_, rest)| Some(rest.split_once('"')?.0.to_owned())));
        }
        let listed: BTreeSet<String> = ROWS.iter().map(|needs| needs.row.to_string()).collect();
        assert_eq!((listed.len(), &listed), (ROWS.len(), &constants));
    }
}
