use glam::{DAffine3, DQuat, Vec3};
use proptest::prelude::*;

use super::*;
use crate::plan::{
    FramePlan, MANY_OBJECTS,
    samples::{self, vector},
};
use crate::scene::builtin::shapes::{self, MeshBuilder};
use crate::scene::{Keep, Material, Mesh, Object, OptionalPart, Projection, Settings};
use crate::visible::Visible;

const SIZE: [u32; 2] = [640, 360];

/// Objects of these meshes, in the materials of their numbers: one-sided, two-sided.
fn scene(objects: Vec<(MeshBuilder, usize, DAffine3)>) -> Scene {
    let two_sided = Material { two_sided: true, ..Material::default() };
    let mut scene = Scene { materials: vec![Material::default(), two_sided], ..Scene::default() };
    for (index, (mesh, material, place)) in objects.into_iter().enumerate() {
        scene.meshes.push(mesh.finish(&format!("mesh {index}")));
        scene.objects.push(Object::new(format!("object {index}"), index, material, place));
    }
    scene
}

fn world(scene: &Scene) -> (World, FramePlan) {
    let settings = Settings { size: SIZE, ..Settings::default() };
    let plan = FramePlan::of(scene, &settings, &samples::software()).expect("a plan");
    (World::of(scene, &settings, &plan, 1.0), plan)
}

fn picture(scene: &Scene, camera: &Camera) -> (World, OcclusionBuffer) {
    let (world, plan) = world(scene);
    let occluders = Occluders::of(scene, &plan, &world.objects);
    let depth = DepthMapping::of(&world, &plan, camera);
    let picture = OcclusionBuffer::of(&world, &occluders, (camera, &depth), SIZE, 0..world.objects.len());
    (world, picture)
}

/// Share of the cells that hide something.
fn covered(picture: &OcclusionBuffer) -> f64 {
    picture.hidden_from.iter().filter(|from| from.is_finite()).count() as f64 / picture.hidden_from.len() as f64
}

/// Returns the distance at which a ray first meets a mesh, if the triangle is drawn from that side.
fn hit(mesh: &Mesh, place: &DAffine3, two_sided: bool, from: DVec3, ray: DVec3, near: f64) -> Option<f64> {
    let at = |index: u32| place.transform_point3(mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3());
    let mirrored = place.matrix3.determinant() < 0.0;
    let distance = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(at);
        let normal = (b - a).cross(c - a);
        let along = normal.dot(ray);
        if along == 0.0 || (((along < 0.0) == mirrored) && !two_sided) {
            return None;
        }
        let t = normal.dot(a - from) / along;
        let point = from + ray * t;
        let inside = |p: DVec3, q: DVec3| (q - p).cross(point - p).dot(normal) >= 0.0;
        (t > near && inside(a, b) && inside(b, c) && inside(c, a)).then_some(t)
    };
    mesh.indices.as_chunks::<3>().0.iter().filter_map(distance).min_by(f64::total_cmp)
}

fn mesh(kind: usize) -> MeshBuilder {
    match kind {
        0 => shapes::cuboid([1.0, 1.0, 0.2]),
        1 => shapes::sphere(0.5, 12),
        2 => shapes::torus(0.4, 0.15, 10),
        3 => shapes::cone(0.5, 1.0, 9),
        _ => shapes::plane([1.0, 1.0]),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn what_a_ray_through_any_part_of_a_pixel_meets_first_is_not_hidden(
        objects in proptest::collection::vec((0..5usize, 0..2usize, vector(6.0), vector(3.0), [0.1..7.0, 0.1..7.0, 0.1..7.0f64], any::<bool>()), 2..24),
        position in vector(9.0), target in vector(2.0), fov in 20.0..110.0f64, parallel in any::<bool>(),
        rays in proptest::collection::vec((0.0..=1.0f64, 0.0..=1.0f64), 400),
    ) {
        prop_assume!(position.distance(target) > 0.1);
        let object = |(kind, material, at, turn, size, mirrored): (usize, usize, DVec3, DVec3, [f64; 3], bool)| {
            let size = DVec3::from(size) * if mirrored { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
            (mesh(kind), material, DAffine3::from_scale_rotation_translation(size, DQuat::from_scaled_axis(turn), at))
        };
        let scene = scene(objects.into_iter().map(object).collect());
        let projection = if parallel { Projection::orthographic(fov * 0.1) } else { Projection::perspective(fov) };
        let camera = Camera { projection, near: 0.1, ..Camera::looking_at(position, target, DVec3::Y) };
        let (world, picture) = picture(&scene, &camera);
        let hidden: Vec<bool> = world.objects.iter().map(|object| picture.hides(&object.bounds)).collect();
        let half_y = camera.half_height();
        let half_x = half_y * f64::from(SIZE[0]) / f64::from(SIZE[1]);
        for (x, y) in rays {
            let aside = camera.right() * half_x * (2.0 * x - 1.0) + camera.up() * half_y * (1.0 - 2.0 * y);
            let (from, ray) = match parallel {
                true => (position + aside, camera.forward()),
                false => (position, camera.forward() + aside),
            };
            let hits = scene.objects.iter().enumerate().filter_map(|(index, object)| {
                let two_sided = scene.materials[object.material].two_sided;
                Some((hit(&scene.meshes[object.mesh], &object.transform, two_sided, from, ray, 0.1)?, index))
            });
            let first = hits.min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, first)) = first {
                prop_assert!(!hidden[first], "object {first} is seen at {x}, {y}");
            }
            // The ray's own length along the view is 1.
            let cell = picture.view.cell(picture.view.place(from + ray)).floor().max(DVec2::ZERO);
            let (column, row) = ((cell.x as usize).min(picture.view.columns - 1), (cell.y as usize).min(picture.view.rows - 1));
            let hidden_from = picture.hidden_from[row * picture.view.columns + column];
            let distance = first.map_or(f64::INFINITY, |(distance, _)| distance);
            let is_right = hidden_from.is_infinite() || distance <= hidden_from * (1.0 + 1e-9);
            prop_assert!(is_right, "{distance} {hidden_from} at {x}, {y}");
        }
    }
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

fn camera() -> Camera {
    Camera { position: DVec3::ZERO, near: 0.1, ..Camera::default() }
}

#[test]
fn a_wall_hides_across_the_edges_of_its_triangles_and_not_past_its_outline() {
    let wall = || shapes::cuboid([6.0, 6.0, 0.5]);
    let small = || shapes::sphere(0.2, 8);
    let scene = scene(vec![
        (wall(), 0, at(0.0, 0.0, -6.0)),
        // On the diagonal of the wall's front, and beside that; before the wall; half beside it; behind the camera.
        (small(), 0, at(0.0, 0.0, -9.0)),
        (small(), 0, at(1.5, 0.7, -20.0)),
        (small(), 0, at(0.0, 0.0, -4.0)),
        (small(), 0, at(4.5, 0.0, -9.0)),
        (small(), 0, at(0.0, 0.0, 5.0)),
    ]);
    let (world, picture) = picture(&scene, &camera());
    let hidden: Vec<bool> = world.objects.iter().map(|object| picture.hides(&object.bounds)).collect();
    assert_eq!(hidden, [false, true, true, false, false, false]);
    assert!(covered(&picture) > 0.3, "{}", covered(&picture));
}

#[test]
fn only_sides_that_are_drawn_hide_and_what_has_holes_or_is_seen_through_does_not() {
    let behind = || (shapes::sphere(0.2, 8), 0, at(0.0, 0.0, -9.0));
    let turned = at(0.0, 0.0, -6.0) * DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let front = at(0.0, 0.0, -6.0) * DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let mirrored = front * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let hides = |material: usize, place: DAffine3, change: &dyn Fn(&mut Scene)| {
        let mut scene = scene(vec![(shapes::plane([6.0, 6.0]), material, place), behind()]);
        change(&mut scene);
        let (world, picture) = picture(&scene, &camera());
        picture.hides(&world.objects[1].bounds)
    };
    let same = |_: &mut Scene| {};
    assert!(hides(0, front, &same) && !hides(0, turned, &same), "a one-sided sheet");
    assert!(hides(1, front, &same) && hides(1, turned, &same), "a two-sided one");
    assert!(hides(0, mirrored, &same), "a mirrored front is a front");
    assert!(!hides(0, front, &|scene| scene.materials[0] = samples::glass()), "glass");
    let with_holes = |scene: &mut Scene| {
        scene.materials.push(samples::masked());
        samples::add_textures(scene);
        scene.objects[0].material = 2;
    };
    assert!(!hides(0, front, &with_holes), "a mask");
}

#[test]
fn meshes_that_meet_do_not_hide_across_the_gap_and_one_mesh_with_a_gap_does_not_either() {
    let quad = |mesh: &mut MeshBuilder, left: f64, right: f64| {
        let corners = [[left, -3.0], [right, -3.0], [right, 3.0], [left, 3.0]];
        mesh.quad(corners.map(|[x, y]| DVec3::new(x, y, 0.0)), shapes::WHOLE_IMAGE);
    };
    for gap in [1e-7, 1e-3, 0.0] {
        let mut both = MeshBuilder::new();
        quad(&mut both, -3.0, 0.0);
        quad(&mut both, gap, 3.0);
        let scene = scene(vec![(both, 0, at(0.0, 0.0, -6.0)), (shapes::sphere(0.2, 8), 0, at(0.0, 0.0, -9.0))]);
        let (world, picture) = picture(&scene, &camera());
        assert_eq!(picture.hides(&world.objects[1].bounds), gap == 0.0, "{gap} m");
    }
}

#[test]
fn only_large_scenes_leave_out_what_is_hidden() {
    let many = |count: usize| {
        let wall = (shapes::cuboid([6.0, 6.0, 0.5]), 0, at(0.0, 0.0, -6.0));
        let small = (1..count).map(|_| (shapes::cuboid([0.2; 3]), 0, at(0.0, 0.0, -9.0)));
        scene(std::iter::once(wall).chain(small).collect())
    };
    let occluded = |scene: &Scene, keep: Keep| {
        let settings = Settings { size: SIZE, keep, ..Settings::default() };
        let plan = FramePlan::of(scene, &settings, &samples::software()).expect("a plan");
        let visible = Visible::of(&World::of(scene, &settings, &plan, 1.0), &camera(), &plan);
        assert_eq!(visible.draws.len() + visible.occluded, scene.objects.len());
        visible.occluded
    };
    assert_eq!(occluded(&many(MANY_OBJECTS), Keep::NONE), MANY_OBJECTS - 1);
    assert_eq!(occluded(&many(MANY_OBJECTS - 1), Keep::NONE), 0);
    assert_eq!(occluded(&many(MANY_OBJECTS), Keep::NONE.with(OptionalPart::OccludedObjects)), 0);
}
