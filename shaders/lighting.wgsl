// LIGHTING: every light on every pixel that has a surface. The triangle lies at depth 0 and is drawn with compare LESS, so
// the sky, which has depth 0, costs nothing.
// With several samples a pixel there are two draws, because one invocation cannot write different samples: pixels whose samples
// agree are shaded once, the others once a sample (PER_SAMPLE).
// variants: LIGHTS UNIFORM_BUFFER CLUSTERED SHADOW MATERIAL SPECULAR POSITION NORMAL_UINT MSAA PER_SAMPLE BY_FOURS
// requires: PER_SAMPLE -> MSAA
// excludes: MSAA NORMAL_UINT
// requires: SHADOW -> LIGHTS
// requires: UNIFORM_BUFFER -> LIGHTS
// requires: CLUSTERED -> LIGHTS
// requires: BY_FOURS -> LIGHTS
// excludes: BY_FOURS CLUSTERED
// excludes: BY_FOURS MSAA
// excludes: BY_FOURS NORMAL_UINT
// requires: SPECULAR -> MATERIAL
// precise
// counts: 240; with LIGHTS 216, UNIFORM_BUFFER 108, CLUSTERED 96, SHADOW 108, MATERIAL 160, SPECULAR 80, POSITION 120, NORMAL_UINT 54, MSAA 108, PER_SAMPLE 54, BY_FOURS 24
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
#ifdef LIGHTS
#import afterlight::shading::{add_punctual}
#endif
#ifdef BY_FOURS
#import afterlight::brdf::{Surface}
#import afterlight::texel::{Texel}
#endif
#ifdef CLUSTERED
#import afterlight::clusters::{cluster_at, cluster_lights}
#endif
#import afterlight::tonemapping::{tone_map}

// The BRDF that all materials have; 4 where the scene mixes them.
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
// The filter of shadow maps.
override SHADOW_FILTER: u32 = 2u;
// The kinds of lights with shadow maps.
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

// The loop over punctual lights takes four at a time. A variant and no constant: drivers compile code that a constant leaves out, and this is four
// times the code.
#ifdef BY_FOURS
const HAS_FOURS = true;
const PLACES: u32 = 32u; // host

struct Push {
    // Each element is its own index. Indices into push constants must be the same in all invocations, so llvmpipe (Mesa 25) takes values read from
    // there for uniform. It reads a light whose number comes from here once for the eight pixels of a vector; with a loop's counter as the number it
    // gathers each float lane by lane, in some 24 instructions.
    places: array<u32, PLACES>,
}

var<immediate> push: Push;

// The loop over punctual lights of `light_everywhere`, for up to 4 PLACES^2 lights of any kind.
fn add_by_fours(radiance: ptr<function, vec3<f32>>, surface: Surface, texel: Texel, model: Model) {
    let first = frame.directional_count;
    let count = frame.looped_count - first;
    let end = (frame.looped_count + 3u) / 4u;
    var four = first / 4u;
    while four < end {
        let block = push.places[four / PLACES] * PLACES;
        let last = min((four / PLACES + 1u) * PLACES, end);
        for (; four < last; four++) {
            let i = (block + push.places[four % PLACES]) * 4u;
            // Wraps around for directional lights.
            let place = i - first;
            add_punctual(radiance, i, place < count, surface, texel, model);
            add_punctual(radiance, i + 1u, place + 1u < count, surface, texel, model);
            add_punctual(radiance, i + 2u, place + 2u < count, surface, texel, model);
            add_punctual(radiance, i + 3u, place + 3u < count, surface, texel, model);
        }
    }
}
#else
const HAS_FOURS = false;
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
    // ANCHOR: loop-and-lists
    let which = Everywhere(AMBIENT, DIRECTIONAL, PUNCTUAL && !HAS_FOURS, frame.looped_count);
    var radiance = light_everywhere(surface, texel, model, which);
#ifdef BY_FOURS
    add_by_fours(&radiance, surface, texel, model);
#endif
#ifdef CLUSTERED
    let list = cluster_at(pixel.xy, load_depth(pixel.xy));
    for (var i = 0u; i < list.y; i++) {
        add_punctual(&radiance, cluster_lights[list.x + i], true, surface, texel, model);
    }
#endif
    // ANCHOR_END: loop-and-lists
    // ANCHOR: expose
    let exposed = min(radiance * frame.exposure, vec3(LARGEST));
    if TONE_MAP {
        return vec4(tone_map(exposed, OPERATOR), 1.0);
    }
    return vec4(exposed, 1.0);
    // ANCHOR_END: expose
}

#ifdef PER_SAMPLE
@fragment
// ANCHOR: by-sample
fn fragment(@builtin(position) pixel: vec4<f32>, @builtin(sample_index) sample: u32) -> @location(0) vec4<f32> {
    let center = floor(pixel.xy) + 0.5;
    if samples_agree(center, SAMPLES, NORMAL_ENCODING, GEOMETRIC_STEPS) {
        discard;
    }
    read_one(sample);
    return shade(center + sample_offset(sample, SAMPLES));
}
// ANCHOR_END: by-sample
#else
@fragment
fn fragment(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
#ifdef MSAA
    // A driver may run a shader that reads multisampled inputs once a sample, with the sample's own position (Mesa does).
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
