//! The render passes of a plan: attachments, subpasses, and the rows of [`super::edges`] as dependencies.

use std::fmt;
use std::sync::Arc;

use ash::vk;

use super::edges::{self, Carrier, Edge, Edges, Place};
use crate::gpu::sync::Use;
use crate::gpu::{self, Device, RenderPass, SubpassDesc};
use crate::passes::{fxaa, shadow};
use crate::plan::{FramePlan, Shading};
use crate::scene::Transparency;
use crate::targets::{Attachment, COMPOSITE_INPUTS, Target, attachments, gbuffer_inputs, light_target, samples_of};

/// Resolves samples into the output after the subpass that is the last to write them: reads them, and as their last user drops them.
pub const RESOLVE: Use = Use::new(
    vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags::from_raw(
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE.as_raw() | vk::AccessFlags::COLOR_ATTACHMENT_READ.as_raw(),
    ),
);

/// Indices of the main pass's subpasses; which exist depends on the plan.
#[derive(Debug, Clone, Copy)]
pub struct Subpasses {
    pub geometry: Option<u32>,
    /// Or FORWARD, in a frame without a G-buffer.
    pub lighting: u32,
    pub transparent: Option<u32>,
    pub composite: Option<u32>,
    pub tonemap: Option<u32>,
}

impl Subpasses {
    /// Of a tiled plan only GEOMETRY is a subpass.
    pub fn of(plan: &FramePlan) -> Self {
        let geometry = (plan.has_geometry() && !plan.is_forward()).then_some(0);
        let lighting = u32::from(geometry.is_some());
        let mut last = lighting;
        let mut next = |present: bool| {
            last += u32::from(present);
            present.then_some(last)
        };
        let transparent = next(plan.transparency.is_some());
        let composite = next(plan.transparency == Some(Transparency::Oit));
        Self { geometry, lighting, transparent, composite, tonemap: next(plan.has_tonemap_subpass()) }
    }

    fn index(&self, place: Place) -> u32 {
        match place {
            Place::Geometry => self.geometry.unwrap_or(0),
            Place::Lighting | Place::Forward => self.lighting,
            Place::Transparent => self.transparent.unwrap_or(self.lighting),
            Place::Composite => self.composite.unwrap_or(self.lighting),
            Place::Tonemap => self.tonemap.unwrap_or(self.lighting),
            // The passes of these have one subpass.
            Place::Shadow | Place::Fxaa => 0,
            _ => vk::SUBPASS_EXTERNAL,
        }
    }
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

/// The main pass's subpasses, in the order of [`Subpasses`].
fn main_subpasses(plan: &FramePlan) -> Vec<Subpass> {
    let refs = References::of(plan);
    let depth = |layout| Some(refs.reference(Target::Depth, layout));
    // Tested, and in GEOMETRY and FORWARD written; by LIGHTING read as an input at once.
    let written = || depth(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
    let tested = || depth(vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL);
    let mut subpasses = Vec::new();
    if plan.is_forward() {
        subpasses.push(Subpass { color: refs.lighting_color.clone(), depth: written(), ..Subpass::at(Place::Forward) });
    } else if plan.has_geometry() {
        subpasses.push(Subpass {
            color: refs.geometry_color.clone(),
            depth: written(),
            ..Subpass::at(Place::Geometry)
        });
    }
    if !plan.is_tiled() && !plan.is_forward() {
        subpasses.push(Subpass {
            input: refs.lighting_input.clone(),
            color: refs.lighting_color.clone(),
            depth: plan.lighting_tests_depth().then(tested).flatten(),
            ..Subpass::at(Place::Lighting)
        });
    }
    if plan.transparency.is_some() {
        subpasses.push(Subpass {
            color: refs.transparent_color.clone(),
            depth: tested(),
            preserve: refs.transparent_preserve.clone(),
            ..Subpass::at(Place::Transparent)
        });
    }
    if plan.transparency == Some(Transparency::Oit) {
        subpasses.push(Subpass {
            input: refs.composite_input.clone(),
            color: refs.lighting_color.clone(),
            ..Subpass::at(Place::Composite)
        });
    }
    if plan.has_tonemap_subpass() {
        subpasses.push(Subpass {
            input: refs.tonemap_input.clone(),
            color: refs.tonemap_color.clone(),
            ..Subpass::at(Place::Tonemap)
        });
    }
    // After the subpass that is the last to write the samples.
    let last = edges::resolving(plan);
    for subpass in subpasses.iter_mut().filter(|subpass| last == Some(subpass.place)) {
        subpass.resolve.clone_from(&refs.resolve);
    }
    subpasses
}

fn dependencies(plan: &FramePlan, edges: &Edges, carrier: Carrier) -> Vec<(Edge, [u32; 2])> {
    let subpasses = Subpasses::of(plan);
    let index = |place| match (carrier, place) {
        // Seen from the main pass, FXAA is outside.
        (Carrier::MainPass, Place::Fxaa) => vk::SUBPASS_EXTERNAL,
        // The shadow pass has one subpass, and all else is outside.
        (Carrier::ShadowPass, place) if place != Place::Shadow => vk::SUBPASS_EXTERNAL,
        _ => subpasses.index(place),
    };
    edges.of(carrier).map(|edge| (edge.clone(), [index(edge.from), index(edge.to)])).collect()
}

/// Attachment references of each subpass.
struct References {
    order: Vec<Target>,
    geometry_color: Vec<vk::AttachmentReference>,
    lighting_input: Vec<vk::AttachmentReference>,
    /// COMPOSITE's too.
    lighting_color: Vec<vk::AttachmentReference>,
    transparent_color: Vec<vk::AttachmentReference>,
    transparent_preserve: Vec<u32>,
    composite_input: Vec<vk::AttachmentReference>,
    resolve: Vec<vk::AttachmentReference>,
    tonemap_input: Vec<vk::AttachmentReference>,
    tonemap_color: Vec<vk::AttachmentReference>,
}

impl References {
    fn of(plan: &FramePlan) -> Self {
        let order = attachments(plan).iter().map(|attachment| attachment.target).collect();
        let mut refs = Self {
            order,
            geometry_color: Vec::new(),
            lighting_input: Vec::new(),
            lighting_color: Vec::new(),
            transparent_color: Vec::new(),
            transparent_preserve: Vec::new(),
            composite_input: Vec::new(),
            resolve: Vec::new(),
            tonemap_input: Vec::new(),
            tonemap_color: Vec::new(),
        };
        let color = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        refs.geometry_color = geometry_targets(plan)
            .into_iter()
            .map(|target| match target {
                Some(target) => refs.reference(target, color),
                None => {
                    vk::AttachmentReference { attachment: vk::ATTACHMENT_UNUSED, layout: vk::ImageLayout::UNDEFINED }
                }
            })
            .collect();
        refs.lighting_input =
            gbuffer_inputs(plan).into_iter().map(|(_, target)| refs.reference(target, input_layout(target))).collect();
        refs.lighting_color = vec![refs.reference(light_target(plan), color)];
        if plan.resolves_output() {
            refs.resolve = vec![refs.reference(Target::Output, color)];
        }
        match plan.transparency {
            Some(Transparency::Sorted) => refs.transparent_color = refs.lighting_color.clone(),
            Some(Transparency::Oit) => {
                refs.transparent_color = COMPOSITE_INPUTS.map(|(_, target)| refs.reference(target, color)).to_vec();
                refs.composite_input = COMPOSITE_INPUTS.map(|(_, target)| refs.reference(target, read)).to_vec();
                // LIGHTING has written it, COMPOSITE blends over it.
                refs.transparent_preserve = refs.lighting_color.iter().map(|light| light.attachment).collect();
            }
            None => {}
        }
        if plan.has_tonemap_subpass() {
            refs.tonemap_input = vec![refs.reference(Target::Hdr, read)];
            refs.tonemap_color = vec![refs.reference(Target::Output, color)];
        }
        refs
    }

    fn reference(&self, target: Target, layout: vk::ImageLayout) -> vk::AttachmentReference {
        let position = self.order.iter().position(|&own| own == target);
        let attachment = position.map_or(vk::ATTACHMENT_UNUSED, |index| index as u32);
        vk::AttachmentReference { attachment, layout }
    }
}

/// The layout in which a subpass reads a target as an input.
pub fn input_layout(target: Target) -> vk::ImageLayout {
    match target {
        Target::Depth => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        _ => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    }
}

/// GEOMETRY's targets by location (`shaders/geometry.wgsl`); a gap where the plan lacks one.
fn geometry_targets(plan: &FramePlan) -> Vec<Option<Target>> {
    if plan.shading == Shading::ShowOverdraw {
        return vec![Some(Target::Count)];
    }
    if plan.shading == Shading::ShowTriangle {
        return vec![Some(Target::Triangle)];
    }
    let Some(gbuffer) = &plan.gbuffer else { return Vec::new() };
    let all = [
        Some(Target::Albedo),
        Some(Target::Normal),
        gbuffer.material.map(|_| Target::Material),
        plan.emissive.then(|| light_target(plan)),
        gbuffer.specular.map(|_| Target::Specular),
        gbuffer.position.map(|_| Target::Position),
    ];
    all[..plan.geometry_locations() as usize].to_vec()
}

#[cfg(test)]
mod tests;
