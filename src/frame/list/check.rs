//! The list and the rows held against Vulkan's limits and against each other.

use ash::vk;

use super::{Step, StepList, Subpass};
use crate::frame::rows::Rows;
use crate::gpu;
use crate::passes::{Endpoint, Resource, ResourceUse, UseKind, copy};
use crate::plan::FramePlan;

impl StepList {
    /// Compares the list and the rows with Vulkan's limits.
    ///
    /// # Errors
    /// In a sentence: the pass, the resource and the row that cannot be so.
    pub fn check(&self, plan: &FramePlan, rows: &Rows) -> gpu::Result<()> {
        let refused = self.contradiction(plan).or_else(|| self.stray_row(rows));
        refused.map_or(Ok(()), |sentence| Err(gpu::Error::Misuse(sentence)))
    }

    /// A row of a render pass of which neither place is a subpass, or a row that names a pass which the frame has not.
    fn stray_row(&self, rows: &Rows) -> Option<String> {
        let is_known = |place: &Endpoint| {
            let pass = |step: &Step| matches!(step, Step::Commands(own) if own.pass.name == *place);
            !place.is_pass() || *place == copy::PASS.name || self.find(*place).is_some() || self.0.iter().any(pass)
        };
        rows.iter().find_map(|row| {
            let (name, from, to) = (row.name, row.from, row.to);
            if let Some(pass) = row.carrier.pass() {
                let is_in = |place| self.find(place).is_some_and(|(own, _)| own == pass);
                if !is_in(from) && !is_in(to) {
                    return Some(format!(
                        "the row {name} is a dependency of the {pass}, of which neither {from} nor {to} is a subpass"
                    ));
                }
            }
            let unknown = [from, to].into_iter().find(|place| !is_known(place))?;
            Some(format!("the row {name} names {unknown}, which is no pass of this plan"))
        })
    }

    /// Why passes with these touches cannot be the frame, if they cannot.
    fn contradiction(&self, plan: &FramePlan) -> Option<String> {
        let mut written: Vec<Resource> = Vec::new();
        for step in &self.0 {
            match step {
                Step::RenderPass(name, subpasses) => {
                    let draws = |resource| {
                        let all = subpasses.iter().flat_map(|own| &own.touches);
                        all.into_iter().any(|touch| touch.resource == resource && touch.is_attachment())
                    };
                    for Subpass { place, touches, .. } in subpasses {
                        // ANCHOR: neighbours
                        let neighbour = touches
                            .iter()
                            .find(|touch| matches!(touch.how, UseKind::Sampled { .. }) && draws(touch.resource));
                        if let Some(ResourceUse { resource, .. }) = neighbour {
                            return Some(format!(
                                "{place} samples the neighbours of its pixel in the target {resource}, which the {name} draws as well: no subpass can, so \
                                 that one of the two needs another place in the order, or another way to read"
                            ));
                        }
                        // ANCHOR_END: neighbours
                        if let Some(sentence) = contradiction(plan, *place, touches, &mut written) {
                            return Some(sentence);
                        }
                    }
                }
                Step::Commands(own) => {
                    let touches = own.pass.uses(plan);
                    if let Some(sentence) = contradiction(plan, own.pass.name, &touches, &mut written) {
                        return Some(sentence);
                    }
                }
                Step::Presentation | Step::HandOver(_) => {}
            }
        }
        None
    }
}

/// Finds a touch of a pass that contradicts another touch, the plan, or the resources `written` before.
fn contradiction(
    plan: &FramePlan,
    place: Endpoint,
    touches: &[ResourceUse],
    written: &mut Vec<Resource>,
) -> Option<String> {
    for (index, touch) in touches.iter().enumerate() {
        let resource = touch.resource;
        if let Resource::Target(target) = resource
            && plan.format_of(target).is_none()
        {
            return Some(format!("{place} touches the target {resource}, which the plan does not have"));
        }
        let needed = needed_access(touch.how);
        if !needed.is_empty() && !touch.uses.coarse().access.intersects(needed) {
            return Some(format!(
                "{place} touches {resource} as {:?}, but says of its access {:?}",
                touch.how, touch.uses
            ));
        }
        for other in &touches[..index] {
            if other.resource == resource && other.layout() != touch.layout() {
                return Some(format!(
                    "{place} touches {resource} as {:?} and as {:?}, which need two layouts at once",
                    other.how, touch.how
                ));
            }
            if let (UseKind::Color { location: own, .. }, UseKind::Color { location, .. }) = (touch.how, other.how)
                && own == location
            {
                return Some(format!(
                    "{place} draws into {} and {resource} at the same location {own}",
                    other.resource
                ));
            }
        }
        if matches!(resource, Resource::Target(_)) && !touch.writes() && !written.contains(&resource) {
            return Some(format!("{place} reads the target {resource}, which no pass before it has written"));
        }
    }
    written.extend(touches.iter().filter(|touch| touch.writes()).map(|touch| touch.resource));
    None
}

/// Accesses of which a touch of this kind must have at least one; none where it depends.
fn needed_access(how: UseKind) -> vk::AccessFlags2 {
    match how {
        UseKind::Input { .. } => vk::AccessFlags2::INPUT_ATTACHMENT_READ,
        UseKind::Color { .. } | UseKind::Resolve => vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
        UseKind::Depth { .. } => {
            vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE
        }
        UseKind::Sampled { .. } => vk::AccessFlags2::SHADER_READ,
        UseKind::Storage { .. } => vk::AccessFlags2::SHADER_WRITE,
        UseKind::CopiedFrom => vk::AccessFlags2::TRANSFER_READ,
        UseKind::CopiedTo => vk::AccessFlags2::TRANSFER_WRITE,
        UseKind::Presented | UseKind::Buffer => vk::AccessFlags2::empty(),
    }
}
