//! Lights that are very near, very far, very weak, very strong, very many.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{Brdf, Falloff, Light, LightKind, LightPath, black_body_color};

pub const CASES: &[Case] = &[
    case("lights/distance", "a lamp above the floor, from inside of it to farther than any planet")
        .over(SweepValues::Decades(-9, 15), "m")
        // Nearer to the floor, a lamp's height is no more than the rounding of a place four metres away to f32.
        .claim([1e-4, 1e15], Bound { worst: 1e-3, mean: 1e-5 })
        .check(Check::Picture(distance)),
    case("lights/inside", "a lamp in the middle of a sphere, on its surface and above it")
        .over(
            SweepValues::List(&[0.0, 1e-9, 1e-6, 1e-3, 0.5, 0.9, 0.99, 0.999, 1.0, 1.001, 1.01, 1.1, 1.5, 3.0]),
            "radii",
        )
        .claim([0.0, 3.0], BOUND)
        .check(Check::Picture(inside)),
    case("lights/intensity", "from starlight to a supernova in the room, metered")
        .over(INTENSITIES, "cd")
        // One more decade, and the light's red is more than f32 holds.
        .claim([1e-12, 1e36], BOUND)
        .check(Check::Picture(intensity)),
    case("lights/range", "a lamp whose light ends at a tiny or huge range, beside another")
        .over(FACTORS, "m")
        .claim([0.0, 1e30], BOUND)
        .check(Check::Picture(|range| ranged(range, Falloff::InverseSquare))),
    case("lights/range-quadratic", "the same, with the quadratic fall-off")
        .over(FACTORS, "m")
        .claim([0.0, 1e30], BOUND)
        .check(Check::Picture(|range| ranged(range, Falloff::Quadratic))),
    case("lights/polynomial", "a polynomial fall-off with tiny or huge factors")
        .over(FACTORS, "")
        .claim([0.0, 1e30], BOUND)
        .check(Check::Picture(polynomial)),
    case("lights/cone", "a spot from no angle to all around, soft from the axis on")
        .over(ANGLES, "degrees")
        .claim([0.0, 180.0], BOUND)
        .check(Check::Picture(|outer| spot([0.0, outer]))),
    case("lights/cone-sharp", "the same without a soft edge")
        .over(ANGLES, "degrees")
        .claim([0.0, 180.0], BOUND)
        .check(Check::Picture(|outer| spot([outer, outer]))),
    case("lights/direction", "a sun and a spot whose directions are so long; one without a length is refused")
        .over(SweepValues::List(&[0.0, 1e-300, 1e-160, 1e-30, 1e-3, 1.0, 1e3, 1e30, 1e160, 1e300]), "")
        .claim([1e-300, 1e300], BOUND)
        .check(Check::Picture(direction)),
    many("lights/count-loop", |count| count_of(count, LightPath::Loop)),
    many("lights/count-per-light", |count| count_of(count, LightPath::PerLight)),
    many("lights/count-volumes", |count| count_of(count, LightPath::Volumes)),
    many("lights/count-clustered", |count| count_of(count, LightPath::Clustered)),
    many("lights/count-compute", |count| count_of(count, LightPath::Compute)),
    many("lights/count-visibility", |count| count_of(count, LightPath::Visibility)),
    many("lights/count-forward", |count| count_of(count, LightPath::Forward)),
    many("lights/count-forward-naive", |count| count_of(count, LightPath::ForwardNaive)),
    case("lights/sum", "a thousand equal lamps after one that is so many times as bright")
        .over(SweepValues::Decades(0, 12), "times")
        .claim([1.0, 1e12], BOUND)
        .check(Check::Picture(sum)),
    case("lights/temperature", "a black body, also where no colour is defined")
        .over(SweepValues::List(&[0.0, 1.0, 800.0, 1000.0, 1900.0, 6500.0, 40_000.0, 1e9, 1e300]), "K")
        .claim([0.0, 1e300], BOUND)
        .check(Check::Picture(temperature)),
];

/// The worst pixels lie where the light just grazes the ball, and hardly anything is left of it.
const BOUND: Bound = Bound { worst: 1e-2, mean: 2e-5 };

const INTENSITIES: SweepValues = SweepValues::List(&[
    1e-30, 1e-20, 1e-12, 1e-8, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9, 1e12, 1e20, 1e30, 1e36, 1e37, 1e38, 3e38,
]);
const FACTORS: SweepValues = SweepValues::List(&[
    0.0, 1e-30, 1e-20, 1e-19, 1e-12, 1e-6, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e6, 1e12, 1e20, 1e30,
]);
const ANGLES: SweepValues = SweepValues::List(&[
    0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0, 30.0, 45.0, 59.0, 61.0, 89.0, 90.0, 91.0, 120.0, 179.0, 179.99, 180.0,
]);

const fn many(name: &'static str, subject: fn(f64) -> Subject) -> Case {
    case(name, "lamps that reach every pixel")
        .over(SweepValues::List(&[1.0, 100.0, 1e4]), "")
        .claim([1.0, 1e4], Bound { worst: 1e-4, mean: 1e-5 })
        .check(Check::Picture(subject))
}

/// A subject with a G-buffer in single floats, so that only the light errs.
fn precise(stage: SceneBuilder) -> Subject {
    Subject::with(stage.scene, float32())
}

/// As strong as far, so that the floor below is always lit alike.
fn distance(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, metres, 1.0), (1000.0 * metres * metres).max(10.0) as f32));
    precise(stage)
}

fn inside(radii: f64) -> Subject {
    let mut stage = sphere_on_floor();
    // Towards the camera, so that the place where it leaves the sphere is seen.
    let out = DVec3::new(0.3, 0.6, 0.8).normalize();
    stage.light(lamp(DVec3::new(0.0, 0.5, 0.0) + out * (0.5 * radii), 1000.0));
    precise(stage)
}

fn intensity(candela: f64) -> Subject {
    let mut stage = sphere_on_floor();
    // Infinity times the blue that it has not would be no number.
    let floor = &mut stage.scene.materials[0];
    (floor.brdf, floor.base_color) = (Brdf::Lambert, Vec3::new(0.5, 0.3, 0.0));
    // A colour of which one channel is nothing and another more than its intensity.
    let light = lamp(DVec3::new(1.2, 2.0, 1.0), candela as f32);
    stage.light(Light { color: Vec3::new(30.0, 1.0, 0.0), ..light });
    precise(stage)
}

fn ranged(metres: f64, falloff: Falloff) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(-1.2, 2.0, 1.0), 10.0));
    let position = DVec3::new(1.2, 0.5 * metres.min(4.0), 1.0);
    let light = lamp(position, (100.0 * metres.min(4.0).powi(2)).max(1e-30) as f32);
    stage.light(Light { kind: LightKind::Point { position, range: Some(metres), falloff }, ..light });
    precise(stage)
}

fn polynomial(factor: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(-1.2, 2.0, 1.0), 10.0));
    let position = DVec3::new(1.2, 2.0, 1.0);
    let term = factor as f32;
    let falloff = Falloff::Polynomial { constant: term, linear: term, quadratic: term };
    let kind = LightKind::Point { position, range: None, falloff };
    // As bright at any factor, as far as the model's guard allows.
    stage.light(Light { kind, ..lamp(position, (100.0 * factor.max(1e-5)) as f32) });
    precise(stage)
}

fn spot([inner_angle_degrees, outer_angle_degrees]: [f64; 2]) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(-1.2, 2.0, 1.0), 10.0));
    let position = DVec3::new(1.2, 3.0, 1.0);
    let kind = LightKind::Spot {
        position,
        direction: DVec3::new(-0.35, -0.9, -0.3).normalize(),
        inner_angle_degrees,
        outer_angle_degrees,
        range: None,
        falloff: Falloff::InverseSquare,
    };
    stage.light(Light { kind, ..lamp(position, 1000.0) });
    precise(stage)
}

/// The truth has unit vectors. The spot has a range, so that its reach has a volume.
fn direction(length: f64) -> Subject {
    let lit = |length: f64| {
        let mut stage = sphere_on_floor();
        let sun = LightKind::Directional { direction: DVec3::new(0.3, -1.0, -0.2).normalize() * length };
        stage.light(Light { kind: sun, ..lamp(DVec3::ZERO, 300.0) });
        let position = DVec3::new(1.2, 3.0, 1.0);
        let kind = LightKind::Spot {
            position,
            direction: DVec3::new(-0.35, -0.9, -0.3).normalize() * length,
            inner_angle_degrees: 5.0,
            outer_angle_degrees: 25.0,
            range: Some(10.0),
            falloff: Falloff::InverseSquare,
        };
        stage.light(Light { kind, ..lamp(position, 3000.0) });
        stage
    };
    Subject { truth: Some(lit(1.0).scene), ..precise(lit(length)) }
}

/// So many lamps in a spiral above the floor, in all colours.
fn spiral(stage: &mut SceneBuilder, count: usize, candela: f64) {
    for index in 0..count {
        let share = (index as f64 + 0.5) / count as f64;
        // The golden angle.
        let (sin, cos) = (index as f64 * 2.399_963).sin_cos();
        let radius = 3.0 * share.sqrt();
        let position = DVec3::new(radius * cos, 1.5 + share, radius * sin);
        let kind = LightKind::Point { position, range: Some(12.0), falloff: Falloff::InverseSquare };
        let color = Vec3::new(1.0, 0.5 + 0.5 * share as f32, 1.0 - share as f32);
        stage.light(Light { kind, color, ..lamp(position, candela as f32) });
    }
}

fn count_of(count: f64, path: LightPath) -> Subject {
    let mut stage = sphere_on_floor();
    spiral(&mut stage, count as usize, 1000.0 / count);
    let mut subject = precise(stage);
    subject.settings.size = Some([32, 18]);
    subject.settings.light_path = Some(path);
    if matches!(path, LightPath::Forward | LightPath::ForwardNaive) {
        subject.settings.gbuffer = None;
    }
    subject
}

fn sum(times: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 1000.0));
    spiral(&mut stage, 1000, 1000.0 / times);
    let mut subject = precise(stage);
    subject.settings.light_path = Some(LightPath::Loop);
    subject
}

fn temperature(kelvin: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let light = lamp(DVec3::new(1.2, 2.0, 1.0), 1000.0);
    stage.light(Light { color: black_body_color(kelvin), ..light });
    precise(stage)
}
