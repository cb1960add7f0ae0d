// ARRANGE: for each step of depth a work group, which turns the numbers of instances by slot into how many come before them in the step.
// counts: 1
#import afterlight::culling::{count_at, cull, culled}

// The number of instances of each step, for the CPU.
@group(0) @binding(7) var<storage, read_write> found: array<u32>;

const THREADS: u32 = 128u;

var<workgroup> sums: array<u32, 128>;

@compute @workgroup_size(128)
fn compute(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let step = workgroup.x;
    // Each thread has some slots that follow each other.
    let share = (cull.slots + THREADS - 1u) / THREADS;
    let first = min(thread * share, cull.slots);
    let end = min(first + share, cull.slots);
    var sum = 0u;
    for (var slot = first; slot < end; slot++) {
        sum += culled[count_at(step, slot)];
    }
    sums[thread] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var other = 0u; other < thread; other++) {
        before += sums[other];
    }
    for (var slot = first; slot < end; slot++) {
        let at = count_at(step, slot);
        let count = culled[at];
        culled[at] = before;
        before += count;
    }
    if thread == THREADS - 1u {
        culled[cull.totals_at + step] = before;
        found[step] = before;
    }
}
