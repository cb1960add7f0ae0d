//! Fog that is next to nothing or next to a wall, from far above it and far below its base, along level rays without end, and towards a sun.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::{Camera, Fog, HdrFormat, Light, LightKind, SettingsPatch};

/// The bound on errors over a pixel's light. Exponents of up to 88 are rounded to 2^-24 of themselves.
const CLOSED: Bound = Bound { worst: 1e-4, mean: 2e-6 };

pub const CASES: &[Case] = &[
    case("fog/density", "a sphere on a floor in fog that takes away so much of the light along a metre")
        .over(SweepValues::Decades(-9, 6), "1/m")
        .claim([1e-9, 1e6], CLOSED)
        .check(Check::Picture(|density| fogged(density, 20.0, 0.0))),
    case("fog/scale-height", "the same where the fog falls to a part in e within such a height")
        .over(SweepValues::Decades(-3, 6), "m")
        .claim([1e-3, 1e6], CLOSED)
        .check(Check::Picture(|height| fogged(0.1, height, 0.0))),
    case("fog/base", "the same with a base so high above the floor, or so far below it")
        .over(SweepValues::List(&[-1e6, -1e3, -100.0, -10.0, 0.0, 10.0, 100.0, 1e3, 1e6]), "m")
        .claim([-1e6, 1e6], CLOSED)
        .check(Check::Picture(|base| fogged(0.02, 20.0, base))),
    case("fog/horizon", "rays without end: a camera that looks so far up from the horizon")
        .over(SweepValues::List(&[-10.0, -1e-3, 0.0, 1e-6, 1e-3, 1.0, 45.0, 90.0]), "degrees")
        .claim([-10.0, 90.0], CLOSED)
        .check(Check::Picture(horizon)),
    case("fog/anisotropy", "fog that scatters light of a sun before the camera by such a mean cosine")
        .over(SweepValues::List(&[-0.999, -0.9, 0.0, 0.5, 0.9, 0.99, 0.999]), "")
        // Near the sun the phase falls to a half within a milliradian, of which single floats keep four digits.
        .claim([-0.999, 0.999], Bound { worst: 1e-4, mean: 2e-6 })
        .check(Check::Picture(towards_the_sun)),
];

fn sun(towards: DVec3) -> Light {
    Light {
        name: "sun".into(),
        intensity: 1.0,
        color: Vec3::new(1.0, 0.9, 0.7),
        casts_shadow: false,
        ..Light::of(LightKind::Directional { direction: -towards.normalize() })
    }
}

fn subject(camera: Option<Camera>, towards_sun: DVec3, said: SettingsPatch) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4.0));
    stage.light(sun(towards_sun));
    stage.scene.environment.ambient = Vec3::new(0.3, 0.4, 0.5);
    stage.scene.environment.background = Vec3::new(0.2, 0.5, 1.0);
    stage.scene.camera = camera.unwrap_or(stage.scene.camera);
    let kept = SettingsPatch { hdr_format: Some(HdrFormat::Rgba32f), exposure: Some(0.0), ..float32() };
    Subject::with(stage.scene, said.or(&SettingsPatch { fog: Some(Fog::Height), ..kept }))
}

fn fogged(density: f64, height: f64, base: f64) -> Subject {
    let [density, height, base] = [density, height, base].map(|number| Some(number as f32));
    let said = SettingsPatch { fog_density: density, fog_height: height, fog_base: base, ..SettingsPatch::default() };
    subject(None, DVec3::new(0.3, 1.0, 0.4), said)
}

fn horizon(degrees: f64) -> Subject {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let eye = DVec3::new(0.0, 1.0, 6.0);
    let up = DVec3::new(0.0, cos, sin);
    let camera = Camera::looking_at(eye, eye + DVec3::new(0.0, sin, -cos), up);
    subject(
        Some(camera),
        DVec3::new(0.3, 1.0, 0.4),
        SettingsPatch { fog_density: Some(0.05), ..SettingsPatch::default() },
    )
}

fn towards_the_sun(mean_cosine: f64) -> Subject {
    let eye = DVec3::new(0.0, 1.0, 6.0);
    let camera = Camera::looking_at(eye, eye + DVec3::new(0.0, 0.2, -1.0), DVec3::Y);
    let said =
        SettingsPatch { fog_density: Some(0.05), fog_anisotropy: Some(mean_cosine as f32), ..SettingsPatch::default() };
    subject(Some(camera), DVec3::new(0.0, 0.2, -1.0), said)
}
