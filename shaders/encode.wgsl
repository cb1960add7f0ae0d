// ENCODE: a window's picture, which is linear light, into the values of images that no hardware encodes. 1 is white.
// counts: 1
#import afterlight::tonemapping::{encode_srgb}
#import afterlight::screen::{screen_corner}

// TRANSFER.
const SRGB: u32 = 0u; // host
const PQ: u32 = 1u; // host
const LINEAR: u32 = 2u; // host

override TRANSFER: u32 = 0u;
// The brightness of white in nits, where values tell how bright they are.
override WHITE: f32 = 203.0;

@group(0) @binding(0) var picture: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// Converts linear light from Rec. 709 primaries to Rec. 2020 primaries (ITU-R BT.2087), to four digits.
fn rec2020(color: vec3<f32>) -> vec3<f32> {
    let to_rec2020 = mat3x3(
        vec3(0.6274, 0.0691, 0.0164),
        vec3(0.3293, 0.9195, 0.0880),
        vec3(0.0433, 0.0114, 0.8956),
    );
    return to_rec2020 * color;
}

// SMPTE ST 2084: the inverse of its EOTF, of 10000 nits.
fn perceptual_quantizer(light: vec3<f32>) -> vec3<f32> {
    let y = pow(saturate(light), vec3(0.1593017578125));
    return pow((0.8359375 + 18.8515625 * y) / (1.0 + 18.6875 * y), vec3(78.84375));
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let light = max(textureLoad(picture, vec2<i32>(position.xy), 0).rgb, vec3(0.0));
    switch TRANSFER {
        case PQ: { return vec4(perceptual_quantizer(rec2020(light) * (WHITE / 10000.0)), 1.0); }
        case LINEAR: { return vec4(light * (WHITE / 80.0), 1.0); }
        default: { return vec4(encode_srgb(saturate(light)), 1.0); }
    }
}
