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
use super::edges::{Edges, RowName};
use super::main_pass::{MainPass, background, image_barrier, input, prepass};
use crate::gpu::barrier::ImageRange;
use crate::gpu::{self, Image, Timestamps};
use crate::passes::depth::Depth;
use crate::passes::geometry::Geometry;
use crate::passes::tiled::{EMISSIVE, Stored, Tiled};
use crate::passes::tonemap::encode_srgb;
use crate::passes::{Recording, present};
use crate::plan::{FramePlan, OUTPUT_PLAIN, World};
use crate::targets::{Target, Targets, stored_inputs};

/// The passes of a plan and what they draw into.
pub struct TiledFrame {
    main: MainPass,
    depth: Option<Depth>,
    geometry: Geometry,
    tiled: Tiled,
    edges: Edges,
}

impl TiledFrame {
    /// Records one frame. The main pass carries the rows from and to GEOMETRY (`gbuffer-reuse`, `gbuffer-to-tiled`), the output's are
    /// barriers.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);

        // A render pass for each stale map. Row `shadow-map-to-lighting`: TILED looks up what it wrote.
        self.main.record_shadow(frame, times);

        frame.begin("GEOMETRY");
        // SAFETY: `cmd` is being recorded outside a render pass; pass, framebuffer and clear values were made from one plan.
        unsafe { gpu.cmd_begin_render_pass(cmd, &self.main.begin(frame), vk::SubpassContents::INLINE) };
        if let Some(depth) = &self.depth {
            // In the same subpass: rasterization order alone puts it before what it hides.
            depth.record(frame);
        }
        self.geometry.record(frame);
        // SAFETY: begun above; its one subpass is recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };
        frame.end(times, "geometry");

        frame.begin("TILED");
        // The last picture may still be copied.
        let output = self.main.targets.image(Target::Output);
        image_barrier(frame.device, cmd, output, self.edges.find(RowName::OutputReuse));
        self.tiled.record(frame);
        // COPY reads what TILED wrote, and so does PRESENT.
        image_barrier(frame.device, cmd, output, self.edges.find(RowName::ReadBack));
        frame.end(times, "lighting");

        if let (Some(begin), Some(image)) = (self.edges.find(RowName::SwapchainToPresent), frame.swapchain_image) {
            frame.begin("PRESENT");
            let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
            image_barrier(frame.device, cmd, whole, Some(begin));
            present::record(frame.device, cmd, output, image);
            image_barrier(frame.device, cmd, whole, self.edges.find(RowName::PresentToSwapchain));
            frame.end(times, "present");
        }
    }

    /// Makes everything that the plan has, once.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, frame_layout, scene, world, .. } = parts;
        let main = MainPass::new(parts)?;
        let depth = prepass(parts, main.slot(0))?;
        let geometry = Geometry::new(device, plan, main.slot(0), frame_layout, scene)?;
        let (stored, output) = bound(plan, &main.targets);
        let background = written_background(plan, world);
        let tiled = Tiled::new(device, plan, parts.layouts(), (&stored, output), background)?;
        Ok(Self { main, depth, geometry, tiled, edges: edges.clone() })
    }

    /// Makes anew what has the size of the picture: attachments, framebuffers, and the set that names them.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        self.main.resize(parts)?;
        let (stored, output) = bound(parts.plan, &self.main.targets);
        self.tiled.rebind(parts.device, &stored, output)
    }

    /// Re-exposes the background.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.main.expose(plan, world);
        self.tiled.background = written_background(plan, world);
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame.
    pub fn output(&self) -> Option<&Image> {
        self.main.targets.output()
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
