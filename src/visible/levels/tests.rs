use glam::DMat3;
use proptest::prelude::*;

use super::*;
use crate::plan::{GeometryKey, samples};
use crate::scene::builtin::shapes;
use crate::scene::{Culling, Light, Material, Mesh, Object, Projection, Scene, Settings, View};
use crate::visible::{MapDraw, ShadowCache};

fn ball() -> Mesh {
    shapes::sphere(0.5, 48).finish("ball")
}

/// Balls and a square, at these places.
fn balls(places: &[DVec3], lights: Vec<Light>) -> Scene {
    let mut scene = samples::scene(vec![Material::default()], lights);
    scene.meshes.push(ball());
    for &place in places {
        scene.objects.push(Object::new("ball", 1, 0, DAffine3::from_translation(place)));
    }
    scene
}

fn world(scene: &Scene, lod: f32) -> (World, FramePlan) {
    let settings = Settings { lod, ..Settings::default() };
    let plan = samples::plan(scene, &settings);
    (World::of(scene, &settings, &plan, 1.0), plan)
}

fn row(count: usize) -> Vec<DVec3> {
    (0..count).map(|index| DVec3::new(0.01 * index as f64, 0.0, -1.0 - (index as f64).powi(2))).collect()
}

#[test]
fn farther_objects_have_coarser_levels_that_are_off_by_no_more_pixels_than_allowed() {
    let scene = balls(&row(40), vec![]);
    let camera = scene.camera;
    let mut before = None;
    for lod in [0.25, 1.0, 4.0] {
        let (world, plan) = world(&scene, lod);
        let choice = LevelChoice::of(&world, &camera, &plan).expect("levels");
        let pixels_a_radian = f64::from(plan.size[1]) / (2.0 * camera.half_height());
        let chosen: Vec<u8> = world.objects.iter().skip(1).map(|own| choice.level(&world, own)).collect();
        assert!(chosen.windows(2).all(|pair| pair[0] <= pair[1]), "{chosen:?}");
        let last = world.levels_of(&world.objects[1]).len() as u8;
        assert!(chosen[0] < chosen[39] && chosen[39] == last, "{chosen:?}");
        for (object, &level) in world.objects.iter().skip(1).zip(&chosen) {
            let nearest = camera.position.distance(camera.position.clamp(object.bounds.min, object.bounds.max));
            let error = |level: u8| match level {
                0 => 0.0,
                level => world.levels_of(object)[usize::from(level) - 1].error * pixels_a_radian / nearest,
            };
            assert!(error(level) <= f64::from(lod), "{} pixels", error(level));
            assert!(level == last || error(level + 1) > f64::from(lod), "a coarser one is allowed");
        }
        if let Some(before) = before.replace(chosen.clone()) {
            assert!(before.iter().zip(&chosen).all(|(fine, coarse)| fine <= coarse));
        }
    }
}

#[test]
fn the_choice_does_not_depend_on_how_the_camera_is_turned_and_not_on_distance_in_parallel_rays() {
    let scene = balls(&row(20), vec![]);
    let (world, plan) = world(&scene, 1.0);
    let levels = |camera: &Camera| -> Vec<u8> {
        let choice = LevelChoice::of(&world, camera, &plan).expect("levels");
        world.objects.iter().map(|own| choice.level(&world, own)).collect()
    };
    let camera = scene.camera;
    let turned = Camera { rotation: glam::DQuat::from_rotation_y(2.0) * camera.rotation, ..camera };
    assert_eq!(levels(&camera), levels(&turned));
    let parallel = levels(&Camera { projection: Projection::orthographic(200.0), ..camera });
    assert!(parallel[1] > 0 && parallel[1..].iter().all(|&level| level == parallel[1]), "{parallel:?}");
}

proptest! {
    #[test]
    fn no_length_grows_by_more_than_the_largest_scale(
        columns in [samples::vector(3.0), samples::vector(3.0), samples::vector(3.0)], to in samples::vector(1.0), sizes in samples::vector(5.0),
    ) {
        prop_assume!(to.length() > 1e-3);
        let map = |matrix3| DAffine3 { matrix3, ..DAffine3::IDENTITY };
        let sheared = map(DMat3::from_cols_array_2d(&columns.map(|own| own.to_array())));
        let grown = sheared.transform_vector3(to).length() / to.length();
        prop_assert!(grown <= largest_scale(&sheared) * (1.0 + 1e-12));
        let turned = DMat3::from_quat(glam::DQuat::from_axis_angle(to.normalize(), 1.0));
        let plain = largest_scale(&map(turned * DMat3::from_diagonal(sizes)));
        prop_assert!((plain - sizes.abs().max_element()).abs() <= 1e-9);
    }
}

#[test]
fn a_larger_copy_of_an_object_has_the_level_of_a_nearer_one() {
    let mut scene = balls(&[DVec3::Z * -40.0, DVec3::Z * -40.0], vec![]);
    scene.objects[2].transform.matrix3 *= 8.0;
    let (world, plan) = world(&scene, 1.0);
    let choice = LevelChoice::of(&world, &scene.camera, &plan).expect("levels");
    let level = |index: usize| choice.level(&world, &world.objects[index]);
    assert!(level(2) < level(1), "{} {}", level(1), level(2));
}

#[test]
fn commands_draw_each_object_that_is_seen_once_with_its_level() {
    let places: Vec<DVec3> = (0..300)
        .map(|index| DVec3::new((index % 7) as f64 - 3.0, (index % 5) as f64 - 2.0, -0.7 * index as f64))
        .collect();
    let scene = balls(&places, vec![]);
    let camera = scene.camera;
    let seen = |lod: f32| {
        let (world, plan) = world(&scene, lod);
        (Visible::of(&world, &camera, &plan), world)
    };
    let ((whole, _), (visible, world)) = (seen(0.0), seen(1.0));
    let sorted = |visible: &Visible| {
        let mut all = visible.instances.clone();
        all.sort();
        all
    };
    assert!(whole.levels.is_none() && whole.draws.iter().all(|draw| draw.level == 0));
    assert_eq!(sorted(&visible), sorted(&whole));
    let choice = visible.levels.expect("levels");
    let key = |index: u32| -> (GeometryKey, usize) {
        let object = &world.objects[index as usize];
        (object.key, object.mesh)
    };
    let mut next = 0;
    for draw in &visible.draws {
        assert_eq!(draw.first, next);
        next += draw.count;
        for &index in &visible.instances[draw.first as usize..next as usize] {
            assert_eq!(choice.level(&world, &world.objects[index as usize]), draw.level);
            assert_eq!(key(index), key(draw.object as u32));
        }
    }
    assert_eq!(next as usize, visible.instances.len());
    assert!(visible.triangles(&world) * 2 < whole.triangles(&world), "{}", visible.triangles(&world));
}

#[test]
fn a_map_is_drawn_again_when_a_caster_changes_its_level_and_no_sooner() {
    let scene = balls(&row(12), vec![samples::sun(), samples::spot(crate::scene::Falloff::InverseSquare)]);
    let (world, plan) = world(&scene, 1.0);
    let shadow = plan.shadow.as_ref().expect("maps");
    let mut cache = ShadowCache::default();
    let mut frame = |camera: &Camera| -> (Vec<MapDraw>, Visible) {
        let visible = Visible::of(&world, camera, &plan);
        let stale = cache.stale(&world, shadow, camera, &visible);
        cache.keep(&world, camera, &visible, &stale);
        (stale, visible)
    };
    let camera = scene.camera;
    let (first, visible) = frame(&camera);
    assert!(!first.is_empty());
    for map in &first {
        assert!(map.casters.iter().any(|caster| caster.level > 0) && visible.has_levels_of(&world, &map.casters));
    }
    assert!(frame(&camera).0.is_empty());
    let turned = Camera { rotation: glam::DQuat::from_rotation_z(0.3) * camera.rotation, ..camera };
    assert!(frame(&turned).0.is_empty(), "no level changes when the camera turns");
    let back = Camera { position: camera.position + DVec3::Z * 30.0, ..turned };
    let (again, visible) = frame(&back);
    assert!(!again.is_empty() && again.iter().all(|map| visible.has_levels_of(&world, &map.casters)));
}

#[test]
fn what_is_transparent_or_asked_for_by_its_triangles_is_drawn_whole() {
    let mut scene = balls(&row(3), vec![]);
    scene.objects.remove(0);
    let settings = Settings { lod: 1.0, ..Settings::default() };
    assert!(samples::plan(&scene, &settings).lod > 0.0);
    assert_eq!(samples::plan(&scene, &Settings { view: View::Triangle, ..settings.clone() }).lod, 0.0);
    scene.materials[0] = samples::glass();
    let plan = samples::plan(&scene, &settings);
    assert_eq!((plan.lod, plan.meshes.level_bytes()), (0.0, 0));
}

#[test]
fn a_plan_without_levels_has_no_trace_of_them() {
    let scene = balls(&row(3), vec![samples::sun()]);
    let plan = samples::plan(&scene, &samples::deferred());
    let indices = scene.meshes.iter().map(|mesh| mesh.indices.len() as u64).sum::<u64>();
    assert_eq!((plan.meshes.indices_16, plan.meshes.has_levels(), plan.lod), (indices, false, 0.0));
    let leveled = samples::plan(&scene, &Settings { lod: 1.0, ..samples::deferred() });
    assert_eq!(leveled.meshes.bytes(), plan.meshes.bytes() + leveled.meshes.level_bytes());
    assert!(leveled.meshes.level_bytes() > indices && leveled.meshes.vertices == plan.meshes.vertices);
}

#[test]
fn the_device_culls_where_there_are_levels() {
    let scene = balls(&row(3), vec![]);
    let asked = Settings { culling: Culling::Gpu, ..Settings::default() };
    assert!(samples::plan(&scene, &asked).culls_on_device);
    assert!(samples::plan(&scene, &Settings { lod: 1.0, ..asked }).culls_on_device);
}
