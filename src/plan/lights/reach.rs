//! The reach of a light: its range, or the certified cut-off.

use glam::DVec3;

use crate::scene::{Aabb, AlphaMode, Brdf, Falloff, Light, Material, Object, Scene, Settings, TextureSlot, Tonemap};

/// Metres beyond which no scene of f32 positions extends.
const FARTHEST: f64 = 1e30;

/// Returns true if light paths can leave this light out somewhere.
pub(in crate::plan) fn bounded(light: &Light, settings: &Settings) -> bool {
    let form = light.kind.form();
    form.range.is_some() || (settings.light_cutoff && form.falloff.is_some_and(weakens))
}

/// Returns true if light grows weaker with distance at all: a polynomial of nothing but a constant does not.
pub(crate) fn weakens(falloff: Falloff) -> bool {
    !matches!(falloff, Falloff::Polynomial { linear: 0.0, quadratic: 0.0, .. })
}

/// A sphere around all that a light reaches, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    pub center: DVec3,
    /// Metres; infinite for a light without a limit.
    pub radius: f64,
}

impl Reach {
    pub fn touches(&self, bounds: &Aabb) -> bool {
        !bounds.is_empty() && self.center.clamp(bounds.min, bounds.max).distance(self.center) <= self.radius
    }
}

/// The sphere around everything that a light lights within `reach` metres.
pub(crate) fn sphere_of(light: &Light, reach: f64) -> Reach {
    let (center, radius) = light.kind.form().sphere(reach);
    Reach { center, radius }
}

/// The reach of each light in metres: its range, or with the certified cut-off the distance beyond which the sum of all dropped light stays below
/// half a step of the output; else infinity.
///
/// A light of I candela brings a pixel at most `exposure I B / d^2`, where B bounds the reflection of all materials
/// ([`largest_reflection`]). Half a step of 8 bits, 0.5 / 255, divided by the steepest slope of tone curve and sRGB encoding
/// ([`steepest`]) may be dropped in all, an even share by each light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightCutoff {
    enabled: bool,
    /// Brightest pixel for each candela, at a metre, in nits.
    reflection: f64,
    exposure: f32,
    /// The error that each light may cause.
    share: f64,
}

impl LightCutoff {
    pub(crate) fn of(scene: &Scene, settings: &Settings, exposure: f32) -> Self {
        let without = |light: &&Light| light.shines() && range_of(light).is_none() && bounded(light, settings);
        let count = scene.lights.iter().filter(without).count();
        // A pane of glass adds its whole highlight to the light behind it, so each layer can lose another share. Other blended surfaces average,
        // which loses no more than one of them does.
        let is_glass = |object: &&Object| scene.materials[object.material].alpha_mode == AlphaMode::Glass;
        let panes = scene.objects.iter().filter(is_glass).map(|object| scene.meshes[object.mesh].indices.len() / 3);
        let layers = 1 + panes.sum::<usize>();
        let share = 0.5 / 255.0 / steepest(settings.tonemap) / (count.max(1) * layers) as f64;
        // Scanning textures only pays if some light can be cut off.
        let reflection = if count > 0 { largest_reflection(scene, settings) } else { 0.0 };
        Self { enabled: settings.light_cutoff, reflection, exposure, share }
    }

    pub(crate) fn exposed(self, exposure: f32) -> Self {
        Self { exposure, ..self }
    }

    pub(crate) fn reach(&self, light: &Light) -> f64 {
        let form = light.kind.form();
        let candela = f64::from(light.intensity) * f64::from(light.color.max_element());
        match (form.range, form.falloff) {
            (Some(range), _) => range,
            // Finite, as `bounded` says: lights that reach everywhere are sorted before the others.
            (None, Some(falloff)) if self.enabled && weakens(falloff) => {
                let brightest = f64::from(self.exposure) * self.reflection;
                distance_of(falloff, candela * brightest, self.share).min(FARTHEST)
            }
            (None, _) => f64::INFINITY,
        }
    }
}

/// The distance in metres beyond which the light is exactly zero, if it has a range.
pub(crate) fn range_of(light: &Light) -> Option<f64> {
    light.kind.form().range
}

/// The distance at which a light that is `brightest` at one metre's fall-off of 1 falls below `share`.
fn distance_of(falloff: Falloff, brightest: f64, share: f64) -> f64 {
    falloff.polynomial_radius(brightest, share).unwrap_or_else(|| (brightest / share).sqrt())
}

/// The steepest slope of the encoded output, 0 to 1, over exposed radiance. sRGB is steepest at black, 12.92; tone curves that are no steeper than 1
/// there add nothing. The values come from sampled colours, rounded up; a test in `src/passes/curves.rs` samples them again.
pub fn steepest(tonemap: Tonemap) -> f64 {
    match tonemap {
        Tonemap::None | Tonemap::Neutral => 12.93,
        Tonemap::Agx => 14.0,
        Tonemap::Aces => 14.0,
    }
}

/// A bound of f(l, v) NdotL over all materials that are drawn. Lambert: albedo / pi <= 1 / pi. Phong and Blinn-Phong: their
/// normalization at the peak. GGX: D <= 1 / (pi alpha^2), and V NdotL <= 1 / (2 alpha) as the height-correlated Smith term's
/// denominator is at least 2 NdotL sqrt(NdotV^2 (1 - alpha^2) + alpha^2) >= 2 NdotL alpha.
fn largest_reflection(scene: &Scene, settings: &Settings) -> f64 {
    use std::f64::consts::PI;
    let of = |material: &Material| {
        let shininess = f64::from(material.shininess);
        1.0 / PI
            + match material.model(settings.brdf) {
                Brdf::Lambert => 0.0,
                Brdf::Phong => (shininess + 2.0) / (2.0 * PI),
                Brdf::BlinnPhong => (shininess + 8.0) / (8.0 * PI),
                Brdf::CookTorrance => {
                    let alpha = least_roughness(scene, material).powi(2);
                    1.0 / (2.0 * PI * alpha.powi(3))
                }
            }
    };
    scene.objects.iter().map(|object| of(&scene.materials[object.material])).fold(1.0 / PI, f64::max)
}

/// The least perceptual roughness of the reflection models. As f64: the nearest f32, which shaders have, would move the bound.
const MIN_ROUGHNESS: f64 = 0.01;
const _: () = assert!(MIN_ROUGHNESS as f32 == crate::shaders::shared::brdf::MIN_ROUGHNESS);

/// The least perceptual roughness of a material, its texture included.
fn least_roughness(scene: &Scene, material: &Material) -> f64 {
    let texture = material.textures().find(|(slot, _)| *slot == TextureSlot::MetallicRoughness);
    let least = texture.map_or(255, |(_, index)| {
        let mut least = 255;
        // Texels that cannot be read are 0, the bound of all.
        scene.textures[index].any_texel(|[_, green, ..]| {
            least = green.min(least);
            least == 0
        });
        least
    });
    // G-buffers store 8 bits: half a step less.
    (f64::from(material.roughness) * f64::from(least) / 255.0 - 0.5 / 255.0).max(MIN_ROUGHNESS)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples;
    use crate::scene::LightKind;

    proptest! {
        #[test]
        fn all_that_a_cone_reaches_lies_in_its_sphere(
            angle in 0.0..180.0f64, reach in 0.1..10.0f64, share in 0.0..=1.0f64, turn in 0.0..6.2f64, distance in 0.0..=1.0f64,
        ) {
            let light = Light { kind: cone(angle), ..samples::spot(Falloff::InverseSquare) };
            let sphere = sphere_of(&light, reach);
            let off_axis = (angle * share).to_radians();
            let around = DVec3::new(turn.cos(), turn.sin(), 0.0) * off_axis.sin();
            let point = DVec3::Z + (DVec3::NEG_Z * off_axis.cos() + around) * reach * distance;
            prop_assert!(point.distance(sphere.center) <= sphere.radius * (1.0 + 1e-9), "{point} {sphere:?}");
        }
    }

    fn cone(outer_angle_degrees: f64) -> LightKind {
        LightKind::Spot {
            position: DVec3::Z,
            direction: DVec3::NEG_Z,
            inner_angle_degrees: 0.0,
            outer_angle_degrees,
            range: None,
            falloff: Falloff::InverseSquare,
        }
    }

    #[test]
    fn the_cut_off_shares_half_a_step_among_all_lights_without_a_range() {
        let lamp = Light { intensity: 10.0, ..samples::spot(Falloff::InverseSquare) };
        let scene = samples::scene(vec![samples::material(Brdf::Lambert)], vec![lamp; 4]);
        let settings = Settings { light_cutoff: true, tonemap: Tonemap::None, ..Settings::default() };
        let reaches = |settings: &Settings| -> Vec<f64> {
            let cut = LightCutoff::of(&scene, settings, 2.0);
            scene.lights.iter().map(|light| cut.reach(light)).collect()
        };
        let off = reaches(&Settings::default());
        let reaches = reaches(&settings);
        let dropped: f64 = reaches.iter().map(|d| 2.0 * 10.0 / std::f64::consts::PI / (d * d)).sum();
        assert!((dropped * 12.93 * 255.0 / 0.5 - 1.0).abs() < 1e-9, "{dropped}");
        assert!(off.iter().all(|d| d.is_infinite()));
        // A square of glass is two triangles, which may lie over one pixel: three layers share the step.
        let mut glazed = scene.clone();
        let glass = Material { alpha_mode: AlphaMode::Glass, ..samples::material(Brdf::Lambert) };
        glazed.materials[0] = glass;
        let far = LightCutoff::of(&glazed, &settings, 2.0).reach(&glazed.lights[0]);
        assert!((far / reaches[0] - 3f64.sqrt()).abs() < 1e-9, "{far}");
    }
}
