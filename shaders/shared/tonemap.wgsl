// From scene-linear light to a display's light, both linear Rec. 709. src/passes/curves.rs has the same curves for the
// background's clear colour.
#define_import_path afterlight::tonemapping

const NEUTRAL: u32 = 0u; // host
const AGX: u32 = 1u; // host
const ACES: u32 = 2u; // host

// The brightest that is shown, in units of white: 1, but for displays that show more.
override HEADROOM: f32 = 1.0;

// Khronos PBR Neutral tone mapper (Khronos Group, 2024). It compresses from 0.8 of the brightest on, which there is white; here it may be more.
fn neutral(color_in: vec3<f32>) -> vec3<f32> {
    // 0.8 - 0.04, and 0.8 of the light beyond white.
    let start_compression = 0.76 + 0.8 * (HEADROOM - 1.0);
    let desaturation = 0.15;
    let least = min(color_in.r, min(color_in.g, color_in.b));
    let offset = select(0.04, least - 6.25 * least * least, least < 0.08);
    let color = color_in - offset;
    let peak = max(color.r, max(color.g, color.b));
    if peak < start_compression {
        return color;
    }
    let d = HEADROOM - start_compression;
    let new_peak = HEADROOM - d * d / (peak + d - start_compression);
    let g = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(color * (new_peak / peak), vec3(new_peak), g);
}

// AgX (Troy Sobotka), with the polynomial fit of its contrast curve by Benjamin Wrensch.
fn agx(color: vec3<f32>) -> vec3<f32> {
    let inset = mat3x3(
        vec3(0.842479062253094, 0.0423282422610123, 0.0423756549057051),
        vec3(0.0784335999999992, 0.878468636469772, 0.0784336),
        vec3(0.0792237451477643, 0.0791661274605434, 0.879142973793104),
    );
    let outset = mat3x3(
        vec3(1.19687900512017, -0.0528968517574562, -0.0529716355144438),
        vec3(-0.0980208811401368, 1.15190312990417, -0.0980434501171241),
        vec3(-0.0990297440797205, -0.0989611768448433, 1.15107367264116),
    );
    let least_ev = -12.47393;
    let most_ev = 4.026069;
    let ev = clamp(log2(max(inset * color, vec3(1e-10))), vec3(least_ev), vec3(most_ev));
    let x = (ev - least_ev) / (most_ev - least_ev);
    let x2 = x * x;
    let x4 = x2 * x2;
    let contrast = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(max(outset * contrast, vec3(0.0)), vec3(2.2));
}

// ACES RRT and ODT, Stephen Hill's fit.
fn aces(color: vec3<f32>) -> vec3<f32> {
    let input = mat3x3(
        vec3(0.59719, 0.07600, 0.02840),
        vec3(0.35458, 0.90834, 0.13383),
        vec3(0.04823, 0.01566, 0.83777),
    );
    let output = mat3x3(
        vec3(1.60475, -0.10208, -0.00327),
        vec3(-0.53108, 1.10813, -0.07276),
        vec3(-0.07367, -0.00605, 1.07602),
    );
    // The squares of large single floats overflow, and infinity over infinity is black.
    let v = input * min(color, vec3(65000.0));
    let a = v * (v + 0.0245786) - 0.000090537;
    let b = v * (0.983729 * v + 0.4329510) + 0.238081;
    return output * (a / b);
}

// IEC 61966-2-1, for targets that do not encode by themselves.
fn encode_srgb(linear: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, linear * 12.92, linear <= vec3(0.0031308));
}

// Curves that were fitted for displays which show nothing beyond white end there. On others their upper half rises on, to HEADROOM: a value
// v from a half on, of the brightest channel, by (HEADROOM - 1) (2v - 1)^4. Below, the curve is the same on any display.
fn stretch(color: vec3<f32>) -> vec3<f32> {
    let mapped = saturate(color);
    let brightest = max(mapped.r, max(mapped.g, mapped.b));
    if HEADROOM <= 1.0 || brightest <= 0.5 {
        return mapped;
    }
    let above = 2.0 * brightest - 1.0;
    return mapped * (1.0 + (HEADROOM - 1.0) * above * above * above * above / brightest);
}

// 0..HEADROOM for any finite input that is not negative.
fn tone_map(color: vec3<f32>, curve: u32) -> vec3<f32> {
    switch curve {
        case NEUTRAL: { return clamp(neutral(color), vec3(0.0), vec3(HEADROOM)); }
        case AGX: { return stretch(agx(color)); }
        case ACES: { return stretch(aces(color)); }
        default: { return clamp(color, vec3(0.0), vec3(HEADROOM)); }
    }
}
