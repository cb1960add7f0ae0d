//! A pixel's light as a function of what is at work: the truth when nothing is, and what the device would show when everything is.

use glam::DVec3;

use super::device::{Stored, shininess, stores_shininess};
use super::shapley::shapley;
use crate::reference::Surface;
use crate::reference::light::{Illumination, radiance};

/// Parts that can be switched one by one, and by which bit.
pub const SWITCHES: [&str; 5] =
    ["texture filtering", "G-buffer quantization", "position from depth", "shadows", "BRDF arithmetic"];
const TEXTURES: usize = 1 << 0;
const GBUFFER: usize = 1 << 1;
const POSITION: usize = 1 << 2;
const SHADOWS: usize = 1 << 3;
const ARITHMETIC: usize = 1 << 4;

/// A surface in a pixel: as it is, and as the device has it.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    pub truth: &'a Surface,
    pub own: &'a Stored,
    pub unquantized: &'a Stored,
}

/// Which share of a light arrives, by its index: as it is, and as the device has it.
pub trait Visibility {
    fn exact(&mut self, light: usize) -> f64;
    fn measured(&mut self, light: usize) -> f64;
}

/// Radiance with nothing at work, and what each part adds to it, in nits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Explained {
    pub truth: DVec3,
    pub parts: [DVec3; SWITCHES.len()],
}

impl Seen<'_> {
    /// Takes a pixel apart: the light of every set of parts at work.
    pub fn explain(&self, illumination: &Illumination, visibility: &mut dyn Visibility) -> Explained {
        let sets = 0..1 << SWITCHES.len();
        let values: Vec<DVec3> = sets.map(|set| self.shade(set, illumination, visibility)).collect();
        Explained { truth: values[0], parts: shapley(&values) }
    }

    fn shade(&self, set: usize, illumination: &Illumination, visibility: &mut dyn Visibility) -> DVec3 {
        let surface = self.surface(set);
        let mut share = |light| match set & SHADOWS != 0 {
            true => visibility.measured(light),
            false => visibility.exact(light),
        };
        match set & ARITHMETIC != 0 {
            true => radiance::<f32>(&surface, illumination, &mut share),
            false => radiance::<f64>(&surface, illumination, &mut share),
        }
    }

    fn surface(&self, set: usize) -> Surface {
        let mut surface = *self.truth;
        if set & POSITION != 0 {
            surface.position = self.own.position;
        }
        match (set & TEXTURES != 0, set & GBUFFER != 0) {
            (false, false) => {}
            (true, false) => store(&mut surface, self.unquantized),
            (true, true) => store(&mut surface, self.own),
            // What quantization does to the device's surface is done to the true one.
            (false, true) => store(&mut surface, &moved(self.truth, self.unquantized, self.own)),
        }
        surface
    }
}

fn store(surface: &mut Surface, stored: &Stored) {
    surface.normal = stored.normal;
    surface.albedo = stored.albedo;
    surface.metallic = stored.metallic;
    surface.occlusion = stored.occlusion;
    surface.emissive = stored.emissive;
    match stores_shininess(surface.brdf) {
        true => surface.shininess = shininess(stored.roughness),
        false => surface.roughness = stored.roughness,
    }
}

/// A surface, moved as far as `to` is from `from`.
fn moved(surface: &Surface, from: &Stored, to: &Stored) -> Stored {
    // The inverse of `shininess`.
    let encoded = (surface.shininess + 1.0).log2() / 20.0;
    let roughness = if stores_shininess(surface.brdf) { encoded } else { surface.roughness };
    Stored {
        position: to.position,
        normal: (surface.normal + to.normal - from.normal).normalize_or(surface.normal),
        albedo: (surface.albedo + to.albedo - from.albedo).clamp(DVec3::ZERO, DVec3::ONE),
        metallic: (surface.metallic + to.metallic - from.metallic).clamp(0.0, 1.0),
        roughness: (roughness + to.roughness - from.roughness).clamp(0.0, 1.0),
        occlusion: (surface.occlusion + to.occlusion - from.occlusion).clamp(0.0, 1.0),
        emissive: (surface.emissive + to.emissive - from.emissive).max(DVec3::ZERO),
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::reference::Smith;
    use crate::scene::{Brdf, Environment, Light, LightKind};

    /// A light that is half hidden, and to the device a quarter.
    struct Half;

    impl Visibility for Half {
        fn exact(&mut self, _: usize) -> f64 {
            0.5
        }

        fn measured(&mut self, _: usize) -> f64 {
            0.75
        }
    }

    fn surface() -> Surface {
        Surface {
            position: DVec3::new(0.0, -2.0, 0.0),
            normal: DVec3::Y,
            geometric_normal: DVec3::Y,
            brdf: Brdf::Lambert,
            albedo: DVec3::splat(0.5),
            metallic: 0.0,
            roughness: 0.5,
            specular: DVec3::ZERO,
            shininess: 30.0,
            occlusion: 1.0,
            emissive: DVec3::ZERO,
            alpha: 1.0,
            receives_shadow: true,
        }
    }

    fn stored(surface: &Surface) -> Stored {
        let Surface { position, normal, albedo, metallic, roughness, occlusion, emissive, .. } = *surface;
        let encoded = (surface.shininess + 1.0).log2() / 20.0;
        let roughness = if stores_shininess(surface.brdf) { encoded } else { roughness };
        Stored { position, normal, albedo, metallic, roughness, occlusion, emissive }
    }

    fn explain(truth: &Surface, own: &Stored, unquantized: &Stored) -> Explained {
        let light = Light {
            name: "sun".into(),
            kind: LightKind::Directional { direction: DVec3::new(0.0, -1.0, 0.0) },
            color: Vec3::ONE,
            intensity: std::f32::consts::PI,
            casts_shadow: true,
            size: 0.0,
        };
        let environment = Environment::default();
        let illumination =
            Illumination { lights: &[light], environment: &environment, eye: DVec3::ZERO, smith: Smith::default() };
        Seen { truth, own, unquantized }.explain(&illumination, &mut Half)
    }

    /// The largest of each part, except for arithmetic's.
    fn sizes(explained: &Explained) -> [f64; 4] {
        [0, 1, 2, 3].map(|part| explained.parts[part].abs().max_element())
    }

    #[test]
    fn a_device_that_is_right_is_told_of_its_shadows_and_its_arithmetic_only() {
        let truth = surface();
        let explained = explain(&truth, &stored(&truth), &stored(&truth));
        // Half of an albedo of a half against three quarters.
        assert!((explained.truth.x - 0.25).abs() < 1e-7, "{explained:?}");
        let [textures, gbuffer, position, shadows] = sizes(&explained);
        assert_eq!([textures, gbuffer, position], [0.0; 3]);
        assert!((shadows - 0.125).abs() < 1e-7);
        assert!(explained.parts[4].abs().max_element() < 1e-7);
    }

    #[test]
    fn each_change_is_its_own_part_and_all_add_up() {
        let truth = surface();
        let filtered = Stored { albedo: DVec3::splat(0.6), ..stored(&truth) };
        let coarse = Stored { normal: DVec3::new(0.6, 0.8, 0.0), ..filtered };
        let shifted = Stored { position: truth.position * 1.5, ..stored(&truth) };
        let only =
            |own: &Stored, unquantized: &Stored| sizes(&explain(&truth, own, unquantized)).map(|size| size > 1e-6);
        assert_eq!(only(&filtered, &filtered), [true, false, false, true]);
        assert_eq!(only(&coarse, &filtered), [true, true, false, true]);
        // A lambert surface under parallel light looks the same from everywhere.
        assert_eq!(only(&shifted, &stored(&truth)), [false, false, false, true]);
        let explained = explain(&truth, &coarse, &filtered);
        let sum: DVec3 = explained.parts.into_iter().sum();
        // 0.6 of the cosine 0.8, three quarters of it, against 0.5 of 1, half of it.
        assert!((sum - DVec3::splat(0.6 * 0.8 * 0.75 - 0.25)).abs().max_element() < 1e-6, "{sum}");
    }

    #[test]
    fn a_phong_lobe_takes_its_shininess_from_where_roughness_is_stored() {
        let truth = Surface { brdf: Brdf::Phong, specular: DVec3::ONE, ..surface() };
        let same = stored(&truth);
        let broader = Stored { roughness: same.roughness - 0.05, ..same };
        assert!(sizes(&explain(&truth, &same, &same))[..2].iter().all(|size| *size < 1e-9));
        let [textures, gbuffer, ..] = sizes(&explain(&truth, &broader, &same));
        assert!(textures < 1e-9 && gbuffer > 0.1, "{textures} {gbuffer}");
    }
}
