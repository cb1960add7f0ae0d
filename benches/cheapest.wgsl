// The least that draws a lambert surface under one directional light: `benches/cheapest.rs` compares the renderer with it.

struct Push {
    clip_from_mesh: mat4x4<f32>,
    // Towards the light, in mesh space.
    to_light: vec3<f32>,
    // Albedo times illuminance times exposure over pi.
    color: vec3<f32>,
}

var<immediate> push: Push;

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) normal: vec3<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Varying {
    return Varying(push.clip_from_mesh * vec4(position, 1.0), normal);
}

// Khronos PBR Neutral, as in `shaders/shared/tonemap.wgsl`.
fn neutral(color_in: vec3<f32>) -> vec3<f32> {
    let start_compression = 0.8 - 0.04;
    let least = min(color_in.r, min(color_in.g, color_in.b));
    let offset = select(0.04, least - 6.25 * least * least, least < 0.08);
    let color = color_in - offset;
    let peak = max(color.r, max(color.g, color.b));
    if peak < start_compression {
        return color;
    }
    let d = 1.0 - start_compression;
    let new_peak = 1.0 - d * d / (peak + d - start_compression);
    let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(color * (new_peak / peak), vec3(new_peak), g);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let light = push.color * max(dot(normalize(in.normal), push.to_light), 0.0);
    return vec4(saturate(neutral(light)), 1.0);
}
