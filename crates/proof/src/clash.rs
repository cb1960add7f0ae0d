//! Hazards as drawings show them: each with its two uses apart, and hazards that are alike as one.

use ash::vk::{AccessFlags2 as A, ImageLayout, PipelineStageFlags2 as S};

use super::order::PRESENTATION;
use super::program::{MemoryAccess, TouchKind};
use super::words::noun;
use super::{Hazard, HazardKind, kind_of};
use afterlight::gpu::barrier::Half;

/// One side of a clash.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct End {
    /// The author of the use: `GEOMETRY`, or `the end of the GEOMETRY pass`.
    pub who: String,
    /// Empty for layout changes, and for presentation, which is no stage of Vulkan's.
    pub stages: S,
    /// Empty for layout changes.
    pub accesses: A,
    /// The load or store operation of an attachment, or the half of an ownership transfer, if the use is nothing else.
    pub operation: Option<&'static str>,
    /// Layout changes, each from one layout to another.
    pub changes: Vec<[ImageLayout; 2]>,
}

/// Two uses that nothing orders, and the memory that both touch.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Clash {
    /// The kind of hazard. Where a use comes after a layout change that itself came too soon, it is the kind that the two uses have without the change.
    pub kind: HazardKind,
    /// The names of the memory, with an article only if it is one thing: `depth`, `the picture`.
    pub memories: Vec<&'static str>,
    /// The number of frames by which the earlier use comes before the later one's; 0 for a use before all frames.
    pub frames_apart: usize,
    /// The earlier use.
    pub first: End,
    /// The later use.
    pub second: End,
}

/// Returns the clashes of hazards. Clashes that differ only in memory, stages, accesses and frames are merged, and reads of wrong values come before
/// layouts that change too soon.
pub fn clashes(hazards: &[Hazard]) -> Vec<Clash> {
    let mut merged: Vec<Clash> = Vec::new();
    for clash in hazards.iter().filter_map(|hazard| hazard.clash.as_ref()) {
        match merged.iter_mut().find(|own| own.is_alike(clash)) {
            Some(own) => own.merge(clash),
            None => merged.push(clash.clone()),
        }
    }
    merged.sort_by_key(|clash| clash.kind);
    merged
}

impl Clash {
    pub(super) fn of(first: &MemoryAccess, second: &MemoryAccess) -> Self {
        Self {
            kind: kind_of(first, second),
            memories: vec![noun(second.memory)],
            frames_apart: if first.frame == 0 { 0 } else { second.frame.saturating_sub(first.frame) },
            first: End::of(first),
            second: End::of(second),
        }
    }

    fn is_alike(&self, other: &Self) -> bool {
        let key = |own: &Self| (own.kind, own.frames_apart == 0);
        key(self) == key(other) && self.first.who == other.first.who && self.second.who == other.second.who
    }

    fn merge(&mut self, other: &Self) {
        add_new(&mut self.memories, &other.memories);
        self.frames_apart = self.frames_apart.min(other.frames_apart);
        self.first.merge(&other.first);
        self.second.merge(&other.second);
    }
}

impl End {
    fn of(touch: &MemoryAccess) -> Self {
        let (operation, changes) = match touch.kind {
            TouchKind::Plain => (None, Vec::new()),
            TouchKind::Load => (Some("load operation"), Vec::new()),
            TouchKind::Store => (Some("store operation"), Vec::new()),
            TouchKind::Transition { to, .. } => (None, vec![[touch.layout, to]]),
            TouchKind::HandOver { half: Half::Release, .. } => (Some("release"), Vec::new()),
            TouchKind::HandOver { half: Half::Acquire, .. } => (Some("acquire"), Vec::new()),
        };
        let stages = if touch.stage == PRESENTATION { S::empty() } else { touch.stage };
        Self { who: touch.who.to_string(), stages, accesses: touch.access, operation, changes }
    }

    fn merge(&mut self, other: &Self) {
        self.stages |= other.stages;
        self.accesses |= other.accesses;
        self.operation = self.operation.filter(|_| self.operation == other.operation);
        add_new(&mut self.changes, &other.changes);
    }
}

fn add_new<T: Copy + PartialEq>(all: &mut Vec<T>, others: &[T]) {
    for other in others {
        if !all.contains(other) {
            all.push(*other);
        }
    }
}
