// A drawn object and its material: what changes from draw to draw, and what its textures say of a point.
#define_import_path afterlight::material
#import afterlight::vectors::{handedness, scaled_rows, turned_normal, unit_or}

struct Push {
    // Rows of the map from mesh space to camera-relative world space.
    row_x: vec4<f32>,
    row_y: vec4<f32>,
    row_z: vec4<f32>,
    base_color: vec3<f32>,
    alpha: f32,
    // Pre-exposed.
    emissive: vec3<f32>,
    alpha_cutoff: f32,
    specular: vec3<f32>,
    // BRDF's index / 3.
    brdf: f32,
    metallic: f32,
    // Perceptual roughness, or shininess for the Phong models.
    roughness: f32,
    ambient: f32,
    normal_scale: f32,
}

var<immediate> push: Push;

#ifdef TEXTURED
@group(1) @binding(0) var base_color_texture: texture_2d<f32>;
@group(1) @binding(1) var normal_texture: texture_2d<f32>;
@group(1) @binding(2) var metallic_roughness_texture: texture_2d<f32>;
@group(1) @binding(3) var occlusion_texture: texture_2d<f32>;
@group(1) @binding(4) var emissive_texture: texture_2d<f32>;
@group(1) @binding(5) var specular_texture: texture_2d<f32>;
@group(1) @binding(6) var shininess_texture: texture_2d<f32>;
@group(1) @binding(15) var texture_sampler: sampler;
#endif

// Bits of TEXTURES in the passes: which of a material's textures exist. The variables of others are names of one that does, and are never
// sampled. The bit of a slot is that of its binding.
const BASE_COLOR: u32 = 1u;
const METALLIC_ROUGHNESS: u32 = 4u;
const OCCLUSION: u32 = 8u;
const EMISSIVE: u32 = 16u;
const SPECULAR: u32 = 32u;
const SHININESS: u32 = 64u;

// What a material says of a point, in its own terms.
struct Point {
    // Albedo and alpha.
    base: vec4<f32>,
    // Share of the ambient light.
    ambient: f32,
    metallic: f32,
    // Or shininess for the Phong models.
    roughness: f32,
    specular: vec3<f32>,
}

// From mesh space to the world around the camera.
fn world_position(position: vec3<f32>) -> vec3<f32> {
    let p = vec4(position, 1.0);
    return vec3(dot(push.row_x, p), dot(push.row_y, p), dot(push.row_z, p));
}

// From the rows of the transform's linear part.
fn rows() -> mat3x3<f32> {
    return scaled_rows(push.row_x.xyz, push.row_y.xyz, push.row_z.xyz);
}

// Not of unit length.
fn world_normal(normal: vec3<f32>) -> vec3<f32> {
    return turned_normal(rows(), normal);
}

fn world_tangent(tangent: vec4<f32>) -> vec4<f32> {
    let t = tangent.xyz;
    let sign = handedness(rows());
    return vec4(dot(push.row_x.xyz, t), dot(push.row_y.xyz, t), dot(push.row_z.xyz, t), tangent.w * sign);
}

#ifdef TEXTURED
fn mapped_normal(normal: vec3<f32>, tangent: vec4<f32>, uv: vec2<f32>) -> vec3<f32> {
    // 128 of 255 is the zero: a neutral map decodes to exactly (0, 0, 1). The dead zone of 1/100 of a step takes up the
    // driver's rounding.
    let centered = textureSample(normal_texture, texture_sampler, uv).xyz * 255.0 - 128.0;
    let snapped = select(centered, vec3(0.0), abs(centered) < vec3(0.01));
    let n = snapped / 127.0 * vec3(push.normal_scale, push.normal_scale, 1.0);
    let bitangent = cross(normal, tangent.xyz) * tangent.w;
    // MikkTSpace: the interpolated frame is used as it is, neither orthogonalized nor normalized (Mikkelsen 2008).
    let mapped = unit_or(tangent.xyz * n.x + bitangent * n.y + normal * n.z, normal);
    // A flat texel leaves the normal as it is, to the last bit: so that a flat map can be left out.
    return select(mapped, normal, n.x == 0.0 && n.y == 0.0 && n.z > 0.0);
}

// For what only needs to know whether there is anything.
fn alpha_at(uv: vec2<f32>) -> f32 {
    return textureSample(base_color_texture, texture_sampler, uv).a * push.alpha;
}

fn emissive_at(uv: vec2<f32>, textures: u32) -> vec3<f32> {
    var emissive = push.emissive;
    if (textures & EMISSIVE) != 0u {
        emissive *= textureSample(emissive_texture, texture_sampler, uv).rgb;
    }
    return emissive;
}

fn point_at(uv: vec2<f32>, textures: u32) -> Point {
    var point = plain_point();
    if (textures & BASE_COLOR) != 0u {
        point.base *= textureSample(base_color_texture, texture_sampler, uv);
    }
    if (textures & OCCLUSION) != 0u {
        point.ambient *= textureSample(occlusion_texture, texture_sampler, uv).r;
    }
    if (textures & METALLIC_ROUGHNESS) != 0u {
        let texel = textureSample(metallic_roughness_texture, texture_sampler, uv);
        point.roughness *= texel.g;
        point.metallic *= texel.b;
    }
    if (textures & SHININESS) != 0u {
        point.roughness *= textureSample(shininess_texture, texture_sampler, uv).g;
    }
    if (textures & SPECULAR) != 0u {
        point.specular *= textureSample(specular_texture, texture_sampler, uv).rgb;
    }
    return point;
}
#endif

// The material without its textures.
fn plain_point() -> Point {
    return Point(vec4(push.base_color, push.alpha), push.ambient, push.metallic, push.roughness, push.specular);
}
