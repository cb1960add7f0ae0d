//! Ambient occlusion at its extremes: radii, and distances of the camera from the occluder.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, sphere_on_floor};
use afterlight::scene::{AmbientOcclusion, Camera, SettingsPatch};

pub const CASES: &[Case] = &[
    // The worst pixels lie in the crevice below the sphere, where the truth has next to no light.
    // A radius far beyond the scene and the picture: eight steps to a side then look at a few places of it.
    case("ao/radius", "a sphere on a floor under light from everywhere, which surfaces within such a radius hide")
        .over(SweepValues::Decades(-3, 3), "m")
        .claim([1e-3, 1e3], Bound { worst: 5.0, mean: 0.05 })
        .check(Check::Picture(|metres| radius(metres, AmbientOcclusion::Bitmask))),
    case("ao/radius-ssao", "the same by samples of the hemisphere")
        .over(SweepValues::Decades(-3, 3), "m")
        .claim([1e-3, 1e3], Bound { worst: 5.0, mean: 0.25 })
        .check(Check::Picture(|metres| radius(metres, AmbientOcclusion::Ssao))),
    case("ao/distance", "the same with a radius of half a metre, seen from so far away")
        .over(SweepValues::List(&[0.6, 1.0, 3.0, 10.0, 100.0, 1e4]), "m")
        .claim([0.6, 1e4], Bound { worst: 6.0, mean: 0.04 })
        .check(Check::Picture(distance)),
];

fn subject(ao: AmbientOcclusion, metres: f64, eye: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.scene.environment.ambient = Vec3::ONE;
    let towards = DVec3::new(0.0, 0.45, 0.9).normalize();
    stage.scene.camera = Camera::looking_at(DVec3::Y * 0.5 + towards * eye, DVec3::Y * 0.5, DVec3::Y);
    Subject::with(stage.scene, SettingsPatch { ao: Some(ao), ao_radius: Some(metres as f32), ..float32() })
}

fn radius(metres: f64, ao: AmbientOcclusion) -> Subject {
    subject(ao, metres, 4.0)
}

fn distance(metres: f64) -> Subject {
    subject(AmbientOcclusion::Bitmask, 0.5, metres)
}
