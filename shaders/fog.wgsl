// FOG: the light that the air takes from every pixel, and the light that it scatters to the eye: blended by the share that is left, in alpha.
// With several samples a pixel it runs once a sample: each has its own depth.
// variants: LIGHTS MSAA FROXELS
// requires: FROXELS -> LIGHTS
// precise
// counts: 6; with LIGHTS 4, MSAA 3, FROXELS 2
#import afterlight::frame::{distance_at, frame}
#import afterlight::screen::{screen_corner}
#import afterlight::fog::{endless_fog_depth, fog_depth, fog_light, fog_ray, fog_transmittance}
#ifdef FROXELS
#import afterlight::froxels::{froxel_light}
#endif
#ifdef MSAA
#import afterlight::multisampling::{sample_offset}
#endif

// Largest value that the target holds.
override LARGEST: f32 = 65000.0;
#ifdef MSAA
override SAMPLES: u32 = 4u;

@group(1) @binding(0) var subpass_depth: texture_depth_multisampled_2d;
#else
@group(1) @binding(0) var subpass_depth: texture_depth_2d;
#endif

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

fn fogged(pixel: vec2<f32>, depth: f32) -> vec4<f32> {
    let ray = fog_ray(pixel);
    // The sky has depth 0. A distance beyond 1e30 m has no square.
    var thick = endless_fog_depth(ray);
    if depth > 0.0 {
        thick = min(thick, fog_depth(ray, clamp(distance_at(depth), 0.0, 1e30) * ray.stretch + frame.eye_ahead));
    }
    let left = fog_transmittance(thick);
#ifdef FROXELS
    let distance = clamp(distance_at(max(depth, 1e-37)), 0.0, 1e30);
    return vec4(froxel_light(pixel, ray, distance + frame.eye_ahead, depth <= 0.0, LARGEST), left);
#else
    return vec4(fog_light(ray.direction, LARGEST) * (1.0 - left), left);
#endif
}

#ifdef MSAA
@fragment
fn fragment(@builtin(position) pixel: vec4<f32>, @builtin(sample_index) sample: u32) -> @location(0) vec4<f32> {
    let place = floor(pixel.xy) + 0.5 + sample_offset(sample, SAMPLES);
    return fogged(place, textureLoad(subpass_depth, vec2<i32>(0, 0), sample));
}
#else
@fragment
fn fragment(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    return fogged(pixel.xy, textureLoad(subpass_depth, vec2<i32>(0, 0), 0));
}
#endif
