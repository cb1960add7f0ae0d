//! The validation layer has nothing to say, core and synchronization, in both modes of its shader heuristic, with frames in
//! flight under a moving camera. `on_gpu_in_both_modes` proves first that the layer is on, and fails on every message and leak.
//!
//! Hazards between two submissions, as those of targets that frames share, are seen by newer layers only: 1.3.239 says
//! nothing when `gbuffer-reuse` is left out, and that of Debian 13 does so in every test here.

mod common;

use afterlight::frame::{Error, Renderer};
use afterlight::plan;
use afterlight::scene::builtin::{CATALOGUE, shapes};
use afterlight::scene::{
    AlphaMode, Brdf, Camera, ColorSpace, Environment, Falloff, GbufferPreset, HdrFormat, Light, LightKind, LightPath,
    Material, Scene, Settings, ShadowSettings, TARGETS, Texture, Transparency, View,
};
use common::gpu::{Gpu, on_gpu_in_both_modes};
use common::stage::{add, gbuffer, lambert, open, own, plane, point, rectangle, spot, sun};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// Pictures are small: the layer looks at commands and not at pixels.
const SIZE: [u32; 2] = [32, 18];

/// Frames enough that each of the two in flight is recorded anew while the other is drawn, a picture read between them, and the
/// renderer dropped with frames under way.
fn draw_frames(renderer: &mut Renderer, camera: &Camera) -> Result<(), Error> {
    for turn in 0..6 {
        // Out of sight as well: a frame that draws nothing has barriers all the same.
        let rotation = camera.rotation * DQuat::from_rotation_y(0.7 * f64::from(turn));
        renderer.render(&Camera { rotation, ..*camera })?;
        if turn == 3 {
            renderer.read_back()?;
        }
    }
    Ok(())
}

/// Draws several frames; the layer's messages are looked at when the device is gone.
fn exercise(gpu: &Gpu, scene: &Scene, settings: &Settings) {
    let mut renderer = gpu.renderer(scene, settings);
    draw_frames(&mut renderer, &scene.camera).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
}

fn small(scene: &Scene) -> Settings {
    own(scene, SIZE[0], SIZE[1])
}

/// Every other texel is a hole.
fn perforated() -> Texture {
    let texel = |index: u32| [255, 128, 64, if (index + index / 4).is_multiple_of(2) { 255 } else { 0 }];
    let texels = (0..16).flat_map(texel).collect();
    Texture { name: "perforated".into(), size: [4, 4], color_space: ColorSpace::Srgb, texels }
}

/// One of each thing that a frame has code for: every BRDF, emissive light, a masked two-sided sheet that casts a shadow, a
/// mirrored transform, a normal map, and a sun with a shadow beside lights of every kind and fall-off.
fn one_of_each() -> Scene {
    let lamp = |x: f64, range, falloff| point(DVec3::new(x, 0.3, 1.0), 2.0, range, falloff);
    let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.5, quadratic: 0.5 };
    let lights = vec![
        sun(DVec3::new(0.5, 0.7, 1.0), 3.0),
        lamp(-0.5, None, Falloff::InverseSquare),
        lamp(0.0, Some(3.0), Falloff::Quadratic),
        lamp(0.5, Some(3.0), polynomial),
        spot(DVec3::new(0.0, 0.0, 1.5), 2.0, 10.0, 30.0),
    ];
    let mut scene = plane(lambert(0.7), lights);
    scene.name = "one of each".into();
    scene.textures = vec![perforated(), Texture { color_space: ColorSpace::Linear, ..perforated() }];
    let at = |x: f64, y: f64| DAffine3::from_translation(DVec3::new(x, y, 0.4));
    let mirrored = |x, y| at(x, y) * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let shiny = |brdf| Material { brdf, specular: Vec3::splat(0.3), shininess: 20.0, ..Material::default() };
    add(&mut scene, shapes::cuboid([0.4; 3]), shiny(Brdf::Phong), at(-0.6, -0.5));
    add(&mut scene, shapes::sphere(0.25, 12), shiny(Brdf::BlinnPhong), mirrored(0.0, -0.5));
    let normal_mapped =
        Material { normal_texture: Some(1), metallic_roughness_texture: Some(1), ..Material::default() };
    add(&mut scene, shapes::cuboid([0.4; 3]), normal_mapped, at(0.6, -0.5));
    let glowing = Material { emissive: Vec3::new(1.0, 0.5, 0.2), emissive_texture: Some(0), ..Material::default() };
    add(&mut scene, shapes::cuboid([0.3; 3]), glowing, at(-0.6, 0.5));
    let sheet = Material {
        base_color_texture: Some(0),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        two_sided: true,
        ..lambert(1.0)
    };
    add(&mut scene, rectangle([-0.4, -0.4], [0.4, 0.4], 0.1), sheet, mirrored(0.5, 0.5));
    scene.environment = Environment { ambient: Vec3::splat(0.1), background: Vec3::splat(0.2), ground: None };
    scene
}

/// The same without what emits, so that there is no HDR target.
fn nothing_emits() -> Scene {
    let mut scene = one_of_each();
    for material in &mut scene.materials {
        (material.emissive, material.emissive_texture) = (Vec3::ZERO, None);
    }
    scene
}

/// The same with a glowing sheet that blends, a glass ball in a mirror, and textured gauze, which overlap.
fn with_transparent(mut scene: Scene) -> Scene {
    scene.name += " behind glass";
    let transparent = |alpha_mode| Material { alpha_mode, alpha: 0.4, two_sided: true, ..Material::default() };
    let at = |z: f64| DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    let glow = Material { emissive: Vec3::new(0.5, 1.0, 0.2), ..transparent(AlphaMode::Blend) };
    add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.0), glow, at(0.5));
    let mirrored = at(0.6) * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    add(&mut scene, shapes::sphere(0.3, 12), transparent(AlphaMode::Glass), mirrored);
    let textures = (!scene.textures.is_empty()).then_some(0);
    let gauze = Material {
        brdf: Brdf::Phong,
        base_color_texture: textures,
        normal_texture: textures,
        ..transparent(AlphaMode::Blend)
    };
    add(&mut scene, rectangle([-0.4, -0.4], [0.6, 0.6], 0.0), gauze, at(0.7));
    scene
}

#[test]
fn transparent_surfaces_are_silent_sorted_and_weighted() {
    on_gpu_in_both_modes(|gpu| {
        let alone = Scene { name: "nothing".into(), ..plane(lambert(0.5), Vec::new()) };
        for scene in [one_of_each(), nothing_emits(), alone].map(with_transparent) {
            for (_, transparency) in Transparency::NAMES {
                for hdr_output in [false, true] {
                    for name in ["lean", "float32"] {
                        let settings = Settings { transparency: *transparency, hdr_output, ..small(&scene) };
                        exercise(gpu, &scene, &Settings { gbuffer: gbuffer(name), ..settings });
                    }
                }
            }
        }
    });
}

#[test]
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
        for builtin in CATALOGUE {
            // Fewer objects than by default: what is drawn more often is recorded the same way.
            let query = if builtin.name == "field" { "?objects=40&lights=20" } else { "" };
            let scene = open(&format!("builtin:{}{query}", builtin.name));
            for hdr_output in [false, true] {
                exercise(gpu, &scene, &Settings { hdr_output, ..small(&scene) });
            }
        }
    });
}

#[test]
fn every_view_is_silent_or_says_why_there_is_none() {
    on_gpu_in_both_modes(|gpu| {
        for scene in [one_of_each(), open("builtin:cornell"), open("builtin:spheres?rows=1&columns=2")] {
            let shadowed = scene.lights.iter().any(|light| light.casts_shadow);
            for (name, view) in View::NAMES {
                // What it shows is how samples differ.
                let msaa = if *view == View::Complexity { 4 } else { 1 };
                let settings = Settings { view: *view, msaa, ..small(&scene) };
                match Renderer::new(&gpu.device, &scene, &settings) {
                    Ok(mut renderer) => {
                        let drawn = draw_frames(&mut renderer, &scene.camera);
                        drawn.unwrap_or_else(|error| panic!("{} {name}: {error}", scene.name));
                    }
                    Err(Error::Plan(plan::Error::NoShadowMap(_))) if *view == View::ShadowMap && !shadowed => {}
                    Err(error) => panic!("{} {name}: {error}", scene.name),
                }
            }
        }
    });
}

/// Every preset, and every format that a target can be given instead of that of `lean`.
fn every_gbuffer() -> Vec<String> {
    let presets = GbufferPreset::NAMES.iter().map(|(name, _)| (*name).to_owned());
    let overrides = TARGETS.iter().flat_map(|(target, formats)| formats.iter().map(move |f| format!("{target}={f}")));
    presets.chain(overrides).collect()
}

#[test]
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
        // More lights than a uniform buffer holds, of limited reach.
        let lamp = |index| point(DVec3::new(index as f64 * 1e-3, 0.0, 1.0), 0.01, Some(2.0), Falloff::InverseSquare);
        let mut crowd = one_of_each();
        crowd.lights.extend((0..300).map(lamp));
        for (_, light_path) in LightPath::NAMES {
            for scene in [&one_of_each(), &nothing_emits(), &crowd] {
                for hdr_output in [false, true] {
                    exercise(gpu, scene, &Settings { light_path: *light_path, hdr_output, ..small(scene) });
                }
            }
        }
        let scene = nothing_emits();
        for light_path in [LightPath::PerLight, LightPath::Volumes, LightPath::Clustered, LightPath::Compute] {
            for name in ["float32", "fat", "normal=oct16-uint"] {
                exercise(gpu, &scene, &Settings { light_path, gbuffer: gbuffer(name), ..small(&scene) });
            }
            exercise(gpu, &scene, &Settings { light_path, light_cutoff: true, ..small(&scene) });
            exercise(gpu, &scene, &Settings { light_path, depth_prepass: Some(true), ..small(&scene) });
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
                Ok(mut renderer) => draw_frames(&mut renderer, &scene.camera).unwrap_or_else(|error| panic!("{error}")),
                Err(Error::Plan(plan::Error::HdrFormat(refused))) => assert_eq!(refused, *hdr_format),
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
                exercise(gpu, &scene, &Settings { gbuffer: gbuffer(name), hdr_output: true, ..small(&scene) });
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
            for hdr_output in [false, true] {
                exercise(gpu, &scene, &Settings { hdr_output, ..small(&scene) });
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
        draw_frames(&mut second, &scene.camera).unwrap_or_else(|error| panic!("{error}"));
    });
}
