//! Points and lines are one pixel wide, where the truth has them: by every light path, in front of the camera and behind it.

use std::collections::BTreeSet;

use afterlight::frame::Picture;
use afterlight::plan::{FramePlan, PlanError};
use afterlight::scene::{
    AlphaMode, Camera, Culling, LightPath, Material, Mesh, Object, Playing, Projection, STROKE_ENDS, STROKE_VERTICES,
    Scene, Settings, stroke_indices,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec2, DVec3, Vec3};

use crate::common::compare::assert_identical;
use crate::common::gpu::{floats, nits, on_gpu, places};
use crate::common::moving::{SECONDS, moving};
use crate::common::some_of;
use crate::common::stage::{add, exact, lambert, plane, rectangle, seen, stage, sun};

const SIZE: [u32; 2] = [64, 64];

fn unlit(color: Vec3) -> Material {
    Material { base_color: color, unlit: true, ..Material::default() }
}

fn add_strokes(scene: &mut Scene, strokes: &[[DVec3; 2]], material: Material) {
    let mesh = Mesh::of_strokes("strokes", strokes);
    scene.meshes.push(mesh);
    scene.materials.push(material);
    let (mesh, material) = (scene.meshes.len() - 1, scene.materials.len() - 1);
    scene.objects.push(Object::new("strokes", mesh, material, DAffine3::IDENTITY));
}

/// The place on the plane z = 0 of a pixel's middle.
fn middle(x: u32, y: u32) -> DVec3 {
    seen(SIZE, x, y)
}

/// The pixels that show something.
fn shown(picture: &Picture) -> BTreeSet<(u32, u32)> {
    places(picture).filter(|&(x, y)| nits(picture, x, y) != DVec3::ZERO).collect()
}

#[test]
fn a_point_is_a_pixel_and_a_line_is_one_pixel_wide() {
    on_gpu(|gpu| {
        let color = Vec3::new(0.5, 0.25, 1.0);
        let across = (10..=30).map(|x| (x, 20)).collect::<BTreeSet<_>>();
        let down = (5..=9).map(|y| (50, y)).collect();
        let diagonal = (0..=10).map(|step| (40 + step, 40 + step)).collect();
        let cases = [
            ([(33, 12), (33, 12)], BTreeSet::from([(33, 12)])),
            ([(10, 20), (30, 20)], across.clone()),
            ([(30, 20), (10, 20)], across),
            ([(50, 9), (50, 5)], down),
            ([(40, 40), (50, 50)], diagonal),
        ];
        for (ends, expected) in cases {
            let mut scene = stage();
            add_strokes(&mut scene, &[ends.map(|(x, y)| middle(x, y))], unlit(color));
            let picture = gpu.draw(&scene, &exact(SIZE[0], SIZE[1]));
            assert_eq!(shown(&picture), expected, "{ends:?}");
            let (x, y) = ends[0];
            assert!((nits(&picture, x, y) - color.as_dvec3()).abs().max_element() < 1e-6, "{ends:?}");
        }
    });
}

#[test]
fn what_is_nearer_hides_a_line_and_a_line_hides_what_is_farther() {
    on_gpu(|gpu| {
        let mut scene = stage();
        add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], -1.0), unlit(Vec3::splat(0.25)), DAffine3::IDENTITY);
        // At half the distance the rectangle hides the right half of the picture.
        add(&mut scene, rectangle([0.0, -4.0], [4.0, 4.0], 1.0), unlit(Vec3::splat(0.5)), DAffine3::IDENTITY);
        add_strokes(&mut scene, &[[middle(10, 20), middle(50, 20)]], unlit(Vec3::ONE));
        let picture = gpu.draw(&scene, &exact(SIZE[0], SIZE[1]));
        let red = |x: u32, y: u32| nits(&picture, x, y).x;
        for x in 0..SIZE[0] {
            let behind = if x < 32 { 0.25 } else { 0.5 };
            let line = if (10..32).contains(&x) { 1.0 } else { behind };
            assert!((red(x, 20) - line).abs() < 1e-6 && (red(x, 21) - behind).abs() < 1e-6, "{x}: {}", red(x, 20));
        }
    });
}

/// Lines and points all around a camera that looks along -Z from z = 2: many cross its plane or lie behind it.
fn around(count: usize, random: &mut fastrand::Rng) -> Vec<[DVec3; 2]> {
    let mut place = || DVec3::new(random.f64() - 0.5, random.f64() - 0.5, random.f64() - 0.4) * 6.0;
    (0..count)
        .map(|index| {
            let first = place();
            [first, if index % 4 == 0 { first } else { place() }]
        })
        .collect()
}

/// Lit and unlit ones among a wall and a pane, some transparent.
fn crowd() -> Scene {
    let mut random = fastrand::Rng::with_seed(5);
    let mut scene = plane(lambert(0.4), vec![sun(DVec3::new(0.3, 0.8, 0.6), 2.0)]);
    scene.environment.ambient = Vec3::splat(0.1);
    scene.environment.background = Vec3::new(0.05, 0.1, 0.3);
    add_strokes(&mut scene, &around(60, &mut random), unlit(Vec3::new(1.0, 0.2, 0.1)));
    add_strokes(&mut scene, &around(60, &mut random), lambert(0.9));
    let veil = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..unlit(Vec3::new(0.1, 1.0, 0.3)) };
    add_strokes(&mut scene, &around(60, &mut random), veil.clone());
    add(&mut scene, rectangle([-0.5, -0.5], [0.2, 0.4], 0.6), veil, DAffine3::IDENTITY);
    let of_end = |end: usize| [[1.0, 0.2, 0.5, 1.0], [0.3, 1.0, 0.1, 1.0]][end];
    scene.meshes[1].colors = STROKE_ENDS.repeat(60).into_iter().map(of_end).collect();
    // A mirror turns no stroke's back to the camera.
    scene.objects[1].transform = DAffine3::from_scale(DVec3::new(-1.0, 1.2, 1.0));
    scene.objects.iter_mut().for_each(|object| object.casts_shadow = afterlight::scene::CastsShadow::No);
    scene
}

/// Share of the pixels that are off by more than a thousandth of the light there or of 0.1 nits, and the share that shows a stroke.
fn share_off(scene: &Scene, picture: &Picture, size: [u32; 2]) -> [f64; 2] {
    let options = TruthOptions { mode: Mode::Point, smith: Smith::default() };
    let view = CameraView { camera: scene.camera, size };
    let truth = Reference::new(scene).expect("a scene").render(&view, &options, &|_, _| {});
    let mut bare = scene.clone();
    bare.objects.retain(|object| !scene.meshes[object.mesh].is_strokes);
    let without = Reference::new(&bare).expect("a scene").render(&view, &options, &|_, _| {});
    let pixels = truth.radiance.len() as f64;
    let is_off = |(drawn, truth): &(&[f32], &[f64; 3])| {
        drawn.iter().zip(*truth).any(|(&drawn, &truth)| (f64::from(drawn) - truth).abs() > 1e-3 * truth.max(0.1))
    };
    let off = floats(picture).chunks_exact(4).zip(&truth.radiance).filter(is_off).count();
    let strokes = truth.radiance.iter().zip(&without.radiance).filter(|(with, without)| with != without).count();
    [off as f64 / pixels, strokes as f64 / pixels]
}

#[test]
fn every_light_path_shows_the_strokes_of_the_truth() {
    on_gpu(|gpu| {
        let size = [160, 120];
        let scene = crowd();
        let orthographic = Camera { projection: Projection::orthographic(3.0), ..scene.camera };
        let paths = LightPath::NAMES.iter().filter(|(_, path)| *path != LightPath::Visibility);
        let mut opaque = scene.clone();
        opaque.objects.retain(|object| !scene.materials[object.material].is_transparent());
        for (name, light_path) in some_of(paths.copied(), 2) {
            // It draws nothing transparent.
            let scene = if light_path == LightPath::Compute { &opaque } else { &scene };
            for camera in [scene.camera, orthographic] {
                let scene = Scene { camera, ..scene.clone() };
                let picture = gpu.draw(&scene, &Settings { light_path, ..exact(size[0], size[1]) });
                let [off, strokes] = share_off(&scene, &picture, size);
                println!("{name}: {:.2}% off, {:.1}% strokes", 100.0 * off, 100.0 * strokes);
                // Pixels on a stroke's long edges may fall to either side, as on a triangle's edges.
                assert!(strokes > 0.1 && off < 0.01 * strokes, "{name}: {off} of {strokes}");
            }
        }
    });
}

#[test]
fn a_depth_prepass_and_culling_on_the_device_change_no_stroke() {
    on_gpu(|gpu| {
        let scene = crowd();
        let plain = gpu.draw(&scene, &exact(160, 120));
        let prepass = Settings { depth_prepass: Some(true), ..exact(160, 120) };
        assert_identical(&plain, &gpu.draw(&scene, &prepass), "depth pre-pass");
        let culled = Settings { culling: Culling::Gpu, ..exact(160, 120) };
        assert_identical(&plain, &gpu.draw(&scene, &culled), "culling on the device");
    });
}

#[test]
fn extreme_strokes_are_finite_and_leave_the_others_as_they_are() {
    on_gpu(|gpu| {
        let line = [middle(10, 20), middle(30, 20)];
        let eye = DVec3::new(0.0, 0.0, 2.0);
        let picture = |strokes: &[[DVec3; 2]]| {
            let mut scene = stage();
            add_strokes(&mut scene, &[line], unlit(Vec3::ONE));
            add_strokes(&mut scene, strokes, unlit(Vec3::splat(0.5)));
            let picture = gpu.draw(&scene, &exact(SIZE[0], SIZE[1]));
            assert!(floats(&picture).iter().all(|value| value.is_finite()), "{strokes:?}");
            shown(&picture)
        };
        let alone = picture(&[[eye + DVec3::Z; 2]]);
        assert_eq!(alone.len(), 21);
        // Behind the camera, at it, and end on.
        for strokes in [[eye, eye], [eye + DVec3::Z, eye + DVec3::new(1.0, 2.0, 3.0)], [eye, eye + DVec3::Z * 9.0]] {
            assert_eq!(picture(&[strokes]), alone, "{strokes:?}");
        }
        let ahead = eye + (middle(40, 50) - eye) * 0.5;
        let end_on = [ahead, ahead + (middle(40, 50) - eye) * 100.0];
        assert_eq!(picture(&[end_on]).difference(&alone).copied().collect::<Vec<_>>(), [(40, 50)]);
        // Past the camera on its right: from the picture's middle row to the right edge, and nothing on the left.
        let past = [DVec3::new(0.0, middle(0, 40).y, 0.0), DVec3::new(0.5, 0.0, 4.0)];
        let new: Vec<_> = picture(&[past]).difference(&alone).copied().collect();
        assert!(new.iter().any(|&(x, _)| x == 63) && new.iter().all(|&(x, _)| x > 30), "{new:?}");
        for size in [1e-30, 1e9, 1e18, 1e30] {
            let far = [DVec3::new(-size, 0.3, 0.0), DVec3::new(size, 0.3, -size)];
            picture(&[far, [far[0]; 2], [far[1], eye], [DVec3::splat(size), DVec3::splat(-size)]]);
        }
    });
}

#[test]
fn a_line_is_drawn_through_the_plane_of_the_camera_where_the_truth_has_it() {
    on_gpu(|gpu| {
        for steps in 0..8 {
            // The stroke's far end is ahead, its near end beside, behind or far behind the camera.
            let behind = DVec3::new(0.4, -0.3, 2.0 + f64::from(steps * steps) * 100.0);
            let mut scene = stage();
            add_strokes(&mut scene, &[[middle(20, 10), behind]], unlit(Vec3::ONE));
            let picture = gpu.draw(&scene, &exact(SIZE[0], SIZE[1]));
            let [off, strokes] = share_off(&scene, &picture, SIZE);
            assert!(strokes > 0.002 && off <= 2.0 / 4096.0, "{steps}: {off} of {strokes}");
        }
    });
}

#[test]
fn the_light_path_that_looks_triangles_up_refuses_strokes() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(0.4), vec![sun(DVec3::Z, 1.0)]);
        add_strokes(&mut scene, &[[middle(1, 1), middle(9, 9)]], unlit(Vec3::ONE));
        let settings = Settings { light_path: LightPath::Visibility, ..exact(SIZE[0], SIZE[1]) };
        let device = afterlight::frame::capabilities(&gpu.device.physical);
        let error = FramePlan::of(&scene, &settings, &device).expect_err("refused");
        assert!(matches!(&error, PlanError::Visibility(why) if why.contains("points and lines")), "{error}");
    });
}

/// An edge of some triangles of a mesh, which move as the mesh does. Edges that meet would be equally near where they do.
fn edges(mesh: &Mesh) -> Mesh {
    let corners = mesh.indices.as_chunks::<3>().0.iter().step_by(9);
    let vertices: Vec<usize> = corners.flat_map(|own| STROKE_ENDS.map(|end| own[end] as usize)).collect();
    fn of<T: Copy>(values: &[T], vertices: &[usize]) -> Vec<T> {
        if values.is_empty() { Vec::new() } else { vertices.iter().map(|&vertex| values[vertex]).collect() }
    }
    let mut edges = mesh.clone();
    edges.positions = of(&mesh.positions, &vertices);
    edges.normals = of(&mesh.normals, &vertices);
    (edges.uvs, edges.tangents) = (of(&mesh.uvs, &vertices), of(&mesh.tangents, &vertices));
    (edges.uvs_1, edges.colors) = (of(&mesh.uvs_1, &vertices), of(&mesh.colors, &vertices));
    if let (Some(own), Some(influences)) = (&mut edges.influences, &mesh.influences) {
        let count = influences.per_vertex;
        let each = |vertex: &usize| vertex * count..(vertex + 1) * count;
        own.joints = vertices.iter().flat_map(|vertex| influences.joints[each(vertex)].to_vec()).collect();
        own.weights = vertices.iter().flat_map(|vertex| influences.weights[each(vertex)].to_vec()).collect();
    }
    for (own, morph) in edges.morphs.iter_mut().zip(&mesh.morphs) {
        own.positions = of(&morph.positions, &vertices);
        own.normals = of(&morph.normals, &vertices);
        own.tangents = of(&morph.tangents, &vertices);
        (own.uvs, own.colors) = (of(&morph.uvs, &vertices), of(&morph.colors, &vertices));
    }
    (edges.indices, edges.is_strokes) = (stroke_indices(vertices.len() / STROKE_VERTICES).collect(), true);
    edges
}

#[test]
fn lines_that_joints_and_shapes_move_are_those_of_the_truth() {
    on_gpu(|gpu| {
        let mut scene = moving(DVec3::ZERO);
        scene.lights.iter_mut().for_each(|light| light.casts_shadow = false);
        let materials = scene.materials.clone();
        scene.objects.retain(|object| !materials[object.material].is_transparent());
        for mesh in scene.meshes.iter_mut().filter(|mesh| !mesh.is_plain()) {
            *mesh = edges(mesh);
        }
        scene.materials.iter_mut().for_each(|material| material.normal_texture = None);
        scene.check().unwrap_or_else(|error| panic!("{error}"));
        let size = [160, 120];
        for time in [0.0, 0.3 * SECONDS, 0.8 * SECONDS] {
            let playing = Playing { time, looped: false, ..Playing::default() };
            let mut renderer = gpu.renderer(&scene, &exact(size[0], size[1]));
            renderer.pose(&scene, &scene.motion.pose(&playing)).unwrap_or_else(|error| panic!("{error}"));
            let picture = renderer.picture(&scene.camera, || {}).unwrap_or_else(|error| panic!("{error}"));
            let [off, strokes] = share_off(&scene.at(&playing), &picture, size);
            println!("{time}: {off} {strokes}");
            assert!(strokes > 0.003 && off < 0.05 * strokes, "{time}: {off} of {strokes}");
        }
    });
}

#[test]
fn a_stroke_lies_at_the_depth_of_its_ends_and_has_their_values() {
    on_gpu(|gpu| {
        // From black to white along the line; perspective makes its middle darker than half where the white end is nearer.
        let mut scene = stage();
        let row = middle(0, 31).y / 2.0;
        let [far, near] = [DVec3::new(-1.5, 3.0 * row, -1.0), DVec3::new(0.5, row, 1.0)];
        add_strokes(&mut scene, &[[far, near]], unlit(Vec3::ONE));
        scene.meshes[0].colors = STROKE_ENDS.map(|end| [[0.0, 0.0, 0.0, 1.0], [1.0; 4]][end]).to_vec();
        let picture = gpu.draw(&scene, &exact(SIZE[0], SIZE[1]));
        let view = CameraView { camera: scene.camera, size: SIZE };
        let reference = Reference::new(&scene).expect("a scene");
        let mut least = f64::INFINITY;
        for x in 2..62 {
            let y = 31;
            let place = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (surface, id, distance) = reference.surface(&view, place).expect("the line");
            assert_eq!((id.object, id.triangle), (0, 0));
            let share = (3.0 - distance) / 2.0;
            let drawn = nits(&picture, x, y).x;
            assert!((drawn - share).abs() < 1e-4 && (surface.emissive.x - share).abs() < 1e-9, "{x}: {drawn} {share}");
            least = least.min((drawn - 0.5).abs());
        }
        assert!(least < 0.05);
    });
}
