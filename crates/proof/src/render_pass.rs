//! A render pass in the list: its dependencies, implicit ones included, and its subpasses' touches of attachments ("Render Pass": load operations,
//! layout changes, store operations).

use ash::vk::{self, AccessFlags2 as A, PipelineStageFlags2 as S};

use super::program::{Memory, MemoryAccess, MemorySet, Program, Scope, Span, Sync, Time, TouchKind, Who};
use afterlight::frame::list::RESOLVE;
use afterlight::frame::render_pass::PassDescription;
use afterlight::frame::rendering::AroundRendering;
use afterlight::frame::rows::Row;
use afterlight::gpu::sync::{Dependency, Use};
use afterlight::passes::{ResourceUse, UseKind};
use afterlight::plan::DEPTH;

const COLOR: S = S::COLOR_ATTACHMENT_OUTPUT;
const TESTS: S = S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw());
const COLOR_WRITE: Use = Use::new(COLOR, A::COLOR_ATTACHMENT_WRITE);
const COLOR_READ: Use = Use::new(COLOR, A::COLOR_ATTACHMENT_READ);
const DEPTH_READ: Use = Use::new(TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ);
const DEPTH_WRITE: Use = Use::new(TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE);
const INPUT_READ: Use = Use::new(S::FRAGMENT_SHADER, A::INPUT_ATTACHMENT_READ);

/// The accesses of implicit dependencies (`VkSubpassDependency`).
const IMPLICIT: A = A::from_raw(
    A::INPUT_ATTACHMENT_READ.as_raw()
        | A::COLOR_ATTACHMENT_READ.as_raw()
        | A::COLOR_ATTACHMENT_WRITE.as_raw()
        | A::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
        | A::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
);

/// A subpass's touch of something other than an attachment: memory, its layout, the use.
pub(super) type Besides = (Memory, vk::ImageLayout, Use);

/// An instance of a render pass that is being added.
struct RenderPassInstance<'a> {
    pass: &'a PassDescription,
    /// Memory of each attachment.
    memory: &'a [Memory],
    /// All memory that the instance touches: attachments, and the subpasses' touches besides.
    touched: MemorySet,
    id: u32,
    begin: Time,
    /// The time of each subpass.
    times: Vec<Time>,
    end: Time,
    /// Each dependency: its subpasses, and its index.
    dependencies: Vec<([u32; 2], usize)>,
}

const EXTERNAL: u32 = vk::SUBPASS_EXTERNAL;

impl Program {
    /// Adds an instance of a pass. `memory` is its attachments' memory, and `besides` has each subpass's other touches.
    pub(super) fn render_pass(
        &mut self,
        pass: &PassDescription,
        memory: &[Memory],
        besides: impl Fn(&[ResourceUse]) -> Vec<Besides>,
    ) {
        let besides: Vec<_> = pass.subpasses.iter().map(|subpass| besides(&subpass.touches)).collect();
        let touched = memory.iter().copied().chain(besides.iter().flatten().map(|(memory, ..)| *memory)).collect();
        let id = self.instance();
        let instance = match pass.is_rendering {
            true => RenderPassInstance::rendered(self, (pass, memory, touched), id),
            false => {
                let begin = self.step();
                let times = pass.subpasses.iter().map(|_| self.step()).collect();
                let end = self.step();
                let mut instance =
                    RenderPassInstance { pass, memory, touched, id, begin, times, end, dependencies: Vec::new() };
                instance.add_dependencies(self);
                instance
            }
        };
        for (index, (subpass, besides)) in (0..).zip(pass.subpasses.iter().zip(&besides)) {
            let (who, group) = (Who::At(subpass.place), self.group());
            let time = instance.times[index as usize];
            for attachment in 0..pass.attachments.len() as u32 {
                instance.touch(self, who, (index, attachment), group);
            }
            for &(memory, layout, uses) in besides {
                self.touch(&MemoryAccess { time, group, ..self.plain(memory, who, layout) }, uses);
            }
        }
        if pass.is_rendering {
            instance.leave_rendering(self);
            return;
        }
        for attachment in 0..pass.attachments.len() as u32 {
            instance.finish(self, attachment);
        }
    }
}

impl<'a> RenderPassInstance<'a> {
    /// Rendering without a render pass: barriers before it, then barriers inside it before the subpasses that wait.
    fn rendered(
        program: &mut Program,
        (pass, memory, touched): (&'a PassDescription, &'a [Memory], MemorySet),
        id: u32,
    ) -> Self {
        let mut instance =
            Self { pass, memory, touched, id, begin: 0, times: Vec::new(), end: 0, dependencies: Vec::new() };
        for around in pass.changes_at_the_start() {
            let change = |index: usize, own: &Self| {
                let used = own.users(index as u32).first().and_then(|&first| own.layout(first, index as u32));
                [pass.attachments[index].1.initial_layout, used.unwrap_or_default()]
            };
            instance.carry_out(program, &around, change);
        }
        instance.begin = program.step();
        let inside =
            |subpass: u32| pass.dependencies.iter().filter(move |(_, ends)| ends[1] == subpass && ends[0] != EXTERNAL);
        let count: usize = (0..pass.subpasses.len() as u32).map(|subpass| 1 + inside(subpass).count()).sum();
        let after = instance.begin + count as Time + 2;
        for subpass in 0..pass.subpasses.len() as u32 {
            for (row, ends) in inside(subpass) {
                let now = program.step();
                program.synchronize(Sync {
                    first: Scope { span: Span::between(instance.begin, now), mask: row.before },
                    second: Scope { span: Span::between(now, after), mask: row.after },
                    region: Some(id),
                    by_sample: instance.is_by_sample(*ends),
                    memory: Some(instance.touched.clone()),
                    is_whole: false,
                    is_fence: false,
                });
            }
            instance.times.push(program.step());
        }
        instance.end = program.step();
        instance
    }

    /// The barriers after rendering.
    fn leave_rendering(&self, program: &mut Program) {
        for around in self.pass.changes_at_the_end() {
            self.carry_out(program, &around, |index, own| {
                let used = own.users(index as u32).last().and_then(|&last| own.layout(last, index as u32));
                [used.unwrap_or_default(), own.pass.attachments[index].1.final_layout]
            });
        }
    }

    /// The barriers of one row: on images whose layout changes, and on memory where it orders more than these.
    fn carry_out(
        &self,
        program: &mut Program,
        around: &AroundRendering,
        change: impl Fn(usize, &Self) -> [vk::ImageLayout; 2],
    ) {
        let order = around.row.as_ref().map_or(Dependency::between(Use::START, Use::END), Row::order);
        let who = around.row.as_ref().map_or(Who::End(self.pass.name), |row| Who::Row(row.name));
        let changed: MemorySet = around.changed.iter().map(|&index| self.memory[index]).collect();
        let by = program.barrier_on(order, Some(if around.orders_more { self.touched.clone() } else { changed }));
        for &index in &around.changed {
            // A draw that waits for it may wait by region for one before.
            program.transition((who, self.memory[index]), change(index, self), vec![by], Some(self.id));
        }
    }

    /// "Framebuffer Region Dependencies": where both sides have as many samples, a region has one of them.
    fn is_by_sample(&self, ends: [u32; 2]) -> bool {
        self.samples(ends[0]) == self.samples(ends[1]) && self.samples(ends[0]) != Some(vk::SampleCountFlags::TYPE_1)
    }

    /// The layout in which a subpass uses an attachment, if it does.
    fn layout(&self, subpass: u32, attachment: u32) -> Option<vk::ImageLayout> {
        let own = &self.pass.subpasses[subpass as usize];
        let mut references = own.input.iter().chain(&own.color).chain(&own.resolve).chain(&own.depth);
        references.find(|reference| reference.attachment == attachment).map(|reference| reference.layout)
    }

    /// Sample count of a subpass, which its colour and depth attachments share; `None` outside of the pass.
    fn samples(&self, subpass: u32) -> Option<vk::SampleCountFlags> {
        let own = self.pass.subpasses.get(subpass as usize)?;
        let drawn = own.color.iter().chain(&own.depth).find(|reference| reference.attachment != vk::ATTACHMENT_UNUSED);
        drawn.map(|reference| self.pass.attachments[reference.attachment as usize].1.samples)
    }

    fn users(&self, attachment: u32) -> Vec<u32> {
        (0..self.pass.subpasses.len() as u32).filter(|&subpass| self.layout(subpass, attachment).is_some()).collect()
    }

    fn add_dependencies(&mut self, program: &mut Program) {
        // Each dependency: its ends, masks, whether it orders within the instance alone, and whether by region. A row across samples orders all pixels, and frames
        // too; counting on that would make rows between frames depend on the number of samples, so no frame rests on it.
        let mut all: Vec<([u32; 2], Use, Use, [bool; 2])> = self
            .pass
            .dependencies
            .iter()
            .map(|(row, ends)| (*ends, row.before, row.after, [row.is_between_subpasses(), row.by_region]))
            .collect();
        // An attachment that changes its layout without a dependency of the pass has implicit ones, which wait for nothing from outside.
        for (index, (_, attachment)) in (0..).zip(&self.pass.attachments) {
            let users = self.users(index);
            let (Some(&first), Some(&last)) = (users.first(), users.last()) else { continue };
            let is = |wanted: [u32; 2], all: &[([u32; 2], Use, Use, [bool; 2])]| {
                all.iter().any(|(ends, ..)| *ends == wanted)
            };
            if self.layout(first, index) != Some(attachment.initial_layout) && !is([EXTERNAL, first], &all) {
                all.push(([EXTERNAL, first], Use::START, Use::new(S::ALL_COMMANDS, IMPLICIT), [false; 2]));
            }
            if self.layout(last, index) != Some(attachment.final_layout) && !is([last, EXTERNAL], &all) {
                all.push(([last, EXTERNAL], Use::new(S::ALL_COMMANDS, IMPLICIT).writes(), Use::END, [false; 2]));
            }
        }
        all.sort_by_key(|([_, to], ..)| *to);
        for (ends, before, after, [is_local, by_region]) in all {
            let span = |subpass: u32, outside: Span| match self.times.get(subpass as usize) {
                Some(&time) => Span::between(time, time + 1),
                None => outside,
            };
            let sync = Sync {
                first: Scope { span: span(ends[0], Span::before(self.begin)), mask: before },
                second: Scope { span: span(ends[1], Span::since(self.end)), mask: after },
                region: is_local.then_some(self.id),
                by_sample: by_region && self.is_by_sample(ends),
                memory: Some(self.touched.clone()),
                is_whole: false,
                is_fence: false,
            };
            self.dependencies.push((ends, program.synchronize(sync)));
        }
    }

    /// Adds a subpass's touch of an attachment, with the layout change before it.
    fn touch(&self, program: &mut Program, who: Who, (subpass, attachment): (u32, u32), group: u32) {
        let Some(layout) = self.layout(subpass, attachment) else { return };
        let users = self.users(attachment);
        let previous = users.iter().rev().find(|&&user| user < subpass).copied();
        let description = self.pass.attachments[attachment as usize].1;
        let memory = self.memory[attachment as usize];
        let from = previous.map_or(description.initial_layout, |user| self.layout(user, attachment).unwrap_or(layout));
        let change = self.change((previous, Some(subpass)));
        if !self.pass.is_rendering {
            program.transition((who, memory), [from, layout], change, Some(self.id));
        }

        // The format decides the stages of load and store, even if the pass only reads the attachment as an input.
        let is_depth = description.format == DEPTH;
        let (time, local) = (self.times[subpass as usize], Some(self.id));
        // Rendering loads before its first draw, and stores after its last one.
        let is_rendering = self.pass.is_rendering;
        let (loaded, stored) = if is_rendering { (self.begin, self.end) } else { (time, time) };
        let own = MemoryAccess { time, local, group, ..program.plain(memory, who, layout) };
        let subpass_of = &self.pass.subpasses[subpass as usize];
        let names = |references: &[vk::AttachmentReference]| references.iter().any(|own| own.attachment == attachment);
        let image = self.pass.attachments[attachment as usize].0;
        let declared = || subpass_of.touches.iter().filter(|own| own.resource == image);
        if names(&subpass_of.input) {
            let all_samples = declared().any(|own| matches!(own.how, UseKind::Input { .. }) && own.all_samples);
            program.touch(&MemoryAccess { all_samples, ..own.clone() }, INPUT_READ);
        }
        let mut touch_at = |time, uses: Use, kind| program.touch(&MemoryAccess { kind, time, ..own.clone() }, uses);
        let write = if is_depth { DEPTH_WRITE } else { COLOR_WRITE };
        if previous.is_none() {
            let load = match (description.load_op, is_depth) {
                (vk::AttachmentLoadOp::LOAD, true) => DEPTH_READ,
                (vk::AttachmentLoadOp::LOAD, false) => COLOR_READ,
                _ => write,
            };
            let stage = if is_depth { S::EARLY_FRAGMENT_TESTS } else { COLOR };
            touch_at(loaded, Use::new(stage, load.access), TouchKind::Load);
        }
        if names(&subpass_of.color) {
            // As its pass declares: it overwrites, or blends.
            let drawn = declared().filter(|own| matches!(own.how, UseKind::Color { .. }));
            drawn.for_each(|own| touch_at(time, own.uses, TouchKind::Plain));
            if !subpass_of.resolve.is_empty() {
                touch_at(time, RESOLVE, TouchKind::Plain);
            }
        }
        if names(&subpass_of.resolve) {
            touch_at(time, COLOR_WRITE, TouchKind::Plain);
        }
        if subpass_of.depth.is_some_and(|own| own.attachment == attachment) {
            let writes = declared().any(|own| matches!(own.how, UseKind::Depth { .. }) && own.writes());
            touch_at(time, if writes { DEPTH_READ.or(DEPTH_WRITE) } else { DEPTH_READ }, TouchKind::Plain);
        }
        if users.last() == Some(&subpass) {
            let stage = if is_depth { S::LATE_FRAGMENT_TESTS } else { COLOR };
            touch_at(stored, Use::new(stage, write.access), TouchKind::Store);
        }
    }

    /// The layout change at the end of the pass.
    fn finish(&self, program: &mut Program, attachment: u32) {
        let last = self.users(attachment).last().copied();
        let Some(from) = last.and_then(|last| self.layout(last, attachment)) else { return };
        let to = self.pass.attachments[attachment as usize].1.final_layout;
        let end = (Who::End(self.pass.name), self.memory[attachment as usize]);
        program.transition(end, [from, to], self.change((last, None)), Some(self.id));
    }

    /// The dependencies that a layout change between two users is a part of; outside of the pass is `None`. By the specification the change also
    /// comes after dependencies from its first user to others, and before dependencies from others to its second user; here each change has a
    /// separate row.
    fn change(&self, (from, to): (Option<u32>, Option<u32>)) -> Vec<usize> {
        let ends = [from, to].map(|subpass| subpass.unwrap_or(EXTERNAL));
        self.dependencies.iter().filter(|(own, _)| *own == ends).map(|(_, index)| *index).collect()
    }
}
