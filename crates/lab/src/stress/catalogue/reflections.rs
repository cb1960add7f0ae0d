//! Reflections at their extremes: from mirrors to rough floors, grazing rays, and light that is mirrored.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::{Camera, Reflections, SettingsPatch};

pub const CASES: &[Case] = &[
    // A screen does not know the sphere's lower half, which the floor mirrors.
    case("reflections/roughness", "a sphere on a metal floor of such a roughness, which mirrors it")
        .over(SweepValues::List(&[0.0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0]), "")
        .claim([0.0, 1.0], Bound { worst: 8.0, mean: 0.1 })
        .check(Check::Picture(|roughness| subject(roughness, 2.0, 1.0))),
    case("reflections/height", "the same on a floor of a roughness of 0.1, seen from so high above it")
        .over(SweepValues::Decades(-6, 1), "m")
        .claim([1e-6, 10.0], Bound { worst: 8.0, mean: 0.1 })
        .check(Check::Picture(|metres| subject(0.1, metres, 1.0))),
    // At the edge of its image a dark floor has all of the sphere's light or nothing.
    case("reflections/light", "the same from two metres up, where the sphere emits so many nits")
        .over(SweepValues::Decades(-3, 6), "nits")
        .claim([1e-3, 1e6], Bound { worst: 300.0, mean: 0.5 })
        .check(Check::Picture(|nits| subject(0.1, 2.0, nits))),
];

fn subject(roughness: f64, height: f64, nits: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let floor = &mut stage.scene.materials[0];
    (floor.metallic, floor.roughness) = (1.0, roughness as f32);
    stage.scene.materials[1].emissive = Vec3::splat(nits as f32);
    stage.scene.environment.ambient = Vec3::splat(0.2);
    stage.scene.lights.push(lamp(DVec3::new(1.0, 3.0, 2.0), 20.0));
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, height, 4.0), DVec3::new(0.0, 0.4, 0.0), DVec3::Y);
    let reflections =
        SettingsPatch { reflections: Some(Reflections::Screen), reflection_roughness: Some(1.0), ..float32() };
    Subject::with(stage.scene, reflections)
}
