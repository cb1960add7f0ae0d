//! One frame that is rasterized, from top to bottom, as explicit Vulkan. This is the file to read first: [`Deferred::record`] is its
//! outline, and [`list`] says which passes share a render pass.
//!
//! ```text
//! compute        SKIN       vertices of meshes that skins and shapes deform, when their pose is another
//! occluder pass  OCCLUDERS  depth of the largest objects, where the device culls occluded ones
//! compute        PYRAMID    the least depths of squares of that depth
//!                CULL, ARRANGE, FILL  objects in view and not occluded, where the device culls
//! shadow passes  SHADOW     depth maps of lights, those in which something has moved
//! compute        SCATTER, INTEGRATE  the light in the air, where fog has lamps and shadows in it
//! compute        SIMULATE, SORT  particles of the moment with their light, from back to front
//! main pass      GEOMETRY   surfaces into the G-buffer, in tile memory where there is any
//! compute        AO, AO_DENOISE  where asked for: ambient occlusion by surfaces nearby, into the G-buffer's occlusion; the main pass is parted there
//!                LIGHTING   every light on every pixel; or VIEW, which shows a buffer instead
//!                AMBIENT    light of the sky, in LIGHTING's subpass, where a sky lights the scene
//!                SKY        the sky, in the subpass that lights surfaces, on pixels without one
//!                FORWARD    replaces GEOMETRY, LIGHTING and AMBIENT on the forward light paths: surfaces, lit as they are rasterized
//! compute        HIZ, REFLECT, REFLECT_RESOLVE  where asked for: reflections of the lit picture in smooth surfaces, added to it; the main pass ends
//!                before them, and a blend pass goes on
//!                FOG        only where fog is asked for: the light that the air absorbs and scatters
//!                TRANSPARENT  surfaces that let light through, over the lit picture
//!                PARTICLES  in its subpass, after them
//!                COMPOSITE  only where TRANSPARENT summed them up without sorting
//! VELOCITY pass  VELOCITY   only where frames are averaged over time, and something moves by itself: its place in the frame before
//! compute        TAA        only where frames are averaged over time: the mean with the frames before
//! SHARPEN pass   SHARPEN    TAA's mean as light again; the passes after it share its render pass up to where that is parted again
//! compute        BLOOM, SPREAD  only where light is spread: then TONEMAP and TONE have a render pass of their own
//!                TONEMAP    only where something is blended before it
//!                TONE       vignette and grain, where asked for; after FXAA where there is that
//! FXAA pass      FXAA       smooths edges of the finished picture, where asked for
//! ```
//!
//! A pass that the plan leaves out has no object, no resources and no commands. On the light paths `compute` and `visibility` the frame is
//! [`super::tiled`]'s instead. Both share [`super::render_passes`].

use std::cell::Cell;

use ash::vk;

use super::FrameParts;
use super::ao::{self, AoStage};
use super::edges::{Edge, RowName};
use super::froxels::{self as froxel_steps, FroxelStage};
use super::list::{
    self, BLEND_PASS, FXAA_PASS, GBUFFER_PASS, MAIN_PASS, Occasion, SHADOW_PASS, SHARPEN_PASS, Step, Subpass,
    TONEMAP_PASS,
};
use super::particles::{self as particle_steps, ParticleStage};
use super::reflections::{self, ReflectStage};
use super::render_passes::{RenderPassIndex, RenderPasses, prepass};
use super::taa::{self, TaaStage};
use crate::gpu::{self, Image, Timestamps, barrier};
use crate::passes::ambient::{self, Ambient};
use crate::passes::bloom::{self, Bloom};
use crate::passes::composite::{self, Composite};
use crate::passes::depth::{self, Depth};
use crate::passes::fog::{self, FogPass};
use crate::passes::forward::{self, Forward};
use crate::passes::fxaa::{self, Fxaa};
use crate::passes::geometry::{self, Geometry};
use crate::passes::lighting::{self, Lighting};
use crate::passes::particles;
use crate::passes::per_light::{self, PerLight};
use crate::passes::sky::{self, SkyPass};
use crate::passes::tone::{self, Tone};
use crate::passes::tonemap::{self, TonemapPass};
use crate::passes::transparent::{self, Transparent};
use crate::passes::view::{self, ViewPass};
use crate::passes::{Pass, Recording, Resource, shadow, sharpen};
use crate::plan::{FramePlan, Shading, Target};
use crate::visible::{Visible, World};

const INLINE: vk::SubpassContents = vk::SubpassContents::INLINE;

/// The passes of a plan and their targets.
pub struct Deferred {
    pub(super) passes: RenderPasses,
    /// The render pass that begins with surfaces, or with light where there are none.
    first: RenderPassIndex,
    /// The one that goes on with LIGHTING, where the first ends with GEOMETRY.
    second: Option<RenderPassIndex>,
    /// In the first subpass, before what it hides.
    depth: Option<Depth>,
    /// Before the first render pass.
    froxels: Option<Box<FroxelStage>>,
    opaque: Opaque,
    /// Between the two render passes.
    ao: Option<AoStage>,
    sky: Option<SkyPass>,
    /// Between the main pass and the blend pass, where that has something to draw.
    reflect: Option<(ReflectStage, Option<RenderPassIndex>)>,
    fog: Option<FogPass>,
    transparent: Option<Transparent>,
    particles: Option<Box<ParticleStage>>,
    composite: Option<Composite>,
    /// After the main pass.
    taa: Option<TaaStage>,
    bloom: Option<BloomStage>,
    tonemap: Option<TonemapPass>,
    fxaa: Option<(RenderPassIndex, Fxaa)>,
    /// In the last render pass.
    tone: Option<Tone>,
}

/// BLOOM and SPREAD with the rows of its barriers, and the render pass that goes on after it.
struct BloomStage {
    bloom: Bloom,
    reuse: Option<Edge>,
    to_spread: Option<Edge>,
    step: Option<Edge>,
    next: RenderPassIndex,
}

/// The ways in which opaque surfaces become light.
enum Opaque {
    /// By the G-buffer: GEOMETRY, where there are surfaces, and LIGHTING.
    Deferred(Option<Geometry>, Box<Shade>),
    Forward(Forward),
}

/// LIGHTING's place in the frame.
enum Shade {
    /// One draw lights every pixel, and then lights are added one by one, and that of the sky.
    Light(Lighting, Option<PerLight>, Option<Box<Ambient>>),
    View(ViewPass),
}

/// The passes of the frame in their order, grouped by render pass. Passes that the plan lacks are left out.
pub(super) fn list(plan: &FramePlan) -> Vec<Option<Step>> {
    let subpass = |place: &Pass, passes: &[&'static Pass]| list::subpass(plan, place.place, passes);
    let alone = |pass: &'static Pass| subpass(pass, &[pass]);

    let surfaces = subpass(&geometry::PASS, &[&depth::PASS, &geometry::PASS]);
    // Over the picture, wherever that is finished.
    let [tone, smoothed_tone] = if plan.fxaa { [None, alone(&tone::PASS)] } else { [alone(&tone::PASS), None] };
    // BLOOM and TAA read each pixel's neighbours, so that the main pass ends before them.
    let (mut shown, mut smoothed, mut bloomed) = ([None, None], [None, None], [None, None]);
    let last = [alone(&tonemap::PASS), tone];
    match (&plan.bloom, &plan.taa) {
        (Some(_), _) => bloomed = last,
        (None, Some(_)) => smoothed = last,
        (None, None) => shown = last,
    }
    let [tonemap, tone] = shown;
    // ANCHOR: list-subpasses
    let lit = [
        subpass(&lighting::PASS, &[&lighting::PASS, &per_light::PASS, &ambient::PASS, &sky::PASS, &view::PASS]),
        subpass(&forward::PASS, &[&depth::PASS, &forward::PASS, &sky::PASS]),
    ];
    let over = subpass(&transparent::PASS, &[&transparent::PASS, &particles::PASS]);
    let blended = [alone(&fog::PASS), over, alone(&composite::PASS), tonemap, tone];
    // ANCHOR_END: list-subpasses
    // REFLECT reads the light of all pixels, so that the main pass ends with it.
    let (light, blended): (Vec<Option<Subpass>>, Vec<_>) = match plan.reflects() {
        true => (lit.into(), blended.into()),
        false => (lit.into_iter().chain(blended).collect(), Vec::new()),
    };
    let mut steps = vec![super::render_passes::skin_step(plan)];
    steps.extend(super::render_passes::culling_steps(plan));
    steps.push(list::render_pass(SHADOW_PASS, [alone(&shadow::PASS)]));
    steps.extend(froxel_steps::steps(plan));
    steps.extend(particle_steps::steps(plan));
    // ANCHOR: list-main-pass
    // Each of these reads only its own pixel, so that a tiler never leaves the tile. AO reads neighbours, and parts them.
    match plan.stores_gbuffer {
        false => steps.push(list::render_pass(MAIN_PASS, [surfaces].into_iter().chain(light))),
        true => {
            steps.push(list::render_pass(GBUFFER_PASS, [surfaces]));
            steps.extend(ao::steps(plan));
            steps.push(list::render_pass(MAIN_PASS, light));
        }
    }
    // ANCHOR_END: list-main-pass
    steps.extend(reflections::steps(plan));
    steps.push(list::render_pass(BLEND_PASS, blended));
    steps.extend(taa::steps(plan));
    steps.push(list::render_pass(SHARPEN_PASS, [alone(&sharpen::PASS)].into_iter().chain(smoothed)));
    // A step of SPREAD after another: all but the first wait alike.
    let step = |pass, row| list::commands(plan, Occasion::Always, pass, &[(row, Resource::BloomLevels)], &[]);
    steps.extend([
        step(&bloom::PASS, RowName::BLOOM_REUSE),
        step(&bloom::SPREAD, RowName::BLOOM_TO_SPREAD),
        step(&bloom::SPREAD, RowName::SPREAD_TO_SPREAD),
    ]);
    steps.push(list::render_pass(TONEMAP_PASS, bloomed));
    steps.push(list::render_pass(FXAA_PASS, [alone(&fxaa::PASS), smoothed_tone]));
    steps
}

impl Deferred {
    /// Records one frame. The rows that are named here are those of [`super::edges::table`]. The render passes carry each of them as a
    /// subpass dependency, so that `cmd_next_subpass` waits as they say.
    pub fn record(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (gpu, cmd, passes) = (&frame.device.raw, frame.cmd, &self.passes);

        // SKIN writes deformed vertices for all that draws below: rows `deformed-reuse` and `skin-to-draws`.
        passes.record_skin(frame, times);

        // OCCLUDERS and PYRAMID make the pyramid of occluding depths: rows `occluders-reuse`, `occluders-to-pyramid`, `pyramid-reuse` and
        // `pyramid-to-cull`. CULL, ARRANGE and FILL find the visible objects: rows `culled-reuse`, `cull-to-arrange`, `arrange-to-fill` and
        // `fill-to-draws`.
        passes.record_hiding(frame, times);
        passes.record_culling(frame, times);

        // A render pass for each stale map. Row `shadow-map-to-lighting`: the passes below look up what it wrote.
        passes.record_shadow(frame, times);

        // SCATTER and INTEGRATE find the light in the air: rows `froxels-reuse`, `scatter-to-integrate` and `froxels-to-fog`.
        if let Some(froxels) = &self.froxels {
            froxels.record(frame, times);
        }

        // SIMULATE and SORT write the particles that PARTICLES draws: rows `particles-reuse`, `simulate-to-sort`, `sort-to-sort` and
        // `particles-to-draw`.
        if let Some(particles) = &self.particles {
            particles.record(frame, times);
        }

        // The first users of the targets wait until the last frame has let go of them: rows `gbuffer-reuse` or `targets-reuse`, `hdr-reuse`,
        // `samples-reuse`, `sums-reuse`, `output-reuse`.
        // SAFETY: `cmd` is being recorded outside a render pass; the subpasses that follow were made from the same list.
        unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, self.first), INLINE) };
        match &self.opaque {
            Opaque::Deferred(geometry, shade) => {
                if let Some(geometry) = geometry {
                    frame.begin(&geometry::PASS);
                    if let Some(depth) = &self.depth {
                        // In the same subpass: rasterization order alone puts it before what it hides.
                        depth.record(frame);
                    }
                    geometry.record(frame);
                    frame.end(times, &geometry::PASS);
                    // Row `gbuffer-to-lighting`: each pixel reads what GEOMETRY wrote in its own place.
                    match self.second {
                        // SAFETY: the pass has LIGHTING or VIEW next.
                        None => unsafe { gpu.cmd_next_subpass(cmd, INLINE) },
                        Some(second) => {
                            // SAFETY: the first pass has no other subpass.
                            unsafe { gpu.cmd_end_render_pass(cmd) };
                            if let Some(ao) = &self.ao {
                                // Rows `gbuffer-to-ao` and `occlusion-to-lighting`: AO reads GEOMETRY's output, and LIGHTING the resulting occlusion
                                // in it.
                                ao.record(frame, passes, times);
                            }
                            // SAFETY: outside a render pass; the second one begins with LIGHTING or VIEW.
                            unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, second), INLINE) };
                        }
                    }
                }
                match shade.as_ref() {
                    Shade::Light(lighting, added, ambient) => {
                        frame.begin(&lighting::PASS);
                        lighting.record(frame);
                        if let Some(added) = added {
                            added.record(frame);
                        }
                        frame.end(times, &lighting::PASS);
                        if let Some(ambient) = ambient {
                            // In the same subpass: rasterization order alone puts it after what it adds to. Row `prefilter-to-lighting`.
                            frame.begin(&ambient::PASS);
                            ambient.record(frame);
                            frame.end(times, &ambient::PASS);
                        }
                    }
                    Shade::View(view) => {
                        frame.begin(&view::PASS);
                        view.record(frame);
                        frame.end(times, &view::PASS);
                    }
                }
            }
            Opaque::Forward(forward) => {
                frame.begin(&forward::PASS);
                if let Some(depth) = &self.depth {
                    depth.record(frame);
                }
                forward.record(frame);
                frame.end(times, &forward::PASS);
            }
        }
        if let Some(sky) = &self.sky {
            // In the same subpass, where depth still has the value of its clear.
            frame.begin(&sky::PASS);
            sky.record(frame);
            frame.end(times, &sky::PASS);
        }
        if let Some((reflect, next)) = &self.reflect {
            // Row `lighting-to-hiz`: they read the light and the G-buffer of all pixels.
            // SAFETY: the main pass has no other subpass.
            unsafe { gpu.cmd_end_render_pass(cmd) };
            reflect.record(frame, passes, times);
            if let Some(next) = next {
                // SAFETY: outside a render pass; the blend pass begins with the next step.
                unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, *next), INLINE) };
            }
        }
        // The first subpass of the blend pass has begun with it.
        let has_begun = Cell::new(self.reflect.is_some());
        let next_subpass = || {
            if !has_begun.take() {
                // SAFETY: the pass has the subpass of the next step.
                unsafe { gpu.cmd_next_subpass(cmd, INLINE) };
            }
        };
        // ANCHOR: record-fog
        if let Some(fog) = &self.fog {
            // Row `lighting-to-fog`, `resolve-to-fog` or `forward-to-fog`: it reads the depth of its pixel, and is blended over its light.
            next_subpass();
            frame.begin(&fog::PASS);
            fog.record(frame);
            frame.end(times, &fog::PASS);
        }
        // ANCHOR_END: record-fog
        if self.transparent.is_some() || self.particles.is_some() {
            // Rows `lighting-to-transparent`, `resolve-to-transparent`, `forward-to-transparent` or `fog-to-transparent`: it tests against the depth of
            // opaque surfaces, and sorted surfaces are blended over their light.
            next_subpass();
        }
        if let Some(transparent) = &self.transparent {
            frame.begin(&transparent::PASS);
            transparent.record(frame);
            frame.end(times, &transparent::PASS);
        }
        if let Some(particles) = &self.particles {
            // In the same subpass: rasterization order alone puts them over transparent surfaces.
            particles.draw(frame, times);
        }
        if let Some(composite) = &self.composite {
            // Rows `sums-to-composite`, and `lighting-to-composite`, `resolve-to-composite` or `forward-to-composite`: it blends the sums of its
            // pixel over the light.
            next_subpass();
            frame.begin(&composite::PASS);
            composite.record(frame);
            frame.end(times, &composite::PASS);
        }
        // Where nothing is blended after reflections, there is no blend pass.
        let is_open = Cell::new(self.reflect.as_ref().is_none_or(|(_, next)| next.is_some()));
        let end_render_pass = || {
            if is_open.take() {
                // SAFETY: the render pass so far has no other subpass.
                unsafe { gpu.cmd_end_render_pass(cmd) };
            }
        };
        if let Some(taa) = &self.taa {
            // The render pass that wrote light and depth stores them, and another one goes on after TAA.
            end_render_pass();
            taa.record(frame, passes, times);
            is_open.set(true);
            has_begun.set(false);
        }
        if let Some(tonemap) = &self.tonemap {
            match &self.bloom {
                // Row `hdr-to-tonemap`: it reads the light of its pixel when the last surface is blended.
                None => next_subpass(),
                // Rows `hdr-to-bloom` and `spread-to-tonemap`: the light is stored, and BLOOM spreads it in between.
                Some(stage) => {
                    end_render_pass();
                    self.record_bloom(frame, stage, times);
                }
            }
            frame.begin(&tonemap::PASS);
            tonemap.record(frame);
            frame.end(times, &tonemap::PASS);
        }
        if self.fxaa.is_none() {
            self.record_tone(frame, times);
        }
        // Row `read-back`: COPY, or what a window draws over the picture, waits for its last write.
        // SAFETY: begun above, and every subpass recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };

        // ANCHOR: record-fxaa
        if let Some((pass, fxaa)) = &self.fxaa {
            // A render pass of its own, because it reads each pixel's neighbours: row `output-to-fxaa`. Its picture waits by `picture-reuse`.
            frame.begin(&fxaa::PASS);
            // SAFETY: outside a render pass again; FXAA is the first subpass.
            unsafe { gpu.cmd_begin_render_pass(cmd, &passes.begin(frame, *pass), INLINE) };
            fxaa.record(frame);
            frame.end(times, &fxaa::PASS);
            self.record_tone(frame, times);
            // SAFETY: begun above, and every subpass recorded.
            unsafe { gpu.cmd_end_render_pass(cmd) };
        }
        // ANCHOR_END: record-fxaa

        // A window's picture that is enlarged: rows `swapchain-to-present` and `present-to-swapchain`.
        passes.record_present(frame, times);
    }

    /// BLOOM and SPREAD, outside a render pass, and the begin of the one that goes on with TONEMAP.
    fn record_bloom(&self, frame: &Recording, stage: &BloomStage, times: &mut Option<Timestamps>) {
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);
        let barrier = |row: &Option<Edge>| {
            if let Some(row) = row {
                barrier::buffer_barrier(frame.device, cmd, &stage.bloom.levels, row.order());
            }
        };
        frame.begin(&bloom::PASS);
        // TONEMAP of the last frame may still read the levels.
        barrier(&stage.reuse);
        stage.bloom.record(frame);
        frame.end(times, &bloom::PASS);
        frame.begin(&bloom::SPREAD);
        // Each step reads what the one before it wrote.
        barrier(&stage.to_spread);
        stage.bloom.record_spread(frame, || barrier(&stage.step));
        frame.end(times, &bloom::SPREAD);
        // SAFETY: outside a render pass again; TONEMAP is the first subpass of the next.
        unsafe { gpu.cmd_begin_render_pass(cmd, &self.passes.begin(frame, stage.next), INLINE) };
    }

    /// TONE, in the render pass that finishes the picture.
    fn record_tone(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let Some(tone) = &self.tone else { return };
        // Row `picture-to-tone`: it multiplies the finished value of its pixel.
        // SAFETY: the render pass has TONE next.
        unsafe { frame.device.raw.cmd_next_subpass(frame.cmd, INLINE) };
        frame.begin(&tone::PASS);
        tone.record(frame);
        frame.end(times, &tone::PASS);
    }

    /// Makes everything that the plan has, once.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, frame_layout, scene, .. } = parts;
        let passes = RenderPasses::new(parts)?;
        let main = passes.find(MAIN_PASS).ok_or_else(|| gpu::Error::Misuse("the frame has no main pass".into()))?;
        let (first, second) = passes.find(GBUFFER_PASS).map_or((main, None), |first| (first, Some(main)));
        let slot = |pass| passes.slot(pass);
        let (layouts, depth) = (parts.layouts(), prepass(parts, &passes)?);

        let opaque = match slot(&forward::PASS) {
            Some(slot) => Opaque::Forward(Forward::new(device, plan, slot, layouts, scene)?),
            None => {
                let geometry = slot(&geometry::PASS)
                    .map(|slot| Geometry::new(device, plan, slot, frame_layout, scene))
                    .transpose()?;
                Opaque::Deferred(geometry, Box::new(Shade::new(parts, &passes)?))
            }
        };
        let sky = slot(&sky::PASS).map(|slot| SkyPass::new(device, plan, slot, layouts)).transpose()?;
        let fog = slot(&fog::PASS)
            .map(|slot| FogPass::new(device, plan, slot, layouts, &passes.inputs(&fog::PASS, plan)))
            .transpose()?;
        let transparent =
            slot(&transparent::PASS).map(|slot| Transparent::new(device, plan, slot, layouts, scene)).transpose()?;
        let particles = ParticleStage::new(parts, &passes)?.map(Box::new);
        let composite = slot(&composite::PASS)
            .map(|slot| Composite::new(device, plan, slot, &passes.inputs(&composite::PASS, plan)))
            .transpose()?;
        let taa = TaaStage::new(parts, &passes)?;
        let bloom = BloomStage::new(parts, &passes)?;
        let levels = bloom.as_ref().map(|stage| &stage.bloom.levels);
        let tonemap = slot(&tonemap::PASS)
            .map(|slot| TonemapPass::new(device, plan, slot, &passes.inputs(&tonemap::PASS, plan), levels))
            .transpose()?;
        let fxaa = match (passes.find(FXAA_PASS), slot(&fxaa::PASS)) {
            (Some(pass), Some(slot)) => {
                Some((pass, Fxaa::new(device, slot, passes.targets.image(Target::Output).view)?))
            }
            _ => None,
        };
        let ao = AoStage::new(parts, &passes)?;
        let reflect = ReflectStage::new(parts, &passes)?.map(|stage| (stage, passes.find(BLEND_PASS)));
        let tone = slot(&tone::PASS).map(|slot| Tone::new(device, plan, slot, layouts)).transpose()?;
        Ok(Self {
            passes,
            first,
            second,
            depth,
            froxels: FroxelStage::new(parts)?.map(Box::new),
            opaque,
            ao,
            sky,
            reflect,
            fog,
            transparent,
            particles,
            composite,
            taa,
            bloom,
            tonemap,
            fxaa,
            tone,
        })
    }

    /// The buffer of the fog's froxels, where there are some.
    pub fn froxels(&self) -> Option<&gpu::Buffer> {
        self.froxels.as_ref().map(|own| &own.froxels)
    }

    /// Writes what passes of one frame in flight read of their own.
    pub fn write(&self, place: usize, visible: &Visible) -> gpu::Result<()> {
        self.particles.as_ref().map_or(Ok(()), |particles| particles.write(place, &visible.particles))
    }

    /// Makes the objects of the picture's size anew: attachments, framebuffers, and the sets that name them.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, .. } = parts;
        self.passes.resize(parts)?;
        let passes = &self.passes;
        if let Opaque::Deferred(_, shade) = &mut self.opaque {
            shade.read_from(parts, passes)?;
        }
        if let Some(ao) = &mut self.ao {
            ao.rebind(parts, passes)?;
        }
        if let Some(fog) = &mut self.fog {
            fog.inputs.read_from(device, &passes.inputs(&fog::PASS, plan))?;
        }
        if let Some(particles) = &mut self.particles {
            particles.rebind(parts, passes)?;
        }
        if let Some((reflect, _)) = &mut self.reflect {
            reflect.rebind(parts, passes)?;
        }
        if let Some(composite) = &mut self.composite {
            composite.inputs.read_from(device, &passes.inputs(&composite::PASS, plan))?;
        }
        if let Some(taa) = &mut self.taa {
            taa.resize(parts, passes)?;
        }
        if let Some(stage) = &mut self.bloom {
            stage.bloom.resize(device, plan, &passes.inputs(&bloom::PASS, plan))?;
        }
        if let Some(tonemap) = &mut self.tonemap {
            let levels = self.bloom.as_ref().map(|stage| &stage.bloom.levels);
            tonemap.read_from(device, &passes.inputs(&tonemap::PASS, plan), levels)?;
        }
        match &mut self.fxaa {
            Some((_, fxaa)) => fxaa.read_from(device, passes.targets.image(Target::Output).view),
            None => Ok(()),
        }
    }

    /// Re-exposes the background's clear colours.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.passes.expose(plan, world);
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame, unless it is in an image of the swapchain.
    pub fn output(&self, plan: &FramePlan) -> Option<&Image> {
        self.passes.targets.find(plan.picture())
    }
}

impl BloomStage {
    /// None where the plan does not have it.
    fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, .. } = parts;
        let (Some(planned), Some(next)) = (plan.bloom, passes.find(TONEMAP_PASS)) else { return Ok(None) };
        Ok(Some(Self {
            bloom: Bloom::new(device, plan, planned, &passes.inputs(&bloom::PASS, plan))?,
            reuse: edges.find(RowName::BLOOM_REUSE).cloned(),
            to_spread: edges.find(RowName::BLOOM_TO_SPREAD).cloned(),
            step: edges.find(RowName::SPREAD_TO_SPREAD).cloned(),
            next,
        }))
    }
}

impl Shade {
    fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Self> {
        let (&FrameParts { device, plan, .. }, layouts) = (parts, parts.layouts());
        let pass = if let Shading::Light { .. } = plan.shading { &lighting::PASS } else { &view::PASS };
        let (slot, inputs) = (passes.needed_slot(pass)?, passes.inputs(pass, plan));
        if pass.place == view::PASS.place {
            return Ok(Self::View(ViewPass::new(device, plan, slot, layouts, &inputs)?));
        }
        let added = match plan.adds_lights() {
            true => Some(PerLight::new(device, plan, slot, layouts, &inputs)?),
            false => None,
        };
        let ambient = match plan.adds_ambient() {
            true => Some(Box::new(Ambient::new(device, plan, slot, layouts, &inputs)?)),
            false => None,
        };
        Ok(Self::Light(Lighting::new(device, plan, slot, layouts, &inputs)?, added, ambient))
    }

    fn read_from(&mut self, parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<()> {
        let &FrameParts { device, plan, .. } = parts;
        match self {
            Self::Light(lighting, added, ambient) => {
                let inputs = passes.inputs(&lighting::PASS, plan);
                let others = [added.as_mut().map(|own| &mut own.inputs), ambient.as_mut().map(|own| &mut own.inputs)];
                let all = [Some(&mut lighting.inputs)].into_iter().chain(others).flatten();
                all.into_iter().try_for_each(|own| own.read_from(device, &inputs))
            }
            Self::View(view) => {
                let inputs = passes.inputs(&view::PASS, plan);
                view.inputs.as_mut().map_or(Ok(()), |own| own.read_from(device, &inputs))
            }
        }
    }
}
