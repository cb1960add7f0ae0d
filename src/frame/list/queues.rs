//! Steps on another queue, and the hand-overs of images to that queue and back.

use std::ops::Range;

use ash::vk;

use super::{Step, StepList};
use crate::frame::rows::RowName;
use crate::gpu::Queue;
use crate::gpu::barrier::Half;
use crate::gpu::sync::Use;
use crate::passes::{Endpoint, Resource, ResourceUse};
use crate::plan::{FramePlan, Target};

/// A half of a hand-over from one queue to another. The release ends a part of the frame, and the acquire begins one.
#[derive(Clone)]
pub struct HandOver {
    /// Which half.
    pub half: Half,
    /// The releasing queue, then the acquiring one.
    pub queues: [Queue; 2],
    /// The steps before the release and after the acquire.
    pub ends: [Endpoint; 2],
    /// The images that both queues use, each in the layout that it keeps.
    pub targets: Vec<(Target, vk::ImageLayout)>,
    /// The uses of these images on the other queue.
    pub uses: Use,
    /// On the way back: reads of images that the other queue only reads, in the same layout. No row orders them, since both queues only read.
    pub read_on: Use,
}

/// A run of steps that goes to one queue in one piece.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QueuePart {
    /// The queue that executes the steps.
    pub queue: Queue,
    /// Indices into the list.
    pub steps: Range<usize>,
    /// The earlier part that it waits for, and the row by which it does.
    pub after: Option<(usize, RowName)>,
}

/// Adds the hand-overs where a plan has steps on another queue: what both queues use goes there when it was last used before these steps, and comes back after
/// them.
pub(super) fn add_hand_overs(plan: &FramePlan, steps: &mut Vec<Step>) {
    let is_beside = |step: &Step| matches!(step, Step::Commands(own) if own.queue != Queue::Graphics);
    let Some(first) = steps.iter().position(is_beside) else { return };
    let until = first + steps[first..].iter().take_while(|step| is_beside(step)).count();
    let Step::Commands(own) = &steps[first] else { return };
    let queue = own.queue;
    let beside: Vec<ResourceUse> = steps[first..until].iter().flat_map(|step| step.touches(plan)).collect();
    let uses_any =
        |step: &Step, target: Target| step.touches(plan).iter().any(|touch| touch.resource == Resource::Target(target));
    let others = || steps[..first].iter().chain(&steps[until..]);
    let both: Vec<Target> = plan
        .targets()
        .filter(|target| beside.iter().any(|touch| touch.resource == Resource::Target(*target)))
        .filter(|target| others().any(|step| uses_any(step, *target)))
        .collect();
    let of = |target: &Target| {
        let image = Resource::Target(*target);
        beside.iter().filter(move |touch| touch.resource == image)
    };
    let uses: Vec<Use> = both.iter().flat_map(|target| of(target).map(|touch| touch.uses)).collect();
    let kept = |pick: fn(&[&ResourceUse]) -> vk::ImageLayout| -> Vec<(Target, vk::ImageLayout)> {
        both.iter().map(|target| (*target, pick(&of(target).collect::<Vec<_>>()))).collect()
    };
    let first_layout: fn(&[&ResourceUse]) -> vk::ImageLayout =
        |all| all.first().map_or(vk::ImageLayout::UNDEFINED, |touch| touch.layout());
    let last_layout: fn(&[&ResourceUse]) -> vk::ImageLayout =
        |all| all.last().map_or(vk::ImageLayout::UNDEFINED, |touch| touch.layout());
    let last_use = steps[..first].iter().rposition(|step| both.iter().any(|target| uses_any(step, *target)));
    let released = last_use.map_or(first, |index| index + 1);
    let place = |index: usize| steps.get(index).and_then(Step::place).unwrap_or(Endpoint::OUTSIDE);
    let there = HandOver {
        half: Half::Release,
        queues: [Queue::Graphics, queue],
        ends: [last_use.map_or(Endpoint::OUTSIDE, place), place(first)],
        targets: kept(first_layout),
        uses: Use::all(&uses),
        read_on: Use::all(&[]),
    };
    let only_read = both.iter().filter(|target| of(target).all(|touch| !touch.writes()));
    let read_on: Vec<Use> = only_read
        .flat_map(|&target| reads(plan, &steps[until..], target, last_layout(&of(&target).collect::<Vec<_>>())))
        .collect();
    let back = HandOver {
        queues: [queue, Queue::Graphics],
        ends: [place(until - 1), place(until)],
        targets: kept(last_layout),
        read_on: Use::all(&read_on),
        ..there.clone()
    };
    let acquired = |own: &HandOver| Step::HandOver(HandOver { half: Half::Acquire, ..own.clone() });
    let after = [acquired(&back)];
    // Inserted from back to front, so that the earlier indices stay valid.
    steps.splice(until..until, [Step::HandOver(back)].into_iter().chain(after));
    steps.insert(first, acquired(&there));
    steps.insert(released, Step::HandOver(there));
}

/// The reads of an image by these steps, up to the first step that writes it or changes its layout: that step has its own row.
fn reads(plan: &FramePlan, steps: &[Step], target: Target, layout: vk::ImageLayout) -> Vec<Use> {
    let own = |step: &Step| -> Vec<ResourceUse> {
        step.touches(plan).into_iter().filter(|touch| touch.resource == Resource::Target(target)).collect()
    };
    let all: Vec<Vec<ResourceUse>> = steps.iter().map(own).filter(|touches| !touches.is_empty()).collect();
    let mut found = Vec::new();
    for (index, touches) in all.iter().enumerate() {
        let is_last_step = index + 1 == all.len();
        for (position, touch) in touches.iter().enumerate() {
            // An attachment's last user drops it, which is a write.
            let is_dropped = is_last_step && position + 1 == touches.len() && touch.is_attachment();
            if touch.writes() || is_dropped || touch.layout() != layout {
                return found;
            }
            found.push(touch.uses);
            if position == 0 && touch.is_attachment() {
                found.push(touch.load());
            }
        }
    }
    found
}

impl StepList {
    /// The runs of steps that go to one queue each, in the order of the list. Most frames are one.
    pub fn parts(&self) -> Vec<QueuePart> {
        let mut parts = vec![QueuePart { queue: Queue::Graphics, steps: 0..0, after: None }];
        let mut released = 0;
        for (index, step) in self.0.iter().enumerate() {
            let is_empty = parts[parts.len() - 1].steps.is_empty();
            if let Step::HandOver(own) = step
                && own.half == Half::Acquire
            {
                let after = Some((released, RowName::semaphore(own.queues)));
                if is_empty {
                    parts.pop();
                }
                parts.push(QueuePart { queue: own.queues[1], steps: index..index, after });
            }
            let current = parts.len() - 1;
            parts[current].steps.end = index + 1;
            if let Step::HandOver(own) = step
                && own.half == Half::Release
            {
                released = current;
                parts.push(QueuePart { queue: own.queues[0], steps: index + 1..index + 1, after: None });
            }
        }
        parts.retain(|part| !part.steps.is_empty());
        parts
    }
}

impl Step {
    /// The name of its first pass or subpass.
    fn place(&self) -> Option<Endpoint> {
        match self {
            Self::RenderPass(_, subpasses) => subpasses.first().map(|own| own.place),
            Self::Commands(own) => Some(own.pass.name),
            Self::Presentation | Self::HandOver(_) => None,
        }
    }
}
