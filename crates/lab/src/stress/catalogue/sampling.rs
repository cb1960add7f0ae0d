//! Details between pixels: textures, masks and highlights that are smaller than a pixel, meshes that do not quite meet, and numbers that
//! are smaller than drivers keep.

use glam::{DAffine3, DVec2, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor, texture, waves};
use afterlight::scene::builtin::shapes::{self, MeshBuilder};
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{AlphaMode, Brdf, Camera, Environment, Material, SettingsPatch, TextureSlot, UvMap};

pub const CASES: &[Case] = &[
    case("sampling/color", "a floor whose texture repeats so often in a metre: its light in the mean")
        .over(SweepValues::Decades(-1, 4), "")
        // On lavapipe 1% where no level but the first is looked at, which is a code of 8 bits, and 3% where the smallest are.
        .claim([0.1, 1e4], Bound { worst: 0.06, mean: 0.06 })
        .check(Check::Whole(color)),
    case(
        "sampling/uv-scale",
        "a floor whose UV map scales its coordinates, which are metres, so: its light in the mean",
    )
    .over(SweepValues::Decades(-6, 6), "")
    .claim([1e-6, 1e6], Bound { worst: 0.06, mean: 0.06 })
    .check(Check::Whole(|scale| mapped(UvMap { scale: DVec2::new(scale, -scale), rotation: 0.3, ..UvMap::IDENTITY }))),
    case("sampling/uv-offset", "a floor whose UV map moves its texture by so many images: its light in the mean")
        .over(SweepValues::Decades(-6, 12), "")
        .claim([1e-6, 1e12], Bound { worst: 0.06, mean: 0.06 })
        .check(Check::Whole(|images| mapped(UvMap { offset: DVec2::new(images, 0.5 - images), ..UvMap::IDENTITY }))),
    case(
        "sampling/mask",
        "a grille whose holes repeat so often in a metre: the light of it and of what is seen through it in the mean",
    )
    .over(SweepValues::Decades(-1, 4), "")
    // The mean of a level's alpha, above or below the cut-off, decides about a whole hole: all of it is left, or nothing.
    .claim([0.1, 1.0], Bound { worst: 0.25, mean: 0.25 })
    .check(Check::Whole(mask)),
    case("sampling/bumps", "a shiny floor whose normal map repeats so often in a metre: its light in the mean")
        .over(SweepValues::Decades(-1, 4), "")
        // Levels of a normal map are flat, and a flat floor has its highlight elsewhere: 0.6 of the light from ten repeats on.
        .claim([0.1, 1.0], Bound { worst: 0.3, mean: 0.3 })
        .check(Check::Whole(bumps)),
    case("sampling/highlights", "shiny balls in a picture of so many rows: their light in the mean")
        .over(SweepValues::List(&[2.0, 4.0, 8.0, 16.0, 32.0, 64.0]), "px")
        .claim([32.0, 64.0], Bound { worst: 0.1, mean: 0.1 })
        .check(Check::Whole(highlights)),
    case("sampling/t-junction", "the floor's near half in so many pieces, its far half in one")
        .over(SweepValues::List(&[1.0, 3.0, 7.0, 31.0, 127.0, 1021.0]), "")
        .claim([1.0, 1021.0], Bound { worst: 1e-3, mean: 2e-6 })
        .check(Check::Placed(t_junction, 0.03)),
    case("sampling/triangles", "a sphere of so many meridians: triangles of a pixel and less")
        .over(SweepValues::List(&[4.0, 16.0, 64.0, 256.0, 512.0]), "")
        .claim([4.0, 512.0], Bound { worst: 1e-3, mean: 1e-6 })
        .check(Check::Placed(triangles, 0.2)),
    case("sampling/shading-normal", "normals so far from those of their triangles")
        .over(SweepValues::List(&[0.0, 30.0, 60.0, 80.0, 89.0, 90.0, 91.0, 120.0, 150.0, 180.0]), "degrees")
        .claim([0.0, 180.0], Bound { worst: 1e-3, mean: 1e-5 })
        .check(Check::Placed(shading_normal, 0.005)),
    case(
        "sampling/denormal",
        "albedo and places along an axis so small that drivers may take them for 0, under as much \
         light as there may be",
    )
    .over(SweepValues::List(&[1e-45, 1e-42, 1e-40, 1e-38, 1e-37, 1e-30, 1e-20, 1e-10, 1.0]), "")
    // Products with cosines and 1 / pi must be normal numbers, too.
    .claim([1e-30, 1.0], Bound { worst: 1e-3, mean: 1e-6 })
    .check(Check::Placed(denormal, 0.005)),
];

/// A floor under a sun whose texture coordinates are metres times `repeats`, seen from a man's height.
fn floor(repeats: f64, material: impl FnOnce(&mut SceneBuilder) -> Material) -> Subject {
    let mut stage = SceneBuilder::default();
    let material = material(&mut stage);
    let material = stage.material(material);
    let mut mesh = MeshBuilder::new();
    let corners = [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)];
    let uvs = corners.map(|(x, z)| DVec2::new(x, z) * repeats);
    mesh.quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), uvs);
    stage.add("floor", mesh, material);
    stage.sun(DVec3::new(0.2, -1.0, -0.6), 1000.0, Vec3::ONE, false);
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 1.7, 3.0), DVec3::new(0.0, 0.0, 0.5), DVec3::Y);
    // Each driver has its own way of anisotropy, and lavapipe's takes minutes where ten thousand repeats lie in a metre.
    let settings = SettingsPatch { anisotropy: Some(1), ..float32() };
    Subject::with(stage.scene, settings)
}

fn color(repeats: f64) -> Subject {
    floor(repeats, |stage| Material { base_color_texture: stage.texture(waves()), ..Material::default() })
}

fn mapped(map: UvMap) -> Subject {
    floor(1.0, |stage| {
        let mut material = Material { base_color_texture: stage.texture(waves()), ..Material::default() };
        material.uv_maps[TextureSlot::BaseColor as usize] = map;
        material
    })
}

fn mask(repeats: f64) -> Subject {
    const EDGE: u32 = 64;
    let mut subject = floor(repeats, |stage| {
        // Round holes, which are about half of it.
        let texel = |index: u32| {
            let at = DVec2::new(f64::from(index % EDGE), f64::from(index / EDGE)) + 0.5 - f64::from(EDGE) * 0.5;
            [255, 200, 100, if at.length() < 25.5 { 0 } else { 255 }]
        };
        let (grille, alpha_mode) = (texture("grille", EDGE, texel), AlphaMode::Mask { cutoff: 0.5 });
        Material { base_color_texture: stage.texture(grille), alpha_mode, ..Material::default() }
    });
    subject.scene.environment = Environment { background: Vec3::new(20.0, 60.0, 90.0), ..Environment::default() };
    subject
}

fn bumps(repeats: f64) -> Subject {
    const EDGE: u32 = 64;
    floor(repeats, |stage| {
        let slope = |at: u32| 0.35 * (f64::from(at) / f64::from(EDGE) * std::f64::consts::TAU).sin();
        let texel = |index: u32| {
            let normal = DVec3::new(slope(index % EDGE), slope(index / EDGE), 1.0).normalize() * 127.0 + 128.0;
            [normal.x.round() as u8, normal.y.round() as u8, normal.z.round() as u8, 255]
        };
        let map = stage.texture(texture("bumps", EDGE, texel));
        Material { normal_texture: map, roughness: 0.3, metallic: 1.0, ..Material::default() }
    })
}

fn highlights(rows: f64) -> Subject {
    let mut stage = SceneBuilder::default();
    let shiny = stage.material(Material { roughness: 0.3, base_color: Vec3::splat(0.3), ..Material::default() });
    let ball = stage.mesh("ball", shapes::sphere(0.15, 32), shiny);
    for index in 0..64 {
        let place = DVec3::new(f64::from(index % 8) - 3.5, f64::from(index / 8) - 3.5, 0.0) * 0.4;
        stage.place(ball, shiny, DAffine3::from_translation(place));
    }
    stage.sun(DVec3::new(-0.4, -0.7, -1.0), 1000.0, Vec3::ONE, false);
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y);
    let size = Some([rows as u32; 2]);
    Subject::with(stage.scene, SettingsPatch { size, ..float32() })
}

fn t_junction(pieces: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let pieces = pieces as usize;
    let mut mesh = MeshBuilder::new();
    let mut quad = |from: DVec2, to: DVec2| {
        let corners = [(from.x, to.y), (to.x, to.y), (to.x, from.y), (from.x, from.y)];
        mesh.quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), shapes::WHOLE_IMAGE);
    };
    quad(DVec2::new(-4.0, -4.0), DVec2::new(4.0, 0.7));
    for piece in 0..pieces {
        let x = |piece: usize| piece as f64 / pieces as f64 * 8.0 - 4.0;
        quad(DVec2::new(x(piece), 0.7), DVec2::new(x(piece + 1), 4.0));
    }
    stage.scene.meshes[0] = mesh.finish("floor");
    // So that no edge runs along a row of pixels.
    stage.scene.objects[0].transform = DAffine3::from_rotation_y(0.2);
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    Subject::with(stage.scene, float32())
}

fn triangles(meridians: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let material = stage.scene.objects[1].material;
    stage.scene.objects.truncate(1);
    let sphere = stage.mesh("fine", shapes::sphere(0.5, meridians as usize), material);
    stage.place(sphere, material, DAffine3::from_translation(DVec3::new(0.0, 0.5, 0.0)));
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    Subject::with(stage.scene, float32())
}

/// About the axis that runs to the right, so that normals lean away from the eye, and then into the floor.
fn shading_normal(degrees: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let turned = glam::DQuat::from_rotation_x(-degrees.to_radians());
    for mesh in &mut stage.scene.meshes {
        for normal in &mut mesh.normals {
            *normal = (turned * Vec3::from(*normal).as_dvec3()).as_vec3().to_array();
        }
    }
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    stage.light(lamp(DVec3::new(-1.0, 1.5, -3.0), 1000.0));
    Subject::with(stage.scene, float32())
}

fn denormal(least: f64) -> Subject {
    let mut stage = sphere_on_floor();
    for material in &mut stage.scene.materials {
        material.base_color = Vec3::splat(least as f32);
        // Nothing but the base reflects.
        material.brdf = Brdf::Lambert;
    }
    let floor = &mut stage.scene.meshes[0];
    floor.positions.iter_mut().for_each(|position| position[1] = least as f32);
    floor.bounds = floor.compute_bounds();
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1e18));
    Subject::with(stage.scene, SettingsPatch { exposure: Some(0.0), ..float32() })
}
