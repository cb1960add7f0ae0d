// Light through glass: a ray beyond its surface is followed through the body by an estimate of the body's shape, and then through the picture behind the glass.
#define_import_path afterlight::refraction
#import afterlight::frame::{frame, ORTHOGRAPHIC}
#import afterlight::backdrop::{level_extent, light_at, unpacked_light, Backdrop, LAST_LEVEL}
#import afterlight::fogged::{through_all_air}
#import afterlight::brdf::{Surface}
#import afterlight::lobes::{film_reflectance, lobe_data, FILM}
#ifdef SKY_LIGHT
#import afterlight::sky::{lobe_of_sky}
#endif

// The material is glass that bends, blurs or tints light (KHR_materials_transmission, KHR_materials_volume, KHR_materials_dispersion).
override REFRACTS: bool = false;
// Rays that meet nothing see the sky, and not one colour.
override SEES_SKY: bool = false;

@group(0) @binding(13) var<storage, read> backdrop: Backdrop;

// Facets that light through a rough surface is looked up by, and steps of each ray through the picture.
const GLASS_FACETS: u32 = 8u;
const STEPS: u32 = 32u;
const HALVINGS: u32 = 5u;
// The square of the sine of the most grazing angle at which light leaves a body.
const MOST_ASIDE: f32 = 0.97;
// Below this perceptual roughness a surface is taken for polished.
const SMOOTH: f32 = 0.01;

// The glass of the surface that is lit.
struct Glass {
    // Indices of refraction of red, green and blue.
    iors: vec3<f32>,
    // Thickness in the world, in metres; 0 is a thin wall.
    thickness: f32,
    // Absorption in 1/m.
    absorption: vec3<f32>,
    // Shape, from 0 for a pane, whose far side is parallel to the near one, to 1 for a ball.
    round: f32,
    // Light of a ray that meets nothing, where no sky is seen.
    background: vec3<f32>,
    roughness: f32,
    // Depth of the surface, reversed, and the place of this frame's facets among all.
    depth: f32,
    turn: vec2<f32>,
}

// `texel`: the share of the thickness that the material's texture leaves; `scale`: metres per unit of the mesh; `shape`: the round share of its
// surface, and 1 over its longest edge.
fn glass_of(row: u32, texel: f32, scale: f32, shape: vec2<f32>, roughness: f32, depth: f32) -> Glass {
    let own = lobe_data.rows[row];
    var glass: Glass;
    glass.iors = max(vec3(own.glass.x) + vec3(-own.glass.z, 0.0, own.glass.z), vec3(1.0));
    // A texture makes no body a thin wall, which would absorb nothing.
    glass.thickness = own.glass.y * max(texel, 1e-4) * scale;
    glass.absorption = own.absorption.rgb;
    // The body is a pane up to a quarter of the longest edge, and a ball from half of that edge on, as far as it is round.
    glass.round = shape.x * saturate(4.0 * own.glass.y * texel * shape.y - 1.0);
    glass.background = own.background.rgb;
    glass.roughness = roughness;
    glass.depth = depth;
    // Another set of facets for each jittered frame; the middle of the pixel has the first.
    glass.turn = fract(vec2(dot(frame.jitter, vec2(7.31, 13.17)), dot(frame.jitter, vec2(17.43, -5.29))));
    return glass;
}

fn picture_size() -> vec2<u32> {
    return vec2<u32>(round(2.0 / vec2(frame.pixel_width, frame.pixel_height)));
}

fn depth_in_backdrop(pixel: vec2<f32>, size: vec2<u32>) -> f32 {
    let at = min(vec2<u32>(max(pixel, vec2(0.0))), size - 1u);
    return bitcast<f32>(backdrop.words[at.y * size.x + at.x]);
}

fn texel_light(level: u32, texel: vec2<u32>, size: vec2<u32>) -> vec3<f32> {
    let at = light_at(size, level, texel);
    return unpacked_light(vec2(backdrop.words[at], backdrop.words[at + 1u]));
}

// A level's light at a place of the picture in pixels, between texels.
fn level_light(level: u32, pixel: vec2<f32>, size: vec2<u32>) -> vec3<f32> {
    let last = vec2<i32>(level_extent(size, level)) - 1;
    let place = pixel / f32(1u << level) - 0.5;
    let corner = floor(place);
    let within = place - corner;
    let low = vec2<u32>(clamp(vec2<i32>(corner), vec2(0), last));
    let high = vec2<u32>(clamp(vec2<i32>(corner) + 1, vec2(0), last));
    let upper = mix(texel_light(level, low, size), texel_light(level, vec2(high.x, low.y), size), within.x);
    let lower = mix(texel_light(level, vec2(low.x, high.y), size), texel_light(level, high, size), within.x);
    return mix(upper, lower, within.y);
}

// The picture's light around a place, blurred to a square of `width` pixels.
fn light_behind(pixel: vec2<f32>, width: f32) -> vec3<f32> {
    let size = picture_size();
    let level = clamp(log2(max(width, 1.0)), 0.0, f32(LAST_LEVEL));
    let finer = u32(level);
    let own = level_light(finer, pixel, size);
    if f32(finer) == level {
        return own;
    }
    return mix(own, level_light(finer + 1u, pixel, size), fract(level));
}

// The light of this pixel as it is without glass.
fn light_straight_behind(pixel: vec2<f32>) -> vec3<f32> {
    let size = picture_size();
    return texel_light(0u, min(vec2<u32>(pixel), size - 1u), size);
}

fn to_pixel(clip: vec2<f32>) -> vec2<f32> {
    return (clip + 1.0) / vec2(frame.pixel_width, frame.pixel_height);
}

// Light that a ray beyond the glass meets, as stored: the ray is followed on its line across the picture, on which depth falls evenly, until a
// surface is nearer than the ray. `spread`: the slope of the cone that the ray stands for. A ray that leaves the picture or passes the last surface
// meets the background.
fn light_along(start: vec3<f32>, direction: vec3<f32>, before: f32, spread: f32, glass: Glass) -> vec3<f32> {
    let size = picture_size();
    let origin = frame.clip_from_world * vec4(start, 1.0);
    let step = frame.clip_from_world * vec4(direction, 0.0);
    let a = origin.xyz / origin.w;
    // The end is where the ray vanishes, at infinity, or shortly before it reaches the camera's plane; orthographic, where depth ends.
    let vanishes = step.w > 1e-4;
    var length = 0.95 * origin.w / max(-step.w, 1e-4);
    if ORTHOGRAPHIC {
        length = clamp(a.z / max(-step.z, 1e-6), 0.0, 1e4 * frame.depth_range);
    }
    let finite = origin + step * length;
    let b = select(finite.xyz / finite.w, step.xyz / step.w, vec3(vanishes));
    let end_w = select(finite.w, step.w, vanishes);
    // The part of the way that is in the picture.
    let way = b - a;
    let room = (select(vec2(-1.0), vec2(1.0), way.xy > vec2(0.0)) - a.xy) / select(way.xy, vec2(1e-9), abs(way.xy) < vec2(1e-9));
    let inside = min(1.0, min(room.x, room.y));
    var met = -1.0;
    if inside > 0.0 {
        var last = 0.0;
        for (var i = 1u; i <= STEPS; i++) {
            let share = inside * f32(i) / f32(STEPS);
            let at = a + way * share;
            let stored = depth_in_backdrop(to_pixel(at.xy), size);
            // What lies before the glass is not seen through it.
            if stored >= at.z && stored <= glass.depth {
                met = share;
                break;
            }
            last = share;
        }
        if met > 0.0 {
            for (var i = 0u; i < HALVINGS; i++) {
                let middle = 0.5 * (last + met);
                let at = a + way * middle;
                let stored = depth_in_backdrop(to_pixel(at.xy), size);
                let is_behind = stored >= at.z && stored <= glass.depth;
                last = select(middle, last, is_behind);
                met = select(met, middle, is_behind);
            }
        }
    }
    var pixel = to_pixel(clamp(a.xy + way.xy * max(inside, 0.0), vec2(-1.0), vec2(1.0)));
    var width = 4.0;
    if met < 0.0 {
        // A surface that the picture cuts off is taken to go on as far as the ray goes.
        let stored = depth_in_backdrop(pixel, size);
        let goes_on = stored > 0.0 && stored <= glass.depth && inside < 1.0;
#ifdef SKY_LIGHT
        let is_seen = goes_on;
#else
        // A sky that is seen and lights nothing is in the picture alone.
        let is_seen = goes_on || SEES_SKY;
#endif
        if !is_seen {
            var light = glass.background;
#ifdef SKY_LIGHT
            if SEES_SKY {
                light = lobe_of_sky(direction, min(sqrt(0.5 * spread), 1.0)) * frame.exposure;
            }
#endif
            return through_all_air(light, direction);
        }
    } else {
        // Metres along the ray, and the pixels that its cone covers there.
        let pixels = 1.0 / (frame.pixel_height * max(sqrt(dot(frame.ray_y, frame.ray_y)), 1e-9));
        width = spread * pixels / max(step.w, 1e-4);
        if !vanishes || met < 0.9999 {
            let farther = select(met / end_w, met / step.w, vanishes);
            let nearer = (1.0 - met) / origin.w;
            let metres = select(length * farther / (farther + nearer), farther / nearer, vanishes);
            width = spread * pixels * (metres + before) / max(origin.w + step.w * metres, 1e-9);
        }
        pixel = to_pixel(a.xy + way.xy * met);
    }
    return light_behind(pixel, width);
}

// A facet that the eye sees, of GGX (Heitz, "Sampling the GGX Distribution of Visible Normals", 2018), about a normal.
fn visible_facet(view: vec3<f32>, normal: vec3<f32>, alpha: f32, point: vec2<f32>) -> vec3<f32> {
    let other_axis = select(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), abs(normal.x) > 0.5);
    let x = normalize(cross(other_axis, normal));
    let y = cross(normal, x);
    let stretched = normalize(vec3(alpha * dot(view, x), alpha * dot(view, y), max(dot(view, normal), 1e-4)));
    var aside = vec3(-stretched.y, stretched.x, 0.0);
    let flat = dot(aside, aside);
    aside = select(vec3(1.0, 0.0, 0.0), aside * inverseSqrt(max(flat, 1e-20)), flat > 1e-12);
    let other = cross(stretched, aside);
    let radius = sqrt(point.y);
    let angle = point.x * 6.28318530718;
    let across = radius * cos(angle);
    let share = 0.5 * (1.0 + stretched.z);
    let along = (1.0 - share) * sqrt(max(1.0 - across * across, 0.0)) + share * radius * sin(angle);
    let ahead = sqrt(max(1.0 - across * across - along * along, 0.0));
    let facet = aside * across + other * along + stretched * ahead;
    return normalize(x * (alpha * facet.x) + y * (alpha * facet.y) + normal * max(facet.z, 0.0));
}

// The share of light that a facet lets pass, by the cosine of its angle in the air.
fn passed(surface: Surface, cosine: f32) -> vec3<f32> {
    let x = 1.0 - min(cosine, 1.0);
    let x2 = x * x;
    var fresnel = surface.specular + surface.fresnel_rise * (x2 * x2 * x);
    if FILM {
        fresnel = film_reflectance(min(cosine, 1.0), fresnel);
        // Of all colours the same share, or they would have the opposite colours.
        fresnel = vec3(max(fresnel.r, max(fresnel.g, fresnel.b)));
    }
    return saturate(vec3(1.0) - fresnel);
}

// Smith's term of a direction over its cosine.
fn hidden_of(cosine: f32, alpha_squared: f32) -> f32 {
    return sqrt(cosine * cosine + alpha_squared * (1.0 - cosine * cosine)) / max(cosine, 1e-4);
}

// The share of light from a visible facet that is not masked on its way out, by the cosine of the way.
fn unmasked(surface: Surface, cosine: f32) -> f32 {
    let seen = hidden_of(surface.n_dot_v, surface.alpha_squared);
    return (seen + 1.0) / (seen + hidden_of(cosine, surface.alpha_squared));
}

// Light through one facet: the facet's share times the light that it meets. The far side of the body is estimated from its thickness: parallel to the
// near side for a pane, and spherical for a ball of this diameter. Both are exact where the picture shows the light that they meet.
fn light_through(surface: Surface, glass: Glass, place: vec3<f32>, points: vec4<f32>, ior: f32, spread: f32) -> vec3<f32> {
    let alpha = glass.roughness * glass.roughness;
    let is_rough = glass.roughness >= SMOOTH;
    var facet = surface.normal;
    if is_rough {
        facet = visible_facet(surface.view, surface.normal, alpha, points.xy);
    }
    let v_dot_h = dot(surface.view, facet);
    let normal = surface.normal;
    let first = passed(surface, v_dot_h);
    // Light through a thin wall goes as the facet mirrors it, on the other side.
    let mirrored = 2.0 * v_dot_h * facet - surface.view;
    var down = dot(mirrored, normal);
    var out = mirrored - 2.0 * down * normal;
    var share = first;
    var start = place;
    var path = 0.0;
    var cone = 2.0 * spread;
    if glass.thickness > 0.0 {
        let eta = 1.0 / ior;
        let within = facet * (eta * v_dot_h - sqrt(max(1.0 - eta * eta * (1.0 - v_dot_h * v_dot_h), 0.0))) - surface.view * eta;
        down = -dot(within, normal);
        path = glass.thickness * mix(1.0 / max(down, 0.05), down, glass.round);
        let far_normal = normalize(mix(-normal, normal + 2.0 * down * within, glass.round));
        var far_facet = far_normal;
        if is_rough {
            far_facet = -visible_facet(-within, -far_normal, alpha, points.zw);
        }
        var aside = ior * (within - far_facet * dot(within, far_facet));
        if dot(aside, aside) > MOST_ASIDE {
            // Beyond the critical angle light goes on within, and leaves where another facet lets it: here, by the mean of all facets.
            far_facet = far_normal;
            aside = ior * (within - far_facet * dot(within, far_facet));
        }
        let length_squared = dot(aside, aside);
        aside *= min(1.0, sqrt(MOST_ASIDE / max(length_squared, 1e-9)));
        let rest = 1.0 - min(length_squared, MOST_ASIDE);
        out = normalize(aside + far_facet * sqrt(rest));
        let second = passed(surface, sqrt(rest));
        // Light that both sides mirror back and forth comes out, too.
        share = first * second / max(vec3(1.0) - (vec3(1.0) - first) * (vec3(1.0) - second), vec3(1e-3)) * exp(-glass.absorption * path);
        start = place + within * path;
        cone = (ior - 1.0) * spread;
    }
    if v_dot_h <= 0.0 || down <= 0.0 {
        return vec3(0.0);
    }
    return share * (select(1.0, unmasked(surface, down), is_rough) * light_along(start, out, path, cone, glass));
}

// The light that passes through glass to the eye, as stored, but for its tint. There is one loop for facets and colours, so that compilers have the code for a ray once.
fn light_through_glass(surface: Surface, glass: Glass, place: vec3<f32>) -> vec3<f32> {
    let facets = select(1u, GLASS_FACETS, glass.roughness >= SMOOTH);
    let colors = select(3u, 1u, glass.iors.x == glass.iors.z || glass.thickness <= 0.0);
    // Facets of both sides stand for their share of the lobe.
    let spread = select(0.0, glass.roughness * glass.roughness / sqrt(f32(GLASS_FACETS)), facets > 1u);
    var sum = vec3(0.0);
    for (var i = 0u; i < facets * colors; i++) {
        let color = i % colors;
        // R2 (Roberts 2018).
        let number = f32(i / colors);
        let near = fract(vec2(0.7548776662, 0.5698402910) * (number + 0.5) + glass.turn);
        let far = fract(vec2(0.5698402910, 0.7548776662) * (3.0 * number + 1.5) + glass.turn.yx * 3.0);
        let ior = select(select(glass.iors.z, glass.iors.x, color == 0u), glass.iors.y, colors == 1u || color == 1u);
        let wanted = select(vec3<f32>(vec3(color) == vec3(0u, 1u, 2u)), vec3(1.0), colors == 1u);
        sum += wanted * light_through(surface, glass, place, vec4(near, far), ior, spread);
    }
    return sum / f32(facets);
}
