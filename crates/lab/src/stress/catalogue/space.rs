//! Places and sizes: far from the origin, tiny and huge, through lenses of all angles, stretched and flattened, and close to each other.

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{Camera, Material, Projection, Scene, SettingsPatch};

pub const CASES: &[Case] = &[
    // ANCHOR: claim
    case("space/origin", "scene and camera so far from the origin; the truth stays there")
        .over(SweepValues::Decades(0, 15), "m")
        .claim([1.0, 1e15], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Placed(origin, 0.01)),
    // ANCHOR_END: claim
    case("space/detail", "a model of millimetres whose vertices are written so far from its zero")
        .over(SweepValues::Decades(0, 12), "m")
        .claim([1.0, 1e9], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Placed(detail, 0.01)),
    case("space/size", "scene, camera, near plane and lamp all so many times as large")
        .over(SweepValues::Decades(-12, 12), "")
        .claim([1e-9, 1e12], Bound { worst: 2e-4, mean: 1e-6 })
        .check(Check::Placed(size, 0.01)),
    case(
        "space/size-lod",
        "the same, with levels of detail that may be off by half a pixel; the truth has the meshes themselves",
    )
    .over(SweepValues::Decades(-12, 12), "")
    .claim([1e-9, 1e12], Bound { worst: 1e-2, mean: 1e-2 })
    .check(Check::Whole(size_in_levels)),
    case("space/near", "near planes before a floor and a sphere metres away")
        .over(SweepValues::Decades(-12, 0), "m")
        .claim([1e-12, 1.0], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Placed(near, 0.01)),
    case(
        "space/depth",
        "a wall so far from a camera whose near plane is at a micrometre: its place, rebuilt from depth",
    )
    .over(SweepValues::Decades(-5, 15), "m")
    .claim([1e-5, 1e15], Bound { worst: 1e-6, mean: 3e-7 })
    .check(Check::Position(depth)),
    case(
        "space/field-of-view",
        "lenses from the narrowest to the widest, at the distance from which the scene fills the picture",
    )
    .over(
        SweepValues::List(&[0.001, 0.01, 0.1, 1.0, 10.0, 60.0, 120.0, 170.0, 179.0, 179.9, 179.99, 179.999]),
        "degrees",
    )
    // Places are relative to the camera, in f32: from 1100 m, where 0.1 degrees see two metres, they are known to 0.1 mm, which
    // is told where light grazes.
    .claim([0.1, 179.0], Bound { worst: 1e-2, mean: 1e-4 })
    .check(Check::Placed(field_of_view, 0.02)),
    case(
        "space/orthographic",
        "an orthographic camera that shows so much from top to bottom, two metres from a sphere",
    )
    .over(SweepValues::Decades(-6, 6), "m")
    .claim([1e-3, 1e6], Bound { worst: 1e-3, mean: 1e-5 })
    .check(Check::Placed(orthographic, 0.02)),
    case("space/orthographic-distance", "an orthographic camera so far from the two metres that it shows")
        .over(SweepValues::Decades(0, 12), "m")
        .claim([1.0, 1e8], Bound { worst: 1e-3, mean: 1e-5 })
        .check(Check::Placed(orthographic_distance, 0.02)),
    case(
        "space/orthographic-depth",
        "a wall of its size so far from an orthographic camera: its place, rebuilt from a depth that is linear",
    )
    .over(SweepValues::Decades(-5, 15), "m")
    .claim([1e-5, 1e15], Bound { worst: 1e-6, mean: 5e-7 })
    .check(Check::Position(orthographic_depth)),
    case("space/aspect", "width over height of the picture")
        .over(SweepValues::List(&[1.0 / 16384.0, 1.0 / 4096.0, 1.0 / 64.0, 1.0, 64.0, 4096.0, 16384.0]), "")
        .claim([1.0 / 16384.0, 16384.0], Bound { worst: 4e-3, mean: 2e-6 })
        .check(Check::Placed(aspect, 0.02)),
    case("space/stretch", "a sphere that is stretched so much along one axis")
        .over(SweepValues::Decades(-12, 12), "")
        .claim([1e-12, 1e12], Bound { worst: 5e-3, mean: 5e-6 })
        .check(Check::Placed(stretch, 0.02)),
    case("space/shrunk", "a model so many times too large, shrunk by its transform and mirrored")
        .over(SweepValues::Decades(-27, 30), "")
        .claim([1e-27, 1e30], Bound { worst: 2e-4, mean: 1e-6 })
        .check(Check::Placed(shrunk, 0.01)),
    case("space/mirrored", "mirrored along x (1), y (2) and z (4), under a normal map")
        .over(SweepValues::List(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]), "")
        .claim([0.0, 7.0], Bound { worst: 2e-3, mean: 2e-6 })
        .check(Check::Placed(mirrored, 0.01)),
    case("space/flattened", "a sphere that is flattened to so much of its thickness, down to none")
        .over(SweepValues::List(&[0.0, 1e-40, 1e-30, 1e-20, 1e-12, 1e-9, 1e-6, 1e-3, 1.0]), "")
        .claim([0.0, 1.0], Bound { worst: 5e-5, mean: 1e-6 })
        .check(Check::Placed(flattened, 0.02)),
    case("space/apart", "a sheet so far above the floor, seen from four metres")
        .over(SweepValues::Decades(-9, 0), "m")
        .claim([1e-6, 1.0], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Placed(apart, 0.01)),
];

fn subject(scene: Scene) -> Subject {
    Subject::with(scene, float32())
}

/// Moves all that has a place.
fn moved(scene: &mut Scene, by: DVec3) {
    scene.objects.iter_mut().for_each(|object| object.transform.translation += by);
    for light in &mut scene.lights {
        if let Some(position) = light.kind.place_mut() {
            *position += by;
        }
    }
    scene.camera.position += by;
}

/// Floor, sphere and lamp; all places are multiples of an eighth of a metre, which f64 holds up to 1e15.
fn lit_stage() -> SceneBuilder {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    stage
}

fn origin(metres: f64) -> Subject {
    let at_origin = lit_stage().scene;
    let mut scene = at_origin.clone();
    moved(&mut scene, DVec3::new(metres, -metres / 2.0, metres / 4.0).round());
    Subject { truth: Some(at_origin), ..subject(scene) }
}

fn detail(metres: f64) -> Subject {
    let place = DVec3::new(metres, -metres / 2.0, metres / 4.0);
    let mut stage = SceneBuilder::default();
    let matt = stage.material(Material { base_color: Vec3::splat(0.5), ..Material::default() });
    let mut model = shapes::MeshBuilder::new();
    let small = |offset: DVec3| {
        DAffine3::from_translation(place)
            * DAffine3::from_scale(DVec3::splat(1e-3))
            * DAffine3::from_translation(offset)
    };
    model.append(&shapes::plane([8.0, 8.0]), &small(DVec3::ZERO));
    model.append(&shapes::sphere(0.5, 24), &small(DVec3::new(0.0, 0.5, 0.0)));
    model.append(&shapes::cuboid([1.0; 3]), &small(DVec3::new(-1.5, 0.5, -0.5)));
    stage.add("detail", model, matt);
    stage.light(lamp(place + DVec3::new(2.0, 4.0, 2.0) * 1e-2, 0.1));
    stage.scene.camera = Camera {
        near: 1e-5,
        position: place + DVec3::new(0.0, 2e-3, 4e-3),
        ..Camera::looking_at(DVec3::new(0.0, 2e-3, 4e-3), DVec3::new(0.0, 4e-4, 0.0), DVec3::Y)
    };
    subject(stage.scene)
}

/// Lights grow no stronger within a centimetre, at any size of the lit objects: their intensity keeps a least value.
fn size(factor: f64) -> Subject {
    let mut scene = lit_stage().scene;
    for object in &mut scene.objects {
        object.transform = DAffine3::from_scale(DVec3::splat(factor)) * object.transform;
    }
    for light in &mut scene.lights {
        let Some(position) = light.kind.place_mut() else { continue };
        *position *= factor;
        light.intensity *= (factor * factor).max(1e-5) as f32;
    }
    scene.camera.position *= factor;
    scene.camera.near *= factor;
    subject(scene)
}

fn size_in_levels(factor: f64) -> Subject {
    let subject = size(factor);
    Subject { settings: SettingsPatch { lod: Some(0.5), ..subject.settings.clone() }, ..subject }
}

fn near(metres: f64) -> Subject {
    let mut scene = lit_stage().scene;
    scene.camera.near = metres;
    subject(scene)
}

fn depth(metres: f64) -> Subject {
    let mut stage = SceneBuilder::default();
    let matt = stage.material(Material::default());
    let wall = stage.mesh("wall", shapes::plane([8.0, 8.0]), matt);
    // Turned to the camera and a little out of its way.
    let turned = DQuat::from_rotation_y(0.4) * DQuat::from_rotation_x(1.3);
    stage.place(
        wall,
        matt,
        DAffine3::from_scale_rotation_translation(DVec3::splat(metres), turned, DVec3::NEG_Z * metres),
    );
    stage.scene.camera = Camera { position: DVec3::ZERO, near: 1e-6, ..Camera::default() };
    Subject::new(stage.scene)
}

fn field_of_view(degrees: f64) -> Subject {
    let mut scene = lit_stage().scene;
    let target = DVec3::new(0.0, 0.5, 0.0);
    // Not into the sphere.
    let distance = (1.0 / (degrees.to_radians() * 0.5).tan()).max(0.75);
    let place = target + DVec3::new(0.0, 1.0, 2.0).normalize() * distance;
    scene.camera =
        Camera { projection: Projection::perspective(degrees), ..Camera::looking_at(place, target, DVec3::Y) };
    let mut stage = SceneBuilder { scene };
    if degrees > 60.0 {
        // The widest lenses see the walls beside them.
        let walls = stage.material(Material { base_color: Vec3::splat(0.7), two_sided: true, ..Material::default() });
        stage.add("walls", shapes::cuboid([7.0; 3]), walls);
    }
    subject(stage.scene)
}

fn orthographic(height: f64) -> Subject {
    let mut scene = lit_stage().scene;
    let target = DVec3::new(0.0, 0.5, 0.0);
    let place = target + DVec3::new(0.25, 1.0, 2.0).normalize() * 2.0;
    let camera = Camera::looking_at(place, target, DVec3::Y);
    scene.camera = Camera { projection: Projection::orthographic(height), near: 1e-3, ..camera };
    subject(scene)
}

fn orthographic_distance(metres: f64) -> Subject {
    let mut subject = orthographic(2.0);
    let camera = &mut subject.scene.camera;
    camera.position += camera.forward() * (2.0 - metres);
    subject
}

fn orthographic_depth(metres: f64) -> Subject {
    let mut subject = depth(metres);
    subject.scene.camera.projection = Projection::orthographic(metres);
    subject
}

fn aspect(ratio: f64) -> Subject {
    let size = if ratio >= 1.0 { [ratio as u32, 1] } else { [1, (1.0 / ratio) as u32] };
    let subject = subject(lit_stage().scene);
    Subject { settings: SettingsPatch { size: Some(size), ..subject.settings }, ..subject }
}

/// The stage with the sphere's transform after `change`, about the sphere's middle.
fn changed(change: DMat3) -> Subject {
    let mut scene = lit_stage().scene;
    scene.objects[1].transform.matrix3 = change;
    subject(scene)
}

/// Turned half to the camera, so that a disc shows its face, and a rod its side.
fn stretched(along: f64) -> DMat3 {
    DMat3::from_rotation_y(0.6) * DMat3::from_diagonal(DVec3::new(1.0, 1.0, along))
}

fn stretch(factor: f64) -> Subject {
    changed(stretched(factor))
}

fn flattened(share: f64) -> Subject {
    changed(stretched(share))
}

fn shrunk(factor: f64) -> Subject {
    let mut stage = lit_stage();
    let material = stage.scene.objects[1].material;
    stage.scene.objects.truncate(1);
    let sphere = stage.mesh("large", shapes::sphere(0.5 * factor, 48), material);
    let place =
        DAffine3::from_translation(DVec3::new(0.0, 0.5, 0.0)) * DAffine3::from_scale(DVec3::splat(-1.0 / factor));
    stage.place(sphere, material, place);
    subject(stage.scene)
}

fn mirrored(axes: f64) -> Subject {
    let bits = axes as u32;
    let sign = |bit: u32| if bits & bit == 0 { 1.0 } else { -1.0 };
    let mut stage = lit_stage();
    let normals = super::stage::even_texture([190, 90, 220, 255]);
    let normal_texture = stage.texture(normals);
    let material = stage.material(Material { normal_texture, roughness: 0.5, ..Material::default() });
    stage.scene.objects.truncate(1);
    let torus = stage.mesh("torus", shapes::torus(0.5, 0.25, 32), material);
    let scale = DVec3::new(sign(1), sign(2), sign(4));
    let turned = DQuat::from_rotation_x(0.9);
    stage.place(torus, material, DAffine3::from_scale_rotation_translation(scale, turned, DVec3::new(0.0, 0.75, 0.0)));
    subject(stage.scene)
}

fn apart(metres: f64) -> Subject {
    let mut stage = lit_stage();
    let bright = stage.material(Material { base_color: Vec3::new(0.1, 0.6, 0.9), ..Material::default() });
    let sheet = stage.mesh("sheet", shapes::plane([4.0, 4.0]), bright);
    stage.place(sheet, bright, DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.3), DVec3::Y * metres));
    subject(stage.scene)
}
