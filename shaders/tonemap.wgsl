// TONEMAP: the HDR target to the output. Left out when LIGHTING tone-maps by itself.
// With several samples a pixel it resolves them: the hardware's resolve could only average before tone mapping.
// With BLOOM it takes a share of the light from the spread light.
// variants: MSAA BLOOM
// precise
// counts: 4; with MSAA 2, BLOOM 2
#import afterlight::tonemapping::{tone_map}
#import afterlight::screen::{screen_corner}
#ifdef BLOOM
#import afterlight::bloom::{axis_of, extent_of, up, Levels}
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
#ifdef BLOOM
@group(1) @binding(0) var<storage, read> levels: Levels;
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

#ifndef BLOOM
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

#ifdef BLOOM
// Light with its share of the levels' light, which BLOOM has mixed on the way up to the first one.
fn bloomed(light: vec3<f32>, pixel: vec2<i32>) -> vec3<f32> {
    let x = up(axis_of(levels.picture.x, 0u), pixel.x);
    let y = up(axis_of(levels.picture.y, 0u), pixel.y);
    let extent = vec2<i32>(extent_of(levels.picture, 1u));
    var spread = vec3(0.0);
    for (var down = 0; down < 3; down++) {
        let row = clamp(pixel.y / 2 + down - 1, 0, extent.y - 1) * extent.x;
        for (var right = 0; right < 3; right++) {
            let column = clamp(pixel.x / 2 + right - 1, 0, extent.x - 1);
            spread += y[down] * x[right] * levels.texels[row + column].rgb;
        }
    }
    return mix(min(light, vec3(LARGEST)), spread, levels.share);
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
#ifdef MSAA
    // Spread light is that of whole pixels.
    var sum = vec3(0.0);
    for (var i = 0u; i < SAMPLES; i++) {
        sum += min(textureLoad(subpass_hdr, vec2<i32>(0, 0), i).rgb, vec3(LARGEST));
    }
    let light = sum / f32(SAMPLES);
#else
    let light = textureLoad(subpass_hdr, vec2<i32>(0, 0), 0).rgb;
#endif
    return vec4(shown(bloomed(light, pixel)), 1.0);
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
