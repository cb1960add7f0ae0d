struct Push {
    clip_from_world: mat4x4<f32>,
}
var<immediate> push: Push;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>) -> Varying {
    return Varying(push.clip_from_world * vec4(position, 1.0), position);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    return vec4(in.world, 1.0);
}
