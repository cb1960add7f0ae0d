// AO's output for AO_DENOISE: a share of light in 10 bits, and 22 bits of the depth that it was found at, so that one load has both.
#define_import_path afterlight::visibility

// Reversed depth is 0 to 1, so that its two highest bits are 0; leaving out the lowest 8 changes it by 1.5e-5 of its value.
fn pack_visibility(open: f32, depth: f32) -> u32 {
    // NaN becomes 0 or 1 here.
    return ((bitcast<u32>(depth) >> 8u) << 10u) | u32(saturate(open) * 1023.0 + 0.5);
}

struct Visibility {
    open: f32,
    // 0 if the pixel shows no surface.
    depth: f32,
}

fn unpack_visibility(packed: u32) -> Visibility {
    return Visibility(f32(packed & 1023u) / 1023.0, bitcast<f32>((packed >> 10u) << 8u));
}
