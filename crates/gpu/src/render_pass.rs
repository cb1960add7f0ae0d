//! Render passes and framebuffers: `sType`s and counts are filled in, everything else stands at the call.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::owned::Owned;

/// A render pass.
pub type RenderPass = Owned<vk::RenderPass>;

/// The views that a render pass renders into.
pub type Framebuffer = Owned<vk::Framebuffer>;

/// The attachments of one subpass. A reference to `vk::ATTACHMENT_UNUSED` leaves a gap.
#[derive(Clone, Copy, Debug, Default)]
pub struct SubpassDesc<'a> {
    /// Read by `InputAttachmentIndex`.
    pub input: &'a [vk::AttachmentReference],
    /// Written by location.
    pub color: &'a [vk::AttachmentReference],
    /// The resolve targets of `color` after the subpass; empty, or as many.
    pub resolve: &'a [vk::AttachmentReference],
    /// Tested, and written if its layout allows that.
    pub depth: Option<vk::AttachmentReference>,
    /// Kept through a subpass that does not use them.
    pub preserve: &'a [u32],
}

impl RenderPass {
    /// A render pass of these subpasses, all graphics.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more colour attachments in a subpass, or more input attachments, than the device has;
    /// running out of memory.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        attachments: &[vk::AttachmentDescription],
        subpasses: &[SubpassDesc<'_>],
        dependencies: &[vk::SubpassDependency],
    ) -> Result<RenderPass> {
        let limits = &device.physical.limits;
        for (index, subpass) in subpasses.iter().enumerate() {
            let of = format!("attachments of subpass {index} of '{name}'");
            check(format!("the number of color {of}"), subpass.color.len(), limits.max_color_attachments)?;
            let most = limits.max_per_stage_descriptor_input_attachments;
            check(format!("the number of input {of}"), subpass.input.len(), most)?;
        }
        let descriptions: Vec<vk::SubpassDescription<'_>> = subpasses
            .iter()
            .map(|subpass| {
                let description = vk::SubpassDescription::default()
                    .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
                    .input_attachments(subpass.input)
                    .color_attachments(subpass.color)
                    .preserve_attachments(subpass.preserve);
                let description = match subpass.resolve.is_empty() {
                    true => description,
                    false => description.resolve_attachments(subpass.resolve),
                };
                match &subpass.depth {
                    Some(depth) => description.depth_stencil_attachment(depth),
                    None => description,
                }
            })
            .collect();
        let info = vk::RenderPassCreateInfo::default()
            .attachments(attachments)
            .subpasses(&descriptions)
            .dependencies(dependencies);
        // SAFETY: the device is alive, and all that the structures point to lives until the call returns.
        let raw = unsafe { device.raw.create_render_pass(&info, None) }
            .doing("vkCreateRenderPass", || format!("creating the render pass '{name}'"))?;
        // Render passes are compatible if they differ in layouts, loads and stores only; telling apart those that differ there costs little.
        device.reuse.note(raw, (attachments, subpasses, dependencies));
        Ok(Owned::new_from(device, name, raw))
    }
}

fn check(what: String, asked: usize, limit: u32) -> Result<()> {
    if asked <= limit as usize {
        return Ok(());
    }
    Err(Error::TooLarge { what, asked: asked as u64, limit: limit.into() })
}

/// A framebuffer of one layer, with a view for each attachment of `pass`.
///
/// # Errors
/// [`Error::TooLarge`] beyond the device's limits; running out of memory.
pub fn framebuffer(
    device: &Arc<Device>,
    name: &str,
    pass: vk::RenderPass,
    views: &[vk::ImageView],
    extent: vk::Extent2D,
) -> Result<Framebuffer> {
    let limits = &device.physical.limits;
    check(format!("the width of the framebuffer '{name}'"), extent.width as usize, limits.max_framebuffer_width)?;
    check(format!("the height of the framebuffer '{name}'"), extent.height as usize, limits.max_framebuffer_height)?;
    let info = vk::FramebufferCreateInfo::default()
        .render_pass(pass)
        .attachments(views)
        .width(extent.width)
        .height(extent.height)
        .layers(1);
    // SAFETY: the pass and the views are alive (the module's contract).
    let raw = unsafe { device.raw.create_framebuffer(&info, None) }
        .doing("vkCreateFramebuffer", || format!("creating the framebuffer '{name}'"))?;
    Ok(Owned::new_from(device, name, raw))
}
