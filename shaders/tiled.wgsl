// TILED: every light on every pixel by compute, from a stored G-buffer. A work group is a tile of pixels; it tests the lights against
// the tile's frustum together, keeps a bit for each in shared memory, and then each pixel goes over the bits in the lights' order.
// With VISIBILITY there is no G-buffer: which triangle a pixel shows is stored, and each surface is looked up here.
// always: LIGHTS STORED
// variants: UNIFORM_BUFFER SHADOW MATERIAL SPECULAR POSITION NORMAL_UINT EMISSIVE LINEAR_OUTPUT HALF_OUTPUT VISIBILITY TEXTURED
// excludes: LINEAR_OUTPUT HALF_OUTPUT
// requires: SPECULAR -> MATERIAL
// excludes: VISIBILITY MATERIAL
// excludes: VISIBILITY SPECULAR
// excludes: VISIBILITY POSITION
// excludes: VISIBILITY NORMAL_UINT
// excludes: VISIBILITY EMISSIVE
// excludes: VISIBILITY UNIFORM_BUFFER
// requires: TEXTURED -> VISIBILITY
// precise
enable wgpu_binding_array;
#import afterlight::frame::{across, distance_at, frame, ORTHOGRAPHIC}
#ifdef VISIBILITY
#import afterlight::seen::{hit_of, seen_at, Hit}
#else
#import afterlight::gbuffer::{load_depth, load_texel}
#endif
#import afterlight::shading::{add_punctual, light_everywhere, surface_of, Everywhere, Model}
#ifdef VISIBILITY
#import afterlight::texel::{Texel}
#endif
#import afterlight::tonemapping::{encode_srgb, tone_map}

override BRDF: u32 = 0u;
// Reflection models as textbooks have them.
override TEXTBOOK: bool = false;
// Some surface is a metal.
override METAL: bool = true;
#ifndef VISIBILITY
override NORMAL_ENCODING: u32 = 0u;
override GEOMETRIC_STEPS: f32 = 255.0;
#endif
override AMBIENT: bool = true;
override DIRECTIONAL: bool = true;
// Some lights reach everywhere, and meet every pixel.
override UNBOUNDED: bool = true;
// Some lights reach only so far.
override BOUNDED: bool = true;
override FALLOFF: u32 = 3u;
// Bits of the traits that some light of the plan has: ranges, cones, beams (lights.wgsl).
override TRAITS: u32 = 0xffffffffu;
override SHADOW_FILTER: u32 = 2u;
// The kinds of lights with shadow maps.
override DIRECTIONAL_SHADOWS: bool = true;
override PUNCTUAL_SHADOWS: bool = true;
override TONE_MAP: bool = true;
override OPERATOR: u32 = 0u;
override LARGEST: f32 = 65000.0;
override LIGHT_ONLY: bool = false;
// Red and blue are stored in each other's place.
override SWAPPED: bool = false;

struct Push {
    // The light of pixels without a surface, as it is stored.
    background: vec3<f32>,
}

var<immediate> push: Push;

// Spheres around the reach of lights of limited reach, relative to the camera: centre and radius.
@group(0) @binding(4) var<storage, read> spheres: array<vec4<f32>>;

#ifdef VISIBILITY
@group(1) @binding(0) var stored_depth: texture_depth_2d;
// Numbers of the instance and of the triangle in its mesh (seen.wgsl), where depth says that there is something: to clear this target takes a GPU as long
// as to draw a layer.
@group(1) @binding(1) var stored_triangle: texture_2d<u32>;
#endif
#ifdef EMISSIVE
@group(1) @binding(6) var stored_emissive: texture_2d<f32>;
#endif
#ifdef LINEAR_OUTPUT
@group(1) @binding(7) var output: texture_storage_2d<rgba32float, write>;
#else ifdef HALF_OUTPUT
@group(1) @binding(7) var output: texture_storage_2d<rgba16float, write>;
#else
@group(1) @binding(7) var output: texture_storage_2d<rgba8unorm, write>;
#endif

const TILE: u32 = 16u;
const THREADS: u32 = 256u;
// Lights that are binned at once: 32 a word.
const WORDS: u32 = 512u;
const SUMMARY_WORDS: u32 = 16u;

// Depths of the tile as bits, which are in order as positive floats are.
var<workgroup> farthest: atomic<u32>;
var<workgroup> nearest: atomic<u32>;
// A bit for each light of the batch, and a bit for each word that is not empty.
var<workgroup> masks: array<atomic<u32>, WORDS>;
var<workgroup> summary: array<atomic<u32>, SUMMARY_WORDS>;

#ifdef VISIBILITY
// The material whose turn it is: the least of those that are still to be looked up.
var<workgroup> next: atomic<u32>;
var<workgroup> turn: u32;
const NO_MATERIAL: u32 = 0xffffffffu;
#endif

// The volume of a tile: planes through the eye, or beside it where rays are parallel, their normals pointing inside; and an interval of distances
// along the view.
struct Tile {
    left: vec4<f32>,
    right: vec4<f32>,
    top: vec4<f32>,
    bottom: vec4<f32>,
    begin: f32,
    end: f32,
}

fn tile_of(corner: vec2<f32>) -> Tile {
    // Steps of a tile, from the axes: the difference of two rays would cancel where the field of view is narrow.
    let right = frame.ray_x * (f32(TILE) * frame.pixel_width);
    let down = frame.ray_y * (f32(TILE) * frame.pixel_height);
    let first = across(corner);
    let last = across(corner + f32(TILE));
    var tile: Tile;
    if ORTHOGRAPHIC {
        tile.left = beside(first, right);
        tile.right = beside(last, -right);
        tile.top = beside(first, down);
        tile.bottom = beside(last, -down);
    } else {
        tile.left = inward(cross(first, down), right);
        tile.right = inward(cross(last, down), -right);
        tile.top = inward(cross(first, right), down);
        tile.bottom = inward(cross(last, right), -down);
    }
    return tile;
}

// A plane through the eye. Whichever way the axes turn, `towards` leads inside.
fn inward(normal: vec3<f32>, towards: vec3<f32>) -> vec4<f32> {
    return vec4(normalize(normal) * select(-1.0, 1.0, dot(normal, towards) >= 0.0), 0.0);
}

// A plane through a place, along the view.
fn beside(place: vec3<f32>, towards: vec3<f32>) -> vec4<f32> {
    let normal = normalize(towards);
    return vec4(normal, -dot(normal, place));
}

fn touches(tile: Tile, sphere: vec4<f32>) -> bool {
    let p = vec4(sphere.xyz, 1.0);
    let along = dot(sphere.xyz, frame.forward);
    let side = min(min(dot(tile.left, p), dot(tile.right, p)), min(dot(tile.top, p), dot(tile.bottom, p)));
    return side > -sphere.w && along + sphere.w > tile.begin && along - sphere.w < tile.end;
}

fn store(pixel: vec2<u32>, light: vec3<f32>) {
    textureStore(output, pixel, vec4(select(light, light.bgr, SWAPPED), 1.0));
}

@compute @workgroup_size(16, 16, 1)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
) {
    let size = textureDimensions(output);
    let pixel = vec2<f32>(id.xy) + 0.5;
    let inside = all(id.xy < size);
    // The sky has depth 0; so have the threads outside the picture.
    var depth = 0.0;
    if inside {
#ifdef VISIBILITY
        depth = textureLoad(stored_depth, id.xy, 0);
#else
        depth = load_depth(pixel);
#endif
    }
    let seen = depth > 0.0;
#ifdef VISIBILITY
    var hit: Hit;
    if seen {
        hit = hit_of(textureLoad(stored_triangle, id.xy, 0).x, pixel);
    }
#endif
    let model = Model(BRDF, FALLOFF, TRAITS, DIRECTIONAL_SHADOWS, PUNCTUAL_SHADOWS, SHADOW_FILTER, TEXTBOOK);

    if thread == 0u {
        atomicStore(&farthest, 0x7f800000u);
        atomicStore(&nearest, 0u);
    }
    workgroupBarrier();
    if seen {
        atomicMin(&farthest, bitcast<u32>(depth));
        atomicMax(&nearest, bitcast<u32>(depth));
    }
    workgroupBarrier();
    var tile = tile_of(vec2<f32>(group.xy * TILE));
    tile.begin = distance_at(bitcast<f32>(atomicLoad(&nearest)));
    tile.end = distance_at(bitcast<f32>(atomicLoad(&farthest)));

#ifdef VISIBILITY
    // Not every device can index textures differently from pixel to pixel, so materials take turns.
    var texel: Texel;
    var emissive = vec3(0.0);
    var waits_for = select(NO_MATERIAL, hit.material, seen);
    loop {
        if thread == 0u {
            atomicStore(&next, NO_MATERIAL);
        }
        workgroupBarrier();
        if waits_for != NO_MATERIAL {
            atomicMin(&next, waits_for);
        }
        workgroupBarrier();
        if thread == 0u {
            turn = atomicLoad(&next);
        }
        let material = workgroupUniformLoad(&turn);
        if material == NO_MATERIAL {
            break;
        }
        if waits_for == material {
            let surface = seen_at(hit, material, pixel, depth);
            texel = surface.texel;
            emissive = surface.emissive;
            waits_for = NO_MATERIAL;
        }
    }
#else
    var texel = load_texel(clamp(pixel, vec2(0.5), vec2<f32>(size) - 0.5), NORMAL_ENCODING, GEOMETRIC_STEPS);
#endif
    texel.albedo = select(texel.albedo, vec3(1.0), LIGHT_ONLY);
    texel.metallic = select(0.0, texel.metallic, METAL && !LIGHT_ONLY);
    let surface = surface_of(texel, model);
    var radiance = vec3(0.0);
    if seen {
        let which = Everywhere(AMBIENT, DIRECTIONAL, UNBOUNDED, frame.looped_count);
        radiance = light_everywhere(surface, texel, model, which);
    }
    if BOUNDED {
        let first = frame.looped_count;
        let count = frame.light_count - first;
        for (var start = 0u; start < count; start += WORDS * 32u) {
            // The batch before may still be read.
            workgroupBarrier();
            let batch = min(count - start, WORDS * 32u);
            let words = (batch + 31u) / 32u;
            for (var word = thread; word < words; word += THREADS) {
                atomicStore(&masks[word], 0u);
            }
            if thread < SUMMARY_WORDS {
                atomicStore(&summary[thread], 0u);
            }
            workgroupBarrier();
            // ANCHOR: tile-lists
            for (var light = thread; light < batch; light += THREADS) {
                if touches(tile, spheres[start + light]) {
                    let word = light / 32u;
                    atomicOr(&masks[word], 1u << (light % 32u));
                    atomicOr(&summary[word / 32u], 1u << (word % 32u));
                }
            }
            workgroupBarrier();
            // ANCHOR_END: tile-lists
            if seen {
                let summaries = (words + 31u) / 32u;
                for (var s = 0u; s < summaries; s++) {
                    var full = atomicLoad(&summary[s]);
                    while full != 0u {
                        let word = s * 32u + firstTrailingBit(full);
                        full &= full - 1u;
                        var bits = atomicLoad(&masks[word]);
                        while bits != 0u {
                            let light = start + word * 32u + firstTrailingBit(bits);
                            bits &= bits - 1u;
                            add_punctual(&radiance, first + light, true, surface, texel, model);
                        }
                    }
                }
            }
        }
    }
    if !inside {
        return;
    }
    if !seen {
        store(id.xy, push.background);
        return;
    }
    var light = min(radiance * frame.exposure, vec3(LARGEST));
#ifdef VISIBILITY
    light = min(light + min(emissive, vec3(LARGEST)), vec3(LARGEST));
#endif
#ifdef EMISSIVE
    light = min(light + textureLoad(stored_emissive, id.xy, 0).rgb, vec3(LARGEST));
#endif
    if TONE_MAP {
        light = tone_map(light, OPERATOR);
    }
#ifndef LINEAR_OUTPUT
#ifndef HALF_OUTPUT
    // Bytes, which no hardware encodes as they are stored.
    light = encode_srgb(light);
#endif
#endif
    store(id.xy, light);
}
