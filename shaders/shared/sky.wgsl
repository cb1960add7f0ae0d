// Light of the sky around the scene, as PREFILTER left it.
#define_import_path afterlight::sky
#import afterlight::frame::{frame, to_sky}
#import afterlight::brdf::{Surface, COOK_TORRANCE, MIN_ROUGHNESS, PI}

// Radiance mirrored by a lobe about a direction: level 0 of a mirror, the last of a roughness of 1. In units of frame.sky_scale.
@group(0) @binding(7) var sky_lobe: texture_cube<f32>;
// Radiance collected by the cosine about a direction: the light that a white lambert surface reflects.
@group(0) @binding(8) var sky_base: texture_cube<f32>;
// By NdotV and roughness: the shares of the reflectances facing the eye and grazing that a lobe has of even light.
@group(0) @binding(9) var sky_table: texture_2d<f32>;
@group(0) @binding(10) var sky_sampler: sampler;

// Levels of sky_lobe beyond the first.
const ROUGHEST_LEVEL: f32 = 5.0; // host

// The direction in which a lobe of this alpha looks most: between the mirrored view and the normal (Lagarde and de Rousiers, "Moving Frostbite to
// Physically Based Rendering", 2014, listing 21).
fn dominant(normal: vec3<f32>, mirrored: vec3<f32>, roughness: f32) -> vec3<f32> {
    let alpha = roughness * roughness;
    let smoothness = 1.0 - alpha;
    return mix(normal, mirrored, smoothness * (sqrt(smoothness) + alpha));
}

// The light that a surface of Cook-Torrance collects of the sky, in units of frame.sky_scale, and its shares of it.
struct Collected {
    // From the lobe's direction, and by the cosine.
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

// A surface's reflection of the sky, in nits, all of which arrives. The base gets the light that the lobe leaves: together they reflect all of an
// even sky where nothing is absorbed. The Phong models' lobes have no share, as of other ambient light.
fn sky_light(surface: Surface, brdf: u32, perceptual_roughness: f32) -> vec3<f32> {
    let diffuse = surface.diffuse * PI;
    if brdf != COOK_TORRANCE {
        return diffuse * textureSampleLevel(sky_base, sky_sampler, to_sky(surface.normal), 0.0).rgb * frame.sky_scale;
    }
    let own = collected(surface, perceptual_roughness);
    return (own.single * own.lobe + (own.again + diffuse * (vec3(1.0) - own.single - own.again)) * own.base) * frame.sky_scale;
}

// The part of that which a lobe of Cook-Torrance mirrors, at once and again.
fn mirrored_sky(surface: Surface, perceptual_roughness: f32) -> vec3<f32> {
    let own = collected(surface, perceptual_roughness);
    return (own.single * own.lobe + own.again * own.base) * frame.sky_scale;
}

// Light of the sky collected by the cosine about a normal, in nits: the light that a white lambert surface reflects.
fn even_sky(normal: vec3<f32>) -> vec3<f32> {
    return textureSampleLevel(sky_base, sky_sampler, to_sky(normal), 0.0).rgb * frame.sky_scale;
}
