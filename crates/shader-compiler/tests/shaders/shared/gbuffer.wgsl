#define_import_path test::gbuffer

// A G-buffer with an optional target, read in a separate module.
#ifdef NORMALS
@group(0) @binding(1) var subpass_normal: texture_2d<u32>;
#endif
@group(0) @binding(0) var subpass_albedo: texture_2d<f32>;
@group(0) @binding(3) var subpass_depth: texture_depth_2d;

struct Pixel {
    albedo: vec4<f32>,
    normal: vec4<u32>,
    depth: f32,
}

fn read_pixel() -> Pixel {
    var pixel: Pixel;
    pixel.albedo = textureLoad(subpass_albedo, vec2<i32>(0, 0), 0);
#ifdef NORMALS
    pixel.normal = textureLoad(subpass_normal, vec2<i32>(0, 0), 0);
#endif
    pixel.depth = textureLoad(subpass_depth, vec2<i32>(0, 0), 0);
    return pixel;
}
