// INTEGRATE: the light that the fog before each froxel scatters to the eye, column by column from the eye on. Along a froxel the light is the same
// everywhere, and a ray's gain of it is in proportion to the fog's loss there, whatever its optical depth (Hillaire 2015): nothing is gained twice.
// always: FROXELS_WRITTEN
// counts: 1
#import afterlight::fog::{fog_depth, fog_lost, fog_moved, fog_ray, fog_transmittance}
#import afterlight::froxels::{column_size, froxel_index, froxels, pack_light, slice_begin, unpack_light, FROXEL_COLUMNS, FROXEL_ROWS, FROXEL_SLICES}

@compute @workgroup_size(8, 8, 1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= vec2(FROXEL_COLUMNS, FROXEL_ROWS)) {
        return;
    }
    let ray = fog_ray((vec2<f32>(id.xy) + 0.5) * column_size());
    var gained = vec3(0.0);
    var begin = 0.0;
    for (var slice = 0u; slice < FROXEL_SLICES; slice++) {
        let index = froxel_index(vec3(id.xy, slice)) * 2u;
        froxels[index + 1u] = pack_light(gained);
        let end = slice_begin(slice + 1u) * ray.stretch;
        let arrives = fog_transmittance(fog_depth(ray, begin));
        gained += unpack_light(froxels[index]) * (arrives * fog_lost(fog_depth(fog_moved(ray, begin), end - begin)));
        begin = end;
    }
    let last = froxel_index(vec3(id.xy, FROXEL_SLICES)) * 2u;
    froxels[last] = vec2(0u);
    froxels[last + 1u] = pack_light(gained);
}
