// PARTICLES: discs or squares that face the view, lit by SIMULATE, over the lit picture. They fade where they come near the surface behind them.
// LIGHTS: lights are in the air before them.
// variants: TEXTURED WEIGHTED SORTED LIGHTS
// excludes: WEIGHTED SORTED
// counts: 12; with TEXTURED 6, WEIGHTED 4, SORTED 4, LIGHTS 6
#import afterlight::frame::{distance_at, frame, ORTHOGRAPHIC}
#import afterlight::fogged::{seen_through_air}
#import afterlight::particles::{Particle}
#ifdef WEIGHTED
#import afterlight::weights::{weight_of}
#endif

// The first square covers the picture and hides it; each other one adds LAYER.
override COUNTS: bool = false;
override LAYER: f32 = 1.0;
// The weight of a layer: as in forward.wgsl.
override WEIGHT: f32 = 1.0;
override LEAST: f32 = 0.000244140625;
override PEAK: f32 = 1e28;
// Largest value that the target takes.
override LARGEST: f32 = 65000.0;

@group(1) @binding(0) var subpass_depth: texture_depth_2d;
@group(2) @binding(0) var<storage, read> particles: array<Particle>;
#ifdef SORTED
// Sort keys, from back to front.
@group(2) @binding(1) var<storage, read> keys: array<vec2<u32>>;
#endif
#ifdef TEXTURED
@group(2) @binding(2) var texture_0: texture_2d_array<f32>;
@group(2) @binding(3) var texture_1: texture_2d_array<f32>;
@group(2) @binding(4) var texture_2: texture_2d_array<f32>;
@group(2) @binding(5) var texture_3: texture_2d_array<f32>;
@group(2) @binding(6) var texture_sampler: sampler;
#endif

// Stands for a triangle that hides all of the picture.
const COVERS: u32 = 0xffffffffu;

struct Varying {
    @builtin(position) position: vec4<f32>,
    // Place in the square: -1 to 1, to the right and up.
    @location(0) square: vec2<f32>,
    // The particle, or COVERS. Fragments fetch its look with this number: on GPUs the cost of a small triangle grows with the values that it hands on
    // to them.
    @location(1) @interpolate(flat) number: u32,
    @location(2) world: vec3<f32>,
}

#ifdef TEXTURED
const CORNERS: u32 = 6u;

// A square has two triangles: its corners 0 1 2 and 3 2 1.
fn corner_of(index: u32) -> vec2<f32> {
    let corner = select(index, 6u - index, index >= 3u);
    return vec2(select(-1.0, 1.0, (corner & 1u) != 0u), select(-1.0, 1.0, (corner & 2u) != 0u));
}
#else
const CORNERS: u32 = 3u;

// A disc is drawn by the least triangle around it, which has half of a square's vertices, and no pixels that two triangles share.
fn corner_of(index: u32) -> vec2<f32> {
    return array(vec2(0.0, 2.0), vec2(-1.7320508, -1.0), vec2(1.7320508, -1.0))[index];
}
#endif

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    var out: Varying;
    let corner = corner_of(index % CORNERS);
    var number = index / CORNERS;
    out.square = corner;
    if COUNTS {
        if number == 0u {
            // Four times as large, a triangle covers the picture, too.
            out.position = vec4(corner * 4.0, 1.0, 1.0);
            out.number = COVERS;
            return out;
        }
        number -= 1u;
    }
#ifdef SORTED
    number = keys[number].y;
#endif
    let particle = particles[number];
    // No triangle of a particle that is not seen.
    out.position = vec4(0.0, 0.0, 0.0, 1.0);
    if particle.edge > 0.0 {
        let turn = particle.turn;
        let turned = vec2(corner.x * turn.x - corner.y * turn.y, corner.x * turn.y + corner.y * turn.x) * (particle.edge * 0.5);
        let off = normalize(frame.ray_x) * turned.x - normalize(frame.ray_y) * turned.y;
        // All of it lies at one depth. An orthographic range of depths ends where surfaces do; particles beyond it are drawn at its ends.
        let middle = frame.clip_from_world * vec4(particle.position, 1.0);
        let across = (frame.clip_from_world * vec4(off, 0.0)).xy;
        out.position = vec4(middle.xy + across, clamp(middle.z, 0.0, middle.w), middle.w);
        out.world = particle.position + off;
    }
    out.number = number;
    return out;
}

// The share of a soft disc that is left at a place.
fn disc(in: Varying) -> f32 {
    let inside = saturate(1.0 - dot(in.square, in.square));
    return inside * inside;
}

#ifdef TEXTURED
fn sampled(look: u32, uv: vec2<f32>, across: vec2<f32>, down: vec2<f32>) -> vec4<f32> {
    let cell = i32(look & 0xffffu);
    switch look >> 16u {
        case 1u: { return textureSampleGrad(texture_0, texture_sampler, uv, cell, across, down); }
        case 2u: { return textureSampleGrad(texture_1, texture_sampler, uv, cell, across, down); }
        case 3u: { return textureSampleGrad(texture_2, texture_sampler, uv, cell, across, down); }
        default: { return textureSampleGrad(texture_3, texture_sampler, uv, cell, across, down); }
    }
}

// Colour and alpha of its texture, or of a soft disc.
fn shape(in: Varying, look: u32) -> vec4<f32> {
    let uv = vec2(in.square.x, -in.square.y) * 0.5 + 0.5;
    let across = dpdx(uv);
    let down = dpdy(uv);
    if (look >> 16u) != 0u {
        return sampled(look, uv, across, down);
    }
    return vec4(1.0, 1.0, 1.0, disc(in));
}
#endif

// The share of a particle that is left before the surface of its pixel, and behind the near plane.
fn fade(particle: Particle) -> f32 {
    let depth = textureLoad(subpass_depth, vec2<i32>(0, 0), 0);
    // A pixel without a surface counts as endlessly far.
    let surface = select(1e30, distance_at(max(depth, 1e-37)), depth > 0.0);
    let distance = dot(particle.position, frame.forward);
    return saturate(min(surface - distance, distance - frame.near) / max(particle.softness, 1e-30));
}

// Times its share of the picture, so that it stays below the largest value: SIMULATE has cut off its light.
fn shade(in: Varying) -> vec4<f32> {
    let particle = particles[in.number];
    let color = particle.color;
#ifdef TEXTURED
    let texel = shape(in, particle.look);
    let alpha = saturate(color.a * texel.a * fade(particle));
    let own = vec4(color.rgb * texel.rgb * alpha, alpha);
#else
    let alpha = color.a * disc(in) * fade(particle);
    let own = vec4(color.rgb * alpha, alpha);
#endif
    return seen_through_air(in.world, own, LARGEST);
}

#ifdef WEIGHTED

struct Weighted {
    @location(0) accumulation: vec4<f32>,
    @location(1) weights: vec4<f32>,
}

@fragment
fn fragment(in: Varying) -> Weighted {
    let color = shade(in);
    let weight = weight_of(color.rgb, in.world, WEIGHT, LEAST, PEAK);
    return Weighted(vec4(color.rgb * weight, color.a), vec4(color.a * weight, 0.0, 0.0, color.a));
}

#else

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    if COUNTS {
        if in.number == COVERS {
            return vec4(0.0, 0.0, 0.0, 1.0);
        }
        return vec4(select(vec3(0.0), vec3(LAYER), shade(in).a > 0.0), 0.0);
    }
    return shade(in);
}

#endif
