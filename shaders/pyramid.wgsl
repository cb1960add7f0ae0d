// PYRAMID: of each square of 8 x 8 pixels, and of 16, 32 and 64, the least depth: the farthest of the nearest depths there. Reversed, 0 is where
// nothing was drawn.
// variants: SAMPLES
// counts: 2; with SAMPLES 1
#ifdef SAMPLES
@group(0) @binding(0) var depths: texture_multisampled_2d<f32>;
#else
@group(0) @binding(0) var depths: texture_2d<f32>;
#endif
// Level by level, the finest first; each has all squares of the work groups' tiles, row by row.
@group(0) @binding(1) var<storage, read_write> pyramid: array<f32>;

// The least depth in each square of the tile, 8 squares in a row.
var<workgroup> least: array<f32, 64>;

fn depth_at(pixel: vec2<u32>) -> f32 {
#ifdef SAMPLES
    var own = 1.0;
    for (var index = 0u; index < textureNumSamples(depths); index++) {
        own = min(own, textureLoad(depths, pixel, index).x);
    }
    return own;
#else
    return textureLoad(depths, pixel, 0).x;
#endif
}

@compute @workgroup_size(8, 8)
fn compute(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(num_workgroups) tiles: vec3<u32>,
    @builtin(local_invocation_id) square: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let first = (tile.xy * 8u + square.xy) * 8u;
    let end = min(first + 8u, textureDimensions(depths));
    // Pixels beside the picture say nothing.
    var own = 1.0;
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            own = min(own, depth_at(vec2(x, y)));
        }
    }
    least[lane] = own;
    var at = 0u;
    for (var edge = 8u; edge > 0u; edge /= 2u) {
        let is_in = square.x < edge && square.y < edge;
        workgroupBarrier();
        if edge < 8u && is_in {
            let below = square.y * 16u + square.x * 2u;
            own = min(min(least[below], least[below + 1u]), min(least[below + 8u], least[below + 9u]));
        }
        workgroupBarrier();
        if is_in {
            least[lane] = own;
            pyramid[at + (tile.y * edge + square.y) * tiles.x * edge + tile.x * edge + square.x] = own;
        }
        at += tiles.x * tiles.y * edge * edge;
    }
}
