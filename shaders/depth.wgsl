// DEPTH, the pre-pass: positions only, so that the pass that shades after it shades each visible surface once. Its position arithmetic matches
// geometry.wgsl and is precise, so that depths are equal to the bit.
// precise
// counts: 1
#import afterlight::frame::{frame}

struct Vertex {
    @location(0) position: vec3<f32>,
    // Rows of the instance's map from mesh space to the world around the camera.
    @location(8) row_x: vec4<f32>,
    @location(9) row_y: vec4<f32>,
    @location(10) row_z: vec4<f32>,
}

@vertex
fn vertex(in: Vertex) -> @builtin(position) vec4<f32> {
    let p = vec4(in.position, 1.0);
    let world = vec3(dot(in.row_x, p), dot(in.row_y, p), dot(in.row_z, p));
    return frame.clip_from_world * vec4(world, 1.0);
}
