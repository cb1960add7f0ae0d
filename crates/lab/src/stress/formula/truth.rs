//! The reference's formulas in 64 bits, on the inputs of the shaders.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use nalgebra::Vector3;

use super::{FormulaTruth, Input};
use afterlight::scene::{Brdf, Environment, Falloff, Light, LightKind, Tonemap};
use afterlight_truth::reference::light::{
    Illumination, MIN_ROUGHNESS, Reflector, arriving, interference, radiance, weakened,
};
use afterlight_truth::reference::{ShadingPoint, Smith, SurfaceLobes, tonemap};

/// Directions nearer to the horizon than this make the half vector of the difference of two long vectors: their rounding alone then moves
/// a sharp highlight.
const HORIZON: f64 = 0.05;
/// A thousandth of a white wall's light.
const DARK: f64 = 1e-3 / PI;

fn three(input: &Input, at: usize) -> DVec3 {
    Vec3::from_slice(&input[at..]).as_dvec3()
}

fn one(input: &Input, at: usize) -> f64 {
    f64::from(input[at])
}

fn of(values: DVec3, floor: f64, held: bool) -> FormulaTruth {
    FormulaTruth { values: values.extend(0.0).to_array(), floor, held }
}

fn scalar(value: f64, floor: f64) -> FormulaTruth {
    of(DVec3::X * value, floor, true)
}

/// A direction of length 1: the length that single precision has rounded it to is no part of the model, but a large power makes much of it.
fn unit(input: &Input, at: usize) -> DVec3 {
    three(input, at).normalize()
}

fn surface(input: &Input, brdf: Brdf) -> ShadingPoint {
    let is_phong = brdf != Brdf::CookTorrance;
    ShadingPoint {
        // Relative to the eye.
        position: -unit(input, 4),
        ray: None,
        normal: unit(input, 0),
        geometric_normal: unit(input, 0),
        brdf,
        albedo: three(input, 12),
        metallic: if is_phong { 0.0 } else { one(input, 7) },
        roughness: one(input, 3),
        specular: DVec3::splat(one(input, 7)),
        reflectance: DVec3::splat(one(input, 11)),
        grazing: one(input, 15),
        shininess: one(input, 3),
        lobes: SurfaceLobes::NONE,
        occlusion: 1.0,
        emissive: DVec3::ZERO,
        alpha: 1.0,
        receives_shadow: false,
    }
}

fn reflected(input: &Input, brdf: Brdf, least_cosine: f64) -> FormulaTruth {
    let (normal, view, light) = (unit(input, 0), unit(input, 4), unit(input, 8));
    let n_dot_l = normal.dot(light);
    let held = n_dot_l >= least_cosine && normal.dot(view) >= least_cosine;
    if n_dot_l <= 0.0 {
        return of(DVec3::ZERO, DARK, held);
    }
    let reflector = Reflector::<f64>::new(&surface(input, brdf), Smith::HeightCorrelated);
    let reflectance = reflector.reflect(&Vector3::new(light.x, light.y, light.z));
    let sum = (reflectance.base + reflectance.lobe) * n_dot_l;
    of(DVec3::new(sum.x, sum.y, sum.z), DARK * n_dot_l, held)
}

pub fn cook_torrance(input: &Input) -> FormulaTruth {
    reflected(input, Brdf::CookTorrance, HORIZON)
}

/// The lobe of a sheen alone.
pub fn sheen(input: &Input) -> FormulaTruth {
    let (normal, view, light) = (unit(input, 0), unit(input, 4), unit(input, 8));
    let n_dot_l = normal.dot(light);
    let held = n_dot_l >= HORIZON && normal.dot(view) >= HORIZON;
    if n_dot_l <= 0.0 {
        return of(DVec3::ZERO, DARK, held);
    }
    let lobes = SurfaceLobes { sheen: three(input, 12), sheen_roughness: one(input, 3), ..SurfaceLobes::NONE };
    let black = ShadingPoint {
        albedo: DVec3::ZERO,
        metallic: 0.0,
        reflectance: DVec3::ZERO,
        grazing: 0.0,
        lobes,
        ..surface(input, Brdf::CookTorrance)
    };
    let reflectance = Reflector::<f64>::new(&black, Smith::HeightCorrelated);
    let lobe = reflectance.reflect(&Vector3::new(light.x, light.y, light.z)).lobe * n_dot_l;
    of(DVec3::new(lobe.x, lobe.y, lobe.z), DARK * n_dot_l, held)
}

/// The stretched highlight alone.
pub fn grooves(input: &Input) -> FormulaTruth {
    let (normal, light, across) = (unit(input, 0), unit(input, 8), three(input, 12));
    let n_dot_l = normal.dot(light);
    let flat = (across - normal * normal.dot(across)).length();
    // If `across` is almost the normal, the direction of the grooves is little but rounding error.
    let held = n_dot_l >= HORIZON && normal.dot(unit(input, 4)) >= HORIZON && flat > 0.1 * across.length().max(0.1);
    if n_dot_l <= 0.0 {
        return of(DVec3::ZERO, DARK, held);
    }
    let lobes = SurfaceLobes { anisotropy: one(input, 7), across, ..SurfaceLobes::NONE };
    let white = ShadingPoint {
        albedo: DVec3::ONE,
        metallic: 1.0,
        reflectance: DVec3::ONE,
        grazing: 1.0,
        lobes,
        ..surface(input, Brdf::CookTorrance)
    };
    let reflector = Reflector::<f64>::new(&white, Smith::HeightCorrelated);
    let lobe = reflector.reflect(&Vector3::new(light.x, light.y, light.z)).lobe.x * n_dot_l;
    of(DVec3::X * lobe, DARK * n_dot_l, held)
}

/// A surface of which a share lets light through.
fn leaf(input: &Input) -> (Reflector<f64>, Vector3<f64>, f64) {
    let lobes = SurfaceLobes { transmitting: one(input, 3), transmission: three(input, 12), ..SurfaceLobes::NONE };
    let own = ShadingPoint { roughness: 1.0, lobes, ..surface(input, Brdf::CookTorrance) };
    let (normal, light) = (unit(input, 0), unit(input, 8));
    let reflector = Reflector::new(&own, Smith::HeightCorrelated);
    (reflector, Vector3::new(light.x, light.y, light.z), normal.dot(light))
}

/// Light through a surface, from a light behind it: opposite to the direction in the input.
pub fn through(input: &Input) -> FormulaTruth {
    let (reflector, opposite, cosine) = leaf(input);
    let held = cosine >= HORIZON && unit(input, 0).dot(unit(input, 4)) >= HORIZON;
    if cosine <= 0.0 {
        return of(DVec3::ZERO, DARK, held);
    }
    let through = reflector.transmit(&-opposite) * cosine;
    of(DVec3::new(through.x, through.y, through.z), DARK * cosine, held)
}

/// The light of two lights, one in front and its mirror image behind, that leaves a surface in front.
pub fn both_sides(input: &Input) -> FormulaTruth {
    let (reflector, light, cosine) = leaf(input);
    if cosine <= 0.0 {
        return of(DVec3::ZERO, DARK, true);
    }
    let front = reflector.reflect(&light);
    let normal = unit(input, 0);
    let behind = light - Vector3::new(normal.x, normal.y, normal.z) * (2.0 * cosine);
    let sum = (front.base + front.lobe + reflector.transmit(&behind)) * cosine;
    of(DVec3::new(sum.x, sum.y, sum.z), DARK * cosine, true)
}

/// One over the density of directions by the cosine; the output has that cosine in it.
pub fn cosine_weight(input: &Input) -> f64 {
    let cosine = light_cosine(input);
    if cosine <= 0.0 { 0.0 } else { PI / cosine }
}

/// A thin film over something that reflects.
pub fn film(input: &Input) -> FormulaTruth {
    of(interference(one(input, 4), one(input, 5), three(input, 0), one(input, 3)), 1e-2, true)
}

/// Wherever the eye is.
pub fn anywhere(input: &Input) -> FormulaTruth {
    FormulaTruth { held: light_cosine(input) > 0.0, ..reflected(input, Brdf::CookTorrance, 0.0) }
}

pub fn phong(input: &Input) -> FormulaTruth {
    reflected(input, Brdf::Phong, HORIZON)
}

pub fn blinn_phong(input: &Input) -> FormulaTruth {
    reflected(input, Brdf::BlinnPhong, HORIZON)
}

/// Cosine to the light of a reflection.
pub fn light_cosine(input: &Input) -> f64 {
    three(input, 0).dot(three(input, 8))
}

/// One over the density with which [`furnace`](super::inputs::furnace) chooses directions: 4 v.h / (D n.h).
fn furnace_weight(input: &Input, view: DVec3, light: DVec3) -> f64 {
    let (normal, half) = (three(input, 0), (view + light).normalize());
    let cosine = normal.dot(half);
    4.0 * view.dot(half) / (ggx(normal, half, one(input, 3)) * cosine)
}

/// Alpha along grooves and across them (KHR_materials_anisotropy), by roughness and strength.
pub fn groove_alphas(roughness: f64, strength: f64) -> [f64; 2] {
    let alpha = roughness.max(MIN_ROUGHNESS).powi(2);
    [alpha + (1.0 - alpha) * strength * strength, alpha]
}

/// One over the density with which [`grooved`](super::inputs::grooved) chooses directions: 4 v.h / (D n.h), with the D of grooves (Burley 2012, equation 13).
pub fn groove_weight(input: &Input) -> f64 {
    let (normal, view, across) = (three(input, 0), three(input, 4), three(input, 12));
    let half = (view + three(input, 8)).normalize();
    let [wide, narrow] = groove_alphas(one(input, 3), one(input, 7));
    let across = (across - normal * normal.dot(across)).normalize();
    let cosine = normal.dot(half);
    let [x, y] = [across.dot(half) / wide, normal.cross(across).dot(half) / narrow];
    4.0 * view.dot(half) * PI * wide * narrow * (x * x + y * y + cosine * cosine).powi(2) / cosine
}

/// Light from everywhere; the output has the cosine to the light in it.
pub fn furnace_in(input: &Input) -> f64 {
    furnace_weight(input, three(input, 4), three(input, 8))
}

/// Light to everywhere: with the cosine to the eye in place of that to the light.
pub fn furnace_out(input: &Input) -> f64 {
    let (normal, view, light) = (three(input, 0), three(input, 4), three(input, 8));
    let n_dot_v = normal.dot(view).max(0.0);
    if n_dot_v == 0.0 { 0.0 } else { furnace_weight(input, light, view) * n_dot_v / normal.dot(light) }
}

/// GGX D (Walter et al. 2007, equation 33).
fn ggx(normal: DVec3, half: DVec3, roughness: f64) -> f64 {
    let alpha = roughness.max(MIN_ROUGHNESS).powi(2);
    let (cosine, sine2) = (normal.dot(half), normal.cross(half).length_squared());
    alpha * alpha / (PI * (cosine * cosine * alpha * alpha + sine2).powi(2))
}

pub fn distribution(input: &Input) -> FormulaTruth {
    scalar(ggx(three(input, 0), three(input, 4).normalize(), one(input, 3)), DARK)
}

/// 1 / (2 (n.l root(n.v) + n.v root(n.l))), root(x) = sqrt(x^2 (1 - alpha^2) + alpha^2) (Heitz 2014, equation 99).
pub fn masking(input: &Input) -> FormulaTruth {
    let [light, view, roughness] = [0, 1, 2].map(|at| one(input, at));
    let alpha2 = roughness.max(MIN_ROUGHNESS).powi(4);
    let root = |x: f64| (x * x * (1.0 - alpha2) + alpha2).sqrt();
    scalar(0.5 / (light * root(view) + view * root(light)), DARK)
}

/// F0 + (F90 - F0)(1 - v.h)^5 (Schlick 1994).
pub fn fresnel(input: &Input) -> FormulaTruth {
    let facing = three(input, 0);
    // A surface that reflects less grazing than facing keeps the rounding of its facing reflectance.
    let floor = facing.max_element().max(1e-3);
    of(facing + (DVec3::splat(one(input, 4)) - facing) * (1.0 - one(input, 3)).powi(5), floor, true)
}

pub fn ambient(input: &Input) -> FormulaTruth {
    let environment = Environment { ambient: Vec3::ONE, ground: None, background: Vec3::ZERO };
    let smith = Smith::HeightCorrelated;
    let illumination = Illumination {
        lights: &[],
        environment: &environment,
        eye: DVec3::ZERO,
        open: 1.0,
        open_behind: 1.0,
        sky: None,
        smith,
    };
    let sum = radiance::<f64>(&surface(input, Brdf::CookTorrance), &illumination, &mut |_| DVec3::ONE);
    of(sum, 1e-3, true)
}

/// A direction comes back unchanged.
pub fn normal(input: &Input) -> FormulaTruth {
    of(three(input, 0), 1.0, true)
}

/// The floor is a quarter of the step from black to the next code of 8 bits.
pub fn tone_mapped(input: &Input) -> FormulaTruth {
    let curve = match input[3].to_bits() {
        0 => Tonemap::Neutral,
        1 => Tonemap::Agx,
        _ => Tonemap::Aces,
    };
    of(tonemap::tone_map::<f64>(three(input, 0), curve), 7.6e-5, true)
}

pub fn encoded(input: &Input) -> FormulaTruth {
    of(DVec3::from_array(three(input, 0).to_array().map(tonemap::encode_srgb)), 1e-3, true)
}

/// The ray through a pixel of [`PICTURE`], with a field of view of 60 degrees and the near plane at 1 cm, at the distance of a depth.
pub fn position(input: &Input) -> FormulaTruth {
    let ndc = DVec2::new(one(input, 0), one(input, 1)) * 2.0 / DVec2::from_array(PICTURE) - DVec2::ONE;
    let tan_y = 30f64.to_radians().tan();
    let ray = DVec3::new(ndc.x * tan_y * PICTURE[0] / PICTURE[1], -ndc.y * tan_y, -1.0);
    of(ray * (f64::from(NEAR) / one(input, 2)), 1e-9, true)
}

/// Width and height of the picture in pixels.
pub const PICTURE: [f64; 2] = [1920.0, 1080.0];
/// Distance of the near plane, in metres.
pub const NEAR: f32 = 0.01;

/// A specular power that comes back unchanged. Errors are relative to the power, or to 1, a matt surface's, if that is larger.
pub fn shininess(input: &Input) -> FormulaTruth {
    scalar(one(input, 0), 1.0)
}

/// The light of a record that [`lamp`](super::inputs::lamp) made.
fn light(input: &Input) -> Light {
    let range = one(input, 6);
    let [constant, linear, quadratic] = [12, 13, 14].map(|at| input[at]);
    let falloff = match input[7].to_bits() {
        0 => Falloff::InverseSquare,
        1 => Falloff::Quadratic,
        _ => Falloff::Polynomial { constant, linear, quadratic },
    };
    let (position, direction, range) = (three(input, 0), three(input, 8), (range > 0.0).then_some(range));
    let [inner_angle_degrees, outer_angle_degrees] = [4, 5].map(|at| one(input, at));
    let kind = if direction == DVec3::ZERO {
        LightKind::Point { position, range, falloff }
    } else {
        LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff }
    };
    Light::of(kind)
}

/// Relative to the light without cone and range, as these draw it to zero.
pub fn strength(input: &Input) -> FormulaTruth {
    let light = light(input);
    let bare = light.kind.form().falloff.map_or(1.0, |falloff| weakened(falloff, None, three(input, 0).length()));
    scalar(arriving(&light, DVec3::ZERO).1, bare)
}

pub fn to_light(input: &Input) -> FormulaTruth {
    of(arriving(&light(input), DVec3::ZERO).0, 1.0, true)
}
