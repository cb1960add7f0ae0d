// A point of a surface as every kind of shading takes it, from the G-buffer or straight from a material.
#define_import_path afterlight::texel

struct Texel {
    // Relative to the camera, in metres.
    position: vec3<f32>,
    // From the eye through the middle of the pixel, of any length. The place says the same, but where it is interpolated over a large triangle
    // it has the rounding of the triangle's corners, which from close by is another direction.
    ray: vec3<f32>,
    normal: vec3<f32>,
    geometric_normal: vec3<f32>,
    albedo: vec3<f32>,
    occlusion: f32,
    metallic: f32,
    // Perceptual roughness, or the encoded shininess of a Phong model.
    roughness: f32,
    specular: vec3<f32>,
    // Index of the BRDF, where the scene mixes them.
    brdf: u32,
    // Whether shadows fall on it.
    receives: bool,
}
