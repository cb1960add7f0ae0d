//! Rows and bits whose absence the validation layer does not report, and why they are there all the same.
//!
//! Layer 1.4.309 is silent about these in both modes of its shader heuristic. Nothing is left out of the table for that reason: each entry
//! quotes what the specification has to say, and [`super::super::proof`] finds a hazard without it. `tests/sync/necessity.rs` fails when an entry is noticed after all, when none of its rows is
//! silent any more, and when something is silent that is not listed.

use ash::vk::{self, AccessFlags as A, PipelineStageFlags as S};

use super::{Carrier, Edge, Side};
use crate::frame::list::RenderPassName;
use crate::gpu::sync::Use;
use crate::passes::{Place, forward, geometry, lighting, reflect_resolve, tonemap};
use crate::plan::FramePlan;
use crate::scene::Transparency;

/// The first layer that sees wrong masks of subpass dependencies.
pub const LAYER: u32 = vk::make_api_version(0, 1, 4, 309);

/// The part of a row that is removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Row,
    /// The reach across the samples of a pixel: the row becomes one by region.
    AcrossSamples,
    /// Some bits of one side.
    Bits(Side, Use),
}

/// Parts of rows that no layer misses, for one reason.
#[derive(Debug)]
pub struct UnreportedMutants {
    /// The rows' names.
    rows: &'static [&'static str],
    parts: Parts,
    /// True for the rows of the plans in which the layer is silent.
    only: fn(&FramePlan, &Edge) -> bool,
    /// The section of the specification.
    pub section: &'static str,
    /// A sentence of that section.
    pub says: &'static str,
    /// Why the layer stays silent, in a sentence.
    pub why: &'static str,
}

#[derive(Debug)]
enum Parts {
    /// The row and each of its bits.
    All,
    Row,
    AcrossSamples,
    /// Any of these bits.
    Any(Side, S, A),
}

impl UnreportedMutants {
    fn is_about(&self, plan: &FramePlan, edge: &Edge, part: Part) -> bool {
        let same = match (&self.parts, part) {
            (Parts::All, Part::Row | Part::Bits(..)) => true,
            (Parts::Row, Part::Row) | (Parts::AcrossSamples, Part::AcrossSamples) => true,
            (Parts::Any(side, stages, accesses), Part::Bits(own, bits)) => {
                *side == own && stages.contains(bits.stage) && accesses.contains(bits.access)
            }
            _ => false,
        };
        same && self.rows.contains(&edge.label) && (self.only)(plan, edge)
    }
}

/// Why nobody notices that a part of a row is missing; `None` where a layer does.
pub fn reason(plan: &FramePlan, edge: &Edge, part: Part) -> Option<&'static UnreportedMutants> {
    UNREPORTED_MUTANTS.iter().find(|entry| entry.is_about(plan, edge, part))
}

const fn accesses(first: A, second: A) -> A {
    A::from_raw(first.as_raw() | second.as_raw())
}

const fn stages(first: S, second: S) -> S {
    S::from_raw(first.as_raw() | second.as_raw())
}

const ALWAYS: fn(&FramePlan, &Edge) -> bool = |_, _| true;
const BETWEEN_SUBPASSES: fn(&FramePlan, &Edge) -> bool = |_, edge| edge.is_between_subpasses();
/// TRANSPARENT reads depth that is visible already, and waits only for readers of what it drops.
const WAITS_TO_DROP: fn(&FramePlan, &Edge) -> bool = |_, edge| {
    !edge.after.access.intersects(accesses(A::DEPTH_STENCIL_ATTACHMENT_READ, A::DEPTH_STENCIL_ATTACHMENT_WRITE))
};
/// By SIMULATE, and by passes that shade.
const LOOKED_UP_TWICE: fn(&FramePlan, &Edge) -> bool =
    |_, edge| edge.after.stage.contains(stages(S::FRAGMENT_SHADER, S::COMPUTE_SHADER));
const AFTER_REFLECTIONS: fn(&FramePlan, &Edge) -> bool = |_, edge| edge.from == reflect_resolve::PASS.place;
/// The render pass of the row begins with this place.
fn begins_with(edge: &Edge, place: Place) -> bool {
    edge.carrier == Carrier::Subpass(RenderPassName::of(place))
}

/// Depth was stored by an earlier render pass, so that this one loads it.
const LOADS_DEPTH: fn(&FramePlan, &Edge) -> bool =
    |_, edge| !begins_with(edge, geometry::PASS.place) && !begins_with(edge, forward::PASS.place);

const OVER_PRESENTED: Carrier =
    Carrier::ImageBarrier(vk::ImageLayout::PRESENT_SRC_KHR, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);

/// Reads and writes of depth in a later render pass.
const USES_OF_DEPTH: Parts = Parts::Any(
    Side::After,
    stages(S::FRAGMENT_SHADER, stages(S::EARLY_FRAGMENT_TESTS, S::LATE_FRAGMENT_TESTS)),
    accesses(A::INPUT_ATTACHMENT_READ, accesses(A::DEPTH_STENCIL_ATTACHMENT_READ, A::DEPTH_STENCIL_ATTACHMENT_WRITE)),
);

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
        rows: &["geometry-to-lighting", "lighting-to-transparent", "lighting-to-fog"],
        parts: Parts::AcrossSamples,
        only: ALWAYS,
        section: "Framebuffer Region Dependencies",
        says: "If N equals M, and if the VkSubpassDescription::flags does not specify the VK_SUBPASS_DESCRIPTION_FRAGMENT_REGION_BIT_EXT flag, then a \
               framebuffer region containing a single (x, y, layer, sample) coordinate in the first synchronization scope corresponds to a region \
               containing the same sample at the same coordinate in the second synchronization scope",
        why: "no layer knows the samples of a pixel apart. By region, an invocation of LIGHTING for one sample may read the others before GEOMETRY has \
              written them, and a later subpass may drop them before it has",
    },
    UnreportedMutants {
        rows: &["cull-to-arrange", "arrange-to-fill"],
        parts: Parts::All,
        only: ALWAYS,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer does not see that a dispatch reads what the one before wrote, of a buffer that both read and write. Without the row ARRANGE \
              may add up what the numbers were before, and FILL put rows where others lie",
    },
    UnreportedMutants {
        rows: &["bloom-to-spread", "spread-to-spread"],
        parts: Parts::All,
        only: ALWAYS,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the same of the steps of SPREAD, which read and write one buffer. Without the rows a level may be the mean of what the one before it was in \
              the last frame",
    },
    UnreportedMutants {
        rows: &["simulate-to-sort", "sort-to-sort"],
        parts: Parts::All,
        only: ALWAYS,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the same of the keys that SORT reads and writes. Without the rows a step may compare keys as they were before the last one",
    },
    UnreportedMutants {
        rows: &["scatter-to-integrate"],
        parts: Parts::All,
        only: ALWAYS,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the same of the froxels that SCATTER writes and INTEGRATE reads: a dispatch after another on one buffer. Without the row INTEGRATE may add up the \
              light of the frame before",
    },
    UnreportedMutants {
        rows: &["clear-to-shadow-maps"],
        parts: Parts::Any(Side::After, stages(S::FRAGMENT_SHADER, S::COMPUTE_SHADER), A::SHADER_READ),
        only: LOOKED_UP_TWICE,
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "particles move, so that the frames that are tried draw each map between its clear and those who look it up, and either stage orders that. A frame \
              that draws a map later looks up what was cleared, in both stages",
    },
    UnreportedMutants {
        rows: &["shadow-to-readers"],
        parts: Parts::Any(Side::After, S::FRAGMENT_SHADER, A::empty()),
        only: |plan, _| plan.effects.particles.is_some() || plan.froxels().is_some(),
        section: "Pipeline Stages",
        says: "Its first access scope only includes memory accesses performed by pipeline stages explicitly specified in the source stage \
               mask",
        why: "the layer lets the row from SIMULATE to PARTICLES, or from INTEGRATE to FOG, with all stages after theirs, carry the maps on to LIGHTING. That row is about a buffer, and \
              makes nothing of the maps visible",
    },
    UnreportedMutants {
        rows: &["shadow-reuse"],
        parts: Parts::Any(Side::Before, S::COMPUTE_SHADER, A::empty()),
        only: |_, edge| edge.before.stage.contains(stages(S::FRAGMENT_SHADER, S::COMPUTE_SHADER)),
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer lets the rows from SIMULATE to PARTICLES and from there to LIGHTING, for whose look-ups the next frame waits, hold back SIMULATE's too, and \
              those after SCATTER SCATTER's. None of them is about the maps",
    },
    UnreportedMutants {
        rows: &["lighting-to-transparent", "lighting-to-fog", "fog-to-transparent"],
        parts: Parts::Any(Side::After, S::FRAGMENT_SHADER, A::INPUT_ATTACHMENT_READ),
        only: ALWAYS,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes all that a render pass does to depth to be in rasterization order. FOG and PARTICLES read it as an input, in another subpass than \
              that which wrote it",
    },
    UnreportedMutants {
        rows: &["reflect-resolve-to-tonemap"],
        parts: Parts::Any(Side::After, S::FRAGMENT_SHADER, A::INPUT_ATTACHMENT_READ),
        only: AFTER_REFLECTIONS,
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer takes all uses of an attachment that is loaded to be ordered by its load operation. TONEMAP reads its input by another access and in \
              another stage, and what REFLECT_RESOLVE wrote must be visible to that, too",
    },
    UnreportedMutants {
        rows: &["reflect-resolve-to-transparent", "reflect-resolve-to-composite", "reflect-resolve-to-fog"],
        parts: Parts::Any(Side::After, S::empty(), A::COLOR_ATTACHMENT_WRITE),
        only: |_, edge| edge.after.access.contains(A::COLOR_ATTACHMENT_READ),
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "blending and the load before it read, and the layer takes the write to be ordered by these reads. What REFLECT_RESOLVE wrote must be visible to \
              both accesses",
    },
    UnreportedMutants {
        rows: &["reflect-resolve-to-transparent", "reflect-resolve-to-fog", "reflect-resolve-to-velocity"],
        parts: USES_OF_DEPTH,
        only: AFTER_REFLECTIONS,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes depth that one render pass stores and the next one loads, as its layout stays the same, to be in rasterization order. That order holds \
              within a subpass, and HIZ has read the depth in between, which is stored again or dropped",
    },
    UnreportedMutants {
        rows: &["lighting-to-readers"],
        parts: USES_OF_DEPTH,
        only: |plan, _| plan.reflects(),
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same of the depth that LIGHTING's render pass stores: HIZ reads it, and a later one loads it",
    },
    UnreportedMutants {
        rows: &["reflect-resolve-to-transparent"],
        parts: Parts::All,
        // Where FOG lies between the two, and draws into the same light.
        only: |plan, _| plan.has_fog() && plan.transparency == Some(Transparency::Sorted),
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets the row from FOG to TRANSPARENT order what came before the render pass. Its first scope has only what is submitted in FOG, so that \
              TRANSPARENT would read depth that is not visible to it, and drop what REFLECT_RESOLVE may still read",
    },
    UnreportedMutants {
        rows: &["hdr-to-reflect-resolve"],
        parts: Parts::Any(Side::After, S::empty(), A::SHADER_READ),
        only: ALWAYS,
        section: "VkImageMemoryBarrier",
        says: "The second access scope is limited to access to memory through the specified image subresource range, via access types in the \
               destination access mask specified by dstAccessMask",
        why: "the layer takes what REFLECT_RESOLVE loads of the light to be ordered by the store to it. The light must be visible to both accesses",
    },
    UnreportedMutants {
        rows: &["bloom-reuse", "simulate-reuse", "scatter-reuse", "skin-reuse"],
        parts: Parts::Any(Side::After, S::empty(), A::SHADER_WRITE),
        // Where draws have fetched all that SKIN wrote, the layer sees that nothing holds back the next write.
        only: |_, edge| edge.before.stage.intersects(stages(S::COMPUTE_SHADER, S::FRAGMENT_SHADER)),
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer sees a write after the read of TONEMAP or PARTICLES, for which waiting is enough. It is a write after those of SPREAD or SORT, too, which \
              must be visible to it",
    },
    UnreportedMutants {
        rows: &["tonemap-reuse"],
        parts: Parts::Any(Side::Before, S::FRAGMENT_SHADER, A::empty()),
        only: |_, edge| begins_with(edge, tonemap::PASS.place),
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes the output's layout change to be ordered after the copy, or FXAA's read, that an earlier submission made. It happens after \
              what the dependency's first scope has, and that must have the read",
    },
    UnreportedMutants {
        rows: &["geometry-reuse", "forward-reuse"],
        parts: Parts::Any(Side::Before, S::COMPUTE_SHADER, A::empty()),
        only: |plan, edge| plan.effects.taa.is_some() && !edge.before.stage.contains(S::LATE_FRAGMENT_TESTS),
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets the rows that lead from TAA's mean to the picture hold back what draws depth anew. Their scopes have only what is submitted in their \
              subpasses, and TAA has read the last frame's depth outside of them",
    },
    UnreportedMutants {
        rows: &["forward-reuse"],
        parts: Parts::Any(Side::Before, S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE),
        only: |plan, _| plan.presented.is_some(),
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer lets the semaphore by which presentation gives an image back order the depth of the frame before as well. It is about the image, and frames \
              take turns with several of these while they share the depth",
    },
    UnreportedMutants {
        rows: &["bloom-to-tonemap"],
        parts: Parts::Any(
            Side::After,
            S::FRAGMENT_SHADER,
            accesses(A::INPUT_ATTACHMENT_READ, A::COLOR_ATTACHMENT_WRITE),
        ),
        only: ALWAYS,
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer takes all uses of an attachment that is loaded to be ordered by its load operation. Inputs are read by another access than the load \
              operation's, and what LIGHTING stored must be visible to that, too",
    },
    UnreportedMutants {
        rows: &["taa-reuse"],
        parts: Parts::Any(Side::After, S::empty(), A::SHADER_READ),
        only: ALWAYS,
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer sees that TAA overwrites what TAA of the last frame has read, for which waiting is enough. It reads what that has written, too, \
              which must be visible to it",
    },
    UnreportedMutants {
        rows: &["taa-to-sharpen"],
        parts: Parts::Any(Side::After, S::empty(), A::COLOR_ATTACHMENT_WRITE),
        only: ALWAYS,
        section: "Execution and Memory Dependencies",
        says: HAZARDS,
        why: "the layer takes all uses of an attachment that is loaded to be ordered by its load operation. SHARPEN writes it by another access, to which \
              what was stored must be visible, too",
    },
    UnreportedMutants {
        rows: &["fill-to-readers"],
        parts: Parts::Any(Side::After, S::VERTEX_INPUT, A::VERTEX_ATTRIBUTE_READ),
        only: ALWAYS,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer does not know how many instances an indirect draw fetches, and takes it for none. Without these bits draws may fetch the rows \
              that the buffer had before",
    },
    UnreportedMutants {
        rows: &["pyramid-reuse"],
        parts: Parts::All,
        only: ALWAYS,
        section: "Synchronization and Cache Control",
        says: FEW_GUARANTEES,
        why: "the layer is right as long as OCCLUDERS is between the two: occluders-reuse waits for the stage of CULL, and occluders-to-pyramid for \
              OCCLUDERS. Those rows are about another image, and none of them may be relied on for the buffer",
    },
    UnreportedMutants {
        rows: &["picture-to-host", "found-to-host"],
        parts: Parts::All,
        only: ALWAYS,
        section: "Fences",
        says: "Signaling a fence and waiting on the host does not guarantee that the results of memory accesses will be visible to the host, \
               as the access scope of a memory dependency defined by a fence only includes device access",
        why: "the layer does not track what the CPU reads. A fence makes the device's writes available, and its second access scope is empty: \
              only a dependency on HOST, HOST_READ makes them visible to the CPU",
    },
    UnreportedMutants {
        rows: &["lighting-reuse", "transparent-reuse", "composite-reuse", "fog-reuse", "tonemap-reuse", "fxaa-reuse"],
        parts: Parts::Row,
        only: |plan, edge| {
            // After REFLECT_RESOLVE the layer sees that nothing orders the change of the output that FXAA has read.
            let is_smoothed =
                edge.before.stage == S::FRAGMENT_SHADER && begins_with(edge, tonemap::PASS.place) && !plan.reflects();
            edge.carrier.is_render_pass() && (edge.before.stage == S::TRANSFER || is_smoothed)
        },
        section: "VkSubpassDependency",
        says: "If there is no subpass dependency from VK_SUBPASS_EXTERNAL to the first subpass that uses an attachment, then an implicit \
               subpass dependency exists from VK_SUBPASS_EXTERNAL to the first subpass it is used in",
        why: "the layer takes a layout change to be ordered after the copy that an earlier submission made. Without the row there is an \
              implicit dependency that waits for nothing, and the change may overwrite what is being copied",
    },
    UnreportedMutants {
        rows: &[
            "geometry-reuse",
            "lighting-reuse",
            "forward-reuse",
            "transparent-reuse",
            "composite-reuse",
            "fog-reuse",
            "tonemap-reuse",
            "fxaa-reuse",
            "output-reuse",
        ],
        parts: Parts::Any(Side::Before, S::TRANSFER, A::empty()),
        // Not where GEOMETRY waits for the copy alone.
        only: |_, edge| edge.to != geometry::PASS.place || edge.before.stage.contains(S::COLOR_ATTACHMENT_OUTPUT),
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes a layout change to be ordered after the copy that an earlier submission made. It happens after what the \
              dependency's first scope has, and that must have the copy's read",
    },
    UnreportedMutants {
        rows: &["lighting-to-composite", "forward-to-composite", "fog-to-composite"],
        parts: Parts::All,
        only: ALWAYS,
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets the row from TRANSPARENT to COMPOSITE order what an earlier subpass did. Its first scope has only what is \
              submitted in TRANSPARENT, so that COMPOSITE would blend over light that may not be there yet",
    },
    UnreportedMutants {
        rows: &[
            "lighting-to-transparent",
            "forward-to-transparent",
            "lighting-to-fog",
            "forward-to-fog",
            "fog-to-transparent",
            "tonemap-to-tone",
            "forward-to-tone",
            "fxaa-to-tone",
            "lighting-to-tone",
        ],
        parts: Parts::Any(
            Side::After,
            S::COLOR_ATTACHMENT_OUTPUT,
            accesses(A::COLOR_ATTACHMENT_READ, A::COLOR_ATTACHMENT_WRITE),
        ),
        only: ALWAYS,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes all that a render pass does to a colour attachment to be in rasterization order. That order holds within a \
              subpass; blending in a later one reads and writes what the earlier one wrote",
    },
    UnreportedMutants {
        rows: &["tonemap-to-tone", "fxaa-to-tone", "lighting-to-tone", "forward-to-tone"],
        parts: Parts::Any(Side::Before, S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE),
        only: ALWAYS,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same, seen from the other side",
    },
    UnreportedMutants {
        rows: &["lighting-to-transparent", "fog-to-transparent", "lighting-to-velocity", "transparent-to-velocity"],
        parts: Parts::Any(Side::Before, stages(S::COLOR_ATTACHMENT_OUTPUT, S::LATE_FRAGMENT_TESTS), A::empty()),
        only: |plan, edge| !edge.after.access.contains(A::DEPTH_STENCIL_ATTACHMENT_WRITE) || LOADS_DEPTH(plan, edge),
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes all that a render pass does to depth to be in rasterization order. TRANSPARENT drops depth that LIGHTING or FOG reads, in \
              another subpass",
    },
    UnreportedMutants {
        rows: &["fog-to-transparent", "fog-to-velocity"],
        parts: Parts::Any(Side::Before, S::FRAGMENT_SHADER, A::empty()),
        only: |plan, edge| {
            let is_of_inputs = plan.is_forward() && !edge.after.access.contains(A::DEPTH_STENCIL_ATTACHMENT_WRITE);
            let follows_input = WAITS_TO_DROP(plan, edge) || LOADS_DEPTH(plan, edge) || is_of_inputs;
            edge.before.stage == S::FRAGMENT_SHADER && follows_input
        },
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same where the row is about depth alone: FOG reads it as an input, and the next subpass tests against it or drops it",
    },
    UnreportedMutants {
        rows: &["lighting-to-fog"],
        parts: Parts::Any(Side::Before, S::COLOR_ATTACHMENT_OUTPUT, A::empty()),
        // Where FOG drops depth by a write, the layer sees that nothing holds that back from LIGHTING's reads.
        only: |plan, edge| !edge.after.access.contains(A::DEPTH_STENCIL_ATTACHMENT_WRITE) || LOADS_DEPTH(plan, edge),
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes all that a render pass does to a colour attachment to be in rasterization order. That order holds within a subpass; FOG blends \
              over light that LIGHTING writes in another",
    },
    UnreportedMutants {
        rows: &["lighting-to-transparent", "lighting-to-fog", "fog-to-transparent"],
        parts: Parts::Any(Side::After, S::LATE_FRAGMENT_TESTS, A::empty()),
        only: WAITS_TO_DROP,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same, seen from the other side",
    },
    UnreportedMutants {
        rows: &["ao-denoise-to-lighting"],
        parts: Parts::Any(
            Side::After,
            stages(S::FRAGMENT_SHADER, S::LATE_FRAGMENT_TESTS),
            accesses(A::INPUT_ATTACHMENT_READ, accesses(A::COLOR_ATTACHMENT_WRITE, A::DEPTH_STENCIL_ATTACHMENT_WRITE)),
        ),
        only: ALWAYS,
        section: "VkAttachmentDescription",
        says: "The load operation for each sample in an attachment happens-before any recorded command which accesses the sample in the first subpass \
               where the attachment is used",
        why: "the layer lets the loads of the G-buffer, which wait by the row's other bits, order what LIGHTING does to it afterwards. What is visible to \
              a load is not visible to input reads for that, and a drop is a write that waits for what AO read by its own stage",
    },
    UnreportedMutants {
        rows: &["ao-denoise-to-transparent", "ao-denoise-to-fog"],
        parts: Parts::All,
        only: ALWAYS,
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets the row from LIGHTING to TRANSPARENT or FOG order what came before the render pass. Its first scope has only what is submitted in \
              LIGHTING, so that TRANSPARENT or FOG would read depth that is not visible to it, and drop what AO may still read",
    },
    UnreportedMutants {
        rows: &["lighting-reuse", "forward-reuse"],
        parts: Parts::Any(Side::Before, S::empty(), A::COLOR_ATTACHMENT_WRITE),
        only: |_, edge| edge.to == lighting::PASS.place && edge.before.stage.contains(S::TRANSFER),
        section: "VkDependencyFlagBits",
        says: "VK_DEPENDENCY_BY_REGION_BIT specifies that dependencies will be framebuffer-local",
        why: "the row to TONE makes the samples' store available, but by region. The next frame's samples wait for all of it",
    },
    UnreportedMutants {
        rows: &["geometry-to-lighting"],
        parts: Parts::Any(Side::After, S::empty(), A::COLOR_ATTACHMENT_READ),
        only: BETWEEN_SUBPASSES,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same for the emissive light that LIGHTING adds to; the write is noticed by what else LIGHTING drops",
    },
    UnreportedMutants {
        rows: &[
            "lighting-to-transparent",
            "forward-to-transparent",
            "lighting-to-fog",
            "forward-to-fog",
            "fog-to-transparent",
        ],
        parts: Parts::Any(Side::Before, S::empty(), A::COLOR_ATTACHMENT_WRITE),
        only: ALWAYS,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same, seen from the other side: the light that was written must be available to what blends over it",
    },
    UnreportedMutants {
        rows: &["forward-to-transparent", "forward-to-fog"],
        parts: Parts::Any(Side::Before, S::COLOR_ATTACHMENT_OUTPUT, A::empty()),
        only: ALWAYS,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same of the stage, beside those that test depth",
    },
    UnreportedMutants {
        rows: &[
            "geometry-to-lighting",
            "lighting-to-transparent",
            "forward-to-transparent",
            "fog-to-transparent",
            "lighting-to-velocity",
            "forward-to-velocity",
            "fog-to-velocity",
            "transparent-to-velocity",
        ],
        parts: Parts::Any(Side::After, S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ),
        only: BETWEEN_SUBPASSES,
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes all that a render pass does to depth to be in rasterization order. That order holds within a subpass; the tests \
              of a later one read what the earlier one wrote, early or late as the implementation likes",
    },
    UnreportedMutants {
        rows: &["geometry-to-lighting", "lighting-to-transparent", "forward-to-transparent", "fog-to-transparent"],
        parts: Parts::Any(Side::After, S::LATE_FRAGMENT_TESTS, A::empty()),
        // Where the pass drops depth, the layer misses the store's stage.
        only: |_, edge| !edge.after.access.contains(A::DEPTH_STENCIL_ATTACHMENT_WRITE),
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the same for tests that run late",
    },
    UnreportedMutants {
        rows: &["geometry-to-lighting", "forward-to-transparent", "forward-to-velocity", "forward-to-fog"],
        parts: Parts::Any(Side::Before, S::EARLY_FRAGMENT_TESTS, A::empty()),
        only: ALWAYS,
        section: "Pipeline Stages",
        says: "Its first access scope only includes memory accesses performed by pipeline stages explicitly specified in the source stage \
               mask",
        why: "where nothing is drawn, depth was written by its clear, which executes in EARLY_FRAGMENT_TESTS. LATE_FRAGMENT_TESTS includes \
              what is logically earlier for execution, but an access scope only has the stages that are named",
    },
    UnreportedMutants {
        rows: &["picture-to-split", "picture-to-copy", "picture-to-overlay"],
        parts: Parts::Any(Side::Before, S::TRANSFER, A::empty()),
        // Where COPY takes the picture as it lies, no layout change comes between, and the layer sees that OVERLAY waits for the copy.
        only: |_, edge| edge.label != "picture-to-overlay" || edge.carrier == OVER_PRESENTED,
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes a layout change to be ordered after that at the end of a render pass, or in a barrier before it. It is so by a chain \
              only: what comes before ends with TRANSFER, with which this begins",
    },
    UnreportedMutants {
        rows: &[
            "read-back",
            "split-to-picture",
            "copy-to-picture",
            "overlay-to-picture",
            "encode-to-picture",
            "present-to-swapchain",
        ],
        parts: Parts::Any(Side::After, S::TRANSFER, A::empty()),
        // With an access it is for a copy that comes right after.
        only: |_, edge| edge.after.access.is_empty(),
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the same, seen from the other side: what comes next begins with TRANSFER, with which this ends",
    },
    UnreportedMutants {
        rows: &["read-back"],
        parts: Parts::Row,
        // Only where the pass draws into an image of the swapchain.
        only: |_, edge| edge.after.access.is_empty(),
        section: "VkSubpassDependency",
        says: "If there is no subpass dependency from the last subpass that uses an attachment to VK_SUBPASS_EXTERNAL, then an implicit subpass \
               dependency exists from the last subpass it is used in to VK_SUBPASS_EXTERNAL",
        why: "the same for all of it: the implicit dependency holds nothing back, so that it makes no chain with what comes over the picture",
    },
    UnreportedMutants {
        rows: &["picture-to-overlay"],
        parts: Parts::Any(Side::After, S::empty(), A::COLOR_ATTACHMENT_WRITE),
        only: ALWAYS,
        section: "VkImageMemoryBarrier",
        says: "The second access scope is limited to access to memory through the specified image subresource range, via access types in the \
               destination access mask specified by dstAccessMask",
        why: "blending reads before it writes, and the layer takes the write to be ordered by the read. The picture must be visible to both \
              accesses, and is to those of the mask",
    },
    UnreportedMutants {
        rows: &["lighting-reuse", "transparent-reuse", "forward-reuse"],
        parts: Parts::Any(Side::Before, S::empty(), A::COLOR_ATTACHMENT_WRITE),
        // Where the light or the G-buffer is drawn by an earlier subpass of the render pass.
        only: |_, edge| {
            edge.before.stage == S::COLOR_ATTACHMENT_OUTPUT
                && !begins_with(edge, edge.to)
                && [geometry::PASS.place, lighting::PASS.place, forward::PASS.place]
                    .iter()
                    .any(|place| begins_with(edge, *place))
        },
        section: "Render Pass Creation",
        says: "Automatic layout transitions away from initialLayout happen-after the availability operations for all dependencies with a \
               srcSubpass equal to VK_SUBPASS_EXTERNAL, where dstSubpass uses the attachment that will be transitioned",
        why: "the layer takes what a row from OUTSIDE to an earlier subpass makes available to be so for this attachment too. That subpass does not \
              use it, so that its layout may change before. (Of the HDR target's later user, TONEMAP, tonemap-reuse would do by the letter)",
    },
    UnreportedMutants {
        rows: &["geometry-to-lighting", "geometry-to-readers"],
        parts: Parts::Any(
            Side::After,
            stages(S::FRAGMENT_SHADER, S::LATE_FRAGMENT_TESTS),
            A::from_raw(
                A::INPUT_ATTACHMENT_READ.as_raw()
                    | A::COLOR_ATTACHMENT_WRITE.as_raw()
                    | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
            ),
        ),
        only: |_, edge| !edge.is_between_subpasses(),
        section: "Image Layout Transitions",
        says: TRANSITION,
        why: "the layer takes all uses of an attachment that is loaded to be ordered by its load operation. That reads in other stages than inputs do \
              and than the store writes in, and what GEOMETRY stored, and the new layout, must be visible to each of these accesses",
    },
    UnreportedMutants {
        rows: &["lighting-to-transparent", "lighting-to-velocity"],
        parts: Parts::Row,
        only: |plan, _| plan.has_fog(),
        section: "VkSubpassDependency",
        says: "the first set of commands includes all commands submitted as part of the subpass instance identified by srcSubpass and any \
               load, store, or multisample resolve operations on attachments used in srcSubpass",
        why: "the layer lets the rows from LIGHTING to FOG and from there to TRANSPARENT or VELOCITY order what LIGHTING did. The first scope of the latter has only what is \
              submitted in FOG",
    },
    UnreportedMutants {
        rows: &["lighting-to-fog"],
        parts: Parts::All,
        only: |_, edge| !edge.is_between_subpasses(),
        section: "Rasterization Order",
        says: IN_ORDER,
        why: "the layer takes depth that one render pass stores and the next one loads, as its layout stays the same, to be in rasterization order. That order holds \
              within a subpass",
    },
];
