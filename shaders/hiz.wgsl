// HIZ: the nearest and the farthest depth of squares of 2 x 2 pixels, and of 4, 8, 16 and 32: reversed, the nearest is the largest, and 0 is where nothing
// is. A work group makes all levels of a tile.
// counts: 1
#import afterlight::hiz::{level_at, LAST_LEVEL, TILE}

@group(1) @binding(0) var stored_depth: texture_depth_2d;
@group(1) @binding(1) var hiz: texture_storage_2d<r32float, write>;

// Nearest and farthest by square of 4 x 4 pixels of the tile, 8 in a row.
var<workgroup> ranges: array<vec2<f32>, 64>;

fn store(level: i32, texel: vec2<i32>, tiles: vec2<i32>, range: vec2<f32>) {
    let at = level_at(level, tiles) + texel;
    textureStore(hiz, at, vec4(range.x, 0.0, 0.0, 0.0));
    textureStore(hiz, at + vec2(0, tiles.y * (TILE / 2)), vec4(range.y, 0.0, 0.0, 0.0));
}

fn both(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2(max(a.x, b.x), min(a.y, b.y));
}

@compute @workgroup_size(8, 8)
fn compute(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(num_workgroups) count: vec3<u32>,
    @builtin(local_invocation_id) square: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let size = vec2<i32>(textureDimensions(stored_depth));
    let tiles = vec2<i32>(count.xy);
    let first = vec2<i32>(tile.xy * 8u + square.xy) * 4;
    // Pixels beside the picture say nothing: no ray goes there.
    var own = vec2(0.0, 1.0);
    for (var i = 0; i < 4; i++) {
        let corner = first + vec2(i & 1, i >> 1u) * 2;
        var range = vec2(0.0, 1.0);
        for (var j = 0; j < 4; j++) {
            let pixel = corner + vec2(j & 1, j >> 1u);
            if all(pixel < size) {
                range = both(range, vec2(textureLoad(stored_depth, pixel, 0)));
            }
        }
        store(1, corner / 2, tiles, range);
        own = both(own, range);
    }
    store(2, first / 4, tiles, own);
    ranges[lane] = own;
    var edge = 4u;
    for (var level = 3; level <= LAST_LEVEL; level++) {
        let is_in = square.x < edge && square.y < edge;
        workgroupBarrier();
        if is_in {
            let below = square.y * 16u + square.x * 2u;
            own = both(both(ranges[below], ranges[below + 1u]), both(ranges[below + 8u], ranges[below + 9u]));
        }
        workgroupBarrier();
        if is_in {
            ranges[lane] = own;
            store(level, vec2<i32>(tile.xy * edge + square.xy), tiles, own);
        }
        edge /= 2u;
    }
}
