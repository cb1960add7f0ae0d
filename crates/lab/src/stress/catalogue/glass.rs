//! Glass before a wall whose light changes evenly across it: panes and balls, for which a frame knows the body.

use glam::{DAffine3, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp};
use afterlight::scene::builtin::shapes::{self, MeshBuilder};
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    AlphaMode, Camera, HdrFormat, Light, LightKind, LightPath, Material, Projection, Refraction, SettingsPatch,
};

/// Light that goes back and forth within a body leaves it, by rays, on the side of the camera as well, where nothing shines.
const BACK_AND_FORTH: Bound = Bound { worst: 0.01, mean: 3e-3 };

pub const CASES: &[Case] = &[
    case("glass/ior", "a tilted pane of this index of refraction before a wall whose light changes evenly")
        .over(SweepValues::List(&[1.0, 1.01, 1.33, 1.5, 2.0, 2.42, 4.0, 10.0, 100.0]), "")
        .claim([1.0, 4.0], BACK_AND_FORTH)
        .check(Check::Picture(|ior| tilted(Refraction { ior: ior as f32, ..body() }, even()))),
    case("glass/size", "a ball of glass before a wall, with all that is around it so many times as large")
        .over(SweepValues::Decades(-6, 6), "")
        .claim([1e-6, 1e6], BACK_AND_FORTH)
        .check(Check::Picture(|size| ball(body(), size))),
    case("glass/distance", "a pane whose colour is that of light after so many metres")
        .over(SweepValues::List(&[1e-9, 1e-6, 1e-3, 0.01, 0.1, 1.0, 1e3, 1e9, f64::INFINITY]), "m")
        // Rays give up light of which less than a thousandth is left.
        .claim([0.01, f64::INFINITY], BACK_AND_FORTH)
        .check(Check::Picture(|distance| {
            tilted(Refraction { color: Vec3::new(0.1, 0.5, 0.9), distance: distance as f32, ..body() }, even())
        })),
    case("glass/dispersion", "a pane that bends colours apart by so much")
        .over(SweepValues::List(&[0.0, 1e-6, 0.1, 0.36, 1.0, 5.0, 20.0, 40.0]), "")
        .claim([0.0, 40.0], BACK_AND_FORTH)
        .check(Check::Picture(|dispersion| tilted(Refraction { dispersion: dispersion as f32, ..body() }, even()))),
    case("glass/strength", "a thin wall before light of so many nits, metered")
        .over(SweepValues::Decades(-9, 9), "nits")
        .claim([1e-9, 1e9], Bound { worst: 1e-5, mean: 1e-6 })
        .check(Check::Picture(|nits| tilted(Refraction::THIN, shining(nits)))),
    case("glass/shadow-alpha", "the shadow of a sheet that is blended with this alpha")
        .over(SweepValues::List(&[0.0, 1e-6, 0.01, 0.1, 0.5, 0.9, 0.99, 1.0]), "")
        .claim([0.0, 1.0], OF_SHADOW)
        .check(Check::Picture(|alpha| shadow(veil(alpha as f32), (0.3, 1.0), 4.0))),
    case("glass/shadow-tilt", "the shadow of a sheet of coloured glass, so far from lying across the light")
        .over(SweepValues::List(&[0.0, 1e-3, 10.0, 45.0, 80.0, 89.0, 89.9, 90.0]), "degrees")
        .claim([0.0, 80.0], OF_SHADOW)
        .check(Check::Picture(|degrees| shadow(red(), (degrees.to_radians(), 1.0), 4.0))),
    case(
        "glass/shadow-size",
        "the shadow of a sheet of coloured glass, with all that is around it so many times as large",
    )
    .over(SweepValues::Decades(-6, 6), "")
    .claim([1e-6, 1e6], OF_SHADOW)
    .check(Check::Picture(|size| shadow(red(), (0.3, size), 4.0))),
    case("glass/shadow-distance", "the same so many metres above the floor")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.01, 0.1, 1.0, 10.0, 1e3]), "m")
        // Nearer to the floor than a texel is wide, and so far that a map of the whole scene has few texels for the sheet, edges are wrong.
        .claim([0.01, 10.0], OF_SHADOW)
        .check(Check::Picture(|height| shadow(red(), (0.0, 1.0), height))),
];

/// Of a pixel: edges of shadows fall to either side of the middle of a pixel.
const OF_SHADOW: Bound = Bound { worst: 1.0, mean: 5e-3 };

fn body() -> Refraction {
    Refraction { thickness: 0.4, ..Refraction::THIN }
}

/// A wall that sends the colours of its corners, in nits.
fn even() -> Material {
    Material { base_color: Vec3::ONE, unlit: true, ..Material::default() }
}

fn shining(nits: f64) -> Material {
    Material { base_color: Vec3::ZERO, emissive: Vec3::splat(nits as f32), ..Material::default() }
}

fn veil(alpha: f32) -> Material {
    Material { alpha_mode: AlphaMode::Blend, alpha, ..Material::default() }
}

fn red() -> Material {
    Material { base_color: Vec3::new(0.9, 0.2, 0.1), ..Material::clear_glass(Refraction::THIN) }
}

/// A tilted sheet `height` metres above a floor in the sun, and the camera that sees its shadow. All lengths are multiplied by `size`.
fn shadow(material: Material, (tilt, size): (f64, f64), height: f64) -> Subject {
    let mut stage = SceneBuilder::default();
    let plaster = stage.material(Material { base_color: Vec3::splat(0.6), roughness: 1.0, ..Material::default() });
    let own = stage.material(material);
    let floor = stage.mesh("floor", shapes::plane([16.0, 16.0]), plaster);
    let sheet = stage.mesh("sheet", shapes::plane([1.0, 1.0]), own);
    let scaled = DAffine3::from_scale(DVec3::splat(size));
    stage.place(floor, plaster, scaled);
    let towards = DVec3::new(0.2, 1.0, 0.1).normalize();
    let raised = DAffine3::from_translation(towards * (height / towards.y)) * DAffine3::from_rotation_x(tilt);
    stage.place(sheet, own, scaled * raised);
    let kind = LightKind::Directional { direction: -towards };
    stage.light(Light { kind, casts_shadow: true, ..lamp(DVec3::ZERO, 1000.0) });
    let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 2.0) * size, DVec3::ZERO, DVec3::Y);
    stage.scene.camera = Camera { near: 0.1 * size, projection: Projection::perspective(45.0), ..camera };
    let own = SettingsPatch {
        tinted_shadows: Some(true),
        cascades: Some(1),
        size: Some([48, 48]),
        ..SettingsPatch::default()
    };
    // Errors are relative to the light of the floor where the sun falls on it.
    Subject { floor: 0.6, ..Subject::with(stage.scene, own.or(&float32())) }
}

/// Glass before the wall, all of it `size` times as large.
fn before_wall(mesh: MeshBuilder, material: Material, (transform, wall): (DAffine3, Material), size: f64) -> Subject {
    let mut stage = SceneBuilder::default();
    let shining = stage.material(wall);
    let own = stage.material(material);
    let wall = stage.mesh("wall", shapes::plane([16.0, 16.0]), shining);
    let body = stage.mesh("body", mesh, own);
    let scaled = DAffine3::from_scale(DVec3::splat(size));
    let upright = DAffine3::from_translation(DVec3::NEG_Z * 2.0) * DAffine3::from_rotation_x(90f64.to_radians());
    stage.place(wall, shining, scaled * upright);
    stage.place(body, own, scaled * transform);
    // An unlit wall shines in the colours of its corners.
    let colors = [[1.0, 0.2, 0.1, 1.0], [0.2, 1.0, 0.3, 1.0], [0.1, 0.3, 1.0, 1.0], [0.8, 0.8, 0.2, 1.0]];
    stage.scene.meshes[wall].colors = (0..stage.scene.meshes[wall].positions.len()).map(|at| colors[at % 4]).collect();
    let camera = Camera::looking_at(DVec3::Z * 2.0 * size, DVec3::ZERO, DVec3::Y);
    // A narrow view: at grazing angles the far side would mirror the wall.
    stage.scene.camera = Camera { near: 0.1 * size, projection: Projection::perspective(30.0), ..camera };
    let path = SettingsPatch {
        light_path: Some(LightPath::Loop),
        hdr_format: Some(HdrFormat::Rgba32f),
        size: Some([32, 32]),
        ..SettingsPatch::default()
    };
    Subject { floor: 1.0, ..Subject::with(stage.scene, path.or(&float32())) }
}

/// A pane that fills the picture. A thin wall has no far side.
fn tilted(refraction: Refraction, wall: Material) -> Subject {
    let tilt = DAffine3::from_axis_angle(DVec3::new(0.3, 1.0, 0.0).normalize(), 0.3);
    let mesh = match refraction.thickness > 0.0 {
        true => shapes::cuboid([8.0, 8.0, f64::from(refraction.thickness)]),
        false => shapes::cuboid([8.0, 8.0, 0.01]),
    };
    before_wall(mesh, Material::clear_glass(refraction), (tilt, wall), 1.0)
}

/// A ball that fills the picture.
fn ball(refraction: Refraction, size: f64) -> Subject {
    let material = Material::clear_glass(Refraction { thickness: 3.0, ..refraction });
    let place = DAffine3::from_translation(DVec3::NEG_Z * 0.4);
    before_wall(shapes::sphere(1.5, 192), material, (place, even()), size)
}
