// TONEMAP: the HDR target to the output. Left out when LIGHTING tone-maps by itself.
// precise
#import afterlight::tonemapping::{tone_map}
#import afterlight::screen::{screen_corner}

override OPERATOR: u32 = 0u;

@group(0) @binding(0) var subpass_hdr: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

@fragment
fn fragment() -> @location(0) vec4<f32> {
    let hdr = textureLoad(subpass_hdr, vec2<i32>(0, 0), 0).rgb;
    // Each that was added is at most that bright, but their sum may have become infinite.
    return vec4(tone_map(min(hdr, vec3(65000.0)), OPERATOR), 1.0);
}
