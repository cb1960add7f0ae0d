// REFLECT_RESOLVE: combines the hits of a pixel and of its neighbours, weighted by the pixel's own lobe. They replace the sky's light and the ambient
// light that AMBIENT and LIGHTING have added for the same share of the lobe. (T. Stachowiak, "Stochastic Screen-Space Reflections", SIGGRAPH 2015.)
// always: STORED MATERIAL
// variants: SPECULAR NORMAL_UINT SINGLE SKY_LIGHT
// counts: 16; with SPECULAR 8, NORMAL_UINT 8, SINGLE 8, SKY_LIGHT 8
#import afterlight::frame::{frame, position_at}
#import afterlight::gbuffer::{load_depth, load_texel, stored_depth}
#import afterlight::brdf::{ggx_lobe, half_vector, schlick, smith_root, COOK_TORRANCE}
#import afterlight::shading::{mirrored_ambient, surface_of, brdf_of, Model}
#ifdef SKY_LIGHT
#import afterlight::sky::{mirrored_sky}
#endif
#import afterlight::reflection::{lobe_share, smooth_enough, unpack_found}

@group(1) @binding(6) var rays: texture_2d<u32>;
#ifdef SINGLE
@group(1) @binding(7) var light: texture_storage_2d<rgba32float, read_write>;
#else
@group(1) @binding(7) var light: texture_storage_2d<rgba16float, read_write>;
#endif

override BRDF: u32 = 0u;
// Some surface is a metal.
override METAL: bool = true;
override NORMAL_ENCODING: u32 = 0u;
// There is light of the half-spheres.
override AMBIENT: bool = true;
override ROUGHEST: f32 = 0.6;
// Largest value that the target holds.
override LARGEST: f32 = 65000.0;
// The picture shows the hits.
override SHOWN: bool = false;

// Below this roughness a lobe is narrower than the difference between neighbours.
const MIRROR: f32 = 0.02;
// Largest weight of a neighbour's direction that is more frequent in the pixel's own lobe.
const MOST_WEIGHT: f32 = 4.0;

fn store(texel: vec2<i32>, radiance: vec3<f32>) {
    textureStore(light, texel, vec4(clamp(radiance, vec3(0.0), vec3(LARGEST)), 1.0));
}

@compute @workgroup_size(8, 8)
fn compute(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<i32>(textureDimensions(stored_depth));
    let texel = vec2<i32>(id.xy);
    if any(texel >= size) {
        return;
    }
    let pixel = vec2<f32>(texel) + 0.5;
    if load_depth(pixel) <= 0.0 {
        if SHOWN {
            store(texel, vec3(0.0));
        }
        return;
    }
    var own = load_texel(pixel, NORMAL_ENCODING, 0.0);
    own.metallic = select(0.0, own.metallic, METAL);
    let model = Model(BRDF, 0u, 0u, false, false, 0u, false);
    let surface = surface_of(own, model);
    let brdf = brdf_of(surface, model);
    let share = smooth_enough(own.roughness, ROUGHEST);
    if brdf != COOK_TORRANCE || share <= 0.0 {
        if SHOWN {
            store(texel, vec3(0.0));
        }
        return;
    }
    let reach = select(2, 0, own.roughness < MIRROR);
    var weights = 0.0;
    var met = 0.0;
    var sum = vec3(0.0);
    var plain = vec3(0.0);
    for (var y = -reach; y <= reach; y++) {
        for (var x = -reach; x <= reach; x++) {
            let other = texel + vec2(x, y);
            if any(other < vec2(0)) || any(other >= size) {
                continue;
            }
            let found = unpack_found(textureLoad(rays, other, 0));
            if found.density <= 0.0 {
                continue;
            }
            var direction = found.direction;
            if found.confidence > 0.0 && reach > 0 {
                // The pixel sees that ray's hit in another direction than the ray went.
                let there = vec2<f32>(other) + 0.5;
                let start = position_at(there, textureLoad(stored_depth, other, 0));
                direction = normalize(start + found.direction * found.distance - own.position);
            }
            let n_dot_l = dot(surface.normal, direction);
            if n_dot_l <= 0.0 {
                continue;
            }
            let half = half_vector(direction + surface.view);
            let smith = n_dot_l * surface.smith_v + surface.n_dot_v * smith_root(n_dot_l, surface.alpha_squared);
            let lobe = ggx_lobe(surface.normal, half.direction, surface.alpha_squared, smith) * n_dot_l;
            // Five across and five down, of which the outer ones count half: each tile of 4 x 4 has a choice of every sixteenth of the lobe.
            let beside = select(1.0, 0.5, abs(x) == 2) * select(1.0, 0.5, abs(y) == 2);
            let weight = beside * min(lobe / found.density, MOST_WEIGHT);
            weights += weight;
            met += weight * found.confidence;
            sum += weight * found.confidence * schlick(surface.specular, surface.grazing, min(0.5 * half.length, 1.0)) * found.light;
            plain += weight * found.confidence * found.light;
        }
    }
    let scale = select(0.0, share / weights, weights > 1e-6);
    if SHOWN {
        store(texel, plain * scale);
        return;
    }
    if met * scale <= 0.0 {
        return;
    }
    // Light that facets scatter a second time (as in sky.wgsl) comes from where the lobe looks, too.
    let once = lobe_share(surface.n_dot_v, own.roughness);
    let mean = surface.specular + (vec3(surface.grazing) - surface.specular) / 21.0;
    let mirrored = sum * scale * once / (vec3(1.0) - mean * (1.0 - once));
    var instead = vec3(0.0);
    if AMBIENT {
        instead += mirrored_ambient(surface, own, model);
    }
#ifdef SKY_LIGHT
    instead += mirrored_sky(surface, own.roughness) * own.occlusion;
#endif
    let before = textureLoad(light, texel).rgb;
    store(texel, before + mirrored - met * scale * instead * frame.exposure);
}
