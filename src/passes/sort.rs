//! SORT: particles from back to front, by compute, in as many steps as a bitonic network has for as many as are alive.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::{Endpoint, FrameContext, Pass, PassRecorder, Presence, Resource, ResourceUse, compute_stage};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Owned, SetLayout, SetWriter, binding, compute_pipeline, pipeline_layout,
    sync::Use,
};
use crate::plan::{PARTICLES, SORT_BLOCK, sort_places};
use crate::shaders::sort::{self as shader, Flags};

/// Reads keys of a step before.
pub const KEY_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes them in another order.
pub const KEY_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SORT"),
    time: "sort",
    what: "particles from back to front",
    presence: |plan| match plan.effects.particles {
        Some(_) if plan.sorts_particles() => Presence::In("particles are blended from back to front".into()),
        Some(_) => Presence::Out("particles are summed or counted, in any order".into()),
        None => Presence::Out("no particles are drawn".into()),
    },
    touches: |_| {
        vec![
            ResourceUse::resource(Resource::Buffers(PARTICLES), KEY_READ.or(KEY_WRITE))
                .because("compares keys and exchanges them, step by step"),
        ]
    },
    leave_out: None,
    make: Some(|own| {
        // The keys are the second buffer, after the particles.
        let keys = own.needed(own.buffers(Resource::Buffers(PARTICLES)).nth(1))?;
        Ok(Box::new(SortPass::new(own.device, keys)?))
    }),
};

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;
/// Invocations of a work group.
const GROUP: u32 = shader::WORKGROUP_SIZE[0];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct SortPush {
    first: u32,
    last: u32,
    apart: u32,
}

const _: () = {
    use std::mem::offset_of;
    assert!(size_of::<SortPush>() == shader::push::SIZE && offset_of!(SortPush, first) == shader::push::FIRST);
    assert!(offset_of!(SortPush, last) == shader::push::LAST && offset_of!(SortPush, apart) == shader::push::APART);
};

/// A dispatch: true if it is within blocks, false over all keys; and its push constants.
type SortDispatch = (bool, SortPush);

pub struct SortPass {
    layout: Owned<vk::PipelineLayout>,
    /// Pipelines over all keys, and within blocks.
    pipelines: [Owned<vk::Pipeline>; 2],
    set: vk::DescriptorSet,
    _set_layout: SetLayout,
    _pool: DescriptorPool,
}

impl SortPass {
    pub fn new(device: &Arc<Device>, keys: &Buffer) -> gpu::Result<Self> {
        let set_layout = SetLayout::new(device, "sort", &[binding(0, vk::DescriptorType::STORAGE_BUFFER, COMPUTE)])?;
        let pool = DescriptorPool::new(device, "sort", 1, &[(vk::DescriptorType::STORAGE_BUFFER, 1)])?;
        let set = pool.allocate("sort", set_layout.raw)?;
        SetWriter::new().storage_buffer(0, keys, keys.size).update(device, set);
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: shader::push::SIZE as u32 };
        let layout = pipeline_layout(device, "sort", &[set_layout.raw], &[range])?;
        let pipeline =
            |flags| compute_pipeline(device, "sort", &compute_stage("sort", shader::variant, flags, &[])?, layout.raw);
        let pipelines = [pipeline(Flags::NONE)?, pipeline(Flags::LOCAL)?];
        Ok(Self { layout, pipelines, set, _set_layout: set_layout, _pool: pool })
    }
}

impl PassRecorder for SortPass {
    /// Sorts the first `sort_places(count)` keys, a power of two. `between` records the barrier before each step except the first. Runs outside any
    /// render pass.
    fn record(&self, context: &FrameContext) {
        let count = context.visible.emitters.count;
        if count == 0 {
            return;
        }
        let places = sort_places(count);
        let (raw, cmd, point) = (&context.device.raw, context.cmd, vk::PipelineBindPoint::COMPUTE);
        // SAFETY: `cmd` is being recorded outside a render pass; the set is of the layout.
        unsafe { raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[self.set], &[]) };
        for (index, (is_local, push)) in steps(places).into_iter().enumerate() {
            if index > 0 {
                (context.between)();
            }
            let groups = if is_local { places / SORT_BLOCK } else { places / 2 / GROUP };
            // SAFETY: as above, with the set bound; the push constants are those of the layout. The pass owns all of it and outlives the submission, and
            // the buffer has that many keys.
            unsafe {
                raw.cmd_bind_pipeline(cmd, point, self.pipelines[usize::from(is_local)].raw);
                raw.cmd_push_constants(cmd, self.layout.raw, COMPUTE, 0, bytemuck::bytes_of(&push));
                raw.cmd_dispatch(cmd, groups, 1, 1);
            }
        }
    }
}

/// All runs of a block at once; then for each longer run a step for each distance that reaches out of a block, and the rest at once.
fn steps(places: u32) -> Vec<SortDispatch> {
    let mut steps = vec![(true, SortPush { first: 2, last: SORT_BLOCK, apart: 0 })];
    let mut run = 2 * SORT_BLOCK;
    while run <= places {
        let mut apart = run / 2;
        while apart >= SORT_BLOCK {
            steps.push((false, SortPush { first: run, last: run, apart }));
            apart /= 2;
        }
        steps.push((true, SortPush { first: run, last: run, apart: 0 }));
        run *= 2;
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The network as `shaders/sort.wgsl` has it.
    fn sorted(mut keys: Vec<(u32, u32)>) -> Vec<(u32, u32)> {
        let exchange = |keys: &mut Vec<(u32, u32)>, run: u32, apart: u32| {
            for pair in 0..keys.len() as u32 / 2 {
                let low = ((pair & !(apart - 1)) << 1) | (pair & (apart - 1));
                let (a, b) = (keys[low as usize], keys[(low + apart) as usize]);
                if (a > b) == (low & run == 0) {
                    keys.swap(low as usize, (low + apart) as usize);
                }
            }
        };
        for (is_local, push) in steps(keys.len() as u32) {
            let mut run = push.first;
            while run <= push.last {
                let mut apart = if is_local { run.min(SORT_BLOCK) / 2 } else { push.apart };
                while apart > 0 {
                    exchange(&mut keys, run, apart);
                    apart = if is_local { apart / 2 } else { 0 };
                }
                run *= 2;
            }
        }
        keys
    }

    #[test]
    fn the_steps_sort_any_keys_and_equal_ones_by_their_places() {
        for count in [SORT_BLOCK, 2 * SORT_BLOCK, 8 * SORT_BLOCK] {
            let key = |place: u32| (place.wrapping_mul(2_654_435_761) >> 22, place);
            let keys: Vec<_> = (0..count).map(key).collect();
            let mut expected = keys.clone();
            expected.sort_unstable();
            assert_eq!(sorted(keys), expected, "{count}");
        }
        // 1 + 2 + 3 + ... steps over all, one more within blocks for each.
        assert_eq!((steps(SORT_BLOCK).len(), steps(8 * SORT_BLOCK).len(), steps(1 << 20).len()), (1, 10, 55));
        assert_eq!([sort_places(0), sort_places(2048), sort_places(2049)], [2048, 2048, 4096]);
    }
}
