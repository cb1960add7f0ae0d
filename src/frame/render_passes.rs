//! The parts that every kind of frame has: the images that it draws into, and its render passes with their framebuffers and clear values.

use std::sync::Arc;

use ash::vk;
use glam::Vec3;

use super::BuildContext;
use super::list::{RenderPassName, StepList, Subpass};
use super::render_pass::PassDescription;
use super::rendering::{Rendered, Rendering};
use super::rows::{Row, RowName, SyncKind};
use crate::gpu::barrier::{self, ImageRange};
use crate::gpu::sync::Layouts;
use crate::gpu::{self, Device, Framebuffer, RenderPass, Timestamps, framebuffer};
use crate::gpu_scene::ShadowAtlas;
use crate::passes::background::background;
use crate::passes::present;
use crate::passes::{FrameContext, MapRecording, Pass, Resource, Slot};
use crate::plan::{FramePlan, Target};
use crate::scene::Passes;
use crate::targets::{Framebuffers, Targets};
use crate::visible::World;

/// The targets of a frame, and the render passes that draw into them.
pub struct RenderPasses {
    pub targets: Targets,
    pub list: StepList,
    passes: Vec<DevicePass>,
    maps: Vec<MapPass>,
    present: Option<PresentStage>,
}

/// A render pass on the device.
struct DevicePass {
    name: RenderPassName,
    targets: Vec<Target>,
    /// Some attachment is cleared.
    clears_some: bool,
    form: PassForm,
    clears: Vec<vk::ClearValue>,
}

/// The form in which a render pass of the list is recorded.
enum PassForm {
    /// A Vulkan render pass object.
    Object(RenderPass, Framebuffers),
    /// Dynamic rendering, with the views of the swapchain's images.
    Rendering(Box<Rendering>, Vec<vk::ImageView>),
}

/// A render pass of shadow maps on the device.
struct MapPass {
    name: RenderPassName,
    form: MapForm,
    clears: Vec<vk::ClearValue>,
}

enum MapForm {
    /// A render pass object, with a framebuffer for each layer of the maps.
    Object(RenderPass, Vec<Framebuffer>),
    /// Dynamic rendering, with the attachments of each layer.
    Rendering(Box<Rendering>, Vec<Vec<Rendered>>),
}

/// A render pass that can be recorded in a frame.
pub enum BeginPass<'a> {
    Object(vk::RenderPassBeginInfo<'a>),
    /// Dynamic rendering, with this frame's images, the clear values and the area.
    Rendering(&'a Rendering, Vec<Rendered>, &'a [vk::ClearValue], vk::Rect2D),
}

/// PRESENT, with the picture that it copies and the rows of the barriers around it.
struct PresentStage {
    picture: Target,
    /// The image that is shown has the same texels. A compute pass writes its own order of channels.
    is_alike: bool,
    layouts: Layouts,
    before: Row,
    after: Row,
}

impl RenderPasses {
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline, or the list of passes and the rows contradict each other.
    pub fn new(parts: &BuildContext) -> gpu::Result<Self> {
        let &BuildContext { device, plan, rows, world, swapchain, atlas, .. } = parts;
        let list = StepList::of(plan);
        list.check(plan, rows)?;
        let targets = Targets::new(device, plan, |target| list.usage(plan, target))?;
        let (mut passes, mut maps) = (Vec::new(), Vec::new());
        for description in PassDescription::all(plan, rows) {
            let name = description.name;
            if name.draws_maps() {
                maps.extend(atlas.map(|atlas| MapPass::new(device, plan, description, atlas)).transpose()?);
                continue;
            }
            let own = description.targets();
            let cleared = |own: &vk::AttachmentDescription| own.load_op == vk::AttachmentLoadOp::CLEAR;
            let clears_some = description.attachments.iter().any(|(_, own)| cleared(own));
            let form = match plan.passes {
                Passes::LocalRead => PassForm::Rendering(Box::new(Rendering::new(description)), swapchain.to_vec()),
                Passes::Subpasses | Passes::Stored => {
                    let pass = description.make(device)?;
                    let framebuffers = targets.framebuffers(plan, (device, &pass), &own, swapchain)?;
                    PassForm::Object(pass, framebuffers)
                }
            };
            passes.push(DevicePass { name, form, clears_some, clears: Vec::new(), targets: own });
        }
        let row = |name| rows.find(name).cloned();
        let rows = row(RowName::SWAPCHAIN_TO_PRESENT).zip(row(RowName::PRESENT_TO_SWAPCHAIN));
        let present = rows.map(|(before, after)| PresentStage {
            picture: plan.picture(),
            is_alike: !plan.is_tiled(),
            layouts: plan.layouts,
            before,
            after,
        });
        let mut made = Self { targets, list, passes, maps, present };
        made.expose(plan, world);
        Ok(made)
    }

    /// Makes the images and framebuffers anew, which have the size of the picture.
    pub fn resize(&mut self, parts: &BuildContext) -> gpu::Result<()> {
        let &BuildContext { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan, |target| self.list.usage(plan, target))?;
        for made in &mut self.passes {
            match &mut made.form {
                PassForm::Object(pass, framebuffers) => {
                    *framebuffers = self.targets.framebuffers(plan, (device, pass), &made.targets, swapchain)?;
                }
                PassForm::Rendering(_, views) => *views = swapchain.to_vec(),
            }
        }
        Ok(())
    }

    /// Re-exposes the background's clear colours.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        for made in self.passes.iter_mut().filter(|made| made.clears_some) {
            made.clears = clear_values(plan, world, &made.targets);
        }
    }

    /// Returns the render pass and the subpass to which a pass's pipelines belong, if the frame has it in a subpass.
    pub fn slot(&self, pass: &Pass) -> Option<Slot> {
        let draws = |name: RenderPassName, subpasses: &[Subpass]| {
            let subpass = subpasses.iter().position(|own| own.passes.iter().any(|one| one.name == pass.name))?;
            let of_rendering = |own: &Rendering| own.places.get(subpass).cloned().map(Slot::Rendering);
            let of_object = |own: &RenderPass| Some(Slot::Subpass(own.raw, subpass as u32));
            match self.maps.iter().find(|made| made.name == name).map(|made| &made.form) {
                Some(MapForm::Object(pass, _)) => return of_object(pass),
                Some(MapForm::Rendering(rendering, _)) => return of_rendering(rendering),
                None => {}
            }
            match &self.find(name)?.form {
                PassForm::Object(pass, _) => of_object(pass),
                PassForm::Rendering(rendering, _) => of_rendering(rendering),
            }
        };
        self.list.render_passes().find_map(|(name, subpasses)| draws(name, subpasses))
    }

    fn find(&self, name: RenderPassName) -> Option<&DevicePass> {
        self.passes.iter().find(|made| made.name == name)
    }

    /// Returns the arguments that begin a render pass in this frame.
    pub fn begin(&self, frame: &FrameContext, name: RenderPassName) -> Option<BeginPass<'_>> {
        let made = self.find(name)?;
        match &made.form {
            PassForm::Object(pass, framebuffers) => {
                let begin = vk::RenderPassBeginInfo::default()
                    .render_pass(pass.raw)
                    .framebuffer(framebuffers.of(frame.image))
                    .render_area(frame.area())
                    .clear_values(&made.clears);
                Some(BeginPass::Object(begin))
            }
            PassForm::Rendering(rendering, shown) => {
                let image = |&target: &Target| match self.targets.find(target) {
                    Some(own) => Some(Rendered { image: ImageRange::from(own), view: own.view }),
                    None => {
                        let (image, _) = frame.swapchain_image?;
                        let view = *shown.get(frame.image)?;
                        Some(Rendered { image: ImageRange::whole(image, vk::ImageAspectFlags::COLOR), view })
                    }
                };
                let images = made.targets.iter().map(image).collect::<Option<_>>()?;
                Some(BeginPass::Rendering(rendering, images, &made.clears, frame.area()))
            }
        }
    }

    /// Returns the arguments that begin a render pass of shadow maps for one map, if the plan has maps.
    pub fn begin_map(&self, name: RenderPassName, map: &MapRecording) -> Option<BeginPass<'_>> {
        let made = self.maps.iter().find(|made| made.name == name)?;
        let layer = map.view.tile.layer as usize;
        match &made.form {
            MapForm::Object(pass, layers) => {
                let begin = vk::RenderPassBeginInfo::default()
                    .render_pass(pass.raw)
                    .framebuffer(layers.get(layer)?.raw)
                    .render_area(map.area())
                    .clear_values(&made.clears);
                Some(BeginPass::Object(begin))
            }
            MapForm::Rendering(rendering, layers) => {
                Some(BeginPass::Rendering(rendering, layers.get(layer)?.clone(), &made.clears, map.area()))
            }
        }
    }

    /// Records PRESENT where the plan has it.
    pub fn record_present(&self, frame: &FrameContext, times: &mut Option<Timestamps>) {
        if let (Some(_), Some(image)) = (&self.present, frame.swapchain_image) {
            self.present_into(frame.device, frame.cmd, image);
            Timestamps::stamp(times, frame.cmd, present::PASS.time);
        }
    }

    /// Records the copy of the picture into the image that is shown, outside a render pass, where the plan has it.
    pub fn present_into(&self, device: &Device, cmd: vk::CommandBuffer, (image, extent): (vk::Image, vk::Extent2D)) {
        let Some(stage) = &self.present else { return };
        device.begin_label(cmd, present::PASS.name.name());
        let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
        // Presentation, or ENCODE, may still have read the image: all of it is written.
        image_barrier(device, cmd, whole, Some(&stage.before));
        let picture = self.targets.image(stage.picture);
        present::record(device, cmd, (picture, stage.is_alike), (image, extent), stage.layouts);
        image_barrier(device, cmd, whole, Some(&stage.after));
        device.end_label(cmd);
    }
}

impl MapPass {
    fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        description: PassDescription,
        atlas: &ShadowAtlas,
    ) -> gpu::Result<Self> {
        let name = description.name;
        let image = |&(resource, _): &(Resource, _)| match resource {
            Resource::SHADOW_TINTS => atlas.tints(),
            _ => Some(atlas.depth()),
        };
        let images: Vec<_> = description.attachments.iter().filter_map(image).collect();
        let clears = images.iter().map(|own| own.clear).collect();
        let layers = 0..atlas.layers();
        let form = match plan.passes {
            Passes::LocalRead => {
                let of_layer = |layer: usize| {
                    images.iter().map(|own| Rendered { image: own.layer(layer), view: own.views[layer].raw }).collect()
                };
                MapForm::Rendering(Box::new(Rendering::new(description)), layers.map(of_layer).collect())
            }
            Passes::Subpasses | Passes::Stored => {
                let pass = description.make(device)?;
                let of_layer = |layer: usize| {
                    let name = format!("{name} framebuffer, layer {layer}");
                    let views: Vec<_> = images.iter().map(|own| own.views[layer].raw).collect();
                    framebuffer(device, &name, pass.raw, &views, atlas.extent())
                };
                let layers = layers.map(of_layer).collect::<gpu::Result<_>>()?;
                MapForm::Object(pass, layers)
            }
        };
        Ok(Self { name, form, clears })
    }
}

/// Carries out a row that is a pipeline barrier on an image, where the plan has it.
pub(super) fn image_barrier(device: &Device, cmd: vk::CommandBuffer, image: impl Into<ImageRange>, row: Option<&Row>) {
    if let Some(row) = row
        && let SyncKind::ImageBarrier(old, new) = row.carrier
    {
        barrier::image_barrier(device, cmd, image, row.order(), [old, new]);
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
            // No surface has drawn anything yet.
            Target::OfSurfaces(_) => vk::ClearValue::default(),
            _ => color(Vec3::ZERO),
        })
        .collect()
}
