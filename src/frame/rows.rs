//! Every dependency of the program, in one table for a plan.
//!
//! A row orders uses of one place before uses of another. Two subpasses of a render pass have one row between them, because dependencies of the same pair
//! overlap and would hide each other's missing bits. Passes declare stages, accesses and layouts, and [`mod@waits`] makes rows of these; the others are written by hand
//! here. [`table`] is a pure function of the plan. The render passes and the barriers are made from its value, a [`Rows`]. `afterlight inspect` prints it.
//!
//! The crate `afterlight-proof` computes that the rows suffice, and which of their parts others order as well. All of a renderer is made from the value, so another value makes another
//! renderer: with a row dropped, or one bit. `tests/sync/necessity.rs` compares the proof with a layer's reports in this way, and `afterlight inspect
//! --drop` shows both.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Mutex, PoisonError};

use ash::vk;

use super::list;
use super::list::{RenderPassName, Step};
use crate::gpu::Queue;
use crate::gpu::sync::{Dependency, Layouts, SyncVersion, Use};
pub use crate::passes::{Endpoint, Resource};
use crate::plan::{FramePlan, Target};
use crate::scene::{self, Passes};

mod host;
#[doc(hidden)]
pub mod masks;
mod prefilter;
mod presentation;
mod queues;
mod renamed;
#[doc(hidden)]
pub mod shadow;
mod uploads;
mod waits;
pub(super) mod widened;

pub use host::FORMULA_WRITE;
#[doc(hidden)]
pub use masks::SUPPORTED;
pub use renamed::{in_windows, lack};
pub(super) use waits::BarrierPosition;

/// The Vulkan mechanism that carries a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SyncKind {
    /// A subpass dependency of a render pass.
    Subpass(RenderPassName),
    /// A pipeline barrier of rendering without a render pass: inside it where both ends are parts of it, and before or after it otherwise.
    Rendering(RenderPassName),
    /// A pipeline barrier on an image, with its layouts before and after.
    ImageBarrier(vk::ImageLayout, vk::ImageLayout),
    /// A pipeline barrier on a buffer.
    BufferBarrier,
    /// A pipeline barrier on all memory.
    MemoryBarrier,
    /// `vkQueueSubmit` itself, which orders the CPU's earlier writes before everything submitted ("Host Write Ordering Guarantees"): for memory that
    /// is not HOST_COHERENT, the writes flushed before it. Two submissions are ordered only by rows from or to OUTSIDE, which reach beyond one of
    /// them.
    Submission,
    /// The CPU waits for a submission's fence (a `Ticket`).
    Fence,
    /// A semaphore between a submission and presentation.
    Semaphore,
    /// A semaphore between two queues, which counts.
    QueueSemaphore,
    /// A pair of barriers that gives images or buffers to another queue's family: a release on the first queue, an acquire on the second.
    Ownership([Queue; 2]),
}

impl SyncKind {
    /// The kind of the rows of a render pass in a plan's frames.
    pub(super) fn of_pass(plan: &FramePlan, name: RenderPassName) -> Self {
        match plan.passes {
            Passes::Subpasses | Passes::Stored => Self::Subpass(name),
            Passes::LocalRead => Self::Rendering(name),
        }
    }

    /// The render pass that rows of this kind belong to.
    pub fn pass(self) -> Option<RenderPassName> {
        match self {
            Self::Subpass(name) | Self::Rendering(name) => Some(name),
            _ => None,
        }
    }

    /// Returns true if rows of this kind belong to a render pass, or to rendering in its place.
    pub fn is_render_pass(self) -> bool {
        self.pass().is_some()
    }

    /// The reason why rows of this kind cannot be dropped; none if they can.
    pub fn stays(self) -> Option<&'static str> {
        match self {
            Self::Submission => Some("vkQueueSubmit orders it, whatever the program does"),
            Self::Fence => Some(
                "without it the CPU would read, write or free memory under the device's hands, and no driver has to survive that",
            ),
            Self::Semaphore => Some(
                "the call that acquires the image signals it, or the call that presents waits for it: a signal without its wait, or a wait without its \
                 signal, is invalid use by itself",
            ),
            _ => None,
        }
    }
}

impl fmt::Display for SyncKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Subpass(pass) => write!(f, "dependency of the {pass}"),
            Self::Rendering(pass) => write!(f, "barrier of the {pass}"),
            Self::ImageBarrier(old, new) => write!(f, "image barrier {old:?} -> {new:?}"),
            Self::BufferBarrier => f.write_str("buffer barrier"),
            Self::MemoryBarrier => f.write_str("memory barrier"),
            Self::Submission => f.write_str("submission"),
            Self::Fence => f.write_str("fence"),
            Self::Semaphore => f.write_str("semaphore"),
            Self::QueueSemaphore => f.write_str("semaphore between queues"),
            Self::Ownership(_) => f.write_str("ownership transfer"),
        }
    }
}

/// A row, by the name that `afterlight inspect` prints. The names of rows between passes follow from their ends; others are constants beside the row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RowName {
    /// A row that is written by hand.
    Own(&'static str),
    /// A wait of one pass for another: `lighting-to-fog`.
    Pair(Endpoint, Endpoint),
    /// A wait of all passes that read a buffer for the one that wrote it: `skin-to-readers`.
    Readers(Endpoint),
    /// A wait of a pass for an image, outside of render passes: `rays-to-reflect-resolve`. The first word is the image's, and not a pass's.
    Image(Target, Endpoint),
    /// A wait of a pass for the frame before: `geometry-reuse`.
    Reuse(Endpoint),
    /// A wait for an image that the frame before has used: `hiz-reuse`.
    ImageReuse(Target),
}

impl RowName {
    /// As `afterlight inspect` prints it and [`Rows::named`] takes it: `geometry-to-lighting`. Each name is kept for the rest of the program: there are only
    /// as many as pairs of passes.
    pub fn name(self) -> &'static str {
        static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        let name = self.to_string();
        names.get(name.as_str()).copied().unwrap_or_else(|| {
            let kept: &'static str = name.leak();
            names.insert(kept);
            kept
        })
    }
}

impl fmt::Display for RowName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |place: &Endpoint| renamed::spelled(*place);
        let image = |target: &Target| Resource::Target(*target).to_string();
        match self {
            Self::Own(name) => f.pad(name),
            Self::Pair(from, to) => f.pad(&format!("{}-to-{}", of(from), of(to))),
            Self::Readers(from) => f.pad(&format!("{}-to-readers", of(from))),
            Self::Image(target, to) => f.pad(&format!("{}-to-{}", image(target), of(to))),
            Self::Reuse(to) => f.pad(&format!("{}-reuse", of(to))),
            Self::ImageReuse(target) => f.pad(&format!("{}-reuse", image(target))),
        }
    }
}

/// The part of a row that is removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowPart {
    /// All of it.
    Row,
    /// The reach across the samples of a pixel: the row becomes one by region.
    AcrossSamples,
    /// Some bits of one side.
    Bits(Side, Use),
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Unique within a table.
    pub name: RowName,
    /// The name as it is spelled.
    pub label: &'static str,
    /// The Vulkan construct that the row becomes.
    pub carrier: SyncKind,
    /// The subpass or step that must be over.
    pub from: Endpoint,
    /// The subpass or step that must wait, or the first of them.
    pub to: Endpoint,
    /// All subpasses and steps that wait; none where the row is written by hand.
    pub waiting: Vec<Endpoint>,
    /// The resources whose uses it orders; none where the row is written by hand.
    pub resources: Vec<Resource>,
    /// The first scope, the union of all uses that must be complete: their stages, and their write accesses.
    pub before: Use,
    /// The second scope, the union of all uses that wait.
    pub after: Use,
    /// `VK_DEPENDENCY_BY_REGION_BIT`: each pixel waits only for itself, and between subpasses of as many samples each sample. False outside of subpass
    /// dependencies.
    pub by_region: bool,
    /// The row would be by region, but one side reads other samples of its pixel.
    pub across_samples: bool,
    /// The reason in a sentence, for `afterlight inspect` and its documentation.
    pub why: String,
}

/// A side of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// The first scope: uses that must be complete.
    Before,
    /// The second scope: uses that wait.
    After,
}

impl Row {
    /// Adapts the row to a plan: its layouts, and the masks of its API.
    fn in_frames_of(self, plan: &FramePlan) -> Self {
        let carrier = match self.carrier {
            SyncKind::ImageBarrier(old, new) => SyncKind::ImageBarrier(plan.layouts.of(old), plan.layouts.of(new)),
            other => other,
        };
        match plan.sync {
            SyncVersion::One => Self { carrier, before: self.before.coarse(), after: self.after.coarse(), ..self },
            SyncVersion::Two => Self { carrier, ..self },
        }
    }

    /// Both sides' masks, as a barrier takes them.
    pub fn order(&self) -> Dependency {
        Dependency { row: self.label, before: self.before, after: self.after }
    }

    /// The row without its reason and the passes that share it, by which rows of different plans are compared.
    pub fn masks(&self) -> Self {
        Self { why: String::new(), waiting: Vec::new(), resources: Vec::new(), ..self.clone() }
    }

    /// Each part of the row that can be taken away: all of it, its reach across samples, and each stage and access of both sides.
    pub fn parts(&self) -> Vec<RowPart> {
        let mut parts = vec![RowPart::Row];
        parts.extend(self.across_samples.then_some(RowPart::AcrossSamples));
        // Signals wait for all that their queue was given.
        let is_signalled = self.carrier == SyncKind::QueueSemaphore;
        for side in [Side::Before, Side::After].into_iter().filter(|side| !is_signalled || *side == Side::After) {
            parts.extend(masks::bits(self.side(side)).map(|bit| RowPart::Bits(side, bit)));
        }
        parts
    }

    /// Returns true if it is between two subpasses of one render pass.
    pub fn is_between_subpasses(&self) -> bool {
        self.by_region || self.across_samples
    }

    /// `, by region` or `, across samples`, to follow the carrier in words; empty for other rows.
    pub fn region(&self) -> &'static str {
        match (self.by_region, self.across_samples) {
            (true, _) => ", by region",
            (_, true) => ", across samples",
            _ => "",
        }
    }

    /// The stages and accesses of one side.
    pub fn side(&self, side: Side) -> Use {
        match side {
            Side::Before => self.before,
            Side::After => self.after,
        }
    }
}

/// A row that cannot be changed: a name that the plan has not, or one that stays.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RowError(String);

/// The dependencies of a plan's frames, or all but some of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rows {
    rows: Vec<Row>,
    /// The layouts that the frames' images are used in.
    pub layouts: Layouts,
    /// The API by which the frames and their uploads are recorded.
    pub sync: SyncVersion,
    /// Frames have a barrier that waits for everything before each render pass and each pass outside of them ([`Rows::with_full_barriers`]).
    pub(super) has_full_barriers: bool,
}

impl Rows {
    /// All rows in the order of a frame; rows between the CPU and the device come last.
    pub fn iter(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter()
    }

    /// The rows of one carrier.
    pub fn of(&self, carrier: SyncKind) -> impl Iterator<Item = &Row> {
        self.iter().filter(move |row| row.carrier == carrier)
    }

    /// The row of this name. A frame that asks for one which its plan has not gets none, orders nothing, and the proof (`afterlight-proof`) finds the hazard.
    pub fn find(&self, name: RowName) -> Option<&Row> {
        self.iter().find(|row| row.name == name)
    }

    /// The row that is spelled so, or that has taken the place of one which was.
    ///
    /// # Errors
    /// When the plan has none. The message lists the rows for which `is_listed` returns true.
    pub fn named(&self, name: &str, is_listed: impl Fn(&Row) -> bool) -> Result<&Row, RowError> {
        let own = renamed::row_of(self, name).or_else(|| renamed::successor(self, name));
        own.ok_or_else(|| {
            let names: Vec<_> = self.iter().filter(|row| is_listed(row)).map(|row| row.label).collect();
            RowError(scene::unknown("dependency of this plan", name, &names))
        })
    }

    /// All but the row of this name. A render pass is then made without it. A barrier becomes one that orders nothing, so that a layout
    /// that it changes is still changed; so does an ownership transfer, and a semaphore between queues is one that no command waits for.
    ///
    /// # Errors
    /// When there is no such row, or it cannot be dropped.
    pub fn without(&self, name: RowName) -> Result<Self, RowError> {
        let index = self.changeable(name)?;
        let mut rows = self.rows.clone();
        if rows[index].carrier.is_render_pass() {
            rows.remove(index);
        } else {
            (rows[index].before, rows[index].after) = (Use::START, Use::END);
        }
        Ok(self.with(rows))
    }

    /// All but a part of a row.
    ///
    /// # Errors
    /// As [`Rows::without`].
    pub fn without_part(&self, name: RowName, part: RowPart) -> Result<Self, RowError> {
        match part {
            RowPart::Row => self.without(name),
            RowPart::AcrossSamples => {
                let index = self.changeable(name)?;
                let mut rows = self.rows.clone();
                (rows[index].by_region, rows[index].across_samples) = (true, false);
                Ok(self.with(rows))
            }
            RowPart::Bits(side, bits) => self.without_bits(name, side, bits),
        }
    }

    /// Returns a copy of the table without some bits of one side of a row. Removing a stage also removes the accesses that no other stage of that
    /// side supports. A side without stages waits for nothing, or holds nothing back.
    ///
    /// # Errors
    /// When there is no such row, or it cannot be changed.
    pub fn without_bits(&self, name: RowName, side: Side, bits: Use) -> Result<Self, RowError> {
        let index = self.changeable(name)?;
        let mut rows = self.rows.clone();
        let row = &mut rows[index];
        match side {
            Side::Before => row.before = masks::without(row.before, bits).unwrap_or(Use::START),
            Side::After => row.after = masks::without(row.after, bits).unwrap_or(Use::END),
        }
        Ok(self.with(rows))
    }

    fn with(&self, rows: Vec<Row>) -> Self {
        Self { rows, ..*self }
    }

    /// Returns the index of a row that an experiment may change.
    fn changeable(&self, name: RowName) -> Result<usize, RowError> {
        let Some(index) = self.rows.iter().position(|row| row.name == name) else {
            return Err(RowError(format!("this plan has no dependency {name}")));
        };
        match self.rows[index].carrier.stays() {
            Some(why) => Err(RowError(format!("the dependency {name} cannot be dropped: {why}"))),
            None => Ok(index),
        }
    }
}

/// The dependencies of the program that evaluates formulas for `afterlight stress`: one dispatch.
pub fn formulas() -> Rows {
    Rows { rows: host::formulas().into(), layouts: Layouts::Optimal, sync: SyncVersion::One, has_full_barriers: false }
}

/// The dependencies of a plan's frames.
pub fn table(plan: &FramePlan) -> Rows {
    let steps = list::steps(plan);
    let mut rows = uploads::rows(plan);
    rows.extend(queues::of_uploads(plan));
    rows.extend(prefilter::rows(plan, &steps));
    rows.extend(shadow::rows(plan, &steps));
    rows.extend(waits(plan, &steps).into_iter().map(|(row, _)| row));
    rows.extend(queues::rows(&steps));
    rows.extend(presentation::rows(plan, &steps));
    rows.extend(host::rows());
    let rows = rows.into_iter().map(|row| row.in_frames_of(plan)).collect();
    Rows { rows, layouts: plan.layouts, sync: plan.sync, has_full_barriers: false }
}

/// The rows between the passes of a frame; a row that is a barrier comes with its place in the list.
pub(super) fn waits(plan: &FramePlan, steps: &[Step]) -> Vec<(Row, Option<BarrierPosition>)> {
    waits::rows(plan, steps).into_iter().map(|wait| (wait.row, wait.barrier)).collect()
}

/// A row that is being written: the uses that must be over, the uses that wait, and why.
struct RowBuilder(Row);

fn row(name: RowName, carrier: SyncKind) -> RowBuilder {
    let (from, to, before, after) = (Endpoint::OUTSIDE, Endpoint::OUTSIDE, Use::START, Use::END);
    RowBuilder(Row {
        name,
        label: name.name(),
        carrier,
        from,
        to,
        waiting: Vec::new(),
        resources: Vec::new(),
        before,
        after,
        by_region: false,
        across_samples: false,
        why: String::new(),
    })
}

/// A row that changes an image's layout.
fn barrier(name: RowName, old: vk::ImageLayout, new: vk::ImageLayout) -> RowBuilder {
    row(name, SyncKind::ImageBarrier(old, new))
}

impl RowBuilder {
    // ANCHOR: first-scope
    /// Sets the first scope: uses that must be complete.
    fn from(self, from: Endpoint, uses: &[Use]) -> Self {
        // Only writes have to be made available (specification, "Execution and Memory Dependencies"): a read access in the first scope
        // does nothing, and an earlier stage does nothing beside a later one.
        Self(Row { from, before: masks::latest(Use::all(uses).writes()), ..self.0 })
    }
    // ANCHOR_END: first-scope

    /// Sets the second scope: uses that wait.
    fn to(self, to: Endpoint, uses: &[Use]) -> Self {
        Self(Row { to, after: Use::all(uses), ..self.0 })
    }

    /// Names all that wait.
    fn for_all(self, reasons: &[(Endpoint, Vec<&'static str>)]) -> Self {
        Self(Row { waiting: reasons.iter().map(|(place, _)| *place).collect(), ..self.0 })
    }

    /// Names the resources that it orders.
    fn about(self, resources: Vec<Resource>) -> Self {
        Self(Row { resources, ..self.0 })
    }

    /// A dependency between two subpasses is by region: each pixel waits only for itself. With `reads_all`, invocations for one sample read the other
    /// samples of their pixel, so the row is not by region: "If N equals M", with N samples a pixel on one side and M on the other, "then a
    /// framebuffer region containing a single (x, y, layer, sample) coordinate in the first synchronization scope corresponds to a region containing
    /// the same sample at the same coordinate in the second" (specification, "Framebuffer Region Dependencies").
    fn between(self, is_between: bool, reads_all: bool) -> Self {
        Self(Row { by_region: is_between && !reads_all, across_samples: is_between && reads_all, ..self.0 })
    }

    fn because(self, why: impl Into<String>) -> Row {
        Row { why: why.into(), ..self.0 }
    }
}
