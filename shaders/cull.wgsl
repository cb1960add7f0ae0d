// CULL: finds the instances that are in view and not hidden, the depth step of each, and how many come before it in its group.
// variants: HIDES LEVELS
// precise
// counts: 4; with HIDES 2, LEVELS 2
#import afterlight::culling::{Batch, batch_of, count_at, cull, culled, group_of, groups, HIDDEN, LANES, slot_of, InstanceTransform, transforms, STEPS}

struct Bounds {
    center: vec3<f32>,
    half: vec3<f32>,
}

@group(0) @binding(4) var<storage, read> boxes: array<Bounds>;

// A bit for each lane whose instance is seen, by step and level.
#ifdef LEVELS
var<workgroup> seen: array<array<atomic<u32>, 2>, 544>;
#else
var<workgroup> seen: array<array<atomic<u32>, 2>, STEPS>;
#endif

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
fn step_of(bounds: Bounds) -> u32 {
    let offset = bounds.center - cull.camera;
    let along = abs(cull.forward);
    let middle = offset.x * cull.forward.x + offset.y * cull.forward.y + offset.z * cull.forward.z;
    let depth = middle + (bounds.half.x * along.x + bounds.half.y * along.y + bounds.half.z * along.z);
    return u32(clamp((depth - cull.begin) * cull.scale, 0.0, f32(STEPS - 1u)));
}

#ifdef HIDES
// The depths that PYRAMID writes, level by level.
@group(0) @binding(6) var<storage, read> pyramid: array<f32>;

// A box is hidden only if it lies behind its occluder by DEPTH_SHARE of its depth and by DEPTH_SLACK: depths are interpolated over large triangles
// with the rounding of their largest value.
const DEPTH_SHARE: f32 = 1e-3; // host
const DEPTH_SLACK: f32 = 4e-6; // host

// The box is hidden if every pixel that it may cover shows something before it.
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
        // Objects this large are mostly visible.
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

#ifdef LEVELS
// The level of fewest triangles that is off by no more than is allowed, as src/visible/levels.rs has it, to the bit.
fn level_of(batch: Batch, transform: InstanceTransform, bounds: Bounds) -> u32 {
    let beside = max(abs(bounds.center - cull.camera) - bounds.half - cull.slack, vec3(0.0));
    let squared = beside.x * beside.x + beside.y * beside.y + beside.z * beside.z;
    let allowed = cull.allowed * select(squared, 1.0, cull.is_orthographic != 0u);
    var level = 0u;
    while level + 1u < batch.levels {
        let error = bitcast<f32>(groups[cull.levels_at + (batch.first_command + level + 1u) * 3u + 2u]);
        if error * transform.scale > allowed {
            break;
        }
        level++;
    }
    return level;
}
#endif

@compute @workgroup_size(64)
fn compute(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let group = group_of(workgroup);
    if group >= cull.groups {
        return;
    }
    let batch = batch_of(group);
    let count = STEPS * batch.levels;
    for (var index = lane; index < count; index += LANES) {
        atomicStore(&seen[index][0], 0u);
        atomicStore(&seen[index][1], 0u);
    }
    workgroupBarrier();
    var step = HIDDEN;
    var level = 0u;
    if lane < groups[group * 3u + 1u] {
        let place = groups[group * 3u] + lane;
        if is_seen(boxes[place]) {
            step = step_of(boxes[place]);
#ifdef LEVELS
            level = level_of(batch, transforms[place], boxes[place]);
#endif
            atomicOr(&seen[step * batch.levels + level][lane / 32u], 1u << (lane % 32u));
        }
    }
    workgroupBarrier();
    var before = 0u;
    if step != HIDDEN {
        let own = step * batch.levels + level;
        before = countOneBits(atomicLoad(&seen[own][lane / 32u]) & ((1u << (lane % 32u)) - 1u));
        if lane >= 32u {
            before += countOneBits(atomicLoad(&seen[own][0]));
        }
    }
    culled[group * LANES + lane] = step | (level << 8u) | (before << 16u);
    for (var index = lane; index < count; index += LANES) {
        let at = count_at(index / batch.levels, slot_of(batch, index % batch.levels, group));
        culled[at] = countOneBits(atomicLoad(&seen[index][0])) + countOneBits(atomicLoad(&seen[index][1]));
    }
}
