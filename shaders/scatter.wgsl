// SCATTER: the light that each of the fog's froxels scatters to the eye: ambient light, and each light with its shadow, by the mean of a few places
// in the froxel. The places are the same in every frame, so that a picture depends on its moment alone.
// always: LIGHTS FROXELS_WRITTEN
// variants: SHADOW
// counts: 2; with SHADOW 1
#import afterlight::frame::{across, frame, ORTHOGRAPHIC}
#import afterlight::fog::{fog_depth, fog_lost, fog_moved, fog_ray, phase}
#import afterlight::froxels::{column_size, froxel_index, froxels, pack_light, slice_begin, FROXEL_COLUMNS, FROXEL_ROWS, FROXEL_SLICES}
#import afterlight::lights::{lights, reach_of, Light, INVERSE_SQUARE, MIN_DISTANCE_SQUARED, NO_FALLOFF}
#ifdef SHADOW
#import afterlight::shadows::{visibility}
#endif

// Places in a froxel.
override SAMPLES: u32 = 1u;
// All lights' fall-off, and bits of the traits that some light has (lights.wgsl).
override FALLOFF: u32 = 3u;
override TRAITS: u32 = 0xffffffffu;
override SHADOW_FILTER: u32 = 1u;
override DIRECTIONAL_SHADOWS: bool = true;
override PUNCTUAL_SHADOWS: bool = true;
// Largest value that the picture's target takes.
override LARGEST: f32 = 65000.0;

// Lights are cut off at this: times the most that distance and phase make of it, it is finite.
const BRIGHTEST: f32 = 1e28;

// Least distance of a ray from a lamp: the integral of 1 / (h^2 + x^2) is pi / h, and the integral of 1 / x^2, held below 1 cm, is 400 / m.
const LEAST_BESIDE: f32 = 0.00785398;

// A piece of a ray through a froxel.
struct Piece {
    direction: vec3<f32>,
    // The middle of the light that fog loses along the piece, relative to the camera.
    position: vec3<f32>,
    // Distances from there to the piece's ends, in metres along the ray.
    begin: f32,
    end: f32,
    // Least distance of a light from the ray: a nearer one lights the whole width of the froxel as from here.
    beside: f32,
}

// The distance along a part of a ray, as a share of the part's length, at which it has lost a share of all that it loses.
fn place_of(share: f32, thick: f32) -> f32 {
    if thick < 0.01 {
        return share;
    }
    return min(-log(max(1.0 - share * fog_lost(thick), 1e-30)) / thick, 1.0);
}

// Places a piece by the sequence of Roberts 2018, whose first place is the middle.
fn piece_of(at: vec3<u32>, index: u32) -> Piece {
    let number = f32(index);
    let size = column_size();
    let aside = fract(0.5 + number * vec2(0.7548776662, 0.5698402910));
    let pixel = (vec2<f32>(at.xy) + aside) * size;
    let ray = fog_ray(pixel);
    let first = slice_begin(at.z);
    let length = (slice_begin(at.z + 1u) - first) * ray.stretch;
    let thick = min(fog_depth(fog_moved(ray, first * ray.stretch), length), 60.0);
    let pieces = f32(SAMPLES);
    let middle = place_of((number + 0.5) / pieces, thick) * length;
    let begin = place_of(number / pieces, thick) * length - middle;
    let end = place_of((number + 1.0) / pieces, thick) * length - middle;
    let along = first * ray.stretch + middle;
    var position = ray.direction * along;
    var wide = along / ray.stretch;
    if ORTHOGRAPHIC {
        position += across(pixel) - ray.direction * frame.eye_ahead;
        wide = 1.0;
    }
    // A disc as large as the space that a place stands for. The mean of 1 / distance over it is that at half of its radius.
    let area = size.x * size.y * frame.pixel_width * frame.pixel_height * length_of(frame.ray_x) * length_of(frame.ray_y) * wide * wide;
    return Piece(ray.direction, position, begin, end, 0.5 * sqrt(area / (3.14159265 * pieces)));
}

fn length_of(axis: vec3<f32>) -> f32 {
    return sqrt(dot(axis, axis));
}

// The mean of 1 / distance^2 along a piece, where `offset` leads from its middle to the light: the integral of 1 / (h^2 + x^2) is atan(x / h) / h. Near a
// light the value in the middle would be off by any factor, and flicker when the camera moves.
fn mean_inverse_square(piece: Piece, offset: vec3<f32>) -> f32 {
    let along = dot(offset, piece.direction);
    let beside = offset - piece.direction * along;
    let h = max(sqrt(dot(beside, beside)), max(piece.beside, LEAST_BESIDE));
    let a = piece.begin - along;
    let b = piece.end - along;
    let length = max(b - a, 1e-6 * h);
    let mean = atan2(h * length, h * h + a * b) / (h * length);
    return min(mean, 1.0 / MIN_DISTANCE_SQUARED);
}

// Edge of a work group's block of froxels, and the number of lamps that it sorts out at once, 32 a word.
const EDGE: u32 = 4u;
const THREADS: u32 = 64u;
const WORDS: u32 = 8u;

// A bit for each lamp of the batch that reaches into the block.
var<workgroup> reaching: array<atomic<u32>, WORDS>;

// Centre and radius of a sphere around the block. The block's near and far sides are flat, so nothing in it is farther out than its corners.
fn block_of(group: vec3<u32>) -> vec4<f32> {
    let low = vec2<f32>(group.xy * EDGE) * column_size();
    let high = low + f32(EDGE) * column_size();
    let begin = slice_begin(group.z * EDGE);
    let end = slice_begin(min((group.z + 1u) * EDGE, FROXEL_SLICES));
    let center = (corner(low, begin) + corner(high, end) + corner(low, end) + corner(high, begin)) * 0.25;
    var radius = 0.0;
    for (var i = 0u; i < 8u; i++) {
        let pixel = vec2(select(low.x, high.x, (i & 1u) != 0u), select(low.y, high.y, (i & 2u) != 0u));
        radius = max(radius, distance(center, corner(pixel, select(begin, end, (i & 4u) != 0u))));
    }
    return vec4(center, radius * 1.001);
}

fn corner(pixel: vec2<f32>, along: f32) -> vec3<f32> {
    if ORTHOGRAPHIC {
        return across(pixel) + frame.forward * (along - frame.eye_ahead);
    }
    return across(pixel) * along;
}

// Returns false only if none of a lamp's light falls into a sphere: beyond its range, or out of its cone. Beams count as reaching everywhere.
fn reaches_block(light: Light, block: vec4<f32>) -> bool {
    if (light.falloff & 3u) == NO_FALLOFF {
        return true;
    }
    let offset = block.xyz - light.position;
    let squared = dot(offset, offset);
    let room = block.w * sqrt(light.inverse_range_squared);
    if light.inverse_range_squared * squared > (1.0 + room) * (1.0 + room) {
        return false;
    }
    let cosine = -light.edge_offset / max(light.edge_scale, 1e-30);
    if light.edge_scale <= 0.0 || cosine <= 0.0 {
        return true;
    }
    let along = dot(offset, light.direction);
    let beside = sqrt(max(squared - along * along, 0.0));
    return cosine * beside - along * sqrt(max(1.0 - cosine * cosine, 0.0)) <= block.w * 1.001 && along >= -block.w;
}

fn suns_in(piece: Piece) -> vec3<f32> {
    var radiance = vec3(0.0);
    for (var i = 0u; i < frame.directional_count; i++) {
        let to_light = lights[i].position;
        var strength = phase(piece.direction, to_light, frame.air.anisotropy);
#ifdef SHADOW
        if DIRECTIONAL_SHADOWS {
            strength *= visibility(lights[i].falloff, piece.position, vec3(0.0), to_light, SHADOW_FILTER).x;
        }
#endif
        radiance += min(lights[i].color, vec3(BRIGHTEST)) * strength;
    }
    return radiance;
}

fn lamp_in(light: Light, piece: Piece) -> vec3<f32> {
    let reach = reach_of(light, piece.position, FALLOFF, TRAITS);
    var strength = reach.strength;
    if strength <= 0.0 {
        return vec3(0.0);
    }
    strength *= phase(piece.direction, reach.to_light, frame.air.anisotropy);
    if (light.falloff & 3u) == INVERSE_SQUARE {
        let offset = light.position - piece.position;
        strength *= mean_inverse_square(piece, offset) * max(dot(offset, offset), MIN_DISTANCE_SQUARED);
    }
#ifdef SHADOW
    if PUNCTUAL_SHADOWS {
        strength *= visibility(light.falloff, piece.position, vec3(0.0), reach.to_light, SHADOW_FILTER).x;
    }
#endif
    return min(light.color, vec3(BRIGHTEST)) * strength;
}

@compute @workgroup_size(4, 4, 4)
fn main(
    @builtin(global_invocation_id) at: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    var radiance = vec3(0.0);
    for (var i = 0u; i < SAMPLES; i++) {
        radiance += suns_in(piece_of(at, i));
    }
    let block = block_of(group);
    let first = frame.directional_count;
    let count = frame.light_count - first;
    // Where lamps are many, most of them reach few blocks.
    for (var start = 0u; start < count; start += WORDS * 32u) {
        // The batch before may still be read.
        workgroupBarrier();
        if thread < WORDS {
            atomicStore(&reaching[thread], 0u);
        }
        workgroupBarrier();
        let batch = min(count - start, WORDS * 32u);
        for (var lamp = thread; lamp < batch; lamp += THREADS) {
            if reaches_block(lights[first + start + lamp], block) {
                atomicOr(&reaching[lamp / 32u], 1u << (lamp % 32u));
            }
        }
        workgroupBarrier();
        for (var i = 0u; i < SAMPLES; i++) {
            let piece = piece_of(at, i);
            for (var word = 0u; word < (batch + 31u) / 32u; word++) {
                // In the order of the lights, so that their sum has the same rounding in each frame.
                var bits = atomicLoad(&reaching[word]);
                while bits != 0u {
                    radiance += lamp_in(lights[first + start + word * 32u + firstTrailingBit(bits)], piece);
                    bits &= bits - 1u;
                }
            }
        }
    }
    if any(at >= vec3(FROXEL_COLUMNS, FROXEL_ROWS, FROXEL_SLICES)) {
        return;
    }
    radiance = radiance * (frame.air.albedo / f32(SAMPLES)) + frame.air.light;
    froxels[froxel_index(at) * 2u] = pack_light(min(radiance * frame.exposure, vec3(min(LARGEST, 65000.0))));
}
