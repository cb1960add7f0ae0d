// TONE: the loss of a lens and a film in the finished picture. Blending multiplies a pixel by the share of light that stays.
// counts: 1
#import afterlight::frame::{frame}
#import afterlight::screen::{screen_corner}

// 0 to 1: the strength of the fall-off towards the corners.
override VIGNETTE: f32 = 0.0;
// 0 to 1: the most that the grain takes from a pixel.
override GRAIN: f32 = 0.0;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// PCG (O'Neill 2014), as a hash: Jarzynski and Olano, "Hash Functions for GPU Rendering" (2020).
fn hash(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    // From the middle of the picture, in pixels; its corners are half a diagonal away.
    let half_size = 1.0 / vec2(frame.pixel_width, frame.pixel_height);
    let place = position.xy - half_size;
    let square = dot(place, place) / dot(half_size, half_size);
    // The fourth power of the angle's cosine, where half the diagonal is seen at 45 degrees: a quarter in the corners.
    let lens = 1.0 / ((1.0 + square) * (1.0 + square));
    let pixel = vec2<u32>(position.xy);
    // A float holds 24 bits exactly.
    let grain = f32(hash(pixel.x + hash(pixel.y)) >> 8u) / 16777216.0;
    return vec4(vec3(mix(1.0, lens, VIGNETTE) * (1.0 - GRAIN * grain)), 1.0);
}
