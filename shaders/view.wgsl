// VIEW: one of the frame's buffers instead of its light.
// variants: GBUFFER LIGHTS UNIFORM_BUFFER MATERIAL SPECULAR POSITION NORMAL_UINT OVERDRAW TRIANGLE SHADOW_MAP MSAA
// requires: MSAA -> GBUFFER
// excludes: MSAA LIGHTS
// excludes: MSAA NORMAL_UINT
// requires: LIGHTS -> GBUFFER
// requires: UNIFORM_BUFFER -> LIGHTS
// requires: MATERIAL -> GBUFFER
// requires: SPECULAR -> GBUFFER
// requires: POSITION -> GBUFFER
// requires: NORMAL_UINT -> GBUFFER
// excludes: OVERDRAW GBUFFER
// excludes: OVERDRAW SHADOW_MAP
// excludes: SHADOW_MAP GBUFFER
// excludes: TRIANGLE GBUFFER
// excludes: TRIANGLE OVERDRAW
// excludes: TRIANGLE SHADOW_MAP
// precise
// counts: 60; with GBUFFER 56, LIGHTS 32, UNIFORM_BUFFER 16, MATERIAL 28, SPECULAR 28, POSITION 28, NORMAL_UINT 24, OVERDRAW 1, TRIANGLE 1, SHADOW_MAP 1, MSAA 8
#import afterlight::frame::{frame}
#import afterlight::screen::{screen_corner}
#ifdef GBUFFER
#import afterlight::gbuffer::{load_texel}
#import afterlight::texel::{Texel}
#import afterlight::encodings::{decode_shininess}
#endif
#ifdef MSAA
#import afterlight::gbuffer::{covered_samples, samples_agree}
#endif
#ifdef LIGHTS
#import afterlight::lights::{lights, reach_of, ALL_TRAITS, MIXED_FALLOFF}
#endif

// The codes of the views.
const SHOW_POSITION: u32 = 0u; // host
const SHOW_NORMAL: u32 = 1u; // host
const SHOW_NORMAL_ABSOLUTE: u32 = 2u; // host
const SHOW_ALBEDO: u32 = 3u; // host
const SHOW_METALLIC: u32 = 4u; // host
const SHOW_ROUGHNESS: u32 = 5u; // host
const SHOW_DEPTH: u32 = 6u; // host
const SHOW_LIGHTS: u32 = 7u; // host
const SHOW_OCCLUSION: u32 = 8u; // host

override SHOW: u32 = 0u;
override NORMAL_ENCODING: u32 = 0u;
override GEOMETRIC_STEPS: f32 = 255.0;
// The output encodes sRGB: undo that for values that are no light, so that the picture holds them as they are. An output of floats takes
// places, directions and numbers themselves, and not a picture of them.
override ENCODED_OUTPUT: bool = true;
#ifdef MSAA
override SAMPLES: u32 = 4u;
#endif

#ifdef OVERDRAW
@group(1) @binding(0) var subpass_count: texture_2d<f32>;
#endif
#ifdef TRIANGLE
@group(1) @binding(0) var subpass_triangle: texture_2d<u32>;
#endif
#ifdef SHADOW_MAP
#import afterlight::shadows::{shadow_atlas, shadow_views}
#endif

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// IEC 61966-2-1, from the encoded value to the linear one.
fn plain(value: vec3<f32>) -> vec4<f32> {
    let v = saturate(value);
    let linear = select(pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, v <= vec3(0.04045));
    return vec4(select(v, linear, ENCODED_OUTPUT), 1.0);
}

// 0 black, then blue, cyan, green, yellow, red, 1 white.
fn heat(t: f32) -> vec3<f32> {
    var stops = array(
        vec3(0.0, 0.0, 0.0),
        vec3(0.1, 0.1, 0.8),
        vec3(0.0, 0.7, 0.9),
        vec3(0.1, 0.8, 0.2),
        vec3(0.95, 0.9, 0.1),
        vec3(0.9, 0.15, 0.05),
        vec3(1.0, 1.0, 1.0),
    );
    let x = saturate(t) * 6.0;
    let i = min(u32(x), 5u);
    return mix(stops[i], stops[i + 1u], x - f32(i));
}

#ifdef LIGHTS
fn lights_in_reach(position: vec3<f32>) -> u32 {
    var count = frame.directional_count;
    for (var i = frame.directional_count; i < frame.light_count; i++) {
        if reach_of(lights[i], position, MIXED_FALLOFF, ALL_TRAITS).strength > 0.0 {
            count += 1u;
        }
    }
    return count;
}
#endif

#ifdef GBUFFER
fn show(texel: Texel) -> vec4<f32> {
    switch SHOW {
        case SHOW_POSITION: {
            if !ENCODED_OUTPUT {
                return vec4(texel.position + frame.eye_ahead * frame.forward, 1.0);
            }
            // Sign and logarithm: a thousandth of the scene's radius and its whole both show.
            let p = (texel.position + frame.camera_in_scene) / frame.scene_radius;
            return plain(sign(p) * log2(1.0 + abs(p) * 1000.0) / log2(1001.0) * 0.5 + 0.5);
        }
        case SHOW_NORMAL: {
            if !ENCODED_OUTPUT {
                return vec4(texel.normal, 1.0);
            }
            return plain(texel.normal * 0.5 + 0.5);
        }
        case SHOW_NORMAL_ABSOLUTE: { return plain(abs(texel.normal)); }
        case SHOW_ALBEDO: { return vec4(texel.albedo, 1.0); }
        case SHOW_METALLIC: { return plain(vec3(texel.metallic)); }
        case SHOW_ROUGHNESS: { return plain(vec3(texel.roughness)); }
        case SHOW_OCCLUSION: { return plain(vec3(texel.occlusion)); }
        case SHOW_DEPTH: {
            if !ENCODED_OUTPUT {
                return vec4(vec3(dot(texel.position, frame.forward) + frame.eye_ahead), 1.0);
            }
            return plain(vec3(1.0 / (1.0 + 2.0 * length(texel.position) / frame.scene_radius)));
        }
        default: {
#ifdef LIGHTS
            let most = log2(1.0 + f32(frame.light_count));
            return plain(heat(log2(1.0 + f32(lights_in_reach(texel.position))) / most));
#else
            return plain(vec3(0.0));
#endif
        }
    }
}
#endif

#ifdef TRIANGLE
// A bright colour for a number (M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", 2020: pcg).
fn hashed_color(number: u32) -> vec3<f32> {
    let state = number * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    let bits = (word >> 22u) ^ word;
    return vec3<f32>(vec3(bits, bits >> 8u, bits >> 16u) & vec3(255u)) / 255.0 * 0.75 + 0.25;
}
#endif

#ifdef SHADOW_MAP
// Depth of an orthographic map as it is. That of a perspective one falls as 1 / distance, from a ten-millionth of the scene's extent on:
// its seventh root shows near and far.
fn shown_depth(texel: vec2<f32>, layer: u32, depth: f32) -> f32 {
    for (var i = 0u; i < frame.shadow_view_count; i++) {
        let high = shadow_views[i].low + shadow_views[i].edge;
        if shadow_views[i].layer == layer && all(texel >= shadow_views[i].low) && all(texel < high) {
            return select(depth, pow(depth, 1.0 / 7.0), any(shadow_views[i].w.xyz != vec3(0.0)));
        }
    }
    return depth;
}
#endif

@fragment
fn fragment(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
#ifdef MSAA
    // Pixels that are shaded once a sample are bright; src/frame/complexity.rs counts these codes.
    if covered_samples(pixel.xy, SAMPLES) == 0u {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let once = samples_agree(pixel.xy, SAMPLES, NORMAL_ENCODING, GEOMETRIC_STEPS);
    return plain(select(vec3(1.0, 0.6, 0.2), vec3(0.0, 0.2, 0.4), once));
#else
#ifdef GBUFFER
    return show(load_texel(pixel.xy, NORMAL_ENCODING, GEOMETRIC_STEPS));
#else
#ifdef OVERDRAW
    // Eight layers and more are white.
    return plain(heat(textureLoad(subpass_count, vec2<i32>(0, 0), 0).r * 255.0 / 8.0));
#else
#ifdef TRIANGLE
    let seen = textureLoad(subpass_triangle, vec2<i32>(0, 0), 0).rg;
    if !ENCODED_OUTPUT {
        return vec4(f32(seen.x), f32(seen.y), 0.0, 1.0);
    }
    return plain(hashed_color(seen.x * 2654435761u + seen.y));
#else
#ifdef SHADOW_MAP
    // Layers side by side, in the largest square in the middle of the picture.
    let size = vec2(2.0 / frame.pixel_width, 2.0 / frame.pixel_height);
    let edge = min(size.x, size.y);
    let uv = (pixel.xy - (size - edge) * 0.5) / edge;
    if any(uv < vec2(0.0)) || any(uv >= vec2(1.0)) {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let columns = ceil(sqrt(f32(frame.shadow_layers)));
    let cell = floor(uv * columns);
    let layer = u32(cell.y * columns + cell.x);
    if layer >= frame.shadow_layers {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let texel = floor(fract(uv * columns) * frame.shadow_size);
    let depth = textureLoad(shadow_atlas, vec2<i32>(texel), i32(layer), 0);
    return plain(vec3(1.0 - shown_depth(texel, layer, depth)));
#else
    return vec4(0.0);
#endif
#endif
#endif
#endif
#endif
}
