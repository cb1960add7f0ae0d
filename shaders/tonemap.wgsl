// TONEMAP: the HDR target to the output. Left out when LIGHTING tone-maps by itself.
// precise
#import afterlight::tonemapping::{tone_map}

override OPERATOR: u32 = 0u;

@group(0) @binding(0) var subpass_hdr: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let x = f32(index & 1u) * 4.0 - 1.0;
    let y = f32(index >> 1u) * 4.0 - 1.0;
    return vec4(x, y, 0.0, 1.0);
}

@fragment
fn fragment() -> @location(0) vec4<f32> {
    let hdr = textureLoad(subpass_hdr, vec2<i32>(0, 0), 0).rgb;
    return vec4(tone_map(hdr, OPERATOR), 1.0);
}
