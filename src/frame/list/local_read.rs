//! Subpasses as parts of one `vkCmdBeginRendering`, whose draws read attachments at their own pixel (VK_KHR_dynamic_rendering_local_read).
//!
//! Rendering has no subpasses: one list of attachments for all of its draws, loads before them and stores after them, and barriers in between that must be by region. So some
//! subpasses of a render pass cannot go on in it.

use std::collections::BTreeSet;

use ash::vk;

use super::{Step, StepList, Subpass};
use crate::passes::{Resource, ResourceUse, UseKind};
use crate::plan::{Capabilities, FramePlan, PlanError, RENDERED_COLORS, Refusal, Target};
use crate::scene::Passes;

/// Returns true if a subpass can continue the rendering of the subpasses in `drawn`.
pub(super) fn goes_on(plan: &FramePlan, subpass: &Subpass, drawn: &[Subpass]) -> bool {
    let all = || drawn.iter().chain([subpass]);
    let reads_all_samples = |touch: &ResourceUse| plan.msaa > 1 && touch.is_attachment() && touch.all_samples;
    // All attachments have one sample count.
    drawn.iter().all(|own| own.samples(plan) == subpass.samples(plan))
        // Samples are resolved at the end.
        && !drawn.iter().flat_map(|own| &own.touches).any(|touch| touch.how == UseKind::Resolve)
        // A barrier inside of rendering must be by region (VUID-vkCmdPipelineBarrier-dependencyFlags-07891), which is one sample.
        && !all().flat_map(|own| &own.touches).any(reads_all_samples)
        && colors(all()).len() <= RENDERED_COLORS as usize
}

/// The colour attachments of subpasses, including attachments that are only read.
fn colors<'a>(subpasses: impl Iterator<Item = &'a Subpass>) -> BTreeSet<Resource> {
    let touches = subpasses.flat_map(|own| &own.touches);
    let is_color = |touch: &&ResourceUse| touch.is_attachment() && !touch.is_depth() && touch.how != UseKind::Resolve;
    touches.filter(is_color).map(|touch| touch.resource).collect()
}

/// Gives each attachment one layout for the whole rendering: the local-read layout if some draw reads it as input, otherwise the attachment layout.
pub(super) fn keep_layouts(plan: &FramePlan, steps: &mut [Step]) {
    for step in steps {
        let Step::RenderPass(_, subpasses) = step else { continue };
        let all: Vec<ResourceUse> =
            subpasses.iter().flat_map(|own| &own.touches).filter(|touch| touch.is_attachment()).copied().collect();
        for touch in subpasses.iter_mut().flat_map(|own| &mut own.touches).filter(|touch| touch.is_attachment()) {
            let of_it = || all.iter().filter(|other| other.resource == touch.resource);
            let is_read = of_it().any(|other| matches!(other.how, UseKind::Input { .. }));
            let written = of_it().find(|other| other.writes()).map(ResourceUse::layout);
            touch.throughout = match is_read {
                true => Some(plan.layouts.of(vk::ImageLayout::RENDERING_LOCAL_READ_KHR)),
                false => written,
            };
        }
    }
}

/// Refuses devices that lack the local reads of a plan's draws: Vulkan 1.4 guarantees it only for single-sampled colour.
///
/// # Errors
/// With the pass and the property that is missing.
pub(in crate::frame) fn check(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    if plan.passes != Passes::LocalRead {
        return Ok(());
    }
    let list = StepList::of(plan);
    let subpasses = list.render_passes().flat_map(|(_, subpasses)| subpasses);
    for (own, touch) in subpasses.flat_map(|own| own.touches.iter().map(move |touch| (own, touch))) {
        let place = own.place;
        let (UseKind::Input { .. }, Resource::Target(target)) = (touch.how, touch.resource) else { continue };
        let refuse = |what: &str, property: &str, instead: &str| {
            let why = format!(
                "{place} reads {what}, and this device cannot read that so ({property} is false): ask for --passes subpasses{instead}"
            );
            Err(Refusal::of("--passes local-read", why))
        };
        if plan.samples_of(target) > 1 && !device.local_read_samples {
            let property = "dynamicRenderingLocalReadMultisampledAttachments";
            return refuse("attachments of several samples", property, ", or for --msaa 1");
        }
        if target == Target::Depth && !device.local_read_depth {
            let property = "dynamicRenderingLocalReadDepthStencilAttachments";
            return refuse("depth", property, ", or for a G-buffer with positions, as --gbuffer float32");
        }
        // All attachments of a rendering have one sample count (VUID-VkRenderingInfo-multisampledRenderToSingleSampled-06857).
        let (read, drawn) = (plan.samples_of(target), own.samples(plan));
        if read != drawn {
            let why = format!(
                "{place} reads attachments of {read} samples a pixel and draws {drawn}, and all attachments of a rendering have as many: ask for --passes subpasses, \
                 or for --msaa 1"
            );
            return Err(Refusal::of("--passes local-read", why));
        }
    }
    Ok(())
}
