// The encodings of directions in G-buffer channels.
#define_import_path afterlight::encodings

// NORMAL_ENCODING in the passes.
const OCTAHEDRAL: u32 = 0u; // host
const HALF_ENCODED: u32 = 1u; // host
const SIGNED: u32 = 2u; // host
const OCTAHEDRAL_8: u32 = 3u; // host

// ANCHOR: octahedral
fn sign_not_zero(v: vec2<f32>) -> vec2<f32> {
    return select(vec2(-1.0), vec2(1.0), v >= vec2(0.0));
}

// Octahedral map of a unit vector to -1..1 (Cigolle et al. 2014, "A Survey of Efficient Representations for Independent
// Unit Vectors").
fn octahedral(n: vec3<f32>) -> vec2<f32> {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return select((1.0 - abs(p.yx)) * sign_not_zero(p), p, n.z >= 0.0);
}

fn octahedral_decode(e: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(e.x) - abs(e.y);
    let xy = select((1.0 - abs(e.yx)) * sign_not_zero(e), e, z >= 0.0);
    return normalize(vec3(xy, z));
}

// -1..1 to normalized channels of `steps` + 1 codes, and back. Centred on a code, so that 0 and with it each axis is exact.
fn to_unorm(v: vec2<f32>, steps: f32) -> vec2<f32> {
    let half_steps = floor(steps * 0.5);
    return (round(v * half_steps) + half_steps) / steps;
}

fn from_unorm(v: vec2<f32>, steps: f32) -> vec2<f32> {
    let half_steps = floor(steps * 0.5);
    return clamp((round(v * steps) - half_steps) / half_steps, vec2(-1.0), vec2(1.0));
// ANCHOR_END: octahedral
}

fn encode_normal(n: vec3<f32>, encoding: u32) -> vec4<f32> {
    switch encoding {
        case OCTAHEDRAL: { return vec4(to_unorm(octahedral(n), 65535.0), 0.0, 0.0); }
        case OCTAHEDRAL_8: { return vec4(to_unorm(octahedral(n), 255.0), 0.0, 0.0); }
        case HALF_ENCODED: { return vec4(n * 0.5 + 0.5, 0.0); }
        default: { return vec4(n, 0.0); }
    }
}

fn decode_normal(t: vec4<f32>, encoding: u32) -> vec3<f32> {
    switch encoding {
        case OCTAHEDRAL: { return octahedral_decode(from_unorm(t.xy, 65535.0)); }
        case OCTAHEDRAL_8: { return octahedral_decode(from_unorm(t.xy, 255.0)); }
        case HALF_ENCODED: { return normalize(t.xyz * 2.0 - 1.0); }
        default: { return normalize(t.xyz); }
    }
}

// Octahedral encoding with 65536 codes, in an unsigned integer target.
fn encode_normal_uint(n: vec3<f32>) -> vec2<u32> {
    return vec2<u32>(round(octahedral(n) * 32767.0) + 32767.0);
}

fn decode_normal_uint(t: vec2<u32>) -> vec3<f32> {
    return octahedral_decode(clamp((vec2<f32>(t) - 32767.0) / 32767.0, vec2(-1.0), vec2(1.0)));
}

// Packs a Cook-Torrance surface's reflectances, facing the eye and grazing, for a specular target that has such surfaces. The square root gives dark
// reflectances most codes, and 0.04 has an exact 8-bit code (51). Two thirds of the last channel are for the grazing share, whose 1 has an exact code
// (170); the values above mark the other BRDFs: 7/9, 8/9 and 1.
fn encode_dielectric(facing: vec3<f32>, grazing: f32) -> vec4<f32> {
    return vec4(sqrt(facing), grazing * (2.0 / 3.0));
}

fn decode_facing(stored: vec3<f32>) -> vec3<f32> {
    return stored * stored;
}

fn decode_grazing(stored: f32) -> f32 {
    return min(stored * 1.5, 1.0);
}

// The BRDF of the last channel. It is Cook-Torrance's, number 0, below the codes of the others.
fn decode_brdf(stored: f32) -> u32 {
    return select(u32(round(stored * 9.0)) - 6u, 0u, stored < 0.72);
}

// A specular power, 0 to about a million, in 0..1: about 1.1% a step of 8 bits at Ns = 1000, relative error even over the range.
fn encode_shininess(shininess: f32) -> f32 {
    return log2(shininess + 1.0) / 20.0;
}

fn decode_shininess(t: f32) -> f32 {
    return exp2(t * 20.0) - 1.0;
}
