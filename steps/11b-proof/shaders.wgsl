// precise
struct Push {
    clip_from_world: mat4x4<f32>,
    eye: vec3<f32>,
    // From the eye to the corner of the near plane, and on from there by pixels.
    corner: vec3<f32>,
    across: vec3<f32>,
    down: vec3<f32>,
}
var<immediate> push: Push;

struct Light {
    position: vec3<f32>,
    candela: vec3<f32>,
}
struct Frame {
    map_from_world: mat4x4<f32>,
    // The last one is the sun: a direction and lux.
    lights: array<Light, 65>,
}
@group(0) @binding(0) var<uniform> frame: Frame;
// Textures with these names are input attachments: they have the texel of the pixel that is drawn, and no other.
@group(0) @binding(1) var subpass_depth: texture_depth_2d;
@group(0) @binding(2) var subpass_normal: texture_2d<f32>;
@group(0) @binding(3) var subpass_albedo: texture_2d<f32>;
@group(0) @binding(4) var subpass_light: texture_2d<f32>;
@group(0) @binding(5) var shadow_map: texture_depth_2d;

struct Varying {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) albedo: vec3<f32>,
    @location(3) material: vec2<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>, @location(2) albedo: vec3<f32>, @location(3) material: vec2<f32>) -> Varying {
    return Varying(push.clip_from_world * vec4(position, 1.0), position, normal, albedo, material);
}

// The share of the sun that arrives: the share of 3 x 3 texels in which nothing is nearer to the sun (percentage-closer filtering).
fn sunlit(position: vec3<f32>) -> f32 {
    let place = (frame.map_from_world * vec4(position, 1.0)).xyz;
    // Beyond the map nothing casts a shadow.
    if any(abs(place.xy) > vec2(0.99)) {
        return 1.0;
    }
    let texel = vec2<i32>((place.xy * 0.5 + 0.5) * 1024.0);
    var lit = 0.0;
    for (var i = 0; i < 9; i++) {
        lit += step(textureLoad(shadow_map, texel + vec2(i % 3 - 1, i / 3 - 1), 0), place.z);
    }
    return lit / 9.0;
}

const PI: f32 = 3.14159265;

// The light that a surface sends to the eye. Facets mirror it (GGX: Walter et al. 2007), as far as others do not hide them (Smith: Heitz 2014), and the more, the
// flatter it arrives (Schlick 1994). A metal does nothing else; in other matter the rest of the light is coloured and leaves evenly to all sides (Lambert).
fn lit(position: vec3<f32>, normal: vec3<f32>, albedo: vec3<f32>, roughness: f32, metallic: f32) -> vec3<f32> {
    let view = normalize(push.eye - position);
    let n_v = max(dot(normal, view), 1e-4);
    let a2 = pow(roughness, 4.0);
    let facing = mix(vec3(0.04), albedo, metallic);
    var radiance = vec3(0.0);
    for (var i = 0; i < 65; i++) {
        let way = frame.lights[i].position - position;
        let squared = dot(way, way);
        // Candela / distance^2 are lux on a surface that faces the light.
        var towards = way / sqrt(squared);
        var lux = frame.lights[i].candela / squared;
        if i == 64 {
            towards = frame.lights[i].position;
            lux = frame.lights[i].candela * sunlit(position);
        }
        let n_l = max(dot(normal, towards), 0.0);
        let half = normalize(towards + view);
        let fresnel = facing + (1.0 - facing) * pow(1.0 - dot(view, half), 5.0);
        // 1 - cos^2 as the square of the sine, which does not cancel where the lobe is sharp.
        let sine = cross(normal, half);
        let cosine = dot(normal, half);
        let d = dot(sine, sine) + cosine * cosine * a2;
        let smith = n_l * sqrt(n_v * n_v * (1.0 - a2) + a2) + n_v * sqrt(n_l * n_l * (1.0 - a2) + a2);
        let mirrored = fresnel * (a2 / (2.0 * PI * d * d * smith));
        radiance += (mirrored + (1.0 - fresnel) * (1.0 - metallic) * albedo / PI) * n_l * lux;
    }
    return radiance;
}

// The octahedral map lays the sphere onto an octahedron and unfolds its lower half, which fills a square from -1 to 1 (Cigolle et al. 2014).
fn unfolded(p: vec2<f32>) -> vec2<f32> {
    return (1.0 - abs(p.yx)) * select(vec2(-1.0), vec2(1.0), p >= vec2(0.0));
}

fn encoded(n: vec3<f32>) -> vec2<f32> {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return select(unfolded(p), p, n.z >= 0.0) * 0.5 + 0.5;
}

fn decoded(stored: vec2<f32>) -> vec3<f32> {
    let p = stored * 2.0 - 1.0;
    let z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3(select(unfolded(p), p, z >= 0.0), z));
}

fn place_of(pixel: vec2<f32>, depth: f32) -> vec3<f32> {
    return push.eye + (push.corner + pixel.x * push.across + pixel.y * push.down) / depth;
}

struct Gbuffer {
    @location(0) normal: vec2<f32>,
    @location(1) albedo: vec4<f32>,
}

@fragment
fn geometry(in: Varying) -> Gbuffer {
    // Alpha: 7 bits of roughness under a bit of metal.
    let material = (round(in.material.x * 127.0) + 128.0 * round(in.material.y)) / 255.0;
    return Gbuffer(encoded(normalize(in.normal)), vec4(in.albedo, material));
}

// A triangle that is twice as wide and as high as the picture.
@vertex
fn screen(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(select(-1.0, 3.0, index == 2u), select(-1.0, 3.0, index == 1u), 0.0, 1.0);
}

@fragment
fn lighting(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    let depth = textureLoad(subpass_depth, vec2(0, 0), 0);
    // Nothing is seen here: the pixel keeps its clear colour.
    if depth == 0.0 {
        discard;
    }
    let normal = decoded(textureLoad(subpass_normal, vec2(0, 0), 0).xy);
    let albedo = textureLoad(subpass_albedo, vec2(0, 0), 0);
    let metallic = step(0.5, albedo.w);
    let roughness = (albedo.w * 255.0 - 128.0 * metallic) / 127.0;
    return vec4(min(lit(place_of(pixel.xy, depth), normal, albedo.xyz, roughness, metallic), vec3(65504.0)), 1.0);
}

// Khronos PBR Neutral (2024): colours stay as they are up to 0.76, brighter ones are compressed below 1 and lose colour. The exposure makes 1 of half a nit.
@fragment
fn tonemap() -> @location(0) vec4<f32> {
    let exposed = textureLoad(subpass_light, vec2(0, 0), 0).xyz * 2.0;
    let least = min(exposed.x, min(exposed.y, exposed.z));
    let color = exposed - select(0.04, least - 6.25 * least * least, least < 0.08);
    let peak = max(color.x, max(color.y, color.z));
    if peak < 0.76 {
        return vec4(color, 1.0);
    }
    let compressed = 1.0 - 0.24 * 0.24 / (peak + 0.24 - 0.76);
    let grey = 1.0 - 1.0 / (0.15 * (peak - compressed) + 1.0);
    return vec4(mix(color * (compressed / peak), vec3(compressed), grey), 1.0);
}
