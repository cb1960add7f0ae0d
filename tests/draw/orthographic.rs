//! A camera of parallel rays shows the same as the truth, by every light path and layout.

use crate::common::gpu::{Gpu, code, floats, nits, on_gpu, places};
use crate::common::some_in_turn;
use crate::common::stage::{add, directional, exact, gbuffer, lambert, open, plane, point, rectangle, spot, sun};
use afterlight::frame::Picture;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Brdf, Camera, Falloff, LightPath, Material, Output, Projection, Scene, Settings, ShadowFilter,
    ShadowSettings, Transparency, View,
};
use afterlight_truth::reference::{CameraView as Eye, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [133, 75];

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// Things of several reflection models on a floor, seen from above and from the side, in the light of lamps of every kind.
fn still_life() -> Scene {
    let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.2, quadratic: 3.0 };
    let lights = vec![
        sun(DVec3::new(0.4, 1.0, 0.6), 0.5),
        point(DVec3::new(-1.0, 1.5, 1.0), 1.0, Some(4.0), Falloff::InverseSquare),
        point(DVec3::new(1.2, 0.8, 0.4), 0.5, Some(2.0), Falloff::Quadratic),
        point(DVec3::new(0.2, 1.4, -1.0), 0.3, Some(3.0), polynomial),
        spot(DVec3::new(0.0, 2.0, 0.5), 2.0, 10.0, 35.0),
    ];
    let mut scene = plane(lambert(0.7), lights);
    scene.name = "still life".into();
    scene.objects.clear();
    let shiny =
        |brdf| Material { brdf, specular: Vec3::splat(0.3), shininess: 20.0, roughness: 0.4, ..Material::default() };
    add(&mut scene, shapes::plane([6.0, 6.0]), lambert(0.7), at(0.0, 0.0, 0.0));
    add(&mut scene, shapes::cuboid([0.5; 3]), shiny(Brdf::Phong), at(-0.8, 0.25, 0.3));
    add(&mut scene, shapes::sphere(0.4, 24), shiny(Brdf::CookTorrance), at(0.0, 0.4, 0.2));
    add(&mut scene, shapes::sphere(0.3, 24), shiny(Brdf::BlinnPhong), at(0.8, 0.3, 0.0));
    scene.environment.ambient = Vec3::splat(0.02);
    scene.environment.background = Vec3::new(0.05, 0.1, 0.3);
    scene.camera = Camera {
        projection: Projection::orthographic(2.0),
        near: 0.01,
        ..Camera::looking_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.2, 0.0), DVec3::Y)
    };
    scene
}

fn truth(scene: &Scene, shadows: bool) -> Vec<[f64; 3]> {
    let options = TruthOptions { mode: Mode::Point, smith: Smith::default() };
    let eye = Eye { camera: scene.camera, size: SIZE };
    Reference::new(scene).expect("a scene").with_shadows(shadows).render(&eye, &options, &|_, _| {}).radiance
}

/// Share of the pixels that are off by more than `bound` of their light, or of a hundredth of the picture's.
fn share_off(picture: &Picture, truth: &[[f64; 3]], bound: f64) -> f64 {
    let brightest = truth.iter().flatten().fold(0.0, |most: f64, &value| most.max(value));
    let off = |(pixel, truth): (&[f32], &[f64; 3])| {
        let scale = truth.iter().fold(0.01 * brightest, |most, &value| most.max(value));
        pixel.iter().zip(truth).any(|(&drawn, &value)| (f64::from(drawn) - value).abs() > bound * scale)
    };
    let count = floats(picture).chunks_exact(4).map(|pixel| &pixel[..3]).zip(truth).filter(|&pair| off(pair)).count();
    count as f64 / truth.len() as f64
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn every_light_path_and_layout_shows_what_the_truth_shows() {
    on_gpu(|gpu| {
        let scene = still_life();
        let shadows = ShadowSettings { enabled: false, ..ShadowSettings::default() };
        let expected = truth(&scene, false);
        let layouts = [("float32", 1e-4), ("float32,position=rgba32f", 1e-4), ("lean", 0.03), ("fat", 0.03)];
        for (turn, &(name, light_path)) in LightPath::NAMES.iter().enumerate() {
            // The bounds of 3% are for positions in half floats and normals in 16 bits, whose errors are not the camera's doing.
            for (layout, bound) in some_in_turn(&layouts, turn, 2) {
                let settings = Settings { light_path, shadows, gbuffer: gbuffer(layout), ..exact(SIZE[0], SIZE[1]) };
                let off = share_off(&gpu.draw(&scene, &settings), &expected, bound);
                println!("{name} {layout}: {:.2}% of the pixels are off by more than {bound}", 100.0 * off);
                // Edges of triangles are seen from either side.
                assert!(off < 0.005, "{name} {layout}: {off}");
            }
        }
    });
}

#[test]
fn shadows_lie_where_the_truth_has_them() {
    on_gpu(|gpu| {
        let mut scene = still_life();
        for light in &mut scene.lights {
            light.casts_shadow = true;
        }
        let expected = truth(&scene, true);
        let without = truth(&scene, false);
        let shadowed = expected.iter().zip(&without).filter(|(a, b)| a != b).count() as f64 / expected.len() as f64;
        for cascades in [1, 3] {
            for filter in [ShadowFilter::None, ShadowFilter::Box2, ShadowFilter::Poisson] {
                let shadows = ShadowSettings { size: 1024, cascades, filter, ..ShadowSettings::default() };
                let settings = Settings { shadows, ..exact(SIZE[0], SIZE[1]) };
                let off = share_off(&gpu.draw(&scene, &settings), &expected, 0.05);
                println!(
                    "{cascades} cascades, {filter}: {:.2}% off, of {:.0}% in shadow",
                    100.0 * off,
                    100.0 * shadowed
                );
                assert!(shadowed > 0.2 && off < 0.05, "{cascades} {filter}: {off} {shadowed}");
            }
        }
    });
}

#[test]
fn what_is_seen_through_is_sorted_along_the_rays() {
    on_gpu(|gpu| {
        // Beside each other in the picture's depth order, and the other way around by their distance from the eye.
        let mut scene = still_life();
        scene.camera = Camera { position: DVec3::new(0.0, 0.0, 2.0), ..Camera::default() };
        scene.camera.projection = Projection::orthographic(8.0);
        scene.objects.clear();
        let sheet = |albedo: Vec3| Material {
            base_color: albedo,
            alpha: 0.5,
            alpha_mode: AlphaMode::Blend,
            two_sided: true,
            ..lambert(1.0)
        };
        add(&mut scene, rectangle([-3.0, -3.0], [3.0, 3.0], -1.0), lambert(0.5), DAffine3::IDENTITY);
        // The near one's middle is far to the side, and so farther from the eye.
        add(&mut scene, rectangle([-1.0, -1.0], [6.5, 1.0], 0.5), sheet(Vec3::X), DAffine3::IDENTITY);
        add(&mut scene, rectangle([-1.0, -1.0], [1.0, 1.0], 0.0), sheet(Vec3::Y), DAffine3::IDENTITY);
        scene.lights = vec![directional(DVec3::Z, 3.0)];
        let expected = truth(&scene, false);
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            for light_path in [LightPath::Loop, LightPath::Forward] {
                let settings = Settings { transparency, light_path, ..exact(SIZE[0], SIZE[1]) };
                let picture = gpu.draw(&scene, &settings);
                let middle = nits(&picture, SIZE[0] / 2, SIZE[1] / 2);
                if transparency == Transparency::Sorted {
                    let off = share_off(&picture, &expected, 1e-3);
                    assert!(off < 0.005, "{light_path}: {off}");
                }
                // The red one lies before the green one.
                assert!(middle.x > middle.y && middle.y > middle.z, "{transparency} {light_path}: {middle}");
            }
        }
    });
}

/// The share of pixels that are shaded sample by sample.
fn share_split(gpu: &Gpu, scene: &Scene) -> f64 {
    let settings = Settings { msaa: 4, view: View::Complexity, output: Output::Srgb8, ..exact(SIZE[0], SIZE[1]) };
    let picture = gpu.draw(scene, &settings);
    let corner = code(&picture, 0, 0);
    let split = places(&picture).filter(|&(x, y)| code(&picture, x, y) != corner).count();
    split as f64 / f64::from(SIZE[0] * SIZE[1])
}

#[test]
fn samples_of_a_slanting_plane_agree_and_those_of_an_edge_do_not() {
    on_gpu(|gpu| {
        if gpu.device.physical.attachment_samples().as_raw() & 4 == 0 {
            return crate::common::gpu::not_run("the device has no 4 samples");
        }
        for (tilt, far) in [(0.0, 0.0), (1.2, 0.0), (1.4, 1e4)] {
            let mut scene = plane(lambert(0.7), vec![sun(DVec3::new(0.1, 0.3, 1.0), 1.0)]);
            scene.objects.clear();
            let turned = DAffine3::from_rotation_x(tilt);
            add(&mut scene, rectangle([-90.0, -90.0], [90.0, 90.0], 0.0), lambert(0.6), turned);
            scene.camera.projection = Projection::orthographic(2.0);
            scene.camera.position += DVec3::Z * (200.0 + far);
            assert_eq!(share_split(gpu, &scene), 0.0, "{tilt}");
            add(&mut scene, rectangle([-0.2, -0.2], [0.3, 0.3], 100.0), lambert(0.2), DAffine3::from_rotation_z(0.3));
            let split = share_split(gpu, &scene);
            assert!(split > 0.005 && split < 0.05, "{tilt}: {split}");
        }
    });
}

#[test]
fn frames_of_one_projection_refuse_a_camera_of_the_other() {
    on_gpu(|gpu| {
        let scene = still_life();
        let mut renderer = gpu.renderer(&scene, &exact(16, 9));
        let perspective = Camera { projection: Projection::perspective(60.0), ..scene.camera };
        let refused = renderer.render(&perspective).expect_err("refused").to_string();
        assert!(refused.contains("perspective") && refused.contains("orthographic"), "{refused}");
        let wider = Camera { projection: Projection::orthographic(3.0), ..scene.camera };
        renderer.render(&wider).expect("another height is no other plan");
    });
}

#[test]
fn views_tell_places_from_where_the_camera_stands_however_far_that_is() {
    on_gpu(|gpu| {
        let mut scene = open("builtin:quad");
        scene.camera = Camera {
            projection: Projection::orthographic(1.0),
            ..Camera::looking_at(DVec3::new(0.0, 0.0, 4096.0), DVec3::ZERO, DVec3::Y)
        };
        let of = |view| gpu.draw(&scene, &Settings { view, ..exact(33, 33) });
        let (depth, place) = (nits(&of(View::Depth), 16, 16), nits(&of(View::Position), 16, 16));
        assert!((depth.x - 4096.0).abs() < 1e-2 && (place - DVec3::NEG_Z * 4096.0).length() < 1e-2, "{depth} {place}");
    });
}
