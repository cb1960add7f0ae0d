// FORWARD, LOBES and TRANSPARENT: surfaces are lit while they are rasterized, by the same code as in LIGHTING.
// variants: TEXTURED NORMAL_MAP EXTRAS LIGHTS UNIFORM_BUFFER CLUSTERED SHADOW WEIGHTED SKY_LIGHT LOBES
// requires: NORMAL_MAP -> TEXTURED
// requires: UNIFORM_BUFFER -> LIGHTS
// requires: CLUSTERED -> LIGHTS
// requires: SHADOW -> LIGHTS | SKY_LIGHT
// requires: LOBES -> EXTRAS
// excludes: SKY_LIGHT UNIFORM_BUFFER
// excludes: LOBES UNIFORM_BUFFER
// excludes: LOBES WEIGHTED
// precise
// counts: 213; with TEXTURED 142, NORMAL_MAP 71, EXTRAS 123, LIGHTS 168, UNIFORM_BUFFER 48, CLUSTERED 84, SHADOW 99, WEIGHTED 90, SKY_LIGHT 90, LOBES 33
#import afterlight::frame::{frame, view_ray, ORTHOGRAPHIC}
#import afterlight::encodings::{encode_shininess}
#import afterlight::brdf::{coat_share, usual_dielectric, Dielectric, Surface, MIN_ROUGHNESS}
#import afterlight::instance::{Rows, world_normal, world_position, world_tangent}
#ifdef LOBES
#import afterlight::instance::{scale_of}
#endif
#import afterlight::material::{plain_point, push}
#import afterlight::vectors::{unit_or}
#ifdef TEXTURED
#import afterlight::material::{emissive_at, mapped_normal, point_at, Uvs}
#ifdef EXTRAS
#import afterlight::instance::{layer_of}
#import afterlight::material::{mapped_uvs}
#endif
#endif
#ifdef EXTRAS
#import afterlight::instance::{highlighted, is_selected, packed_look, tint_of, unpacked_look}
#import afterlight::strokes::{corner_offset, stroke_corner}
#endif
#import afterlight::shading::{light_everywhere, surface_of, Everywhere, Model}
#ifdef LIGHTS
#import afterlight::shading::{directional_light}
#endif
#ifdef CLUSTERED
#import afterlight::shading::{add_punctual}
#import afterlight::clusters::{cluster_at, cluster_lights}
#endif
#ifdef LOBES
#import afterlight::lobes::{dim_transmission, take_below, take_grooves, take_lobes, take_transmission, DIFFUSE_TRANSMISSION, GROOVES}
#import afterlight::refraction::{glass_of, light_straight_behind, light_through_glass, REFRACTS}
#endif
#import afterlight::fogged::{seen_through_air}
#import afterlight::texel::{Texel}
#import afterlight::tonemapping::{tone_map}
#ifdef WEIGHTED
#import afterlight::weights::{weight_of}
#endif

// Bits of the textures that a material has (material.wgsl).
override TEXTURES: u32 = 0u;
// Colours of vertices multiply the base colour and alpha.
override COLORED: bool = false;
// And the light that the surface emits. So do tints of instances.
override COLORED_LIGHT: bool = false;
// Instances have looks.
override LOOKS: bool = false;
// The mesh is points and lines (strokes.wgsl).
override STROKES: bool = false;
override MASKED: bool = false;
override TWO_SIDED: bool = false;
// Shadows fall on it.
override RECEIVES: bool = true;
// The material's BRDF, which decides if its roughness is a shininess.
override BRDF: u32 = 0u;
// Reflection models as textbooks have them.
override TEXTBOOK: bool = false;
override PHONG: bool = false;
// The material has a reflectance of its dielectric share.
override REFLECTANCE: bool = false;
// Emitted light is shown.
override EMISSIVE: bool = true;
override AMBIENT: bool = true;
override DIRECTIONAL: bool = true;
// One of them is all there is.
override ONE_DIRECTIONAL: bool = false;
override PUNCTUAL: bool = true;
// All lights' fall-off; 3 where they differ.
override FALLOFF: u32 = 3u;
// Bits of the traits that some light of the plan has: ranges, cones, beams (lights.wgsl).
override TRAITS: u32 = 0xffffffffu;
// The filter of shadow maps.
override SHADOW_FILTER: u32 = 2u;
// The kinds of lights with shadow maps.
override DIRECTIONAL_SHADOWS: bool = true;
override PUNCTUAL_SHADOWS: bool = true;
// Some surface is a metal.
override METAL: bool = true;
// The view of the light alone: albedo 1, not metallic.
override LIGHT_ONLY: bool = false;
// Nothing is blended over this surface: tone-map straight into the output.
override TONE_MAP: bool = false;
override OPERATOR: u32 = 0u;
// A pixel has several samples.
override MULTISAMPLED: bool = false;
// Largest value that the target takes.
override LARGEST: f32 = 65000.0;
// The surface over the one behind it: 0 hides it, 1 is times alpha as a whole, 2 keeps its highlights whole, 3 has nothing but highlights, as much of
// them as it hides.
override OPACITY: u32 = 0u;
// The most that a surface may add beyond its share of LARGEST. src/passes/transparent.rs chooses it so that no sum overflows.
override HIGHLIGHT: f32 = 0.0;
// Weight of a surface at the eye, the least one as a share of it, and the most that a surface may add to a sum; as HIGHLIGHT.
override WEIGHT: f32 = 1.0;
override LEAST: f32 = 0.000244140625;
override PEAK: f32 = 1e28;

const HIDES: u32 = 0u; // host
const BLEND: u32 = 1u; // host
const GLASS: u32 = 2u; // host
const COAT: u32 = 3u; // host

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
#ifdef TEXTURED
    @location(2) uv: vec2<f32>,
#endif
#ifdef NORMAL_MAP
    @location(3) tangent: vec4<f32>,
#endif
#ifdef EXTRAS
    @location(4) color: vec4<f32>,
#ifdef TEXTURED
    @location(5) second_uv: vec2<f32>,
#endif
#endif
    // Rows of the instance's map from mesh space to the world around the camera.
    @location(8) row_x: vec4<f32>,
    @location(9) row_y: vec4<f32>,
    @location(10) row_z: vec4<f32>,
#ifdef EXTRAS
    // Look of the instance (material.wgsl).
    @location(13) look: vec4<u32>,
    // The other end of a stroke. Normals, tangents and second coordinates are the own end's.
    @location(6) other_end: vec3<f32>,
    @location(7) other_color: vec4<f32>,
#ifdef TEXTURED
    @location(15) other_uv: vec2<f32>,
#endif
    @builtin(vertex_index) own: u32,
#endif
}

// Centroid: as in geometry.wgsl. A pixel with several samples is shaded once for each triangle in it, on the triangle.
struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(1) @interpolate(perspective, centroid) normal: vec3<f32>,
#ifdef TEXTURED
#ifdef EXTRAS
    // Coordinates as in `Uvs`.
    @location(2) @interpolate(perspective, centroid) base_and_normal: vec4<f32>,
    @location(6) @interpolate(perspective, centroid) metal_and_occlusion: vec4<f32>,
    @location(7) @interpolate(perspective, centroid) emissive_and_specular: vec4<f32>,
    @location(8) @interpolate(perspective, centroid) of_shininess: vec4<f32>,
#ifdef LOBES
    @location(9) @interpolate(perspective, centroid) of_film: vec4<f32>,
    @location(12) @interpolate(perspective, centroid) of_diffuse_transmission: vec2<f32>,
#endif
#else
    @location(2) @interpolate(perspective, centroid) uv: vec2<f32>,
#endif
#endif
#ifdef NORMAL_MAP
    @location(3) @interpolate(perspective, centroid) tangent: vec4<f32>,
#endif
    @location(4) @interpolate(perspective, centroid) world: vec3<f32>,
#ifdef EXTRAS
    // The colour of the vertex.
    @location(5) @interpolate(perspective, centroid) color: vec4<f32>,
    // The look of the instance (`packed_look`).
    @location(10) @interpolate(flat) look: vec2<u32>,
#endif
#ifdef LOBES
    // Metres per unit of the mesh.
    @location(11) @interpolate(flat) scale: f32,
#endif
}

@vertex
fn vertex(in: Vertex) -> Varying {
    var out: Varying;
    let rows = Rows(in.row_x, in.row_y, in.row_z);
    var world = world_position(rows, in.position);
    out.position = frame.clip_from_world * vec4(world, 1.0);
#ifdef EXTRAS
    var color = in.color;
#ifdef TEXTURED
    var uv = in.uv;
#endif
    if STROKES {
        let corner = stroke_corner(out.position, rows, in.position, in.other_end, in.own);
        out.position = corner.position;
        world += corner_offset(corner, rows, in.position, in.other_end);
        color = mix(color, in.other_color, corner.share);
#ifdef TEXTURED
        uv = mix(uv, in.other_uv, corner.share);
#endif
    }
#endif
    out.normal = world_normal(rows, in.normal);
#ifdef TEXTURED
#ifdef EXTRAS
    let uvs = mapped_uvs(uv, in.second_uv, in.look);
    out.base_and_normal = uvs.base_and_normal;
    out.metal_and_occlusion = uvs.metal_and_occlusion;
    out.emissive_and_specular = uvs.emissive_and_specular;
    out.of_shininess = uvs.of_shininess;
#ifdef LOBES
    out.of_film = uvs.of_film;
    out.of_diffuse_transmission = uvs.of_diffuse_transmission;
#endif
#else
    out.uv = in.uv;
#endif
#endif
#ifdef NORMAL_MAP
    out.tangent = world_tangent(rows, in.tangent);
#endif
    out.world = world;
#ifdef EXTRAS
    out.color = select(vec4(1.0), color, COLORED);
    out.look = packed_look(in.look);
#endif
#ifdef LOBES
    out.scale = scale_of(rows);
#endif
    return out;
}

#ifdef TEXTURED
fn uvs_of(in: Varying) -> Uvs {
#ifdef EXTRAS
    var uvs: Uvs;
    uvs.base_and_normal = in.base_and_normal;
    uvs.metal_and_occlusion = in.metal_and_occlusion;
    uvs.emissive_and_specular = in.emissive_and_specular;
    uvs.of_shininess = in.of_shininess;
#ifdef LOBES
    uvs.of_film = in.of_film;
    uvs.of_diffuse_transmission = in.of_diffuse_transmission;
#endif
    uvs.layer = layer_of(unpacked_look(in.look).w);
    return uvs;
#else
    return Uvs(in.uv);
#endif
}
#endif

// Light that a surface sends to the eye, in nits: the lights in LIGHTING's order.
fn all_light(pixel: vec4<f32>, surface: Surface, texel: Texel, model: Model) -> vec3<f32> {
#ifdef CLUSTERED
    let end = frame.global_count;
#else
    // Paths that add lights one by one do so only to opaque surfaces.
    let end = frame.light_count;
#endif
    var radiance = light_everywhere(surface, texel, model, Everywhere(AMBIENT, DIRECTIONAL && !ONE_DIRECTIONAL, PUNCTUAL, end));
#ifdef LIGHTS
    if ONE_DIRECTIONAL {
        // As in its turn there: no other light is added before it.
        radiance += directional_light(0u, surface, texel, model);
    }
#endif
#ifdef CLUSTERED
    var depth = pixel.z;
    if MULTISAMPLED {
        // The depth of the pixel's centre, which may lie beside the surface, and in another froxel.
        let clip = frame.clip_from_world * vec4(texel.position, 1.0);
        depth = clip.z / clip.w;
    }
    let list = cluster_at(pixel.xy, depth);
    for (var i = 0u; i < list.y; i++) {
        add_punctual(&radiance, cluster_lights[list.x + i], true, surface, texel, model);
    }
#endif
    return radiance;
}

#ifdef LOBES
// Glass over the picture: its own light, and the light that passes through it. Layers between the glass and the picture that it shows have changed
// the light straight behind it. Blending adds this change: `kept` times the target's light, less `kept` times the picture without the layers. `kept`
// is the darkest channel of the tint, limited so that no light is negative.
fn over_backdrop(own: vec4<f32>, thickness: f32, alpha: f32, surface: Surface, texel: Texel, in: Varying) -> vec4<f32> {
    let glass = glass_of(push.lobes, thickness, in.scale, vec2(push.round, push.slender), texel.roughness, in.position.z);
    let tint = texel.albedo * ((1.0 - texel.metallic) * (1.0 - alpha));
    let passed = min(light_through_glass(surface, glass, in.world) * tint, vec3(LARGEST));
    let all = own.rgb + passed;
    let straight = light_straight_behind(in.position.xy);
    let shares = min(tint, all / max(straight, vec3(1e-30)));
    let kept = saturate(min(shares.r, min(shares.g, shares.b)));
    return vec4(clamp(all - straight * kept, vec3(0.0), vec3(LARGEST * (1.0 - kept) + HIGHLIGHT)), 1.0 - kept);
}
#endif

// Colour and alpha, with the colour times its share of the picture.
fn shade(in: Varying, front: bool) -> vec4<f32> {
#ifdef TEXTURED
    var point = point_at(uvs_of(in), TEXTURES);
#else
    var point = plain_point();
#endif
#ifdef EXTRAS
    let look = unpacked_look(in.look);
    let color = select(vec4(1.0), in.color, COLORED) * vec4(select(vec3(1.0), tint_of(look), LOOKS), 1.0);
    point.base *= color;
    let selected = LOOKS && is_selected(look.w);
    if selected && !COLORED_LIGHT {
        point.base = vec4(highlighted(point.base.rgb, 1.0), point.base.a);
    }
#endif
    let facing = select(1.0, -1.0, TWO_SIDED && !front);
    let geometric = unit_or(in.normal, vec3(0.0, 1.0, 0.0));
    var normal = geometric;
#ifdef NORMAL_MAP
    normal = mapped_normal(geometric, in.tangent, uvs_of(in));
#endif
    var emissive = vec3(0.0);
    if EMISSIVE {
#ifdef TEXTURED
        emissive = emissive_at(uvs_of(in), TEXTURES);
#else
        emissive = push.emissive;
#endif
#ifdef EXTRAS
        emissive *= select(vec3(1.0), color.rgb, COLORED_LIGHT);
        if selected && COLORED_LIGHT {
            emissive = highlighted(emissive, frame.exposure);
        }
#endif
    }
#ifdef TEXTURED
    // After the last texture was sampled: derivatives need all four pixels of a quad.
    if MASKED && point.base.a < push.alpha_cutoff {
        discard;
    }
#else ifdef EXTRAS
    if MASKED && point.base.a < push.alpha_cutoff {
        discard;
    }
#endif
    var texel: Texel;
    texel.position = in.world;
    // The middle of a pixel of several samples may lie beside the triangle.
    texel.ray = select(view_ray(in.position.xy), in.world, MULTISAMPLED && !ORTHOGRAPHIC);
    texel.normal = normal * facing;
    texel.geometric_normal = geometric * facing;
    texel.albedo = select(point.base.rgb, vec3(1.0), LIGHT_ONLY);
    texel.occlusion = point.ambient;
    texel.metallic = select(0.0, point.metallic, METAL && !LIGHT_ONLY);
    texel.roughness = select(point.roughness, encode_shininess(point.roughness), PHONG);
    texel.specular = point.specular;
    texel.dielectric = usual_dielectric();
    if REFLECTANCE {
        texel.dielectric = Dielectric(point.specular * point.strength, push.brdf * point.strength);
    }
    texel.brdf = BRDF;
    texel.receives = RECEIVES;
    let model = Model(BRDF, FALLOFF, TRAITS, DIRECTIONAL_SHADOWS, PUNCTUAL_SHADOWS, SHADOW_FILTER, TEXTBOOK);
    var surface = surface_of(texel, model);
#ifdef LOBES
    take_below(texel.dielectric.facing, texel.albedo, texel.metallic);
    take_lobes(push.lobes, point.sheen, point.film, surface.n_dot_v);
    if DIFFUSE_TRANSMISSION {
        surface.diffuse *= take_transmission(push.lobes, point.diffuse_transmission, texel.metallic);
    }
#ifdef NORMAL_MAP
    if GROOVES {
        take_grooves(push.lobes, point.anisotropy, in.tangent, geometric, texel.normal, max(texel.roughness, MIN_ROUGHNESS));
    }
#endif
#endif
    var alpha = select(saturate(point.base.a), 1.0, OPACITY == HIDES);
    if OPACITY == GLASS {
        // The body's share of the light; the mirrored light is whole.
        surface.diffuse *= alpha;
#ifdef LOBES
        dim_transmission(alpha);
#endif
    }
    if OPACITY == COAT {
        // The share that the coat hides from all sides scales its lobe before any light is added: otherwise bright light would be clamped that is dim
        // after scaling.
        alpha *= coat_share(surface.n_dot_v);
        surface.diffuse = vec3(0.0);
        surface.specular = vec3(alpha);
        surface.grazing = alpha;
        surface.fresnel_rise = vec3(0.0);
    }
    let light = min(all_light(in.position, surface, texel, model) * frame.exposure, vec3(LARGEST)) + min(emissive, vec3(LARGEST));
    let share = select(1.0, alpha, OPACITY == BLEND);
    let own = vec4(min(light * share, vec3(LARGEST * alpha + HIGHLIGHT)), alpha);
#ifdef LOBES
    if REFRACTS {
        // The picture behind is fogged already.
        return over_backdrop(seen_through_air(in.world, own, LARGEST), point.film.b, alpha, surface, texel, in);
    }
#endif
    return seen_through_air(in.world, own, LARGEST);
}

#ifdef WEIGHTED

// Weighted blended order-independent transparency (McGuire and Bavoil 2013): sums that no order changes.
struct Weighted {
    // Colour: the sum of colours times weights. Alpha: the share of the background that the surface hides; blending multiplies up 1 minus it.
    @location(0) accumulation: vec4<f32>,
    // Red: the sum of these shares times weights. Alpha is as above, though the target has none: both targets blend in one way.
    @location(1) weights: vec4<f32>,
}

// No sum overflows. A layer adds at most PEAK to any channel, for alpha because WEIGHT <= PEAK. In single floats PEAK is 1e38 / T of
// the scene's T transparent triangles. In half floats a sum below 65504 gains at most half a step, 16, by rounding, so that T layers
// stay below T (PEAK + 16), which is 64000 up to T = 2000. From there on PEAK is 16, and no number of layers passes 2^15: there a
// step is 32, and a sum to which half a step or less is added stays (rounded to even, or cut off).
//
// No sum is lost. In half floats, LEAST WEIGHT >= 2^-6, so that an alpha of 1/255 adds a normal number, at least 2^-14. A bright layer adds PEAK
// alpha / colour, which is normal for every colour up to 32000 alpha + 512, hence for all tone-mapped light. Only a clear pane's highlight of more
// than 900 nits in a linear picture adds less: still 32 of the steps of 2^-24 that lie below. An alpha below 1/255 adds less too, and where nothing
// is left of it COMPOSITE leaves the background.
// Single floats hold all of it: 2^-12 / 255 and PEAK / 255 / 2e30 are normal.

@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> Weighted {
    let color = shade(in, front);
    // The highlight of a clear pane or a thin coat is a colour without cover: it gets the least cover that an 8-bit picture does not show.
    let cover = select(color.a, max(color.a, 1.0 / 255.0), OPACITY >= GLASS);
    let weight = weight_of(color.rgb, in.world, WEIGHT, LEAST, PEAK);
    return Weighted(vec4(color.rgb * weight, cover), vec4(cover * weight, 0.0, 0.0, cover));
}

#else

@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let color = shade(in, front);
    if TONE_MAP {
        return vec4(tone_map(color.rgb, OPERATOR), 1.0);
    }
    return color;
}

#endif
