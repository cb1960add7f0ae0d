// Reflection models. Every function returns f(l, v), without NdotL and the light's colour, is finite and not negative for any
// finite input, and is written once more, in f64, by the reference.
//
// Terms that are the same for every light stand in `Surface`, down to differences of two numbers: lavapipe's compiler moves nothing out of loops.
//
// Guards, part of the model: perceptual roughness is at least MIN_ROUGHNESS, NdotV at least MIN_N_DOT_V.
#define_import_path afterlight::brdf

const PI: f32 = 3.14159265358979;
const LN_2: f32 = 0.693147180559945;
const MIN_ROUGHNESS: f32 = 0.01; // host
const MIN_N_DOT_V: f32 = 1e-4;

// BRDF in the passes.
const COOK_TORRANCE: u32 = 0u; // host
const PHONG: u32 = 1u; // host
const BLINN_PHONG: u32 = 2u; // host
const LAMBERT: u32 = 3u; // host

// A lit point, with all that is the same for every light.
struct Surface {
    normal: vec3<f32>,
    // The normal, HALF_SCALE long; set for Cook-Torrance only.
    half_axis: vec3<f32>,
    // Unit vector towards the eye.
    view: vec3<f32>,
    // albedo / pi, without the metallic share
    diffuse: vec3<f32>,
    // F0 of Cook-Torrance, Ks of the Phong models
    specular: vec3<f32>,
    // F90 of Cook-Torrance, and F90 - F0.
    grazing: f32,
    fresnel_rise: vec3<f32>,
    // NdotV, at least MIN_N_DOT_V; `along_view` is unlimited.
    n_dot_v: f32,
    along_view: f32,
    // GGX: alpha squared, and 1 less that.
    alpha_squared: f32,
    smith_slope: f32,
    // GGX: sqrt(NdotV^2 (1 - alpha^2) + alpha^2), the light-independent half of height-correlated Smith.
    smith_v: f32,
    shininess: f32,
    // Normalization of the lobes: of GGX alpha^2 / 2 pi.
    lobe_scale: f32,
    brdf: u32,
}

// The reflectances of a dielectric facing the eye and at a grazing angle.
struct Dielectric {
    facing: vec3<f32>,
    grazing: f32,
}

// A dielectric with an index of refraction of 1.5, which every material has that does not say otherwise.
fn usual_dielectric() -> Dielectric {
    return Dielectric(vec3(0.04), 1.0);
}

fn cook_torrance_surface(
    normal: vec3<f32>,
    view: vec3<f32>,
    albedo: vec3<f32>,
    metallic: f32,
    roughness: f32,
    dielectric: Dielectric,
) -> Surface {
    var s: Surface;
    s.normal = normal;
    s.half_axis = normal * HALF_SCALE;
    s.view = view;
    s.along_view = dot(normal, view);
    s.n_dot_v = max(s.along_view, MIN_N_DOT_V);
    s.alpha_squared = squared_alpha(roughness);
    s.smith_slope = 1.0 - s.alpha_squared;
    s.lobe_scale = s.alpha_squared * (0.5 / PI);
    s.smith_v = smith_root(s.n_dot_v, s.alpha_squared);
    s.diffuse = albedo * ((1.0 - metallic) / PI);
    // Not `mix`: where that is a + (b - a) t, a dark metal keeps the rounding error of 0.04.
    s.specular = dielectric.facing * (1.0 - metallic) + albedo * metallic;
    // Exactly 1 where the dielectric has 1.
    s.grazing = 1.0 - (1.0 - dielectric.grazing) * (1.0 - metallic);
    s.fresnel_rise = vec3(s.grazing) - s.specular;
    s.brdf = COOK_TORRANCE;
    return s;
}

fn phong_surface(normal: vec3<f32>, view: vec3<f32>, albedo: vec3<f32>, specular: vec3<f32>, shininess: f32, brdf: u32) -> Surface {
    var s: Surface;
    s.normal = normal;
    s.view = view;
    s.along_view = dot(normal, view);
    s.n_dot_v = max(s.along_view, MIN_N_DOT_V);
    s.diffuse = albedo / PI;
    s.specular = specular;
    s.shininess = shininess;
    // Unit albedo at normal incidence: exactly by (n + 2) / 2 pi for the reflected ray, within 7.6% by (n + 8) / 8 pi for the half vector
    // (Akenine-Moller et al., Real-Time Rendering, section 9.8).
    s.lobe_scale = select((shininess + 8.0) / (8.0 * PI), (shininess + 2.0) / (2.0 * PI), brdf == PHONG);
    s.brdf = brdf;
    return s;
}

// alpha^2 of a perceptual roughness.
fn squared_alpha(roughness: f32) -> f32 {
    let clamped = max(roughness, MIN_ROUGHNESS);
    let alpha = clamped * clamped;
    return alpha * alpha;
}

// One direction's part of Smith's height-correlated term.
fn smith_root(cosine: f32, alpha_squared: f32) -> f32 {
    return sqrt(cosine * cosine * (1.0 - alpha_squared) + alpha_squared);
}

// Schlick's Fresnel.
fn schlick(facing: vec3<f32>, grazing: f32, v_dot_h: f32) -> vec3<f32> {
    let x = 1.0 - v_dot_h;
    let x2 = x * x;
    return facing + (vec3(grazing) - facing) * (x2 * x2 * x);
}

// The share of light that a clear coat mirrors: of an index of refraction of 1.5, by the angle to its normal.
fn coat_share(n_dot_v: f32) -> f32 {
    return schlick(vec3(0.04), 1.0, n_dot_v).x;
}

struct Half {
    // Unit vector; zero where light and eye are opposite.
    direction: vec3<f32>,
    // |l + v|
    length: f32,
}

fn half_vector(sum: vec3<f32>) -> Half {
    let length2 = dot(sum, sum);
    let inverse = inverseSqrt(max(length2, 1e-30));
    return Half(sum * inverse, length2 * inverse);
}

// ANCHOR: ggx-lobe
// D V of GGX in one division, where V = 0.5 / smith. 1 - NdotH^2 by Lagrange's identity: the difference would cancel where the lobe is
// sharpest.
fn ggx_lobe(normal: vec3<f32>, half: vec3<f32>, alpha_squared: f32, smith: f32) -> f32 {
    let across = cross(normal, half);
    let along = dot(normal, half);
    let d = along * along * alpha_squared + dot(across, across);
    // d >= alpha^2 >= 1e-8 and smith >= 1e-8 for unit vectors: the guard is only for a half vector of zero.
    return alpha_squared * (0.5 / PI) / max(d * d * smith, 1e-30);
// ANCHOR_END: ggx-lobe
}

// The length of half vectors, in units of |l + v|, so that their fourth powers do not vanish where light and eye are nearly opposite.
const HALF_SCALE: f32 = 1048576.0;

// GGX D, height-correlated Smith V, Schlick F, and the uncoupled lambert base (1 - F)(1 - metallic) albedo / pi.
// ANCHOR: cook-torrance
fn cook_torrance(s: Surface, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    // h = l + v is left as long as it is: N.h and |N x h|, and by Lagrange's identity |h|^2 of both, as a normal has the length 1. That saves a
    // division and some fifteen other operations a light.
    let across = cross(s.half_axis, light + s.view);
    let along = (n_dot_l + s.along_view) * HALF_SCALE;
    let across_squared = dot(across, across);
    let along_squared = along * along;
    let length_squared = along_squared + across_squared;
    // Schlick's Fresnel. V.H = |h| / 2 for unit vectors.
    let x = 1.0 - min(0.5 / HALF_SCALE * sqrt(length_squared), 1.0);
    let x2 = x * x;
    let fresnel = s.specular + s.fresnel_rise * (x2 * x2 * x);
    // D V in one division, where V = 0.5 / smith: as in `ggx_lobe`, with numerator and denominator times |h|^4. Where light and eye are opposite h is
    // zero, and the lobe does not reach there.
    let smith = n_dot_l * s.smith_v + s.n_dot_v * sqrt(n_dot_l * n_dot_l * s.smith_slope + s.alpha_squared);
    let d = along_squared * s.alpha_squared + across_squared;
    let lobe = length_squared * length_squared * s.lobe_scale / max(d * d * smith, 1e-30);
    return s.diffuse * (vec3(1.0) - fresnel) + fresnel * lobe;
}
// ANCHOR_END: cook-torrance

// A power of the cosine between two unit vectors. Near 1 a cosine tells little of its angle, and drivers' logarithms little of the cosine:
// there the sine says it, ln(cos) = ln(1 - sin^2) / 2 = -(sin^2 + sin^4 / 2 + ...) / 2.
fn power(cosine: f32, sine2: f32, exponent: f32) -> f32 {
    let series = sine2 * (1.0 + sine2 * (0.5 + sine2 * (1.0 / 3.0 + sine2 * (0.25 + sine2 * 0.2))));
    let near = -0.5 / LN_2 * series;
    let far = log2(clamp(cosine, 1e-30, 1.0));
    return exp2(exponent * select(far, near, cosine > 0.0 && sine2 < 0.1));
}

fn phong(s: Surface, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    let reflected = 2.0 * n_dot_l * s.normal - light;
    let across = cross(reflected, s.view);
    let lobe = power(dot(reflected, s.view), dot(across, across), s.shininess) * s.lobe_scale;
    return s.diffuse + s.specular * lobe;
}

fn blinn_phong(s: Surface, light: vec3<f32>) -> vec3<f32> {
    let half = half_vector(light + s.view).direction;
    let across = cross(s.normal, half);
    let lobe = power(dot(s.normal, half), dot(across, across), s.shininess) * s.lobe_scale;
    return s.diffuse + s.specular * lobe;
}

fn lambert(s: Surface) -> vec3<f32> {
    return s.diffuse;
}

// Share of light from everywhere that a surface's lobe reflects: of ambient light, that is the same from all directions. Karis's fit of
// GGX with Schlick's Fresnel ("Physically Based Shading on Mobile", 2014), made for dielectrics. A white metal gets too little: .826 where
// GGX has .969, at alpha .1 and NdotV .5. The Phong models have no share in it.
fn ambient_lobe(s: Surface, brdf: u32, roughness: f32) -> vec3<f32> {
    if brdf != COOK_TORRANCE {
        return vec3(0.0);
    }
    let r = max(roughness, MIN_ROUGHNESS) * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * s.n_dot_v)) * r.x + r.y;
    return saturate(s.specular * (-1.04 * a + r.z) + vec3((1.04 * a + r.w) * s.grazing));
}

// Share of light from everywhere that a surface reflects. The base gets the light that the lobe leaves, so that the sum never exceeds 1.
fn reflect_ambient(s: Surface, lobe: vec3<f32>) -> vec3<f32> {
    return s.diffuse * PI * (vec3(1.0) - lobe) + lobe;
}

// `brdf` is a specialization constant where the scene has one model, and the surface's own where it mixes them.
fn reflect_light(s: Surface, brdf: u32, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    switch brdf {
        case COOK_TORRANCE: { return cook_torrance(s, light, n_dot_l); }
        case PHONG: { return phong(s, light, n_dot_l); }
        case BLINN_PHONG: { return blinn_phong(s, light); }
        default: { return lambert(s); }
    }
}
