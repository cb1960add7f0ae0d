//! One frame with lighting by compute, from top to bottom. On GPUs whose fragment rate is low this is the fast way.
//!
//! ```text
//! shadow passes  SHADOW     as in the deferred frame
//! main pass      GEOMETRY   surfaces into the G-buffer, which is stored
//! compute        TILED      every light on every pixel, tile by tile, into the output
//! copies         PRESENT    the output into an image of the swapchain, where there is one
//! ```

use ash::vk;
use glam::Vec3;

use super::FrameParts;
use super::deferred::{background, clear_values, image_barrier};
use super::edges::{Edges, RowName};
use super::render_pass::PassDescription;
use super::stages::{ShadowStage, input, stamp};
use crate::gpu::barrier::ImageRange;
use crate::gpu::{self, Image, RenderPass, Timestamps};
use crate::passes::depth::Depth;
use crate::passes::geometry::Geometry;
use crate::passes::tiled::{EMISSIVE, Stored, Tiled};
use crate::passes::tonemap::encode_srgb;
use crate::passes::{Recording, SetLayouts, Slot, present};
use crate::plan::{FramePlan, OUTPUT_PLAIN, World};
use crate::targets::{Framebuffers, Target, Targets, stored_inputs};

/// The passes of a plan and what they draw into.
pub struct TiledFrame {
    targets: Targets,
    pass: RenderPass,
    framebuffers: Framebuffers,
    clears: Vec<vk::ClearValue>,
    shadow: Option<ShadowStage>,
    depth: Option<Depth>,
    geometry: Geometry,
    tiled: Tiled,
    edges: Edges,
}

impl TiledFrame {
    /// Makes everything that the plan has, once.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, frame_layout, atlas, scene, world, swapchain } = parts;
        let targets = Targets::new(device, plan)?;
        let pass = PassDescription::main(plan, edges).make(device)?;
        let framebuffers = targets.framebuffers(device, plan, pass.raw, swapchain)?;
        let shadow = ShadowStage::new(parts)?;
        let slot = Slot { render_pass: pass.raw, subpass: 0 };
        let depth = match plan.depth_prepass {
            true => Some(Depth::new(device, plan, slot, frame_layout, plan.geometry_locations())?),
            false => None,
        };
        let geometry = Geometry::new(device, plan, slot, frame_layout, scene)?;
        let (stored, output) = bound(plan, &targets);
        let layouts = SetLayouts { frame: frame_layout, shadows: atlas.map(|atlas| atlas.set_layout.raw) };
        let tiled = Tiled::new(device, plan, layouts, (&stored, output), written_background(plan, world))?;
        let clears = clear_values(plan, world);
        let edges = edges.clone();
        Ok(Self { targets, pass, framebuffers, clears, shadow, depth, geometry, tiled, edges })
    }

    /// Makes anew what has the size of the picture: attachments, framebuffers, and the set that names them.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan)?;
        self.framebuffers = self.targets.framebuffers(device, plan, self.pass.raw, swapchain)?;
        let (stored, output) = bound(plan, &self.targets);
        self.tiled.rebind(device, &stored, output)
    }

    /// Takes the world's present exposure for the next frames.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.clears = clear_values(plan, world);
        self.tiled.background = written_background(plan, world);
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame.
    pub fn output(&self) -> Option<&Image> {
        self.targets.output()
    }

    /// Records one frame. The main pass carries the rows from and to GEOMETRY, the output's are barriers.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);

        if let Some(shadow) = &self.shadow {
            // TILED loads what SHADOW wrote: rows of the table, which each of its render passes carries.
            shadow.record(frame, times);
        }

        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass.raw)
            .framebuffer(self.framebuffers.of(frame.image))
            .render_area(frame.area())
            .clear_values(&self.clears);
        frame.device.begin_label(cmd, "GEOMETRY");
        // SAFETY: `cmd` is being recorded outside a render pass; pass, framebuffer and clear values were made from one plan.
        unsafe { gpu.cmd_begin_render_pass(cmd, &begin, vk::SubpassContents::INLINE) };
        if let Some(depth) = &self.depth {
            // In the same subpass: rasterization order alone puts it before what it hides.
            depth.record(frame);
        }
        self.geometry.record(frame);
        // SAFETY: begun above; its one subpass is recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };
        frame.device.end_label(cmd);
        stamp(times, cmd, "geometry");

        frame.device.begin_label(cmd, "TILED");
        // The last picture may still be copied.
        let output = self.targets.image(Target::Output);
        image_barrier(frame.device, cmd, output, self.edges.find(RowName::OutputReuse));
        self.tiled.record(frame);
        // COPY reads what TILED wrote, and so does PRESENT.
        image_barrier(frame.device, cmd, output, self.edges.find(RowName::ReadBack));
        frame.device.end_label(cmd);
        stamp(times, cmd, "lighting");

        if let (Some(begin), Some(image)) = (self.edges.find(RowName::SwapchainToPresent), frame.swapchain_image) {
            frame.device.begin_label(cmd, "PRESENT");
            let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
            image_barrier(frame.device, cmd, whole, Some(begin));
            present::record(frame.device, cmd, output, image);
            image_barrier(frame.device, cmd, whole, self.edges.find(RowName::PresentToSwapchain));
            frame.device.end_label(cmd);
            stamp(times, cmd, "present");
        }
    }
}

/// What TILED reads and writes.
fn bound(plan: &FramePlan, targets: &Targets) -> (Vec<Stored>, vk::ImageView) {
    let emitted = plan.emissive.then_some((EMISSIVE, Target::Hdr));
    let stored = stored_inputs(plan).into_iter().chain(emitted).map(|own| input(own, targets)).collect();
    (stored, targets.image(Target::Output).view)
}

/// The background as a shader writes it: an attachment's clear value would be encoded by the hardware.
fn written_background(plan: &FramePlan, world: &World) -> Vec3 {
    let light = background(plan, world, Target::Output);
    if plan.output == OUTPUT_PLAIN { light.map(|v| encode_srgb(f64::from(v)) as f32) } else { light }
}
