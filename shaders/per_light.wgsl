// LIGHTING, light by light: adds one light to the pixels of a rectangle, or to the pixels before the back of its volume. The triangle or volume is
// blended over the light that LIGHTING drew first.
// always: LIGHTS
// variants: VOLUME UNIFORM_BUFFER SHADOW MATERIAL SPECULAR POSITION NORMAL_UINT
// requires: SPECULAR -> MATERIAL
// precise
// counts: 96; with VOLUME 48, UNIFORM_BUFFER 48, SHADOW 48, MATERIAL 64, SPECULAR 32, POSITION 48, NORMAL_UINT 48
#import afterlight::frame::{frame}
#import afterlight::screen::{screen_corner}
#import afterlight::gbuffer::{load_position, load_texel}
#import afterlight::shading::{punctual_light, reaches, surface_of, Model}

override BRDF: u32 = 0u;
// Reflection models as textbooks have them.
override TEXTBOOK: bool = false;
// Some surface is a metal.
override METAL: bool = true;
override NORMAL_ENCODING: u32 = 0u;
override GEOMETRIC_STEPS: f32 = 255.0;
override FALLOFF: u32 = 3u;
// Bits of the traits that some light of the plan has: ranges, cones, beams (lights.wgsl).
override TRAITS: u32 = 0xffffffffu;
override SHADOW_FILTER: u32 = 2u;
override PUNCTUAL_SHADOWS: bool = true;
override LARGEST: f32 = 65000.0;
override LIGHT_ONLY: bool = false;

#ifdef VOLUME
// Map from a unit sphere or cone to the world around the camera.
struct Volume {
    row_x: vec4<f32>,
    row_y: vec4<f32>,
    row_z: vec4<f32>,
    light: u32,
}

@group(0) @binding(4) var<storage, read> volumes: array<Volume>;

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) light: u32,
}

@vertex
fn vertex(@location(0) corner: vec3<f32>, @builtin(instance_index) instance: u32) -> Varying {
    let volume = volumes[instance];
    let p = vec4(corner, 1.0);
    let world = vec3(dot(volume.row_x, p), dot(volume.row_y, p), dot(volume.row_z, p));
    return Varying(frame.clip_from_world * vec4(world, 1.0), volume.light);
}
#else
struct Push {
    light: u32,
}

var<immediate> push: Push;

struct Varying {
    @builtin(position) position: vec4<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    return Varying(screen_corner(index));
}
#endif

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
#ifdef VOLUME
    let light = in.light;
#else
    let light = push.light;
#endif
    let model = Model(BRDF, FALLOFF, TRAITS, false, PUNCTUAL_SHADOWS, SHADOW_FILTER, TEXTBOOK);
    // Most pixels of a rectangle lie out of reach: they need no more than their place.
    if !reaches(light, load_position(in.position.xy), model) {
        discard;
    }
    var texel = load_texel(in.position.xy, NORMAL_ENCODING, GEOMETRIC_STEPS);
    texel.albedo = select(texel.albedo, vec3(1.0), LIGHT_ONLY);
    texel.metallic = select(0.0, texel.metallic, METAL && !LIGHT_ONLY);
    let radiance = punctual_light(light, surface_of(texel, model), texel, model);
    return vec4(min(radiance * frame.exposure, vec3(LARGEST)), 1.0);
}
