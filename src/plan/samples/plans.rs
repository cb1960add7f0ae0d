//! Plans of every kind, made once for all tests of a process.

use std::sync::OnceLock;

use super::*;

/// Plans with their names.
type Named = Vec<(String, FramePlan)>;

/// Makes plans once for all tests of a process.
fn once(kept: &OnceLock<Named>, make: impl FnOnce() -> Named) -> Named {
    kept.get_or_init(make).clone()
}

/// Every plan of the scenes, views, layouts, outputs and devices above, with the names of these.
pub fn plans() -> Named {
    static KEPT: OnceLock<Named> = OnceLock::new();
    once(&KEPT, made_plans)
}

fn made_plans() -> Named {
    let plain = Capabilities {
        unorm_2x16_attachment: false,
        float32_blends: false,
        packed_float_blends: false,
        lazily_allocated: true,
        depth_clamp: false,
        ..device()
    };
    let mut plans = Vec::new();
    for (scene_name, scene) in scenes() {
        for (layout, gbuffer) in gbuffers() {
            for (view, output) in views().flat_map(|view| Output::NAMES.iter().map(move |&(_, output)| (view, output)))
            {
                for (device_name, device) in [("able", device()), ("plain", plain)] {
                    let transparency = if device.lazily_allocated { Transparency::Oit } else { Transparency::Sorted };
                    let settings = Settings { gbuffer, view, output, transparency, ..deferred() };
                    let name = format!("{scene_name} {layout} {view:?} {output} {device_name}");
                    match FramePlan::of(&scene, &settings, &device) {
                        Ok(plan) => plans.push((name, plan)),
                        Err(error) => assert_eq!(view, View::ShadowMap, "{name}: {error}"),
                    }
                }
            }
        }
    }
    plans.extend(antialiased());
    plans.extend(multisampled());
    plans.extend(light_paths(|plan| !plan.is_tiled() && !plan.is_forward()));
    let culled = ("culled on the device", Settings { culling: Culling::Gpu, ..deferred() });
    plans.extend(of_scenes(&[culled]).into_iter().filter(|(_, plan)| plan.culls_on_device));
    plans
}

/// Plans whose first render pass of surfaces ends with GEOMETRY, because compute lights the stored surfaces.
pub fn tiled_plans() -> Named {
    static KEPT: OnceLock<Named> = OnceLock::new();
    once(&KEPT, || [light_paths(FramePlan::is_tiled), multisampled_tiled()].concat())
}

/// Plans of compute lighting with several samples a pixel: layouts without integers, outputs, and ways to resolve.
fn multisampled_tiled() -> Named {
    let mut plans = Vec::new();
    for (scene_name, scene) in scenes() {
        for (layout, gbuffer) in gbuffers().into_iter().filter(|(layout, _)| !layout.contains("uint")) {
            for (view, output, resolve) in [
                (View::Final, Output::Srgb8, Resolve::ToneMapped),
                (View::Final, Output::Srgb8, Resolve::Linear),
                (View::Final, Output::Nits, Resolve::Linear),
                (View::Final, Output::Exposed, Resolve::ToneMapped),
                (View::Lighting, Output::Srgb8, Resolve::ToneMapped),
            ] {
                for light_path in [LightPath::Compute, LightPath::Visibility] {
                    let settings =
                        Settings { msaa: 4, light_path, gbuffer, view, output, resolve, ..Settings::default() };
                    let name = format!("{scene_name} {layout} {light_path} msaa {view:?} {resolve} {output}");
                    match FramePlan::of(&scene, &settings, &device()) {
                        Err(error) if is_left_out(&error) => {}
                        Err(error) => panic!("{name}: {error}"),
                        // A plan without lights has no compute pass.
                        Ok(plan) => plans.extend(plan.is_tiled().then_some((name, plan))),
                    }
                }
            }
        }
    }
    assert!(plans.iter().any(|(_, plan)| plan.emissive));
    plans
}

/// Returns true if the light path alone is refused.
fn is_left_out(error: &PlanError) -> bool {
    matches!(error, PlanError::Refused(Refusal { why: RefusalReason::WritesPicture(_), .. }) | PlanError::Visibility(_))
}

/// Plans without a G-buffer: both forward paths, with and without passes before and after FORWARD.
pub fn forward_plans() -> Named {
    let cases = [
        ("culled on the device", Settings { culling: Culling::Gpu, depth_prepass: Some(false), ..Settings::default() }),
        ("without pre-pass", Settings { depth_prepass: Some(false), ..Settings::default() }),
        ("oit", Settings { transparency: Transparency::Oit, ..Settings::default() }),
        ("oit in nits", Settings { transparency: Transparency::Oit, output: Output::Nits, ..Settings::default() }),
        ("light", Settings { view: View::Lighting, ..Settings::default() }),
        ("4 samples", Settings { samples: 4, ..Settings::default() }),
        ("msaa", Settings { msaa: 4, ..Settings::default() }),
        ("msaa, averaged light", Settings { msaa: 4, resolve: Resolve::Linear, ..Settings::default() }),
        ("msaa in nits", Settings { msaa: 4, output: Output::Nits, ..Settings::default() }),
        ("msaa exposed", Settings { msaa: 4, output: Output::Exposed, ..Settings::default() }),
        ("exposed", Settings { output: Output::Exposed, ..Settings::default() }),
        ("msaa without pre-pass", Settings { msaa: 4, depth_prepass: Some(false), ..Settings::default() }),
        ("msaa and oit", Settings { msaa: 4, transparency: Transparency::Oit, ..Settings::default() }),
        (
            "msaa and oit in nits",
            Settings { msaa: 4, transparency: Transparency::Oit, output: Output::Nits, ..Settings::default() },
        ),
    ];
    let forward =
        |(name, settings)| (format!("forward {name}"), Settings { light_path: LightPath::Forward, ..settings });
    let plans = [light_paths(FramePlan::is_forward), of_scenes(&cases.map(forward))].concat();
    assert!(plans.iter().all(|(_, plan)| plan.is_forward()));
    plans
}

/// The light paths that are `wanted`, over all scenes.
fn light_paths(wanted: impl Fn(&FramePlan) -> bool) -> Named {
    let mut plans = Vec::new();
    for (scene_name, scene) in scenes() {
        for &(path_name, light_path) in LightPath::NAMES {
            for (layout, gbuffer) in [gbuffers()[0], gbuffers()[2]] {
                for (output, light_cutoff) in
                    [(Output::Srgb8, false), (Output::Srgb8, true), (Output::Nits, false), (Output::Exposed, true)]
                {
                    let settings = Settings { light_path, light_cutoff, gbuffer, output, ..Settings::default() };
                    let name = format!("{scene_name} {layout} {path_name} {output} cutoff={light_cutoff}");
                    let plan = match FramePlan::of(&scene, &settings, &device()) {
                        Err(error) if is_left_out(&error) => continue,
                        plan => plan.unwrap_or_else(|error| panic!("{name}: {error}")),
                    };
                    plans.extend(wanted(&plan).then_some((name, plan)));
                }
            }
        }
    }
    plans
}

/// Plans of several frames a picture.
fn antialiased() -> Named {
    of_scenes(&[
        ("4 samples", Settings { samples: 4, ..deferred() }),
        ("4 samples of light", Settings { samples: 4, view: View::Lighting, ..deferred() }),
        ("4 linear samples", Settings { samples: 4, output: Output::Nits, ..deferred() }),
        ("4 exposed samples", Settings { samples: 4, output: Output::Exposed, ..deferred() }),
    ])
}

/// All sample plans.
pub fn of_every_kind() -> Named {
    static KEPT: OnceLock<Named> = OnceLock::new();
    once(&KEPT, || [plans(), forward_plans(), tiled_plans(), plans_of_effects()].concat())
}

/// The scenes that plans of effects are made of: each differs from the others in its passes.
const OF_EFFECTS: [&str; 9] = [
    "nothing",
    "sunlit",
    "lamps",
    "shadowed-lamps",
    "emissive",
    "glass",
    "glowing gauze",
    "nothing but glass",
    "deformed",
];

/// Plans of effects: each of their variations with various passes before it and after it and with each output, and every two of them together. Scenes on
/// which an effect does nothing are among them, and settings that refuse it are not.
pub fn plans_of_effects() -> Named {
    static KEPT: OnceLock<Named> = OnceLock::new();
    once(&KEPT, made_plans_of_effects)
}

fn made_plans_of_effects() -> Named {
    let oit = |settings: Settings| Settings { transparency: Transparency::Oit, ..settings };
    let nits = |settings: Settings| Settings { output: Output::Nits, ..settings };
    let msaa = |settings: Settings| Settings { msaa: 4, resolve: Resolve::Linear, ..settings };
    let forward = || Settings { light_path: LightPath::Forward, ..Settings::default() };
    let stored = || Settings { light_path: LightPath::Loop, ..keeping(&[OptionalPart::StoredGbuffer]) };
    let frames = [
        ("", deferred()),
        (" in nits", nits(deferred())),
        (" exposed", Settings { output: Output::Exposed, ..deferred() }),
        (" of 4 samples", Settings { samples: 4, ..deferred() }),
        (" of msaa", msaa(deferred())),
        (" of msaa as shown", Settings { msaa: 4, ..deferred() }),
        (" of msaa in nits", nits(msaa(deferred()))),
        (" and oit", oit(deferred())),
        (" and vignette", Settings { vignette: 1.0, ..deferred() }),
        (" and stored G-buffer", stored()),
        (", oit and stored G-buffer", oit(stored())),
        (" added up", Settings { light_path: LightPath::PerLight, ..Settings::default() }),
        (", clustered", Settings { light_path: LightPath::Clustered, ..Settings::default() }),
        (", forward", forward()),
        (" of msaa, forward", msaa(forward())),
        (" and oit, forward", oit(forward())),
    ];
    assert!(OF_EFFECTS.iter().all(|own| scenes().iter().any(|(name, _)| name == own)), "a scene has another name");
    let mut plans = Vec::new();
    let mut add = |variations: &[&Variation], (frame, settings): &(&str, Settings)| {
        let names: Vec<&str> = variations.iter().map(|variation| variation.name).collect();
        for (scene_name, mut scene) in scenes().into_iter().filter(|(name, _)| OF_EFFECTS.contains(name)) {
            let mut settings = settings.clone();
            for variation in variations {
                (variation.scene)(&mut scene);
                (variation.settings)(&mut settings);
            }
            let name = format!("{scene_name} {}{frame}", names.join(", "));
            match FramePlan::of(&scene, &settings, &device()) {
                Ok(plan) => plans.push((name, plan)),
                // A light path may not support a view.
                Err(_) if variations.iter().any(|variation| variation.is_alone) => {}
                Err(error) => assert!(matches!(error, PlanError::Refused(_)), "{name}: {error}"),
            }
        }
    };
    let all: Vec<&Variation> = variations().collect();
    for (index, one) in all.iter().enumerate() {
        frames.iter().for_each(|frame| add(&[one], frame));
        let others = all[index + 1..].iter().filter(|other| !one.is_alone && !other.is_alone);
        others.for_each(|other| add(&[one, other], &frames[0]));
    }
    plans
}

/// A plan of each scene with each of these settings.
fn of_scenes(all: &[(impl std::fmt::Display, Settings)]) -> Named {
    let mut plans = Vec::new();
    for (scene_name, scene) in scenes() {
        for (name, settings) in all {
            let name = format!("{scene_name} {name}");
            let plan = FramePlan::of(&scene, settings, &device());
            plans.push((name.clone(), plan.unwrap_or_else(|error| panic!("{name}: {error}"))));
        }
    }
    plans
}

/// Plans of several samples a pixel: all scenes, layouts of floats, outputs, ways to resolve, and the view that goes with it.
fn multisampled() -> Named {
    let mut cases = Vec::new();
    for (layout, gbuffer) in gbuffers().into_iter().filter(|(layout, _)| !layout.contains("uint")) {
        for (view, light_path) in [
            (View::Final, LightPath::Loop),
            (View::Final, LightPath::Clustered),
            (View::Lighting, LightPath::Loop),
            (View::Complexity, LightPath::Auto),
        ] {
            for (output, resolve) in [
                (Output::Srgb8, Resolve::ToneMapped),
                (Output::Srgb8, Resolve::Linear),
                (Output::Nits, Resolve::Linear),
                (Output::Exposed, Resolve::ToneMapped),
                (Output::Exposed, Resolve::Linear),
            ] {
                let settings = Settings { msaa: 4, gbuffer, view, light_path, output, resolve, ..Settings::default() };
                let name = format!("{layout} msaa {view:?} {light_path} {resolve} {output}");
                for transparency in [Transparency::Sorted, Transparency::Oit] {
                    cases.push((format!("{name} {transparency}"), Settings { transparency, ..settings.clone() }));
                }
            }
        }
    }
    of_scenes(&cases)
}
