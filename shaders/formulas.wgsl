// FORMULAS: one formula of the modules that frames use, on each element of a buffer of inputs: the stress cases `formulas/...` compare it with 64
// bits. No pass of a frame.
// variants: PLANTED
// precise
// counts: 2; with PLANTED 1
#import afterlight::brdf::{ambient_lobe, cook_torrance_surface, ggx_lobe, half_vector, phong_surface, reflect_ambient, reflect_light, schlick, smith_root, squared_alpha, Dielectric, COOK_TORRANCE, PHONG, BLINN_PHONG, MIN_N_DOT_V, MIN_ROUGHNESS}
#import afterlight::encodings::{decode_normal, decode_shininess, encode_normal, encode_shininess, octahedral, octahedral_decode, OCTAHEDRAL}
#import afterlight::frame::{position_at}
#import afterlight::lights::{reach_of, Light, ALL_TRAITS, MIXED_FALLOFF}
#import afterlight::lobes::{groove_lobe, interference, sheen_lobe, take_sheen, take_stretch, take_through, transmitted}
#import afterlight::tonemapping::{encode_srgb, tone_map}
#ifdef PLANTED
#import afterlight::textbook::{textbook_light}
#endif

// The number of the formula; crates/lab/src/stress/formula/mod.rs has the same order.
override FORMULA: u32 = 0u;

// The meaning of the numbers is the formula's.
struct Input {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
    d: vec4<f32>,
}

@group(1) @binding(0) var<storage, read> inputs: array<Input>;
@group(1) @binding(1) var<storage, read_write> outputs: array<vec4<f32>>;

fn dielectric_of(in: Input) -> Dielectric {
    return Dielectric(vec3(in.c.w), in.d.w);
}

// normal and roughness, view and metallic, light and reflectance facing, albedo and reflectance grazing
fn cook_torrance_of(in: Input) -> vec3<f32> {
    let n_dot_l = dot(in.a.xyz, in.c.xyz);
    // As `punctual_light` has it.
    if n_dot_l <= 0.0 {
        return vec3(0.0);
    }
    let surface = cook_torrance_surface(in.a.xyz, in.b.xyz, in.d.xyz, in.b.w, in.a.w, dielectric_of(in));
#ifdef PLANTED
    return textbook_light(surface, COOK_TORRANCE, in.c.xyz, n_dot_l) * n_dot_l;
#else
    return reflect_light(surface, COOK_TORRANCE, in.c.xyz, n_dot_l) * n_dot_l;
#endif
}

// normal and shininess, view and Ks, light, albedo
fn phong_of(in: Input, brdf: u32) -> vec3<f32> {
    let n_dot_l = dot(in.a.xyz, in.c.xyz);
    if n_dot_l <= 0.0 {
        return vec3(0.0);
    }
    let surface = phong_surface(in.a.xyz, in.b.xyz, in.d.xyz, vec3(in.b.w), in.a.w, brdf);
#ifdef PLANTED
    return textbook_light(surface, brdf, in.c.xyz, n_dot_l) * n_dot_l;
#else
    return reflect_light(surface, brdf, in.c.xyz, n_dot_l) * n_dot_l;
#endif
}

// normal and roughness, view, light, colour
fn sheen_of(in: Input) -> vec3<f32> {
    let n_dot_l = dot(in.a.xyz, in.c.xyz);
    if n_dot_l <= 0.0 {
        return vec3(0.0);
    }
    let n_dot_v = max(dot(in.a.xyz, in.b.xyz), MIN_N_DOT_V);
    take_sheen(vec4(in.d.xyz, in.a.w), n_dot_v);
    return sheen_lobe(in.a.xyz, in.b.xyz, n_dot_v, in.c.xyz, n_dot_l) * n_dot_l;
}

// normal and roughness, view and strength, light, direction across the grooves
fn grooves_of(in: Input) -> f32 {
    let n_dot_l = dot(in.a.xyz, in.c.xyz);
    if n_dot_l <= 0.0 {
        return 0.0;
    }
    take_stretch(in.d.xyz, in.b.w, in.a.xyz, max(in.a.w, MIN_ROUGHNESS));
    let half = half_vector(in.c.xyz + in.b.xyz).direction;
    let n_dot_v = max(dot(in.a.xyz, in.b.xyz), MIN_N_DOT_V);
    return groove_lobe(half, dot(in.a.xyz, half), in.b.xyz, n_dot_v, in.c.xyz, n_dot_l) * n_dot_l;
}

// normal and share that comes through, view and metallic, the direction opposite to the light and reflectance facing, colour and reflectance grazing
fn through_of(in: Input) -> vec3<f32> {
    let n_dot_l = -dot(in.a.xyz, in.c.xyz);
    if n_dot_l >= 0.0 {
        return vec3(0.0);
    }
    let surface = cook_torrance_surface(in.a.xyz, in.b.xyz, in.d.xyz, in.b.w, 1.0, dielectric_of(in));
    take_through(vec4(in.d.xyz, in.a.w), in.b.w);
    return transmitted(surface, -in.c.xyz, n_dot_l) * -n_dot_l;
}

// The leaf's reflected light in front, plus the light that comes through from the mirrored direction behind.
fn leaf_of(in: Input) -> vec3<f32> {
    let n_dot_l = dot(in.a.xyz, in.c.xyz);
    if n_dot_l <= 0.0 {
        return vec3(0.0);
    }
    var surface = cook_torrance_surface(in.a.xyz, in.b.xyz, in.d.xyz, in.b.w, 1.0, dielectric_of(in));
    surface.diffuse *= take_through(vec4(in.d.xyz, in.a.w), in.b.w);
    let behind = in.c.xyz - in.a.xyz * (2.0 * n_dot_l);
    return (reflect_light(surface, COOK_TORRANCE, in.c.xyz, n_dot_l) + transmitted(surface, behind, -n_dot_l)) * n_dot_l;
}

// normal and roughness, light + view
fn distribution_of(in: Input) -> f32 {
    let half = half_vector(in.b.xyz);
    // D alone: V is 0.5 / smith.
    return ggx_lobe(in.a.xyz, half.direction, squared_alpha(in.a.w), 0.5);
}

// NdotL, NdotV, roughness
fn masking_of(in: Input) -> f32 {
    let alpha_squared = squared_alpha(in.a.z);
    return 0.5 / (in.a.x * smith_root(in.a.y, alpha_squared) + in.a.y * smith_root(in.a.x, alpha_squared));
}

// normal and roughness, view and metallic, - and reflectance facing, albedo and reflectance grazing
fn ambient_of(in: Input) -> vec3<f32> {
    let surface = cook_torrance_surface(in.a.xyz, in.b.xyz, in.d.xyz, in.b.w, in.a.w, dielectric_of(in));
    return reflect_ambient(surface, ambient_lobe(surface, COOK_TORRANCE, in.a.w));
}

// pixel, depth
fn position_of(in: Input) -> vec3<f32> {
#ifdef PLANTED
    // Forward Z, 1 - near / distance: far surfaces have codes next to 1, which are as far apart as the codes of near surfaces.
    let forward = 1.0 - in.a.z;
    return position_at(in.a.xy, 1.0 - forward);
#else
    return position_at(in.a.xy, in.a.z);
#endif
}

// The record of a light as the frame's buffer has it, seen from the origin.
fn light_of(in: Input) -> Light {
    return Light(in.a.xyz, in.a.w, in.b.xyz, bitcast<u32>(in.b.w), in.c.xyz, in.c.w, in.d.xyz, in.d.w);
}

fn strength_of(light: Light) -> f32 {
    return reach_of(light, vec3(0.0), MIXED_FALLOFF, ALL_TRAITS).strength;
}

fn evaluate(in: Input) -> vec4<f32> {
    switch FORMULA {
        case 0u: { return vec4(cook_torrance_of(in), 0.0); }
        case 1u: { return vec4(phong_of(in, PHONG), 0.0); }
        case 2u: { return vec4(phong_of(in, BLINN_PHONG), 0.0); }
        case 3u: { return vec4(distribution_of(in), 0.0, 0.0, 0.0); }
        case 4u: { return vec4(masking_of(in), 0.0, 0.0, 0.0); }
        case 5u: { return vec4(schlick(in.a.xyz, in.b.x, in.a.w), 0.0); }
        case 6u: { return vec4(ambient_of(in), 0.0); }
        case 7u: { return vec4(strength_of(light_of(in)), 0.0, 0.0, 0.0); }
        case 8u: { return vec4(octahedral_decode(octahedral(in.a.xyz)), 0.0); }
        case 9u: { return vec4(decode_normal(encode_normal(in.a.xyz, OCTAHEDRAL), OCTAHEDRAL), 0.0); }
        case 10u: { return vec4(tone_map(in.a.xyz, bitcast<u32>(in.a.w)), 0.0); }
        case 11u: { return vec4(encode_srgb(in.a.xyz), 0.0); }
        case 12u: { return vec4(position_of(in), 0.0); }
        case 13u: { return vec4(decode_shininess(encode_shininess(in.a.x)), 0.0, 0.0, 0.0); }
        case 15u: { return vec4(sheen_of(in), 0.0); }
        case 16u: { return vec4(interference(in.b.x, in.b.y, in.a.xyz, in.a.w), 0.0); }
        case 17u: { return vec4(grooves_of(in), 0.0, 0.0, 0.0); }
        case 18u: { return vec4(through_of(in), 0.0); }
        case 19u: { return vec4(leaf_of(in), 0.0); }
        default: { return vec4(reach_of(light_of(in), vec3(0.0), MIXED_FALLOFF, ALL_TRAITS).to_light, 0.0); }
    }
}

@compute @workgroup_size(64, 1, 1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < arrayLength(&inputs) {
        outputs[id.x] = evaluate(inputs[id.x]);
    }
}
