// Fog that grows thinner with height: along a metre at a height h it takes away density * exp(-(h - base) / height) of the light. It scatters light
// that comes from everywhere alike, and light of directional lights, which reaches it without loss or shadow: then a ray's gain is in proportion to
// its loss, and both are closed forms (docs/FOG.md).
#define_import_path afterlight::fog
#import afterlight::frame::{across, frame, view_ray, ORTHOGRAPHIC}
#ifdef LIGHTS
#import afterlight::lights::{lights}
#endif

const FOUR_PI: f32 = 12.566370614;
// Logarithms of densities, and optical depths, are cut off here: exp(-80) is 2e-35, which nobody sees.
const MOST_LOG: f32 = 80.0;

// The ray from the eye to the surface seen through a pixel.
struct FogRay {
    // Unit vector.
    direction: vec3<f32>,
    // Metres along it for each metre along the view.
    stretch: f32,
    // The height of its beginning, in scale heights above the fog's base.
    rise: f32,
}

fn fog_ray(pixel: vec2<f32>) -> FogRay {
    let ray = view_ray(pixel);
    let stretch = length(ray);
    let aside = select(0.0, across(pixel).y * frame.air.rate, ORTHOGRAPHIC);
    return FogRay(ray / stretch, stretch, frame.air.rise + aside);
}

// (1 - exp(-x)) / x for x >= 0: the mean of exp(-t) for t in 0..x.
fn mean_decay(x: f32) -> f32 {
    if x < 0.5 {
        // The difference would cancel. The first term left out is below 2e-7.
        return 1.0 - x * (1.0 / 2.0 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0 - x / 5040.0)))));
    }
    return (1.0 - exp(-x)) / x;
}

// Optical depth along `metres` of a ray. Symmetric in its ends: the fog is densest at the lower end, and falls from there on.
fn fog_depth(ray: FogRay, metres: f32) -> f32 {
    let climb = ray.direction.y * metres * frame.air.rate;
    let lowest = ray.rise + min(climb, 0.0);
    return metres * mean_decay(abs(climb)) * exp(min(frame.air.density - lowest, MOST_LOG));
}

// Optical depth of an endless ray. A ray that does not climb never leaves the fog.
fn endless_fog_depth(ray: FogRay) -> f32 {
    let climb = ray.direction.y * frame.air.rate;
    let here = exp(min(frame.air.density - ray.rise, MOST_LOG));
    return select(3.4e38, here / climb, climb > 0.0);
}

// The ray moved on by `metres`.
fn fog_moved(ray: FogRay, metres: f32) -> FogRay {
    return FogRay(ray.direction, ray.stretch, ray.rise + ray.direction.y * metres * frame.air.rate);
}

// The share of light that an optical depth takes away, of thin fog as well.
fn fog_lost(depth: f32) -> f32 {
    let most = min(depth, MOST_LOG);
    return most * mean_decay(most);
}

// The share of light that arrives. Never zero: light that a half float holds as infinite would then be no number.
fn fog_transmittance(depth: f32) -> f32 {
    return exp(-min(depth, MOST_LOG));
}

#ifdef LIGHTS
// Henyey and Greenstein 1941, by the square of the distance between the directions: near g = 1 their cosine tells little of their angle.
fn phase(direction: vec3<f32>, to_light: vec3<f32>, g: f32) -> f32 {
    let apart = direction - select(-to_light, to_light, g >= 0.0);
    let most = abs(g);
    let base = (1.0 - most) * (1.0 - most) + most * dot(apart, apart);
    return (1.0 - most) * (1.0 + most) / (FOUR_PI * base * sqrt(base));
}
#endif

// The exposed light that endless fog sends against the direction. A ray through less fog loses a share of its own light, and gains an equal share of
// this light.
fn fog_light(direction: vec3<f32>, largest: f32) -> vec3<f32> {
    var radiance = frame.air.light;
#ifdef LIGHTS
    for (var i = 0u; i < frame.directional_count; i++) {
        radiance += min(lights[i].color, vec3(1e30)) * (phase(direction, lights[i].position, frame.air.anisotropy) * frame.air.albedo);
    }
#endif
    return min(radiance * frame.exposure, vec3(largest));
}
