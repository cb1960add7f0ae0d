// Tints of shadows. A second map beside each shadow map holds the share of light that transparent surfaces let through, and the nearness to the light
// of the nearest one. All tints of a texel are multiplied into one colour, so a point between two transparent surfaces gets the tint of both.
#define_import_path afterlight::tints

// The half floats above zero, in their order: nearness is an integer among them, so that the largest of two halves is the nearer of two surfaces, to 1 part in 30000.
const FIRST: f32 = 1024.0;
const STEPS: f32 = 30000.0;

// A map's depth as an integer's value, from FIRST for the farthest. Perspective depth spans many powers of two, and its logarithm is stored.
fn nearness(depth: f32, perspective: bool) -> f32 {
    // Down to 2^-40: a lamp a hundred thousand times as far away as the scene is large.
    let even = select(depth, 1.0 + log2(max(depth, 9.1e-13)) / 40.0, perspective);
    return FIRST + saturate(even) * STEPS;
}

fn to_half(nearness: f32) -> f32 {
    return unpack2x16float(u32(nearness)).x;
}

// The inverse of `nearness`.
fn depth_of(nearness: f32, perspective: bool) -> f32 {
    let even = (nearness - FIRST) / STEPS;
    return select(even, exp2((even - 1.0) * 40.0), perspective);
}

// Returns 0 if no transparent surface was stored.
fn from_half(stored: f32) -> f32 {
    return f32(pack2x16float(vec2(stored, 0.0)) & 0xffffu);
}
