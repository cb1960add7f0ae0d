// SHARPEN: TAA's mean, back into the light, with its edges sharpened.
// counts: 1
#import afterlight::screen::{screen_corner}
#import afterlight::history::{History, light_of, mean_of}

// The share of a pixel's difference from its neighbours that is added.
override SHARPNESS: f32 = 0.0;
// Vectors and not light.
override SHOWN: bool = false;

@group(0) @binding(0) var<storage, read> history: History;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

fn mean_at(pixel: vec2<i32>) -> vec3<f32> {
    let size = vec2<i32>(history.picture);
    let at = clamp(pixel, vec2(0), size - 1);
    return mean_of(history.texels[u32(at.y * size.x + at.x)]);
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
    let own = mean_at(pixel);
    if SHOWN {
        return vec4(own, 1.0);
    }
    if SHARPNESS <= 0.0 {
        return vec4(light_of(own), 1.0);
    }
    let left = mean_at(pixel - vec2(1, 0));
    let right = mean_at(pixel + vec2(1, 0));
    let above = mean_at(pixel - vec2(0, 1));
    let below = mean_at(pixel + vec2(0, 1));
    let sharper = own + SHARPNESS * (own - 0.25 * (left + right + above + below));
    // Edges become steeper, but no pixel becomes brighter or darker than its brightest or darkest neighbour.
    let least = min(min(min(left, right), min(above, below)), own);
    let greatest = max(max(max(left, right), max(above, below)), own);
    return vec4(light_of(clamp(sharper, least, greatest)), 1.0);
}
