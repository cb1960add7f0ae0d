//! Rows and bits whose absence the validation layer does not report, and why they are there all the same.
//!
//! Layer 1.4.309 is silent about these in both modes of its shader heuristic. The table keeps them all the same: each entry quotes the specification,
//! and the proof ([`afterlight_proof`]) finds a hazard without it. `tests/sync/necessity.rs` fails when the layer reports an entry after all, when no
//! row of an entry is silent any more, and when something that is not listed is silent.
//!
//! A blind spot of the layer concerns a kind of row, whichever passes the row is between. So an entry asks for the row's carrier, stages and
//! accesses, and names no effect: the entry judges the rows of a new effect as well.

use afterlight::frame::list::RenderPassName;
use afterlight::frame::rows::{Row, RowPart, Side, SyncKind, table};
use afterlight::frame::{LayoutChange, layout_changes};
use afterlight::gpu::sync::Use;
use afterlight::passes::{Endpoint, Resource, forward, geometry, lighting, pyramid, shadow, tonemap};
use afterlight::plan::{FramePlan, Target};
use ash::vk::{self, AccessFlags2 as A, PipelineStageFlags2 as S};

/// The first layer that sees wrong masks of subpass dependencies.
pub const LAYER: u32 = vk::make_api_version(0, 1, 4, 309);
/// The newest layer that was tried.
pub const NEWEST: u32 = vk::make_api_version(0, 1, 4, 363);

/// Parts of rows that the layer does not miss, for one reason.
#[derive(Debug)]
pub struct UnreportedMutants {
    /// The first layer that was seen to notice them, packed as Vulkan packs it; none where all that were tried are silent. Layers between may notice them, too.
    pub seen_from: Option<u32>,
    is_about: fn(&MissingPart) -> bool,
    /// The section of the specification.
    pub section: &'static str,
    /// A sentence of that section.
    pub says: &'static str,
    /// Why the layer stays silent, in a sentence.
    pub why: &'static str,
}

/// Why the layer does not notice that a part of a row is missing; `None` where it does. An entry that is further up in the list comes first.
pub fn reason(plan: &FramePlan, row: &Row, part: RowPart) -> Option<&'static UnreportedMutants> {
    UNREPORTED_MUTANTS.iter().find(|entry| (entry.is_about)(&MissingPart { plan, row, part }))
}

/// A part that is missing, of a row of a plan's table.
struct MissingPart<'a> {
    plan: &'a FramePlan,
    row: &'a Row,
    part: RowPart,
}

impl MissingPart<'_> {
    fn is_row(&self) -> bool {
        self.part == RowPart::Row
    }

    /// Returns true for one of these stages or accesses of the first scope.
    fn is_before(&self, stages: S, accesses: A) -> bool {
        self.is_bit(Side::Before, stages, accesses)
    }

    /// Returns true for one of these stages or accesses of the second scope.
    fn is_after(&self, stages: S, accesses: A) -> bool {
        self.is_bit(Side::After, stages, accesses)
    }

    fn is_bit(&self, side: Side, stages: S, accesses: A) -> bool {
        let RowPart::Bits(own, bits) = self.part else { return false };
        side == own && stages.contains(bits.stage) && accesses.contains(bits.access)
    }

    /// Returns true if the render pass of the row begins with this place.
    fn begins_with(&self, place: Endpoint) -> bool {
        self.row.carrier == SyncKind::Subpass(RenderPassName::of(place))
    }

    /// Returns true if the row waits for something outside of its frame, mostly for the frame before.
    fn is_from_outside(&self) -> bool {
        self.row.from == Endpoint::OUTSIDE
    }

    /// Returns true if a render pass waits by this row for an earlier pass of the same frame.
    fn enters(&self) -> bool {
        self.row.carrier.is_render_pass() && !self.row.is_between_subpasses() && !self.is_from_outside()
    }

    /// Returns true for a bit of a row between two subpasses that would not be needed within one, where uses of an attachment are in rasterization order.
    fn is_of_attachment(&self) -> bool {
        let Row { from, before, after, .. } = self.row;
        let tests = A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE;
        // What LIGHTING writes of the G-buffer besides are drops, which the layer notices.
        let blends = after.access.contains(A::COLOR_ATTACHMENT_READ) && *from != geometry::PASS.name;
        let draws = after.access.intersects(A::COLOR_ATTACHMENT_READ | tests);
        let drops = after.access.contains(A::DEPTH_STENCIL_ATTACHMENT_WRITE);
        let writes_depth = before.access.contains(A::DEPTH_STENCIL_ATTACHMENT_WRITE);
        // Where the render pass has its depth from an earlier one, or does not drop it, the layer does not see what must be over first.
        let begins_depth = self.begins_with(geometry::PASS.name) || self.begins_with(forward::PASS.name);
        let is_kept = !drops || !begins_depth;
        let missed = [
            (Side::Before, S::empty(), A::COLOR_ATTACHMENT_WRITE, blends),
            (Side::Before, S::COLOR_ATTACHMENT_OUTPUT, A::empty(), blends && (writes_depth || is_kept)),
            (Side::Before, S::FRAGMENT_SHADER | S::LATE_FRAGMENT_TESTS, A::empty(), !writes_depth && is_kept),
            (Side::After, S::empty(), A::COLOR_ATTACHMENT_READ, true),
            (Side::After, S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE, blends),
            (Side::After, S::FRAGMENT_SHADER, A::INPUT_ATTACHMENT_READ, draws && !writes_depth),
            (Side::After, S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ, true),
            (Side::After, S::LATE_FRAGMENT_TESTS, A::empty(), !drops),
        ];
        let is_missed = |(side, stages, accesses, is_missed)| is_missed && self.is_bit(side, stages, accesses);
        // TINT tests against the depth of its map, and stores it.
        let is_of_map = *from == shadow::PASS.name && matches!(self.part, RowPart::Bits(..));
        self.row.is_between_subpasses() && (is_of_map || missed.into_iter().any(is_missed))
    }

    /// Returns true if shadow maps are read by this row as their render pass has left them.
    fn leaves_maps(&self) -> bool {
        let row = self.row;
        let is_of_maps = row.carrier.pass().is_some_and(RenderPassName::draws_maps);
        is_of_maps && !row.is_between_subpasses() && !self.is_from_outside()
    }

    /// Returns true if another row, of a subpass of this frame, makes the same dispatches wait with their writes.
    fn is_awaited_in_the_frame(&self) -> bool {
        let to_same =
            |row: &Row| row.carrier.is_render_pass() && row.to == self.row.to && row.from != Endpoint::OUTSIDE;
        table(self.plan).iter().any(|row| to_same(row) && row.after.access.contains(A::SHADER_WRITE))
    }

    /// Returns true if a buffer of the same dispatches is read by draws of an earlier subpass, whose tests the subpass waits for.
    fn is_led_around_by_buffer(&self) -> bool {
        let row = self.row;
        let rows = table(self.plan);
        let is_last =
            |other: &&Row| other.by_region && other.to == row.to && other.before.stage == S::LATE_FRAGMENT_TESTS;
        let buffers: Vec<_> = rows.of(SyncKind::BufferBarrier).filter(|other| other.from == row.from).collect();
        let is_read = |last: &Row| buffers.iter().any(|buffer| buffer.waiting.contains(&last.from));
        rows.of(row.carrier).filter(is_last).any(is_read)
    }

    /// Returns true if other rows lead to the same subpass, through another one of its render pass.
    fn is_led_around(&self) -> bool {
        let row = self.row;
        let (is_between, follows_reads) = (row.is_between_subpasses(), row.before.access.is_empty());
        if !(is_between && self.is_row() || self.enters() && follows_reads) {
            return false;
        }
        let rows = table(self.plan);
        let last = |other: &&Row| other.is_between_subpasses() && other.to == row.to && other.from != row.from;
        // LIGHTING's render pass changes the layout of the depth that it loads, and the layer takes that for an order.
        let is_ordered = is_between || self.begins_with(lighting::PASS.name);
        let is_led_to = |last: &Row| {
            let mut firsts = rows.iter().filter(|other| other.from == row.from && other.waiting.contains(&last.from));
            firsts.any(|first| is_ordered || first.after.stage.intersects(last.before.stage))
        };
        // Tests read depth in rasterization order, so that any row to the subpass will do.
        let follows_tests = is_between && follows_reads && row.before.stage == S::LATE_FRAGMENT_TESTS;
        rows.of(row.carrier).filter(last).any(|last| follows_tests || is_led_to(last))
    }
}

const IN_ORDER: &str = "Within a subpass of a render pass instance, for a given (x,y,layer,sample) sample location, the following operations \
                        are guaranteed to execute in rasterization order, for each separate primitive that includes that sample location";
const FEW_GUARANTEES: &str = "The order of execution of commands with respect to the host and other commands on the device has few implicit guarantees, \
                              and needs to be explicitly specified";
const HAZARDS: &str = "Write-after-read hazards can be solved with just an execution dependency, but read-after-write and write-after-write hazards \
                       need appropriate memory dependencies to be included between them";
const TRANSITION: &str = "Applications must ensure that layout transitions happen-after all operations accessing the image with the old layout, \
                          and happen-before any operations that will access the image with the new layout";

/// The list.
pub static UNREPORTED_MUTANTS: &[UnreportedMutants] = &[
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| missing.part == RowPart::AcrossSamples,
        section: "Framebuffer Region Dependencies",
        says: "If N equals M, and if the VkSubpassDescription::flags does not specify the VK_SUBPASS_DESCRIPTION_FRAGMENT_REGION_BIT_EXT flag, then a \
               framebuffer region containing a single (x, y, layer, sample) coordinate in the first synchronization scope corresponds to a region \
               containing the same sample at the same coordinate in the second synchronization scope",
        why: "no layer knows the samples of a pixel apart. By region, an invocation of LIGHTING for one sample may read the others before GEOMETRY has \
              written them, and a later subpass may drop them before it has",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let writes_too = missing.row.after.access.contains(A::SHADER_READ | A::SHADER_WRITE);
            !missing.row.carrier.is_render_pass() && writes_too && missing.is_after(S::empty(), A::SHADER_READ)
        },
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer takes what a dispatch reads to be ordered by what it writes of the same buffer or image. What was there must be visible to both accesses",
    },
    UnreportedMutants {
        seen_from: Some(NEWEST),
        is_about: |missing| {
            let Row { carrier, before, after, .. } = missing.row;
            let is_of_dispatches = before.stage == S::COMPUTE_SHADER && after.stage == S::COMPUTE_SHADER;
            let writes = after.access.contains(A::SHADER_WRITE);
            *carrier == SyncKind::BufferBarrier && is_of_dispatches && writes && !missing.is_from_outside()
        },
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer does not see that a dispatch reads what the one before wrote, of a buffer that it writes as well. Without the row it may \
              read what was there before: the numbers of another step, or those of the last frame",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let Row { from, to, before, after, .. } = missing.row;
            let both = S::FRAGMENT_SHADER | S::COMPUTE_SHADER;
            let is_written = (*from == Endpoint::CLEAR || missing.leaves_maps()) && after.stage == both;
            let is_read = *to == shadow::PASS.name && before.stage == both;
            is_written && missing.is_after(S::FRAGMENT_SHADER, A::empty())
                || is_read && missing.is_before(S::COMPUTE_SHADER, A::empty())
        },
        section: "Pipeline Stages",
        says: "Its first access scope only includes memory accesses performed by pipeline stages explicitly specified in the source stage \
               mask",
        why: "where dispatches look up the shadow maps and draws do so after them, the layer lets the row from these dispatches to draws, with all stages \
              after theirs, order either stage's look-ups. That row is about a buffer, and makes nothing of the maps visible",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let Row { from, carrier, after, .. } = missing.row;
            let is_color = matches!(carrier, SyncKind::ImageBarrier(_, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL));
            let is_cleared = *from == Endpoint::CLEAR && is_color;
            let is_looked_up = after.stage == S::FRAGMENT_SHADER | S::COMPUTE_SHADER;
            is_cleared && is_looked_up && missing.is_after(S::COMPUTE_SHADER, A::SHADER_READ)
        },
        section: "Pipeline Stages",
        says: "Its first access scope only includes memory accesses performed by pipeline stages explicitly specified in the source stage \
               mask",
        why: "the first frame draws the tints of all layers before a dispatch looks them up, and their layout changes in between, after both stages. The row \
              is about layers that no frame has drawn yet",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let Row { from, carrier, after, .. } = missing.row;
            let is_color = matches!(carrier, SyncKind::ImageBarrier(_, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL));
            // Tints are drawn after their map, by another subpass.
            let is_tint = *from == Endpoint::CLEAR && is_color || missing.leaves_maps() && *from != shadow::PASS.name;
            let is_lit_there = after.stage == S::FRAGMENT_SHADER && missing.plan.is_forward();
            is_tint && is_lit_there && missing.is_after(S::empty(), A::SHADER_READ)
        },
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "where FORWARD looks up shadow maps with their tints, the layer is content with a row that has its stage. Without the access nothing makes the maps visible to it. \
              (Which other row it lets do so is not known: maps without tints are noticed)",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let Row { before, after, .. } = missing.row;
            let is_of_reads = missing.is_row() && missing.is_from_outside() && before.access.is_empty();
            let writes = before.stage == S::FRAGMENT_SHADER && after.stage == S::COMPUTE_SHADER;
            is_of_reads && writes && missing.is_awaited_in_the_frame()
        },
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets a row from a subpass of this frame to the same dispatches order what draws of the last frame read. Its first scope has that subpass alone",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let is_about = missing.is_row() || missing.is_before(S::COMPUTE_SHADER, A::empty());
            let follows_dispatch = missing.row.before == Use::new(S::COMPUTE_SHADER, A::empty());
            missing.enters() && is_about && follows_dispatch && missing.is_led_around_by_buffer()
        },
        section: "Framebuffer Region Dependencies",
        says: "If a synchronization command includes a dependencyFlags parameter, and specifies the VK_DEPENDENCY_BY_REGION_BIT flag, then it defines framebuffer-local \
               dependencies for the framebuffer-space pipeline stages in that synchronization command, for all framebuffer regions",
        why: "the layer lets the barrier of a buffer that draws of an earlier subpass read, and the row from their tests to this subpass, order depth as well. That row is by region, \
              and the dispatch has read the depth of other pixels",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| missing.is_of_attachment(),
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes all that a render pass does to colour and depth to be in rasterization order. That order holds within a subpass. A later one \
              blends over colour and tests, reads or drops depth that an earlier one has written or read, early or late as the implementation likes",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            missing.row.is_between_subpasses() && missing.is_before(S::EARLY_FRAGMENT_TESTS, A::empty())
        },
        section: "Pipeline Stages",
        says: "Its first access scope only includes memory accesses performed by pipeline stages explicitly specified in the source stage \
               mask",
        why: "where nothing is drawn, depth was written by its clear, which executes in EARLY_FRAGMENT_TESTS. LATE_FRAGMENT_TESTS includes \
              what is logically earlier for execution, but an access scope only has the stages that are named",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let uses = missing.row.after.access;
            let loads = uses.intersects(A::COLOR_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_READ);
            let is_read = uses.contains(A::INPUT_ATTACHMENT_READ) && missing.is_after(S::FRAGMENT_SHADER, A::empty());
            let others = A::INPUT_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE | A::DEPTH_STENCIL_ATTACHMENT_WRITE;
            missing.enters() && loads && (is_read || missing.is_after(S::LATE_FRAGMENT_TESTS, others))
        },
        section: "VkAttachmentDescription",
        says: "The load operation for each sample in an attachment happens-before any recorded command which accesses the sample in the first subpass \
               where the attachment is used",
        why: "the layer takes all uses of an attachment that is loaded to be ordered by its load operation. Inputs are read in another stage than the load's and \
              by another access, and draws and drops write by a third: what was stored must be visible to each of these",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let is_test = missing.is_after(S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ);
            let is_depth = |change: &LayoutChange| change.image == Some(Resource::Target(Target::Depth));
            // The layer sees that tests follow a change of layout.
            let changes = || layout_changes(missing.plan, &table(missing.plan), missing.row);
            let lights = missing.row.waiting.contains(&lighting::PASS.name);
            missing.enters() && !lights && is_test && !changes().iter().any(is_depth)
        },
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes depth that one render pass stores and the next one loads, as its layout stays the same, to be in rasterization order. That order holds \
              within a subpass, and dispatches have read the depth in between, which is stored again or dropped",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let before = missing.row.before.stage;
            let is_of_last_depth =
                missing.is_from_outside() && before == S::COLOR_ATTACHMENT_OUTPUT | S::COMPUTE_SHADER;
            let is_drawn = missing.row.carrier.is_render_pass() && is_of_last_depth;
            is_drawn && missing.is_before(S::COMPUTE_SHADER, A::empty()) || missing.is_led_around()
        },
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets rows that lead there through another subpass order it. The first scope of the last of these has only what is submitted in its own \
              subpass. So what an earlier one wrote need not be there yet, and what an earlier one or a dispatch still reads may be dropped or drawn anew",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| missing.row.to == Endpoint::HOST,
        section: "Fences",
        says: "Signaling a fence and waiting on the host does not guarantee that the results of memory accesses will be visible to the host, \
               as the access scope of a memory dependency defined by a fence only includes device access",
        why: "the layer does not track what the CPU reads. A fence makes the device's writes available, and its second access scope is empty: \
              only a dependency on HOST, HOST_READ makes them visible to the CPU",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let is_indirect = missing.row.after.stage.contains(S::DRAW_INDIRECT);
            is_indirect && missing.is_after(S::VERTEX_INPUT, A::VERTEX_ATTRIBUTE_READ)
        },
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer does not know how many instances an indirect draw fetches, and takes it for none. Without these bits draws may fetch the rows \
              that the buffer had before",
    },
    UnreportedMutants {
        seen_from: Some(NEWEST),
        is_about: |missing| {
            let Row { carrier, to, before, .. } = missing.row;
            let is_drawn = carrier.is_render_pass();
            // Where GEOMETRY waits for the copy alone, the layer sees that nothing holds it back.
            let is_alone = *to == geometry::PASS.name && before.stage == S::TRANSFER;
            let is_written = *carrier == SyncKind::ImageBarrier(vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
            let is_of_copy = missing.is_before(S::TRANSFER, A::empty()) && (is_drawn && !is_alone || is_written)
                || missing.is_row() && is_drawn && before.stage == S::TRANSFER;
            missing.is_from_outside() && is_of_copy
        },
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes a layout change to be ordered after the copy that an earlier submission made. It happens after what the \
              dependency's first scope has, and that must have the copy's read. Without the row there is an implicit dependency that waits for nothing, \
              and the change may overwrite what is being copied",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let is_read = missing.row.before.stage == S::FRAGMENT_SHADER && missing.is_from_outside();
            let is_about = missing.is_row() || missing.is_before(S::FRAGMENT_SHADER, A::empty());
            // After a dispatch that has written the light, the layer sees that nothing orders the change.
            let follows_write = |row: &Row| row.before.access.contains(A::SHADER_WRITE);
            is_read
                && is_about
                && missing.begins_with(tonemap::PASS.name)
                && !table(missing.plan).of(missing.row.carrier).any(follows_write)
        },
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes the layout change of an output that an earlier submission has sampled to be ordered after that. It happens after what the \
              dependency's first scope has, and that must have the read",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let Row { label, carrier, after, .. } = missing.row;
            let is_presented = matches!(carrier, SyncKind::ImageBarrier(vk::ImageLayout::PRESENT_SRC_KHR, _));
            // Where COPY takes the picture as it lies, no layout change comes between, and the layer sees that OVERLAY waits for the copy.
            let follows_change = ["picture-to-split", "picture-to-copy"].contains(label)
                || *label == "picture-to-overlay" && is_presented;
            // A row with an access is one for a copy that follows.
            after.access.is_empty() && missing.is_after(S::TRANSFER, A::empty())
                || follows_change && missing.is_before(S::TRANSFER, A::empty())
        },
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes a layout change to be ordered after that at the end of a render pass, or in a barrier before it. It is so by a chain \
              only: what comes before ends with TRANSFER, with which this begins, and what comes next begins with TRANSFER, with which this ends",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let Row { carrier, to, after, .. } = missing.row;
            let leaves = carrier.is_render_pass() && *to == Endpoint::OUTSIDE;
            // A row with an access is one for the copy that follows.
            missing.is_row() && leaves && after.access.is_empty()
        },
        section: "VkSubpassDependency",
        says: "If there is no subpass dependency from the last subpass that uses an attachment to VK_SUBPASS_EXTERNAL, then an implicit subpass \
               dependency exists from the last subpass it is used in to VK_SUBPASS_EXTERNAL",
        why: "the layer is content with the implicit dependency. That one holds nothing back, so that it makes no chain with what comes over the picture",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| missing.is_from_outside() && missing.row.to == pyramid::PASS.name,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer is right as long as OCCLUDERS is between the two: occluders-reuse waits for the stage of CULL, and occluders-to-pyramid for \
              OCCLUDERS. Those rows are about another image, and none of them may be relied on for the buffer",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let before = missing.row.before;
            let follows_reads = before.access.is_empty() && before.stage.contains(S::FRAGMENT_SHADER);
            follows_reads && missing.is_from_outside() && missing.is_after(S::empty(), A::SHADER_WRITE)
        },
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer sees a write after the read of a draw, for which waiting is enough. It is a write after those of dispatches of the last frame, too, which \
              must be visible to it",
    },
    UnreportedMutants {
        seen_from: Some(NEWEST),
        is_about: |missing| {
            let Row { before, after, .. } = missing.row;
            let is_rewritten = before.access.contains(A::SHADER_WRITE) && after.access == A::SHADER_WRITE;
            is_rewritten && missing.is_from_outside() && missing.is_after(S::empty(), A::SHADER_WRITE)
        },
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer is content where the row makes the writes of the last frame available. Nothing makes them visible to this frame's writes",
    },
    UnreportedMutants {
        seen_from: Some(NEWEST),
        is_about: |missing| {
            let is_barrier = matches!(missing.row.carrier, SyncKind::ImageBarrier(..));
            let blends = missing.row.after.access.contains(A::COLOR_ATTACHMENT_READ);
            is_barrier && blends && missing.is_after(S::empty(), A::COLOR_ATTACHMENT_WRITE)
        },
        section: "VkImageMemoryBarrier",
        says: "The second access scope is limited to access to memory through the specified image subresource range, via access types in the \
               destination access mask specified by dstAccessMask",
        why: "blending reads before it writes, and the layer takes the write to be ordered by the read. The picture must be visible to both \
              accesses, and is to those of the mask",
    },
    UnreportedMutants {
        seen_from: None,
        is_about: |missing| {
            let is_drawn = missing.is_from_outside() && missing.row.to == forward::PASS.name;
            let is_of_depth = missing.is_before(S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
            is_drawn && missing.plan.presented.is_some() && is_of_depth
        },
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer lets the semaphore by which presentation gives an image back order the depth of the frame before as well. It is about the image, and frames \
              take turns with several of these while they share the depth",
    },
    UnreportedMutants {
        seen_from: Some(NEWEST),
        is_about: |missing| {
            let Row { to, before, .. } = missing.row;
            // Where the light or the G-buffer is drawn by an earlier subpass of the render pass.
            let firsts = [geometry::PASS.name, lighting::PASS.name, forward::PASS.name];
            let is_later = firsts.into_iter().any(|first| first != *to && missing.begins_with(first));
            let is_available = missing.is_before(S::empty(), A::COLOR_ATTACHMENT_WRITE);
            let is_of_last_frame = before.stage.contains(S::COLOR_ATTACHMENT_OUTPUT);
            missing.is_from_outside() && is_later && is_of_last_frame && is_available
        },
        section: "Render Pass Creation",
        says: "Automatic layout transitions away from initialLayout happen-after the availability operations for all dependencies with a \
               srcSubpass equal to VK_SUBPASS_EXTERNAL, where dstSubpass uses the attachment that will be transitioned",
        why: "the layer takes what a row from OUTSIDE to an earlier subpass makes available to be so for this attachment too. That subpass does not \
              use it, so that its layout may change before. (Of the HDR target's later user, TONEMAP, tonemap-reuse would do by the letter)",
    },
];
