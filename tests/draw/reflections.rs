//! Reflections in frames: a mirror's image of blocks, known in closed form, is the same on every path and finite at the extremes, and there is none
//! where reflections are off.

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::stage::{add, exact, lambert, own, plane, point, rectangle, stage};
use afterlight::plan::FramePlan;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    Brdf, Camera, Falloff, HdrFormat, LightPath, Material, Output, Projection, Reflections, Scene, Settings,
    Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [96, 54];

fn shown(gpu: &Gpu, scene: &Scene, settings: &Settings, view: View) -> Vec<DVec3> {
    let settings = Settings { view, output: Output::Nits, ..settings.clone() };
    let picture = gpu.renderer(scene, &settings).picture(&scene.camera, || ()).expect("a picture");
    floats(&picture)
        .chunks_exact(4)
        .map(|texel| DVec3::new(texel[0].into(), texel[1].into(), texel[2].into()))
        .collect()
}

fn on(settings: &Settings) -> Settings {
    Settings { reflections: Reflections::Screen, ..settings.clone() }
}

fn metal(roughness: f32) -> Material {
    Material { base_color: Vec3::splat(0.8), metallic: 1.0, roughness, ..Material::default() }
}

fn glowing(color: Vec3) -> Material {
    Material { emissive: color, base_color: Vec3::ZERO, brdf: Brdf::Lambert, two_sided: true, ..Material::default() }
}

/// The walls of [`mirror`] from left to right: their edges, and the light that they emit.
const WALLS: [([f64; 2], Vec3); 3] = [
    ([-1.6, -0.6], Vec3::new(3.0, 0.0, 0.0)),
    ([-0.4, 0.4], Vec3::new(0.0, 2.0, 0.0)),
    ([0.6, 1.6], Vec3::new(0.0, 0.5, 4.0)),
];
/// The walls' distance behind the origin, and their height.
const BEHIND: f64 = 1.0;
const HEIGHT: f64 = 0.6;

/// A floor at y = 0 that mirrors three glowing walls; nothing else gives light.
fn mirror(roughness: f32) -> Scene {
    let mut scene = stage();
    let lying = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), metal(roughness), lying);
    for ([left, right], color) in WALLS {
        add(&mut scene, rectangle([left, 0.0], [right, HEIGHT], -BEHIND), glowing(color), DAffine3::IDENTITY);
    }
    scene.camera = Camera::looking_at(DVec3::new(0.2, 0.8, 2.0), DVec3::new(0.0, 0.1, -0.4), DVec3::Y);
    scene
}

/// The floor's place at the middle of a pixel, if it is seen before the walls.
fn on_floor(camera: &Camera, [x, y]: [u32; 2], size: [u32; 2]) -> Option<DVec3> {
    let [width, height] = size.map(f64::from);
    let half = camera.half_height();
    let across = ((f64::from(x) + 0.5) * 2.0 / width - 1.0) * half * width / height;
    let up = (1.0 - (f64::from(y) + 0.5) * 2.0 / height) * half;
    let ray = camera.forward() + camera.right() * across + camera.up() * up;
    let place = camera.position - ray * (camera.position.y / ray.y);
    (ray.y < 0.0 && place.z > -BEHIND && place.abs().max_element() < 4.0).then_some(place)
}

/// Returns the light of the wall that a place of the floor mirrors, by mirroring at the plane y = 0; none within a margin of an edge.
fn expected(camera: &Camera, place: DVec3, margin: f64) -> Option<DVec3> {
    let view = (camera.position - place).normalize();
    let out = DVec3::new(-view.x, view.y, -view.z);
    let far = (-BEHIND - place.z) / out.z;
    let met = place + out * far;
    // A ray begins beyond its own pixel: where floor and wall share one there is nothing to find.
    let sides = |[left, right]: [f64; 2]| [met.x - left, right - met.x, HEIGHT - met.y, met.y];
    let inside = |edges, margin: f64| sides(edges).iter().all(|own| *own > margin);
    let near = WALLS.iter().any(|(edges, _)| inside(*edges, -margin) && !inside(*edges, margin));
    if out.z >= 0.0 || near {
        return None;
    }
    let own = WALLS.iter().find(|(edges, _)| inside(*edges, margin));
    let fresnel = 0.8 + 0.2 * (1.0 - view.y).powi(5);
    Some(own.map_or(DVec3::ZERO, |(_, color)| color.as_dvec3() * fresnel))
}

#[test]
fn a_mirror_shows_blocks_where_plane_geometry_says() {
    on_gpu(|gpu| {
        let mut orthographic = mirror(0.0);
        orthographic.camera.projection = Projection::Orthographic { height: 2.6 };
        for (name, scene) in [("perspective", mirror(0.0)), ("orthographic", orthographic)] {
            let size = [192, 108];
            let settings =
                Settings { reflection_steps: 256, reflection_thickness: 0.01, ..on(&exact(size[0], size[1])) };
            let found = shown(gpu, &scene, &settings, View::Final);
            let (mut lit, mut dark, mut wrong) = (0, 0, 0);
            for (index, found) in found.iter().enumerate() {
                let pixel = [index as u32 % size[0], index as u32 / size[0]];
                // Within a sixteenth of the picture's edges, reflections have faded out or come from there.
                let is_inner = pixel.iter().zip(size).all(|(at, edge)| (edge / 16..edge - edge / 16).contains(at));
                let expected = match name {
                    "perspective" => {
                        on_floor(&scene.camera, pixel, size).and_then(|own| expected(&scene.camera, own, 0.07))
                    }
                    _ => on_flat_floor(&scene.camera, pixel, size),
                };
                let Some(expected) = expected.filter(|_| is_inner) else { continue };
                let error = (*found - expected).abs().max_element();
                if error > 0.02 * expected.max_element() + 1e-6 {
                    wrong += 1;
                    println!("{name} {pixel:?}: {found} in the place of {expected}");
                }
                if expected == DVec3::ZERO { dark += 1 } else { lit += 1 }
            }
            println!("{name}: {lit} lit, {dark} dark, {wrong} wrong");
            assert!(lit > 300 && dark > 300 && wrong == 0, "{name}: {lit} {dark} {wrong}");
        }
    });
}

/// Returns the mirrored light at a pixel under parallel rays, which all leave the floor in one direction.
fn on_flat_floor(camera: &Camera, [x, y]: [u32; 2], size: [u32; 2]) -> Option<DVec3> {
    let [width, height] = size.map(f64::from);
    let half = camera.half_height();
    let across = ((f64::from(x) + 0.5) * 2.0 / width - 1.0) * half * width / height;
    let up = (1.0 - (f64::from(y) + 0.5) * 2.0 / height) * half;
    let start = camera.position + camera.right() * across + camera.up() * up;
    let place = start - camera.forward() * (start.y / camera.forward().y);
    let seen = place.z > -BEHIND && place.abs().max_element() < 4.0;
    let eye = Camera { position: place - camera.forward() * 5.0, ..*camera };
    seen.then(|| expected(&eye, place, 0.07)).flatten()
}

#[test]
fn a_lobe_mirrors_as_much_light_as_a_mirror_does_in_the_mean_and_rougher_surfaces_than_asked_for_none() {
    on_gpu(|gpu| {
        let light = |roughness: f32| {
            let settings = on(&exact(SIZE[0], SIZE[1]));
            let scene = mirror(roughness);
            let found = shown(gpu, &scene, &settings, View::Final);
            let floor = |index: usize| {
                on_floor(&scene.camera, [index as u32 % SIZE[0], index as u32 / SIZE[0]], SIZE).is_some()
            };
            let all: Vec<f64> =
                found.iter().enumerate().filter(|(index, _)| floor(*index)).map(|(_, own)| own.element_sum()).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        let [sharp, soft, softer, rough] = [0.0, 0.1, 0.3, 0.7].map(light);
        println!("{sharp} {soft} {softer} {rough}");
        assert!(sharp > 0.0 && (soft / sharp - 1.0).abs() < 0.2 && (softer / sharp - 1.0).abs() < 0.3);
        assert_eq!(rough, 0.0);
    });
}

/// Boxes, a lamp and ambient light over a floor that mirrors them.
fn room(transparent: bool) -> Scene {
    let mut scene =
        plane(metal(0.2), vec![point(DVec3::new(0.2, -0.5, 1.0), 2.0, Some(4.0), Falloff::InverseSquare); 3]);
    scene.environment.ambient = Vec3::splat(0.2);
    for (place, edge) in [(DVec3::new(-0.4, 0.1, 0.2), 0.4), (DVec3::new(0.3, -0.2, 0.1), 0.2)] {
        add(&mut scene, shapes::cuboid([edge; 3]), lambert(0.5), DAffine3::from_translation(place));
    }
    add(&mut scene, rectangle([-0.2, 0.2], [0.2, 0.6], 0.3), glowing(Vec3::new(2.0, 1.0, 0.5)), DAffine3::IDENTITY);
    if transparent {
        let glass = Material { alpha: 0.3, alpha_mode: afterlight::scene::AlphaMode::Blend, ..lambert(0.5) };
        add(&mut scene, rectangle([-0.6, -0.6], [0.6, 0.2], 0.6), glass, DAffine3::IDENTITY);
    }
    scene.camera = Camera::looking_at(DVec3::new(0.3, -1.6, 0.9), DVec3::ZERO, DVec3::Z);
    scene
}

#[test]
fn all_paths_add_the_same_below_what_is_transparent_and_before_light_is_spread() {
    on_gpu(|gpu| {
        let scene = room(false);
        let settings = Settings { light_path: LightPath::Loop, ..exact(SIZE[0], SIZE[1]) };
        let plain = shown(gpu, &scene, &settings, View::Final);
        let first = shown(gpu, &scene, &on(&settings), View::Final);
        let brighter = plain.iter().zip(&first).filter(|(one, other)| (**other - **one).max_element() > 0.02).count();
        assert!(brighter > plain.len() / 50, "{brighter}");
        for light_path in [LightPath::PerLight, LightPath::Volumes, LightPath::Clustered] {
            let found = shown(gpu, &scene, &Settings { light_path, ..on(&settings) }, View::Final);
            let off =
                found.iter().zip(&first).map(|(own, first)| (*own - *first).abs().max_element()).fold(0.0, f64::max);
            assert!(off < 1e-3, "{light_path}: {off}");
        }
        // With everything that works on the light after it: pictures, not values, in every order of passes.
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            let glass = room(true);
            for bloom in [0.0, 0.2] {
                let own = Settings { transparency, bloom, fxaa: true, vignette: 0.3, ..settings.clone() };
                let display = Settings { output: Output::Srgb8, ..own };
                let [with, without] = [on(&display), display].map(|own| gpu.draw(&glass, &own));
                assert_ne!(with, without);
            }
        }
    });
}

#[test]
fn whatever_is_asked_for_pictures_are_finite() {
    on_gpu(|gpu| {
        let grazing = |mut scene: Scene, height: f64| {
            scene.camera =
                Camera::looking_at(DVec3::new(0.3, -1.6, height), DVec3::new(0.0, 1.0, height * 0.5), DVec3::Z);
            scene
        };
        let mut bright = room(true);
        bright.lights.iter_mut().for_each(|light| light.intensity = 1e9);
        let mut empty = stage();
        empty.environment.background = Vec3::ONE;
        let inside = {
            let mut own = room(false);
            own.camera.position = DVec3::new(-0.4, 0.1, 0.2);
            own
        };
        let facing = {
            let mut own = room(false);
            own.camera = Camera::looking_at(DVec3::Z * 2.0, DVec3::ZERO, DVec3::Y);
            own
        };
        let scenes = [
            grazing(room(false), 1e-3),
            grazing(room(true), 1e-9),
            bright,
            empty,
            inside,
            facing,
            mirror(0.0),
            mirror(1.0),
        ];
        for (index, scene) in scenes.iter().enumerate() {
            for (size, reflection_thickness, reflection_steps, reflection_roughness, preset) in [
                ([1, 1], 0.0, 1, 0.0, "lean"),
                ([3, 5], 1000.0, 1024, 1.0, "fat"),
                ([33, 17], 0.2, 64, 1.0, "lean,normal=oct16-uint"),
                ([97, 61], 1000.0, 256, 0.6, "float32"),
            ] {
                let gbuffer = crate::common::stage::gbuffer(preset);
                let base = own(scene, size[0], size[1]);
                let settings =
                    on(&Settings { reflection_thickness, reflection_steps, reflection_roughness, gbuffer, ..base });
                for view in [View::Final, View::Reflections] {
                    let found = shown(gpu, scene, &settings, view);
                    assert!(
                        found.iter().all(|own| own.is_finite() && own.min_element() >= 0.0),
                        "{index} {size:?} {view:?}"
                    );
                }
            }
        }
    });
}

#[test]
fn off_there_is_no_pass_and_no_difference_and_what_they_cannot_go_with_is_refused() {
    on_gpu(|gpu| {
        let scene = room(false);
        let plain = Settings { light_path: LightPath::Loop, ..own(&scene, SIZE[0], SIZE[1]) };
        let passes = |settings: &Settings| {
            let mut renderer = gpu.renderer(&scene, settings);
            renderer.render(&scene.camera).expect("a frame");
            renderer.recorded_passes().to_vec()
        };
        let reflects = |settings: &Settings| passes(settings).iter().any(|pass| pass.starts_with("reflect"));
        let numbers =
            Settings { reflection_steps: 7, reflection_thickness: 3.0, reflection_roughness: 1.0, ..plain.clone() };
        assert!(!reflects(&plain) && !reflects(&numbers) && reflects(&on(&plain)));
        assert_eq!(gpu.draw(&scene, &plain), gpu.draw(&scene, &numbers));
        let device = afterlight::frame::capabilities(&gpu.device.physical);
        let plan = |scene: &Scene, settings: &Settings| FramePlan::of(scene, settings, &device);
        // Nor where nothing mirrors.
        let matt = plan(&plane(lambert(0.5), Vec::new()), &on(&plain)).expect("a plan");
        assert!(!matt.reflects() && matt.reasons.lack_of("reflections").contains("no opaque surface"));
        let asked = on(&plain);
        // Nor where the picture shows vectors.
        let vectors = plan(&scene, &Settings { view: View::Velocity, ..asked.clone() }).expect("a plan");
        assert!(!vectors.reflects() && vectors.effects.taa.is_some());
        for (settings, why) in [
            (Settings { light_path: LightPath::Forward, ..asked.clone() }, "the light path forward has none"),
            (Settings { light_path: LightPath::Compute, ..asked.clone() }, "--light-path compute"),
            (Settings { msaa: 4, ..asked.clone() }, "--msaa 4"),
            (Settings { hdr_format: HdrFormat::B10g11r11, ..asked.clone() }, "b10g11r11"),
            (Settings { reflection_roughness: f32::NAN, ..asked.clone() }, "reflection roughness is NaN"),
            (Settings { reflection_roughness: 1.5, ..asked.clone() }, "reflection roughness is 1.5"),
            (Settings { reflection_steps: 0, ..asked.clone() }, "reflection ray steps is 0"),
            (Settings { reflection_steps: u32::MAX, ..asked.clone() }, "must be a whole number from 1 to 1024"),
            (Settings { reflection_thickness: f32::INFINITY, ..asked.clone() }, "reflection thickness is inf"),
            (Settings { reflection_thickness: -1.0, ..asked.clone() }, "reflection thickness is -1"),
        ] {
            let text = plan(&scene, &settings).expect_err(why).to_string();
            let is_named = text.starts_with("reflections: ") || text.contains("cannot draw reflections: ");
            assert!(is_named && text.contains(why), "{text}");
        }
        // A plain scene that `auto` would light as it draws it gets a G-buffer.
        let bare = plane(metal(0.1), Vec::new());
        let auto = Settings { light_path: LightPath::Auto, ..plain };
        assert!(plan(&bare, &auto).expect("a plan").is_forward());
        assert!(plan(&bare, &on(&auto)).expect("a plan").reflects());
    });
}
