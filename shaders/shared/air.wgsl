// The fog of a frame, as a part of the frame's uniform data. All numbers are 0 in a frame without fog.
#define_import_path afterlight::air

struct Air {
    // The mean radiance of light from everywhere, times the albedo.
    light: vec3<f32>,
    // The logarithm of the loss along a metre at the base.
    density: f32,
    albedo: f32,
    // The mean cosine of the angle of scattering.
    anisotropy: f32,
    // Slices of froxels begin at near (exp(span i / n) - 1).
    near: f32,
    span: f32,
    // The camera's height above the base in scale heights, and scale heights in a metre.
    rise: f32,
    rate: f32,
}
