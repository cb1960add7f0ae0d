// The triangle's corners in metres. The camera sees two metres of its plane from top to bottom, and 16/9 as much from left to right.
const CORNERS = array(vec2(-0.5, -0.5), vec2(0.5, -0.5), vec2(0.0, 0.5));

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    // Vulkan's y runs from -1 at the top to 1 at the bottom.
    return vec4(CORNERS[index].x * 9.0 / 16.0, -CORNERS[index].y, 0.5, 1.0);
}

// A matt surface sends albedo / pi of the light that arrives to every side: pi lux at an albedo of 0.5.
@fragment
fn fragment() -> @location(0) vec4<f32> {
    return vec4(0.5, 0.5, 0.5, 1.0);
}
