// The G-buffer as the subpasses after GEOMETRY read it: each pixel its own texels, through input attachments.
#define_import_path afterlight::gbuffer
#import afterlight::encodings::{decode_normal, decode_normal_uint, octahedral_decode, from_unorm}
#import afterlight::frame::{frame, view_ray}
#import afterlight::texel::{Texel}

#ifdef STORED
// Compute reads the stored targets as textures. Depth is there in any case: it tells the sky.
@group(1) @binding(0) var stored_depth: texture_depth_2d;
@group(1) @binding(1) var stored_albedo: texture_2d<f32>;
#ifdef NORMAL_UINT
@group(1) @binding(2) var stored_normal: texture_2d<u32>;
#else
@group(1) @binding(2) var stored_normal: texture_2d<f32>;
#endif
#ifdef MATERIAL
@group(1) @binding(3) var stored_material: texture_2d<f32>;
#endif
#ifdef SPECULAR
@group(1) @binding(4) var stored_specular: texture_2d<f32>;
#endif
#ifdef POSITION
@group(1) @binding(5) var stored_position: texture_2d<f32>;
#endif
#else
#ifndef POSITION
@group(1) @binding(0) var subpass_depth: texture_depth_2d;
#endif
@group(1) @binding(1) var subpass_albedo: texture_2d<f32>;
#ifdef NORMAL_UINT
@group(1) @binding(2) var subpass_normal: texture_2d<u32>;
#else
@group(1) @binding(2) var subpass_normal: texture_2d<f32>;
#endif
#ifdef MATERIAL
@group(1) @binding(3) var subpass_material: texture_2d<f32>;
#endif
#ifdef SPECULAR
@group(1) @binding(4) var subpass_specular: texture_2d<f32>;
#endif
#ifdef POSITION
@group(1) @binding(5) var subpass_position: texture_2d<f32>;
#endif
#endif

// The texels of a pixel as they are stored.
struct Stored {
    albedo: vec4<f32>,
#ifdef NORMAL_UINT
    normal: vec2<u32>,
#else
    normal: vec4<f32>,
#endif
    material: vec4<f32>,
    specular: vec4<f32>,
}

#ifdef STORED
fn load_stored(pixel: vec2<f32>) -> Stored {
    let at = vec2<i32>(pixel);
    var stored: Stored;
    stored.albedo = textureLoad(stored_albedo, at, 0);
#ifdef NORMAL_UINT
    stored.normal = textureLoad(stored_normal, at, 0).xy;
#else
    stored.normal = textureLoad(stored_normal, at, 0);
#endif
#ifdef MATERIAL
    stored.material = textureLoad(stored_material, at, 0);
#endif
#ifdef SPECULAR
    stored.specular = textureLoad(stored_specular, at, 0);
#endif
    return stored;
}

#else

fn load_stored(pixel: vec2<f32>) -> Stored {
    var stored: Stored;
    stored.albedo = textureLoad(subpass_albedo, vec2<i32>(0, 0), 0);
#ifdef NORMAL_UINT
    stored.normal = textureLoad(subpass_normal, vec2<i32>(0, 0), 0).xy;
#else
    stored.normal = textureLoad(subpass_normal, vec2<i32>(0, 0), 0);
#endif
#ifdef MATERIAL
    stored.material = textureLoad(subpass_material, vec2<i32>(0, 0), 0);
#endif
#ifdef SPECULAR
    stored.specular = textureLoad(subpass_specular, vec2<i32>(0, 0), 0);
#endif
    return stored;
}
#endif

// Relative to the camera, in metres.
fn load_position(pixel: vec2<f32>) -> vec3<f32> {
#ifdef POSITION
#ifdef STORED
    return textureLoad(stored_position, vec2<i32>(pixel), 0).xyz;
#else
    return textureLoad(subpass_position, vec2<i32>(0, 0), 0).xyz;
#endif
#else
    // Reversed Z with an infinite far plane: depth = near / distance along the view axis.
    return view_ray(pixel) * (frame.near / load_depth(pixel));
#endif
}

// Reversed depth; 0 where there is no surface.
fn load_depth(pixel: vec2<f32>) -> f32 {
#ifdef STORED
    return textureLoad(stored_depth, vec2<i32>(pixel), 0);
#else
#ifdef POSITION
    let along = dot(load_position(pixel), frame.forward);
    return select(0.0, frame.near / along, along > 0.0);
#else
    return textureLoad(subpass_depth, vec2<i32>(0, 0), 0);
#endif
#endif
}

// `geometric_steps`: codes of a channel that holds half of the geometric normal, as GEOMETRY wrote it.
fn load_texel(pixel: vec2<f32>, normal_encoding: u32, geometric_steps: f32) -> Texel {
    let stored = load_stored(pixel);
    var texel: Texel;
    texel.position = load_position(pixel);
    texel.albedo = stored.albedo.rgb;
    texel.occlusion = stored.albedo.a;
#ifdef NORMAL_UINT
    texel.normal = decode_normal_uint(stored.normal);
#else
    texel.normal = decode_normal(stored.normal, normal_encoding);
#endif
    texel.geometric_normal = texel.normal;
    texel.roughness = 1.0;
    texel.receives = true;
#ifdef MATERIAL
    texel.metallic = stored.material.r;
    texel.roughness = stored.material.g;
    // Codes of normals end below 1: a surface that receives no shadow has that instead.
    texel.receives = stored.material.b < (geometric_steps - 0.5) / geometric_steps;
    texel.geometric_normal = octahedral_decode(from_unorm(stored.material.ba, geometric_steps));
#endif
#ifdef SPECULAR
    texel.specular = stored.specular.rgb;
    texel.brdf = u32(round(stored.specular.a * 3.0));
#endif
    return texel;
}
