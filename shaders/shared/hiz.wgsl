// The pyramid of depths has all of its levels in one image: src/plan/effects/reflections.rs says the same. Level n has a texel for each square of 2^n pixels. Level
// 1 lies at the left, the others below one another at its right; nearest depths in the upper half, farthest in the lower.
#define_import_path afterlight::hiz

// Edge of a square of the last level, in pixels.
const TILE: i32 = 32; // host
const LAST_LEVEL: i32 = 5;

// The first texel of a level, for a picture of `tiles` tiles.
fn level_at(level: i32, tiles: vec2<i32>) -> vec2<i32> {
    let half = tiles * (TILE / 2);
    if level == 1 {
        return vec2(0);
    }
    return vec2(half.x, half.y - (half.y >> u32(level - 2)));
}
