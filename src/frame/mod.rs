//! Frames: the commands recorded for each and their order, and the renderer that keeps two of them in flight.

mod accumulate;
mod builder;
#[cfg(feature = "caches")]
pub mod calibration;
mod capabilities;
mod changes;
mod complexity;
mod deferred;
mod figures;
mod in_flight;
mod jitter;
pub mod list;
mod picture;
#[cfg(feature = "present")]
mod present;
mod read_back;
#[cfg(feature = "present")]
mod rebuild;
pub mod rows;
mod simulation;
// Drawings of a frame name its render passes.
#[doc(hidden)]
pub mod render_pass;
mod render_passes;
// The proof models the barriers around rendering.
#[doc(hidden)]
pub mod rendering;
#[cfg(feature = "present")]
mod split;
mod timeline;
mod triangles;
mod walk;

#[cfg(feature = "present")]
pub use crate::passes::encode::WHITE_NITS;
pub use accumulate::Accumulator;
pub use capabilities::capabilities;
pub use changes::Changed;
pub use complexity::Complexity;
pub use figures::{DrawCounts, FrameTimes};
pub use jitter::{JitterSequence, lens_point, moment, sample_offset};
pub use picture::{Picture, Pixels};
#[cfg(feature = "present")]
pub use present::{FitOutcome, Outcome, Presenter};
#[cfg(feature = "present")]
pub use rebuild::Wake;
pub use render_pass::{LayoutChange, layout_changes};
pub use simulation::{HazardPicture, MissingRow, Simulation};
pub use timeline::FRAMES_A_SECOND;
pub use triangles::triangles;
pub(crate) use walk::BuildContext;

use builder::RendererBuilder;
use in_flight::InFlight;
use rows::Rows;
use simulation::earlier_camera;
use timeline::Timeline;
use walk::Frame;

use std::sync::Arc;
use std::time::Instant;

use ash::vk;

use crate::gpu::{self, CommandBuffer, Device, Owned, Part, Queue, SubmitOptions};
use crate::gpu_scene::{
    CullingBuffers, FrameUniform, GpuScene, PoseBuffer, ShadowAtlas, SortedIndices, VisibilityLookup,
};
use crate::passes::FrameContext;
use crate::passes::copy::Copy;
use crate::plan::{self, FramePlan};
use crate::scene::{self, Camera, Scene, Settings};
use crate::visible::{Eye, MapDraw, Reprojection, STEPS, ShadowCache, Visible, World};

/// While the device draws one frame, the CPU records the next.
#[doc(hidden)]
pub const IN_FLIGHT: usize = 2;

/// A renderer that could not be made, or a frame that could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The settings cannot be planned for this scene and device.
    #[error(transparent)]
    Plan(#[from] plan::PlanError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] gpu::Error),
}

impl From<scene::Error> for Error {
    fn from(error: scene::Error) -> Self {
        Self::Plan(error.into())
    }
}

/// A frame that is recorded and not submitted yet.
struct Recorded {
    camera: Camera,
    visible: Visible,
    stale_maps: Vec<MapDraw>,
    /// The revision of the world's pose that it draws.
    pose: u64,
    reprojection: Option<Reprojection>,
}

/// Draws frames of one scene with one plan.
pub struct Renderer {
    device: Arc<Device>,
    plan: FramePlan,
    settings: Settings,
    rows: Rows,
    world: World,
    scene: Arc<GpuScene>,
    frame: Frame,
    atlas: Option<ShadowAtlas>,
    shadow_cache: ShadowCache,
    copy: Option<(CommandBuffer, Copy)>,
    frames: Vec<InFlight>,
    /// The poses of the frames in flight, in their order, if the plan deforms objects.
    poses: Vec<PoseBuffer>,
    /// The world's pose that the deformed vertices have; 0: none yet.
    posed: u64,
    /// Present if the plan culls on the device.
    culling: Option<CullingBuffers>,
    /// Present if TILED looks up the surfaces that pixels show.
    seen: Option<VisibilityLookup>,
    next: usize,
    /// The frames so far, where the plan averages them over time.
    timeline: Timeline,
    #[cfg_attr(not(feature = "present"), expect(dead_code, reason = "frames of a window are resized, and no others"))]
    frame_layout: Owned<vk::DescriptorSetLayout>,
}

/// The plan of a scene's frames on a device; creates nothing.
///
/// # Errors
/// When the device cannot do what the settings ask for, or a view needs content that the scene lacks.
pub fn plan_for(device: &Device, scene: &Scene, settings: &Settings) -> Result<FramePlan, plan::PlanError> {
    plan_with(&capabilities(&device.physical), scene, settings)
}

/// Variant of [`plan_for`] for a device with the given capabilities.
///
/// # Errors
/// As [`plan_for`].
pub fn plan_with(
    device: &plan::Capabilities,
    scene: &Scene,
    settings: &Settings,
) -> Result<FramePlan, plan::PlanError> {
    let plan = FramePlan::of(scene, settings, device)?;
    list::local_read::check(&plan, device)?;
    Ok(plan)
}

impl Renderer {
    /// Plans the scene's frames, uploads it and makes every pass. The scene is not needed afterwards.
    ///
    /// # Errors
    /// When the settings cannot be planned on this device, or it lacks the memory.
    pub fn new(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<Self, Error> {
        let plan = plan_for(device, scene, settings)?;
        let rows = rows::table(&plan);
        RendererBuilder::new(device, scene, settings, (plan, rows), None)?.finish(&[])
    }

    /// Variant of [`Renderer::new`] that consumes the scene's content: meshes, textures and sky are freed while they are uploaded, so that memory
    /// never holds them twice. If the frames cannot be planned, the scene stays whole.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn taking(device: &Arc<Device>, scene: &mut Scene, settings: &Settings) -> Result<Self, Error> {
        let plan = plan_for(device, scene, settings)?;
        let rows = rows::table(&plan);
        RendererBuilder::new(device, scene, settings, (plan, rows), None)?.finish(&[])
    }

    /// Makes a renderer of the same scene with other settings; it shares the uploaded scene if both plans upload the same.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn beside(&self, scene: &Scene, settings: &Settings) -> Result<Self, Error> {
        let plan = plan_for(&self.device, scene, settings)?;
        let uploaded = plan.uploads_as(&self.plan).then(|| Arc::clone(&self.scene));
        let rows = rows::table(&plan);
        RendererBuilder::new(&self.device, scene, settings, (plan, rows), uploaded)?.finish(&[])
    }

    /// Variant of [`Renderer::new`] with other dependencies than [`rows::table`] has for the plan, for experiments and proofs: a synchronization
    /// validation layer should report the missing ones.
    ///
    /// # Safety
    /// Without a row or a bit that frames need (`proof::FrameModel` finds a hazard), memory of the device is read and written in any order: the driver's
    /// behaviour is then undefined.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub unsafe fn with_rows(
        device: &Arc<Device>,
        scene: &Scene,
        settings: &Settings,
        rows: Rows,
    ) -> Result<Self, Error> {
        let plan = plan_for(device, scene, settings)?;
        RendererBuilder::new(device, scene, settings, (plan, rows), None)?.finish(&[])
    }

    /// The plan of all frames.
    pub fn plan(&self) -> &FramePlan {
        &self.plan
    }

    /// Records and submits a frame. Returns as soon as it is submitted; waits only for the frame before the last.
    ///
    /// # Errors
    /// When the device is lost or out of memory.
    pub fn render(&mut self, camera: &Camera) -> Result<(), Error> {
        self.render_jittered(camera, [0.0; 2])
    }

    /// Variant of [`Renderer::render`] that samples each pixel at an offset from its centre, in pixels to the right and down.
    ///
    /// # Errors
    /// When the device is lost or out of memory.
    pub fn render_jittered(&mut self, camera: &Camera, jitter: [f64; 2]) -> Result<(), Error> {
        let recorded = self.record(camera, jitter, None)?;
        let ends_frame = self.frame.output(&self.plan).map(|output| output.raw);
        self.submit(recorded, &SubmitOptions { ends_frame, ..SubmitOptions::default() })
    }

    /// Waits until the place of the next frame is free: its buffers are written anew, and so is its semaphore used. The times of the frame that
    /// was there, if there was one.
    // ANCHOR: free-place
    fn free_place(&mut self) -> Result<Option<FrameTimes>, Error> {
        let frame = &mut self.frames[self.next];
        let Some(ticket) = frame.ticket.take() else { return Ok(None) };
        // The row "frame-to-host".
        self.device.wait(ticket)?;
        // ANCHOR_END: free-place
        let found = self.culling.as_ref().map(|culling| culling.found(self.next)).transpose()?;
        Ok(Some(frame.times(&self.device, found)?))
    }

    /// Records a frame, into an image of the swapchain where one is named, and leaves its command buffer open.
    fn record(
        &mut self,
        camera: &Camera,
        jitter: [f64; 2],
        swapchain_image: Option<(usize, (vk::Image, vk::Extent2D))>,
    ) -> Result<Recorded, Error> {
        self.plan.check_camera(camera)?;
        self.free_place()?;
        self.frames[self.next].begun = Instant::now();
        self.world.refresh(&self.plan);
        if self.plan.averages_over_time() {
            // While something moves the directions stay: the mean over time would not follow light that is another in each frame.
            self.world.aim_sky(&self.plan, self.timeline.since_change());
        }
        // ANCHOR: record-frame
        let eye = Eye::of(camera, &self.world.drawn_bounds(&self.plan));
        let camera = &eye.camera;
        let visible = Visible::of(&self.world, camera, &self.plan);
        if !self.world.shadows.cache || self.frame.simulation.is_some() {
            self.shadow_cache = ShadowCache::default();
        }
        let stale_maps = match &self.plan.shadow {
            Some(shadow) => self.shadow_cache.stale(&self.world, shadow, camera, &visible),
            None => Vec::new(),
        };
        let is_averaged = self.plan.averages_over_time();
        let reprojection = is_averaged.then(|| self.timeline.reprojection(&self.world, &visible, &eye, self.plan.size));
        let jitter = reprojection.as_ref().map_or(jitter, |own| own.jitter);
        let earlier = self.write_earlier(&eye, jitter, &visible)?;
        // The submission makes the data visible to the device: the row "host-to-frame".
        self.write_view(self.next, (&eye, jitter), &visible, &stale_maps)?;
        // ANCHOR_END: record-frame
        let posed = !self.poses.is_empty() && self.posed != self.world.pose.revision;
        if posed {
            self.poses[self.next].write(&self.world.pose.joints, &self.world.pose.weights)?;
        }
        let frame = &mut self.frames[self.next];
        frame.each_recording(|cmd| cmd.begin_by(self.plan.sync))?;
        let cmd = frame.cmd.raw;
        let before: Vec<_> = frame.before.iter().map(|part| part.raw).collect();
        let first_of = |queue| frame.before.iter().find(|part| part.queue == queue).map_or(cmd, |part| part.raw);
        let (mut times, mut beside) = (frame.times.take(), frame.beside.take());
        if let Some(times) = &mut times {
            let cmd = first_of(Queue::Graphics);
            times.reset(cmd);
            times.write(cmd, vk::PipelineStageFlags2::TOP_OF_PIPE, "begin");
        }
        if let Some(times) = &mut beside {
            // The first timestamp of the compute queue is written after the acquire.
            times.reset(first_of(Queue::Compute));
        }
        let context = FrameContext {
            textures: &self.plan.textures,
            device: &self.device,
            cmd,
            size: self.plan.size,
            in_flight: self.next,
            posed,
            image: swapchain_image.map_or(0, |(index, _)| index),
            swapchain_image: swapchain_image.map(|(_, image)| image),
            scene: &self.scene,
            world: &self.world,
            visible: &visible,
            frame_set: self.frames[self.next].view.set,
            shadow_set: self.atlas.as_ref().map(|atlas| atlas.set(self.next)),
            instances: &self.frames[self.next].instances,
            culling: self.culling.as_ref(),
            seen_set: self.seen.as_ref().map(|seen| seen.set(self.next)),
            reprojection: reprojection.as_ref(),
            stale_maps: &stale_maps,
            map: None,
            between: &|| (),
            sorted: self.frames[self.next].sorted.as_ref().map(SortedIndices::raw),
            tile: None,
            earlier: None,
        };
        let earlier = earlier.as_ref().map(|visible| {
            let place = self.other_place();
            FrameContext {
                in_flight: place,
                visible,
                frame_set: self.frames[place].view.set,
                shadow_set: self.atlas.as_ref().map(|atlas| atlas.set(place)),
                instances: &self.frames[place].instances,
                seen_set: self.seen.as_ref().map(|seen| seen.set(place)),
                sorted: self.frames[place].sorted.as_ref().map(SortedIndices::raw),
                ..context
            }
        });
        let all_times = [&mut times, &mut beside];
        self.frame.record(&FrameContext { earlier: earlier.as_ref(), ..context }, &before, all_times);
        let frame = &mut self.frames[self.next];
        (frame.times, frame.beside) = (times, beside);
        frame.drawn = DrawCounts {
            objects: visible.opaque_count(),
            found: None,
            on_device: visible.culling.map_or(0, |_| self.world.instances.opaque_count()),
            commands: visible.draws.len()
                + visible.transparent.len()
                + visible.culling.map_or(0, |_| STEPS * self.culling.as_ref().map_or(0, |own| own.states.len())),
            culled: visible.culled,
            occluded: visible.occluded,
            triangles: visible.triangles(&self.world),
            lights: visible.active_lights.lights.len(),
            idle_lights: self.world.lights.len() - visible.active_lights.lights.len(),
            casters: stale_maps.iter().map(|draw| draw.casters.len()).sum(),
            idle_casters: stale_maps.iter().map(|draw| draw.idle).sum(),
            shadow_maps: visible.shadows.iter().flatten().count(),
            shadow_maps_drawn: stale_maps.len(),
        };
        Ok(Recorded { camera: *camera, visible, stale_maps, pose: self.world.pose.revision, reprojection })
    }

    /// Writes the view data that shaders read into the buffers of a frame in flight. Nothing on the device may use them any more.
    fn write_view(
        &mut self,
        place: usize,
        (eye, jitter): (&Eye, [f64; 2]),
        visible: &Visible,
        stale_maps: &[MapDraw],
    ) -> Result<(), Error> {
        let (frame, camera) = (&mut self.frames[place], &eye.camera);
        let uniform = FrameUniform::of(&self.world, visible, eye, &self.plan, jitter);
        frame.view.rename(&self.device, builder::named_buffers(&self.frame));
        frame.view.write(&uniform, (&self.world, &self.plan), visible, camera)?;
        self.frame.write(place, visible)?;
        if let Some(atlas) = &self.atlas {
            atlas.write(place, visible, camera)?;
        }
        if let Some(sorted) = &frame.sorted {
            sorted.write(&visible.sorted_indices)?;
        }
        if let (Some(culling), Some(view)) = (&mut self.culling, &visible.culling) {
            culling.write(
                &self.device,
                place,
                (&self.world, &self.scene),
                (view, visible.levels.as_ref(), uniform.clip_from_world),
            )?;
        }
        let of_scene = (&self.world, &self.plan, &*self.scene);
        frame.instances.write(&self.device, of_scene, (visible, camera), stale_maps)?;
        if let Some(seen) = &mut self.seen {
            let of_frame = (&frame.instances, frame.view.uv_maps());
            seen.write(&self.device, place, (&self.world, &self.plan, &self.scene), visible, of_frame)?;
        }
        Ok(())
    }

    /// Where stale content is simulated: writes the view of an earlier camera into the buffers of the other frame in flight, which is done then.
    /// Returns what that camera sees, with the shadow maps of this frame.
    fn write_earlier(&mut self, eye: &Eye, jitter: [f64; 2], visible: &Visible) -> Result<Option<Visible>, Error> {
        if !self.frame.simulation.as_ref().is_some_and(Simulation::is_stale) {
            return Ok(None);
        }
        self.wait_for_all()?;
        let eye = Eye { camera: earlier_camera(&eye.camera), ..*eye };
        let mut seen = Visible::of(&self.world, &eye.camera, &self.plan);
        seen.shadows.clone_from(&visible.shadows);
        self.write_view(self.other_place(), (&eye, jitter), &seen, &[])?;
        Ok(Some(seen))
    }

    /// Where the frame before the next one was recorded.
    fn other_place(&self) -> usize {
        (self.next + IN_FLIGHT - 1) % IN_FLIGHT
    }

    /// Waits for all frames in flight: the row "frame-to-host".
    fn wait_for_all(&self) -> Result<(), Error> {
        let mut tickets = self.frames.iter().filter_map(|frame| frame.ticket);
        Ok(tickets.try_for_each(|ticket| self.device.wait(ticket))?)
    }

    /// Makes frames show a hazard from the next one on; `None` ends it, and frames are bit-identical to before. Waits for the frames in flight.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn simulate(&mut self, simulation: Option<Simulation>) -> Result<(), Error> {
        if self.frame.simulation != simulation {
            // A simulated frame reads the data of both frames in flight.
            self.wait_for_all()?;
            // Cached shadow maps may lack casters.
            self.shadow_cache = ShadowCache::default();
            self.cut();
            self.frame.simulation = simulation;
        }
        Ok(())
    }

    /// Submits the recorded frame.
    fn submit(&mut self, recorded: Recorded, around: &SubmitOptions) -> Result<(), Error> {
        let Recorded { camera, visible, stale_maps, pose, reprojection } = recorded;
        let frame = &mut self.frames[self.next];
        frame.each_recording(CommandBuffer::end)?;
        frame.record_ms = milliseconds(frame.begun);
        let recorded = Instant::now();
        let plans = self.frame.parts();
        let part = |(cmd, plan)| Part { cmd, after: self.frame.after(plan) };
        let parts: Vec<_> = frame.before.iter().zip(plans).map(part).collect();
        let after = plans.last().and_then(|last| self.frame.after(last));
        let around = SubmitOptions { parts: &parts, after, ..*around };
        frame.ticket = Some(self.device.submit_with(&frame.cmd, &around)?);
        frame.submit_ms = milliseconds(recorded);
        self.posed = pose;
        self.shadow_cache.keep(&self.world, &camera, &visible, &stale_maps);
        if let Some(reprojection) = &reprojection {
            self.timeline.pass(reprojection, &self.world, &visible);
        }
        self.world.previous.forget();
        self.device.collect();
        self.next = (self.next + 1) % IN_FLIGHT;
        Ok(())
    }

    /// Waits for the last frame and tells its times.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn wait(&mut self) -> Result<FrameTimes, Error> {
        let place = self.other_place();
        let frame = &self.frames[place];
        let Some(ticket) = frame.ticket else { return Ok(FrameTimes::default()) };
        self.device.wait(ticket)?;
        let wall_ms = milliseconds(frame.begun);
        let found = self.culling.as_ref().map(|culling| culling.found(place)).transpose()?;
        Ok(FrameTimes { wall_ms, ..frame.times(&self.device, found)? })
    }

    /// The passes of the last frame in the order in which they were recorded, by the names that [`FrameTimes`] has; none on devices without
    /// timestamps.
    pub fn recorded_passes(&self) -> &[String] {
        let times = &self.frames[self.other_place()].times;
        // The first point is the frame's begin.
        times.as_ref().and_then(|times| times.labels().get(1..)).unwrap_or_default()
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // Buffers of frames in flight are destroyed through the retire queue; nothing to wait for here.
        self.device.collect();
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
