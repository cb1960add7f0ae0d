// CULL: which instances are in view, in which step of depth each of those is, and how many come before it in its group.
// precise
#import afterlight::culling::{count_at, cull, culled, group_of, groups, HIDDEN, LANES, STEPS}

struct Stand {
    // Rows of the map from the mesh, the larger part of the offset in w.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    rest: vec3<f32>,
}

struct Bounds {
    center: vec3<f32>,
    half: vec3<f32>,
}

@group(0) @binding(3) var<storage, read> stands: array<Stand>;
@group(0) @binding(4) var<storage, read> boxes: array<Bounds>;

// A bit for each lane whose instance is seen, by step.
var<workgroup> seen: array<array<atomic<u32>, 2>, 32>;

fn is_in_view(bounds: Bounds) -> bool {
    let center = bounds.center - cull.camera;
    for (var index = 0u; index < 5u; index++) {
        let plane = cull.planes[index];
        if dot(plane.xyz, center) + plane.w + dot(abs(plane.xyz), bounds.half) < -cull.slack {
            return false;
        }
    }
    return true;
}

// As src/visible/instances.rs has it, to the bit: instances that are equally far are drawn in the same order.
fn step_of(stand: Stand) -> u32 {
    let offset = vec3(stand.x.w, stand.y.w, stand.z.w) - cull.camera;
    let depth = offset.x * cull.forward.x + offset.y * cull.forward.y + offset.z * cull.forward.z;
    return u32(clamp((depth - cull.begin) * cull.scale, 0.0, f32(STEPS - 1u)));
}

@compute @workgroup_size(64)
fn compute(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let group = group_of(workgroup);
    if group >= cull.groups {
        return;
    }
    atomicStore(&seen[lane / 2u][lane % 2u], 0u);
    workgroupBarrier();
    var step = HIDDEN;
    if lane < groups[group * 3u + 1u] {
        let place = groups[group * 3u] + lane;
        if is_in_view(boxes[place]) {
            step = step_of(stands[place]);
            atomicOr(&seen[step][lane / 32u], 1u << (lane % 32u));
        }
    }
    workgroupBarrier();
    var before = 0u;
    if step != HIDDEN {
        let own = atomicLoad(&seen[step][lane / 32u]) & ((1u << (lane % 32u)) - 1u);
        before = countOneBits(own);
        if lane >= 32u {
            before += countOneBits(atomicLoad(&seen[step][0]));
        }
    }
    culled[group * LANES + lane] = step | (before << 8u);
    if lane < STEPS {
        let count = countOneBits(atomicLoad(&seen[lane][0])) + countOneBits(atomicLoad(&seen[lane][1]));
        culled[count_at(lane, group)] = count;
    }
}
