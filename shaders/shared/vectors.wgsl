// Vectors of any length, and linear maps of any size, without overflow.
#define_import_path afterlight::vectors

// The rows of a linear map, as columns, by a power of two that brings the largest element to 1..2: exact, and then products of three of them
// neither overflow nor vanish.
fn scaled_rows(row_x: vec3<f32>, row_y: vec3<f32>, row_z: vec3<f32>) -> mat3x3<f32> {
    let x = abs(row_x);
    let y = abs(row_y);
    let z = abs(row_z);
    let largest = max(max(max(x.x, x.y), max(x.z, y.x)), max(max(y.y, y.z), max(z.x, max(z.y, z.z))));
    // The exponent e, which is biased by 127, becomes 254 - e.
    let scale = bitcast<f32>(0x7f000000u - (bitcast<u32>(largest) & 0x7f800000u));
    return mat3x3(row_x * scale, row_y * scale, row_z * scale);
}

// -1 where a map swaps left and right.
fn handedness(rows: mat3x3<f32>) -> f32 {
    return select(-1.0, 1.0, dot(rows[0], cross(rows[1], rows[2])) >= 0.0);
}

// Normals go by the cofactor matrix, which is right for any scale and mirror. Not of unit length.
fn turned_normal(rows: mat3x3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let x = rows[0];
    let y = rows[1];
    let z = rows[2];
    return handedness(rows) * vec3(dot(cross(y, z), normal), dot(cross(z, x), normal), dot(cross(x, y), normal));
}

// Bits of the smallest number that no driver flushes to 0, and of infinity: vectors with lengths in between can be normalized. Bits of absolute
// values sort in the order of the values, with NaN last; a comparison of floats with NaN may be compiled to either answer.
const LEAST_NORMAL: u32 = 0x00800000u;
const INFINITY: u32 = 0x7f800000u;

// A vector of any length to a unit one; one of no length, or of none that is finite, gives the fallback.
fn unit_or(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let size = bitcast<vec3<u32>>(v) & vec3(0x7fffffffu);
    let largest = max(size.x, max(size.y, size.z));
    if largest < LEAST_NORMAL || largest >= INFINITY {
        return fallback;
    }
    // Scaled first, so that squares neither overflow nor vanish.
    return normalize(v / bitcast<f32>(largest));
}
