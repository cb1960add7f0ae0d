// Points and lines on the picture: each stroke of a mesh (crates/scene/src/mesh/strokes.rs) is a rectangle one pixel wide, which reaches half a pixel
// beyond both ends. Each corner has the depth and the values of the end that it belongs to.
#define_import_path afterlight::strokes
#import afterlight::frame::{frame}
#import afterlight::instance::{Rows}

// Vertices of a stroke; the first vertex of each mesh of strokes is a multiple of it.
const STROKE_VERTICES: u32 = 6u; // host
// A line whose direction across the picture is smaller, as a share of its length, is seen end on: a point.
const END_ON: f32 = 1e-6;

struct StrokeCorner {
    // Clip-space position.
    position: vec4<f32>,
    // Share of the line by which the corner was moved from its own end towards the other; 0 unless its end lies before the near plane.
    share: f32,
    // Offset from the line to the corner, in pixels to the right and down.
    offset: vec2<f32>,
}

// The corner of a vertex whose end is at `end` in clip space. The other end is `other - own` away in mesh space.
//
// An end before the near plane is moved onto it along the line. The device could clip a line that crosses the camera's plane, but no rectangle around it: there
// its width would be negative behind the camera, and its two sides would cross.
fn stroke_corner(end: vec4<f32>, rows: Rows, own: vec3<f32>, other: vec3<f32>, vertex: u32) -> StrokeCorner {
    let corner = vertex % STROKE_VERTICES;
    let is_first = corner == 0u || corner == 3u;
    let away = frame.clip_from_world * vec4(world_offset(rows, other - own), 0.0);
    let step = unit_size(away.xyw);
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
    var out = StrokeCorner(end, 0.0, along * select(0.5, -0.5, is_first) + across * select(-0.5, 0.5, corner < 2u));
    // Under orthographic projection w is 1 everywhere.
    if end.w < frame.near && away.w > 0.0 {
        out.share = min((frame.near - end.w) / away.w, 1.0);
        out.position = end + away * out.share;
        if out.share < 1.0 {
            out.position.w = frame.near;
        }
    }
    out.position += vec4(out.offset * pixel * out.position.w, 0.0, 0.0);
    return out;
}

// Offset in the world from a corner's own end to the corner.
fn corner_offset(corner: StrokeCorner, rows: Rows, own: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let beside = frame.ray_x * (corner.offset.x * frame.pixel_width) + frame.ray_y * (corner.offset.y * frame.pixel_height);
    return world_offset(rows, other - own) * corner.share + beside * corner.position.w;
}

// A difference of positions in mesh space, in the world.
fn world_offset(rows: Rows, offset: vec3<f32>) -> vec3<f32> {
    return vec3(dot(rows.x.xyz, offset), dot(rows.y.xyz, offset), dot(rows.z.xyz, offset));
}

// Scaled so that products of two neither overflow nor vanish.
fn unit_size(v: vec3<f32>) -> vec3<f32> {
    return v / max(max(abs(v.x), abs(v.y)), max(abs(v.z), 1e-37));
}
