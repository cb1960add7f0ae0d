#define_import_path test::lights
#import test::gbuffer::Pixel

override LIGHT_MODEL: u32 = 1u;
override SCALE: f32 = 0.5;

struct Light {
    position: vec3<f32>,
    range: f32,
    colour: vec3<f32>,
}

struct Lights {
    count: u32,
    list: array<Light>,
}

fn shade(pixel: Pixel, light: Light) -> vec3<f32> {
    if LIGHT_MODEL == 0u {
        return vec3<f32>(0.0);
    }
    return pixel.albedo.rgb * light.colour * SCALE / max(light.range, 1e-3);
}
