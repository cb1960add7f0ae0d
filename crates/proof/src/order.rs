//! The happens-before relation of touches: the specification's rules of execution and memory dependencies ("Execution and Memory Dependencies", "Pipeline
//! Stages", "Image Layout Transitions"), as a pure function of a [`Program`].

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use super::program::{MemoryAccess, Program, Scope, Sync, TouchKind};

/// A stage of our own: presentation, which the program orders by semaphores.
pub(super) const PRESENTATION: S = S::from_raw(1 << 62);

/// The stages of drawing, each logically earlier than the next.
const DRAWING: [S; 9] = [
    S::DRAW_INDIRECT,
    S::VERTEX_INPUT,
    S::INDEX_INPUT,
    S::VERTEX_ATTRIBUTE_INPUT,
    S::VERTEX_SHADER,
    S::EARLY_FRAGMENT_TESTS,
    S::FRAGMENT_SHADER,
    S::LATE_FRAGMENT_TESTS,
    S::COLOR_ATTACHMENT_OUTPUT,
];

/// The stages that TRANSFER is made of.
const COPIES: S = S::from_raw(S::ALL_TRANSFER.as_raw() | S::COPY.as_raw() | S::BLIT.as_raw() | S::CLEAR.as_raw());

/// Every stage of the device that anything here happens in.
fn all_commands() -> S {
    DRAWING.into_iter().fold(S::COMPUTE_SHADER | COPIES, |all, stage| all | stage)
}

/// The mask with the finer stages that its coarse ones are made of.
fn in_full(mask: S) -> S {
    let is_drawing = mask.contains(S::ALL_GRAPHICS);
    let drawing = DRAWING.into_iter().filter(|_| is_drawing).fold(S::empty(), |all, stage| all | stage);
    let copies = if mask.contains(S::ALL_TRANSFER) { COPIES } else { S::empty() };
    let fetches = if mask.contains(S::VERTEX_INPUT) { S::INDEX_INPUT | S::VERTEX_ATTRIBUTE_INPUT } else { S::empty() };
    mask | copies | fetches | drawing
}

/// The stages of a first scope: its mask's, and all that are logically earlier. A wait for the end of the pipe waits for everything.
fn with_earlier(mask: S) -> S {
    if mask.intersects(S::ALL_COMMANDS | S::BOTTOM_OF_PIPE) {
        return all_commands() | mask;
    }
    let mask = in_full(mask);
    let last = DRAWING.iter().rposition(|stage| mask.intersects(*stage)).map_or(0, |index| index + 1);
    let indirect = if mask.intersects(S::COMPUTE_SHADER) { S::DRAW_INDIRECT } else { S::empty() };
    DRAWING[..last].iter().fold(mask | indirect, |all, stage| all | *stage)
}

/// The stages of a second scope: its mask's, and all that are logically later.
fn with_later(mask: S) -> S {
    if mask.intersects(S::ALL_COMMANDS | S::TOP_OF_PIPE) {
        return all_commands() | mask;
    }
    let mask = in_full(mask);
    let first = DRAWING.iter().position(|stage| mask.intersects(*stage)).unwrap_or(DRAWING.len());
    let compute = if mask.intersects(S::DRAW_INDIRECT) { S::COMPUTE_SHADER } else { S::empty() };
    DRAWING[first..].iter().fold(mask | compute, |all, stage| all | *stage)
}

/// The accesses with the finer ones that coarse ones are made of.
fn accesses_in_full(mask: A) -> A {
    let reads =
        if mask.contains(A::SHADER_READ) { A::SHADER_SAMPLED_READ | A::SHADER_STORAGE_READ } else { A::empty() };
    let writes = if mask.contains(A::SHADER_WRITE) { A::SHADER_STORAGE_WRITE } else { A::empty() };
    mask | reads | writes
}

impl Scope {
    /// An access scope has only the stages and accesses that are named.
    fn reaches_memory(&self, touch: &MemoryAccess) -> bool {
        let named = in_full(self.mask.stage).contains(touch.stage)
            || self.mask.stage.contains(S::ALL_COMMANDS) && all_commands().contains(touch.stage);
        let any = if touch.is_write() { A::MEMORY_WRITE } else { A::MEMORY_READ };
        self.span.contains(touch)
            && named
            && (accesses_in_full(self.mask.access).contains(touch.access) || self.mask.access.contains(any))
    }
}

/// Bits of one word for each 64 synchronizations.
#[derive(Clone)]
struct Bits(Vec<u64>);

impl Bits {
    fn new(len: usize) -> Self {
        Self(vec![0; len.div_ceil(64)])
    }

    fn set(&mut self, index: usize) {
        self.0[index / 64] |= 1 << (index % 64);
    }

    fn has(&self, index: usize) -> bool {
        self.0[index / 64] >> (index % 64) & 1 == 1
    }

    /// The numbers of all that are set.
    fn iter(&self) -> impl Iterator<Item = usize> {
        (0..self.0.len() * 64).filter(|&index| self.has(index))
    }

    fn meets(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).any(|(own, other)| own & other != 0)
    }
}

/// The synchronizations that happen after a touch: for execution, and for making its write available.
struct Reached {
    executed: Bits,
    available: Bits,
}

/// What the result of two touches depends on: the first, whether the second is in the same instance of a render pass, and whether one of the two is of all
/// samples of its pixel.
type ReachKey = (*const MemoryAccess, bool, bool);

/// The rules, applied to one program.
pub(super) struct HappensBefore<'a> {
    program: &'a Program,
    /// The stages of each synchronization's first scope, with the logically earlier ones.
    firsts: Vec<S>,
    /// The stages of each synchronization's second scope, with the logically later ones.
    seconds: Vec<S>,
    /// For each synchronization, the earlier ones that it may follow in a chain.
    before: Vec<Bits>,
    /// Results so far.
    reached: RefCell<HashMap<ReachKey, Rc<Reached>>>,
}

impl<'a> HappensBefore<'a> {
    pub(super) fn new(program: &'a Program) -> Self {
        let syncs = &program.syncs;
        // Synchronizations are sorted by their second scopes, so that a chain leads only forward.
        debug_assert!(syncs.is_sorted_by_key(|sync| sync.second.span.from));
        let seconds: Vec<_> = syncs.iter().map(|sync| with_later(sync.second.mask.stage)).collect();
        let firsts: Vec<_> = syncs.iter().map(|sync| with_earlier(sync.first.mask.stage)).collect();
        let chained = |(later, first): (&Sync, &S), earlier_syncs: &[Sync]| {
            let mut before = Bits::new(syncs.len());
            for (index, (earlier, second)) in earlier_syncs.iter().zip(&seconds).enumerate() {
                if second.intersects(*first) && earlier.second.span.meets(later.first.span) {
                    before.set(index);
                }
            }
            before
        };
        let before =
            syncs.iter().zip(&firsts).enumerate().map(|(index, later)| chained(later, &syncs[..index])).collect();
        Self { program, firsts, seconds, before, reached: RefCell::default() }
    }

    // ANCHOR: has
    /// Returns true if `first` is over before `second` begins, and its writes, if any, have reached `second`.
    pub(super) fn has(&self, first: &MemoryAccess, second: &MemoryAccess) -> bool {
        // A dependency by region orders touches of the same pixel alone, in the same instance of a render pass.
        let local = first.local.filter(|_| first.local == second.local);
        let all_samples = first.all_samples || second.all_samples;
        let key = (std::ptr::from_ref(first), local.is_some(), all_samples);
        let known = self.reached.borrow().get(&key).cloned();
        let reached = known.unwrap_or_else(|| {
            let new = self.reach(first, local);
            let new = Rc::new(if all_samples { self.across_samples(&new) } else { new });
            self.reached.borrow_mut().insert(key, Rc::clone(&new));
            new
        });
        let needs_memory = first.is_write();
        let from = if needs_memory { &reached.available } else { &reached.executed };
        match &second.kind {
            TouchKind::Transition { by, .. } => by.iter().any(|&sync| from.has(sync)),
            TouchKind::HandOver { by, .. } => from.has(*by),
            _ if second.stage == S::HOST => {
                let waits = self.after(second, &reached.executed, |sync| sync.is_fence);
                // A fence makes nothing visible to the CPU.
                waits && (!needs_memory || second.is_write() || self.sees(second, &reached.available))
            }
            _ if needs_memory => self.sees(second, from),
            _ => self.after(second, from, |_| true),
        }
    }
    // ANCHOR_END: has

    fn sees(&self, second: &MemoryAccess, available: &Bits) -> bool {
        let mut syncs = self.program.syncs.iter().enumerate();
        syncs.any(|(index, sync)| available.has(index) && sync.second.reaches_memory(second))
    }

    fn after(&self, second: &MemoryAccess, executed: &Bits, which: impl Fn(&Sync) -> bool) -> bool {
        let mut syncs = self.program.syncs.iter().enumerate();
        syncs.any(|(index, sync)| {
            let held = sync.second.span.contains(second) && self.seconds[index].intersects(second.stage);
            executed.has(index) && which(sync) && held
        })
    }

    /// Keeps the synchronizations that follow a touch of any sample of its pixel: at least one in the chain before them must order more than each sample
    /// by itself.
    fn across_samples(&self, reached: &Reached) -> Reached {
        let across = |own: &Bits| {
            let mut across = Bits::new(self.program.syncs.len());
            for index in own.iter() {
                if !self.program.syncs[index].by_sample || self.before[index].meets(&across) {
                    across.set(index);
                }
            }
            across
        };
        Reached { executed: across(&reached.executed), available: across(&reached.available) }
    }

    fn reach(&self, first: &MemoryAccess, local: Option<u32>) -> Reached {
        let syncs = &self.program.syncs;
        let mut reached = Reached { executed: Bits::new(syncs.len()), available: Bits::new(syncs.len()) };
        for (index, sync) in syncs.iter().enumerate() {
            if sync.region.is_some() && sync.region != local || !sync.is_about(first.memory) {
                continue;
            }
            let scope = sync.first;
            let (executed, available) = match &first.kind {
                TouchKind::Transition { by, .. } => {
                    // A wait for whole submissions includes their layout changes. The write of a layout change is available by itself.
                    let direct = by.contains(&index) || sync.is_whole && scope.span.contains(first);
                    (direct, direct)
                }
                TouchKind::HandOver { by, .. } => {
                    let direct = *by == index || sync.is_whole && scope.span.contains(first);
                    (direct, direct)
                }
                _ => {
                    let direct = scope.span.contains(first) && self.firsts[index].intersects(first.stage);
                    (direct, first.is_write() && scope.reaches_memory(first))
                }
            };
            if executed || self.before[index].meets(&reached.executed) {
                reached.executed.set(index);
            }
            if available || self.before[index].meets(&reached.available) {
                reached.available.set(index);
            }
        }
        reached
    }
}
