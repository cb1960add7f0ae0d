//! The instances of one command, in groups for work groups.

use std::ops::Range;

use super::LANES;
use crate::gpu_scene::{GpuScene, MeshRange};
use crate::plan::IndexWidth;
use crate::visible::{World, WorldObject, squared_error};

/// Commands that one reads of a buffer at most; `indirect_draws` of the device's capabilities says that it can.
const MOST_COMMANDS: u32 = 65536;

/// Commands that follow each other and differ only in their mesh and its level of detail.
#[derive(Debug, Clone)]
pub struct CulledState {
    /// Index into [`World::objects`] of one of the objects that they draw.
    pub object: usize,
    pub width: IndexWidth,
    pub deformed: bool,
    /// Range of their commands within one step of depth.
    pub commands: Range<u32>,
}

/// The groups and batches of a list, and the levels of detail of these, as `shaders/shared/culling.wgsl` has them.
pub(super) struct Groups {
    pub words: Vec<u32>,
    pub count: usize,
    pub slots: usize,
    pub commands: usize,
    /// The place of the levels among the words.
    pub levels_at: usize,
    pub states: Vec<CulledState>,
}

impl Groups {
    pub(super) fn of(world: &World, scene: &GpuScene) -> Self {
        let (mut words, mut batches, mut levels) = (Vec::new(), Vec::new(), Vec::new());
        let (mut states, mut slots) = (Vec::<CulledState>::new(), 0);
        for (batch, places) in (0..).zip(world.instances.opaque_batches()) {
            let first_group = words.len() as u32 / 3;
            for first in places.clone().step_by(LANES) {
                words.extend([first as u32, places.end.min(first + LANES) as u32 - first as u32, batch]);
            }
            let object = world.instances.object(places.start);
            let own = &world.objects[object];
            let errors = own_errors(world, own);
            let ranges = (0..=errors.len() as u8).map(|level| range(scene, own, level));
            let (groups, first_command) = (words.len() as u32 / 3 - first_group, levels.len() as u32 / 3);
            let count = errors.len() as u32 + 1;
            for (range, error) in ranges.zip([0.0].into_iter().chain(errors)) {
                levels.extend([range.index_count, range.first_index, error.to_bits()]);
            }
            let MeshRange { vertex_offset, width, deformed, .. } = range(scene, own, 0);
            batches.extend([count, groups, slots, first_command, vertex_offset as u32, first_group]);
            slots += count * groups;
            let state = CulledState { object, width, deformed, commands: first_command..first_command + count };
            match states.last_mut() {
                Some(last)
                    if last.commands.len() as u32 + count <= MOST_COMMANDS
                        && (last.width, last.deformed) == (state.width, state.deformed)
                        && world.objects[last.object].key == own.key
                        && world.objects[last.object].material_set() == own.material_set() =>
                {
                    last.commands.end = state.commands.end;
                }
                _ => states.push(state),
            }
        }
        let (count, commands, levels_at) = (words.len() / 3, levels.len() / 3, words.len() + batches.len());
        words.extend(batches);
        words.extend(levels);
        Self { words, count, slots: slots as usize, commands, levels_at, states }
    }
}

/// The squared errors of an object's levels of detail, the finest first.
fn own_errors(world: &World, object: &WorldObject) -> Vec<f32> {
    world.levels_of(object).iter().map(squared_error).collect()
}

/// Returns the place of a level's indices. The plan has the mesh of each object that is drawn.
fn range(scene: &GpuScene, object: &WorldObject, level: u8) -> MeshRange {
    let none = MeshRange {
        first_index: 0,
        index_count: 0,
        vertex_offset: 0,
        begin: 0,
        width: IndexWidth::Bits16,
        deformed: false,
    };
    scene.level(object.mesh, object.deform, level).unwrap_or(none)
}
