// PREFILTER: once for a sky, the light that surfaces collect of it. LOBE is a level of the mirrored sky, BASE the light that lambert surfaces
// reflect; without both it is the table of a lobe's shares of even light.
// variants: LOBE BASE
// excludes: LOBE BASE
// counts: 3; with LOBE 1, BASE 1
#import afterlight::brdf::{smith_root, squared_alpha, PI}

struct Push {
    // Texels along a face of the output, or along the table.
    edge: u32,
    // Perceptual.
    roughness: f32,
    // The number of directions that are sampled.
    samples: u32,
    // Texels along a face of the sky's finest level; for BASE, of the level that it reads.
    source_edge: f32,
    // The level of the sky that BASE reads.
    level: u32,
}

var<immediate> push: Push;

#ifdef LOBE
@group(0) @binding(0) var sky: texture_cube<f32>;
@group(0) @binding(1) var sky_sampler: sampler;
#endif
#ifdef BASE
@group(0) @binding(0) var sky: texture_2d_array<f32>;
#endif
@group(0) @binding(2) var output: texture_storage_2d_array<rgba16float, write>;

// The direction of a place on a face, of any length; places are from -1 to 1 across and down (Vulkan specification, "Cube Map Face Selection").
fn face_direction(face: u32, at: vec2<f32>) -> vec3<f32> {
    switch face {
        case 0u: { return vec3(1.0, -at.y, -at.x); }
        case 1u: { return vec3(-1.0, -at.y, at.x); }
        case 2u: { return vec3(at.x, 1.0, at.y); }
        case 3u: { return vec3(at.x, -1.0, -at.y); }
        case 4u: { return vec3(at.x, -at.y, 1.0); }
        default: { return vec3(-at.x, -at.y, -1.0); }
    }
}

fn place_of(texel: vec2<u32>, edge: f32) -> vec2<f32> {
    return (vec2<f32>(texel) + 0.5) / edge * 2.0 - 1.0;
}

// Point `i` of Hammersley's set: evenly spread over a square.
fn hammersley(i: u32, count: u32) -> vec2<f32> {
    return vec2((f32(i) + 0.5) / f32(count), f32(reverseBits(i)) * 2.3283064365386963e-10);
}

// A half vector about +Z, as often as GGX has microfacets that face there.
fn ggx_half(point: vec2<f32>, alpha_squared: f32) -> vec3<f32> {
    let cos2 = (1.0 - point.y) / (1.0 + (alpha_squared - 1.0) * point.y);
    let sine = sqrt(max(1.0 - cos2, 0.0));
    let angle = 2.0 * PI * point.x;
    return vec3(sine * cos(angle), sine * sin(angle), sqrt(cos2));
}

#ifdef LOBE
// The mean light that a lobe mirrors straight back along its axis, by its own shadowing. Each direction stands for as much of the sky as its
// probability says, and looks into the level that has about that in a texel (Krivanek and Colbert, "Real-Time Shading with Filtered Importance
// Sampling", 2008).
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= push.edge || id.y >= push.edge {
        return;
    }
    let normal = normalize(face_direction(id.z, place_of(id.xy, f32(push.edge))));
    let finest = push.source_edge;
    var mean = textureSampleLevel(sky, sky_sampler, normal, max(log2(finest / f32(push.edge)), 0.0)).rgb;
    if push.roughness > 0.0 {
        let alpha_squared = squared_alpha(push.roughness);
        let aside = normalize(select(cross(normal, vec3(0.0, 1.0, 0.0)), cross(normal, vec3(1.0, 0.0, 0.0)), abs(normal.y) > 0.7));
        let other = cross(normal, aside);
        let texel = 4.0 * PI / (6.0 * finest * finest);
        var sum = vec3(0.0);
        var weights = 0.0;
        for (var i = 0u; i < push.samples; i++) {
            let half = ggx_half(hammersley(i, push.samples), alpha_squared);
            // Mirrored at it, about +Z: normal and view are both +Z, and have the same cosine with the half vector.
            let cosine = 2.0 * half.z * half.z - 1.0;
            if cosine > 0.0 {
                let beside = 2.0 * half.z * half.xy;
                let toward = aside * beside.x + other * beside.y + normal * cosine;
                let d = half.z * half.z * (alpha_squared - 1.0) + 1.0;
                let density = alpha_squared / (PI * d * d) * 0.25;
                let level = 0.5 * log2(1.0 / (f32(push.samples) * density * texel)) + 0.5;
                // The part of height-correlated Smith that changes with the direction, times the cosine.
                let weight = cosine / (cosine + smith_root(cosine, alpha_squared));
                sum += textureSampleLevel(sky, sky_sampler, toward, max(level, 0.0)).rgb * weight;
                weights += weight;
            }
        }
        mean = sum / max(weights, 1e-20);
    }
    textureStore(output, vec2<i32>(id.xy), i32(id.z), vec4(mean, 1.0));
}
#endif

#ifdef BASE
// Every texel of a level of the sky, by its solid angle and the cosine.
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= push.edge || id.y >= push.edge {
        return;
    }
    let normal = normalize(face_direction(id.z, place_of(id.xy, f32(push.edge))));
    let edge = u32(push.source_edge);
    var sum = vec3(0.0);
    var weights = 0.0;
    for (var face = 0u; face < 6u; face++) {
        for (var y = 0u; y < edge; y++) {
            for (var x = 0u; x < edge; x++) {
                let direction = face_direction(face, place_of(vec2(x, y), push.source_edge));
                let inverse = inverseSqrt(dot(direction, direction));
                // The solid angle of a texel falls with the cube of its distance.
                let weight = max(dot(direction, normal), 0.0) * inverse * inverse * inverse * inverse;
                sum += textureLoad(sky, vec2(i32(x), i32(y)), i32(face), i32(push.level)).rgb * weight;
                weights += weight;
            }
        }
    }
    textureStore(output, vec2<i32>(id.xy), i32(id.z), vec4(sum / weights, 1.0));
}
#endif

#ifndef LOBE
#ifndef BASE
// A half vector about +Z, as often as GGX has facets there that are seen from a direction (Heitz, "Sampling the GGX Distribution of Visible Normals", 2018).
fn visible_facet(view: vec3<f32>, point: vec2<f32>, alpha: f32) -> vec3<f32> {
    let stretched = normalize(vec3(alpha * view.xy, view.z));
    // The view lies in the plane of X and Z.
    let aside = vec3(0.0, 1.0, 0.0);
    let other = cross(stretched, aside);
    let radius = sqrt(point.y);
    let across = radius * cos(2.0 * PI * point.x);
    let share = 0.5 * (1.0 + stretched.z);
    let along = (1.0 - share) * sqrt(max(1.0 - across * across, 0.0)) + share * radius * sin(2.0 * PI * point.x);
    let ahead = sqrt(max(1.0 - across * across - along * along, 0.0));
    let facet = aside * across + other * along + stretched * ahead;
    return normalize(vec3(alpha * facet.xy, max(facet.z, 0.0)));
}

// The two sums of Schlick's Fresnel over the lobe (Karis 2013), for height-correlated Smith.
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= push.edge || id.y >= push.edge {
        return;
    }
    let place = (vec2<f32>(id.xy) + 0.5) / f32(push.edge);
    let n_dot_v = place.x;
    let alpha_squared = squared_alpha(place.y);
    let view = vec3(sqrt(1.0 - n_dot_v * n_dot_v), 0.0, n_dot_v);
    let hidden_view = smith_root(n_dot_v, alpha_squared) / n_dot_v;
    var shares = vec2(0.0);
    for (var i = 0u; i < push.samples; i++) {
        let half = visible_facet(view, hammersley(i, push.samples), sqrt(alpha_squared));
        let v_dot_h = dot(view, half);
        let n_dot_l = 2.0 * v_dot_h * half.z - n_dot_v;
        if n_dot_l > 0.0 {
            // Masking and shadowing over masking alone.
            let share = (hidden_view + 1.0) / (hidden_view + smith_root(n_dot_l, alpha_squared) / n_dot_l);
            let x = saturate(1.0 - v_dot_h);
            let grazing = x * x * x * x * x;
            shares += vec2(share * (1.0 - grazing), share * grazing);
        }
    }
    textureStore(output, vec2<i32>(id.xy), 0, vec4(shares / f32(push.samples), 0.0, 1.0));
}
#endif
#endif
