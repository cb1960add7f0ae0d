// The G-buffer as the subpasses after GEOMETRY read it: each pixel its own texels, through input attachments.
#define_import_path afterlight::gbuffer
#import afterlight::encodings::{decode_normal, decode_normal_uint, octahedral_decode, from_unorm}
#import afterlight::frame::{frame, view_ray}
#import afterlight::texel::{Texel}

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

// `geometric_steps`: codes of a channel that holds half of the geometric normal, as GEOMETRY wrote it.
fn load_texel(pixel: vec2<f32>, normal_encoding: u32, geometric_steps: f32) -> Texel {
    var texel: Texel;
#ifdef POSITION
    texel.position = textureLoad(subpass_position, vec2<i32>(0, 0), 0).xyz;
#else
    // Reversed Z with an infinite far plane: depth = near / distance along the view axis.
    let depth = textureLoad(subpass_depth, vec2<i32>(0, 0), 0);
    texel.position = view_ray(pixel) * (frame.near / depth);
#endif
    let albedo = textureLoad(subpass_albedo, vec2<i32>(0, 0), 0);
    texel.albedo = albedo.rgb;
    texel.occlusion = albedo.a;
#ifdef NORMAL_UINT
    texel.normal = decode_normal_uint(textureLoad(subpass_normal, vec2<i32>(0, 0), 0).xy);
#else
    texel.normal = decode_normal(textureLoad(subpass_normal, vec2<i32>(0, 0), 0), normal_encoding);
#endif
    texel.geometric_normal = texel.normal;
    texel.roughness = 1.0;
#ifdef MATERIAL
    let material = textureLoad(subpass_material, vec2<i32>(0, 0), 0);
    texel.metallic = material.r;
    texel.roughness = material.g;
    texel.geometric_normal = octahedral_decode(from_unorm(material.ba, geometric_steps));
#endif
#ifdef SPECULAR
    let specular = textureLoad(subpass_specular, vec2<i32>(0, 0), 0);
    texel.specular = specular.rgb;
    texel.brdf = u32(round(specular.a * 3.0));
#endif
    return texel;
}
