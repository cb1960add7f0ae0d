// Data of CULL, ARRANGE and FILL. Instances are in a list, in which a batch, the instances of one draw command, is contiguous. Work groups look at
// groups of instances, each a part of one batch.
#define_import_path afterlight::culling

struct Cull {
    // The sides of the view and its near plane, around the camera; normals point inside.
    planes: array<vec4<f32>, 5>,
    // The camera's place, relative to the one that transforms of instances are about, in two parts.
    camera: vec3<f32>,
    // Metres by which a box may lie beside where f32 has it.
    slack: f32,
    camera_rest: vec3<f32>,
    // The distance at which the first step of depth begins, and steps a metre.
    begin: f32,
    forward: vec3<f32>,
    scale: f32,
    groups: u32,
    // Counts, and commands, of a step of depth.
    slots: u32,
    commands: u32,
    // Groups of a row of the dispatch.
    columns: u32,
    // The offsets of the parts of `culled`, in words.
    counts_at: u32,
    totals_at: u32,
    draws_at: u32,
    rows_at: u32,
    looks_at: u32,
    // The offset of the levels of detail in `groups`, in words.
    levels_at: u32,
    // The square of the metres that the error of a level may have at a distance of one, or at any.
    allowed: f32,
    is_orthographic: u32,
    // As the passes that draw have it.
    clip_from_world: mat4x4<f32>,
    // The picture's width and height in pixels.
    picture: vec2<f32>,
    // Work groups of PYRAMID across and down.
    tiles: vec2<u32>,
}

@group(0) @binding(0) var<uniform> cull: Cull;
// Three words for each group: its first place in the list, how many places, and its batch. Then the batches, and three words for each level of
// detail of each: indices, the first of them, and the square of its error.
@group(0) @binding(1) var<storage, read> groups: array<u32>;
// First a word for each lane of each group, by which CULL says of an instance: its step of depth, its level, and how many of its group with both
// come before it. Then, by step and slot, how many instances there are, which ARRANGE replaces by how many come before them in the step. Then how
// many each step has, the commands by step, batch and level, and at last the rows of the instances in the order in which they are drawn, and how
// they look.
@group(0) @binding(2) var<storage, read_write> culled: array<u32>;

struct Batch {
    // Levels of detail, of which the mesh itself is one.
    levels: u32,
    groups: u32,
    // The counts of a step: of the first level all groups', then of the next.
    first_slot: u32,
    // The batch's first command among the commands of a step, and its first level among all levels.
    first_command: u32,
    first_vertex: u32,
    first_group: u32,
}

struct InstanceTransform {
    // Rows of the map from the mesh, the larger part of the offset in w.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    rest: vec3<f32>,
    // The square of the largest factor by which a length grows.
    scale: f32,
}

@group(0) @binding(3) var<storage, read> transforms: array<InstanceTransform>;

// Steps of depth, by which instances are sorted, and the instances of a group.
const STEPS: u32 = 32u; // host
const LANES: u32 = 64u; // host
// The step of instances that are not visible.
const HIDDEN: u32 = 255u;

fn group_of(workgroup: vec3<u32>) -> u32 {
    return workgroup.y * cull.columns + workgroup.x;
}

fn batch_of(group: u32) -> Batch {
    let at = cull.groups * 3u + groups[group * 3u + 2u] * 6u;
    return Batch(groups[at], groups[at + 1u], groups[at + 2u], groups[at + 3u], groups[at + 4u], groups[at + 5u]);
}

fn slot_of(batch: Batch, level: u32, group: u32) -> u32 {
    return batch.first_slot + level * batch.groups + group - batch.first_group;
}

fn count_at(step: u32, slot: u32) -> u32 {
    return cull.counts_at + step * cull.slots + slot;
}
