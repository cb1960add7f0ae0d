// FILL: the rows of the instances that are seen, in the order in which they are drawn, and the commands that draw them.
// variants: LOOKS
// precise
// counts: 2; with LOOKS 1
#import afterlight::culling::{batch_of, count_at, cull, culled, group_of, groups, HIDDEN, LANES, slot_of, InstanceTransform, transforms, STEPS}

#ifdef LOOKS
// The look of each (material.wgsl), two of its numbers in a word.
@group(0) @binding(5) var<storage, read> looks: array<vec2<u32>>;
#endif

// The number of instances before each step.
var<workgroup> before: array<u32, STEPS>;

// The offset of an instance from the camera, as src/visible/instances.rs has it, to the bit.
fn offset_of(transform: InstanceTransform) -> vec3<f32> {
    let large = vec3(transform.x.w, transform.y.w, transform.z.w);
    let difference = large - cull.camera;
    let back = difference - large;
    let lost = (large - (difference - back)) - (cull.camera + back);
    return difference + (lost + (transform.rest - cull.camera_rest));
}

fn store(at: u32, row: vec3<f32>, offset: f32) {
    culled[at] = bitcast<u32>(row.x);
    culled[at + 1u] = bitcast<u32>(row.y);
    culled[at + 2u] = bitcast<u32>(row.z);
    culled[at + 3u] = bitcast<u32>(offset);
}

@compute @workgroup_size(64)
fn compute(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let group = group_of(workgroup);
    if group >= cull.groups {
        return;
    }
    if lane < STEPS {
        var sum = 0u;
        for (var step = 0u; step < lane; step++) {
            sum += culled[cull.totals_at + step];
        }
        before[lane] = sum;
    }
    workgroupBarrier();
    let mark = culled[group * LANES + lane];
    let step = mark & 255u;
    let batch = batch_of(group);
    if step != HIDDEN {
        let own = groups[group * 3u] + lane;
        let transform = transforms[own];
        let offset = offset_of(transform);
        let slot = slot_of(batch, (mark >> 8u) & 255u, group);
        let place = before[step] + culled[count_at(step, slot)] + (mark >> 16u);
        let at = cull.rows_at + place * 12u;
        store(at, transform.x.xyz, offset.x);
        store(at + 4u, transform.y.xyz, offset.y);
        store(at + 8u, transform.z.xyz, offset.z);
#ifdef LOOKS
        culled[cull.looks_at + place * 2u] = looks[own].x;
        culled[cull.looks_at + place * 2u + 1u] = looks[own].y;
#endif
    }
    // The first group of a batch writes its commands: VkDrawIndexedIndirectCommand.
    if batch.first_group == group && lane < STEPS {
        for (var level = 0u; level < batch.levels; level++) {
            let slot = batch.first_slot + level * batch.groups;
            let next = slot + batch.groups;
            let first = culled[count_at(lane, slot)];
            var end = culled[cull.totals_at + lane];
            if next < cull.slots {
                end = culled[count_at(lane, next)];
            }
            let command = batch.first_command + level;
            let at = cull.draws_at + (lane * cull.commands + command) * 5u;
            culled[at] = groups[cull.levels_at + command * 3u];
            culled[at + 1u] = end - first;
            culled[at + 2u] = groups[cull.levels_at + command * 3u + 1u];
            culled[at + 3u] = batch.first_vertex;
            culled[at + 4u] = before[lane] + first;
        }
    }
}
