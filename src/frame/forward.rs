//! One forward frame, from top to bottom: no G-buffer, surfaces are lit while they are rasterized.
//!
//! ```text
//! shadow passes  SHADOW       as in the deferred frame
//! main pass      FORWARD      opaque surfaces, lit as they are drawn; after their depth alone, where there is a pre-pass
//!                TRANSPARENT, COMPOSITE, TONEMAP, and then FXAA, as in the deferred frame
//! ```
//!
//! What the plan leaves out does not exist: its field is `None` and its commands are not recorded.

use ash::vk;

use super::FrameParts;
use super::deferred::clear_values;
use super::render_pass::{PassDescription, Subpasses};
use super::stages::{FxaaStage, ShadowStage, Tail, stamp};
use crate::gpu::{self, Image, RenderPass, Timestamps};
use crate::passes::depth::Depth;
use crate::passes::forward::Forward;
use crate::passes::{Recording, SetLayouts, Slot};
use crate::plan::{FramePlan, World};
use crate::targets::{Framebuffers, Targets};

const INLINE: vk::SubpassContents = vk::SubpassContents::INLINE;

/// The passes of a plan and what they draw into.
pub struct ForwardFrame {
    targets: Targets,
    pass: RenderPass,
    framebuffers: Framebuffers,
    clears: Vec<vk::ClearValue>,
    shadow: Option<ShadowStage>,
    depth: Option<Depth>,
    forward: Forward,
    tail: Tail,
    fxaa: Option<FxaaStage>,
}

impl ForwardFrame {
    /// Makes everything that the plan has, once.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, frame_layout, atlas, scene, world, swapchain } = parts;
        let targets = Targets::new(device, plan)?;
        let pass = PassDescription::main(plan, edges).make(device)?;
        let framebuffers = targets.framebuffers(device, plan, pass.raw, swapchain)?;
        let subpasses = Subpasses::of(plan);
        let slot = |subpass| Slot { render_pass: pass.raw, subpass };

        let shadow = ShadowStage::new(parts)?;
        let lit = slot(subpasses.lighting);
        let depth = match plan.depth_prepass {
            true => Some(Depth::new(device, plan, lit, frame_layout, 1)?),
            false => None,
        };
        let layouts = SetLayouts { frame: frame_layout, shadows: atlas.map(|atlas| atlas.set_layout.raw) };
        let forward = Forward::new(device, plan, lit, layouts, scene)?;
        let tail = Tail::new(device, plan, &pass, layouts, scene, &targets)?;
        let fxaa = FxaaStage::new(parts, &targets)?;
        let clears = clear_values(plan, world);
        Ok(Self { targets, pass, framebuffers, clears, shadow, depth, forward, tail, fxaa })
    }

    /// Makes anew what has the size of the picture: attachments, framebuffers, and the sets that name them.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan)?;
        self.framebuffers = self.targets.framebuffers(device, plan, self.pass.raw, swapchain)?;
        self.tail.resize(device, &self.targets)?;
        match &mut self.fxaa {
            Some(fxaa) => fxaa.resize(parts, &self.targets),
            None => Ok(()),
        }
    }

    /// Takes the world's present exposure for the next frames.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.clears = clear_values(plan, world);
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame, unless it is in an image of the swapchain.
    pub fn output(&self) -> Option<&Image> {
        match &self.fxaa {
            Some(fxaa) => fxaa.picture(),
            None => self.targets.output(),
        }
    }

    /// Records one frame. Dependencies between subpasses are rows of [`super::edges::table`]; the render pass carries them.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);

        if let Some(shadow) = &self.shadow {
            // FORWARD loads what SHADOW wrote: rows of the table, which each of its render passes carries.
            shadow.record(frame, times);
        }

        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass.raw)
            .framebuffer(self.framebuffers.of(frame.image))
            .render_area(frame.area())
            .clear_values(&self.clears);
        // SAFETY: `cmd` is being recorded outside a render pass; pass, framebuffer and clear values were made from one plan,
        // as were the subpasses that follow.
        unsafe { gpu.cmd_begin_render_pass(cmd, &begin, INLINE) };
        frame.device.begin_label(cmd, "FORWARD");
        if let Some(depth) = &self.depth {
            // In the same subpass: rasterization order alone puts it before what it hides.
            depth.record(frame);
        }
        self.forward.record(frame);
        frame.device.end_label(cmd);
        stamp(times, cmd, "forward");
        // TRANSPARENT, COMPOSITE and TONEMAP, each where the plan has it.
        self.tail.record_next_subpasses(frame, times);
        // SAFETY: begun above, and every subpass recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };

        if let Some(fxaa) = &self.fxaa {
            fxaa.record(frame, times);
        }
    }
}
