// The shading of a surface: the same code, in the same order of operations, for every light path.
#define_import_path afterlight::shading
#import afterlight::frame::{frame}
#import afterlight::texel::{Texel}
#import afterlight::encodings::{decode_shininess}
#import afterlight::brdf::{Surface, cook_torrance_surface, ambient_lobe, phong_surface, reflect_ambient, reflect_light, COOK_TORRANCE, LAMBERT}
#import afterlight::textbook::{textbook_light}
#ifdef LIGHTS
#import afterlight::lights::{is_beam, lights, reach_of, reach_of_beam, strength_after, way_of, within_range, Reach, CONES}
#endif
#ifdef SHADOW
#import afterlight::shadows::{visibility}
#endif
#ifdef SKY_LIGHT
#import afterlight::sky::{sky_light}
#endif
#ifdef LOBES
#import afterlight::brdf::{ggx_lobe, half_vector, PI}
#import afterlight::lobes::{film_facing, film_reflectance, gathering, left_behind, left_by_lobes, groove_facet, groove_lobe, groove_roughness, groove_weight, over_surface, scattered_by_lobes, through_base, transmitted, DIFFUSE_TRANSMISSION, FACETS, FILM, GROOVES}
#ifdef SKY_LIGHT
#import afterlight::sky::{collected, even_sky, even_sky_behind, lobe_of_sky, lobe_share}
#endif
#endif

// The plan's knowledge of the scene. Passes fill it from specialization constants, so that absent features cost nothing.
struct Model {
    // The BRDF that all materials have; MIXED_BRDF where the scene mixes them.
    brdf: u32,
    // All lights' fall-off; MIXED_FALLOFF where they differ.
    falloff: u32,
    // Bits of the traits that some light of the plan has: ranges, cones, beams (lights.wgsl).
    traits: u32,
    // Some directional light, some point or spot light has shadow maps.
    directional_shadows: bool,
    punctual_shadows: bool,
    // The filter of shadow maps (shadows.wgsl).
    shadow_filter: u32,
    // Reflection models as textbooks have them (textbook.wgsl).
    textbook: bool,
}

const MIXED_BRDF: u32 = 4u; // host

// A surface that is ready to be lit, seen from the camera.
fn surface_of(texel: Texel, model: Model) -> Surface {
    let view = normalize(-texel.ray);
    let brdf = select(model.brdf, texel.brdf, model.brdf == MIXED_BRDF);
    if brdf == COOK_TORRANCE {
        return cook_torrance_surface(texel.normal, view, texel.albedo, texel.metallic, texel.roughness, texel.dielectric);
    }
    var shininess = 0.0;
    if brdf != LAMBERT {
        shininess = decode_shininess(texel.roughness);
    }
    return phong_surface(texel.normal, view, texel.albedo, texel.specular, shininess, brdf);
}

// The BRDF to switch on: the model's constant, unless BRDFs are mixed.
fn brdf_of(surface: Surface, model: Model) -> u32 {
    return select(model.brdf, surface.brdf, model.brdf == MIXED_BRDF);
}

#ifdef LOBES
// Cook-Torrance with the Fresnel term of a thin film, or a highlight that grooves stretch. The film's brightest channel darkens the base, or the base
// would have the opposite colour.
fn filmed_light(surface: Surface, to_light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    let half = half_vector(to_light + surface.view);
    let v_dot_h = min(0.5 * half.length, 1.0);
    let x = 1.0 - v_dot_h;
    let x2 = x * x;
    var fresnel = surface.specular + surface.fresnel_rise * (x2 * x2 * x);
    var taken = fresnel;
    if FILM {
        fresnel = film_reflectance(v_dot_h, fresnel);
        taken = vec3(max(fresnel.r, max(fresnel.g, fresnel.b)));
    }
    if GROOVES {
        let lobe = groove_lobe(half.direction, dot(surface.normal, half.direction), surface.view, surface.n_dot_v, to_light, n_dot_l);
        return surface.diffuse * (vec3(1.0) - taken) + fresnel * lobe;
    }
    let smith = n_dot_l * surface.smith_v + surface.n_dot_v * sqrt(n_dot_l * n_dot_l * surface.smith_slope + surface.alpha_squared);
    let lobe = ggx_lobe(surface.normal, half.direction, surface.alpha_squared, smith);
    return surface.diffuse * (vec3(1.0) - taken) + fresnel * lobe;
}

// True for light that arrives at the back of a surface which lets it through.
fn is_behind(n_dot_l: f32) -> bool {
    return DIFFUSE_TRANSMISSION && n_dot_l < 0.0;
}

// The surface as it reflects light from everywhere: under a film, with its reflectance at the angle of the eye.
fn in_even_light(surface: Surface) -> Surface {
    var even = surface;
    if FILM {
        even.specular = film_facing(surface.specular, surface.grazing, surface.n_dot_v);
        even.fresnel_rise = vec3(surface.grazing) - even.specular;
    }
    return even;
}

#ifdef SKY_LIGHT
// Light of the sky along a highlight that grooves stretch, in nits: the mean over facets.
fn stretched_sky(surface: Surface, roughness: f32) -> vec3<f32> {
    let level = groove_roughness(roughness);
    var sum = vec3(0.0);
    var weights = 0.0;
    for (var i = 0u; i < FACETS; i++) {
        let facet = groove_facet(i, surface.normal);
        let v_dot_h = dot(surface.view, facet);
        let light = 2.0 * v_dot_h * facet - surface.view;
        let n_dot_l = dot(surface.normal, light);
        if v_dot_h > 0.0 && n_dot_l > 0.0 {
            let weight = groove_weight(dot(surface.normal, facet), v_dot_h, surface.view, surface.n_dot_v, light, n_dot_l);
            sum += weight * lobe_of_sky(light, level);
            weights += weight;
        }
    }
    return sum / max(weights, 1e-9);
}
#endif
#endif

// f(l, v), with the sign of n.l: light at the back of a surface that lets it through is the product of two negative numbers.
fn reflected(surface: Surface, model: Model, to_light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    if model.textbook {
        return textbook_light(surface, brdf_of(surface, model), to_light, n_dot_l);
    }
#ifdef LOBES
    if is_behind(n_dot_l) {
        return transmitted(surface, to_light, n_dot_l) * -left_behind(n_dot_l);
    }
    var below = vec3(0.0);
    if FILM || GROOVES {
        below = filmed_light(surface, to_light, n_dot_l);
    } else {
        below = reflect_light(surface, brdf_of(surface, model), to_light, n_dot_l);
    }
    return over_surface(below, surface.normal, surface.view, surface.n_dot_v, to_light, n_dot_l);
#else
    return reflect_light(surface, brdf_of(surface, model), to_light, n_dot_l);
#endif
}

// Light from two half-spheres, sky and ground. The base collects it by the cosine, which is exact: mean + tilt n.y. The lobe is taken to do the same
// about the mirrored direction: exact for a lobe as wide as the cosine's, and too soft at the horizon for a narrower one. Where both half-spheres are
// the same, this is the same to the last bit as if there were one: the tilt is zero.
fn ambient_light(surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    let lobe = ambient_lobe(surface, brdf_of(surface, model), texel.roughness);
    let even = (frame.ambient + frame.ambient_tilt * surface.normal.y) * texel.occlusion * reflect_ambient(surface, lobe);
    let mirrored_y = 2.0 * dot(surface.normal, surface.view) * surface.normal.y - surface.view.y;
    // Not below zero where rounding makes the normal longer than 1.
    return max(even + frame.ambient_tilt * ((mirrored_y - surface.normal.y) * texel.occlusion) * lobe, vec3(0.0));
}

// The part of ambient light that the lobe mirrors.
fn mirrored_ambient(surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    let lobe = ambient_lobe(surface, brdf_of(surface, model), texel.roughness);
    let mirrored_y = 2.0 * dot(surface.normal, surface.view) * surface.normal.y - surface.view.y;
    return max((frame.ambient + frame.ambient_tilt * mirrored_y) * texel.occlusion * lobe, vec3(0.0));
}

#ifdef LOBES
// Ambient light that comes through the surface from its back.
fn ambient_through(surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    let lobe = ambient_lobe(surface, brdf_of(surface, model), texel.roughness);
    let behind = max((frame.ambient - frame.ambient_tilt * surface.normal.y) * texel.occlusion, vec3(0.0));
    return behind * (through_base() * PI) * (vec3(1.0) - lobe);
}

// Ambient light that lobes beside base and highlight scatter.
fn ambient_of_lobes(surface: Surface, texel: Texel) -> vec3<f32> {
    return max((frame.ambient + frame.ambient_tilt * surface.normal.y) * texel.occlusion, vec3(0.0)) * scattered_by_lobes();
}
#endif

#ifdef LIGHTS
// True where a light falls on the surface, by any number with the sign of n.l.
fn is_lit_by(facing: f32) -> bool {
#ifdef LOBES
    return facing > 0.0 || is_behind(facing);
#else
    return facing > 0.0;
#endif
}

// The normal of the side that a light falls on, where its shadows are looked up: from the other one the surface would lie in its own shadow.
fn lit_side(texel: Texel, n_dot_l: f32) -> vec3<f32> {
#ifdef LOBES
    return select(texel.geometric_normal, -texel.geometric_normal, is_behind(n_dot_l));
#else
    return texel.geometric_normal;
#endif
}

// The addend of directional light number `i`.
// ANCHOR: directional-light
fn directional_light(i: u32, surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    let to_light = lights[i].position;
    let n_dot_l = dot(surface.normal, to_light);
    if !is_lit_by(n_dot_l) {
        return vec3(0.0);
    }
    var light = lights[i].color * (n_dot_l * reflected(surface, model, to_light, n_dot_l));
#ifdef SHADOW
    if model.directional_shadows && texel.receives {
        light *= visibility(lights[i].falloff, texel.position, lit_side(texel, n_dot_l), to_light, model.shadow_filter);
    }
#endif
    return light;
}
// ANCHOR_END: directional-light

// Returns true if point or spot light number `i` brings anything to a place.
fn reaches(i: u32, position: vec3<f32>, model: Model) -> bool {
    return reach_of(lights[i], position, model.falloff, model.traits).strength > 0.0;
}

// The light that light number `i` brings to a surface that faces it.
fn lit(i: u32, reach: Reach, n_dot_l: f32, surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    var share = vec3(reach.strength * n_dot_l);
#ifdef SHADOW
    if model.punctual_shadows && texel.receives {
        share *= visibility(lights[i].falloff, texel.position, lit_side(texel, n_dot_l), reach.to_light, model.shadow_filter);
    }
#endif
    return lights[i].color * (share * reflected(surface, model, reach.to_light, n_dot_l));
}

// Adds the light of punctual light number `i` if it is wanted; exactly zero out of its range, its cone, and behind an opaque surface.
fn add_punctual(radiance: ptr<function, vec3<f32>>, i: u32, wanted: bool, surface: Surface, texel: Texel, model: Model) {
    if is_beam(lights[i], model.traits) {
        let reach = reach_of_beam(lights[i], texel.position, model.traits);
        let n_dot_l = dot(surface.normal, reach.to_light);
        if wanted && is_lit_by(n_dot_l) && reach.strength > 0.0 {
            *radiance += lit(i, reach, n_dot_l, surface, texel, model);
        }
        return;
    }
    let offset = lights[i].position - texel.position;
    let facing = dot(surface.normal, offset);
    let distance_squared = dot(offset, offset);
    // Asked before the square root, since lavapipe branches where no lane of a vector goes on, and half of all lights are behind a wall's surface.
    if wanted && is_lit_by(facing) && within_range(lights[i], distance_squared, model.traits) {
        let way = way_of(offset, distance_squared);
        let strength = strength_after(way, lights[i], model.falloff, model.traits);
        if (model.traits & CONES) == 0u || strength > 0.0 {
            *radiance += lit(i, Reach(way.to_light, strength), facing * way.inverse_distance, surface, texel, model);
        }
    }
}

// The light of punctual light number `i` alone.
fn punctual_light(i: u32, surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
    var radiance = vec3(0.0);
    add_punctual(&radiance, i, true, surface, texel, model);
    return radiance;
}
#endif

// The kinds of light that meet every pixel; true for the kinds that exist.
struct Everywhere {
    ambient: bool,
    directional: bool,
    punctual: bool,
    // The first punctual light that the path deals with otherwise.
    end: u32,
}

// Light that meets every pixel. Paths add their own after it, so that all of them sum in one order.
fn light_everywhere(surface: Surface, texel: Texel, model: Model, which: Everywhere) -> vec3<f32> {
    var radiance = vec3(0.0);
    if which.ambient {
#ifdef LOBES
        let own = in_even_light(surface);
        var below = ambient_light(own, texel, model);
        if DIFFUSE_TRANSMISSION {
            below += ambient_through(own, texel, model);
        }
        radiance += below * left_by_lobes() + ambient_of_lobes(surface, texel);
#else
        radiance += ambient_light(surface, texel, model);
#endif
    }
#ifdef SKY_LIGHT
#ifdef LOBES
    let even = in_even_light(surface);
    var below = sky_light(even, brdf_of(surface, model), texel);
    if GROOVES {
        // The mirrored light of the stretched highlight in the place of one that is as wide in each direction, of which the same share arrives.
        let own = collected(even, texel.roughness);
        let stretched = stretched_sky(surface, texel.roughness) - own.lobe * frame.sky_scale;
        below = max(below + own.single * stretched * lobe_share(), vec3(0.0));
    }
    if DIFFUSE_TRANSMISSION {
        let own = collected(even, texel.roughness);
        below += through_base() * PI * (vec3(1.0) - own.single - own.again) * even_sky_behind(surface.normal, texel);
    }
    below *= left_by_lobes();
    let toward = gathering(surface.normal, surface.view, surface.n_dot_v);
    radiance += (below + even_sky(toward) * scattered_by_lobes()) * texel.occlusion;
#else
    radiance += sky_light(surface, brdf_of(surface, model), texel) * texel.occlusion;
#endif
#endif
#ifdef LIGHTS
    // Mesa 22's lavapipe compiles a shader with the values of its uniforms inserted, and again for each frame (0.3 s), if that removes half of it, as
    // with loops whose bounds are uniforms. This term hides the bounds from it: a cosine is never above 2, nor is NaN.
    let untold = u32(surface.n_dot_v > 2.0);
    if which.directional {
        let end = frame.directional_count + untold;
        for (var i = 0u; i < end; i++) {
            radiance += directional_light(i, surface, texel, model);
        }
    }
    if which.punctual {
        let end = which.end + untold;
        for (var i = frame.directional_count; i < end; i++) {
            add_punctual(&radiance, i, true, surface, texel, model);
        }
    }
#endif
    return radiance;
}
