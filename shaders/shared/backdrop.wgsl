// The picture behind glass: light and depth of each pixel, and the mean light of squares of 2 x 2 pixels, and of 4, 8, 16 and 32. Level n has a texel for each square of
// 2^n pixels, row by row, one level after the other (src/plan/effects/refraction.rs).
#define_import_path afterlight::backdrop

const LAST_LEVEL: u32 = 5u; // host

struct Backdrop {
    // Light; in level 0 depth as well, reversed.
    texels: array<vec4<f32>>,
}

// Texels of a level across and down.
fn level_extent(size: vec2<u32>, level: u32) -> vec2<u32> {
    return (size + (1u << level) - 1u) >> vec2(level);
}

// The index of a level's first texel.
fn level_start(size: vec2<u32>, level: u32) -> u32 {
    var start = 0u;
    for (var i = 0u; i < level; i++) {
        let extent = level_extent(size, i);
        start += extent.x * extent.y;
    }
    return start;
}
