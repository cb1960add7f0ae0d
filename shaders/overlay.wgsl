// OVERLAY: panels over the finished picture. Colours and textures are encoded as sRGB and times their alpha, as user interfaces have them;
// a target that encodes by itself takes them linear, so that there the blending is linear too.
// counts: 1

// The target encodes sRGB.
override ENCODED_OUTPUT: bool = true;

struct Push {
    // From points, which grow to the right and down, to clip space: 2 over the window's size in points.
    scale: vec2<f32>,
}

var<immediate> push: Push;

@group(0) @binding(0) var panel_texture: texture_2d<f32>;
@group(0) @binding(1) var panel_sampler: sampler;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) color: vec4<f32>,
}

@vertex
fn vertex(@location(0) position: vec2<f32>, @location(1) uv: vec2<f32>, @location(2) color: vec4<f32>) -> Corner {
    return Corner(vec4(position * push.scale - 1.0, 0.0, 1.0), uv, color);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    let color = corner.color * textureSample(panel_texture, panel_sampler, corner.uv);
    // IEC 61966-2-1, from the encoded value to the linear one.
    let linear = select(pow((color.rgb + 0.055) / 1.055, vec3(2.4)), color.rgb / 12.92, color.rgb <= vec3(0.04045));
    return vec4(select(color.rgb, linear, ENCODED_OUTPUT), color.a);
}
