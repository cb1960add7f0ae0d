// The flow of light from a level of BLOOM to the next wider one and back. A texel of level k stands for the square of 2^k x 2^k pixels that it
// covers, the last of a row or column for the part of that in the picture: its mass, 1 for a whole square. Along each axis a wider texel is the mean
// of its two, and across each edge between wider texels the two texels there exchange a quarter of the smaller one's mass. One texel's gain is the
// other's loss, and nothing is exchanged across the picture's edge: no energy is lost or gained anywhere, and even light stays even. Away from edges
// the filter down is 1 3 3 1 (of 8), and up 3 1 (of 4) to either side.
#define_import_path afterlight::bloom

// Of the filter down, along an axis: 2 is the mean alone, 4 exchanges, 6 first has each texel exchange with both its neighbours, and does the same on
// the way up: 1 5 10 10 5 1 (of 32).
override TAPS: u32 = 6u;

// The buffer of the levels.
struct Levels {
    // Width and height of the picture in pixels.
    picture: vec2<u32>,
    // The share of the picture's light that comes from the levels.
    share: f32,
    unused: f32,
    // Level by level from the first, each row by row.
    texels: array<vec4<f32>>,
}

// A row or a column of a level.
struct Axis {
    count: i32,
    // Mass of the last texel.
    last: f32,
}

// Texels of a level across and down.
fn extent_of(size: vec2<u32>, level: u32) -> vec2<u32> {
    return (size + (1u << level) - 1u) >> vec2(level);
}

fn axis_of(size: u32, level: u32) -> Axis {
    let count = (size + (1u << level) - 1u) >> level;
    let whole = (count - 1u) << level;
    return Axis(i32(count), f32(size - whole) / f32(1u << level));
}

// Mass of a texel; 0 beside the picture.
fn mass(axis: Axis, index: i32) -> f32 {
    let inside = select(1.0, axis.last, index == axis.count - 1);
    return select(0.0, inside, index >= 0 && index < axis.count);
}

// The mass that a texel and the one before it exchange.
fn exchanged(axis: Axis, index: i32) -> f32 {
    return 0.25 * min(mass(axis, index - 1), mass(axis, index));
}

// The weights of the texel before, of itself and of the one after it, where each exchanges with its neighbours.
fn smoothed(axis: Axis, index: i32) -> vec3<f32> {
    // Beside the picture there is nothing to take.
    let own = max(mass(axis, index), 1e-6);
    let before = exchanged(axis, index) / own;
    let after = exchanged(axis, index + 1) / own;
    return vec3(before, 1.0 - before - after, after);
}

// A wider texel's weights of the six from two before its own two on: three and three.
struct Down {
    left: vec3<f32>,
    right: vec3<f32>,
}

fn down(axis: Axis, index: i32) -> Down {
    let first = 2 * index;
    let masses = vec2(mass(axis, first), mass(axis, first + 1));
    var crossing = vec2(0.0);
    if TAPS > 2u {
        crossing = vec2(exchanged(axis, first), exchanged(axis, first + 2));
    }
    // Weights of four texels: the one before the texel's own two, these two, and the one after them.
    let four = vec4(crossing.x, masses - crossing, crossing.y) / (masses.x + masses.y);
    if TAPS <= 4u {
        return Down(vec3(0.0, four.xy), vec3(four.zw, 0.0));
    }
    let a = smoothed(axis, first - 1) * four.x;
    let b = smoothed(axis, first) * four.y;
    let c = smoothed(axis, first + 1) * four.z;
    let d = smoothed(axis, first + 2) * four.w;
    return Down(vec3(a.x, a.y + b.x, a.z + b.y + c.x), vec3(b.z + c.y + d.x, c.z + d.y, d.z));
}

// A texel's weights of three wider ones, the one before that at `middle`, this one, and the one after it: each way back is the way down, by masses.
fn up_about(axis: Axis, index: i32, middle: i32) -> vec3<f32> {
    let odd = index & 1;
    let crossing = exchanged(axis, index + odd) / max(mass(axis, index), 1e-6);
    let own = (index >> 1u) - middle + 1;
    let other = own + select(-1, 1, odd == 1);
    var taken = vec3(0.0);
    for (var at = 0; at < 3; at++) {
        taken[at] = select(0.0, 1.0 - crossing, at == own) + select(0.0, crossing, at == other);
    }
    return taken;
}

fn up(axis: Axis, index: i32) -> vec3<f32> {
    let middle = index >> 1u;
    if TAPS <= 4u {
        return up_about(axis, index, middle);
    }
    let share = smoothed(axis, index);
    return share.x * up_about(axis, index - 1, middle) + share.y * up_about(axis, index, middle)
        + share.z * up_about(axis, index + 1, middle);
}
