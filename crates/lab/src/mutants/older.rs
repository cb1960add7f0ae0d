//! Blind spots that layers before [`LAYER`] have in addition to the blind spots of [`LAYER`] itself. They were found with 1.3.239; layers between the
//! two may have fewer.

use super::Mutant;
use super::unreported::LAYER;
use afterlight::frame::list::RenderPassName;
use afterlight::frame::rows::{Endpoint, Row, RowPart, Side, SyncKind};
use afterlight::gpu::vk::{AccessFlags2, PipelineStageFlags2};

/// Mutants that an older layer does not notice, for one reason.
#[derive(Debug)]
pub struct OlderLayers {
    /// The first layer that notices them, packed as Vulkan packs it.
    pub seen_from: u32,
    is_about: fn(&Mutant) -> bool,
    /// Why the older ones stay silent, in a sentence.
    pub why: &'static str,
}

/// The first reason for which a layer of this version misses a mutant.
pub fn reason(layer: u32, mutant: &Mutant) -> Option<&'static OlderLayers> {
    OLDER_LAYERS.iter().find(|entry| layer < entry.seen_from && (entry.is_about)(mutant))
}

/// The list.
pub static OLDER_LAYERS: &[OlderLayers] = &[
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| is_of_buffer(&mutant.row) && !is_sampled_first(mutant, &mutant.row),
        why: "the layer notices hardly a hazard on a buffer: neither between compute shaders, nor on what draws fetch, nor after a copy in another submission",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| matches!(mutant.part, RowPart::Bits(..)) && mutant.row.is_between_subpasses(),
        why: "the layer does not look at the masks of a dependency between two subpasses: it takes each for one of all stages and accesses",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| {
            let row = &mutant.row;
            let follows_reads = enters(row) && follows_dispatch(row) && row.before.access.is_empty();
            let leads_there = |other: &&Row| other.from != row.from && other.waiting.contains(&row.to);
            let mut others = mutant.rows.of(SyncKind::BufferBarrier).filter(leads_there);
            follows_reads && others.any(|row| is_sampled_first(mutant, row))
        },
        why: "the layer lets the barrier of a buffer that the same subpass reads, of a later dispatch, order an attachment that an earlier one has read as well. By \
              then nothing says that the attachment is visible to the subpass",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: is_in_another_submission,
        why: "the layer looks at each submission by itself. What the frame before has done, uploads, and the copy to the CPU are in submissions of their own",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| {
            let reads = AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ;
            let is_load = matches!(mutant.part, RowPart::Bits(Side::After, bits) if bits.access == reads);
            is_load && enters(&mutant.row) && follows_dispatch(&mutant.row)
        },
        why: "the layer does not notice that a load operation reads after a layout change that is not visible to it, where the same dependency makes the change \
              visible to other accesses",
    },
];

fn is_of_buffer(row: &Row) -> bool {
    matches!(row.carrier, SyncKind::BufferBarrier | SyncKind::MemoryBarrier)
}

/// Returns true if a render pass waits by this row for an earlier pass of the same frame.
fn enters(row: &Row) -> bool {
    row.carrier.is_render_pass() && row.from != Endpoint::OUTSIDE && !row.is_between_subpasses()
}

fn follows_dispatch(row: &Row) -> bool {
    row.before.stage == PipelineStageFlags2::COMPUTE_SHADER
}

/// Returns true if fragment shaders wait, in a subpass with which a render pass begins. These are the draws whose look-ups the layer follows.
fn is_sampled_first(mutant: &Mutant, row: &Row) -> bool {
    let begins = |place: &Endpoint| mutant.rows.of(SyncKind::Subpass(RenderPassName::of(*place))).next().is_some();
    row.after.stage == PipelineStageFlags2::FRAGMENT_SHADER && row.waiting.iter().any(begins)
}

/// Returns true if the part orders work of another submission, before or after the submissions that the layer looks at.
fn is_in_another_submission(mutant: &Mutant) -> bool {
    let row = &mutant.row;
    let (begins_outside, ends_outside) = (row.from == Endpoint::OUTSIDE, row.to == Endpoint::OUTSIDE);
    let is_prepared = !row.from.is_pass() && !begins_outside && row.to != Endpoint::UPLOAD;
    match mutant.part {
        RowPart::Row => {
            row.carrier.is_render_pass() && (begins_outside || ends_outside) && !changes_after_dispatch(mutant)
        }
        RowPart::Bits(Side::Before, _) => begins_outside,
        RowPart::Bits(Side::After, _) => ends_outside || is_prepared,
        RowPart::AcrossSamples => false,
    }
}

/// Returns true if an attachment's layout changes in a render pass that waits for a dispatch, and no other dependency is for its colours. The layer sees that
/// nothing orders the change.
fn changes_after_dispatch(mutant: &Mutant) -> bool {
    let row = &mutant.row;
    let colours = PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
    let is_of_frames_alone = [colours, PipelineStageFlags2::COMPUTE_SHADER].contains(&row.before.stage);
    let entering = || mutant.rows.of(row.carrier).filter(|row| enters(row));
    let waits_for_colours = |other: &Row| other.waiting.contains(&row.to) && other.after.stage.contains(colours);
    row.from == Endpoint::OUTSIDE
        && is_of_frames_alone
        && entering().any(follows_dispatch)
        && !entering().any(waits_for_colours)
}
