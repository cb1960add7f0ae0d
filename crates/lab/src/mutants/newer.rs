//! Mutants that layers after [`LAYER`](super::unreported::LAYER) no longer notice. They were found with 1.4.363; layers between the two
//! may notice them. What newer layers notice and it misses stands beside the reason why it does ([`UnreportedMutants::seen_from`]).
//!
//! [`UnreportedMutants::seen_from`]: super::unreported::UnreportedMutants::seen_from

use super::Mutant;
use super::unreported::NEWEST;
use afterlight::frame::rows::{RowPart, Side};
use afterlight::gpu::vk::{AccessFlags2, PipelineStageFlags2};
use afterlight::scene::View;

/// Mutants that newer layers no longer notice, for one reason.
#[derive(Debug)]
pub struct Hidden {
    /// The first layer that was seen to miss them, packed as Vulkan packs it.
    pub from: u32,
    is_about: fn(&Mutant) -> bool,
    /// Why the newer ones stay silent, in a sentence.
    pub why: &'static str,
}

/// The first reason for which a layer of this version misses a mutant that older ones notice.
pub fn reason(layer: u32, mutant: &Mutant) -> Option<&'static Hidden> {
    HIDDEN.iter().find(|entry| layer >= entry.from && (entry.is_about)(mutant))
}

static HIDDEN: &[Hidden] = &[
    Hidden {
        from: NEWEST,
        is_about: |mutant| {
            matches!(mutant.part, RowPart::Bits(Side::After, bits) if bits.access == AccessFlags2::VERTEX_ATTRIBUTE_READ)
                && ["upload-to-vertices", "skin-to-readers"].contains(&mutant.row.label)
                // A view of shadow maps has no other draws.
                || mutant.row.label == "skin-to-readers" && mutant.case.settings.view == View::ShadowMap
        },
        why: "the layer no longer looks at the vertices that an indexed draw fetches (`ValidateDrawVertexIndex` of its source says so), only at the indices",
    },
    Hidden {
        from: NEWEST,
        is_about: |mutant| {
            let is_read_before = mutant.row.after.stage.contains(PipelineStageFlags2::COMPUTE_SHADER);
            matches!(mutant.part, RowPart::Bits(Side::After, bits) if bits.stage == PipelineStageFlags2::FRAGMENT_SHADER)
                && mutant.row.label == "upload-to-textures"
                && is_read_before
        },
        why: "the layer does not hold a read against the write before it if it happens after another read (`IsRAWHazard` of its source): a dispatch has read the \
              texture, and draws wait for the dispatch, to which alone the copy is visible",
    },
];
