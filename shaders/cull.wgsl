// CULL: which instances are in view and not hidden, in which step of depth each of those is, and how many come before it in its group.
// variants: HIDES
// precise
#import afterlight::culling::{count_at, cull, culled, group_of, groups, HIDDEN, LANES, Stand, stands, STEPS}

struct Bounds {
    center: vec3<f32>,
    half: vec3<f32>,
}

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

#ifdef HIDES
// What PYRAMID writes.
@group(0) @binding(6) var<storage, read> pyramid: array<f32>;

// Behind what hides it a box is by so much of its depth, and by so much in any case: depths are interpolated over large triangles with the
// rounding of their largest value. As in src/visible/occlusion.rs.
const DEPTH_SHARE: f32 = 1e-3;
const DEPTH_SLACK: f32 = 4e-6;

// Whether all pixels that the box may cover show something before it.
fn is_hidden(bounds: Bounds) -> bool {
    let center = bounds.center - cull.camera;
    let half = bounds.half + cull.slack;
    var low = vec2(1e30);
    var high = vec2(-1e30);
    var nearest = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let side = vec3(f32(corner & 1u), f32((corner >> 1u) & 1u), f32(corner >> 2u)) * 2.0 - 1.0;
        let clip = cull.clip_from_world * vec4(center + side * half, 1.0);
        // Not wholly before the near plane.
        if clip.w <= 0.0 || clip.z >= clip.w {
            return false;
        }
        let at = (clip.xy / clip.w * 0.5 + 0.5) * cull.picture;
        low = min(low, at);
        high = max(high, at);
        nearest = max(nearest, clip.z / clip.w);
    }
    // Samples lie beside centres, and vertices are rounded to parts of a pixel.
    low = floor(low) - 1.0;
    high = floor(high) + 1.0;
    if any(high < vec2(0.0)) || any(low >= cull.picture) {
        return false;
    }
    let first = vec2<u32>(max(low, vec2(0.0)));
    let last = vec2<u32>(min(high, cull.picture - 1.0));
    // The finest level of which it covers no more than five squares across and down.
    let span = max(last.x - first.x, last.y - first.y);
    var shift = 3u;
    var edge = 8u;
    var at = 0u;
    while (span >> shift) > 3u {
        // What is so large is mostly seen.
        if edge == 1u {
            return false;
        }
        at += cull.tiles.x * cull.tiles.y * edge * edge;
        edge /= 2u;
        shift++;
    }
    let behind = nearest * (1.0 + DEPTH_SHARE) + DEPTH_SLACK;
    for (var row = first.y >> shift; row <= last.y >> shift; row++) {
        for (var column = first.x >> shift; column <= last.x >> shift; column++) {
            if pyramid[at + row * cull.tiles.x * edge + column] <= behind {
                return false;
            }
        }
    }
    return true;
}
#endif

fn is_seen(bounds: Bounds) -> bool {
#ifdef HIDES
    return is_in_view(bounds) && !is_hidden(bounds);
#else
    return is_in_view(bounds);
#endif
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
        if is_seen(boxes[place]) {
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
