// SHADOW: a map's depth, nothing else. Only alpha-masked casters have a fragment stage.
// variants: MASKED
// precise

struct Push {
    // Rows of the map from mesh space to the light's clip space. Depth is reversed; w is 1 where the map is orthographic.
    row_x: vec4<f32>,
    row_y: vec4<f32>,
    row_z: vec4<f32>,
    row_w: vec4<f32>,
    alpha: f32,
    alpha_cutoff: f32,
}

var<immediate> push: Push;

struct Varying {
    @builtin(position) position: vec4<f32>,
#ifdef MASKED
    @location(0) uv: vec2<f32>,
#endif
}

struct Vertex {
    @location(0) position: vec3<f32>,
#ifdef MASKED
    @location(2) uv: vec2<f32>,
#endif
}

@vertex
fn vertex(in: Vertex) -> Varying {
    var out: Varying;
    let p = vec4(in.position, 1.0);
    out.position = vec4(dot(push.row_x, p), dot(push.row_y, p), dot(push.row_z, p), dot(push.row_w, p));
#ifdef MASKED
    out.uv = in.uv;
#endif
    return out;
}

#ifdef MASKED
@group(0) @binding(0) var base_color_texture: texture_2d<f32>;
@group(0) @binding(15) var texture_sampler: sampler;

@fragment
fn fragment(in: Varying) {
    if textureSample(base_color_texture, texture_sampler, in.uv).a * push.alpha < push.alpha_cutoff {
        discard;
    }
}
#endif
