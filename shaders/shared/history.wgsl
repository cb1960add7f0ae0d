// The values that TAA keeps of a frame for the next one.
#define_import_path afterlight::history

struct History {
    // Width and height of the picture in pixels.
    picture: vec2<u32>,
    unused: vec2<u32>,
    // Row by row: red, green and blue, of which frames are averaged, in single floats, for steps of a 64th of a light and less must not be lost; then a
    // distance, whether the pixel showed something that moves by itself, and of how many frames it is the mean.
    texels: array<vec4<u32>>,
}

// The space in which frames are averaged: light, or about the values as shown, so that light far beyond white has the weight of white. Light of `c`
// then is c / (1 + the largest of c) (B. Karis, "High-quality temporal supersampling", 2014).
override AS_SHOWN: bool = false;
// Light is cut off there.
override LARGEST: f32 = 65000.0;

fn largest_of(color: vec3<f32>) -> f32 {
    return max(max(color.r, color.g), color.b);
}

fn averaged(light: vec3<f32>) -> vec3<f32> {
    let own = clamp(light, vec3(0.0), vec3(LARGEST));
    if AS_SHOWN {
        return own / (1.0 + largest_of(own));
    }
    return own;
}

// The light of a mean.
fn light_of(mean: vec3<f32>) -> vec3<f32> {
    if AS_SHOWN {
        return mean / max(1.0 - largest_of(mean), 1.0 / (1.0 + LARGEST));
    }
    return mean;
}

// The most that a mean can be.
fn most() -> f32 {
    return select(LARGEST, LARGEST / (1.0 + LARGEST), AS_SHOWN);
}

const COUNT: u32 = 0x7ffu;
const MOVING: u32 = 0x800u;
// The upper 20 bits of a positive float: good to 1 / 4096 of it.
const DISTANCE: u32 = 0xfffff000u;

fn packed(mean: vec3<f32>, distance: f32, moving: bool, count: u32) -> vec4<u32> {
    let last = (bitcast<u32>(distance) & DISTANCE) | select(0u, MOVING, moving) | count;
    return vec4(bitcast<vec3<u32>>(mean), last);
}

fn mean_of(texel: vec4<u32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(texel.rgb);
}

fn distance_of(texel: vec4<u32>) -> f32 {
    return bitcast<f32>(texel.a & DISTANCE);
}
