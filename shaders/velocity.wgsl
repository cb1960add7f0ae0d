// VELOCITY: screen-space motion, since the previous frame, of surfaces that move by themselves. The position uses the arithmetic of geometry.wgsl,
// and is precise, so that the depth test for equality draws visible surfaces only. The same test makes mask lookups unnecessary.
// variants: DEFORMED STROKES
// precise
// counts: 4; with DEFORMED 2, STROKES 2
#import afterlight::frame::{frame}
#ifdef STROKES
#import afterlight::instance::{Rows}
#import afterlight::strokes::{stroke_corner}
#endif

struct Push {
    // Rows of the map from mesh space to the frame before, without its jitter: pixels to the right and down times w, and w.
    before_x: vec4<f32>,
    before_y: vec4<f32>,
    before_w: vec4<f32>,
    // And to the distance along the view, in each of the two.
    distance: vec4<f32>,
    distance_before: vec4<f32>,
}

var<immediate> push: Push;

struct Vertex {
    @location(0) position: vec3<f32>,
    // Rows of the instance's map from mesh space to the world around the camera.
    @location(8) row_x: vec4<f32>,
    @location(9) row_y: vec4<f32>,
    @location(10) row_z: vec4<f32>,
#ifdef DEFORMED
    // The vertex in the pose before.
    @location(14) position_before: vec3<f32>,
#endif
#ifdef STROKES
    // The position of a stroke's other end.
    @location(6) other_end: vec3<f32>,
    @builtin(vertex_index) own: u32,
#endif
}

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) before: vec3<f32>,
    @location(1) distances: vec2<f32>,
}

@vertex
fn vertex(in: Vertex) -> Varying {
    var p = vec4(in.position, 1.0);
    let world = vec3(dot(in.row_x, p), dot(in.row_y, p), dot(in.row_z, p));
    var position = frame.clip_from_world * vec4(world, 1.0);
#ifdef DEFORMED
    var q = vec4(in.position_before, 1.0);
#else
    var q = p;
#endif
#ifdef STROKES
    let corner = stroke_corner(position, Rows(in.row_x, in.row_y, in.row_z), in.position, in.other_end, in.own);
    position = corner.position;
    // An end that was moved before the camera moves as it did.
    let moved = vec4((in.other_end - in.position) * corner.share, 0.0);
    p += moved;
    q += moved;
#endif
    var before = vec3(dot(push.before_x, q), dot(push.before_y, q), dot(push.before_w, q));
#ifdef STROKES
    before += vec3(corner.offset * before.z, 0.0);
#endif
    return Varying(
        position,
        before,
        vec2(dot(push.distance, p), dot(push.distance_before, q)),
    );
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    // It was behind the eye, which no distance below 0 says.
    if in.before.z <= 0.0 {
        return vec4(0.0, 0.0, -1.0, 1.0);
    }
    let come = in.position.xy + frame.jitter - in.before.xy / in.before.z;
    return vec4(clamp(come, vec2(-60000.0), vec2(60000.0)), clamp(in.distances.y / in.distances.x, 0.0, 60000.0), 1.0);
}
