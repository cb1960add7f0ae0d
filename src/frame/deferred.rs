//! One deferred frame, from top to bottom, as explicit Vulkan. This is the file to read first.
//!
//! ```text
//! shadow passes  SHADOW     depth maps of lights, those in which something has moved
//! main pass      GEOMETRY   surfaces into the G-buffer, in tile memory where there is any
//!                LIGHTING   every light on every pixel; or VIEW, which shows a buffer instead
//!                TRANSPARENT  what shows what lies behind it, over the lit picture
//!                COMPOSITE  only where it was summed up without sorting
//!                TONEMAP    only where something is blended before it
//! FXAA pass      FXAA       smooths edges of the finished picture, where asked for
//! ```
//!
//! What the plan leaves out does not exist: its field is `None` and its commands are not recorded. What other kinds of frame have as well
//! is in [`super::stages`]: SHADOW, and all after LIGHTING.

use ash::vk;
use glam::Vec3;

use super::FrameParts;
use super::edges::{Carrier, Edge};
use super::render_pass::{PassDescription, Subpasses};
use super::stages::{FxaaStage, ShadowStage, Tail, input, stamp};
use crate::gpu::barrier::{self, ImageRange};
use crate::gpu::{self, Device, Image, RenderPass, Timestamps};
use crate::passes::depth::Depth;
use crate::passes::geometry::Geometry;
use crate::passes::lighting::Lighting;
use crate::passes::per_light::PerLight;
use crate::passes::tonemap::tone_map_up_to;
use crate::passes::view::ViewPass;
use crate::passes::{Input, Recording, SetLayouts, Slot};
use crate::plan::{FramePlan, Shading, ToneMapping, World};
use crate::targets::{Framebuffers, Target, Targets, attachments, gbuffer_inputs};

const INLINE: vk::SubpassContents = vk::SubpassContents::INLINE;

/// LIGHTING's place in the frame.
enum Shade {
    /// All that meets every pixel, and then what is added light by light.
    Light(Lighting, Option<Box<PerLight>>),
    View(ViewPass),
}

/// The passes of a plan and what they draw into.
pub struct Deferred {
    targets: Targets,
    pass: RenderPass,
    framebuffers: Framebuffers,
    clears: Vec<vk::ClearValue>,
    shadow: Option<ShadowStage>,
    depth: Option<Depth>,
    geometry: Option<Geometry>,
    shade: Shade,
    tail: Tail,
    fxaa: Option<FxaaStage>,
}

impl Deferred {
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
        let depth = match subpasses.geometry.filter(|_| plan.depth_prepass) {
            Some(subpass) => Some(Depth::new(device, plan, slot(subpass), frame_layout, plan.geometry_locations())?),
            None => None,
        };
        let geometry = match subpasses.geometry {
            Some(subpass) => Some(Geometry::new(device, plan, slot(subpass), frame_layout, scene)?),
            None => None,
        };
        let inputs = inputs(plan, &targets);
        let shadows = atlas.map(|atlas| atlas.set_layout.raw);
        let layouts = SetLayouts { frame: frame_layout, shadows };
        let lighting = slot(subpasses.lighting);
        let shade = match plan.shading {
            Shading::Light { .. } => {
                let added = match plan.adds_lights() {
                    true => Some(Box::new(PerLight::new(device, plan, lighting, layouts, &inputs)?)),
                    false => None,
                };
                Shade::Light(Lighting::new(device, plan, lighting, layouts, &inputs)?, added)
            }
            _ => Shade::View(ViewPass::new(device, plan, lighting, layouts, &inputs)?),
        };
        let tail = Tail::new(device, plan, &pass, layouts, scene, &targets)?;
        let fxaa = FxaaStage::new(parts, &targets)?;
        let clears = clear_values(plan, world);
        Ok(Self { targets, pass, framebuffers, clears, shadow, depth, geometry, shade, tail, fxaa })
    }

    /// Makes anew what has the size of the picture: attachments, framebuffers, and the sets that name them.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan)?;
        self.framebuffers = self.targets.framebuffers(device, plan, self.pass.raw, swapchain)?;
        let inputs = inputs(plan, &self.targets);
        match &mut self.shade {
            Shade::Light(lighting, added) => {
                lighting.read_from(device, &inputs)?;
                if let Some(added) = added {
                    added.read_from(device, &inputs)?;
                }
            }
            Shade::View(view) => view.read_from(device, &inputs)?,
        }
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
            // LIGHTING loads what SHADOW wrote: rows of the table, which each of its render passes carries.
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
        if let Some(geometry) = &self.geometry {
            frame.device.begin_label(cmd, "GEOMETRY");
            if let Some(depth) = &self.depth {
                // In the same subpass: rasterization order alone puts it before what it hides.
                depth.record(frame);
            }
            geometry.record(frame);
            frame.device.end_label(cmd);
            stamp(times, cmd, "geometry");
            // SAFETY: the pass has LIGHTING or VIEW next.
            unsafe { gpu.cmd_next_subpass(cmd, INLINE) };
        }
        match &self.shade {
            Shade::Light(lighting, added) => {
                frame.device.begin_label(cmd, "LIGHTING");
                lighting.record(frame);
                if let Some(added) = added {
                    added.record(frame);
                }
            }
            Shade::View(view) => {
                frame.device.begin_label(cmd, "VIEW");
                view.record(frame);
            }
        }
        frame.device.end_label(cmd);
        stamp(times, cmd, "lighting");
        // TRANSPARENT, COMPOSITE and TONEMAP, each where the plan has it.
        self.tail.record_next_subpasses(frame, times);
        // SAFETY: begun above, and every subpass recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };

        if let Some(fxaa) = &self.fxaa {
            fxaa.record(frame, times);
        }
    }
}

/// What LIGHTING or VIEW reads.
fn inputs(plan: &FramePlan, targets: &Targets) -> Vec<Input> {
    gbuffer_inputs(plan).into_iter().map(|own| input(own, targets)).collect()
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
pub(super) fn clear_values(plan: &FramePlan, world: &World) -> Vec<vk::ClearValue> {
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
