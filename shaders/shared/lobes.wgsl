// Lobes that a surface has beside its base and its highlight. A G-buffer has no room for their values, so such surfaces are lit as they are drawn.
//
// A pipeline's constants say which lobes its material has; code for the others is left out.
#define_import_path afterlight::lobes
#import afterlight::brdf::{Surface}

const PI: f32 = 3.14159265358979;

// Fibres that stand on the surface (KHR_materials_sheen).
override SHEEN: bool = false;
// A thin film, that reflects each colour at other angles (KHR_materials_iridescence).
override FILM: bool = false;
// Grooves, that stretch the highlight (KHR_materials_anisotropy).
override GROOVES: bool = false;
// A base that lets light through diffusely (KHR_materials_diffuse_transmission).
override DIFFUSE_TRANSMISSION: bool = false;

// Guards, part of the model: the roughness of a sheen is at least MIN_SHEEN_ROUGHNESS. MIN_COSINE is for lights in the surface's plane, whose light
// has no share in the picture.
const MIN_SHEEN_ROUGHNESS: f32 = 0.07; // host
const MIN_COSINE: f32 = 1e-6;
// Along each edge of the table of a sheen's shares: 1.2% of a share is the most that a finer table would change.
const SHEEN_EDGE: u32 = 32u; // host
const SHEEN_SHARES: u32 = 1024u; // host

// The parameters of a material.
struct LobeRow {
    // Colour of the sheen, and its perceptual roughness.
    sheen: vec4<f32>,
    // Of the film: strength, index of refraction, least and most thickness in nanometres.
    film: vec4<f32>,
    // Of the grooves: strength, and cosine and sine of the angle from the tangent to the direction of greater roughness.
    grooves: vec4<f32>,
    // Colour of the light that comes through, and the share of the base that lets it.
    through: vec4<f32>,
    // Of glass: index of refraction, thickness in units of the mesh, and how far the indices of red and blue lie beside it.
    glass: vec4<f32>,
    // Absorption of glass, in 1/m.
    absorption: vec4<f32>,
    // Radiance of the background, exposed.
    background: vec4<f32>,
}

struct LobeData {
    // By roughness, and in each row by the root of a cosine: the share of even light that a white sheen scatters in a direction.
    sheen_shares: array<f32, SHEEN_SHARES>,
    rows: array<LobeRow>,
}

@group(0) @binding(11) var<storage, read> lobe_data: LobeData;

// The lobes of the surface that is lit, seen from the camera.
struct Lobes {
    sheen: vec3<f32>,
    // Alpha of the sheen's distribution.
    alpha: f32,
    roughness: f32,
    // The largest channel of the sheen's colour.
    most: f32,
    // The sheen's share of even light, and its visibility's term, both towards the eye.
    at_view: f32,
    hidden: f32,
    // Of the film: its share in the reflectance, its index of refraction and its thickness in nanometres.
    film: f32,
    film_ior: f32,
    nanometres: f32,
    // Reflectance facing the eye of the surface below the film: of its dielectric share, and of its metallic one.
    dielectric: vec3<f32>,
    metal: vec3<f32>,
    metallic: f32,
    // The direction of greater roughness and the one along the grooves, in the surface; alpha of either; and how far they differ, 0 to 1.
    across: vec3<f32>,
    along: vec3<f32>,
    wide: f32,
    narrow: f32,
    strength: f32,
    // Light that comes through, of light at the back: as `diffuse` of a surface.
    through: vec3<f32>,
}

var<private> lobes: Lobes;

// Takes the lobes of a material for all that is lit after this. `sheen` and `film`: their textures, white without one.
fn take_lobes(row: u32, sheen: vec4<f32>, film: vec4<f32>, n_dot_v: f32) {
    if FILM {
        let own = lobe_data.rows[row].film;
        lobes.film_ior = own.y;
        lobes.nanometres = mix(own.z, own.w, film.g);
        // A film without thickness is none: it comes within the first 0.03 nm.
        lobes.film = own.x * film.r * smoothstep(0.0, 0.03, lobes.nanometres);
    }
    if SHEEN {
        take_sheen(lobe_data.rows[row].sheen * sheen, n_dot_v);
        lobes.at_view = sheen_share(n_dot_v);
    }
}

// Takes the colour and the roughness of a sheen.
fn take_sheen(sheen: vec4<f32>, n_dot_v: f32) {
    lobes.sheen = sheen.rgb;
    lobes.roughness = max(sheen.a, MIN_SHEEN_ROUGHNESS);
    lobes.alpha = lobes.roughness * lobes.roughness;
    lobes.most = max(sheen.r, max(sheen.g, sheen.b));
    lobes.hidden = sheen_hidden(n_dot_v);
}

// Takes the grooves of a material. `texel`: of its texture, (1, 128 / 255, 1) without one. Where the mesh has no tangent there are none.
fn take_grooves(row: u32, texel: vec3<f32>, tangent: vec4<f32>, geometric: vec3<f32>, normal: vec3<f32>, roughness: f32) {
    let own = lobe_data.rows[row].grooves;
    // Codes as in a normal map (instance.wgsl).
    let centered = texel.xy * 255.0 - 128.0;
    let way = select(centered, vec2(0.0), abs(centered) < vec2(0.01)) / 127.0;
    let turned = vec2(own.y * way.x - own.z * way.y, own.z * way.x + own.y * way.y);
    let bitangent = cross(geometric, tangent.xyz) * tangent.w;
    take_stretch(tangent.xyz * turned.x + bitangent * turned.y, own.x * texel.z, normal, roughness);
}

// Takes grooves by a direction across them, of any length, and a strength.
fn take_stretch(across: vec3<f32>, strength: f32, normal: vec3<f32>, roughness: f32) {
    let flat_across = across - normal * dot(normal, across);
    let is_there = dot(flat_across, flat_across) > 1e-12;
    let instead = cross(normal, select(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), abs(normal.x) > 0.5));
    lobes.across = normalize(select(instead, flat_across, is_there));
    lobes.along = cross(normal, lobes.across);
    lobes.strength = select(0.0, strength, is_there);
    lobes.narrow = roughness * roughness;
    lobes.wide = mix(lobes.narrow, 1.0, lobes.strength * lobes.strength);
}

fn stretched_length(direction: vec3<f32>, cosine: f32) -> f32 {
    return length(vec3(dot(lobes.across, direction) * lobes.wide, dot(lobes.along, direction) * lobes.narrow, cosine));
}

// D V of GGX with two roughnesses (Burley 2012, Heitz 2014), for the half vector of a view and a light.
fn groove_lobe(half: vec3<f32>, n_dot_h: f32, view: vec3<f32>, n_dot_v: f32, light: vec3<f32>, n_dot_l: f32) -> f32 {
    // Times narrow: the squares of small alphas would vanish.
    let x = dot(lobes.across, half) * (lobes.narrow / lobes.wide);
    let y = dot(lobes.along, half);
    let z = n_dot_h * lobes.narrow;
    let spread = x * x + y * y + z * z;
    let masked = n_dot_l * stretched_length(view, n_dot_v) + n_dot_v * stretched_length(light, n_dot_l);
    let narrow2 = lobes.narrow * lobes.narrow;
    return narrow2 * lobes.narrow * (0.5 / PI) / max(lobes.wide * spread * spread * masked, 1e-30);
}

// Facets that light of the sky is looked up by.
const FACETS: u32 = 16u;

// Facet `i` of them, a unit vector: they lean across the grooves as often as GGX's do, by its distribution of slopes in one direction.
fn groove_facet(i: u32, normal: vec3<f32>) -> vec3<f32> {
    let u = (2.0 * f32(i) + 1.0) / f32(FACETS) - 1.0;
    return normalize(normal + lobes.across * (lobes.wide * u * inverseSqrt(1.0 - u * u)));
}

// The share of a facet in the highlight: f n.l over the density of its direction, but for a factor.
fn groove_weight(n_dot_h: f32, v_dot_h: f32, view: vec3<f32>, n_dot_v: f32, light: vec3<f32>, n_dot_l: f32) -> f32 {
    let masked = n_dot_l * stretched_length(view, n_dot_v) + n_dot_v * stretched_length(light, n_dot_l);
    return v_dot_h * n_dot_l / max(n_dot_h * masked, 1e-9);
}

// The roughness of the sky that a facet mirrors: the highlight's own, or as much as closes the gaps between facets.
fn groove_roughness(roughness: f32) -> f32 {
    return max(roughness, sqrt(lobes.wide * (2.0 / f32(FACETS))));
}

// Takes the share of the base that lets light through, and returns the share that reflects. `texel`: of its texture, white without one.
fn take_transmission(row: u32, texel: vec4<f32>, metallic: f32) -> f32 {
    return take_through(lobe_data.rows[row].through * texel, metallic);
}

// Takes the colour of the light that comes through and, in alpha, the share of the base that lets it; returns the share that reflects.
fn take_through(own: vec4<f32>, metallic: f32) -> f32 {
    lobes.through = own.rgb * (own.a * (1.0 - metallic) / PI);
    return 1.0 - own.a;
}

// A body of this alpha lets as large a share of that light through.
fn dim_transmission(alpha: f32) {
    lobes.through *= alpha;
}

// Takes the reflectances below a film.
fn take_below(dielectric: vec3<f32>, metal: vec3<f32>, metallic: f32) {
    lobes.dielectric = dielectric;
    lobes.metal = metal;
    lobes.metallic = metallic;
}

// Looks up the table of shares, bilinear.
fn sheen_share(cosine: f32) -> f32 {
    let last = f32(SHEEN_EDGE - 1u);
    let place = vec2(sqrt(saturate(cosine)), saturate(lobes.roughness)) * last;
    let corner = min(floor(place), vec2(last - 1.0));
    let within = place - corner;
    let first = u32(corner.y) * SHEEN_EDGE + u32(corner.x);
    let upper = mix(lobe_data.sheen_shares[first], lobe_data.sheen_shares[first + 1u], within.x);
    let lower = mix(lobe_data.sheen_shares[first + SHEEN_EDGE], lobe_data.sheen_shares[first + SHEEN_EDGE + 1u], within.x);
    return mix(upper, lower, within.y);
}

fn sheen_curve(x: f32) -> f32 {
    let smooth_share = (1.0 - lobes.alpha) * (1.0 - lobes.alpha);
    let a = mix(21.5473, 25.3245, smooth_share);
    let b = mix(3.82987, 3.32435, smooth_share);
    let c = mix(0.19823, 0.16801, smooth_share);
    let d = mix(-1.97760, -1.27393, smooth_share);
    let e = mix(-4.32054, -4.85967, smooth_share);
    return a / (1.0 + b * pow(max(x, MIN_COSINE), c)) + d * x + e;
}

// Lambda of the visibility (Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017, equation 3).
fn sheen_hidden(cosine: f32) -> f32 {
    if cosine < 0.5 {
        return exp(sheen_curve(cosine));
    }
    return exp(2.0 * sheen_curve(0.5) - sheen_curve(max(1.0 - cosine, 0.0)));
}

// The share of light of one direction that a sheen leaves to the layers below it.
fn left_by_sheen(share: f32) -> f32 {
    return max(1.0 - lobes.most * share, 0.0);
}

// The surface's f(l, v) with its other lobes over it; `below` is f of base and highlight.
fn over_surface(below: vec3<f32>, normal: vec3<f32>, view: vec3<f32>, n_dot_v: f32, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    if !SHEEN {
        return below;
    }
    let share = sheen_share(max(n_dot_l, MIN_COSINE));
    let left = min(left_by_sheen(lobes.at_view), left_by_sheen(share));
    return below * left + sheen_lobe(normal, view, n_dot_v, light, n_dot_l);
}

// f of the sheen alone: D V, where F is its colour.
fn sheen_lobe(normal: vec3<f32>, view: vec3<f32>, n_dot_v: f32, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    // sin^2 of the angle between normal and half vector, of l + v as long as it is.
    let sum = light + view;
    let across = cross(normal, sum);
    let sine_squared = min(dot(across, across) / max(dot(sum, sum), 1e-30), 1.0);
    let inverse = 1.0 / lobes.alpha;
    let distribution = (2.0 + inverse) * pow(max(sine_squared, 1e-30), 0.5 * inverse) * (0.5 / PI);
    let cosine = max(n_dot_l, MIN_COSINE);
    let visibility = 0.25 / ((1.0 + lobes.hidden + sheen_hidden(cosine)) * cosine * n_dot_v);
    return lobes.sheen * (distribution * visibility);
}

// f(l, v) of light that arrives at the back, where `n_dot_l` is negative: lambert's. The highlight leaves it the share that it leaves of light from the direction
// mirrored at the surface.
fn transmitted(surface: Surface, light: vec3<f32>, n_dot_l: f32) -> vec3<f32> {
    let mirrored = light - surface.normal * (2.0 * n_dot_l);
    let v_dot_h = min(0.5 * length(mirrored + surface.view), 1.0);
    var taken = surface.specular + surface.fresnel_rise * fifth_power(1.0 - v_dot_h);
    if FILM {
        let fresnel = film_reflectance(v_dot_h, taken);
        taken = vec3(max(fresnel.r, max(fresnel.g, fresnel.b)));
    }
    return lobes.through * (vec3(1.0) - taken);
}

// The share of that light which a sheen leaves.
fn left_behind(n_dot_l: f32) -> f32 {
    if !SHEEN {
        return 1.0;
    }
    return min(left_by_sheen(lobes.at_view), left_by_sheen(sheen_share(max(-n_dot_l, MIN_COSINE))));
}

// `diffuse` of a surface for light at its back.
fn through_base() -> vec3<f32> {
    return lobes.through;
}

// The share of light from everywhere that other lobes leave to base and highlight, by the angle to the eye alone.
fn left_by_lobes() -> f32 {
    return select(1.0, left_by_sheen(lobes.at_view), SHEEN);
}

// The direction from which they scatter most light of the sky to the eye: the mean of a sheen's lobe leans to the eye's side, the more so the smoother
// it is. The tangent of its angle to the normal is this within a tenth for roughnesses of 0.4 to 1, and within a third from 0.2 on; the lobe is nearly
// as wide as the cosine's.
fn gathering(normal: vec3<f32>, view: vec3<f32>, n_dot_v: f32) -> vec3<f32> {
    if !SHEEN {
        return normal;
    }
    let aside = view - normal * dot(normal, view);
    let lean = 0.145 * pow(lobes.alpha, -0.75) * (1.0 + 1.4 * n_dot_v);
    return normalize(normal + aside * (lean * inverseSqrt(max(dot(aside, aside), 1e-8))));
}

// The share of light from everywhere that they scatter to the eye. They are taken to collect it by the cosine, as the base does.
fn scattered_by_lobes() -> vec3<f32> {
    return select(vec3(0.0), lobes.sheen * lobes.at_view, SHEEN);
}

// ((n1 - n2) / (n1 + n2))^2.
fn facing_of(inside: vec3<f32>, outside: f32) -> vec3<f32> {
    let root = (inside - outside) / (inside + outside);
    return root * root;
}

fn fifth_power(x: f32) -> f32 {
    let x2 = x * x;
    return x2 * x2 * x;
}

// The eye's sensitivities in the Fourier domain, as Gaussians, by the path in nanometres: in linear Rec. 709.
fn sensitivity(path: f32, shift: vec3<f32>) -> vec3<f32> {
    let phase = 2.0e-9 * PI * path;
    let spread = vec3(4.3278e+09, 9.3046e+09, 6.6121e+09);
    // Each Gaussian's weight times the root of 2 pi its variance, over 1.0685e-7.
    let weight = vec3(0.846590, 1.000222, 1.001122);
    var xyz = weight * cos(vec3(1.6810e+06, 1.7953e+06, 2.2084e+06) * phase + shift) * exp(-phase * phase * spread);
    xyz.x += 0.153868 * cos(2.2399e+06 * phase + shift.x) * exp(-phase * phase * 4.5282e+09);
    return mat3x3(3.2404542, -0.9692660, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.0415560, 1.0572252) * xyz;
}

// The reflectance of a film in air over a surface with this reflectance facing the eye (Belcour and Barla, "A Practical Extension to Microfacet Theory for
// the Modeling of Varying Iridescence", 2017, as KHR_materials_iridescence has it).
fn interference(ior: f32, nanometres: f32, below: vec3<f32>, cosine: f32) -> vec3<f32> {
    // The form 1 less the sine's square would cancel for an index like air's.
    let inner = sqrt(max((ior - 1.0) * (ior + 1.0) + cosine * cosine, 0.0)) / ior;
    let upper_facing = facing_of(vec3(ior), 1.0).x;
    let upper = upper_facing + (1.0 - upper_facing) * fifth_power(1.0 - cosine);
    let passed = 1.0 - upper;
    let root = sqrt(min(below + 1e-4, vec3(0.9999)));
    let base = (1.0 + root) / (1.0 - root);
    let lower_facing = facing_of(base, ior);
    let lower = lower_facing + (1.0 - lower_facing) * fifth_power(1.0 - inner);
    // Reflection at a denser medium shifts light by half a wave; the shift here is relative to the first reflection.
    let shift = vec3(PI) + select(vec3(0.0), vec3(PI), base < vec3(ior));
    let both = clamp(lower * upper, vec3(1e-5), vec3(0.9999));
    let returned = lower * (passed * passed) / (1.0 - both);
    let path = 2.0 * ior * nanometres * inner;
    let first = (returned - passed) * sqrt(both);
    let second = first * sqrt(both);
    let sum = returned + upper + 2.0 * (first * sensitivity(path, shift) + second * sensitivity(2.0 * path, 2.0 * shift));
    return max(sum, vec3(0.0));
}

// The reflectance by the cosine between view and half vector, of a surface that has `bare` without its film.
fn film_reflectance(cosine: f32, bare: vec3<f32>) -> vec3<f32> {
    var own = vec3(0.0);
    if lobes.metallic < 1.0 {
        own = interference(lobes.film_ior, lobes.nanometres, lobes.dielectric, cosine) * (1.0 - lobes.metallic);
    }
    if lobes.metallic > 0.0 {
        own += interference(lobes.film_ior, lobes.nanometres, lobes.metal, cosine) * lobes.metallic;
    }
    return mix(bare, own, lobes.film);
}

// The reflectance facing the eye that gives Schlick's Fresnel the film's at the angle of the eye. Angles so grazing that Schlick's share exceeds 0.9 tell
// nothing of it.
fn film_facing(facing: vec3<f32>, grazing: f32, n_dot_v: f32) -> vec3<f32> {
    let share = fifth_power(1.0 - min(n_dot_v, 1.0));
    let seen = film_reflectance(min(n_dot_v, 1.0), facing + (vec3(grazing) - facing) * share);
    let told = min(share, 0.9);
    return saturate((seen - vec3(grazing * told)) / (1.0 - told));
}
