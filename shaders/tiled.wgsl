// TILED: every light on every pixel by compute, from a stored G-buffer. A work group is a tile of pixels; it tests the lights against
// the tile's frustum together, keeps a bit for each in shared memory, and then each pixel goes over the bits in the lights' order.
// With VISIBILITY there is no G-buffer: which triangle a pixel shows is stored, and each surface is looked up here.
// With MSAA a pixel whose samples agree is shaded once, as LIGHTING does it. The samples of a tile's other pixels are dealt to all invocations of its
// work group, so that no edge holds up the pixels beside it, and their light is averaged here.
// always: LIGHTS STORED
// variants: UNIFORM_BUFFER SHADOW MATERIAL SPECULAR POSITION NORMAL_UINT EMISSIVE LINEAR_OUTPUT HALF_OUTPUT VISIBILITY TEXTURED MSAA
// excludes: LINEAR_OUTPUT HALF_OUTPUT
// requires: SPECULAR -> MATERIAL
// excludes: VISIBILITY MATERIAL
// excludes: VISIBILITY SPECULAR
// excludes: VISIBILITY POSITION
// excludes: VISIBILITY NORMAL_UINT
// excludes: VISIBILITY EMISSIVE
// excludes: VISIBILITY UNIFORM_BUFFER
// requires: TEXTURED -> VISIBILITY
// excludes: MSAA VISIBILITY
// excludes: MSAA NORMAL_UINT
// excludes: MSAA UNIFORM_BUFFER
// precise
enable wgpu_binding_array;
#import afterlight::frame::{distance_at, frame}
#import afterlight::brdf::{Surface}
#ifdef VISIBILITY
#import afterlight::seen::{hit_of, seen_at, Hit}
#else ifdef MSAA
#import afterlight::gbuffer::{load_texel, read_mean, read_one, sample_depth, samples_agree}
#import afterlight::multisampling::{sample_offset}
#ifdef POSITION
#import afterlight::frame::{depth_at}
#import afterlight::gbuffer::{sample_position}
#endif
#else
#import afterlight::gbuffer::{load_depth, load_texel}
#endif
#import afterlight::shading::{add_punctual, light_everywhere, surface_of, Everywhere, Model}
#import afterlight::texel::{Texel}
#import afterlight::tile::{tile_of, touches, Tile, TILE}
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
#ifdef MSAA
override SAMPLES: u32 = 4u;
// Average light, and not its tone-mapped values.
override LINEAR: bool = false;
#endif

struct Push {
    // The light of pixels without a surface, as it is stored.
    background: vec3<f32>,
    // The light of a sample that shows no surface, as it is averaged.
    sample_background: vec3<f32>,
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
#ifdef MSAA
@group(1) @binding(6) var stored_emissive: texture_multisampled_2d<f32>;
#else
@group(1) @binding(6) var stored_emissive: texture_2d<f32>;
#endif
#endif
#ifdef LINEAR_OUTPUT
@group(1) @binding(7) var output: texture_storage_2d<rgba32float, write>;
#else ifdef HALF_OUTPUT
@group(1) @binding(7) var output: texture_storage_2d<rgba16float, write>;
#else
@group(1) @binding(7) var output: texture_storage_2d<rgba8unorm, write>;
#endif

const THREADS: u32 = 256u;
// Lights that are binned at once: 32 a word.
const WORDS: u32 = 512u;
const BATCH: u32 = WORDS * 32u;
const SUMMARY_WORDS: u32 = 16u;

// Depths of the tile as bits, which are in order as positive floats are.
var<workgroup> farthest: atomic<u32>;
var<workgroup> nearest: atomic<u32>;
// A bit for each light of the batch, and a bit for each word that is not empty.
var<workgroup> masks: array<atomic<u32>, WORDS>;
var<workgroup> summary: array<atomic<u32>, SUMMARY_WORDS>;

#ifdef MSAA
// Pixels of the tile whose samples differ, in any order: x + TILE y.
var<workgroup> mixed: array<u32, THREADS>;
var<workgroup> mixed_count: atomic<u32>;
var<workgroup> mixed_end: u32;
// Light of the samples of a round.
var<workgroup> sample_light: array<vec3<f32>, THREADS>;
#endif

#ifdef VISIBILITY
// The material whose turn it is: the least of those that are still to be looked up.
var<workgroup> next: atomic<u32>;
var<workgroup> turn: u32;
const NO_MATERIAL: u32 = 0xffffffffu;
#endif

fn store(pixel: vec2<u32>, light: vec3<f32>) {
    textureStore(output, pixel, vec4(select(light, light.bgr, SWAPPED), 1.0));
}

// Light that is displayed, as the output has it.
fn encoded(light: vec3<f32>) -> vec3<f32> {
#ifdef LINEAR_OUTPUT
    return light;
#else ifdef HALF_OUTPUT
    return light;
#else
    // Bytes, which no hardware encodes as they are stored.
    return encode_srgb(light);
#endif
}

fn planned_model() -> Model {
    return Model(BRDF, FALLOFF, TRAITS, DIRECTIONAL_SHADOWS, PUNCTUAL_SHADOWS, SHADOW_FILTER, TEXTBOOK);
}

// The surface as the plan knows it.
fn planned(stored: Texel) -> Texel {
    var texel = stored;
    texel.albedo = select(texel.albedo, vec3(1.0), LIGHT_ONLY);
    texel.metallic = select(0.0, texel.metallic, METAL && !LIGHT_ONLY);
    return texel;
}

// Light that needs no list.
fn unlisted_light(surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    return light_everywhere(surface, texel, model, Everywhere(AMBIENT, DIRECTIONAL, UNBOUNDED, frame.looped_count));
}

// Lists those lights of a batch that may reach the tile. The whole work group does it.
fn list_lights(start: u32, batch: u32, tile: Tile, thread: u32) {
    // The batch before may still be read.
    workgroupBarrier();
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
}

// Adds the lights that are listed of a batch, in their order.
fn add_listed(radiance: ptr<function, vec3<f32>>, start: u32, batch: u32, surface: Surface, texel: Texel, model: Model) {
    let words = (batch + 31u) / 32u;
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
                add_punctual(radiance, frame.looped_count + light, true, surface, texel, model);
            }
        }
    }
}

// The tile with the depths that its invocations have found.
fn found_tile(group: vec2<u32>) -> Tile {
    var tile = tile_of(vec2<f32>(group * TILE));
    tile.begin = distance_at(bitcast<f32>(atomicLoad(&nearest)));
    tile.end = distance_at(bitcast<f32>(atomicLoad(&farthest)));
    return tile;
}

#ifdef MSAA
// The light of a sample as it is averaged.
fn averaged(radiance: vec3<f32>, pixel: vec2<u32>, sample: u32) -> vec3<f32> {
    var light = min(radiance * frame.exposure, vec3(LARGEST));
#ifdef EMISSIVE
    light = min(light + textureLoad(stored_emissive, pixel, sample).rgb, vec3(LARGEST));
#endif
    if TONE_MAP && !LINEAR {
        return tone_map(light, OPERATOR);
    }
    return light;
}

fn store_mean(pixel: vec2<u32>, mean: vec3<f32>) {
    if TONE_MAP && LINEAR {
        store(pixel, encoded(tone_map(mean, OPERATOR)));
    } else {
        store(pixel, encoded(mean));
    }
}

@compute @workgroup_size(16, 16, 1)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
) {
    let size = textureDimensions(output);
    let center = vec2<f32>(id.xy) + 0.5;
    let inside = all(id.xy < size);
    let model = planned_model();
    // The least and the greatest depth of the samples that show a surface, as bits.
    var low = 0x7f800000u;
    var high = 0u;
    if inside {
        for (var i = 0u; i < SAMPLES; i++) {
            let depth = bitcast<u32>(sample_depth(center, i));
            if depth > 0u {
                low = min(low, depth);
                high = max(high, depth);
#ifdef POSITION
                // Stored positions lie where the driver interpolates them, which need not be where the sample is.
                let place = bitcast<u32>(max(depth_at(dot(sample_position(center, i), frame.forward)), 0.0));
                low = min(low, max(place, 1u));
                high = max(high, place);
#endif
            }
        }
    }
    // The sky has depth 0; so have the invocations outside the picture.
    let seen = high > 0u;
    var agrees = false;
    if seen {
        agrees = samples_agree(center, SAMPLES, NORMAL_ENCODING, GEOMETRIC_STEPS);
    }

    if thread == 0u {
        atomicStore(&farthest, 0x7f800000u);
        atomicStore(&nearest, 0u);
        atomicStore(&mixed_count, 0u);
    }
    workgroupBarrier();
    if seen {
        atomicMin(&farthest, low);
        atomicMax(&nearest, high);
        if !agrees {
            mixed[atomicAdd(&mixed_count, 1u)] = thread;
        }
    } else if inside {
        store(id.xy, push.background);
    }
    workgroupBarrier();
    if thread == 0u {
        mixed_end = atomicLoad(&mixed_count);
    }
    let mixed_pixels = workgroupUniformLoad(&mixed_end);
    let tile = found_tile(group.xy);

    // First each pixel whose samples agree, by its own invocation; then the samples of the others, as many at a time as there are invocations.
    let pixels_at_once = THREADS / SAMPLES;
    let rounds = 1u + (mixed_pixels + pixels_at_once - 1u) / pixels_at_once;
    for (var round = 0u; round < rounds; round++) {
        // The index of the first mixed pixel of this round.
        let first_mixed = select(0u, (round - 1u) * pixels_at_once, round > 0u);
        var pixel = id.xy;
        var sample = 0u;
        var place = center;
        var lights = agrees;
        if round == 0u {
            read_mean(SAMPLES);
        } else {
            let own = first_mixed + thread / SAMPLES;
            lights = own < mixed_pixels;
            if lights {
                sample = thread % SAMPLES;
                pixel = group.xy * TILE + vec2(mixed[own] % TILE, mixed[own] / TILE);
                let middle = vec2<f32>(pixel) + 0.5;
                place = middle + sample_offset(sample, SAMPLES);
                lights = sample_depth(middle, sample) > 0.0;
                read_one(sample);
            }
        }
        var texel: Texel;
        var surface: Surface;
        var radiance = vec3(0.0);
        if lights {
            texel = planned(load_texel(place, NORMAL_ENCODING, GEOMETRIC_STEPS));
            surface = surface_of(texel, model);
            radiance = unlisted_light(surface, texel, model);
        }
        if BOUNDED {
            let count = frame.light_count - frame.looped_count;
            for (var start = 0u; start < count; start += BATCH) {
                let batch = min(count - start, BATCH);
                // The lists of a single batch stay for all rounds.
                if round == 0u || count > BATCH {
                    list_lights(start, batch, tile, thread);
                }
                if lights {
                    add_listed(&radiance, start, batch, surface, texel, model);
                }
            }
        }
        if round == 0u {
            if lights {
#ifdef EMISSIVE
                // No comparison has looked at what surfaces emit: each sample has its own.
                var sum = averaged(radiance, pixel, 0u);
                for (var i = 1u; i < SAMPLES; i++) {
                    sum += averaged(radiance, pixel, i);
                }
                store_mean(pixel, sum / f32(SAMPLES));
#else
                store_mean(pixel, averaged(radiance, pixel, 0u));
#endif
            }
        } else {
            var light = push.sample_background;
            if lights {
                light = averaged(radiance, pixel, sample);
            }
            // The round before may still be read.
            workgroupBarrier();
            sample_light[thread] = light;
            workgroupBarrier();
            let own = first_mixed + thread;
            if thread < pixels_at_once && own < mixed_pixels {
                // In the order of samples, as lavapipe resolves attachments of floats.
                var sum = sample_light[thread * SAMPLES];
                for (var i = 1u; i < SAMPLES; i++) {
                    sum += sample_light[thread * SAMPLES + i];
                }
                let at = group.xy * TILE + vec2(mixed[own] % TILE, mixed[own] / TILE);
                store_mean(at, sum / f32(SAMPLES));
            }
        }
    }
}

#else
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
    let model = planned_model();

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
    let tile = found_tile(group.xy);

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
    texel = planned(texel);
    let surface = surface_of(texel, model);
    var radiance = vec3(0.0);
    if seen {
        radiance = unlisted_light(surface, texel, model);
    }
    if BOUNDED {
        let count = frame.light_count - frame.looped_count;
        for (var start = 0u; start < count; start += BATCH) {
            let batch = min(count - start, BATCH);
            list_lights(start, batch, tile, thread);
            if seen {
                add_listed(&radiance, start, batch, surface, texel, model);
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
    store(id.xy, encoded(light));
}
#endif
