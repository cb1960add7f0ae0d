// FXAA: smooths the edges of a finished picture, by its brightness alone. After Timothy Lottes, "FXAA" (NVIDIA, 2009; version 3.11, 2011): where
// neighbours differ, it finds the direction of the edge and searches along it for both ends. The pixel then moves towards its neighbour across the
// edge by the share of the pixel that a straight edge between these ends covers.
// counts: 1
#import afterlight::screen::{screen_corner}

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var linear_sampler: sampler;

// Contrast that counts as an edge: of the brightest neighbour, and at least (in dark places). "High quality" of the original.
const CONTRAST: f32 = 0.125;
const LEAST_CONTRAST: f32 = 0.0312;
// The share of single bright or dark pixels that is taken away, 0 to 1.
const SUBPIXEL: f32 = 0.75;
const SEARCH_STEPS: u32 = 12u;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

// About the eye's impression: the square root of luminance (Rec. 709).
fn brightness(color: vec3<f32>) -> f32 {
    return sqrt(dot(color, vec3(0.2126, 0.7152, 0.0722)));
}

// Beyond the border lies the border.
fn load(pixel: vec2<i32>) -> vec3<f32> {
    let last = vec2<i32>(textureDimensions(picture)) - 1;
    return textureLoad(picture, clamp(pixel, vec2(0), last), 0).rgb;
}

// Pixels from one step of the search to the next: the further away, the coarser.
fn step_length(step: u32) -> f32 {
    if step < 5u {
        return 1.0;
    }
    if step < 6u {
        return 1.5;
    }
    return select(select(8.0, 4.0, step < 11u), 2.0, step < 10u);
}

// One end of an edge: its distance, and the brightness there less the edge's brightness.
struct End {
    distance: f32,
    difference: f32,
}

fn search(start: vec2<f32>, along: vec2<f32>, edge: f32, threshold: f32) -> End {
    var end = End(0.0, 0.0);
    let texel = 1.0 / vec2<f32>(textureDimensions(picture));
    for (var step = 0u; step < SEARCH_STEPS; step++) {
        end.distance += step_length(step);
        let uv = (start + along * end.distance) * texel;
        end.difference = brightness(textureSampleLevel(picture, linear_sampler, uv, 0.0).rgb) - edge;
        if abs(end.difference) >= threshold {
            break;
        }
    }
    return end;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
    let color = load(pixel);
    let middle = brightness(color);
    let north = brightness(load(pixel + vec2(0, -1)));
    let south = brightness(load(pixel + vec2(0, 1)));
    let west = brightness(load(pixel + vec2(-1, 0)));
    let east = brightness(load(pixel + vec2(1, 0)));
    let brightest = max(middle, max(max(north, south), max(west, east)));
    let darkest = min(middle, min(min(north, south), min(west, east)));
    let range = brightest - darkest;
    if range < max(LEAST_CONTRAST, brightest * CONTRAST) {
        return vec4(color, 1.0);
    }

    let north_west = brightness(load(pixel + vec2(-1, -1)));
    let north_east = brightness(load(pixel + vec2(1, -1)));
    let south_west = brightness(load(pixel + vec2(-1, 1)));
    let south_east = brightness(load(pixel + vec2(1, 1)));
    // Second differences across either direction: the larger one is across the edge.
    let across_rows = abs(north_west + south_west - 2.0 * west) + 2.0 * abs(north + south - 2.0 * middle)
        + abs(north_east + south_east - 2.0 * east);
    let across_columns = abs(north_west + north_east - 2.0 * north) + 2.0 * abs(west + east - 2.0 * middle)
        + abs(south_west + south_east - 2.0 * south);
    let horizontal = across_rows >= across_columns;

    // The neighbour beyond the edge, and the brightness half way to it.
    let before = select(west, north, horizontal);
    let after = select(east, south, horizontal);
    let towards_before = abs(before - middle) >= abs(after - middle);
    let gradient = max(abs(before - middle), abs(after - middle));
    let edge = 0.5 * (middle + select(after, before, towards_before));
    let sign = select(1.0, -1.0, towards_before);
    let across = select(vec2(sign, 0.0), vec2(0.0, sign), horizontal);
    let along = select(vec2(0.0, 1.0), vec2(1.0, 0.0), horizontal);

    let start = position.xy + 0.5 * across;
    let back = search(start, -along, edge, 0.25 * gradient);
    let ahead = search(start, along, edge, 0.25 * gradient);
    let back_is_near = back.distance < ahead.distance;
    let near_difference = select(ahead.difference, back.difference, back_is_near);
    // At the near end the edge bends to the one side or the other: only the pixels on the side that it leaves are covered in part.
    let covered = (near_difference < 0.0) != (middle < edge);
    let near_distance = min(back.distance, ahead.distance);
    let edge_shift = select(0.0, 0.5 - near_distance / (back.distance + ahead.distance), covered);

    // Details smaller than a pixel: by how much it stands out from the mean of its neighbours.
    let mean = (2.0 * (north + south + west + east) + north_west + north_east + south_west + south_east) / 12.0;
    let detail = smoothstep(0.0, 1.0, abs(mean - middle) / range);
    let shift = max(edge_shift, detail * detail * SUBPIXEL);
    let uv = (position.xy + shift * across) / vec2<f32>(textureDimensions(picture));
    return vec4(textureSampleLevel(picture, linear_sampler, uv, 0.0).rgb, 1.0);
}
