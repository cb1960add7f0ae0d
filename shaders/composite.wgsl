// COMPOSITE: what weighted blending has summed up, as one layer over the picture (McGuire and Bavoil 2013).
// precise
#import afterlight::screen::{screen_corner}

// Largest value that the picture may gain.
override LARGEST: f32 = 65000.0;

@group(0) @binding(0) var subpass_accumulation: texture_2d<f32>;
@group(0) @binding(1) var subpass_revealage: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

@fragment
fn fragment() -> @location(0) vec4<f32> {
    let sum = textureLoad(subpass_accumulation, vec2<i32>(0, 0), 0);
    let cover = 1.0 - textureLoad(subpass_revealage, vec2<i32>(0, 0), 0).r;
    // The mean colour, as much of it as the surfaces hide together. With one surface its own colour, whatever its weight.
    let mean = select(vec3(0.0), sum.rgb / max(sum.a, 1e-30), sum.a > 0.0);
    return vec4(min(mean * cover, vec3(LARGEST)), cover);
}
