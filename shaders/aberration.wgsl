// ABERRATION: red and blue of the finished picture, apart. A simple lens bends blue light more than red, so that its picture in red is larger than that in
// blue: transverse chromatic aberration, which grows with the distance from the axis. Green stays.
// counts: 1
#import afterlight::screen::{screen_corner}

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var linear_sampler: sampler;

// The part of the distance from the middle by which red lies farther out than green, and blue farther in.
override SHARE: f32 = 0.0;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// The picture at a place from its middle, in parts of its size. Beyond the border lies the border.
fn seen(place: vec2<f32>) -> vec3<f32> {
    return textureSampleLevel(picture, linear_sampler, place + 0.5, 0.0).rgb;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let place = position.xy / vec2<f32>(textureDimensions(picture)) - 0.5;
    let green = textureLoad(picture, vec2<i32>(position.xy), 0).g;
    return vec4(seen(place * (1.0 - SHARE)).r, green, seen(place * (1.0 + SHARE)).b, 1.0);
}
