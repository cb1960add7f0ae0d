//! How pixels meet their lights: which path the plan takes, and how far each light reaches.

use glam::DVec3;

use super::{Capabilities, Error, PlannedLights, World};
use crate::scene::{
    Aabb, AlphaMode, Brdf, Falloff, GbufferChoice, HdrFormat, Light, LightKind, LightPath, Material, Object, Output,
    Scene, Settings, TextureSlot, Tonemap, View, unit,
};

/// `auto` takes `loop` up to this many local lights: neither lists nor compute save what they cost.
const FEW_LIGHTS: usize = 4;

/// Metres beyond which no scene of f32 positions extends.
const FARTHEST: f64 = 1e30;

/// Invocations of a work group of TILED (`shaders/tiled.wgsl`).
const TILE_INVOCATIONS: u32 = 256;

/// The path that a plan takes, never `Auto`, and why.
pub(super) fn choose(
    scene: &Scene,
    settings: &Settings,
    lights: &PlannedLights,
    planned: &[usize],
    device: &Capabilities,
) -> Result<(LightPath, String), Error> {
    let lit = matches!(settings.view, View::Final | View::Lighting);
    if settings.light_cutoff && settings.output == Output::Nits {
        return Err(Error::CutoffWithoutSteps);
    }
    if !lit {
        return match settings.light_path {
            LightPath::Forward | LightPath::ForwardNaive if needs_gbuffer(settings.view) => {
                Err(Error::NoGbuffer(settings.light_path))
            }
            _ => Ok((LightPath::Loop, "a view of a buffer meets no lights".into())),
        };
    }
    let blends = matches!(settings.light_path, LightPath::PerLight | LightPath::Volumes);
    if blends && !device.float32_blends {
        return Err(Error::NoFloatBlending(settings.light_path));
    }
    if blends && settings.hdr_format == HdrFormat::B10g11r11 {
        return Err(Error::BlendedFormat(settings.light_path, settings.hdr_format));
    }
    if let (LightPath::Compute, Some(effect)) = (settings.light_path, settings.first_effect()) {
        return Err(Error::ComputeWithEffect(effect));
    }
    if settings.light_path == LightPath::Compute && device.compute_invocations < TILE_INVOCATIONS {
        return Err(Error::WorkGroup(TILE_INVOCATIONS, device.compute_invocations));
    }
    match settings.light_path {
        LightPath::Auto => {}
        LightPath::PerLight | LightPath::Volumes | LightPath::Clustered | LightPath::Compute if !lights.any() => {
            return Ok((LightPath::Loop, format!("{} was asked for, and there is no light", settings.light_path)));
        }
        asked => return Ok((asked, "asked for".into())),
    }
    let bounded = planned.iter().filter(|&&index| bounded(&scene.lights[index], settings)).count();
    if is_plain(scene, settings, planned) {
        let met = if planned.is_empty() { "no light" } else { "one directional light, without a shadow" };
        let why = format!("{met}, and no texture: a surface is lit for less than a G-buffer of it is written");
        let path = if settings.depth_prepass == Some(true) { LightPath::Forward } else { LightPath::ForwardNaive };
        return Ok((path, why));
    }
    let directional = |index: &&usize| matches!(scene.lights[**index].kind, LightKind::Directional { .. });
    let local = planned.len() - planned.iter().filter(directional).count();
    let out = compute_is_out(scene, settings, device);
    if local > FEW_LIGHTS && out.is_none() {
        // Even if all of them reach everywhere.
        return Ok((LightPath::Compute, format!("{local} local lights: a GPU computes faster than it shades")));
    }
    if !lights.bounded {
        return Ok((LightPath::Loop, "no light has a limited reach, so that there is nothing to leave out".into()));
    }
    let many = format!("{bounded} lights of limited reach");
    if bounded <= FEW_LIGHTS {
        return Ok((LightPath::Loop, format!("{many}: lists cost more than they save")));
    }
    let instead = out.map_or_else(String::new, |why| format!("; not by compute, as {why}"));
    Ok((LightPath::Clustered, format!("{many}: each pixel meets its own{instead}")))
}

/// Whether surfaces are so plain that each is best lit as it is drawn. Measured in docs/LIGHT_PATHS.md: with one light this beats the loop for any number
/// of layers on a GPU, and up to two on a CPU even where they lie back to front; draws go from near to far.
///
/// What is shadowed, textured or transparent is not: overdraw then costs more. Nor are several samples a pixel, which the two ways
/// shade differently, or a layout of the G-buffer that was asked for. What is kept without need does not count.
fn is_plain(scene: &Scene, settings: &Settings, planned: &[usize]) -> bool {
    let lit = match planned {
        [] => true,
        &[one] => matches!(scene.lights[one].kind, LightKind::Directional { .. }),
        _ => false,
    };
    let plain = |object: &Object| {
        let material = &scene.materials[object.material];
        material.textures().next().is_none() && !material.is_transparent()
    };
    lit && settings.msaa == 1
        && settings.gbuffer == GbufferChoice::default()
        && super::shadow_reason(scene, settings, planned).is_err()
        && scene.objects.iter().all(plain)
}

/// Why `auto` does not choose compute: what the path cannot do, and where it is known to be slower (docs/LIGHT_PATHS.md, "Measured").
fn compute_is_out(scene: &Scene, settings: &Settings, device: &Capabilities) -> Option<&'static str> {
    let transparent = scene.objects.iter().any(|object| scene.materials[object.material].is_transparent());
    [
        (device.software, "a CPU keeps no list in shared memory faster than in any other"),
        (device.lazily_allocated, "the G-buffer would leave the tile"),
        (device.compute_invocations < TILE_INVOCATIONS, "the device's work groups are too small"),
        (transparent, "transparent surfaces come after it"),
        (settings.first_effect().is_some(), "the picture goes through another pass"),
        (settings.msaa > 1, "it reads one sample a pixel"),
    ]
    .into_iter()
    .find_map(|(out, why)| out.then_some(why))
}

fn needs_gbuffer(view: View) -> bool {
    !matches!(view, View::Overdraw | View::Triangle | View::ShadowMap)
}

/// Whether a light paths can leave this light out somewhere.
pub(super) fn bounded(light: &Light, settings: &Settings) -> bool {
    match light.kind {
        LightKind::Directional { .. } => false,
        LightKind::Point { range, falloff, .. } | LightKind::Spot { range, falloff, .. } => {
            range.is_some() || (settings.light_cutoff && weakens(falloff))
        }
    }
}

/// Whether light grows weaker with distance at all: a polynomial of nothing but a constant does not.
pub(super) fn weakens(falloff: Falloff) -> bool {
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

/// The sphere around what a light brings light to within `reach` metres. A narrow cone's is smaller than the light's own: that
/// through its apex and the rim of its base, or that around the rim alone where the cone is wider than 45 degrees.
pub(super) fn sphere_of(light: &Light, reach: f64) -> Reach {
    match light.kind {
        LightKind::Directional { .. } => Reach { center: DVec3::ZERO, radius: f64::INFINITY },
        LightKind::Point { position, .. } => Reach { center: position, radius: reach },
        LightKind::Spot { position, direction, outer_angle_degrees, .. } => {
            // Of a scene's own lights it may have any length.
            let direction = unit(direction).unwrap_or(direction);
            let angle = outer_angle_degrees.to_radians();
            if !reach.is_finite() || angle >= std::f64::consts::FRAC_PI_2 {
                Reach { center: position, radius: reach }
            } else if angle <= std::f64::consts::FRAC_PI_4 {
                let radius = reach / (2.0 * angle.cos());
                Reach { center: position + direction * radius, radius }
            } else {
                Reach { center: position + direction * (reach * angle.cos()), radius: reach * angle.sin() }
            }
        }
    }
}

/// How far each light reaches in metres: its range, or with the certified cut-off the distance beyond which the sum of all
/// that is dropped stays below half a step of the output; else infinity.
///
/// A light of I candela brings a pixel at most `exposure I B / d^2`, where B bounds the reflection of all materials
/// ([`largest_reflection`]). Half a step of 8 bits, 0.5 / 255, divided by the steepest slope of tone curve and sRGB encoding
/// ([`steepest`]) may be dropped in all, an even share by each light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    enabled: bool,
    /// Brightest pixel for each candela, at a metre, in nits.
    reflection: f64,
    exposure: f32,
    /// What each light may drop.
    share: f64,
}

impl Cut {
    pub(super) fn of(scene: &Scene, settings: &Settings, exposure: f32) -> Self {
        let without = |light: &&Light| World::shines(light) && range_of(light).is_none() && bounded(light, settings);
        let count = scene.lights.iter().filter(without).count();
        // A pane of glass adds its whole highlight to what is behind it, so that each layer may drop as much again. Other surfaces
        // that blend take a mean, which drops no more than one of them.
        let is_glass = |object: &&Object| scene.materials[object.material].alpha_mode == AlphaMode::Glass;
        let panes = scene.objects.iter().filter(is_glass).map(|object| scene.meshes[object.mesh].indices.len() / 3);
        let layers = 1 + panes.sum::<usize>();
        let share = 0.5 / 255.0 / steepest(settings.tonemap) / (count.max(1) * layers) as f64;
        // Scanning textures is only worth it where there is something to cut.
        let reflection = if count > 0 { largest_reflection(scene, settings) } else { 0.0 };
        Self { enabled: settings.light_cutoff, reflection, exposure, share }
    }

    pub(super) fn exposed(self, exposure: f32) -> Self {
        Self { exposure, ..self }
    }

    pub(super) fn reach(&self, light: &Light) -> f64 {
        match light.kind {
            LightKind::Directional { .. } => f64::INFINITY,
            LightKind::Point { range, falloff, .. } | LightKind::Spot { range, falloff, .. } => {
                let candela = f64::from(light.intensity) * f64::from(light.color.max_element());
                match (range, self.enabled) {
                    (Some(range), _) => range,
                    // Finite, as `bounded` says: what reaches everywhere is sorted before what does not.
                    (None, true) if weakens(falloff) => {
                        let brightest = f64::from(self.exposure) * self.reflection;
                        distance_of(falloff, candela * brightest, self.share).min(FARTHEST)
                    }
                    (None, _) => f64::INFINITY,
                }
            }
        }
    }
}

/// Metres beyond which the light is exactly zero, if there is such a distance.
pub(super) fn range_of(light: &Light) -> Option<f64> {
    match light.kind {
        LightKind::Directional { .. } => None,
        LightKind::Point { range, .. } | LightKind::Spot { range, .. } => range,
    }
}

/// Where a light that is `brightest` at one metre's fall-off of 1 falls below `share`.
fn distance_of(falloff: Falloff, brightest: f64, share: f64) -> f64 {
    falloff.polynomial_radius(brightest, share).unwrap_or_else(|| (brightest / share).sqrt())
}

/// The steepest slope of the encoded output, 0 to 1, over exposed radiance. sRGB is steepest at black, 12.92; tone curves that are
/// no steeper than 1 there add nothing. Found by sampling colours (a test in `src/passes/tonemap.rs` does so again), rounded up.
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
            + match settings.brdf.unwrap_or(material.brdf) {
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

/// The least perceptual roughness of a material, its texture included. The model's own least is 0.01 (`shaders/shared/brdf.wgsl`).
fn least_roughness(scene: &Scene, material: &Material) -> f64 {
    let texture = material.textures().find(|(slot, _)| *slot == TextureSlot::MetallicRoughness);
    let least = texture.map_or(255, |(_, index)| {
        let texels = scene.textures[index].texels.chunks_exact(4);
        texels.map(|texel| texel[1]).min().unwrap_or(255)
    });
    // G-buffers store 8 bits: half a step less.
    (f64::from(material.roughness) * f64::from(least) / 255.0 - 0.5 / 255.0).max(0.01)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::{FramePlan, samples};
    use crate::scene::Keep;

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
    fn auto_chooses_by_lights_and_device_and_says_why() {
        let lamps = |count| {
            samples::scene(vec![samples::material(Brdf::Lambert)], vec![samples::point(Falloff::Quadratic); count])
        };
        let chosen = |scene: &Scene, settings: &Settings, device: &Capabilities| {
            let plan = FramePlan::of(scene, settings, device).expect("a plan");
            (plan.light_path, plan.light_path_reason)
        };
        let (gpu, defaults) = (samples::device(), Settings::default());
        let software = Capabilities { software: true, ..gpu };
        let tiler = Capabilities { lazily_allocated: true, ..gpu };
        assert_eq!(chosen(&lamps(FEW_LIGHTS), &defaults, &gpu).0, LightPath::Loop);
        assert_eq!(chosen(&lamps(FEW_LIGHTS + 1), &defaults, &gpu).0, LightPath::Compute);
        for (settings, device) in
            [(&defaults, &software), (&defaults, &tiler), (&Settings { fxaa: true, ..defaults.clone() }, &gpu)]
        {
            let (path, why) = chosen(&lamps(FEW_LIGHTS + 1), settings, device);
            assert!(path == LightPath::Clustered && why.contains("not by compute"), "{why}");
        }
        let mut unlimited = lamps(9);
        unlimited.lights = vec![samples::spot(Falloff::InverseSquare); 9];
        assert_eq!(chosen(&unlimited, &defaults, &gpu).0, LightPath::Compute);
        assert_eq!(chosen(&unlimited, &defaults, &software).0, LightPath::Loop);
        let cut = Settings { light_cutoff: true, ..defaults };
        assert_eq!(chosen(&unlimited, &cut, &software).0, LightPath::Clustered);
        for asked in [LightPath::Volumes, LightPath::Clustered, LightPath::Compute] {
            let settings = Settings { light_path: asked, ..Settings::default() };
            assert_eq!(chosen(&lamps(1), &settings, &software), (asked, "asked for".into()));
            assert_eq!(chosen(&lamps(0), &settings, &software).0, LightPath::Loop);
        }
    }

    #[test]
    fn auto_lights_plain_surfaces_as_it_draws_them_and_says_why() {
        let chosen = |scene: &Scene, settings: &Settings| {
            let plan = FramePlan::of(scene, settings, &samples::device()).expect("a plan");
            assert_eq!(plan.is_forward(), plan.gbuffer.is_none());
            // What is kept without need changes no path, or pictures could differ.
            let full = Settings { keep: Keep::ALL, ..settings.clone() };
            let full = FramePlan::of(scene, &full, &samples::device()).expect("a full plan");
            assert_eq!((full.light_path, &full.light_path_reason), (plan.light_path, &plan.light_path_reason));
            (plan.light_path, plan.light_path_reason)
        };
        let defaults = Settings::default();
        let one = |material: Material, lights: Vec<Light>| samples::scene(vec![material], lights);
        let lambert = || samples::material(Brdf::Lambert);
        for (scene, says) in [
            (one(lambert(), vec![samples::sky()]), "one directional light"),
            (one(samples::material(Brdf::CookTorrance), vec![samples::sky()]), "one directional light"),
            (one(samples::emissive(), vec![]), "no light"),
            (samples::scene(vec![lambert(), samples::material(Brdf::Phong)], vec![samples::sky()]), "no texture"),
        ] {
            let (path, why) = chosen(&scene, &defaults);
            assert!(path == LightPath::ForwardNaive && why.contains(says), "{path}: {why}");
            let prepass = Settings { depth_prepass: Some(true), ..Settings::default() };
            assert_eq!(chosen(&scene, &prepass).0, LightPath::Forward);
        }
        for (scene, settings) in [
            (one(lambert(), vec![samples::sky(); 2]), defaults.clone()),
            (one(lambert(), vec![samples::sun()]), defaults.clone()),
            (one(lambert(), vec![samples::spot(Falloff::InverseSquare)]), defaults.clone()),
            (one(samples::textured(Brdf::Lambert), vec![samples::sky()]), defaults.clone()),
            (one(samples::glass(), vec![samples::sky()]), defaults.clone()),
            (one(lambert(), vec![samples::sky()]), Settings { msaa: 4, ..Settings::default() }),
            (
                one(lambert(), vec![samples::sky()]),
                Settings { gbuffer: samples::gbuffers()[1].1, ..Settings::default() },
            ),
        ] {
            assert_eq!(chosen(&scene, &settings).0, LightPath::Loop);
        }
        // A sun whose shadows are switched off is as plain as one without.
        let mut settings = defaults;
        settings.shadows.enabled = false;
        assert_eq!(chosen(&one(lambert(), vec![samples::sun()]), &settings).0, LightPath::ForwardNaive);
    }

    #[test]
    fn the_cut_off_shares_half_a_step_among_all_lights_without_a_range() {
        let lamp = Light { intensity: 10.0, ..samples::spot(Falloff::InverseSquare) };
        let scene = samples::scene(vec![samples::material(Brdf::Lambert)], vec![lamp; 4]);
        let settings = Settings { light_cutoff: true, tonemap: Tonemap::None, ..Settings::default() };
        let reaches = |settings: &Settings| -> Vec<f64> {
            let cut = Cut::of(&scene, settings, 2.0);
            scene.lights.iter().map(|light| cut.reach(light)).collect()
        };
        let off = reaches(&Settings::default());
        let reaches = reaches(&settings);
        let dropped: f64 = reaches.iter().map(|d| 2.0 * 10.0 / std::f64::consts::PI / (d * d)).sum();
        assert!((dropped * 12.93 * 255.0 / 0.5 - 1.0).abs() < 1e-9, "{dropped}");
        assert!(off.iter().all(|d| d.is_infinite()));
        // Exposed as another, a world has that one's reaches.
        let world = |exposure: f32| {
            let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
            World::of(&scene, &settings, &plan, exposure)
        };
        let (mut brighter, darker) = (world(2.0), world(0.25));
        assert_eq!(brighter.reaches, reaches);
        assert!(brighter.reaches[0] > 2.0 * darker.reaches[0]);
        brighter.set_exposure(0.25);
        assert_eq!((brighter.exposure, brighter.reaches), (0.25, darker.reaches));
        // A square of glass is two triangles, which may lie over one pixel: three layers share the step.
        let mut glazed = scene.clone();
        let glass = Material { alpha_mode: AlphaMode::Glass, ..samples::material(Brdf::Lambert) };
        glazed.materials[0] = glass;
        let far = Cut::of(&glazed, &settings, 2.0).reach(&glazed.lights[0]);
        assert!((far / reaches[0] - 3f64.sqrt()).abs() < 1e-9, "{far}");
    }
}
