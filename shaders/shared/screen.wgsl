// A picture's worth of fragments.
#define_import_path afterlight::screen

// The corners of one triangle that covers the screen. It lies at depth 0, where the sky is.
fn screen_corner(index: u32) -> vec4<f32> {
    let x = f32(index & 1u) * 4.0 - 1.0;
    let y = f32(index >> 1u) * 4.0 - 1.0;
    return vec4(x, y, 0.0, 1.0);
}
