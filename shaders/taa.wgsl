// TAA: the mean of this frame and of the frames before it, over the same surfaces.
// variants: VELOCITY
// counts: 2; with VELOCITY 1
#import afterlight::history::{averaged, COUNT, distance_of, History, light_of, mean_of, most, MOVING, packed}

struct Push {
    // The map from a pixel of this frame, its place and its depth (x, y, depth, 1), to the same in the frame before, less the identity.
    moved: mat4x4<f32>,
    // The place in each pixel that this frame looks through, in pixels from its centre.
    jitter: vec2<f32>,
    // The nearest distance of a depth, and metres from an orthographic depth of 1 to one of 0: of this frame, and of the one before.
    depths: vec2<f32>,
    depths_before: vec2<f32>,
    flags: u32,
    // Ratio of this frame's exposure to the previous frame's.
    exposed: f32,
}

var<immediate> push: Push;

// There is a frame before.
const FOLLOWS: u32 = 1u; // host
// Nothing has changed since: no camera, no surface, no light.
const STILL: u32 = 2u; // host
// The camera is another.
const LOOKS_ELSEWHERE: u32 = 4u; // host

// Maximum number of frames averaged where nothing changes.
override MOST_FRAMES: u32 = 64u;
// Maximum number of frames where something changes: for a surface that has stayed in its pixel; for one that has moved, whose history has been
// filtered as often; and for the pixels around a moved one, whose history shows another background.
const MOST_STAYED: u32 = 16u;
const MOST_MOVED: u32 = 6u;
const MOST_BESIDE: u32 = 3u;
// Pixels by which a surface may move and still count as one that has stayed.
const STAYED: f32 = 0.02;
// Pictures show vectors: as values, or as colours.
override SHOWN: u32 = 0u;
override ORTHOGRAPHIC: bool = false;

// Greatest distance of the history from the mean of the neighbouring pixels, in their standard deviations (M. Salvi, "An Excursion in Temporal
// Supersampling", 2016).
const SPREAD: f32 = 1.0;
// A surface nearer than this share of the distance hid the one that is looked for.
const HID: f32 = 0.95;
// The distance of the sky, in metres.
const FARTHEST: f32 = 1e30;
// The length in pixels at which a vector's colour is half as bright as it can be.
const HALF_BRIGHT: f32 = 4.0;

@group(0) @binding(0) var<storage, read> before: History;
@group(0) @binding(1) var<storage, read_write> after: History;
@group(0) @binding(2) var light: texture_2d<f32>;
@group(0) @binding(3) var depth: texture_depth_2d;
#ifdef VELOCITY
@group(0) @binding(4) var velocity: texture_2d<f32>;
#endif

// The place of a surface in the frame before.
struct Motion {
    // Pixels to the right and down that the surface has moved since the previous frame.
    vector: vec2<f32>,
    // Distance from the eye in the previous frame. 0 or less if it was beside or behind the view.
    distance: f32,
    // The surface itself moves, not only the camera.
    moving: bool,
}

fn distance_at(depth: f32, depths: vec2<f32>) -> f32 {
    if ORTHOGRAPHIC {
        return depths.x + (1.0 - depth) * depths.y;
    }
    return select(min(depths.x / max(depth, 1e-30), FARTHEST), FARTHEST, depth <= 0.0);
}

fn motion_at(pixel: vec2<i32>) -> Motion {
    let own = textureLoad(depth, pixel, 0);
    let away = distance_at(own, push.depths);
#ifdef VELOCITY
    let vector = textureLoad(velocity, pixel, 0);
    if vector.a > 0.0 {
        return Motion(vector.rg, away * vector.b, true);
    }
#endif
    let place = vec2<f32>(pixel) + 0.5 + push.jitter;
    let change = push.moved * vec4(place, own, 1.0);
    let w = 1.0 + change.w;
    if w <= 1e-6 {
        return Motion(vec2(0.0), 0.0, false);
    }
    let come = (place * change.w - change.xy) / w;
    if ORTHOGRAPHIC {
        return Motion(come, distance_at(own + change.z, push.depths_before), false);
    }
    return Motion(come, select(away * w, FARTHEST, own <= 0.0), false);
}

fn to_ycocg(c: vec3<f32>) -> vec3<f32> {
    return vec3(0.25 * c.r + 0.5 * c.g + 0.25 * c.b, 0.5 * c.r - 0.5 * c.b, -0.25 * c.r + 0.5 * c.g - 0.25 * c.b);
}

fn from_ycocg(c: vec3<f32>) -> vec3<f32> {
    let t = c.x - c.z;
    return vec3(t + c.y, c.x + c.z, t - c.y);
}

// The neighbourhood of a pixel in this frame: where the nearest surface is, and the colours around it.
struct Around {
    nearest: vec2<i32>,
    mean: vec3<f32>,
    deviation: vec3<f32>,
}

fn seen(pixel: vec2<i32>) -> vec3<f32> {
    return averaged(textureLoad(light, pixel, 0).rgb);
}

fn look_around(pixel: vec2<i32>, size: vec2<i32>) -> Around {
    var nearest = pixel;
    var greatest = -1.0;
    var sum = vec3(0.0);
    var squares = vec3(0.0);
    for (var down = -1; down <= 1; down++) {
        for (var right = -1; right <= 1; right++) {
            let at = clamp(pixel + vec2(right, down), vec2(0), size - 1);
            let color = to_ycocg(seen(at));
            sum += color;
            squares += color * color;
            let own = textureLoad(depth, at, 0);
            if own > greatest {
                greatest = own;
                nearest = at;
            }
        }
    }
    let mean = sum / 9.0;
    return Around(nearest, mean, sqrt(max(squares / 9.0 - mean * mean, vec3(0.0))));
}

fn texel(at: vec2<i32>, size: vec2<i32>) -> vec4<u32> {
    let inside = clamp(at, vec2(0), size - 1);
    return before.texels[u32(inside.y * size.x + inside.x)];
}

// Catmull and Rom, "A class of local interpolating splines", 1974: of four texels in a row, at a share of the way from the second to the third.
fn weights(t: f32) -> vec4<f32> {
    let a = t * (-0.5 + t * (1.0 - 0.5 * t));
    let b = 1.0 + t * t * (-2.5 + 1.5 * t);
    let c = t * (0.5 + t * (2.0 - 1.5 * t));
    return vec4(a, b, c, t * t * (-0.5 + 0.5 * t));
}

// The history at a place.
struct Seen {
    mean: vec3<f32>,
    count: f32,
    // The greatest of four texels.
    distance: f32,
    moving: bool,
}

fn seen_before(place: vec2<f32>, size: vec2<i32>) -> Seen {
    let corner = floor(place - 0.5);
    let share = place - 0.5 - corner;
    let x = weights(share.x);
    let y = weights(share.y);
    let first = vec2<i32>(corner) - 1;
    var own = Seen(vec3(0.0), 0.0, 0.0, false);
    for (var down = 0; down < 4; down++) {
        for (var right = 0; right < 4; right++) {
            let found = texel(first + vec2(right, down), size);
            own.mean += x[right] * y[down] * mean_of(found);
            if right == 1 || right == 2 {
                if down == 1 || down == 2 {
                    let weight = select(1.0 - share.x, share.x, right == 2) * select(1.0 - share.y, share.y, down == 2);
                    own.count += weight * f32(found.a & COUNT);
                    own.distance = max(own.distance, distance_of(found));
                    own.moving = own.moving || (found.a & MOVING) != 0u;
                }
            }
        }
    }
    own.mean = clamp(own.mean, vec3(0.0), vec3(most()));
    return own;
}

// The history as this frame is exposed.
fn exposed(mean: vec3<f32>) -> vec3<f32> {
    if push.exposed == 1.0 {
        return mean;
    }
    return averaged(light_of(mean) * push.exposed);
}

// Clips a colour towards the mean of its neighbourhood, just far enough to resemble the neighbourhood.
// ANCHOR: clip-history
fn clipped(color: vec3<f32>, around: Around) -> vec3<f32> {
    let offset = to_ycocg(color) - around.mean;
    let reach = SPREAD * around.deviation;
    let times = abs(offset) / max(reach, vec3(1e-20));
    let most_times = max(max(times.x, times.y), times.z);
    return max(from_ycocg(around.mean + offset / max(most_times, 1.0)), vec3(0.0));
}
// ANCHOR_END: clip-history

// Colours of a hue, from 0 to 1 around the circle.
fn hue(turn: f32) -> vec3<f32> {
    return clamp(abs(fract(turn + vec3(0.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, vec3(0.0), vec3(1.0));
}

fn vector_shown(own: Motion) -> vec3<f32> {
    if SHOWN == 1u {
        return vec3(own.vector, select(0.0, 1.0, own.moving));
    }
    let pixels = length(own.vector);
    let turn = select(0.0, atan2(own.vector.y, own.vector.x) / 6.2831853, pixels > 0.0);
    return hue(turn) * (pixels / (pixels + HALF_BRIGHT));
}

@compute @workgroup_size(8, 8)
fn compute(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let extent = textureDimensions(light);
    if all(invocation.xy == vec2(0u)) {
        after.picture = extent;
    }
    if any(invocation.xy >= extent) {
        return;
    }
    let size = vec2<i32>(extent);
    let pixel = vec2<i32>(invocation.xy);
    let at = invocation.y * extent.x + invocation.x;
    let away = distance_at(textureLoad(depth, pixel, 0), push.depths);
    if SHOWN != 0u {
        var vector = vec3(0.0);
        if (push.flags & FOLLOWS) != 0u {
            vector = vector_shown(motion_at(pixel));
        }
        after.texels[at] = packed(vector, away, false, 1u);
        return;
    }
    let now = seen(pixel);
    if (push.flags & FOLLOWS) == 0u {
        after.texels[at] = packed(now, away, false, 1u);
        return;
    }
    if (push.flags & STILL) != 0u {
        // It is the mean, and nothing is filtered or clipped.
        let found = before.texels[at];
        let count = min(found.a & COUNT, MOST_FRAMES - 1u);
        let mean = exposed(mean_of(found));
        after.texels[at] = packed(mean + (now - mean) / f32(count + 1u), away, (found.a & MOVING) != 0u, count + 1u);
        return;
    }
    let around = look_around(pixel, size);
    let motion = motion_at(around.nearest);
    let place = vec2<f32>(pixel) + 0.5 - motion.vector;
    // `!(x > 0)` is also true if the distance is NaN.
    if !(motion.distance > 0.0 && all(place >= vec2(0.0)) && all(place <= vec2<f32>(extent))) {
        after.texels[at] = packed(now, away, motion.moving, 1u);
        return;
    }
    let old = seen_before(place, size);
    // If neither the camera moves nor something that is or was here, nothing comes into view.
    let may_appear = (push.flags & LOOKS_ELSEWHERE) != 0u || old.moving || motion.moving;
    if may_appear && old.distance < HID * motion.distance {
        after.texels[at] = packed(now, away, motion.moving, 1u);
        return;
    }
    let mean = clipped(exposed(old.mean), around);
    var most_frames = MOST_STAYED;
    if length(motion.vector) > STAYED {
        most_frames = MOST_MOVED;
    }
    if motion.moving && !motion_at(pixel).moving {
        most_frames = MOST_BESIDE;
    }
    let count = min(u32(old.count + 0.5), min(MOST_FRAMES, most_frames) - 1u);
    after.texels[at] = packed(mean + (now - mean) / f32(count + 1u), away, motion.moving, count + 1u);
}
