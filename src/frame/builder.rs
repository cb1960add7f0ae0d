//! A renderer in the making: first the steps that need the scene, then the passes, for which a driver's compiler takes its time.

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use super::in_flight::InFlight;
use super::list::{QueuePart, StepList};
use super::rows::Rows;
use super::{BuildContext, DrawCounts, Error, Frame, IN_FLIGHT, Renderer, Timeline};
use crate::gpu::{self, CommandBuffer, Device, Queue, Timestamps};
use crate::gpu_scene::{
    CullingBuffers, GpuScene, Instances, PoseBuffer, ShadowAtlas, SortedIndices, UploadSource, ViewBuffers,
    VisibilityLookup, view_set_layout,
};
use crate::passes::{air, backdrop, prefilter};
use crate::plan::FramePlan;
use crate::scene::{Settings, exposure_scale, metered_ev100};
use crate::visible::{ShadowCache, World};

/// The buffers of passes that set 0 names.
pub(super) fn named_buffers(frame: &Frame) -> [Option<&gpu::Buffer>; 2] {
    [air::LIGHT, backdrop::LEVELS].map(|resource| frame.buffer(resource))
}

/// All of a renderer that the scene is needed for.
pub(super) struct RendererBuilder {
    device: Arc<Device>,
    plan: FramePlan,
    settings: Settings,
    rows: Rows,
    world: World,
    scene: Arc<GpuScene>,
}

impl RendererBuilder {
    /// Uploads the scene, unless it is on the device already as the plan has it.
    ///
    /// # Errors
    /// When the device lacks the memory or is lost.
    pub(super) fn new<'a>(
        device: &Arc<Device>,
        source: impl Into<UploadSource<'a>>,
        settings: &Settings,
        (plan, rows): (FramePlan, Rows),
        uploaded: Option<Arc<GpuScene>>,
    ) -> Result<Self, Error> {
        let mut source = source.into();
        let scene = source.scene();
        let exposure = match plan.exposes {
            true => exposure_scale(settings.exposure.unwrap_or_else(|| metered_ev100(scene))),
            false => 1.0,
        };
        let world = World::of(scene, settings, &plan, exposure);
        let scene = match uploaded {
            Some(uploaded) => uploaded,
            None => {
                let scene = GpuScene::new(device, &mut source, &plan, rows.upload_order())?;
                if let (Some(sky), Some(planned), Some(order)) = (&scene.sky, &plan.effects.sky, rows.prefilter_order())
                {
                    prefilter::submit(device, sky, planned, order)?;
                }
                Arc::new(scene)
            }
        };
        Ok(Self { device: Arc::clone(device), plan, settings: settings.clone(), rows, world, scene })
    }

    /// As [`Renderer::uploaded_for`].
    #[cfg(feature = "present")]
    pub(super) fn uploaded_for(&self, plan: &FramePlan) -> Option<Arc<GpuScene>> {
        self.plan.uploads_as(plan).then(|| Arc::clone(&self.scene))
    }

    /// Takes the parts that change when frames of the same structure go on.
    pub(super) fn into_world(self) -> (World, FramePlan) {
        (self.world, self.plan)
    }

    /// Makes every pass, in any thread. `swapchain` has the views of the images that frames are presented in.
    ///
    /// # Errors
    /// When the device lacks the memory, or cannot compile a pipeline.
    pub(super) fn finish(self, swapchain: &[vk::ImageView]) -> Result<Renderer, Error> {
        let Self { device, plan, settings, rows, world, scene } = self;
        let frame_layout = view_set_layout(&device, &plan)?;
        let atlas = match (&plan.shadow, rows.clear_orders()) {
            (Some(shadow), Some(orders)) => Some(ShadowAtlas::new(&device, shadow, IN_FLIGHT, orders)?),
            _ => None,
        };
        let deforms = &plan.meshes.deforms;
        let poses = (0..IN_FLIGHT).map(|index| PoseBuffer::new(&device, index, deforms));
        let poses: Vec<_> = poses.filter_map(Result::transpose).collect::<gpu::Result<_>>()?;
        let culling = CullingBuffers::new(&device, &plan, IN_FLIGHT)?;
        let seen = VisibilityLookup::new(&device, &plan, &scene, IN_FLIGHT)?;
        let frame = Frame::new(&BuildContext {
            device: &device,
            plan: &plan,
            rows: &rows,
            frame_layout: frame_layout.raw,
            atlas: atlas.as_ref(),
            scene: &scene,
            world: &world,
            poses: &poses,
            culling: culling.as_ref(),
            seen: seen.as_ref(),
            swapchain,
        })?;
        // Timestamps: the begin of a frame, and the end of each of its passes and of each pass over the picture.
        let times = StepList::of(&plan).passes().count() as u32 + 2;
        let of_world = (&world, scene.sky.as_ref(), named_buffers(&frame));
        let parts = frame.parts();
        let before = &parts[..parts.len().saturating_sub(1)];
        let runs_beside = before.iter().any(|part| part.queue != Queue::Graphics);
        let in_flight = |index| {
            let part = |(place, own): (usize, &QueuePart)| {
                CommandBuffer::on(&device, own.queue, &format!("frame {index}, part {place}"))
            };
            let beside = match runs_beside {
                true => Timestamps::new(&device, Queue::Compute, &format!("times beside frame {index}"), times)?,
                false => None,
            };
            Ok(InFlight {
                cmd: CommandBuffer::new(&device, &format!("frame {index}"))?,
                before: before.iter().enumerate().map(part).collect::<gpu::Result<_>>()?,
                beside,
                view: ViewBuffers::new(&device, index, frame_layout.raw, &plan, of_world)?,
                sorted: SortedIndices::new(&device, index, &plan)?,
                instances: Instances::new(index, &plan),
                times: Timestamps::new(&device, Queue::Graphics, &format!("times of frame {index}"), times)?,
                ticket: None,
                begun: Instant::now(),
                record_ms: 0.0,
                submit_ms: 0.0,
                drawn: DrawCounts::default(),
            })
        };
        let frames = (0..IN_FLIGHT).map(in_flight).collect::<gpu::Result<_>>()?;
        let timeline = Timeline::of(plan.averaged_frames());
        Ok(Renderer {
            device,
            plan,
            settings,
            rows,
            world,
            scene,
            frame,
            atlas,
            shadow_cache: ShadowCache::default(),
            copy: None,
            frames,
            poses,
            posed: 0,
            culling,
            seen,
            next: 0,
            timeline,
            frame_layout,
        })
    }
}
