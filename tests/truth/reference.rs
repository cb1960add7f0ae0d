//! The truth against geometry and formulas that can be worked out by hand, and against the renderer where both must agree.

use std::f64::consts::PI;

use crate::common::gpu::{floats, nits, on_gpu, places};
use crate::common::stage::{
    EDGE, EYE, add, camera, directional, exact, lambert, open, plane, point, rectangle, seen, stage, sun,
};
use afterlight::frame::Picture;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Camera, CastsShadow, ColorSpace, Environment, Falloff, Light, LightKind, Material, Scene, Settings,
    ShadowSettings, Texture, TextureSlot,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TriangleId, Truth, TruthOptions};
use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};

const POINT: TruthOptions = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };

fn view(scene: &Scene, edge: u32) -> CameraView {
    CameraView { camera: scene.camera, size: [edge, edge] }
}

fn converged(samples: u32) -> TruthOptions {
    TruthOptions { mode: Mode::Converged { samples }, ..POINT }
}

fn render(scene: &Scene, edge: u32, options: &TruthOptions) -> Truth {
    Reference::new(scene).expect("a scene").render(&view(scene, edge), options, &|_, _| {})
}

fn at(truth: &Truth, x: u32, y: u32) -> DVec3 {
    DVec3::from_array(truth.radiance[(y * truth.size[0] + x) as usize])
}

fn middle(x: u32, y: u32) -> DVec2 {
    DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
}

fn moved(z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::Z * z)
}

#[test]
fn a_pixel_sees_the_point_where_its_ray_meets_the_box() {
    let mut scene = stage();
    // One metre deep and turned about its own axis by a right angle, so that its sides change places.
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_z(PI / 2.0), DVec3::new(0.25, 0.0, -0.5));
    add(&mut scene, shapes::cuboid([0.5, 1.0, 1.0]), lambert(0.5), turn);
    let reference = Reference::new(&scene).expect("a scene");
    let mut met = 0;
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let on_front = seen([EDGE, EDGE], x, y);
        let expected = (on_front.x - 0.25).abs() < 0.5 && on_front.y.abs() < 0.25;
        let found = reference.surface(&view(&scene, EDGE), middle(x, y));
        assert_eq!(found.is_some(), expected, "({x}, {y})");
        let Some((surface, triangle, distance)) = found else { continue };
        assert!((surface.position + EYE - on_front).length() < 1e-12, "{surface:?}");
        assert!((surface.normal - DVec3::Z).length() < 1e-12 && (distance - 2.0).abs() < 1e-12);
        assert!(triangle.object == 0 && triangle.triangle < 12);
        met += 1;
    }
    assert!(met > 100, "{met}");
}

#[test]
fn nothing_is_seen_before_the_near_plane() {
    let mut scene = stage();
    add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), lambert(0.5), DAffine3::IDENTITY);
    add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 1.9), lambert(0.5), DAffine3::IDENTITY);
    let distance = |near: f64| {
        let view = CameraView { camera: Camera { near, ..camera() }, size: [9, 9] };
        Reference::new(&scene)
            .expect("a scene")
            .surface(&view, DVec2::new(1.3, 2.2))
            .map(|(_, triangle, _)| triangle.object)
    };
    assert_eq!((distance(0.09), distance(0.11), distance(2.1)), (Some(1), Some(0), None));
}

#[test]
fn back_faces_of_one_sided_materials_are_not_seen_and_mirrors_turn_them_over() {
    for (mirrored, turned, two_sided, expected) in [
        (false, false, false, true),
        (false, true, false, false),
        (true, false, false, true),
        (true, true, false, false),
        (false, true, true, true),
        (true, true, true, true),
    ] {
        let mut transform = DAffine3::IDENTITY;
        if mirrored {
            // Mirrored at a plane that the rectangle stands on, it still faces the eye.
            transform = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * transform;
        }
        if turned {
            transform = DAffine3::from_rotation_y(PI) * transform;
        }
        let mut scene = stage();
        let material = Material { two_sided, ..lambert(0.5) };
        add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), material, transform);
        let found = Reference::new(&scene).expect("a scene").surface(&view(&scene, 9), DVec2::new(3.3, 4.4));
        let what = format!("mirrored {mirrored}, turned {turned}, two-sided {two_sided}");
        assert_eq!(found.is_some(), expected, "{what}");
        if let Some((surface, ..)) = found {
            assert!((surface.normal - DVec3::Z).length() < 1e-12, "{what}: {}", surface.normal);
        }
    }
}

/// A material with a hole on the left half of its image.
fn sieve(scene: &mut Scene) -> Material {
    let texels = [[255, 255, 255, 0], [255, 255, 255, 255]].concat();
    let texture = Texture {
        name: "half".into(),
        size: [2, 1],
        color_space: ColorSpace::Srgb,
        sampler: Default::default(),
        texels: texels.into(),
    };
    scene.textures.push(texture);
    let base_color_texture = Some(scene.textures.len() - 1);
    Material { base_color_texture, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..lambert(0.5) }
}

#[test]
fn holes_of_masks_are_seen_through_and_let_light_through() {
    let mut scene = plane(lambert(0.5), vec![sun(DVec3::new(0.0, 0.5, 1.0), 10.0)]);
    let material = sieve(&mut scene);
    add(&mut scene, rectangle([-1.0, -1.0], [1.0, 1.0], 0.0), material, moved(1.0));
    // Alpha falls below one half in the middle, and again at the edges, where the image begins anew: from 0 to 1.
    let reference = Reference::new(&scene).expect("a scene");
    let object = |x: f64, y: f64| {
        let pixel = DVec2::new((x / 2.0 + 0.5) * 65.0, (0.5 - y / 2.0) * 65.0);
        reference.surface(&view(&scene, 65), pixel).map(|(_, triangle, _)| triangle.object)
    };
    // The sheet is half as far as the plane: a point on it at x is seen at 2x.
    assert_eq!((object(-0.04, 0.1), object(0.04, 0.1)), (Some(0), Some(1)));
    // The sheet's shadow lies half a metre lower, at the same x.
    let mut under = scene.clone();
    under.camera.position.z = 0.9;
    let reference = Reference::new(&under).expect("a scene");
    let lit = |x: f64| {
        let pixel = DVec2::new((x / 0.9 + 1.0) * 32.5, 32.5);
        reference.visibility(&view(&under, 65), pixel, 0)
    };
    assert_eq!((lit(-0.1), lit(-0.02), lit(0.02), lit(0.1)), (1.0, 1.0, 0.0, 0.0));
}

/// A globe whose faces are known: its radiance follows the cosine law, and is none where faces turn away from the light.
#[test]
fn a_sphere_under_one_light_obeys_the_cosine_law_up_to_the_terminator() {
    let mut scene = stage();
    let towards = DVec3::new(1.0, 0.3, 0.2).normalize();
    add(&mut scene, shapes::sphere(0.9, 64), lambert(0.8), DAffine3::IDENTITY);
    scene.lights = vec![sun(towards, 1000.0)];
    let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene, 65));
    let truth = reference.render(&view, &POINT, &|_, _| {});
    let (mut lit, mut dark, mut smooth) = (0, 0, 0);
    for (x, y) in (0..65).flat_map(|y| (0..65).map(move |x| (x, y))) {
        let Some((surface, triangle, _)) = reference.surface(&view, middle(x, y)) else {
            assert_eq!(at(&truth, x, y), DVec3::ZERO);
            continue;
        };
        // The corners lie on the sphere and the normals point from its centre.
        let from_centre = (surface.position + EYE).normalize();
        assert!(from_centre.dot(surface.normal) > 0.99999, "{} {}", from_centre, surface.normal);
        let mesh = &scene.meshes[0];
        let corner = |corner: usize| mesh.positions[mesh.indices[triangle.triangle as usize * 3 + corner] as usize];
        let [a, b, c] = [corner(0), corner(1), corner(2)].map(|corner| Vec3::from(corner).as_dvec3());
        let faces_light = (b - a).cross(c - a).dot(towards) > 0.0;
        let law = 1000.0 * 0.8f32 as f64 / PI * surface.normal.dot(towards).max(0.0);
        let found = at(&truth, x, y).x;
        if faces_light {
            assert!((found - law).abs() <= 1e-9 * law.max(1.0), "({x}, {y}): {found}, by the law {law}");
            lit += usize::from(law > 0.0);
        } else {
            assert_eq!(found, 0.0, "({x}, {y}): a face that is turned away is dark");
            dark += 1;
            smooth += usize::from(law > 0.0);
        }
    }
    assert!(lit > 500 && dark > 500 && smooth > 5, "{lit} {dark} {smooth}");
}

/// Light at a hundredth of a degree above a wavy ground far from the origin: nothing shadows itself.
#[test]
fn grazing_light_makes_no_acne_at_any_coordinates() {
    for far in [0.0, 1e3, 1e7] {
        for scale in [1e-3, 1.0, 1e4] {
            let mut scene = stage();
            let place = DVec3::new(far, -2.0 * far, 3.0 * far);
            let placed = DAffine3::from_scale_rotation_translation(
                DVec3::splat(scale),
                DQuat::from_rotation_x(0.4) * DQuat::from_rotation_y(0.3),
                place,
            );
            let mut ground = shapes::MeshBuilder::new();
            ground.grid_smooth([40, 40], |u, v| (DVec3::new(u - 0.5, v - 0.5, 0.0) * 6.0, DVec2::new(u, v)));
            add(&mut scene, ground, Material { two_sided: true, ..lambert(0.5) }, placed);
            let angle = 0.01f64.to_radians();
            let towards = placed.matrix3 * DVec3::new(angle.cos(), 0.2 * angle.cos(), angle.sin());
            scene.lights = vec![sun(towards.normalize(), 1.0)];
            scene.camera.position = placed.transform_point3(EYE);
            scene.camera.rotation = DQuat::from_rotation_x(0.4) * DQuat::from_rotation_y(0.3);
            scene.camera.near = scale * 0.1;
            let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene, 41));
            for (x, y) in (0..41).flat_map(|y| (0..41).map(move |x| (x, y))) {
                let share = reference.visibility(&view, middle(x, y), 0);
                assert_eq!(share, 1.0, "far {far}, scale {scale}: acne at ({x}, {y})");
            }
        }
    }
}

/// The share of a unit disc's area at one side of a straight line, `height` above its centre.
fn disc_beyond(height: f64) -> f64 {
    let h = height.clamp(-1.0, 1.0);
    (h.acos() - h * (1.0 - h * h).sqrt()) / PI
}

#[test]
fn a_penumbra_is_the_visible_share_of_the_disc() {
    let height = 3.0;
    let degrees: f64 = 8.0;
    let sun = Light { size: degrees, ..sun(DVec3::Z, 1.0) };
    let lamp = Light { size: 0.4, casts_shadow: true, ..point(DVec3::Z * 9.0, 1.0, None, Falloff::InverseSquare) };
    for (name, light) in [("sun", sun), ("lamp", lamp)] {
        let mut scene = plane(lambert(0.5), vec![light]);
        // Above the eye, so that it is not in the picture; the half-plane x < 0.
        add(&mut scene, rectangle([-40.0, -40.0], [0.0, 40.0], height), lambert(0.5), DAffine3::IDENTITY);
        let lamp_is = name == "lamp";
        let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene, 65));
        let mut partly = 0;
        for x in 0..65 {
            let place = seen([65, 65], x, 32).x;
            // The line of the disc where the edge lies, in radii: by similar triangles for the lamp.
            let line = match lamp_is {
                true => place * (9.0 - height) / height / 0.4,
                false => place / (height * (degrees * 0.5).to_radians().tan()),
            };
            let expected = disc_beyond(-line);
            let found = reference.visibility(&view, middle(x, 32), 0);
            // From off the axis the lamp's disc is turned to the receiver: seen a little narrower.
            assert!((found - expected).abs() < 0.04, "{name} at {place}: {found}, by geometry {expected}");
            partly += usize::from((0.05..0.95).contains(&expected));
        }
        assert!(partly > 5, "{name}: {partly}");
    }
}

/// Form factor of a rectangle above a point of a plane that is parallel to it: `low` and `high` are its corners as seen from the point,
/// over its height (Howell's catalogue of configuration factors, a differential element below a rectangle's corner).
fn form_factor(low: DVec2, high: DVec2) -> f64 {
    let half = |a: f64, b: f64| {
        let root = (1.0 + a * a).sqrt();
        a / root * (b / root).atan()
    };
    let corner = |a: f64, b: f64| (half(a, b) + half(b, a)) / (2.0 * PI);
    corner(high.x, high.y) - corner(low.x, high.y) - corner(high.x, low.y) + corner(low.x, low.y)
}

/// An even sky of many suns, each of which brings as much light to the plane.
#[test]
fn a_rectangle_takes_its_form_factor_from_the_light_of_a_sky() {
    let count = 8192;
    let suns = (0..count).map(|index| {
        // Even over the unit disc below the half-sphere (Nusselt), as a sunflower's seeds.
        let (place, angle) = (f64::from(index) + 0.5, f64::from(index) * PI * (3.0 - 5f64.sqrt()));
        let across = DVec2::from_angle(angle) * (place / f64::from(count)).sqrt();
        let up = (1.0 - across.length_squared()).sqrt();
        sun(across.extend(up), (PI / (up * f64::from(count))) as f32)
    });
    let mut scene = plane(lambert(1.0), suns.collect());
    let (low, high, height) = (DVec2::new(-1.0, -2.0), DVec2::new(2.5, 0.5), 3.0);
    assert!((form_factor(DVec2::splat(-1e9), DVec2::splat(1e9)) - 1.0).abs() < 1e-8);
    // Above the eye, so that it is not in the picture.
    add(&mut scene, rectangle(low.to_array(), high.to_array(), height), lambert(0.5), DAffine3::IDENTITY);
    let (edge, mut most) = (7, 0.0f64);
    let truth = render(&scene, edge, &POINT);
    for (x, y) in (0..edge).flat_map(|y| (0..edge).map(move |x| (x, y))) {
        let below = seen([edge, edge], x, y).truncate();
        let taken = form_factor((low - below) / height, (high - below) / height);
        // No points do better than their number to the power of -3/4 at straight edges (Beck 1987), independent ones -1/2: 0.005.
        let off = at(&truth, x, y).x - (1.0 - taken);
        assert!(off.abs() < 2.0 * f64::from(count).powf(-0.75), "({x}, {y}): off by {off} of {taken}");
        most = most.max(taken);
    }
    assert!(most > 0.15, "{most}");
}

#[test]
fn a_tilted_plane_sees_sky_and_ground_by_their_form_factors() {
    let (sky, ground) = (Vec3::new(3.0, 2.0, 1.0), Vec3::new(0.25, 0.5, 4.0));
    for degrees in [-60.0f64, -20.0, 0.0, 35.0, 80.0] {
        let turn = DAffine3::from_rotation_x(degrees.to_radians());
        let mut scene = stage();
        add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.0), lambert(0.5), turn);
        scene.environment = Environment { ambient: sky, ground: Some(ground), ..Environment::default() };
        // The cosine of its normal against straight up.
        let cosine = (turn.matrix3 * DVec3::Z).y;
        let expected = (sky.as_dvec3() * (1.0 + cosine) / 2.0 + ground.as_dvec3() * (1.0 - cosine) / 2.0) * 0.5;
        let found = at(&render(&scene, EDGE, &POINT), EDGE / 2, EDGE / 2);
        assert!((found - expected).length() < 1e-7, "{degrees}: {found}, by form factors {expected}");
    }
}

/// Each pixel of a converged picture is the mean over its square: across a penumbra, and along it nothing changes.
#[test]
fn a_converged_penumbra_is_within_its_standard_error() {
    let (height, degrees) = (3.0, 8.0f64);
    let mut scene = plane(lambert(1.0), vec![Light { size: degrees, ..sun(DVec3::Z, PI as f32) }]);
    add(&mut scene, rectangle([-40.0, -40.0], [0.0, 40.0], height), lambert(0.5), DAffine3::IDENTITY);
    let truth = render(&scene, 33, &converged(256));
    let errors = truth.standard_error.as_ref().expect("several samples");
    let (mut squares, mut count) = (0.0, 0);
    for (x, y) in (0..33).flat_map(|y| (0..33).map(move |x| (x, y))) {
        let steps = 200;
        let shares = (0..steps).map(|step| {
            let across = (f64::from(x) + (f64::from(step) + 0.5) / f64::from(steps)) * 2.0 / 33.0 - 1.0;
            disc_beyond(-across / (height * (degrees * 0.5).to_radians().tan()))
        });
        let expected = shares.sum::<f64>() / f64::from(steps) * f64::from(PI as f32) / PI;
        let error = errors[(y * 33 + x) as usize][0];
        let off = at(&truth, x, y).x - expected;
        // The spread of a share that few samples meet is not known.
        assert!(off.abs() <= 4.0 * error + 4.0 / 256.0, "({x}, {y}): off by {off}, standard error {error}");
        if error > 1e-3 {
            (squares, count) = (squares + (off / error).powi(2), count + 1);
        }
    }
    let z = (squares / f64::from(count)).sqrt();
    // The sequence does better than independent samples, of which this would be 1.
    assert!(count > 50 && z < 0.7, "{count} pixels, {z}");
}

#[test]
fn the_coverage_of_an_edge_converges_to_its_area() {
    let mut scene = stage();
    let glow = Material { emissive: Vec3::ONE, ..lambert(0.0) };
    let turn = DAffine3::from_rotation_z(0.3);
    add(&mut scene, rectangle([-4.0, -4.0], [0.0, 4.0], 0.0), glow, turn);
    // Pixels of 2/33 metres; the covered share of each by a fine grid, whose own error is below 1e-4.
    let truth = render(&scene, 33, &converged(512));
    let errors = truth.standard_error.as_ref().expect("several samples");
    let normal = turn.matrix3 * DVec3::X;
    let (mut worst, mut cut, mut squares) = (0.0f64, 0, 0.0);
    for (x, y) in (0..33).flat_map(|y| (0..33).map(move |x| (x, y))) {
        let grid = 200;
        let inside = (0..grid * grid).filter(|index| {
            let inner = DVec2::new(f64::from(index % grid) + 0.5, f64::from(index / grid) + 0.5) / f64::from(grid);
            let place = (DVec2::new(f64::from(x), f64::from(y)) + inner) * 2.0 / 33.0 - 1.0;
            DVec3::new(place.x, -place.y, 0.0).dot(normal) < 0.0
        });
        let expected = inside.count() as f64 / f64::from(grid * grid);
        let (off, error) = (at(&truth, x, y).x - expected, errors[(y * 33 + x) as usize][0]);
        assert!(off.abs() <= 3.0 * error + 4.0 / 512.0, "({x}, {y}): off by {off}, standard error {error}");
        if error > 0.0 {
            (worst, cut, squares) = (worst.max(off.abs()), cut + 1, squares + (off / error).powi(2));
        }
    }
    assert!(cut > 30 && worst < 0.02, "{cut} {worst}");
    let z = (squares / f64::from(cut)).sqrt();
    assert!(z < 0.6, "{z}: the error of spread samples is below that of independent ones");
}

#[test]
fn panes_are_laid_over_one_another_from_back_to_front() {
    let colors = [Vec3::new(1.0, 0.2, 0.1), Vec3::new(0.1, 0.9, 0.3), Vec3::new(0.2, 0.3, 1.0), Vec3::splat(0.7)];
    let heights = [0.9, -0.2, 0.4, 0.1];
    let mut scene = plane(Material { emissive: Vec3::splat(2.0), ..lambert(0.0) }, Vec::new());
    for (color, height) in colors.into_iter().zip(heights) {
        let pane = Material { emissive: color, alpha: 0.3, alpha_mode: AlphaMode::Blend, ..lambert(0.0) };
        add(&mut scene, rectangle([-2.0, -2.0], [2.0, 2.0], height), pane, DAffine3::IDENTITY);
    }
    // The one behind the plane is not seen; the others by their height. The middle lies on the panes' diagonals.
    let expected = [3, 2, 0].iter().fold(DVec3::splat(2.0), |behind, &pane| {
        let alpha = f64::from(0.3f32);
        colors[pane].as_dvec3() * alpha + behind * (1.0 - alpha)
    });
    let truth = render(&scene, EDGE, &POINT);
    for (x, y) in [(16, 16), (3, 3), (20, 12), (0, 32), (31, 2)] {
        let found = at(&truth, x, y);
        assert!((found - expected).length() < 1e-12, "({x}, {y}): {found}, by the formula {expected}");
    }
}

#[test]
fn transparent_objects_and_those_that_cast_none_leave_no_shadow() {
    // The sheet is turned away from the light, so that only its back stands in it.
    for (casts, alpha_mode, turned, expected) in [
        (CastsShadow::Yes, AlphaMode::Opaque, false, 0.0),
        (CastsShadow::Yes, AlphaMode::Opaque, true, 0.0),
        (CastsShadow::Front, AlphaMode::Opaque, false, 0.0),
        (CastsShadow::Front, AlphaMode::Opaque, true, 1.0),
        (CastsShadow::No, AlphaMode::Opaque, false, 1.0),
        (CastsShadow::Yes, AlphaMode::Blend, false, 1.0),
        (CastsShadow::Yes, AlphaMode::Glass, false, 1.0),
    ] {
        for light in [
            sun(DVec3::Z, 1.0),
            Light { casts_shadow: true, ..point(DVec3::Z * 9.0, 1.0, None, Falloff::InverseSquare) },
        ] {
            let mut scene = plane(lambert(0.5), vec![light]);
            let material = Material { alpha_mode, alpha: 0.5, ..lambert(0.5) };
            let turn = DAffine3::from_rotation_y(if turned { PI } else { 0.0 });
            add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), material, moved(3.0) * turn);
            scene.objects[1].casts_shadow = casts;
            let found = Reference::new(&scene).expect("a scene").visibility(&view(&scene, 9), DVec2::new(3.3, 2.2), 0);
            assert_eq!(found, expected, "{casts:?} {alpha_mode:?} turned {turned}");
        }
    }
    // An object beyond a lamp casts no shadow of it, and a surface that receives no shadow gets its light.
    let lamp = Light { casts_shadow: true, ..point(DVec3::Z * 2.5, 1.0, None, Falloff::InverseSquare) };
    let mut scene = plane(lambert(0.5), vec![lamp]);
    add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 3.0), lambert(0.5), DAffine3::IDENTITY);
    assert_eq!(Reference::new(&scene).expect("a scene").visibility(&view(&scene, 9), DVec2::new(3.3, 2.2), 0), 1.0);
    scene.lights[0] = sun(DVec3::Z, 1.0);
    assert_eq!(at(&render(&scene, 9, &POINT), 4, 4), DVec3::ZERO);
    scene.objects[0].receives_shadow = false;
    assert!(at(&render(&scene, 9, &POINT), 4, 4).x > 0.1);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = open("builtin:hall");
    let view = CameraView { camera: scene.camera, size: [40, 24] };
    let reference = Reference::new(&scene).expect("a scene");
    for options in [POINT, converged(5)] {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| reference.render(&view, &options, &|_, _| {}))
        };
        assert!(on(1) == on(3), "{options:?}");
    }
}

/// Pixels around which the truth sees one triangle: the rasterizer, which snaps corners to 1/256 pixel, sees the same there.
fn agreed(reference: &Reference, view: &CameraView, x: u32, y: u32) -> Option<TriangleId> {
    let offset = 0.02;
    let around = [[0.0, 0.0], [offset, offset], [-offset, offset], [offset, -offset], [-offset, -offset]];
    let mut seen = around.into_iter().map(|offset| {
        reference.surface(view, middle(x, y) + DVec2::from_array(offset)).map(|(_, triangle, _)| triangle)
    });
    let first = seen.next()??;
    seen.all(|triangle| triangle == Some(first)).then_some(first)
}

/// Differences relative to the truth, in order, of all pixels on which both see the same.
fn differences(scene: &Scene, picture: &Picture) -> Vec<f64> {
    let view = CameraView { camera: scene.camera, size: picture.size };
    let reference = Reference::new(scene).expect("a scene").with_shadows(false);
    let truth = reference.render(&view, &POINT, &|_, _| {});
    let same = places(picture).filter(|&(x, y)| agreed(&reference, &view, x, y).is_some());
    let off =
        same.map(|(x, y)| (nits(picture, x, y) - at(&truth, x, y)).length() / at(&truth, x, y).length().max(1e-30));
    let mut off: Vec<f64> = off.collect();
    off.sort_by(f64::total_cmp);
    off
}

/// Scenes without textures, whose filtering differs on purpose.
#[test]
fn the_renderer_in_32_bits_is_near_the_truth_where_both_see_the_same_triangle() {
    on_gpu(|gpu| {
        let built_in = ["builtin:cornell", "builtin:spheres", "builtin:layers", "builtin:field?objects=200&lights=16"];
        for spec in built_in.into_iter().chain(["assets/gallery/beam.toml"]) {
            let mut scene = open(spec);
            scene.textures.clear();
            for material in &mut scene.materials {
                TextureSlot::ALL.into_iter().for_each(|slot| *material.texture_mut(slot) = None);
            }
            let shadows = ShadowSettings { enabled: false, ..ShadowSettings::default() };
            let settings = Settings { shadows, ..exact(160, 90) };
            let picture = gpu.draw(&scene, &settings);
            assert!(floats(&picture).iter().all(|value| value.is_finite()));
            let off = differences(&scene, &picture);
            let share = |part: f64| off[((off.len() - 1) as f64 * part) as usize];
            println!(
                "{spec}: {} pixels, median {:.1e}, 99% {:.1e}, worst {:.1e}",
                off.len(),
                share(0.5),
                share(0.99),
                share(1.0)
            );
            assert!(off.len() > 160 * 90 / 3, "{spec}: only {} pixels", off.len());
            assert!(share(0.5) < 2e-6 && share(0.99) < 2e-5, "{spec}: median {} 99% {}", share(0.5), share(0.99));
        }
    });
}

#[test]
fn the_background_is_seen_where_nothing_is() {
    let mut scene = stage();
    scene.environment = Environment { background: Vec3::new(1.0, 2.0, 3.0), ..Environment::default() };
    let truth = render(&scene, 4, &POINT);
    assert!(truth.radiance.iter().all(|&radiance| radiance == [1.0, 2.0, 3.0]));
    assert_eq!(truth.triangles, Some(vec![None; 16]));
    // Lights in an empty scene, and lights without power, change nothing.
    scene.lights = vec![directional(DVec3::Z, 5.0)];
    assert!(matches!(scene.lights[0].kind, LightKind::Directional { .. }));
    assert_eq!(render(&scene, 4, &POINT), truth);
}
