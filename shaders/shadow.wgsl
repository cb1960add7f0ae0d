// SHADOW: a map's depth, nothing else. Only casters with holes have a fragment stage: of a texture (MASKED), of the alpha of vertices or of a
// texture that lies on the mesh otherwise than its first coordinates say (EXTRAS).
// variants: MASKED EXTRAS
// precise
// counts: 4; with MASKED 2, EXTRAS 2

struct Push {
    alpha: f32,
    alpha_cutoff: f32,
    // Rows of the map from texture coordinates and 1 to the image; w of the first row is 1 for coordinates of the second set.
    uv_x: vec4<f32>,
    uv_y: vec4<f32>,
}

var<immediate> push: Push;

// The alpha of vertices counts.
override COLORED: bool = false;

struct Varying {
    @builtin(position) position: vec4<f32>,
#ifdef MASKED
    @location(0) uv: vec2<f32>,
#endif
#ifdef EXTRAS
    @location(1) alpha: f32,
#ifdef MASKED
    // The layer of the atlas in which its cell lies.
    @location(2) @interpolate(flat) layer: u32,
#endif
#endif
}

struct Vertex {
    @location(0) position: vec3<f32>,
    // Rows of the instance's map from mesh space to the light's clip space. Depth is reversed; w is 1 where the map is orthographic.
    @location(8) row_x: vec4<f32>,
    @location(9) row_y: vec4<f32>,
    @location(10) row_z: vec4<f32>,
    @location(11) row_w: vec4<f32>,
#ifdef MASKED
    @location(2) uv: vec2<f32>,
#endif
#ifdef EXTRAS
    @location(4) color: vec4<f32>,
#ifdef MASKED
    @location(5) second_uv: vec2<f32>,
    // The look of the instance (shared/material.wgsl).
    @location(13) look: vec4<u32>,
#endif
#endif
}

@vertex
fn vertex(in: Vertex) -> Varying {
    var out: Varying;
    let p = vec4(in.position, 1.0);
    out.position = vec4(dot(in.row_x, p), dot(in.row_y, p), dot(in.row_z, p), dot(in.row_w, p));
#ifdef MASKED
    out.uv = in.uv;
#endif
#ifdef EXTRAS
    out.alpha = select(1.0, in.color.a, COLORED);
#ifdef MASKED
    // The map is the same all over the triangle: it commutes with interpolation.
    let uv = vec3(select(in.uv, in.second_uv, push.uv_x.w > 0.0), 1.0);
    out.uv = vec2(dot(push.uv_x.xyz, uv), dot(push.uv_y.xyz, uv));
    out.layer = in.look.w & 0x7fffu;
#endif
#endif
    return out;
}

#ifdef MASKED
#ifdef EXTRAS
// The layers of an atlas, or a plain image: as in shared/material.wgsl.
@group(0) @binding(0) var base_color_texture: texture_2d_array<f32>;
#else
@group(0) @binding(0) var base_color_texture: texture_2d<f32>;
#endif
@group(0) @binding(15) var texture_sampler: sampler;

@fragment
fn fragment(in: Varying) {
#ifdef EXTRAS
    let alpha = textureSample(base_color_texture, texture_sampler, in.uv, in.layer).a * push.alpha;
    if alpha * in.alpha < push.alpha_cutoff {
        discard;
    }
#else
    let alpha = textureSample(base_color_texture, texture_sampler, in.uv).a * push.alpha;
    if alpha < push.alpha_cutoff {
        discard;
    }
#endif
}
#else ifdef EXTRAS
@fragment
fn fragment(in: Varying) {
    if push.alpha * in.alpha < push.alpha_cutoff {
        discard;
    }
}
#endif
