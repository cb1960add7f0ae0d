// TINT: what transparent surfaces let through of a light, multiplied into the second map that lies beside each shadow map. A surface is met as an eye at the light's place
// would see it, and its light goes straight on.
// variants: TEXTURED EXTRAS
// precise
// counts: 4; with TEXTURED 2, EXTRAS 2
#import afterlight::tints::{nearness, to_half}

struct Push {
    // Rows of the matrix from (u, v, 1) to the texture; w of the first row is 1 if it maps the second set of texture coordinates.
    uv_x: vec4<f32>,
    uv_y: vec4<f32>,
    // Colour of light that passes.
    color: vec3<f32>,
    alpha: f32,
    // Negated logarithm of the share of light that is left after a path as long as the body is thick.
    absorption: vec3<f32>,
    // Share of perpendicular light that the surface mirrors.
    facing: f32,
    // Metres from the middle of the map to its edge (at a distance of 1 metre, for perspective maps); and metres from its near to its far end, 0 for
    // perspective maps.
    across: f32,
    along: f32,
    // As of `Glass` (shared/refraction.wgsl).
    round: f32,
    slope_bias: f32,
}

var<immediate> push: Push;

// Colours of vertices count.
override COLORED: bool = false;
// Light is tinted by the colour of the surface, and part of it is mirrored.
override GLASS: bool = false;
// Glass is a wall, and no body.
override THIN: bool = false;

struct Varying {
    @builtin(position) position: vec4<f32>,
    // The place in metres, across the map and along its view.
    @location(0) place: vec3<f32>,
#ifdef TEXTURED
    @location(1) uv: vec2<f32>,
#endif
#ifdef EXTRAS
    @location(2) color: vec4<f32>,
#ifdef TEXTURED
    // The layer of the atlas in which its cell lies.
    @location(3) @interpolate(flat) layer: u32,
#endif
#endif
}

struct Vertex {
    @location(0) position: vec3<f32>,
    // As in shadow.wgsl.
    @location(8) row_x: vec4<f32>,
    @location(9) row_y: vec4<f32>,
    @location(10) row_z: vec4<f32>,
    @location(11) row_w: vec4<f32>,
#ifdef TEXTURED
    @location(2) uv: vec2<f32>,
#endif
#ifdef EXTRAS
    @location(4) color: vec4<f32>,
#ifdef TEXTURED
    @location(5) second_uv: vec2<f32>,
    // The look of the instance (shared/material.wgsl).
    @location(13) look: vec4<u32>,
#endif
#endif
}

fn is_perspective() -> bool {
    return push.along == 0.0;
}

@vertex
fn vertex(in: Vertex) -> Varying {
    var out: Varying;
    let p = vec4(in.position, 1.0);
    let clip = vec4(dot(in.row_x, p), dot(in.row_y, p), dot(in.row_z, p), dot(in.row_w, p));
    out.position = clip;
    out.place = vec3(clip.xy * push.across, select(clip.z * push.along, clip.w, is_perspective()));
#ifdef TEXTURED
    out.uv = in.uv;
#endif
#ifdef EXTRAS
    out.color = select(vec4(1.0), in.color, COLORED);
#ifdef TEXTURED
    let uv = vec3(select(in.uv, in.second_uv, push.uv_x.w > 0.0), 1.0);
    out.uv = vec2(dot(push.uv_x.xyz, uv), dot(push.uv_y.xyz, uv));
    out.layer = in.look.w & 0x7fffu;
#endif
#endif
    return out;
}

#ifdef TEXTURED
#ifdef EXTRAS
@group(0) @binding(0) var base_color_texture: texture_2d_array<f32>;
#else
@group(0) @binding(0) var base_color_texture: texture_2d<f32>;
#endif
@group(0) @binding(15) var texture_sampler: sampler;
#endif

// Light through one surface of glass. `color` tints it as it enters.
fn through_glass(color: vec3<f32>, place: vec3<f32>, enters: bool) -> vec3<f32> {
    // Of the triangle: interpolated normals are not among a caster's streams.
    let normal = cross(dpdx(place), dpdy(place));
    let ray = select(vec3(0.0, 0.0, 1.0), place, is_perspective());
    let cosine = min(abs(dot(normal, ray)) / max(length(normal) * length(ray), 1e-30), 1.0);
    let x = 1.0 - cosine;
    // Schlick's Fresnel.
    var light = vec3((1.0 - push.facing) * (1.0 - x * x * x * x * x));
    if THIN || enters {
        light *= color;
    }
    if !THIN && enters {
        // Straight through a pane, or through a ball.
        light *= exp(-push.absorption * mix(1.0 / max(cosine, 0.05), cosine, push.round));
    }
    return light;
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    var base = vec4(push.color, push.alpha);
#ifdef TEXTURED
#ifdef EXTRAS
    base *= textureSample(base_color_texture, texture_sampler, in.uv, in.layer);
#else
    base *= textureSample(base_color_texture, texture_sampler, in.uv);
#endif
#endif
#ifdef EXTRAS
    base *= in.color;
#endif
    let left = 1.0 - saturate(base.a);
    // A surface must not lie in its own shadow: it is stored farther from the light, by the slope bias and a step of the encoding.
    let slope = max(abs(dpdx(in.position.z)), abs(dpdy(in.position.z)));
    let stored = to_half(nearness(in.position.z - push.slope_bias * slope, is_perspective()) - 1.0);
    if GLASS {
        return vec4(saturate(through_glass(base.rgb * left, in.place, front)), stored);
    }
    return vec4(vec3(left), stored);
}
