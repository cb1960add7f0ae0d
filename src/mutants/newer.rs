//! Layers after [`LAYER`](crate::frame::edges::unreported_mutants::LAYER): mutants that they notice and it misses, and mutants that one of their
//! false messages hides. They were found with 1.4.363; layers between the two may have fewer.

use super::Mutant;
use crate::frame::edges::Side;
use crate::frame::edges::unreported_mutants::Part;
use crate::gpu::vk::{self, AccessFlags, PipelineStageFlags};
use crate::scene::View;

/// Mutants that newer layers notice, for one reason.
#[derive(Debug)]
struct NewerLayers {
    /// The first layer that was seen to notice them, packed as Vulkan packs it.
    from: u32,
    is_about: fn(&Mutant) -> bool,
}

/// Mutants that newer layers no longer notice, for one reason.
#[derive(Debug)]
pub struct Hidden {
    /// The first layer that was seen to miss them, packed as Vulkan packs it.
    pub from: u32,
    is_about: fn(&Mutant) -> bool,
    /// Why the newer ones stay silent, in a sentence.
    pub why: &'static str,
}

/// The newest layer that was tried.
const NEWEST: u32 = vk::make_api_version(0, 1, 4, 363);

/// Returns true if a layer of this version notices a mutant that [`LAYER`](crate::frame::edges::unreported_mutants::LAYER) misses.
pub fn notices(layer: u32, mutant: &Mutant) -> bool {
    NEWER_LAYERS.iter().any(|entry| layer >= entry.from && (entry.is_about)(mutant))
}

/// The first reason for which a layer of this version misses a mutant that older ones notice.
pub fn reason(layer: u32, mutant: &Mutant) -> Option<&'static Hidden> {
    HIDDEN.iter().find(|entry| layer >= entry.from && (entry.is_about)(mutant))
}

/// The rows by which the passes that draw the picture wait for the copy of the last one.
const OVER_THE_PICTURE: [&str; 7] = [
    "lighting-reuse",
    "transparent-reuse",
    "composite-reuse",
    "fog-reuse",
    "tonemap-reuse",
    "output-reuse",
    "fxaa-reuse",
];

static NEWER_LAYERS: &[NewerLayers] = &[
    // Two dispatches that read and write the same buffer, one after the other. If a barrier makes the first one's writes visible to the second one's
    // writes, the layer does not check whether they are visible to its reads.
    NewerLayers {
        from: NEWEST,
        is_about: |mutant| {
            let only_reads =
                matches!(mutant.part, Part::Bits(Side::After, bits) if bits.access == AccessFlags::SHADER_READ);
            !only_reads
                && [
                    "cull-to-arrange",
                    "arrange-to-fill",
                    "bloom-to-spread",
                    "spread-to-spread",
                    "simulate-to-sort",
                    "sort-to-sort",
                    "scatter-to-integrate",
                ]
                .contains(&mutant.edge.label)
        },
    },
    // A layout change after the copy that an earlier submission made.
    NewerLayers {
        from: NEWEST,
        is_about: |mutant| match mutant.part {
            // Where FXAA has read the output, and not a copy, it is still taken to be ordered.
            Part::Row => {
                let waits_for_fxaa = mutant.edge.before.stage == PipelineStageFlags::FRAGMENT_SHADER;
                OVER_THE_PICTURE.contains(&mutant.edge.label) && !waits_for_fxaa
            }
            Part::Bits(Side::Before, bits) => {
                let label = mutant.edge.label;
                let others = ["forward-reuse", "geometry-reuse"];
                bits.stage == PipelineStageFlags::TRANSFER
                    && (OVER_THE_PICTURE.contains(&label) || others.contains(&label))
            }
            _ => false,
        },
    },
    // What a row from OUTSIDE to another subpass makes available is no longer taken to be so for this attachment.
    NewerLayers {
        from: NEWEST,
        is_about: |mutant| {
            matches!(mutant.part, Part::Bits(Side::Before, bits) if bits.access == AccessFlags::COLOR_ATTACHMENT_WRITE)
                && ["lighting-reuse", "transparent-reuse", "forward-reuse"].contains(&mutant.edge.label)
        },
    },
    // A write after a read that nothing has made visible to it.
    NewerLayers {
        from: NEWEST,
        is_about: |mutant| {
            matches!(mutant.part, Part::Bits(Side::After, bits) if bits.access == AccessFlags::SHADER_WRITE)
                && mutant.edge.label == "skin-reuse"
        },
    },
    // The write of a blend is no longer taken to be ordered by its read, after an image barrier.
    NewerLayers {
        from: NEWEST,
        is_about: |mutant| {
            matches!(mutant.part, Part::Bits(Side::After, bits) if bits.access == AccessFlags::COLOR_ATTACHMENT_WRITE)
                && mutant.edge.label == "picture-to-overlay"
        },
    },
];

static HIDDEN: &[Hidden] = &[
    Hidden {
        from: NEWEST,
        is_about: |mutant| {
            matches!(mutant.part, Part::Bits(Side::After, bits) if bits.access == AccessFlags::VERTEX_ATTRIBUTE_READ)
                && ["upload-to-vertices", "skin-to-readers"].contains(&mutant.edge.label)
                // A view of shadow maps has no other draws.
                || mutant.edge.label == "skin-to-readers" && mutant.case.settings.view == View::ShadowMap
        },
        why: "the layer no longer looks at the vertices that an indexed draw fetches (`ValidateDrawVertexIndex` of its source says so), only at the indices",
    },
    Hidden {
        from: NEWEST,
        is_about: |mutant| {
            matches!(mutant.part, Part::Bits(Side::After, bits) if bits.stage == PipelineStageFlags::FRAGMENT_SHADER)
                && mutant.edge.label == "upload-to-textures"
                && mutant.plan.is_lit_by_sky()
        },
        why: "the layer does not hold a read against the write before it if it happens after another read (`IsRAWHazard` of its source): PREFILTER has read the sky, \
              and SKY waits for PREFILTER, to which alone the copy is visible",
    },
];
