//! Stages that several kinds of frame share: the shadow maps before the main pass, and all that comes after the first light.
//!
//! ```text
//! shadow passes  SHADOW       before the main pass of every frame
//! main pass      TRANSPARENT, COMPOSITE, TONEMAP: its last subpasses, in this order
//! FXAA pass      FXAA         after it
//! ```
//!
//! What the plan leaves out is `None` and records nothing.

use std::sync::Arc;

use ash::vk;

use super::FrameParts;
use super::render_pass::{PassDescription, Subpasses, input_layout};
use crate::gpu::{self, Device, Image, RenderPass, Timestamps};
use crate::gpu_scene::GpuScene;
use crate::passes::composite::Composite;
use crate::passes::fxaa::Fxaa;
use crate::passes::shadow::Shadow;
use crate::passes::tonemap::TonemapPass;
use crate::passes::transparent::Transparent;
use crate::passes::{Input, Recording, SetLayouts, Slot};
use crate::plan::FramePlan;
use crate::targets::{COMPOSITE_INPUTS, Target, Targets};

/// SHADOW: a render pass for each map that is drawn anew.
pub struct ShadowStage {
    _pass: RenderPass,
    shadow: Shadow,
}

impl ShadowStage {
    /// `None` where the plan has no shadow maps.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, atlas, scene, world, .. } = parts;
        let (Some(shadow_plan), Some(atlas)) = (&plan.shadow, atlas) else {
            return Ok(None);
        };
        let pass = PassDescription::shadow(plan, edges).make(device)?;
        let slot = Slot { render_pass: pass.raw, subpass: 0 };
        let shadow = Shadow::new(device, shadow_plan, atlas, slot, scene, world)?;
        Ok(Some(Self { _pass: pass, shadow }))
    }

    /// Records the stale maps, outside a render pass. What shades loads what this wrote: rows of the table, which each of
    /// its render passes carries.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        frame.device.begin_label(frame.cmd, "SHADOW");
        self.shadow.record(frame);
        frame.device.end_label(frame.cmd);
        stamp(times, frame.cmd, "shadow");
    }
}

/// The subpasses of the main pass after opaque surfaces are lit, each where the plan has it.
pub struct Tail {
    transparent: Option<Transparent>,
    composite: Option<Composite>,
    tonemap: Option<TonemapPass>,
}

impl Tail {
    /// # Errors
    /// When a pipeline cannot be made.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        pass: &RenderPass,
        layouts: SetLayouts,
        scene: &GpuScene,
        targets: &Targets,
    ) -> gpu::Result<Self> {
        let subpasses = Subpasses::of(plan);
        let slot = |subpass| Slot { render_pass: pass.raw, subpass };
        let input = |own| input(own, targets);
        let transparent = match subpasses.transparent {
            Some(subpass) => Some(Transparent::new(device, plan, slot(subpass), layouts, scene)?),
            None => None,
        };
        let composite = match subpasses.composite {
            Some(subpass) => Some(Composite::new(device, plan, slot(subpass), &COMPOSITE_INPUTS.map(input))?),
            None => None,
        };
        let tonemap = match subpasses.tonemap {
            Some(subpass) => Some(TonemapPass::new(device, plan, slot(subpass), input((0, Target::Hdr)))?),
            None => None,
        };
        Ok(Self { transparent, composite, tonemap })
    }

    /// Reads other images, as of another size.
    ///
    /// # Errors
    /// When there is no memory for their descriptors.
    pub fn resize(&mut self, device: &Arc<Device>, targets: &Targets) -> gpu::Result<()> {
        if let Some(composite) = &mut self.composite {
            composite.read_from(device, &COMPOSITE_INPUTS.map(|own| input(own, targets)))?;
        }
        match &mut self.tonemap {
            Some(tonemap) => tonemap.read_from(device, input((0, Target::Hdr), targets)),
            None => Ok(()),
        }
    }

    /// Steps through the subpasses after the one that is being recorded, up to the last of the pass. Each waits for what it
    /// needs by a row of [`super::edges::table`], which the render pass carries.
    pub fn record_next_subpasses(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        if let Some(transparent) = &self.transparent {
            next_subpass(frame, "TRANSPARENT");
            transparent.record(frame);
            end_subpass(frame, times, "transparent");
        }
        if let Some(composite) = &self.composite {
            next_subpass(frame, "COMPOSITE");
            composite.record(frame);
            end_subpass(frame, times, "composite");
        }
        if let Some(tonemap) = &self.tonemap {
            next_subpass(frame, "TONEMAP");
            tonemap.record(frame);
            end_subpass(frame, times, "tonemap");
        }
    }
}

fn next_subpass(frame: &Recording, label: &str) {
    // SAFETY: the main pass is being recorded, and made from the plan that says that this subpass is next.
    unsafe { frame.device.raw.cmd_next_subpass(frame.cmd, vk::SubpassContents::INLINE) };
    frame.device.begin_label(frame.cmd, label);
}

fn end_subpass(frame: &Recording, times: &mut Option<Timestamps>, label: &str) {
    frame.device.end_label(frame.cmd);
    stamp(times, frame.cmd, label);
}

/// FXAA: a pass of its own, because it reads each pixel's neighbours.
pub struct FxaaStage {
    _pass: RenderPass,
    fxaa: Fxaa,
}

impl FxaaStage {
    /// `None` where the plan has none. It reads the main pass's output.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts, targets: &Targets) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, swapchain, .. } = parts;
        if !plan.fxaa {
            return Ok(None);
        }
        let pass = PassDescription::fxaa(plan, edges).make(device)?;
        let slot = Slot { render_pass: pass.raw, subpass: 0 };
        let fxaa = Fxaa::new(device, plan, slot, targets.image(Target::Output).view, swapchain)?;
        Ok(Some(Self { _pass: pass, fxaa }))
    }

    /// What it draws, in TRANSFER_SRC_OPTIMAL after the frame, unless it is in an image of the swapchain.
    pub fn picture(&self) -> Option<&Image> {
        self.fxaa.picture()
    }

    /// Samples and draws images of another size.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts, targets: &Targets) -> gpu::Result<()> {
        self.fxaa.resize(parts.device, parts.plan, targets.image(Target::Output).view, parts.swapchain)
    }

    /// Records the pass, after the main one.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        frame.device.begin_label(frame.cmd, "FXAA");
        self.fxaa.record(frame);
        frame.device.end_label(frame.cmd);
        stamp(times, frame.cmd, "fxaa");
    }
}

/// What a subpass reads at a binding.
pub(super) fn input((binding, target): (u32, Target), targets: &Targets) -> Input {
    (binding, targets.image(target).view, input_layout(target))
}

/// The time when all that was recorded so far is done.
pub(super) fn stamp(times: &mut Option<Timestamps>, cmd: vk::CommandBuffer, label: &str) {
    if let Some(times) = times {
        times.write(cmd, vk::PipelineStageFlags::BOTTOM_OF_PIPE, label);
    }
}
