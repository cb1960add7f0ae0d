// AMBIENT: light from everywhere on every pixel that has a surface, added to what LIGHTING wrote, in its subpass and as it draws: where the sky lights
// the scene, so that LIGHTING knows nothing of skies.
// always: SKY_LIGHT
// variants: MATERIAL SPECULAR POSITION NORMAL_UINT MSAA PER_SAMPLE SHADOW
// requires: PER_SAMPLE -> MSAA
// excludes: MSAA NORMAL_UINT
// requires: SPECULAR -> MATERIAL
// precise
// counts: 48; with MATERIAL 32, SPECULAR 16, POSITION 24, NORMAL_UINT 12, MSAA 24, PER_SAMPLE 12, SHADOW 24
#import afterlight::frame::{frame}
#import afterlight::screen::{screen_corner}
#import afterlight::gbuffer::{load_texel}
#ifdef MSAA
#import afterlight::gbuffer::{samples_agree}
#endif
#ifdef PER_SAMPLE
#import afterlight::gbuffer::{read_one}
#import afterlight::multisampling::{sample_offset}
#endif
#import afterlight::shading::{light_everywhere, surface_of, Everywhere, Model}

// The BRDF that all materials have; 4 where the scene mixes them.
override BRDF: u32 = 0u;
// Some surface is a metal.
override METAL: bool = true;
override NORMAL_ENCODING: u32 = 0u;
override GEOMETRIC_STEPS: f32 = 255.0;
// There is light of the half-spheres.
override AMBIENT: bool = true;
// Largest value that the target holds.
override LARGEST: f32 = 65000.0;
// The view of the light alone: albedo 1, not metallic.
override LIGHT_ONLY: bool = false;
#ifdef MSAA
override SAMPLES: u32 = 4u;
#endif

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// The light of a pixel, or of one of its samples.
fn shade(pixel: vec2<f32>) -> vec4<f32> {
    let model = Model(BRDF, 0u, 0u, false, false, 0u, false);
    var texel = load_texel(pixel, NORMAL_ENCODING, GEOMETRIC_STEPS);
    texel.albedo = select(texel.albedo, vec3(1.0), LIGHT_ONLY);
    texel.metallic = select(0.0, texel.metallic, METAL && !LIGHT_ONLY);
    let which = Everywhere(AMBIENT, false, false, 0u);
    let radiance = light_everywhere(surface_of(texel, model), texel, model, which);
    return vec4(min(radiance * frame.exposure, vec3(LARGEST)), 1.0);
}

#ifdef PER_SAMPLE
@fragment
fn fragment(@builtin(position) pixel: vec4<f32>, @builtin(sample_index) sample: u32) -> @location(0) vec4<f32> {
    let center = floor(pixel.xy) + 0.5;
    if samples_agree(center, SAMPLES, NORMAL_ENCODING, GEOMETRIC_STEPS) {
        discard;
    }
    read_one(sample);
    return shade(center + sample_offset(sample, SAMPLES));
}
#else
@fragment
fn fragment(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
#ifdef MSAA
    // As in LIGHTING.
    let center = floor(pixel.xy) + 0.5;
    if !samples_agree(center, SAMPLES, NORMAL_ENCODING, GEOMETRIC_STEPS) {
        discard;
    }
    return shade(center);
#else
    return shade(pixel.xy);
#endif
}
#endif
