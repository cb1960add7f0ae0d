// LIGHTING: every light on every pixel that has a surface. The triangle lies at depth 0 and is drawn with compare LESS, so
// the sky, which has depth 0, costs nothing.
// With several samples a pixel there are two draws, because one invocation cannot write different samples: pixels whose samples
// agree are shaded once, the others once a sample (PER_SAMPLE).
// variants: LIGHTS UNIFORM_BUFFER CLUSTERED SHADOW MATERIAL SPECULAR POSITION NORMAL_UINT MSAA PER_SAMPLE
// requires: PER_SAMPLE -> MSAA
// excludes: MSAA NORMAL_UINT
// requires: SHADOW -> LIGHTS
// requires: UNIFORM_BUFFER -> LIGHTS
// requires: CLUSTERED -> LIGHTS
// requires: SPECULAR -> MATERIAL
// precise
#import afterlight::frame::{frame}
#import afterlight::screen::{screen_corner}
#import afterlight::gbuffer::{load_depth, load_texel}
#ifdef MSAA
#import afterlight::gbuffer::{samples_agree}
#endif
#ifdef PER_SAMPLE
#import afterlight::gbuffer::{read_one}
#import afterlight::multisampling::{sample_offset}
#endif
#import afterlight::shading::{light_everywhere, surface_of, Everywhere, Model}
#ifdef CLUSTERED
#import afterlight::shading::{add_punctual}
#import afterlight::clusters::{cluster_at, cluster_lights}
#endif
#import afterlight::tonemapping::{tone_map}

// Which BRDF all materials have; 4 where the scene mixes them.
override BRDF: u32 = 0u;
// Reflection models as textbooks have them.
override TEXTBOOK: bool = false;
// Some surface is a metal.
override METAL: bool = true;
override NORMAL_ENCODING: u32 = 0u;
override GEOMETRIC_STEPS: f32 = 255.0;
override AMBIENT: bool = true;
override DIRECTIONAL: bool = true;
override PUNCTUAL: bool = true;
// All lights' fall-off; 3 where they differ.
override FALLOFF: u32 = 3u;
// Bits of the traits that some light of the plan has: ranges, cones, beams (lights.wgsl).
override TRAITS: u32 = 0xffffffffu;
// How shadow maps are looked up.
override SHADOW_FILTER: u32 = 2u;
// Which lights have some.
override DIRECTIONAL_SHADOWS: bool = true;
override PUNCTUAL_SHADOWS: bool = true;
// No HDR target: tone-map straight into the output.
override TONE_MAP: bool = true;
override OPERATOR: u32 = 0u;
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
    let model = Model(BRDF, FALLOFF, TRAITS, DIRECTIONAL_SHADOWS, PUNCTUAL_SHADOWS, SHADOW_FILTER, TEXTBOOK);
    var texel = load_texel(pixel.xy, NORMAL_ENCODING, GEOMETRIC_STEPS);
    texel.albedo = select(texel.albedo, vec3(1.0), LIGHT_ONLY);
    texel.metallic = select(0.0, texel.metallic, METAL && !LIGHT_ONLY);
    let surface = surface_of(texel, model);
    let which = Everywhere(AMBIENT, DIRECTIONAL, PUNCTUAL, frame.looped_count);
    var radiance = light_everywhere(surface, texel, model, which);
#ifdef CLUSTERED
    let list = cluster_at(pixel.xy, load_depth(pixel.xy));
    for (var i = 0u; i < list.y; i++) {
        add_punctual(&radiance, cluster_lights[list.x + i], true, surface, texel, model);
    }
#endif
    let exposed = min(radiance * frame.exposure, vec3(LARGEST));
    if TONE_MAP {
        return vec4(tone_map(exposed, OPERATOR), 1.0);
    }
    return vec4(exposed, 1.0);
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
    // A driver may run whatever reads multisampled inputs once a sample, with the sample's own position (Mesa does).
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
