// A lighting pass in small: everything that the compiler adds to WGSL, at once.
// variants: NORMALS TONEMAP
// precise
#import test::gbuffer::read_pixel
#import test::lights::{Lights, shade}

struct Push {
    view: mat3x3<f32>,
    exposure: f32,
    offset: vec2<f32>,
}

var<immediate> push: Push;

@group(1) @binding(0) var<storage, read> lights: Lights;
@group(1) @binding(1) var noise: texture_2d<f32>;
@group(1) @binding(2) var noise_sampler: sampler;

@id(8) override FANCY: bool = false;

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @location(2) material: u32) -> Varying {
    var out: Varying;
    out.position = vec4<f32>(push.view * position + vec3<f32>(push.offset, 0.0), f32(material));
    out.uv = position.xy;
    return out;
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let pixel = read_pixel();
    if pixel.depth == 0.0 {
        discard;
    }
    var colour = textureSample(noise, noise_sampler, in.uv).rgb + textureLoad(noise, vec2<i32>(1, 2), 0).rgb;
    for (var index = 0u; index < lights.count; index++) {
        colour += shade(pixel, lights.list[index]);
    }
#ifdef NORMALS
    colour *= f32(pixel.normal.x);
#endif
#ifdef TONEMAP
    colour = colour / (colour + 1.0);
#endif
    if FANCY {
        colour = colour.bgr;
    }
    return vec4<f32>(colour * push.exposure, 1.0);
}
