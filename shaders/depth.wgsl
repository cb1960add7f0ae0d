// DEPTH, the pre-pass: positions only, so that what shades after it meets each visible surface once. The arithmetic of the position is
// that of geometry.wgsl, and precise, so that depths are equal to the bit.
// precise
#import afterlight::frame::{frame}

struct Push {
    // Rows of the map from mesh space to camera-relative world space.
    row_x: vec4<f32>,
    row_y: vec4<f32>,
    row_z: vec4<f32>,
}

var<immediate> push: Push;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    let p = vec4(position, 1.0);
    let world = vec3(dot(push.row_x, p), dot(push.row_y, p), dot(push.row_z, p));
    return frame.clip_from_world * vec4(world, 1.0);
}
