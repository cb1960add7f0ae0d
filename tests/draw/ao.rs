//! Ambient occlusion in frames: none where nothing occludes, the same on every path, and near the f64 march of the same depths.

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::stage::{add, exact, lambert, open, own, plane, rectangle};
use afterlight::plan::FramePlan;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AmbientOcclusion, AoResolution, Brdf, Environment, LightPath, Material, Output, Projection, Scene, Settings, View,
};
use afterlight_truth::reference;
use afterlight_truth::reference::depth_march::{DepthBuffer, March};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [96, 54];

/// Leaves a scene nothing but white ambient light.
fn ambient(mut scene: Scene) -> Scene {
    scene.environment = Environment { ambient: Vec3::ONE, background: Vec3::splat(0.25), ground: None };
    scene.lights.clear();
    scene
}

/// Boxes on a floor, seen from above at a slant.
fn boxes() -> Scene {
    let mut scene = ambient(plane(lambert(0.5), Vec::new()));
    for (place, edge) in [(DVec3::new(-0.4, 0.1, 0.2), 0.4), (DVec3::new(0.3, -0.2, 0.1), 0.2)] {
        add(&mut scene, shapes::cuboid([edge; 3]), lambert(0.5), DAffine3::from_translation(place));
    }
    add(&mut scene, rectangle([-1.5, 0.0], [1.5, 0.8], 0.0), lambert(0.5), upright());
    scene.camera = afterlight::scene::Camera::looking_at(DVec3::new(0.3, -1.6, 1.4), DVec3::ZERO, DVec3::Z);
    scene
}

/// A wall at y = 0.7 that faces the camera.
fn upright() -> DAffine3 {
    DAffine3::from_translation(DVec3::Y * 0.7) * DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2)
}

fn with(ao: AmbientOcclusion, settings: &Settings) -> Settings {
    Settings { ao, ..settings.clone() }
}

/// Draws a view, with its values as they are.
fn shown(gpu: &Gpu, scene: &Scene, settings: &Settings, view: View) -> Vec<[f64; 3]> {
    let settings = Settings { view, output: Output::Nits, ..settings.clone() };
    let picture = gpu.renderer(scene, &settings).picture(&scene.camera, || ()).expect("a picture");
    floats(&picture).chunks_exact(4).map(|texel| [0, 1, 2].map(|channel| f64::from(texel[channel]))).collect()
}

#[test]
fn a_surface_alone_keeps_all_of_its_light() {
    on_gpu(|gpu| {
        let scene = ambient(plane(lambert(0.5), Vec::new()));
        for method in [AmbientOcclusion::Ssao, AmbientOcclusion::Bitmask] {
            for (ao_radius, ao_resolution) in [
                (0.001, AoResolution::Full),
                (0.3, AoResolution::Full),
                (0.3, AoResolution::Half),
                (1000.0, AoResolution::Full),
            ] {
                let settings = Settings { ao_radius, ao_resolution, ..with(method, &exact(SIZE[0], SIZE[1])) };
                let found = shown(gpu, &scene, &settings, View::Ao);
                // The plane occludes itself by less than half a sector of 32 and half a code of 1023, which rounds to nothing.
                assert!(found.iter().all(|open| open[0] == 1.0 || open[0] == 0.0), "{method} {ao_radius}");
                assert!(found.iter().any(|open| open[0] == 1.0));
            }
        }
    });
}

#[test]
fn ambient_light_is_times_what_the_view_shows_and_no_other_light_is_on_every_path() {
    on_gpu(|gpu| {
        let mut scene = boxes();
        let settings = Settings { light_path: LightPath::Loop, ..exact(SIZE[0], SIZE[1]) };
        let plain = shown(gpu, &scene, &settings, View::Final);
        let bitmask = with(AmbientOcclusion::Bitmask, &settings);
        let open = shown(gpu, &scene, &bitmask, View::Ao);
        let occluded = shown(gpu, &scene, &bitmask, View::Final);
        let mut darker = 0;
        for ((plain, open), found) in plain.iter().zip(&open).zip(&occluded) {
            // The background is no surface: the view shows black there.
            let wanted = if open[0] == 0.0 { plain[0] } else { plain[0] * open[0] };
            assert!((found[0] - wanted).abs() <= 1e-6 * plain[0], "{found:?} {plain:?} {open:?}");
            darker += usize::from(found[0] < 0.9 * plain[0]);
        }
        assert!(darker > open.len() / 20, "{darker}");

        // Each lamp adds the same light as without occlusion.
        let lamp = crate::common::stage::point(
            DVec3::new(0.2, -0.5, 1.0),
            2.0,
            Some(4.0),
            afterlight::scene::Falloff::InverseSquare,
        );
        scene.lights = vec![lamp; 3];
        let lit = shown(gpu, &scene, &settings, View::Final);
        let paths =
            [LightPath::Loop, LightPath::PerLight, LightPath::Volumes, LightPath::Clustered, LightPath::Compute];
        for light_path in paths {
            let both = shown(gpu, &scene, &Settings { light_path, ..bitmask.clone() }, View::Final);
            for (index, found) in both.iter().enumerate() {
                let wanted = lit[index][0] - plain[index][0] + occluded[index][0];
                assert!((found[0] - wanted).abs() <= 1e-5 * lit[index][0].max(1.0), "{light_path} {found:?} {wanted}");
            }
        }
    });
}

/// The root mean square of the distance between a frame's occlusion and the march's of the same depths and normals.
fn own_error(gpu: &Gpu, scene: &Scene, settings: &Settings) -> f64 {
    let found = shown(gpu, scene, settings, View::Ao);
    let normals = shown(gpu, scene, settings, View::Normal);
    let distances: Vec<f64> = shown(gpu, scene, settings, View::Depth)
        .iter()
        .map(|at| if at[0] > 0.0 { at[0] } else { f64::INFINITY })
        .collect();
    let view = reference::CameraView { camera: scene.camera, size: settings.size };
    let depths = DepthBuffer { view, distances: &distances };
    let march = March::fine(f64::from(settings.ao_radius));
    let (mut squares, mut count) = (0.0, 0);
    for (index, open) in found.iter().enumerate().filter(|(index, _)| distances[*index].is_finite()) {
        let [width, _] = settings.size;
        let pixel = [index as u32 % width, index as u32 / width];
        let normal = DVec3::from_array(normals[index]).normalize();
        squares += (open[0] - depths.visibility(pixel, normal, &march)).powi(2);
        count += 1;
    }
    (squares / f64::from(count)).sqrt()
}

#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn slices_come_to_what_the_march_of_the_same_depths_does_the_nearer_the_more_samples_there_are() {
    on_gpu(|gpu| {
        let perspective = boxes();
        let mut orthographic = boxes();
        orthographic.camera.projection = Projection::Orthographic { height: 2.0 };
        for (name, scene) in [("perspective", perspective), ("orthographic", orthographic)] {
            let settings = Settings { ao_radius: 0.3, ..with(AmbientOcclusion::Bitmask, &exact(SIZE[0], SIZE[1])) };
            let error = |ao_samples| own_error(gpu, &scene, &Settings { ao_samples, ..settings.clone() });
            let errors = [4, 16, 64].map(error);
            println!("{name}: {errors:?}");
            // Bounds of a pass against rays hold all the more against the march.
            assert!(errors[1] < 0.05 && errors[2] < 0.04, "{name}: {errors:?}");
            assert!(errors[0] > errors[1] && errors[1] > errors[2], "{name}: {errors:?}");
            let ssao = own_error(gpu, &scene, &Settings { ao_samples: 64, ..with(AmbientOcclusion::Ssao, &settings) });
            assert!(ssao > errors[1], "{name}: {ssao} {errors:?}");
        }
    });
}

#[test]
fn frames_of_a_picture_differ_in_what_is_random_and_their_mean_is_nearer() {
    on_gpu(|gpu| {
        let scene = boxes();
        let settings = Settings { ao_radius: 0.3, ..with(AmbientOcclusion::Bitmask, &exact(SIZE[0], SIZE[1])) };
        let few = Settings { ao_samples: 4, light_path: LightPath::Loop, ..settings };
        let many =
            |ao_samples, samples| shown(gpu, &scene, &Settings { ao_samples, samples, ..few.clone() }, View::Final);
        let distance = |one: &[[f64; 3]], other: &[[f64; 3]]| {
            let squares = one.iter().zip(other).map(|(one, other)| (one[0] - other[0]).powi(2));
            (squares.sum::<f64>() / one.len() as f64).sqrt()
        };
        let truth = many(128, 16);
        let one = many(4, 1);
        assert!(distance(&many(4, 16), &truth) < 0.7 * distance(&one, &truth));
    });
}

#[test]
fn whatever_is_asked_for_pictures_are_finite_and_between_black_and_what_they_were() {
    on_gpu(|gpu| {
        for scene in [boxes(), ambient(open("builtin:spheres"))] {
            for size in [[1, 1], [3, 5], [33, 17]] {
                for (ao, ao_radius, ao_samples, ao_resolution, preset) in [
                    (AmbientOcclusion::Bitmask, 1000.0, 4, AoResolution::Half, "lean"),
                    (AmbientOcclusion::Bitmask, 0.001, 128, AoResolution::Full, "fat"),
                    (AmbientOcclusion::Bitmask, 0.5, 1, AoResolution::Full, "lean,normal=oct16-uint"),
                    (AmbientOcclusion::Ssao, 1000.0, 1, AoResolution::Full, "float32"),
                    (AmbientOcclusion::Ssao, 0.001, 64, AoResolution::Half, "lean,normal=oct8"),
                ] {
                    let gbuffer = crate::common::stage::gbuffer(preset);
                    let settings =
                        Settings { ao, ao_radius, ao_samples, ao_resolution, gbuffer, ..own(&scene, size[0], size[1]) };
                    let found = shown(gpu, &scene, &settings, View::Ao);
                    assert!(found.iter().all(|open| (0.0..=1.0).contains(&open[0])), "{ao} {size:?}");
                }
            }
        }
    });
}

#[test]
fn off_there_is_no_pass_and_no_difference_and_what_it_cannot_go_with_is_refused() {
    on_gpu(|gpu| {
        let scene = boxes();
        let plain = Settings { light_path: LightPath::Loop, ..own(&scene, SIZE[0], SIZE[1]) };
        let passes = |settings: &Settings| {
            let mut renderer = gpu.renderer(&scene, settings);
            renderer.render(&scene.camera).expect("a frame");
            renderer.recorded_passes().to_vec()
        };
        let has_ao = |settings: &Settings| passes(settings).iter().any(|pass| pass.starts_with("ao"));
        // Other numbers without a method change nothing.
        let numbers = Settings { ao_radius: 2.0, ao_samples: 64, ao_resolution: AoResolution::Half, ..plain.clone() };
        assert!(!has_ao(&plain) && !has_ao(&numbers) && has_ao(&with(AmbientOcclusion::Bitmask, &plain)));
        assert_eq!(gpu.draw(&scene, &plain), gpu.draw(&scene, &numbers));
        // Nor where no light comes from everywhere.
        let dark = Scene { environment: Environment::default(), ..boxes() };
        let device = afterlight::frame::capabilities(&gpu.device.physical);
        let plan = |scene: &Scene, settings: &Settings| FramePlan::of(scene, settings, &device);
        let dark_plan = plan(&dark, &with(AmbientOcclusion::Bitmask, &plain)).expect("a plan");
        assert!(!dark_plan.has_ao() && dark_plan.reasons.lack_of("ambient occlusion").contains("no light comes"));
        let bitmask = with(AmbientOcclusion::Bitmask, &plain);
        for (settings, why) in [
            (Settings { light_path: LightPath::Forward, ..bitmask.clone() }, "the light path forward has none"),
            (Settings { light_path: LightPath::ForwardNaive, ..bitmask.clone() }, "forward-naive"),
            (Settings { msaa: 4, ..bitmask.clone() }, "--msaa 4"),
            (Settings { ao_radius: f32::NAN, ..bitmask.clone() }, "a radius of NaN m"),
            (Settings { ao_radius: f32::INFINITY, ..bitmask.clone() }, "a radius of inf m"),
            (Settings { ao_radius: -1.0, ..bitmask.clone() }, "a radius of -1 m"),
            (Settings { ao_radius: 0.0, ..bitmask.clone() }, "a radius of 0 m"),
            (Settings { ao_radius: 1e6, ..bitmask.clone() }, "a radius of 1000000 m"),
            (Settings { ao_samples: 0, ..bitmask.clone() }, "0 samples"),
            (Settings { ao_samples: u32::MAX, ..bitmask.clone() }, "samples of the depth buffer"),
        ] {
            let text = plan(&scene, &settings).expect_err(why).to_string();
            assert!(text.starts_with("ambient occlusion: ") && text.contains(why), "{text}");
        }
        // A plain scene that `auto` would light as it draws it gets a G-buffer.
        let bare = ambient(plane(Material { brdf: Brdf::Lambert, ..lambert(0.5) }, Vec::new()));
        let auto = Settings { light_path: LightPath::Auto, ..plain };
        assert!(plan(&bare, &auto).expect("a plan").is_forward());
        assert!(plan(&bare, &with(AmbientOcclusion::Bitmask, &auto)).expect("a plan").has_ao());
    });
}
