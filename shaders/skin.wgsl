// SKIN: the vertices of deformed meshes for a pose: shapes are added by their weights, then joints move the result. One invocation a
// vertex; a work group has vertices of one mesh.
// counts: 1
#import afterlight::vectors::{handedness, scaled_rows, turned_normal, unit_or}

// The offsets of the parts of `sources` and `vertices`, in words.
struct Push {
    // Work groups of a row of the dispatch, and of all of it.
    columns: u32,
    groups: u32,
    records_at: u32,
    // Streams of the vertices that are written. Positions lie at 0; NONE for a stream that no pipeline reads.
    normals_at: u32,
    tangents_at: u32,
    uvs_at: u32,
    colors_at: u32,
    // The first row of `pose` with weights of shapes, four a row.
    weights_row: u32,
    // The offset of the positions of the pose before; NONE where nobody asks for them.
    positions_before_at: u32,
}

var<immediate> push: Push;

// Work groups (the mesh's record, the group's first vertex), records, and the meshes at rest.
@group(0) @binding(0) var<storage, read> sources: array<u32>;
// Three rows a joint, then the weights.
@group(0) @binding(1) var<storage, read> pose: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> vertices: array<f32>;

const NONE: u32 = 0xffffffffu; // host
// Words of a record.
const RECORD: u32 = 15u; // host
// Bits of the attributes that shapes change.
const SHAPES_POSITIONS: u32 = 1u; // host
const SHAPES_NORMALS: u32 = 2u; // host
const SHAPES_TANGENTS: u32 = 4u; // host
const SHAPES_UVS: u32 = 8u; // host
const SHAPES_COLORS: u32 = 16u; // host

// A deformed mesh: `src/gpu_scene/deformed.rs` writes it.
struct Record {
    vertex_count: u32,
    first_vertex: u32,
    positions_at: u32,
    normals_at: u32,
    tangents_at: u32,
    uvs_at: u32,
    colors_at: u32,
    // `per_vertex` joints of every vertex, then as many weights; NONE without a skin.
    influences_at: u32,
    per_vertex: u32,
    first_joint: u32,
    // The deltas of all shapes, one shape after the other.
    shapes_at: u32,
    shape_count: u32,
    shape_words: u32,
    first_weight: u32,
    changes: u32,
}

fn record_at(index: u32) -> Record {
    let at = push.records_at + index * RECORD;
    return Record(
        sources[at], sources[at + 1u], sources[at + 2u], sources[at + 3u], sources[at + 4u], sources[at + 5u], sources[at + 6u],
        sources[at + 7u], sources[at + 8u], sources[at + 9u], sources[at + 10u], sources[at + 11u], sources[at + 12u], sources[at + 13u],
        sources[at + 14u],
    );
}

fn source(at: u32) -> f32 {
    return bitcast<f32>(sources[at]);
}

fn source3(at: u32) -> vec3<f32> {
    return vec3(source(at), source(at + 1u), source(at + 2u));
}

fn source4(at: u32) -> vec4<f32> {
    return vec4(source3(at), source(at + 3u));
}

fn weight_of(shape: u32) -> f32 {
    return pose[push.weights_row + shape / 4u][shape % 4u];
}

fn store3(at: u32, value: vec3<f32>) {
    vertices[at] = value.x;
    vertices[at + 1u] = value.y;
    vertices[at + 2u] = value.z;
}

// A vertex before joints move it.
struct Shaped {
    position: vec3<f32>,
    normal: vec3<f32>,
    tangent: vec3<f32>,
    uv: vec2<f32>,
    color: vec4<f32>,
}

// Adds the shapes. Weights are uniform across the work group, so shapes of weight 0 cost nothing.
fn shaped(record: Record, vertex: u32) -> Shaped {
    var own = Shaped(source3(record.positions_at + vertex * 3u), vec3(0.0), vec3(0.0), vec2(0.0), vec4(0.0));
    if push.normals_at != NONE {
        own.normal = source3(record.normals_at + vertex * 3u);
    }
    if push.tangents_at != NONE && record.tangents_at != NONE {
        own.tangent = source3(record.tangents_at + vertex * 4u);
    }
    if push.uvs_at != NONE && record.uvs_at != NONE {
        let at = record.uvs_at + vertex * 2u;
        own.uv = vec2(source(at), source(at + 1u));
    }
    if push.colors_at != NONE && record.colors_at != NONE {
        own.color = source4(record.colors_at + vertex * 4u);
    }
    for (var shape = 0u; shape < record.shape_count; shape += 1u) {
        let weight = weight_of(record.first_weight + shape);
        if weight == 0.0 {
            continue;
        }
        var at = record.shapes_at + shape * record.shape_words;
        if (record.changes & SHAPES_POSITIONS) != 0u {
            own.position += weight * source3(at + vertex * 3u);
            at += record.vertex_count * 3u;
        }
        if (record.changes & SHAPES_NORMALS) != 0u {
            own.normal += weight * source3(at + vertex * 3u);
            at += record.vertex_count * 3u;
        }
        if (record.changes & SHAPES_TANGENTS) != 0u {
            own.tangent += weight * source3(at + vertex * 3u);
            at += record.vertex_count * 3u;
        }
        if (record.changes & SHAPES_UVS) != 0u {
            own.uv += weight * vec2(source(at + vertex * 2u), source(at + vertex * 2u + 1u));
            at += record.vertex_count * 2u;
        }
        if (record.changes & SHAPES_COLORS) != 0u {
            own.color += weight * source4(at + vertex * 4u);
        }
    }
    return own;
}

// The mean of the joints' maps by the vertex's weights: its rows.
fn blended(record: Record, vertex: u32) -> mat3x4<f32> {
    var rows = mat3x4<f32>();
    let joints_at = record.influences_at + vertex * record.per_vertex;
    let weights_at = joints_at + record.vertex_count * record.per_vertex;
    for (var index = 0u; index < record.per_vertex; index += 1u) {
        let weight = source(weights_at + index);
        if weight == 0.0 {
            continue;
        }
        let joint = (record.first_joint + sources[joints_at + index]) * 3u;
        rows += weight * mat3x4(pose[joint], pose[joint + 1u], pose[joint + 2u]);
    }
    return rows;
}

@compute @workgroup_size(64)
fn compute(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = group.y * push.columns + group.x;
    if index >= push.groups {
        return;
    }
    let record = record_at(sources[index * 2u]);
    let vertex = sources[index * 2u + 1u] + lane;
    if vertex >= record.vertex_count {
        return;
    }
    let out = record.first_vertex + vertex;
    var own = shaped(record, vertex);
    var sign = 1.0;
    if record.influences_at != NONE {
        let map = blended(record, vertex);
        let rows = scaled_rows(map[0].xyz, map[1].xyz, map[2].xyz);
        let position = vec4(own.position, 1.0);
        own.position = vec3(dot(map[0], position), dot(map[1], position), dot(map[2], position));
        own.normal = turned_normal(rows, own.normal);
        own.tangent = own.tangent * rows;
        sign = handedness(rows);
    }
    if push.positions_before_at != NONE {
        store3(push.positions_before_at + out * 3u, vec3(vertices[out * 3u], vertices[out * 3u + 1u], vertices[out * 3u + 2u]));
    }
    store3(out * 3u, own.position);
    if push.normals_at != NONE {
        // Of unit length, as at rest: a longer one would count for more between vertices.
        store3(push.normals_at + out * 3u, unit_or(own.normal, vec3(0.0, 1.0, 0.0)));
    }
    if push.tangents_at != NONE && record.tangents_at != NONE {
        let at = push.tangents_at + out * 4u;
        store3(at, unit_or(own.tangent, vec3(1.0, 0.0, 0.0)));
        vertices[at + 3u] = source(record.tangents_at + vertex * 4u + 3u) * sign;
    }
    if push.uvs_at != NONE && (record.changes & SHAPES_UVS) != 0u {
        let at = push.uvs_at + out * 2u;
        vertices[at] = own.uv.x;
        vertices[at + 1u] = own.uv.y;
    }
    if push.colors_at != NONE && (record.changes & SHAPES_COLORS) != 0u {
        let at = push.colors_at + out * 4u;
        // Clamped after shapes are added (glTF 2.0, "Morph Targets").
        let color = clamp(own.color, vec4(0.0), vec4(1.0));
        store3(at, color.rgb);
        vertices[at + 3u] = color.a;
    }
}
