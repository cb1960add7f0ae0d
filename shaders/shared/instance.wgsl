// The placing and the look of a drawn instance.
#define_import_path afterlight::instance
#import afterlight::vectors::{handedness, scaled_rows, turned_normal, unit_or}

// Rows of an instance's map from mesh space to the world around the camera.
struct Rows {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

// Maps a position from mesh space to the world around the camera.
fn world_position(rows: Rows, position: vec3<f32>) -> vec3<f32> {
    let p = vec4(position, 1.0);
    return vec3(dot(rows.x, p), dot(rows.y, p), dot(rows.z, p));
}

// The linear part of an instance's map.
fn linear(rows: Rows) -> mat3x3<f32> {
    return scaled_rows(rows.x.xyz, rows.y.xyz, rows.z.xyz);
}

// Metres per unit of the mesh: the cube root of how much larger a body is in the world.
fn scale_of(rows: Rows) -> f32 {
    return pow(abs(determinant(mat3x3(rows.x.xyz, rows.y.xyz, rows.z.xyz))), 1.0 / 3.0);
}

// Not of unit length.
fn world_normal(rows: Rows, normal: vec3<f32>) -> vec3<f32> {
    return turned_normal(linear(rows), normal);
}

// The tangent has unit length, however large the object is: a mapped normal leans as far at any scale.
fn world_tangent(rows: Rows, tangent: vec4<f32>) -> vec4<f32> {
    let t = tangent.xyz;
    let sign = handedness(linear(rows));
    return vec4(unit_or(vec3(dot(rows.x.xyz, t), dot(rows.y.xyz, t), dot(rows.z.xyz, t)), vec3(0.0)), tangent.w * sign);
}

// The look of an instance (src/visible/looks.rs): its tint in 65535ths, then the layer of its cell, and in bit 15 whether it is selected.
fn tint_of(look: vec4<u32>) -> vec3<f32> {
    return vec3<f32>(look.xyz) / 65535.0;
}

// The look on its way from the vertices to the fragments: two numbers in each. A tint that travels as it is, flat, reaches each fragment to the bit;
// one that is interpolated as a colour is rounded, and Mesa before 26 moves the centroids of all values of a shader that reads one more of them.
fn packed_look(look: vec4<u32>) -> vec2<u32> {
    return look.xz | (look.yw << vec2(16u));
}

fn unpacked_look(packed: vec2<u32>) -> vec4<u32> {
    return vec4(packed.x & 0xffffu, packed.x >> 16u, packed.y & 0xffffu, packed.y >> 16u);
}

fn layer_of(last: u32) -> u32 {
    return last & 0x7fffu;
}

fn is_selected(last: u32) -> bool {
    return (last & 0x8000u) != 0u;
}

// The base colour of selected instances (HIGHLIGHT and its share in crates/scene/src/look.rs).
fn highlighted(color: vec3<f32>, exposure: f32) -> vec3<f32> {
    return color * 0.25 + vec3(1.0, 0.4, 0.0) * (0.75 * exposure);
}

// The normal that a texel of a normal map says, on a surface with this normal and tangent.
fn bent_normal(texel: vec3<f32>, scale: f32, normal: vec3<f32>, tangent: vec4<f32>) -> vec3<f32> {
    // 128 of 255 is the zero: a neutral map decodes to exactly (0, 0, 1). The dead zone of 1/100 of a step takes up the
    // driver's rounding.
    let centered = texel * 255.0 - 128.0;
    let snapped = select(centered, vec3(0.0), abs(centered) < vec3(0.01));
    let n = snapped / 127.0 * vec3(scale, scale, 1.0);
    let bitangent = cross(normal, tangent.xyz) * tangent.w;
    // MikkTSpace: the interpolated frame is used as it is, neither orthogonalized nor normalized (Mikkelsen 2008).
    let mapped = unit_or(tangent.xyz * n.x + bitangent * n.y + normal * n.z, normal);
    // A flat texel leaves the normal as it is, to the last bit: so that a flat map can be left out.
    return select(mapped, normal, n.x == 0.0 && n.y == 0.0 && n.z > 0.0);
}
