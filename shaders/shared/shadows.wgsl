// Looking a shadow map up.
#define_import_path afterlight::shadows
#import afterlight::frame::{frame}

@group(2) @binding(0) var shadow_map: texture_depth_2d;

fn lit_texel(texel: vec2<i32>, depth: f32) -> f32 {
    let last = i32(frame.shadow_size) - 1;
    let stored = textureLoad(shadow_map, clamp(texel, vec2(0), vec2(last)), 0);
    return select(0.0, 1.0, depth <= stored);
}

// Share of the sun that reaches a point: 3x3 percentage-closer filtering (Reeves et al. 1987), the outer texels weighted by
// how far the point has moved across its own, so that the edge slides instead of stepping. Texels are fetched and compared
// by hand, because depth formats need not filter.
fn sun_visibility(position: vec3<f32>, geometric_normal: vec3<f32>) -> f32 {
    let p = vec4(position + geometric_normal * frame.shadow_normal_offset, 1.0);
    let uv = vec2(dot(frame.shadow_u, p), dot(frame.shadow_v, p));
    let depth = dot(frame.shadow_depth, p);
    // Outside the map nothing was drawn: lit.
    if any(uv < vec2(0.0)) || any(uv > vec2(frame.shadow_size)) || depth >= 1.0 {
        return 1.0;
    }
    let texel = vec2<i32>(floor(uv));
    let f = uv - floor(uv);
    let weight_x = vec3(1.0 - f.x, 1.0, f.x);
    let weight_y = vec3(1.0 - f.y, 1.0, f.y);
    var sum = 0.0;
    for (var row = 0; row < 3; row++) {
        let y = row - 1;
        let lit = vec3(
            lit_texel(texel + vec2(-1, y), depth),
            lit_texel(texel + vec2(0, y), depth),
            lit_texel(texel + vec2(1, y), depth),
        );
        sum += dot(lit, weight_x) * weight_y[row];
    }
    return sum * 0.25;
}
