//! Render passes as values: attachments and subpasses from the list of passes ([`super::list`]), dependencies from the rows of [`super::rows`].

use std::fmt;
use std::sync::Arc;

use ash::vk;

use super::list::{RenderPassName, StepList, Subpass as Listed};
use super::rows::{self, Row, Rows, SyncKind};
use crate::gpu::sync::SyncVersion;
use crate::gpu::{self, Device, MergeFeedback, RenderPass, RenderPassParts, SubpassDesc, SubpassOrder};
use crate::passes::{Endpoint, Resource, ResourceUse, UseKind};
use crate::plan::{FramePlan, Target};
use crate::scene::Passes;

/// A render pass as a value. The device's is made from it, and `afterlight_lab::report::graph` draws it.
#[derive(Debug, Clone)]
pub struct PassDescription {
    pub name: RenderPassName,
    /// No Vulkan object exists for it: it is recorded as dynamic rendering ([`super::rendering`]).
    pub is_rendering: bool,
    /// The API by which it is made.
    pub sync: SyncVersion,
    pub attachments: Vec<(Resource, vk::AttachmentDescription)>,
    pub subpasses: Vec<SubpassAttachments>,
    /// Rows of the table, each with the subpasses that it is between.
    pub dependencies: Vec<(Row, [u32; 2])>,
}

/// A layout change of an image, ordered by a dependency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LayoutChange {
    /// Attachment whose layout changes; absent for the image of a barrier.
    pub image: Option<Resource>,
    /// Layout before the row.
    pub old: vk::ImageLayout,
    /// Layout after the row.
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
pub fn layout_changes(plan: &FramePlan, rows: &Rows, row: &Row) -> Vec<LayoutChange> {
    let name = match row.carrier {
        SyncKind::Subpass(name) | SyncKind::Rendering(name) => name,
        SyncKind::ImageBarrier(old, new) => return vec![LayoutChange { image: None, old, new }],
        _ => return Vec::new(),
    };
    let Some(pass) = PassDescription::named(plan, rows, name) else { return Vec::new() };
    let Some(&(_, ends)) = pass.dependencies.iter().find(|(own, _)| own.name == row.name) else { return Vec::new() };
    let rows: Vec<&Row> = pass.dependencies.iter().filter(|(_, own)| *own == ends).map(|(row, _)| row).collect();
    // Of rows that leave a render pass together, each is told with the images that its own passes use.
    let list = StepList::of(plan);
    let uses = |row: &Row, image: Option<Resource>| {
        let touches = list.passes_at(row.to).into_iter().flat_map(|pass| pass.uses(plan));
        touches.into_iter().any(|touch| Some(touch.resource) == image)
    };
    let own = |change: &LayoutChange| {
        let first = rows.iter().find(|row| uses(row, change.image)).or(rows.first());
        first.is_some_and(|other| other.name == row.name)
    };
    let changes = pass.layout_changes().into_iter().filter(|(between, _)| *between == ends).map(|(_, change)| change);
    changes.filter(own).collect()
}

/// The attachments of a subpass; references count them in the order of the pass, and `vk::ATTACHMENT_UNUSED` is a gap.
#[derive(Debug, Clone)]
pub struct SubpassAttachments {
    pub place: Endpoint,
    /// Read by `InputAttachmentIndex`.
    pub input: Vec<vk::AttachmentReference>,
    /// Written by location.
    pub color: Vec<vk::AttachmentReference>,
    /// The attachments into which `color` is resolved after the subpass; empty, or as many.
    pub resolve: Vec<vk::AttachmentReference>,
    /// Tested, and written if its layout allows that.
    pub depth: Option<vk::AttachmentReference>,
    /// Kept through a subpass that does not use them.
    pub preserve: Vec<u32>,
    /// As the passes declare it.
    pub touches: Vec<ResourceUse>,
}

impl SubpassAttachments {
    fn of(listed: &Listed, order: &[Resource]) -> Self {
        let (place, touches) = (listed.place, listed.touches.clone());
        let (input, color, resolve, preserve) = Default::default();
        let mut own = Self { place, input, color, resolve, depth: None, preserve, touches };
        for touch in listed.touches.iter().filter(|touch| touch.is_attachment()) {
            let position = order.iter().position(|&resource| resource == touch.resource);
            let attachment = position.map_or(vk::ATTACHMENT_UNUSED, |index| index as u32);
            let reference = vk::AttachmentReference { attachment, layout: touch.layout() };
            match touch.how {
                UseKind::Color { location, .. } => {
                    let gap = vk::AttachmentReference {
                        attachment: vk::ATTACHMENT_UNUSED,
                        layout: vk::ImageLayout::UNDEFINED,
                    };
                    let location = location as usize;
                    own.color.resize(own.color.len().max(location + 1), gap);
                    own.color[location] = reference;
                }
                UseKind::Depth { .. } => own.depth = Some(reference),
                UseKind::Resolve => own.resolve.push(reference),
                _ => own.input.push(reference),
            }
        }
        own
    }

    /// All references, gaps included.
    pub fn references(&self) -> impl Iterator<Item = &vk::AttachmentReference> {
        self.input.iter().chain(&self.color).chain(&self.resolve).chain(&self.depth)
    }

    fn uses(&self, image: Resource) -> bool {
        self.touches.iter().any(|touch| touch.resource == image && touch.is_attachment())
    }
}

impl PassDescription {
    /// All render passes of a plan's frames in their order.
    pub fn all(plan: &FramePlan, rows: &Rows) -> Vec<Self> {
        let list = StepList::of(plan);
        let of = |(name, subpasses): (RenderPassName, &[Listed])| Self::of(plan, rows, &list, (name, subpasses));
        list.render_passes().map(of).collect()
    }

    /// The one with this name, if the plan has it.
    pub fn named(plan: &FramePlan, rows: &Rows, name: RenderPassName) -> Option<Self> {
        Self::all(plan, rows).into_iter().find(|pass| pass.name == name)
    }

    fn of(plan: &FramePlan, rows: &Rows, list: &StepList, (name, listed): (RenderPassName, &[Listed])) -> Self {
        let attachments: Vec<_> = match name.draws_maps() {
            true => rows::shadow::attachments(plan, list, listed),
            false => {
                let targets = list.attachments(plan, name).into_iter();
                targets.map(|(target, description)| (Resource::Target(target), description)).collect()
            }
        };
        let order: Vec<_> = attachments.iter().map(|&(image, _)| image).collect();
        let mut subpasses: Vec<_> = listed.iter().map(|own| SubpassAttachments::of(own, &order)).collect();
        for index in 0..subpasses.len() {
            // The images that the subpasses before and after it use, and it does not.
            let used = |some: &[SubpassAttachments], image| some.iter().any(|own| own.uses(image));
            let passes_by = |image: Resource| {
                !subpasses[index].uses(image)
                    && used(&subpasses[..index], image)
                    && used(&subpasses[index + 1..], image)
            };
            let preserve = (0..).zip(&order).filter(|&(_, &image)| passes_by(image)).map(|(index, _)| index).collect();
            subpasses[index].preserve = preserve;
        }
        let index = |place| {
            let position = listed.iter().position(|own| own.place == place);
            position.map_or(vk::SUBPASS_EXTERNAL, |index| index as u32)
        };
        let rows = rows.of(SyncKind::of_pass(plan, name));
        let dependencies = rows.map(|row| (row.clone(), [index(row.from), index(row.to)])).collect();
        let is_rendering = plan.passes == Passes::LocalRead;
        Self { name, is_rendering, sync: plan.sync, attachments, subpasses, dependencies }
    }

    /// The targets that it draws into, in its order.
    pub fn targets(&self) -> Vec<Target> {
        let targets = self.attachments.iter().filter_map(|&(resource, _)| match resource {
            Resource::Target(target) => Some(target),
            _ => None,
        });
        targets.collect()
    }

    /// Each automatic layout change of an attachment, with the two uses before and after it: subpasses, or `vk::SUBPASS_EXTERNAL` outside the render
    /// pass.
    pub fn layout_changes(&self) -> Vec<([u32; 2], LayoutChange)> {
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
        self.with_parts(|name, parts| RenderPass::new(device, name, parts))
    }

    /// Asks the driver which of the subpasses it merges. Returns nothing if the driver cannot answer, if there is only one subpass, and if Vulkan has no
    /// object of the render pass.
    ///
    /// # Errors
    /// When the device cannot make it.
    pub fn merge_feedback(&self, device: &Arc<Device>) -> gpu::Result<Option<MergeFeedback>> {
        // PRESENT_SRC belongs to VK_KHR_swapchain, and only windows open a device with it.
        let presents = |own: &vk::AttachmentDescription| own.final_layout == vk::ImageLayout::PRESENT_SRC_KHR;
        let is_shown = self.attachments.iter().any(|(_, own)| presents(own));
        if self.is_rendering || self.subpasses.len() < 2 || is_shown {
            return Ok(None);
        }
        self.with_parts(|name, parts| RenderPass::merge_feedback(device, name, parts))
    }

    fn with_parts<T>(&self, make: impl FnOnce(&str, RenderPassParts<'_>) -> T) -> T {
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
            .map(|(row, between)| SubpassOrder {
                between: *between,
                before: row.before,
                after: row.after,
                by_region: row.by_region,
            })
            .collect();
        let (attachments, subpasses, dependencies) = (&attachments, &subpasses, &dependencies);
        let parts = RenderPassParts { sync: self.sync, attachments, subpasses, dependencies };
        make(&self.name.to_string(), parts)
    }
}
