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

@fragment
fn forward(in: Varying) -> @location(0) vec4<f32> {
    return vec4(lit(in.world, normalize(in.normal), in.albedo), 1.0);
}
