//! A pixel's light as a function of the parts at work: the truth with none of them, and the device's light with all.

use glam::DVec3;

use super::device::{GbufferTexel, shininess, stores_shininess};
use super::formats::Formats;
use super::shapley::shapley;
use afterlight_truth::reference::ShadingPoint;
use afterlight_truth::reference::light::{Illumination, radiance};

pub const HDR: &str = "HDR format";
pub const OUTPUT: &str = "tone mapping and 8-bit output";
/// Parts that can be switched one by one, in the order of their bits: first the parts of the shading, then the formats that hold its light.
pub const SWITCHES: [&str; 7] =
    ["texture filtering", "G-buffer quantization", "position from depth", "shadows", "BRDF arithmetic", HDR, OUTPUT];
const TEXTURES: usize = 1 << 0;
const GBUFFER: usize = 1 << 1;
const POSITION: usize = 1 << 2;
const SHADOWS: usize = 1 << 3;
const ARITHMETIC: usize = 1 << 4;
/// The number of combinations of the shading's switches.
const SHADINGS: usize = 1 << 5;
const HDR_PART: usize = 5;
const OUTPUT_PART: usize = 6;

/// A surface in a pixel: as it is, and as the device has it.
#[derive(Debug, Clone, Copy)]
pub struct PixelSurface<'a> {
    pub truth: &'a ShadingPoint,
    pub own: &'a GbufferTexel,
    pub unquantized: &'a GbufferTexel,
}

/// The share of a light that arrives, by its index: as it is, and as the device has it.
pub trait LightVisibility {
    fn exact(&mut self, light: usize) -> f64;
    fn measured(&mut self, light: usize) -> f64;
}

/// A pixel's light by every set of the shading's parts at work, in nits or exposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shades(pub [DVec3; SHADINGS]);

/// The measurements of a pixel, exposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelMeasurements {
    /// Light in 32 bits.
    pub unrounded: DVec3,
    /// The difference that the light's target makes.
    pub hdr: DVec3,
    /// The difference that the picture makes to the target's light, referred back to light.
    pub output: DVec3,
}

impl Shades {
    /// The light with no part at work.
    pub fn truth(&self) -> DVec3 {
        self.0[0]
    }

    /// The light with all of the shading's parts at work.
    pub fn all(&self) -> DVec3 {
        self.0[SHADINGS - 1]
    }

    /// Returns the effect of each switch, averaged over all orders. They add up to `all - truth + hdr + output`.
    ///
    /// The effect of formats on light that was not measured is modelled. The model's error at the measured light is added to the formats' parts.
    pub fn apart(&self, formats: &Formats, measured: &PixelMeasurements) -> [DVec3; SWITCHES.len()] {
        // So that where everything is at work, formats get the light that the device gave them.
        let offset = measured.unrounded - self.all();
        let mut values = [DVec3::ZERO; 1 << SWITCHES.len()];
        for (set, shade) in self.0.iter().enumerate() {
            let light = *shade + offset;
            let kept = formats.kept(light);
            let shown = formats.shown(light);
            let kept_and_shown = if kept == light { shown } else { formats.shown(kept) };
            for (both, value) in [light, kept, shown, kept_and_shown].into_iter().enumerate() {
                values[set | both << HDR_PART] = value;
            }
        }
        let mut parts: [DVec3; SWITCHES.len()] = shapley(&values);
        let [.., shaded, kept, _, shown] = [0, 1, 2, 3].map(|both| values[(SHADINGS - 1) | both << HDR_PART]);
        parts[HDR_PART] += measured.hdr - (kept - shaded);
        parts[OUTPUT_PART] += measured.output - (shown - kept);
        parts
    }
}

impl PixelSurface<'_> {
    /// A pixel's light in nits.
    pub fn shades(&self, illumination: &Illumination, visibility: &mut dyn LightVisibility) -> Shades {
        Shades(std::array::from_fn(|set| self.shade(set, illumination, visibility)))
    }

    fn shade(&self, set: usize, illumination: &Illumination, visibility: &mut dyn LightVisibility) -> DVec3 {
        let surface = self.surface(set);
        let mut share = |light| match set & SHADOWS != 0 {
            true => DVec3::splat(visibility.measured(light)),
            false => DVec3::splat(visibility.exact(light)),
        };
        match set & ARITHMETIC != 0 {
            true => radiance::<f32>(&surface, illumination, &mut share),
            false => radiance::<f64>(&surface, illumination, &mut share),
        }
    }

    fn surface(&self, set: usize) -> ShadingPoint {
        let mut surface = *self.truth;
        if set & POSITION != 0 {
            // Shaders look along the ray of the pixel, wherever the place is.
            surface.ray = Some(surface.position);
            surface.position = self.own.position;
        }
        match (set & TEXTURES != 0, set & GBUFFER != 0) {
            (false, false) => {}
            (true, false) => store(&mut surface, self.unquantized),
            (true, true) => store(&mut surface, self.own),
            // The change of the device's surface by quantization is made to the true one.
            (false, true) => store(&mut surface, &moved(self.truth, self.unquantized, self.own)),
        }
        surface
    }
}

fn store(surface: &mut ShadingPoint, stored: &GbufferTexel) {
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
fn moved(surface: &ShadingPoint, from: &GbufferTexel, to: &GbufferTexel) -> GbufferTexel {
    // The inverse of `shininess`.
    let encoded = (surface.shininess + 1.0).log2() / 20.0;
    let roughness = if stores_shininess(surface.brdf) { encoded } else { surface.roughness };
    GbufferTexel {
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
    use super::*;
    use afterlight::scene::{Brdf, Environment, HdrFormat, Light, LightKind, Tonemap};
    use afterlight_truth::reference::{Smith, SurfaceLobes};

    /// A light that is half hidden, and to the device a quarter.
    struct Half;

    impl LightVisibility for Half {
        fn exact(&mut self, _: usize) -> f64 {
            0.5
        }

        fn measured(&mut self, _: usize) -> f64 {
            0.75
        }
    }

    fn surface() -> ShadingPoint {
        ShadingPoint {
            position: DVec3::new(0.0, -2.0, 0.0),
            ray: None,
            normal: DVec3::Y,
            geometric_normal: DVec3::Y,
            brdf: Brdf::Lambert,
            albedo: DVec3::splat(0.5),
            metallic: 0.0,
            roughness: 0.5,
            specular: DVec3::ZERO,
            reflectance: DVec3::splat(0.04),
            grazing: 1.0,
            shininess: 30.0,
            lobes: SurfaceLobes::NONE,
            occlusion: 1.0,
            emissive: DVec3::ZERO,
            alpha: 1.0,
            receives_shadow: true,
        }
    }

    fn stored(surface: &ShadingPoint) -> GbufferTexel {
        let ShadingPoint { position, normal, albedo, metallic, roughness, occlusion, emissive, .. } = *surface;
        let encoded = (surface.shininess + 1.0).log2() / 20.0;
        let roughness = if stores_shininess(surface.brdf) { encoded } else { roughness };
        GbufferTexel { position, normal, albedo, metallic, roughness, occlusion, emissive }
    }

    fn shades(truth: &ShadingPoint, own: &GbufferTexel, unquantized: &GbufferTexel) -> Shades {
        let light = Light {
            name: "sun".into(),
            intensity: std::f32::consts::PI,
            casts_shadow: true,
            ..Light::of(LightKind::Directional { direction: DVec3::new(0.0, -1.0, 0.0) })
        };
        let environment = Environment::default();
        let illumination = Illumination {
            lights: &[light],
            environment: &environment,
            eye: DVec3::ZERO,
            open: 1.0,
            open_behind: 1.0,
            sky: None,
            smith: Smith::default(),
        };
        PixelSurface { truth, own, unquantized }.shades(&illumination, &mut Half)
    }

    /// Nothing is rounded.
    const EXACT: Formats = Formats { hdr: None, output: None };

    /// The parts on a device that agrees with the model.
    fn parts(shades: &Shades, formats: &Formats) -> [DVec3; SWITCHES.len()] {
        let unrounded = shades.all();
        let kept = formats.kept(unrounded);
        let measured = PixelMeasurements { unrounded, hdr: kept - unrounded, output: formats.shown(kept) - kept };
        shades.apart(formats, &measured)
    }

    /// The largest of each part of the shading, except for arithmetic's.
    fn sizes(shades: &Shades) -> [f64; 4] {
        let parts = parts(shades, &EXACT);
        [0, 1, 2, 3].map(|part| parts[part].abs().max_element())
    }

    #[test]
    fn a_device_that_is_right_is_told_of_its_shadows_and_its_arithmetic_only() {
        let truth = surface();
        let shades = shades(&truth, &stored(&truth), &stored(&truth));
        // Half of an albedo of a half against three quarters.
        assert!((shades.truth().x - 0.25).abs() < 1e-7, "{shades:?}");
        let [textures, gbuffer, position, shadows] = sizes(&shades);
        assert_eq!([textures, gbuffer, position], [0.0; 3]);
        assert!((shadows - 0.125).abs() < 1e-7);
        let [.., arithmetic, hdr, output] = parts(&shades, &EXACT);
        assert!(arithmetic.abs().max_element() < 1e-7 && [hdr, output] == [DVec3::ZERO; 2]);
    }

    #[test]
    fn each_change_is_its_own_part_and_all_add_up() {
        let truth = surface();
        let filtered = GbufferTexel { albedo: DVec3::splat(0.6), ..stored(&truth) };
        let coarse = GbufferTexel { normal: DVec3::new(0.6, 0.8, 0.0), ..filtered };
        let shifted = GbufferTexel { position: truth.position * 1.5, ..stored(&truth) };
        let only = |own: &GbufferTexel, unquantized: &GbufferTexel| {
            sizes(&shades(&truth, own, unquantized)).map(|size| size > 1e-6)
        };
        assert_eq!(only(&filtered, &filtered), [true, false, false, true]);
        assert_eq!(only(&coarse, &filtered), [true, true, false, true]);
        // A lambert surface under parallel light looks the same from everywhere.
        assert_eq!(only(&shifted, &stored(&truth)), [false, false, false, true]);
        let sum: DVec3 = parts(&shades(&truth, &coarse, &filtered), &EXACT).into_iter().sum();
        // 0.6 of the cosine 0.8, three quarters of it, against 0.5 of 1, half of it.
        assert!((sum - DVec3::splat(0.6 * 0.8 * 0.75 - 0.25)).abs().max_element() < 1e-6, "{sum}");
    }

    #[test]
    fn a_phong_lobe_takes_its_shininess_from_where_roughness_is_stored() {
        let truth = ShadingPoint { brdf: Brdf::Phong, specular: DVec3::ONE, ..surface() };
        let same = stored(&truth);
        let broader = GbufferTexel { roughness: same.roughness - 0.05, ..same };
        assert!(sizes(&shades(&truth, &same, &same))[..2].iter().all(|size| *size < 1e-9));
        let [textures, gbuffer, ..] = sizes(&shades(&truth, &broader, &same));
        assert!(textures < 1e-9 && gbuffer > 0.1, "{textures} {gbuffer}");
    }

    /// A light's shadow is wrong by an eighth, and the rest is right.
    fn in_the_shadow() -> Shades {
        let truth = surface();
        shades(&truth, &stored(&truth), &stored(&truth))
    }

    #[test]
    fn formats_are_averaged_over_orders_too() {
        // Steps of the packed format from a quarter to a half are 1/256, and 1/128 in blue: 0.25 of the truth and 0.375 of the device
        // are codes of it. They are none of the picture.
        let formats = Formats { hdr: Some(HdrFormat::B10g11r11), output: Some(Tonemap::None) };
        let shades = in_the_shadow();
        let [textures, _, _, shadows, arithmetic, hdr, output] = parts(&shades, &formats);
        assert_eq!(textures, DVec3::ZERO);
        let rounded = |light: DVec3| formats.shown(light) - light;
        // Shadows and output meet: half of the orders have one first. Arithmetic is too little to count.
        let expected = (rounded(shades.truth()) + rounded(shades.all())) * 0.5;
        assert!((output - expected).abs().max_element() < 1e-6, "{output}, not {expected}");
        let expected = shades.all() - shades.truth() + (rounded(shades.all()) - rounded(shades.truth())) * 0.5;
        assert!((shadows - expected).abs().max_element() < 1e-6, "{shadows}, not {expected}");
        assert!(rounded(shades.all()).abs().min_element() > 1e-4 && expected.x != 0.125);
        assert!(hdr.abs().max_element() < 1e-6 && arithmetic.abs().max_element() < 1e-6, "{hdr} {arithmetic}");
    }

    #[test]
    fn what_a_driver_does_and_the_model_does_not_is_its_formats() {
        let formats = Formats { hdr: Some(HdrFormat::Rgba16f), output: Some(Tonemap::Neutral) };
        let shades = in_the_shadow();
        let model = parts(&shades, &formats);
        let (hdr, output) = (DVec3::splat(0.01), DVec3::new(0.0, -0.02, 0.03));
        // Light that is cut off, or not explained, is none of these parts.
        let measured = PixelMeasurements { unrounded: shades.all() * 0.75, hdr, output };
        let found = shades.apart(&formats, &measured);
        let sum: DVec3 = found.into_iter().sum();
        let expected = shades.all() - shades.truth() + hdr + output;
        assert!((sum - expected).abs().max_element() < 1e-14, "{sum}, not {expected}");
        assert!((found[HDR_PART] - hdr).abs().max_element() < 1e-3, "{found:?}");
        assert!((found[3] - model[3]).abs().max_element() < 5e-3, "{found:?} {model:?}");
    }
}
