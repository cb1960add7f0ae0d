//! Highlights that are narrower than a pixel or wider than the picture, and surfaces seen and lit from where formulas divide by nothing.

use glam::{DAffine3, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{kept_in, lamp};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{Brdf, Camera, GbufferChoice, GbufferPreset, Material, Projection, TargetChoice};

pub const CASES: &[Case] = &[
    small("highlights/small-float32", [0.0, 1.0], 2e-4, |roughness| small_of(roughness, FLOAT32)),
    small("highlights/small-fat", [0.0, 1.0], 3e-2, |roughness| small_of(roughness, FAT)),
    // Of eight bits of roughness, r errs by 0.002, and the peak by 0.008 / r.
    small("highlights/small-lean", [0.05, 1.0], 0.15, |roughness| small_of(roughness, LEAN)),
    small("highlights/small-lean-rgba16f", [0.0, 1.0], 3e-2, |roughness| small_of(roughness, LEAN_RGBA16F)),
    wide("highlights/wide-float32", [0.0, 1.0], 3e-3, |roughness| wide_of(roughness, FLOAT32)),
    // Half floats of positions two metres away are a millimetre apart.
    wide("highlights/wide-fat", [0.1, 1.0], 6e-2, |roughness| wide_of(roughness, FAT)),
    wide("highlights/wide-lean", [0.05, 1.0], 0.15, |roughness| wide_of(roughness, LEAN)),
    wide("highlights/wide-lean-rgba16f", [0.1, 1.0], 2e-2, |roughness| wide_of(roughness, LEAN_RGBA16F)),
    phong("highlights/phong-float32", ROUNDED, |power| phong_of(power, Brdf::Phong, FLOAT32)),
    phong("highlights/phong-lean", EIGHT_BITS, |power| phong_of(power, Brdf::Phong, LEAN)),
    phong("highlights/blinn-phong-float32", ROUNDED, |power| phong_of(power, Brdf::BlinnPhong, FLOAT32)),
    phong("highlights/blinn-phong-lean", EIGHT_BITS, |power| phong_of(power, Brdf::BlinnPhong, LEAN)),
    case("highlights/metallic", "from no metal to all metal")
        .over(SHARES, "")
        .claim([0.0, 1.0], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Picture(|metallic| ball(Material { metallic: metallic as f32, ..colored() }))),
    case("highlights/albedo", "from black to white metal")
        .over(SHARES, "")
        .claim([0.0, 1.0], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Picture(|albedo| {
            ball(Material { metallic: 1.0, base_color: Vec3::splat(albedo as f32), ..colored() })
        })),
    case("highlights/lamp-at-eye", "a lamp so far beside the eye, on a smooth ball")
        .over(SweepValues::List(&[0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0]), "m")
        .claim([0.0, 1.0], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Picture(lamp_at_eye)),
    case("highlights/grazing", "eye and lamp so high over a smooth floor, face to face")
        .over(SweepValues::Decades(-7, 1), "m")
        .claim([1e-7, 10.0], GRAZED)
        .check(Check::Picture(|height| grazing([height, height]))),
    case("highlights/grazing-eye", "the eye so high over a smooth floor, the lamp well above")
        .over(SweepValues::Decades(-7, 1), "m")
        .claim([1e-7, 10.0], GRAZED)
        .check(Check::Picture(|height| grazing([height, 1.0]))),
    case("highlights/grazing-lamp", "a lamp so high over a smooth floor, the eye well above")
        .over(SweepValues::Decades(-7, 1), "m")
        // Nearer to the floor, the lamp's height is no more than the rounding of a place to f32.
        .claim([1e-4, 10.0], GRAZED)
        .check(Check::Picture(|height| grazing([1.0, height]))),
];

const FLOAT32: GbufferChoice = preset(GbufferPreset::Float32);
const FAT: GbufferChoice = preset(GbufferPreset::Fat);
const LEAN: GbufferChoice = preset(GbufferPreset::Lean);
const LEAN_RGBA16F: GbufferChoice = GbufferChoice { material: Some(TargetChoice::Rgba16f), ..LEAN };

const fn preset(preset: GbufferPreset) -> GbufferChoice {
    GbufferChoice { preset, position: None, normal: None, albedo: None, material: None }
}

const GRAZED: Bound = Bound { worst: 2e-3, mean: 2e-4 };
/// Of powers: near 1 the shader takes them by the sine, because a cosine there tells little of its angle.
const ROUNDED: Bound = Bound { worst: 5e-3, mean: 5e-4 };
/// A code is a factor of 2^(20 / 255) of the power, and the power errs by half of that at most.
const EIGHT_BITS: Bound = Bound { worst: 0.1, mean: 0.02 };

const ROUGHNESS: SweepValues =
    SweepValues::List(&[0.0, 1e-4, 1e-3, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0]);
const SHARES: SweepValues = SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.999, 1.0]);

const fn small(name: &'static str, claim: [f64; 2], worst: f64, subject: fn(f64) -> Subject) -> Case {
    let extreme = "smoother and smoother, highlights far smaller than a pixel; errors of each pixel";
    let bound = Bound { worst, mean: 0.1 * worst };
    Case { name, extreme, unit: "", values: ROUGHNESS, claim, bound, check: Check::Picture(subject) }
}

const fn wide(name: &'static str, claim: [f64; 2], worst: f64, subject: fn(f64) -> Subject) -> Case {
    let extreme = "smoother and smoother, seen so closely that the highlight fills the picture; errors of its peak";
    let bound = Bound { worst, mean: 0.5 * worst };
    Case { name, extreme, unit: "", values: ROUGHNESS, claim, bound, check: Check::Picture(subject) }
}

const fn phong(name: &'static str, bound: Bound, subject: fn(f64) -> Subject) -> Case {
    case(name, "powers of the Phong models, seen so closely that the highlight fills the picture; errors of its peak")
        .over(SweepValues::List(&[0.0, 1e-3, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6]), "")
        .claim([0.0, 1e6], bound)
        .check(Check::Picture(subject))
}

fn colored() -> Material {
    Material { name: "smooth".into(), base_color: Vec3::new(0.9, 0.6, 0.3), roughness: 0.3, ..Material::default() }
}

/// A metre wide, and a lamp above and behind the eye.
fn ball(material: Material) -> Subject {
    let mut stage = SceneBuilder::default();
    let material = stage.material(material);
    stage.add("ball", shapes::sphere(0.5, 96), material);
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 0.3, 1.5), DVec3::ZERO, DVec3::Y);
    stage.light(lamp(DVec3::new(1.0, 2.0, 3.0), 1000.0));
    Subject::with(stage.scene, kept_in(FLOAT32))
}

fn small_of(roughness: f64, gbuffer: GbufferChoice) -> Subject {
    let material = Material { metallic: 1.0, roughness: roughness as f32, ..colored() };
    Subject { settings: kept_in(gbuffer), ..ball(material) }
}

/// A ball of ten metres that fills the view from two metres away, with a lamp beside the eye. `angle`: how far, in radians, the ball's normal
/// leans away at the edge of the picture, about.
fn close_up(angle: f64, material: Material, gbuffer: GbufferChoice) -> Subject {
    let mut stage = SceneBuilder::default();
    let material = stage.material(material);
    let ball = stage.mesh("ball", shapes::sphere(10.0, 64), material);
    // Turned so that no normal is an axis.
    let turned = glam::DQuat::from_rotation_x(0.7) * glam::DQuat::from_rotation_y(0.4);
    stage.place(ball, material, DAffine3::from_quat(turned));
    let out = DVec3::new(0.3, 0.5, 0.8).normalize();
    let aside = out.any_orthonormal_vector();
    let camera = Camera::looking_at(out * 12.0, out * 10.0, aside.cross(out));
    // Half of the view; at that angle the ball's normal leans as much as the ray, and five times that less.
    let half = (angle / 1.2).min(0.5);
    stage.scene.camera = Camera { projection: Projection::perspective((2.0 * half).to_degrees().max(0.002)), ..camera };
    // So little aside that the highlight stays in the middle.
    stage.light(lamp(out * 12.5 + aside * (0.5 * half), 1000.0));
    Subject { floor: 1.0, ..Subject::with(stage.scene, kept_in(gbuffer)) }
}

fn wide_of(roughness: f64, gbuffer: GbufferChoice) -> Subject {
    // As smooth as the model goes.
    let alpha = roughness.max(0.01).powi(2);
    close_up(3.0 * alpha, Material { metallic: 1.0, roughness: roughness as f32, ..colored() }, gbuffer)
}

fn phong_of(power: f64, brdf: Brdf, gbuffer: GbufferChoice) -> Subject {
    let material = Material {
        brdf,
        shininess: power as f32,
        specular: Vec3::new(0.9, 0.6, 0.3),
        base_color: Vec3::splat(0.1),
        ..colored()
    };
    // The angle at which cos^n is a tenth.
    close_up((4.6 / power.max(1.0)).sqrt(), material, gbuffer)
}

fn lamp_at_eye(metres: f64) -> Subject {
    let mut subject = ball(Material { metallic: 1.0, roughness: 0.1, ..colored() });
    let camera = subject.scene.camera;
    subject.scene.lights = vec![lamp(camera.position + camera.right() * metres, 1000.0)];
    subject
}

/// A floor that is seen over its whole depth, the lamp at its far end.
fn grazing([eye, light]: [f64; 2]) -> Subject {
    let mut stage = SceneBuilder::default();
    let smooth = stage.material(Material { roughness: 0.2, ..colored() });
    stage.add("floor", shapes::plane([20.0, 20.0]), smooth);
    // And a ball to be seen where the floor is not.
    let ball = stage.mesh("ball", shapes::sphere(0.5, 96), smooth);
    stage.place(ball, smooth, DAffine3::from_translation(DVec3::new(1.0, 0.5, -2.0)));
    let position = DVec3::new(0.0, eye, 2.0);
    let camera = Camera::looking_at(position, DVec3::new(0.0, 0.0, -2.0), DVec3::Y);
    stage.scene.camera = Camera { near: 1e-3 * eye.min(1.0), ..camera };
    stage.light(lamp(DVec3::new(0.0, light, -6.0), 1000.0));
    Subject::with(stage.scene, kept_in(FLOAT32))
}
