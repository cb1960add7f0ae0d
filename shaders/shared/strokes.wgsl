// Points and lines on the picture: each stroke of a mesh (crates/scene/src/mesh/strokes.rs) is a rectangle one pixel wide, which reaches half a pixel beyond
// both ends. Its corners have depth and values of the end that they belong to.
#define_import_path afterlight::strokes
#import afterlight::frame::{frame}
#import afterlight::instance::{Rows}

// Vertices of a stroke; the first vertex of each mesh of strokes is a multiple of it.
const STROKE_VERTICES: u32 = 6u; // host
// A line whose direction across the picture is smaller, as a share of its length, is seen end on: a point.
const END_ON: f32 = 1e-6;

// The place in clip space of a corner, whose end is at `end`. Its other end is `other - own` away in mesh space.
//
// The offset is times w, so the corners of both ends lie on straight lines in clip space, and the device clips a stroke that crosses the camera's plane as
// it clips any triangle.
fn stroke_corner(end: vec4<f32>, rows: Rows, own: vec3<f32>, other: vec3<f32>, vertex: u32) -> vec4<f32> {
    let corner = vertex % STROKE_VERTICES;
    let is_first = corner == 0u || corner == 3u;
    let away = other - own;
    let world = vec3(dot(rows.x.xyz, away), dot(rows.y.xyz, away), dot(rows.z.xyz, away));
    let step = unit_size((frame.clip_from_world * vec4(world, 0.0)).xyw);
    let here = unit_size(end.xyw);
    // The derivative of x / w and y / w along the line, times w squared: its direction on the picture, wherever on the line, and on which side of the camera.
    let derivative = step.xy * here.z - here.xy * step.z;
    let pixel = vec2(frame.pixel_width, frame.pixel_height);
    var along = vec2(1.0, 0.0);
    if max(abs(derivative.x), abs(derivative.y)) > END_ON {
        // Towards the second end, from both.
        along = normalize(derivative / pixel) * select(-1.0, 1.0, is_first);
    }
    let across = vec2(-along.y, along.x);
    let offset = along * select(0.5, -0.5, is_first) + across * select(-0.5, 0.5, corner < 2u);
    return end + vec4(offset * pixel * end.w, 0.0, 0.0);
}

// Scaled so that products of two neither overflow nor vanish.
fn unit_size(v: vec3<f32>) -> vec3<f32> {
    return v / max(max(abs(v.x), abs(v.y)), max(abs(v.z), 1e-37));
}
