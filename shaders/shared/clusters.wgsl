// Froxels and their lists of lights, made by src/visible/clusters.rs.
#define_import_path afterlight::clusters
#import afterlight::frame::{frame, ORTHOGRAPHIC}

// Edge of a tile in pixels, slices of depth, and how the bits of a depth become a slice: two an octave.
const TILE: u32 = 32u; // host
const SLICES: u32 = 32u; // host
const SLICE_SHIFT: u32 = 22u; // host

// First entry and number of entries in `cluster_lights`: columns first, then rows, then slices.
@group(0) @binding(2) var<storage, read> cluster_heads: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> cluster_lights: array<u32>;

// The list for a pixel at a reversed depth. The bits decide, so that every pass and the CPU agree; a linear depth has equally thick slices.
// ANCHOR: cluster-at
fn cluster_at(pixel: vec2<f32>, depth: f32) -> vec2<u32> {
    var slice = (bitcast<u32>(1.0) - bitcast<u32>(saturate(depth))) >> SLICE_SHIFT;
    if ORTHOGRAPHIC {
        slice = u32((1.0 - saturate(depth)) * f32(SLICES));
    }
    slice = min(slice, SLICES - 1u);
    let tile = vec2<u32>(pixel) / TILE;
    return cluster_heads[(slice * frame.cluster_rows + tile.y) * frame.cluster_columns + tile.x];
}
// ANCHOR_END: cluster-at
