//! Frames by render passes with subpasses, by rendering with local read, and stored; by either API of synchronization; in optimal and unified layouts: the same
//! bytes, and silent layers.

use afterlight::frame::{Renderer, plan_for, plan_with, rows};
use afterlight::gpu::{Device, Support, vk};
use afterlight::plan::{Capabilities, Variation, samples, variations};
use afterlight::scene::{
    AmbientOcclusion, Culling, Fog, GbufferPreset, ImageLayouts, LightPath, Passes, Reflections, Resolve, Scene,
    Settings, SyncApi, Transparency,
};
use afterlight_lab::mutants::experiment;

use crate::common::compare::assert_identical;
use crate::common::gpu::{Gpu, on_gpu};
use crate::common::some_of;
use crate::common::stage::{open, own};

const SIZE: [u32; 2] = [96, 54];

/// Each way to carry a frame beside the default.
fn carriers() -> Vec<(Passes, SyncApi, ImageLayouts)> {
    let mut all = Vec::new();
    for &(_, passes) in Passes::NAMES {
        for &(_, sync) in SyncApi::NAMES {
            for &(_, layouts) in ImageLayouts::NAMES {
                all.push((passes, sync, layouts));
            }
        }
    }
    assert_eq!(all.remove(0), Default::default());
    all
}

/// Frames that have most passes between them, and each split of render passes.
fn frames() -> Vec<(&'static str, Scene, Settings)> {
    let hall = open("builtin:hall");
    let of = |scene: &Scene| Settings { size: SIZE, samples: 1, ..own(scene, SIZE[0], SIZE[1]) };
    let plain = of(&hall);
    let mut glazed = hall.clone();
    for (index, material) in glazed.materials.iter_mut().enumerate().filter(|(index, _)| index % 3 == 0) {
        (material.alpha, material.alpha_mode) = (0.2 + 0.2 * (index % 4) as f32, afterlight::scene::AlphaMode::Blend);
    }
    let mut tinted = Settings { transparency: Transparency::Oit, fxaa: true, vignette: 0.5, ..plain.clone() };
    tinted.shadows.tinted = true;
    vec![
        ("the hall", hall.clone(), plain.clone()),
        (
            "neighbours",
            hall.clone(),
            Settings {
                ao: AmbientOcclusion::Ssao,
                reflections: Reflections::Screen,
                bloom: 0.2,
                fog: Fog::Height,
                ..plain.clone()
            },
        ),
        ("veils in any order", glazed.clone(), tinted),
        ("veils", glazed, Settings { aberration: 0.02, grain: 0.2, ..plain.clone() }),
        ("forward", hall.clone(), Settings { light_path: LightPath::Forward, fog: Fog::Height, ..plain.clone() }),
        ("compute", hall.clone(), Settings { light_path: LightPath::Compute, ..plain.clone() }),
        ("culled", hall.clone(), Settings { culling: Culling::Gpu, ..plain.clone() }),
        ("samples", hall, Settings { msaa: 4, fog: Fog::Height, ..plain }),
    ]
}

/// A small scene in each form of each effect.
fn effects() -> Vec<(&'static str, Scene, Settings)> {
    let scenes: Vec<(&str, Scene)> = samples::scenes()
        .into_iter()
        .filter(|(name, _)| ["shadowed-lamps", "glass", "glowing gauze", "deformed"].contains(name))
        .collect();
    let of_one = |(index, variation): (usize, &'static Variation)| {
        let mut scene = scenes[index % scenes.len()].1.clone();
        let mut settings = Settings { size: SIZE, light_path: LightPath::Loop, ..Settings::default() };
        (variation.scene)(&mut scene);
        (variation.settings)(&mut settings);
        (variation.name, scene, settings)
    };
    variations().filter(|variation| !variation.is_alone).enumerate().map(of_one).collect()
}

/// Whether a refusal names a requirement of the carrier that the device says it lacks.
fn names_a_lack(device: &Device, settings: &Settings, refusal: &str) -> bool {
    let newer = device.physical.newer;
    let names = |support: Support| support.is_err_and(|lack| refusal.contains(&lack.to_string()));
    let of_reads = [
        (newer.local_read_depth, "dynamicRenderingLocalReadDepthStencilAttachments"),
        (newer.local_read_samples, "dynamicRenderingLocalReadMultisampledAttachments"),
        (device.physical.features.independent_blend == vk::TRUE, "independentBlend"),
    ];
    let by_read = names(newer.local_read) || of_reads.iter().any(|(has, name)| !has && refusal.contains(name));
    settings.passes == Passes::LocalRead && by_read
        || settings.sync == SyncApi::Two && names(newer.synchronization2)
        || settings.layouts == ImageLayouts::Unified && names(newer.unified_layouts)
}

/// Two frames, so that the second one waits for the first.
fn draw(gpu: &Gpu, scene: &Scene, settings: &Settings) -> afterlight::frame::Picture {
    let mut renderer =
        Renderer::new(&gpu.device, scene, settings).unwrap_or_else(|error| panic!("{settings:?}: {error}"));
    for _ in 0..2 {
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
    }
    renderer.read_back().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn each_way_to_carry_a_frame_draws_the_same_bytes() {
    on_gpu(|gpu| {
        let mut drawn = 0;
        // The finest masks, in barriers inside of rendering.
        let together = (Passes::LocalRead, SyncApi::Two, ImageLayouts::Optimal);
        for (index, (name, scene, mut settings)) in frames().into_iter().chain(effects()).enumerate() {
            // Positions take the place of depth where local read is of colour alone.
            if !gpu.device.physical.newer.local_read_depth && index % 2 == 0 {
                settings.gbuffer.preset = GbufferPreset::Float32;
            }
            // Some effects have nothing to do in some scenes.
            if index >= frames().len() && plan_for(&gpu.device, &scene, &settings).is_err() {
                continue;
            }
            let classic = draw(gpu, &scene, &settings);
            let some: Vec<_> = crate::common::some_in_turn(&carriers(), index, 3).collect();
            let first = (index == 0 && !some.contains(&together)).then_some(together);
            for (passes, sync, layouts) in first.into_iter().chain(some) {
                let carried = Settings { passes, sync, layouts, ..settings.clone() };
                // What a device lacks is refused by name: the test below. What it has must be drawn.
                if let Err(refusal) = plan_for(&gpu.device, &scene, &carried) {
                    let refusal = refusal.to_string();
                    let is_right = names_a_lack(&gpu.device, &carried, &refusal);
                    assert!(is_right, "{name}, {passes}, sync {sync}, {layouts}: {refusal}");
                    continue;
                }
                let picture = draw(gpu, &scene, &carried);
                assert_identical(&classic, &picture, &format!("{name}, {passes}, sync {sync}, {layouts}"));
                drawn += 1;
            }
        }
        assert!(drawn >= 2 * frames().len(), "{drawn}");
    });
}

/// What is ordered more than it must be costs time and changes nothing: no byte, and no layer has a word for it.
#[test]
fn more_order_draws_the_same_bytes() {
    on_gpu(|gpu| {
        for (index, (name, scene, mut settings)) in some_of(frames().into_iter().enumerate(), 3) {
            if index % 2 == 1 {
                settings.gbuffer.preset = GbufferPreset::Float32;
                let carried = Settings { passes: Passes::LocalRead, sync: SyncApi::Two, ..settings.clone() };
                if plan_for(&gpu.device, &scene, &carried).is_ok() {
                    settings = carried;
                }
            }
            let plain = draw(gpu, &scene, &settings);
            let plan = plan_for(&gpu.device, &scene, &settings).unwrap_or_else(|error| panic!("{name}: {error}"));
            let table = rows::table(&plan);
            for rows in [table.all_widened(&plan), table.with_full_barriers()] {
                // SAFETY: they order all that the plan's own table orders.
                let picture = unsafe { experiment::draw(&gpu.device, &scene, &settings, rows) };
                let picture = picture.unwrap_or_else(|error| panic!("{name}: {error}"));
                // Clips move between the frames of an experiment.
                if scene.motion.is_empty() {
                    assert_identical(&plain, &picture, name);
                }
            }
        }
    });
}

/// The commands that either API has, by the name of the older one. The other adds a 2.
const OF_BOTH: [&str; 5] =
    ["vkCmdPipelineBarrier", "vkCmdBeginRenderPass", "vkCmdNextSubpass", "vkCmdEndRenderPass", "vkCmdWriteTimestamp"];

/// Fails unless all commands that `record` records are of this API, and barriers among them.
fn assert_recorded_by(sync: SyncApi, device: &Device, what: &str, record: impl FnOnce()) {
    device.keep_commands();
    record();
    let of = |sync: SyncApi, name: &str| if sync == SyncApi::Two { format!("{name}2") } else { name.to_owned() };
    let other = if sync == SyncApi::Two { SyncApi::One } else { SyncApi::Two };
    let recorded: Vec<&str> = device.take_commands().into_iter().map(|own| own.name).collect();
    let wrong = OF_BOTH.map(|name| of(other, name));
    let stray: Vec<_> = recorded.iter().filter(|name| wrong.iter().any(|wrong| wrong == *name)).collect();
    assert!(stray.is_empty(), "{what}, sync {sync}: {stray:?}");
    assert!(recorded.contains(&&*of(sync, "vkCmdPipelineBarrier")), "{what}, sync {sync}: {recorded:?}");
}

/// Whichever renderer of a device was made last, each records its uploads and frames by its own plan's API.
#[test]
fn each_renderer_of_a_device_records_by_its_own_api() {
    on_gpu(|gpu| {
        let device = &gpu.device;
        let (_, scene, plain) = frames().swap_remove(0);
        let settings = |sync: SyncApi| Settings { sync, ..plain.clone() };
        if plan_for(device, &scene, &settings(SyncApi::Two)).is_err() {
            println!("NOT RUN: this device has one API of synchronization");
            return;
        }
        let both = [SyncApi::One, SyncApi::Two];
        let mut renderers = Vec::new();
        for sync in both.into_iter().chain(both) {
            assert_recorded_by(sync, device, "uploads", || {
                let made = Renderer::new(device, &scene, &settings(sync));
                renderers.push((sync, made.unwrap_or_else(|error| panic!("{error}"))));
            });
        }
        let mut pictures = Vec::new();
        for turn in 0..2 {
            for (sync, renderer) in &mut renderers {
                assert_recorded_by(*sync, device, &format!("frame {turn}"), || {
                    renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
                    pictures.push(renderer.read_back().unwrap_or_else(|error| panic!("{error}")));
                });
            }
        }
        pictures.iter().for_each(|own| assert_identical(&pictures[0], own, "in turn"));
    });
}

#[test]
fn what_a_device_lacks_for_a_carrier_is_refused_by_name() {
    on_gpu(|gpu| {
        let newer = gpu.device.physical.newer;
        let (_, scene, plain) = frames().swap_remove(0);
        let refused = |settings: Settings| match plan_for(&gpu.device, &scene, &settings) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        };
        let local = Settings { passes: Passes::LocalRead, ..plain.clone() };
        let by_depth = refused(local.clone());
        match (newer.local_read, newer.local_read_depth) {
            (Err(lack), _) => assert!(by_depth.contains(&lack.to_string()), "{by_depth}"),
            (Ok(()), false) => {
                let property = "dynamicRenderingLocalReadDepthStencilAttachments";
                assert!(by_depth.contains(property) && by_depth.contains("LIGHTING"), "{by_depth}");
                let mut stored = local.clone();
                stored.gbuffer.preset = GbufferPreset::Float32;
                assert_eq!(refused(stored), "", "positions are colours");
            }
            (Ok(()), true) => assert_eq!(by_depth, ""),
        }
        let by_samples = refused(Settings { msaa: 4, ..local });
        if newer.local_read.is_ok() && newer.local_read_depth && !newer.local_read_samples {
            assert!(by_samples.contains("dynamicRenderingLocalReadMultisampledAttachments"), "{by_samples}");
        }
        let by_layouts = refused(Settings { layouts: ImageLayouts::Unified, ..plain.clone() });
        let names = |told: &str, support: Support| match support {
            Ok(()) => told.is_empty(),
            Err(lack) => told.contains(&lack.to_string()),
        };
        assert!(names(&by_layouts, newer.unified_layouts), "{by_layouts}");
        let by_api = refused(Settings { sync: SyncApi::Two, ..plain });
        assert!(names(&by_api, newer.synchronization2), "{by_api}");
    });
}

/// All attachments of a rendering have as many samples, and TONEMAP reads several a pixel and draws one.
#[test]
fn local_read_of_samples_into_one_is_refused_on_any_device() {
    let (_, scene, plain) = frames().swap_remove(0);
    let told = |resolve, bloom| {
        let settings = Settings { passes: Passes::LocalRead, msaa: 4, bloom, resolve, ..plain.clone() };
        plan_with(&Capabilities::ample(), &scene, &settings).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let linear = told(Resolve::Linear, 0.2);
    assert!(linear.contains("TONEMAP reads attachments of 4 samples a pixel and draws 1"), "{linear}");
    assert_eq!(told(Resolve::ToneMapped, 0.0), "", "TONEMAP draws samples, and they are resolved at the end");
}
