//! The light path that a plan takes: the way in which pixels meet their lights.

use std::fmt::Write as _;

use super::{PlannedLights, bounded};
use crate::plan::checks::TILE_SHARED_BYTES;
use crate::plan::shadows::shadow_reason;
use crate::plan::{Basis, COMPARED, Capabilities, CostModel, Load, PlanError, Refusal, RefusalReason};
use crate::plan::{effects, lacks_gbuffer, visibility};
use crate::scene::{GbufferChoice, HdrFormat, LightPath, Object, Output, Scene, Settings, View, counted};
use crate::shaders::tiled::WORKGROUP_SIZE;

/// Invocations of a work group of TILED.
const TILE_INVOCATIONS: u32 = WORKGROUP_SIZE[0] * WORKGROUP_SIZE[1];

/// The path that a plan takes, never `Auto`, and why.
pub(in crate::plan) fn choose(
    scene: &Scene,
    settings: &Settings,
    lights: &PlannedLights,
    planned: &[usize],
    device: &Capabilities,
) -> Result<(LightPath, String), PlanError> {
    check(settings, device)?;
    if !effects::is_lit(settings.view) {
        return Ok((LightPath::Loop, "this view is not lit".into()));
    }
    match settings.light_path {
        LightPath::Auto => {}
        LightPath::PerLight
        | LightPath::Volumes
        | LightPath::Clustered
        | LightPath::Compute
        | LightPath::Visibility
            if !lights.any() =>
        {
            return Ok((LightPath::Loop, format!("{} was asked for, but there is no light", settings.light_path)));
        }
        asked => return Ok((asked, "asked for".into())),
    }
    let bounded = planned.iter().filter(|&&index| bounded(&scene.lights[index], settings)).count();
    if is_plain(scene, settings, planned) {
        let met = if planned.is_empty() { "no light" } else { "one directional light, without a shadow" };
        let why = format!("{met}, and no texture: lighting a surface costs less than writing its G-buffer");
        let path = if settings.depth_prepass == Some(true) { LightPath::Forward } else { LightPath::ForwardNaive };
        return Ok((path, why));
    }
    Ok(cheapest(scene, settings, (planned, bounded), device))
}

/// Of the paths that are not out, the one that takes the least time by the figures of the device.
fn cheapest(
    scene: &Scene,
    settings: &Settings,
    (planned, bounded): (&[usize], usize),
    device: &Capabilities,
) -> (LightPath, String) {
    let triangles = scene.triangle_count() as u64;
    let [width, height] = settings.size.map(u64::from);
    let (unlimited, limited) = ((planned.len() - bounded) as u64, bounded as u64);
    let load = Load { pixels: width * height, triangles, unlimited, limited };
    let no_lists = (bounded == 0).then_some("no light has a range, so lists leave nothing out");
    let no_compute = match planned {
        [] => Some("there is no light"),
        _ => compute_is_out(scene, settings, device),
    };
    let no_visibility = no_compute.or_else(|| visibility::is_out(scene, settings, device));
    let outs = [
        (LightPath::Loop, None),
        (LightPath::Clustered, no_lists),
        (LightPath::Compute, no_compute),
        (LightPath::Visibility, no_visibility),
    ];
    let can = |wanted: &[LightPath]| {
        let those = outs.iter().filter(|(path, out)| out.is_none() && wanted.contains(path));
        those.map(|&(path, _)| path).collect::<Vec<_>>()
    };
    // Compute shaders write other last digits than fragment shaders do: loop and clustered write the same.
    let figures = device.costs.of_pictures(device.software);
    let shown = figures.cheapest(can(&COMPARED), &load).unwrap_or(LightPath::Loop);
    let (path, figures) = match shown {
        LightPath::Loop | LightPath::Clustered => {
            let same = can(&[LightPath::Loop, LightPath::Clustered]);
            (device.costs.cheapest(same, &load).unwrap_or(LightPath::Loop), device.costs)
        }
        _ => (shown, figures),
    };
    (path, reason(path, &outs, &figures, &load))
}

/// The cost of each path that could be taken, in milliseconds, and the reasons against the others.
fn reason(path: LightPath, outs: &[(LightPath, Option<&'static str>)], figures: &CostModel, load: &Load) -> String {
    let lights = match counted((load.unlimited + load.limited) as usize, "light") {
        _ if load.limited + load.unlimited == 0 => "no light".into(),
        all if load.limited == 0 => all,
        all if load.unlimited == 0 => format!("{all} of limited reach"),
        all => format!("{all}, {} of limited reach", load.limited),
    };
    let cost = |own: LightPath| Some(figures.of(own, load)? as f64 / 1e9);
    let mut others: Vec<(LightPath, f64)> = Vec::new();
    for &(own, _) in outs.iter().filter(|(own, out)| out.is_none() && *own != path) {
        others.extend(cost(own).map(|cost| (own, cost)));
    }
    others.sort_by(|a, b| a.1.total_cmp(&b.1));
    // Figures that nobody asked for decide between these two alone.
    let decides =
        |own: &LightPath| figures.basis != Basis::Unasked || matches!(own, LightPath::Loop | LightPath::Clustered);
    others.retain(|(own, _)| decides(own));
    let mut text = match cost(path).filter(|_| !others.is_empty()) {
        None => lights,
        Some(own) => {
            let others: String = others.iter().map(|&(own, cost)| format!(", {own} {}", milliseconds(cost))).collect();
            let basis = match figures.basis {
                Basis::Kind(device) => {
                    format!("estimated by figures of {device}; `doctor --calibrate` measures this device")
                }
                Basis::Unasked | Basis::Asked => "by the figures of this device".into(),
            };
            format!("{path} {} ms{others} for {lights} ({basis})", milliseconds(own))
        }
    };
    // Visibility is out wherever compute is: the reason once.
    let mut told = None;
    for &(own, out) in outs {
        let Some(out) = out.filter(|&out| told != Some(out)) else { continue };
        told = Some(out);
        let which = if own == LightPath::Compute { "compute or visibility".into() } else { own.to_string() };
        let _ = write!(text, "; not {which}: {out}");
    }
    text
}

/// Formats milliseconds with at least two digits.
fn milliseconds(value: f64) -> String {
    let decimals = if value < 1.0 { 2 } else { usize::from(value < 10.0) };
    format!("{value:.decimals$}")
}

/// Refuses a path that the device cannot take, or that does not go with the other settings.
fn check(settings: &Settings, device: &Capabilities) -> Result<(), PlanError> {
    let path = settings.light_path;
    if settings.light_cutoff && settings.output == Output::Nits {
        return Err(PlanError::CutoffWithoutSteps);
    }
    if !effects::is_lit(settings.view) {
        return if lacks_gbuffer(path) && needs_gbuffer(settings.view) {
            Err(PlanError::NoGbuffer(path))
        } else {
            Ok(())
        };
    }
    match path {
        LightPath::PerLight | LightPath::Volumes if !device.float32_blends => Err(PlanError::NoFloatBlending(path)),
        LightPath::PerLight | LightPath::Volumes if settings.hdr_format == HdrFormat::B10g11r11 => {
            Err(PlanError::BlendedFormat(path, settings.hdr_format))
        }
        LightPath::Compute | LightPath::Visibility => match settings.first_effect() {
            Some(what) => Err(PlanError::Refused(Refusal { what, why: RefusalReason::WritesPicture(path) })),
            None if device.compute_invocations < TILE_INVOCATIONS => {
                Err(PlanError::WorkGroup(path, TILE_INVOCATIONS, device.compute_invocations))
            }
            None => Ok(()),
        },
        _ => Ok(()),
    }
}

/// Returns true if surfaces are plain enough to be lit fastest as they are drawn. Measured in docs/LIGHT_PATHS.md: with one light this beats the loop
/// for any number of layers on a GPU, and for up to two on a CPU even if they are drawn back to front; draws go front to back.
///
/// Shadowed, textured or transparent surfaces are not plain, as their overdraw costs more. Nor are frames with several samples a pixel, which the two
/// paths shade differently, with effects that read a G-buffer, or with a G-buffer layout that was asked for. Parts that are kept without need do not
/// count.
fn is_plain(scene: &Scene, settings: &Settings, planned: &[usize]) -> bool {
    let lit = match planned {
        [] => true,
        &[one] => scene.lights[one].kind.is_directional(),
        _ => false,
    };
    let plain = |object: &Object| {
        let material = &scene.materials[object.material];
        material.textures().next().is_none() && !material.is_transparent()
    };
    lit && settings.msaa == 1
        && effects::asked_for(scene, settings).all(|effect| effect.reads_gbuffer.is_none())
        && settings.gbuffer == GbufferChoice::default()
        && shadow_reason(scene, settings, planned).is_err()
        && scene.objects.iter().all(plain)
}

/// The reason why `auto` does not choose compute, whatever it costs: limits of the path, and tile memory, of which only a device's own figures tell.
fn compute_is_out(scene: &Scene, settings: &Settings, device: &Capabilities) -> Option<&'static str> {
    let transparent = scene.objects.iter().any(|object| scene.materials[object.material].is_transparent());
    let limits = [
        (
            device.lazily_allocated && device.costs.basis != Basis::Asked,
            "the G-buffer would leave the tile (`doctor --calibrate` measures whether that pays)",
        ),
        (device.compute_invocations < TILE_INVOCATIONS, "they need larger work groups than the device has"),
        (transparent, "they cannot draw transparent surfaces"),
    ];
    let more_limits = [
        (settings.first_effect().is_some(), "they draw no effects on the finished picture"),
        (device.sampled_msaa & settings.msaa == 0, "the device reads no textures of so many samples"),
        (
            settings.msaa > 1 && device.shared_memory < TILE_SHARED_BYTES,
            "several samples share more memory than the device's work groups have",
        ),
    ];
    let met = |(out, why): (bool, &'static str)| out.then_some(why);
    let effect = || effects::asked_for(scene, settings).find_map(|effect| effect.not_by_compute);
    limits.into_iter().find_map(met).or_else(effect).or_else(|| more_limits.into_iter().find_map(met))
}

fn needs_gbuffer(view: View) -> bool {
    !matches!(view, View::Overdraw | View::Triangle | View::ShadowMap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{ABSENT, CullingCost, FramePlan, PathCost, samples};
    use crate::scene::{AmbientOcclusion, Brdf, Falloff, Keep, Light, Material};

    #[test]
    fn auto_chooses_by_lights_and_device_and_says_why() {
        let lamps = |count| {
            samples::scene(vec![samples::material(Brdf::Lambert)], vec![samples::point(Falloff::Quadratic); count])
        };
        let chosen = |scene: &Scene, settings: &Settings, device: &Capabilities| {
            let plan = FramePlan::of(scene, settings, device).expect("a plan");
            (plan.light_path, plan.reasons.light_path)
        };
        let (gpu, defaults) = (samples::device(), Settings::default());
        let software = samples::software();
        let tiler = Capabilities { lazily_allocated: true, ..gpu };
        for count in [1, 4, 1000] {
            let (path, why) = chosen(&lamps(count), &defaults, &gpu);
            assert_eq!(path, LightPath::Visibility);
            assert!(
                why.starts_with("visibility ")
                    && why.contains(
                        "(estimated by figures of an NVIDIA H200; `doctor --calibrate` measures this device)"
                    ),
                "{why}"
            );
        }
        let occluded = Settings { ao: AmbientOcclusion::Bitmask, ..defaults.clone() };
        let mut in_the_open = lamps(1);
        in_the_open.environment.ambient = glam::Vec3::ONE;
        for (scene, settings, device, says) in [
            (&lamps(1), &defaults, &Capabilities { storage_buffers: 8, ..gpu }, "too few buffers"),
            (&in_the_open, &occluded, &gpu, "ambient occlusion"),
        ] {
            let (path, why) = chosen(scene, settings, device);
            assert!(path == LightPath::Compute && why.contains("not visibility") && why.contains(says), "{why}");
        }
        assert_eq!(chosen(&lamps(1), &defaults, &software).0, LightPath::Loop);
        for (settings, device) in
            [(&defaults, &software), (&defaults, &tiler), (&Settings { fxaa: true, ..defaults.clone() }, &gpu)]
        {
            let (path, why) = chosen(&lamps(100), settings, device);
            assert!(path == LightPath::Clustered && why.contains("; not ") != device.software, "{why}");
        }
        let mut unlimited = lamps(9);
        unlimited.lights = vec![samples::spot(Falloff::InverseSquare); 9];
        assert_eq!(chosen(&unlimited, &defaults, &gpu).0, LightPath::Visibility);
        assert_eq!(chosen(&unlimited, &defaults, &software).0, LightPath::Loop);
        let cut = Settings { light_cutoff: true, ..defaults };
        assert_eq!(chosen(&unlimited, &cut, &software).0, LightPath::Clustered);
        for asked in [LightPath::Volumes, LightPath::Clustered, LightPath::Compute, LightPath::Visibility] {
            let settings = Settings { light_path: asked, ..Settings::default() };
            assert_eq!(chosen(&lamps(1), &settings, &software), (asked, "asked for".into()));
            assert_eq!(chosen(&lamps(0), &settings, &software).0, LightPath::Loop);
        }
    }

    /// Opening a window has the device measured, and its pictures must stay as they were.
    #[test]
    fn figures_that_nobody_asked_for_choose_only_between_the_same_bits() {
        let lamps = |count| {
            samples::scene(vec![samples::material(Brdf::Lambert)], vec![samples::point(Falloff::Quadratic); count])
        };
        let chosen = |count, device: &Capabilities| {
            FramePlan::of(&lamps(count), &Settings::default(), device).expect("a plan").light_path
        };
        let [same, fast] = [1000, 1].map(|base| PathCost { base, triangle: 0, lists: 0, unlimited: 1, limited: 1 });
        for device in [samples::device(), samples::software()] {
            let measured = |basis, paths| Capabilities { costs: CostModel { basis, paths, ..device.costs }, ..device };
            let alone = |wanted| std::array::from_fn(|index| if COMPARED[index] == wanted { fast } else { same });
            for wanted in COMPARED {
                assert_eq!(chosen(5, &measured(Basis::Asked, alone(wanted))), wanted);
                let unasked = chosen(5, &measured(Basis::Unasked, alone(wanted)));
                match chosen(5, &device) {
                    LightPath::Loop | LightPath::Clustered => {
                        let expected = if wanted == LightPath::Clustered { wanted } else { LightPath::Loop };
                        assert_eq!(unasked, expected);
                    }
                    shown => assert_eq!(unasked, shown),
                }
            }
            // A path that could not be measured is not taken.
            let mut paths = alone(LightPath::Loop);
            paths[0] = ABSENT;
            assert_eq!(chosen(5, &measured(Basis::Asked, paths)), LightPath::Clustered);
        }
        // Nor do they move the number of objects that visibility leaves to the device's culling.
        let mut device = samples::device();
        device.costs.basis = Basis::Unasked;
        device.costs.culling = CullingCost { cpu_object: 1000, device_frame: 0, device_object: 0 };
        let mut crowd = lamps(5);
        crowd.objects = (0..1000).map(|_| crowd.objects[0].clone()).collect();
        let planned = |device| FramePlan::of(&crowd, &Settings::default(), &device).expect("a plan").light_path;
        assert_eq!((planned(device), planned(samples::device())), (LightPath::Visibility, LightPath::Visibility));
        device.costs.basis = Basis::Asked;
        assert_eq!(planned(device), LightPath::Compute);
        let tiler = Capabilities { lazily_allocated: true, ..samples::device() };
        assert_eq!(chosen(5, &tiler), LightPath::Clustered);
        let measured = CostModel { basis: Basis::Asked, ..tiler.costs };
        assert_eq!(chosen(5, &Capabilities { costs: measured, ..tiler }), LightPath::Visibility);
    }

    #[test]
    fn auto_lights_plain_surfaces_as_it_draws_them_and_says_why() {
        let chosen = |scene: &Scene, settings: &Settings| {
            let plan = FramePlan::of(scene, settings, &samples::device()).expect("a plan");
            assert_eq!(lacks_gbuffer(plan.light_path), plan.gbuffer.is_none());
            // Parts that are kept without need change no path, or pictures could differ.
            let full = Settings { keep: Keep::ALL, ..settings.clone() };
            let full = FramePlan::of(scene, &full, &samples::device()).expect("a full plan");
            assert_eq!((full.light_path, &full.reasons.light_path), (plan.light_path, &plan.reasons.light_path));
            (plan.light_path, plan.reasons.light_path)
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
        let other_gbuffer = Settings { gbuffer: samples::gbuffers()[1].1, ..Settings::default() };
        let msaa = Settings { msaa: 4, ..Settings::default() };
        for (scene, settings, path) in [
            (one(lambert(), vec![samples::sky(); 2]), &defaults, LightPath::Visibility),
            (one(lambert(), vec![samples::sun()]), &defaults, LightPath::Visibility),
            (one(lambert(), vec![samples::spot(Falloff::InverseSquare)]), &defaults, LightPath::Visibility),
            (one(samples::textured(Brdf::Lambert), vec![samples::sky()]), &defaults, LightPath::Visibility),
            (one(samples::textured(Brdf::Lambert), vec![]), &defaults, LightPath::Loop),
            (one(samples::glass(), vec![samples::sky()]), &defaults, LightPath::Loop),
            (one(lambert(), vec![samples::sky()]), &msaa, LightPath::Visibility),
            (one(lambert(), vec![samples::sky()]), &other_gbuffer, LightPath::Compute),
        ] {
            assert_eq!(chosen(&scene, settings).0, path);
        }
        // A sun whose shadows are switched off is as plain as one without.
        let mut settings = defaults;
        settings.shadows.enabled = false;
        assert_eq!(chosen(&one(lambert(), vec![samples::sun()]), &settings).0, LightPath::ForwardNaive);
    }
}
