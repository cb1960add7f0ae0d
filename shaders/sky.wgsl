// SKY: the sky on pixels without a surface. The triangle lies at depth 0 and is drawn with compare EQUAL, so that it costs nothing where a surface
// is.
// counts: 1
#import afterlight::frame::{frame, to_sky, view_ray}
#import afterlight::screen::{screen_corner}
#import afterlight::tonemapping::{tone_map}

@group(0) @binding(6) var sky: texture_cube<f32>;
@group(0) @binding(10) var sky_sampler: sampler;

// A sun is drawn into it.
override SUN: bool = false;
override TONE_MAP: bool = true;
override OPERATOR: u32 = 0u;
// Largest value that the target holds.
override LARGEST: f32 = 65000.0;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

@fragment
fn fragment(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    let direction = normalize(view_ray(pixel.xy));
    var radiance = textureSample(sky, sky_sampler, to_sky(direction)).rgb * frame.sky_scale;
    if SUN {
        // The sine: near 1 a cosine tells little of its angle.
        let across = cross(direction, frame.sun_direction);
        if dot(direction, frame.sun_direction) > 0.0 && dot(across, across) <= frame.sun_sine * frame.sun_sine {
            radiance = frame.sun_radiance;
        }
    }
    let exposed = min(radiance * frame.exposure, vec3(LARGEST));
    if TONE_MAP {
        return vec4(tone_map(exposed, OPERATOR), 1.0);
    }
    return vec4(exposed, 1.0);
}
