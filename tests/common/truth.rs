//! The light model in f64, from its formulas and not from the shaders: KHR_lights_punctual, Walter et al. 2007 (GGX), Heitz 2014
//! (height-correlated Smith), Schlick 1994, Phong 1975, Blinn 1977.

use std::f64::consts::PI;

use afterlight::scene::{Brdf, Falloff, Light, LightKind, Material};
use glam::DVec3;

/// Guards that are part of the model (`shaders/shared/brdf.wgsl`, `lights.wgsl`).
const MIN_ROUGHNESS: f64 = 0.01;
const MIN_N_DOT_V: f64 = 1e-4;
const MIN_DISTANCE: f64 = 0.01;

/// Light that a point sends towards the eye, in nits: every light, no shadows, no ambient light.
pub fn radiance(material: &Material, lights: &[Light], point: DVec3, normal: DVec3, eye: DVec3) -> DVec3 {
    let view = (eye - point).normalize();
    lights.iter().fold(DVec3::ZERO, |sum, light| {
        let (to_light, strength) = arriving(light, point);
        let n_dot_l = normal.dot(to_light);
        if n_dot_l <= 0.0 {
            return sum;
        }
        let color = light.color.as_dvec3() * f64::from(light.intensity) * strength;
        sum + color * reflectance(material, normal, view, to_light) * n_dot_l
    })
}

/// Unit vector towards a light, and how much of its intensity arrives.
pub fn arriving(light: &Light, point: DVec3) -> (DVec3, f64) {
    match light.kind {
        LightKind::Directional { direction } => (-direction, 1.0),
        LightKind::Point { position, range, falloff } => {
            ((position - point).normalize(), weakened(falloff, range, position.distance(point)))
        }
        LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff } => {
            let to_light = (position - point).normalize();
            let [inner, outer] = [inner_angle_degrees, outer_angle_degrees].map(|angle| angle.to_radians().cos());
            let share = (-to_light.dot(direction) - outer) / (inner - outer).max(0.001);
            let cone = share.clamp(0.0, 1.0).powi(2);
            (to_light, cone * weakened(falloff, range, position.distance(point)))
        }
    }
}

fn weakened(falloff: Falloff, range: Option<f64>, distance: f64) -> f64 {
    let ratio = range.map_or(0.0, |range| distance / range);
    match falloff {
        Falloff::InverseSquare => (1.0 - ratio.powi(4)).clamp(0.0, 1.0).powi(2) / distance.max(MIN_DISTANCE).powi(2),
        Falloff::Quadratic => (1.0 - ratio * ratio).max(0.0),
        Falloff::Polynomial { .. } if ratio >= 1.0 => 0.0,
        Falloff::Polynomial { constant, linear, quadratic } => {
            1.0 / (f64::from(constant) + f64::from(linear) * distance + f64::from(quadratic) * distance * distance)
        }
    }
}

fn reflectance(material: &Material, normal: DVec3, view: DVec3, to_light: DVec3) -> DVec3 {
    let albedo = material.base_color.as_dvec3();
    let specular = material.specular.as_dvec3();
    let shininess = f64::from(material.shininess);
    match material.brdf {
        Brdf::Lambert => albedo / PI,
        Brdf::CookTorrance => cook_torrance(material, normal, view, to_light),
        Brdf::Phong => {
            let reflected = 2.0 * normal.dot(to_light) * normal - to_light;
            let lobe = (shininess + 2.0) / (2.0 * PI) * reflected.dot(view).max(0.0).powf(shininess);
            albedo / PI + specular * lobe
        }
        Brdf::BlinnPhong => {
            let half = (to_light + view).normalize();
            let lobe = (shininess + 8.0) / (8.0 * PI) * normal.dot(half).max(0.0).powf(shininess);
            albedo / PI + specular * lobe
        }
    }
}

fn cook_torrance(material: &Material, normal: DVec3, view: DVec3, to_light: DVec3) -> DVec3 {
    let (albedo, metallic) = (material.base_color.as_dvec3(), f64::from(material.metallic));
    let alpha = f64::from(material.roughness).max(MIN_ROUGHNESS).powi(2);
    let half = (to_light + view).normalize();
    let (n_dot_l, n_dot_v) = (normal.dot(to_light), normal.dot(view).max(MIN_N_DOT_V));
    let (n_dot_h, v_dot_h) = (normal.dot(half), view.dot(half));
    let d = alpha.powi(2) / (PI * (n_dot_h.powi(2) * (alpha.powi(2) - 1.0) + 1.0).powi(2));
    let smith = |x: f64| (alpha.powi(2) + (1.0 - alpha.powi(2)) * x * x).sqrt();
    let v = 0.5 / (n_dot_l * smith(n_dot_v) + n_dot_v * smith(n_dot_l));
    let f0 = DVec3::splat(0.04).lerp(albedo, metallic);
    let f = f0 + (DVec3::ONE - f0) * (1.0 - v_dot_h).powi(5);
    (DVec3::ONE - f) * (1.0 - metallic) * albedo / PI + d * v * f
}
