// AO_DENOISE: the mean of AO's values at a pixel and at neighbours in the plane of its surface, times the material's occlusion from the G-buffer.
// variants: NORMAL_UINT HALF_ALBEDO SINGLE_ALBEDO
// excludes: HALF_ALBEDO SINGLE_ALBEDO
// counts: 6; with NORMAL_UINT 3, HALF_ALBEDO 2, SINGLE_ALBEDO 2
#import afterlight::frame::{frame, position_at}
#import afterlight::encodings::{decode_normal, decode_normal_uint}
#import afterlight::visibility::{unpack_visibility}

@group(1) @binding(0) var stored_depth: texture_depth_2d;
#ifdef NORMAL_UINT
@group(1) @binding(1) var stored_normal: texture_2d<u32>;
#else
@group(1) @binding(1) var stored_normal: texture_2d<f32>;
#endif
@group(1) @binding(2) var visibility: texture_2d<u32>;
// Alpha is occlusion. The other channels go back as they came: bytes as bytes, whatever curve they stand for.
#ifdef HALF_ALBEDO
@group(1) @binding(3) var albedo: texture_storage_2d<rgba16float, read_write>;
#else ifdef SINGLE_ALBEDO
@group(1) @binding(3) var albedo: texture_storage_2d<rgba32float, read_write>;
#else
@group(1) @binding(3) var albedo: texture_storage_2d<rgba8unorm, read_write>;
#endif

override NORMAL_ENCODING: u32 = 0u;
override RADIUS: f32 = 0.5;
override SCALE: u32 = 1u;

// The distance from the plane of a surface, in radii, beyond which other pixels count no more.
const TOLERANCE: f32 = 0.1;

@compute @workgroup_size(8, 8)
fn compute(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<i32>(textureDimensions(stored_depth));
    let texel = vec2<i32>(id.xy);
    if any(texel >= size) {
        return;
    }
    let depth = textureLoad(stored_depth, texel, 0);
    // LIGHTING skips the sky.
    if depth <= 0.0 {
        return;
    }
#ifdef NORMAL_UINT
    let normal = decode_normal_uint(textureLoad(stored_normal, texel, 0).xy);
#else
    let normal = decode_normal(textureLoad(stored_normal, texel, 0), NORMAL_ENCODING);
#endif
    let place = position_at(vec2<f32>(texel) + 0.5, depth);
    let scale = i32(SCALE);
    let base = texel / scale;
    let last = (size - 1) / scale;
    let offset = vec2<f32>(texel - base * scale) / f32(SCALE);
    var sum = 0.0;
    var weights = 0.0;
    // Five across and five down, of which the outer ones count half: each of the tile's 16 patterns as much as any other.
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            let other = base + vec2(x, y);
            if any(other < vec2(0)) || any(other > last) {
                continue;
            }
            let found = unpack_visibility(textureLoad(visibility, other, 0).x);
            if found.depth <= 0.0 {
                continue;
            }
            let beside = clamp(2.5 - abs(vec2(f32(x), f32(y)) - offset), vec2(0.0), vec2(1.0));
            let off = abs(dot(position_at(vec2<f32>(other * scale) + 0.5, found.depth) - place, normal));
            let weight = beside.x * beside.y * max(1.0 - off / (TOLERANCE * RADIUS), 0.0);
            sum += weight * found.open;
            weights += weight;
        }
    }
    var open = unpack_visibility(textureLoad(visibility, base, 0).x).open;
    if weights > 1e-6 {
        open = sum / weights;
    }
    let own = textureLoad(albedo, texel);
    textureStore(albedo, texel, vec4(own.rgb, own.a * open));
}
