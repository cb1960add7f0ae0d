// LIGHTING: every light on every pixel that has a surface. The triangle lies at depth 0 and is drawn with compare LESS, so
// the sky, which has depth 0, costs nothing.
// variants: LIGHTS UNIFORM_BUFFER SHADOW MATERIAL SPECULAR POSITION NORMAL_UINT
// requires: SHADOW -> LIGHTS
// requires: UNIFORM_BUFFER -> LIGHTS
// precise
#import afterlight::frame::{frame}
#import afterlight::screen::{screen_corner}
#import afterlight::gbuffer::{load_texel, Texel}
#import afterlight::encodings::{decode_shininess}
#import afterlight::brdf::{Surface, cook_torrance_surface, phong_surface, reflect_ambient, reflect_light, COOK_TORRANCE, LAMBERT}
#ifdef LIGHTS
#import afterlight::lights::{lights, reach_of, spot_attenuation}
#endif
#ifdef SHADOW
#import afterlight::shadows::{sun_visibility}
#endif
#import afterlight::tonemapping::{tone_map}

// Which BRDF all materials have; 4 where the scene mixes them.
override BRDF: u32 = 0u;
override NORMAL_ENCODING: u32 = 0u;
override GEOMETRIC_STEPS: f32 = 255.0;
override AMBIENT: bool = true;
override DIRECTIONAL: bool = true;
override PUNCTUAL: bool = true;
override SPOT: bool = true;
// All lights' fall-off; 3 where they differ.
override FALLOFF: u32 = 3u;
// Some light has a range.
override RANGED: bool = true;
// No HDR target: tone-map straight into the output.
override TONE_MAP: bool = true;
override OPERATOR: u32 = 0u;
// Largest value that the target holds.
override LARGEST: f32 = 65000.0;
// The view of the light alone: albedo 1, not metallic.
override LIGHT_ONLY: bool = false;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return screen_corner(index);
}

fn surface_of(texel: Texel, view: vec3<f32>) -> Surface {
    var albedo = texel.albedo;
    var metallic = texel.metallic;
    if LIGHT_ONLY {
        albedo = vec3(1.0);
        metallic = 0.0;
    }
    let brdf = select(BRDF, texel.brdf, BRDF == 4u);
    if brdf == COOK_TORRANCE {
        return cook_torrance_surface(texel.normal, view, albedo, metallic, texel.roughness);
    }
    var shininess = 0.0;
    if brdf != LAMBERT {
        shininess = decode_shininess(texel.roughness);
    }
    return phong_surface(texel.normal, view, albedo, texel.specular, shininess, brdf);
}

#ifdef LIGHTS
fn directional_light(surface: Surface, brdf: u32, texel: Texel) -> vec3<f32> {
    var sum = vec3(0.0);
    let end = frame.directional_count;
    for (var i = 0u; i < end; i++) {
        let to_light = lights[i].position;
        let n_dot_l = dot(surface.normal, to_light);
        if n_dot_l > 0.0 {
            var light = lights[i].color * reflect_light(surface, brdf, to_light, n_dot_l);
#ifdef SHADOW
            if i == 0u {
                light *= sun_visibility(texel.position, texel.geometric_normal);
            }
#endif
            sum += light;
        }
    }
    return sum;
}

fn punctual_light(surface: Surface, brdf: u32, position: vec3<f32>) -> vec3<f32> {
    var sum = vec3(0.0);
    let end = frame.light_count;
    for (var i = frame.directional_count; i < end; i++) {
        let light = lights[i];
        let reach = reach_of(light, position, select(FALLOFF, light.falloff, FALLOFF == 3u), RANGED);
        let n_dot_l = dot(surface.normal, reach.to_light);
        var strength = reach.strength;
        if SPOT {
            strength *= spot_attenuation(light, reach.to_light);
        }
        if n_dot_l > 0.0 && strength > 0.0 {
            sum += light.color * (strength * reflect_light(surface, brdf, reach.to_light, n_dot_l));
        }
    }
    return sum;
}
#endif

@fragment
fn fragment(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    let texel = load_texel(pixel.xy, NORMAL_ENCODING, GEOMETRIC_STEPS);
    let view = normalize(-texel.position);
    let surface = surface_of(texel, view);
    // The switch of the model goes by a constant where there is one.
    let brdf = select(BRDF, surface.brdf, BRDF == 4u);
    var radiance = vec3(0.0);
    if AMBIENT {
        radiance += frame.ambient * texel.occlusion * reflect_ambient(surface, brdf, texel.roughness);
    }
#ifdef LIGHTS
    if DIRECTIONAL {
        radiance += directional_light(surface, brdf, texel);
    }
    if PUNCTUAL {
        radiance += punctual_light(surface, brdf, texel.position);
    }
#endif
    let exposed = min(radiance * frame.exposure, vec3(LARGEST));
    if TONE_MAP {
        return vec4(tone_map(exposed, OPERATOR), 1.0);
    }
    return vec4(exposed, 1.0);
}
