// Light sources and their fall-offs, in lux (directional) and candela (point, spot), as KHR_lights_punctual has them.
#define_import_path afterlight::lights

const INVERSE_SQUARE: u32 = 0u;
const QUADRATIC: u32 = 1u;
const POLYNOMIAL: u32 = 2u;

// Least distance, part of the model: 1 cm. Nearer than that a point light grows no brighter.
const MIN_DISTANCE2: f32 = 1e-4;

struct Light {
    // Towards the light for a directional one; else its place relative to the camera.
    position: vec3<f32>,
    // 1 / range^2; 0 for a light without a range.
    inverse_range2: f32,
    // Colour times intensity.
    color: vec3<f32>,
    falloff: u32,
    // Where a spot's light travels to.
    direction: vec3<f32>,
    // Cone as in KHR_lights_punctual: saturate(cos(angle) * spot_scale + spot_offset)^2; 0 and 1 for a point light.
    spot_scale: f32,
    // Coefficients of the polynomial: constant, linear, quadratic.
    polynomial: vec3<f32>,
    spot_offset: f32,
}

// Strength at a squared distance, without the spot's cone. Zero from the range on.
fn distance_attenuation(light: Light, distance2: f32) -> f32 {
    let x2 = distance2 * light.inverse_range2;
    switch light.falloff {
        case INVERSE_SQUARE: {
            let window = saturate(1.0 - x2 * x2);
            return window * window / max(distance2, MIN_DISTANCE2);
        }
        case QUADRATIC: { return max(1.0 - x2, 0.0); }
        default: {
            let polynomial = light.polynomial.x + light.polynomial.y * sqrt(distance2) + light.polynomial.z * distance2;
            return select(0.0, 1.0 / max(polynomial, 1e-4), x2 < 1.0);
        }
    }
}

// `to_light` is a unit vector.
fn spot_attenuation(light: Light, to_light: vec3<f32>) -> f32 {
    let t = saturate(-dot(light.direction, to_light) * light.spot_scale + light.spot_offset);
    return t * t;
}
