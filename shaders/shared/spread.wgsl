// The light that a lens spreads, for TONEMAP: the last step of the way up from the levels of BLOOM, at a pixel.
#define_import_path afterlight::spread
#import afterlight::bloom::{axis_of, extent_of, up, Levels}

@group(1) @binding(0) var<storage, read> levels: Levels;

// Light with its share of the levels' light, which BLOOM has mixed on the way up to the first one.
fn with_spread_light(light: vec3<f32>, pixel: vec2<i32>) -> vec3<f32> {
    let x = up(axis_of(levels.picture.x, 0u), pixel.x);
    let y = up(axis_of(levels.picture.y, 0u), pixel.y);
    let extent = vec2<i32>(extent_of(levels.picture, 1u));
    var spread = vec3(0.0);
    for (var down = 0; down < 3; down++) {
        let row = clamp(pixel.y / 2 + down - 1, 0, extent.y - 1) * extent.x;
        for (var right = 0; right < 3; right++) {
            let column = clamp(pixel.x / 2 + right - 1, 0, extent.x - 1);
            spread += y[down] * x[right] * levels.texels[row + column].rgb;
        }
    }
    return mix(light, spread, levels.share);
}
