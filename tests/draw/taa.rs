//! Frames that are averaged over time: still frames converge to the mean of `samples`, motion vectors point to earlier positions that are computed in
//! f64, surfaces that come into view are not mixed with the surfaces that hid them, and nothing is left after a cut.

use afterlight::frame::{Changed, Error, FRAMES_A_SECOND, JitterSequence, Renderer};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Camera, Channel, ChannelTarget, Clip, ColorSpace, Culling, Interpolation, LightPath, Local, Material,
    Mesh, Motion, Node, Object, Output, Placement, Playing, Resolve, Scene, Settings, Texture, View,
};
use afterlight_truth::measure::{LinearImage, errors};
use glam::{DAffine3, DVec2, DVec3, Vec3};

use crate::common::gpu::{Gpu, floats, on_gpu};
use crate::common::moving::{SECONDS, moving};
use crate::common::stage::{add, exact, lambert, open, own, plane, rectangle, sun};
use crate::common::{some_of, tries_all};

fn taa(frames: u32, settings: &Settings) -> Settings {
    Settings { taa: true, taa_frames: frames, ..settings.clone() }
}

/// A picture of a scene that plays, until this time.
fn at(gpu: &Gpu, scene: &Scene, settings: &Settings, time: f64, camera: impl Fn(f64) -> Camera) -> Vec<[f64; 3]> {
    let show = |renderer: &mut Renderer, seconds: f64| {
        let playing = Playing { time: time + seconds, looped: false, ..Playing::default() };
        renderer.pose(scene, &scene.motion.pose(&playing))?;
        Ok::<_, Error>(camera(seconds))
    };
    let picture = gpu.renderer(scene, settings).picture_while(show, || ()).unwrap_or_else(|error| panic!("{error}"));
    floats(&picture).chunks_exact(4).map(|texel| [0, 1, 2].map(|channel| f64::from(texel[channel]))).collect()
}

fn still(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<[f64; 3]> {
    at(gpu, scene, settings, 0.0, |_| scene.camera)
}

fn rel_mse(size: [u32; 2], actual: &[[f64; 3]], truth: &[[f64; 3]]) -> f64 {
    let image = |pixels: &[[f64; 3]]| LinearImage { size, pixels: pixels.to_vec() };
    errors(&image(actual), &image(truth)).expect("one size").rel_mse
}

#[test]
fn a_still_picture_is_as_near_the_truth_as_one_of_as_many_samples() {
    on_gpu(|gpu| {
        let counts: &[u32] = if tries_all() { &[4, 8, 16, 32, 64] } else { &[16] };
        for spec in some_of(["assets/gallery/edges.toml", "builtin:hall"], 2) {
            let scene = open(spec);
            let size = [64, 36];
            let settings =
                Settings { output: Output::Exposed, resolve: Resolve::Linear, ..own(&scene, size[0], size[1]) };
            let truth = still(gpu, &scene, &Settings { samples: 128, ..settings.clone() });
            for &count in counts {
                let error = |own: Settings| rel_mse(size, &still(gpu, &scene, &own), &truth);
                let [own, samples] =
                    [error(taa(count, &settings)), error(Settings { samples: count, ..settings.clone() })];
                let one = error(settings.clone());
                println!("{spec}, {count}: {own:.2e}, samples {samples:.2e}, one frame {one:.2e}");
                assert!(
                    own <= 2.0 * samples && own < 0.5 * one,
                    "{spec}, {count}: {own}, samples {samples}, one {one}"
                );
            }
        }
    });
}

/// Pixels to the right and down, and the distance.
fn project(camera: &Camera, size: [u32; 2], place: DVec3) -> DVec2 {
    let [width, height] = size.map(f64::from);
    let (offset, half) = (place - camera.position, camera.half_height());
    let w = offset.dot(camera.forward());
    let (x, y) = (offset.dot(camera.right()) / w, -offset.dot(camera.up()) / w);
    DVec2::new((x * height / width / half + 1.0) * width / 2.0, (y / half + 1.0) * height / 2.0)
}

fn ray(camera: &Camera, size: [u32; 2], pixel: DVec2) -> DVec3 {
    let [width, height] = size.map(f64::from);
    let (x, y) = (pixel.x * 2.0 / width - 1.0, pixel.y * 2.0 / height - 1.0);
    let half = camera.half_height();
    camera.forward() + camera.right() * (x * half * width / height) - camera.up() * (y * half)
}

/// Returns the world-space corners of all opaque triangles, and true for triangles that move by themselves.
fn triangles(scene: &Scene, still: &Scene) -> Vec<([DVec3; 3], bool)> {
    let mut all = Vec::new();
    for (object, posed) in scene.objects.iter().zip(&still.objects) {
        if scene.materials[object.material].is_transparent() {
            continue;
        }
        let mesh = &still.meshes[posed.mesh];
        let corner = |index: u32| {
            let place = mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3();
            posed.transform.transform_point3(place)
        };
        let own =
            mesh.indices.chunks_exact(3).map(|own| ([corner(own[0]), corner(own[1]), corner(own[2])], object.moves()));
        all.extend(own);
    }
    all
}

/// The triangle that a ray meets first, and where on it: the shares of its second and third corner.
fn hit(triangles: &[([DVec3; 3], bool)], eye: DVec3, ray: DVec3) -> Option<(usize, [f64; 2])> {
    let mut nearest = (f64::INFINITY, None);
    for (index, ([a, b, c], _)) in triangles.iter().enumerate() {
        let (ab, ac) = (b - a, c - a);
        let p = ray.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 {
            continue;
        }
        let from = eye - a;
        let u = from.dot(p) / determinant;
        let q = from.cross(ab);
        let (v, t) = (ray.dot(q) / determinant, ac.dot(q) / determinant);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < nearest.0 {
            nearest = (t, Some((index, [u, v])));
        }
    }
    nearest.1
}

/// Joints, shapes, nodes and the camera all move.
#[test]
fn vectors_are_from_where_surfaces_were() {
    on_gpu(|gpu| {
        let size = [80, 60];
        for place in [DVec3::ZERO, DVec3::new(3e5, 20.0, -1e5)] {
            let scene = moving(place);
            let camera =
                |seconds: f64| Camera { position: scene.camera.position + DVec3::X * 0.5 * seconds, ..scene.camera };
            for time in [0.3, 0.5 * SECONDS] {
                let settings = Settings { view: View::Velocity, ..exact(size[0], size[1]) };
                let found = at(gpu, &scene, &settings, time, camera);
                let posed = |time| triangles(&scene, &scene.at(&Playing { time, looped: false, ..Playing::default() }));
                let (now, before) = (posed(time), posed(time - 1.0 / FRAMES_A_SECOND));
                let [jitter_x, jitter_y] = JitterSequence::of(2).offset(1);
                let (mut differences, mut longest) = (Vec::new(), 0.0f64);
                for (index, found) in found.iter().enumerate() {
                    let (x, y) = (index as u32 % size[0], index as u32 / size[0]);
                    let pixel = DVec2::new(f64::from(x) + 0.5 + jitter_x, f64::from(y) + 0.5 + jitter_y);
                    let eye = camera(0.0);
                    let Some((triangle, [u, v])) = hit(&now, eye.position, ray(&eye, size, pixel)) else { continue };
                    let ([a, b, c], moves) = before[triangle];
                    let was = a + (b - a) * u + (c - a) * v;
                    let come = pixel - project(&camera(-1.0 / FRAMES_A_SECOND), size, was);
                    let difference = (DVec2::new(found[0], found[1]) - come).length();
                    // Behind glass as well; at an edge the raster may see the other surface.
                    differences.push(if (found[2] > 0.5) == moves { difference } else { f64::INFINITY });
                    longest = longest.max(if moves { come.length() } else { 0.0 });
                }
                differences.sort_by(f64::total_cmp);
                let share = |share: f64| differences[(share * (differences.len() - 1) as f64) as usize];
                println!("{place} {time}: median {:.1e}, 99% {:.1e} of {longest:.1} pixels", share(0.5), share(0.99));
                assert!(differences.len() > 2000 && longest > 0.3);
                assert!(share(0.5) < 2e-4 && share(0.99) < 2e-3, "{place} {time}: {} {}", share(0.5), share(0.99));
            }
        }
    });
}

/// Puts one object of a scene on a node that a clip moves along X at `speed` metres a second.
fn carried(mut scene: Scene, object: usize, speed: f64) -> Scene {
    let node =
        Node { name: "carrier".into(), parent: None, local: Local::Parts(Placement::default()), weights: Vec::new() };
    let channel = Channel {
        target: ChannelTarget::Translation(0),
        times: vec![0.0, 10.0],
        values: vec![0.0, 0.0, 0.0, 10.0 * speed, 0.0, 0.0],
        interpolation: Interpolation::Linear,
    };
    scene.motion = Motion {
        nodes: vec![node],
        clips: vec![Clip { name: "slide".into(), channels: vec![channel] }],
        ..Motion::default()
    };
    scene.objects[object].node = Some(0);
    scene
}

/// Squares that are light and dark.
fn chequered(edge: u32) -> Texture {
    let texel = |index: u32| if (index % edge + index / edge).is_multiple_of(2) { 230 } else { 60 };
    Texture {
        name: "squares".into(),
        size: [edge; 2],
        color_space: ColorSpace::Linear,
        sampler: Default::default(),
        texels: (0..edge * edge).flat_map(|index| [texel(index), texel(index), texel(index), 255]).collect(),
    }
}

/// A bright plate slides over a chequered floor.
fn plate() -> Scene {
    let mut scene = plane(lambert(0.9), vec![sun(DVec3::new(0.2, 0.3, 1.0), 3.0)]);
    scene.lights[0].casts_shadow = false;
    scene.textures.push(chequered(32));
    scene.materials[0].base_color_texture = Some(0);
    let bright = Material { emissive: Vec3::splat(4.0), ..lambert(0.1) };
    add(&mut scene, rectangle([-1.1, -0.5], [-0.4, 0.5], 0.5), bright, DAffine3::IDENTITY);
    // Some two pixels of 96 a frame.
    carried(scene, 1, 3.5)
}

/// Ghosts: the mean share of the plate's light, less the ground's, that is left in pixels which the plate uncovered 0 to 5 frames ago.
#[test]
fn ghosts_are_gone_three_frames_after_what_hid_the_ground() {
    on_gpu(|gpu| {
        let scene = plate();
        let size = [96, 54];
        let settings = exact(size[0], size[1]);
        let edge = |time: f64| project(&scene.camera, size, DVec3::new(-1.1 + 3.5 * time, 0.0, 0.5)).x;
        let (mut ghosts, mut blind, mut pixels) = ([0.0; 6], [0.0; 6], [0.0; 6]);
        for step in 0..3 {
            let time = f64::from(20 + 3 * step) / FRAMES_A_SECOND;
            let moment = scene.at(&Playing { time, looped: false, ..Playing::default() });
            let truth = still(gpu, &moment, &Settings { samples: 64, ..settings.clone() });
            let found = at(gpu, &scene, &taa(12, &settings), time, |_| scene.camera);
            // The mean of as many frames, as if nobody knew of motion: each sees the plate elsewhere.
            let mut mixed = vec![0.0; truth.len()];
            for ago in 0..8 {
                let own =
                    Playing { time: time - f64::from(ago) / FRAMES_A_SECOND, looped: false, ..Playing::default() };
                let frame = still(gpu, &scene.at(&own), &settings);
                mixed.iter_mut().zip(&frame).for_each(|(sum, own)| *sum += own[0] / 8.0);
            }
            for (index, truth) in truth.iter().enumerate() {
                let (x, y) = (f64::from(index as u32 % size[0]) + 0.5, index as u32 / size[0]);
                // Well within the height of the plate, and a pixel behind its edge.
                for ago in 0..6 {
                    let frame = |ago: usize| edge(time - ago as f64 / FRAMES_A_SECOND) - 1.0;
                    if (20..34).contains(&y) && x < frame(ago) && x >= frame(ago + 1) {
                        ghosts[ago] += found[index][0] - truth[0];
                        blind[ago] += mixed[index] - truth[0];
                        pixels[ago] += 1.0;
                    }
                }
            }
        }
        // The plate emits 4 nits, and the ground reflects at most one.
        let share =
            |sums: &[f64; 6]| sums.iter().zip(&pixels).map(|(sum, count)| sum / count / 4.0).collect::<Vec<_>>();
        let (ghosts, blind) = (share(&ghosts), share(&blind));
        println!(
            "left of the plate, by frames since it has gone: {ghosts:.3?}; of a mean without vectors: {blind:.3?}"
        );
        assert!(pixels.iter().all(|count| *count > 20.0) && blind[..4].iter().all(|share| *share > 0.3), "{blind:?}");
        assert!(ghosts[3..].iter().all(|share| share.abs() <= 0.01), "{ghosts:?}");
        assert!(ghosts[..3].iter().all(|share| share.abs() <= 0.05), "{ghosts:?}");
    });
}

/// Moving surfaces have vectors in exactly the pixels that show them: through holes of masks, by levels of detail, whichever processor culls, and on
/// each path.
#[test]
fn each_pixel_that_shows_what_moves_has_its_vector() {
    on_gpu(|gpu| {
        let mut scene = plane(Material::default(), Vec::new());
        scene.textures.push(Texture {
            texels: (0..64u32)
                .flat_map(|index| [255, 255, 255, if index.is_multiple_of(3) { 0 } else { 255 }])
                .collect(),
            ..chequered(8)
        });
        let mask = Material {
            base_color_texture: Some(0),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            two_sided: true,
            emissive: Vec3::ONE,
            ..lambert(0.0)
        };
        add(&mut scene, rectangle([-0.9, -0.6], [0.1, 0.6], 0.2), mask, DAffine3::from_rotation_y(0.3));
        let glow = Material { emissive: Vec3::ONE, ..lambert(0.0) };
        add(&mut scene, shapes::sphere(0.4, 24), glow, DAffine3::from_translation(DVec3::new(0.5, 0.1, 0.3)));
        // Behind it, and before it.
        add(&mut scene, rectangle([-0.1, -0.1], [0.2, 0.7], 0.9), lambert(0.5), DAffine3::IDENTITY);
        // Lines, points and both behind the others.
        let strokes: Vec<_> = (0..12)
            .map(|at| {
                let place = |x: f64| DVec3::new(x, 0.9 - 0.15 * f64::from(at), 0.1 * f64::from(at) - 0.53);
                [place(-1.2), place(if at % 3 == 0 { -1.2 } else { 1.2 })]
            })
            .collect();
        scene.meshes.push(Mesh::of_strokes("strokes", &strokes));
        scene.objects.push(Object::new("strokes", scene.meshes.len() - 1, 2, DAffine3::IDENTITY));
        let mut scene = carried(scene, 1, 1.0);
        scene.objects[2].node = Some(0);
        scene.objects[4].node = Some(0);
        // The holes stay in place whatever square of a pixel textures are filtered for, since they are magnified.
        let plain = Settings { anisotropy: 1, ..exact(71, 40) };
        for (name, settings) in [
            ("loop", Settings { light_path: LightPath::Loop, ..plain.clone() }),
            ("forward", Settings { light_path: LightPath::Forward, ..plain.clone() }),
            ("pre-pass", Settings { light_path: LightPath::Loop, depth_prepass: Some(true), ..plain.clone() }),
            ("levels", Settings { lod: 4.0, ..plain.clone() }),
            ("device culls", Settings { culling: Culling::Gpu, ..plain.clone() }),
        ] {
            let velocity = Settings { view: View::Velocity, ..settings.clone() };
            let found = at(gpu, &scene, &velocity, 0.2, |_| scene.camera);
            let mut renderer = gpu.renderer(&scene, &settings);
            let pose = scene.motion.pose(&Playing { time: 0.2, looped: false, ..Playing::default() });
            renderer.pose(&scene, &pose).expect("a pose");
            renderer.render_jittered(&scene.camera, JitterSequence::of(2).offset(1)).expect("a frame");
            let shown = renderer.read_back().expect("a picture");
            let glows: Vec<bool> = floats(&shown).chunks_exact(4).map(|texel| texel[0] > 0.5).collect();
            let count = glows.iter().filter(|glows| **glows).count();
            let lacks = glows.iter().zip(&found).filter(|(glows, found)| **glows && found[2] < 0.5).count();
            let strays = glows.iter().zip(&found).filter(|(glows, found)| !**glows && found[2] > 0.5).count();
            assert!(count > 300 && lacks + strays == 0, "{name}: {lacks} lack one and {strays} stray, of {count}");
        }
    });
}

#[test]
fn the_same_frames_give_the_same_bits_and_after_a_cut_nothing_is_left() {
    on_gpu(|gpu| {
        let scene = moving(DVec3::ZERO);
        let settings = taa(4, &exact(48, 36));
        let picture = |time: f64| at(gpu, &scene, &settings, time, |_| scene.camera);
        assert_eq!(picture(0.7), picture(0.7));
        let mut renderer = gpu.renderer(&scene, &settings);
        let draw = |renderer: &mut Renderer, camera: &Camera| {
            renderer.render(camera).expect("a frame");
            floats(&renderer.read_back().expect("a picture")).to_vec()
        };
        let first = draw(&mut renderer, &scene.camera);
        let second = draw(&mut renderer, &scene.camera);
        assert!(first != second);
        renderer.cut();
        assert_eq!(draw(&mut renderer, &scene.camera), first);
        assert_eq!(draw(&mut renderer, &scene.camera), second);
        renderer.update(&scene, Changed::Arrangement).expect("an update");
        assert_eq!(draw(&mut renderer, &scene.camera), first);
    });
}

/// Light of 1e4 and none side by side, cameras that jump and look the other way, things that are elsewhere in the next frame, and pictures of a pixel.
#[test]
fn no_frame_has_a_value_that_is_not_finite_or_below_nothing() {
    on_gpu(|gpu| {
        let mut scene = plate();
        scene.materials[1].emissive = Vec3::splat(1e4);
        scene.textures[0] = Texture {
            texels: (0..64u32)
                .flat_map(|index| [[0; 3], [255; 3]][index as usize % 2].into_iter().chain([255]))
                .collect(),
            ..chequered(8)
        };
        let away = Camera::looking_at(DVec3::new(1e6, -1e6, 1e6), DVec3::ZERO, DVec3::Z);
        let behind =
            Camera::looking_at(scene.camera.position, scene.camera.position + DVec3::new(0.1, 0.0, 1.0), DVec3::X);
        let inside = Camera { position: DVec3::new(0.0, 0.0, 0.51), ..scene.camera };
        for (width, height, sharpness) in [(1, 1, 1.0), (33, 20, 1.0), (2, 40, 0.0)] {
            for output in [Output::Exposed, Output::Nits] {
                let mut settings = Settings { sharpness, output, ..taa(1, &exact(width, height)) };
                settings.exposure = (output == Output::Exposed).then_some(0.0);
                let mut renderer = gpu.renderer(&scene, &settings);
                let cameras =
                    [scene.camera, scene.camera, away, behind, scene.camera, inside, scene.camera, scene.camera];
                for (frame, camera) in cameras.iter().enumerate() {
                    let time = [0.0, 0.1, 9.0, 0.2, 5.0, 0.2, 0.2, 0.2][frame];
                    let pose = scene.motion.pose(&Playing { time, looped: false, ..Playing::default() });
                    renderer.pose(&scene, &pose).expect("a pose");
                    renderer.render(camera).expect("a frame");
                    let picture = renderer.read_back().expect("a picture");
                    let fine = floats(&picture).iter().all(|value| value.is_finite() && *value >= 0.0);
                    assert!(fine, "{width}x{height} {output}, frame {frame}");
                }
            }
        }
    });
}

#[test]
fn what_does_not_go_with_it_is_refused_with_a_sentence() {
    on_gpu(|gpu| {
        let scene = plate();
        let base = taa(4, &exact(16, 16));
        let refused =
            |settings: Settings| Renderer::new(&gpu.device, &scene, &settings).err().map(|error| error.to_string());
        let said = |settings: Settings| refused(settings).expect("refused");
        assert!(said(Settings { samples: 4, ..base.clone() }).contains("choose one"));
        assert!(said(Settings { msaa: 4, ..base.clone() }).contains("one depth a pixel"));
        assert!(
            said(Settings { light_path: LightPath::Compute, ..base.clone() })
                .contains("--light-path compute cannot draw TAA")
        );
        assert_eq!(refused(base), None);
    });
}
