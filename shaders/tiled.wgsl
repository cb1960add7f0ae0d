// TILED: every light on every pixel by compute, from a stored G-buffer. A work group is a tile of pixels; it tests the lights against
// the tile's frustum together, keeps a bit for each in shared memory, and then each pixel goes over the bits in the lights' order.
// With VISIBILITY there is no G-buffer: which triangle a pixel or a sample shows is stored, and each surface is looked up here.
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
// excludes: MSAA NORMAL_UINT
// excludes: MSAA UNIFORM_BUFFER
// precise
// counts: 384; with UNIFORM_BUFFER 144, SHADOW 192, MATERIAL 240, SPECULAR 120, POSITION 180, NORMAL_UINT 144, EMISSIVE 180, LINEAR_OUTPUT 128, HALF_OUTPUT 128, VISIBILITY 24, TEXTURED 12, MSAA 84
enable wgpu_binding_array;
#import afterlight::frame::{distance_at, frame}
#import afterlight::brdf::{Surface}
#ifdef MSAA
#import afterlight::multisampling::{sample_offset}
#endif
#ifdef VISIBILITY
#import afterlight::seen::{hit_of, seen_at}
#else ifdef MSAA
#import afterlight::gbuffer::{load_texel, read_one, sample_depth, samples_agree}
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
// Average the light of samples, and not its tone-mapped values.
override LINEAR: bool = false;
#ifdef MSAA
override SAMPLES: u32 = 4u;
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
// Beside depth, numbers of the instance and of the triangle in its mesh (seen.wgsl), where depth says that there is something: to clear this target takes a
// GPU as long as to draw a layer.
#ifdef MSAA
@group(1) @binding(0) var stored_depth: texture_depth_multisampled_2d;
@group(1) @binding(1) var stored_triangle: texture_multisampled_2d<u32>;
#else
@group(1) @binding(0) var stored_depth: texture_depth_2d;
@group(1) @binding(1) var stored_triangle: texture_2d<u32>;
#endif
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

// Lists the lights of a batch that may reach the tile. The whole work group does it.
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

// The unit that an invocation shades at once: a pixel, or one of its samples.
struct Part {
    pixel: vec2<u32>,
    // The pixel's centre, or the place of the sample.
    place: vec2<f32>,
    sample: u32,
    // The part shows a surface and must be shaded.
    shows: bool,
}

// Light of a part, and its emission if that is not stored.
struct Lit {
    radiance: vec3<f32>,
    emissive: vec3<f32>,
}

#ifdef VISIBILITY
#ifdef MSAA
fn sample_depth(center: vec2<f32>, sample: u32) -> f32 {
    return textureLoad(stored_depth, vec2<u32>(center), sample);
}

fn triangle_at(part: Part) -> u32 {
    return textureLoad(stored_triangle, part.pixel, part.sample).x;
}

// Returns true if all samples show one triangle.
fn samples_agree(center: vec2<f32>) -> bool {
    let pixel = vec2<u32>(center);
    let first = textureLoad(stored_triangle, pixel, 0u).x;
    var same = sample_depth(center, 0u) > 0.0;
    for (var i = 1u; i < SAMPLES; i++) {
        same = same && sample_depth(center, i) > 0.0 && textureLoad(stored_triangle, pixel, i).x == first;
    }
    return same;
}

#else
fn load_depth(center: vec2<f32>) -> f32 {
    return textureLoad(stored_depth, vec2<u32>(center), 0);
}

fn triangle_at(part: Part) -> u32 {
    return textureLoad(stored_triangle, part.pixel, 0).x;
}
#endif
#endif

// Least and greatest depth, as bits, of the pixel's samples that show a surface; the greatest is 0 if no sample does.
fn depths_at(center: vec2<f32>) -> vec2<u32> {
#ifdef MSAA
    var low = 0x7f800000u;
    var high = 0u;
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
    return vec2(low, high);
#else
    return vec2(bitcast<u32>(max(load_depth(center), 0.0)));
#endif
}

// Returns the light of a part. The whole work group does it, each invocation for its own part: pixels in the first round, samples in the others.
fn lit(part: Part, round: u32, tile: Tile, thread: u32) -> Lit {
    let model = planned_model();
    var texel: Texel;
    var light: Lit;
#ifdef VISIBILITY
    if part.shows {
        let hit = hit_of(triangle_at(part), part.place);
        let seen = seen_at(hit, part.place);
        texel = seen.texel;
        light.emissive = seen.emissive;
    }
#else
    if part.shows {
        texel = load_texel(part.place, NORMAL_ENCODING, GEOMETRIC_STEPS);
    }
#endif
    var surface: Surface;
    if part.shows {
        texel = planned(texel);
        surface = surface_of(texel, model);
        light.radiance = unlisted_light(surface, texel, model);
    }
    if BOUNDED {
        let count = frame.light_count - frame.looped_count;
        for (var start = 0u; start < count; start += BATCH) {
            let batch = min(count - start, BATCH);
            // The lists of a single batch stay for all rounds.
            if round == 0u || count > BATCH {
                list_lights(start, batch, tile, thread);
            }
            if part.shows {
                var radiance = light.radiance;
                add_listed(&radiance, start, batch, surface, texel, model);
                light.radiance = radiance;
            }
        }
    }
    return light;
}

// The light of a pixel, or of a sample as it is averaged.
fn averaged(lit: Lit, pixel: vec2<u32>, sample: u32) -> vec3<f32> {
    var light = min(lit.radiance * frame.exposure, vec3(LARGEST));
#ifdef VISIBILITY
    light = min(light + min(lit.emissive, vec3(LARGEST)), vec3(LARGEST));
#endif
#ifdef EMISSIVE
#ifdef MSAA
    light = min(light + textureLoad(stored_emissive, pixel, sample).rgb, vec3(LARGEST));
#else
    light = min(light + textureLoad(stored_emissive, pixel, 0).rgb, vec3(LARGEST));
#endif
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

// The mean of a pixel whose samples agree.
fn mean_of(light: Lit, pixel: vec2<u32>) -> vec3<f32> {
#ifdef EMISSIVE
#ifdef MSAA
    // The comparison of samples ignored emission, so each sample adds its own.
    var sum = averaged(light, pixel, 0u);
    for (var i = 1u; i < SAMPLES; i++) {
        sum += averaged(light, pixel, i);
    }
    return sum / f32(SAMPLES);
#else
    return averaged(light, pixel, 0u);
#endif
#else
    return averaged(light, pixel, 0u);
#endif
}

#ifdef MSAA
// A sample of a pixel whose samples differ.
fn mixed_part(own: u32, mixed_pixels: u32, sample: u32, group: vec2<u32>) -> Part {
    var part: Part;
    if own < mixed_pixels {
        part.pixel = group * TILE + vec2(mixed[own] % TILE, mixed[own] / TILE);
        let center = vec2<f32>(part.pixel) + 0.5;
        part.place = center + sample_offset(sample, SAMPLES);
        part.sample = sample;
        part.shows = sample_depth(center, sample) > 0.0;
#ifndef VISIBILITY
        read_one(sample);
#endif
    }
    return part;
}

// Averages the samples of a round. The whole work group does it; `first` is the round's first pixel.
fn average_mixed(light: Lit, part: Part, first: u32, mixed_pixels: u32, group: vec2<u32>, thread: u32) {
    var own = push.sample_background;
    if part.shows {
        own = averaged(light, part.pixel, part.sample);
    }
    // The round before may still be read.
    workgroupBarrier();
    sample_light[thread] = own;
    workgroupBarrier();
    if thread < THREADS / SAMPLES && first + thread < mixed_pixels {
        // In the order of samples, as lavapipe resolves attachments of floats.
        var sum = sample_light[thread * SAMPLES];
        for (var i = 1u; i < SAMPLES; i++) {
            sum += sample_light[thread * SAMPLES + i];
        }
        let at = mixed[first + thread];
        store_mean(group * TILE + vec2(at % TILE, at / TILE), sum / f32(SAMPLES));
    }
}
#endif

@compute @workgroup_size(16, 16, 1)
fn main(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
    @builtin(workgroup_id) group: vec3<u32>,
) {
    let size = textureDimensions(output);
    let center = vec2<f32>(id.xy) + 0.5;
    let inside = all(id.xy < size);
    // The sky has depth 0; so have the invocations outside the picture.
    var depths = vec2(0u);
    if inside {
        depths = depths_at(center);
    }
    let seen = depths.y > 0u;
    var own = Part(id.xy, center, 0u, seen);
#ifdef MSAA
    if seen {
#ifdef VISIBILITY
        own.shows = samples_agree(center);
#else
        own.shows = samples_agree(center, SAMPLES, NORMAL_ENCODING, GEOMETRIC_STEPS);
#endif
    }
#endif

    if thread == 0u {
        atomicStore(&farthest, 0x7f800000u);
        atomicStore(&nearest, 0u);
#ifdef MSAA
        atomicStore(&mixed_count, 0u);
#endif
    }
    workgroupBarrier();
    if seen {
        atomicMin(&farthest, depths.x);
        atomicMax(&nearest, depths.y);
#ifdef MSAA
        if !own.shows {
            mixed[atomicAdd(&mixed_count, 1u)] = thread;
        }
#endif
    } else if inside {
        store(id.xy, push.background);
    }
    workgroupBarrier();
    let tile = found_tile(group.xy);
#ifdef MSAA
    if thread == 0u {
        mixed_end = atomicLoad(&mixed_count);
    }
    let mixed_pixels = workgroupUniformLoad(&mixed_end);
    // First each pixel whose samples agree, by its own invocation; then the samples of the others, as many at a time as there are invocations.
    let rounds = 1u + (mixed_pixels + THREADS / SAMPLES - 1u) / (THREADS / SAMPLES);
#else
    let rounds = 1u;
#endif
    for (var round = 0u; round < rounds; round++) {
        var part = own;
#ifdef MSAA
        let first = max(round, 1u) * (THREADS / SAMPLES) - THREADS / SAMPLES;
        if round > 0u {
            part = mixed_part(first + thread / SAMPLES, mixed_pixels, thread % SAMPLES, group.xy);
        }
#endif
        let light = lit(part, round, tile, thread);
#ifdef MSAA
        if round > 0u {
            average_mixed(light, part, first, mixed_pixels, group.xy, thread);
            continue;
        }
#endif
        if part.shows {
            store_mean(id.xy, mean_of(light, id.xy));
        }
    }
}
