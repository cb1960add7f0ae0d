//! Particles hours after the first, without end, all at one point, behind the camera, across its near plane, and as large as a country.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::{Emitter, HdrFormat, Playing, SettingsPatch};

/// The bound for particles in single floats, as the device has them. The worst pixels are pixels in which two particles at nearly the same distance
/// swap their order, and pixels of particles with an edge of the sphere's shadow on them.
const DRAWN: Bound = Bound { worst: 5e-3, mean: 5e-5 };

pub const CASES: &[Case] = &[
    case("particles/time", "a fountain so long after its first particle")
        .over(SweepValues::List(&[0.0, 1e-6, 0.25, 1.0, 3600.0, 1e5, 1e8]), "s")
        .claim([0.0, 1e8], DRAWN)
        .check(Check::Picture(|time| drawn(Emitter { start: Some(0.0), ..fountain() }, time))),
    case("particles/drag", "air that takes such a share of the velocity a second")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e6]), "")
        .claim([0.0, 1e6], DRAWN)
        .check(Check::Picture(|drag| drawn(Emitter { drag, ..fountain() }, 20.0))),
    case("particles/size", "squares of such an edge")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 1.0, 100.0, 1e4, 1e6]), "m")
        // Squares much smaller than a pixel are seen where one of them lies in the middle of a pixel, and f32 has them a hair beside it.
        .claim([0.1, 1e6], DRAWN)
        .check(Check::Picture(|edge| drawn(Emitter { size: vec![edge as f32], ..fountain() }, 20.0))),
    case("particles/distance", "a cloud so far before the camera, or behind it, or across its near plane")
        .over(SweepValues::List(&[-1e6, -1.0, 0.0, 0.01, 0.1, 1.0, 100.0, 1e6]), "m")
        .claim([-1e6, 1e6], DRAWN)
        .check(Check::Picture(cloud)),
    case("particles/one-point", "so many, all at one point: the oldest lies behind")
        .over(SweepValues::List(&[0.0, 1.0, 2.0, 10.0, 100.0, 3000.0]), "")
        .claim([0.0, 3000.0], DRAWN)
        .check(Check::Picture(one_point)),
    case("particles/emission", "sparks that send out so much light")
        .over(SweepValues::List(&[0.0, 1e-12, 1e-3, 1.0, 1e6, 1e18]), "nits")
        .claim([0.0, 1e18], Bound { worst: 0.0, mean: 0.0 })
        .check(Check::Sane(|nits| drawn(Emitter { emission: vec![Vec3::splat(nits as f32)], ..fountain() }, 20.0))),
];

fn fountain() -> Emitter {
    Emitter {
        name: "fountain".into(),
        position: DVec3::new(0.6, 0.4, 0.6),
        extent: DVec3::new(0.1, 0.0, 0.1),
        rate: 100.0,
        life: 2.0,
        velocity: DVec3::new(0.0, 2.0, 0.0),
        spread: DVec3::splat(0.5),
        gravity: DVec3::new(0.0, -2.0, 0.0),
        drag: 0.2,
        size: vec![0.2, 0.5],
        color: vec![[0.9, 0.7, 0.5, 0.6], [0.4, 0.5, 0.9, 0.0]],
        softness: 0.2,
        seed: 5,
        ..Emitter::default()
    }
}

fn drawn(emitter: Emitter, time: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4000.0));
    stage.scene.emitters = vec![emitter];
    let settings = SettingsPatch { hdr_format: Some(HdrFormat::Rgba32f), ..float32() };
    Subject { floor: 1.0, playing: Some(Playing::at(time)), ..Subject::with(stage.scene, settings) }
}

fn cloud(metres: f64) -> Subject {
    let usual = drawn(fountain(), 20.0);
    let camera = usual.scene.camera;
    let own = Emitter {
        position: camera.position + camera.forward() * metres,
        extent: DVec3::splat(0.05),
        velocity: DVec3::ZERO,
        spread: DVec3::splat(0.05),
        gravity: DVec3::ZERO,
        size: vec![0.1],
        softness: 0.05,
        ..fountain()
    };
    drawn(own, 20.0)
}

fn one_point(count: f64) -> Subject {
    let still =
        Emitter { extent: DVec3::ZERO, velocity: DVec3::ZERO, spread: DVec3::ZERO, gravity: DVec3::ZERO, ..fountain() };
    // No particle exists before the start.
    let start = if count == 0.0 { Some(1e3) } else { None };
    drawn(Emitter { rate: (count - 0.5).max(0.4) / 2.0, start, ..still }, 20.0)
}
