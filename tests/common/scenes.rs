//! Scenes that together use each thing that a frame has code for. They are drawn for the messages of layers, not for their looks.

use afterlight::frame::{Error, Renderer};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Brdf, Camera, Channel, ChannelTarget, Clip, ColorSpace, Emitter, Environment, Falloff, Interpolation,
    LightPath, Look, Material, Output, Playing, Scene, Settings, ShadowFilter, ShadowSettings, Texture, Transparency,
    View,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::gpu::Gpu;
use super::moving::moving;
use super::stage::{add, gbuffer, lambert, open, own, plane, point, rectangle, spot, sun};

/// Pictures are small: layers look at commands and not at pixels.
const SIZE: [u32; 2] = [32, 18];

/// A small picture with the settings that the scene asks for.
pub fn small(scene: &Scene) -> Settings {
    own(scene, SIZE[0], SIZE[1])
}

/// Frames enough that each of the two in flight is recorded anew while the other is drawn, a picture read between them, and the
/// renderer dropped with frames under way.
pub fn draw_frames(renderer: &mut Renderer, scene: &Scene) -> Result<(), Error> {
    for turn in 0..6 {
        if !scene.motion.is_empty() && turn != 2 {
            renderer.pose(scene, &scene.motion.pose(&Playing::at(0.3 * f64::from(turn))))?;
        }
        // Out of sight as well: a frame that draws nothing has barriers all the same.
        let camera = &scene.camera;
        let rotation = camera.rotation * DQuat::from_rotation_y(0.7 * f64::from(turn));
        renderer.render(&Camera { rotation, ..*camera })?;
        if turn == 3 {
            renderer.read_back()?;
        }
    }
    Ok(())
}

/// Draws several frames; the layer's messages are looked at when the device is gone.
pub fn exercise(gpu: &Gpu, scene: &Scene, settings: &Settings) {
    if !gpu.takes_turn() {
        return;
    }
    let mut renderer = gpu.renderer(scene, settings);
    draw_frames(&mut renderer, scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
}

/// Every other texel is a hole.
pub fn perforated() -> Texture {
    let texel = |index: u32| [255, 128, 64, if (index + index / 4).is_multiple_of(2) { 255 } else { 0 }];
    let texels = (0..16).flat_map(texel).collect();
    Texture {
        name: "perforated".into(),
        size: [4, 4],
        color_space: ColorSpace::Srgb,
        sampler: Default::default(),
        texels,
    }
}

/// One of each thing that a frame has code for: every BRDF, emissive light, a masked two-sided sheet that casts a shadow, a
/// mirrored transform, a normal map, and a sun with a shadow beside lights of every kind and fall-off.
pub fn one_of_each() -> Scene {
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

/// Returns [`one_of_each`] without emission, so that the frame has no HDR target.
pub fn nothing_emits() -> Scene {
    let mut scene = one_of_each();
    for material in &mut scene.materials {
        (material.emissive, material.emissive_texture) = (Vec3::ZERO, None);
    }
    scene
}

/// Adds a glowing blended sheet, a mirrored glass ball and textured gauze to a scene; they overlap.
pub fn with_transparent(mut scene: Scene) -> Scene {
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

/// One of each thing under more lights than a uniform buffer holds, of limited reach.
pub fn crowd() -> Scene {
    let lamp = |index| point(DVec3::new(index as f64 * 1e-3, 0.0, 1.0), 0.01, Some(2.0), Falloff::InverseSquare);
    let mut scene = one_of_each();
    scene.name = "crowd".into();
    scene.lights.extend((0..300).map(lamp));
    scene
}

/// Draws each thing that frames have code for at least once: every light path with and without transparent surfaces, few lights and
/// many, hardware samples, FXAA, views, samples of one picture, every filter of shadows, and maps that are kept and drawn anew.
pub fn draw_everything(gpu: &Gpu) {
    let (plain, glass, many) = (nothing_emits(), with_transparent(one_of_each()), crowd());
    for &(_, light_path) in LightPath::NAMES {
        for scene in [&plain, &glass, &many] {
            // A path that ends with a compute pass blends nothing.
            let ends = matches!(light_path, LightPath::Compute | LightPath::Visibility);
            if !(ends && std::ptr::eq(scene, &glass)) && gpu.takes(light_path, scene) {
                exercise(gpu, scene, &Settings { light_path, ..small(scene) });
            }
        }
    }
    let oit = Settings { transparency: Transparency::Oit, ..small(&glass) };
    exercise(gpu, &glass, &oit);
    for output in [Output::Nits, Output::Exposed] {
        exercise(gpu, &glass, &Settings { output, ..small(&glass) });
    }
    for light_path in [LightPath::Loop, LightPath::Clustered, LightPath::Compute] {
        exercise(gpu, &plain, &Settings { light_path, depth_prepass: Some(true), ..small(&plain) });
    }
    for (light_path, scene) in [(LightPath::Loop, &plain), (LightPath::Loop, &glass), (LightPath::Forward, &glass)] {
        exercise(gpu, scene, &Settings { light_path, msaa: 4, fxaa: true, ..small(scene) });
    }
    exercise(gpu, &glass, &Settings { msaa: 4, ..oit.clone() });
    exercise(gpu, &plain, &Settings { fxaa: true, ..small(&plain) });
    exercise(gpu, &plain, &Settings { gbuffer: gbuffer("float32"), ..small(&plain) });
    let smoking = Scene { emitters: vec![Emitter { rate: 3000.0, ..Emitter::default() }], ..plain.clone() };
    for &(_, view) in View::NAMES.iter().filter(|(_, view)| gpu.shows(*view)) {
        let msaa = if view == View::Complexity { 4 } else { 1 };
        let scene = if view == View::Particles { &smoking } else { &plain };
        exercise(gpu, scene, &Settings { view, msaa, ..small(scene) });
    }
    for transparency in [Transparency::Sorted, Transparency::Oit] {
        exercise(gpu, &smoking, &Settings { transparency, taa: true, ..small(&smoking) });
    }
    for &(_, filter) in ShadowFilter::NAMES {
        let shadows = ShadowSettings { filter, cache: false, cascades: 4, size: 64, ..ShadowSettings::default() };
        exercise(gpu, &plain, &Settings { shadows, ..small(&plain) });
    }
    for samples in [1, 3] {
        let mut renderer = gpu.renderer(&glass, &Settings { samples, ..small(&glass) });
        let picture = renderer.picture(&glass.camera, || ());
        picture.unwrap_or_else(|error| panic!("{samples} samples: {error}"));
    }
    let dance = moving(DVec3::ZERO);
    for light_path in [LightPath::Loop, LightPath::Forward, LightPath::Clustered] {
        exercise(gpu, &dance, &Settings { light_path, ..small(&dance) });
    }
    let cells = sprites();
    for light_path in [LightPath::Loop, LightPath::Forward] {
        exercise(gpu, &cells, &Settings { light_path, ..small(&cells) });
    }
    for scene in [Scene::default(), plane(lambert(0.5), Vec::new()), open("builtin:hall?detail=6")] {
        exercise(gpu, &scene, &small(&scene));
    }
}

/// Eight figures on two rows of an atlas: discs, rings, bars and crosses of other sizes and colours, with nothing around them.
fn figures() -> Texture {
    const EDGE: u32 = 16;
    let texel = |index: u32| {
        let [x, y] = [index % (4 * EDGE), index / (4 * EDGE)];
        let (cell, [u, v]) = (
            y / EDGE * 4 + x / EDGE,
            [x % EDGE, y % EDGE].map(|at| (f64::from(at) + 0.5) / f64::from(EDGE) * 2.0 - 1.0),
        );
        let far = u.hypot(v);
        let size = if cell < 4 { 0.85 } else { 0.6 };
        let there = match cell % 4 {
            0 => far < size,
            1 => far < size && far > 0.45 * size,
            2 => v.abs() < 0.4 * size && u.abs() < size,
            _ => u.abs().min(v.abs()) < 0.25 * size && u.abs().max(v.abs()) < size,
        };
        let shade = |channel: u32| if cell >> channel & 1 == 1 { 230 } else { 70 + 20 * channel as u8 };
        [shade(0), shade(1), shade(2), if there { 255 } else { 0 }]
    };
    let texels = (0..4 * EDGE * 2 * EDGE).flat_map(texel).collect();
    let (size, color_space) = ([4 * EDGE, 2 * EDGE], ColorSpace::Srgb);
    Texture { name: "figures".into(), size, color_space, sampler: Default::default(), texels }
}

/// Figures of one mesh and one material that stand on a floor, some tinted, one selected, and one that a clip leads from cell to cell; before them
/// a pane of glass with another cell.
pub fn sprites() -> Scene {
    let mut scene = plane(lambert(0.6), vec![sun(DVec3::new(0.5, 0.8, 1.0), 3.0)]);
    scene.name = "sprites".into();
    scene.textures = vec![figures()];
    let figure = Material {
        atlas: [2, 4],
        base_color_texture: Some(0),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        two_sided: true,
        ..lambert(1.0)
    };
    let at = |x: f64, y: f64| DAffine3::from_translation(DVec3::new(x, y, 0.25));
    add(&mut scene, rectangle([-0.28, -0.28], [0.28, 0.28], 0.0), figure.clone(), at(0.0, 0.0));
    let first = scene.objects.pop().expect("a figure");
    for index in 0..12u32 {
        let [x, y] = [index % 4, index / 4].map(f64::from);
        let mut own = first.clone();
        own.transform = at(x * 0.62 - 0.93, 0.62 - y * 0.62);
        let tint = if index % 5 == 2 { Vec3::new(1.0, 0.5, 0.1) } else { Vec3::ONE };
        own.look = Some(Look { cell: index % 8, tint, selected: index == 6 });
        scene.objects.push(own);
    }
    let pane = Material { alpha_mode: AlphaMode::Blend, alpha: 0.6, ..figure };
    let place = DAffine3::from_translation(DVec3::new(0.55, 0.1, 0.6));
    add(&mut scene, rectangle([-0.4, -0.4], [0.4, 0.4], 0.0), pane, place);
    scene.objects[13].look = Some(Look { cell: 5, ..Look::PLAIN });
    let channel = Channel {
        target: ChannelTarget::Cell(1),
        times: vec![0.0, 0.25, 0.5, 0.75],
        values: vec![0.0, 1.0, 2.0, 3.0],
        interpolation: Interpolation::Step,
    };
    scene.motion.clips = vec![Clip { name: "turn".into(), channels: vec![channel] }];
    scene.environment = Environment { ambient: Vec3::splat(0.3), background: Vec3::splat(0.2), ground: None };
    scene
}

/// As few frames as run every shader that reads data which only the content of memory tells: lists of lights, indices, records of maps. A layer that
/// adds code to shaders makes them so large that a software driver compiles some for ten seconds and more.
pub fn draw_with_each_list(gpu: &Gpu, light_paths: &[LightPath]) {
    let lamp = |index| point(DVec3::new(index as f64 * 1e-3, 0.0, 1.0), 0.01, Some(2.0), Falloff::InverseSquare);
    let mut scene = plane(lambert(0.7), (0..300).map(lamp).collect());
    scene.lights.push(sun(DVec3::new(0.5, 0.7, 1.0), 3.0));
    for &light_path in light_paths {
        exercise(gpu, &scene, &Settings { light_path, ..small(&scene) });
    }
}
