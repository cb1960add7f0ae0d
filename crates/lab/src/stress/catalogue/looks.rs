//! Objects of one mesh and material that look each in its way: atlases of many cells, seen from far away and at low angles, and dark tints.

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, texture};
use afterlight::scene::builtin::shapes::{MeshBuilder, WHOLE_IMAGE};
use afterlight::scene::builtin::stage::{SceneBuilder, hue};
use afterlight::scene::{Brdf, Camera, LightPath, Look, Material, SettingsPatch};

pub const CASES: &[Case] = &[
    case(
        "looks/cells",
        "sprites of one material, each with another cell of an atlas of so many rows and as many columns",
    )
    .over(SweepValues::List(&[1.0, 2.0, 3.0, 16.0, 64.0, 256.0]), "")
    .claim([1.0, 256.0], Bound { worst: 1e-5, mean: 1e-6 })
    .check(Check::Placed(|edge| cells(edge, LightPath::Loop), 0.2)),
    // Lavapipe makes each level of each cell by a separate draw: ten seconds for all of the largest atlas.
    case("looks/cells-forward", "the same, lit as they are drawn")
        .over(SweepValues::List(&[1.0, 2.0, 3.0, 16.0, 64.0]), "")
        .claim([1.0, 64.0], Bound { worst: 1e-5, mean: 1e-6 })
        .check(Check::Placed(|edge| cells(edge, LightPath::Forward), 0.2)),
    case("looks/distance", "sprites of pure colours, seen so far away that all of a cell is smaller than a pixel")
        .over(SweepValues::List(&[0.1, 0.3, 1.0, 3.0, 10.0, 20.0]), "m")
        .claim([0.1, 20.0], Bound { worst: 1e-5, mean: 1e-6 })
        .check(Check::Placed(|metres| seen_from(DVec3::new(0.0, 0.0, metres)), 0.6)),
    case(
        "looks/angle",
        "sprites of pure colours, seen so many degrees above the plane that they lie in, with 16 places a pixel",
    )
    .over(SweepValues::List(&[0.5, 1.0, 2.0, 5.0, 15.0, 45.0, 90.0]), "degrees")
    .claim([0.5, 90.0], Bound { worst: 1e-5, mean: 1e-6 })
    .check(Check::Placed(
        |degrees| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            seen_from(DVec3::new(0.0, -cos, sin) * 2.0)
        },
        0.6,
    )),
    case("looks/tint", "sprites whose tint is so dark")
        .over(SweepValues::Decades(-6, 0), "")
        // A tint has 16 bits a channel.
        .claim([0.01, 1.0], Bound { worst: 1e-3, mean: 1e-3 })
        .check(Check::Placed(tint, 0.2)),
];

/// Sprites a side.
const SIDE: u32 = 16;

/// A square metre of sprites, each as `look` says, in front of a camera. The atlas has `edge` cells a side, each of one colour and with `texels`
/// texels a side.
fn sprites([edge, texels]: [u32; 2], color: impl Fn(u32) -> Vec3, look: impl Fn(u32) -> Look) -> SceneBuilder {
    let width = edge * texels;
    let texel = |index: u32| {
        let [x, y] = [index % width, index / width];
        let [red, green, blue] = color(y / texels * edge + x / texels).to_array().map(|share| (share * 255.0) as u8);
        // One texel differs: a constant texture would be folded into the material.
        [red, green, blue, if index == 0 { 254 } else { 255 }]
    };
    let mut stage = SceneBuilder::default();
    let material = Material {
        brdf: Brdf::Lambert,
        base_color: Vec3::ONE,
        base_color_texture: stage.texture(texture("atlas", width, texel)),
        atlas: [edge; 2],
        ..Material::default()
    };
    let material = stage.material(material);
    let mut square = MeshBuilder::new();
    square.quad([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0)), WHOLE_IMAGE);
    let mesh = stage.mesh("sprite", square, material);
    for index in 0..SIDE * SIDE {
        let place = DVec3::new(f64::from(index % SIDE), f64::from(index / SIDE), 0.0) / f64::from(SIDE) - 0.5;
        let scale = DVec3::splat(1.0 / f64::from(SIDE));
        let place = place * DVec3::new(1.0, 1.0, 0.0);
        stage.place(mesh, material, DAffine3::from_scale_rotation_translation(scale, DQuat::IDENTITY, place));
        if let Some(object) = stage.scene.objects.last_mut() {
            object.look = Some(look(index));
        }
    }
    stage.sun(DVec3::new(0.3, 0.2, -1.0), 3.0, Vec3::ONE, false);
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 0.0, 1.2), DVec3::ZERO, DVec3::Y);
    stage
}

fn cells(edge: f64, light_path: LightPath) -> Subject {
    let edge = edge as u32;
    let (count, last) = (edge * edge, SIDE * SIDE - 1);
    // Neighbours in the atlas differ in all channels.
    let color = |cell: u32| hue(f64::from(cell) * 0.381_966) * 0.7 + 0.2;
    let look =
        |index: u32| Look { cell: ((count - 1) as u64 * u64::from(index) / u64::from(last)) as u32, ..Look::PLAIN };
    let stage = sprites([edge, 2], color, look);
    Subject::with(stage.scene, SettingsPatch { light_path: Some(light_path), ..float32() })
}

fn seen_from(eye: DVec3) -> Subject {
    let pure = |cell: u32| [Vec3::X, Vec3::Y, Vec3::Z][(cell % 3) as usize];
    let mut stage = sprites([4, 16], pure, |index| Look { cell: index % 16, ..Look::PLAIN });
    stage.scene.camera = Camera { near: 1e-3, ..Camera::looking_at(eye, DVec3::ZERO, DVec3::new(0.0, 0.6, 0.8)) };
    Subject::with(stage.scene, SettingsPatch { anisotropy: Some(16), ..float32() })
}

fn tint(tint: f64) -> Subject {
    let color = |cell: u32| hue(f64::from(cell) * 0.381_966) * 0.7 + 0.2;
    let dark = Vec3::splat(tint as f32);
    let stage = sprites([4, 4], color, |index| Look { cell: index % 16, tint: dark, selected: false });
    Subject::with(stage.scene, float32())
}
