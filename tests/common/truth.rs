//! The reference's light model for a material at a point: every light, no shadows, no ambient light.

use afterlight::scene::{Environment, Light, Material};
use afterlight_truth::reference::light::{self, Illumination};
use afterlight_truth::reference::{ShadingPoint, Smith, SurfaceLobes};
use glam::DVec3;

/// Light that a point sends towards the eye, in nits.
pub fn radiance(material: &Material, lights: &[Light], point: DVec3, normal: DVec3, eye: DVec3) -> DVec3 {
    let surface = ShadingPoint {
        position: point - eye,
        ray: None,
        normal,
        geometric_normal: normal,
        brdf: material.brdf,
        albedo: material.base_color.as_dvec3(),
        metallic: f64::from(material.metallic),
        roughness: f64::from(material.roughness),
        specular: material.specular.as_dvec3(),
        reflectance: material.reflectance.as_dvec3(),
        grazing: f64::from(material.grazing),
        shininess: f64::from(material.shininess),
        lobes: SurfaceLobes {
            sheen: material.sheen.color.as_dvec3(),
            sheen_roughness: f64::from(material.sheen.roughness),
            film: f64::from(material.film.strength),
            film_ior: f64::from(material.film.ior),
            film_nanometres: f64::from(material.film.nanometres[1]),
            anisotropy: 0.0,
            across: DVec3::X,
            transmitting: f64::from(material.diffuse_transmission.strength),
            transmission: material.diffuse_transmission.color.as_dvec3(),
        },
        occlusion: 1.0,
        emissive: DVec3::ZERO,
        alpha: 1.0,
        receives_shadow: false,
    };
    let environment = Environment::default();
    let illumination = Illumination {
        lights,
        environment: &environment,
        eye,
        open: 1.0,
        open_behind: 1.0,
        sky: None,
        smith: Smith::default(),
    };
    light::radiance::<f64>(&surface, &illumination, &mut |_| DVec3::ONE)
}
