// The fog's froxels: the view cut into columns, rows and slices of depth. Each has the light that is scattered there, and the light that the fog
// before it scatters to the eye. SCATTER and INTEGRATE write them, and surfaces and particles in fog look them up at their own places.
#define_import_path afterlight::froxels
#import afterlight::frame::{frame}
#import afterlight::fog::{endless_fog_depth, fog_depth, fog_light, fog_lost, fog_moved, fog_transmittance, FogRay}

override FROXEL_COLUMNS: u32 = 160u;
override FROXEL_ROWS: u32 = 90u;
override FROXEL_SLICES: u32 = 64u;

#ifdef FROXELS_WRITTEN
// Twice as many: the light of each froxel, and the light scattered before it.
@group(0) @binding(14) var<storage, read_write> froxels: array<vec2<u32>>;
#else
// Columns first, then rows, then slices. One slice more has the light scattered by all froxels of a column.
@group(0) @binding(14) var<storage, read> froxels: array<vec4<u32>>;
#endif

// The beginning of a slice, in metres along the view from the eye. Slices are even near the eye, and then ever thicker.
fn slice_begin(slice: u32) -> f32 {
    return frame.air.near * (exp(frame.air.span * (f32(slice) / f32(FROXEL_SLICES))) - 1.0);
}

// The slice at a distance along the view; beyond the last their number.
fn slice_at(distance: f32) -> u32 {
    let share = log(1.0 + max(distance, 0.0) / frame.air.near) / frame.air.span;
    return u32(min(share, 1.0) * f32(FROXEL_SLICES));
}

fn froxel_index(at: vec3<u32>) -> u32 {
    return (at.z * FROXEL_ROWS + at.y) * FROXEL_COLUMNS + at.x;
}

fn pack_light(light: vec3<f32>) -> vec2<u32> {
    return vec2(pack2x16float(light.rg), pack2x16float(vec2(light.b, 0.0)));
}

fn unpack_light(packed: vec2<u32>) -> vec3<f32> {
    return vec3(unpack2x16float(packed.x), unpack2x16float(packed.y).x);
}

// Pixels of a column, across and down.
fn column_size() -> vec2<f32> {
    return 2.0 / (vec2(frame.pixel_width, frame.pixel_height) * vec2(f32(FROXEL_COLUMNS), f32(FROXEL_ROWS)));
}

#ifndef FROXELS_WRITTEN
struct Froxel {
    // Endless fog with this light in it would send this.
    light: vec3<f32>,
    before: vec3<f32>,
}

fn mixed(a: Froxel, b: Froxel, share: f32) -> Froxel {
    return Froxel(mix(a.light, b.light, share), mix(a.before, b.before, share));
}

fn froxel(at: vec3<u32>) -> Froxel {
    let packed = froxels[froxel_index(at)];
    return Froxel(unpack_light(packed.xy), unpack_light(packed.zw));
}

// Interpolates between the middles of four columns.
fn froxel_at(pixel: vec2<f32>, slice: u32) -> Froxel {
    let most = vec2<f32>(f32(FROXEL_COLUMNS), f32(FROXEL_ROWS)) - 1.0;
    let at = clamp(pixel / column_size() - 0.5, vec2(0.0), most);
    let share = fract(at);
    let low = vec2<u32>(at);
    let high = min(low + 1u, vec2(FROXEL_COLUMNS, FROXEL_ROWS) - 1u);
    let above = mixed(froxel(vec3(low, slice)), froxel(vec3(high.x, low.y, slice)), share.x);
    let below = mixed(froxel(vec3(low.x, high.y, slice)), froxel(vec3(high, slice)), share.x);
    return mixed(above, below, share.y);
}

// The exposed light that the fog before a distance along the view scatters to the eye. `is_endless`: nothing is seen there. From the beginning of its
// slice on, the fog has the slice's light; beyond the last slice, light without lamps and shadows.
fn froxel_light(pixel: vec2<f32>, ray: FogRay, distance: f32, is_endless: bool, largest: f32) -> vec3<f32> {
    let slice = select(slice_at(distance), FROXEL_SLICES, is_endless);
    let own = froxel_at(pixel, slice);
    var light = own.light;
    if slice == FROXEL_SLICES {
        light = fog_light(ray.direction, largest);
    }
    let begin = slice_begin(slice);
    let onward = fog_moved(ray, begin * ray.stretch);
    var thick = endless_fog_depth(onward);
    if !is_endless {
        thick = min(thick, fog_depth(onward, max(distance - begin, 0.0) * ray.stretch));
    }
    return own.before + light * (fog_transmittance(fog_depth(ray, begin * ray.stretch)) * fog_lost(thick));
}
#endif
