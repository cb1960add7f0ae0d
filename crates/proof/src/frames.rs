//! A model of the work of a plan's frames, made from the plan, its render passes and its rows: uploads, frames in flight, copies, and a window's
//! additions.

use ash::vk::{AccessFlags2 as A, ImageLayout as L};

use super::order::PRESENTATION;
use super::program::{Memory, Program, QueueSet, Scope, Span, Sync, Time, Who};
use super::render_pass::Besides;
use afterlight::frame::IN_FLIGHT;
use afterlight::frame::list::{Commands, Condition, HandOver, RenderPassName, Step, StepList};
use afterlight::frame::render_pass::PassDescription;
use afterlight::frame::rows::{Endpoint, FORMULA_WRITE, Row, RowName, Rows, SyncKind, shadow};
use afterlight::gpu::Queue;
use afterlight::gpu::barrier::Half;
use afterlight::gpu::sync::{DEVICE_ACCESS, HOST_WRITE, Use};
use afterlight::gpu::upload::{BLIT_READ, BLIT_WRITE, COPY_WRITE};
use afterlight::gpu_scene::shadow_clear;
use afterlight::passes::{FRAME_READ, Resource, ResourceUse, copy, present};
use afterlight::plan::{FramePlan, Target};

mod prefilter;

const BUFFER: L = L::UNDEFINED;
const TEXTURE: Memory = Memory::of(Resource::Textures);
const LEVELS: [Memory; 3] =
    [Memory::part(Resource::Textures, 1), Memory::part(Resource::Textures, 2), Memory::part(Resource::Textures, 3)];
const STAGING: Memory = Memory::of(Resource::Staging);
const READ_BACK: Memory = Memory::of(Resource::ReadBack);

const PRESENTED: Use = Use::new(PRESENTATION, A::MEMORY_READ);

/// The state that differs from frame to frame.
#[derive(Clone, Copy, Default)]
struct Turn {
    /// The number of times that each shadow map is drawn.
    maps: [usize; 2],
    /// Deformed objects have another pose than in the frame before.
    posed: bool,
    split: bool,
    copied: bool,
    covered: bool,
    /// The panel over the picture has a new texture.
    has_new_panel: bool,
    /// Nothing is drawn: PRESENT copies the picture of the frame before once more.
    again: bool,
}

impl Turn {
    fn has(self, occasion: Condition) -> bool {
        match occasion {
            Condition::Always => true,
            Condition::Posed => self.posed,
            Condition::Split => self.split,
            Condition::Copied => self.copied,
            Condition::Covered => self.covered,
        }
    }
}

/// The frames of a plan with these rows.
pub(super) fn program(plan: &FramePlan, rows: &Rows) -> Program {
    let list = StepList::of(plan);
    let passes = PassDescription::all(plan, rows);
    let mut frames = FrameModelBuilder { plan, rows, program: Program::default(), ends: Vec::new(), copied: None };
    let uploaded = frames.upload();
    frames.prefilter();
    frames.clear_maps();
    let mut drawn = 0;
    for (index, turn) in turns(plan).into_iter().enumerate() {
        frames.program.frame = index + 1;
        if turn.again {
            frames.show_again(turn, &list);
        } else {
            frames.frame(drawn, turn, &list, &passes);
            drawn += 1;
        }
    }
    frames.look();
    frames.wait(RowName::LAST_USE_TO_DESTROY, uploaded);
    frames.program.command(Endpoint::HOST, &[(STAGING, BUFFER, HOST_WRITE)]);
    frames.program
}

/// The frames of the program: each after one with and one without a copy, and a window's each with and without each thing that may cover the picture.
fn turns(plan: &FramePlan) -> Vec<Turn> {
    // Shadow maps are looked up before they are drawn, drawn twice in a row, kept, and drawn anew.
    let maps = |index: usize| [[0, 0], [2, 0], [0, 0], [1, 1]][index % 4];
    // Objects are posed in all frames but one.
    let posed = |index: usize| index != 2;
    match plan.presented {
        None => (0..4)
            .map(|index| Turn { maps: maps(index), posed: posed(index), copied: index == 1, ..Turn::default() })
            .collect(),
        Some(_) => {
            let drawn = (0..9).map(|index| Turn {
                maps: maps(index),
                posed: posed(index),
                copied: index & 1 != 0,
                split: index & 2 != 0,
                covered: index & 4 != 0,
                has_new_panel: index == 4,
                again: false,
            });
            // A picture that lies ready is shown again twice, and drawn over.
            let again = Turn { copied: true, split: true, covered: true, again: true, ..Turn::default() };
            let over = Turn { posed: true, ..Turn::default() };
            let kept = plan.is_copied_to_be_shown().then_some([again, Turn { copied: false, ..again }, over]);
            drawn.chain(kept.into_iter().flatten()).collect()
        }
    }
}

/// The dispatch that evaluates formulas, with these rows.
pub(super) fn formulas(rows: &Rows) -> Program {
    let mut program = Program::default();
    let order = |row| rows.find(row).map(Row::order);
    let (inputs, results) = (Memory::of(Resource::FrameData), READ_BACK);
    program.command(Endpoint::HOST, &[(inputs, BUFFER, HOST_WRITE)]);
    if let Some(submitted) = order(RowName::HOST_TO_FRAME) {
        program.barrier(submitted, None);
    }
    program.command(Endpoint::DEVICE, &[(inputs, BUFFER, FRAME_READ), (results, BUFFER, FORMULA_WRITE)]);
    if let Some(order) = order(RowName::RESULTS_TO_HOST) {
        program.barrier(order, Some(results));
    }
    if let Some(order) = order(RowName::COPY_TO_HOST) {
        let end = program.step();
        program.fence(order, end);
    }
    program.command(Endpoint::HOST, &[(results, BUFFER, copy::HOST_READ)]);
    program
}

struct FrameModelBuilder<'a> {
    plan: &'a FramePlan,
    rows: &'a Rows,
    program: Program,
    /// The end of each frame's submission.
    ends: Vec<Time>,
    /// The end of a submission whose copy the CPU has not looked at.
    copied: Option<Time>,
}

impl FrameModelBuilder<'_> {
    /// A barrier of the table, on all memory or some of it.
    fn barrier(&mut self, name: RowName, memory: Option<Memory>) {
        if let Some(row) = self.rows.find(name) {
            self.program.barrier(row.order(), memory);
        }
    }

    fn image_barrier(&mut self, name: RowName, memory: Memory) {
        let Some(row) = self.rows.find(name) else { return };
        if let SyncKind::ImageBarrier(old, new) = row.carrier {
            let sync = self.program.barrier(row.order(), Some(memory));
            self.program.transition((Who::Row(name), memory), [old, new], vec![sync], None);
        }
    }

    /// Makes the CPU's earlier writes visible to a submission.
    fn submit(&mut self) {
        if let Some(row) = self.rows.find(RowName::HOST_TO_FRAME) {
            self.program.submission(row.order());
        }
    }

    /// The CPU waits for all that was submitted until then.
    fn wait(&mut self, row: RowName, until: Time) {
        let Some(order) = self.rows.find(row).map(Row::order) else { return };
        self.program.fence(order, until);
    }

    /// The CPU looks at the picture that was copied last, but only before the next copy, so that its wait hides nothing.
    fn look(&mut self) {
        if let Some(copied) = self.copied.take() {
            self.wait(RowName::COPY_TO_HOST, copied);
            self.program.command(Endpoint::HOST, &[(READ_BACK, BUFFER, copy::HOST_READ)]);
        }
    }

    /// Gives the end of the submission.
    fn upload(&mut self) -> Time {
        let uploads = self.plan.uploads;
        let (copied_into, blitted) =
            (self.plan.layouts.of(L::TRANSFER_DST_OPTIMAL), self.plan.layouts.of(L::TRANSFER_SRC_OPTIMAL));
        self.program.command(Endpoint::HOST, &[(STAGING, BUFFER, HOST_WRITE)]);
        self.submit();
        let from = (STAGING, BUFFER, copy::READ);
        let queues = [Queue::Transfer, Queue::Graphics];
        let is_elsewhere = self.plan.queues.transfer;
        if uploads.textures {
            for texture in [&LEVELS[..], &[TEXTURE]] {
                if texture.len() > 1 && !uploads.mip_levels {
                    continue;
                }
                for &level in texture {
                    self.program.queue = if is_elsewhere { Queue::Transfer } else { Queue::Graphics };
                    self.image_barrier(RowName::TEXTURE_TO_COPY, level);
                }
                self.program.command(Endpoint::UPLOAD, &[from, (texture[0], copied_into, COPY_WRITE)]);
                if is_elsewhere {
                    let all: Vec<_> = texture.iter().map(|&level| (level, copied_into)).collect();
                    let released = self.cross(Half::Release, queues, &all, 0);
                    self.cross(Half::Acquire, queues, &all, released);
                }
                for pair in texture.windows(2) {
                    self.image_barrier(RowName::LEVEL_TO_BLIT, pair[0]);
                    let read = (pair[0], blitted, BLIT_READ);
                    self.program.command(Endpoint::UPLOAD, &[read, (pair[1], copied_into, BLIT_WRITE)]);
                }
                self.image_barrier(RowName::UPLOAD_TO_TEXTURES, texture[texture.len() - 1]);
                for &level in &texture[..texture.len() - 1] {
                    self.image_barrier(RowName::BLIT_TO_TEXTURES, level);
                }
            }
        }
        if uploads.vertices || uploads.volumes {
            self.program.queue = if is_elsewhere { Queue::Transfer } else { Queue::Graphics };
            let mut buffers = vec![Resource::Vertices];
            buffers.extend(uploads.vertices.then_some(Resource::Indices));
            buffers.extend(self.plan.deforms().then_some(Resource::RestMeshes));
            let buffers: Vec<_> = buffers.into_iter().map(|own| (Memory::of(own), BUFFER)).collect();
            for &(buffer, _) in &buffers {
                self.program.command(Endpoint::UPLOAD, &[from, (buffer, BUFFER, COPY_WRITE)]);
            }
            if is_elsewhere {
                let released = self.cross(Half::Release, queues, &buffers, 0);
                self.cross(Half::Acquire, queues, &buffers, released);
            }
            self.barrier(RowName::UPLOAD_TO_VERTICES, None);
        }
        self.program.step()
    }

    /// A texture of OVERLAY.
    fn upload_panel(&mut self) {
        self.image_barrier(RowName::PANEL_TO_COPY, Memory::of(Resource::PanelTextures));
        let layout = self.plan.layouts.of(L::TRANSFER_DST_OPTIMAL);
        self.program.command(Endpoint::UPLOAD, &[(Memory::of(Resource::PanelTextures), layout, COPY_WRITE)]);
        self.image_barrier(RowName::UPLOAD_TO_PANELS, Memory::of(Resource::PanelTextures));
    }

    fn clear_maps(&mut self) {
        for (image, [before, after]) in shadow::images(self.plan) {
            for map in memory_of(self.plan, image, 0) {
                self.image_barrier(before, map);
                let layout = self.plan.layouts.of(L::TRANSFER_DST_OPTIMAL);
                self.program.command(Endpoint::CLEAR, &[(map, layout, shadow_clear::WRITE)]);
                self.image_barrier(after, map);
            }
        }
    }

    /// Adds the submission of `Presenter::show_again`: PRESENT and the steps after it.
    fn show_again(&mut self, turn: Turn, list: &StepList) {
        if turn.copied {
            self.look();
        }
        self.submit();
        self.acquire();
        let is_before = |step: &&Step| !matches!(step, Step::Commands(own) if own.pass.name == present::PASS.name);
        for step in list.0.iter().skip_while(is_before) {
            match step {
                // These passes read nothing that the CPU writes for a frame.
                Step::Commands(own) if turn.has(own.when) => self.commands(own, 0),
                Step::Commands(_) | Step::RenderPass(..) | Step::HandOver(_) => {}
                Step::Presentation => self.show(),
            }
        }
        if turn.copied {
            self.copied = Some(self.program.step());
        }
    }

    fn frame(&mut self, index: usize, turn: Turn, list: &StepList, passes: &[PassDescription]) {
        let place = index % IN_FLIGHT;
        if turn.copied {
            self.look();
        }
        if let Some(last) = index.checked_sub(IN_FLIGHT) {
            self.wait(RowName::FRAME_TO_HOST, self.ends[last]);
            if self.plan.culls_on_device {
                let found = Memory::part(Resource::FoundCounts, place);
                self.program.command(Endpoint::HOST, &[(found, BUFFER, copy::HOST_READ)]);
            }
        }
        if turn.has_new_panel {
            self.upload_panel();
        }
        self.program.command(Endpoint::HOST, &[(Memory::part(Resource::FrameData, place), BUFFER, HOST_WRITE)]);
        self.submit();
        // The last part waits for the image of the swapchain.
        let last_part = list.parts().last().map_or(0, |part| part.steps.start);
        let mut released = 0;
        for (index, step) in list.0.iter().enumerate() {
            if index == last_part && self.plan.presented.is_some() {
                self.acquire();
            }
            match step {
                Step::RenderPass(name, _) => self.render_pass(passes, *name, turn, place),
                // The copy is a separate submission if there is no window.
                Step::Commands(own) if self.plan.presented.is_some() || own.when != Condition::Copied => {
                    if turn.has(own.when) {
                        self.commands(own, place);
                    }
                }
                Step::Commands(_) => {}
                Step::HandOver(own) => released = self.hand_over(own, place, released),
                Step::Presentation => self.show(),
            }
        }
        let end = self.program.step();
        self.ends.push(end);
        if self.plan.presented.is_none() && turn.copied {
            self.submit();
            for step in &list.0 {
                if let Step::Commands(own) = step
                    && own.when == Condition::Copied
                {
                    self.commands(own, place);
                }
            }
        }
        if turn.copied {
            self.copied = Some(self.program.step());
        }
    }

    /// A half of a hand-over between queues. Returns the end of the part that released last.
    fn hand_over(&mut self, own: &HandOver, place: usize, released: Time) -> Time {
        let of = |&(target, layout): &(Target, L)| {
            memory_of(self.plan, Resource::Target(target), place).into_iter().map(move |memory| (memory, layout))
        };
        let all: Vec<_> = own.targets.iter().flat_map(of).collect();
        self.cross(own.half, own.queues, &all, released)
    }

    /// Hands this memory over by the rows between the two queues.
    fn cross(&mut self, half: Half, queues: [Queue; 2], all: &[(Memory, L)], released: Time) -> Time {
        if half == Half::Acquire {
            self.program.queue = queues[1];
            if let Some(row) = self.rows.find(RowName::semaphore(queues)) {
                self.program.semaphore(row.order(), released, queues);
            }
        }
        let name = RowName::ownership(queues);
        if let Some(row) = self.rows.find(name) {
            self.program.hand_over((name, row.order()), (half, queues), all);
        }
        self.program.step()
    }

    fn render_pass(&mut self, passes: &[PassDescription], name: RenderPassName, turn: Turn, place: usize) {
        let plan = self.plan;
        let Some(pass) = passes.iter().find(|pass| pass.name == name) else { return };
        let besides = |touches: &[ResourceUse]| -> Vec<Besides> {
            let all = touches.iter().filter(|touch| !touch.is_attachment());
            all.flat_map(|touch| besides(plan, touch, place)).collect()
        };
        if name.draws_maps() {
            // All render passes of a map come one after the other, with the first of them.
            let of_maps: Vec<_> = passes.iter().filter(|pass| pass.name.draws_maps()).collect();
            if of_maps[0].name != name {
                return;
            }
            for (map, times) in (0..).zip(turn.maps) {
                for pass in (0..times).flat_map(|_| &of_maps) {
                    let memory: Vec<_> = pass.attachments.iter().map(|&(image, _)| Memory::part(image, map)).collect();
                    self.program.render_pass(pass, &memory, besides);
                }
            }
            return;
        }
        let memory: Vec<_> =
            pass.attachments.iter().flat_map(|&(resource, _)| memory_of(plan, resource, place)).collect();
        self.program.render_pass(pass, &memory, besides);
    }

    /// A pass outside of the frame's render passes, between its barriers.
    fn commands(&mut self, own: &Commands, place: usize) {
        let plan = self.plan;
        self.barriers(&own.before, place);
        let touches = own.pass.uses(plan);
        let all: Vec<_> = touches.iter().flat_map(|touch| besides(plan, touch, place)).collect();
        self.program.command(own.pass.name, &all);
        self.barriers(&own.after, place);
    }

    fn barriers(&mut self, rows: &[(RowName, Resource)], place: usize) {
        for &(name, resource) in rows {
            for memory in memory_of(self.plan, resource, place) {
                match self.rows.find(name).map(|row| row.carrier) {
                    Some(SyncKind::ImageBarrier(..)) => self.image_barrier(name, memory),
                    _ => self.barrier(name, Some(memory)),
                }
            }
        }
    }

    /// The frame goes on when presentation has let go of the image.
    fn acquire(&mut self) {
        let Some(mask) = self.rows.find(RowName::ACQUIRE).map(|row| row.after) else { return };
        let now = self.program.step();
        self.program.synchronize(Sync {
            first: Scope { span: Span::before(now).on(QueueSet::EVERY), mask: PRESENTED },
            second: Scope { span: Span::since(now), mask: Use::new(mask.stage, DEVICE_ACCESS.access) },
            region: None,
            by_sample: false,
            // Presentation of other images goes on meanwhile.
            memory: Some([Memory::of(Resource::SwapchainImage)].into_iter().collect()),
            is_whole: false,
            is_fence: false,
        });
    }

    /// Presentation shows the image when the frame is done.
    fn show(&mut self) {
        let Some(mask) = self.rows.find(RowName::PRESENT).map(|row| row.before) else { return };
        let now = self.program.step();
        self.program.synchronize(Sync {
            first: Scope { span: Span::before(now), mask },
            second: Scope { span: Span::since(now).on(QueueSet::EVERY), mask: PRESENTED },
            region: None,
            by_sample: false,
            memory: None,
            is_whole: true,
            is_fence: false,
        });
        self.program
            .command(Endpoint::PRESENTATION, &[(Memory::of(Resource::SwapchainImage), L::PRESENT_SRC_KHR, PRESENTED)]);
    }
}

/// The memory that a frame uses of a resource. `place` is the index of the frame among the frames in flight.
fn memory_of(plan: &FramePlan, resource: Resource, place: usize) -> Vec<Memory> {
    match resource {
        Resource::Target(target) if target == plan.picture() && plan.draws_into_swapchain() => {
            vec![Memory::of(Resource::SwapchainImage)]
        }
        // Two maps: one drawn in most frames, one looked up before it is first drawn.
        Resource::Maps(_) => [0, 1].map(|map| Memory::part(resource, map)).to_vec(),
        Resource::Textures => {
            let levels = LEVELS.into_iter().filter(|_| plan.uploads.mip_levels);
            levels.chain([TEXTURE]).collect()
        }
        Resource::FrameData | Resource::FoundCounts | Resource::Kept(_) => vec![Memory::part(resource, place)],
        Resource::KeptBefore(own) => vec![Memory::part(Resource::Kept(own), (place + IN_FLIGHT - 1) % IN_FLIGHT)],
        _ => vec![Memory::of(resource)],
    }
}

fn besides(plan: &FramePlan, touch: &ResourceUse, place: usize) -> impl Iterator<Item = Besides> {
    let (layout, uses) = (touch.layout(), touch.uses);
    memory_of(plan, touch.resource, place).into_iter().map(move |memory| (memory, layout, uses))
}
