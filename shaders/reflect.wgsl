// REFLECT: a ray of each smooth pixel's lobe, through the depth buffer, and the light of the pixel that it meets.
//
// A straight line is straight in the picture, too, and reversed depth is linear along it: x, y and depth of a ray change evenly. The ray is marched
// through a pyramid of squares, and each step leaves one square. It passes where the ray is nearer than everything visible in the square, or behind
// all of it by more than surfaces are thick. Otherwise the next step looks at a smaller square; if that is a pixel, it is met. (T. Uludag, "Hi-Z
// Screen-Space Cone-Traced Reflections", GPU Pro 5, 2014.)
// always: STORED MATERIAL
// variants: SPECULAR NORMAL_UINT
// counts: 4; with SPECULAR 2, NORMAL_UINT 2
#import afterlight::frame::{depth_at, distance_at, frame, position_at, view_ray, ORTHOGRAPHIC}
#import afterlight::encodings::{decode_normal, decode_normal_uint}
#import afterlight::gbuffer::{load_depth, load_texel, stored_depth, stored_normal}
#import afterlight::brdf::{smith_root, COOK_TORRANCE, MIN_N_DOT_V, MIN_ROUGHNESS, PI}
#import afterlight::hiz::{level_at, LAST_LEVEL, TILE}
#import afterlight::reflection::{across_normal, choice_of, pack_found, visible_facet, Found}

@group(1) @binding(6) var lit: texture_2d<f32>;
@group(1) @binding(7) var hiz: texture_2d<f32>;
@group(1) @binding(8) var rays: texture_storage_2d<rgba32uint, write>;

override NORMAL_ENCODING: u32 = 0u;
// The BRDF that all materials have; 4 where the scene mixes them.
override BRDF: u32 = 0u;
// The greatest roughness of surfaces that mirror others.
override ROUGHEST: f32 = 0.6;
override STEPS: u32 = 64u;
// Metres that surfaces go on behind their visible side.
override THICKNESS: f32 = 0.2;

// The distance from the edges of the picture over which hits fade out, as a part of its width and height.
const FADE: f32 = 0.03125;

fn normal_at(texel: vec2<i32>) -> vec3<f32> {
#ifdef NORMAL_UINT
    return decode_normal_uint(textureLoad(stored_normal, texel, 0).xy);
#else
    return decode_normal(textureLoad(stored_normal, texel, 0), NORMAL_ENCODING);
#endif
}

// The nearest and the farthest depth of a square.
fn range_of(square: vec2<i32>, level: i32, size: vec2<i32>) -> vec2<f32> {
    if level == 0 {
        return vec2(textureLoad(stored_depth, square, 0));
    }
    let tiles = (size + TILE - 1) / TILE;
    let at = level_at(level, tiles) + square;
    return vec2(textureLoad(hiz, at, 0).x, textureLoad(hiz, at + vec2(0, tiles.y * (TILE / 2)), 0).x);
}

// The length of a line up to the edge of a box of the picture; all lengths in pixels.
fn leaves(from_: vec2<f32>, step: vec2<f32>, low: vec2<f32>, high: vec2<f32>) -> f32 {
    let side = select(low, high, step > vec2(0.0));
    let until = (side - from_) / step;
    return min(select(1e30, until.x, step.x != 0.0), select(1e30, until.y, step.y != 0.0));
}

// The pixel that a ray meets; -1 for none.
fn march(start: vec3<f32>, direction: vec3<f32>, texel: vec2<i32>, size: vec2<i32>) -> vec2<i32> {
    let nothing = vec2(-1);
    let from_clip = frame.clip_from_world * vec4(start, 1.0);
    let by_clip = frame.clip_from_world * vec4(direction, 0.0);
    // Start and step of x, y in pixels, and depth. Homogenous: (c + t d) / (w + t d_w) lies on the line from c / w along d w - c d_w.
    let pixels = vec3(1.0 / frame.pixel_width, 1.0 / frame.pixel_height, 1.0);
    let first = (from_clip.xyz / from_clip.w + vec3(1.0, 1.0, 0.0)) * pixels;
    var step = (by_clip.xyz * from_clip.w - from_clip.xyz * by_clip.w) * pixels;
    let longest = max(abs(step.x), abs(step.y));
    // A ray along the line of sight is seen as a point, which shows where it began.
    if !(longest > 1e-20) || !(from_clip.w > 0.0) {
        return nothing;
    }
    step /= longest;
    let limit = vec2<f32>(size);
    // Beyond the edges of the picture, at infinity, and nearer than the near plane nothing is known.
    var end = leaves(first.xy, step.xy, vec2(0.0), limit);
    if step.z != 0.0 {
        end = min(end, select((1.0 - first.z) / step.z, -first.z / step.z, step.z < 0.0));
    }
    let own = vec2<f32>(texel);
    // It begins beyond the pixel that it is of.
    var at = max(leaves(first.xy, step.xy, own, own + 1.0), 0.0);
    var level = 0;
    for (var i = 0u; i < STEPS; i++) {
        // A hundredth of a pixel on, it is in the next square.
        let here = first + step * (at + 0.01);
        if at + 0.01 >= end || any(here.xy < vec2(0.0)) || any(here.xy >= limit) {
            return nothing;
        }
        let edge = f32(1u << u32(level));
        let square = floor(here.xy / edge);
        let next = max(min(leaves(first.xy, step.xy, square * edge, (square + 1.0) * edge), end), at + 0.01);
        let depths = vec2(first.z + step.z * at, first.z + step.z * next);
        let nearest = max(depths.x, depths.y);
        let farthest = max(min(depths.x, depths.y), 0.0);
        let range = range_of(vec2<i32>(square), level, size);
        let is_before = farthest > range.x;
        // A square that shows the sky somewhere is endlessly deep there, and no ray passes behind that.
        let is_behind = range.y > 0.0 && nearest < range.y && distance_at(nearest) > distance_at(range.y) + THICKNESS;
        if is_before || is_behind {
            at = next;
            level = min(level + 1, LAST_LEVEL);
        } else if level > 0 {
            level -= 1;
        } else {
            let pixel = vec2<i32>(square);
            // It meets fronts alone: of a surface turned away, the picture shows the other side.
            if range.x > 0.0 && dot(normal_at(pixel), direction) < 0.0 {
                return pixel;
            }
            at = next;
        }
    }
    return nothing;
}

@compute @workgroup_size(8, 8)
fn compute(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<i32>(textureDimensions(stored_depth));
    let texel = vec2<i32>(id.xy);
    if any(texel >= size) {
        return;
    }
    let pixel = vec2<f32>(texel) + 0.5;
    var found = Found(vec3(0.0, 0.0, 1.0), 0.0, vec3(0.0), 0.0, 0.0);
    let depth = load_depth(pixel);
    if depth <= 0.0 {
        textureStore(rays, texel, pack_found(found));
        return;
    }
    let surface = load_texel(pixel, NORMAL_ENCODING, 0.0);
    let brdf = select(BRDF, surface.brdf, BRDF == 4u);
    if brdf != COOK_TORRANCE || surface.roughness > ROUGHEST {
        textureStore(rays, texel, pack_found(found));
        return;
    }
    let place = position_at(pixel, depth);
    let to_eye = normalize(-view_ray(pixel));
    let normal = surface.normal;
    let axes = across_normal(normal);
    // Normal maps turn some away from the eye.
    let n_dot_v = max(dot(normal, to_eye), MIN_N_DOT_V);
    let view = normalize(vec3(dot(to_eye, axes[0]), dot(to_eye, axes[1]), n_dot_v));
    let roughness = max(surface.roughness, MIN_ROUGHNESS);
    let alpha = roughness * roughness;
    let half = visible_facet(view, choice_of(id.xy), alpha);
    let mirrored = 2.0 * dot(view, half) * half - view;
    if mirrored.z > 0.0 {
        found.direction = normalize(axes[0] * mirrored.x + axes[1] * mirrored.y + normal * mirrored.z);
        // Density of directions: the visible facets' density, G1 D VdotH / NdotV, over the Jacobian from half vectors to directions,
        // 4 VdotH: G1 D / (4 NdotV).
        let sine2 = dot(half.xy, half.xy);
        let spread = half.z * half.z * alpha * alpha + sine2;
        let smith = 2.0 * view.z / (view.z + smith_root(view.z, alpha * alpha));
        found.density = alpha * alpha / (PI * spread * spread) * smith / (4.0 * view.z);
        // A pixel's width above the surface: its depth changes by half of its slope from the middle to the edge of a pixel.
        let width = length(position_at(pixel + vec2(1.0, 0.0), depth) - place);
        let met = march(place + normal * width, found.direction, texel, size);
        if met.x >= 0 {
            let there = vec2<f32>(met) + 0.5;
            let off = position_at(there, load_depth(there)) - place;
            let inside = min(there, vec2<f32>(size) - there) / vec2<f32>(size);
            found.distance = max(length(off), 1e-4);
            found.light = textureLoad(lit, met, 0).rgb;
            found.confidence = saturate(min(inside.x, inside.y) / FADE);
        }
    }
    textureStore(rays, texel, pack_found(found));
}
