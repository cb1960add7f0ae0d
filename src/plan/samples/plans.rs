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

/// The same of several samples a pixel: layouts of floats, outputs, and ways to resolve.
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
                        // Without a light there is nothing for it to do.
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
fn is_left_out(error: &Error) -> bool {
    matches!(error, Error::Refused(Refusal { why: Why::WritesPicture(_), .. }) | Error::Visibility(_))
}

/// Plans without a G-buffer: both paths, with and without what is drawn before and after FORWARD.
pub fn forward_plans() -> Named {
    let cases = [
        ("culled on the device", Settings { culling: Culling::Gpu, depth_prepass: Some(false), ..Settings::default() }),
        ("without pre-pass", Settings { depth_prepass: Some(false), ..Settings::default() }),
        ("oit", Settings { transparency: Transparency::Oit, ..Settings::default() }),
        ("oit in nits", Settings { transparency: Transparency::Oit, output: Output::Nits, ..Settings::default() }),
        ("fxaa", Settings { fxaa: true, ..Settings::default() }),
        ("fxaa without pre-pass", Settings { fxaa: true, depth_prepass: Some(false), ..Settings::default() }),
        ("light", Settings { view: View::Lighting, ..Settings::default() }),
        ("4 samples", Settings { samples: 4, ..Settings::default() }),
        ("msaa", Settings { msaa: 4, ..Settings::default() }),
        ("msaa, averaged light", Settings { msaa: 4, resolve: Resolve::Linear, ..Settings::default() }),
        ("msaa in nits", Settings { msaa: 4, output: Output::Nits, ..Settings::default() }),
        ("msaa exposed", Settings { msaa: 4, output: Output::Exposed, ..Settings::default() }),
        ("exposed", Settings { output: Output::Exposed, ..Settings::default() }),
        ("msaa and fxaa", Settings { msaa: 4, fxaa: true, ..Settings::default() }),
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

/// Plans of several frames a picture, and of FXAA.
fn antialiased() -> Named {
    of_scenes(&[
        ("4 samples", Settings { samples: 4, ..deferred() }),
        ("4 samples of light", Settings { samples: 4, view: View::Lighting, ..deferred() }),
        ("4 linear samples", Settings { samples: 4, output: Output::Nits, ..deferred() }),
        ("4 exposed samples", Settings { samples: 4, output: Output::Exposed, ..deferred() }),
        ("fxaa", Settings { fxaa: true, ..deferred() }),
        ("fxaa of light", Settings { fxaa: true, view: View::Lighting, ..deferred() }),
    ])
}

/// Plans with spread light, of which a render pass ends before BLOOM: with various passes before that and after it, and each output.
pub fn bloomed_plans() -> Named {
    let bloom = |settings: Settings| Settings { bloom: 0.1, ..settings };
    let forward = || Settings { light_path: LightPath::Forward, ..Settings::default() };
    of_scenes(&[
        ("bloom", bloom(deferred())),
        (
            "bloom and stored G-buffer",
            bloom(Settings { light_path: LightPath::Loop, ..keeping(&[OptionalPart::StoredGbuffer]) }),
        ),
        ("bloom in nits", bloom(Settings { output: Output::Nits, ..deferred() })),
        ("bloom exposed", bloom(Settings { output: Output::Exposed, ..deferred() })),
        ("bloom of 4 samples", bloom(Settings { samples: 4, ..deferred() })),
        ("bloom of msaa", bloom(Settings { msaa: 4, resolve: Resolve::Linear, ..deferred() })),
        ("bloom of msaa in nits", bloom(Settings { msaa: 4, output: Output::Nits, ..deferred() })),
        ("bloom and oit", bloom(Settings { transparency: Transparency::Oit, ..deferred() })),
        ("bloom and fxaa", bloom(Settings { fxaa: true, ..deferred() })),
        ("bloom and vignette", bloom(Settings { vignette: 1.0, ..deferred() })),
        ("bloom, fxaa and vignette", bloom(Settings { fxaa: true, vignette: 1.0, ..deferred() })),
        ("bloom added up", bloom(Settings { light_path: LightPath::PerLight, ..Settings::default() })),
        ("bloom, forward", bloom(forward())),
        ("bloom of msaa, forward", bloom(Settings { msaa: 4, resolve: Resolve::Linear, ..forward() })),
        ("bloom and oit, forward", bloom(Settings { transparency: Transparency::Oit, ..forward() })),
        ("bloom and fxaa, forward", bloom(Settings { fxaa: true, ..forward() })),
        ("spread light", Settings { view: View::Bloom, ..deferred() }),
    ])
}

/// Plans with particles: sorted, summed and counted, before and after all that they can be between.
fn particle_plans() -> Named {
    let forward = || Settings { light_path: LightPath::Forward, ..Settings::default() };
    let oit = |settings: Settings| Settings { transparency: Transparency::Oit, ..settings };
    let stored = || Settings { light_path: LightPath::Loop, ..keeping(&[OptionalPart::StoredGbuffer]) };
    let fog = |settings: Settings| Settings { fog: Fog::Height, ..settings };
    let all = [
        ("particles", deferred()),
        ("particles in nits", Settings { output: Output::Nits, ..deferred() }),
        ("particles of 4 samples", Settings { samples: 4, ..deferred() }),
        ("particles and stored G-buffer", stored()),
        ("particles summed and stored G-buffer", oit(stored())),
        ("particles occluded", Settings { ao: AmbientOcclusion::Bitmask, ..deferred() }),
        ("particles and fxaa", Settings { fxaa: true, ..deferred() }),
        ("particles and bloom", Settings { bloom: 0.1, ..deferred() }),
        ("particles summed", oit(deferred())),
        ("particles, clustered", Settings { light_path: LightPath::Clustered, ..Settings::default() }),
        ("particles, forward", forward()),
        ("particles summed, forward", oit(forward())),
        ("particles in fog", fog(deferred())),
        ("particles in fog and stored G-buffer", fog(stored())),
        ("particles summed in fog and stored G-buffer", fog(oit(stored()))),
        ("particles in fog, occluded", fog(Settings { ao: AmbientOcclusion::Bitmask, ..deferred() })),
        ("particles summed in fog, forward", fog(oit(forward()))),
        ("particles in lit fog", Settings { fog: Fog::Froxels, ..deferred() }),
        ("particles counted", Settings { view: View::Particles, ..deferred() }),
    ];
    let mut plans = Vec::new();
    for (scene_name, mut scene) in scenes() {
        scene.emitters = vec![Emitter { rate: 5000.0, ..Emitter::default() }];
        for (name, settings) in &all {
            let name = format!("{scene_name} {name}");
            let plan = FramePlan::of(&scene, settings, &device());
            plans.push((name.clone(), plan.unwrap_or_else(|error| panic!("{name}: {error}"))));
        }
    }
    plans
}

/// Plans whose frames are averaged over time: with various passes before that and after it, and each output.
fn taa_plans() -> Named {
    let taa = |settings: Settings| Settings { taa: true, ..settings };
    let forward = || Settings { light_path: LightPath::Forward, ..Settings::default() };
    of_scenes(&[
        ("taa", taa(deferred())),
        (
            "taa and stored G-buffer",
            taa(Settings { light_path: LightPath::Loop, ..keeping(&[OptionalPart::StoredGbuffer]) }),
        ),
        ("taa in nits", taa(Settings { output: Output::Nits, ..deferred() })),
        ("taa exposed", taa(Settings { output: Output::Exposed, ..deferred() })),
        ("taa and oit", taa(Settings { transparency: Transparency::Oit, ..deferred() })),
        ("taa and fxaa", taa(Settings { fxaa: true, ..deferred() })),
        ("taa and vignette", taa(Settings { vignette: 1.0, ..deferred() })),
        ("taa, fxaa and vignette", taa(Settings { fxaa: true, vignette: 1.0, ..deferred() })),
        ("taa and bloom", taa(Settings { bloom: 0.1, ..deferred() })),
        ("taa, bloom, fxaa and vignette", taa(Settings { bloom: 0.1, fxaa: true, vignette: 1.0, ..deferred() })),
        ("taa added up", taa(Settings { light_path: LightPath::PerLight, ..Settings::default() })),
        ("taa, forward", taa(forward())),
        ("taa and oit, forward", taa(Settings { transparency: Transparency::Oit, ..forward() })),
        ("taa and bloom, forward", taa(Settings { bloom: 0.1, ..forward() })),
        ("vectors", Settings { view: View::Velocity, ..deferred() }),
        ("vectors as values, forward", Settings { view: View::Velocity, output: Output::Nits, ..forward() }),
    ])
}

/// All sample plans.
pub fn of_every_kind() -> Named {
    static KEPT: OnceLock<Named> = OnceLock::new();
    let of_each = || {
        [plans(), forward_plans(), tiled_plans(), filtered_plans(), particle_plans(), reflected_plans(), fogged_plans()]
    };
    once(&KEPT, || of_each().concat())
}

/// Plans in which a render pass ends before something that reads neighbours of the lit picture.
fn filtered_plans() -> Named {
    [bloomed_plans(), taa_plans()].concat()
}

/// Plans with reflections, in which a render pass ends with LIGHTING: with various passes before that and after it, and each output. Scenes that mirror
/// nothing have none.
fn reflected_plans() -> Named {
    let of = |settings: Settings| Settings { reflections: Reflections::Screen, reflection_roughness: 1.0, ..settings };
    let plans = of_scenes(&[
        ("reflections", of(deferred())),
        ("reflections in nits", of(Settings { output: Output::Nits, ..deferred() })),
        ("reflections exposed", of(Settings { output: Output::Exposed, ..deferred() })),
        ("reflections and oit", of(Settings { transparency: Transparency::Oit, ..deferred() })),
        ("reflections and fxaa", of(Settings { fxaa: true, ..deferred() })),
        ("reflections and bloom", of(Settings { bloom: 0.1, ..deferred() })),
        ("reflections, bloom and oit", of(Settings { bloom: 0.1, transparency: Transparency::Oit, ..deferred() })),
        ("reflections and occlusion", of(Settings { ao: AmbientOcclusion::Bitmask, ..deferred() })),
        ("reflections added up", of(Settings { light_path: LightPath::PerLight, ..Settings::default() })),
        ("reflections and taa", Settings { taa: true, ..of(deferred()) }),
        ("reflections, taa and oit", Settings { taa: true, transparency: Transparency::Oit, ..of(deferred()) }),
        ("reflections, taa and bloom", Settings { taa: true, bloom: 0.1, ..of(deferred()) }),
        ("what is mirrored", Settings { view: View::Reflections, ..of(deferred()) }),
    ]);
    plans.into_iter().filter(|(_, plan)| plan.reflects()).collect()
}

/// Plans with fog: with various passes before FOG and after it, and each output.
fn fogged_plans() -> Named {
    let fog = |settings: Settings| Settings { fog: Fog::Height, ..settings };
    let oit = |settings: Settings| Settings { transparency: Transparency::Oit, ..settings };
    let reflecting =
        |settings: Settings| Settings { reflections: Reflections::Screen, reflection_roughness: 1.0, ..settings };
    let lit = |settings: Settings| Settings { fog: Fog::Froxels, ..settings };
    let forward = || Settings { light_path: LightPath::Forward, ..Settings::default() };
    let stored = || Settings { light_path: LightPath::Loop, ..keeping(&[OptionalPart::StoredGbuffer]) };
    of_scenes(&[
        ("fog", fog(deferred())),
        ("fog and stored G-buffer", fog(stored())),
        ("fog in nits", fog(Settings { output: Output::Nits, ..deferred() })),
        ("fog of 4 samples", fog(Settings { samples: 4, ..deferred() })),
        ("fog of msaa", fog(Settings { msaa: 4, ..deferred() })),
        ("fog of msaa in nits", fog(Settings { msaa: 4, output: Output::Nits, ..deferred() })),
        ("fog and oit", fog(Settings { transparency: Transparency::Oit, ..deferred() })),
        ("fog, bloom, fxaa and vignette", fog(Settings { bloom: 0.1, fxaa: true, vignette: 1.0, ..deferred() })),
        ("fog added up", fog(Settings { light_path: LightPath::PerLight, ..Settings::default() })),
        ("fog, forward", fog(forward())),
        ("fog of msaa, forward", fog(Settings { msaa: 4, ..forward() })),
        ("fog and oit, forward", fog(Settings { transparency: Transparency::Oit, ..forward() })),
        ("fog and taa", fog(Settings { taa: true, ..deferred() })),
        ("fog, taa and stored G-buffer", fog(Settings { taa: true, ..stored() })),
        ("fog, taa and oit, forward", fog(Settings { taa: true, transparency: Transparency::Oit, ..forward() })),
        ("fog and reflections", fog(reflecting(deferred()))),
        ("fog, reflections and oit", fog(oit(reflecting(deferred())))),
        ("fog, reflections and bloom", fog(Settings { bloom: 0.1, ..reflecting(deferred()) })),
        ("fog, reflections and taa", fog(Settings { taa: true, ..reflecting(deferred()) })),
        ("fog, reflections, taa and oit", fog(oit(Settings { taa: true, ..reflecting(deferred()) }))),
        ("fog alone", fog(Settings { view: View::Fog, ..deferred() })),
        ("lit fog", lit(deferred())),
        ("lit fog and stored G-buffer", lit(stored())),
        ("lit fog and oit, forward", lit(Settings { transparency: Transparency::Oit, ..forward() })),
    ])
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
                let settings = Settings {
                    msaa: 4,
                    fxaa: !output.is_linear() && view == View::Lighting,
                    gbuffer,
                    view,
                    light_path,
                    output,
                    resolve,
                    ..Settings::default()
                };
                let name = format!("{layout} msaa {view:?} {light_path} {resolve} {output}");
                for transparency in [Transparency::Sorted, Transparency::Oit] {
                    cases.push((format!("{name} {transparency}"), Settings { transparency, ..settings.clone() }));
                }
            }
        }
    }
    of_scenes(&cases)
}
