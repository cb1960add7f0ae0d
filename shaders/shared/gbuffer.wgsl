// The G-buffer as the subpasses after GEOMETRY read it: each pixel its own texels, through input attachments.
#define_import_path afterlight::gbuffer
#import afterlight::encodings::{decode_normal, decode_normal_uint, octahedral_decode, from_unorm}
#ifdef SPECULAR
#import afterlight::encodings::{decode_brdf, decode_facing, decode_grazing}
#endif
#import afterlight::frame::{across, depth_at, frame, position_at, view_ray, ORTHOGRAPHIC}
#import afterlight::brdf::{usual_dielectric}
#import afterlight::texel::{Texel}
#ifdef MSAA
#import afterlight::multisampling::{sample_offset}
#endif

#ifdef STORED
// Compute reads the stored targets as textures. Depth is there in any case: it tells the sky.
#ifdef MSAA
@group(1) @binding(0) var stored_depth: texture_depth_multisampled_2d;
@group(1) @binding(1) var stored_albedo: texture_multisampled_2d<f32>;
@group(1) @binding(2) var stored_normal: texture_multisampled_2d<f32>;
#ifdef MATERIAL
@group(1) @binding(3) var stored_material: texture_multisampled_2d<f32>;
#endif
#ifdef SPECULAR
@group(1) @binding(4) var stored_specular: texture_multisampled_2d<f32>;
#endif
#ifdef POSITION
@group(1) @binding(5) var stored_position: texture_multisampled_2d<f32>;
#endif
#else
@group(1) @binding(0) var stored_depth: texture_depth_2d;
@group(1) @binding(1) var stored_albedo: texture_2d<f32>;
#ifdef NORMAL_UINT
@group(1) @binding(2) var stored_normal: texture_2d<u32>;
#else
@group(1) @binding(2) var stored_normal: texture_2d<f32>;
#endif
#ifdef MATERIAL
@group(1) @binding(3) var stored_material: texture_2d<f32>;
#endif
#ifdef SPECULAR
@group(1) @binding(4) var stored_specular: texture_2d<f32>;
#endif
#ifdef POSITION
@group(1) @binding(5) var stored_position: texture_2d<f32>;
#endif
#endif
#else
#ifdef MSAA
// Depth is there in any case: it tells which samples are sky.
@group(1) @binding(0) var subpass_depth: texture_depth_multisampled_2d;
@group(1) @binding(1) var subpass_albedo: texture_multisampled_2d<f32>;
@group(1) @binding(2) var subpass_normal: texture_multisampled_2d<f32>;
#ifdef MATERIAL
@group(1) @binding(3) var subpass_material: texture_multisampled_2d<f32>;
#endif
#ifdef SPECULAR
@group(1) @binding(4) var subpass_specular: texture_multisampled_2d<f32>;
#endif
#ifdef POSITION
@group(1) @binding(5) var subpass_position: texture_multisampled_2d<f32>;
#endif
#else
#ifndef POSITION
@group(1) @binding(0) var subpass_depth: texture_depth_2d;
#endif
@group(1) @binding(1) var subpass_albedo: texture_2d<f32>;
#ifdef NORMAL_UINT
@group(1) @binding(2) var subpass_normal: texture_2d<u32>;
#else
@group(1) @binding(2) var subpass_normal: texture_2d<f32>;
#endif
#ifdef MATERIAL
@group(1) @binding(3) var subpass_material: texture_2d<f32>;
#endif
#ifdef SPECULAR
@group(1) @binding(4) var subpass_specular: texture_2d<f32>;
#endif
#ifdef POSITION
@group(1) @binding(5) var subpass_position: texture_2d<f32>;
#endif
#endif
#endif

#ifdef SPECULAR
// The specular target has the reflectance of Cook-Torrance surfaces (encodings.wgsl).
override REFLECTANCE: bool = false;
#endif

// The texels of a pixel as they are stored.
struct Stored {
    albedo: vec4<f32>,
#ifdef NORMAL_UINT
    normal: vec2<u32>,
#else
    normal: vec4<f32>,
#endif
    material: vec4<f32>,
    specular: vec4<f32>,
}

#ifdef MSAA
// The part of the pixel that is read: one of its samples; or the values of the first, at the mean place of `samples_in_mean`.
var<private> chosen_sample: u32 = 0u;
var<private> samples_in_mean: u32 = 1u;

fn read_one(sample: u32) {
    chosen_sample = sample;
    samples_in_mean = 1u;
}

fn read_mean(count: u32) {
    chosen_sample = 0u;
    samples_in_mean = count;
}

#ifdef STORED
fn load_sample(pixel: vec2<f32>, sample: u32) -> Stored {
    let at = vec2<i32>(pixel);
    var stored: Stored;
    stored.albedo = textureLoad(stored_albedo, at, sample);
    stored.normal = textureLoad(stored_normal, at, sample);
#ifdef MATERIAL
    stored.material = textureLoad(stored_material, at, sample);
#endif
#ifdef SPECULAR
    stored.specular = textureLoad(stored_specular, at, sample);
#endif
    return stored;
}

// Reversed depth; 0 without a surface.
fn sample_depth(pixel: vec2<f32>, sample: u32) -> f32 {
    return textureLoad(stored_depth, vec2<i32>(pixel), sample);
}

#ifdef POSITION
fn sample_position(pixel: vec2<f32>, sample: u32) -> vec3<f32> {
    return textureLoad(stored_position, vec2<i32>(pixel), sample).xyz;
}
#endif
#else
// Input attachments: a pixel reads its own place alone.
fn load_sample(pixel: vec2<f32>, sample: u32) -> Stored {
    var stored: Stored;
    stored.albedo = textureLoad(subpass_albedo, vec2<i32>(0, 0), sample);
    stored.normal = textureLoad(subpass_normal, vec2<i32>(0, 0), sample);
#ifdef MATERIAL
    stored.material = textureLoad(subpass_material, vec2<i32>(0, 0), sample);
#endif
#ifdef SPECULAR
    stored.specular = textureLoad(subpass_specular, vec2<i32>(0, 0), sample);
#endif
    return stored;
}

// Reversed depth; 0 without a surface.
fn sample_depth(pixel: vec2<f32>, sample: u32) -> f32 {
    return textureLoad(subpass_depth, vec2<i32>(0, 0), sample);
}

#ifdef POSITION
fn sample_position(pixel: vec2<f32>, sample: u32) -> vec3<f32> {
    return textureLoad(subpass_position, vec2<i32>(0, 0), sample).xyz;
}
#endif
#endif

fn load_stored(pixel: vec2<f32>) -> Stored {
    return load_sample(pixel, chosen_sample);
}

// Samples that show a surface.
fn covered_samples(pixel: vec2<f32>, count: u32) -> u32 {
    var covered = 0u;
    for (var i = 0u; i < count; i++) {
        covered += select(0u, 1u, sample_depth(pixel, i) > 0.0);
    }
    return covered;
}

// The greatest difference between the values of samples that are shaded as one: where two triangles of one smooth surface meet in a pixel, they
// differ by less than from one pixel to the next. Normals are compared as encoded, other values as they are.
const NORMAL_TOLERANCE: f32 = 1.0 / 64.0;
const VALUE_TOLERANCE: f32 = 1.0 / 64.0;
const LEAST_TOLERANCE: f32 = 1.0 / 1024.0;
// The greatest distance of a sample's depth from the plane of the pixel's surface has two parts. The first is a share of the change of depth across
// the pixel by the plane's slope, or by half the slope of 45 degrees if that is more, because the normal of a smooth mesh is not normal to its
// triangles. The second is rounding, as a share of the depth.
const SLOPE_TOLERANCE: f32 = 0.25;
const LEAST_SLOPE: f32 = 0.5;
const DEPTH_TOLERANCE: f32 = 1.0 / 262144.0;

// False for NaN.
fn alike(a: vec4<f32>, b: vec4<f32>) -> bool {
    return all(abs(a - b) <= VALUE_TOLERANCE * max(abs(a), abs(b)) + LEAST_TOLERANCE);
}

// Returns true if shading once does for all samples of a pixel: they show one surface, with about the same values, and their depths lie in the plane
// that the normal tells. `center` is the pixel's. Later reads get the mean.
fn samples_agree(center: vec2<f32>, count: u32, normal_encoding: u32, geometric_steps: f32) -> bool {
    read_mean(count);
    let first = load_sample(center, 0u);
    var same = sample_depth(center, 0u) > 0.0;
    for (var i = 1u; i < count; i++) {
        let other = load_sample(center, i);
        same = same && sample_depth(center, i) > 0.0 && all(abs(other.normal - first.normal) <= vec4(NORMAL_TOLERANCE));
        same = same && alike(other.albedo, first.albedo) && alike(other.specular, first.specular);
        // Roughness and metallic; the normal there says no more than the other.
        same = same && alike(vec4(other.material.xy, 0.0, 0.0), vec4(first.material.xy, 0.0, 0.0));
    }
    if !same {
        return false;
    }
    // Depth is linear across the picture: a step aside, times n, over n * ray through the centre, is the step along the ray to the plane. As a
    // part of the distance it changes the depth by that part; where depth is linear, in metres, by their part of its range.
    let normal = load_texel(center, normal_encoding, geometric_steps).geometric_normal;
    let depth = mean_depth(center);
    let ray = view_ray(center);
    let facing = dot(normal, ray);
    let unit = select(depth, 1.0 / frame.depth_range, ORTHOGRAPHIC);
    var slope = 0.0;
    for (var i = 0u; i < count; i++) {
        let offset = across(center + sample_offset(i, count)) - across(center);
        slope = max(slope, max(abs(dot(normal, offset) / facing), LEAST_SLOPE * length(offset) / length(ray)));
    }
    let tolerance = SLOPE_TOLERANCE * slope * unit + DEPTH_TOLERANCE * select(depth, 1.0, ORTHOGRAPHIC);
    for (var i = 0u; i < count; i++) {
        let offset = across(center + sample_offset(i, count)) - across(center);
        let expected = depth + unit * dot(normal, offset) / facing;
        same = same && abs(sample_depth(center, i) - expected) <= tolerance;
    }
    return same;
}

// Averages differences, so that the mean of equal values is that value.
fn mean_depth(pixel: vec2<f32>) -> f32 {
    let first = sample_depth(pixel, chosen_sample);
    var differences = 0.0;
    for (var i = 1u; i < samples_in_mean; i++) {
        differences += sample_depth(pixel, i) - first;
    }
    return first + differences / f32(samples_in_mean);
}

#ifdef POSITION
fn mean_position(pixel: vec2<f32>) -> vec3<f32> {
    let first = sample_position(pixel, chosen_sample);
    var differences = vec3(0.0);
    for (var i = 1u; i < samples_in_mean; i++) {
        differences += sample_position(pixel, i) - first;
    }
    return first + differences / f32(samples_in_mean);
}
#endif

#else
#ifdef STORED
fn load_stored(pixel: vec2<f32>) -> Stored {
    let at = vec2<i32>(pixel);
    var stored: Stored;
    stored.albedo = textureLoad(stored_albedo, at, 0);
#ifdef NORMAL_UINT
    stored.normal = textureLoad(stored_normal, at, 0).xy;
#else
    stored.normal = textureLoad(stored_normal, at, 0);
#endif
#ifdef MATERIAL
    stored.material = textureLoad(stored_material, at, 0);
#endif
#ifdef SPECULAR
    stored.specular = textureLoad(stored_specular, at, 0);
#endif
    return stored;
}

#else
fn load_stored(pixel: vec2<f32>) -> Stored {
    var stored: Stored;
    stored.albedo = textureLoad(subpass_albedo, vec2<i32>(0, 0), 0);
#ifdef NORMAL_UINT
    stored.normal = textureLoad(subpass_normal, vec2<i32>(0, 0), 0).xy;
#else
    stored.normal = textureLoad(subpass_normal, vec2<i32>(0, 0), 0);
#endif
#ifdef MATERIAL
    stored.material = textureLoad(subpass_material, vec2<i32>(0, 0), 0);
#endif
#ifdef SPECULAR
    stored.specular = textureLoad(subpass_specular, vec2<i32>(0, 0), 0);
#endif
    return stored;
}
#endif
#endif

// Relative to the camera, in metres.
fn load_position(pixel: vec2<f32>) -> vec3<f32> {
#ifdef POSITION
#ifdef MSAA
    return mean_position(pixel);
#else
#ifdef STORED
    return textureLoad(stored_position, vec2<i32>(pixel), 0).xyz;
#else
    return textureLoad(subpass_position, vec2<i32>(0, 0), 0).xyz;
#endif
#endif
#else
    return position_at(pixel, load_depth(pixel));
#endif
}

// Reversed depth; 0 without a surface.
fn load_depth(pixel: vec2<f32>) -> f32 {
#ifdef MSAA
    return mean_depth(pixel);
#else
#ifdef STORED
    return textureLoad(stored_depth, vec2<i32>(pixel), 0);
#else
#ifdef POSITION
    let along = dot(load_position(pixel), frame.forward);
    return select(0.0, depth_at(along), along > 0.0);
#else
    return textureLoad(subpass_depth, vec2<i32>(0, 0), 0);
#endif
#endif
#endif
}

// `geometric_steps`: codes of a channel that holds half of the geometric normal, as GEOMETRY wrote it; 0 if none holds it.
fn load_texel(pixel: vec2<f32>, normal_encoding: u32, geometric_steps: f32) -> Texel {
    let stored = load_stored(pixel);
    var texel: Texel;
    texel.position = load_position(pixel);
    texel.ray = view_ray(pixel);
    texel.albedo = stored.albedo.rgb;
    texel.occlusion = stored.albedo.a;
#ifdef NORMAL_UINT
    texel.normal = decode_normal_uint(stored.normal);
#else
    texel.normal = decode_normal(stored.normal, normal_encoding);
#endif
    texel.geometric_normal = texel.normal;
    texel.roughness = 1.0;
    texel.receives = true;
    texel.dielectric = usual_dielectric();
#ifdef MATERIAL
    texel.roughness = stored.material.r;
    // 0 where the target has one channel.
    texel.metallic = stored.material.g;
    if geometric_steps > 0.0 {
        // Codes of normals end below 1: a surface that receives no shadow has 1 in the first, and one that nothing bends 1 in the second.
        let marked = stored.material.ba > vec2((geometric_steps - 0.5) / geometric_steps);
        texel.receives = !marked.x;
        texel.geometric_normal = select(octahedral_decode(from_unorm(stored.material.ba, geometric_steps)), texel.normal, marked.y);
    }
#endif
#ifdef SPECULAR
    texel.specular = stored.specular.rgb;
    texel.brdf = u32(round(stored.specular.a * 3.0));
    if REFLECTANCE {
        texel.dielectric.facing = decode_facing(stored.specular.rgb);
        texel.dielectric.grazing = decode_grazing(stored.specular.a);
        texel.brdf = decode_brdf(stored.specular.a);
    }
#endif
    return texel;
}
