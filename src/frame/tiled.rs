//! One frame with lighting by compute, from top to bottom. On GPUs whose fragment rate is low this is the fast way.
//!
//! ```text
//! compute        SKIN       as in the deferred frame
//! occluder pass, compute     culling on the device, as in the deferred frame
//! shadow passes  SHADOW     as in the deferred frame
//! main pass      GEOMETRY   surfaces into the G-buffer, which is stored; or which triangle each pixel shows
//! compute        AO, AO_DENOISE  as in the deferred frame
//! compute        TILED      every light on every pixel, tile by tile, into the output
//! copies         PRESENT    the output into an image of the swapchain, where there is one
//! ```

use ash::vk;

use super::FrameParts;
use super::ao::{self, AoStage};
use super::edges::{Edges, RowName};
use super::list::{self, MAIN_PASS, Occasion, SHADOW_PASS, Step};
use super::render_passes::{RenderPassIndex, RenderPasses, background, exposed_background, image_barrier, prepass};
use crate::gpu::{self, Image, Timestamps};
use crate::passes::depth::{self, Depth};
use crate::passes::geometry::{self, Geometry};
use crate::passes::tiled::{self, Background, Tiled};
use crate::passes::tonemap::encode_srgb;
use crate::passes::{Recording, Resource, shadow};
use crate::plan::{FramePlan, OUTPUT_PLAIN, Target};
use crate::visible::World;

/// The passes of a plan and their targets.
pub struct TiledFrame {
    pub(super) passes: RenderPasses,
    main: RenderPassIndex,
    depth: Option<Depth>,
    geometry: Geometry,
    ao: Option<AoStage>,
    tiled: Tiled,
    edges: Edges,
}

/// The passes of the frame in their order. PRESENT is among the steps after the picture ([`list::List::of`]).
pub(super) fn list(plan: &FramePlan) -> Vec<Option<Step>> {
    let output = Resource::Target(Target::Output);
    let shadow = list::subpass(plan, shadow::PASS.place, &[&shadow::PASS]);
    let surfaces = list::subpass(plan, geometry::PASS.place, &[&depth::PASS, &geometry::PASS]);
    let mut steps = vec![super::render_passes::skin_step(plan)];
    steps.extend(super::render_passes::culling_steps(plan));
    steps.extend([list::render_pass(SHADOW_PASS, [shadow]), list::render_pass(MAIN_PASS, [surfaces])]);
    steps.extend(ao::steps(plan));
    steps.push(list::commands(
        plan,
        Occasion::Always,
        &tiled::PASS,
        &[(RowName::OUTPUT_REUSE, output)],
        &[(RowName::READ_BACK, output)],
    ));
    steps
}

impl TiledFrame {
    /// Records one frame. The main pass carries the rows from and to GEOMETRY (`gbuffer-reuse`, `gbuffer-to-tiled`), the output's are
    /// barriers.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (gpu, cmd, passes) = (&frame.device.raw, frame.cmd, &self.passes);

        // SKIN writes deformed vertices for all that draws below: rows `deformed-reuse` and `skin-to-draws`.
        passes.record_skin(frame, times);
        // Occlusion and frustum culling on the device, as in the deferred frame.
        passes.record_hiding(frame, times);
        passes.record_culling(frame, times);
        // A render pass for each stale map. Row `shadow-map-to-lighting`: TILED looks up what it wrote.
        passes.record_shadow(frame, times);

        frame.begin(&geometry::PASS);
        // SAFETY: `cmd` is being recorded outside a render pass; GEOMETRY is its only subpass.
        unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, self.main), vk::SubpassContents::INLINE) };
        if let Some(depth) = &self.depth {
            // In the same subpass: rasterization order alone puts it before what it hides.
            depth.record(frame);
        }
        self.geometry.record(frame);
        // SAFETY: begun above; its one subpass is recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };
        frame.end(times, &geometry::PASS);

        if let Some(ao) = &self.ao {
            // Rows `gbuffer-to-ao` and `occlusion-to-tiled`.
            ao.record(frame, passes, times);
        }

        frame.begin(&tiled::PASS);
        // The last picture may still be copied.
        let output = passes.targets.image(Target::Output);
        image_barrier(frame.device, cmd, output, self.edges.find(RowName::OUTPUT_REUSE));
        self.tiled.record(frame);
        // COPY reads what TILED wrote, and so does PRESENT.
        image_barrier(frame.device, cmd, output, self.edges.find(RowName::READ_BACK));
        frame.end(times, &tiled::PASS);

        // Rows `swapchain-to-present` and `present-to-swapchain`.
        passes.record_present(frame, times);
    }

    /// Makes everything that the plan has, once.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, frame_layout, scene, world, .. } = parts;
        let passes = RenderPasses::new(parts)?;
        let main = passes.find(MAIN_PASS).ok_or_else(|| gpu::Error::Misuse("the frame has no main pass".into()))?;
        let depth = prepass(parts, &passes)?;
        let geometry = Geometry::new(device, plan, passes.needed_slot(&geometry::PASS)?, frame_layout, scene)?;
        let ao = AoStage::new(parts, &passes)?;
        let (stored, output) = (passes.inputs(&tiled::PASS, plan), passes.targets.image(Target::Output).view);
        let tiled =
            Tiled::new(device, plan, parts.layouts(), parts.seen, (&stored, output), written_background(plan, world))?;
        Ok(Self { passes, main, depth, geometry, ao, tiled, edges: edges.clone() })
    }

    /// Makes the objects of the picture's size anew: attachments, framebuffers, and the set that names them.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        self.passes.resize(parts)?;
        if let Some(ao) = &mut self.ao {
            ao.rebind(parts, &self.passes)?;
        }
        let stored = self.passes.inputs(&tiled::PASS, parts.plan);
        self.tiled.rebind(parts.device, &stored, self.passes.targets.image(Target::Output).view)
    }

    /// Re-exposes the background.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.passes.expose(plan, world);
        self.tiled.background = written_background(plan, world);
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame.
    pub fn output(&self, plan: &FramePlan) -> Option<&Image> {
        self.passes.targets.find(plan.picture())
    }
}

/// The background as a shader writes it: an attachment's clear value would be encoded by the hardware.
fn written_background(plan: &FramePlan, world: &World) -> Background {
    let light = background(plan, world, Target::Output);
    let encoded = plan.output == OUTPUT_PLAIN;
    Background {
        of_pixel: if encoded { light.map(|v| encode_srgb(f64::from(v)) as f32) } else { light },
        of_sample: if plan.averages_light() { exposed_background(plan, world) } else { light },
    }
}
