// Light sources and their fall-offs, in lux (directional, beam) and candela (point, spot), as KHR_lights_punctual has them.
#define_import_path afterlight::lights

const INVERSE_SQUARE: u32 = 0u; // host
const QUADRATIC: u32 = 1u; // host
const POLYNOMIAL: u32 = 2u; // host
// In place of a fall-off that all lights share: each light has its own.
const MIXED_FALLOFF: u32 = 3u; // host
// A beam has none.
const NO_FALLOFF: u32 = 3u; // host

// Bits of TRAITS in the passes, the features that some light needs code for.
const RANGES: u32 = 1u; // host
const CONES: u32 = 2u; // host
const BEAMS: u32 = 4u; // host
const ALL_TRAITS: u32 = 0xffffffffu;

// Least distance, part of the model: 1 cm. Nearer than that a point light grows no brighter.
const MIN_DISTANCE_SQUARED: f32 = 1e-4;

struct Light {
    // Towards the light for a directional one; else its place relative to the camera.
    position: vec3<f32>,
    // 1 / range^2; 0 for a light without a range.
    inverse_range_squared: f32,
    // Colour times intensity.
    color: vec3<f32>,
    // Bits 0 and 1: the fall-off. The other bits describe the light's shadow maps, see shadows.wgsl.
    falloff: u32,
    // The direction in which the light of a spot or a beam travels.
    direction: vec3<f32>,
    // Cone as in KHR_lights_punctual: saturate(cos(angle) * edge_scale + edge_offset)^2; 0 and 1 for a point light. A beam has the same factors for
    // the distance from its axis.
    edge_scale: f32,
    // Coefficients of the polynomial: constant, linear, quadratic.
    polynomial: vec3<f32>,
    edge_offset: f32,
}

// The direction to a light, and its strength at a place.
struct Reach {
    // Unit vector.
    to_light: vec3<f32>,
    strength: f32,
}

// sat(1 - (d/r)^4)^2, of d^2: draws to zero at the range.
// ANCHOR: window
fn window_of(light: Light, distance_squared: f32) -> f32 {
    let x2 = distance_squared * light.inverse_range_squared;
    let window = saturate(1.0 - x2 * x2);
    return window * window;
}
// ANCHOR_END: window

// Parallel light from a disc: nothing behind it and beside its cylinder.
fn reach_of_beam(light: Light, position: vec3<f32>, traits: u32) -> Reach {
    let offset = position - light.position;
    let along = dot(offset, light.direction);
    let beside = length(offset - light.direction * along);
    let t = saturate(beside * light.edge_scale + light.edge_offset);
    var strength = select(0.0, t * t, along > 0.0);
    if (traits & RANGES) != 0u {
        strength *= window_of(light, along * along);
    }
    return Reach(-light.direction, strength);
}

fn is_beam(light: Light, traits: u32) -> bool {
    return (traits & BEAMS) != 0u && (light.falloff & 3u) == NO_FALLOFF;
}

// The way from a place to a light.
struct Way {
    // Unit vector.
    to_light: vec3<f32>,
    distance_squared: f32,
    inverse_distance: f32,
}

fn way_of(offset: vec3<f32>, distance_squared: f32) -> Way {
    // Finite where the light is in the place itself.
    let inverse_distance = inverseSqrt(max(distance_squared, 1e-20));
    return Way(offset * inverse_distance, distance_squared, inverse_distance);
}

// False only where a light that is no beam has no strength.
fn within_range(light: Light, distance_squared: f32, traits: u32) -> bool {
    return (traits & RANGES) == 0u || distance_squared * light.inverse_range_squared < 1.0;
}

// The share of its light that a light which is no beam has left at the end of the way. `all_falloff` and `traits` are constants.
fn strength_after(way: Way, light: Light, all_falloff: u32, traits: u32) -> f32 {
    let distance_squared = way.distance_squared;
    let falloff = select(all_falloff, light.falloff & 3u, all_falloff == MIXED_FALLOFF);
    var strength = 0.0;
    if falloff == INVERSE_SQUARE {
        // ANCHOR: inverse-square
        // 1 / max(d^2, least^2), from the reciprocal that is there already.
        strength = min(way.inverse_distance * way.inverse_distance, 1.0 / MIN_DISTANCE_SQUARED);
        if (traits & RANGES) != 0u {
            strength *= window_of(light, distance_squared);
        }
        // ANCHOR_END: inverse-square
    } else if falloff == QUADRATIC {
        strength = max(1.0 - distance_squared * light.inverse_range_squared, 0.0);
    } else {
        let distance = distance_squared * way.inverse_distance;
        let polynomial = light.polynomial.x + light.polynomial.y * distance + light.polynomial.z * distance_squared;
        let inside = distance_squared * light.inverse_range_squared < 1.0;
        strength = select(0.0, 1.0 / max(polynomial, 1e-4), inside);
    }
    if (traits & CONES) != 0u {
        let t = saturate(-dot(light.direction, way.to_light) * light.edge_scale + light.edge_offset);
        strength *= t * t;
    }
    return strength;
}

// Zero from the range on, and out of a cone. `all_falloff` and `traits` are constants.
fn reach_of(light: Light, position: vec3<f32>, all_falloff: u32, traits: u32) -> Reach {
    if is_beam(light, traits) {
        return reach_of_beam(light, position, traits);
    }
    let offset = light.position - position;
    let way = way_of(offset, dot(offset, offset));
    return Reach(way.to_light, strength_after(way, light, all_falloff, traits));
}

// Lights that fit into the least uniform buffer that a device must have, 16 KiB.
const UNIFORM_LIGHTS: u32 = 256u; // host

#ifdef UNIFORM_BUFFER
// Few lights: a uniform buffer, which every driver reads faster when all invocations read the same.
@group(0) @binding(1) var<uniform> lights: array<Light, UNIFORM_LIGHTS>;
#else
@group(0) @binding(1) var<storage, read> lights: array<Light>;
#endif
