// GEOMETRY: surfaces into the G-buffer. Emissive light goes straight into the HDR target.
// variants: TEXTURED NORMAL_MAP MATERIAL SPECULAR EMISSIVE POSITION NORMAL_UINT OVERDRAW
// requires: NORMAL_MAP -> TEXTURED
// excludes: OVERDRAW NORMAL_MAP
// excludes: OVERDRAW MATERIAL
// excludes: OVERDRAW SPECULAR
// excludes: OVERDRAW EMISSIVE
// excludes: OVERDRAW POSITION
// excludes: OVERDRAW NORMAL_UINT
// precise
#import afterlight::frame::{frame}
#import afterlight::encodings::{encode_normal, encode_normal_uint, encode_shininess, octahedral, to_unorm}

// Which of a material's textures exist. Slots without one alias another texture and are never sampled.
override BASE_COLOR_TEXTURE: bool = false;
override METALLIC_ROUGHNESS_TEXTURE: bool = false;
override OCCLUSION_TEXTURE: bool = false;
override EMISSIVE_TEXTURE: bool = false;
override SPECULAR_TEXTURE: bool = false;
override MASKED: bool = false;
override TWO_SIDED: bool = false;
// Shadows fall on it.
override RECEIVES: bool = true;
override NORMAL_ENCODING: u32 = 0u;
// Codes of a channel that holds half an octahedral geometric normal.
override GEOMETRIC_STEPS: f32 = 255.0;
// The material's roughness channel holds a shininess instead.
override PHONG: bool = false;
// Largest value that the light target holds.
override LARGEST: f32 = 65000.0;
// Largest coordinate that the position target holds.
override FARTHEST: f32 = 65000.0;

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
@group(1) @binding(6) var texture_sampler: sampler;
#endif

struct Vertex {
    @location(0) position: vec3<f32>,
#ifndef OVERDRAW
    @location(1) normal: vec3<f32>,
#endif
#ifdef TEXTURED
    @location(2) uv: vec2<f32>,
#endif
#ifdef NORMAL_MAP
    @location(3) tangent: vec4<f32>,
#endif
}

struct Varying {
    @builtin(position) position: vec4<f32>,
#ifndef OVERDRAW
    @location(1) normal: vec3<f32>,
#endif
#ifdef TEXTURED
    @location(2) uv: vec2<f32>,
#endif
#ifdef NORMAL_MAP
    @location(3) tangent: vec4<f32>,
#endif
#ifdef POSITION
    @location(4) world: vec3<f32>,
#endif
}

@vertex
fn vertex(in: Vertex) -> Varying {
    var out: Varying;
    let p = vec4(in.position, 1.0);
    let world = vec3(dot(push.row_x, p), dot(push.row_y, p), dot(push.row_z, p));
    out.position = frame.clip_from_world * vec4(world, 1.0);
#ifndef OVERDRAW
    // Normals go by the cofactor matrix, which is right for any scale and mirror.
    let x = push.row_x.xyz;
    let y = push.row_y.xyz;
    let z = push.row_z.xyz;
    let cofactor_x = cross(y, z);
    let handed = select(-1.0, 1.0, dot(x, cofactor_x) >= 0.0);
    out.normal = handed * vec3(dot(cofactor_x, in.normal), dot(cross(z, x), in.normal), dot(cross(x, y), in.normal));
#endif
#ifdef TEXTURED
    out.uv = in.uv;
#endif
#ifdef NORMAL_MAP
    let t = in.tangent.xyz;
    out.tangent = vec4(dot(x, t), dot(y, t), dot(z, t), in.tangent.w * handed);
#endif
#ifdef POSITION
    out.world = world;
#endif
    return out;
}

#ifdef OVERDRAW

// Adds one step of an 8-bit target for each fragment that is shaded.
@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
#ifdef TEXTURED
    if MASKED && BASE_COLOR_TEXTURE {
        if textureSample(base_color_texture, texture_sampler, in.uv).a * push.alpha < push.alpha_cutoff {
            discard;
        }
    }
#endif
    return vec4(1.0 / 255.0, 0.0, 0.0, 0.0);
}

#else

struct Gbuffer {
    @location(0) albedo: vec4<f32>,
#ifdef NORMAL_UINT
    @location(1) normal: vec2<u32>,
#else
    @location(1) normal: vec4<f32>,
#endif
#ifdef MATERIAL
    @location(2) material: vec4<f32>,
#endif
#ifdef EMISSIVE
    @location(3) emissive: vec4<f32>,
#endif
#ifdef SPECULAR
    @location(4) specular: vec4<f32>,
#endif
#ifdef POSITION
    @location(5) position: vec4<f32>,
#endif
}

// A vector of any length to a unit one; a zero vector gives the fallback.
fn unit_or(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    // Scaled first, so that squares neither overflow nor vanish.
    let largest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if !(largest > 0.0) {
        return fallback;
    }
    return normalize(v / largest);
}

#ifdef NORMAL_MAP
fn mapped_normal(in: Varying, normal: vec3<f32>) -> vec3<f32> {
    // 128 of 255 is the zero: a neutral map decodes to exactly (0, 0, 1). The dead zone of 1/100 of a step takes up the
    // driver's rounding.
    let centered = textureSample(normal_texture, texture_sampler, in.uv).xyz * 255.0 - 128.0;
    let snapped = select(centered, vec3(0.0), abs(centered) < vec3(0.01));
    let n = snapped / 127.0 * vec3(push.normal_scale, push.normal_scale, 1.0);
    let tangent = in.tangent.xyz;
    let bitangent = cross(normal, tangent) * in.tangent.w;
    // MikkTSpace: the interpolated frame is used as it is, neither orthogonalized nor normalized (Mikkelsen 2008).
    return unit_or(tangent * n.x + bitangent * n.y + normal * n.z, normal);
}
#endif

@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> Gbuffer {
    var out: Gbuffer;
    var base = vec4(push.base_color, push.alpha);
#ifdef TEXTURED
    if BASE_COLOR_TEXTURE {
        base *= textureSample(base_color_texture, texture_sampler, in.uv);
    }
#endif
    let facing = select(1.0, -1.0, TWO_SIDED && !front);
    let geometric = unit_or(in.normal, vec3(0.0, 1.0, 0.0));
    var normal = geometric;
#ifdef NORMAL_MAP
    normal = mapped_normal(in, geometric);
#endif
    var ambient = push.ambient;
    var metallic = push.metallic;
    var roughness = push.roughness;
    var specular = push.specular;
#ifdef TEXTURED
    if OCCLUSION_TEXTURE {
        ambient *= textureSample(occlusion_texture, texture_sampler, in.uv).r;
    }
    if METALLIC_ROUGHNESS_TEXTURE && !PHONG {
        let texel = textureSample(metallic_roughness_texture, texture_sampler, in.uv);
        roughness *= texel.g;
        metallic *= texel.b;
    }
    if SPECULAR_TEXTURE {
        specular *= textureSample(specular_texture, texture_sampler, in.uv).rgb;
    }
#endif
    out.albedo = vec4(base.rgb, ambient);
#ifdef NORMAL_UINT
    out.normal = encode_normal_uint(normal * facing);
#else
    out.normal = encode_normal(normal * facing, NORMAL_ENCODING);
#endif
#ifdef MATERIAL
    let stored_roughness = select(roughness, encode_shininess(roughness), PHONG);
    var plane = to_unorm(octahedral(geometric * facing), GEOMETRIC_STEPS);
    // Only shadows need the geometric normal. Its codes never reach 1, which says that there is none.
    plane.x = select(1.0, plane.x, RECEIVES);
    out.material = vec4(metallic, stored_roughness, plane);
#endif
#ifdef SPECULAR
    out.specular = vec4(specular, push.brdf);
#endif
#ifdef EMISSIVE
    var emissive = push.emissive;
#ifdef TEXTURED
    if EMISSIVE_TEXTURE {
        emissive *= textureSample(emissive_texture, texture_sampler, in.uv).rgb;
    }
#endif
    out.emissive = vec4(min(emissive, vec3(LARGEST)), 1.0);
#endif
#ifdef POSITION
    // Beyond what the target holds a place moves along its ray to where it fits, so that the eye still sees it in its direction.
    let farthest = max(abs(in.world.x), max(abs(in.world.y), abs(in.world.z)));
    out.position = vec4(in.world * min(1.0, FARTHEST / farthest), 1.0);
#endif
#ifdef TEXTURED
    // After the last texture was sampled: derivatives need all four pixels of a quad.
    if MASKED && base.a < push.alpha_cutoff {
        discard;
    }
#endif
    return out;
}

#endif
