//! Shadows at the limits of maps. Ambient light is as bright as the lamp's, so that a pixel in which a shadow is missing, or too
//! much, errs by about 1 and the mean error is the share of such pixels, with any filter of edges.

use glam::{DAffine3, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{kept_in, lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    Camera, CastsShadow, Environment, GbufferChoice, Light, LightKind, Material, Projection, SettingsPatch,
    TargetChoice,
};

pub const CASES: &[Case] = &[
    case("shadows/elevation", "a sun so high above the horizon")
        .over(ELEVATIONS, "degrees")
        .claim([0.0, 90.0], wrong(5e-4))
        .check(Check::Picture(elevation)),
    case("shadows/wall", "a sun so far from parallel to a wall")
        .over(SLANTS, "degrees")
        .claim([-90.0, 90.0], wrong(6e-4))
        .check(Check::Picture(wall)),
    case("shadows/contact", "a box so high above the floor")
        .over(SweepValues::Decades(-7, 0), "m")
        .claim([1e-7, 1.0], wrong(3e-4))
        .check(Check::Picture(contact)),
    case("shadows/thin", "a wall so thick")
        .over(SweepValues::Decades(-7, 0), "m")
        // At 0.1 m a whole row of pixels sees the wall's upper edge, within half a texel of where it ends.
        .claim([1e-7, 1.0], wrong(6e-3))
        .check(Check::Picture(thin)),
    case("shadows/thin-lamp", "the same before a lamp")
        .over(SweepValues::Decades(-7, 0), "m")
        .claim([1e-7, 1.0], wrong(2e-4))
        .check(Check::Picture(thin_lamp)),
    case("shadows/receiver", "a floor so wide under a ball of a metre")
        .over(SweepValues::Decades(1, 7), "m")
        // The near cascade's texels are larger than the ball from 10 km on.
        .claim([10.0, 1e3], wrong(2e-3))
        .check(Check::Picture(receiver)),
    case("shadows/cascades", "a ball so far off, and as large, on a floor of 200 km")
        .over(SweepValues::Decades(0, 5), "m")
        // The default cascades split the view more evenly than the balls are spaced, and begin at a thousandth of the view's depth.
        .claim([1e3, 1e5], wrong(5e-3))
        .check(Check::Picture(|metres| cascades(metres, None))),
    case("shadows/cascades-log", "the same with cascades that part the view by its logarithm")
        .over(SweepValues::Decades(0, 5), "m")
        .claim([1.0, 1e5], wrong(3e-3))
        .check(Check::Picture(|metres| cascades(metres, Some(1.0)))),
    case("shadows/inside", "a lamp so far from the middle of a ball")
        .over(RADII, "radii")
        .claim([0.0, 2.0], wrong(3e-4))
        .check(Check::Picture(inside)),
    case("shadows/casters", "so many casters, smaller the more there are")
        .over(SweepValues::List(&[0.0, 1.0, 2.0, 10.0, 100.0, 1000.0]), "")
        .claim([0.0, 1000.0], wrong(3e-3))
        .check(Check::Picture(casters)),
    case("shadows/camera-inside", "the eye inside of a caster so large")
        .over(SweepValues::Decades(-3, 2), "m")
        .claim([1e-3, 100.0], wrong(2e-4))
        .check(Check::Picture(camera_inside)),
    case("shadows/high", "a caster so high above all that is seen")
        .over(SweepValues::Decades(0, 7), "m")
        // Cascades part the view as far as the scene goes, upwards too.
        .claim([1.0, 100.0], wrong(5e-4))
        .check(Check::Picture(high)),
    case("shadows/near-lamp", "a caster so near to the lamp, and as small")
        .over(SweepValues::Decades(-9, 0), "m")
        .claim([1e-9, 1.0], wrong(2e-4))
        .check(Check::Picture(near_lamp)),
];

const ELEVATIONS: SweepValues =
    SweepValues::List(&[0.0, 1e-6, 1e-3, 0.01, 0.1, 0.3, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 89.0, 89.999, 90.0]);
const SLANTS: SweepValues = SweepValues::List(&[
    -90.0, -30.0, -10.0, -3.0, -1.0, -0.1, -1e-3, -1e-6, 0.0, 1e-6, 1e-3, 0.1, 1.0, 3.0, 10.0, 30.0, 90.0,
]);
const RADII: SweepValues = SweepValues::List(&[0.0, 1e-6, 0.5, 0.9, 0.99, 1.01, 1.1, 1.5, 2.0]);

/// Claims that at most this share of pixels is wrong.
const fn wrong(share: f64) -> Bound {
    Bound { worst: 1.0, mean: share }
}

/// With all of the G-buffer as it is by default but albedo, whose eight bits err by more than a shadow's edge.
fn exact_but_shadows(stage: SceneBuilder) -> Subject {
    let gbuffer = GbufferChoice { albedo: Some(TargetChoice::Rgba32f), ..GbufferChoice::default() };
    Subject::with(stage.scene, kept_in(gbuffer))
}

/// Adds ambient light that makes an upright surface as bright as direct light of `lux` does.
fn ambient(stage: &mut SceneBuilder, lux: f64) {
    let ambient = Vec3::splat((lux / std::f64::consts::PI) as f32);
    stage.scene.environment = Environment { ambient, ..Environment::default() };
}

/// A hard-edged sun that stands in a direction.
fn sun(stage: &mut SceneBuilder, towards: DVec3) {
    let kind = LightKind::Directional { direction: -towards.normalize() };
    stage.light(Light { kind, casts_shadow: true, ..lamp(DVec3::ZERO, 1000.0) });
    ambient(stage, 1000.0);
}

/// A lamp with a shadow that makes about 1000 lux at this distance.
fn shadowing_lamp(stage: &mut SceneBuilder, position: DVec3, metres: f64) {
    stage.light(Light { casts_shadow: true, ..lamp(position, (1000.0 * metres * metres) as f32) });
    ambient(stage, 1000.0);
}

fn matt(stage: &mut SceneBuilder) -> usize {
    stage.material(Material {
        name: "plaster".into(),
        base_color: Vec3::splat(0.6),
        roughness: 1.0,
        ..Material::default()
    })
}

fn place(stage: &mut SceneBuilder, size: [f64; 3], at: DVec3) {
    let plaster = matt(stage);
    let mesh = stage.mesh("box", shapes::cuboid(size), plaster);
    stage.place(mesh, plaster, DAffine3::from_translation(at));
}

fn elevation(degrees: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let (sin, cos) = degrees.to_radians().sin_cos();
    sun(&mut stage, DVec3::new(0.8 * cos, sin, 0.6 * cos));
    exact_but_shadows(stage)
}

fn wall(degrees: f64) -> Subject {
    let mut stage = sphere_on_floor();
    place(&mut stage, [4.0, 2.0, 0.5], DVec3::new(0.0, 1.0, -1.25));
    // The wall faces +Z.
    let (sin, cos) = degrees.to_radians().sin_cos();
    sun(&mut stage, DVec3::new(0.6 * cos, 0.8 * cos, sin));
    exact_but_shadows(stage)
}

fn contact(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    place(&mut stage, [1.0, 0.5, 1.0], DVec3::new(1.0, 0.25 + metres, 0.5));
    sun(&mut stage, DVec3::new(-0.4, 1.0, 0.8));
    stage.scene.camera = Camera::looking_at(DVec3::new(0.5, 0.8, 3.0), DVec3::new(0.7, 0.2, 0.0), DVec3::Y);
    exact_but_shadows(stage)
}

/// The sun is behind the wall, and the eye before it.
fn behind_wall(metres: f64) -> SceneBuilder {
    let mut stage = sphere_on_floor();
    place(&mut stage, [6.0, 1.5, metres], DVec3::new(0.0, 0.75, -0.8));
    stage
}

fn thin(metres: f64) -> Subject {
    let mut stage = behind_wall(metres);
    sun(&mut stage, DVec3::new(0.1, 0.5, -0.7));
    exact_but_shadows(stage)
}

fn thin_lamp(metres: f64) -> Subject {
    let mut stage = behind_wall(metres);
    shadowing_lamp(&mut stage, DVec3::new(0.5, 1.2, -2.5), 2.5);
    exact_but_shadows(stage)
}

fn receiver(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    // The floor is eight metres wide.
    stage.scene.objects[0].transform = DAffine3::from_scale(DVec3::splat(metres / 8.0));
    sun(&mut stage, DVec3::new(0.5, 1.0, 0.3));
    exact_but_shadows(stage)
}

fn cascades(metres: f64, lambda: Option<f32>) -> Subject {
    let mut stage = SceneBuilder::default();
    let plaster = matt(&mut stage);
    stage.add("land", shapes::plane([2e5; 2]), plaster);
    let ball = stage.mesh("ball", shapes::sphere(1.0, 48), plaster);
    for decade in 0..=5 {
        let far = 10f64.powi(decade);
        // Beside one another as seen from the eye.
        let place = DVec3::new((f64::from(decade) - 2.5) * 0.3 * far, 0.1 * far, -far);
        stage.place(
            ball,
            plaster,
            DAffine3::from_scale_rotation_translation(DVec3::splat(0.1 * far), glam::DQuat::IDENTITY, place),
        );
    }
    // The camera looks at the ball of this decade.
    let decade = metres.log10().round() - 2.5;
    let eye = DVec3::new(0.0, 0.3, 0.0);
    let camera = Camera::looking_at(eye, DVec3::new(decade * 0.3 * metres, 0.05 * metres, -metres), DVec3::Y);
    stage.scene.camera = Camera { projection: Projection::perspective(25.0), ..camera };
    sun(&mut stage, DVec3::new(0.5, 1.0, 0.3));
    let subject = exact_but_shadows(stage);
    Subject { settings: SettingsPatch { cascades: Some(4), shadow_lambda: lambda, ..subject.settings }, ..subject }
}

fn inside(radii: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let out = DVec3::new(0.5, 0.8, 0.3).normalize();
    shadowing_lamp(&mut stage, DVec3::new(0.0, 0.5, 0.0) + out * (0.5 * radii), 1.0);
    exact_but_shadows(stage)
}

/// Pegs in a square beside the sphere. Neither the sphere nor the floor casts a shadow.
fn casters(count: f64) -> Subject {
    let mut stage = sphere_on_floor();
    for object in &mut stage.scene.objects {
        object.casts_shadow = CastsShadow::No;
    }
    let plaster = matt(&mut stage);
    let edge = count.sqrt().ceil().max(1.0);
    let peg = stage.mesh("peg", shapes::cuboid([1.0 / edge, 0.4, 1.0 / edge]), plaster);
    for index in 0..count as usize {
        let (row, column) = ((index as f64 / edge).floor(), index as f64 % edge);
        let place = DVec3::new((column / edge - 0.5) * 4.0, 0.2, 0.6 + row / edge * 2.0);
        stage.place(peg, plaster, DAffine3::from_translation(place));
    }
    sun(&mut stage, DVec3::new(0.5, 1.0, 0.3));
    exact_but_shadows(stage)
}

/// Nobody sees it from inside, but its shadow.
fn camera_inside(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let plaster = matt(&mut stage);
    let shell = stage.mesh("shell", shapes::cuboid([metres; 3]), plaster);
    stage.place(shell, plaster, DAffine3::from_translation(stage.scene.camera.position));
    sun(&mut stage, DVec3::new(0.3, 1.0, 1.2));
    exact_but_shadows(stage)
}

fn high(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let towards = DVec3::new(0.5, 1.0, 0.3);
    place(&mut stage, [1.0, 0.1, 1.0], DVec3::new(1.2, 0.0, 0.8) + towards * metres);
    sun(&mut stage, towards);
    exact_but_shadows(stage)
}

fn near_lamp(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    let position = DVec3::new(1.2, 2.0, 1.0);
    let size = 0.3 * metres;
    place(&mut stage, [size, 0.1 * size, size], position - DVec3::new(0.2, 1.0, 0.1) * metres);
    shadowing_lamp(&mut stage, position, 2.0);
    exact_but_shadows(stage)
}
