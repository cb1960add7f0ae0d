//! The validation layer has nothing to say, core and synchronization, in both modes of its shader heuristic, with frames in
//! flight under a moving camera. `on_gpu_in_both_modes` proves first that the layer is on, and fails on every message and leak.
//!
//! Only newer layers see hazards between two submissions, for example on targets that frames share: 1.3.239 says nothing when `geometry-reuse` is
//! left out, and Debian 13's layer reports it in every test here.

use crate::common::gpu::{Gpu, on_gpu_in_both_modes};
use crate::common::scenes::{crowd, draw_frames, exercise, nothing_emits, one_of_each, small, with_transparent};
use crate::common::stage::{gbuffer, lambert, open, plane, point, spot, sun};
use crate::common::{one_of, some_in_turn, some_of, tries_all};
use afterlight::frame::{Error, Renderer};
use afterlight::plan;
use afterlight::scene::builtin::CATALOGUE;
use afterlight::scene::{
    Brdf, Camera, Environment, Falloff, Fog, GbufferPreset, HdrFormat, Keep, Light, LightKind, LightPath, Material,
    Output, Playing, Reflections, Resolve, Scene, Settings, ShadowFilter, ShadowSettings, TARGETS, Transparency, View,
};
use glam::{DAffine3, DQuat, DVec3};

#[test]
fn transparent_surfaces_are_silent_sorted_and_weighted() {
    on_gpu_in_both_modes(|gpu| {
        let alone = Scene { name: "nothing".into(), ..plane(lambert(0.5), Vec::new()) };
        for (turn, scene) in [one_of_each(), nothing_emits(), alone].map(with_transparent).into_iter().enumerate() {
            for (kind, (_, transparency)) in Transparency::NAMES.iter().enumerate() {
                for &(_, output) in one_of(Output::NAMES, turn + kind) {
                    // The tests of layouts store surfaces behind panes in either layout, so `make test` takes one here.
                    for name in some_of(["lean", "float32"], 2) {
                        let settings = Settings { transparency: *transparency, output, ..small(&scene) };
                        exercise(gpu, &scene, &Settings { gbuffer: gbuffer(name), ..settings });
                    }
                }
            }
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn transparent_surfaces_are_silent_on_every_light_path() {
    on_gpu_in_both_modes(|gpu| {
        let scene = with_transparent(one_of_each());
        for (_, transparency) in Transparency::NAMES {
            for (light_path, depth_prepass) in [
                (LightPath::Forward, Some(true)),
                (LightPath::Forward, Some(false)),
                (LightPath::ForwardNaive, None),
                (LightPath::PerLight, None),
                (LightPath::Volumes, None),
                (LightPath::Clustered, Some(true)),
            ] {
                let settings = Settings { transparency: *transparency, light_path, depth_prepass, ..small(&scene) };
                exercise(gpu, &scene, &settings);
            }
        }
    });
}

#[test]
fn every_built_in_scene_is_silent_in_every_kind_of_output() {
    on_gpu_in_both_modes(|gpu| {
        for (turn, builtin) in CATALOGUE.iter().enumerate() {
            // Fewer objects than by default: more of them are recorded the same way.
            let query = if builtin.name == "field" { "?objects=40&lights=20" } else { "" };
            let scene = open(&format!("builtin:{}{query}", builtin.name));
            for &(_, output) in one_of(Output::NAMES, turn) {
                exercise(gpu, &scene, &Settings { output, ..small(&scene) });
            }
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn every_view_is_silent_or_says_why_there_is_none() {
    on_gpu_in_both_modes(|gpu| {
        let smoke = open("assets/gallery/particles.toml").into_still(&Playing::at(9.0));
        let scenes = [one_of_each(), open("builtin:cornell"), open("builtin:spheres?rows=1&columns=2"), smoke];
        for (turn, scene) in scenes.into_iter().enumerate() {
            let shadowed = scene.lights.iter().any(|light| light.casts_shadow);
            for (name, view) in some_in_turn(View::NAMES, turn, 2) {
                // The view shows where samples of a pixel differ, so it needs several.
                let msaa = if view == View::Complexity { 4 } else { 1 };
                let settings = Settings { view, msaa, ..small(&scene) };
                match Renderer::new(&gpu.device, &scene, &settings) {
                    Ok(mut renderer) => {
                        let drawn = draw_frames(&mut renderer, &scene);
                        drawn.unwrap_or_else(|error| panic!("{} {name}: {error}", scene.name));
                    }
                    Err(Error::Plan(plan::PlanError::NoTriangles)) if !gpu.shows(view) => {}
                    Err(Error::Plan(plan::PlanError::NoShadowMap(_))) if view == View::ShadowMap && !shadowed => {}
                    Err(Error::Plan(refused @ plan::PlanError::Refused(_)))
                        if refused.shows_nothing() && scene.emitters.is_empty() => {}
                    Err(error) => panic!("{} {name}: {error}", scene.name),
                }
            }
        }
    });
}

/// Returns every preset, and every format that a target can be given instead of its format in `lean`.
fn every_gbuffer() -> Vec<String> {
    let presets = GbufferPreset::NAMES.iter().map(|(name, _)| (*name).to_owned());
    let overrides = TARGETS.iter().flat_map(|(target, formats)| formats.iter().map(move |f| format!("{target}={f}")));
    presets.chain(overrides).collect()
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn every_gbuffer_is_silent_with_and_without_an_hdr_target() {
    on_gpu_in_both_modes(|gpu| {
        for name in every_gbuffer() {
            let scene = one_of_each();
            exercise(gpu, &scene, &Settings { gbuffer: gbuffer(&name), ..small(&scene) });
        }
        // Without an HDR target LIGHTING writes to the output, whatever the targets' formats.
        for (name, _) in GbufferPreset::NAMES {
            let scene = nothing_emits();
            exercise(gpu, &scene, &Settings { gbuffer: gbuffer(name), ..small(&scene) });
        }
    });
}

#[test]
fn every_light_path_is_silent() {
    on_gpu_in_both_modes(|gpu| {
        for (path, (_, light_path)) in LightPath::NAMES.iter().enumerate() {
            let scenes = [&one_of_each(), &nothing_emits(), &crowd()];
            for (turn, scene) in some_in_turn(&scenes, path, 3).enumerate() {
                if !gpu.takes(*light_path, scene) {
                    continue;
                }
                for &(_, output) in one_of(Output::NAMES, path + turn) {
                    exercise(gpu, scene, &Settings { light_path: *light_path, output, ..small(scene) });
                }
            }
        }
        let scene = nothing_emits();
        let layouts = ["float32", "fat", "normal=oct16-uint"];
        let paths = [LightPath::PerLight, LightPath::Volumes, LightPath::Clustered, LightPath::Compute];
        for (turn, light_path) in paths.into_iter().enumerate() {
            for &name in one_of(&layouts, turn) {
                exercise(gpu, &scene, &Settings { light_path, gbuffer: gbuffer(name), ..small(&scene) });
            }
            let alone = [
                Settings { light_path, light_cutoff: true, ..small(&scene) },
                Settings { light_path, depth_prepass: Some(true), ..small(&scene) },
            ];
            one_of(&alone, turn).iter().for_each(|settings| exercise(gpu, &scene, settings));
        }
    });
}

#[test]
fn every_hdr_format_is_silent_or_refused() {
    on_gpu_in_both_modes(|gpu| {
        let scene = one_of_each();
        for (name, hdr_format) in HdrFormat::NAMES {
            let settings = Settings { hdr_format: *hdr_format, ..small(&scene) };
            match Renderer::new(&gpu.device, &scene, &settings) {
                Ok(mut renderer) => draw_frames(&mut renderer, &scene).unwrap_or_else(|error| panic!("{error}")),
                Err(Error::Plan(plan::PlanError::HdrFormat(refused))) => assert_eq!(refused, *hdr_format),
                Err(error) => panic!("{name}: {error}"),
            }
        }
    });
}

#[test]
fn linear_output_is_silent_with_and_without_what_emits() {
    on_gpu_in_both_modes(|gpu| {
        for scene in [one_of_each(), nothing_emits()] {
            for name in ["lean", "fat", "float32", "normal=oct16-uint"] {
                exercise(gpu, &scene, &Settings { gbuffer: gbuffer(name), output: Output::Nits, ..small(&scene) });
            }
        }
    });
}

#[test]
fn every_brdf_is_silent_alone() {
    on_gpu_in_both_modes(|gpu| {
        for (_, brdf) in Brdf::NAMES {
            for scene in [one_of_each(), nothing_emits()] {
                exercise(gpu, &scene, &Settings { brdf: Some(*brdf), ..small(&scene) });
            }
        }
    });
}

#[test]
fn scenes_that_lack_nearly_everything_are_silent() {
    on_gpu_in_both_modes(|gpu| {
        let empty = Scene { name: "empty".into(), ..Scene::default() };
        let lit_emptiness = Scene { lights: one_of_each().lights, ..empty.clone() };
        let dark = Scene { lights: Vec::new(), environment: Environment::default(), ..one_of_each() };
        let dark_and_plain = Scene { lights: Vec::new(), ..nothing_emits() };
        let only_ambient = Scene { name: "ambient".into(), ..plane(lambert(0.5), Vec::new()) };
        for scene in [empty, lit_emptiness, dark, dark_and_plain, only_ambient] {
            for &(_, output) in Output::NAMES {
                exercise(gpu, &scene, &Settings { output, ..small(&scene) });
            }
        }
    });
}

#[test]
fn few_and_many_lights_are_silent() {
    on_gpu_in_both_modes(|gpu| {
        for count in [1usize, plan::UNIFORM_LIGHTS, plan::UNIFORM_LIGHTS + 1, 1000] {
            let lamp = |index| point(DVec3::new(index as f64 * 1e-3, 0.0, 1.0), 0.1, Some(4.0), Falloff::InverseSquare);
            let scene = plane(Material::default(), (0..count).map(lamp).collect());
            let renderer = gpu.renderer(&scene, &small(&scene));
            assert_eq!(renderer.plan().lights.uniform, count <= plan::UNIFORM_LIGHTS, "{count} lights");
            exercise(gpu, &scene, &small(&scene));
        }
    });
}

#[test]
fn a_sun_that_shares_its_scene_with_others_is_silent() {
    on_gpu_in_both_modes(|gpu| {
        let mut scene = one_of_each();
        let from_above = LightKind::Directional { direction: DVec3::NEG_Y };
        scene.lights.push(Light { kind: from_above, ..scene.lights[0].clone() });
        exercise(gpu, &scene, &small(&scene));
        let enabled = false;
        exercise(gpu, &scene, &Settings { shadows: ShadowSettings { enabled, ..Default::default() }, ..small(&scene) });
    });
}

#[test]
fn every_size_of_picture_and_shadow_map_is_silent() {
    on_gpu_in_both_modes(|gpu| {
        for scene in [one_of_each(), nothing_emits()] {
            for size in [[1, 1], [1, 67], [67, 1], [17, 13], [65, 33]] {
                exercise(gpu, &scene, &Settings { size, ..small(&scene) });
            }
        }
        for size in [1, 3, 4096] {
            let scene = nothing_emits();
            let shadows = ShadowSettings { size, ..ShadowSettings::default() };
            exercise(gpu, &scene, &Settings { shadows, ..small(&scene) });
        }
    });
}

#[test]
fn renderers_that_share_a_device_are_silent() {
    on_gpu_in_both_modes(|gpu| {
        let scene = one_of_each();
        let mut first = gpu.renderer(&scene, &small(&scene));
        // Made while the first draws: a resize, as a window has it.
        first.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
        let mut second = gpu.renderer(&scene, &Settings { size: [19, 31], ..small(&scene) });
        for _ in 0..3 {
            for renderer in [&mut first, &mut second] {
                renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
            }
        }
        drop(first);
        draw_frames(&mut second, &scene).unwrap_or_else(|error| panic!("{error}"));
    });
}

/// A sun, a point and a spot light, all with shadows, over solid, masked and transparent casters.
fn shadowed() -> Scene {
    let casts = |light| Light { casts_shadow: true, ..light };
    let lamp = point(DVec3::new(-0.4, 0.2, 1.2), 2.0, Some(4.0), Falloff::InverseSquare);
    let lights =
        vec![sun(DVec3::new(0.5, 0.7, 1.0), 3.0), casts(lamp), casts(spot(DVec3::new(0.0, 0.0, 1.5), 2.0, 10.0, 30.0))];
    Scene { name: "shadows".into(), lights, ..nothing_emits() }
}

/// Frames between which nothing changes, a caster moves, each light moves, and the camera turns: some maps are drawn anew while the
/// frame before still looks them up, and others stay.
fn draw_while_things_move(gpu: &Gpu, scene: &Scene, settings: &Settings) {
    if !gpu.takes_turn() {
        return;
    }
    let mut renderer = gpu.renderer(scene, settings);
    let draw = |renderer: &mut Renderer, camera: &Camera| -> Result<(), Error> {
        renderer.render(camera)?;
        // Draws a second frame: one of the two in flight sees a change first.
        renderer.render(camera)
    };
    let all = |renderer: &mut Renderer| -> Result<(), Error> {
        draw(renderer, &scene.camera)?;
        for caster in [1, scene.objects.len() - 1] {
            let aside = DAffine3::from_translation(DVec3::new(0.1, 0.0, 0.0)) * scene.objects[caster].transform;
            renderer.move_object(&mut scene.clone(), caster, &aside)?;
            draw(renderer, &scene.camera)?;
        }
        for (index, light) in scene.lights.iter().enumerate() {
            renderer.set_light(&mut scene.clone(), index, &Light { kind: moved(light.kind), ..light.clone() })?;
            draw(renderer, &scene.camera)?;
        }
        renderer.read_back()?;
        let rotation = scene.camera.rotation * DQuat::from_rotation_y(0.3);
        draw(renderer, &Camera { rotation, ..scene.camera })
    };
    all(&mut renderer).unwrap_or_else(|error| panic!("{} {settings:?}: {error}", scene.name));
}

fn moved(mut kind: LightKind) -> LightKind {
    let by = DVec3::new(0.1, 0.05, 0.0);
    if let Some(place) = kind.place_mut() {
        *place += by;
    } else if let Some(direction) = kind.direction_mut() {
        *direction = (*direction + by).normalize();
    }
    kind
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn shadow_maps_that_are_kept_or_drawn_anew_are_silent_on_every_light_path() {
    on_gpu_in_both_modes(|gpu| {
        let (plain, glass) = (shadowed(), with_transparent(shadowed()));
        for cache in [true, false] {
            for &(_, light_path) in LightPath::NAMES {
                if !cache && !tries_all() && light_path != LightPath::Loop {
                    // Maps that are drawn anew are drawn alike on every path that looks them up.
                    continue;
                }
                // Nothing blends over the picture of a compute pass.
                let ends = matches!(light_path, LightPath::Compute | LightPath::Visibility);
                let scene = if ends { &plain } else { &glass };
                if !gpu.takes(light_path, scene) {
                    continue;
                }
                let shadows = ShadowSettings { cache, size: 64, ..ShadowSettings::default() };
                draw_while_things_move(gpu, scene, &Settings { light_path, shadows, ..small(scene) });
            }
        }
    });
}

#[test]
fn every_filter_and_number_of_cascades_is_silent_with_and_without_the_cache() {
    on_gpu_in_both_modes(|gpu| {
        let scene = shadowed();
        for cache in [true, false] {
            let base = ShadowSettings { cache, size: 64, ..ShadowSettings::default() };
            for (_, filter) in some_in_turn(ShadowFilter::NAMES, usize::from(cache), 2) {
                let shadows = ShadowSettings { filter, ..base };
                draw_while_things_move(gpu, &scene, &Settings { shadows, ..small(&scene) });
            }
            for cascades in some_in_turn(&[1, 2, 3, 4], usize::from(cache), 2) {
                let shadows = ShadowSettings { cascades, ..base };
                draw_while_things_move(gpu, &scene, &Settings { shadows, ..small(&scene) });
            }
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn samples_of_one_picture_are_silent_wherever_they_are_averaged() {
    on_gpu_in_both_modes(|gpu| {
        let (plain, glass) = (shadowed(), with_transparent(one_of_each()));
        for &(_, resolve) in Resolve::NAMES {
            for (light_path, scene) in
                [(LightPath::Loop, &glass), (LightPath::Compute, &plain), (LightPath::Forward, &glass)]
            {
                for &(_, output) in Output::NAMES {
                    let settings = Settings { samples: 3, resolve, light_path, output, ..small(scene) };
                    if !gpu.takes_turn() {
                        continue;
                    }
                    let mut renderer = gpu.renderer(scene, &settings);
                    let picture = renderer.picture(&scene.camera, || ());
                    picture.unwrap_or_else(|error| panic!("{settings:?}: {error}"));
                }
            }
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn hardware_samples_and_fxaa_are_silent_in_flight() {
    on_gpu_in_both_modes(|gpu| {
        let (plain, glass) = (shadowed(), with_transparent(one_of_each()));
        for (turn, scene) in [&plain, &glass].into_iter().enumerate() {
            for (path, light_path) in [LightPath::Loop, LightPath::Forward].into_iter().enumerate() {
                for &(_, resolve) in one_of(Resolve::NAMES, turn + path) {
                    exercise(gpu, scene, &Settings { light_path, msaa: 4, resolve, ..small(scene) });
                }
                for &msaa in one_of(&[1, 4], turn + path) {
                    exercise(gpu, scene, &Settings { light_path, msaa, fxaa: true, ..small(scene) });
                }
            }
        }
        let transparency = Transparency::Oit;
        exercise(gpu, &glass, &Settings { transparency, msaa: 4, fxaa: true, ..small(&glass) });
        let glowing = one_of_each();
        for (turn, (scene, layout)) in [(&plain, "lean"), (&glowing, "float32")].into_iter().enumerate() {
            for &(_, resolve) in one_of(Resolve::NAMES, turn) {
                let (light_path, gbuffer) = (LightPath::Compute, gbuffer(layout));
                let compute = Settings { light_path, msaa: 4, resolve, gbuffer, ..small(scene) };
                exercise(gpu, scene, &compute);
                if layout == "lean" && gpu.takes(LightPath::Visibility, scene) {
                    exercise(gpu, scene, &Settings { light_path: LightPath::Visibility, ..compute });
                }
            }
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn spread_light_is_silent_in_flight() {
    on_gpu_in_both_modes(|gpu| {
        let (plain, glass) = (shadowed(), with_transparent(one_of_each()));
        let with = |scene: &Scene, light_path| Settings { bloom: 0.3, light_path, ..small(scene) };
        exercise(gpu, &plain, &Settings { fxaa: true, vignette: 0.5, ..with(&plain, LightPath::Loop) });
        exercise(gpu, &plain, &Settings { output: Output::Nits, ..with(&plain, LightPath::Forward) });
        exercise(gpu, &plain, &Settings { msaa: 4, resolve: Resolve::Linear, ..with(&plain, LightPath::Loop) });
        exercise(gpu, &glass, &with(&glass, LightPath::PerLight));
        exercise(gpu, &glass, &Settings { transparency: Transparency::Oit, ..with(&glass, LightPath::Loop) });
        for size in [[1, 1], [33, 7], [200, 3]] {
            exercise(gpu, &plain, &Settings { bloom_radius: 1.0, size, ..with(&plain, LightPath::Loop) });
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn reflections_are_silent_in_flight() {
    on_gpu_in_both_modes(|gpu| {
        let polished = |mut scene: Scene| {
            scene.materials.iter_mut().for_each(|own| (own.brdf, own.roughness) = (Brdf::CookTorrance, 0.3));
            scene
        };
        let (plain, glass) = (polished(shadowed()), polished(with_transparent(one_of_each())));
        let with =
            |scene: &Scene| Settings { reflections: Reflections::Screen, light_path: LightPath::Loop, ..small(scene) };
        exercise(gpu, &plain, &Settings { fxaa: true, vignette: 0.5, ..with(&plain) });
        exercise(gpu, &plain, &Settings { output: Output::Nits, bloom: 0.2, ..with(&plain) });
        exercise(gpu, &glass, &Settings { transparency: Transparency::Oit, bloom: 0.2, ..with(&glass) });
        for size in [[1, 1], [200, 3]] {
            exercise(gpu, &plain, &Settings { size, ..with(&plain) });
        }
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn fog_is_silent_in_flight() {
    on_gpu_in_both_modes(|gpu| {
        let (plain, glass) = (shadowed(), with_transparent(one_of_each()));
        let with = |scene: &Scene, light_path| Settings { fog: Fog::Height, light_path, ..small(scene) };
        exercise(gpu, &plain, &Settings { fxaa: true, vignette: 0.5, ..with(&plain, LightPath::Loop) });
        exercise(gpu, &plain, &Settings { msaa: 4, output: Output::Nits, ..with(&plain, LightPath::Forward) });
        exercise(gpu, &glass, &Settings { bloom: 0.1, ..with(&glass, LightPath::PerLight) });
        exercise(gpu, &glass, &Settings { transparency: Transparency::Oit, ..with(&glass, LightPath::Forward) });
        let lit = |settings| Settings { fog: Fog::Froxels, fog_froxels: [16, 9, 12], ..settings };
        exercise(gpu, &plain, &lit(with(&plain, LightPath::Loop)));
        exercise(gpu, &glass, &lit(with(&glass, LightPath::Forward)));
    });
}

#[test]
#[ignore = "test-all: other tests draw the same frames under the layer"]
fn what_a_plan_keeps_without_need_is_silent() {
    on_gpu_in_both_modes(|gpu| {
        let alone = Scene { name: "alone".into(), ..plane(lambert(0.5), Vec::new()) };
        for scene in [&alone, &nothing_emits()] {
            for light_path in [LightPath::Loop, LightPath::Forward, LightPath::Compute] {
                exercise(gpu, scene, &Settings { light_path, keep: Keep::ALL, ..small(scene) });
            }
        }
    });
}
