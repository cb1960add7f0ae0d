//! Frames as a list: each touch of memory with its time, and the synchronization between them.

use std::fmt;

use ash::vk::{self, AccessFlags2 as A, PipelineStageFlags2 as S};

use afterlight::frame::list::RenderPassName;
use afterlight::frame::rows::{Endpoint, RowName, SUPPORTED};
use afterlight::gpu::Queue;
use afterlight::gpu::barrier::Half;
use afterlight::gpu::sync::{DEVICE_ACCESS, Dependency, Use};
use afterlight::passes::Resource;

/// A place in the order of submission.
pub(super) type Time = u32;

/// Some of the device's queues. The CPU and presentation are on all of them: their work happens in the order of the calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct QueueSet(u8);

impl QueueSet {
    pub(super) const EVERY: Self = Self(u8::MAX);
    pub(super) const FIRST: Self = Self::of(Queue::Graphics);

    pub(super) const fn of(queue: Queue) -> Self {
        Self(1 << queue as u8)
    }

    const fn meets(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// The part of a recording between two times, on some queues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Span {
    pub(super) from: Time,
    /// The first time that is no part of it.
    pub(super) until: Time,
    pub(super) queues: QueueSet,
}

impl Span {
    /// A span on the graphics queue.
    pub(super) const fn between(from: Time, until: Time) -> Self {
        Self { from, until, queues: QueueSet::FIRST }
    }

    /// A span on the graphics queue, up to this time.
    pub(super) const fn before(time: Time) -> Self {
        Self::between(0, time)
    }

    /// A span on the graphics queue, from this time on.
    pub(super) const fn since(time: Time) -> Self {
        Self::between(time, Time::MAX)
    }

    /// Moves the span to other queues.
    pub(super) const fn on(self, queues: QueueSet) -> Self {
        Self { queues, ..self }
    }

    pub(super) fn contains(self, touch: &MemoryAccess) -> bool {
        let queues = touch.queue.map_or(QueueSet::EVERY, QueueSet::of);
        self.from <= touch.time && touch.time < self.until && self.queues.meets(queues)
    }

    pub(super) fn meets(self, other: Self) -> bool {
        self.from < other.until && other.from < self.until && self.queues.meets(other.queues)
    }
}

/// One side of a synchronization: its time, stages and accesses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Scope {
    pub(super) span: Span,
    pub(super) mask: Use,
}

/// A synchronization: a barrier, a dependency of a render pass, a semaphore, a fence, or a submission.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Sync {
    pub(super) first: Scope,
    pub(super) second: Scope,
    /// The instance of a render pass within whose regions alone it orders.
    pub(super) region: Option<u32>,
    /// True where a region is a single sample, not a pixel: both sides have as many samples a pixel, and more than one.
    pub(super) by_sample: bool,
    /// The memory that it is about; none for all of it. The specification lets dependencies of a render pass, and the execution dependency of any
    /// barrier, order all touches. Here they order the touches of their pass or their barrier: no pass may rest on another one's rows.
    pub(super) memory: Option<MemorySet>,
    /// True if its first scope is the whole span, layout changes included: fences, and semaphores that are signaled.
    pub(super) is_whole: bool,
    /// True if the CPU waits.
    pub(super) is_fence: bool,
}

impl Sync {
    pub(super) fn is_about(&self, memory: Memory) -> bool {
        self.memory.as_ref().is_none_or(|own| own.contains(memory))
    }
}

/// The special kinds of touches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum TouchKind {
    /// Nothing.
    Plain,
    /// A load operation: before all else that its subpass does to the attachment.
    Load,
    /// A store operation: after all else.
    Store,
    /// A layout change: after these synchronizations' first scopes, and before their second ones.
    Transition { by: Vec<usize>, to: vk::ImageLayout },
    /// A half of an ownership transfer, after the first scope of the barrier, and before its second: the release, or the acquire. The image keeps its layout.
    HandOver { by: usize, half: Half, queues: [Queue; 2] },
}

/// A part of a resource that is written and read by itself: a layer or a level of an image, or what one frame in flight has of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Memory {
    pub(super) resource: Resource,
    pub(super) part: usize,
}

impl Memory {
    pub(super) const fn part(resource: Resource, part: usize) -> Self {
        Self { resource, part }
    }

    /// A resource that has no parts.
    pub(super) const fn of(resource: Resource) -> Self {
        Self::part(resource, 0)
    }
}

/// Some of it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct MemorySet(Vec<Memory>);

impl MemorySet {
    fn contains(&self, memory: Memory) -> bool {
        self.0.contains(&memory)
    }
}

impl FromIterator<Memory> for MemorySet {
    fn from_iter<T: IntoIterator<Item = Memory>>(all: T) -> Self {
        let mut own: Vec<_> = all.into_iter().collect();
        own.sort_unstable();
        own.dedup();
        Self(own)
    }
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = self.part;
        match self.resource {
            Resource::Target(target) if target.is_picture() => f.write_str("the picture"),
            Resource::Target(target) => write!(f, "the target {target}"),
            Resource::SwapchainImage => f.write_str("the swapchain's image"),
            Resource::ShownImage => f.write_str("the image that ENCODE reads"),
            Resource::SHADOW_MAPS => write!(f, "shadow map {part}"),
            resource @ Resource::Maps(_) => write!(f, "the {resource} of map {part}"),
            Resource::Textures if part == 0 => f.write_str("a texture without levels"),
            Resource::Textures => write!(f, "level {} of a texture", part - 1),
            Resource::FrameData => write!(f, "what the CPU writes for frames in flight at place {part}"),
            resource @ (Resource::FoundCounts | Resource::Kept(_)) => {
                write!(f, "the {resource} of frames in flight at place {part}")
            }
            resource => write!(f, "the {resource}"),
        }
    }
}

/// The author of a touch: a place of the frame, or the row that changes a layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Who {
    At(Endpoint),
    Row(RowName),
    /// The end of a render pass.
    End(RenderPassName),
}

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::At(place) => write!(f, "{place}"),
            Self::Row(name) => write!(f, "the row {name}"),
            Self::End(pass) => write!(f, "the end of the {pass}"),
        }
    }
}

/// One access of one stage to one resource.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct MemoryAccess {
    pub(super) memory: Memory,
    pub(super) time: Time,
    /// The queue that makes it; none for the CPU and presentation.
    pub(super) queue: Option<Queue>,
    pub(super) who: Who,
    /// The frame, from 1; 0 for touches before all of them.
    pub(super) frame: usize,
    pub(super) stage: S,
    pub(super) access: A,
    /// The layout that it needs; UNDEFINED for buffers.
    pub(super) layout: vk::ImageLayout,
    pub(super) kind: TouchKind,
    /// The instance of a render pass in which it touches its own pixel alone.
    pub(super) local: Option<u32>,
    /// True where it touches all samples of that pixel, although it belongs to the region of one.
    pub(super) all_samples: bool,
    /// Touches of one group need no order among each other: rasterization order has it, or one command.
    pub(super) group: u32,
}

impl MemoryAccess {
    /// Returns true if it changes a layout.
    pub(super) fn is_change(&self) -> bool {
        matches!(self.kind, TouchKind::Transition { .. } | TouchKind::HandOver { .. })
    }

    pub(super) fn is_write(&self) -> bool {
        self.is_change() || !Use::new(self.stage, self.access).writes().access.is_empty()
    }
}

/// All of it.
#[derive(Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Program {
    pub(super) touches: Vec<MemoryAccess>,
    /// Synchronizations, sorted by the beginning of their second scopes.
    pub(super) syncs: Vec<Sync>,
    /// Images that do not begin in the layout UNDEFINED.
    pub(super) layouts: Vec<(Memory, vk::ImageLayout)>,
    /// The frame that is being added.
    pub(super) frame: usize,
    /// The queue that commands are being added to.
    pub(super) queue: Queue,
    now: Time,
    groups: u32,
    instances: u32,
}

impl Program {
    /// Nothing yet, with images that begin in these layouts.
    pub(super) fn with_layouts(layouts: Vec<(Memory, vk::ImageLayout)>) -> Self {
        Self { layouts, ..Self::default() }
    }

    /// The next time.
    pub(super) fn step(&mut self) -> Time {
        self.now += 1;
        self.now
    }

    pub(super) fn group(&mut self) -> u32 {
        self.groups += 1;
        self.groups
    }

    pub(super) fn instance(&mut self) -> u32 {
        self.instances += 1;
        self.instances
    }

    /// A command that touches memory, each in a layout, in one go.
    pub(super) fn command(&mut self, place: Endpoint, touches: &[(Memory, vk::ImageLayout, Use)]) {
        let (time, group) = (self.step(), self.group());
        for &(memory, layout, uses) in touches {
            self.touch(&MemoryAccess { time, group, ..self.plain(memory, Who::At(place), layout) }, uses);
        }
    }

    /// A touch with its party, its memory and its layout alone.
    pub(super) fn plain(&self, memory: Memory, who: Who, layout: vk::ImageLayout) -> MemoryAccess {
        MemoryAccess {
            memory,
            time: self.now,
            queue: match who {
                Who::At(Endpoint::HOST | Endpoint::PRESENTATION) => None,
                _ => Some(self.queue),
            },
            who,
            frame: self.frame,
            stage: S::empty(),
            access: A::empty(),
            layout,
            kind: TouchKind::Plain,
            local: None,
            all_samples: false,
            group: 0,
        }
    }

    /// Adds a copy of a touch for each stage and each access that the stage supports.
    pub(super) fn touch(&mut self, touch: &MemoryAccess, uses: Use) {
        for one in each(uses) {
            self.touches.push(MemoryAccess { stage: one.stage, access: one.access, ..touch.clone() });
        }
    }

    /// A pipeline barrier on all memory, or on one part of it. Gives its index.
    pub(super) fn barrier(&mut self, order: Dependency, memory: Option<Memory>) -> usize {
        self.barrier_on(order, memory.map(|own| [own].into_iter().collect()))
    }

    /// A pipeline barrier on all memory, or on several parts of it. Gives its index.
    pub(super) fn barrier_on(&mut self, order: Dependency, memory: Option<MemorySet>) -> usize {
        let queues = QueueSet::of(self.queue);
        self.order(order, queues, memory)
    }

    /// Makes the CPU's earlier writes visible to all later submissions, on any queue.
    pub(super) fn submission(&mut self, order: Dependency) {
        self.order(order, QueueSet::EVERY, None);
    }

    fn order(&mut self, order: Dependency, queues: QueueSet, memory: Option<MemorySet>) -> usize {
        let time = self.step();
        self.synchronize(Sync {
            first: Scope { span: Span::before(time).on(queues), mask: order.before },
            second: Scope { span: Span::since(time).on(queues), mask: order.after },
            region: None,
            by_sample: false,
            memory,
            is_whole: false,
            is_fence: false,
        })
    }

    /// One queue waits for all that another was given until then.
    pub(super) fn semaphore(&mut self, order: Dependency, until: Time, queues: [Queue; 2]) {
        let [from, to] = queues.map(QueueSet::of);
        let now = self.step();
        self.synchronize(Sync {
            first: Scope { span: Span::before(until).on(from), mask: DEVICE_ACCESS },
            second: Scope { span: Span::since(now).on(to), mask: Use::new(order.after.stage, DEVICE_ACCESS.access) },
            region: None,
            by_sample: false,
            memory: None,
            is_whole: true,
            is_fence: false,
        });
    }

    /// The CPU waits for all that was submitted until then.
    pub(super) fn fence(&mut self, order: Dependency, until: Time) {
        let now = self.step();
        self.synchronize(Sync {
            first: Scope { span: Span::before(until), mask: order.before },
            second: Scope { span: Span::since(now).on(QueueSet::EVERY), mask: Use::new(order.after.stage, A::empty()) },
            region: None,
            by_sample: false,
            memory: None,
            is_whole: true,
            is_fence: true,
        });
    }

    /// A layout change now, unless the two layouts are the same.
    pub(super) fn transition(
        &mut self,
        (who, memory): (Who, Memory),
        [from, to]: [vk::ImageLayout; 2],
        by: Vec<usize>,
        local: Option<u32>,
    ) {
        if from != to {
            let (group, kind) = (self.group(), TouchKind::Transition { by, to });
            self.touches.push(MemoryAccess { kind, local, group, ..self.plain(memory, who, from) });
        }
    }

    /// A half of the transfer of some memory, each in the layout that it is in, between the stages of a row.
    pub(super) fn hand_over(
        &mut self,
        (name, order): (RowName, Dependency),
        (half, queues): (Half, [Queue; 2]),
        all: &[(Memory, vk::ImageLayout)],
    ) {
        let order = half.scopes(order);
        let by = self.barrier_on(order, Some(all.iter().map(|(memory, _)| *memory).collect()));
        for &(memory, layout) in all {
            let (group, kind) = (self.group(), TouchKind::HandOver { by, half, queues });
            self.touches.push(MemoryAccess { kind, group, ..self.plain(memory, Who::Row(name), layout) });
        }
    }

    /// Adds a synchronization whose second scope begins no earlier than all others'.
    pub(super) fn synchronize(&mut self, sync: Sync) -> usize {
        self.syncs.push(sync);
        self.syncs.len() - 1
    }
}

/// Each stage with each access that it supports.
fn each(uses: Use) -> impl Iterator<Item = Use> {
    let supported = SUPPORTED.iter().filter(move |(access, _)| uses.access.contains(*access));
    supported.flat_map(move |&(access, stages)| {
        let stages = (uses.stage & stages).as_raw();
        let bits = (0..u64::BITS).map(|bit| 1 << bit).filter(move |bit| stages & bit != 0);
        bits.map(move |stage| Use::new(S::from_raw(stage), access))
    })
}
