//! Glass on the device against the truth in 64 bits: panes and balls, which are bodies of a known shape, and layers between the glass and the
//! picture.

use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::stage::{add, directional, exact, lambert, rectangle, stage};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{AlphaMode, Environment, Keep, LightPath, Material, Refraction, Scene, Settings, Transparency};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [97, 97];
const POINT: TruthOptions = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };

/// A wall of upright stripes, two metres behind the origin and wider than any ray through glass goes.
fn striped() -> Scene {
    let mut scene = stage();
    for index in -20..20 {
        let color = [Vec3::new(0.8, 0.2, 0.1), Vec3::new(0.1, 0.3, 0.8), Vec3::splat(0.5)][(index + 21) as usize % 3];
        let left = f64::from(index) * 0.5;
        let stripe = rectangle([left, -10.0], [left + 0.5, 10.0], -2.0);
        add(&mut scene, stripe, Material { base_color: color, ..lambert(1.0) }, DAffine3::IDENTITY);
    }
    scene.lights = vec![directional(DVec3::new(0.3, 0.2, 1.0), 3.0)];
    // Black, because rays let a pane mirror the space before it at its far side, too.
    scene.environment = Environment { background: Vec3::ZERO, ..Environment::default() };
    scene
}

fn with_body(mesh: shapes::MeshBuilder, material: Material, transform: DAffine3) -> Scene {
    let mut scene = striped();
    add(&mut scene, mesh, material, transform);
    scene
}

fn settings(light_path: LightPath) -> Settings {
    Settings { light_path, ..exact(SIZE[0], SIZE[1]) }
}

/// Returns the pixels' distances from the truth, relative to 1 nit, in order. The pixels lie in a box about the middle of the picture, `reach` pixels
/// to each side.
fn differences(gpu: &Gpu, scene: &Scene, settings: &Settings, reach: u32) -> Vec<f64> {
    let picture = gpu.draw(scene, settings);
    let view = CameraView { camera: scene.camera, size: picture.size };
    let truth = Reference::new(scene).expect("a scene").render(&view, &POINT, &|_, _| {});
    let middle = SIZE[0] / 2;
    let near = |&(x, y): &(u32, u32)| x.abs_diff(middle) <= reach && y.abs_diff(middle) <= reach;
    let lit = |x: u32, y: u32| DVec3::from_array(truth.radiance[(y * SIZE[0] + x) as usize]);
    let mut off: Vec<f64> =
        places(&picture).filter(near).map(|(x, y)| (nits(&picture, x, y) - lit(x, y)).abs().max_element()).collect();
    off.sort_by(f64::total_cmp);
    off
}

fn at(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

#[test]
fn a_pane_and_a_ball_show_what_is_behind_them_as_rays_do() {
    on_gpu(|gpu| {
        let body = Refraction { thickness: 0.4, ..Refraction::THIN };
        let green = Refraction { color: Vec3::new(0.2, 0.8, 0.3), distance: 0.4, ..body };
        let flint = Refraction { ior: 1.7, dispersion: 5.0, ..body };
        let pane = || shapes::cuboid([3.0, 3.0, 0.4]);
        let aslant = DAffine3::from_axis_angle(DVec3::Y, 0.5);
        let ball = |refraction| Material::clear_glass(Refraction { thickness: 1.0, ..refraction });
        let cases = [
            ("a pane", with_body(pane(), Material::clear_glass(body), aslant), [1e-3, 3e-3]),
            ("a green pane", with_body(pane(), Material::clear_glass(green), aslant), [1e-3, 3e-3]),
            ("a pane of flint", with_body(pane(), Material::clear_glass(flint), aslant), [2e-3, 6e-3]),
            (
                "a thin wall",
                with_body(rectangle([-1.0; 2], [1.0; 2], 0.0), Material::clear_glass(Refraction::THIN), aslant),
                [1e-6, 1e-5],
            ),
            ("a ball", with_body(shapes::sphere(0.5, 128), ball(body), DAffine3::IDENTITY), [1e-3, 3e-3]),
            ("a green ball", with_body(shapes::sphere(0.5, 128), ball(green), DAffine3::IDENTITY), [1e-3, 3e-3]),
        ];
        for (turn, (name, scene, [half, most])) in cases.into_iter().enumerate() {
            for path in
                [LightPath::Loop, LightPath::Forward, LightPath::Clustered].into_iter().skip(turn % 2).step_by(2)
            {
                // Within a ball of 48 pixels across.
                let off = differences(gpu, &scene, &settings(path), 13);
                println!("{name}, {path}: median {:.1e}, 0.85 {:.1e}", at(&off, 0.5), at(&off, 0.85));
                assert!(at(&off, 0.5) <= half && at(&off, 0.85) <= most, "{name}, {path}");
            }
        }
        // What these bounds hold against: without its body a ball is far off.
        let ball = with_body(shapes::sphere(0.5, 128), ball(body), DAffine3::IDENTITY);
        let mut faded = ball.clone();
        faded.materials.iter_mut().for_each(|own| own.refraction = None);
        let [truth, plain] = [&ball, &faded].map(|scene| gpu.draw(scene, &settings(LightPath::Loop)));
        let middle = SIZE[0] / 2;
        let differ = (middle - 12..middle + 12)
            .filter(|&x| (nits(&truth, x, middle) - nits(&plain, x, middle)).abs().max_element() > 0.1);
        assert!(differ.count() > 8);
    });
}

#[test]
fn rough_glass_blurs_as_rays_do() {
    on_gpu(|gpu| {
        let thin = Material { roughness: 0.4, ..Material::clear_glass(Refraction::THIN) };
        let thick =
            Material { roughness: 0.4, ..Material::clear_glass(Refraction { thickness: 0.4, ..Refraction::THIN }) };
        let cases = [
            ("a thin wall", with_body(rectangle([-1.0; 2], [1.0; 2], 0.0), thin, DAffine3::IDENTITY)),
            ("a pane", with_body(shapes::cuboid([3.0, 3.0, 0.4]), thick, DAffine3::IDENTITY)),
        ];
        for (name, scene) in cases {
            let view = CameraView { camera: scene.camera, size: SIZE };
            let many = TruthOptions { mode: Mode::Converged { samples: 256 }, ..POINT };
            let truth = Reference::new(&scene).expect("a scene").render(&view, &many, &|_, _| {});
            let picture = gpu.expose(&scene, &Settings { samples: 16, ..settings(LightPath::Loop) }, 0.0);
            let middle = SIZE[1] / 2;
            let row = |light: &dyn Fn(u32) -> DVec3| (20..77).map(light).collect::<Vec<_>>();
            let drawn = row(&|x| nits(&picture, x, middle));
            let traced = row(&|x| DVec3::from_array(truth.radiance[(middle * SIZE[0] + x) as usize]));
            let off = drawn.iter().zip(&traced).map(|(a, b)| (*a - *b).abs().max_element()).sum::<f64>() / 57.0;
            let spread = |row: &[DVec3]| {
                let mean = row.iter().sum::<DVec3>() / row.len() as f64;
                (row.iter().map(|own| (*own - mean).length_squared()).sum::<f64>() / row.len() as f64).sqrt()
            };
            println!("{name}: off {off:.3}, spread {:.3} and {:.3}", spread(&drawn), spread(&traced));
            assert!(off < 0.04, "{name}: {off}");
            // Stripes are blurred, and not gone.
            assert!((0.6..1.6).contains(&(spread(&drawn) / spread(&traced))), "{name}");
        }
    });
}

#[test]
fn glass_lets_layers_between_it_and_the_picture_be_seen() {
    on_gpu(|gpu| {
        let mut scene =
            with_body(rectangle([-1.0; 2], [1.0; 2], 0.0), Material::clear_glass(Refraction::THIN), DAffine3::IDENTITY);
        let without = gpu.draw(&scene, &settings(LightPath::Loop));
        let gauze = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..lambert(0.0) };
        add(&mut scene, rectangle([-1.0, -1.0], [0.0, 1.0], -0.5), gauze, DAffine3::IDENTITY);
        let with = gpu.draw(&scene, &settings(LightPath::Loop));
        let y = SIZE[1] / 2;
        let [left, right] = [30, 67].map(|x| nits(&with, x, y).element_sum() / nits(&without, x, y).element_sum());
        assert!((left - 0.5).abs() < 1e-3 && (right - 1.0).abs() < 1e-6, "{left} {right}");
    });
}

#[test]
fn glass_that_is_summed_up_in_any_order_fades_what_is_behind_it() {
    on_gpu(|gpu| {
        let red = Material { base_color: Vec3::X, ..Material::clear_glass(Refraction::THIN) };
        let scene = with_body(rectangle([-1.0; 2], [1.0; 2], 0.0), red, DAffine3::IDENTITY);
        let drawn = |transparency| {
            let settings = Settings { transparency, keep: Keep::default(), ..settings(LightPath::Loop) };
            nits(&gpu.draw(&scene, &settings), SIZE[0] / 2 + 8, SIZE[1] / 2)
        };
        let (tinted, faded) = (drawn(Transparency::Sorted), drawn(Transparency::Oit));
        assert!(tinted.y < 1e-6 && tinted.x > 0.1 && faded.y > 0.1, "{tinted} {faded}");
    });
}

#[test]
fn extreme_glass_is_finite() {
    on_gpu(|gpu| {
        let body = Refraction { thickness: 0.4, ..Refraction::THIN };
        for own in [
            Refraction { ior: 1.0, ..body },
            Refraction { ior: 100.0, dispersion: 40.0, ..body },
            Refraction { thickness: 1e-30, ..body },
            Refraction { thickness: 1e18, ..body },
            Refraction { color: Vec3::ZERO, distance: 1e-9, ..body },
            Refraction { color: Vec3::ZERO, distance: f32::INFINITY, ..body },
        ] {
            for roughness in [0.0, 1.0] {
                let material = Material { roughness, ..Material::clear_glass(own) };
                let scene = with_body(shapes::sphere(0.5, 24), material, DAffine3::IDENTITY);
                let picture = gpu.draw(&scene, &settings(LightPath::Loop));
                assert!(places(&picture).all(|(x, y)| nits(&picture, x, y).min_element() >= 0.0), "{own:?}");
                assert!(places(&picture).all(|(x, y)| nits(&picture, x, y).is_finite()), "{own:?}");
            }
        }
    });
}
