//! What the drawing shows: stops in time, images, and who touches which how. Derived from the descriptions that the render passes
//! are made from, and from the table of dependencies.

use ash::vk;

use crate::frame::edges::{Edge, Edges, Place};
use crate::frame::render_pass::{LayoutChange, PassDescription, Resource, Subpass, layout_changes};
use crate::passes::fxaa;
use crate::plan::{FramePlan, Shading, format_bytes};
use crate::targets::{Target, samples_of, storage_output, stored_inputs};

/// Something that happens, or stands for what happens before or after the frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    pub place: Place,
    pub when: When,
    pub name: String,
    pub what: &'static str,
    /// The render pass that it is a subpass of.
    pub pass: Option<&'static str>,
    pub touches: Vec<Touch>,
}

/// Where in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum When {
    Before,
    During,
    After,
}

/// How a stop touches an image, by its index.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    pub image: usize,
    pub how: String,
    pub writes: bool,
    /// As an attachment of its render pass.
    pub attached: bool,
}

/// An image that the frame draws into.
#[derive(Debug, Clone)]
pub struct Image {
    pub resource: Resource,
    pub name: String,
    pub format: vk::Format,
    pub samples: u32,
    /// Of a pixel of the picture; none for images of another size.
    pub bytes_per_pixel: Option<u32>,
    pub bytes: u64,
    /// As the render pass has it; none for what no render pass writes.
    pub attachment: Option<vk::AttachmentDescription>,
}

/// The whole frame.
#[derive(Debug, Clone)]
pub struct Graph {
    pub stops: Vec<Stop>,
    pub images: Vec<Image>,
    /// Each with the indices of the stops that it is between.
    pub edges: Vec<(Edge, [usize; 2])>,
    /// What layouts each of them changes.
    pub layouts: Vec<Vec<LayoutChange>>,
}

/// The order of time: before a frame, in it, and after it.
const BEFORE: [Place; 7] =
    [Place::Presentation, Place::Host, Place::Device, Place::Outside, Place::Upload, Place::Clear, Place::Draws];
const DURING: [Place; 13] = [
    Place::Shadow,
    Place::Geometry,
    Place::Lighting,
    Place::Forward,
    Place::Transparent,
    Place::Composite,
    Place::Tonemap,
    Place::Tiled,
    Place::Fxaa,
    Place::Present,
    Place::Split,
    Place::Overlay,
    Place::Encode,
];
const AFTER: [Place; 5] = [Place::Outside, Place::Copy, Place::Device, Place::Presentation, Place::Host];

impl Graph {
    pub fn of(plan: &FramePlan, edges: &Edges) -> Self {
        let mut passes = vec![PassDescription::main(plan, edges)];
        if plan.shadow.is_some() {
            passes.insert(0, PassDescription::shadow(plan, edges));
        }
        if plan.fxaa {
            passes.push(PassDescription::fxaa(plan, edges));
        }
        let mut images: Vec<Image> =
            passes.iter().flat_map(|pass| &pass.attachments).map(|own| attached(plan, own)).collect();
        images.extend(storage_output(plan).map(|own| image(plan, Resource::Target(own.target), own.format, None)));
        let mut graph = Self { stops: Vec::new(), images, edges: Vec::new(), layouts: Vec::new() };
        for pass in &passes {
            for subpass in &pass.subpasses {
                let touches = graph.touches(pass, subpass);
                graph.stops.push(Stop { pass: Some(pass.name), touches, ..stop(plan, subpass.place, When::During) });
            }
        }
        for edge in edges.iter() {
            for (place, when) in ends(edge) {
                if graph.find(place, when).is_none() {
                    graph.stops.push(stop(plan, place, when));
                }
            }
        }
        graph.add_touches_outside_of_passes(plan, edges);
        graph.stops.sort_by_key(|stop| (stop.when, rank(stop.place, stop.when)));
        let between = |edge: &Edge| {
            // Added above, where it was not there.
            let [from, to] = ends(edge).map(|(place, when)| graph.find(place, when).unwrap_or(0));
            (edge.clone(), [from, to])
        };
        graph.edges = edges.iter().map(between).collect();
        graph.layouts = edges.iter().map(|edge| layout_changes(plan, edges, edge)).collect();
        graph
    }

    fn find(&self, place: Place, when: When) -> Option<usize> {
        self.stops.iter().position(|stop| (stop.place, stop.when) == (place, when))
    }

    fn image(&self, resource: Resource) -> Option<usize> {
        self.images.iter().position(|image| image.resource == resource)
    }

    /// All references of a subpass, in the words of the drawing.
    fn touches(&self, pass: &PassDescription, subpass: &Subpass) -> Vec<Touch> {
        let mut touches = Vec::new();
        let mut add = |attachment: u32, how: String, writes| {
            // Past the end: `vk::ATTACHMENT_UNUSED`, a gap between locations.
            let resource = pass.attachments.get(attachment as usize).map(|&(resource, _)| resource);
            if let Some(image) = resource.and_then(|resource| self.image(resource)) {
                touches.push(Touch { image, how, writes, attached: true });
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
            let writes = depth.layout == vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
            add(depth.attachment, if writes { "test, write" } else { "test" }.into(), writes);
        }
        for &attachment in &subpass.preserve {
            add(attachment, "preserve".into(), false);
        }
        touches
    }

    /// What is read and written by other means than attachments.
    fn add_touches_outside_of_passes(&mut self, plan: &FramePlan, edges: &Edges) {
        let mut touches = Vec::new();
        // Who waits for SHADOW, looks the maps up.
        for edge in edges.iter().filter(|edge| edge.from == Place::Shadow && edge.to != Place::Shadow) {
            touches.push((edge.to, Resource::ShadowMaps, "sampled", false));
        }
        if plan.shadow.is_some() && plan.transparency.is_some() {
            // After those, in the same pass: the rows into that order it too.
            touches.push((Place::Transparent, Resource::ShadowMaps, "sampled", false));
        }
        if plan.is_tiled() {
            let emitted = plan.emissive.then_some(Target::Hdr);
            for target in stored_inputs(plan).into_iter().map(|(_, target)| target).chain(emitted) {
                touches.push((Place::Tiled, Resource::Target(target), "sampled", false));
            }
            touches.push((Place::Tiled, Resource::Target(Target::Output), "stored to", true));
        }
        let picture = match plan.fxaa {
            true => {
                let sampled =
                    fxaa::touches(plan).map(|own| (Place::Fxaa, Resource::Target(own.target()), "sampled", false));
                touches.extend(sampled);
                Resource::SmoothedPicture
            }
            false => Resource::Target(Target::Output),
        };
        touches.push((Place::Copy, picture, "copied", false));
        for (place, resource, how, writes) in touches {
            if let (Some(stop), Some(image)) = (self.find(place, when(place, When::After)), self.image(resource)) {
                self.stops[stop].touches.push(Touch { image, how: how.into(), writes, attached: false });
            }
        }
    }

    /// The stops that touch an image first and last.
    pub fn life(&self, image: usize) -> Option<(usize, usize)> {
        let touched = |stop: &Stop| stop.touches.iter().any(|touch| touch.image == image);
        Some((self.stops.iter().position(touched)?, self.stops.iter().rposition(touched)?))
    }
}

fn attached(plan: &FramePlan, &(resource, attachment): &(Resource, vk::AttachmentDescription)) -> Image {
    image(plan, resource, attachment.format, Some(attachment))
}

fn image(
    plan: &FramePlan,
    resource: Resource,
    format: vk::Format,
    attachment: Option<vk::AttachmentDescription>,
) -> Image {
    let samples = match resource {
        Resource::Target(target) => samples_of(plan, target).as_raw(),
        Resource::ShadowMaps | Resource::SmoothedPicture => 1,
    };
    let texel = format_bytes(format) * samples;
    let pixels = u64::from(plan.size[0]) * u64::from(plan.size[1]);
    let (bytes_per_pixel, bytes) = match (resource, &plan.shadow) {
        (Resource::ShadowMaps, Some(shadow)) => (None, shadow.bytes()),
        _ => (Some(texel), u64::from(texel) * pixels),
    };
    let name = resource.to_string();
    Image { resource, name, format, samples, bytes_per_pixel, bytes, attachment }
}

/// Where a row begins and ends. What is outside of the frame lies before what waits for it, and after what it waits for.
fn ends(edge: &Edge) -> [(Place, When); 2] {
    // What the CPU hands over comes before all that a submission does, and what it waits for after all of that.
    let (from, to) = match (edge.from, edge.to) {
        (Place::Device, _) => (When::After, When::After),
        (_, Place::Device) => (When::Before, When::Before),
        _ => (When::Before, When::After),
    };
    [(edge.from, when(edge.from, from)), (edge.to, when(edge.to, to))]
}

/// `outside`: of what lies on either side of a frame.
fn when(place: Place, outside: When) -> When {
    match place {
        Place::Outside | Place::Host | Place::Device | Place::Presentation => outside,
        Place::Upload | Place::Clear | Place::Draws => When::Before,
        // A submission of its own.
        Place::Copy => When::After,
        _ => When::During,
    }
}

fn rank(place: Place, when: When) -> usize {
    let order = match when {
        When::Before => &BEFORE[..],
        When::During => &DURING,
        When::After => &AFTER,
    };
    order.iter().position(|&own| own == place).unwrap_or(0)
}

fn stop(plan: &FramePlan, place: Place, when: When) -> Stop {
    let lit = matches!(plan.shading, Shading::Light { .. });
    let what = match (place, when) {
        (Place::Outside, When::After) => "later commands of this frame or another, as COPY",
        (Place::Outside, _) => "earlier commands, of the frames before",
        (Place::Shadow, _) => "depth maps of lights, a render pass each, those in which something has moved",
        (Place::Geometry, _) if plan.gbuffer.is_some() => "surfaces into the G-buffer, near ones first",
        (Place::Geometry, _) => "surfaces, near ones first",
        (Place::Lighting, _) if lit => "every light on every pixel, which reads its own place of the G-buffer",
        (Place::Lighting, _) => "VIEW: shows a buffer instead of lighting it",
        (Place::Forward, _) => "surfaces, lit while they are rasterized",
        (Place::Transparent, _) => "what shows what lies behind it",
        (Place::Composite, _) => "what was summed up without sorting, over the light",
        (Place::Tonemap, _) => "scene light into display light",
        (Place::Tiled, _) => "every light on every pixel, tile by tile, in a compute shader",
        (Place::Fxaa, _) => "smooths edges, and so reads each pixel's neighbours",
        (Place::Copy, _) => "brings the picture to the CPU, in a submission of its own, when one is asked for",
        (Place::Split, _) => "copies a part of another picture over this one",
        (Place::Overlay, _) => "draws panels over the picture",
        (Place::Encode, _) => "brings the picture into an image of the swapchain that no hardware encodes",
        (Place::Present, _) => "copies the picture into an image of the swapchain",
        (Place::Presentation, _) => "shows the swapchain's images",
        (Place::Upload, _) => "once: copies out of staging buffers, and blits from level to level of a texture",
        (Place::Clear, _) => "once: the shadow maps' image, which the first frame may look up anywhere",
        (Place::Draws, _) => "every pass below that draws the scene's meshes with its textures",
        (Place::Device, _) => "everything that one submission does",
        (Place::Host, _) => "the CPU",
    };
    let name = match (place, when) {
        (Place::Lighting, _) if !lit => "LIGHTING's place".to_owned(),
        _ => place.to_string(),
    };
    Stop { place, when, name, what, pass: None, touches: Vec::new() }
}
