// GEOMETRY: surfaces into the G-buffer. Emissive light goes straight into the HDR target.
// Views without a G-buffer are drawn by OVERDRAW, which counts fragments, and with TRIANGLE writes which triangle is seen: for the light path
// `visibility` in 32 bits, with PACKED.
// variants: TEXTURED NORMAL_MAP EXTRAS MATERIAL SPECULAR EMISSIVE POSITION NORMAL_UINT OVERDRAW TRIANGLE PACKED
// requires: TRIANGLE -> OVERDRAW
// requires: PACKED -> TRIANGLE
// requires: NORMAL_MAP -> TEXTURED
// excludes: OVERDRAW NORMAL_MAP
// excludes: OVERDRAW MATERIAL
// excludes: OVERDRAW SPECULAR
// excludes: OVERDRAW EMISSIVE
// excludes: OVERDRAW POSITION
// excludes: OVERDRAW NORMAL_UINT
// precise
// counts: 204; with TEXTURED 134, NORMAL_MAP 64, EXTRAS 102, MATERIAL 96, SPECULAR 96, EMISSIVE 96, POSITION 96, NORMAL_UINT 96, OVERDRAW 12, TRIANGLE 8, PACKED 4
enable primitive_index;
#import afterlight::frame::{frame}
#import afterlight::encodings::{encode_normal, encode_normal_uint, encode_shininess, octahedral, to_unorm}
#ifdef SPECULAR
#import afterlight::encodings::{encode_dielectric}
#endif
#import afterlight::instance::{Rows, world_normal, world_position, world_tangent}
#import afterlight::material::{plain_point, push}
#import afterlight::vectors::{unit_or}
#ifdef TEXTURED
#import afterlight::material::{alpha_at, emissive_at, mapped_normal, point_at, Uvs, BASE_COLOR}
#ifdef EXTRAS
#import afterlight::instance::{layer_of}
#import afterlight::material::{mapped_uvs}
#endif
#endif
#ifdef EXTRAS
#import afterlight::instance::{highlighted, is_selected, packed_look, tint_of, unpacked_look}
#import afterlight::strokes::{corner_offset, stroke_corner}
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
override NORMAL_ENCODING: u32 = 0u;
// Codes of a channel that holds half an octahedral geometric normal; 0 if none holds it.
override GEOMETRIC_STEPS: f32 = 255.0;
// A pass reads geometric normals that differ from the shading ones; false where their channels are kept without that need.
override NORMALS_DIFFER: bool = true;
// The material's roughness channel holds a shininess instead.
override PHONG: bool = false;
#ifdef SPECULAR
// The material is of Cook-Torrance's model, and the specular target has the reflectance of such surfaces.
override REFLECTANCE: bool = false;
#endif
// Largest value that the light target holds.
override LARGEST: f32 = 65000.0;
// Largest coordinate that the position target holds.
override FARTHEST: f32 = 65000.0;
struct Vertex {
    @location(0) position: vec3<f32>,
#ifndef OVERDRAW
    @location(1) normal: vec3<f32>,
#endif
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
#ifndef PACKED
    @builtin(vertex_index) own: u32,
#endif
#endif
#ifdef TRIANGLE
    @location(12) number: u32,
#endif
#ifdef PACKED
    // Index of the vertex among the vertices of all meshes.
    @builtin(vertex_index) own: u32,
#endif
}

// Centroid: where an edge cuts a pixel with several samples, values belong to a point on the surface and not beside it. A pixel with one sample takes
// them at its centre.
struct Varying {
    @builtin(position) position: vec4<f32>,
#ifndef OVERDRAW
    @location(1) @interpolate(perspective, centroid) normal: vec3<f32>,
#endif
#ifdef TEXTURED
#ifdef EXTRAS
    // Coordinates as in `Uvs`.
    @location(2) @interpolate(perspective, centroid) base_and_normal: vec4<f32>,
    @location(6) @interpolate(perspective, centroid) metal_and_occlusion: vec4<f32>,
    @location(7) @interpolate(perspective, centroid) emissive_and_specular: vec4<f32>,
    @location(8) @interpolate(perspective, centroid) of_shininess: vec4<f32>,
#else
    @location(2) @interpolate(perspective, centroid) uv: vec2<f32>,
#endif
#endif
#ifdef NORMAL_MAP
    @location(3) @interpolate(perspective, centroid) tangent: vec4<f32>,
#endif
#ifdef POSITION
    @location(4) @interpolate(perspective, centroid) world: vec3<f32>,
#endif
#ifdef EXTRAS
    // The colour of the vertex.
    @location(5) @interpolate(perspective, centroid) color: vec4<f32>,
    // The look of the instance (`packed_look`).
    @location(10) @interpolate(flat) look: vec2<u32>,
#endif
#ifdef TRIANGLE
    // The object's number plus 1; with PACKED the triangle's code: each triangle begins with its own vertex, and a flat value is the first vertex's.
    // Reading `primitive_index` costs a GPU up to a third of drawing.
    @location(9) @interpolate(flat, first) number: u32,
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
#ifndef OVERDRAW
    out.normal = world_normal(rows, in.normal);
#endif
#ifdef TEXTURED
#ifdef EXTRAS
    let uvs = mapped_uvs(uv, in.second_uv, in.look);
    out.base_and_normal = uvs.base_and_normal;
    out.metal_and_occlusion = uvs.metal_and_occlusion;
    out.emissive_and_specular = uvs.emissive_and_specular;
    out.of_shininess = uvs.of_shininess;
#else
    out.uv = in.uv;
#endif
#endif
#ifdef NORMAL_MAP
    out.tangent = world_tangent(rows, in.tangent);
#endif
#ifdef POSITION
    out.world = world;
#endif
#ifdef EXTRAS
    out.color = select(vec4(1.0), color, COLORED);
    out.look = packed_look(in.look);
#endif
#ifdef PACKED
    // The instance's number is the code of its first triangle, less the vertex with which that begins.
    out.number = in.number + in.own;
#else ifdef TRIANGLE
    out.number = in.number;
#endif
    return out;
}

#ifdef TEXTURED
fn uvs_of(in: Varying) -> Uvs {
#ifdef EXTRAS
    return Uvs(in.base_and_normal, in.metal_and_occlusion, in.emissive_and_specular, in.of_shininess, layer_of(unpacked_look(in.look).w));
#else
    return Uvs(in.uv);
#endif
}
#endif

#ifdef OVERDRAW

#ifdef TEXTURED
fn cut_away(in: Varying) -> bool {
    if MASKED && ((TEXTURES & BASE_COLOR) != 0u || COLORED) {
        var alpha = push.alpha;
        if (TEXTURES & BASE_COLOR) != 0u {
            alpha = alpha_at(uvs_of(in));
        }
#ifdef EXTRAS
        alpha *= select(1.0, in.color.a, COLORED);
#endif
        return alpha < push.alpha_cutoff;
    }
    return false;
}
#else ifdef EXTRAS
fn cut_away(in: Varying) -> bool {
    return MASKED && push.alpha * in.color.a < push.alpha_cutoff;
}
#endif

#ifdef TRIANGLE
// Writes the object's number, from 1, and the triangle's number in its mesh, from 0; with PACKED the code of both (seen.wgsl).
@fragment
#ifdef PACKED
fn fragment(in: Varying) -> @location(0) u32 {
#else
fn fragment(in: Varying, @builtin(primitive_index) triangle: u32) -> @location(0) vec2<u32> {
#endif
#ifdef TEXTURED
    if cut_away(in) {
        discard;
    }
#else ifdef EXTRAS
    if cut_away(in) {
        discard;
    }
#endif
#ifdef PACKED
    return in.number;
#else
    return vec2(in.number, triangle);
#endif
}
#else
// Adds one step of an 8-bit target for each fragment that is shaded.
@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
#ifdef TEXTURED
    if cut_away(in) {
        discard;
    }
#else ifdef EXTRAS
    if cut_away(in) {
        discard;
    }
#endif
    return vec4(1.0 / 255.0, 0.0, 0.0, 0.0);
}
#endif

#else

struct Gbuffer {
    @location(0) albedo: vec4<f32>,
#ifdef NORMAL_UINT
    @location(1) normal: vec2<u32>,
#else
    @location(1) normal: vec4<f32>,
#endif
#ifdef MATERIAL
    @location(2) material: vec4<f32>,
#endif
#ifdef EMISSIVE
    @location(3) emissive: vec4<f32>,
#endif
#ifdef SPECULAR
    @location(4) specular: vec4<f32>,
#endif
#ifdef POSITION
    @location(5) position: vec4<f32>,
#endif
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> Gbuffer {
    var out: Gbuffer;
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
    // ANCHOR: store
    out.albedo = vec4(point.base.rgb, point.ambient);
#ifdef NORMAL_UINT
    out.normal = encode_normal_uint(normal * facing);
#else
    out.normal = encode_normal(normal * facing, NORMAL_ENCODING);
#endif
#ifdef MATERIAL
    let stored_roughness = select(point.roughness, encode_shininess(point.roughness), PHONG);
    // The values that are needed most come first: the target has as many channels as the scene needs.
    out.material = vec4(stored_roughness, point.metallic, 0.0, 0.0);
    if GEOMETRIC_STEPS > 0.0 {
        var plane = to_unorm(octahedral(geometric * facing), GEOMETRIC_STEPS);
        // Only shadows need the geometric normal. Its encoded values stay below 1, which leaves 1 free. In the first channel 1 means that the surface
        // receives no shadow; in the second one, that the geometric normal is the shading normal, which its own target holds in more bits.
        plane.x = select(1.0, plane.x, RECEIVES);
        plane.y = select(plane.y, 1.0, !NORMALS_DIFFER || !RECEIVES || all(normal == geometric));
        out.material = vec4(stored_roughness, point.metallic, plane);
    // ANCHOR_END: store
    }
#endif
#ifdef SPECULAR
    out.specular = vec4(point.specular, push.brdf);
    if REFLECTANCE {
        out.specular = encode_dielectric(point.specular * point.strength, push.brdf * point.strength);
    }
#endif
#ifdef EMISSIVE
#ifdef TEXTURED
    var emissive = emissive_at(uvs_of(in), TEXTURES);
#else
    var emissive = push.emissive;
#endif
#ifdef EXTRAS
    emissive *= select(vec3(1.0), color.rgb, COLORED_LIGHT);
    if selected && COLORED_LIGHT {
        emissive = highlighted(emissive, frame.exposure);
    }
#endif
    out.emissive = vec4(min(emissive, vec3(LARGEST)), 1.0);
#endif
#ifdef POSITION
    // A place beyond the target's range moves along its ray to where it fits, so that the eye still sees it in its direction.
    let farthest = max(abs(in.world.x), max(abs(in.world.y), abs(in.world.z)));
    out.position = vec4(in.world * min(1.0, FARTHEST / farthest), 1.0);
#endif
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
    return out;
}

#endif
