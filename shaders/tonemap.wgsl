// TONEMAP: the HDR target to the output. Left out when LIGHTING tone-maps by itself.
// With several samples a pixel it resolves them: the hardware's resolve could only average before tone mapping.
// With SPREAD it takes a share of the light from the light that a lens spreads.
// variants: MSAA SPREAD
// precise
// counts: 4; with MSAA 2, SPREAD 2
#import afterlight::tonemapping::{tone_map}
#import afterlight::screen::{screen_corner}
#ifdef SPREAD
#import afterlight::spread::{with_spread_light}
#endif

override OPERATOR: u32 = 0u;
// The output takes the light itself, to be measured.
override KEPT: bool = false;
// Light is cut off there.
override LARGEST: f32 = 65000.0;

#ifdef MSAA
override SAMPLES: u32 = 4u;
// Average light, and not its tone-mapped values.
override LINEAR: bool = false;
@group(0) @binding(0) var subpass_hdr: texture_multisampled_2d<f32>;
#else
@group(0) @binding(0) var subpass_hdr: texture_2d<f32>;
#endif

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

fn shown(hdr: vec3<f32>) -> vec3<f32> {
    // Each that was added is at most that bright, but their sum may have become infinite.
    let light = min(hdr, vec3(LARGEST));
    if KEPT {
        return light;
    }
    return tone_map(light, OPERATOR);
}

#ifndef SPREAD
#ifdef MSAA
fn sample_value(sample: u32) -> vec3<f32> {
    let hdr = textureLoad(subpass_hdr, vec2<i32>(0, 0), sample).rgb;
    if LINEAR {
        return hdr;
    }
    return shown(hdr);
}
#endif
#endif

#ifdef SPREAD
@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
#ifdef MSAA
    // Spread light is stored per pixel, not per sample.
    var sum = vec3(0.0);
    for (var i = 0u; i < SAMPLES; i++) {
        sum += min(textureLoad(subpass_hdr, vec2<i32>(0, 0), i).rgb, vec3(LARGEST));
    }
    let light = sum / f32(SAMPLES);
#else
    let light = textureLoad(subpass_hdr, vec2<i32>(0, 0), 0).rgb;
#endif
    return vec4(shown(with_spread_light(min(light, vec3(LARGEST)), pixel)), 1.0);
}
#else
@fragment
fn fragment() -> @location(0) vec4<f32> {
#ifdef MSAA
    // By differences, so that the mean of equal samples is that sample.
    let first = sample_value(0u);
    var differences = vec3(0.0);
    for (var i = 1u; i < SAMPLES; i++) {
        differences += sample_value(i) - first;
    }
    let mean = first + differences / f32(SAMPLES);
    if LINEAR {
        return vec4(shown(mean), 1.0);
    }
    return vec4(mean, 1.0);
#else
    // ANCHOR: read
    let hdr = textureLoad(subpass_hdr, vec2<i32>(0, 0), 0).rgb;
    return vec4(shown(hdr), 1.0);
    // ANCHOR_END: read
#endif
}
#endif
