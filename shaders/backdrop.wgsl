// BACKDROP: the picture so far, with its depth, as glass sees it: each pixel, and the means of ever larger squares. A work group makes all levels of
// a tile of 32 x 32 pixels.
// variants: MSAA
// counts: 2; with MSAA 1
#import afterlight::backdrop::{level_extent, light_at, packed_light, Backdrop, LAST_LEVEL}

// Light is cut off at that before it is averaged, as TONEMAP cuts off its own.
override LARGEST: f32 = 65000.0;

@group(0) @binding(0) var<storage, read_write> backdrop: Backdrop;
#ifdef MSAA
@group(0) @binding(1) var picture: texture_multisampled_2d<f32>;
@group(0) @binding(2) var stored_depth: texture_depth_multisampled_2d;
#else
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var stored_depth: texture_depth_2d;
#endif

// The sum of the light of a square of 4 x 4 pixels, 8 in a row, and the number of its pixels that are in the picture.
var<workgroup> sums: array<vec4<f32>, 64>;

fn light_of(pixel: vec2<u32>) -> vec3<f32> {
#ifdef MSAA
    var sum = vec3(0.0);
    let count = textureNumSamples(picture);
    for (var index = 0u; index < count; index++) {
        sum += min(textureLoad(picture, pixel, index).rgb, vec3(LARGEST));
    }
    return sum / f32(count);
#else
    return min(textureLoad(picture, pixel, 0).rgb, vec3(LARGEST));
#endif
}

fn store(size: vec2<u32>, level: u32, texel: vec2<u32>, sum: vec4<f32>) {
    if all(texel < level_extent(size, level)) {
        let words = packed_light(sum.rgb / sum.a);
        let at = light_at(size, level, texel);
        backdrop.words[at] = words.x;
        backdrop.words[at + 1u] = words.y;
    }
}

@compute @workgroup_size(8, 8)
fn compute(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(local_invocation_id) square: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let size = textureDimensions(picture);
    let first = (tile.xy * 8u + square.xy) * 4u;
    var own = vec4(0.0);
    for (var i = 0u; i < 4u; i++) {
        let corner = first + vec2(i & 1u, i >> 1u) * 2u;
        var sum = vec4(0.0);
        for (var j = 0u; j < 4u; j++) {
            let pixel = corner + vec2(j & 1u, j >> 1u);
            if all(pixel < size) {
                let light = light_of(pixel);
                // The first of several samples stands for the pixel.
                backdrop.words[pixel.y * size.x + pixel.x] = bitcast<u32>(textureLoad(stored_depth, pixel, 0));
                store(size, 0u, pixel, vec4(light, 1.0));
                sum += vec4(light, 1.0);
            }
        }
        store(size, 1u, corner / 2u, sum);
        own += sum;
    }
    store(size, 2u, first / 4u, own);
    sums[lane] = own;
    var edge = 4u;
    for (var level = 3u; level <= LAST_LEVEL; level++) {
        let is_in = square.x < edge && square.y < edge;
        workgroupBarrier();
        if is_in {
            let below = square.y * 16u + square.x * 2u;
            own = sums[below] + sums[below + 1u] + sums[below + 8u] + sums[below + 9u];
        }
        workgroupBarrier();
        if is_in {
            sums[lane] = own;
            store(size, level, tile.xy * edge + square.xy, own);
        }
        edge /= 2u;
    }
}
