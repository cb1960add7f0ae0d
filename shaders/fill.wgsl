// FILL: the rows of the instances that are seen, in the order in which they are drawn, and the commands that draw them.
// precise
#import afterlight::culling::{count_at, cull, culled, group_of, groups, HIDDEN, LANES, STEPS}

struct Stand {
    // Rows of the map from the mesh, the larger part of the offset in w.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    rest: vec3<f32>,
}

@group(0) @binding(3) var<storage, read> stands: array<Stand>;

// By step: how many instances come before it.
var<workgroup> before: array<u32, 32>;

// The offset of an instance from the camera, as src/visible/instances.rs has it, to the bit.
fn offset_of(stand: Stand) -> vec3<f32> {
    let large = vec3(stand.x.w, stand.y.w, stand.z.w);
    let difference = large - cull.camera;
    let back = difference - large;
    let lost = (large - (difference - back)) - (cull.camera + back);
    return difference + (lost + (stand.rest - cull.camera_rest));
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
    if step != HIDDEN {
        let stand = stands[groups[group * 3u] + lane];
        let offset = offset_of(stand);
        let place = before[step] + culled[count_at(step, group)] + (mark >> 8u);
        let at = cull.rows_at + place * 12u;
        store(at, stand.x.xyz, offset.x);
        store(at + 4u, stand.y.xyz, offset.y);
        store(at + 8u, stand.z.xyz, offset.z);
    }
    // The first group of a batch writes its commands: VkDrawIndexedIndirectCommand.
    let batch = groups[group * 3u + 2u];
    let batch_at = cull.groups * 3u + batch * 4u;
    if groups[batch_at + 3u] == group && lane < STEPS {
        let first = culled[count_at(lane, group)];
        var end = culled[cull.totals_at + lane];
        if batch + 1u < cull.batches {
            end = culled[count_at(lane, groups[batch_at + 7u])];
        }
        let at = cull.draws_at + (lane * cull.batches + batch) * 5u;
        culled[at] = groups[batch_at];
        culled[at + 1u] = end - first;
        culled[at + 2u] = groups[batch_at + 1u];
        culled[at + 3u] = groups[batch_at + 2u];
        culled[at + 4u] = before[lane] + first;
    }
}
