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
@group(0) @binding(0) var<uniform> lights: array<Light, 64>;
// Textures with these names are input attachments: they have the texel of the pixel that is drawn, and no other.
@group(0) @binding(1) var subpass_depth: texture_depth_2d;
@group(0) @binding(2) var subpass_normal: texture_2d<f32>;
@group(0) @binding(3) var subpass_albedo: texture_2d<f32>;
// Floats that are not negative have the order of their bits.
@group(0) @binding(4) var<storage, read_write> largest: array<atomic<u32>, 3>;

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
    return Gbuffer(encoded(normalize(in.normal)), vec4(in.albedo, 0.0));
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
    let albedo = textureLoad(subpass_albedo, vec2(0, 0), 0).xyz;
    return vec4(lit(place_of(pixel.xy, depth), normal, albedo), 1.0);
}

// `early_depth_test`: a shader that writes memory otherwise runs before the depth test, also for surfaces that are not seen.
@early_depth_test(force)
@fragment
fn errors(in: Varying) {
    let depth = textureLoad(subpass_depth, vec2(0, 0), 0);
    let normal = decoded(textureLoad(subpass_normal, vec2(0, 0), 0).xy);
    let angle = 2.0 * asin(0.5 * distance(normal, normalize(in.normal)));
    atomicMax(&largest[0], bitcast<u32>(degrees(angle)));
    // Here w is 1 / distance, and the near plane is at 0.1.
    atomicMax(&largest[1], bitcast<u32>(abs(0.1 / depth * in.clip.w - 1.0)));
    atomicMax(&largest[2], bitcast<u32>(distance(place_of(in.clip.xy, depth), in.world)));
}
