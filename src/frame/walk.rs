//! The objects of a plan's passes, and the walk that makes and records them in the order of the list ([`super::deferred`]). One function begins and ends
//! render passes, and one records barriers; the passes after the picture do both themselves.

use std::ops::Range;
use std::sync::Arc;

use ash::vk;

use super::IN_FLIGHT;
use super::list::{Commands, Condition, HandOver, QueuePart, RenderPassName, Step, Subpass};
use super::render_passes::{BeginPass, RenderPasses};
use super::rows::widened::EVERYTHING;
use super::rows::{Endpoint, RowName, Rows, SyncKind};
use super::simulation::Simulation;
use crate::gpu::barrier::{self, Half, ImageRange};
use crate::gpu::{self, Buffer, Device, Image, PartWait, Queue, RecordedPass, Timestamps};
use crate::gpu_scene::{CullingBuffers, GpuScene, PoseBuffer, ShadowAtlas, VisibilityLookup};
use crate::passes::object::buffers;
use crate::passes::{FrameContext, Making, MapRecording, Pass, PassObject, PassRecorder, Resource, SetLayouts, Tile};
use crate::plan::{FramePlan, Target};
use crate::visible::{Visible, World};

/// The inputs from which frames are made.
#[derive(Clone, Copy)]
pub(crate) struct BuildContext<'a> {
    pub device: &'a Arc<Device>,
    pub plan: &'a FramePlan,
    /// Every stage, access and layout of its dependencies.
    pub rows: &'a Rows,
    /// The layout of set 0.
    pub frame_layout: vk::DescriptorSetLayout,
    /// The shadow maps, if the plan has any.
    pub atlas: Option<&'a ShadowAtlas>,
    pub scene: &'a GpuScene,
    pub world: &'a World,
    /// The poses of the frames in flight, in their order, if the plan deforms objects.
    pub poses: &'a [PoseBuffer],
    /// Present if the plan culls on the device.
    pub culling: Option<&'a CullingBuffers>,
    /// Present if TILED looks up the surfaces that pixels show.
    pub seen: Option<&'a VisibilityLookup>,
    /// Views of the swapchain's images; none where pictures are not presented.
    pub swapchain: &'a [vk::ImageView],
}

impl<'a> BuildContext<'a> {
    /// Collects the inputs of a pass's object, with the objects of the passes before it.
    fn making<'b>(&self, pass: &'static Pass, passes: &'b RenderPasses, before: &'b [PassObject]) -> Making<'b>
    where
        'a: 'b,
    {
        let &Self { device, plan, frame_layout, atlas, scene, world, poses, culling, seen, .. } = self;
        let layouts = SetLayouts { frame: frame_layout, shadows: atlas.map(|atlas| atlas.set_layout.raw) };
        Making {
            device,
            plan,
            layouts,
            targets: &passes.targets,
            scene,
            world,
            atlas,
            poses,
            culling,
            seen,
            in_flight: IN_FLIGHT,
            pass,
            touches: passes.list.touches_with(plan, pass),
            in_render_pass: passes.slot(pass),
            before,
        }
    }
}

/// The frames of a plan: its render passes, and the objects of its passes in their order.
pub(super) struct Frame {
    render_passes: RenderPasses,
    objects: Vec<PassObject>,
    rows: Rows,
    parts: Vec<QueuePart>,
    /// The hazard that frames show, where one is simulated.
    pub(super) simulation: Option<Simulation>,
}

impl Frame {
    /// Makes everything that the plan has, once.
    ///
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline, or the list of passes and the rows contradict each other.
    pub(super) fn new(parts: &BuildContext) -> gpu::Result<Self> {
        let render_passes = RenderPasses::new(parts)?;
        let mut objects: Vec<PassObject> = Vec::new();
        for pass in render_passes.list.passes() {
            let is_made = objects.iter().any(|made| made.pass.name == pass.name);
            if let Some(make) = pass.make.filter(|_| !is_made) {
                let object = make(&parts.making(pass, &render_passes, &objects))?;
                objects.push(PassObject { pass, object });
            }
        }
        let in_queues = render_passes.list.parts();
        Ok(Self { render_passes, objects, rows: parts.rows.clone(), parts: in_queues, simulation: None })
    }

    /// Makes the objects of the picture's size anew: attachments, framebuffers, and the sets that name them.
    #[cfg(feature = "present")]
    pub(super) fn resize(&mut self, parts: &BuildContext) -> gpu::Result<()> {
        self.render_passes.resize(parts)?;
        for index in 0..self.objects.len() {
            let (before, rest) = self.objects.split_at_mut(index);
            let Some(own) = rest.first_mut() else { break };
            own.object.rebind(&parts.making(own.pass, &self.render_passes, before))?;
        }
        Ok(())
    }

    /// Re-exposes the background.
    pub(super) fn expose(&mut self, plan: &FramePlan, world: &World) {
        self.render_passes.expose(plan, world);
        self.objects.iter_mut().for_each(|made| made.object.expose(plan, world));
    }

    /// Lets each pass write its own data for one frame in flight. The frame that used it before must be done.
    pub(super) fn write(&self, slot: usize, visible: &Visible) -> gpu::Result<()> {
        self.objects.iter().try_for_each(|made| made.object.write(slot, visible))
    }

    /// A buffer that a pass has made, where the plan has it.
    pub(super) fn buffer(&self, resource: Resource) -> Option<&Buffer> {
        buffers(&self.objects, resource).next()
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame, unless it is in an image of the swapchain.
    pub(super) fn output(&self, plan: &FramePlan) -> Option<&Image> {
        self.render_passes.targets.find(plan.picture())
    }

    /// The parts of each frame that go to one queue each. The last one goes to the graphics queue.
    pub(super) fn parts(&self) -> &[QueuePart] {
        &self.parts
    }

    /// The earlier part that a part waits for before these stages, if it does.
    pub(super) fn after(&self, part: &QueuePart) -> Option<PartWait> {
        let (earlier, row) = part.after?;
        // Without the row an experiment waits at the bottom of the pipe: no command does, and yet the fence of the last part stands for all of them.
        Some((earlier, self.rows.find(row)?.after.stage))
    }

    /// Records one frame: each part into its command buffer, and PRESENT, if the plan has it, into the last one, which is the frame's own. Timestamps
    /// of other queues go to the second of `times`.
    pub(super) fn record(
        &self,
        frame: &FrameContext,
        before: &[vk::CommandBuffer],
        [times, beside]: [&mut Option<Timestamps>; 2],
    ) {
        let cmds = before.iter().copied().chain([frame.cmd]);
        for (part, cmd) in self.parts.iter().zip(cmds) {
            let earlier = frame.earlier.map(|earlier| FrameContext { cmd, ..*earlier });
            let frame = FrameContext { cmd, earlier: earlier.as_ref(), ..*frame };
            let times = if part.queue == Queue::Graphics { &mut *times } else { &mut *beside };
            if part.queue == Queue::Graphics && part.steps.start > 0 {
                // A command buffer knows nothing of the state that an earlier one has set, and not every pass sets viewport and scissor.
                frame.set_area();
            }
            self.part(&frame, part.steps.clone(), times);
        }
        self.render_passes.record_present(frame, times);
    }

    /// Each step of a part in its turn.
    fn part(&self, frame: &FrameContext, part: Range<usize>, times: &mut Option<Timestamps>) {
        let mut last: Option<&'static Pass> = None;
        let steps = &self.render_passes.list.0;
        for (index, step) in steps.iter().enumerate().take(part.end).skip(part.start) {
            if self.rows.has_full_barriers {
                barrier::memory_barrier(frame.device, frame.cmd, EVERYTHING);
            }
            match step {
                // All render passes of a map come one after the other, with the first of them.
                Step::RenderPass(name, _) if name.draws_maps() => {
                    let of_maps: Vec<_> =
                        self.render_passes.list.render_passes().filter(|(own, _)| own.draws_maps()).collect();
                    if of_maps[0].0 == *name {
                        self.maps(frame, &of_maps, times);
                    }
                }
                Step::RenderPass(name, subpasses) => self.render_pass(frame, (*name, subpasses), times),
                Step::Commands(own) if own.pass.make.is_some() => {
                    // A pass of several steps stands twice, and the second time is about all steps but the first.
                    if last.is_none_or(|last| last.name != own.pass.name) {
                        let again = steps.get(index + 1).and_then(|next| next.again(own.pass));
                        self.commands(frame, (own, again), times);
                    }
                    last = Some(own.pass);
                }
                Step::HandOver(own) => {
                    self.hand_over(frame, own);
                    if own.half == Half::Acquire
                        && own.queues[1] == Queue::Compute
                        && let Some(times) = times
                    {
                        times.write(frame.cmd, vk::PipelineStageFlags2::COMPUTE_SHADER, "begin");
                    }
                }
                // Steps after the picture are recorded where the picture is shown or copied.
                Step::Commands(_) | Step::Presentation => {}
            }
        }
    }

    /// Records one half of an ownership transfer between two queues. The semaphore belongs to the submission.
    fn hand_over(&self, frame: &FrameContext, own: &HandOver) {
        let Some(row) = self.rows.find(RowName::ownership(own.queues)) else { return };
        let image =
            |&(target, layout): &(Target, _)| (ImageRange::from(self.render_passes.targets.image(target)), layout);
        let images: Vec<_> = own.targets.iter().map(image).collect();
        barrier::hand_over(frame.device, frame.cmd, own.half, own.queues, (&images, &[]), row.order());
    }

    // ANCHOR: render-pass
    /// A render pass from begin to end. Rows are its dependencies ([`super::render_pass`]): a subpass waits as it begins, and later commands wait for the end.
    fn render_pass(
        &self,
        frame: &FrameContext,
        (name, subpasses): (RenderPassName, &[Subpass]),
        times: &mut Option<Timestamps>,
    ) {
        let Some(begin) = self.render_passes.begin(frame, name) else { return };
        self.subpasses(frame, (begin, subpasses), times);
    }

    /// The render passes of shadow maps: once for each map that the frame draws anew, all of them with one time, and in a label that is there if no map is drawn.
    fn maps(
        &self,
        frame: &FrameContext,
        render_passes: &[(RenderPassName, &[Subpass])],
        times: &mut Option<Timestamps>,
    ) {
        let passes = || render_passes.iter().flat_map(|(_, subpasses)| *subpasses).flat_map(|own| &own.passes);
        let (Some(named), Some(last)) = (passes().next(), passes().last()) else { return };
        frame.begin(named);
        let mut first = 0;
        for draw in frame.stale_maps {
            let Some(view) = &frame.visible.shadows[draw.map] else { continue };
            let map = MapRecording::of(frame.world, draw, view, first);
            for &(name, subpasses) in render_passes {
                if let Some(begin) = self.render_passes.begin_map(name, &map) {
                    self.subpasses(&FrameContext { map: Some(map), ..*frame }, (begin, subpasses), &mut None);
                }
            }
            first += draw.casters.len() as u32;
        }
        frame.end(times, last);
    }

    fn subpasses(
        &self,
        frame: &FrameContext,
        (begin, subpasses): (BeginPass, &[Subpass]),
        times: &mut Option<Timestamps>,
    ) {
        let cmd = frame.cmd;
        match begin {
            BeginPass::Object(begin) => {
                let begun = RecordedPass::begin(frame.device, cmd, &begin);
                for (index, subpass) in subpasses.iter().enumerate() {
                    if index > 0 {
                        begun.next_subpass();
                    }
                    self.subpass(frame, subpass, times);
                }
                begun.end();
            }
            BeginPass::Rendering(rendering, images, clears, area) => {
                let draw = |subpass: &Subpass| self.subpass(frame, subpass, times);
                rendering.record((frame.device, cmd), (&images, clears), area, subpasses, draw);
            }
        }
    }

    /// The passes of a subpass. In one subpass rasterization order alone puts a pass after the one before it.
    fn subpass(&self, frame: &FrameContext, subpass: &Subpass, times: &mut Option<Timestamps>) {
        let frame = self.seen_at(subpass.place, frame);
        let tiles = self.simulation.as_ref().and_then(|own| own.tiles(subpass.place));
        let mut untimed = None;
        for (position, pass) in subpass.passes.iter().enumerate() {
            // Neighbours that share a time get one stamp, after the last of them.
            let shares = subpass.passes.get(position + 1).is_some_and(|next| next.time == pass.time);
            let times = if shares { &mut untimed } else { &mut *times };
            self.pass(pass, (frame, tiles.as_deref()), times);
        }
    }
    // ANCHOR_END: render-pass

    // ANCHOR: commands
    /// A pass outside of render passes, between its barriers. `again` has the barriers between its steps, and after the last.
    fn commands(
        &self,
        frame: &FrameContext,
        (own, again): (&Commands, Option<&Commands>),
        times: &mut Option<Timestamps>,
    ) {
        if own.when == Condition::Posed && !frame.posed {
            return;
        }
        let frame = self.seen_at(own.pass.name, frame);
        frame.begin(own.pass);
        self.barriers(frame, &own.before);
        let between = || again.into_iter().for_each(|again| self.barriers(frame, &again.before));
        if let Some(object) = self.object(own.pass) {
            object.record(&FrameContext { between: &between, ..*frame });
        }
        self.barriers(frame, again.map_or(&own.after, |again| &again.after));
        frame.end(times, own.pass);
    }
    // ANCHOR_END: commands

    /// A pass in its subpass: once, or once for each tile where not all of the attachment is drawn.
    fn pass(
        &self,
        pass: &'static Pass,
        (frame, tiles): (&FrameContext, Option<&[Tile]>),
        times: &mut Option<Timestamps>,
    ) {
        frame.begin(pass);
        match (self.object(pass), tiles) {
            (Some(object), Some(tiles)) => {
                for &tile in tiles {
                    let of_tile = FrameContext { tile: Some(tile), ..*frame };
                    // Not every pass sets viewport and scissor: some draw where an earlier one of their render pass has set them.
                    of_tile.set_area();
                    object.record(&of_tile);
                }
                frame.set_area();
            }
            (Some(object), None) => object.record(frame),
            (None, _) => {}
        }
        frame.end(times, pass);
    }

    /// The frame as the passes at a place see it: as the last frame saw it where their result is to be stale.
    fn seen_at<'a>(&self, place: Endpoint, frame: &'a FrameContext<'a>) -> &'a FrameContext<'a> {
        let is_earlier = self.simulation.as_ref().is_some_and(|own| own.is_earlier(place));
        frame.earlier.filter(|_| is_earlier).unwrap_or(frame)
    }

    fn object(&self, pass: &Pass) -> Option<&dyn PassRecorder> {
        self.objects.iter().find(|made| made.pass.name == pass.name).map(|made| &*made.object)
    }

    /// Carries out rows that are pipeline barriers, each on its image or on its buffers.
    fn barriers(&self, frame: &FrameContext, rows: &[(RowName, Resource)]) {
        for &(name, resource) in rows {
            let Some(row) = self.rows.find(name) else { continue };
            match (resource, row.carrier) {
                (Resource::Target(target), SyncKind::ImageBarrier(old, new)) => {
                    let image = self.render_passes.targets.image(target);
                    barrier::image_barrier(frame.device, frame.cmd, ImageRange::from(image), row.order(), [old, new]);
                }
                _ => barrier::buffer_barriers(frame.device, frame.cmd, &self.buffers(frame, resource), row.order()),
            }
        }
    }

    /// The buffers of a resource, in this frame.
    fn buffers<'a>(&'a self, frame: &'a FrameContext, resource: Resource) -> Vec<&'a Buffer> {
        match (resource, frame.culling) {
            (Resource::DeformedVertices, _) => frame.scene.deformed.iter().map(|own| &own.vertices).collect(),
            (Resource::CulledInstances, Some(culling)) => vec![&culling.culled],
            (Resource::FoundCounts, Some(culling)) => vec![culling.found_buffer(frame.in_flight)],
            (Resource::DepthPyramid, Some(culling)) => culling.pyramid.iter().collect(),
            _ => buffers(&self.objects, resource).collect(),
        }
    }

    /// Records PRESENT once more, for a picture that lies where the last frame left it.
    #[cfg(feature = "present")]
    pub(super) fn present_again(&self, device: &Device, cmd: vk::CommandBuffer, image: (vk::Image, vk::Extent2D)) {
        self.render_passes.present_into(device, cmd, image);
    }
}

impl Step {
    /// Returns the commands if they are of the same pass.
    fn again(&self, pass: &Pass) -> Option<&Commands> {
        match self {
            Self::Commands(own) if own.pass.name == pass.name => Some(own),
            _ => None,
        }
    }
}
