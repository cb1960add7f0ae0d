//! Inputs that are random, and such as are meant to break something: cosines at 0, at 1 and a unit of the last place around, light along
//! and against the view, black and white, and numbers too small to be normal.

use std::f64::consts::TAU;

use fastrand::Rng;
use glam::{DVec3, Vec3};

use super::Input;
use afterlight::gpu_scene::LightRecord;
use afterlight::scene::{Camera, DIELECTRIC, Falloff, Light, LightKind};

/// Inputs of a trial.
pub const COUNT: usize = 1 << 16;

/// The numbers of [`reflection`].
pub const REFLECTION: &[(&str, usize)] = &[
    ("normal", 3),
    ("roughness or power", 1),
    ("view", 3),
    ("metallic or Ks", 1),
    ("light", 3),
    ("reflectance facing", 1),
    ("albedo", 3),
    ("reflectance grazing", 1),
];

/// Numbers from 0 to 1 that break things.
const SHARES: [f32; 8] = [0.0, 1.0, f32::EPSILON, 1.0 - f32::EPSILON / 2.0, 1e-40, f32::MIN_POSITIVE, 0.5, 0.04];

/// Returns a generator that gives the same numbers for the same seed.
pub fn rng(seed: f64) -> Rng {
    Rng::with_seed(seed.to_bits())
}

/// Returns any number from 0 to 1, and one time in three one that breaks things.
pub fn share(rng: &mut Rng) -> f32 {
    if rng.u32(0..3) == 0 { SHARES[rng.usize(0..SHARES.len())] } else { rng.f32() }
}

/// Returns a direction, uniform over the sphere.
pub fn direction(rng: &mut Rng) -> DVec3 {
    let z = 2.0 * rng.f64() - 1.0;
    around(DVec3::Z, z, TAU * rng.f64())
}

/// The direction whose angle to an axis has this cosine.
pub fn around(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    (axis * cosine + (x * turn.cos() + y * turn.sin()) * sine).normalize()
}

/// The number `steps` further along the floats, which passes through zero.
fn nudged(value: f32, steps: i32) -> f32 {
    (0..steps.unsigned_abs()).fold(value, |value, _| if steps > 0 { value.next_up() } else { value.next_down() })
}

/// Each component up to two units of the last place away.
fn shaken(rng: &mut Rng, v: DVec3) -> DVec3 {
    DVec3::from_array(v.to_array().map(|part| f64::from(nudged(part as f32, rng.i32(-2..=2)))))
}

/// A cosine at the horizon, along the axis, or next to either.
fn hard_cosine(rng: &mut Rng) -> f64 {
    let sign = if rng.bool() { 1.0 } else { -1.0 };
    match rng.u32(0..5) {
        0 => 0.0,
        1 => sign * 6e-8,
        2 => sign * 10f64.powf(-7.0 * rng.f64()),
        3 => 1.0,
        _ => 1.0 - 6e-8,
    }
}

/// Normal, view and light.
type Directions = [DVec3; 3];

/// `width` is about the angle that a highlight is wide.
fn directions(rng: &mut Rng, index: usize, width: f64) -> Directions {
    // Along an axis numbers are exact, and cosines of exactly 0 and 1 come about.
    let normal = if rng.bool() { direction(rng) } else { [DVec3::X, DVec3::Y, DVec3::NEG_Z][rng.usize(0..3)] };
    let single = normal.as_vec3().as_dvec3();
    let turn = TAU * rng.f64();
    let any = around(single, rng.f64(), turn);
    match index % 8 {
        0 => [single, any, around(single, rng.f64(), TAU * rng.f64())],
        // Half vectors near the normal: directions in and around the highlight.
        1..=3 => {
            let half = around(single, (width * 4.0 * rng.f64().powi(2)).min(1.5).cos(), TAU * rng.f64());
            [single, any, (2.0 * any.dot(half) * half - any).normalize()]
        }
        4 => [single, any, shaken(rng, any)],
        // Eye and light are opposite: if the normal faces the light, it faces away from the eye.
        5 => [single, -any, any],
        6 => [single, -any, shaken(rng, any)],
        _ => {
            let (to_eye, to_light) = (hard_cosine(rng), hard_cosine(rng));
            [single, around(single, to_eye, turn), around(single, to_light, TAU * rng.f64())]
        }
    }
}

/// Reflectance of a usual dielectric, facing the eye and grazing.
const USUAL: [f32; 2] = [DIELECTRIC, 1.0];

fn packed([normal, view, light]: Directions, fourth: [f32; 2], albedo: [f32; 3]) -> Input {
    let [normal, view, light] = [normal, view, light].map(DVec3::as_vec3);
    let [facing, grazing] = USUAL;
    let [a, b, c] = [normal.extend(fourth[0]), view.extend(fourth[1]), light.extend(facing)].map(|v| v.to_array());
    [a, b, c, [albedo[0], albedo[1], albedo[2], grazing]].concat().try_into().unwrap_or([0.0; 16])
}

/// Gives every other input its own reflectance, from 0 to 1, both facing and grazing.
fn reflecting(mut inputs: Vec<Input>) -> Vec<Input> {
    for (index, input) in inputs.iter_mut().enumerate().filter(|(index, _)| index % 2 == 1) {
        input[11] = (index / 2 % 17) as f32 / 16.0;
        input[15] = (index / 2 % 13) as f32 / 12.0;
    }
    inputs
}

/// Inputs of a reflection model of this roughness or specular power.
pub fn reflection(stiffness: f64, width: f64) -> Vec<Input> {
    let mut rng = rng(stiffness);
    let inputs = (0..COUNT).map(|index| {
        let directions = directions(&mut rng, index, width);
        let metallic = share(&mut rng);
        let albedo = [0; 3].map(|_| share(&mut rng));
        packed(directions, [stiffness as f32, metallic], albedo)
    });
    reflecting(inputs.collect())
}

/// Light and eye both at this cosine to the normal, half of the time with the half vector along it.
pub fn grazing(cosine: f64, roughness: f32) -> Vec<Input> {
    let mut rng = rng(cosine);
    (0..COUNT)
        .map(|index| {
            let normal = direction(&mut rng).as_vec3().as_dvec3();
            let turn = TAU * rng.f64();
            let other = if index % 2 == 0 { turn + TAU / 2.0 } else { TAU * rng.f64() };
            let [view, light] = [turn, other].map(|turn| around(normal, cosine, turn));
            packed([normal, view, light], [roughness, share(&mut rng)], [0; 3].map(|_| share(&mut rng)))
        })
        .collect()
}

/// Light and eye opposite but for this much, seen from behind the surface: as mapped normals do.
pub fn opposite(apart: f64, roughness: f32) -> Vec<Input> {
    let mut rng = rng(apart);
    let input = |rng: &mut Rng| {
        let normal = direction(rng).as_vec3().as_dvec3();
        let light = around(normal, 0.1 + 0.9 * rng.f64(), TAU * rng.f64()).as_vec3().as_dvec3();
        let view = (direction(rng) * apart - light).normalize();
        packed([normal, view, light], [roughness, share(rng)], [0; 3].map(|_| share(rng)))
    };
    (0..COUNT).map(|_| input(&mut rng)).collect()
}

/// Each input followed by the same with light and eye exchanged. Neither is near the horizon.
pub fn exchanged(stiffness: f64, width: f64) -> Vec<Input> {
    let mut rng = rng(stiffness);
    let mut inputs = Vec::with_capacity(COUNT);
    for index in 0.. {
        if inputs.len() == COUNT {
            break;
        }
        let [normal, view, light] = directions(&mut rng, index, width);
        let share = [stiffness as f32, share(&mut rng)];
        let albedo = [0; 3].map(|_| self::share(&mut rng));
        if normal.dot(view).min(normal.dot(light)) > 0.05 {
            inputs.push(packed([normal, view, light], share, albedo));
            inputs.push(packed([normal, light, view], share, albedo));
        }
    }
    inputs
}

/// A white surface without a highlight, of which this share lets light through, from 16 views: lights by the cosine.
pub fn leaf(transmitting: f64) -> Vec<Input> {
    let mut rng = rng(transmitting);
    let mut inputs = Vec::with_capacity(16 * SAMPLES);
    for step in 0..16 {
        let normal = direction(&mut rng).as_vec3().as_dvec3();
        let view = around(normal, 1.0 - 0.06 * f64::from(step), TAU * rng.f64());
        for index in 0..SAMPLES {
            let (edge, at) = (SAMPLES.isqrt(), index as f64);
            let [row, column] = [(at / edge as f64).floor(), at % edge as f64].map(|cell| (cell + 0.5) / edge as f64);
            let light = around(normal, row.sqrt(), TAU * column);
            inputs.push(packed([normal, view, light], [transmitting as f32, 0.0], [1.0; 3]));
        }
    }
    // Both of its reflectances are 0.
    inputs.iter_mut().for_each(|input| (input[11], input[15]) = (0.0, 0.0));
    inputs
}

/// Samples of a sum.
pub const SAMPLES: usize = 4096;

/// Inputs of a white mirror of this roughness in a white furnace: 16 views, from the axis to a cosine of 0.1, with lights where the facets mirror
/// them, evenly over the distribution of facets. `out` swaps light and eye.
pub fn furnace(roughness: f64, out: bool) -> Vec<Input> {
    let alpha = roughness.max(0.01).powi(2);
    let mut rng = rng(roughness);
    let edge = SAMPLES.isqrt();
    let mut inputs = Vec::with_capacity(16 * SAMPLES);
    for step in 0..16 {
        let normal = direction(&mut rng).as_vec3().as_dvec3();
        let view = around(normal, 1.0 - 0.06 * f64::from(step), TAU * rng.f64());
        for index in 0..SAMPLES {
            let [u, v] = [index % edge, index / edge].map(|cell| (cell as f64 + rng.f64()) / edge as f64);
            // tan^2 = alpha^2 u / (1 - u): Walter et al. 2007, equation 35.
            let cosine = ((1.0 - u) / (1.0 - u + alpha * alpha * u)).sqrt();
            let half = around(normal, cosine, TAU * v);
            let light = (2.0 * view.dot(half) * half - view).normalize();
            let directions = if out { [normal, light, view] } else { [normal, view, light] };
            inputs.push(packed(directions, [roughness as f32, 1.0], [1.0; 3]));
        }
    }
    inputs
}

/// A white mirror with grooves of any strength and direction in a white furnace. Directions of light are chosen as in [`furnace`], by the distribution of facets.
pub fn grooved(roughness: f64) -> Vec<Input> {
    let mut rng = rng(roughness);
    let edge = SAMPLES.isqrt();
    let mut inputs = Vec::with_capacity(16 * SAMPLES);
    for step in 0..16 {
        let normal = direction(&mut rng).as_vec3().as_dvec3();
        let view = around(normal, 1.0 - 0.06 * f64::from(step), TAU * rng.f64());
        let (across, strength) = (around(normal, 0.0, TAU * rng.f64()), share(&mut rng));
        let [wide, narrow] = super::truth::groove_alphas(roughness, f64::from(strength));
        for index in 0..SAMPLES {
            let [u, v] = [index % edge, index / edge].map(|cell| (cell as f64 + rng.f64()) / edge as f64);
            // As of `furnace`, each axis with its own alpha.
            let (tangent, (sine, cosine)) = ((u / (1.0 - u)).sqrt(), (TAU * v).sin_cos());
            let aside = across * (wide * cosine) + normal.cross(across) * (narrow * sine);
            let half = (aside * tangent + normal).normalize();
            let light = (2.0 * view.dot(half) * half - view).normalize();
            inputs.push(packed(
                [normal, view, light],
                [roughness as f32, strength],
                across.to_array().map(|part| part as f32),
            ));
        }
    }
    inputs
}

/// Sixteen numbers of which the first are given.
pub fn filled<const N: usize>(first: [f32; N]) -> Input {
    let mut input = [0.0; 16];
    input[..N].copy_from_slice(&first);
    input
}

/// The numbers of [`lamp`]. Inner and outer angle and range stand in place of the colour, which no fall-off reads.
pub const LAMP: &[(&str, usize)] = &[
    ("to the light", 3),
    ("1/range^2", 1),
    ("cone and range", 3),
    ("", 1),
    ("direction", 3),
    ("cone scale", 1),
    ("polynomial", 3),
    ("cone offset", 1),
];

/// The direction of a cone, and its inner and outer angles in degrees.
pub type Cone = (DVec3, [f32; 2]);

/// A point light, or a spot light if it has a cone, as the frame's buffer has it, seen from the origin. The range is in metres.
pub fn lamp(place: DVec3, cone: Option<Cone>, range: Option<f32>, falloff: Falloff) -> Input {
    let (position, limit) = (place.as_vec3().as_dvec3(), range.map(f64::from));
    let (axis, angles) = cone.unwrap_or_default();
    let [inner_angle_degrees, outer_angle_degrees] = angles.map(f64::from);
    let direction = axis.as_vec3().as_dvec3();
    let kind = match cone {
        None => LightKind::Point { position, range: limit, falloff },
        Some(_) => {
            LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range: limit, falloff }
        }
    };
    let light = Light::of(kind);
    let here = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y);
    let color = Vec3::new(angles[0], angles[1], range.unwrap_or(0.0));
    bytemuck::cast(LightRecord { color, ..LightRecord::of(&light, 0, &here) })
}
