//! Short sequences of passes and rows, given by hand, as exercises ask for them: what the rows leave unordered, and what is more than enough.

use ash::vk::ImageLayout;

use afterlight::frame::rows::{Endpoint, RowName, RowPart, Side, masks};
use afterlight::gpu::sync::{Dependency, Use};
use afterlight::passes::Resource;
use afterlight::plan::BufferName;

use super::program::{Memory, MemoryAccess, Program, Scope, Span, Sync, Who};
use super::{Hazard, hazards_of};

/// A use of an image or a buffer by a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SequenceUse {
    /// The image or buffer.
    pub memory: &'static str,
    /// Its stages and accesses.
    pub uses: Use,
    /// The layout that the pass needs; UNDEFINED for a buffer.
    pub layout: ImageLayout,
    /// Each pixel touches its own texel alone.
    pub own_pixel: bool,
}

/// A step of a sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SequenceStep {
    /// A pass: its name, its uses, and the number of the render pass that it is a subpass of.
    Pass(&'static str, Vec<SequenceUse>, Option<u32>),
    /// A row.
    Row(SequenceRow),
}

/// A row: a barrier, or a dependency between two subpasses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SequenceRow {
    /// The name by which it is reported.
    pub name: &'static str,
    /// The images and buffers that it is about; all of them if it names none.
    pub memory: Vec<&'static str>,
    /// The stages and accesses before it.
    pub before: Use,
    /// The stages and accesses after it.
    pub after: Use,
    /// The layouts of its images before and after it, where it changes them.
    pub layouts: Option<[ImageLayout; 2]>,
    /// It orders, within the render pass of the pass before it, uses of the same pixel alone.
    pub by_region: bool,
}

/// A part of a row that orders nothing which other rows do not order as well.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Superfluous {
    /// The row.
    pub row: &'static str,
    /// All of it, or some bits of one side.
    pub part: RowPart,
}

/// Passes and rows in the order of submission.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sequence {
    /// The steps of a frame.
    pub steps: Vec<SequenceStep>,
    /// The number of frames that follow each other, all with these steps.
    pub frames: usize,
}

impl Sequence {
    /// Finds the hazards that the rows leave. Every image begins in the layout of its first use, unless a row changes it before.
    pub fn hazards(&self) -> Vec<Hazard> {
        hazards_of(&self.program(self.first_layouts())).collect()
    }

    /// Finds passes that only read an image whose contents a row has discarded, by a change from UNDEFINED: the row, the image and the pass.
    pub fn discarded(&self) -> Vec<[&'static str; 3]> {
        let (mut lost, mut found): (Vec<[&'static str; 2]>, Vec<_>) = (Vec::new(), Vec::new());
        for step in (0..self.frames).flat_map(|_| &self.steps) {
            match step {
                SequenceStep::Row(row) if row.layouts.is_some_and(|[from, _]| from == ImageLayout::UNDEFINED) => {
                    lost.retain(|[_, name]| !row.memory.contains(name));
                    lost.extend(row.memory.iter().map(|name| [row.name, name]));
                }
                SequenceStep::Row(_) => {}
                SequenceStep::Pass(pass, uses, _) => {
                    let is_used = |[_, name]: &[&str; 2]| uses.iter().any(|own| own.memory == *name);
                    let writes = |own: &SequenceUse| !own.uses.writes().access.is_empty();
                    let is_written = |name| uses.iter().any(|own| own.memory == name && writes(own));
                    let (used, others): (Vec<_>, Vec<_>) = lost.into_iter().partition(is_used);
                    found.extend(
                        used.into_iter().filter(|[_, name]| !is_written(*name)).map(|[row, name]| [row, name, *pass]),
                    );
                    lost = others;
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Finds rows, and stages and accesses of rows, each of which can be left out without a hazard while the others stay. It is empty while there are hazards.
    pub fn superfluous(&self) -> Vec<Superfluous> {
        // Without a row, too, images begin in the layouts that the whole sequence gives them.
        let begin = self.first_layouts();
        if !self.is_safe(&begin) {
            return Vec::new();
        }
        let rows = self.steps.iter().enumerate().filter_map(|(index, step)| match step {
            SequenceStep::Row(row) => Some((index, row)),
            SequenceStep::Pass(..) => None,
        });
        let mut found = Vec::new();
        for (index, row) in rows {
            let bits = |side, mask| masks::bits(mask).map(move |bits| RowPart::Bits(side, bits));
            let parts = [RowPart::Row].into_iter().chain(bits(Side::Before, row.before));
            for part in parts.chain(bits(Side::After, row.after)) {
                if self.without(index, row, part).is_safe(&begin) {
                    found.push(Superfluous { row: row.name, part });
                    // The bits of a row that is not needed are not, either.
                    if part == RowPart::Row {
                        break;
                    }
                }
            }
        }
        found
    }

    fn is_safe(&self, begin: &[(Memory, ImageLayout)]) -> bool {
        hazards_of(&self.program(begin.to_vec())).next().is_none()
    }

    fn without(&self, index: usize, row: &SequenceRow, part: RowPart) -> Self {
        let mut steps = self.steps.clone();
        match part {
            RowPart::Bits(side, bits) => {
                let mut row = row.clone();
                match side {
                    Side::Before => row.before = masks::without(row.before, bits).unwrap_or(Use::START),
                    Side::After => row.after = masks::without(row.after, bits).unwrap_or(Use::END),
                }
                steps[index] = SequenceStep::Row(row);
            }
            RowPart::Row | RowPart::AcrossSamples => _ = steps.remove(index),
        }
        Self { steps, frames: self.frames }
    }

    fn program(&self, begin: Vec<(Memory, ImageLayout)>) -> Program {
        let mut program = Program::with_layouts(begin);
        for frame in 1..=self.frames {
            program.frame = frame;
            // The number of the render pass that is under way, and its instance.
            let mut under_way: Option<(u32, u32)> = None;
            for step in &self.steps {
                match step {
                    SequenceStep::Pass(name, uses, render_pass) => {
                        under_way = match (*render_pass, under_way) {
                            (Some(number), Some((own, _))) if own == number => under_way,
                            (Some(number), _) => Some((number, program.instance())),
                            (None, _) => None,
                        };
                        let (time, group) = (program.step(), program.group());
                        for own in uses {
                            let local = under_way.map(|(_, instance)| instance).filter(|_| own.own_pixel);
                            let plain = program.plain(memory(own.memory), Who::At(Endpoint::pass(name)), own.layout);
                            program.touch(&MemoryAccess { time, group, local, ..plain }, own.uses);
                        }
                    }
                    SequenceStep::Row(row) => add(&mut program, row, under_way.map(|(_, instance)| instance)),
                }
            }
        }
        program
    }

    /// The layouts that images begin in: those of their first uses, if no row changes them before.
    fn first_layouts(&self) -> Vec<(Memory, ImageLayout)> {
        let mut first: Vec<(Memory, ImageLayout)> = Vec::new();
        let mut add = |name, layout| {
            if first.iter().all(|(own, _)| *own != memory(name)) {
                first.push((memory(name), layout));
            }
        };
        for step in &self.steps {
            match step {
                SequenceStep::Pass(_, uses, _) => uses.iter().for_each(|own| add(own.memory, own.layout)),
                SequenceStep::Row(SequenceRow { memory, layouts: Some([from, _]), .. }) => {
                    memory.iter().for_each(|name| add(name, *from));
                }
                SequenceStep::Row(_) => {}
            }
        }
        first
    }
}

fn memory(name: &'static str) -> Memory {
    Memory::of(Resource::Buffers(BufferName(name)))
}

fn add(program: &mut Program, row: &SequenceRow, instance: Option<u32>) {
    let order = Dependency { row: row.name, before: row.before, after: row.after };
    let about = (!row.memory.is_empty()).then(|| row.memory.iter().map(|name| memory(name)).collect());
    let by = match instance.filter(|_| row.by_region) {
        None => program.barrier_on(order, about),
        Some(instance) => {
            let time = program.step();
            program.synchronize(Sync {
                first: Scope { span: Span::before(time), mask: row.before },
                second: Scope { span: Span::since(time), mask: row.after },
                region: Some(instance),
                by_sample: false,
                memory: about,
                is_whole: false,
                is_fence: false,
            })
        }
    };
    let local = instance.filter(|_| row.by_region);
    for name in row.memory.iter().filter(|_| row.layouts.is_some()) {
        let layouts = row.layouts.unwrap_or_default();
        program.transition((Who::Row(RowName::Own(row.name)), memory(name)), layouts, vec![by], local);
    }
}
