//! Light through surfaces (KHR_materials_diffuse_transmission) on the device against the truth in 64 bits.

use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::stage::{add, directional, lambert, plane, point, rectangle, sun};
use crate::materials::{assert_near, nits_of};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, ColorSpace, DiffuseTransmission, Environment, Falloff, Light, LightPath, Material, Sampler, Scene,
    Settings, Sheen, Sky, SkyImage, Texture, ThinFilm,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

const PATHS: [LightPath; 4] = [LightPath::Forward, LightPath::Loop, LightPath::Clustered, LightPath::PerLight];

fn paper(strength: f32) -> Material {
    Material {
        base_color: Vec3::new(0.7, 0.5, 0.3),
        roughness: 0.4,
        diffuse_transmission: DiffuseTransmission { strength, color: Vec3::new(0.9, 0.6, 0.2) },
        ..Material::default()
    }
}

/// A ball and a leaning sheet of a material, and lights on all sides.
fn lanterns(material: Material) -> Scene {
    let lamp = |place: DVec3| point(place, 4.0, Some(5.0), Falloff::InverseSquare);
    let lights = vec![
        directional(DVec3::new(0.6, 0.4, 0.7), 2.0),
        directional(DVec3::new(-0.5, 0.3, -0.6), 3.0),
        lamp(DVec3::new(-1.0, 0.8, 1.5)),
        lamp(DVec3::new(0.4, -0.6, -1.2)),
    ];
    let mut scene = plane(lambert(0.4), lights);
    scene.objects[0].transform = DAffine3::from_translation(DVec3::Z * -2.0);
    add(&mut scene, shapes::sphere(0.45, 64), material.clone(), DAffine3::from_translation(DVec3::new(-0.5, 0.0, 0.2)));
    let turn = DAffine3::from_translation(DVec3::new(0.55, 0.0, 0.1)) * DAffine3::from_rotation_y(0.6);
    add(&mut scene, rectangle([-0.35, -0.5], [0.35, 0.5], 0.0), material, turn);
    scene.textures.push(motley());
    scene.environment =
        Environment { ambient: Vec3::new(0.2, 0.3, 0.4), ground: Some(Vec3::splat(0.1)), ..Environment::default() };
    scene
}

fn motley() -> Texture {
    let texels = (0..16u32).flat_map(|i| [i * 16, 255 - i * 13, i * 97 % 256, 40 + i * 13].map(|code| code as u8));
    Texture {
        name: "motley".into(),
        size: [4, 4],
        color_space: ColorSpace::Srgb,
        sampler: Sampler::DEFAULT,
        texels: texels.collect(),
    }
}

#[test]
fn light_through_a_surface_is_that_of_the_truth_on_every_path_that_draws_it() {
    on_gpu(|gpu| {
        let film = ThinFilm { strength: 1.0, ior: 1.6, nanometres: [450.0; 2] };
        let sheen = Sheen { color: Vec3::new(0.8, 0.5, 0.6), roughness: 0.5 };
        let cases = [
            ("half", paper(0.5)),
            ("all", paper(1.0)),
            ("half a metal", Material { metallic: 0.5, ..paper(0.7) }),
            ("textured", Material { diffuse_transmission_texture: Some(0), ..paper(1.0) }),
            ("under a film", Material { film, ..paper(0.6) }),
            ("under a sheen", Material { sheen, ..paper(0.6) }),
            ("a pane", Material { alpha_mode: AlphaMode::Glass, alpha: 0.5, ..paper(0.8) }),
        ];
        for (name, material) in cases {
            let scene = lanterns(material.clone());
            let bound = if material.diffuse_transmission_texture.is_some() { [2e-4, 6e-3] } else { [1e-4, 3e-3] };
            for path in PATHS {
                let what = format!("{name}, {path}");
                assert_near(gpu, &scene, &nits_of(path), bound, 0.94, &what);
                // It is seen: without it the picture is another.
                let mut bare = scene.clone();
                bare.materials.iter_mut().for_each(|own| own.diffuse_transmission = DiffuseTransmission::NONE);
                let [with, without] = [&scene, &bare].map(|scene| gpu.draw(scene, &nits_of(path)));
                let moved = places(&with).filter(|&(x, y)| nits(&with, x, y) != nits(&without, x, y)).count();
                assert!(moved > 500, "{what}: {moved} pixels");
            }
        }
    });
}

/// The mean distance of a picture from the truth with as many rays a pixel, relative to the truth's mean.
fn error(gpu: &Gpu, scene: &Scene, settings: &Settings) -> f64 {
    let picture = gpu.expose(scene, settings, 0.0);
    let view = CameraView { camera: scene.camera, size: picture.size };
    let options = TruthOptions { mode: Mode::Converged { samples: 64 }, smith: Smith::default() };
    let truth = Reference::new(scene).expect("a scene").render(&view, &options, &|_, _| {});
    let pixels: Vec<(DVec3, DVec3)> = places(&picture)
        .map(|(x, y)| (nits(&picture, x, y), DVec3::from_array(truth.radiance[(y * picture.size[0] + x) as usize])))
        .collect();
    let mean: f64 = pixels.iter().map(|(_, truth)| truth.element_sum()).sum();
    pixels.iter().map(|(own, truth)| (*own - *truth).abs().element_sum()).sum::<f64>() / mean
}

/// A sheet that faces the eye under a sky that is bright behind it, with a block behind that hides a part of the sky.
fn under_sky(strength: f32, blocked: bool) -> Scene {
    let image = SkyImage::of("bright behind", 64, |way| DVec3::splat(if way.z < 0.0 { 4.0 } else { 0.5 }));
    let mut scene = plane(paper(strength), vec![]);
    let sky = Sky { nits: 1.0, rotation_degrees: 0.0, image: image.into(), shown: true, lights: true, sun: None };
    scene.sky = Some(sky);
    if blocked {
        let behind = DAffine3::from_translation(DVec3::new(0.4, 0.0, -0.5));
        add(&mut scene, shapes::cuboid([0.8, 3.0, 0.1]), lambert(0.0), behind);
    }
    scene
}

#[test]
fn light_of_the_sky_comes_through_with_its_shadow_as_in_the_truth() {
    on_gpu(|gpu| {
        let settings = Settings { samples: 16, size: [33, 33], ..nits_of(LightPath::Clustered) };
        for strength in [0.5, 1.0] {
            for blocked in [false, true] {
                let scene = under_sky(strength, blocked);
                let own = error(gpu, &scene, &settings);
                println!("{strength}, blocked {blocked}: {own:.4}");
                // The share that arrives is found from 16 times 16 directions, so that it errs by 1/32 where half of them are blocked.
                assert!(own < 0.05, "{strength}, blocked {blocked}: {own}");
            }
            // The block is seen: without its shadow the sheet is brighter by far more than that.
            let unshadowed = Settings { sky_shadows: Some(0), ..settings.clone() };
            let own = error(gpu, &under_sky(strength, true), &unshadowed);
            assert!(own > 0.1, "without shadows {own}");
        }
    });
}

#[test]
fn a_shadow_on_the_back_is_where_rays_find_it() {
    on_gpu(|gpu| {
        let mut scene = plane(paper(0.8), vec![sun(DVec3::new(0.4, 0.3, -1.0), 5.0)]);
        scene.lights.push(Light {
            casts_shadow: true,
            ..point(DVec3::new(-0.5, -0.4, -1.5), 6.0, None, Falloff::InverseSquare)
        });
        for (place, radius) in [(DVec3::new(-0.3, 0.2, -0.6), 0.25), (DVec3::new(0.4, -0.3, -0.4), 0.15)] {
            add(&mut scene, shapes::sphere(radius, 48), lambert(0.5), DAffine3::from_translation(place));
        }
        for path in PATHS {
            // Pixels along the edges of shadows are among the others.
            assert_near(gpu, &scene, &nits_of(path), [1e-4, 3e-3], 0.9, &format!("shadows behind, {path}"));
        }
    });
}
