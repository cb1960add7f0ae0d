// COMPOSITE: the sums of weighted blending, as one layer over the picture (McGuire and Bavoil 2013).
// With several samples a pixel it runs once a sample: surfaces may cover some and not others.
// variants: MSAA
// precise
// counts: 2; with MSAA 1
#import afterlight::screen::{screen_corner}

// Largest value that the picture may gain.
override LARGEST: f32 = 65000.0;
// Largest finite value of the sums' format.
override MOST: f32 = 65504.0;

#ifdef MSAA
@group(0) @binding(0) var subpass_accumulation: texture_multisampled_2d<f32>;
@group(0) @binding(1) var subpass_weights: texture_multisampled_2d<f32>;
#else
@group(0) @binding(0) var subpass_accumulation: texture_2d<f32>;
@group(0) @binding(1) var subpass_weights: texture_2d<f32>;
#endif

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// The layer, from the sums of colours and of weights.
fn layer(sums: vec4<f32>, all_weights: f32) -> vec4<f32> {
    // forward.wgsl says why no sum of its weights overflows or is lost. A blender that keeps more bits between two layers than the
    // target has may still store an infinity, which shows here as the largest value instead of as nothing at all.
    let sum = min(sums, vec4(MOST));
    let weights = min(all_weights, MOST);
    let cover = 1.0 - sum.a;
    // Without a surface, or with so little alpha that no colour is known, nothing is laid over: cover without colour would be black.
    if weights <= 0.0 {
        return vec4(0.0);
    }
    // ANCHOR: one-layer
    // The mean colour, as much of it as the surfaces hide together. A single surface gives its own colour, whatever its weight.
    let mean = sum.rgb / max(weights, 1e-30);
    return vec4(min(mean * cover, vec3(LARGEST)), cover);
    // ANCHOR_END: one-layer
}

#ifdef MSAA
@fragment
fn fragment(@builtin(sample_index) sample: u32) -> @location(0) vec4<f32> {
    let sum = textureLoad(subpass_accumulation, vec2<i32>(0, 0), sample);
    return layer(sum, textureLoad(subpass_weights, vec2<i32>(0, 0), sample).r);
}
#else
@fragment
fn fragment() -> @location(0) vec4<f32> {
    let sum = textureLoad(subpass_accumulation, vec2<i32>(0, 0), 0);
    return layer(sum, textureLoad(subpass_weights, vec2<i32>(0, 0), 0).r);
}
#endif
