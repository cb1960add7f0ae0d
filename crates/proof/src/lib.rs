//! Proves a plan's rows without a device, a driver or a layer: finds the hazards that they leave, and the rows that order nothing.
//!
//! The plan decides which memory its frames touch, and when; the rows decide how these touches are synchronized ([`frames`]). The specification's
//! rules of execution and memory dependencies decide which touches are ordered ([`order`]). A pair of touches of the same memory, one of which
//! writes, is a hazard if it is not ordered.

use std::collections::HashMap;
use std::fmt;

use ash::vk;

use afterlight::frame::rows::{Endpoint, Row, RowError, RowName, RowPart, Rows};
use afterlight::gpu::Queue;
use afterlight::gpu::barrier::Half;
use afterlight::gpu::sync::Use;
use afterlight::passes::{Resource, copy};
use afterlight::plan::FramePlan;
use order::HappensBefore;
use program::{Memory, MemoryAccess, Program, TouchKind, Who};

mod clash;
mod frames;
mod order;
mod program;
mod render_pass;
pub mod sequence;
pub mod simulation;
mod words;

pub use clash::{Clash, End, clashes};
pub use words::{Consequence, in_words};

/// The kind of hazard between two touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum HazardKind {
    /// A read may come before the write that it needs.
    ReadAfterWrite,
    /// Two writes may come in either order.
    WriteAfterWrite,
    /// A write may come before the read of the value that it replaces.
    WriteAfterRead,
    /// A layout change, and a use that it does not wait for.
    ChangeAfterUse,
    /// A use, and the layout change that it does not wait for.
    UseAfterChange,
    /// An image in another layout than it must have.
    Layout,
    /// A use on a queue that does not own the memory.
    Owner,
}

impl fmt::Display for HazardKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ReadAfterWrite => "read after write",
            Self::WriteAfterWrite => "write after write",
            Self::WriteAfterRead => "write after read",
            Self::ChangeAfterUse => "layout change after use",
            Self::UseAfterChange => "use after layout change",
            Self::Layout => "wrong layout",
            Self::Owner => "wrong owner",
        })
    }
}

/// Two touches of the same memory that nothing orders.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Hazard {
    /// The kind of the hazard.
    pub kind: HazardKind,
    /// As `the target Depth`.
    pub memory: String,
    /// As `GEOMETRY in frame 1 (LATE_FRAGMENT_TESTS, DEPTH_STENCIL_ATTACHMENT_WRITE)`; of a wrong layout or owner, the one that it has.
    pub first: String,
    /// The later use.
    pub second: String,
    /// The hazard without Vulkan's terms.
    pub consequence: Consequence,
    /// The two uses apart; none for a wrong layout or owner, which needs one use only.
    clash: Option<Clash>,
}

impl fmt::Display for Hazard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, memory, first, second, .. } = self;
        match kind {
            HazardKind::Layout => write!(f, "{kind} of {memory}: {second} finds it in {first}"),
            HazardKind::Owner => write!(f, "{kind} of {memory}: {second} finds it {first}"),
            _ => write!(f, "{kind} of {memory}: nothing orders {first} before {second}"),
        }
    }
}

/// A model of a plan's frames with these rows: touches of memory, and their synchronization. Different plans may have equal models.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct FrameModel(Program);

impl FrameModel {
    /// Models the frames of a plan with these dependencies.
    pub fn of(plan: &FramePlan, rows: &Rows) -> Self {
        Self(frames::program(plan, rows))
    }

    /// The dispatch that evaluates formulas for `afterlight stress`.
    pub fn of_formulas(rows: &Rows) -> Self {
        Self(frames::formulas(rows))
    }

    /// The passes of the frame with most of them, in order: subpasses, and separate dispatches and draws.
    pub fn passes(&self) -> Vec<Endpoint> {
        let others = [Endpoint::HOST, Endpoint::UPLOAD, Endpoint::PRESENTATION, copy::PASS.name];
        let is_pass = |place: &Endpoint| !others.contains(place);
        let of_frame = |frame: usize| {
            let touches = self.0.touches.iter().filter(|touch| touch.frame == frame);
            let places = touches.filter_map(|touch| match touch.who {
                Who::At(place) => Some(place).filter(is_pass),
                _ => None,
            });
            let mut places: Vec<_> = places.collect();
            places.dedup();
            places
        };
        (1..=self.0.frame).map(of_frame).max_by_key(Vec::len).unwrap_or_default()
    }

    /// Returns all hazards: none if every pair of touches is ordered.
    pub fn hazards(&self) -> Vec<Hazard> {
        hazards_of(&self.0).collect()
    }

    /// Returns true if there are no hazards; stops at the first one.
    pub fn are_safe(&self) -> bool {
        hazards_of(&self.0).next().is_none()
    }
}

/// Returns true if a part of a row is superfluous: it orders only touches that others order already.
///
/// # Errors
/// As [`Rows::without_part`].
pub fn is_superfluous(plan: &FramePlan, rows: &Rows, name: RowName, part: RowPart) -> Result<bool, RowError> {
    Ok(FrameModel::of(plan, &rows.without_part(name, part)?).are_safe())
}

/// The parts of a row without which the proof finds no hazard either, because other rows order the same. A row that cannot be dropped has none.
pub fn covered(plan: &FramePlan, rows: &Rows, row: &Row) -> Vec<RowPart> {
    let is_covered = |part: &RowPart| is_superfluous(plan, rows, row.name, *part).unwrap_or(false);
    if row.carrier.stays().is_some() { Vec::new() } else { row.parts().into_iter().filter(is_covered).collect() }
}

/// The touches of memory so far.
#[derive(Default)]
struct AccessHistory<'a> {
    /// Writes of the last group that wrote it.
    writes: Vec<&'a MemoryAccess>,
    /// Reads since these writes.
    reads: Vec<&'a MemoryAccess>,
    layout: vk::ImageLayout,
    /// A use that the layout change since then does not wait for.
    overtaken: Option<&'a MemoryAccess>,
    owner: Owner,
}

/// The queue whose family owns some memory, with its contents.
#[derive(Default, Clone, Copy, PartialEq, Eq)]
enum Owner {
    /// Nothing has used it.
    #[default]
    Nobody,
    /// One has.
    Queue(Queue),
    /// The first has released it to the second.
    Given([Queue; 2]),
}

impl Owner {
    /// The owner after a touch. The error says with whom the touch finds the contents.
    fn after(self, touch: &MemoryAccess) -> Result<Self, String> {
        // The CPU and presentation have no family. A frame's data counts as shared by all: of it, passes on the compute queue read the camera alone, whose buffer is.
        let Some(queue) = touch.queue.filter(|_| touch.memory.resource != Resource::FrameData) else { return Ok(self) };
        let is_discarded =
            matches!(touch.kind, TouchKind::Transition { .. }) && touch.layout == vk::ImageLayout::UNDEFINED;
        match (self, &touch.kind) {
            (Self::Queue(own), TouchKind::HandOver { half: Half::Release, queues, .. }) if own == queues[0] => {
                Ok(Self::Given(*queues))
            }
            (Self::Given(given), TouchKind::HandOver { half: Half::Acquire, queues, .. }) if given == *queues => {
                Ok(Self::Queue(queues[1]))
            }
            (_, TouchKind::HandOver { .. }) => Err(self.to_string()),
            _ if is_discarded => Ok(Self::Queue(queue)),
            (Self::Nobody, _) => Ok(Self::Queue(queue)),
            (Self::Queue(own), _) if own == queue => Ok(self),
            _ => Err(self.to_string()),
        }
    }
}

impl fmt::Display for Owner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nobody => f.write_str("with no queue"),
            Self::Queue(own) => write!(f, "with the {}", own.name()),
            Self::Given([from, to]) => write!(f, "on its way from the {} to the {}", from.name(), to.name()),
        }
    }
}

/// The hazards of a program, as they are found.
fn hazards_of(program: &Program) -> impl Iterator<Item = Hazard> {
    let order = HappensBefore::new(program);
    let begin = |&(memory, layout): &(Memory, _)| (memory, AccessHistory { layout, ..AccessHistory::default() });
    let mut past: HashMap<Memory, AccessHistory> = program.layouts.iter().map(begin).collect();
    // The touches of one memory by one group come together.
    let mut groups: Vec<Vec<&MemoryAccess>> = Vec::new();
    let mut last: HashMap<Memory, usize> = HashMap::new();
    for touch in &program.touches {
        match last.get(&touch.memory) {
            Some(&index) if groups[index][0].group == touch.group => groups[index].push(touch),
            _ => {
                last.insert(touch.memory, groups.len());
                groups.push(vec![touch]);
            }
        }
    }
    groups.into_iter().flat_map(move |group| past.entry(group[0].memory).or_default().take(&order, &group))
}

impl<'a> AccessHistory<'a> {
    /// Adds the touches of a group, and returns their hazards with earlier touches.
    fn take(&mut self, order: &HappensBefore, group: &[&'a MemoryAccess]) -> Vec<Hazard> {
        let mut found = Vec::new();
        let mut report = |kind, first: String, second: &MemoryAccess, consequence, clash| {
            let (memory, second) = (second.memory.to_string(), describe_access(second));
            found.push(Hazard { kind, memory, first, second, consequence, clash });
        };
        for &touch in group {
            if touch.layout != vk::ImageLayout::UNDEFINED && touch.layout != self.layout {
                let layout = format!("{:?}", self.layout);
                report(HazardKind::Layout, layout.clone(), touch, Consequence::of_layout(&layout, touch), None);
            }
            if let TouchKind::Transition { to, .. } = touch.kind {
                self.layout = to;
            }
            self.owner = self.owner.after(touch).unwrap_or_else(|found| {
                report(HazardKind::Owner, found.clone(), touch, Consequence::of_owner(&found, touch), None);
                touch.queue.map_or(self.owner, Owner::Queue)
            });
        }
        let of_kind = |kind: &TouchKind| group.iter().copied().filter(|touch| touch.kind == *kind).collect::<Vec<_>>();
        // The load operation comes before all else that the group does. A group that only reads holds no earlier reader back.
        let loads: Vec<_> = of_kind(&TouchKind::Load).into_iter().filter(|touch| touch.is_write()).collect();
        let mut overtaken = None;
        for second in if loads.is_empty() { group.to_vec() } else { loads } {
            let reads = self.reads.iter().filter(|_| second.is_write());
            for first in self.writes.iter().chain(reads).filter(|first| !order.has(first, second)) {
                let consequence = Consequence::of(first, self.overtaken, second);
                let clash = Clash::of(words::blamed(first, self.overtaken, second), second);
                report(kind_of(first, second), describe_access(first), second, consequence, Some(clash));
                overtaken.get_or_insert(*first);
            }
        }
        self.overtaken = overtaken.filter(|_| group.iter().any(|touch| touch.is_change()));
        // And before its store operation.
        let stores = of_kind(&TouchKind::Store);
        let (writes, reads): (Vec<_>, Vec<_>) = group.iter().copied().partition(|touch| touch.is_write());
        match (stores.is_empty(), writes.is_empty()) {
            (false, _) => (self.writes, self.reads) = (stores, Vec::new()),
            (true, false) => (self.writes, self.reads) = (writes, reads),
            (true, true) => self.reads.extend(reads),
        }
        found
    }
}

fn kind_of(first: &MemoryAccess, second: &MemoryAccess) -> HazardKind {
    match (first.is_write(), second.is_write()) {
        _ if second.is_change() => HazardKind::ChangeAfterUse,
        _ if first.is_change() => HazardKind::UseAfterChange,
        (true, true) => HazardKind::WriteAfterWrite,
        (true, false) => HazardKind::ReadAfterWrite,
        _ => HazardKind::WriteAfterRead,
    }
}

/// A touch in words.
fn describe_access(touch: &MemoryAccess) -> String {
    let when = match touch.frame {
        0 => String::new(),
        frame => format!(" in frame {frame}"),
    };
    let who = touch.who;
    let what = match &touch.kind {
        TouchKind::Transition { to, .. } => {
            return format!("the change from {:?} to {to:?} by {who}{when}", touch.layout);
        }
        TouchKind::HandOver { half: Half::Release, .. } => return format!("the release by {who}{when}"),
        TouchKind::HandOver { half: Half::Acquire, .. } => return format!("the acquire by {who}{when}"),
        TouchKind::Load => ", loading,",
        TouchKind::Store => ", storing,",
        TouchKind::Plain => "",
    };
    let uses = Use::new(touch.stage, touch.access);
    format!("{who}{when}{what} ({}, {})", uses.stages(), uses.accesses())
}

#[cfg(test)]
mod tests;
