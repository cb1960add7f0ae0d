// The material of a drawn surface: the data that change from draw to draw, and the values of its textures at a point.
#define_import_path afterlight::material
#ifdef TEXTURED
#import afterlight::filtering::{places_of, FOOTPRINT, PLACES}
#import afterlight::instance::{bent_normal, layer_of}
#endif

struct Push {
    base_color: vec3<f32>,
    alpha: f32,
    // Pre-exposed.
    emissive: vec3<f32>,
    alpha_cutoff: f32,
    // Ks of the Phong models; for Cook-Torrance materials with their own, the dielectric share's reflectance facing the eye.
    specular: vec3<f32>,
    // The value for the specular target's alpha: the BRDF's index / 3, or a code (encodings.wgsl).
    brdf: f32,
    metallic: f32,
    // Perceptual roughness, or shininess for the Phong models.
    roughness: f32,
    ambient: f32,
    normal_scale: f32,
    // The index of the material's first row in `uv_maps`.
    first_uv_map: u32,
    // The index of the material's row in lobes.wgsl, if it has one.
    lobes: u32,
    // Of a body of glass: the share of its surface that is round, and 1 over the longest edge of its mesh's box.
    round: f32,
    slender: f32,
}

var<immediate> push: Push;

#ifdef TEXTURED
#ifdef EXTRAS
// Textures are arrays whose layers are the cells of an atlas. A material without an atlas has plain images: `bound_fragment` (src/passes/surface.rs)
// changes their type accordingly, and no layer is read.
@group(1) @binding(0) var base_color_texture: texture_2d_array<f32>;
@group(1) @binding(1) var normal_texture: texture_2d_array<f32>;
@group(1) @binding(2) var metallic_roughness_texture: texture_2d_array<f32>;
@group(1) @binding(3) var occlusion_texture: texture_2d_array<f32>;
@group(1) @binding(4) var emissive_texture: texture_2d_array<f32>;
@group(1) @binding(5) var specular_texture: texture_2d_array<f32>;
@group(1) @binding(6) var shininess_texture: texture_2d_array<f32>;
#ifdef LOBES
@group(1) @binding(7) var sheen_texture: texture_2d_array<f32>;
@group(1) @binding(8) var film_texture: texture_2d_array<f32>;
@group(1) @binding(9) var anisotropy_texture: texture_2d_array<f32>;
@group(1) @binding(10) var diffuse_transmission_texture: texture_2d_array<f32>;
#endif
#else
@group(1) @binding(0) var base_color_texture: texture_2d<f32>;
@group(1) @binding(1) var normal_texture: texture_2d<f32>;
@group(1) @binding(2) var metallic_roughness_texture: texture_2d<f32>;
@group(1) @binding(3) var occlusion_texture: texture_2d<f32>;
@group(1) @binding(4) var emissive_texture: texture_2d<f32>;
@group(1) @binding(5) var specular_texture: texture_2d<f32>;
@group(1) @binding(6) var shininess_texture: texture_2d<f32>;
#ifdef LOBES
@group(1) @binding(7) var sheen_texture: texture_2d<f32>;
@group(1) @binding(8) var film_texture: texture_2d<f32>;
@group(1) @binding(9) var anisotropy_texture: texture_2d<f32>;
@group(1) @binding(10) var diffuse_transmission_texture: texture_2d<f32>;
#endif
#endif
// Each texture's sampler. Where a material's textures are all sampled alike, these are names of one, at binding 15.
@group(1) @binding(16) var base_color_sampler: sampler;
@group(1) @binding(17) var normal_sampler: sampler;
@group(1) @binding(18) var metallic_roughness_sampler: sampler;
@group(1) @binding(19) var occlusion_sampler: sampler;
@group(1) @binding(20) var emissive_sampler: sampler;
@group(1) @binding(21) var specular_sampler: sampler;
@group(1) @binding(22) var shininess_sampler: sampler;
#ifdef LOBES
@group(1) @binding(23) var sheen_sampler: sampler;
@group(1) @binding(24) var film_sampler: sampler;
@group(1) @binding(25) var anisotropy_sampler: sampler;
@group(1) @binding(26) var diffuse_transmission_sampler: sampler;
#endif

#ifdef EXTRAS
// The mapping of a texture onto a mesh: rows of the map from texture coordinates and 1 to the image.
struct UvMap {
    // w is 1 for coordinates of the second set.
    x: vec4<f32>,
    y: vec4<f32>,
}

// A map for each slot of each material that has any map but the identity.
@group(0) @binding(5) var<storage, read> uv_maps: array<UvMap>;
#endif
#endif

// The numbers of the slots, equal to the numbers of their bindings.
const BASE_COLOR_SLOT: u32 = 0u; // host
const NORMAL_SLOT: u32 = 1u; // host
const METALLIC_ROUGHNESS_SLOT: u32 = 2u; // host
const OCCLUSION_SLOT: u32 = 3u; // host
const EMISSIVE_SLOT: u32 = 4u; // host
const SPECULAR_SLOT: u32 = 5u; // host
const SHININESS_SLOT: u32 = 6u; // host
const SHEEN_SLOT: u32 = 7u; // host
const FILM_SLOT: u32 = 8u; // host
const ANISOTROPY_SLOT: u32 = 9u; // host
const DIFFUSE_TRANSMISSION_SLOT: u32 = 10u; // host

// Bits of TEXTURES in the passes: which of a material's textures exist. The variables of missing textures name an existing one, and are never
// sampled. A slot's bit has the number of its binding.
const BASE_COLOR: u32 = 1u; // host
const METALLIC_ROUGHNESS: u32 = 4u; // host
const OCCLUSION: u32 = 8u; // host
const EMISSIVE: u32 = 16u; // host
const SPECULAR: u32 = 32u; // host
const SHININESS: u32 = 64u; // host
const SHEEN: u32 = 128u; // host
const FILM: u32 = 256u; // host
const ANISOTROPY: u32 = 512u; // host
const DIFFUSE_TRANSMISSION: u32 = 1024u; // host

// A material's values at a point, in its own terms.
struct Point {
    // Albedo and alpha.
    base: vec4<f32>,
    // Share of the ambient light.
    ambient: f32,
    metallic: f32,
    // Or shininess for the Phong models.
    roughness: f32,
    specular: vec3<f32>,
    // The strength of the specular, from a texture's alpha.
    strength: f32,
#ifdef LOBES
    // Values of the textures alone: lobes.wgsl has the factors.
    sheen: vec4<f32>,
    film: vec4<f32>,
    anisotropy: vec3<f32>,
    diffuse_transmission: vec4<f32>,
#endif
}

// The texture coordinates of a place on a mesh.
#ifdef EXTRAS
struct Uvs {
    // Coordinates of two slots each, in the order of the slots.
    base_and_normal: vec4<f32>,
    metal_and_occlusion: vec4<f32>,
    emissive_and_specular: vec4<f32>,
    // Coordinates of the shininess, and of the sheen if it is drawn.
    of_shininess: vec4<f32>,
#ifdef LOBES
    // Coordinates of the film and the anisotropy.
    of_film: vec4<f32>,
    // Coordinates of diffuse transmission.
    of_diffuse_transmission: vec2<f32>,
#endif
    // The layer of each texture in which the instance's cell lies.
    layer: u32,
}
#else
struct Uvs {
    of_all: vec2<f32>,
}
#endif

#ifdef TEXTURED
#ifdef EXTRAS
fn mapped_uv(slot: u32, first: vec2<f32>, second: vec2<f32>) -> vec2<f32> {
    let map = uv_maps[push.first_uv_map + slot];
    let uv = vec3(select(first, second, map.x.w > 0.0), 1.0);
    return vec2(dot(map.x.xyz, uv), dot(map.y.xyz, uv));
}

// Maps a mesh's coordinates in the vertex stage. The maps are linear, so they commute with interpolation; and fragments need not read them. A
// fragment beside the triangle may read nothing (on lavapipe, zeros), and then the level along every edge would be the smallest.
fn mapped_uvs(first: vec2<f32>, second: vec2<f32>, look: vec4<u32>) -> Uvs {
    return Uvs(
        vec4(mapped_uv(0u, first, second), mapped_uv(1u, first, second)),
        vec4(mapped_uv(2u, first, second), mapped_uv(3u, first, second)),
        vec4(mapped_uv(4u, first, second), mapped_uv(5u, first, second)),
#ifdef LOBES
        vec4(mapped_uv(6u, first, second), mapped_uv(7u, first, second)),
        vec4(mapped_uv(8u, first, second), mapped_uv(9u, first, second)),
        mapped_uv(10u, first, second),
#else
        vec4(mapped_uv(6u, first, second), 0.0, 0.0),
#endif
        layer_of(look.w),
    );
}
#endif

fn uv_of(slot: u32, uvs: Uvs) -> vec2<f32> {
#ifdef EXTRAS
    var pair = uvs.of_shininess;
    if slot < 2u {
        pair = uvs.base_and_normal;
    } else if slot < 4u {
        pair = uvs.metal_and_occlusion;
    } else if slot < 6u {
        pair = uvs.emissive_and_specular;
    }
#ifdef LOBES
    if slot == DIFFUSE_TRANSMISSION_SLOT {
        return uvs.of_diffuse_transmission;
    }
    if slot >= 8u {
        pair = uvs.of_film;
    }
#endif
    return select(pair.xy, pair.zw, (slot & 1u) != 0u);
#else
    return uvs.of_all;
#endif
}

// The texture of a slot at a place.
fn texel_of(
    slot: u32,
#ifdef EXTRAS
    own: texture_2d_array<f32>,
#else
    own: texture_2d<f32>,
#endif
    own_sampler: sampler,
    uvs: Uvs,
) -> vec4<f32> {
    let uv = uv_of(slot, uvs);
    if PLACES > 1u {
        let places = places_of(array(dpdx(uv), dpdy(uv)), textureDimensions(own));
        var sum = vec4(0.0);
        for (var place = 0.5; place < places.count; place += 1.0) {
            let at = uv + places.step * (place - places.count * 0.5);
#ifdef EXTRAS
            sum += textureSampleLevel(own, own_sampler, at, uvs.layer, places.level);
#else
            sum += textureSampleLevel(own, own_sampler, at, places.level);
#endif
        }
        return sum / places.count;
    }
#ifdef EXTRAS
    if FOOTPRINT < 1.0 {
        return textureSampleGrad(own, own_sampler, uv, uvs.layer, dpdx(uv) * FOOTPRINT, dpdy(uv) * FOOTPRINT);
    }
    return textureSample(own, own_sampler, uv, uvs.layer);
#else
    if FOOTPRINT < 1.0 {
        return textureSampleGrad(own, own_sampler, uv, dpdx(uv) * FOOTPRINT, dpdy(uv) * FOOTPRINT);
    }
    return textureSample(own, own_sampler, uv);
#endif
}

fn mapped_normal(normal: vec3<f32>, tangent: vec4<f32>, uvs: Uvs) -> vec3<f32> {
    return bent_normal(texel_of(NORMAL_SLOT, normal_texture, normal_sampler, uvs).xyz, push.normal_scale, normal, tangent);
}

// The alpha of the base colour, for passes that need nothing else.
fn alpha_at(uvs: Uvs) -> f32 {
    return texel_of(BASE_COLOR_SLOT, base_color_texture, base_color_sampler, uvs).a * push.alpha;
}

fn emissive_at(uvs: Uvs, textures: u32) -> vec3<f32> {
    var emissive = push.emissive;
    if (textures & EMISSIVE) != 0u {
        emissive *= texel_of(EMISSIVE_SLOT, emissive_texture, emissive_sampler, uvs).rgb;
    }
    return emissive;
}

fn point_at(uvs: Uvs, textures: u32) -> Point {
    var point = plain_point();
    if (textures & BASE_COLOR) != 0u {
        point.base *= texel_of(BASE_COLOR_SLOT, base_color_texture, base_color_sampler, uvs);
    }
    if (textures & OCCLUSION) != 0u {
        point.ambient *= texel_of(OCCLUSION_SLOT, occlusion_texture, occlusion_sampler, uvs).r;
    }
    if (textures & METALLIC_ROUGHNESS) != 0u {
        let texel = texel_of(METALLIC_ROUGHNESS_SLOT, metallic_roughness_texture, metallic_roughness_sampler, uvs);
        point.roughness *= texel.g;
        point.metallic *= texel.b;
    }
    if (textures & SHININESS) != 0u {
        point.roughness *= texel_of(SHININESS_SLOT, shininess_texture, shininess_sampler, uvs).g;
    }
    if (textures & SPECULAR) != 0u {
        let texel = texel_of(SPECULAR_SLOT, specular_texture, specular_sampler, uvs);
        point.specular *= texel.rgb;
        point.strength = texel.a;
    }
#ifdef LOBES
    if (textures & SHEEN) != 0u {
        point.sheen = texel_of(SHEEN_SLOT, sheen_texture, sheen_sampler, uvs);
    }
    if (textures & FILM) != 0u {
        point.film = texel_of(FILM_SLOT, film_texture, film_sampler, uvs);
    }
    if (textures & ANISOTROPY) != 0u {
        point.anisotropy = texel_of(ANISOTROPY_SLOT, anisotropy_texture, anisotropy_sampler, uvs).rgb;
    }
    if (textures & DIFFUSE_TRANSMISSION) != 0u {
        point.diffuse_transmission = texel_of(DIFFUSE_TRANSMISSION_SLOT, diffuse_transmission_texture, diffuse_transmission_sampler, uvs);
    }
#endif
    return point;
}
#endif

// The material without its textures.
fn plain_point() -> Point {
    var point: Point;
    point.base = vec4(push.base_color, push.alpha);
    point.ambient = push.ambient;
    point.metallic = push.metallic;
    point.roughness = push.roughness;
    point.specular = push.specular;
    point.strength = 1.0;
#ifdef LOBES
    point.sheen = vec4(1.0);
    point.film = vec4(1.0);
    // Along the tangent: 128 is the zero of a code.
    point.anisotropy = vec3(1.0, 128.0 / 255.0, 1.0);
    point.diffuse_transmission = vec4(1.0);
#endif
    return point;
}
