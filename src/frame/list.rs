//! The frame as a list: the passes of a plan's frames, in their order, and the ones that share a render pass.
//!
//! The order is written by hand: [`super::deferred`]. This module derives the rest: which passes share a render pass, the images and their usage, the
//! loads and stores of each render pass, and the layouts.

mod check;
pub(super) mod local_read;
mod order;
mod queues;

use std::fmt;

use ash::vk;

use super::deferred::ORDER;
use super::rows::{self, BarrierPosition, RowName};
use crate::gpu::Queue;
use crate::gpu::sync::Use;
use crate::passes::{
    ContentsIfFirst, Endpoint, Pass, Resource, ResourceUse, UseKind, copy, encode, overlay, present, shadow, shown,
    split, tint,
};
use crate::plan::{FramePlan, Part, PartGroup, PresentTarget, Target};
use crate::scene::Passes;
pub(super) use order::OrderEntry;
pub use queues::{HandOver, QueuePart};

/// Resolves samples into the output after the subpass that is the last to write them: reads them, and as their last user drops them.
pub const RESOLVE: Use = Use::new(
    vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw() | vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw(),
    ),
);

/// The name of a render pass. It is the name of its first subpass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RenderPassName(Endpoint);

/// SHADOW's, of which each map that is drawn anew has an instance.
pub const SHADOW_PASS: RenderPassName = RenderPassName(shadow::PASS.name);

impl RenderPassName {
    /// Returns true if each shadow map that is drawn anew has an instance of the render pass.
    pub fn draws_maps(self) -> bool {
        [shadow::PASS.name, tint::PASS.name].contains(&self.0)
    }

    /// The render pass that begins with this subpass.
    pub const fn of(first: Endpoint) -> Self {
        Self(first)
    }

    /// Returns true if the render pass has this name on the device.
    pub fn is_called(self, name: &str) -> bool {
        self.to_string() == name
    }
}

impl fmt::Display for RenderPassName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} pass", self.0)
    }
}

/// A part of the frame.
pub enum Step {
    /// A render pass with its subpasses, in their order.
    RenderPass(RenderPassName, Vec<Subpass>),
    /// Commands outside the frame's render passes: compute, copies, and passes that begin their own render pass.
    Commands(Commands),
    /// Presentation shows the picture.
    Presentation,
    /// The frame goes on in another queue.
    HandOver(HandOver),
}

/// Passes that draw in one subpass. Rasterization order is all that is between them.
pub struct Subpass {
    /// The name by which rows know it.
    pub place: Endpoint,
    /// Passes in the order in which they draw.
    pub passes: Vec<&'static Pass>,
    /// Resource uses of all passes.
    pub touches: Vec<ResourceUse>,
}

impl Subpass {
    /// Samples per pixel: the colour and depth attachments have the same number.
    pub fn samples(&self, plan: &FramePlan) -> u32 {
        let drawn = self.touches.iter().find_map(|touch| match (touch.how, touch.resource) {
            (UseKind::Color { .. } | UseKind::Depth { .. }, Resource::Target(target)) => Some(plan.samples_of(target)),
            _ => None,
        });
        drawn.unwrap_or(1)
    }
}

/// A pass with the barriers before and after it, by their rows.
pub struct Commands {
    /// Compute, a copy, or a pass that begins its own render pass.
    pub pass: &'static Pass,
    /// Frames in which the step is recorded; the others skip the pass and its barriers.
    pub when: Condition,
    /// The queue that it runs on.
    pub queue: Queue,
    /// Barriers before the pass, each with the image or buffer that it is about.
    pub before: Vec<(RowName, Resource)>,
    /// Barriers after the pass, likewise.
    pub after: Vec<(RowName, Resource)>,
}

/// The condition, among a plan's frames, on which something happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Condition {
    /// Every frame.
    Always,
    /// Deformed objects have another pose than in the frame before.
    Posed,
    /// The window is split.
    Split,
    /// The picture is copied for the CPU.
    Copied,
    /// Panels are shown.
    Covered,
}

/// The steps of a plan's frames.
pub struct StepList(pub Vec<Step>);

/// A line of the order in a plan's frames.
enum Planned {
    Drawn(Subpass),
    DrawnApart(Vec<Subpass>),
    Recorded(Step),
    Split,
}

/// The steps of a plan's frames up to the picture. Consecutive subpasses share a render pass. A pass outside of render passes ends it, and so does a
/// subpass that samples what the render pass draws.
pub(super) fn steps(plan: &FramePlan) -> Vec<Step> {
    let mut planned: Vec<Planned> = ORDER.iter().flat_map(|line| line.planned(plan)).collect();
    resolve_samples(plan, &mut planned);
    let mut steps: Vec<Step> = Vec::new();
    let mut is_open = false;
    let alone = |subpass: Subpass| Step::RenderPass(RenderPassName(subpass.place), vec![subpass]);
    for own in planned {
        is_open = match own {
            Planned::Drawn(subpass) => {
                match steps.last_mut() {
                    Some(Step::RenderPass(_, drawn)) if is_open && joins(plan, &subpass, drawn) => drawn.push(subpass),
                    _ => steps.push(alone(subpass)),
                }
                true
            }
            Planned::DrawnApart(subpasses) if plan.passes == Passes::Stored => {
                steps.extend(subpasses.into_iter().map(alone));
                false
            }
            Planned::DrawnApart(subpasses) => {
                let name = subpasses.first().map(|own| RenderPassName(own.place));
                steps.extend(name.map(|name| Step::RenderPass(name, subpasses)));
                false
            }
            Planned::Recorded(step) => {
                steps.push(step);
                false
            }
            Planned::Split => false,
        };
    }
    if plan.passes == Passes::LocalRead {
        local_read::keep_layouts(plan, &mut steps);
    }
    queues::add_hand_overs(plan, &mut steps);
    add_barriers(plan, &mut steps);
    steps
}

/// Returns true if a subpass continues the render pass of the subpasses in `drawn`.
fn joins(plan: &FramePlan, subpass: &Subpass, drawn: &[Subpass]) -> bool {
    let is_with_them = match plan.passes {
        Passes::Subpasses => true,
        Passes::LocalRead => local_read::goes_on(plan, subpass, drawn),
        Passes::Stored => false,
    };
    is_with_them && !samples_any_of(subpass, drawn)
}

/// The hardware resolves samples after the last subpass that draws them.
fn resolve_samples(plan: &FramePlan, planned: &mut [Planned]) {
    let draws = |own: &ResourceUse| {
        matches!(own.how, UseKind::Color { .. }) && own.resource == Resource::Target(Target::Samples)
    };
    let last = planned.iter_mut().rev().find_map(|own| match own {
        Planned::Drawn(subpass) if subpass.touches.iter().any(draws) => Some(subpass),
        _ => None,
    });
    if let Some(last) = last {
        let touch = ResourceUse::resolve(Target::Output, RESOLVE).because("resolves samples into the picture");
        last.touches.push(touch.in_frames_of(plan));
    }
}

/// Returns true if the subpass samples a target that one of these draws: pixels around its own may not be there yet.
fn samples_any_of(subpass: &Subpass, drawn: &[Subpass]) -> bool {
    let is_drawn =
        |resource| drawn.iter().flat_map(|own| &own.touches).any(|own| own.resource == resource && own.is_attachment());
    subpass.touches.iter().any(|touch| matches!(touch.how, UseKind::Sampled { .. }) && is_drawn(touch.resource))
}

/// Adds to each step the barriers that stand before and after it.
fn add_barriers(plan: &FramePlan, steps: &mut [Step]) {
    for (row, barrier) in rows::waits(plan, steps) {
        let Some(BarrierPosition { step, is_after, resource }) = barrier else { continue };
        if let Step::Commands(own) = &mut steps[step] {
            let rows = if is_after { &mut own.after } else { &mut own.before };
            rows.push((row.name, resource));
            // Which of the two buffers is this frame's own changes from frame to frame.
            if let Resource::Kept(own) = resource {
                rows.push((row.name, Resource::KeptBefore(own)));
            }
        }
    }
}

/// A subpass of the given passes that are in the plan; `None` if none of them is.
fn subpass(plan: &FramePlan, place: Endpoint, passes: &[&'static Pass]) -> Option<Subpass> {
    let passes: Vec<_> = passes.iter().copied().filter(|pass| (pass.presence)(plan).is_in()).collect();
    let mut touches: Vec<ResourceUse> = Vec::new();
    for touch in passes.iter().flat_map(|pass| pass.uses(plan)) {
        // Passes beside each other have one reference to an attachment: one that uses it as another one does adds nothing but its reason.
        if !touches.iter().any(|own| own.is_use_of(&touch)) {
            touches.push(touch);
        }
    }
    // DEPTH and PER_LIGHT draw into the attachments of the pass beside them, so that alone they make no subpass.
    touches.iter().any(ResourceUse::is_attachment).then_some(Subpass { place, passes, touches })
}

/// A pass outside of render passes, if the plan has it.
fn commands(
    plan: &FramePlan,
    when: Condition,
    pass: &'static Pass,
    before: &[(RowName, Resource)],
    after: &[(RowName, Resource)],
) -> Option<Step> {
    let is_in = (pass.presence)(plan).is_in();
    let (before, after) = (before.to_vec(), after.to_vec());
    is_in.then_some(Step::Commands(Commands { pass, when, queue: Queue::Graphics, before, after }))
}

/// Returns the steps after the picture: a copy for the CPU, or a window's overlay and presentation.
fn after_the_picture(plan: &FramePlan) -> Vec<Option<Step>> {
    use Condition::{Always, Copied, Covered, Split};
    let shown = shown(plan);
    let swapchain = Resource::SwapchainImage;
    let to_host = (RowName::PICTURE_TO_HOST, Resource::ReadBack);
    let copied = commands(
        plan,
        Always,
        &present::PASS,
        &[(RowName::SWAPCHAIN_TO_PRESENT, shown)],
        &[(RowName::PRESENT_TO_SWAPCHAIN, shown)],
    );
    let split = commands(
        plan,
        Split,
        &split::PASS,
        &[(RowName::PICTURE_TO_SPLIT, shown)],
        &[(RowName::SPLIT_TO_PICTURE, shown)],
    );
    let covered = commands(
        plan,
        Covered,
        &overlay::PASS,
        &[(RowName::PICTURE_TO_OVERLAY, shown)],
        &[(RowName::OVERLAY_TO_PICTURE, shown)],
    );
    match plan.presented {
        None => vec![commands(plan, Copied, &copy::PASS, &[], &[to_host])],
        Some(PresentTarget::Straight(_) | PresentTarget::Enlarge(_)) => vec![
            copied,
            split,
            commands(
                plan,
                Copied,
                &copy::PASS,
                &[(RowName::PICTURE_TO_COPY, shown)],
                &[to_host, (RowName::COPY_TO_PICTURE, shown)],
            ),
            covered,
            Some(Step::Presentation),
        ],
        Some(PresentTarget::Encode(_) | PresentTarget::EncodeKept(_)) => vec![
            copied,
            split,
            commands(plan, Copied, &copy::PASS, &[], &[to_host]),
            covered,
            commands(
                plan,
                Always,
                &encode::PASS,
                &[(RowName::PICTURE_TO_ENCODE, shown), (RowName::SWAPCHAIN_TO_ENCODE, swapchain)],
                &[(RowName::ENCODE_TO_PICTURE, shown), (RowName::ENCODE_TO_SWAPCHAIN, swapchain)],
            ),
            Some(Step::Presentation),
        ],
    }
}

impl Step {
    /// Moves the step to the compute queue, if the plan uses one.
    fn beside(self, plan: &FramePlan) -> Self {
        match self {
            Self::Commands(own) if plan.computes_beside() => Self::Commands(Commands { queue: Queue::Compute, ..own }),
            other => other,
        }
    }

    /// The passes of the step.
    pub fn passes(&self) -> Vec<&'static Pass> {
        match self {
            Self::RenderPass(_, subpasses) => subpasses.iter().flat_map(|own| own.passes.iter().copied()).collect(),
            Self::Commands(own) => vec![own.pass],
            Self::Presentation | Self::HandOver(_) => Vec::new(),
        }
    }

    /// All touches of the step.
    pub fn touches(&self, plan: &FramePlan) -> Vec<ResourceUse> {
        match self {
            Self::RenderPass(_, subpasses) => subpasses.iter().flat_map(|own| own.touches.iter().copied()).collect(),
            Self::Commands(own) => own.pass.uses(plan),
            Self::Presentation => {
                vec![ResourceUse::new(shown(plan), UseKind::Presented, Use::END).in_frames_of(plan)]
            }
            // A hand-over keeps the images' layouts, and nothing reads or writes them.
            Self::HandOver(_) => Vec::new(),
        }
    }

    /// The layout that an image must be in before the step, unless a barrier of the step's own brings it there.
    fn finds(&self, plan: &FramePlan, image: Resource) -> Option<vk::ImageLayout> {
        if let Self::Commands(own) = self
            && own.before.iter().any(|&(_, resource)| resource == image)
        {
            return None;
        }
        self.touches(plan).iter().find(|touch| touch.resource == image).map(ResourceUse::layout)
    }

    /// The layout in which commands leave an image that no barrier of theirs changes afterwards.
    fn leaves(&self, plan: &FramePlan, image: Resource) -> Option<vk::ImageLayout> {
        let Self::Commands(own) = self else { return None };
        let changes = own.after.iter().any(|&(_, resource)| resource == image);
        let last = own.pass.uses(plan).iter().rfind(|touch| touch.resource == image).map(ResourceUse::layout);
        last.filter(|_| !changes)
    }
}

impl StepList {
    /// The steps in the order in which a frame records them; `proof` and the renderer both follow this list.
    pub fn of(plan: &FramePlan) -> Self {
        Self(steps(plan).into_iter().chain(after_the_picture(plan).into_iter().flatten()).collect())
    }

    /// The render passes with their subpasses.
    pub fn render_passes(&self) -> impl Iterator<Item = (RenderPassName, &[Subpass])> {
        self.0.iter().filter_map(|step| match step {
            Step::RenderPass(name, subpasses) => Some((*name, &subpasses[..])),
            _ => None,
        })
    }

    /// All passes in their order.
    pub fn passes(&self) -> impl Iterator<Item = &'static Pass> {
        self.0.iter().flat_map(Step::passes)
    }

    /// The passes at a place: all passes of a subpass, or the one pass outside of render passes.
    pub fn passes_at(&self, place: Endpoint) -> Vec<&'static Pass> {
        let subpass = self.render_passes().flat_map(|(_, subpasses)| subpasses).find(|own| own.place == place);
        match subpass {
            Some(own) => own.passes.clone(),
            None => self.passes().filter(|pass| pass.name == place).collect(),
        }
    }

    /// The touches of the subpass that a pass draws in, or its own outside of render passes.
    pub fn touches_with(&self, plan: &FramePlan, pass: &Pass) -> Vec<ResourceUse> {
        let mut subpasses = self.render_passes().flat_map(|(_, subpasses)| subpasses);
        let own = subpasses.find(|own| own.passes.iter().any(|one| one.name == pass.name));
        own.map_or_else(|| pass.uses(plan), |own| own.touches.clone())
    }

    /// The render pass, and the index in it, of a subpass.
    pub fn find(&self, place: Endpoint) -> Option<(RenderPassName, u32)> {
        self.render_passes().find_map(|(name, subpasses)| {
            let index = subpasses.iter().position(|own| own.place == place)?;
            Some((name, index as u32))
        })
    }

    /// The attachments of a render pass in the order of its framebuffers: loaded if an earlier step wrote them, stored if a later one reads
    /// them, and left in the layout in which that one finds them.
    pub fn attachments(&self, plan: &FramePlan, name: RenderPassName) -> Vec<(Target, vk::AttachmentDescription)> {
        let at = |step: &Step| matches!(step, Step::RenderPass(own, _) if *own == name);
        let Some(index) = self.0.iter().position(at) else { return Vec::new() };
        let touches = self.0[index].touches(plan);
        plan.targets()
            .filter_map(|target| {
                let own = |touch: &&ResourceUse| touch.resource == Resource::Target(target) && touch.is_attachment();
                let first = touches.iter().find(own)?;
                let last = touches.iter().rfind(own)?;
                Some((target, self.attachment(plan, index, (target, first, last))))
            })
            .collect()
    }

    fn attachment(
        &self,
        plan: &FramePlan,
        index: usize,
        (target, first, last): (Target, &ResourceUse, &ResourceUse),
    ) -> vk::AttachmentDescription {
        let image = Resource::Target(target);
        let touches = |step: &Step| step.touches(plan).iter().any(|touch| touch.resource == image);
        // ANCHOR: load-and-store
        let (before, after) = (&self.0[..index], &self.0[index + 1..]);
        let is_loaded = before.iter().any(touches);
        let load = match (is_loaded, first.how) {
            (true, _) => vk::AttachmentLoadOp::LOAD,
            (
                false,
                UseKind::Color { first: ContentsIfFirst::Clear, .. } | UseKind::Depth { first: ContentsIfFirst::Clear },
            ) => vk::AttachmentLoadOp::CLEAR,
            (false, _) => vk::AttachmentLoadOp::DONT_CARE,
        };
        let store = match after.iter().any(touches) {
            true => vk::AttachmentStoreOp::STORE,
            // It need never leave the tile.
            false => vk::AttachmentStoreOp::DONT_CARE,
        };
        // ANCHOR_END: load-and-store
        vk::AttachmentDescription::default()
            .format(plan.format_of(target).unwrap_or_default())
            .samples(vk::SampleCountFlags::from_raw(plan.samples_of(target)))
            .load_op(load)
            .store_op(store)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            // A render pass stores in the layout that this one wants first, and so does a barrier; other steps leave the image in their own. Nothing
            // is kept from frame to frame.
            .initial_layout(match before.iter().rfind(|step| touches(step)) {
                Some(step) => step.leaves(plan, image).unwrap_or(first.layout()),
                None => vk::ImageLayout::UNDEFINED,
            })
            .final_layout(after.iter().find_map(|step| step.finds(plan, image)).unwrap_or(last.layout()))
    }

    /// The usage of a target's image. One that no step keeps for another is transient.
    pub fn usage(&self, plan: &FramePlan, target: Target) -> vk::ImageUsageFlags {
        let image = Resource::Target(target);
        let users: Vec<Vec<ResourceUse>> = self
            .0
            .iter()
            .map(|step| step.touches(plan).into_iter().filter(|touch| touch.resource == image).collect())
            .filter(|touches: &Vec<_>| !touches.is_empty())
            .collect();
        // ANCHOR: transient
        let all = users.iter().flatten().fold(vk::ImageUsageFlags::empty(), |usage, touch| usage | touch.usage());
        let stays = users.len() == 1 && users[0].iter().all(ResourceUse::is_attachment);
        if stays { all | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT } else { all }
        // ANCHOR_END: transient
    }
}

/// Each pass that a frame can have: first all of the order, then all that come after the picture.
pub fn passes() -> Vec<&'static Pass> {
    let mut all: Vec<&'static Pass> = Vec::new();
    let shown = [&present::PASS, &split::PASS, &copy::PASS, &overlay::PASS, &encode::PASS];
    for pass in ORDER.iter().flat_map(OrderEntry::passes).chain(shown) {
        if !all.iter().any(|own| own.name == pass.name) {
            all.push(pass);
        }
    }
    all
}

/// The passes in or out and why, as `inspect` lists them.
pub fn parts(plan: &FramePlan) -> Vec<Part> {
    let all = passes().into_iter();
    all.map(|pass| {
        let (included, reason) = match (pass.presence)(plan) {
            crate::passes::Presence::In(why) => (true, why),
            crate::passes::Presence::Out(why) => (false, why),
        };
        Part { name: pass.name.to_string(), group: PartGroup::Passes, optional: None, included, reason, bytes: 0 }
    })
    .collect()
}
