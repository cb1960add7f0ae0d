// SIMULATE: where each particle is at the frame's moment, how large, of which colour, how it is lit, and how far away. Nothing is kept from frame to
// frame: all of it follows from the particle's number, its emitter's seed and its age, as in crates/scene/src/emitter.rs.
// variants: LIGHTS SHADOW SORTED
// requires: SHADOW -> LIGHTS
// counts: 6; with LIGHTS 4, SHADOW 2, SORTED 3
#import afterlight::frame::{frame}
#import afterlight::particles::{Particle}
#ifdef LIGHTS
#import afterlight::lights::{lights, reach_of}
#endif
#ifdef SHADOW
#import afterlight::shadows::{visibility}
#endif

// All lights' fall-off, and bits of the traits that some light has (lights.wgsl).
override FALLOFF: u32 = 3u;
override TRAITS: u32 = 0xffffffffu;
override SHADOW_FILTER: u32 = 2u;
override DIRECTIONAL_SHADOWS: bool = true;
override PUNCTUAL_SHADOWS: bool = true;
// Largest value that the picture's target takes.
override LARGEST: f32 = 65000.0;
// Only counted: nothing lights them.
override COUNTS: bool = false;

// A source of particles; src/visible/emitters.rs has the same record, and explains it.
struct Emitter {
    position: vec3<f32>,
    life: f32,
    velocity: vec3<f32>,
    drag: f32,
    spread: vec3<f32>,
    step: f32,
    extent: vec3<f32>,
    age: f32,
    gravity: vec3<f32>,
    softness: f32,
    ambient: vec3<f32>,
    lit: f32,
    sizes: vec4<f32>,
    colors: array<vec4<f32>, 4>,
    emissions: array<vec4<f32>, 4>,
    // The numbers of sizes, colours and emissions; the seed.
    keys: vec4<u32>,
    // The first place in the list, the number of places, the number of the oldest, frames of the texture.
    place: vec4<u32>,
    // Most that is turned at first, most in a second, whether a frame is picked, texture from 1 or 0.
    turns: vec4<f32>,
}

struct Push {
    // Particles that are alive, places in the list of keys, and emitters.
    count: u32,
    places: u32,
    emitters: u32,
}

var<immediate> push: Push;

@group(1) @binding(0) var<storage, read> emitters: array<Emitter>;
@group(1) @binding(1) var<storage, read_write> particles: array<Particle>;
#ifdef SORTED
// The value that orders a particle, and its index.
@group(1) @binding(2) var<storage, read_write> keys: array<vec2<u32>>;
#endif

// Sort key of particles that are not seen: they sort last.
const UNSEEN: u32 = 0xffffffffu;
const PI: f32 = 3.14159265;

// M. O'Neill's PCG as a hash (M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", 2020).
fn pcg(input: u32) -> u32 {
    let state = input * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

var<private> random: u32;

// Random number from 0 to below 1, of 24 bits.
fn share() -> f32 {
    random = pcg(random);
    return f32(random >> 8u) / 16777216.0;
}

fn both_ways() -> f32 {
    return share() * 2.0 - 1.0;
}

fn random_vector() -> vec3<f32> {
    let x = both_ways();
    let y = both_ways();
    return vec3(x, y, both_ways());
}

// The factors of the first velocity and of a steady acceleration in the way that a particle has come.
fn travel(drag: f32, time: f32) -> vec2<f32> {
    let a = drag * time;
    if a < 0.5 {
        // The closed forms below cancel here.
        let first = 1.0 - a * (1.0 / 2.0 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a * (1.0 / 720.0 - a / 5040.0)))));
        let second = 1.0 / 2.0 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a * (1.0 / 720.0 - a * (1.0 / 5040.0 - a / 40320.0)))));
        return vec2(time * first, time * time * second);
    }
    let first = (1.0 - exp(-a)) / a;
    return vec2(time * first, time * time * ((1.0 - first) / a));
}

// Finds a share of life among `count` keys, spaced evenly over a life: returns the key before it, and how far it is towards the next.
fn key_at(count: u32, share_of_life: f32) -> vec2<f32> {
    let at = share_of_life * f32(max(count, 1u) - 1u);
    let first = min(floor(at), f32(max(count, 2u) - 2u));
    return vec2(first, at - first);
}

// The light that arrives from everywhere and is scattered evenly to all sides, in nits: as much as an even sky of that radiance would send through.
fn scattered(position: vec3<f32>, ambient: vec3<f32>) -> vec3<f32> {
    var radiance = ambient;
#ifdef LIGHTS
    for (var i = 0u; i < frame.light_count; i++) {
        let light = lights[i];
        var to_light = light.position;
        var strength = 1.0;
        var arrives = vec3(1.0);
        if i >= frame.directional_count {
            let reach = reach_of(light, position, FALLOFF, TRAITS);
            to_light = reach.to_light;
            strength = reach.strength;
        }
#ifdef SHADOW
        let casts = select(PUNCTUAL_SHADOWS, DIRECTIONAL_SHADOWS, i < frame.directional_count);
        if casts && strength > 0.0 {
            // The shadow on a surface that faces the light.
            arrives = visibility(light.falloff, position, to_light, to_light, SHADOW_FILTER);
        }
#endif
        radiance += light.color * (strength * arrives / (4.0 * PI));
    }
#endif
    return radiance;
}

@compute @workgroup_size(128, 1, 1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    if index >= push.count {
#ifdef SORTED
        if index < push.places {
            keys[index] = vec2(UNSEEN, index);
        }
#endif
        return;
    }
    var own = 0u;
    while own + 1u < push.emitters && index >= emitters[own].place.x + emitters[own].place.y {
        own += 1u;
    }
    let emitter = &emitters[own];
    let place = (*emitter).place;
    let nth = index - place.x;
    let life = (*emitter).life;
    let age = clamp((*emitter).age - f32(nth) * (*emitter).step, 0.0, life);
    let share_of_life = saturate(age / life);
    random = pcg(pcg((*emitter).keys.w) ^ (place.z + nth));
    let born = (*emitter).position + (*emitter).extent * random_vector();
    let velocity = (*emitter).velocity + (*emitter).spread * random_vector();
    let turns = (*emitter).turns;
    let turn = both_ways();
    let spin = both_ways();
    let pick = share();
    let way = travel((*emitter).drag, age);
    let position = born + velocity * way.x + (*emitter).gravity * way.y;

    let keys_of = (*emitter).keys;
    let at_size = key_at(keys_of.x, share_of_life);
    let sizes = (*emitter).sizes;
    let size_key = u32(at_size.x);
    let size = mix(sizes[size_key], sizes[min(size_key + 1u, 3u)], at_size.y);
    let at_color = key_at(keys_of.y, share_of_life);
    let color_key = u32(at_color.x);
    let color = mix((*emitter).colors[color_key], (*emitter).colors[min(color_key + 1u, 3u)], at_color.y);
    var emission = vec3(0.0);
    if keys_of.z > 0u {
        let at = key_at(keys_of.z, share_of_life);
        let key = u32(at.x);
        emission = mix((*emitter).emissions[key], (*emitter).emissions[min(key + 1u, 3u)], at.y).rgb;
    }
    let distance = dot(position, frame.forward);
    // Particles behind the near plane and invisible particles have no size.
    let seen = distance > frame.near && size > 0.0 && color.a > 0.0;
    var light = vec3(0.0);
    if seen && !COUNTS {
        if (*emitter).lit > 0.0 {
            light = color.rgb * scattered(position, (*emitter).ambient);
        }
        light = min((light + emission) * frame.exposure, vec3(LARGEST));
    }
    let angle = turn * turns.x + spin * turns.y * age;
    let picked = select(share_of_life, pick, turns.z > 0.0) * f32(place.w);
    let cell = min(u32(picked), place.w - 1u);
    var particle: Particle;
    particle.position = position;
    particle.edge = select(0.0, size, seen);
    particle.color = vec4(light, color.a);
    particle.turn = vec2(cos(angle), sin(angle));
    particle.look = cell | (u32(turns.w) << 16u);
    particle.softness = (*emitter).softness;
    particles[index] = particle;
#ifdef SORTED
    // Bits of positive floats are in order as they are: the farthest first.
    keys[index] = vec2(select(UNSEEN, UNSEEN - bitcast<u32>(distance), seen), index);
#endif
}
