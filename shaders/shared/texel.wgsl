// A point of a surface as every kind of shading takes it, from the G-buffer or straight from a material.
#define_import_path afterlight::texel
#import afterlight::brdf::{Dielectric}

struct Texel {
    // Relative to the camera, in metres.
    position: vec3<f32>,
    // View ray from the eye through the middle of the pixel, of any length. The position has the same direction, but when interpolated over a large
    // triangle it carries the rounding of the triangle's corners, which from close by changes the direction.
    ray: vec3<f32>,
    normal: vec3<f32>,
    geometric_normal: vec3<f32>,
    albedo: vec3<f32>,
    occlusion: f32,
    metallic: f32,
    // Perceptual roughness, or the encoded shininess of a Phong model.
    roughness: f32,
    // Ks of the Phong models.
    specular: vec3<f32>,
    // The reflectances of Cook-Torrance's share that is no metal.
    dielectric: Dielectric,
    // Index of the BRDF, where the scene mixes them.
    brdf: u32,
    // True if shadows fall on it.
    receives: bool,
}
