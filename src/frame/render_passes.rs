//! The parts that every kind of frame has: the images that it draws into, and its render passes with their framebuffers and clear values.

use ash::vk;
use glam::Vec3;

use super::FrameParts;
use super::edges::{Carrier, Edge, RowName};
use super::list::{self, List, OCCLUDER_PASS, Occasion, RenderPassName, SHADOW_PASS, Step};
use super::render_pass::PassDescription;
use crate::gpu::barrier::{self, ImageRange};
use crate::gpu::{self, Device, RenderPass, Timestamps};
use crate::passes::arrange::{self, Arrange};
use crate::passes::cull::{self, Cull};
use crate::passes::depth::{self, Depth};
use crate::passes::fill::{self, Fill};
use crate::passes::occluders::{self, Occluders};
use crate::passes::present;
use crate::passes::pyramid::{self, Pyramid};
use crate::passes::shadow::{self, Shadow};
use crate::passes::skin::{self, Skin};
use crate::passes::tonemap::tone_map_up_to;
use crate::passes::{How, Input, Pass, Recording, Resource, Slot};
use crate::plan::{FramePlan, Shading, Target, ToneMapping};
use crate::targets::{Framebuffers, Targets};
use crate::visible::World;

/// The targets of a frame, and the render passes that draw into them.
pub struct RenderPasses {
    pub targets: Targets,
    list: List,
    passes: Vec<Made>,
    shadow: Option<ShadowStage>,
    skin: Option<SkinStage>,
    hiding: Option<HidingStage>,
    culling: Option<CullingStage>,
    present: Option<PresentStage>,
}

/// One of a frame's render passes.
#[derive(Debug, Clone, Copy)]
pub struct RenderPassIndex(usize);

/// A render pass on the device.
struct Made {
    name: RenderPassName,
    targets: Vec<Target>,
    /// Some attachment is cleared.
    clears_some: bool,
    pass: RenderPass,
    framebuffers: Framebuffers,
    clears: Vec<vk::ClearValue>,
}

/// SKIN with the rows of the barriers around it.
struct SkinStage {
    skin: Skin,
    before: Option<Edge>,
    after: Option<Edge>,
}

/// The passes by which the device finds hidden objects, with the rows of the barriers around PYRAMID.
struct HidingStage {
    pass: RenderPassIndex,
    occluders: Occluders,
    pyramid: Pyramid,
    pyramid_reuse: Option<Edge>,
    pyramid_to_cull: Option<Edge>,
}

/// The passes that cull on the device, with the rows of the barriers before and after each.
struct CullingStage {
    cull: Cull,
    arrange: Arrange,
    fill: Fill,
    reuse: Option<Edge>,
    cull_to_arrange: Option<Edge>,
    arrange_to_fill: Option<Edge>,
    found_to_host: Option<Edge>,
    fill_to_draws: Option<Edge>,
}

/// PRESENT, with the picture that it copies and the rows of the barriers around it.
struct PresentStage {
    picture: Target,
    /// The image that is shown has the same texels. A compute pass writes its own order of channels.
    is_alike: bool,
    before: Edge,
    after: Edge,
}

/// SHADOW with its render pass.
struct ShadowStage {
    _pass: RenderPass,
    shadow: Shadow,
}

impl RenderPasses {
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline, or the list of passes and the rows contradict each other.
    pub fn new(parts: &FrameParts) -> gpu::Result<Self> {
        let &FrameParts { device, plan, edges, atlas, scene, world, swapchain, .. } = parts;
        let list = List::of(plan);
        list.check(plan, edges)?;
        let targets = Targets::new(device, plan, |target| list.usage(plan, target))?;
        let mut passes = Vec::new();
        for description in PassDescription::all(plan, edges) {
            let name = description.name;
            if name == SHADOW_PASS {
                continue;
            }
            let pass = description.make(device)?;
            let own = description.targets();
            let framebuffers = targets.framebuffers(plan, (device, &pass), &own, swapchain)?;
            let cleared = |own: &vk::AttachmentDescription| own.load_op == vk::AttachmentLoadOp::CLEAR;
            let clears_some = description.attachments.iter().any(|(_, own)| cleared(own));
            passes.push(Made { name, pass, framebuffers, clears_some, clears: Vec::new(), targets: own });
        }
        let shadow = match (&plan.shadow, atlas, PassDescription::named(plan, edges, SHADOW_PASS)) {
            (Some(shadow_plan), Some(atlas), Some(description)) => {
                let pass = description.make(device)?;
                let slot = Slot { render_pass: pass.raw, subpass: 0 };
                let shadow = Shadow::new(device, shadow_plan, atlas, slot, scene, world)?;
                Some(ShadowStage { _pass: pass, shadow })
            }
            _ => None,
        };
        let skin = match &scene.deformed {
            Some(deformed) => Some(SkinStage {
                skin: Skin::new(device, deformed, parts.poses.iter())?,
                before: edges.find(RowName::DEFORMED_REUSE).cloned(),
                after: edges.find(RowName::SKIN_TO_DRAWS).cloned(),
            }),
            None => None,
        };
        let row = |name| edges.find(name).cloned();
        let culling = match parts.culling {
            Some(culling) => Some(CullingStage {
                cull: Cull::new(device, culling)?,
                arrange: Arrange::new(device, culling)?,
                fill: Fill::new(device, culling)?,
                reuse: row(RowName::CULLED_REUSE),
                cull_to_arrange: row(RowName::CULL_TO_ARRANGE),
                arrange_to_fill: row(RowName::ARRANGE_TO_FILL),
                found_to_host: row(RowName::FOUND_TO_HOST),
                fill_to_draws: row(RowName::FILL_TO_DRAWS),
            }),
            None => None,
        };
        let rows = row(RowName::SWAPCHAIN_TO_PRESENT).zip(row(RowName::PRESENT_TO_SWAPCHAIN));
        let present = rows.map(|(before, after)| PresentStage {
            picture: plan.picture(),
            is_alike: !plan.is_tiled(),
            before,
            after,
        });
        let mut made = Self { targets, list, passes, shadow, skin, hiding: None, culling, present };
        made.hiding = HidingStage::new(parts, &made)?;
        made.expose(plan, world);
        Ok(made)
    }

    /// Makes the images and framebuffers anew, which have the size of the picture.
    pub fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        let &FrameParts { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan, |target| self.list.usage(plan, target))?;
        for made in &mut self.passes {
            made.framebuffers = self.targets.framebuffers(plan, (device, &made.pass), &made.targets, swapchain)?;
        }
        let depths = self.hiding.is_some().then(|| self.inputs(&pyramid::PASS, plan));
        match (&mut self.hiding, depths, parts.culling) {
            (Some(hiding), Some(depths), Some(culling)) => hiding.pyramid.rebind(device, culling, &depths),
            _ => Ok(()),
        }
    }

    /// Re-exposes the background's clear colours.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        for made in self.passes.iter_mut().filter(|made| made.clears_some) {
            made.clears = clear_values(plan, world, &made.targets);
        }
    }

    /// Returns the render pass and the subpass to which a pass's pipelines belong, if the frame has it in a subpass.
    pub fn slot(&self, pass: &Pass) -> Option<Slot> {
        let draws = |name: RenderPassName, subpasses: &[super::list::Subpass]| {
            let subpass = subpasses.iter().position(|own| own.passes.iter().any(|one| one.place == pass.place))?;
            let made = self.passes.iter().find(|made| made.name == name)?;
            Some(Slot { render_pass: made.pass.raw, subpass: subpass as u32 })
        };
        self.list.render_passes().find_map(|(name, subpasses)| draws(name, subpasses))
    }

    /// The same for a pass that the frame cannot be without.
    ///
    /// # Errors
    /// When the list does not have it.
    pub fn needed_slot(&self, pass: &Pass) -> gpu::Result<Slot> {
        self.slot(pass).ok_or_else(|| gpu::Error::Misuse(format!("the frame has no subpass for {}", pass.place)))
    }

    /// Returns the frame's targets that a pass reads, at its bindings.
    pub fn inputs(&self, pass: &Pass, plan: &FramePlan) -> Vec<Input> {
        let all = (pass.touches)(plan).into_iter().filter_map(|touch| match (touch.how, touch.resource) {
            (How::Input { binding } | How::Sampled { binding }, Resource::Target(target)) => {
                Some((binding, self.targets.image(target).view, touch.layout()))
            }
            _ => None,
        });
        all.collect()
    }

    /// The render pass of this name, if it is a part of the frame.
    pub fn find(&self, name: RenderPassName) -> Option<RenderPassIndex> {
        self.passes.iter().position(|made| made.name == name).map(RenderPassIndex)
    }

    /// Returns the begin info of a render pass in this frame.
    pub fn begin(&self, frame: &Recording, pass: RenderPassIndex) -> vk::RenderPassBeginInfo<'_> {
        let made = &self.passes[pass.0];
        vk::RenderPassBeginInfo::default()
            .render_pass(made.pass.raw)
            .framebuffer(made.framebuffers.of(frame.image))
            .render_area(frame.area())
            .clear_values(&made.clears)
    }

    /// Records the deformed vertices of a new pose, outside a render pass, where the plan has some.
    pub fn record_skin(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let Some(SkinStage { skin, before, after }) = self.skin.as_ref().filter(|_| frame.posed) else { return };
        let Some(deformed) = &frame.scene.deformed else { return };
        let barrier = |row: &Option<Edge>| {
            if let Some(row) = row {
                barrier::buffer_barrier(frame.device, frame.cmd, &deformed.vertices, row.order());
            }
        };
        frame.begin(&skin::PASS);
        // The last frame's draws may still fetch what it overwrites.
        barrier(before);
        skin.record(frame);
        // Every pass that draws deformed objects fetches what it wrote.
        barrier(after);
        frame.end(times, &skin::PASS);
    }

    /// Records occlusion culling on the device, outside a render pass, where the plan has it.
    pub fn record_hiding(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (Some(stage), Some(culling)) = (&self.hiding, frame.culling) else { return };
        let (gpu, cmd) = (&frame.device.raw, frame.cmd);
        frame.begin(&occluders::PASS);
        // SAFETY: `cmd` is being recorded outside a render pass; OCCLUDERS is its only subpass.
        unsafe { gpu.cmd_begin_render_pass(cmd, &self.begin(frame, stage.pass), vk::SubpassContents::INLINE) };
        stage.occluders.record(frame);
        // SAFETY: begun above; its one subpass is recorded.
        unsafe { gpu.cmd_end_render_pass(cmd) };
        frame.end(times, &occluders::PASS);
        let barrier = |row: &Option<Edge>| {
            if let (Some(row), Some(pyramid)) = (row, &culling.pyramid) {
                barrier::buffer_barrier(frame.device, cmd, pyramid, row.order());
            }
        };
        frame.begin(&pyramid::PASS);
        // CULL of the last frame may still look into it.
        barrier(&stage.pyramid_reuse);
        stage.pyramid.record(frame, culling);
        // CULL looks into it.
        barrier(&stage.pyramid_to_cull);
        frame.end(times, &pyramid::PASS);
    }

    /// Records culling on the device, outside a render pass, where the plan has it.
    pub fn record_culling(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        let (Some(stage), Some(culling)) = (&self.culling, frame.culling) else { return };
        let barrier = |row: &Option<Edge>| {
            if let Some(row) = row {
                barrier::buffer_barrier(frame.device, frame.cmd, &culling.culled, row.order());
            }
        };
        frame.begin(&cull::PASS);
        // The last frame's draws may still read the overwritten values.
        barrier(&stage.reuse);
        stage.cull.record(frame, culling);
        frame.end(times, &cull::PASS);
        frame.begin(&arrange::PASS);
        // It adds up what CULL counted.
        barrier(&stage.cull_to_arrange);
        stage.arrange.record(frame, culling);
        // The CPU reads how many there are, when the frame is done.
        if let Some(row) = &stage.found_to_host {
            barrier::buffer_barrier(frame.device, frame.cmd, culling.found_buffer(frame.place), row.order());
        }
        frame.end(times, &arrange::PASS);
        frame.begin(&fill::PASS);
        // It puts rows where ARRANGE says.
        barrier(&stage.arrange_to_fill);
        stage.fill.record(frame, culling);
        // Draws read commands and rows.
        barrier(&stage.fill_to_draws);
        frame.end(times, &fill::PASS);
    }

    /// Records the stale shadow maps, outside a render pass, where the plan has maps.
    pub fn record_shadow(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        if let Some(ShadowStage { shadow, .. }) = &self.shadow {
            frame.begin(&shadow::PASS);
            shadow.record(frame);
            frame.end(times, &shadow::PASS);
        }
    }
}

impl RenderPasses {
    /// Records PRESENT where the plan has it.
    pub fn record_present(&self, frame: &Recording, times: &mut Option<Timestamps>) {
        if let (Some(_), Some(image)) = (&self.present, frame.swapchain_image) {
            self.present_into(frame.device, frame.cmd, image);
            Timestamps::stamp(times, frame.cmd, present::PASS.time);
        }
    }

    /// Records the copy of the picture into the image that is shown, outside a render pass, where the plan has it.
    pub fn present_into(&self, device: &Device, cmd: vk::CommandBuffer, (image, extent): (vk::Image, vk::Extent2D)) {
        let Some(stage) = &self.present else { return };
        device.begin_label(cmd, present::PASS.place.name());
        let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
        // Presentation, or ENCODE, may still have read the image: all of it is written.
        image_barrier(device, cmd, whole, Some(&stage.before));
        let picture = self.targets.image(stage.picture);
        present::record(device, cmd, (picture, stage.is_alike), (image, extent));
        image_barrier(device, cmd, whole, Some(&stage.after));
        device.end_label(cmd);
    }
}

impl HidingStage {
    /// None where the plan does not have it.
    fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, frame_layout, .. } = parts;
        let (Some(pass), Some(culling)) = (passes.find(OCCLUDER_PASS), parts.culling) else { return Ok(None) };
        Ok(Some(Self {
            pass,
            occluders: Occluders::new(device, plan, passes.needed_slot(&occluders::PASS)?, frame_layout)?,
            pyramid: Pyramid::new(device, plan, culling, &passes.inputs(&pyramid::PASS, plan))?,
            pyramid_reuse: edges.find(RowName::PYRAMID_REUSE).cloned(),
            pyramid_to_cull: edges.find(RowName::PYRAMID_TO_CULL).cloned(),
        }))
    }
}

/// SKIN between its barriers, before all that draws.
pub(super) fn skin_step(plan: &FramePlan) -> Option<Step> {
    let vertices = Resource::DeformedVertices;
    list::commands(
        plan,
        Occasion::Posed,
        &skin::PASS,
        &[(RowName::DEFORMED_REUSE, vertices)],
        &[(RowName::SKIN_TO_DRAWS, vertices)],
    )
}

/// OCCLUDERS and PYRAMID, and CULL, ARRANGE and FILL between their barriers, before all that draws.
pub(super) fn culling_steps(plan: &FramePlan) -> [Option<Step>; 5] {
    let culled = Resource::CulledInstances;
    let step = |pass, before, after: &[(RowName, Resource)]| {
        list::commands(plan, Occasion::Always, pass, &[(before, culled)], after)
    };
    let occluders = list::subpass(plan, occluders::PASS.place, &[&occluders::PASS]);
    let [reuse, pyramid] =
        [RowName::PYRAMID_REUSE, RowName::PYRAMID_TO_CULL].map(|row| [(row, Resource::DepthPyramid)]);
    [
        list::render_pass(OCCLUDER_PASS, [occluders]),
        list::commands(plan, Occasion::Always, &pyramid::PASS, &reuse, &pyramid),
        step(&cull::PASS, RowName::CULLED_REUSE, &[]),
        step(&arrange::PASS, RowName::CULL_TO_ARRANGE, &[(RowName::FOUND_TO_HOST, Resource::FoundCounts)]),
        step(&fill::PASS, RowName::ARRANGE_TO_FILL, &[(RowName::FILL_TO_DRAWS, culled)]),
    ]
}

/// The depth pre-pass, where the plan has one, in the subpass that shades or stores surfaces.
///
/// # Errors
/// When the device cannot compile a pipeline.
pub(super) fn prepass(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Depth>> {
    let &FrameParts { device, plan, frame_layout, .. } = parts;
    let Some(slot) = passes.slot(&depth::PASS) else { return Ok(None) };
    // FORWARD writes light alone.
    let locations = if plan.is_forward() { 1 } else { plan.geometry_locations() };
    Ok(Some(Depth::new(device, plan, slot, frame_layout, locations)?))
}

/// Carries out a row that is a pipeline barrier on an image, where the plan has it.
pub(super) fn image_barrier(device: &Device, cmd: vk::CommandBuffer, image: impl Into<ImageRange>, row: Option<&Edge>) {
    if let Some(edge) = row
        && let Carrier::ImageBarrier(old, new) = edge.carrier
    {
        barrier::image_barrier(device, cmd, image, edge.order(), [old, new]);
    }
}

/// Clear values of these targets.
fn clear_values(plan: &FramePlan, world: &World, targets: &[Target]) -> Vec<vk::ClearValue> {
    let color = |color: Vec3| vk::ClearValue { color: vk::ClearColorValue { float32: color.extend(1.0).to_array() } };
    targets
        .iter()
        .map(|&target| match target {
            // Reversed Z: infinity.
            Target::Depth | Target::Occluders => {
                vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } }
            }
            // Alpha of the sums is 1: no surface has covered anything yet.
            Target::Hdr | Target::Samples | Target::Output => color(background(plan, world, target)),
            // Half rough, and a direction in any encoding: see GEOMETRY.
            Target::Material => color(Vec3::splat(0.5)),
            Target::Normal if plan.format_of(target) == Some(vk::Format::R16G16_UINT) => {
                vk::ClearValue { color: vk::ClearColorValue { uint32: [40_000, 50_000, 0, 0] } }
            }
            Target::Normal => color(Vec3::new(0.3, 0.6, 0.7)),
            // No vector.
            Target::Velocity => vk::ClearValue::default(),
            _ => color(Vec3::ZERO),
        })
        .collect()
}

/// Returns the light of the background.
pub(super) fn exposed_background(plan: &FramePlan, world: &World) -> Vec3 {
    match plan.shading {
        // As in the shaders: cut off before it is stored or mapped, so that nothing overflows on the way.
        Shading::Light { light_only: false } => {
            (world.environment.background * world.exposure).min(Vec3::splat(plan.largest_light()))
        }
        _ => Vec3::ZERO,
    }
}

/// Returns the clear colour of a target.
pub(super) fn background(plan: &FramePlan, world: &World, target: Target) -> Vec3 {
    if !matches!(plan.shading, Shading::Light { light_only: false }) {
        return Vec3::ZERO;
    }
    let exposed = exposed_background(plan, world);
    match plan.tone_mapping {
        ToneMapping::InLighting(curve) => tone_map_up_to(plan.headroom(), exposed, curve),
        ToneMapping::Subpass(_) | ToneMapping::Kept if target == Target::Output => Vec3::ZERO,
        _ => exposed,
    }
}
