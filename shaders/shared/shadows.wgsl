// Shadow maps: the share of a light that reaches a point. All maps lie in one layered image; a light's record names its own. Depth is reversed, 1
// near the light and 0 where nothing was drawn. Texels are fetched and compared by hand, because depth formats need not filter.
#define_import_path afterlight::shadows
#import afterlight::frame::{frame, ORTHOGRAPHIC}
#import afterlight::tints::{depth_of, from_half, nearness}

// The most maps that there are.
const SHADOW_VIEWS: u32 = 128u; // host

// One map; src/gpu_scene/shadows.rs has the same record.
struct ShadowView {
    // Rows from camera-relative world space to u and v in texels of the layer, depth, and w, by which the others are divided.
    u: vec4<f32>,
    v: vec4<f32>,
    depth: vec4<f32>,
    w: vec4<f32>,
    // Origin of the light's square in the map, and the square's edge, in texels. The edge is 0 if there is no map to look up.
    low: vec2<f32>,
    edge: f32,
    layer: u32,
    // Edge of a texel in metres, where w is 1.
    texel: f32,
    // The tangent of half the angle under which a directional light is seen; the radius of another one in metres.
    light_size: f32,
    // The end of a cascade, in metres along the view, and the distance at which the next one begins to take over.
    end: f32,
    blend: f32,
}

@group(2) @binding(0) var shadow_atlas: texture_depth_2d_array;
@group(2) @binding(1) var<uniform> shadow_views: array<ShadowView, SHADOW_VIEWS>;
// Looked up where the filter's code says so; else it is the atlas once more.
@group(2) @binding(2) var shadow_tints: texture_2d_array<f32>;

// SHADOW_FILTER in the passes.
const NO_FILTER: u32 = 0u; // host
const BOX_TWO: u32 = 1u; // host
const BOX_THREE: u32 = 2u; // host
const BOX_FIVE: u32 = 3u; // host
const POISSON: u32 = 4u; // host
const PCSS: u32 = 5u; // host
// Added to the filter: what transparent surfaces let through counts, too.
const TINTED: u32 = 8u; // host

// A light's view of the scene: bits 2 and 3 of its record's `falloff`, 0 for a light without a map. Bits 4 to 11 are its first map, the others its
// number of maps. `ShadowPlan::code` in src/plan/shadows.rs packs them.
const CASCADES: u32 = 1u; // host
const SINGLE: u32 = 2u; // host
const CUBE: u32 = 3u; // host

// A disc of sixteen points that keep their distance, in a unit circle.
const DISC_POINTS: i32 = 16;

fn disc_point(i: i32) -> vec2<f32> {
    var points = array(
        vec2(-0.0585, 0.0472), vec2(0.3641, -0.2307), vec2(-0.1983, -0.4389), vec2(0.1706, 0.4632),
        vec2(-0.4917, 0.2358), vec2(0.5723, 0.2154), vec2(-0.6262, -0.1796), vec2(0.2237, -0.6593),
        vec2(-0.2646, 0.7009), vec2(0.7338, -0.4101), vec2(-0.5573, -0.6434), vec2(0.5012, 0.6815),
        vec2(-0.7826, 0.5403), vec2(0.9357, 0.1379), vec2(-0.9663, 0.0687), vec2(0.0419, -0.9641),
    );
    return points[i];
}

// A point in a map, and the plane through it.
struct MapPoint {
    uv: vec2<f32>,
    depth: f32,
    w: f32,
    // The change of the plane's depth along u and v, from texel to texel.
    slope: vec2<f32>,
}

// Texels around a point are compared with the depth that its plane has there, or a slanting surface would shade itself (Isidoro 2006, "Shadow
// Mapping: GPU-based Tips and Techniques").
fn map_point(view: ShadowView, position: vec3<f32>, normal: vec3<f32>) -> MapPoint {
    let p = vec4(position, 1.0);
    let w = dot(view.w, p);
    let uv = vec2(dot(view.u, p), dot(view.v, p)) / w;
    let depth = dot(view.depth, p) / w;
    // ANCHOR: plane-slope
    // Gradients in the world. The depth gradient is a linear combination of the gradients of u and v and of the normal; the plane does not extend
    // along the normal, so Cramer's rule gives the slopes.
    let du = (view.u.xyz - uv.x * view.w.xyz) / w;
    let dv = (view.v.xyz - uv.y * view.w.xyz) / w;
    let dz = (view.depth.xyz - depth * view.w.xyz) / w;
    let area = dot(normal, cross(du, dv));
    let slope = vec2(dot(normal, cross(dz, dv)), dot(normal, cross(du, dz))) / area;
    // ANCHOR_END: plane-slope
    // Seen from its edge, a plane has no slope that means anything.
    let step = view.texel * w;
    return MapPoint(uv, depth, w, select(slope, vec2(0.0), abs(area) * step * step < 0.005));
}

// Never a texel of another map.
fn inside(view: ShadowView, texel: vec2<f32>) -> vec2<i32> {
    return vec2<i32>(clamp(texel, view.low, view.low + (view.edge - 1.0)));
}

fn stored_depth(view: ShadowView, texel: vec2<f32>) -> f32 {
    return textureLoad(shadow_atlas, inside(view, texel), i32(view.layer), 0);
}

fn is_perspective(view: ShadowView) -> bool {
    return any(view.w.xyz != vec3(0.0));
}

fn stored_tint(view: ShadowView, texel: vec2<f32>) -> vec4<f32> {
    return textureLoad(shadow_tints, inside(view, texel), i32(view.layer), 0);
}

// The share of light that transparent surfaces leave to a depth.
fn tint_before(view: ShadowView, depth: f32, texel: vec2<f32>) -> vec3<f32> {
    let stored = stored_tint(view, texel);
    return select(vec3(1.0), stored.rgb, nearness(depth, is_perspective(view)) < from_half(stored.a));
}

// Depth of the transparent surface nearest to the light; -1, less than any depth, if no surface tints this texel.
fn tinting_depth(view: ShadowView, texel: vec2<f32>) -> f32 {
    let near = from_half(stored_tint(view, texel).a);
    return select(-1.0, depth_of(near, is_perspective(view)), near > 0.0);
}

// The depth of a point's plane in the middle of a texel.
fn plane_depth(at: MapPoint, texel: vec2<f32>) -> f32 {
    return at.depth + dot(at.slope, texel + 0.5 - at.uv);
}

// ANCHOR: is-lit
// The share of light that reaches the plane in a texel.
fn lit_share(view: ShadowView, at: MapPoint, texel: vec2<f32>, tinted: bool) -> vec3<f32> {
    let depth = plane_depth(at, texel);
    var share = vec3(select(0.0, 1.0, depth >= stored_depth(view, texel)));
    if tinted {
        share *= tint_before(view, depth, texel);
    }
    return share;
}
// ANCHOR_END: is-lit

// Percentage-closer filtering (Reeves et al. 1987) over a square of texels, the outer ones weighted by how much of them the square
// covers, so that the edge slides instead of stepping. Two texels a side is bilinear filtering.
fn box_filter(view: ShadowView, at: MapPoint, texels: i32, tinted: bool) -> vec3<f32> {
    let width = f32(texels - 1);
    let start = at.uv - width * 0.5;
    let first = floor(start);
    let f = start - first;
    var sum = vec3(0.0);
    for (var y = 0; y < texels; y++) {
        let weight_y = select(select(1.0, f.y, y == texels - 1), 1.0 - f.y, y == 0);
        var row = vec3(0.0);
        for (var x = 0; x < texels; x++) {
            let weight_x = select(select(1.0, f.x, x == texels - 1), 1.0 - f.x, x == 0);
            row += weight_x * lit_share(view, at, first + vec2(f32(x), f32(y)), tinted);
        }
        sum += weight_y * row;
    }
    return sum / (width * width);
}

// Cosine and sine of an angle that differs from pixel to pixel: interleaved gradient noise (Jimenez 2014). By the pixel that the point
// is seen in, so that every light path turns the disc alike; and by where in the pixel a frame of several samples looks, so that these
// average out.
fn disc_turn(position: vec3<f32>) -> vec2<f32> {
    let clip = frame.clip_from_world * vec4(position, 1.0);
    let pixel = floor((clip.xy / clip.w + 1.0) / vec2(frame.pixel_width, frame.pixel_height));
    let noise = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
    let aside = select(frame.ray_center - frame.forward, frame.ray_center, ORTHOGRAPHIC);
    let sample = fract(dot(aside, vec3(7919.0, 5081.0, 9631.0)));
    let angle = 6.2831853 * (noise + sample);
    return vec2(cos(angle), sin(angle));
}

fn turned(point: vec2<f32>, turn: vec2<f32>) -> vec2<f32> {
    return vec2(point.x * turn.x - point.y * turn.y, point.x * turn.y + point.y * turn.x);
}

fn disc_filter(view: ShadowView, at: MapPoint, turn: vec2<f32>, radius: f32, tinted: bool) -> vec3<f32> {
    var sum = vec3(0.0);
    for (var i = 0; i < DISC_POINTS; i++) {
        let offset = turned(disc_point(i), turn) * radius;
        let texel = floor(at.uv + offset);
        sum += lit_share(view, at, texel, tinted);
    }
    return sum / f32(DISC_POINTS);
}

// Percentage-closer soft shadows (Fernando 2005): blockers are searched for, and the disc is as wide as the penumbra that the
// light's size and their mean distance make. `most` bounds both discs, in texels.
fn soft_filter(view: ShadowView, at: MapPoint, turn: vec2<f32>, most: f32, tinted: bool) -> vec3<f32> {
    // The map is perspective where w changes with the place.
    let perspective = is_perspective(view);
    let texel = view.texel * at.w;
    // As wide as the penumbra of the farthest blocker that there can be; near a lamp that has no bound, so a third of the way to the
    // lamp is as near to it as blockers are looked for.
    let range = 1.0 / max(length(view.depth.xyz), 1e-30);
    let widest = select((1.0 - at.depth) * range, 2.0, perspective) * view.light_size;
    let search = clamp(widest / texel, 1.0, most);
    var sum = 0.0;
    var count = 0.0;
    for (var i = 0; i < DISC_POINTS; i++) {
        let offset = turned(disc_point(i), turn) * search;
        let place = floor(at.uv + offset);
        let depth = plane_depth(at, place);
        var stored = stored_depth(view, place);
        if tinted && stored <= depth {
            // A transparent surface makes a penumbra, too.
            stored = max(stored, tinting_depth(view, place));
        }
        if stored > depth {
            sum += stored;
            count += 1.0;
        }
    }
    if count == 0.0 {
        return vec3(1.0);
    }
    let blocker = sum / count;
    var penumbra = 0.0;
    if perspective {
        // Depth is near / distance; similar triangles with the light above, the receiver below.
        let ratio = blocker / at.depth;
        penumbra = view.light_size * (ratio - 1.0);
    } else {
        penumbra = (blocker - at.depth) * range * view.light_size;
    }
    return disc_filter(view, at, turn, clamp(penumbra / texel, 1.0, most), tinted);
}

// Share of light in one map. `chosen`: the filter.
fn visibility_in(view: ShadowView, position: vec3<f32>, normal: vec3<f32>, chosen: u32) -> vec3<f32> {
    // A point behind the light is lit, and so is every point if there is no map.
    let w = dot(view.w, vec4(position, 1.0));
    if view.edge <= 0.0 || w <= 0.0 {
        return vec3(1.0);
    }
    // In texels at that place, so that the same scene in another unit has the same shadows.
    // ANCHOR: normal-offset
    let moved = position + normal * (view.texel * w * frame.shadow_normal_offset);
    let at = map_point(view, moved, normal);
    // ANCHOR_END: normal-offset
    if any(at.uv < view.low) || any(at.uv > view.low + view.edge) || at.depth <= 0.0 {
        return vec3(1.0);
    }
    let tinted = (chosen & TINTED) != 0u;
    switch chosen & 7u {
        case NO_FILTER: { return lit_share(view, at, floor(at.uv), tinted); }
        case BOX_TWO: { return box_filter(view, at, 2, tinted); }
        case BOX_FIVE: { return box_filter(view, at, 5, tinted); }
        case POISSON: {
            return disc_filter(view, at, disc_turn(position), 2.5, tinted);
        }
        case PCSS: {
            if view.light_size > 0.0 {
                let most = clamp(view.edge / 24.0, 2.5, 64.0);
                return soft_filter(view, at, disc_turn(position), most, tinted);
            }
            return box_filter(view, at, 3, tinted);
        }
        default: { return box_filter(view, at, 3, tinted); }
    }
}

// The number, of six, of the map that sees a direction away from the light.
fn cube_face(direction: vec3<f32>) -> u32 {
    let size = abs(direction);
    if size.x >= size.y && size.x >= size.z {
        return select(1u, 0u, direction.x > 0.0);
    }
    if size.y >= size.z {
        return select(3u, 2u, direction.y > 0.0);
    }
    return select(5u, 4u, direction.z > 0.0);
}

// Share of a light that reaches a point. `code` is the light's `falloff`, `to_light` a unit vector, `chosen` the filter.
fn visibility(code: u32, position: vec3<f32>, normal: vec3<f32>, to_light: vec3<f32>, chosen: u32) -> vec3<f32> {
    let kind = (code >> 2u) & 3u;
    if kind == 0u {
        return vec3(1.0);
    }
    var index = (code >> 4u) & 255u;
    if kind != CASCADES {
        if kind == CUBE {
            index += cube_face(-to_light);
        }
        return visibility_in(shadow_views[index], position, normal, chosen);
    }
    // The distance along the view selects the cascade. The last cascade has no end.
    let distance = dot(position, frame.forward);
    let last = index + (code >> 12u) - 1u;
    while index < last && distance > shadow_views[index].end {
        index += 1u;
    }
    // ANCHOR: next-cascade
    let view = shadow_views[index];
    var light = visibility_in(view, position, normal, chosen);
    if distance > view.blend && index < last {
        let next = visibility_in(shadow_views[index + 1u], position, normal, chosen);
        light = mix(light, next, (distance - view.blend) / (view.end - view.blend));
    }
    return light;
    // ANCHOR_END: next-cascade
}
