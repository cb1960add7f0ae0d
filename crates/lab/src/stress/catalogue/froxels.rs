//! Lamps and shadows in fog that is next to nothing or next to a wall, in froxels as large as the picture, at the eye and far brighter than it sees, and from
//! below and far above the fog's base.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::{Fog, HdrFormat, Light, LightKind, SettingsPatch};

/// Of a pixel: shadows' edges on the floor fall to either side, and in the air they lie anywhere in a froxel.
const FROXELS: Bound = Bound { worst: 2.0, mean: 0.03 };
/// For a single froxel, a lamp inside one, and light that is scattered within a hundredth of the picture.
const COARSE: Bound = Bound { worst: 20.0, mean: 0.5 };

pub const CASES: &[Case] = &[
    case("froxels/density", "a sphere on a floor in lit fog that takes away so much of the light along a metre")
        .over(SweepValues::Decades(-9, 6), "1/m")
        .claim([1e-9, 1e6], FROXELS)
        .check(Check::Picture(|density| lit(SettingsPatch { fog_density: Some(density as f32), ..usual() }))),
    case("froxels/grid", "the same with so many froxels across, down and in depth")
        .over(SweepValues::List(&[1.0, 2.0, 8.0, 32.0, 96.0]), "")
        .claim([1.0, 96.0], COARSE)
        .check(Check::Picture(|edge| lit(SettingsPatch { fog_froxels: Some([edge as u32; 3]), ..usual() }))),
    case("froxels/anisotropy", "the same where the mean cosine of the angle of scattering is so")
        .over(SweepValues::List(&[-0.999, -0.99, -0.5, 0.0, 0.5, 0.99, 0.999]), "")
        .claim([-0.99, 0.99], COARSE)
        .check(Check::Picture(|cosine| lit(SettingsPatch { fog_anisotropy: Some(cosine as f32), ..usual() }))),
    case("froxels/base", "the same with a base so high above the floor, or so far below it")
        .over(SweepValues::List(&[-1e6, -1e3, -10.0, 0.0, 10.0, 1e3, 1e6]), "m")
        .claim([-1e6, 1e6], FROXELS)
        .check(Check::Picture(|base| lit(SettingsPatch { fog_base: Some(base as f32), ..usual() }))),
    case("froxels/lamp", "a lamp in the fog so far before the camera")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 1.0, 3.0]), "m")
        .claim([0.0, 3.0], COARSE)
        .check(Check::Picture(at_the_eye)),
    case("froxels/intensity", "lamps in the fog of so many candela")
        .over(SweepValues::Decades(-9, 9), "cd")
        .claim([1e-9, 1e9], FROXELS)
        .check(Check::Picture(|candela| subject(DVec3::new(1.2, 2.0, 1.0), candela as f32, usual()))),
    case("froxels/distance", "froxels that end so far away along the view")
        .over(SweepValues::Decades(-2, 6), "m")
        .claim([10.0, 100.0], FROXELS)
        .check(Check::Picture(|metres| lit(SettingsPatch { fog_distance: Some(metres as f32), ..usual() }))),
];

fn usual() -> SettingsPatch {
    SettingsPatch { fog_density: Some(0.1), ..SettingsPatch::default() }
}

fn lit(said: SettingsPatch) -> Subject {
    subject(DVec3::new(1.2, 2.0, 1.0), 4.0, said)
}

fn subject(place: DVec3, candela: f32, said: SettingsPatch) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(place, candela));
    let direction = DVec3::new(-0.5, -1.0, -0.3).normalize();
    let share = candela / 4.0;
    stage.light(Light { intensity: 0.5 * share, ..Light::of(LightKind::Directional { direction }) });
    stage.scene.environment.ambient = Vec3::splat(0.05 * share);
    let kept = SettingsPatch {
        fog: Some(Fog::Froxels),
        fog_froxels: Some([48, 27, 48]),
        fog_distance: Some(8.0),
        hdr_format: Some(HdrFormat::Rgba32f),
        exposure: Some((share / 4.0).log2()),
        ..float32()
    };
    Subject::with(stage.scene, said.or(&kept))
}

fn at_the_eye(metres: f64) -> Subject {
    let camera = sphere_on_floor().scene.camera;
    subject(camera.position + camera.forward() * metres, 4.0, usual())
}
