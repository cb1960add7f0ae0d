//! Several samples a pixel, frames that are averaged, and FXAA.

use super::*;

#[test]
fn what_smooths_edges_is_refused_where_it_means_nothing() {
    let scene = scene(vec![material(CT)], vec![]);
    let normals = Settings { view: View::Normal, ..samples::deferred() };
    for (settings, why) in [
        (Settings { samples: 0, ..samples::deferred() }, "at least 1"),
        (Settings { samples: 2, ..normals.clone() }, "the view normal"),
        (Settings { fxaa: true, ..normals }, "the view normal"),
        (Settings { fxaa: true, output: Output::Nits, ..samples::deferred() }, ".exr"),
        (Settings { msaa: 0, ..samples::deferred() }, "cannot draw 0 samples"),
        (Settings { msaa: 3, ..samples::deferred() }, "it can draw 1, 2, 4, 8"),
        (Settings { msaa: 16, ..samples::deferred() }, "it can draw 1, 2, 4, 8"),
        (Settings { msaa: 4, view: View::Depth, ..samples::deferred() }, "the view depth"),
        (Settings { msaa: 4, samples: 2, ..samples::deferred() }, "choose one"),
        (Settings { view: View::Complexity, ..samples::deferred() }, "--msaa 4"),
        (
            Settings { msaa: 4, gbuffer: "lean,normal=oct16-uint".parse().expect("a layout"), ..samples::deferred() },
            "rgb10a2",
        ),
        (Settings { fxaa: true, samples: 2, ..samples::deferred() }, "FXAA needs --samples 1"),
        (Settings { vignette: 0.5, samples: 2, ..samples::deferred() }, "vignette"),
        (Settings { aberration: 0.01, samples: 2, ..samples::deferred() }, "chromatic aberration needs --samples 1"),
        (Settings { aberration: 0.01, output: Output::Nits, ..samples::deferred() }, ".exr"),
        (
            Settings { grain: 0.5, output: Output::Nits, ..samples::deferred() },
            "film grain works on a tone-mapped picture",
        ),
    ] {
        let text = FramePlan::of(&scene, &settings, &device()).expect_err("must be refused").to_string();
        assert!(text.starts_with("anti-aliasing: ") && text.contains(why), "{text}");
    }
}

#[test]
fn frames_that_are_averaged_are_linear_and_tone_mapped_afterwards() {
    let lit = scene(vec![material(CT), samples::emissive()], vec![]);
    for resolve in [Resolve::Linear, Resolve::ToneMapped] {
        let plan = plan_with(&lit, &Settings { samples: 2, resolve, tonemap: Tonemap::Agx, ..samples::deferred() });
        assert_eq!((plan.hdr, plan.output), (None, vk::Format::R32G32B32A32_SFLOAT));
        assert_eq!((plan.tone_mapping, plan.samples), (ToneMapping::AfterFrames(Tonemap::Agx), 2));
    }
    let linear = plan_with(&lit, &Settings { samples: 2, output: Output::Nits, ..samples::deferred() });
    assert_eq!(linear.tone_mapping, ToneMapping::Absent);
}

#[test]
fn multisampling_keeps_light_until_it_is_averaged() {
    let (dull, bright) = (scene(vec![material(CT)], vec![]), scene(vec![emissive()], vec![]));
    let with = |scene: &Scene, resolve, output| {
        let plan = plan_with(scene, &Settings { msaa: 4, resolve, output, ..samples::deferred() });
        (plan.hdr.is_some(), plan.resolves_output())
    };
    // Shown sample by sample in LIGHTING, where nothing blends before that; in TONEMAP else. Linear output is resolved as it is.
    assert_eq!(with(&dull, Resolve::ToneMapped, Output::Srgb8), (false, true));
    assert_eq!(with(&dull, Resolve::Linear, Output::Srgb8), (true, false));
    assert_eq!(with(&bright, Resolve::ToneMapped, Output::Srgb8), (true, false));
    assert_eq!(with(&bright, Resolve::Linear, Output::Srgb8), (true, false));
    assert_eq!(with(&bright, Resolve::ToneMapped, Output::Nits), (false, true));
    // Transparent surfaces blend over it.
    let glass = scene(vec![material(CT), samples::glass()], vec![]);
    assert_eq!(with(&glass, Resolve::ToneMapped, Output::Srgb8), (true, false));
    assert_eq!(with(&glass, Resolve::Linear, Output::Nits), (false, true));
    // FORWARD adds emitted light before it tone-maps.
    for light_path in [LightPath::Forward, LightPath::ForwardNaive] {
        let plan = plan_with(&bright, &Settings { msaa: 4, light_path, ..samples::deferred() });
        assert_eq!((plan.hdr, plan.resolves_output()), (None, true));
    }
    // TILED averages by itself, before or after it tone-maps: no target has samples of the output.
    let lamp = vec![point(Falloff::Quadratic)];
    for (material, emits) in [(material(CT), false), (emissive(), true)] {
        let lit = scene(vec![material], lamp.clone());
        for resolve in [Resolve::Linear, Resolve::ToneMapped] {
            let settings = Settings { msaa: 4, resolve, light_path: LightPath::Compute, ..samples::deferred() };
            let plan = plan_with(&lit, &settings);
            assert_eq!((plan.hdr.is_some(), plan.resolves_output()), (emits, false));
            assert_eq!(plan.tone_mapping, ToneMapping::InLighting(Tonemap::default()));
            assert_eq!(plan.averages_light(), resolve == Resolve::Linear);
            assert_eq!(
                [Target::Albedo, Target::Depth, Target::Output].map(|target| plan.samples_of(target)),
                [4, 4, 1]
            );
        }
    }
    let plan = plan_with(&dull, &Settings { msaa: 4, ..samples::deferred() });
    assert_eq!(plan.gbuffer_bytes_per_pixel(), 4 * plan_with(&dull, &samples::deferred()).gbuffer_bytes_per_pixel());
}

#[test]
fn a_device_that_has_not_the_samples_or_the_path_that_shades_one_is_refused() {
    let lit = scene(vec![material(CT)], vec![point(Falloff::Quadratic)]);
    let four = Settings { msaa: 4, ..samples::deferred() };
    let poor = Capabilities { msaa: 1 | 2, ..device() };
    let text = FramePlan::of(&lit, &four, &poor).expect_err("no 4 samples").to_string();
    assert!(text.contains("cannot draw 4") && text.contains("1, 2"), "{text}");
    for light_path in [LightPath::PerLight, LightPath::Volumes] {
        let settings = Settings { light_path, ..four.clone() };
        let text = FramePlan::of(&lit, &settings, &device()).expect_err("one sample").to_string();
        assert!(text.contains(light_path.name()) && text.contains("clustered"), "{text}");
    }
    let looked_up = Settings { light_path: LightPath::Visibility, ..four.clone() };
    let unnumbered = Capabilities { numbered_msaa: 1 | 2, ..device() };
    let text = FramePlan::of(&lit, &looked_up, &unnumbered).expect_err("no integers").to_string();
    assert!(text.contains("no such textures of integers") && text.contains("choose loop"), "{text}");
    FramePlan::of(&lit, &Settings { msaa: 1, ..looked_up }, &unnumbered).expect("one sample needs none");
    let compute = Settings { light_path: LightPath::Compute, ..four };
    let able = FramePlan::of(&lit, &compute, &device()).expect("a plan");
    assert_eq!((able.light_path, able.msaa), (LightPath::Compute, 4));
    for (device, says) in [
        (Capabilities { sampled_msaa: 1 | 2, ..device() }, "reads 4 samples a pixel as textures"),
        (Capabilities { shared_memory: 4096, ..device() }, "shares 8192 bytes"),
    ] {
        let text = FramePlan::of(&lit, &compute, &device).expect_err("too little").to_string();
        assert!(text.contains(says) && text.contains("choose loop"), "{text}");
        FramePlan::of(&lit, &Settings { msaa: 1, ..compute.clone() }, &device).expect("one sample needs neither");
        FramePlan::of(&lit, &Settings { light_path: LightPath::Loop, ..compute.clone() }, &device)
            .expect("nor do others");
    }
}

#[test]
fn auto_takes_a_path_that_multisampling_and_fxaa_go_with() {
    let lamps: Vec<Light> = (0..20).map(|_| point(Falloff::Quadratic)).collect();
    let lit = scene(vec![material(CT)], lamps);
    let gpu = Capabilities { software: false, lazily_allocated: false, ..device() };
    let four = Settings { msaa: 4, ..Settings::default() };
    let narrow = Capabilities { shared_memory: 4096, ..gpu };
    let unnumbered = Capabilities { numbered_msaa: 1 | 2, ..gpu };
    let unread = Capabilities { sampled_msaa: 1 | 2, ..gpu };
    for (settings, device, path, says) in [
        (Settings::default(), &gpu, LightPath::Visibility, ""),
        (Settings { fxaa: true, ..Settings::default() }, &gpu, LightPath::Clustered, "effects on the finished picture"),
        (four.clone(), &gpu, LightPath::Visibility, ""),
        (
            four.clone(),
            &unnumbered,
            LightPath::Compute,
            "not visibility: the device reads no textures of so many samples of integers",
        ),
        (four.clone(), &narrow, LightPath::Clustered, "share more memory"),
        (four, &unread, LightPath::Clustered, "textures of so many samples"),
    ] {
        let plan = FramePlan::of(&lit, &settings, device).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(plan.light_path, path);
        let why = plan.reasons.light_path;
        assert!(why.contains(says), "{why}");
    }
}
