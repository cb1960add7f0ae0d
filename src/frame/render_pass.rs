//! The render passes of a plan: attachments, subpasses, and the rows of [`super::edges`] as dependencies.

use std::fmt;
use std::sync::Arc;

use ash::vk;

use super::edges::{Carrier, Edge, Edges, Place};
use crate::gpu::sync::Use;
use crate::gpu::{self, Device, RenderPass, SubpassDesc};
use crate::passes::{composite, forward, fxaa, geometry, lighting, shadow, tonemap, transparent};
use crate::plan::FramePlan;
use crate::scene::Transparency;
use crate::targets::{Attachment, Target, Touch, attachments, samples_of};

/// Resolves samples into the output after the subpass that is the last to write them: reads them, and as their last user drops them.
pub const RESOLVE: Use = Use::new(
    vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags::from_raw(
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE.as_raw() | vk::AccessFlags::COLOR_ATTACHMENT_READ.as_raw(),
    ),
);

/// The subpasses of the main pass in their order, each with what it touches. That these passes share a render pass is decided here; their
/// references, and what is preserved between them, follow from the list. Of a tiled plan only GEOMETRY is a subpass.
fn declared(plan: &FramePlan) -> Vec<(Place, Vec<Touch>)> {
    type Touches = fn(&FramePlan) -> Vec<Touch>;
    let is_forward = plan.is_forward();
    let passes: [(Place, bool, Touches); 6] = [
        (Place::Forward, is_forward, forward::touches),
        (Place::Geometry, plan.has_geometry() && !is_forward, geometry::touches),
        // Or VIEW, which touches the same.
        (Place::Lighting, !is_forward && !plan.is_tiled(), lighting::touches),
        (Place::Transparent, plan.transparency.is_some(), transparent::touches),
        (Place::Composite, plan.transparency == Some(Transparency::Oit), composite::touches),
        (Place::Tonemap, plan.has_tonemap_subpass(), tonemap::touches),
    ];
    passes.into_iter().filter(|&(_, is_there, _)| is_there).map(|(place, _, touches)| (place, touches(plan))).collect()
}

/// The index of a place among the main pass's subpasses, if the plan has it there.
pub fn subpass_index(plan: &FramePlan, place: Place) -> Option<u32> {
    declared(plan).iter().position(|&(own, _)| own == place).map(|index| index as u32)
}

/// A render pass as a value. The device's is made from it, and `report::graph` draws it.
#[derive(Debug, Clone)]
pub struct PassDescription {
    pub name: &'static str,
    pub attachments: Vec<(Resource, vk::AttachmentDescription)>,
    pub subpasses: Vec<Subpass>,
    /// Rows of the table, each with the subpasses that it is between.
    pub dependencies: Vec<(Edge, [u32; 2])>,
}

/// An image that a render pass draws into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Resource {
    Target(Target),
    /// A layer of the image of all shadow maps.
    ShadowMaps,
    /// What FXAA draws.
    SmoothedPicture,
}

impl fmt::Display for Resource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Target(target) => f.write_str(&format!("{target:?}").to_lowercase()),
            Self::ShadowMaps => f.write_str("shadow maps"),
            Self::SmoothedPicture => f.write_str("picture"),
        }
    }
}

/// A change of an image's layout, which a dependency orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayoutChange {
    /// None for the image of a barrier.
    pub image: Option<Resource>,
    pub old: vk::ImageLayout,
    pub new: vk::ImageLayout,
}

impl fmt::Display for LayoutChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.image {
            Some(image) => write!(f, "{image} {:?} -> {:?}", self.old, self.new),
            None => write!(f, "{:?} -> {:?}", self.old, self.new),
        }
    }
}

/// The layouts that change where a row of the table orders it.
pub fn layout_changes(plan: &FramePlan, edges: &Edges, edge: &Edge) -> Vec<LayoutChange> {
    let pass = match edge.carrier {
        Carrier::MainPass => PassDescription::main(plan, edges),
        Carrier::ShadowPass => PassDescription::shadow(plan, edges),
        Carrier::FxaaPass => PassDescription::fxaa(plan, edges),
        Carrier::ImageBarrier(old, new) => return vec![LayoutChange { image: None, old, new }],
        _ => return Vec::new(),
    };
    let ends = pass.dependencies.iter().find(|(own, _)| own.name == edge.name).map(|&(_, ends)| ends);
    let changes = pass.layout_changes().into_iter().filter(|(between, _)| Some(*between) == ends);
    changes.map(|(_, change)| change).collect()
}

/// What a subpass does with attachments; references count them in the order of the pass, and `vk::ATTACHMENT_UNUSED` is a gap.
#[derive(Debug, Clone)]
pub struct Subpass {
    pub place: Place,
    /// Read by `InputAttachmentIndex`.
    pub input: Vec<vk::AttachmentReference>,
    /// Written by location.
    pub color: Vec<vk::AttachmentReference>,
    /// Where `color` is resolved to after the subpass; empty, or as many.
    pub resolve: Vec<vk::AttachmentReference>,
    /// Tested, and written if its layout allows that.
    pub depth: Option<vk::AttachmentReference>,
    /// Kept through a subpass that does not use them.
    pub preserve: Vec<u32>,
}

impl Subpass {
    fn at(place: Place) -> Self {
        Self { place, input: Vec::new(), color: Vec::new(), resolve: Vec::new(), depth: None, preserve: Vec::new() }
    }

    fn add(&mut self, order: &[Target], touch: Touch) {
        let reference = reference(order, touch.target(), touch.layout());
        match touch {
            Touch::Input(_) => self.input.push(reference),
            Touch::Color(location, _) => {
                let gap =
                    vk::AttachmentReference { attachment: vk::ATTACHMENT_UNUSED, layout: vk::ImageLayout::UNDEFINED };
                let location = location as usize;
                self.color.resize(self.color.len().max(location + 1), gap);
                self.color[location] = reference;
            }
            Touch::DepthWrite | Touch::DepthTest => self.depth = Some(reference),
            // `check` refuses it.
            Touch::Sampled(_) => {}
        }
    }
}

impl PassDescription {
    /// The one pass with subpasses GEOMETRY, LIGHTING (or VIEW), TRANSPARENT, COMPOSITE and TONEMAP, or FORWARD in the place of
    /// the first two, as far as the plan has them.
    pub fn main(plan: &FramePlan, edges: &Edges) -> Self {
        let describe = |attachment: &Attachment| {
            let description = vk::AttachmentDescription::default()
                .format(attachment.format)
                .samples(samples_of(plan, attachment.target))
                .load_op(attachment.load)
                .store_op(attachment.store)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                // Nothing is kept from frame to frame.
                .initial_layout(vk::ImageLayout::UNDEFINED)
                .final_layout(attachment.final_layout);
            (Resource::Target(attachment.target), description)
        };
        Self {
            name: "main pass",
            attachments: attachments(plan).iter().map(describe).collect(),
            subpasses: main_subpasses(plan),
            dependencies: dependencies(plan, edges, Carrier::MainPass),
        }
    }

    /// The shadow maps' pass: one subpass, depth only.
    pub fn shadow(plan: &FramePlan, edges: &Edges) -> Self {
        let layout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        let depth = Some(vk::AttachmentReference { attachment: 0, layout });
        Self {
            name: "shadow pass",
            attachments: vec![(Resource::ShadowMaps, shadow::attachment())],
            subpasses: vec![Subpass { depth, ..Subpass::at(Place::Shadow) }],
            dependencies: dependencies(plan, edges, Carrier::ShadowPass),
        }
    }

    /// FXAA's pass: one subpass that writes the picture.
    pub fn fxaa(plan: &FramePlan, edges: &Edges) -> Self {
        let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let color = vec![vk::AttachmentReference { attachment: 0, layout }];
        Self {
            name: "FXAA pass",
            attachments: vec![(Resource::SmoothedPicture, fxaa::attachment(plan))],
            subpasses: vec![Subpass { color, ..Subpass::at(Place::Fxaa) }],
            dependencies: dependencies(plan, edges, Carrier::FxaaPass),
        }
    }

    /// Each automatic change of an attachment's layout, and the two of its uses that it is between: subpasses, or
    /// `vk::SUBPASS_EXTERNAL` for what it has before and after the pass.
    fn layout_changes(&self) -> Vec<([u32; 2], LayoutChange)> {
        let mut changes = Vec::new();
        for (index, &(image, attachment)) in (0..).zip(&self.attachments) {
            let mut uses = vec![(vk::SUBPASS_EXTERNAL, attachment.initial_layout)];
            for (subpass, own) in (0..).zip(&self.subpasses) {
                let mut references = own.input.iter().chain(&own.color).chain(&own.resolve).chain(&own.depth);
                // All references of a subpass to an attachment have the same layout.
                uses.extend(
                    references.find(|reference| reference.attachment == index).map(|found| (subpass, found.layout)),
                );
            }
            uses.push((vk::SUBPASS_EXTERNAL, attachment.final_layout));
            for ((from, old), (to, new)) in uses.iter().copied().zip(uses.iter().copied().skip(1)) {
                if old != new {
                    changes.push(([from, to], LayoutChange { image: Some(image), old, new }));
                }
            }
        }
        changes
    }

    /// # Errors
    /// When the device cannot make it.
    pub fn make(&self, device: &Arc<Device>) -> gpu::Result<RenderPass> {
        let attachments: Vec<_> = self.attachments.iter().map(|&(_, description)| description).collect();
        let subpasses: Vec<_> = self
            .subpasses
            .iter()
            .map(|subpass| SubpassDesc {
                input: &subpass.input,
                color: &subpass.color,
                resolve: &subpass.resolve,
                depth: subpass.depth,
                preserve: &subpass.preserve,
            })
            .collect();
        let dependencies: Vec<_> = self
            .dependencies
            .iter()
            .map(|(edge, [from, to])| vk::SubpassDependency {
                src_subpass: *from,
                dst_subpass: *to,
                src_stage_mask: edge.before.stage,
                dst_stage_mask: edge.after.stage,
                src_access_mask: edge.before.access,
                dst_access_mask: edge.after.access,
                dependency_flags: match edge.by_region {
                    true => vk::DependencyFlags::BY_REGION,
                    false => vk::DependencyFlags::empty(),
                },
            })
            .collect();
        RenderPass::new(device, self.name, &attachments, &subpasses, &dependencies)
    }
}

/// The main pass's subpasses, from what their passes declare.
fn main_subpasses(plan: &FramePlan) -> Vec<Subpass> {
    let order: Vec<_> = attachments(plan).iter().map(|attachment| attachment.target).collect();
    let declared = declared(plan);
    let uses = |touches: &[Touch], target| touches.iter().any(|touch| touch.target() == target);
    let subpass = |(index, (place, touches)): (usize, &(Place, Vec<Touch>))| {
        let mut own = Subpass::at(*place);
        touches.iter().for_each(|&touch| own.add(&order, touch));
        // What is used before and after it, and not by it.
        let used = |some: &[(Place, Vec<Touch>)], target| some.iter().any(|(_, touches)| uses(touches, target));
        let (before, after) = (&declared[..index], &declared[index + 1..]);
        let passes_by = |target| !uses(touches, target) && used(before, target) && used(after, target);
        own.preserve = (0..).zip(&order).filter(|&(_, &target)| passes_by(target)).map(|(index, _)| index).collect();
        own
    };
    let mut subpasses: Vec<_> = declared.iter().enumerate().map(subpass).collect();
    // After the last subpass that draws samples they are resolved.
    let draws_samples = |(_, touches): &(Place, Vec<Touch>)| {
        touches.iter().any(|touch| matches!(touch, Touch::Color(_, Target::Samples)))
    };
    if let Some(last) = declared.iter().rposition(draws_samples) {
        subpasses[last].resolve = vec![reference(&order, Target::Output, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)];
    }
    subpasses
}

fn dependencies(plan: &FramePlan, edges: &Edges, carrier: Carrier) -> Vec<(Edge, [u32; 2])> {
    let index = |place| match (carrier, place) {
        // The passes of these have one subpass; all else is outside.
        (Carrier::ShadowPass, Place::Shadow) | (Carrier::FxaaPass, Place::Fxaa) => 0,
        (Carrier::MainPass, place) => subpass_index(plan, place).unwrap_or(vk::SUBPASS_EXTERNAL),
        _ => vk::SUBPASS_EXTERNAL,
    };
    edges.of(carrier).map(|edge| (edge.clone(), [index(edge.from), index(edge.to)])).collect()
}

/// By its number in the order of the pass.
fn reference(order: &[Target], target: Target, layout: vk::ImageLayout) -> vk::AttachmentReference {
    let position = order.iter().position(|&own| own == target);
    let attachment = position.map_or(vk::ATTACHMENT_UNUSED, |index| index as u32);
    vk::AttachmentReference { attachment, layout }
}

/// Holds the main pass's list and rows against what one render pass can be.
///
/// # Errors
/// In a sentence: the pass, the target and the row that cannot be so.
pub fn check(plan: &FramePlan, edges: &Edges) -> gpu::Result<()> {
    let order: Vec<_> = attachments(plan).iter().map(|attachment| attachment.target).collect();
    let declared = declared(plan);
    let stray = edges.of(Carrier::MainPass).find(|edge| {
        let is_inside = |place: Place| declared.iter().any(|&(own, _)| own == place);
        !is_inside(edge.from) && !is_inside(edge.to)
    });
    let refused = match stray {
        Some(Edge { name, from, to, .. }) => Some(format!(
            "the row {name} is a dependency of the main pass, of which neither {from} nor {to} is a subpass"
        )),
        None => refusal(&order, &declared),
    };
    refused.map_or(Ok(()), |sentence| Err(gpu::Error::Misuse(sentence)))
}

/// Why passes that touch these targets cannot be the subpasses of one render pass, if they cannot.
fn refusal(order: &[Target], declared: &[(Place, Vec<Touch>)]) -> Option<String> {
    let mut written: Vec<Target> = Vec::new();
    for (place, touches) in declared {
        for (index, &touch) in touches.iter().enumerate() {
            let target = touch.target();
            if let Touch::Sampled(_) = touch {
                return Some(format!(
                    "{place} samples the neighbours of its pixel in the target {target:?}, which no subpass can: it needs a render pass of its \
                     own"
                ));
            }
            if !order.contains(&target) {
                return Some(format!("{place} touches the target {target:?}, which the plan does not have"));
            }
            for &other in &touches[..index] {
                if other.target() == target && other.layout() != touch.layout() {
                    return Some(format!(
                        "{place} touches the target {target:?} as {other:?} and as {touch:?}, which need two layouts at once"
                    ));
                }
                if let (Touch::Color(own, _), Touch::Color(location, first)) = (touch, other)
                    && own == location
                {
                    return Some(format!("{place} draws into {first:?} and {target:?} at the same location {own}"));
                }
            }
            if !touch.writes() && !written.contains(&target) {
                return Some(format!("{place} reads the target {target:?}, which no subpass before it has written"));
            }
        }
        written.extend(touches.iter().filter(|touch| touch.writes()).map(|touch| touch.target()));
    }
    None
}

#[cfg(test)]
mod tests;
