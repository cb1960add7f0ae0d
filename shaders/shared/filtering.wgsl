// The part of a texture that a pixel is filtered from.
#define_import_path afterlight::filtering

// Edge of the square of a pixel for which textures are filtered, in pixels: less than 1 where several frames make a picture, because each of them looks
// at a part of the pixel. Gradients are scaled and not the level biased: a bias would leave the places of anisotropic filtering as far apart as they are
// in a whole pixel.
override FOOTPRINT: f32 = 1.0;

// Maximum anisotropy where shaders filter: texture samples per pixel; 1 where the sampler does.
override PLACES: u32 = 1u;

// The places along the long side of the parallelogram that a pixel covers on a texture.
struct Places {
    // Step from one place to the next.
    step: vec2<f32>,
    count: f32,
    level: f32,
}

// As EXT_texture_filter_anisotropic has them, with two savings: their count is rounded to the nearest, and several places are sampled from one level, because
// their mean hides the border between levels.
fn places_of(sides: array<vec2<f32>, 2>, size: vec2<u32>) -> Places {
    let lengths = max(vec2(length(sides[0] * vec2<f32>(size)), length(sides[1] * vec2<f32>(size))), vec2(1e-9));
    let long = max(lengths.x, lengths.y);
    let count = clamp(round(long / min(lengths.x, lengths.y)), 1.0, f32(PLACES));
    let level = log2(long / count);
    return Places(select(sides[1], sides[0], lengths.x >= lengths.y) / count, count, select(level, round(level), count > 1.0));
}
