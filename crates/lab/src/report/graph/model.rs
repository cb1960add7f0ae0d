//! The model of the drawing: stops in time, images, and the stops' uses of images. Derived from the list of passes, from the descriptions that the
//! render passes are made from, and from the table of dependencies.

use ash::vk;

use afterlight::frame::list::{RenderPassName, Step, StepList};
use afterlight::frame::render_pass::{LayoutChange, PassDescription, SubpassAttachments, layout_changes};
use afterlight::frame::rows::{Endpoint, Row, Rows};
use afterlight::passes::{ONCE, Resource, UseKind, copy};
use afterlight::plan::{FramePlan, format_bytes};

/// An event of the frame, or one that stands for all events before or after it.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphStop {
    /// The pass.
    pub place: Endpoint,
    /// The part of the frame's time in which the dependency meets it.
    pub when: When,
    /// The name in the drawing.
    pub name: String,
    pub what: &'static str,
    /// The render pass that it is a subpass of.
    pub pass: Option<RenderPassName>,
    pub touches: Vec<PassUse>,
}

/// A part of the frame's time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum When {
    Before,
    During,
    After,
}

/// A stop's use of an image, by the image's index.
#[derive(Debug, Clone, PartialEq)]
pub struct PassUse {
    pub image: usize,
    pub how: String,
    pub writes: bool,
    /// As an attachment of its render pass.
    pub attached: bool,
}

/// An image that the frame draws into.
#[derive(Debug, Clone)]
pub struct FrameImage {
    pub resource: Resource,
    /// The name in the drawing.
    pub name: String,
    pub format: vk::Format,
    pub samples: u32,
    /// Bytes of the image for a pixel of the picture; `None` for images of another size.
    pub bytes_per_pixel: Option<u32>,
    pub bytes: u64,
    /// As the render pass has it; none for an image that no render pass writes.
    pub attachment: Option<vk::AttachmentDescription>,
}

/// The whole frame.
#[derive(Debug, Clone)]
pub struct Graph {
    pub stops: Vec<GraphStop>,
    pub images: Vec<FrameImage>,
    /// Each with the indices of the stops that it is between.
    pub edges: Vec<(Row, [usize; 2])>,
    /// The layout changes that each of `edges` makes.
    pub layouts: Vec<Vec<LayoutChange>>,
}

/// The order of places before a frame, on both sides of [`ONCE`].
const BEFORE: [&[Endpoint]; 2] =
    [&[Endpoint::PRESENTATION, Endpoint::HOST, Endpoint::DEVICE, Endpoint::OUTSIDE], &[Endpoint::DRAWS]];
/// The order of places after a frame.
const AFTER: [Endpoint; 5] =
    [Endpoint::OUTSIDE, copy::PASS.name, Endpoint::DEVICE, Endpoint::PRESENTATION, Endpoint::HOST];

impl Graph {
    pub fn of(plan: &FramePlan, rows: &Rows) -> Self {
        let (list, passes) = (StepList::of(plan), PassDescription::all(plan, rows));
        let mut images: Vec<FrameImage> = Vec::new();
        for (resource, attachment) in passes.iter().flat_map(|pass| &pass.attachments) {
            if !images.iter().any(|own| own.resource == *resource) {
                images.push(image(plan, *resource, attachment.format, Some(*attachment)));
            }
        }
        for (target, format) in plan.targets().filter_map(|target| Some((target, plan.format_of(target)?))) {
            let resource = Resource::Target(target);
            if !images.iter().any(|own| own.resource == resource) {
                images.push(image(plan, resource, format, None));
            }
        }
        let mut graph = Self { stops: Vec::new(), images, edges: Vec::new(), layouts: Vec::new() };
        for pass in &passes {
            for subpass in &pass.subpasses {
                let touches = graph.touches(pass, subpass);
                graph.stops.push(GraphStop {
                    pass: Some(pass.name),
                    touches,
                    ..stop(&list, subpass.place, When::During)
                });
            }
        }
        for edge in rows.iter() {
            for (place, when) in ends(edge) {
                if graph.find(place, when).is_none() {
                    graph.stops.push(stop(&list, place, when));
                }
            }
        }
        graph.add_touches_outside_of_passes(plan, &list);
        let before = [BEFORE[0], &ONCE.map(|(place, _)| place), BEFORE[1]].concat();
        let order: Vec<_> = places(&list).collect();
        let rank = |stop: &GraphStop| {
            let order = match stop.when {
                When::Before => &before[..],
                When::During => &order,
                When::After => &AFTER,
            };
            order.iter().position(|&own| own == stop.place).unwrap_or(0)
        };
        graph.stops.sort_by_key(|stop| (stop.when, rank(stop)));
        let between = |row: &Row| {
            // Added above, where it was not there.
            let [from, to] = ends(row).map(|(place, when)| graph.find(place, when).unwrap_or(0));
            (row.clone(), [from, to])
        };
        graph.edges = rows.iter().map(between).collect();
        graph.layouts = rows.iter().map(|edge| layout_changes(plan, rows, edge)).collect();
        graph
    }

    fn find(&self, place: Endpoint, when: When) -> Option<usize> {
        self.stops.iter().position(|stop| (stop.place, stop.when) == (place, when))
    }

    fn image(&self, resource: Resource) -> Option<usize> {
        self.images.iter().position(|image| image.resource == resource)
    }

    /// All references of a subpass, in the words of the drawing.
    fn touches(&self, pass: &PassDescription, subpass: &SubpassAttachments) -> Vec<PassUse> {
        let mut touches = Vec::new();
        let mut add = |attachment: u32, how: String, writes| {
            // Past the end: `vk::ATTACHMENT_UNUSED`, a gap between locations.
            let resource = pass.attachments.get(attachment as usize).map(|&(resource, _)| resource);
            if let Some(image) = resource.and_then(|resource| self.image(resource)) {
                touches.push(PassUse { image, how, writes, attached: true });
            }
        };
        for (index, reference) in subpass.input.iter().enumerate() {
            add(reference.attachment, format!("input {index}"), false);
        }
        for (location, reference) in subpass.color.iter().enumerate() {
            add(reference.attachment, format!("color {location}"), true);
        }
        for reference in &subpass.resolve {
            add(reference.attachment, "resolve".into(), true);
        }
        if let Some(depth) = subpass.depth {
            let writes = subpass.touches.iter().any(|own| matches!(own.how, UseKind::Depth { .. }) && own.writes());
            add(depth.attachment, if writes { "test, write" } else { "test" }.into(), writes);
        }
        for &attachment in &subpass.preserve {
            add(attachment, "preserve".into(), false);
        }
        touches
    }

    /// Adds reads and writes by other means than attachments.
    fn add_touches_outside_of_passes(&mut self, plan: &FramePlan, list: &StepList) {
        let mut all = Vec::new();
        for step in &list.0 {
            match step {
                Step::RenderPass(_, subpasses) => {
                    all.extend(subpasses.iter().map(|own| (own.place, own.touches.clone())));
                }
                Step::Commands(own) => all.push((own.pass.name, own.pass.uses(plan))),
                Step::Presentation | Step::HandOver(_) => {}
            }
        }
        for (place, touches) in all {
            let Some(stop) = self.find(place, when(place, When::After)) else { continue };
            for touch in touches {
                let how = match touch.how {
                    UseKind::Sampled { .. } => "sampled",
                    UseKind::Storage { .. } => "stored to",
                    UseKind::CopiedFrom => "copied",
                    UseKind::CopiedTo => "copied to",
                    // OVERLAY and ENCODE, which begin separate render passes.
                    UseKind::Color { .. } if self.stops[stop].pass.is_none() => "drawn over",
                    _ => continue,
                };
                if let Some(image) = self.image(touch.resource) {
                    let (how, writes) = (how.into(), touch.writes());
                    self.stops[stop].touches.push(PassUse { image, how, writes, attached: false });
                }
            }
        }
    }

    /// The stops that touch an image first and last.
    pub fn life(&self, image: usize) -> Option<(usize, usize)> {
        let touched = |stop: &GraphStop| stop.touches.iter().any(|touch| touch.image == image);
        Some((self.stops.iter().position(touched)?, self.stops.iter().rposition(touched)?))
    }
}

fn image(
    plan: &FramePlan,
    resource: Resource,
    format: vk::Format,
    attachment: Option<vk::AttachmentDescription>,
) -> FrameImage {
    let samples = match resource {
        Resource::Target(target) => plan.samples_of(target),
        _ => 1,
    };
    let texel = format_bytes(format) * samples;
    let pixels = u64::from(plan.size[0]) * u64::from(plan.size[1]);
    let (bytes_per_pixel, bytes) = match (resource, &plan.shadow) {
        (Resource::Maps(_), Some(shadow)) => (None, u64::from(texel) * shadow.texels()),
        _ => (Some(texel), u64::from(texel) * pixels),
    };
    let name = resource.to_string();
    FrameImage { resource, name, format, samples, bytes_per_pixel, bytes, attachment }
}

/// Returns the begin and the end of a row. Places outside the frame come before the places that wait for them, and after the places that they wait
/// for.
fn ends(row: &Row) -> [(Endpoint, When); 2] {
    // Data that the CPU hands over come before everything that a submission does, and data that it waits for after all of that.
    let (from, to) = match (row.from, row.to) {
        (Endpoint::DEVICE, _) => (When::After, When::After),
        (_, Endpoint::DEVICE) => (When::Before, When::Before),
        _ => (When::Before, When::After),
    };
    [(row.from, when(row.from, from)), (row.to, when(row.to, to))]
}

/// Returns the work of a place that works once.
fn once_at(place: Endpoint) -> Option<&'static str> {
    ONCE.iter().find(|(own, _)| *own == place).map(|&(_, what)| what)
}

/// Returns the part of the frame's time that a place is in: `outside` for a place on either side of a frame.
fn when(place: Endpoint, outside: When) -> When {
    match place {
        Endpoint::OUTSIDE | Endpoint::HOST | Endpoint::DEVICE | Endpoint::PRESENTATION => outside,
        Endpoint::DRAWS => When::Before,
        place if once_at(place).is_some() => When::Before,
        // The copy is a separate submission.
        place if place == copy::PASS.name => When::After,
        _ => When::During,
    }
}

/// The places of the frame in their order.
fn places(list: &StepList) -> impl Iterator<Item = Endpoint> {
    list.0.iter().flat_map(|step| match step {
        Step::RenderPass(_, subpasses) => subpasses.iter().map(|own| own.place).collect(),
        Step::Commands(own) => vec![own.pass.name],
        Step::Presentation | Step::HandOver(_) => Vec::new(),
    })
}

fn stop(list: &StepList, place: Endpoint, when: When) -> GraphStop {
    let passes = list.passes_at(place);
    // DEPTH and PER_LIGHT draw beside another pass, which gives the stop its name.
    let named = passes.iter().find(|pass| pass.name == place).or(passes.first());
    let what = match (place, when) {
        (Endpoint::OUTSIDE, When::After) => "later commands of this frame or another, as COPY",
        (Endpoint::OUTSIDE, _) => "earlier commands, of the frames before",
        (Endpoint::DRAWS, _) => "every pass below that draws the scene's meshes with its textures",
        (Endpoint::DEVICE, _) => "everything that one submission does",
        (Endpoint::HOST, _) => "the CPU",
        (Endpoint::PRESENTATION, _) => "shows the swapchain's images",
        _ => named.map(|pass| pass.what).or_else(|| once_at(place)).unwrap_or_default(),
    };
    let name = named.map_or(place, |pass| pass.name).to_string();
    GraphStop { place, when, name, what, pass: None, touches: Vec::new() }
}
