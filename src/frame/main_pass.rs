//! What every kind of frame has: the main render pass with its targets, and the shadow maps' passes before it.

use ash::vk;
use glam::Vec3;

use super::FrameParts;
use super::edges::{Carrier, Edge};
use super::render_pass::{self, PassDescription};
use crate::gpu::barrier::{self, ImageRange};
use crate::gpu::{self, Device, RenderPass, Timestamps};
use crate::passes::depth::Depth;
use crate::passes::shadow::Shadow;
use crate::passes::tonemap::tone_map_up_to;
use crate::passes::{Input, Recording, Slot};
use crate::plan::{FramePlan, Shading, ToneMapping, World};
use crate::targets::{Framebuffers, Target, Targets, Touch, attachments};

/// The main render pass, what it draws into, and SHADOW before it.
pub struct MainPass {
    pub targets: Targets,
    pass: RenderPass,
    framebuffers: Framebuffers,
    clears: Vec<vk::ClearValue>,
    shadow: Option<ShadowStage>,
}

/// SHADOW with its render pass, of which each map that is drawn anew has an instance.
struct ShadowStage {
    _pass: RenderPass,
    shadow: Shadow,
}

impl MainPass {
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline, or the plan's passes cannot be one render pass.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, atlas, scene, world, swapchain, .. } = parts;
        render_pass::check(plan, edges)?;
        let targets = Targets::new(device, plan)?;
        let pass = PassDescription::main(plan, edges).make(device)?;
        let framebuffers = targets.framebuffers(device, plan, pass.raw, swapchain)?;
        let shadow = match (&plan.shadow, atlas) {
            (Some(shadow_plan), Some(atlas)) => {
                let pass = PassDescription::shadow(plan, edges).make(device)?;
                let slot = Slot { render_pass: pass.raw, subpass: 0 };
                let shadow = Shadow::new(device, shadow_plan, atlas, slot, scene, world)?;
                Some(ShadowStage { _pass: pass, shadow })
            }
            _ => None,
        };
        Ok(Self { targets, pass, framebuffers, clears: clear_values(plan, world), shadow })
    }

    /// Makes the attachments and framebuffers anew, which have the size of the picture.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan)?;
        self.framebuffers = self.targets.framebuffers(device, plan, self.pass.raw, swapchain)?;
        Ok(())
    }

    /// Re-exposes the background's clear colours.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.clears = clear_values(plan, world);
    }

    /// Where the pipelines of a subpass belong.
    pub fn slot(&self, subpass: u32) -> Slot {
        Slot { render_pass: self.pass.raw, subpass }
    }

    /// How the pass begins in this frame.
    pub fn begin(&self, frame: &Recording) -> vk::RenderPassBeginInfo<'_> {
        vk::RenderPassBeginInfo::default()
            .render_pass(self.pass.raw)
            .framebuffer(self.framebuffers.of(frame.image))
            .render_area(frame.area())
            .clear_values(&self.clears)
    }

    /// Records the stale shadow maps, outside a render pass, where the plan has maps.
    pub fn record_shadow(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        if let Some(ShadowStage { shadow, .. }) = &self.shadow {
            frame.begin("SHADOW");
            shadow.record(frame);
            frame.end(times, "shadow");
        }
    }
}

/// The depth pre-pass, where the plan has one; `slot` is that of the subpass that shades or stores surfaces.
///
/// # Errors
/// When the device cannot compile a pipeline.
pub(super) fn prepass(parts: &FrameParts, slot: Slot) -> gpu::Result<Option<Depth>> {
    let &FrameParts { device, plan, frame_layout, .. } = parts;
    if !plan.depth_prepass {
        return Ok(None);
    }
    // FORWARD writes light alone.
    let locations = if plan.is_forward() { 1 } else { plan.geometry_locations() };
    Ok(Some(Depth::new(device, plan, slot, frame_layout, locations)?))
}

/// What a subpass reads at a binding.
pub(super) fn input((binding, target): (u32, Target), targets: &Targets) -> Input {
    (binding, targets.image(target).view, Touch::Input(target).layout())
}

/// Carries out a row that is a pipeline barrier on an image, where the plan has it.
pub(super) fn image_barrier(device: &Device, cmd: vk::CommandBuffer, image: impl Into<ImageRange>, row: Option<&Edge>) {
    if let Some(edge) = row
        && let Carrier::ImageBarrier(old, new) = edge.carrier
    {
        barrier::image_barrier(device, cmd, image, edge.order(), [old, new]);
    }
}

/// Clear values in framebuffer order.
fn clear_values(plan: &FramePlan, world: &World) -> Vec<vk::ClearValue> {
    let color = |color: Vec3| vk::ClearValue { color: vk::ClearColorValue { float32: color.extend(1.0).to_array() } };
    attachments(plan)
        .iter()
        .map(|attachment| match attachment.target {
            // Reversed Z: infinity.
            Target::Depth => vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } },
            // Alpha of the sums is 1: no surface has covered anything yet.
            Target::Hdr | Target::Samples | Target::Output => color(background(plan, world, attachment.target)),
            _ => color(Vec3::ZERO),
        })
        .collect()
}

/// What a target holds where nothing is drawn.
pub(super) fn background(plan: &FramePlan, world: &World, target: Target) -> Vec3 {
    if !matches!(plan.shading, Shading::Light { light_only: false }) {
        return Vec3::ZERO;
    }
    // As in the shaders: cut off before it is stored or mapped, so that nothing overflows on the way.
    let exposed = (world.environment.background * world.exposure).min(Vec3::splat(plan.largest_light()));
    match plan.tone_mapping {
        ToneMapping::InLighting(curve) => tone_map_up_to(plan.headroom(), exposed, curve),
        ToneMapping::Subpass(_) | ToneMapping::Kept if target == Target::Output => Vec3::ZERO,
        _ => exposed,
    }
}
