// Light of the sky around the scene, as PREFILTER left it.
#define_import_path afterlight::sky
#import afterlight::frame::{frame, to_sky}
#import afterlight::brdf::{Surface, COOK_TORRANCE, MIN_ROUGHNESS, PI}
#import afterlight::texel::{Texel}
#ifdef SHADOW
#import afterlight::brdf::{ggx_lobe, half_vector, smith_root}
#import afterlight::shadows::{shadow_views, visibility_in}
#endif

// Radiance mirrored by a lobe about a direction: level 0 of a mirror, the last of a roughness of 1. In units of frame.sky_scale.
@group(0) @binding(7) var sky_lobe: texture_cube<f32>;
// Radiance collected by the cosine about a direction: the light that a white lambert surface reflects.
@group(0) @binding(8) var sky_base: texture_cube<f32>;
// By NdotV and roughness: the shares of the reflectances facing the eye and grazing that a lobe has of even light.
@group(0) @binding(9) var sky_table: texture_2d<f32>;
@group(0) @binding(10) var sky_sampler: sampler;

// Levels of sky_lobe beyond the first.
const ROUGHEST_LEVEL: f32 = 5.0; // host
// The most directions that a frame draws from the sky.
const SKY_DIRECTIONS: u32 = 32u; // host

// The direction in which a lobe of this alpha looks most: between the mirrored view and the normal (Lagarde and de Rousiers, "Moving Frostbite to
// Physically Based Rendering", 2014, listing 21).
fn dominant(normal: vec3<f32>, mirrored: vec3<f32>, roughness: f32) -> vec3<f32> {
    let alpha = roughness * roughness;
    let smoothness = 1.0 - alpha;
    return mix(normal, mirrored, smoothness * (sqrt(smoothness) + alpha));
}

// Light that a Cook-Torrance surface collects from the sky, in units of frame.sky_scale, and the shares of it that the surface reflects.
struct Collected {
    // Light mirrored about the lobe's direction, and light collected by the cosine.
    lobe: vec3<f32>,
    base: vec3<f32>,
    // The share of the first that is mirrored at once; the share of the second that is mirrored again.
    single: vec3<f32>,
    again: vec3<f32>,
}

// The lobe by the split sum (Karis, "Real Shading in Unreal Engine 4", 2013). Light that it does not mirror at once is mirrored again, evenly
// (Fdez-Aguera, "A Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting", 2019).
fn collected(surface: Surface, perceptual_roughness: f32) -> Collected {
    var own: Collected;
    own.base = textureSampleLevel(sky_base, sky_sampler, to_sky(surface.normal), 0.0).rgb;
    let roughness = max(perceptual_roughness, MIN_ROUGHNESS);
    let mirrored = 2.0 * dot(surface.normal, surface.view) * surface.normal - surface.view;
    let toward = to_sky(dominant(surface.normal, mirrored, roughness));
    own.lobe = textureSampleLevel(sky_lobe, sky_sampler, toward, roughness * ROUGHEST_LEVEL).rgb;
    let shares = textureSampleLevel(sky_table, sky_sampler, vec2(surface.n_dot_v, roughness), 0.0).xy;
    own.single = surface.specular * shares.x + vec3(surface.grazing * shares.y);
    // The light that the lobe of a perfect mirror leaves is scattered again; each time the mean of Schlick's Fresnel over all angles is kept.
    let missing = 1.0 - shares.x - shares.y;
    let mean = surface.specular + (vec3(surface.grazing) - surface.specular) / 21.0;
    own.again = missing * own.single * mean / (vec3(1.0) - mean * missing);
    return own;
}

#ifdef SHADOW
// The directions that the sky's light arrives from in this frame, each with a shadow map from the first on; 0 where nothing hides any of it.
override SKY_SHADOWS: u32 = 0u;
override SKY_MAP: u32 = 0u;
// The edges of many shadows blur each other, so from 8 frames on the smallest interpolating filter has the least error (docs/SKY.md). The filter's
// code also selects tinted shadows.
override SKY_FILTER: u32 = 1u;
// Mirrored light has shadows as well. Off with screen-space reflections, whose hits replace that light.
override SKY_LOBE_SHADOWS: bool = true;

// Minimum alpha squared with which directions are weighted for a lobe. The lobe of a smoother surface may contain no direction; this floor gives the
// nearest directions weight.
const WIDEST_OF_NARROW: f32 = 0.01;

// One of these directions; src/gpu_scene/sky.rs has the same record.
struct SkyDirection {
    // Unit vector.
    to_light: vec3<f32>,
    // Light on a surface that faces it; the mean of all directions over all frames is the sky.
    lux: vec3<f32>,
}

@group(0) @binding(12) var<uniform> sky_directions: array<SkyDirection, SKY_DIRECTIONS>;

// Shares of the sky's light that arrive at the lit surface: of light collected by the cosine, per channel, and of the lobe's light.
var<private> arrived_share: vec3<f32> = vec3(1.0);
var<private> arrived_lobe: vec3<f32> = vec3(1.0);

// Finds these shares from the directions of this frame, weighted by the light of each. Summing the directions' light would be unbiased, but would
// vary from frame to frame even where nothing is hidden; a share is exact there, and elsewhere errs by one part in the number of directions. A lobe
// may be much narrower than the spacing of the directions; its share is then taken from the nearest ones.
fn find_shares(surface: Surface, brdf: u32, texel: Texel) {
    var base = vec3(0.0);
    var sum = vec3(0.0);
    var weights = 0.0;
    var met = vec3(0.0);
    let alpha_squared = max(surface.alpha_squared, WIDEST_OF_NARROW);
    for (var i = 0u; i < SKY_SHADOWS; i++) {
        let own = sky_directions[i];
        let n_dot_l = dot(surface.normal, own.to_light);
        if n_dot_l <= 0.0 {
            continue;
        }
        var seen = vec3(1.0);
        if texel.receives {
            seen = visibility_in(shadow_views[SKY_MAP + i], texel.position, texel.geometric_normal, SKY_FILTER);
        }
        base += own.lux * (n_dot_l * seen);
        sum += own.lux * n_dot_l;
        if brdf == COOK_TORRANCE && SKY_LOBE_SHADOWS {
            let smith = n_dot_l * surface.smith_v + surface.n_dot_v * smith_root(n_dot_l, alpha_squared);
            let half = half_vector(own.to_light + surface.view).direction;
            let weight = ggx_lobe(surface.normal, half, alpha_squared, smith) * n_dot_l * dot(own.lux, vec3(1.0));
            weights += weight;
            met += weight * seen;
        }
    }
    arrived_share = select(vec3(1.0), base / sum, sum > vec3(0.0));
    arrived_lobe = select(vec3(1.0), met / weights, weights > 0.0);
}
#endif

// A surface's reflection of the sky, in nits. The base gets the light that the lobe leaves: together they reflect all of an
// even sky where nothing is absorbed. The Phong models' lobes have no share, as of other ambient light.
fn sky_light(surface: Surface, brdf: u32, texel: Texel) -> vec3<f32> {
    let diffuse = surface.diffuse * PI;
#ifdef SHADOW
    if SKY_SHADOWS > 0u {
        find_shares(surface, brdf, texel);
        let base = even_sky(surface.normal);
        if brdf != COOK_TORRANCE {
            return diffuse * base;
        }
        let own = collected(surface, texel.roughness);
        let around = select(own.base * frame.sky_scale, base, SKY_LOBE_SHADOWS);
        let mirrored = own.single * own.lobe * (arrived_lobe * frame.sky_scale) + own.again * around;
        return mirrored + diffuse * (vec3(1.0) - own.single - own.again) * base;
    }
#endif
    if brdf != COOK_TORRANCE {
        return diffuse * textureSampleLevel(sky_base, sky_sampler, to_sky(surface.normal), 0.0).rgb * frame.sky_scale;
    }
    let own = collected(surface, texel.roughness);
    return (own.single * own.lobe + (own.again + diffuse * (vec3(1.0) - own.single - own.again)) * own.base) * frame.sky_scale;
}

// The part of that which a lobe of Cook-Torrance mirrors, at once and again.
fn mirrored_sky(surface: Surface, perceptual_roughness: f32) -> vec3<f32> {
    let own = collected(surface, perceptual_roughness);
    return (own.single * own.lobe + own.again * own.base) * frame.sky_scale;
}

// Sky light collected by the cosine about a normal, in nits: the light that a white Lambert surface reflects. Requires an earlier call of
// `sky_light`, which finds the share that arrives.
fn even_sky(normal: vec3<f32>) -> vec3<f32> {
    var share = vec3(1.0);
#ifdef SHADOW
    share = arrived_share;
#endif
    return textureSampleLevel(sky_base, sky_sampler, to_sky(normal), 0.0).rgb * (frame.sky_scale * share);
}

#ifdef LOBES
// Variant of `even_sky` for light that arrives at the back of a surface: it computes its own shadows, because this light comes from the other half of
// the sky.
fn even_sky_behind(normal: vec3<f32>, texel: Texel) -> vec3<f32> {
    var share = vec3(1.0);
#ifdef SHADOW
    var base = vec3(0.0);
    var sum = vec3(0.0);
    for (var i = 0u; i < SKY_SHADOWS; i++) {
        let own = sky_directions[i];
        let cosine = -dot(normal, own.to_light);
        if cosine <= 0.0 {
            continue;
        }
        var seen = vec3(1.0);
        if texel.receives {
            seen = visibility_in(shadow_views[SKY_MAP + i], texel.position, -texel.geometric_normal, SKY_FILTER);
        }
        base += own.lux * (cosine * seen);
        sum += own.lux * cosine;
    }
    share = select(share, base / sum, sum > vec3(0.0));
#endif
    return textureSampleLevel(sky_base, sky_sampler, to_sky(-normal), 0.0).rgb * (frame.sky_scale * share);
}
#endif

// Share of the lobe's sky light that arrives. Requires an earlier call of `sky_light`, which finds it.
fn lobe_share() -> vec3<f32> {
#ifdef SHADOW
    return arrived_lobe;
#else
    return vec3(1.0);
#endif
}

// Light of the sky that a lobe of this roughness mirrors about a direction, in nits.
fn lobe_of_sky(direction: vec3<f32>, roughness: f32) -> vec3<f32> {
    return textureSampleLevel(sky_lobe, sky_sampler, to_sky(direction), roughness * ROUGHEST_LEVEL).rgb * frame.sky_scale;
}
