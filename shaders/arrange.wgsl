// ARRANGE: for each step of depth a work group, which turns the numbers of instances by group into how many come before them in the step.
#import afterlight::culling::{count_at, cull, culled}

// How many each step has, for the CPU.
@group(0) @binding(7) var<storage, read_write> found: array<u32>;

const THREADS: u32 = 128u;

var<workgroup> sums: array<u32, 128>;

@compute @workgroup_size(128)
fn compute(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let step = workgroup.x;
    // Each thread has some groups that follow each other.
    let share = (cull.groups + THREADS - 1u) / THREADS;
    let first = min(thread * share, cull.groups);
    let end = min(first + share, cull.groups);
    var sum = 0u;
    for (var group = first; group < end; group++) {
        sum += culled[count_at(step, group)];
    }
    sums[thread] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var other = 0u; other < thread; other++) {
        before += sums[other];
    }
    for (var group = first; group < end; group++) {
        let at = count_at(step, group);
        let count = culled[at];
        culled[at] = before;
        before += count;
    }
    if thread == THREADS - 1u {
        culled[cull.totals_at + step] = before;
        found[step] = before;
    }
}
