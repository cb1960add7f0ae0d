//! Blind spots of layers in frames that are carried in other ways than by render passes with subpasses, by the API of Vulkan 1.0, in optimal
//! layouts, and on one queue.
//!
//! The reasons of the other lists were found with frames carried so, and may hold here or not. So a notice is never unexpected here.

use super::Mutant;
use super::unreported::{LAYER, NEWEST};
use afterlight::frame::layout_changes;
use afterlight::frame::list::{Step, StepList};
use afterlight::frame::rows::{Endpoint, Row, RowPart, Side, SyncKind};
use afterlight::gpu::Queue;
use afterlight::gpu::sync::{Layouts, SyncVersion};
use afterlight::gpu::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
use afterlight::plan::OtherQueues;
use afterlight::scene::Passes;

/// Mutants of such frames that layers may not notice, for one reason.
#[derive(Debug)]
pub struct CarriedFrames {
    /// The layers, packed as Vulkan packs them.
    is_of: fn(u32) -> bool,
    is_about: fn(&Mutant) -> bool,
    /// Why they stay silent, in a sentence.
    pub why: &'static str,
}

/// Returns true if the frames of a mutant are carried in another way.
pub fn is_carried(mutant: &Mutant) -> bool {
    let plan = mutant.plan;
    (plan.passes, plan.sync, plan.layouts) != (Passes::Subpasses, SyncVersion::One, Layouts::Optimal)
        || plan.queues != OtherQueues::default()
}

/// The first reason for which a layer of this version may miss a mutant.
pub fn reason(layer: u32, mutant: &Mutant) -> Option<&'static CarriedFrames> {
    CARRIED_FRAMES.iter().find(|entry| (entry.is_of)(layer) && (entry.is_about)(mutant))
}

/// The accesses and stages of attachments that are tested and drawn.
const DRAWN: A = A::from_raw(
    A::COLOR_ATTACHMENT_READ.as_raw()
        | A::COLOR_ATTACHMENT_WRITE.as_raw()
        | A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
        | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
);
const DRAWS: S = S::from_raw(
    S::COLOR_ATTACHMENT_OUTPUT.as_raw() | S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw(),
);

/// The bits that are missing, if it is not all of the row.
fn bits(mutant: &Mutant) -> Option<(Side, S, A)> {
    match mutant.part {
        RowPart::Bits(side, bits) => Some((side, bits.stage, bits.access)),
        RowPart::Row | RowPart::AcrossSamples => None,
    }
}

/// Returns true for bits of attachments that are drawn into or tested.
fn is_of_drawing(mutant: &Mutant) -> bool {
    bits(mutant).is_some_and(|(_, stage, access)| DRAWS.contains(stage) && DRAWN.contains(access))
}

/// Returns true if a render pass waits by the row for an earlier one of its frame.
fn is_between_render_passes(row: &Row) -> bool {
    row.carrier.is_render_pass() && !row.is_between_subpasses() && row.from != Endpoint::OUTSIDE
}

fn changes_a_layout(mutant: &Mutant) -> bool {
    !layout_changes(mutant.plan, &mutant.rows_of_plan(), &mutant.row).is_empty()
}

/// Returns true if the draws that must be over come after a barrier of the same rendering.
fn follows_a_barrier(mutant: &Mutant) -> bool {
    let table = mutant.rows_of_plan();
    let first = mutant.row.from;
    table.of(mutant.row.carrier).any(|other| other.is_between_subpasses() && other.waiting.contains(&first))
}

static CARRIED_FRAMES: &[CarriedFrames] = &[
    CarriedFrames {
        is_of: |_| true,
        is_about: |mutant| {
            let is_row = mutant.part == RowPart::Row && !changes_a_layout(mutant);
            mutant.plan.passes == Passes::Stored
                && is_between_render_passes(&mutant.row)
                && (is_row || is_of_drawing(mutant))
        },
        why: "the layer takes attachments that one render pass stores and the next one loads in the same layout to be in rasterization order. That order holds within a subpass",
    },
    CarriedFrames {
        is_of: |layer| layer <= LAYER,
        is_about: |mutant| mutant.plan.passes == Passes::LocalRead && mutant.row.is_between_subpasses(),
        why: "the layer does not look at what draws read of attachments inside of vkCmdBeginRendering",
    },
    CarriedFrames {
        is_of: |layer| layer > LAYER,
        is_about: |mutant| {
            mutant.plan.passes == Passes::LocalRead && mutant.row.is_between_subpasses() && is_of_drawing(mutant)
        },
        why: "the layer takes all that draws of one rendering do to colour and depth to be in rasterization order, also the drop of depth at its end, as the specification has it within a \
              subpass. The proof counts each pass of a rendering by itself, and asks for the barrier",
    },
    CarriedFrames {
        is_of: |layer| layer > LAYER,
        is_about: |mutant| {
            mutant.plan.passes == Passes::LocalRead
                && mutant.row.is_between_subpasses()
                && (follows_a_barrier(mutant) || mutant.row.from == mutant.row.to || is_tested_alone(&mutant.row))
        },
        why: "after the first barrier inside of a rendering the layer does not see what draws write to an attachment that was written before it: a later draw that reads it \
              without a barrier is taken to wait for the first one",
    },
    CarriedFrames {
        is_of: |_| true,
        is_about: |mutant| {
            let is_first_scope = matches!(mutant.part, RowPart::Row | RowPart::Bits(Side::Before, _));
            mutant.plan.passes == Passes::LocalRead && mutant.row.from == Endpoint::OUTSIDE && is_first_scope
        },
        why: "where another row of the frame is a barrier on all memory before a rendering, as those of subpasses without a change of layout are, the layer lets it order all earlier frames. \
              It is about what its own pass touches",
    },
    CarriedFrames {
        is_of: |layer| layer > LAYER,
        is_about: |mutant| {
            mutant.plan.sync == SyncVersion::Two
                && bits(mutant) == Some((Side::After, S::VERTEX_ATTRIBUTE_INPUT, A::empty()))
        },
        why: "the layer no longer looks at the vertices that an indexed draw fetches (`ValidateDrawVertexIndex` of its source says so), only at the indices",
    },
    CarriedFrames {
        is_of: |layer| layer >= NEWEST,
        is_about: |mutant| {
            let is_of_buffer = mutant.row.carrier == SyncKind::BufferBarrier && mutant.row.from == Endpoint::OUTSIDE;
            mutant.plan.sync == SyncVersion::Two && is_of_buffer
        },
        why: "the layer lets another row from the last frame order it, which waits for the same stage and is about something else",
    },
    CarriedFrames {
        is_of: |_| true,
        is_about: |mutant| {
            let reads = bits(mutant) == Some((Side::After, S::empty(), A::SHADER_STORAGE_READ));
            reads && mutant.row.after.access.contains(A::SHADER_STORAGE_WRITE)
        },
        why: "the layer takes what a dispatch reads to be ordered by what it writes of the same buffer or image. What was there must be visible to both accesses",
    },
    CarriedFrames {
        is_of: |_| true,
        is_about: |mutant| {
            let is_copied = bits(mutant).is_some_and(|(side, stage, _)| side == Side::Before && stage == S::COPY);
            mutant.plan.sync == SyncVersion::Two && mutant.row.label == "upload-to-textures" && is_copied
        },
        why: "the scene has textures with levels alone, of which blits write the last. Of a texture without levels the copy is the last write",
    },
    CarriedFrames {
        is_of: |_| true,
        is_about: |mutant| {
            let reads_again = mutant.row.before.access.is_empty() || follows_another_reader(mutant);
            mutant.plan.layouts == Layouts::Unified && reads_again
        },
        why: "without a change of layout the row orders a read after another read, or a write after reads: the layer does not hold a read against the write before it if it \
              happens after another read (`IsRAWHazard` of its source), to which alone the write need be visible",
    },
    CarriedFrames {
        is_of: |_| true,
        is_about: is_between_queues,
        why: "the layer does not take an ownership transfer that keeps the layout for a use of the contents, but for a barrier; and the semaphore between the two queues makes all available that \
              the first one wrote. So it sees no transfer that is too soon",
    },
    CarriedFrames {
        is_of: |layer| layer < LAYER,
        is_about: |mutant| mutant.row.carrier == SyncKind::QueueSemaphore,
        why: "the layer does not hold the work of one submission against that of another",
    },
    CarriedFrames {
        is_of: |layer| layer == LAYER,
        is_about: |mutant| mutant.row.label == "from-compute-queue",
        why: "the layer does not hold what a render pass loads against the work of another queue",
    },
];

/// Returns true if the row is between uses on two queues: the transfer of what both use, or a row that leads to it or on from it.
fn is_between_queues(mutant: &Mutant) -> bool {
    let beside = |place: &Endpoint| {
        let steps = StepList::of(mutant.plan).0;
        steps
            .iter()
            .any(|step| matches!(step, Step::Commands(own) if own.pass.name == *place && own.queue != Queue::Graphics))
    };
    let row = &mutant.row;
    let is_transfer = matches!(row.carrier, SyncKind::Ownership(_));
    // On the graphics queue, the work that waits by this row comes after the ownership transfer back.
    is_transfer || row.carrier.is_render_pass() && (beside(&row.from) || row.waiting.iter().any(beside))
}

/// Returns true if an earlier row of the frame lets another pass read the writes of this row's first pass.
fn follows_another_reader(mutant: &Mutant) -> bool {
    let (table, row) = (mutant.rows_of_plan(), &mutant.row);
    let mut before = table.iter().take_while(|other| other.name != row.name);
    let shares = |other: &Row| other.resources.iter().any(|resource| row.resources.contains(resource));
    before.any(|other| (other.from == row.from || row.from == Endpoint::OUTSIDE) && shares(other))
}

/// Returns true if the pass that waits tests depth, and reads no attachment otherwise.
fn is_tested_alone(row: &Row) -> bool {
    !row.after.access.contains(A::INPUT_ATTACHMENT_READ)
}
