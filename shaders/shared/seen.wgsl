// Surfaces of the light path `visibility`: GEOMETRY has written the triangle that each pixel shows, and its vertices, its instance and its material
// are looked up here. The values that the rasterizer would interpolate follow from the place where the pixel's ray meets the triangle.
enable wgpu_binding_array;
#define_import_path afterlight::seen
#import afterlight::brdf::{usual_dielectric, Dielectric}
#import afterlight::encodings::{encode_shininess}
#import afterlight::filtering::{places_of, FOOTPRINT, PLACES}
#import afterlight::frame::{across, frame, place_at, view_ray, ORTHOGRAPHIC}
#import afterlight::instance::{bent_normal, highlighted, is_selected, layer_of, tint_of, world_normal, world_position, world_tangent, Rows}
#import afterlight::texel::{Texel}
#import afterlight::vectors::{unit_or}

// Low bits of a pixel that hold the triangle's number in its mesh; the bits above hold the instance's place in the frame.
override TRIANGLE_BITS: u32 = 16u;
// Some mesh has vertex colours, or some instance a look.
override EXTRAS: bool = false;
// Some material has a normal map.
override NORMAL_MAPS: bool = false;

// A material's record (src/gpu_scene/seen.rs).
struct SeenMaterial {
    base_color: vec3<f32>,
    alpha: f32,
    // Pre-exposed; black if emission is not shown.
    emissive: vec3<f32>,
    normal_scale: f32,
    // Ks of the Phong models, or the reflectance of Cook-Torrance's dielectric share facing the eye.
    specular: vec3<f32>,
    // Grazing reflectance.
    grazing: f32,
    metallic: f32,
    // Perceptual roughness, or shininess for the Phong models.
    roughness: f32,
    ambient: f32,
    // The index of its first row in `uv_maps`; all bits where its textures lie as the first coordinates say.
    first_uv_map: u32,
    // Bits, see below.
    traits: u32,
    // For each slot, the texture's number, and the sampler's number in the high 8 bits.
    slots: array<u32, 7>,
}

// The low bits of the traits say which textures there are, as in material.wgsl. Bits 16 and on are the index of the BRDF.
const BASE_COLOR: u32 = 1u; // host
const NORMAL: u32 = 2u; // host
const METALLIC_ROUGHNESS: u32 = 4u; // host
const OCCLUSION: u32 = 8u; // host
const EMISSIVE: u32 = 16u; // host
const SPECULAR: u32 = 32u; // host
const SHININESS: u32 = 64u; // host
const TWO_SIDED: u32 = 128u; // host
const RECEIVES: u32 = 256u; // host
const PHONG: u32 = 512u; // host
const REFLECTANCE: u32 = 1024u; // host
const COLORED: u32 = 2048u; // host
const COLORED_LIGHT: u32 = 4096u; // host
const LOOKS: u32 = 8192u; // host
const MIRRORED: u32 = 16384u; // host
const BRDF_SHIFT: u32 = 16u; // host

// The first index of an instance's mesh, its first vertex, its material, and in bit 0 whether indices have 16 bits.
@group(3) @binding(0) var<storage, read> instances: array<vec4<u32>>;
// Three rows each, from the mesh to the world around the camera.
@group(3) @binding(1) var<storage, read> instance_rows: array<vec4<f32>>;
@group(3) @binding(2) var<storage, read> materials: array<SeenMaterial>;
// Of streams that a plan lacks, the variables are names of another, and never read.
@group(3) @binding(3) var<storage, read> positions: array<f32>;
@group(3) @binding(4) var<storage, read> normals: array<f32>;
@group(3) @binding(5) var<storage, read> uvs: array<vec2<f32>>;
@group(3) @binding(6) var<storage, read> tangents: array<vec4<f32>>;
@group(3) @binding(7) var<storage, read> second_uvs: array<vec2<f32>>;
@group(3) @binding(8) var<storage, read> colors: array<vec4<f32>>;
// Two in a word.
@group(3) @binding(9) var<storage, read> indices_16: array<u32>;
@group(3) @binding(10) var<storage, read> indices_32: array<u32>;
// Two numbers in a word.
@group(3) @binding(11) var<storage, read> looks: array<vec2<u32>>;
#ifdef TEXTURED
@group(3) @binding(12) var<storage, read> uv_maps: array<vec4<f32>>;
// The arrays are as long as the plan needs: src/passes/spirv.rs gives both their lengths. Each pixel looks up its own material's entries.
@group(3) @binding(13) var textures: binding_array<texture_2d_array<f32>, 1021>;
@group(3) @binding(14) var samplers: binding_array<sampler, 1019>;
#endif

// The point where a pixel's ray meets a triangle.
struct Hit {
    instance: u32,
    material: u32,
    vertices: vec3<u32>,
    // Shares of the second and the third corner, and their change from pixel to pixel across and down.
    shares: vec2<f32>,
    step_x: vec2<f32>,
    step_y: vec2<f32>,
    // Along the view axis, in metres.
    distance: f32,
    // The triangle's corners go round anticlockwise.
    front: bool,
}

fn index_at(narrow: bool, at: u32) -> u32 {
    if narrow {
        return (indices_16[at / 2u] >> (16u * (at & 1u))) & 0xffffu;
    }
    return indices_32[at];
}

fn three(at: u32, normal: bool) -> vec3<f32> {
    let first = 3u * at;
    if normal {
        return vec3(normals[first], normals[first + 1u], normals[first + 2u]);
    }
    return vec3(positions[first], positions[first + 1u], positions[first + 2u]);
}

fn rows_of(instance: u32) -> Rows {
    let first = 3u * instance;
    return Rows(instance_rows[first], instance_rows[first + 1u], instance_rows[first + 2u]);
}

// The hit in a pixel that shows something, as Moeller and Trumbore have it ("Fast, Minimum Storage Ray/Triangle Intersection", 1997). All three
// products are linear in the ray, so that the derivatives are exact.
fn hit_of(number: u32, pixel: vec2<f32>) -> Hit {
    var hit: Hit;
    hit.instance = number >> TRIANGLE_BITS;
    let record = instances[hit.instance];
    let narrow = (record.w & 1u) != 0u;
    let first = record.x + 3u * (number & ((1u << TRIANGLE_BITS) - 1u));
    hit.vertices = vec3(index_at(narrow, first), index_at(narrow, first + 1u), index_at(narrow, first + 2u)) + record.y;
    hit.material = record.z;
    let rows = rows_of(hit.instance);
    let corner = three(hit.vertices.x, false);
    let to_second = three(hit.vertices.y, false) - corner;
    let to_third = three(hit.vertices.z, false) - corner;
    // Edges keep their bits, however far the triangle is.
    let long_second = vec3(dot(rows.x.xyz, to_second), dot(rows.y.xyz, to_second), dot(rows.z.xyz, to_second));
    let long_third = vec3(dot(rows.x.xyz, to_third), dot(rows.y.xyz, to_third), dot(rows.z.xyz, to_third));
    // In units of the larger edge, so that no product overflows or vanishes.
    let sizes = max(abs(long_second), abs(long_third));
    let unit = 1.0 / max(max(sizes.x, sizes.y), max(sizes.z, 1e-30));
    let place = world_position(rows, corner) * unit;
    let second = long_second * unit;
    let third = long_third * unit;
    let right = frame.ray_x * frame.pixel_width;
    let down = frame.ray_y * frame.pixel_height;
    var along: f32;
    var shares: vec2<f32>;
    if ORTHOGRAPHIC {
        let from_corner = across(pixel) * unit - place;
        let of_second = cross(frame.forward, third);
        let of_third = cross(second, frame.forward);
        along = dot(second, of_second);
        shares = vec2(dot(from_corner, of_second), dot(from_corner, of_third));
        hit.step_x = vec2(dot(right, of_second), dot(right, of_third)) * (unit / along);
        hit.step_y = vec2(dot(down, of_second), dot(down, of_third)) * (unit / along);
        shares /= along;
    } else {
        let ray = across(pixel);
        let of_second = cross(place, third);
        let of_third = cross(second, place);
        let of_all = cross(third, second);
        along = dot(ray, of_all);
        shares = vec2(dot(ray, of_second), dot(ray, of_third)) / along;
        hit.step_x = (vec2(dot(right, of_second), dot(right, of_third)) - shares * dot(right, of_all)) / along;
        hit.step_y = (vec2(dot(down, of_second), dot(down, of_third)) - shares * dot(down, of_all)) / along;
    }
    hit.front = along > 0.0;
    hit.shares = shares;
    if abs(along) < 1e-37 {
        // Seen from the side, or smaller than numbers are.
        hit.shares = vec2(1.0 / 3.0);
        hit.step_x = vec2(0.0);
        hit.step_y = vec2(0.0);
    }
    // Rasterizers snap corners to parts of a pixel, so that its middle may lie beside the triangle.
    hit.shares = max(hit.shares, vec2(0.0));
    hit.shares /= max(hit.shares.x + hit.shares.y, 1.0);
    // The distance at the pixel's middle, where normal and textures are sampled too. Depth in the depth buffer belongs to a place that may lie half a
    // step of the rasterizer's grid beside it.
    hit.distance = dot(place + second * hit.shares.x + third * hit.shares.y, frame.forward) / unit;
    return hit;
}

#ifdef TEXTURED
// A place on a texture, and its change from pixel to pixel.
struct Coordinates {
    at: vec2<f32>,
    step_x: vec2<f32>,
    step_y: vec2<f32>,
}

fn coordinates_of(hit: Hit, second_set: bool) -> Coordinates {
    var corner = uvs[hit.vertices.x];
    var to_second = uvs[hit.vertices.y] - corner;
    var to_third = uvs[hit.vertices.z] - corner;
    if second_set {
        corner = second_uvs[hit.vertices.x];
        to_second = second_uvs[hit.vertices.y] - corner;
        to_third = second_uvs[hit.vertices.z] - corner;
    }
    return Coordinates(
        corner + to_second * hit.shares.x + to_third * hit.shares.y,
        to_second * hit.step_x.x + to_third * hit.step_x.y,
        to_second * hit.step_y.x + to_third * hit.step_y.y,
    );
}

// The texture of a slot of a material that has one there.
fn texel_of(slot: u32, material: u32, hit: Hit, plain: Coordinates, layer: u32) -> vec4<f32> {
    let word = materials[material].slots[slot];
    let first_uv_map = materials[material].first_uv_map;
    var uv = plain;
    if first_uv_map != 0xffffffffu {
        let row_x = uv_maps[2u * (first_uv_map + slot)];
        let row_y = uv_maps[2u * (first_uv_map + slot) + 1u];
        if row_x.w > 0.0 {
            uv = coordinates_of(hit, true);
        }
        uv.at = vec2(dot(row_x.xyz, vec3(uv.at, 1.0)), dot(row_y.xyz, vec3(uv.at, 1.0)));
        uv.step_x = vec2(dot(row_x.xy, uv.step_x), dot(row_y.xy, uv.step_x));
        uv.step_y = vec2(dot(row_x.xy, uv.step_y), dot(row_y.xy, uv.step_y));
    }
    let image = word & 0xffffffu;
    let own_sampler = word >> 24u;
    if PLACES > 1u {
        let places = places_of(array(uv.step_x, uv.step_y), textureDimensions(textures[image]));
        var sum = vec4(0.0);
        for (var place = 0.5; place < places.count; place += 1.0) {
            let at = uv.at + places.step * (place - places.count * 0.5);
            sum += textureSampleLevel(textures[image], samplers[own_sampler], at, layer, places.level);
        }
        return sum / places.count;
    }
    return textureSampleGrad(textures[image], samplers[own_sampler], uv.at, layer, uv.step_x * FOOTPRINT, uv.step_y * FOOTPRINT);
}
#endif

// A surface, and its emitted light.
struct Seen {
    texel: Texel,
    emissive: vec3<f32>,
}

// The surface that the pixel shows: as geometry.wgsl and forward.wgsl have it.
fn seen_at(hit: Hit, pixel: vec2<f32>) -> Seen {
    let material = hit.material;
    let own = materials[material].traits;
    let rows = rows_of(hit.instance);
    var base = vec4(materials[material].base_color, materials[material].alpha);
    var emissive = materials[material].emissive;
    var ambient = materials[material].ambient;
    var metallic = materials[material].metallic;
    var roughness = materials[material].roughness;
    var specular = materials[material].specular;
    var strength = 1.0;
    var layer = 0u;
    var color = vec4(1.0);
    var selected = false;
    if EXTRAS {
        if (own & COLORED) != 0u {
            let corner = colors[hit.vertices.x];
            color = corner + (colors[hit.vertices.y] - corner) * hit.shares.x + (colors[hit.vertices.z] - corner) * hit.shares.y;
        }
        if (own & LOOKS) != 0u {
            let words = looks[hit.instance];
            let look = vec4(words.x & 0xffffu, words.x >> 16u, words.y & 0xffffu, words.y >> 16u);
            color *= vec4(tint_of(look), 1.0);
            layer = layer_of(look.w);
            selected = is_selected(look.w);
        }
    }
    let corner_normal = three(hit.vertices.x, true);
    let mesh_normal = corner_normal
        + (three(hit.vertices.y, true) - corner_normal) * hit.shares.x
        + (three(hit.vertices.z, true) - corner_normal) * hit.shares.y;
    let geometric = unit_or(world_normal(rows, mesh_normal), vec3(0.0, 1.0, 0.0));
    var normal = geometric;
#ifdef TEXTURED
    if (own & 127u) != 0u {
        let uv = coordinates_of(hit, false);
        if (own & BASE_COLOR) != 0u {
            base *= texel_of(0u, material, hit, uv, layer);
        }
        if (own & OCCLUSION) != 0u {
            ambient *= texel_of(3u, material, hit, uv, layer).r;
        }
        if (own & METALLIC_ROUGHNESS) != 0u {
            let texel = texel_of(2u, material, hit, uv, layer);
            roughness *= texel.g;
            metallic *= texel.b;
        }
        if (own & SHININESS) != 0u {
            roughness *= texel_of(6u, material, hit, uv, layer).g;
        }
        if (own & SPECULAR) != 0u {
            let texel = texel_of(5u, material, hit, uv, layer);
            specular *= texel.rgb;
            strength = texel.a;
        }
        if (own & EMISSIVE) != 0u {
            emissive *= texel_of(4u, material, hit, uv, layer).rgb;
        }
        if NORMAL_MAPS && (own & NORMAL) != 0u {
            let corner = world_tangent(rows, tangents[hit.vertices.x]);
            let tangent = corner
                + (world_tangent(rows, tangents[hit.vertices.y]) - corner) * hit.shares.x
                + (world_tangent(rows, tangents[hit.vertices.z]) - corner) * hit.shares.y;
            let bend = texel_of(1u, material, hit, uv, layer).xyz;
            normal = bent_normal(bend, materials[material].normal_scale, geometric, tangent);
        }
    }
#endif
    if EXTRAS {
        base *= color;
        let glows = (own & COLORED_LIGHT) != 0u;
        if selected && !glows {
            base = vec4(highlighted(base.rgb, 1.0), base.a);
        }
        if glows {
            emissive *= color.rgb;
            if selected {
                emissive = highlighted(emissive, frame.exposure);
            }
        }
    }
    let front = hit.front != ((own & MIRRORED) != 0u);
    let facing = select(1.0, -1.0, (own & TWO_SIDED) != 0u && !front);
    var seen: Seen;
    seen.emissive = emissive;
    // Along the ray, where a sum over the corners of a large triangle would have their rounding.
    seen.texel.position = place_at(pixel, hit.distance);
    seen.texel.ray = view_ray(pixel);
    seen.texel.normal = normal * facing;
    seen.texel.geometric_normal = geometric * facing;
    seen.texel.albedo = base.rgb;
    seen.texel.occlusion = ambient;
    seen.texel.metallic = metallic;
    seen.texel.roughness = roughness;
    if (own & PHONG) != 0u {
        seen.texel.roughness = encode_shininess(roughness);
    }
    seen.texel.specular = specular;
    seen.texel.dielectric = usual_dielectric();
    if (own & REFLECTANCE) != 0u {
        seen.texel.dielectric = Dielectric(specular * strength, materials[material].grazing * strength);
    }
    seen.texel.brdf = own >> BRDF_SHIFT;
    seen.texel.receives = (own & RECEIVES) != 0u;
    return seen;
}
