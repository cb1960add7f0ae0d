//! N objects and N lights in the space before the camera: the load of benchmarks.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::Builtin;
use super::params::{Parameter, Params};
use super::shapes::{self, MeshBuilder};
use super::stage::{Random, SceneBuilder, hue};
use crate::{Camera, Environment, Falloff, Light, LightKind, Material, Projection, Scene};

pub(super) const FIELD: Builtin = Builtin {
    name: "field",
    about: "Objects and point lights scattered through the view before full-screen walls.",
    parameters: &[
        Parameter::integer("objects", [0, 1_000_000], 1000, "objects: spheres, boxes, rings and cones in turn"),
        Parameter::integer("lights", [0, 1_000_000], 256, "point lights"),
        Parameter::number("range", [0.0, 1e6], 4.0, "reach of a light in metres; 0: no limit"),
        Parameter::integer("overdraw", [1, 64], 1, "walls behind each other that fill the view, listed from the back"),
        Parameter::integer(
            "screens",
            [0, 64],
            0,
            "walls across half the view, left and right in turn, that hide what is behind",
        ),
        Parameter::integer("detail", [1, 64], 1, "how many times as many edges go around spheres, rings and cones"),
        Parameter::integer("materials", [1, 100_000], 8, "materials of the objects, taken at random"),
        Parameter::integer("seed", [0, u64::MAX], 1, "of the scatter"),
    ],
    build,
};

/// The slab of the view, in metres before the camera, that is filled.
const NEAREST: f64 = 6.0;
const FARTHEST: f64 = 30.0;
const FOV_Y_DEGREES: f64 = 60.0;
const ASPECT: f64 = 16.0 / 9.0;

fn build(params: &Params) -> Scene {
    let mut stage = SceneBuilder::default();
    let mut random = Random(params.integer("seed") as u64);
    walls(&mut stage, params.integer("overdraw"));
    screens(&mut stage, params.integer("screens"));
    let (count, materials) = (params.integer("objects"), params.integer("materials"));
    objects(&mut stage, &mut random, (count, materials), params.integer("detail"));
    lights(&mut stage, &mut random, params.integer("lights"), params.number("range"));
    stage.scene.environment = Environment { ambient: Vec3::splat(2.0), background: Vec3::splat(1.0), ground: None };
    stage.scene.camera = Camera {
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        projection: Projection::perspective(FOV_Y_DEGREES),
        near: 0.1,
        ..Camera::default()
    };
    stage.scene
}

/// Half the view's height at a metre before the camera.
fn slope() -> f64 {
    (FOV_Y_DEGREES * 0.5).to_radians().tan()
}

/// One mesh whose quads are listed from the back: each wall hides the walls before it in the list. No renderer sorts the triangles of a mesh, so all
/// of them are shaded.
fn walls(stage: &mut SceneBuilder, count: usize) {
    let mut walls = MeshBuilder::new();
    for index in 0..count {
        let distance = FARTHEST + 1.0 + (count - 1 - index) as f64 * 0.5;
        let height = 2.0 * slope() * distance * 1.1;
        let [x, y] = [height * ASPECT * 0.5, height * 0.5];
        let corners = [(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| DVec3::new(x, y, -distance));
        walls.quad(corners, shapes::WHOLE_IMAGE);
    }
    let material = stage.material(Material {
        name: "walls".into(),
        base_color: Vec3::splat(0.6).lerp(hue(0.0), 0.2),
        roughness: 0.8,
        ..Material::default()
    });
    stage.add("walls", walls, material);
}

/// Boxes that stand across half the view each, one behind the other through the slab.
fn screens(stage: &mut SceneBuilder, count: usize) {
    if count == 0 {
        return;
    }
    let material = stage.material(Material {
        name: "screens".into(),
        base_color: Vec3::splat(0.5).lerp(hue(0.6), 0.2),
        roughness: 0.9,
        ..Material::default()
    });
    for index in 0..count {
        let share = (index as f64 + 0.5) / count as f64;
        let distance = NEAREST + (FARTHEST - NEAREST) * share * share;
        let height = 2.0 * slope() * distance;
        let wall =
            stage.mesh(&format!("screen {index}"), shapes::cuboid([height * ASPECT * 0.48, height, 0.2]), material);
        let side = if index % 2 == 0 { -1.0 } else { 1.0 };
        let place = DVec3::new(side * height * ASPECT * 0.25, 0.0, -distance);
        stage.place(wall, material, DAffine3::from_translation(place));
    }
}

/// A point of the slab, evenly spread over its volume.
fn place(random: &mut Random) -> DVec3 {
    let cube = random.between(NEAREST.powi(3), FARTHEST.powi(3));
    let distance = cube.cbrt();
    let (x, y) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    DVec3::new(x * slope() * ASPECT * distance, y * slope() * distance, -distance)
}

fn volume() -> f64 {
    4.0 * slope() * slope() * ASPECT * (FARTHEST.powi(3) - NEAREST.powi(3)) / 3.0
}

fn objects(stage: &mut SceneBuilder, random: &mut Random, (count, materials): (usize, usize), detail: usize) {
    if count == 0 {
        return;
    }
    let materials: Vec<usize> = (0..materials)
        .map(|index| {
            stage.material(Material {
                name: format!("object {index}"),
                base_color: Vec3::splat(0.75).lerp(hue(index as f64 / materials as f64), 0.6),
                metallic: if index % 4 == 3 { 1.0 } else { 0.0 },
                roughness: 0.2 + 0.1 * (index % 8) as f32,
                ..Material::default()
            })
        })
        .collect();
    let shapes = [
        ("sphere", shapes::sphere(0.5, 24 * detail)),
        ("box", shapes::cuboid([0.8; 3])),
        ("ring", shapes::torus(0.38, 0.14, 28 * detail)),
        ("cone", shapes::cone(0.5, 1.0, 24 * detail)),
    ];
    let meshes = shapes.map(|(name, shape)| stage.mesh(name, shape, materials[0]));
    let spacing = (volume() / count as f64).cbrt().min(6.0);
    for index in 0..count {
        let size = spacing * random.between(0.25, 0.6);
        let axis = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
        let rotation = DQuat::from_axis_angle(axis.normalize_or(DVec3::Y), random.between(0.0, std::f64::consts::TAU));
        let transform = DAffine3::from_scale_rotation_translation(DVec3::splat(size), rotation, place(random));
        stage.place(meshes[index % meshes.len()], materials[random.bits() as usize % materials.len()], transform);
    }
}

fn lights(stage: &mut SceneBuilder, random: &mut Random, count: usize, range: f64) {
    let range = (range > 0.0).then_some(range);
    // Without a limit every light reaches everything: share out one sum, so that the picture does not depend on the count.
    let intensity = if range.is_some() { 400.0 } else { 100_000.0 / count.max(1) as f32 };
    for index in 0..count {
        let kind = LightKind::Point { position: place(random), range, falloff: Falloff::InverseSquare };
        stage.light(Light {
            name: format!("light {index}"),
            color: Vec3::ONE.lerp(hue(random.unit()), 0.7),
            intensity,
            ..Light::of(kind)
        });
    }
}
