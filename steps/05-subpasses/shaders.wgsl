// precise
struct Push {
    clip_from_world: mat4x4<f32>,
}
var<immediate> push: Push;

struct Light {
    position: vec3<f32>,
    candela: vec3<f32>,
}
@group(0) @binding(0) var<uniform> lights: array<Light, 64>;
// Textures with these names are input attachments: they have the texel of the pixel that is drawn, and no other.
@group(0) @binding(1) var subpass_position: texture_2d<f32>;
@group(0) @binding(2) var subpass_normal: texture_2d<f32>;
@group(0) @binding(3) var subpass_albedo: texture_2d<f32>;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) albedo: vec3<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>, @location(2) albedo: vec3<f32>) -> Varying {
    return Varying(push.clip_from_world * vec4(position, 1.0), position, normal, albedo);
}

// The light that a matt surface sends to every side: albedo / pi of the light that arrives (Lambert).
fn lit(position: vec3<f32>, normal: vec3<f32>, albedo: vec3<f32>) -> vec3<f32> {
    var lux = vec3(0.0);
    for (var i = 0; i < 64; i++) {
        let towards = lights[i].position - position;
        // Candela / distance^2 are lux on a surface that faces the light. A slanted one catches the cosine of that; the dot product is the cosine times the distance.
        let squared = dot(towards, towards);
        lux += lights[i].candela * max(dot(normal, towards), 0.0) / (squared * sqrt(squared));
    }
    return albedo / 3.14159265 * lux;
}

struct Gbuffer {
    @location(0) position: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) albedo: vec4<f32>,
}

@fragment
fn geometry(in: Varying) -> Gbuffer {
    return Gbuffer(vec4(in.world, 1.0), vec4(normalize(in.normal), 0.0), vec4(in.albedo, 0.0));
}

// A triangle that is twice as wide and as high as the picture.
@vertex
fn screen(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(select(-1.0, 3.0, index == 2u), select(-1.0, 3.0, index == 1u), 0.0, 1.0);
}

@fragment
fn lighting() -> @location(0) vec4<f32> {
    let position = textureLoad(subpass_position, vec2(0, 0), 0);
    // Nothing is seen here: the pixel keeps its clear colour.
    if position.w == 0.0 {
        discard;
    }
    let albedo = textureLoad(subpass_albedo, vec2(0, 0), 0).xyz;
    return vec4(lit(position.xyz, textureLoad(subpass_normal, vec2(0, 0), 0).xyz, albedo), 1.0);
}
