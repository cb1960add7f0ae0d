//! The rows between the passes of a frame.
//!
//! A pass declares in its own file how it uses each resource ([`ResourceUse`]): stages, accesses, layout, and why. The pass that it follows is looked up here,
//! in the order of the frame, for one resource after the other:
//!
//! - a use that only reads waits for the last write;
//! - a use that writes, or finds the image in another layout, waits for the reads since the last write, or for that write if nothing has read it: readers
//!   have waited for it already;
//! - a read in a subpass that finds the image in another layout changes it: for later uses it counts as a write;
//! - the first use in a frame waits for the frame before, which ends as this one does.
//!
//! The carrier follows from where the two ends stand. Within a render pass it is a dependency between two subpasses, and since subpasses use
//! attachments at their own pixel only, it is by region. All waits for a subpass of an earlier render pass are one dependency of that one, which
//! leaves the image in the layout that comes next. If a subpass waits for a compute pass, the dependency belongs to the subpass's render pass.
//! Buffers are the exception: one barrier after the compute pass makes its writes visible to all readers. The carrier is a barrier between two passes
//! outside of render passes.
//!
//! Load and store operations are uses as well: "The load operation for each sample in an attachment happens-before any recorded command which
//! accesses the sample in the first subpass where the attachment is used", and the store operation happens after the accesses in the last one
//! (specification, `VkAttachmentDescription`). Colour is loaded and stored in COLOR_ATTACHMENT_OUTPUT. Depth is loaded in EARLY_FRAGMENT_TESTS and
//! stored in LATE_FRAGMENT_TESTS. CLEAR and DONT_CARE write.

use std::borrow::Cow;
use std::cmp::Reverse;

use ash::vk::{self, AccessFlags2 as A, PipelineStageFlags2 as S};

use super::presentation::IN_TURN;
use super::{Endpoint, Row, RowName, SyncKind, row};
use crate::frame::list::{Condition, RESOLVE, RenderPassName, Step};
use crate::gpu::sync::Use;
use crate::passes::{Resource, ResourceUse, UseKind, copy, present};
use crate::plan::{FramePlan, Target};

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    /// Makes the picture ready for COPY, presentation, or a pass that draws over it.
    pub const READ_BACK: Self = Self::Own("read-back");
    pub const FOUND_TO_HOST: Self = Self::Own("found-to-host");
}

const COLOR_WRITE: Use = Use::new(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE);
const DEPTH_CLEAR: Use = Use::new(S::EARLY_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
const DEPTH_STORE: Use = Use::new(S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);

/// A row, and its barrier's place in the list if it is one.
pub struct Wait {
    pub row: Row,
    pub barrier: Option<BarrierPosition>,
}

/// The place of a pipeline barrier: before or after a step of the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BarrierPosition {
    pub step: usize,
    pub is_after: bool,
    pub resource: Resource,
}

/// A subpass, or a pass outside of render passes.
struct Stop<'a> {
    place: Endpoint,
    /// The index of its step in the list.
    step: usize,
    render_pass: Option<RenderPassName>,
    touches: Cow<'a, [ResourceUse]>,
    /// Samples that it draws of each pixel.
    samples: u32,
    /// Some frames go without it: SHADOW draws only maps that have changed, and SKIN follows only new poses.
    is_occasional: bool,
}

/// All uses of one resource at one stop.
#[derive(Debug, Clone)]
struct Visit {
    /// The index of the stop, or the number of stops for uses after the frame's own passes.
    stop: usize,
    place: Endpoint,
    render_pass: Option<RenderPassName>,
    /// Uses by passes, load operations and store operations, all of which wait for earlier ones.
    waits: Use,
    /// The uses that later ones wait for.
    done: Use,
    layout: vk::ImageLayout,
    writes: bool,
    samples: u32,
    all_samples: bool,
    why: Vec<&'static str>,
    /// The frame before made these uses.
    is_last_frame: bool,
    /// Some frames go without these uses.
    is_occasional: bool,
    /// The uses are COPY's, presentation's, or the CPU's.
    is_after_the_passes: bool,
}

/// A row that is being put together. Rows with the same key are one row.
struct Draft {
    key: Key,
    from: Visit,
    before: Vec<Use>,
    after: Vec<Use>,
    to: Visit,
    /// Who waits, each for its own reasons.
    reasons: Vec<(Endpoint, Vec<&'static str>)>,
    layouts: [vk::ImageLayout; 2],
    resources: Vec<Resource>,
    all_samples: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    /// A dependency between two subpasses of one render pass.
    Between(RenderPassName, usize, usize),
    /// A subpass comes first, and all later steps that wait for it come second.
    OutOf(RenderPassName, usize),
    /// A subpass comes first, and COPY, presentation or the CPU second.
    OutOfFrame(RenderPassName, usize),
    /// A dependency from earlier steps into a subpass.
    Into(RenderPassName, usize),
    /// A dependency from the previous frame into a subpass.
    Reuse(RenderPassName, usize),
    /// A barrier before a stop, or after the last one.
    Barrier(Resource, usize),
    /// A barrier after the stop that wrote a buffer, for all that read it.
    AfterWriter(Resource, usize),
    /// A barrier before a stop, after the frame before.
    BarrierReuse(Resource, usize),
}

/// The uses of a resource since it was last written.
#[derive(Debug, Clone, Default)]
struct UseHistory {
    writes: Vec<Visit>,
    reads: Vec<Visit>,
    layout: Option<vk::ImageLayout>,
    /// The stop before which a barrier stands that made the last write visible.
    barrier: Option<usize>,
}

/// The rows of a plan's passes, in the order of the waiting steps.
pub fn rows(plan: &FramePlan, steps: &[Step]) -> Vec<Wait> {
    let stops = stops(plan, steps);
    let mut drafts: Vec<Draft> = Vec::new();
    for resource in resources(&stops) {
        // A frame writes one of two buffers, and the next one reads it: so a buffer lives through two frames before it is written again.
        let mut spans = vec![visits(plan, &stops, resource)];
        spans[0].extend(after_the_passes(plan, &stops, resource));
        if let Resource::Kept(own) = resource {
            spans.push(visits(plan, &stops, Resource::KeptBefore(own)));
        }
        let mut past = UseHistory::default();
        // The next frame finds each resource as the last use of this one leaves it.
        if is_shared(resource) {
            past.live_through(&spans, |_, _, _| ());
        }
        past.live_through(&spans, |from, to, way| add(&mut drafts, resource, (from, to), way));
    }
    // Where a step waits for two subpasses of a render pass, the row of the later subpass comes first: layers before 1.4.322 take the last dependency that leaves the
    // render pass for both.
    drafts.sort_by_key(|draft| (draft.to.stop, !draft.from.is_last_frame, Reverse(draft.from.stop)));
    drafts.into_iter().map(|draft| draft.finish(plan, &stops)).collect()
}

/// All uses of a resource by passes that only read it, and the first of these; `None` if no pass reads it.
pub fn readers(plan: &FramePlan, steps: &[Step], resource: Resource) -> Option<(Endpoint, Use)> {
    let stops = stops(plan, steps);
    let reads = |touch: &&ResourceUse| touch.resource == resource && !touch.writes() && !touch.is_attachment();
    let of = |stop: &Stop| stop.touches.iter().filter(reads).map(|touch| (stop.place, touch.uses)).collect::<Vec<_>>();
    stops.iter().flat_map(of).reduce(|(first, all), (_, uses)| (first, all.or(uses)))
}

/// The first place that touches a resource.
pub fn first_user(plan: &FramePlan, steps: &[Step], resource: Resource) -> Option<Endpoint> {
    let touches = |stop: &Stop| stop.touches.iter().any(|touch| touch.resource == resource);
    stops(plan, steps).iter().find(|stop| touches(stop)).map(|stop| stop.place)
}

/// Returns false for buffers of which each frame in flight has its own: a fence orders their reuse.
fn is_shared(resource: Resource) -> bool {
    !matches!(resource, Resource::FrameData | Resource::FoundCounts | Resource::ReadBack)
}

fn stops<'a>(plan: &FramePlan, steps: &'a [Step]) -> Vec<Stop<'a>> {
    let mut stops = Vec::new();
    for (step, one) in steps.iter().enumerate() {
        match one {
            Step::RenderPass(name, subpasses) => stops.extend(subpasses.iter().map(|own| Stop {
                place: own.place,
                step,
                render_pass: Some(*name),
                touches: Cow::Borrowed(&own.touches),
                samples: own.samples(plan),
                is_occasional: name.draws_maps(),
            })),
            Step::Commands(own) => {
                let touches = Cow::Owned(own.pass.uses(plan));
                let is_occasional = own.when != Condition::Always;
                stops.push(Stop { place: own.pass.name, step, render_pass: None, touches, samples: 1, is_occasional });
            }
            Step::Presentation | Step::HandOver(_) => {}
        }
    }
    stops
}

/// Each resource that some stop writes, in the order of the first use.
fn resources(stops: &[Stop]) -> Vec<Resource> {
    let mut all = Vec::new();
    for touch in stops.iter().flat_map(|stop| stop.touches.iter()) {
        let resource = touch.resource;
        let written = |touch: &&ResourceUse| touch.resource == resource && (touch.writes() || touch.is_attachment());
        let is_written = stops.iter().flat_map(|stop| stop.touches.iter()).any(|touch| written(&touch));
        if is_written && !all.contains(&resource) {
            all.push(resource);
        }
    }
    all
}

/// The uses of a resource, stop by stop.
fn visits(plan: &FramePlan, stops: &[Stop], resource: Resource) -> Vec<Visit> {
    let own = |stop: &Stop| -> Vec<ResourceUse> {
        stop.touches.iter().filter(|touch| touch.resource == resource).copied().collect()
    };
    let all: Vec<(usize, Vec<ResourceUse>)> =
        stops.iter().map(own).enumerate().filter(|(_, touches)| !touches.is_empty()).collect();
    let visit = |index: usize| {
        let (stop, touches) = &all[index];
        let at = &stops[*stop];
        let is_attachment = touches.iter().any(ResourceUse::is_attachment);
        let beside = |other: Option<&(usize, Vec<ResourceUse>)>| {
            is_attachment && other.is_some_and(|(index, _)| stops[*index].render_pass == at.render_pass)
        };
        let (is_first, is_last) =
            (!beside(index.checked_sub(1).map(|before| &all[before])), !beside(all.get(index + 1)));
        let mut uses = Use::all(&touches.iter().map(|touch| touch.uses).collect::<Vec<_>>());
        // Samples are read when they are resolved.
        let draws = touches.iter().any(|touch| matches!(touch.how, UseKind::Color { .. }));
        if resource == Resource::Target(Target::Samples)
            && draws
            && at.touches.iter().any(|own| own.how == UseKind::Resolve)
        {
            uses = uses.or(RESOLVE);
        }
        let is_depth = touches[0].is_depth();
        // Each map that is drawn is cleared, also one that another frame has drawn: readers do not come before who draws it.
        let is_loaded = index > 0;
        let load = match (is_depth, is_loaded) {
            (_, true) => touches[0].load(),
            (true, false) => DEPTH_CLEAR,
            (false, false) => COLOR_WRITE,
        };
        let store = if is_depth { DEPTH_STORE } else { COLOR_WRITE };
        // The subpass's own uses come after the load operation by themselves: so where that clears, it alone must wait.
        let waits = match (is_attachment && is_first, is_attachment && is_last) {
            (true, _) if !is_loaded => load,
            (true, true) => uses.or(load).or(store),
            (true, false) => uses.or(load),
            (false, true) => uses.or(store),
            (false, false) => uses,
        };
        let mut why: Vec<&'static str> = Vec::new();
        for touch in touches {
            if !touch.why.is_empty() && !why.contains(&touch.why) {
                why.push(touch.why);
            }
        }
        // Who only reads an attachment is told of the write that is not its own.
        if is_attachment && is_last && uses.writes().access.is_empty() {
            why.push(if index + 1 < all.len() { "stores it as its last user" } else { "drops it as its last user" });
        }
        Visit {
            stop: *stop,
            place: at.place,
            render_pass: at.render_pass,
            waits,
            done: if is_attachment && is_last { store } else { uses },
            layout: touches[0].layout(),
            writes: uses.writes().access != A::empty() || is_attachment && (is_last || is_first && !is_loaded),
            samples: at.samples,
            all_samples: plan.msaa > 1 && touches.iter().any(|touch| touch.all_samples),
            why,
            is_last_frame: false,
            is_occasional: at.is_occasional,
            is_after_the_passes: false,
        }
    };
    (0..all.len()).map(visit).collect()
}

/// The reader of a resource after the frame's own passes: COPY and presentation of the picture, the CPU of counts.
fn after_the_passes(plan: &FramePlan, stops: &[Stop], resource: Resource) -> Option<Visit> {
    let (place, waits, done, why) = match resource {
        Resource::FoundCounts => (
            Endpoint::HOST,
            copy::HOST_READ,
            copy::HOST_READ,
            "reads the counts: a fence alone does not make them visible to it",
        ),
        Resource::Target(target) if target == plan.picture() => match plan.draws_into_swapchain() {
            true => (
                Endpoint::OUTSIDE,
                IN_TURN,
                present::ATTACH,
                "whatever comes over the picture waits for TRANSFER, and so for the layout that the picture is left in",
            ),
            false => (
                Endpoint::OUTSIDE,
                present::READ,
                present::READ,
                "whatever copies or shows the picture reads it in the layout that it is left in",
            ),
        },
        _ => return None,
    };
    Some(Visit {
        stop: stops.len(),
        place,
        render_pass: None,
        waits,
        done,
        layout: if place == Endpoint::HOST {
            vk::ImageLayout::UNDEFINED
        } else {
            plan.layouts.of(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
        },
        writes: false,
        samples: 1,
        all_samples: false,
        why: vec![why],
        is_last_frame: false,
        is_occasional: false,
        is_after_the_passes: true,
    })
}

/// The way by which a use follows another: the layouts before and after, and the stop whose barrier has the wait, if another's has.
struct Handover {
    /// The later use writes the resource or changes its layout.
    replaces: bool,
    layouts: [vk::ImageLayout; 2],
    barrier: Option<usize>,
}

impl Handover {
    fn is_about_buffer(&self) -> bool {
        self.layouts == [vk::ImageLayout::UNDEFINED; 2]
    }
}

impl UseHistory {
    /// Adds the visits of one frame after the other.
    fn live_through(&mut self, spans: &[Vec<Visit>], mut wait: impl FnMut(&Visit, &Visit, Handover)) {
        for visits in spans {
            visits.iter().for_each(|visit| self.take(visit, &mut wait));
            self.writes.iter_mut().chain(&mut self.reads).for_each(|visit| visit.is_last_frame = true);
            (self.layout, self.barrier) = (None, None);
        }
    }

    /// Adds a visit, and hands each pair of uses that must come one after the other to `wait`.
    fn take(&mut self, visit: &Visit, mut wait: impl FnMut(&Visit, &Visit, Handover)) {
        let changes = self.layout.is_some_and(|layout| layout != visit.layout);
        let old = self.layout.unwrap_or(vk::ImageLayout::UNDEFINED);
        let replaces = visit.writes || changes;
        // Readers have waited for the last write, so that who waits for them need not wait for it. Two kinds do not count: readers that some frames go without; and readers
        // in the same render pass as this use, where the write is outside of it. (With a stored G-buffer another render pass has written depth, FOG reads it, and TRANSPARENT
        // drops it: FOG's row into the render pass is about FOG alone, and TRANSPARENT has one, too.)
        let mut earlier: Vec<&Visit> = if replaces { self.reads.iter().collect() } else { Vec::new() };
        let is_of_run =
            |own: &&Visit| own.render_pass.is_some() && own.render_pass == visit.render_pass && !own.is_last_frame;
        let begins_outside = !self.writes.iter().all(|write| is_of_run(&write));
        if earlier.iter().all(|read| read.is_occasional || begins_outside && is_of_run(read)) {
            earlier.extend(&self.writes);
        }
        // Readers one after the other share the barrier that stands before the first.
        let is_barrier = |from: &Visit| from.render_pass.is_none() && visit.render_pass.is_none();
        let barrier = self.barrier.filter(|_| !replaces);
        for &from in &earlier {
            wait(
                from,
                visit,
                Handover { replaces, layouts: [old, visit.layout], barrier: barrier.filter(|_| is_barrier(from)) },
            );
        }
        // Within a render pass this use changes the layout, and later readers wait for it. Out of an earlier render pass its `finalLayout` has changed it already, and the row carries that.
        let changes_here = changes
            && visit.render_pass.is_some()
            && earlier.iter().all(|from| from.render_pass.is_none() || from.render_pass == visit.render_pass);
        let makes_barrier = !visit.writes && earlier.iter().any(|from| is_barrier(from));
        if visit.writes || changes_here {
            *self = Self { writes: vec![visit.clone()], ..Self::default() };
        } else {
            if makes_barrier && barrier.is_none() {
                self.barrier = Some(visit.stop);
            }
            self.reads.push(visit.clone());
        }
        self.layout = Some(visit.layout);
    }
}

fn add(drafts: &mut Vec<Draft>, resource: Resource, (from, to): (&Visit, &Visit), way: Handover) {
    let key = match (from.render_pass, to.render_pass) {
        (_, Some(run)) if from.is_last_frame => Key::Reuse(run, to.stop),
        (_, None) if from.is_last_frame => Key::BarrierReuse(resource, to.stop),
        (Some(run), own) if own == Some(run) => Key::Between(run, from.stop, to.stop),
        (Some(run), _) if to.is_after_the_passes => Key::OutOfFrame(run, from.stop),
        (Some(run), _) => Key::OutOf(run, from.stop),
        (None, _) if !way.replaces && way.is_about_buffer() => Key::AfterWriter(resource, from.stop),
        (None, Some(run)) => Key::Into(run, to.stop),
        (None, None) => Key::Barrier(resource, way.barrier.unwrap_or(to.stop)),
    };
    // Where the two draw as many samples, a region is one of these; otherwise it is a pixel, with all of them.
    let all_samples = (from.all_samples || to.all_samples) && from.samples == to.samples;
    match drafts.iter_mut().find(|draft| draft.key == key) {
        Some(draft) => {
            draft.before.push(from.done);
            draft.after.push(to.waits);
            draft.all_samples |= all_samples;
            if from.stop > draft.from.stop {
                draft.from = from.clone();
            }
            if !draft.resources.contains(&resource) {
                draft.resources.push(resource);
            }
            draft.because(to);
        }
        None => drafts.push(Draft {
            key,
            from: from.clone(),
            before: vec![from.done],
            after: vec![to.waits],
            to: to.clone(),
            reasons: vec![(to.place, to.why.clone())],
            layouts: way.layouts,
            resources: vec![resource],
            all_samples,
        }),
    }
}

impl Draft {
    /// Adds the reasons of another one that waits.
    fn because(&mut self, to: &Visit) {
        let own = match self.reasons.iter().position(|(place, _)| *place == to.place) {
            Some(index) => &mut self.reasons[index].1,
            None => {
                self.reasons.push((to.place, Vec::new()));
                &mut self.reasons.last_mut().expect("one was added").1
            }
        };
        for why in &to.why {
            if !own.contains(why) {
                own.push(why);
            }
        }
    }

    fn finish(self, plan: &FramePlan, stops: &[Stop]) -> Wait {
        let Self { key, from, before, after, to, reasons, layouts, resources, all_samples } = self;
        let is_after = to.is_after_the_passes;
        let of_image = |resource: Resource| match resource {
            Resource::Target(_) => SyncKind::ImageBarrier(layouts[0], layouts[1]),
            _ => SyncKind::BufferBarrier,
        };
        let (carrier, barrier) = match key {
            Key::Between(run, ..)
            | Key::OutOf(run, _)
            | Key::OutOfFrame(run, _)
            | Key::Into(run, _)
            | Key::Reuse(run, _) => (SyncKind::of_pass(plan, run), None),
            Key::AfterWriter(resource, stop) => {
                (SyncKind::BufferBarrier, Some(BarrierPosition { step: stops[stop].step, is_after: true, resource }))
            }
            Key::Barrier(resource, _) if is_after => {
                (of_image(resource), Some(BarrierPosition { step: stops[from.stop].step, is_after, resource }))
            }
            Key::Barrier(resource, stop) | Key::BarrierReuse(resource, stop) => {
                (of_image(resource), Some(BarrierPosition { step: stops[stop].step, is_after, resource }))
            }
        };
        let name = match key {
            _ if is_after && to.place == Endpoint::HOST => RowName::FOUND_TO_HOST,
            _ if is_after => RowName::READ_BACK,
            Key::AfterWriter(..) => RowName::Readers(from.place),
            Key::OutOf(..) if reasons.len() > 1 => RowName::Readers(from.place),
            Key::Barrier(Resource::Target(target), _) => RowName::Image(target, to.place),
            Key::BarrierReuse(Resource::Target(target), _) => RowName::ImageReuse(target),
            Key::Reuse(..) | Key::BarrierReuse(..) => RowName::Reuse(to.place),
            _ => RowName::Pair(from.place, to.place),
        };
        let outside = if from.is_last_frame { Endpoint::OUTSIDE } else { from.place };
        let why = why(&from, &reasons, &resources);
        let own = row(name, carrier).from(outside, &before).to(to.place, &after).for_all(&reasons).about(resources);
        let is_between = matches!(key, Key::Between(..));
        Wait { row: own.between(is_between, all_samples).because(why), barrier }
    }
}

/// The reason of a row in a sentence: why each waiting pass uses the resource, and which memory frames share.
fn why(from: &Visit, reasons: &[(Endpoint, Vec<&'static str>)], resources: &[Resource]) -> String {
    let of_one = |(place, why): &(Endpoint, Vec<&str>)| {
        let does = match &why[..] {
            [most @ .., last] if most.len() > 1 => format!("{}, and {last}", most.join(", ")),
            _ => why.join(", and "),
        };
        if *place == Endpoint::OUTSIDE { does } else { format!("{place} {does}") }
    };
    let does = reasons.iter().map(of_one).collect::<Vec<_>>().join("; ");
    if !from.is_last_frame {
        return does;
    }
    let names: Vec<String> = resources.iter().map(ToString::to_string).collect();
    let (shared, them) = match &names[..] {
        [one] => (one.clone(), "it"),
        [most @ .., last] => (format!("{} and {last}", most.join(", ")), "them"),
        [] => (String::new(), "it"),
    };
    format!("{does}; frames in flight share {shared}, so that the last frame must have finished with {them}")
}
