//! A journal of recorded commands: what `vkCmd*` functions were called with, in the order of the calls, with the names of objects.
//!
//! It is off until somebody asks for it ([`super::Device::keep_commands`]). It has a command's objects and its most telling numbers, not all arguments.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk::{self, Handle};

use super::barrier::Half;
use super::queues::Queue;
use super::sync::Dependency;

/// A command, as it was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command {
    /// The name of the command buffer.
    pub command_buffer: String,
    /// The command's own name: `vkCmdDraw`.
    pub name: &'static str,
    /// The command's arguments.
    pub arguments: Arguments,
}

/// The arguments of a command, as far as the journal keeps them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Arguments {
    /// Names of objects in the order of the arguments: pipelines, render passes, buffers, images. A label has its text.
    pub objects: Vec<String>,
    /// Counts, offsets and sizes in the order of the arguments. A rectangle is x, y, width and height.
    pub numbers: Vec<i64>,
    /// The arguments of `vkCmdPipelineBarrier` and `vkCmdPipelineBarrier2`.
    pub barrier: Option<Barrier>,
}

impl Arguments {
    pub(super) fn objects(objects: impl IntoIterator<Item = String>) -> Self {
        Self { objects: objects.into_iter().collect(), ..Self::default() }
    }

    pub(super) fn numbers<N: Into<i64>>(self, numbers: impl IntoIterator<Item = N>) -> Self {
        Self { numbers: self.numbers.into_iter().chain(numbers.into_iter().map(Into::into)).collect(), ..self }
    }
}

/// A pipeline barrier.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Barrier {
    /// The row of the frame's dependencies that it carries out; empty for a barrier outside of that table.
    pub row: &'static str,
    /// The stages that must be over.
    pub src_stages: vk::PipelineStageFlags2,
    /// The stages that wait.
    pub dst_stages: vk::PipelineStageFlags2,
    /// `VK_DEPENDENCY_BY_REGION_BIT`: between draws inside of `vkCmdBeginRendering`.
    pub by_region: bool,
    /// It is a half of an ownership transfer, from the first queue to the second.
    pub handed: Option<(Half, [Queue; 2])>,
    /// Barriers on memory, buffers and images, in this order.
    pub parts: Vec<BarrierPart>,
}

/// A barrier on memory, a buffer or an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BarrierPart {
    /// The name of the buffer or the image; `None` for a barrier on all memory.
    pub object: Option<String>,
    /// Writes that are made available.
    pub src_access: vk::AccessFlags2,
    /// Accesses that see them.
    pub dst_access: vk::AccessFlags2,
    /// An image's layouts before and after.
    pub layouts: Option<[vk::ImageLayout; 2]>,
}

/// The arrays of `vkCmdPipelineBarrier2`, before they have masks.
#[derive(Default)]
pub(super) struct Barriers<'a> {
    pub flags: vk::DependencyFlags,
    pub handed: Option<(Half, [Queue; 2])>,
    pub memory: Vec<vk::MemoryBarrier2<'a>>,
    pub buffers: Vec<vk::BufferMemoryBarrier2<'a>>,
    pub images: Vec<vk::ImageMemoryBarrier2<'a>>,
}

impl Barriers<'_> {
    pub(super) fn arguments(&self, order: Dependency, names: &ObjectNames) -> Arguments {
        let (src_access, dst_access) = (order.before.access, order.after.access);
        let part = |object, layouts| BarrierPart { object, src_access, dst_access, layouts };
        let memory = self.memory.iter().map(|_| part(None, None));
        let buffers = self.buffers.iter().map(|own| part(Some(names.of(own.buffer)), None));
        let images =
            self.images.iter().map(|own| part(Some(names.of(own.image)), Some([own.old_layout, own.new_layout])));
        let barrier = Barrier {
            row: order.row,
            src_stages: order.before.stage,
            dst_stages: order.after.stage,
            by_region: self.flags.contains(vk::DependencyFlags::BY_REGION),
            handed: self.handed,
            parts: memory.chain(buffers).chain(images).collect(),
        };
        Arguments { barrier: Some(barrier), ..Arguments::default() }
    }
}

/// The names of objects, by type and handle. A handle that was used before has the name of its last object.
#[derive(Default)]
pub(super) struct ObjectNames(HashMap<(vk::ObjectType, u64), String>);

impl ObjectNames {
    /// The name of an object; `?` for one that was never named, or was named before the journal was on.
    pub(super) fn of<H: Handle>(&self, object: H) -> String {
        self.0.get(&(H::TYPE, object.as_raw())).map_or_else(|| "?".to_owned(), Clone::clone)
    }

    pub(super) fn all<H: Handle + Copy>(&self, objects: &[H]) -> Vec<String> {
        objects.iter().map(|&object| self.of(object)).collect()
    }
}

#[derive(Default)]
struct JournalEntries {
    names: ObjectNames,
    commands: Vec<Command>,
}

/// The commands that are recorded on one device while the journal is on.
#[derive(Default)]
pub(super) struct CommandJournal {
    /// Read before each command, without the lock: a journal that is off costs nothing.
    is_on: AtomicBool,
    entries: Mutex<JournalEntries>,
}

impl CommandJournal {
    pub(super) fn start(&self) {
        self.lock().commands.clear();
        self.is_on.store(true, Ordering::Relaxed);
    }

    pub(super) fn stop(&self) -> Vec<Command> {
        self.is_on.store(false, Ordering::Relaxed);
        std::mem::take(&mut *self.lock()).commands
    }

    pub(super) fn name<H: Handle + Copy>(&self, object: H, name: &str) {
        if self.is_on.load(Ordering::Relaxed) {
            self.lock().names.0.insert((H::TYPE, object.as_raw()), name.to_owned());
        }
    }

    pub(super) fn note(
        &self,
        cmd: vk::CommandBuffer,
        name: &'static str,
        arguments: impl FnOnce(&ObjectNames) -> Arguments,
    ) {
        if self.is_on.load(Ordering::Relaxed) {
            let mut kept = self.lock();
            let (command_buffer, arguments) = (kept.names.of(cmd), arguments(&kept.names));
            kept.commands.push(Command { command_buffer, name, arguments });
        }
    }

    fn lock(&self) -> MutexGuard<'_, JournalEntries> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
