// The picture behind glass: light and depth of each pixel, and the mean light of squares of 2 x 2 pixels, and of 4, 8, 16 and 32. Level n has a texel for each square of
// 2^n pixels, row by row, one level after the other (src/plan/effects/refraction.rs).
#define_import_path afterlight::backdrop

const LAST_LEVEL: u32 = 5u; // host

// Texels of a level across and down.
fn level_extent(size: vec2<u32>, level: u32) -> vec2<u32> {
    return (size + (1u << level) - 1u) >> vec2(level);
}

fn texels_of(size: vec2<u32>, level: u32) -> u32 {
    let extent = level_extent(size, level);
    return extent.x * extent.y;
}

// The index of a level's first texel. The sum is unrolled: in the loops of the callers, compilers take minutes for another loop.
fn level_start(size: vec2<u32>, level: u32) -> u32 {
    var start = select(0u, texels_of(size, 0u), level > 0u);
    start += select(0u, texels_of(size, 1u), level > 1u);
    start += select(0u, texels_of(size, 2u), level > 2u);
    start += select(0u, texels_of(size, 3u), level > 3u);
    return start + select(0u, texels_of(size, 4u), level > 4u);
}

struct Backdrop {
    // The depth of each pixel, reversed, row by row; then the light of each texel, two words each.
    words: array<u32>,
}

// Light as three shares of a power of two that is above them all, 16 bits each: an error of 2^-17 of the brightest channel, and any strength.
fn packed_light(light: vec3<f32>) -> vec2<u32> {
    let own = max(light, vec3(0.0));
    let exponent = (bitcast<u32>(max(own.r, max(own.g, own.b))) >> 23u) + 1u;
    let shares = vec3<u32>(min(own / bitcast<f32>(exponent << 23u) * 65536.0 + 0.5, vec3(65535.0)));
    return vec2(shares.r | (shares.g << 16u), shares.b | (exponent << 16u));
}

fn unpacked_light(words: vec2<u32>) -> vec3<f32> {
    let shares = vec3<f32>(vec3(words.x & 0xffffu, words.x >> 16u, words.y & 0xffffu));
    return shares * (bitcast<f32>((words.y >> 16u) << 23u) / 65536.0);
}

// The index of the first word of a texel's light.
fn light_at(size: vec2<u32>, level: u32, texel: vec2<u32>) -> u32 {
    return size.x * size.y + 2u * (level_start(size, level) + texel.y * level_extent(size, level).x + texel.x);
}
