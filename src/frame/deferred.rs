//! One frame that is rasterized, from top to bottom, as explicit Vulkan. This is the file to read first, and [`Deferred::record`] is its
//! outline.
//!
//! ```text
//! shadow passes  SHADOW     depth maps of lights, those in which something has moved
//! main pass      GEOMETRY   surfaces into the G-buffer, in tile memory where there is any
//!                LIGHTING   every light on every pixel; or VIEW, which shows a buffer instead
//!                FORWARD    in the place of these two on the forward light paths: surfaces, lit as they are rasterized
//!                TRANSPARENT  surfaces that let light through, over the lit picture
//!                COMPOSITE  only where TRANSPARENT summed them up without sorting
//!                TONEMAP    only where something is blended before it
//! FXAA pass      FXAA       smooths edges of the finished picture, where asked for
//! ```
//!
//! What the plan leaves out does not exist: its field is `None` and its commands are not recorded. On the light path `compute` the frame is
//! [`super::tiled`]'s instead. What both have is in [`super::main_pass`].

use ash::vk;

use super::FrameParts;
use super::edges::Place;
use super::main_pass::{MainPass, input, prepass};
use super::render_pass::{PassDescription, subpass_index};
use crate::gpu::{self, Image, RenderPass, Timestamps};
use crate::passes::composite::Composite;
use crate::passes::depth::Depth;
use crate::passes::forward::Forward;
use crate::passes::fxaa::Fxaa;
use crate::passes::geometry::Geometry;
use crate::passes::lighting::Lighting;
use crate::passes::per_light::PerLight;
use crate::passes::tonemap::TonemapPass;
use crate::passes::transparent::Transparent;
use crate::passes::view::ViewPass;
use crate::passes::{Input, Recording, SetLayouts, Slot};
use crate::plan::{FramePlan, Shading, World};
use crate::targets::{COMPOSITE_INPUTS, Target, Targets, gbuffer_inputs};

const INLINE: vk::SubpassContents = vk::SubpassContents::INLINE;

/// The passes of a plan and what they draw into.
pub struct Deferred {
    main: MainPass,
    /// In the main pass's first subpass, before what it hides.
    depth: Option<Depth>,
    opaque: Opaque,
    transparent: Option<Transparent>,
    composite: Option<Composite>,
    tonemap: Option<TonemapPass>,
    fxaa: Option<FxaaStage>,
}

/// How opaque surfaces become light.
enum Opaque {
    /// By the G-buffer: GEOMETRY, where there are surfaces, and LIGHTING.
    Deferred(Option<Geometry>, Box<Shade>),
    Forward(Forward),
}

/// LIGHTING's place in the frame.
enum Shade {
    /// One draw lights every pixel, and then lights are added one by one.
    Light(Lighting, Option<Box<PerLight>>),
    View(ViewPass),
}

impl Deferred {
    /// Records one frame. The rows that are named here are those of [`super::edges::table`]. The render pass carries each of them as a
    /// subpass dependency, so that `cmd_next_subpass` waits as they say.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);

        // A render pass for each stale map. Row `shadow-map-to-lighting`: the passes below look up what it wrote.
        self.main.record_shadow(frame, times);

        // The first users of the targets wait until the last frame has let go of them: rows `gbuffer-reuse` or `targets-reuse`, `hdr-reuse`,
        // `samples-reuse`, `sums-reuse`, `output-reuse`.
        // SAFETY: `cmd` is being recorded outside a render pass; pass, framebuffer and clear values were made from one plan,
        // as were the subpasses that follow.
        unsafe { gpu.cmd_begin_render_pass(cmd, &self.main.begin(frame), INLINE) };
        match &self.opaque {
            Opaque::Deferred(geometry, shade) => {
                if let Some(geometry) = geometry {
                    frame.begin("GEOMETRY");
                    if let Some(depth) = &self.depth {
                        // In the same subpass: rasterization order alone puts it before what it hides.
                        depth.record(frame);
                    }
                    geometry.record(frame);
                    frame.end(times, "geometry");
                    // Row `gbuffer-to-lighting`: each pixel reads what GEOMETRY wrote in its own place.
                    // SAFETY: the pass has LIGHTING or VIEW next.
                    unsafe { gpu.cmd_next_subpass(cmd, INLINE) };
                }
                match shade.as_ref() {
                    Shade::Light(lighting, added) => {
                        frame.begin("LIGHTING");
                        lighting.record(frame);
                        if let Some(added) = added {
                            added.record(frame);
                        }
                    }
                    Shade::View(view) => {
                        frame.begin("VIEW");
                        view.record(frame);
                    }
                }
                frame.end(times, "lighting");
            }
            Opaque::Forward(forward) => {
                frame.begin("FORWARD");
                if let Some(depth) = &self.depth {
                    depth.record(frame);
                }
                forward.record(frame);
                frame.end(times, "forward");
            }
        }
        if let Some(transparent) = &self.transparent {
            // Rows `lighting-to-transparent` or `forward-to-transparent`: it tests against the depth of opaque surfaces, and sorted surfaces
            // are blended over their light.
            // SAFETY: the pass has TRANSPARENT next.
            unsafe { gpu.cmd_next_subpass(cmd, INLINE) };
            frame.begin("TRANSPARENT");
            transparent.record(frame);
            frame.end(times, "transparent");
        }
        if let Some(composite) = &self.composite {
            // Rows `sums-to-composite`, and `lighting-to-composite` or `forward-to-composite`: it blends the sums of its pixel over the light.
            // SAFETY: the pass has COMPOSITE next.
            unsafe { gpu.cmd_next_subpass(cmd, INLINE) };
            frame.begin("COMPOSITE");
            composite.record(frame);
            frame.end(times, "composite");
        }
        if let Some(tonemap) = &self.tonemap {
            // Row `hdr-to-tonemap`: it reads the light of its pixel when the last surface is blended.
            // SAFETY: the pass has TONEMAP next.
            unsafe { gpu.cmd_next_subpass(cmd, INLINE) };
            frame.begin("TONEMAP");
            tonemap.record(frame);
            frame.end(times, "tonemap");
        }
        // Row `read-back`: COPY, or what a window draws over the picture, waits for its last write.
        // SAFETY: begun above, and every subpass recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };

        if let Some(FxaaStage { fxaa, .. }) = &self.fxaa {
            // A render pass of its own, because it reads each pixel's neighbours: row `output-to-fxaa`.
            frame.begin("FXAA");
            fxaa.record(frame);
            frame.end(times, "fxaa");
        }
    }

    /// Makes everything that the plan has, once.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, frame_layout, scene, .. } = parts;
        let main = MainPass::new(parts)?;
        let slot = |place| subpass_index(plan, place).map(|subpass| main.slot(subpass));
        let layouts = parts.layouts();
        let targets = &main.targets;

        let depth = prepass(parts, main.slot(0))?;
        let opaque = match slot(Place::Forward) {
            Some(slot) => Opaque::Forward(Forward::new(device, plan, slot, layouts, scene)?),
            None => {
                let geometry = match slot(Place::Geometry) {
                    Some(slot) => Some(Geometry::new(device, plan, slot, frame_layout, scene)?),
                    None => None,
                };
                let lighting = main.slot(u32::from(geometry.is_some()));
                Opaque::Deferred(geometry, Box::new(Shade::new(parts, lighting, layouts, targets)?))
            }
        };
        let transparent = match slot(Place::Transparent) {
            Some(slot) => Some(Transparent::new(device, plan, slot, layouts, scene)?),
            None => None,
        };
        let composite = match slot(Place::Composite) {
            Some(slot) => Some(Composite::new(device, plan, slot, &composite_inputs(targets))?),
            None => None,
        };
        let tonemap = match slot(Place::Tonemap) {
            Some(slot) => Some(TonemapPass::new(device, plan, slot, input((0, Target::Hdr), targets))?),
            None => None,
        };
        let fxaa = match plan.fxaa {
            true => Some(FxaaStage::new(parts, targets)?),
            false => None,
        };
        Ok(Self { main, depth, opaque, transparent, composite, tonemap, fxaa })
    }

    /// Makes anew what has the size of the picture: attachments, framebuffers, and the sets that name them.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, swapchain, .. } = parts;
        self.main.resize(parts)?;
        let targets = &self.main.targets;
        if let Opaque::Deferred(_, shade) = &mut self.opaque {
            shade.read_from(parts, &inputs(plan, targets))?;
        }
        if let Some(composite) = &mut self.composite {
            composite.read_from(device, &composite_inputs(targets))?;
        }
        if let Some(tonemap) = &mut self.tonemap {
            tonemap.read_from(device, input((0, Target::Hdr), targets))?;
        }
        match &mut self.fxaa {
            Some(FxaaStage { fxaa, .. }) => fxaa.resize(device, plan, targets.image(Target::Output).view, swapchain),
            None => Ok(()),
        }
    }

    /// Re-exposes the background's clear colours.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.main.expose(plan, world);
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame, unless it is in an image of the swapchain.
    pub fn output(&self) -> Option<&Image> {
        match &self.fxaa {
            Some(FxaaStage { fxaa, .. }) => fxaa.picture(),
            None => self.main.targets.output(),
        }
    }
}

impl Shade {
    fn new(parts: &FrameParts, slot: Slot, layouts: SetLayouts, targets: &Targets) -> gpu::Result<Self> {
        let &FrameParts { device, plan, .. } = parts;
        let inputs = inputs(plan, targets);
        if !matches!(plan.shading, Shading::Light { .. }) {
            return Ok(Self::View(ViewPass::new(device, plan, slot, layouts, &inputs)?));
        }
        let added = match plan.adds_lights() {
            true => Some(Box::new(PerLight::new(device, plan, slot, layouts, &inputs)?)),
            false => None,
        };
        Ok(Self::Light(Lighting::new(device, plan, slot, layouts, &inputs)?, added))
    }

    fn read_from(&mut self, parts: &FrameParts, inputs: &[Input]) -> gpu::Result<()> {
        match self {
            Self::Light(lighting, added) => {
                lighting.read_from(parts.device, inputs)?;
                match added {
                    Some(added) => added.read_from(parts.device, inputs),
                    None => Ok(()),
                }
            }
            Self::View(view) => view.read_from(parts.device, inputs),
        }
    }
}

/// FXAA with its render pass.
struct FxaaStage {
    _pass: RenderPass,
    fxaa: Fxaa,
}

impl FxaaStage {
    fn new(parts: &FrameParts, targets: &Targets) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, swapchain, .. } = parts;
        let pass = PassDescription::fxaa(plan, edges).make(device)?;
        let slot = Slot { render_pass: pass.raw, subpass: 0 };
        let fxaa = Fxaa::new(device, plan, slot, targets.image(Target::Output).view, swapchain)?;
        Ok(Self { _pass: pass, fxaa })
    }
}

/// What LIGHTING or VIEW reads.
fn inputs(plan: &FramePlan, targets: &Targets) -> Vec<Input> {
    gbuffer_inputs(plan).into_iter().map(|own| input(own, targets)).collect()
}

fn composite_inputs(targets: &Targets) -> [Input; 2] {
    COMPOSITE_INPUTS.map(|own| input(own, targets))
}
