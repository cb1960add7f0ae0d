// REFLECT's record for REFLECT_RESOLVE, and the choice of directions of a lobe.
#define_import_path afterlight::reflection
#import afterlight::frame::{frame}
#import afterlight::encodings::{octahedral, octahedral_decode}
#import afterlight::brdf::{smith_root, MIN_ROUGHNESS, PI}

// Directions that stand for a lobe where its share of even light is asked for.
const CHOICES: u32 = 16u;

// The result of a pixel's ray.
struct Found {
    // The ray's direction, of length 1.
    direction: vec3<f32>,
    // Metres to the hit; 0 without one.
    distance: f32,
    // The lit picture's light there.
    light: vec3<f32>,
    // 0 without a hit.
    confidence: f32,
    // The density of directions there, a steradian; 0 where no ray was sent.
    density: f32,
}

// Steps of an octahedral coordinate: a mirror's lobe is 1e-4 wide.
const DIRECTION_STEPS: f32 = 524287.0;
// The binary logarithm of a density in 16 bits: from 2^-20 up, in steps of 1/1024.
const LEAST_DENSITY: f32 = 20.0;

fn pack_found(found: Found) -> vec4<u32> {
    let direction = vec2<u32>(round((octahedral(found.direction) + 1.0) * DIRECTION_STEPS));
    let density = u32(clamp((log2(max(found.density, 1e-6)) + LEAST_DENSITY) * 1024.0, 1.0, 65535.0));
    // Half floats end at 65504.
    let light = clamp(found.light, vec3(0.0), vec3(65000.0));
    return vec4(
        pack2x16float(light.xy),
        pack2x16float(vec2(light.z, min(found.distance, 65000.0))),
        direction.x | ((direction.y & 0xfffu) << 20u),
        (direction.y >> 12u) | (u32(saturate(found.confidence) * 255.0 + 0.5) << 8u) | (select(density, 0u, found.density <= 0.0) << 16u),
    );
}

fn unpack_found(packed: vec4<u32>) -> Found {
    let first = unpack2x16float(packed.x);
    let second = unpack2x16float(packed.y);
    let code = vec2(packed.z & 0xfffffu, (packed.z >> 20u) | ((packed.w & 0xffu) << 12u));
    let density = packed.w >> 16u;
    var found: Found;
    found.direction = octahedral_decode(vec2<f32>(code) / DIRECTION_STEPS - 1.0);
    found.distance = second.y;
    found.light = vec3(first, second.x);
    found.confidence = f32((packed.w >> 8u) & 0xffu) / 255.0;
    found.density = select(exp2(f32(density) / 1024.0 - LEAST_DENSITY), 0.0, density == 0u);
    return found;
}

// 0 to 15, each once in a tile of 4 x 4, neighbours far apart (B. E. Bayer, "An optimum method for two-level rendition", 1973).
fn tile_number(texel: vec2<u32>) -> u32 {
    let mixed = texel.x ^ texel.y;
    return ((mixed & 1u) << 3u) | ((texel.y & 1u) << 2u) | (mixed & 2u) | ((texel.y & 2u) >> 1u);
}

// The unit square's point of a choice (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
fn choice(index: u32) -> vec2<f32> {
    return fract(vec2(0.5) + vec2(0.75487767, 0.56984029) * f32(index));
}

// The choice of a pixel: 64, each once in a square of 8 x 8, of which each tile of 4 x 4 has every fourth. The pixels around fill the gaps, and
// frames of a picture have other choices.
fn choice_of(texel: vec2<u32>) -> vec2<f32> {
    let tile = texel >> vec2(2u);
    let quarter = (((tile.x ^ tile.y) & 1u) << 1u) | (tile.y & 1u);
    return fract(choice(4u * tile_number(texel & vec2(3u)) + quarter) + frame.jitter);
}

// Two vectors of length 1 that lie across one (T. Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
fn across_normal(n: vec3<f32>) -> mat2x3<f32> {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat2x3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y));
}

// A half vector about +Z, as often as GGX has facets there that are seen from a direction (J. Dupuy and A. Benyoub, "Sampling Visible GGX Normals with
// Spherical Caps", 2023).
fn visible_facet(view: vec3<f32>, point: vec2<f32>, alpha: f32) -> vec3<f32> {
    let stretched = normalize(vec3(view.xy * alpha, view.z));
    let angle = 2.0 * PI * point.x;
    let z = (1.0 - point.y) * (1.0 + stretched.z) - stretched.z;
    let sine = sqrt(saturate(1.0 - z * z));
    let cap = vec3(sine * cos(angle), sine * sin(angle), z) + stretched;
    return normalize(vec3(cap.xy * alpha, max(cap.z, 1e-9)));
}

// The share of even light that a lobe with a Fresnel term of 1 reflects: the mean share over the choices that is not masked again on the way out.
fn lobe_share(n_dot_v: f32, roughness: f32) -> f32 {
    let alpha = max(roughness, MIN_ROUGHNESS) * max(roughness, MIN_ROUGHNESS);
    let view = vec3(sqrt(max(1.0 - n_dot_v * n_dot_v, 0.0)), 0.0, n_dot_v);
    let alpha_squared = alpha * alpha;
    let hidden_view = smith_root(n_dot_v, alpha_squared) / n_dot_v;
    var sum = 0.0;
    for (var i = 0u; i < CHOICES; i++) {
        let half = visible_facet(view, choice(i), alpha);
        let n_dot_l = 2.0 * dot(view, half) * half.z - n_dot_v;
        if n_dot_l > 0.0 {
            sum += (hidden_view + 1.0) / (hidden_view + smith_root(n_dot_l, alpha_squared) / n_dot_l);
        }
    }
    return sum / f32(CHOICES);
}

// The share of a surface's reflections that is taken from the screen: surfaces near the roughest fade out.
fn smooth_enough(roughness: f32, roughest: f32) -> f32 {
    return saturate((roughest - roughness) / max(0.2 * roughest, 1e-6) + select(0.0, 1e-3, roughness <= roughest));
}
