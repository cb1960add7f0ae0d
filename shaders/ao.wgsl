// AO: the share of light from everywhere that surfaces nearby leave to each pixel, from depth and normals of the pixels around it. AO_DENOISE
// makes of it what LIGHTING reads.
// variants: NORMAL_UINT
// counts: 2; with NORMAL_UINT 1
#import afterlight::frame::{distance_at, frame, position_at, ORTHOGRAPHIC}
#import afterlight::encodings::{decode_normal, decode_normal_uint}
#import afterlight::visibility::{pack_visibility}

@group(1) @binding(0) var stored_depth: texture_depth_2d;
#ifdef NORMAL_UINT
@group(1) @binding(1) var stored_normal: texture_2d<u32>;
#else
@group(1) @binding(1) var stored_normal: texture_2d<f32>;
#endif
@group(1) @binding(2) var visibility: texture_storage_2d<r32uint, write>;

override NORMAL_ENCODING: u32 = 0u;
// Metres beyond which nothing is hidden.
override RADIUS: f32 = 0.5;
// Pixels from one that is looked at to the next.
override SCALE: u32 = 1u;
// If true, AO takes SLICES slices of the hemisphere with STEPS steps to both sides of each; else SAMPLES samples of it.
override SLICED: bool = true;
override SLICES: u32 = 1u;
override STEPS: u32 = 8u;
override SAMPLES: u32 = 16u;

const PI: f32 = 3.14159265;
const SECTORS: f32 = 32.0;
// The assumed thickness of visible surfaces, in radii: crates/truth/src/reference/depth_march.rs has the same.
const THICKNESS: f32 = 0.5;
// The least cosine between a normal and the line of sight. Normal maps turn some away from the eye.
const LEAST_FACING: f32 = 0.01;
// The distance, in radii, by which a sample of the hemisphere must lie behind the visible surface to be hidden, so that a surface does not hide
// itself.
const BIAS: f32 = 0.025;

// The surface point that a pixel shows.
struct Point {
    pixel: vec2<f32>,
    place: vec3<f32>,
    // The surface's direction, of length 1.
    normal: vec3<f32>,
    to_eye: vec3<f32>,
    // Across the line of sight, of length 1.
    right: vec3<f32>,
    down: vec3<f32>,
    // Shares of a turn and of a step, which differ between the 16 pixels of a tile and from frame to frame of a picture.
    turn: f32,
    step: f32,
}

// Two vectors of length 1 that lie across one (T. Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
fn across(n: vec3<f32>) -> mat2x3<f32> {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat2x3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y));
}

// 0 to 15, each once in a tile of 4 x 4, neighbours far apart (B. E. Bayer, "An optimum method for two-level rendition", 1973).
fn tile_number(texel: vec2<u32>) -> u32 {
    let mixed = texel.x ^ texel.y;
    return ((mixed & 1u) << 3u) | ((texel.y & 1u) << 2u) | (mixed & 2u) | ((texel.y & 2u) >> 1u);
}

// The picture's size in pixels.
fn picture_size() -> vec2<f32> {
    return vec2<f32>(textureDimensions(stored_depth));
}

// Pixels that a step of a metre along a direction is seen as, at a place.
fn seen_as(along: vec3<f32>, place: vec3<f32>) -> vec2<f32> {
    var step = along;
    if !ORTHOGRAPHIC {
        let distance = dot(place, frame.forward);
        step = (along - place * (dot(along, frame.forward) / distance)) / distance;
    }
    let shares = vec2(dot(step, frame.ray_x) / dot(frame.ray_x, frame.ray_x), dot(step, frame.ray_y) / dot(frame.ray_y, frame.ray_y));
    return shares / vec2(frame.pixel_width, frame.pixel_height);
}

fn is_inside(at: vec2<f32>) -> bool {
    return all(at >= vec2(0.0)) && all(at < picture_size());
}

// acos to 7e-5 (M. Abramowitz and I. A. Stegun, "Handbook of Mathematical Functions", 4.4.45).
fn arc_cosine(x: f32) -> f32 {
    let a = min(abs(x), 1.0);
    let up = sqrt(1.0 - a) * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - a * 0.0187293)));
    return select(up, PI - up, x < 0.0);
}

// The angles of a slice, from the line of sight, and the normal's among them.
struct Slice {
    // Across the line of sight, and across the slice, of length 1.
    axis: vec3<f32>,
    beside: vec3<f32>,
    // The normal's part out of the slice.
    lean: f32,
    sin_gamma: f32,
    cos_gamma: f32,
    gamma: f32,
    // The integral of cos(t - gamma) |sin t| over the slice's hemisphere.
    whole: f32,
}

// The share of a slice's hemisphere before a direction, 0 to 1: the same integral up to there.
fn share_before(slice: Slice, to_eye: vec3<f32>, direction: vec3<f32>) -> f32 {
    // Middles of pixels lie beside the slice. They come into it along the surface's own plane, so that a plane never hides itself.
    let normal = vec2(slice.cos_gamma, slice.sin_gamma);
    let raw = vec2(dot(direction, to_eye), dot(direction, slice.axis)) + normal * (dot(direction, slice.beside) * slice.lean);
    let unit = raw * inverseSqrt(max(dot(raw, raw), 1e-30));
    let is_right = unit.y >= 0.0;
    // Below the horizon on either side.
    if dot(unit, normal) <= 0.0 {
        return select(0.0, 1.0, is_right);
    }
    let angle = select(-1.0, 1.0, is_right) * arc_cosine(unit.x);
    let cos_rest = (2.0 * unit.x * unit.x - 1.0) * slice.cos_gamma + 2.0 * unit.x * unit.y * slice.sin_gamma;
    let from_sight = ((slice.cos_gamma - cos_rest) * 0.25 + angle * 0.5 * slice.sin_gamma) * select(-1.0, 1.0, is_right);
    let from_horizon = 0.5 * (slice.cos_gamma + (slice.gamma - 0.5 * PI) * slice.sin_gamma);
    return saturate((from_sight + from_horizon) / slice.whole);
}

// Bits from one number to before another, of 0 to 32.
fn bits_between(first: u32, end: u32) -> u32 {
    if end <= first {
        return 0u;
    }
    return (0xffffffffu >> (32u - (end - first))) << first;
}

// The share of light that the slices leave: the first sample that hides a sector is taken to be the nearest there.
fn sliced(point: Point) -> f32 {
    var open = 0.0;
    var whole = 0.0;
    for (var i = 0u; i < SLICES; i++) {
        let angle = PI * (f32(i) + point.turn) / f32(SLICES);
        let axis = point.right * cos(angle) + point.down * sin(angle);
        let metre = seen_as(axis, point.place);
        let scale = length(metre);
        let towards = metre / scale;
        let projected = vec2(dot(point.normal, point.to_eye), dot(point.normal, axis));
        let weight = max(length(projected), 1e-4);
        let beside = cross(axis, point.to_eye);
        let lean = dot(point.normal, beside) / weight;
        let gamma = atan2(projected.y, projected.x);
        var slice = Slice(axis, beside, lean, projected.y / weight, projected.x / weight, gamma, 0.0);
        slice.whole = slice.cos_gamma + gamma * slice.sin_gamma;
        var covered = 0u;
        var hides = 0.0;
        for (var side = -1.0; side < 2.0; side += 2.0) {
            for (var j = 0u; j < STEPS; j++) {
                // More of them nearby, and none at the pixel itself.
                let part = (f32(j) + point.step) / f32(STEPS);
                let pixels = max(part * part * RADIUS * scale, f32(j + 1u));
                let at = point.pixel + towards * (side * pixels);
                if !is_inside(at) {
                    continue;
                }
                let depth = textureLoad(stored_depth, vec2<i32>(at), 0);
                if depth <= 0.0 {
                    continue;
                }
                let front = position_at(floor(at) + 0.5, depth) - point.place;
                let share = 1.0 - dot(front, front) / (RADIUS * RADIUS);
                if share <= 0.0 {
                    continue;
                }
                let back = front - point.to_eye * (THICKNESS * RADIUS);
                let first = share_before(slice, point.to_eye, front);
                let last = share_before(slice, point.to_eye, back);
                let sectors = vec2<u32>(vec2(min(first, last), max(first, last)) * SECTORS + 0.5);
                let own = bits_between(sectors.x, sectors.y);
                hides += share * f32(countOneBits(own & ~covered));
                covered |= own;
            }
        }
        open += weight * slice.whole * (1.0 - hides / SECTORS);
        whole += weight * slice.whole;
    }
    return open / whole;
}

// The share of light that is left, by samples of the half-ball above the surface: each that lies behind something seen is hidden. Something further in front than the
// radius hides less.
fn sampled(point: Point) -> f32 {
    let axes = across(point.normal);
    var hidden = 0.0;
    for (var i = 0u; i < SAMPLES; i++) {
        // Evenly over the half-sphere, as a sunflower's seeds, and most of them nearby.
        let up = 1.0 - (f32(i) + 0.5) / f32(SAMPLES);
        let around = 2.0 * PI * (fract(f32(i) * 0.61803399) + point.turn);
        let part = fract(f32(i) * 0.75487767 + point.step);
        let aside = sqrt(1.0 - up * up);
        let direction = axes[0] * (cos(around) * aside) + axes[1] * (sin(around) * aside) + point.normal * up;
        let step = direction * (RADIUS * (0.1 + 0.9 * part * part));
        let place = point.place + step;
        let distance = dot(place, frame.forward);
        var at = point.pixel + seen_as(step, point.place);
        if !ORTHOGRAPHIC {
            if distance <= 0.0 {
                continue;
            }
            at = point.pixel + seen_as(step, point.place) * (dot(point.place, frame.forward) / distance);
        }
        if !is_inside(at) {
            continue;
        }
        let depth = textureLoad(stored_depth, vec2<i32>(at), 0);
        if depth <= 0.0 {
            continue;
        }
        let seen = distance_at(depth);
        if seen < distance - BIAS * RADIUS {
            hidden += smoothstep(0.0, 1.0, RADIUS / abs(dot(point.place, frame.forward) - seen));
        }
    }
    return 1.0 - hidden / f32(SAMPLES);
}

@compute @workgroup_size(8, 8)
fn compute(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(visibility)) {
        return;
    }
    let texel = vec2<i32>(id.xy * SCALE);
    let depth = textureLoad(stored_depth, texel, 0);
    if depth <= 0.0 {
        textureStore(visibility, id.xy, vec4(pack_visibility(1.0, 0.0), 0u, 0u, 0u));
        return;
    }
    var point: Point;
    point.pixel = vec2<f32>(texel) + 0.5;
    point.place = position_at(point.pixel, depth);
    point.to_eye = -frame.forward;
    if !ORTHOGRAPHIC {
        point.to_eye = -normalize(point.place);
    }
#ifdef NORMAL_UINT
    let normal = decode_normal_uint(textureLoad(stored_normal, texel, 0).xy);
#else
    let normal = decode_normal(textureLoad(stored_normal, texel, 0), NORMAL_ENCODING);
#endif
    point.normal = normalize(normal + point.to_eye * max(LEAST_FACING - dot(normal, point.to_eye), 0.0));
    let axes = across(point.to_eye);
    point.right = axes[0];
    point.down = axes[1];
    let number = tile_number(id.xy & vec2(3u));
    // A lattice: each sixteenth of a turn has another sixteenth of a step.
    point.turn = fract((f32(number) + 0.5) / 16.0 + frame.jitter.y);
    point.step = fract((f32((number * 5u) & 15u) + 0.5) / 16.0 + frame.jitter.x);
    var open = 1.0;
    if SLICED {
        open = sliced(point);
    } else {
        open = sampled(point);
    }
    textureStore(visibility, id.xy, vec4(pack_visibility(open, depth), 0u, 0u, 0u));
}
