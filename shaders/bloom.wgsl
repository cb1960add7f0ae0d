// BLOOM: a step of the way down to wider levels of light, or of the way up, on which each level is mixed with the light of the wider ones.
// variants: FIRST UP MSAA
// excludes: FIRST UP
// requires: MSAA -> FIRST
// counts: 4; with FIRST 2, UP 1, MSAA 1
#import afterlight::bloom::{axis_of, down, extent_of, up, Levels, TAPS}

// Light is cut off at that before it is blurred, as TONEMAP cuts off its own.
override LARGEST: f32 = 65000.0;

struct Push {
    // Width and height of the picture in pixels.
    picture: vec2<u32>,
    // The finer of the two levels; 0 is the picture.
    level: u32,
    // The index of its first texel, and of the wider level's.
    finer_at: u32,
    wider_at: u32,
    // The share of the finer level's light that comes from the wider ones.
    share: f32,
}

var<immediate> push: Push;

@group(0) @binding(0) var<storage, read_write> levels: Levels;
#ifdef FIRST
#ifdef MSAA
@group(0) @binding(1) var picture: texture_multisampled_2d<f32>;
#else
@group(0) @binding(1) var picture: texture_2d<f32>;
#endif
#endif

#ifdef UP
fn wider(place: vec2<i32>, extent: vec2<i32>) -> vec4<f32> {
    let at = clamp(place, vec2(0), extent - 1);
    return levels.texels[push.wider_at + u32(at.y * extent.x + at.x)];
}
#else
// The finer level's texel at a place, or the nearest to one outside of it.
fn finer(place: vec2<i32>, extent: vec2<i32>) -> vec4<f32> {
    let at = clamp(place, vec2(0), extent - 1);
#ifdef FIRST
#ifdef MSAA
    var sum = vec4(0.0);
    let count = textureNumSamples(picture);
    for (var index = 0u; index < count; index++) {
        sum += min(textureLoad(picture, at, index), vec4(LARGEST));
    }
    return sum / f32(count);
#else
    return min(textureLoad(picture, at, 0), vec4(LARGEST));
#endif
#else
    return levels.texels[push.finer_at + u32(at.y * extent.x + at.x)];
#endif
}

fn row(place: vec2<i32>, extent: vec2<i32>, left: vec3<f32>, right: vec3<f32>) -> vec4<f32> {
    var sum = left.z * finer(place, extent) + right.x * finer(place + vec2(1, 0), extent);
    if TAPS > 2u {
        sum += left.y * finer(place - vec2(1, 0), extent) + right.y * finer(place + vec2(2, 0), extent);
    }
    if TAPS > 4u {
        sum += left.x * finer(place - vec2(2, 0), extent) + right.z * finer(place + vec2(3, 0), extent);
    }
    return sum;
}
#endif

@compute @workgroup_size(8, 8)
fn compute(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let finer_extent = extent_of(push.picture, push.level);
    let wider_extent = extent_of(push.picture, push.level + 1u);
    let across = axis_of(push.picture.x, push.level);
    let along = axis_of(push.picture.y, push.level);
    let place = vec2<i32>(invocation.xy);
#ifdef UP
    if any(invocation.xy >= finer_extent) {
        return;
    }
    let x = up(across, place.x);
    let y = up(along, place.y);
    let extent = vec2<i32>(wider_extent);
    var spread = vec4(0.0);
    for (var step = 0; step < 3; step++) {
        let first = place / 2 + vec2(-1, step - 1);
        spread += y[step] * (x.x * wider(first, extent) + x.y * wider(first + vec2(1, 0), extent) + x.z * wider(first + vec2(2, 0), extent));
    }
    let at = push.finer_at + invocation.y * finer_extent.x + invocation.x;
    levels.texels[at] = mix(levels.texels[at], spread, push.share);
#else
#ifdef FIRST
    if all(invocation.xy == vec2(0u)) {
        levels.picture = push.picture;
        levels.share = push.share;
    }
#endif
    if any(invocation.xy >= wider_extent) {
        return;
    }
    let x = down(across, place.x);
    let y = down(along, place.y);
    let extent = vec2<i32>(finer_extent);
    let first = 2 * place;
    var sum = y.left.z * row(first, extent, x.left, x.right) + y.right.x * row(first + vec2(0, 1), extent, x.left, x.right);
    if TAPS > 2u {
        sum += y.left.y * row(first - vec2(0, 1), extent, x.left, x.right) + y.right.y * row(first + vec2(0, 2), extent, x.left, x.right);
    }
    if TAPS > 4u {
        sum += y.left.x * row(first - vec2(0, 2), extent, x.left, x.right) + y.right.z * row(first + vec2(0, 3), extent, x.left, x.right);
    }
    levels.texels[push.wider_at + invocation.y * wider_extent.x + invocation.x] = sum;
#endif
}
